//! What the summary in a run's folder says about how it ended.

use crate::wording::OneLine;
use serde::{Deserialize, Serialize};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A summary that tells nothing.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
pub enum EndedError {
    /// The system refused to read.
    #[error("cannot read {}: {reason}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// It cannot be understood.
    #[error("{} is no summary of a run: {}; remove it, or bring back a good copy of it", .path.display(), OneLine(.reason))]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
}

impl EndedError {
    /// As a note where work goes on without it.
    pub fn counts_as_missing(&self) -> String {
        format!("{self}; until then it counts as missing")
    }
}

/// A run that has come to its end, or was told to stop and did so in order.
#[derive(Clone, PartialEq, Eq, Default, Debug, Deserialize, Serialize)]
pub struct Ended {
    /// Steps made.
    pub steps: u64,
    /// Whether it was to make more.
    pub interrupted: bool,
    /// Hash of its last state, as it was written.
    pub state_hash: Option<String>,
    /// Hash of the contacts of its last state, as it was written.
    pub contact_hash: Option<String>,
    /// Bodies it began with.
    #[serde(default)]
    pub bodies: u64,
    /// How many of them were missing at its end.
    #[serde(default)]
    pub bodies_lost: i64,
    /// How many tiles there were at its end.
    #[serde(default, skip_serializing)]
    pub(crate) tile_count: Option<u64>,
}

impl Ended {
    /// Reads the summary in the folder of a run. There is none until the run has ended.
    ///
    /// # Errors
    /// If it cannot be read, or says something else.
    pub fn read(folder: &Path) -> Result<Option<Self>, EndedError> {
        let path = folder.join("summary.json");
        match fs::read(&path) {
            Ok(text) => serde_json::from_slice(&text)
                .map(Some)
                .map_err(|error| EndedError::Damaged { path, reason: error.to_string() }),
            Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok(None),
            Err(error) => Err(EndedError::Read { path, reason: error.to_string() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_summary_is_there_or_not_or_damaged() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(Ended::read(folder.path()).unwrap(), None);
        let read = |text: &str| {
            fs::write(folder.path().join("summary.json"), text).unwrap();
            Ended::read(folder.path()).map(Option::unwrap).map_err(|error| error.to_string())
        };
        let [state_hash, contact_hash] = ["00ff", "ff00"].map(|hash| Some(hash.to_owned()));
        let whole = r#"{"steps": 7, "more": 1, "interrupted": false, "state_hash": "00ff", "contact_hash": "ff00",
            "bodies": 9, "bodies_lost": -1}"#;
        let expected = Ended { steps: 7, state_hash, contact_hash, bodies: 9, bodies_lost: -1, ..Ended::default() };
        assert_eq!(read(whole), Ok(expected));
        let short = Ended { steps: 8, interrupted: true, ..Ended::default() };
        assert_eq!(read(r#"{"steps": 8, "interrupted": true}"#), Ok(short));
        for damaged in ["", "{", "[]", r#"{"steps": 7}"#, r#"{"steps": -1, "interrupted": true}"#] {
            let error = read(damaged).unwrap_err();
            assert!(error.contains("summary.json is no summary of a run: ") && !error.contains('\n'), "{error}");
        }
        // What is no folder has none.
        assert_eq!(Ended::read(&folder.path().join("summary.json")).unwrap(), None);
    }
}
