//! A folder as that of a run: what lies where, and what is there when a run begins or goes on.

use super::durable::is_temporary;
use super::{FolderError, recording, snapshot};
use crate::config::{Config, Difference, is_resolved, other_run};
use std::ffi::OsStr;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// The name of what every process of a run holds.
const LOCK: &str = "lock";

/// The name of what says what is run.
pub(super) const CONFIGURATION: &str = "run.toml";

/// How its last line begins.
const LAST_LINE: &str = "\nlog_every = ";

/// The name of what is done while it runs.
const COMMANDS: &str = "commands.jsonl";

/// The name of what tells of tiles that follow the bodies.
pub(super) const TILINGS: &str = "tilings.jsonl";

/// A folder that is, or is to be, that of a run.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct RunFolder {
    path: PathBuf,
    /// What it was given with.
    option: &'static str,
}

impl RunFolder {
    /// The folder at a path, whatever is there, which was given with an option.
    pub fn new(option: &'static str, path: &Path) -> Self {
        Self { path: path.to_owned(), option }
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The resolved configuration.
    pub fn configuration(&self) -> PathBuf {
        self.path.join(CONFIGURATION)
    }

    /// The closing figures.
    pub fn summary(&self) -> PathBuf {
        self.path.join("summary.json")
    }

    /// Figures over time.
    pub fn log(&self) -> PathBuf {
        self.path.join("log.csv")
    }

    /// Where the time of each rank went.
    pub fn timings(&self) -> PathBuf {
        self.path.join("timings.csv")
    }

    /// The tiles, where these follow the bodies.
    pub fn tilings(&self) -> PathBuf {
        self.path.join(TILINGS)
    }

    /// What was done while it ran, and is planned to be.
    pub fn commands(&self) -> PathBuf {
        self.path.join(COMMANDS)
    }

    /// The snapshots.
    pub fn snapshots(&self) -> PathBuf {
        self.path.join("snapshots")
    }

    /// What every process of a run holds.
    pub(super) fn lock(&self) -> PathBuf {
        self.path.join(LOCK)
    }

    /// What a rank records.
    pub fn rank(&self, rank: u32) -> PathBuf {
        recording::rank_folder(&self.path, rank)
    }

    /// Whether a run was begun here: the configuration is one that a run wrote.
    pub fn holds_run(&self) -> bool {
        self.read_configuration().is_ok_and(|text| is_resolved(&text))
    }

    /// The text of the configuration, which is waited for from no pipe.
    fn read_configuration(&self) -> io::Result<String> {
        let path = self.configuration();
        if path.metadata()?.is_file() {
            fs::read_to_string(path)
        } else {
            Err(io::Error::new(ErrorKind::InvalidInput, "it is no file"))
        }
    }

    /// Refuses a folder in which no run can begin, before anything is done to it.
    ///
    /// # Errors
    /// If it holds anything, unless that is a run and `overwrite` is true, or cannot be looked at.
    pub fn check_free(&self, overwrite: bool) -> Result<(), FolderError> {
        if self.holds_run() {
            let how = "name another folder, or have `atoll run` go on with that (--resume) or replace it (--overwrite)";
            return if overwrite { Ok(()) } else { Err(self.refusal(format!("it holds a run; {how}"))) };
        }
        // What was a run, and nothing else, can be replaced when its configuration is lost.
        if overwrite && self.has_lost_configuration() && self.damaged().is_some() {
            let mut names = fs::read_dir(&self.path).into_iter().flatten().flatten().map(|entry| entry.file_name());
            let other = names.find(|name| !self.owns(name)).map(|name| name.display().to_string());
            let refuse = |name| self.refusal(format!("it holds {name} as well, which is no run's; move it away"));
            return other.map_or(Ok(()), |name| Err(refuse(name)));
        }
        // Of commands the lock tells whose they are.
        let is_begun = self.lock().exists();
        let is_ours = |name: &OsStr| name == LOCK || is_begun && name == COMMANDS || self.is_unfinished(name);
        match fs::read_dir(&self.path).map(|mut all| all.all(|entry| entry.is_ok_and(|one| is_ours(&one.file_name()))))
        {
            // A run that was killed before it began leaves a little.
            Ok(true) => Ok(()),
            Ok(false) => Err(self
                .damaged()
                .unwrap_or_else(|| self.refusal("it is not empty, and what it holds is no run; name another folder"))),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
            Err(error) => Err(self.refusal(format!("{error}; name a folder"))),
        }
    }

    /// Whether a run keeps a file or a folder of that name in its folder: nobody else may write there.
    pub fn owns(&self, name: &OsStr) -> bool {
        let written = [self.configuration(), self.summary(), self.timings()];
        let fixed = [self.log(), self.tilings(), self.commands(), self.snapshots(), self.lock()];
        written.iter().chain(&fixed).any(|path| path.file_name() == Some(name))
            || name.to_str().is_some_and(recording::is_rank_folder)
            || self.is_unfinished(name)
    }

    /// Whether a file of that name in here is one that a killed run did not finish.
    fn is_unfinished(&self, name: &OsStr) -> bool {
        let written = [self.configuration(), self.commands(), self.summary(), self.timings()];
        written.iter().any(|path| is_temporary(name, path))
    }

    /// Refuses a folder in which no run was begun.
    ///
    /// # Errors
    /// If none was.
    pub fn check_begun(&self) -> Result<(), FolderError> {
        let begin = "no run was begun there; begin one with `atoll run CONFIG --out DIR`";
        if self.holds_run() { Ok(()) } else { Err(self.damaged().unwrap_or_else(|| self.refusal(begin))) }
    }

    /// That a run was begun here, by what else there is, and its configuration is not one any more.
    pub fn damaged(&self) -> Option<FolderError> {
        let is_run = self.lock().is_file()
            && (self.snapshots().is_dir() || self.log().is_file() || self.summary().is_file() || self.has_recorded());
        match self.read_configuration() {
            _ if !is_run => None,
            Ok(text) if is_resolved(&text) => None,
            Ok(text) if text.is_empty() => Some(self.bad_configuration("it is empty")),
            Ok(_) => Some(self.bad_configuration("it does not begin as runs write it")),
            Err(error) if error.kind() == ErrorKind::NotFound => {
                Some(self.refusal(format!("its {CONFIGURATION} is missing; {}", self.mend())))
            }
            Err(error) if error.kind() == ErrorKind::PermissionDenied => {
                Some(self.refusal(format!("its {CONFIGURATION} cannot be read: {error}; let it be read")))
            }
            Err(error) => Some(self.bad_configuration(&error.to_string())),
        }
    }

    fn bad_configuration(&self, reason: &str) -> FolderError {
        self.refusal(format!("its {CONFIGURATION} is damaged: {reason}; {}", self.mend()))
    }

    /// What becomes of a run without its configuration.
    fn mend(&self) -> String {
        let copies =
            if self.has_recorded() { " (each segment of the recording has its text, as atoll.config)" } else { "" };
        let anew = if self.has_lost_configuration() { ", or begin anew with --out and --overwrite" } else { "" };
        format!("bring back a good copy of it{copies}{anew}")
    }

    /// Whether there is a segment of a recording.
    fn has_recorded(&self) -> bool {
        fs::read_dir(self.rank(0))
            .is_ok_and(|all| all.flatten().any(|entry| entry.file_name().to_str().is_some_and(recording::is_segment)))
    }

    /// Whether nothing is left of the configuration that anybody can read.
    fn has_lost_configuration(&self) -> bool {
        match self.read_configuration() {
            Ok(text) => text.is_empty(),
            Err(error) => [ErrorKind::NotFound, ErrorKind::InvalidData].contains(&error.kind()),
        }
    }

    /// Whether a run was begun here, whatever became of its configuration.
    pub fn was_run(&self) -> bool {
        self.holds_run() || self.damaged().is_some()
    }

    /// The configuration of the run that was begun here.
    ///
    /// # Errors
    /// If none was, or it is damaged.
    pub fn begun(&self) -> Result<Config, FolderError> {
        self.check_begun()?;
        let is_cut = || !self.read_configuration().unwrap_or_default().contains(LAST_LINE);
        // What wrote no log yet wrote no such line.
        if self.log().is_file() && is_cut() {
            return Err(self.bad_configuration("its end is missing"));
        }
        let config = Config::load_begun(&self.configuration());
        config.map_err(|error| self.bad_configuration(&error.to_string()))
    }

    /// Refuses to go on with a run that is configured otherwise than the one here. More steps, or fewer, are no other run.
    ///
    /// # Errors
    /// Naming the first key that differs; or if no run was begun here.
    pub fn check_same_run(&self, config: &Config, tiles: [u32; 2]) -> Result<(), FolderError> {
        let begun = self.begun()?;
        other_run(&config.identity(tiles), &begun.identity(tiles_of(&begun))).map_or(Ok(()), |difference| {
            let Difference { key, ours, theirs } = difference;
            Err(self.refusal(format!("{key} = {theirs} there, and {ours} here; only how a run is spread can change")))
        })
    }

    /// That this folder cannot be used.
    pub fn refusal(&self, reason: impl ToString) -> FolderError {
        FolderError::Unusable { option: self.option, path: self.path.clone(), reason: reason.to_string() }
    }

    /// That nothing can be written or removed here.
    pub fn not_writable(&self, error: &io::Error) -> FolderError {
        FolderError::not_writable(self.option, &self.path, error)
    }

    /// Removes what a run left after `step`, as it goes on from there, but for the log, which only loses rows; everything but
    /// the configuration and the commands if there is no such step.
    ///
    /// # Errors
    /// What the system says.
    pub fn remove_after(&self, step: Option<u64>) -> io::Result<()> {
        for entry in fs::read_dir(&self.path)? {
            let entry = entry?;
            let ended = [self.summary(), self.timings()].contains(&entry.path());
            let begins_anew = step.is_none() && [self.log(), self.tilings()].contains(&entry.path());
            if ended || begins_anew || self.is_unfinished(&entry.file_name()) {
                fs::remove_file(entry.path())?;
            }
        }
        snapshot::remove_after(&self.snapshots(), step)?;
        recording::remove_after(&self.path, step)
    }
}

/// The tile grid in the configuration of a folder, where it is always given.
fn tiles_of(config: &Config) -> [u32; 2] {
    config.run.tiles.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tempfile::tempdir;

    fn config(overrides: &[(&str, &str)]) -> Config {
        let text = "[scene]\nkind = \"rooms\"\n[run]\ntiles = [2, 2]\n[output]\nrecord_every = 5\n";
        Config::from_toml_str("test", text, overrides).unwrap()
    }

    fn folder(files: &[&str]) -> (tempfile::TempDir, RunFolder) {
        let folder = tempdir().unwrap();
        let configuration = config(&[]).to_toml([2, 2]);
        files.iter().for_each(|name| fs::write(folder.path().join(name), &configuration).unwrap());
        let run = RunFolder::new("--out", folder.path());
        (folder, run)
    }

    #[test]
    fn runs_begin_in_empty_folders_and_over_runs() {
        let refused = |files: &[&str], overwrite| {
            let (_folder, run) = folder(files);
            run.check_free(overwrite).err().map(|error| error.to_string())
        };
        assert_eq!(refused(&[], false), None);
        assert_eq!(refused(&["lock", ".run.toml.123.tmp"], false), None);
        assert_eq!(refused(&["run.toml", "summary.json"], true), None);
        for (files, overwrite, expected) in [
            (&["run.toml", "lock"][..], false, "it holds a run; name another folder"),
            (&["commands.jsonl"], true, "it is not empty, and what it holds is no run"),
            (&["lock", "thesis.tex"], true, "it is not empty, and what it holds is no run"),
            (&[".thesis.tex.1.tmp"], true, "it is not empty, and what it holds is no run"),
        ] {
            let told = refused(files, overwrite).unwrap();
            assert!(told.starts_with("--out /") && told.contains(expected), "{told}");
        }
        let (_folder, run) = folder(&["file"]);
        let file = RunFolder::new("--out", &run.path().join("file"));
        // A person's own is no run.
        fs::write(run.configuration(), "[scene]\nkind = \"rooms\"\n").unwrap();
        assert!(run.check_free(true).unwrap_err().to_string().contains("what it holds is no run"));
        assert!(file.check_free(true).unwrap_err().to_string().contains("name a folder"));
    }

    #[test]
    fn what_ended_runs_left_is_removed() {
        let (folder, run) = folder(&["run.toml", "summary.json", ".summary.json.7.tmp", "notes", "lock"]);
        run.remove_after(Some(3)).unwrap();
        let mut left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        left.sort();
        assert_eq!(left, ["lock", "notes", "run.toml"]);
    }

    #[test]
    fn a_configuration_without_its_end_is_damaged() {
        let (_folder, run) = folder(&["run.toml", "log.csv"]);
        run.begun().unwrap();
        let whole = fs::read_to_string(run.configuration()).unwrap();
        fs::write(run.configuration(), whole.split_once("[output]").unwrap().0).unwrap();
        let told = run.begun().unwrap_err().to_string();
        assert!(told.contains("its run.toml is damaged: its end is missing; bring back a good copy of it"), "{told}");
    }

    #[test]
    fn another_run_is_told_by_what_differs() {
        let folder = tempdir().unwrap();
        let run = RunFolder::new("--resume", folder.path());
        let check = |overrides| run.check_same_run(&config(overrides), [2, 2]).map_err(|error| error.to_string());
        assert!(check(&[]).unwrap_err().contains("no run was begun there"));
        run.claim(None, Some(("", &config(&[]).to_toml([2, 2])))).unwrap();
        check(&[("steps", "9"), ("ranks", "2"), ("checkpoint_every", "9")]).unwrap();
        // Wherever it was begun.
        let begun = fs::read_to_string(run.configuration()).unwrap();
        fs::write(run.configuration(), begun.replace("[run]", "[run]\ntransport = \"mpi\"")).unwrap();
        check(&[("transport", "channel")]).unwrap();
        let told = check(&[("seed", "4")]).unwrap_err();
        assert!(told.contains("scene.seed = 1 there, and 4 here"), "{told}");
        let told = check(&[("record_every", "4")]).unwrap_err();
        assert!(told.contains("output.record_every = 5 there, and 4 here"), "{told}");
    }
}
