//! What can go wrong with a recording.

use crate::wording::OneLine;
use parquet::errors::ParquetError;
use std::path::PathBuf;
use thiserror::Error;

/// A recording that cannot be written or read.
#[derive(Debug, Error)]
pub enum RecordingError {
    /// The system refused to write.
    #[error("cannot write {}: {reason}", .path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// The system refused to read.
    #[error("cannot read {}: {reason}", .path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// A file under the name of a segment that is none, or no longer.
    #[error("{} is damaged, or no segment of a recording: {}; bring back a good copy of it", .path.display(), OneLine(.reason))]
    BadSegment {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// There is no record.
    #[error(
        "{} holds no recording: there is no step of which all ranks have closed a segment (rank-*/steps-*.parquet); give the \
         folder of a run that recorded",
        .path.display()
    )]
    Nothing {
        /// The folder.
        path: PathBuf,
    },
    /// Two files hold the same.
    #[error("{} and {} both hold step {step}; keep only the one that belongs to the run", .paths[0].display(), .paths[1].display())]
    Twice {
        /// The files.
        paths: [PathBuf; 2],
        /// The step.
        step: u64,
    },
    /// Two files hold parts of one step that do not go together.
    #[error(
        "step {step} was recorded by {} ranks in {} and by {} in {}; keep only those that belong to the run",
        .ranks[0], .paths[0].display(), .ranks[1], .paths[1].display()
    )]
    OtherRanks {
        /// The files.
        paths: [PathBuf; 2],
        /// How many ranks each speaks of.
        ranks: [u32; 2],
        /// The step.
        step: u64,
    },
    /// Two files are of different runs.
    #[error("{} and {} are of different runs: {}; keep each run in a folder of its own", .paths[0].display(), .paths[1].display(), OneLine(.what))]
    OtherRun {
        /// The files.
        paths: [PathBuf; 2],
        /// What they say differently.
        what: String,
    },
    /// A file must have been there once.
    #[error("{}: the segment that holds step {step} is missing; bring it back", .folder.display())]
    Missing {
        /// The folder where it should be.
        folder: PathBuf,
        /// The step.
        step: u64,
    },
    /// A recording that leaves shapes to its configuration, which is of no use.
    #[error(
        "{}: recordings of format 1 have no shapes, and there is none in its configuration: {}; record the run again",
        .path.display(), OneLine(.reason)
    )]
    NoScene {
        /// One of its files.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// There is no such record.
    #[error("{} has no record of step {step}; the nearest is of step {nearest}", .path.display())]
    NoSuchStep {
        /// The folder of the run.
        path: PathBuf,
        /// The step asked for.
        step: u64,
        /// The recorded one nearest to it.
        nearest: u64,
    },
}

/// What the system or the Parquet library said, without the words around it.
pub(super) fn reason(error: &ParquetError) -> String {
    match error {
        ParquetError::External(source) => source.to_string(),
        ParquetError::General(text) | ParquetError::EOF(text) => text.clone(),
        other => other.to_string(),
    }
}
