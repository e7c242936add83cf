//! Errors as text, for ranks that are processes to tell each other.

use std::time::Duration;

use super::TransportError;
use crate::Rank;

impl TransportError {
    /// The error as text that [`from_text`](TransportError::from_text) reads, in a process of the same version.
    ///
    /// ```
    /// use atoll_transport::{Rank, TransportError};
    ///
    /// let error = TransportError::PeerLost { rank: Rank(3), reason: "it panicked".to_owned() };
    /// assert_eq!(TransportError::from_text(&error.to_text()), Some(error));
    /// ```
    pub fn to_text(&self) -> String {
        match self {
            TransportError::PeerLost { rank, reason } => format!("lost {rank} {reason}"),
            TransportError::Timeout { rank, waited } => format!("silent {rank} {}", waited.as_nanos()),
            TransportError::Usage { message } => format!("misused {message}"),
        }
    }

    /// Undoes [`to_text`](TransportError::to_text). None if that never wrote it.
    pub fn from_text(text: &str) -> Option<TransportError> {
        let (kind, rest) = text.split_once(' ')?;
        let of_rank = || {
            let (rank, rest) = rest.split_once(' ')?;
            Some((Rank(rank.parse().ok()?), rest))
        };
        Some(match kind {
            "lost" => {
                let (rank, reason) = of_rank()?;
                TransportError::PeerLost { rank, reason: reason.to_owned() }
            }
            "silent" => {
                let (rank, nanos) = of_rank()?;
                TransportError::Timeout { rank, waited: from_nanos(nanos.parse().ok()?)? }
            }
            "misused" => TransportError::Usage { message: rest.to_owned() },
            _ => return None,
        })
    }
}

/// All that a duration can be.
fn from_nanos(nanos: u128) -> Option<Duration> {
    let second = Duration::from_secs(1).as_nanos();
    Some(Duration::new(u64::try_from(nanos / second).ok()?, (nanos % second) as u32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_survive_as_text() {
        let lost = |reason: &str| TransportError::PeerLost { rank: Rank(u32::MAX), reason: reason.to_owned() };
        let silent = |waited| TransportError::Timeout { rank: Rank(0), waited };
        let errors = [
            lost("it left"),
            lost(""),
            lost("it aborted: two\nlines, \"quoted\"\n"),
            silent(Duration::ZERO),
            silent(Duration::from_nanos(30_250_000_001)),
            silent(Duration::MAX),
            TransportError::usage("rank 1: too long"),
            TransportError::usage(""),
        ];
        for error in errors {
            assert_eq!(TransportError::from_text(&error.to_text()), Some(error));
        }
    }

    #[test]
    fn what_is_no_error_is_refused() {
        let too_long = format!("silent 1 {}", u128::MAX);
        for text in ["", "lost", "lost 1", "lost x it left", "lost -1 it left", "silent 1 x", "found 1 it", &too_long] {
            assert_eq!(TransportError::from_text(text), None, "{text:?}");
        }
    }
}
