//! The inner loop of the grid: each body against the rest of its cell and the next, and three cells of the row above.
//!
//! Both are runs of memory of a few bodies. Loops over them would cost more in mispredicted branches than in
//! comparisons, so with AVX2 each run is compared whole, eight bodies at once, and the hits are packed and stored
//! without a branch. The pairs found are the same; their order is nobody's business (see the contract in [`super`]).

use super::{Pair, Proxies};

/// Bodies in cell order: copies of their proxies, so that the search reads memory in order.
#[derive(Default, Debug)]
pub(super) struct Sorted {
    x: Vec<f32>,
    y: Vec<f32>,
    half_x: Vec<f32>,
    half_y: Vec<f32>,
    pub(super) body: Vec<u32>,
    cell: Vec<u32>,
    len: usize,
}

/// Entries behind the last one, so that eight can be read from any.
const PADDING: usize = 8;

impl Sorted {
    pub(super) fn resize(&mut self, len: usize) {
        for column in [&mut self.x, &mut self.y, &mut self.half_x, &mut self.half_y] {
            column.resize(len + PADDING, 0.0);
        }
        self.body.resize(len + PADDING, 0);
        self.cell.resize(len + PADDING, 0);
        self.len = len;
    }

    #[inline(always)]
    pub(super) fn set(&mut self, place: usize, proxies: &Proxies, body: u32, cell: u32) {
        let i = body as usize;
        self.x[place] = proxies.x[i];
        self.y[place] = proxies.y[i];
        self.half_x[place] = proxies.half_x[i];
        self.half_y[place] = proxies.half_y[i];
        self.body[place] = body;
        self.cell[place] = cell;
    }

    /// Whether a box meets that of the body at `place`, in local coordinates with room for their rounding.
    #[inline(always)]
    pub(super) fn near(&self, [x, y, half_x, half_y]: [f32; 4], place: usize, slack: f32) -> bool {
        let apart_x = (x - self.x[place]).abs() - (half_x + self.half_x[place]);
        let apart_y = (y - self.y[place]).abs() - (half_y + self.half_y[place]);
        (apart_x <= slack) & (apart_y <= slack)
    }

    fn proxy(&self, place: usize) -> [f32; 4] {
        [self.x[place], self.y[place], self.half_x[place], self.half_y[place]]
    }
}

/// A search for the pairs among sorted bodies.
pub(super) struct Search<'a> {
    pub(super) sorted: &'a Sorted,
    pub(super) slack: f32,
    /// Pairs of two bodies from here on are not wanted.
    pub(super) owned: usize,
    pub(super) pairs: &'a mut Vec<Pair>,
}

/// Where the two runs of a body lie that hold all its neighbours not yet met.
#[inline(always)]
fn runs(start: &[u32], columns: usize, cell: usize, place: usize) -> [(usize, usize); 2] {
    let above = cell + columns;
    [(place + 1, start[cell + 2] as usize), (start[above - 1] as usize, start[above + 2] as usize)]
}

impl Search<'_> {
    /// Every pair of neighbours. `start` holds where each cell begins, `columns` how many cells a row has.
    pub(super) fn neighbours(mut self, start: &[u32], columns: usize) {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has just said that it has AVX2.
            return unsafe { self.neighbours_avx2(start, columns) };
        }
        for place in 0..self.sorted.len {
            for (first, end) in runs(start, columns, self.sorted.cell[place] as usize, place) {
                self.one_by_one(place, first, end);
            }
        }
    }

    fn one_by_one(&mut self, place: usize, first: usize, end: usize) {
        let (proxy, body) = (self.sorted.proxy(place), self.sorted.body[place]);
        for other in first..end {
            if self.sorted.near(proxy, other, self.slack) {
                super::grid::emit(self.pairs, self.owned, body, self.sorted.body[other]);
            }
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,popcnt")]
    fn neighbours_avx2(mut self, start: &[u32], columns: usize) {
        use std::arch::x86_64::*;
        let sorted = self.sorted;
        let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
        let sign = _mm256_set1_ps(-0.0);
        let slack = _mm256_set1_ps(self.slack);
        let owned = _mm256_set1_epi32(self.owned as i32);
        for place in 0..sorted.len {
            let [x, y, half_x, half_y] = sorted.proxy(place).map(|v| _mm256_set1_ps(v));
            let body = _mm256_set1_epi32(sorted.body[place] as i32);
            for (first, end) in runs(start, columns, sorted.cell[place] as usize, place) {
                let mut first = first;
                loop {
                    let eight = |column: &[f32]| {
                        let run: &[f32; 8] = column[first..first + 8].try_into().expect("eight");
                        // SAFETY: the pointer covers eight floats.
                        unsafe { _mm256_loadu_ps(run.as_ptr()) }
                    };
                    let apart = |a: __m256, b: __m256, half_a: __m256, half_b: __m256| {
                        _mm256_sub_ps(_mm256_andnot_ps(sign, _mm256_sub_ps(a, b)), _mm256_add_ps(half_a, half_b))
                    };
                    let apart_x = apart(x, eight(&sorted.x), half_x, eight(&sorted.half_x));
                    let apart_y = apart(y, eight(&sorted.y), half_y, eight(&sorted.half_y));
                    let hit = _mm256_and_ps(
                        _mm256_cmp_ps::<_CMP_LE_OQ>(apart_x, slack),
                        _mm256_cmp_ps::<_CMP_LE_OQ>(apart_y, slack),
                    );
                    let bodies: &[u32; 8] = sorted.body[first..first + 8].try_into().expect("eight");
                    // SAFETY: the pointer covers eight integers.
                    let other = unsafe { _mm256_loadu_si256(bodies.as_ptr().cast()) };
                    let (low, high) = (_mm256_min_epu32(body, other), _mm256_max_epu32(body, other));
                    let left = _mm256_set1_epi32(end as i32 - first as i32);
                    let wanted = _mm256_and_si256(_mm256_cmpgt_epi32(owned, low), _mm256_cmpgt_epi32(left, lanes));
                    let mask = _mm256_movemask_ps(_mm256_and_ps(hit, _mm256_castsi256_ps(wanted))) as usize;
                    // SAFETY: the pointer covers eight integers.
                    let packing = unsafe { _mm256_loadu_si256(PACKING[mask].as_ptr().cast()) };
                    let low = _mm256_permutevar8x32_epi32(low, packing);
                    let high = _mm256_permutevar8x32_epi32(high, packing);
                    self.pairs.reserve(8);
                    let length = self.pairs.len();
                    // Interleaving works within halves of a register: pairs 0 1 4 5 and 2 3 6 7.
                    let (even, odd) = (_mm256_unpacklo_epi32(low, high), _mm256_unpackhi_epi32(low, high));
                    // SAFETY: room for eight pairs was made, and the first `count_ones` of them are now written. A pair
                    // is two `u32` in a row.
                    unsafe {
                        let to = self.pairs.as_mut_ptr().add(length).cast::<__m256i>();
                        _mm256_storeu_si256(to, _mm256_permute2x128_si256::<0x20>(even, odd));
                        _mm256_storeu_si256(to.add(1), _mm256_permute2x128_si256::<0x31>(even, odd));
                        self.pairs.set_len(length + mask.count_ones() as usize);
                    }
                    first += 8;
                    if first >= end {
                        break;
                    }
                }
            }
        }
    }
}

/// For each set of lanes the permutation that packs them to the front.
static PACKING: [[u32; 8]; 256] = packing();

const fn packing() -> [[u32; 8]; 256] {
    let mut table = [[0; 8]; 256];
    let mut set = 0;
    while set < 256 {
        let (mut lane, mut packed) = (0, 0);
        while lane < 8 {
            if set >> lane & 1 == 1 {
                table[set][packed] = lane;
                packed += 1;
            }
            lane += 1;
        }
        set += 1;
    }
    table
}
