//! The memory of one round: what a rank sends and what it receives.
//!
//! Both types hide where their bytes live, so that a backend can hand out memory of its own. Here it is one `Vec<u8>`
//! per rank, which is what the backends inside one process need: a message is moved, never copied, and the buffer that
//! arrives from a peer is the next one to be filled for it. A backend with loaned shared-memory slices keeps one
//! loan per rank instead, and one that sends a single flat buffer keeps that buffer with its boundaries; either becomes
//! another private representation of these two types, and the public methods stay as they are.

use crate::{Rank, TransportError};

/// Buffers at most this large are never trimmed, in bytes.
const KEEP_BYTES: usize = 64 * 1024;

/// A buffer is trimmed when it has more than this many times the room that its edge needed lately.
const KEEP_RATIO: usize = 4;

/// How slowly "lately" fades: the remembered need of an edge shrinks by one part in this many per round.
const FADE: usize = 1024;

/// One writable buffer per destination, of exactly the length that was asked for in
/// [`prepare`](crate::Transport::prepare).
///
/// The buffers hold arbitrary bytes of earlier rounds until they are written. Parallel code shares the slices of
/// [`iter_mut`](Outgoing::iter_mut) between threads, not this type, whose memory may be bound to one thread.
#[derive(Debug, Default)]
pub struct Outgoing {
    frames: Vec<Vec<u8>>,
    /// The recent need of each edge in bytes, either direction: a buffer travels both.
    needs: Vec<usize>,
    /// Whether the frames were prepared and not yet sent.
    ready: bool,
}

impl Outgoing {
    pub(crate) fn new(size: usize) -> Outgoing {
        Outgoing { frames: vec![Vec::new(); size], needs: vec![0; size], ready: false }
    }

    /// The number of destinations, which is the number of ranks.
    pub fn size(&self) -> usize {
        self.frames.len()
    }

    /// The buffer that goes to `rank`.
    ///
    /// # Panics
    /// If there is no such rank.
    pub fn to(&mut self, rank: Rank) -> &mut [u8] {
        &mut self.frames[rank.index()]
    }

    /// Every destination with its buffer, in rank order.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = (Rank, &mut [u8])> {
        self.frames.iter_mut().enumerate().map(|(index, frame)| (Rank::from_index(index), frame.as_mut_slice()))
    }

    /// Sizes the buffers for a new round. What an earlier call prepared is discarded, also by a call that fails.
    pub(crate) fn prepare(&mut self, rank: Rank, lengths: &[usize]) -> Result<(), TransportError> {
        self.ready = false;
        if lengths.len() != self.size() {
            return Err(TransportError::usage(format!(
                "rank {rank}: prepare was given {} lengths for {} ranks; give one per rank, 0 for nothing to send",
                lengths.len(),
                self.size()
            )));
        }
        for ((frame, need), &length) in self.frames.iter_mut().zip(&mut self.needs).zip(lengths) {
            *need = length.max(*need - need.div_ceil(FADE));
            // Old bytes stay: only growth is filled, so that a warm round writes nothing twice.
            frame.resize(length, 0);
            if frame.capacity() > KEEP_BYTES && frame.capacity() / KEEP_RATIO > *need {
                frame.shrink_to(*need);
            }
        }
        self.ready = true;
        Ok(())
    }

    /// Begins the sending: the round is spent from here on.
    pub(crate) fn begin_exchange(&mut self, rank: Rank) -> Result<(), TransportError> {
        if std::mem::take(&mut self.ready) {
            Ok(())
        } else {
            Err(TransportError::usage(format!(
                "rank {rank}: exchange without prepare; prepare every round, with lengths 0 for nothing to send"
            )))
        }
    }

    /// Takes the frame for `rank` out and leaves `old`, a frame no longer needed, as the memory of the next one.
    pub(crate) fn replace(&mut self, rank: Rank, old: Vec<u8>) -> Vec<u8> {
        let need = &mut self.needs[rank.index()];
        *need = old.len().max(*need);
        std::mem::replace(&mut self.frames[rank.index()], old)
    }
}

/// What one round brought: one frame from every rank, this one included.
///
/// Keep one value and pass it to every exchange: its old frames become the memory of later messages, and then a warm
/// exchange allocates nothing. The frames stay valid until the next exchange that is given this value, or until it is
/// dropped. As with [`Outgoing`], share the slices between threads, not the value.
#[derive(Debug, Default)]
pub struct Incoming {
    frames: Vec<Vec<u8>>,
}

impl Incoming {
    /// The number of sources: the number of ranks, or 0 before the first exchange.
    pub fn size(&self) -> usize {
        self.frames.len()
    }

    /// What `rank` sent, possibly nothing.
    ///
    /// # Panics
    /// If there is no such rank, or before the first exchange.
    pub fn from(&self, rank: Rank) -> &[u8] {
        &self.frames[rank.index()]
    }

    /// Every source with what it sent, in rank order.
    pub fn iter(&self) -> impl Iterator<Item = (Rank, &[u8])> {
        self.frames.iter().enumerate().map(|(index, frame)| (Rank::from_index(index), frame.as_slice()))
    }

    /// Makes room for one frame per rank.
    pub(crate) fn resize(&mut self, size: usize) {
        self.frames.resize_with(size, Vec::new);
    }

    /// Takes the frame of `rank` out, to be given back to the backend.
    pub(crate) fn take(&mut self, rank: Rank) -> Vec<u8> {
        std::mem::take(&mut self.frames[rank.index()])
    }

    /// Puts a received frame in its place.
    pub(crate) fn put(&mut self, rank: Rank, frame: Vec<u8>) {
        self.frames[rank.index()] = frame;
    }

    /// Forgets every frame, so that a failed round cannot be mistaken for a received one.
    pub(crate) fn clear(&mut self) {
        self.frames.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIB: usize = 1 << 20;

    #[test]
    fn buffers_have_the_prepared_lengths() {
        let mut outgoing = Outgoing::new(3);
        for lengths in [[4, 0, 9], [1, 7, 0]] {
            outgoing.prepare(Rank(0), &lengths).unwrap();
            let seen: Vec<_> = outgoing.iter_mut().map(|(rank, frame)| (rank, frame.len())).collect();
            assert_eq!(seen, [(Rank(0), lengths[0]), (Rank(1), lengths[1]), (Rank(2), lengths[2])]);
            assert_eq!(outgoing.to(Rank(1)).len(), lengths[1]);
        }
    }

    #[test]
    fn a_failed_prepare_leaves_nothing_prepared() {
        let mut outgoing = Outgoing::new(2);
        outgoing.prepare(Rank(1), &[1, 1]).unwrap();
        let error = outgoing.prepare(Rank(1), &[1]).unwrap_err();
        assert!(error.to_string().starts_with("rank 1: prepare was given 1 lengths for 2 ranks"), "{error}");
        let error = outgoing.begin_exchange(Rank(1)).unwrap_err();
        assert!(error.to_string().starts_with("rank 1: exchange without prepare"), "{error}");
    }

    #[test]
    fn a_large_buffer_is_kept_for_a_while_and_then_trimmed() {
        let mut outgoing = Outgoing::new(1);
        let round = |outgoing: &mut Outgoing, length| {
            outgoing.prepare(Rank(0), &[length]).unwrap();
            let frame = outgoing.replace(Rank(0), Vec::new());
            let capacity = frame.capacity();
            outgoing.replace(Rank(0), frame);
            capacity
        };
        assert!(round(&mut outgoing, MIB) >= MIB);
        for _ in 0..100 {
            assert!(round(&mut outgoing, 10) >= MIB, "trimmed between two steps");
        }
        let last = (0..10 * FADE).map(|_| round(&mut outgoing, 10)).last();
        assert!(last.unwrap() <= KEEP_BYTES * KEEP_RATIO, "kept for ever");
    }

    #[test]
    fn a_buffer_needed_by_the_other_direction_is_not_trimmed() {
        let mut outgoing = Outgoing::new(1);
        for _ in 0..5 * FADE {
            outgoing.prepare(Rank(0), &[8]).unwrap();
            let frame = outgoing.replace(Rank(0), vec![0; 0]);
            assert_eq!(frame.len(), 8);
            // The peer fills the same buffer with much more and it comes back.
            let mut big = frame;
            big.resize(MIB, 0);
            outgoing.replace(Rank(0), big);
        }
        outgoing.prepare(Rank(0), &[8]).unwrap();
        assert!(outgoing.replace(Rank(0), Vec::new()).capacity() >= MIB);
    }
}
