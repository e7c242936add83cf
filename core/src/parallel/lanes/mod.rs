//! Eight numbers at once, the same bits on every machine.
//!
//! A kernel is written once, generic over [`Lanes`], and compiled for plain x86-64 (or any other target) with arrays, for
//! AVX2 with vector registers, and for AVX-512 with twice as many of them. Every operation is the IEEE one, lane by lane, so
//! all give the same bits; how many lanes a register has never decides how work is grouped.

use crate::model::math;
use crate::model::params::Instructions;
use std::cell::Cell;
use wide::Twice;

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(test)]
mod tests;
mod wide;

pub(crate) use wide::{WIDE, Wide, WideRow};

#[cfg(target_arch = "x86_64")]
use avx2::{Avx2, Eight};
#[cfg(target_arch = "x86_64")]
use avx512::Avx512;

/// How many numbers a [`Lanes`] holds. Part of the result's definition nowhere, of the memory layout everywhere.
pub(crate) const LANES: usize = 8;

/// Eight numbers, as they lie in memory.
pub(crate) type Row = [f32; LANES];

/// Four numbers of one body, read and written together.
pub(crate) type Quad = [f32; 4];

/// Two numbers of one body: a vector or a rotation.
pub(crate) type Pair = [f32; 2];

/// Where a body is, in m.
pub(crate) type Place = [f64; 2];

/// Arithmetic, lane by lane.
pub(crate) trait Arithmetic: Copy {
    fn splat(x: f32) -> Self;
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    fn sqrt(self) -> Self;
    /// The greater; `other` where they compare equal or not at all.
    fn max(self, other: Self) -> Self;
    /// The lesser; `other` where they compare equal or not at all.
    fn min(self, other: Self) -> Self;
    /// `yes` where `self > 0`, else `no`.
    fn if_positive(self, yes: Self, no: Self) -> Self;
}

/// Arithmetic on eight lanes.
pub(crate) trait Lanes: Arithmetic {
    /// Whether the processor is known to have registers that hold them.
    const HAS_REGISTERS: bool;
    /// Sixteen lanes, of the same instructions.
    type Wide: Wide;
    fn load(from: &Row) -> Self;
    fn store(self, to: &mut Row);
    /// The four columns of the eight quads at `index`.
    fn gather(from: &[Cell<Quad>], index: &[u32; LANES]) -> [Self; 4];
    /// The inverse of [`Lanes::gather`].
    fn scatter(columns: [Self; 4], to: &[Cell<Quad>], index: &[u32; LANES]);
    /// The four columns of eight quads in a row.
    fn load_quads(from: &[Quad; LANES]) -> [Self; 4];
    /// The inverse of [`Lanes::load_quads`].
    fn store_quads(columns: [Self; 4], to: &mut [Quad; LANES]);
    /// As [`Lanes::gather`], of quads that nobody changes.
    fn gather_fixed(from: &[Quad], index: &[u32; LANES]) -> [Self; 4];
    /// The two columns of eight pairs in a row.
    fn load_pairs(from: &[Pair; LANES]) -> [Self; 2];
    /// The inverse of [`Lanes::load_pairs`].
    fn store_pairs(columns: [Self; 2], to: &mut [Pair; LANES]);
    /// From an origin to eight places, rounded once, in the end.
    fn seen_from(origin: Place, places: &[Place; LANES]) -> [Self; 2];
    /// Moves eight places on.
    fn advance(by: [Self; 2], places: &mut [Place; LANES]);
    /// Whether all places are at least `low` and less than `high`, in both directions.
    fn are_within(places: &[Place; LANES], low: Place, high: Place) -> bool;
    /// Whether all numbers are less than this.
    fn all_below(self, most: f32) -> bool;
}

/// A lane alone.
impl Arithmetic for f32 {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        x
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self + other
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self - other
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self * other
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self / other
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        math::max(self, other)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        math::min(self, other)
    }
    #[inline(always)]
    fn if_positive(self, yes: Self, no: Self) -> Self {
        if self > 0.0 { yes } else { no }
    }
}

/// Plain arrays: the reference, and what other processors run.
///
/// With assertions, which is where little is optimized, kernels call it: unrolled into them it was most of what there was to compile.
/// Elsewhere the compiler chooses what it unrolls, and what it leaves is a twentieth faster than all of it.
#[derive(Clone, Copy)]
pub(crate) struct Portable(Row);

impl Portable {
    #[cfg_attr(debug_assertions, inline(never))]
    fn map2(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|l| f(self.0[l], other.0[l])))
    }
}

impl Arithmetic for Portable {
    #[cfg_attr(debug_assertions, inline(never))]
    fn splat(x: f32) -> Self {
        Self([x; LANES])
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn add(self, other: Self) -> Self {
        self.map2(other, |a, b| a + b)
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn sub(self, other: Self) -> Self {
        self.map2(other, |a, b| a - b)
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn mul(self, other: Self) -> Self {
        self.map2(other, |a, b| a * b)
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn div(self, other: Self) -> Self {
        self.map2(other, |a, b| a / b)
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn max(self, other: Self) -> Self {
        self.map2(other, math::max)
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn min(self, other: Self) -> Self {
        self.map2(other, math::min)
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn if_positive(self, yes: Self, no: Self) -> Self {
        Self(std::array::from_fn(|l| if self.0[l] > 0.0 { yes.0[l] } else { no.0[l] }))
    }
}

impl Lanes for Portable {
    const HAS_REGISTERS: bool = false;
    type Wide = Twice<Self>;
    #[cfg_attr(debug_assertions, inline(never))]
    fn load(from: &Row) -> Self {
        Self(*from)
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn store(self, to: &mut Row) {
        *to = self.0;
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn gather(from: &[Cell<Quad>], index: &[u32; LANES]) -> [Self; 4] {
        let quads = index.map(|i| from[i as usize].get());
        Self::load_quads(&quads)
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn scatter(columns: [Self; 4], to: &[Cell<Quad>], index: &[u32; LANES]) {
        for (l, &i) in index.iter().enumerate() {
            to[i as usize].set(columns.map(|column| column.0[l]));
        }
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn load_quads(from: &[Quad; LANES]) -> [Self; 4] {
        std::array::from_fn(|c| Self(std::array::from_fn(|l| from[l][c])))
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn store_quads(columns: [Self; 4], to: &mut [Quad; LANES]) {
        for (l, quad) in to.iter_mut().enumerate() {
            *quad = columns.map(|column| column.0[l]);
        }
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn gather_fixed(from: &[Quad], index: &[u32; LANES]) -> [Self; 4] {
        Self::load_quads(&index.map(|i| from[i as usize]))
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn load_pairs(from: &[Pair; LANES]) -> [Self; 2] {
        std::array::from_fn(|c| Self(std::array::from_fn(|l| from[l][c])))
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn store_pairs([a, b]: [Self; 2], to: &mut [Pair; LANES]) {
        *to = std::array::from_fn(|l| [a.0[l], b.0[l]]);
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn seen_from(origin: Place, places: &[Place; LANES]) -> [Self; 2] {
        std::array::from_fn(|c| Self(std::array::from_fn(|l| (places[l][c] - origin[c]) as f32)))
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn advance([x, y]: [Self; 2], places: &mut [Place; LANES]) {
        for (l, place) in places.iter_mut().enumerate() {
            *place = [place[0] + f64::from(x.0[l]), place[1] + f64::from(y.0[l])];
        }
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn are_within(places: &[Place; LANES], low: Place, high: Place) -> bool {
        places.iter().all(|place| (0..2).all(|axis| place[axis] >= low[axis] && place[axis] < high[axis]))
    }
    #[cfg_attr(debug_assertions, inline(never))]
    fn all_below(self, most: f32) -> bool {
        self.0.iter().all(|&lane| lane < most)
    }
}

/// A kernel that runs on any [`Lanes`].
pub(crate) trait Kernel {
    type Output;
    fn run<V: Lanes>(self) -> Self::Output;
}

/// The lanes that kernels run on; made only where the processor has what it takes.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(crate) struct LaneSet(Set);

/// Sets of instructions.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(crate) enum Set {
    #[default]
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl LaneSet {
    /// Those that are wanted; none where this processor lacks them.
    pub(crate) fn of(wanted: Instructions) -> Option<Self> {
        match wanted {
            Instructions::Portable => Some(Self(Set::Portable)),
            Instructions::Auto => {
                let wide = [Instructions::Avx512, Instructions::Avx2].into_iter().find_map(Self::of);
                Some(wide.unwrap_or_default())
            }
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2 => {
                let all = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("popcnt");
                all.then_some(Self(Set::Avx2))
            }
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512 => {
                let all = Self::of(Instructions::Avx2).is_some()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512dq");
                all.then_some(Self(Set::Avx512))
            }
            #[cfg(not(target_arch = "x86_64"))]
            Instructions::Avx2 | Instructions::Avx512 => None,
        }
    }

    /// Which instructions the processor has that are wanted.
    #[cfg(target_arch = "x86_64")]
    pub(crate) fn set(self) -> Set {
        self.0
    }

    /// Runs a kernel. The result does not depend on which lanes these are. Not inlined: else all that a kernel comes to would be compiled
    /// anew for each place that runs it.
    #[inline(never)]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            Set::Portable => kernel.run::<Portable>(),
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => {
                #[target_feature(enable = "avx2")]
                fn with_avx2<K: Kernel>(kernel: K) -> K::Output {
                    kernel.run::<Eight<Avx2>>()
                }
                // SAFETY: the processor has said that it has AVX2, or this would not be this set.
                unsafe { with_avx2(kernel) }
            }
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => {
                // Of eight lanes as well, and 32 registers for them; and sixteen lanes.
                #[target_feature(enable = "avx2,avx512f,avx512vl,avx512bw,avx512dq")]
                fn with_avx512<K: Kernel>(kernel: K) -> K::Output {
                    kernel.run::<Eight<Avx512>>()
                }
                // SAFETY: the processor has said that it has all of these, or this would not be this set.
                unsafe { with_avx512(kernel) }
            }
        }
    }
}
