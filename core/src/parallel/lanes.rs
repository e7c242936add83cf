//! Eight numbers at once, the same bits on every machine.
//!
//! A kernel is written once, generic over [`Lanes`], and compiled for plain x86-64 (or any other target) with arrays, for
//! AVX2 with vector registers, and for AVX-512 with twice as many of them. Every operation is the IEEE one, lane by lane, so
//! all give the same bits; how many lanes a register has never decides how work is grouped.

use crate::model::params::Instructions;
use std::cell::Cell;

#[cfg(test)]
mod tests;

/// How many numbers a [`Lanes`] holds. Part of the result's definition nowhere, of the memory layout everywhere.
pub(crate) const LANES: usize = 8;

/// Eight numbers, as they lie in memory.
pub(crate) type Row = [f32; LANES];

/// Four numbers of one body, read and written together.
pub(crate) type Quad = [f32; 4];

/// Arithmetic on eight lanes.
pub(crate) trait Lanes: Copy {
    fn splat(x: f32) -> Self;
    fn load(from: &Row) -> Self;
    fn store(self, to: &mut Row);
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
    /// The four columns of the eight quads at `index`.
    fn gather(from: &[Cell<Quad>], index: &[u32; LANES]) -> [Self; 4];
    /// The inverse of [`Lanes::gather`].
    fn scatter(columns: [Self; 4], to: &[Cell<Quad>], index: &[u32; LANES]);
    /// The four columns of eight quads in a row.
    fn load_quads(from: &[Quad; LANES]) -> [Self; 4];
    /// The inverse of [`Lanes::load_quads`].
    fn store_quads(columns: [Self; 4], to: &mut [Quad; LANES]);
    /// As [`Lanes::gather`], of quads that nobody changes.
    #[inline(always)]
    fn gather_fixed(from: &[Quad], index: &[u32; LANES]) -> [Self; 4] {
        let mut quads = [[0.0; 4]; LANES];
        for (quad, &i) in quads.iter_mut().zip(index) {
            *quad = from[i as usize];
        }
        Self::load_quads(&quads)
    }
}

/// Plain arrays: the reference, and what other processors run.
#[derive(Clone, Copy)]
pub(crate) struct Portable(Row);

impl Portable {
    #[inline(always)]
    fn map2(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|l| f(self.0[l], other.0[l])))
    }
}

impl Lanes for Portable {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; LANES])
    }
    #[inline(always)]
    fn load(from: &Row) -> Self {
        Self(*from)
    }
    #[inline(always)]
    fn store(self, to: &mut Row) {
        *to = self.0;
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.map2(other, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.map2(other, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.map2(other, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.map2(other, |a, b| a / b)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.map2(other, crate::model::math::max)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.map2(other, crate::model::math::min)
    }
    #[inline(always)]
    fn if_positive(self, yes: Self, no: Self) -> Self {
        Self(std::array::from_fn(|l| if self.0[l] > 0.0 { yes.0[l] } else { no.0[l] }))
    }
    #[inline(always)]
    fn gather(from: &[Cell<Quad>], index: &[u32; LANES]) -> [Self; 4] {
        let quads = index.map(|i| from[i as usize].get());
        Self::load_quads(&quads)
    }
    #[inline(always)]
    fn scatter(columns: [Self; 4], to: &[Cell<Quad>], index: &[u32; LANES]) {
        for (l, &i) in index.iter().enumerate() {
            to[i as usize].set(columns.map(|column| column.0[l]));
        }
    }
    #[inline(always)]
    fn load_quads(from: &[Quad; LANES]) -> [Self; 4] {
        std::array::from_fn(|c| Self(std::array::from_fn(|l| from[l][c])))
    }
    #[inline(always)]
    fn store_quads(columns: [Self; 4], to: &mut [Quad; LANES]) {
        for (l, quad) in to.iter_mut().enumerate() {
            *quad = columns.map(|column| column.0[l]);
        }
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) use avx2::Avx2;

#[cfg(target_arch = "x86_64")]
mod avx2 {
    //! Eight lanes in one 256-bit register.
    //!
    //! Every method is inlined into a function compiled for AVX2 or more, which [`super::LaneSet::run`] calls only after the
    //! processor was asked; no other code names this type.
    use super::{LANES, Lanes, Quad, Row};
    use std::arch::x86_64::*;
    use std::cell::Cell;

    #[derive(Clone, Copy)]
    pub(crate) struct Avx2(__m256);

    /// Eight rows of four to four columns of eight. `rows[l]` holds quad `l` in its low half and quad `l + 4` in its
    /// high half.
    #[inline(always)]
    fn transpose(rows: [__m256; 4]) -> [__m256; 4] {
        // SAFETY: AVX2 is there (see the module).
        unsafe {
            let a = _mm256_unpacklo_ps(rows[0], rows[1]);
            let b = _mm256_unpackhi_ps(rows[0], rows[1]);
            let c = _mm256_unpacklo_ps(rows[2], rows[3]);
            let d = _mm256_unpackhi_ps(rows[2], rows[3]);
            [
                _mm256_shuffle_ps::<0b0100_0100>(a, c),
                _mm256_shuffle_ps::<0b1110_1110>(a, c),
                _mm256_shuffle_ps::<0b0100_0100>(b, d),
                _mm256_shuffle_ps::<0b1110_1110>(b, d),
            ]
        }
    }

    #[inline(always)]
    fn two_quads(low: *const Quad, high: *const Quad) -> __m256 {
        // SAFETY: AVX2 is there; each pointer comes from a reference and covers four floats.
        unsafe { _mm256_loadu2_m128(high.cast(), low.cast()) }
    }

    impl Lanes for Avx2 {
        #[inline(always)]
        fn splat(x: f32) -> Self {
            // SAFETY: AVX2 is there (see the module).
            Self(unsafe { _mm256_set1_ps(x) })
        }
        #[inline(always)]
        fn load(from: &Row) -> Self {
            // SAFETY: AVX2 is there; the pointer covers eight floats.
            Self(unsafe { _mm256_loadu_ps(from.as_ptr()) })
        }
        #[inline(always)]
        fn store(self, to: &mut Row) {
            // SAFETY: AVX2 is there; the pointer covers eight floats.
            unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            // SAFETY: AVX2 is there (see the module).
            Self(unsafe { _mm256_add_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            // SAFETY: AVX2 is there (see the module).
            Self(unsafe { _mm256_sub_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            // SAFETY: AVX2 is there (see the module).
            Self(unsafe { _mm256_mul_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn div(self, other: Self) -> Self {
            // SAFETY: AVX2 is there (see the module).
            Self(unsafe { _mm256_div_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            // SAFETY: AVX2 is there (see the module).
            Self(unsafe { _mm256_sqrt_ps(self.0) })
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            // SAFETY: AVX2 is there. `maxps` returns its second operand where they compare equal or not at all.
            Self(unsafe { _mm256_max_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            // SAFETY: AVX2 is there. `minps` returns its second operand where they compare equal or not at all.
            Self(unsafe { _mm256_min_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn if_positive(self, yes: Self, no: Self) -> Self {
            // SAFETY: AVX2 is there (see the module).
            unsafe {
                let mask = _mm256_cmp_ps::<_CMP_GT_OQ>(self.0, _mm256_setzero_ps());
                Self(_mm256_blendv_ps(no.0, yes.0, mask))
            }
        }
        #[inline(always)]
        fn gather(from: &[Cell<Quad>], index: &[u32; LANES]) -> [Self; 4] {
            // Written out, here and below: closures that a library function calls might be compiled without AVX2.
            let quad = |l: usize| from[index[l] as usize].as_ptr().cast_const();
            let [a, b, c, d] = transpose([
                two_quads(quad(0), quad(4)),
                two_quads(quad(1), quad(5)),
                two_quads(quad(2), quad(6)),
                two_quads(quad(3), quad(7)),
            ]);
            [Self(a), Self(b), Self(c), Self(d)]
        }
        #[inline(always)]
        fn scatter(columns: [Self; 4], to: &[Cell<Quad>], index: &[u32; LANES]) {
            let [a, b, c, d] = columns;
            for (l, row) in transpose([a.0, b.0, c.0, d.0]).into_iter().enumerate() {
                // SAFETY: AVX2 is there; the slices are bounds-checked and cover four floats each.
                unsafe {
                    _mm_storeu_ps(to[index[l] as usize].as_ptr().cast(), _mm256_castps256_ps128(row));
                    _mm_storeu_ps(to[index[l + 4] as usize].as_ptr().cast(), _mm256_extractf128_ps::<1>(row));
                }
            }
        }
        #[inline(always)]
        fn load_quads(from: &[Quad; LANES]) -> [Self; 4] {
            let [a, b, c, d] = transpose([
                two_quads(&from[0], &from[4]),
                two_quads(&from[1], &from[5]),
                two_quads(&from[2], &from[6]),
                two_quads(&from[3], &from[7]),
            ]);
            [Self(a), Self(b), Self(c), Self(d)]
        }
        #[inline(always)]
        fn store_quads(columns: [Self; 4], to: &mut [Quad; LANES]) {
            let [a, b, c, d] = columns;
            for (l, row) in transpose([a.0, b.0, c.0, d.0]).into_iter().enumerate() {
                // SAFETY: AVX2 is there; each quad covers four floats.
                unsafe {
                    _mm_storeu_ps(to[l].as_mut_ptr(), _mm256_castps256_ps128(row));
                    _mm_storeu_ps(to[l + 4].as_mut_ptr(), _mm256_extractf128_ps::<1>(row));
                }
            }
        }
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

    /// Runs a kernel. The result does not depend on which lanes these are.
    #[inline]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            Set::Portable => kernel.run::<Portable>(),
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => {
                #[target_feature(enable = "avx2")]
                fn with_avx2<K: Kernel>(kernel: K) -> K::Output {
                    kernel.run::<Avx2>()
                }
                // SAFETY: the processor has said that it has AVX2, or this would not be this set.
                unsafe { with_avx2(kernel) }
            }
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => {
                // Eight lanes as well, and 32 registers for them.
                #[target_feature(enable = "avx2,avx512f,avx512vl,avx512bw,avx512dq")]
                fn with_avx512<K: Kernel>(kernel: K) -> K::Output {
                    kernel.run::<Avx2>()
                }
                // SAFETY: the processor has said that it has all of these, or this would not be this set.
                unsafe { with_avx512(kernel) }
            }
        }
    }
}
