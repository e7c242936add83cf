//! The program as its user meets it: what it refuses and in which words, exit codes, files.

mod projected;
mod refused;
mod told;

use atoll_tests::program::{self, Ended};
use std::fs;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

/// Sections that make a small world, done at once.
const SMALL: &str = "[scene]\nkind = \"rooms\"\nbodies = 400\n\n[run]\nsteps = 5\ntiles = [2, 2]\n";

/// A folder with one configuration in it.
struct Desk(TempDir);

impl Desk {
    fn new(config: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("world.toml"), config).unwrap();
        Self(folder)
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    /// `atoll run world.toml`, started in the folder.
    fn atoll<'a>(&self, options: impl IntoIterator<Item = &'a str>) -> Command {
        let mut command = program::command();
        command.current_dir(self.path()).args(["run", "world.toml"]).args(options);
        command
    }

    fn files(&self) -> Vec<String> {
        let name = |entry: std::io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
        let mut names: Vec<String> = fs::read_dir(self.path()).unwrap().map(name).collect();
        names.sort();
        names
    }
}

/// Nothing on stdout, one line on stderr, and that one starts with `atoll: ` and what is expected.
#[track_caller]
fn assert_refused(ended: &Ended, code: i32, expected: &str) {
    let complaints = ended.complaints();
    let told = complaints.len() == 1 && complaints[0].starts_with(&format!("atoll: {expected}"));
    assert!(ended.code == Some(code) && ended.stdout.is_empty() && told, "expected {expected:?}, {code}: {ended}");
}
