//! What a run is told to do while it runs, and where it answers.

use crate::command::Script;
use std::fmt::Write as _;
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

    /// What the folder of a run is to say that goes on `from` a step, or begins: all that was done before, and all that is known of
    /// what is to come.
    pub(crate) fn record(&self, from: u64) -> String {
        let mut text = String::new();
        let mut add = |script: Option<&Script>, is_meant: &dyn Fn(u64) -> bool| {
            let Some(script) = script else { return };
            let raw: Vec<&str> = script.text.lines().collect();
            for line in script.lines.iter().filter(|line| is_meant(line.step)) {
                writeln!(text, "{}", raw[line.number as usize - 1]).expect("a string takes any text");
            }
        };
        add(self.recorded.as_ref(), &|step| step < from);
        add(self.to_come(), &|step| step >= from);
        text
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
            let record = commands.record(from);
            Script::read(Path::new("b"), &record).unwrap().lines.iter().map(|line| line.step).collect::<Vec<_>>()
        };
        assert_eq!(steps(&commands(script(&[9, 2]), None, false), 0), [2, 9]);
        assert_eq!(steps(&commands(None, script(&[2, 5, 9]), false), 5), [2, 5, 9]);
        // Whoever drives says again what was said for later steps; and another file says otherwise.
        assert_eq!(steps(&commands(None, script(&[2, 5, 9]), true), 5), [2]);
        assert_eq!(steps(&commands(script(&[1, 7]), script(&[2, 5, 9]), false), 5), [2, 7]);
    }
}
