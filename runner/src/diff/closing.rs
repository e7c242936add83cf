//! The last states of two runs.

use crate::trajectory::{Ended, TrajectoryError};
use serde::Serialize;
use std::path::Path;

/// The hashes of the last states of two runs, the first run's first, as their summaries hold them. They cover what no record
/// does: steps after the last one, the rotation in full, contacts and their impulses.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct Closing {
    /// Steps that both runs made.
    pub steps: u64,
    /// Of the bodies.
    pub state_hash: [String; 2],
    /// Of the contacts.
    pub contact_hash: [String; 2],
}

impl Closing {
    /// Reads the summaries in the folders of two runs. None where one has not ended, or after another step.
    ///
    /// # Errors
    /// If a summary cannot be read.
    pub fn read(folders: [&Path; 2]) -> Result<Option<Self>, TrajectoryError> {
        let [a, b] = folders.map(Ended::read);
        Ok(a?.zip(b?).and_then(|(a, b)| Self::of(a, b)))
    }

    fn of(a: Ended, b: Ended) -> Option<Self> {
        (a.steps == b.steps).then_some(())?;
        let state_hash = [a.state_hash?, b.state_hash?];
        let contact_hash = [a.contact_hash?, b.contact_hash?];
        Some(Self { steps: a.steps, state_hash, contact_hash })
    }

    /// Whether the last states are the same bit for bit.
    pub fn is_identical(&self) -> bool {
        self.unlike().next().is_none()
    }

    /// The hashes that are not the same, with the names they have in a summary.
    pub fn unlike(&self) -> impl Iterator<Item = (&'static str, &[String; 2])> {
        let hashes = [("state_hash", &self.state_hash), ("contact_hash", &self.contact_hash)];
        hashes.into_iter().filter(|(_, [a, b])| a != b)
    }
}
