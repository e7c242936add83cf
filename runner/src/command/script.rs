//! A file of commands: a line for each, in any order of their steps.

use super::text::{Line, parse};
use crate::wording::{OneLine, unmarked};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;

/// A file of commands that cannot be used.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
pub enum ScriptError {
    /// The system refused to read.
    #[error("cannot read {}: {reason}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// A line that is no command.
    #[error("{}: line {line}: {}", .path.display(), OneLine(.reason))]
    Line {
        /// The file.
        path: PathBuf,
        /// Counted from 1.
        line: u64,
        /// What is wrong.
        reason: String,
    },
}

/// All lines of a file that say something, by their steps; those of one step in the order of the file.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Script {
    /// Where it was read.
    pub(crate) path: PathBuf,
    /// As it was read.
    pub(crate) text: Arc<str>,
    pub(crate) lines: Arc<[Line]>,
}

impl Script {
    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read, or a line of it is no command.
    pub(crate) fn load(path: &Path) -> Result<Self, ScriptError> {
        Self::read(path, &read(path)?)
    }

    /// Reads what a run wrote down, which may have been killed in the middle of its last line.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub(crate) fn load_recorded(path: &Path) -> Result<Self, ScriptError> {
        let mut text = read(path)?;
        text.truncate(text.rfind('\n').map_or(0, |end| end + 1));
        Self::read(path, &text)
    }

    /// As [`load`](Self::load), where it was read already.
    pub(crate) fn read(path: &Path, text: &str) -> Result<Self, ScriptError> {
        let mut lines = Vec::new();
        for (number, line) in (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()) {
            let bad = |reason| ScriptError::Line { path: path.to_owned(), line: number, reason };
            lines.push(parse(number, line).map_err(bad)?);
        }
        lines.sort_by_key(|line| line.step);
        Ok(Self { path: path.to_owned(), text: text.into(), lines: lines.into() })
    }

    /// The text of each of some of its lines.
    pub(crate) fn texts<'a>(&'a self, lines: &'a [Line]) -> impl Iterator<Item = &'a str> {
        let raw: Vec<&str> = self.text.lines().collect();
        lines.iter().map(move |line| raw[line.number as usize - 1])
    }

    /// A fingerprint of its text.
    #[cfg(any(test, feature = "iceoryx2", feature = "mpi"))]
    pub(crate) fn digest(&self) -> String {
        format!("{:032x}", xxhash_rust::xxh3::xxh3_128(self.text.as_bytes()))
    }
}

fn read(path: &Path) -> Result<String, ScriptError> {
    std::fs::read_to_string(path)
        .map(unmarked)
        .map_err(|error| ScriptError::Read { path: path.to_owned(), reason: error.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_by_step_and_those_of_one_as_they_stand() {
        let text = "{\"step\": 5, \"wake\": 1}\n\n{\"step\": 2, \"wake\": 2}\n{\"step\": 5, \"wake\": 3}\n";
        let script = Script::read(Path::new("a.jsonl"), text).unwrap();
        assert_eq!(script.lines.iter().map(|line| line.number).collect::<Vec<_>>(), [3, 1, 4]);
    }

    #[test]
    fn the_line_that_is_none_is_told() {
        let error = Script::read(Path::new("a.jsonl"), "\n{\"step\": 5, \"wake\": 1}\nremove 3\n").unwrap_err();
        assert_eq!(error.to_string(), "a.jsonl: line 3: expected value, at column 1");
        let error = Script::load(Path::new("/nowhere/a.jsonl")).unwrap_err().to_string();
        assert!(error.starts_with("cannot read /nowhere/a.jsonl: "), "{error}");
    }
}
