//! What is wrong with the folder of a run.

use crate::config::ConfigError;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A folder that cannot be that of a run.
#[derive(Clone, PartialEq, Debug, Error)]
pub enum FolderError {
    /// It cannot be used.
    #[error("{option} {}: {reason}", .path.display())]
    Unusable {
        /// What it was given with.
        option: &'static str,
        /// The folder.
        path: PathBuf,
        /// What is wrong with it, and what to do.
        reason: String,
    },
    /// There is no room left for what is to be written there.
    #[error("{option} {}: {reason}; free some space and run the command again", .path.display())]
    Full {
        /// What it was given with.
        option: &'static str,
        /// The folder.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// The configuration that a run left there.
    #[error(transparent)]
    Config(Box<ConfigError>),
}

impl FolderError {
    /// That nothing can be written or removed there.
    pub(crate) fn not_writable(option: &'static str, path: &Path, error: &io::Error) -> Self {
        let (path, reason) = (path.to_owned(), error.to_string());
        match error.kind() {
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => Self::Full { option, path, reason },
            _ => Self::Unusable { option, path, reason: format!("{reason}; name a folder that can be written to") },
        }
    }
}

impl From<ConfigError> for FolderError {
    fn from(error: ConfigError) -> Self {
        Self::Config(Box::new(error))
    }
}
