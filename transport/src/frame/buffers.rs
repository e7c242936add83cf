//! What a backend that moves a buffer to each rank sends.

use super::{Incoming, Outgoing};
use crate::{Rank, TransportError};

/// The memory of such a backend: one buffer for each rank, which is filled by the caller, moved to the rank, read there and filled again. A
/// [backend of your own](crate#a-backend-of-your-own) may have it, too.
#[derive(Debug)]
pub struct Buffers {
    rank: Rank,
    outgoing: Outgoing,
}

impl Buffers {
    /// That of one of so many ranks.
    pub fn new(rank: Rank, size: usize) -> Self {
        Self { rank, outgoing: Outgoing::owned(size) }
    }

    /// All that a [`prepare`](crate::Transport::prepare) has to do.
    ///
    /// # Errors
    /// [`Usage`](TransportError::Usage) if there is not one length per rank.
    pub fn prepare(&mut self, lengths: &[usize]) -> Result<&mut Outgoing, TransportError> {
        self.outgoing.begin_prepare(self.rank, lengths)?;
        self.outgoing.as_owned().resize(lengths);
        self.outgoing.end_prepare();
        Ok(&mut self.outgoing)
    }

    /// Begins an exchange, in which every message is to be [taken](Self::take) and sent, and one from every rank
    /// [accepted](Incoming::accept). Returns the flag word to send with them.
    ///
    /// # Errors
    /// [`Usage`](TransportError::Usage) if nothing was prepared.
    pub fn begin_exchange(&mut self, incoming: &mut Incoming) -> Result<u128, TransportError> {
        self.outgoing.begin_exchange(self.rank)?;
        incoming.begin(self.outgoing.size());
        incoming.as_owned().resize(self.outgoing.size());
        Ok(self.outgoing.flag_word())
    }

    /// The message to a rank. The one that came from there in the round before is left in its place, as the memory of the next: so take it
    /// before that of this round is accepted.
    ///
    /// # Panics
    /// If there is no such rank.
    pub fn take(&mut self, to: Rank, incoming: &mut Incoming) -> Vec<u8> {
        let old = incoming.as_owned().replace(to, Vec::new());
        self.outgoing.as_owned().replace(to, old)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_have_the_prepared_lengths() {
        let mut buffers = Buffers::new(Rank(0), 3);
        for lengths in [[4, 0, 9], [1, 7, 0]] {
            let outgoing = buffers.prepare(&lengths).unwrap();
            let seen: Vec<_> = outgoing.iter_mut().map(|(rank, frame)| (rank, frame.len())).collect();
            assert_eq!(seen, [(Rank(0), lengths[0]), (Rank(1), lengths[1]), (Rank(2), lengths[2])]);
            assert_eq!(outgoing.to(Rank(1)).len(), lengths[1]);
        }
    }

    #[test]
    fn a_failed_prepare_leaves_nothing_prepared() {
        let mut buffers = Buffers::new(Rank(1), 2);
        buffers.prepare(&[1, 1]).unwrap();
        let error = buffers.prepare(&[1]).unwrap_err();
        assert!(error.to_string().starts_with("rank 1: prepare was given 1 lengths for 2 ranks"), "{error}");
        let error = buffers.begin_exchange(&mut Incoming::default()).unwrap_err();
        assert!(error.to_string().starts_with("rank 1: exchange without prepare"), "{error}");
    }

    #[test]
    fn a_flag_word_is_for_one_round() {
        let (mut buffers, mut incoming) = (Buffers::new(Rank(0), 1), Incoming::default());
        buffers.prepare(&[0]).unwrap().set_flag_word(7);
        assert_eq!(buffers.begin_exchange(&mut incoming).unwrap(), 7);
        buffers.prepare(&[0]).unwrap();
        assert_eq!(buffers.begin_exchange(&mut incoming).unwrap(), u128::MAX);
    }

    #[test]
    fn nothing_of_a_round_before_is_seen_in_the_next() {
        let (mut buffers, mut incoming) = (Buffers::new(Rank(0), 2), Incoming::default());
        for text in [&b"first"[..], b"second"] {
            buffers.prepare(&[0, text.len()]).unwrap().to(Rank(1)).copy_from_slice(text);
            buffers.begin_exchange(&mut incoming).unwrap();
            let message = buffers.take(Rank(1), &mut incoming);
            assert_eq!(incoming.from(Rank(1)), b"");
            incoming.accept(Rank(1), message, 0);
            assert_eq!(incoming.from(Rank(1)), text);
        }
    }
}
