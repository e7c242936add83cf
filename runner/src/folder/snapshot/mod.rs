//! Snapshots: the whole state of a run after some step, from which it goes on to the same bits on any ranks.
//!
//! ```text
//! DIR/snapshots/step-0000000100/rank-00000-of-00004.atoll     one file of each rank that wrote it
//! ```
//!
//! A file is written under a temporary name, made durable and renamed, so what has its final name is whole, and a snapshot
//! is complete once the files of all ranks are there: no rank need wait for another. Blocks are tiles, so any number of ranks
//! can read what any other number wrote, each only the tiles it holds.

mod file;
mod set;
mod store;
#[cfg(test)]
mod tests;

pub(crate) use file::{SnapshotFile, SnapshotWriter};
pub(crate) use set::Snapshot;
pub(crate) use store::{Found, find, find_all, is_folder, remove_after, remove_before};

use std::path::{Path, PathBuf};
use thiserror::Error;

/// What to do where a damaged snapshot was the last hope.
pub(crate) const NO_OTHER: &str = "no other snapshot is whole: begin anew with --out and --overwrite";

/// Why a snapshot cannot be used, or found.
#[derive(Debug, Error)]
pub enum SnapshotError {
    /// The system does not let it be read.
    #[error("{}: cannot read this snapshot: {reason}", .path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// It is not what was written.
    #[error("{}: this snapshot is damaged: {reason}", .path.display())]
    Damaged {
        /// The file, or the folder of all of them.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// Another version wrote it.
    #[error(
        "{}: {what} = {found} in this snapshot, and {expected} in this program; go on with the version that wrote it",
        .path.display()
    )]
    OtherVersion {
        /// The file.
        path: PathBuf,
        /// Version of the program, or of the format.
        what: &'static str,
        /// That of the snapshot.
        found: String,
        /// That of this program.
        expected: String,
    },
    /// It is of a run that is configured otherwise.
    #[error(
        "{}: {key} = {found} in this snapshot, and {expected} in the configuration; only how a run is spread can change",
        .path.display()
    )]
    OtherConfiguration {
        /// The file.
        path: PathBuf,
        /// The first key that differs.
        key: String,
        /// Its value in the snapshot.
        found: String,
        /// Its value in the configuration.
        expected: String,
    },
    /// Whatever was written is damaged.
    #[error("{why}; {NO_OTHER}")]
    NoneWhole {
        /// What is wrong with the newest.
        why: Box<SnapshotError>,
    },
}

impl SnapshotError {
    /// What is wrong with a file, in words.
    pub(crate) fn damaged(path: &Path, reason: impl ToString) -> Self {
        Self::Damaged { path: path.to_owned(), reason: reason.to_string() }
    }

    pub(crate) fn read(path: &Path, error: &std::io::Error) -> Self {
        Self::Read { path: path.to_owned(), reason: error.to_string() }
    }

    /// Whether an older snapshot may do: not where this one is merely not for this run, or cannot be read just now.
    pub fn is_damage(&self) -> bool {
        matches!(self, Self::Damaged { .. })
    }
}
