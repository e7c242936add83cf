//! Sums that come out the same in whatever order, and on however many threads and ranks, they are made.
//!
//! Source: U. Kulisch's long accumulator (Computer Arithmetic and Validity, 2008): every finite number of 64 bits is a whole
//! multiple of 2^-1074, so a whole number that is wide enough adds them up without rounding. Rounding happens once, at the end.

use bytemuck::{Pod, Zeroable};

#[cfg(test)]
mod tests;

/// Numbers reach up to bit 2098 above the unit; the 78 bits above that are for the sign and for more additions than can be
/// made.
const WORDS: usize = 34;

/// Bits of a significand behind its first.
const FRACTION: u32 = 52;

const NAN: u64 = 1;
const INFINITE: u64 = 2;
const MINUS_INFINITE: u64 = 4;

/// A sum of numbers, without any rounding. Plain data, so that it travels as bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ExactSum {
    /// A whole number of 2^-1074, in two's complement, the lowest word first.
    words: [u64; WORDS],
    /// Which numbers came that are not finite.
    special: u64,
}

impl Default for ExactSum {
    fn default() -> Self {
        Self { words: [0; WORDS], special: 0 }
    }
}

impl ExactSum {
    /// Adds a number.
    pub(crate) fn add(&mut self, value: f64) {
        let bits = value.to_bits();
        let (exponent, fraction) = (bits >> FRACTION & 0x7ff, bits & ((1 << FRACTION) - 1));
        if exponent == 0x7ff {
            self.special |= match (fraction, value > 0.0) {
                (0, true) => INFINITE,
                (0, false) => MINUS_INFINITE,
                _ => NAN,
            };
            return;
        }
        // Subnormal numbers have no leading one, and the exponent of the smallest that do.
        let (significand, shift) = if exponent == 0 { (fraction, 0) } else { (fraction | 1 << FRACTION, exponent - 1) };
        let (first, wide) = (shift as usize / 64, u128::from(significand) << (shift % 64));
        let parts = [wide as u64, (wide >> 64) as u64];
        if value.is_sign_negative() { self.subtract_at(first, parts) } else { self.add_at(first, parts) }
    }

    /// Adds all that another has added.
    pub(crate) fn merge(&mut self, other: &Self) {
        let mut carry = false;
        for (word, &other) in self.words.iter_mut().zip(&other.words) {
            (*word, carry) = carrying(*word, other, carry);
        }
        self.special |= other.special;
    }

    /// The sum, rounded once to the nearest number, and to the even one of two.
    pub(crate) fn value(&self) -> f64 {
        match self.special {
            0 => {}
            INFINITE => return f64::INFINITY,
            MINUS_INFINITE => return f64::NEG_INFINITY,
            _ => return f64::NAN,
        }
        let negative = self.words[WORDS - 1] >> 63 == 1;
        let mut size = *self;
        if negative {
            size.negate();
        }
        let bits = size.rounded();
        f64::from_bits(bits | u64::from(negative) << 63)
    }

    fn add_at(&mut self, first: usize, [low, high]: [u64; 2]) {
        let (words, mut carry) = (&mut self.words, false);
        (words[first], carry) = carrying(words[first], low, carry);
        (words[first + 1], carry) = carrying(words[first + 1], high, carry);
        let mut rest = words[first + 2..].iter_mut();
        while carry && let Some(word) = rest.next() {
            (*word, carry) = word.overflowing_add(1);
        }
    }

    fn subtract_at(&mut self, first: usize, [low, high]: [u64; 2]) {
        let (words, mut borrow) = (&mut self.words, false);
        (words[first], borrow) = borrowing(words[first], low, borrow);
        (words[first + 1], borrow) = borrowing(words[first + 1], high, borrow);
        let mut rest = words[first + 2..].iter_mut();
        while borrow && let Some(word) = rest.next() {
            (*word, borrow) = word.overflowing_sub(1);
        }
    }

    fn negate(&mut self) {
        let mut carry = true;
        for word in &mut self.words {
            (*word, carry) = (!*word).overflowing_add(u64::from(carry));
        }
    }

    /// The bits of the nearest number, where the sum is not negative.
    fn rounded(&self) -> u64 {
        let Some(last) = self.words.iter().rposition(|&word| word != 0) else { return 0 };
        let top = 64 * last as u32 + self.words[last].ilog2();
        let Some(dropped) = top.checked_sub(FRACTION) else { return self.words[0] };
        let significand = self.bits_from(dropped) & ((1 << FRACTION) - 1);
        // Biased by one less than the first exponent of a number with a leading one.
        let exponent = u64::from(dropped) + 1;
        if exponent >= 0x7ff {
            return f64::INFINITY.to_bits();
        }
        let half = dropped > 0 && self.bits_from(dropped - 1) & 1 == 1;
        let more = half && (significand & 1 == 1 || self.any_below(dropped - 1));
        // Where the significand overflows, the exponent grows by one, as it must.
        (exponent << FRACTION | significand) + u64::from(more)
    }

    /// The 64 bits from this one up.
    fn bits_from(&self, bit: u32) -> u64 {
        let (word, shift) = ((bit / 64) as usize, bit % 64);
        let above = self.words.get(word + 1).copied().unwrap_or(0);
        ((u128::from(above) << 64 | u128::from(self.words[word])) >> shift) as u64
    }

    fn any_below(&self, bit: u32) -> bool {
        let (word, shift) = ((bit / 64) as usize, bit % 64);
        self.words[..word].iter().any(|&word| word != 0) || self.words[word] & ((1 << shift) - 1) != 0
    }
}

fn carrying(a: u64, b: u64, carry: bool) -> (u64, bool) {
    let (sum, over) = a.overflowing_add(b);
    let (sum, over_again) = sum.overflowing_add(u64::from(carry));
    (sum, over || over_again)
}

fn borrowing(a: u64, b: u64, borrow: bool) -> (u64, bool) {
    let (rest, under) = a.overflowing_sub(b);
    let (rest, under_again) = rest.overflowing_sub(u64::from(borrow));
    (rest, under || under_again)
}
