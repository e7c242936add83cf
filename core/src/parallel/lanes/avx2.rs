//! Eight lanes in one 256-bit register, and sixteen in two.
//!
//! Every method is inlined into a function compiled for AVX2 or more, which [`super::LaneSet::run`] calls only after the
//! processor was asked; no other code names this type.
use super::{Arithmetic, LANES, Lanes, Pair, Place, Quad, Row, Twice, Wide};
use std::arch::x86_64::*;
use std::cell::Cell;
use std::marker::PhantomData;

/// A set of instructions that has those of AVX2: it decides what sixteen lanes are.
pub(crate) trait Registers: Copy {
    type Wide: Wide;
}

/// AVX2 alone.
#[derive(Clone, Copy)]
pub(crate) struct Avx2;

impl Registers for Avx2 {
    type Wide = Twice<Eight<Self>>;
}

/// Eight lanes.
#[derive(Clone, Copy)]
pub(crate) struct Eight<S>(__m256, PhantomData<S>);

impl<S> Eight<S> {
    #[inline(always)]
    fn of(register: __m256) -> Self {
        Self(register, PhantomData)
    }
}

/// Of eight pairs, four in each register, their first numbers and their second ones; and back.
#[inline(always)]
fn part(low: __m256, high: __m256) -> [__m256; 2] {
    // SAFETY: AVX2 is there (see the module).
    unsafe {
        [in_turn(_mm256_shuffle_ps::<0b10_00_10_00>(low, high)), in_turn(_mm256_shuffle_ps::<0b11_01_11_01>(low, high))]
    }
}

#[inline(always)]
fn join([first, second]: [__m256; 2]) -> [__m256; 2] {
    let (first, second) = (in_turn(first), in_turn(second));
    // SAFETY: AVX2 is there (see the module).
    unsafe { [_mm256_unpacklo_ps(first, second), _mm256_unpackhi_ps(first, second)] }
}

/// The two middle quarters in each other's place.
#[inline(always)]
fn in_turn(v: __m256) -> __m256 {
    // SAFETY: AVX2 is there (see the module).
    unsafe { _mm256_castpd_ps(_mm256_permute4x64_pd::<0b11_01_10_00>(_mm256_castps_pd(v))) }
}

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

impl<S: Registers> Arithmetic for Eight<S> {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        // SAFETY: AVX2 is there (see the module).
        Self::of(unsafe { _mm256_set1_ps(x) })
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // SAFETY: AVX2 is there (see the module).
        Self::of(unsafe { _mm256_add_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        // SAFETY: AVX2 is there (see the module).
        Self::of(unsafe { _mm256_sub_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // SAFETY: AVX2 is there (see the module).
        Self::of(unsafe { _mm256_mul_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        // SAFETY: AVX2 is there (see the module).
        Self::of(unsafe { _mm256_div_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: AVX2 is there (see the module).
        Self::of(unsafe { _mm256_sqrt_ps(self.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: AVX2 is there. `maxps` returns its second operand where they compare equal or not at all.
        Self::of(unsafe { _mm256_max_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: AVX2 is there. `minps` returns its second operand where they compare equal or not at all.
        Self::of(unsafe { _mm256_min_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn if_positive(self, yes: Self, no: Self) -> Self {
        // SAFETY: AVX2 is there (see the module).
        unsafe {
            let mask = _mm256_cmp_ps::<_CMP_GT_OQ>(self.0, _mm256_setzero_ps());
            Self::of(_mm256_blendv_ps(no.0, yes.0, mask))
        }
    }
}

impl<S: Registers> Lanes for Eight<S> {
    const HAS_REGISTERS: bool = true;
    type Wide = S::Wide;
    #[inline(always)]
    fn load(from: &Row) -> Self {
        // SAFETY: AVX2 is there; the pointer covers eight floats.
        Self::of(unsafe { _mm256_loadu_ps(from.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, to: &mut Row) {
        // SAFETY: AVX2 is there; the pointer covers eight floats.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self.0) }
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
        [Self::of(a), Self::of(b), Self::of(c), Self::of(d)]
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
        [Self::of(a), Self::of(b), Self::of(c), Self::of(d)]
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
    #[inline(always)]
    fn gather_fixed(from: &[Quad], index: &[u32; LANES]) -> [Self; 4] {
        let [a, b, c, d] = transpose([
            two_quads(&from[index[0] as usize], &from[index[4] as usize]),
            two_quads(&from[index[1] as usize], &from[index[5] as usize]),
            two_quads(&from[index[2] as usize], &from[index[6] as usize]),
            two_quads(&from[index[3] as usize], &from[index[7] as usize]),
        ]);
        [Self::of(a), Self::of(b), Self::of(c), Self::of(d)]
    }
    #[inline(always)]
    fn load_pairs(from: &[Pair; LANES]) -> [Self; 2] {
        let from = from.as_ptr().cast::<f32>();
        // SAFETY: AVX2 is there; eight pairs are sixteen floats.
        let [a, b] = unsafe { part(_mm256_loadu_ps(from), _mm256_loadu_ps(from.add(8))) };
        [Self::of(a), Self::of(b)]
    }
    #[inline(always)]
    fn store_pairs([a, b]: [Self; 2], to: &mut [Pair; LANES]) {
        let [low, high] = join([a.0, b.0]);
        let to = to.as_mut_ptr().cast::<f32>();
        // SAFETY: AVX2 is there; eight pairs are sixteen floats.
        unsafe {
            _mm256_storeu_ps(to, low);
            _mm256_storeu_ps(to.add(8), high);
        }
    }
    #[inline(always)]
    fn seen_from(origin: Place, places: &[Place; LANES]) -> [Self; 2] {
        let from = places.as_ptr().cast::<f64>();
        // SAFETY: AVX2 is there; eight places are sixteen numbers.
        unsafe {
            let origin = _mm256_setr_pd(origin[0], origin[1], origin[0], origin[1]);
            let (a, b) = (_mm256_loadu_pd(from), _mm256_loadu_pd(from.add(4)));
            let (c, d) = (_mm256_loadu_pd(from.add(8)), _mm256_loadu_pd(from.add(12)));
            let (a, b) = (_mm256_cvtpd_ps(_mm256_sub_pd(a, origin)), _mm256_cvtpd_ps(_mm256_sub_pd(b, origin)));
            let (c, d) = (_mm256_cvtpd_ps(_mm256_sub_pd(c, origin)), _mm256_cvtpd_ps(_mm256_sub_pd(d, origin)));
            let [a, b] = part(_mm256_set_m128(b, a), _mm256_set_m128(d, c));
            [Self::of(a), Self::of(b)]
        }
    }
    #[inline(always)]
    fn advance([x, y]: [Self; 2], places: &mut [Place; LANES]) {
        let [low, high] = join([x.0, y.0]);
        let to = places.as_mut_ptr().cast::<f64>();
        // SAFETY: AVX2 is there; eight places are sixteen numbers.
        unsafe {
            let by = [
                _mm256_castps256_ps128(low),
                _mm256_extractf128_ps::<1>(low),
                _mm256_castps256_ps128(high),
                _mm256_extractf128_ps::<1>(high),
            ];
            for (k, by) in by.into_iter().enumerate() {
                let to = to.add(4 * k);
                _mm256_storeu_pd(to, _mm256_add_pd(_mm256_loadu_pd(to), _mm256_cvtps_pd(by)));
            }
        }
    }
    #[inline(always)]
    fn are_within(places: &[Place; LANES], low: Place, high: Place) -> bool {
        let from = places.as_ptr().cast::<f64>();
        // SAFETY: AVX2 is there; eight places are sixteen numbers.
        unsafe {
            let low = _mm256_setr_pd(low[0], low[1], low[0], low[1]);
            let high = _mm256_setr_pd(high[0], high[1], high[0], high[1]);
            let mut all = _mm256_castsi256_pd(_mm256_set1_epi64x(-1));
            for k in 0..4 {
                let two = _mm256_loadu_pd(from.add(4 * k));
                let within =
                    _mm256_and_pd(_mm256_cmp_pd::<_CMP_GE_OQ>(two, low), _mm256_cmp_pd::<_CMP_LT_OQ>(two, high));
                all = _mm256_and_pd(all, within);
            }
            _mm256_movemask_pd(all) == 0b1111
        }
    }
    #[inline(always)]
    fn all_below(self, most: f32) -> bool {
        // SAFETY: AVX2 is there (see the module).
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, _mm256_set1_ps(most))) == 0xff }
    }
}
