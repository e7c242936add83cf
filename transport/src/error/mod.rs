//! What can go wrong between ranks, and how a rank can end.

mod text;

use std::any::Any;
use std::time::Duration;

use thiserror::Error;

use crate::Rank;

/// Why a round could not be prepared or exchanged.
///
/// After [`PeerLost`](TransportError::PeerLost) and [`Timeout`](TransportError::Timeout) the run is over: the endpoint
/// answers every further call with the same error. After [`Usage`](TransportError::Usage) nothing was sent and the
/// endpoint is as good as before.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum TransportError {
    /// A rank that this one needed something from is gone. `rank` is where the trouble began, not merely the
    /// neighbour through which it was noticed.
    #[error("lost rank {rank}: {reason}; the run cannot go on, see what rank {rank} reported")]
    PeerLost {
        /// The rank that went first.
        rank: Rank,
        /// How it went, as a clause that begins with "it".
        reason: String,
    },

    /// A rank is still there, as far as anyone knows, but sent nothing for the whole peer timeout.
    #[error("no answer from rank {rank} for {waited:.1?}; see what rank {rank} is doing, or raise the peer timeout")]
    Timeout {
        /// The rank that did not answer.
        rank: Rank,
        /// How long it was waited for.
        waited: Duration,
    },

    /// The caller broke the contract of [`Transport`](crate::Transport).
    #[error("{message}")]
    Usage {
        /// What was wrong, where, and what to do instead.
        message: String,
    },
}

impl TransportError {
    /// The rank this error blames, if it blames one.
    pub fn blamed(&self) -> Option<Rank> {
        match self {
            TransportError::PeerLost { rank, .. } | TransportError::Timeout { rank, .. } => Some(*rank),
            TransportError::Usage { .. } => None,
        }
    }

    pub(crate) fn usage(message: impl Into<String>) -> TransportError {
        TransportError::Usage { message: message.into() }
    }
}

/// The panic payload with which [`Transport::abort`](crate::Transport::abort) ends a thread.
///
/// Code that catches unwinding tells a deliberate end from a bug by this type; see [`RankFailure::from_panic`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Aborted {
    /// The rank that aborted.
    pub rank: Rank,
    /// The reason it gave.
    pub reason: String,
}

impl Aborted {
    /// Unwinds the current thread with this payload. The panic hook is not run: an abort is no bug.
    pub fn unwind(rank: Rank, reason: &str) -> ! {
        std::panic::resume_unwind(Box::new(Aborted { rank, reason: reason.to_owned() }))
    }
}

/// How a rank ended that did not return.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum RankFailure {
    /// The rank's code panicked.
    #[error("rank {rank} panicked: {message}")]
    Panicked {
        /// The rank.
        rank: Rank,
        /// The text of the panic.
        message: String,
    },

    /// The rank called [`Transport::abort`](crate::Transport::abort).
    #[error("rank {rank} aborted: {reason}")]
    Aborted {
        /// The rank.
        rank: Rank,
        /// The reason it gave.
        reason: String,
    },

    /// The rank's process ended without a word.
    #[error("rank {rank} {how}")]
    Died {
        /// The rank.
        rank: Rank,
        /// How, as a clause that begins with a verb.
        how: String,
    },

    /// The rank's process was ended by its launcher after another rank was lost.
    #[error("rank {rank} was killed, as it did not end by itself when a rank was lost")]
    Outlived {
        /// The rank.
        rank: Rank,
    },

    /// The rank never ran.
    #[error("rank {rank} could not be started: {reason}")]
    NotStarted {
        /// The rank.
        rank: Rank,
        /// Why not.
        reason: String,
    },
}

impl RankFailure {
    /// Reads the payload of a caught panic: an [`Aborted`], or the text of an ordinary panic.
    ///
    /// ```
    /// use atoll_transport::{Rank, RankFailure};
    ///
    /// let payload = std::panic::catch_unwind(|| panic!("body {} is not finite", 7)).unwrap_err();
    /// assert_eq!(RankFailure::from_panic(Rank(2), payload).to_string(), "rank 2 panicked: body 7 is not finite");
    /// ```
    pub fn from_panic(rank: Rank, payload: Box<dyn Any + Send>) -> RankFailure {
        let payload = match payload.downcast::<Aborted>() {
            Ok(aborted) => return RankFailure::Aborted { rank: aborted.rank, reason: aborted.reason },
            Err(payload) => payload,
        };
        let message = match payload.downcast::<String>() {
            Ok(text) => *text,
            Err(payload) => match payload.downcast::<&str>() {
                Ok(text) => (*text).to_owned(),
                Err(_) => "without a text".to_owned(),
            },
        };
        RankFailure::Panicked { rank, message }
    }

    /// The rank that failed.
    pub fn rank(&self) -> Rank {
        match self {
            RankFailure::Panicked { rank, .. }
            | RankFailure::Aborted { rank, .. }
            | RankFailure::Died { rank, .. }
            | RankFailure::Outlived { rank }
            | RankFailure::NotStarted { rank, .. } => *rank,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_one_line_and_name_the_rank() {
        let errors = [
            TransportError::PeerLost { rank: Rank(3), reason: "it panicked".into() },
            TransportError::Timeout { rank: Rank(3), waited: Duration::from_secs(30) },
        ];
        for error in errors {
            let text = error.to_string();
            assert!(text.contains("rank 3") && !text.contains('\n'), "{text}");
            assert_eq!(error.blamed(), Some(Rank(3)));
        }
        assert_eq!(TransportError::usage("x").blamed(), None);
    }

    #[test]
    fn panic_payloads_keep_their_text() {
        let text = |payload: Box<dyn Any + Send>| RankFailure::from_panic(Rank(1), payload).to_string();
        assert_eq!(text(Box::new("literal")), "rank 1 panicked: literal");
        assert_eq!(text(Box::new("owned".to_owned())), "rank 1 panicked: owned");
        assert_eq!(text(Box::new(17_u8)), "rank 1 panicked: without a text");
        assert_eq!(text(Box::new(Aborted { rank: Rank(1), reason: "disk full".into() })), "rank 1 aborted: disk full");
    }
}
