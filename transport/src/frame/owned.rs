//! One buffer per rank, moved from sender to receiver.

use crate::Rank;

/// Buffers at most this large are never trimmed, in bytes.
pub(super) const KEEP_BYTES: usize = 64 * 1024;

/// A buffer is trimmed when it has more than this many times the room that its edge needed lately.
pub(super) const KEEP_RATIO: usize = 4;

/// How slowly "lately" fades: the remembered need of an edge shrinks by one part in this many per round.
pub(super) const FADE: usize = 1024;

/// The buffers that one rank fills.
#[derive(Debug)]
pub(crate) struct OwnedOutgoing {
    frames: Vec<Vec<u8>>,
    /// The recent need of each edge in bytes, either direction: a buffer travels both.
    needs: Vec<usize>,
}

impl OwnedOutgoing {
    pub(super) fn new(size: usize) -> OwnedOutgoing {
        OwnedOutgoing { frames: vec![Vec::new(); size], needs: vec![0; size] }
    }

    pub(super) fn to(&mut self, rank: Rank) -> &mut [u8] {
        &mut self.frames[rank.index()]
    }

    pub(super) fn iter_mut(&mut self) -> std::slice::IterMut<'_, Vec<u8>> {
        self.frames.iter_mut()
    }

    /// Sizes the buffers for a new round.
    pub(super) fn resize(&mut self, lengths: &[usize]) {
        for ((frame, need), &length) in self.frames.iter_mut().zip(&mut self.needs).zip(lengths) {
            *need = length.max(*need - need.div_ceil(FADE));
            // Old bytes stay: only growth is filled, so that a warm round writes nothing twice.
            frame.resize(length, 0);
            if frame.capacity() > KEEP_BYTES && frame.capacity() / KEEP_RATIO > *need {
                frame.shrink_to(*need);
            }
        }
    }

    /// Takes the frame for `rank` out and leaves `old`, a frame no longer needed, as the memory of the next one.
    pub(super) fn replace(&mut self, rank: Rank, old: Vec<u8>) -> Vec<u8> {
        let need = &mut self.needs[rank.index()];
        *need = old.len().max(*need);
        std::mem::replace(&mut self.frames[rank.index()], old)
    }
}

/// The buffers that one rank received.
#[derive(Debug, Default)]
pub(crate) struct OwnedIncoming {
    frames: Vec<Vec<u8>>,
}

impl OwnedIncoming {
    pub(super) fn from(&self, rank: Rank) -> &[u8] {
        &self.frames[rank.index()]
    }

    /// Makes room for one frame per rank.
    pub(super) fn resize(&mut self, size: usize) {
        self.frames.resize_with(size, Vec::new);
    }

    /// Puts a frame of `rank` in its place, and takes out the one that was there.
    pub(super) fn replace(&mut self, rank: Rank, frame: Vec<u8>) -> Vec<u8> {
        std::mem::replace(&mut self.frames[rank.index()], frame)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIB: usize = 1 << 20;

    #[test]
    fn a_large_buffer_is_kept_for_a_while_and_then_trimmed() {
        let mut outgoing = OwnedOutgoing::new(1);
        let round = |outgoing: &mut OwnedOutgoing, length| {
            outgoing.resize(&[length]);
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
        let mut outgoing = OwnedOutgoing::new(1);
        for _ in 0..5 * FADE {
            outgoing.resize(&[8]);
            let frame = outgoing.replace(Rank(0), vec![0; 0]);
            assert_eq!(frame.len(), 8);
            // The peer fills the same buffer with much more and it comes back.
            let mut big = frame;
            big.resize(MIB, 0);
            outgoing.replace(Rank(0), big);
        }
        outgoing.resize(&[8]);
        assert!(outgoing.replace(Rank(0), Vec::new()).capacity() >= MIB);
    }
}
