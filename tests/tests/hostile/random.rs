//! Random choices.

use atoll::scene::SplitMix64;

/// Numbers that a length must not be believed to be.
pub(crate) const GREED: [u32; 6] = [1, 0xffff, 0x7fff_ffff, 0x8000_0000, u32::MAX - 1, u32::MAX];

/// `usual` rounds, or a tenth of it where assertions slow everything down.
pub(crate) const fn rounds(usual: usize) -> usize {
    if cfg!(debug_assertions) { usual / 10 } else { usual }
}

/// A number below `end`.
pub(crate) fn below(random: &mut SplitMix64, end: usize) -> usize {
    (random.bits() % end as u64) as usize
}

/// One of some things.
pub(crate) fn one_of<T: Copy>(random: &mut SplitMix64, things: &[T]) -> T {
    things[below(random, things.len())]
}

pub(crate) fn noise(random: &mut SplitMix64, length: usize) -> Vec<u8> {
    (0..length).map(|_| random.bits() as u8).collect()
}

/// Changes one to eight bits of the first `end` bytes.
pub(crate) fn change_bits(random: &mut SplitMix64, bytes: &mut [u8], end: usize) {
    for _ in 0..=below(random, 8) {
        let bit = below(random, 8 * end);
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
}

/// Puts noise in the place of all bytes from some place on.
pub(crate) fn change_the_end(random: &mut SplitMix64, bytes: &mut [u8]) {
    let at = below(random, bytes.len());
    bytes[at..].fill_with(|| random.bits() as u8);
}

/// The number at some place.
pub(crate) fn number(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

pub(crate) fn overwrite(bytes: &mut [u8], at: usize, number: u32) {
    bytes[at..at + 4].copy_from_slice(&number.to_le_bytes());
}

/// Puts another number in the place of one: a greedy one, or any.
pub(crate) fn change_number(random: &mut SplitMix64, bytes: &mut [u8], at: usize) {
    let old = number(bytes, at);
    let any = random.bits() as u32 >> below(random, 32);
    let new = if random.coin() { one_of(random, &GREED) } else { any };
    overwrite(bytes, at, if new == old { old ^ 1 } else { new });
}
