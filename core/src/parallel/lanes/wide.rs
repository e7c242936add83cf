//! Sixteen numbers at once, for contacts and pairs: two eights side by side. Where each operation waits for the one before, of two
//! eights one does not wait for the other.

use super::{Arithmetic, LANES, Lanes, Quad};
use std::cell::Cell;

/// How many numbers a [`Wide`] holds. Part of the result's definition nowhere.
pub(crate) const WIDE: usize = 2 * LANES;

/// Sixteen numbers, as they lie in memory.
pub(crate) type WideRow = [f32; WIDE];

/// Arithmetic on sixteen lanes.
pub(crate) trait Wide: Arithmetic {
    fn load(from: &WideRow) -> Self;
    fn store(self, to: &mut WideRow);
    /// The four columns of the sixteen quads at `index`.
    fn gather(from: &[Cell<Quad>], index: &[u32; WIDE]) -> [Self; 4];
    /// The inverse of [`Wide::gather`].
    fn scatter(columns: [Self; 4], to: &[Cell<Quad>], index: &[u32; WIDE]);
    /// The four columns of sixteen quads in a row.
    fn load_quads(from: &[Quad; WIDE]) -> [Self; 4];
    /// The inverse of [`Wide::load_quads`].
    fn store_quads(columns: [Self; 4], to: &mut [Quad; WIDE]);
    /// Whether a number is positive in some lane.
    fn any_positive(self) -> bool;
}

/// The first of sixteen alone, where the others have nothing to do.
impl Wide for f32 {
    #[inline(always)]
    fn load(from: &WideRow) -> Self {
        from[0]
    }
    #[inline(always)]
    fn store(self, to: &mut WideRow) {
        to[0] = self;
    }
    #[inline(always)]
    fn gather(from: &[Cell<Quad>], index: &[u32; WIDE]) -> [Self; 4] {
        from[index[0] as usize].get()
    }
    #[inline(always)]
    fn scatter(columns: [Self; 4], to: &[Cell<Quad>], index: &[u32; WIDE]) {
        to[index[0] as usize].set(columns);
    }
    #[inline(always)]
    fn load_quads(from: &[Quad; WIDE]) -> [Self; 4] {
        from[0]
    }
    #[inline(always)]
    fn store_quads(columns: [Self; 4], to: &mut [Quad; WIDE]) {
        to[0] = columns;
    }
    #[inline(always)]
    fn any_positive(self) -> bool {
        self > 0.0
    }
}

/// Two eights.
#[derive(Clone, Copy)]
pub(crate) struct Twice<V>(V, V);

/// Both halves of a row.
#[inline(always)]
fn halves<T>(row: &[T; WIDE]) -> [&[T; LANES]; 2] {
    let (low, high) = row.split_first_chunk().expect("twice as many");
    [low, high.try_into().expect("as many are left")]
}

/// Columns of eight twice to columns of sixteen.
#[inline(always)]
fn together<V>([a, b, c, d]: [V; 4], [e, f, g, h]: [V; 4]) -> [Twice<V>; 4] {
    [Twice(a, e), Twice(b, f), Twice(c, g), Twice(d, h)]
}

impl<V: Lanes> Arithmetic for Twice<V> {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self(V::splat(x), V::splat(x))
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0.add(other.0), self.1.add(other.1))
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0.sub(other.0), self.1.sub(other.1))
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0.mul(other.0), self.1.mul(other.1))
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(self.0.div(other.0), self.1.div(other.1))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt(), self.1.sqrt())
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0), self.1.max(other.1))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0), self.1.min(other.1))
    }
    #[inline(always)]
    fn if_positive(self, yes: Self, no: Self) -> Self {
        Self(self.0.if_positive(yes.0, no.0), self.1.if_positive(yes.1, no.1))
    }
}

impl<V: Lanes> Wide for Twice<V> {
    #[inline(always)]
    fn load(from: &WideRow) -> Self {
        let [low, high] = halves(from);
        Self(V::load(low), V::load(high))
    }
    #[inline(always)]
    fn store(self, to: &mut WideRow) {
        let (low, high) = to.split_first_chunk_mut().expect("twice as many");
        self.0.store(low);
        self.1.store(high.try_into().expect("as many are left"));
    }
    #[inline(always)]
    fn gather(from: &[Cell<Quad>], index: &[u32; WIDE]) -> [Self; 4] {
        let [low, high] = halves(index);
        together(V::gather(from, low), V::gather(from, high))
    }
    #[inline(always)]
    fn scatter([a, b, c, d]: [Self; 4], to: &[Cell<Quad>], index: &[u32; WIDE]) {
        let [low, high] = halves(index);
        V::scatter([a.0, b.0, c.0, d.0], to, low);
        V::scatter([a.1, b.1, c.1, d.1], to, high);
    }
    #[inline(always)]
    fn load_quads(from: &[Quad; WIDE]) -> [Self; 4] {
        let [low, high] = halves(from);
        together(V::load_quads(low), V::load_quads(high))
    }
    #[inline(always)]
    fn store_quads([a, b, c, d]: [Self; 4], to: &mut [Quad; WIDE]) {
        let (low, high) = to.split_first_chunk_mut().expect("twice as many");
        V::store_quads([a.0, b.0, c.0, d.0], low);
        V::store_quads([a.1, b.1, c.1, d.1], high.try_into().expect("as many are left"));
    }
    #[inline(always)]
    fn any_positive(self) -> bool {
        let mut row = [0.0; WIDE];
        self.store(&mut row);
        row.iter().fold(false, |any, &lane| any | (lane > 0.0))
    }
}
