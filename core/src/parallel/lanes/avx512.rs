//! Sixteen lanes in one 512-bit register.
//!
//! Every method is inlined into a function compiled for AVX-512, which [`super::LaneSet::run`] calls only after the processor was
//! asked; no other code names this type.
use super::avx2::Registers;
use super::{Arithmetic, Quad, WIDE, Wide, WideRow};
use std::arch::x86_64::*;
use std::cell::Cell;

/// AVX-512, of which eight lanes use the registers: there are twice as many.
#[derive(Clone, Copy)]
pub(crate) struct Avx512;

impl Registers for Avx512 {
    type Wide = Sixteen;
}

/// Sixteen lanes.
#[derive(Clone, Copy)]
pub(crate) struct Sixteen(__m512);

/// Sixteen rows of four to four columns of sixteen, and back. `rows[l]` holds the quads `l`, `l + 4`, `l + 8` and `l + 12`.
#[inline(always)]
fn transpose(rows: [__m512; 4]) -> [__m512; 4] {
    // SAFETY: AVX-512 is there (see the module).
    unsafe {
        let a = _mm512_unpacklo_ps(rows[0], rows[1]);
        let b = _mm512_unpackhi_ps(rows[0], rows[1]);
        let c = _mm512_unpacklo_ps(rows[2], rows[3]);
        let d = _mm512_unpackhi_ps(rows[2], rows[3]);
        [
            _mm512_shuffle_ps::<0b0100_0100>(a, c),
            _mm512_shuffle_ps::<0b1110_1110>(a, c),
            _mm512_shuffle_ps::<0b0100_0100>(b, d),
            _mm512_shuffle_ps::<0b1110_1110>(b, d),
        ]
    }
}

#[inline(always)]
fn four_quads(quads: [*const Quad; 4]) -> __m512 {
    // SAFETY: AVX-512 is there; each pointer comes from a reference and covers four floats.
    unsafe {
        let low = _mm512_castps128_ps512(_mm_loadu_ps(quads[0].cast()));
        let low = _mm512_insertf32x4::<1>(low, _mm_loadu_ps(quads[1].cast()));
        let low = _mm512_insertf32x4::<2>(low, _mm_loadu_ps(quads[2].cast()));
        _mm512_insertf32x4::<3>(low, _mm_loadu_ps(quads[3].cast()))
    }
}

impl Arithmetic for Sixteen {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        // SAFETY: AVX-512 is there (see the module).
        Self(unsafe { _mm512_set1_ps(x) })
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // SAFETY: AVX-512 is there (see the module).
        Self(unsafe { _mm512_add_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        // SAFETY: AVX-512 is there (see the module).
        Self(unsafe { _mm512_sub_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // SAFETY: AVX-512 is there (see the module).
        Self(unsafe { _mm512_mul_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        // SAFETY: AVX-512 is there (see the module).
        Self(unsafe { _mm512_div_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: AVX-512 is there (see the module).
        Self(unsafe { _mm512_sqrt_ps(self.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: AVX-512 is there. `maxps` returns its second operand where they compare equal or not at all.
        Self(unsafe { _mm512_max_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: AVX-512 is there. `minps` returns its second operand where they compare equal or not at all.
        Self(unsafe { _mm512_min_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn if_positive(self, yes: Self, no: Self) -> Self {
        // SAFETY: AVX-512 is there (see the module).
        unsafe {
            let positive = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(self.0, _mm512_setzero_ps());
            Self(_mm512_mask_blend_ps(positive, no.0, yes.0))
        }
    }
}

impl Wide for Sixteen {
    #[inline(always)]
    fn load(from: &WideRow) -> Self {
        // SAFETY: AVX-512 is there; the pointer covers sixteen floats.
        Self(unsafe { _mm512_loadu_ps(from.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, to: &mut WideRow) {
        // SAFETY: AVX-512 is there; the pointer covers sixteen floats.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn gather(from: &[Cell<Quad>], index: &[u32; WIDE]) -> [Self; 4] {
        // Written out, here and below: closures that a library function calls might be compiled without AVX-512.
        let quad = |l: usize| from[index[l] as usize].as_ptr().cast_const();
        let [a, b, c, d] = transpose([
            four_quads([quad(0), quad(4), quad(8), quad(12)]),
            four_quads([quad(1), quad(5), quad(9), quad(13)]),
            four_quads([quad(2), quad(6), quad(10), quad(14)]),
            four_quads([quad(3), quad(7), quad(11), quad(15)]),
        ]);
        [Self(a), Self(b), Self(c), Self(d)]
    }
    #[inline(always)]
    fn scatter(columns: [Self; 4], to: &[Cell<Quad>], index: &[u32; WIDE]) {
        let [a, b, c, d] = columns;
        for (l, row) in transpose([a.0, b.0, c.0, d.0]).into_iter().enumerate() {
            // SAFETY: AVX-512 is there; the slices are bounds-checked and cover four floats each.
            unsafe {
                _mm_storeu_ps(to[index[l] as usize].as_ptr().cast(), _mm512_castps512_ps128(row));
                _mm_storeu_ps(to[index[l + 4] as usize].as_ptr().cast(), _mm512_extractf32x4_ps::<1>(row));
                _mm_storeu_ps(to[index[l + 8] as usize].as_ptr().cast(), _mm512_extractf32x4_ps::<2>(row));
                _mm_storeu_ps(to[index[l + 12] as usize].as_ptr().cast(), _mm512_extractf32x4_ps::<3>(row));
            }
        }
    }
    #[inline(always)]
    fn load_quads(from: &[Quad; WIDE]) -> [Self; 4] {
        let [a, b, c, d] = transpose([
            four_quads([&from[0], &from[4], &from[8], &from[12]]),
            four_quads([&from[1], &from[5], &from[9], &from[13]]),
            four_quads([&from[2], &from[6], &from[10], &from[14]]),
            four_quads([&from[3], &from[7], &from[11], &from[15]]),
        ]);
        [Self(a), Self(b), Self(c), Self(d)]
    }
    #[inline(always)]
    fn store_quads([a, b, c, d]: [Self; 4], to: &mut [Quad; WIDE]) {
        for (l, row) in transpose([a.0, b.0, c.0, d.0]).into_iter().enumerate() {
            // SAFETY: AVX-512 is there; the slices are bounds-checked and cover four floats each.
            unsafe {
                _mm_storeu_ps(to[l].as_mut_ptr(), _mm512_castps512_ps128(row));
                _mm_storeu_ps(to[l + 4].as_mut_ptr(), _mm512_extractf32x4_ps::<1>(row));
                _mm_storeu_ps(to[l + 8].as_mut_ptr(), _mm512_extractf32x4_ps::<2>(row));
                _mm_storeu_ps(to[l + 12].as_mut_ptr(), _mm512_extractf32x4_ps::<3>(row));
            }
        }
    }
    #[inline(always)]
    fn any_positive(self) -> bool {
        // SAFETY: AVX-512 is there (see the module).
        unsafe { _mm512_cmp_ps_mask::<_CMP_GT_OQ>(self.0, _mm512_setzero_ps()) != 0 }
    }
}
