//! Where the end of a run began: the one record that all ranks report.

use crate::{Rank, TransportError};

/// What ended the run, by the rank that noticed or caused it first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Origin {
    pub(crate) error: TransportError,
    pub(crate) reporter: Rank,
}

impl Origin {
    /// What `rank` reports.
    pub(crate) fn as_seen_by(&self, rank: Rank) -> TransportError {
        match &self.error {
            // This very rank was too slow for another one. To itself it is not lost; the other one is.
            TransportError::Timeout { rank: blamed, waited } if *blamed == rank => TransportError::PeerLost {
                rank: self.reporter,
                reason: format!("it gave up after waiting {waited:.1?} for this rank, {rank}"),
            },
            error => error.clone(),
        }
    }
}

/// A rank that is gone although others still need it, if nothing else is on record.
pub(crate) fn left_early(rank: Rank) -> TransportError {
    TransportError::PeerLost { rank, reason: LEFT_EARLY.to_owned() }
}

/// The reason of [`left_early`].
pub(crate) const LEFT_EARLY: &str = "it left while other ranks still needed it";
