//! One buffer for all ranks, of which a message-passing library scatters and gathers the parts.

use std::ops::Range;

use super::owned::{FADE, KEEP_BYTES, KEEP_RATIO};
use crate::Rank;

/// The messages of all ranks in one buffer.
///
/// Short messages lie in front, in rank order and without gaps; long ones behind them, likewise. So what a library
/// addresses with 32 bits are the short ones alone, and the buffer may be of any length.
#[derive(Debug, Default)]
pub(crate) struct Flat {
    /// At least what the parts need. What an earlier round had longer is kept, so that a warm round writes no zeros.
    bytes: Vec<u8>,
    parts: Vec<Range<usize>>,
    /// Messages longer than this lie behind.
    longest_in_front: usize,
    /// The recent need of all parts together, in bytes.
    need: usize,
}

impl Flat {
    /// A buffer for `size` ranks, and nothing in it.
    pub(crate) fn new(size: usize) -> Flat {
        Flat { parts: vec![0..0; size], ..Flat::default() }
    }

    /// Gives every rank a part of its length, with arbitrary bytes in it.
    ///
    /// # Panics
    /// If that is more than memory can hold.
    pub(crate) fn arrange(&mut self, lengths: &[usize], longest_in_front: usize) {
        self.longest_in_front = longest_in_front;
        self.parts.clear();
        self.parts.resize(lengths.len(), 0..0);
        let mut end = 0;
        for behind in [false, true] {
            for (part, &length) in self.parts.iter_mut().zip(lengths) {
                if (length > longest_in_front) == behind {
                    *part = end..end + length;
                    end += length;
                }
            }
        }
        self.fit(end);
    }

    /// Forgets all parts and makes room for those of `size` ranks, each to be [`place`](Flat::place)d.
    pub(crate) fn clear_parts(&mut self, size: usize) {
        self.parts.clear();
        self.parts.resize(size, 0..0);
    }

    /// Says where the message of one rank lies.
    pub(crate) fn place(&mut self, rank: Rank, part: Range<usize>) {
        self.parts[rank.index()] = part;
    }

    /// Where the message of `rank` lies.
    pub(crate) fn place_of(&self, rank: Rank) -> Range<usize> {
        self.parts[rank.index()].clone()
    }

    pub(crate) fn part(&self, rank: Rank) -> &[u8] {
        &self.bytes[self.place_of(rank)]
    }

    pub(crate) fn part_mut(&mut self, rank: Rank) -> &mut [u8] {
        let part = self.place_of(rank);
        &mut self.bytes[part]
    }

    pub(super) fn iter_mut(&mut self) -> PartsMut<'_> {
        let boundary = self.parts.iter().filter(|part| part.len() <= self.longest_in_front).map(|part| part.end).max();
        let (front, behind) = self.bytes.split_at_mut(boundary.unwrap_or(0));
        PartsMut { parts: self.parts.iter(), front, behind, longest_in_front: self.longest_in_front }
    }

    /// Takes the buffer out, for the library to work on; the parts remain.
    pub(crate) fn take(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.bytes)
    }

    /// Puts the buffer back, or another one with the same parts.
    pub(crate) fn put(&mut self, bytes: Vec<u8>) {
        self.bytes = bytes;
    }

    /// Makes the buffer at least `used` bytes long, and not much longer than what was needed lately.
    pub(crate) fn fit(&mut self, used: usize) {
        self.need = used.max(self.need - self.need.div_ceil(FADE));
        if self.bytes.len() < used {
            self.bytes.resize(used, 0);
        }
        if self.bytes.capacity() > KEEP_BYTES && self.bytes.capacity() / KEEP_RATIO > self.need {
            self.bytes.truncate(self.need);
            self.bytes.shrink_to_fit();
        }
    }
}

/// The parts of a [`Flat`], in rank order.
pub(super) struct PartsMut<'a> {
    parts: std::slice::Iter<'a, Range<usize>>,
    /// What is left of each of the two groups.
    front: &'a mut [u8],
    behind: &'a mut [u8],
    longest_in_front: usize,
}

impl<'a> Iterator for PartsMut<'a> {
    type Item = &'a mut [u8];

    fn next(&mut self) -> Option<&'a mut [u8]> {
        let length = self.parts.next()?.len();
        let group = if length > self.longest_in_front { &mut self.behind } else { &mut self.front };
        Some(group.split_off_mut(..length).expect("the buffer holds all parts"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIB: usize = 1 << 20;

    /// Fills every part with the number of its rank, through the iterator, and reads it back.
    fn check_parts(flat: &mut Flat, lengths: &[usize], longest_in_front: usize) {
        flat.arrange(lengths, longest_in_front);
        let seen: Vec<usize> = flat.iter_mut().map(|part| part.len()).collect();
        assert_eq!(seen, lengths);
        flat.iter_mut().enumerate().for_each(|(rank, part)| part.fill(rank as u8));
        for (rank, &length) in Rank::all(lengths.len()).zip(lengths) {
            assert_eq!(flat.part(rank), vec![rank.0 as u8; length]);
            assert_eq!(flat.part_mut(rank).len(), length);
        }
    }

    #[test]
    fn parts_do_not_overlap_wherever_they_lie() {
        let mut flat = Flat::new(5);
        for longest_in_front in [0, 1, 3, 10, usize::MAX] {
            check_parts(&mut flat, &[3, 0, 10, 1, 11], longest_in_front);
            check_parts(&mut flat, &[0, 0, 0, 0, 0], longest_in_front);
            check_parts(&mut flat, &[9, 9, 9, 9, 9], longest_in_front);
        }
    }

    #[test]
    fn short_parts_are_in_front_in_rank_order() {
        let mut flat = Flat::new(4);
        flat.arrange(&[5, 100, 7, 200], 10);
        let places: Vec<_> = Rank::all(4).map(|rank| flat.place_of(rank)).collect();
        assert_eq!(places, [0..5, 12..112, 5..12, 112..312]);
    }

    #[test]
    fn a_warm_round_allocates_nothing_and_a_large_buffer_is_trimmed_in_the_end() {
        let mut flat = Flat::new(2);
        flat.arrange(&[MIB, 0], usize::MAX);
        let memory = flat.bytes.as_ptr();
        for round in 0..100 {
            flat.arrange(&[10, round % 7], usize::MAX);
            assert_eq!((flat.bytes.as_ptr(), flat.bytes.len()), (memory, MIB), "trimmed between two steps");
            let bytes = flat.take();
            flat.put(bytes);
        }
        for _ in 0..10 * FADE {
            flat.arrange(&[10, 10], usize::MAX);
        }
        assert!(flat.bytes.capacity() <= KEEP_BYTES * KEEP_RATIO, "kept for ever");
        assert!(flat.bytes.len() >= 20);
    }
}
