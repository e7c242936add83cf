//! What ranks tell each other beside the rounds.

use std::time::Duration;

use crate::{Rank, TransportError};

/// The longest reason that is passed on, in bytes, so that any notice is a short message, which is sent without waiting.
const LONGEST_REASON: usize = 1000;

/// A message about the run itself.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Notice {
    /// Who gets this is to answer with a pong of the same number.
    Ping { number: u64 },
    /// The answer, with the rounds that the one who answers has completed.
    Pong { number: u64, rounds: u64 },
    /// The sender takes part in no further round.
    Left { rounds: u64 },
    /// The sender has given up.
    Failed(TransportError),
}

impl Notice {
    /// As bytes: a kind, a rank, two numbers and a text.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let (kind, rank, first, second, text) = match self {
            Notice::Ping { number } => (0, Rank(0), *number, 0, ""),
            Notice::Pong { number, rounds } => (1, Rank(0), *number, *rounds, ""),
            Notice::Left { rounds } => (2, Rank(0), *rounds, 0, ""),
            Notice::Failed(TransportError::Timeout { rank, waited }) => {
                (3, *rank, waited.as_secs(), u64::from(waited.subsec_nanos()), "")
            }
            Notice::Failed(TransportError::PeerLost { rank, reason }) => (4, *rank, 0, 0, reason.as_str()),
            Notice::Failed(TransportError::Usage { message }) => (5, Rank(0), 0, 0, message.as_str()),
        };
        let text = &text.as_bytes()[..text.len().min(LONGEST_REASON)];
        [&[kind][..], &rank.0.to_le_bytes(), &first.to_le_bytes(), &second.to_le_bytes(), text].concat()
    }

    /// Undoes [`to_bytes`](Notice::to_bytes), as far as a reason was not too long.
    pub(super) fn from_bytes(bytes: &[u8]) -> Option<Notice> {
        let (&[kind], rest) = bytes.split_first_chunk()?;
        let (&rank, rest) = rest.split_first_chunk()?;
        let (&first, rest) = rest.split_first_chunk()?;
        let (&second, text) = rest.split_first_chunk()?;
        let rank = Rank(u32::from_le_bytes(rank));
        let (first, second) = (u64::from_le_bytes(first), u64::from_le_bytes(second));
        let text = || String::from_utf8_lossy(text).into_owned();
        Some(match kind {
            0 => Notice::Ping { number: first },
            1 => Notice::Pong { number: first, rounds: second },
            2 => Notice::Left { rounds: first },
            3 => {
                let waited = Duration::from_secs(first).checked_add(Duration::from_nanos(second))?;
                Notice::Failed(TransportError::Timeout { rank, waited })
            }
            4 => Notice::Failed(TransportError::PeerLost { rank, reason: text() }),
            5 => Notice::Failed(TransportError::Usage { message: text() }),
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notices_survive_as_bytes() {
        let lost = |reason: &str| Notice::Failed(TransportError::PeerLost { rank: Rank(7), reason: reason.to_owned() });
        let notices = [
            Notice::Ping { number: 5 },
            Notice::Pong { number: u64::MAX, rounds: 6 },
            Notice::Left { rounds: 1 << 40 },
            Notice::Failed(TransportError::Timeout { rank: Rank(70_000), waited: Duration::from_millis(30_250) }),
            lost("it left"),
            Notice::Failed(TransportError::usage("too long")),
        ];
        for notice in notices {
            assert_eq!(Notice::from_bytes(&notice.to_bytes()), Some(notice));
        }
        let cut = Notice::from_bytes(&lost(&"ü".repeat(LONGEST_REASON)).to_bytes());
        assert!(matches!(cut, Some(Notice::Failed(TransportError::PeerLost { rank: Rank(7), .. }))), "{cut:?}");
    }

    #[test]
    fn what_is_no_notice_is_refused() {
        assert_eq!(Notice::from_bytes(&[]), None);
        assert_eq!(Notice::from_bytes(&[0; 20]), None);
        assert_eq!(Notice::from_bytes(&[9; 21]), None);
    }
}
