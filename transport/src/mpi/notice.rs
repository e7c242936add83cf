//! What ranks tell each other beside the rounds.

use crate::TransportError;

/// The longest text that is passed on, in bytes, so that any notice is a short message, which is sent without waiting.
const LONGEST_TEXT: usize = 1000;

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
    /// As bytes: a kind, two numbers and a text.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let (kind, first, second, text) = match self {
            Notice::Ping { number } => (0, *number, 0, String::new()),
            Notice::Pong { number, rounds } => (1, *number, *rounds, String::new()),
            Notice::Left { rounds } => (2, *rounds, 0, String::new()),
            Notice::Failed(error) => (3, 0, 0, error.to_text()),
        };
        let text = &text.as_bytes()[..text.len().min(LONGEST_TEXT)];
        [&[kind][..], &first.to_le_bytes(), &second.to_le_bytes(), text].concat()
    }

    /// Undoes [`to_bytes`](Notice::to_bytes), as far as a reason was not too long.
    pub(super) fn from_bytes(bytes: &[u8]) -> Option<Notice> {
        let (&[kind], rest) = bytes.split_first_chunk()?;
        let (&first, rest) = rest.split_first_chunk()?;
        let (&second, text) = rest.split_first_chunk()?;
        let (first, second) = (u64::from_le_bytes(first), u64::from_le_bytes(second));
        Some(match kind {
            0 => Notice::Ping { number: first },
            1 => Notice::Pong { number: first, rounds: second },
            2 => Notice::Left { rounds: first },
            3 => Notice::Failed(TransportError::from_text(&String::from_utf8_lossy(text))?),
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rank;
    use std::time::Duration;

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
        let cut = Notice::from_bytes(&lost(&"ü".repeat(LONGEST_TEXT)).to_bytes());
        assert!(matches!(cut, Some(Notice::Failed(TransportError::PeerLost { rank: Rank(7), .. }))), "{cut:?}");
    }

    #[test]
    fn what_is_no_notice_is_refused() {
        assert_eq!(Notice::from_bytes(&[]), None);
        assert_eq!(Notice::from_bytes(&[0; 16]), None);
        assert_eq!(Notice::from_bytes(&[9; 17]), None);
        assert_eq!(Notice::from_bytes(&[3; 30]), None, "no error");
    }
}
