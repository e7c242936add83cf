//! The inner loop of the grid: each body against the rest of its cell and the next, and three cells of the row above.
//!
//! Both are runs of memory of a few bodies. Loops over them would cost more in mispredicted branches than in
//! comparisons, so each run is compared whole, eight bodies at once; with AVX-512, both runs. Nor is it asked who was found:
//! all of them are written down, and as many are counted as there are. Compared are circles, a little more generously than
//! [`Cull`](crate::collide::cull::Cull) does, which has the last word.

use super::Pair;
use super::cells::Cells;
use super::grid::Level;
use crate::model::math::max;
use crate::parallel::lanes::LaneSet;
#[cfg(target_arch = "x86_64")]
use crate::parallel::lanes::Set;
use std::ops::Range;

/// Bodies in cell order: copies of what the search compares, so that it reads memory in order.
#[derive(Default, Debug)]
pub(super) struct Sorted {
    x: Vec<f32>,
    y: Vec<f32>,
    radius: Vec<f32>,
    pub(super) body: Vec<u32>,
    cell: Vec<u32>,
    pub(super) len: usize,
}

/// Entries behind the last one, so that eight can be read from any.
const PADDING: usize = 8;

impl Sorted {
    /// Lays bodies out by cell, but for so many, which are in the last. `start[c + 1]` holds where cell `c` begins; afterwards, where
    /// it ends.
    pub(super) fn fill(&mut self, level: &Level<'_>, cells: &[u32], start: &mut [u32], without: usize) {
        self.len = level.body.len() - without;
        let padded = level.body.len() + PADDING;
        for column in [&mut self.x, &mut self.y, &mut self.radius] {
            column.resize(padded, 0.0);
        }
        self.body.resize(padded, 0);
        self.cell.resize(padded, 0);
        // One length for all columns: each place is checked once, not once per column.
        let [x, y, radius] = [&mut self.x, &mut self.y, &mut self.radius].map(|column| &mut column[..padded]);
        let (to_body, to_cell) = (&mut self.body[..padded], &mut self.cell[..padded]);
        let from = level.x.iter().zip(level.y).zip(level.radius).zip(level.body).zip(cells);
        for ((((&from_x, &from_y), &from_radius), &body), &cell) in from {
            let next = &mut start[cell as usize + 1];
            let place = *next as usize;
            *next += 1;
            (x[place], y[place], radius[place]) = (from_x, from_y, from_radius);
            (to_body[place], to_cell[place]) = (body, cell);
        }
    }

    pub(super) fn greatest_radius(&self) -> f32 {
        self.radius[..self.len].iter().copied().fold(0.0, max)
    }

    /// How many bodies a search looks at.
    #[cfg(test)]
    pub(super) fn looks(&self, cells: &impl Cells) -> usize {
        let runs = |place: usize| cells.runs(self.cell[place] as usize, place);
        (0..self.len).flat_map(runs).map(|(first, end)| end - first).sum()
    }
}

/// A search for the pairs among sorted bodies.
pub(super) struct Search<'a> {
    pub(super) sorted: &'a Sorted,
    /// Pairs of two bodies from here on are not wanted.
    pub(super) pairing: usize,
    #[cfg_attr(not(target_arch = "x86_64"), expect(dead_code))]
    pub(super) lanes: LaneSet,
    /// Whose neighbours are looked for, as places in cell order.
    pub(super) places: Range<usize>,
    pub(super) pairs: &'a mut Vec<Pair>,
}

/// Room for the rounding of everything that follows from the coordinates, for squares.
const MORE: f32 = 1.002;

/// Appends a pair, lower index first, if that is wanted.
#[inline(always)]
pub(super) fn emit(pairs: &mut Vec<Pair>, pairing: usize, a: u32, b: u32) {
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    if (low as usize) < pairing {
        pairs.push([low, high]);
    }
}

impl Search<'_> {
    /// Every pair of neighbours of which one, the first in cell order, is among `places`.
    pub(super) fn neighbours(self, cells: &impl Cells) {
        #[cfg(target_arch = "x86_64")]
        match self.lanes.set() {
            // SAFETY: the processor has AVX-512, or these lanes would not be there.
            Set::Avx512 => return unsafe { self.neighbours_avx512(cells) },
            // SAFETY: the processor has AVX2, or these lanes would not be there.
            Set::Avx2 => return unsafe { self.neighbours_avx2(cells) },
            Set::Portable => {}
        }
        let Sorted { body, cell, .. } = self.sorted;
        for place in self.places.clone() {
            for (first, end) in cells.runs(cell[place] as usize, place) {
                for other in first..end {
                    if self.may_touch(place, other) {
                        emit(self.pairs, self.pairing, body[place], body[other]);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn may_touch(&self, a: usize, b: usize) -> bool {
        let Sorted { x, y, radius, .. } = self.sorted;
        let (x, y, within) = (x[b] - x[a], y[b] - y[a], radius[a] + radius[b]);
        x * x + y * y <= within * within * MORE
    }
}

/// Vectors of the processor, for the search.
#[cfg(target_arch = "x86_64")]
mod wide {
    use super::{Cells, MORE, PADDING, Pair, Search};
    use std::arch::x86_64::*;

    /// Room for so many more pairs, and where they go.
    #[inline(always)]
    fn room(pairs: &mut Vec<Pair>, more: usize) -> *mut Pair {
        if pairs.capacity() - pairs.len() < more {
            pairs.reserve(more.max(pairs.len()));
        }
        pairs.spare_capacity_mut().as_mut_ptr().cast()
    }

    /// For each set of lanes which of them those are that come first, when they are put together.
    static TOGETHER: [[u32; 8]; 256] = {
        let mut together = [[0; 8]; 256];
        let mut set = 0;
        while set < 256 {
            let (mut lane, mut count) = (0, 0);
            while lane < 8 {
                if set >> lane & 1 == 1 {
                    together[set][count] = lane;
                    count += 1;
                }
                lane += 1;
            }
            set += 1;
        }
        together
    };

    /// The lowest lanes, as many as are left of eight.
    #[inline(always)]
    fn lowest(left: usize) -> u32 {
        (1 << left.min(8)) - 1
    }

    impl Search<'_> {
        #[target_feature(enable = "avx2,popcnt")]
        pub(super) fn neighbours_avx2(self, around: &impl Cells) {
            let Self { sorted, pairing, places, pairs, .. } = self;
            // One length for all: each place is checked once, not once per column.
            let padded = sorted.len + PADDING;
            let (xs, ys, radii) = (&sorted.x[..padded], &sorted.y[..padded], &sorted.radius[..padded]);
            let (bodies, cells) = (&sorted.body[..padded], &sorted.cell[..padded]);
            let (more, pairing) = (_mm256_set1_ps(MORE), _mm256_set1_epi32(pairing as i32));
            for place in places {
                let (x, y) = (_mm256_set1_ps(xs[place]), _mm256_set1_ps(ys[place]));
                let (radius, body) = (_mm256_set1_ps(radii[place]), _mm256_set1_epi32(bodies[place] as i32));
                for (mut first, end) in around.runs(cells[place] as usize, place) {
                    loop {
                        let all = first..first + 8;
                        // SAFETY: each of these slices has eight numbers.
                        let (other_x, other_y, other_radius, other) = unsafe {
                            (
                                _mm256_loadu_ps(xs[all.clone()].as_ptr()),
                                _mm256_loadu_ps(ys[all.clone()].as_ptr()),
                                _mm256_loadu_ps(radii[all.clone()].as_ptr()),
                                _mm256_loadu_si256(bodies[all].as_ptr().cast()),
                            )
                        };
                        let (apart_x, apart_y) = (_mm256_sub_ps(other_x, x), _mm256_sub_ps(other_y, y));
                        let square = _mm256_add_ps(_mm256_mul_ps(apart_x, apart_x), _mm256_mul_ps(apart_y, apart_y));
                        let within = _mm256_add_ps(radius, other_radius);
                        let within = _mm256_mul_ps(_mm256_mul_ps(within, within), more);
                        let near = _mm256_cmp_ps::<_CMP_LE_OQ>(square, within);
                        let (low, high) = (_mm256_min_epi32(body, other), _mm256_max_epi32(body, other));
                        let wanted = _mm256_and_ps(near, _mm256_castsi256_ps(_mm256_cmpgt_epi32(pairing, low)));
                        // Lanes behind the end of the run are not meant.
                        let hits = _mm256_movemask_ps(wanted) as u32 & lowest(end.saturating_sub(first));
                        let to = room(pairs, 8);
                        // SAFETY: there is room for eight pairs, and as many are there as there were hits.
                        unsafe {
                            let together = _mm256_loadu_si256(TOGETHER[hits as usize].as_ptr().cast());
                            let low = _mm256_permutevar8x32_epi32(low, together);
                            let high = _mm256_permutevar8x32_epi32(high, together);
                            let (a, b) = (_mm256_unpacklo_epi32(low, high), _mm256_unpackhi_epi32(low, high));
                            _mm256_storeu_si256(to.cast(), _mm256_permute2x128_si256::<0x20>(a, b));
                            _mm256_storeu_si256(to.add(4).cast(), _mm256_permute2x128_si256::<0x31>(a, b));
                            pairs.set_len(pairs.len() + hits.count_ones() as usize);
                        }
                        first += 8;
                        if first >= end {
                            break;
                        }
                    }
                }
            }
        }

        #[target_feature(enable = "avx2,avx512f,avx512vl,avx512bw,avx512dq,popcnt")]
        pub(super) fn neighbours_avx512(self, around: &impl Cells) {
            let Self { sorted, pairing, places, pairs, .. } = self;
            let padded = sorted.len + PADDING;
            let (xs, ys, radii) = (&sorted.x[..padded], &sorted.y[..padded], &sorted.radius[..padded]);
            let (bodies, cells) = (&sorted.body[..padded], &sorted.cell[..padded]);
            let (more, pairing) = (_mm512_set1_ps(MORE), _mm512_set1_epi32(pairing as i32));
            // Of two vectors of sixteen, their first eight in turn, and their last eight.
            let first_half = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
            let last_half = _mm512_setr_epi32(8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
            for place in places {
                let (x, y) = (_mm512_set1_ps(xs[place]), _mm512_set1_ps(ys[place]));
                let (radius, body) = (_mm512_set1_ps(radii[place]), _mm512_set1_epi32(bodies[place] as i32));
                let [(mut a, end_a), (mut b, end_b)] = around.runs(cells[place] as usize, place);
                loop {
                    let (all_a, all_b) = (a..a + 8, b..b + 8);
                    let both = |column: &[f32]| {
                        let (a, b) = (&column[all_a.clone()], &column[all_b.clone()]);
                        // SAFETY: each of these slices has eight numbers.
                        unsafe {
                            let (a, b) = (_mm256_loadu_ps(a.as_ptr()), _mm256_loadu_ps(b.as_ptr()));
                            _mm512_insertf32x8::<1>(_mm512_castps256_ps512(a), b)
                        }
                    };
                    let (apart_x, apart_y) = (_mm512_sub_ps(both(xs), x), _mm512_sub_ps(both(ys), y));
                    let square = _mm512_add_ps(_mm512_mul_ps(apart_x, apart_x), _mm512_mul_ps(apart_y, apart_y));
                    let within = _mm512_add_ps(radius, both(radii));
                    let near =
                        _mm512_cmp_ps_mask::<_CMP_LE_OQ>(square, _mm512_mul_ps(_mm512_mul_ps(within, within), more));
                    // SAFETY: each of these slices has eight numbers.
                    let other = unsafe {
                        let a = _mm256_loadu_si256(bodies[all_a.clone()].as_ptr().cast());
                        let b = _mm256_loadu_si256(bodies[all_b.clone()].as_ptr().cast());
                        _mm512_inserti32x8::<1>(_mm512_castsi256_si512(a), b)
                    };
                    let (low, high) = (_mm512_min_epi32(body, other), _mm512_max_epi32(body, other));
                    // Lanes behind the ends of the runs are not meant.
                    let meant = lowest(end_a.saturating_sub(a)) | lowest(end_b.saturating_sub(b)) << 8;
                    let hits = near & _mm512_cmplt_epi32_mask(low, pairing) & meant as u16;
                    let to = room(pairs, 16);
                    // SAFETY: there is room for sixteen pairs, and as many are there as there were hits.
                    unsafe {
                        let low = _mm512_maskz_compress_epi32(hits, low);
                        let high = _mm512_maskz_compress_epi32(hits, high);
                        _mm512_storeu_si512(to.cast(), _mm512_permutex2var_epi32(low, first_half, high));
                        if hits.count_ones() > 8 {
                            _mm512_storeu_si512(to.add(8).cast(), _mm512_permutex2var_epi32(low, last_half, high));
                        }
                        pairs.set_len(pairs.len() + hits.count_ones() as usize);
                    }
                    (a, b) = (a + 8, b + 8);
                    if a >= end_a && b >= end_b {
                        break;
                    }
                    // The shorter run ends before the longer; what is read behind it is not meant.
                    (a, b) = (a.min(sorted.len), b.min(sorted.len));
                }
            }
        }
    }
}
