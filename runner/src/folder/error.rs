//! What is wrong with the folder of a run.

use crate::config::ConfigError;
use std::path::PathBuf;
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
    #[error("{option} {}: {reason}; make room, and do the same again", .path.display())]
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

impl From<ConfigError> for FolderError {
    fn from(error: ConfigError) -> Self {
        Self::Config(Box::new(error))
    }
}
