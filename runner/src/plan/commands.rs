//! What a run is told to do while it runs, and where it answers.

use crate::command::{Line, Script};
use std::collections::HashSet;
use std::path::PathBuf;

/// The usual ones are none.
#[derive(Clone, Default, Debug)]
pub(crate) struct Commands {
    /// Those of a file.
    pub(crate) given: Option<Script>,
    /// Those that the run's folder has of an earlier part of it.
    pub(crate) recorded: Option<Script>,
    /// Whether somebody tells more while it runs, and is waited for.
    pub(crate) drives: bool,
    /// Where answers are written to; `-` is standard output.
    pub(crate) answers: Option<PathBuf>,
    /// Whether what cannot be done is left out, and the run goes on.
    pub(crate) skips: bool,
}

impl Commands {
    /// Those to be done from the step on with which the run begins or goes on. What is recorded is done again, but where others
    /// were given, or somebody is there to say it again.
    pub(crate) fn to_come(&self) -> Option<&Script> {
        self.given.as_ref().or(self.recorded.as_ref().filter(|_| !self.drives))
    }

    /// The lines that were done before a run goes on `from` a step, or begins, with `done` of that step's lines; and those to come. Of a
    /// file that was given those lines of that step were done that it begins with as the recorded ones do.
    pub(crate) fn parted(&self, from: u64, done: u64) -> [Option<(&Script, &[Line])>; 2] {
        let passed = |script: &Script| script.lines.partition_point(|line| line.step < from);
        let split = |script: &Script| {
            let of_step = script.lines[passed(script)..].partition_point(|line| line.step == from);
            passed(script) + of_step.min(usize::try_from(done).unwrap_or(usize::MAX))
        };
        let before = self.recorded.as_ref().map(|script| (script, &script.lines[..split(script)]));
        let first_to_come = |script: &Script| match (&self.given, before) {
            (Some(given), Some((recorded, lines))) => {
                let were_done = recorded.texts(&lines[passed(recorded)..]);
                let both = given.texts(&given.lines[passed(given)..]).zip(were_done);
                passed(given) + both.take_while(|(text, done)| text.trim() == done.trim()).count()
            }
            _ => split(script),
        };
        [before, self.to_come().map(|script| (script, &script.lines[first_to_come(script)..]))]
    }

    /// How many lines of a file that was given are for steps before the one `from` which the run goes on, and are none of those that
    /// were done then.
    pub(crate) fn late(&self, from: u64, done: u64) -> usize {
        let Some(given) = &self.given else { return 0 };
        let before = self.parted(from, done)[0];
        let before: HashSet<&str> = before.into_iter().flat_map(|(script, lines)| script.texts(lines)).collect();
        let passed = given.lines.partition_point(|line| line.step < from);
        given.texts(&given.lines[..passed]).filter(|text| !before.contains(text)).count()
    }

    /// What the folder of a run is to say that goes on `from` a step with `done` of its lines, or begins: all that was done before,
    /// and all that is known of what is to come.
    pub(crate) fn record(&self, from: u64, done: u64) -> String {
        let texts = self.parted(from, done).into_iter().flatten().flat_map(|(script, lines)| script.texts(lines));
        texts.map(|text| format!("{text}\n")).collect()
    }

    /// What all ranks must have alike.
    #[cfg(any(test, feature = "iceoryx2", feature = "mpi"))]
    pub(crate) fn hello(&self) -> String {
        let digest = |script: &Option<Script>| script.as_ref().map(Script::digest);
        let (given, recorded) = (digest(&self.given), digest(&self.recorded));
        format!("{given:?} {recorded:?} {} {:?} {}", self.drives, self.answers, self.skips)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn a_folder_keeps_what_was_done_and_what_is_to_come() {
        let script = |steps: &[u64]| {
            let text: String = steps.iter().map(|step| format!("{{\"step\": {step}, \"wake\": 1}}\n")).collect();
            Some(Script::read(Path::new("a"), &text).unwrap())
        };
        let commands = |given, recorded, drives| Commands { given, recorded, drives, ..Commands::default() };
        let steps = |commands: &Commands, from| {
            let record = commands.record(from, 0);
            Script::read(Path::new("b"), &record).unwrap().lines.iter().map(|line| line.step).collect::<Vec<_>>()
        };
        assert_eq!(steps(&commands(script(&[9, 2]), None, false), 0), [2, 9]);
        assert_eq!(steps(&commands(None, script(&[2, 5, 9]), false), 5), [2, 5, 9]);
        // Whoever drives says again what was said for later steps; and another file says otherwise.
        assert_eq!(steps(&commands(None, script(&[2, 5, 9]), true), 5), [2]);
        let other = commands(script(&[1, 2, 7]), script(&[2, 5, 9]), false);
        assert_eq!((steps(&other, 5), other.late(5, 0)), (vec![2, 7], 1));
        // Of the step itself some may be done, and are not said again.
        let resumed = commands(None, script(&[2, 5, 5, 9]), true);
        assert_eq!([0, 1, 2, 3].map(|done| resumed.record(5, done).lines().count()), [1, 2, 3, 3]);
        // Of another file those were done that it begins with as it was; what it says instead of others is to come.
        let woken = |names: &[u64]| {
            let text: String = names.iter().map(|name| format!("{{\"step\": 5, \"wake\": {name}}}\n")).collect();
            Some(Script::read(Path::new("a"), &text).unwrap())
        };
        for (given, to_come) in [(&[1, 3][..], 1), (&[3], 1), (&[1, 2], 0), (&[1, 2, 3], 1), (&[1], 0), (&[2, 1], 2)] {
            let other = commands(woken(given), woken(&[1, 2]), false);
            assert_eq!(other.parted(5, 2)[1].unwrap().1.len(), to_come, "{given:?}");
        }
    }
}
