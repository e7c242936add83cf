//! Where the end of a run began: the one record that all ranks report.

use crate::{Rank, TransportError};

/// What ended the run, by the rank that noticed or caused it first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Origin {
    pub(crate) error: TransportError,
    pub(crate) reporter: Rank,
}

impl Origin {
    /// What `own` reports. To itself a rank is not lost: the one that gave it up is, unless it gave itself up.
    pub(crate) fn as_seen_by(&self, own: Rank) -> TransportError {
        let Origin { error, reporter } = self;
        if *reporter == own {
            return error.clone();
        }
        let reason = match error {
            TransportError::Timeout { rank, waited } if *rank == own => {
                format!("it gave up after waiting {waited:.1?} for this rank, {own}")
            }
            TransportError::PeerLost { rank, reason } if *rank == own => {
                format!("it gave up because of this rank, {own}: {reason}")
            }
            TransportError::Usage { message } => format!("it gave up: {message}"),
            TransportError::Timeout { .. } | TransportError::PeerLost { .. } => return error.clone(),
        };
        TransportError::PeerLost { rank: *reporter, reason }
    }
}

/// A rank that is gone although others still need it, if nothing else is on record.
pub(crate) fn left_early(rank: Rank) -> TransportError {
    TransportError::PeerLost { rank, reason: LEFT_EARLY.to_owned() }
}

/// The reason of [`left_early`].
pub(crate) const LEFT_EARLY: &str = "it left while other ranks still needed it";

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn no_rank_is_lost_to_itself_by_what_another_says() {
        let timeout = TransportError::Timeout { rank: Rank(2), waited: Duration::from_secs(30) };
        let seen = |error: &TransportError, reporter, own| {
            Origin { error: error.clone(), reporter: Rank(reporter) }.as_seen_by(Rank(own))
        };
        assert_eq!(seen(&timeout, 0, 1), timeout);
        let gave_up = seen(&timeout, 0, 2);
        assert_eq!(gave_up.blamed(), Some(Rank(0)));
        assert!(gave_up.to_string().contains("waiting 30.0s for this rank, 2"), "{gave_up}");

        let left = left_early(Rank(2));
        assert_eq!(seen(&left, 0, 1), left);
        assert_eq!(seen(&left, 0, 2).blamed(), Some(Rank(0)));
        assert!(seen(&left, 0, 2).to_string().contains("because of this rank, 2: it left"));
    }

    #[test]
    fn what_a_rank_says_of_itself_stays() {
        let aborted = TransportError::PeerLost { rank: Rank(1), reason: "it aborted: no disk".to_owned() };
        let origin = Origin { error: aborted.clone(), reporter: Rank(1) };
        assert_eq!([origin.as_seen_by(Rank(1)), origin.as_seen_by(Rank(0))], [aborted.clone(), aborted]);
    }

    #[test]
    fn who_misuses_its_endpoint_is_lost_to_the_others_alone() {
        let origin = Origin { error: TransportError::usage("two lengths"), reporter: Rank(1) };
        assert_eq!(origin.as_seen_by(Rank(1)), origin.error);
        let reason = "it gave up: two lengths".to_owned();
        assert_eq!(origin.as_seen_by(Rank(0)), TransportError::PeerLost { rank: Rank(1), reason });
    }
}
