//! The inner loop of the grid: each body against the rest of its cell and the next, and three cells of the row above.
//!
//! Both are runs of memory of a few bodies. Loops over them would cost more in mispredicted branches than in
//! comparisons, so with AVX2 each run is compared whole, eight bodies at once. Compared are bounding circles and speeds,
//! a little more generously than [`Proxies::is_pair`] does, which has the last word.

use super::Pair;
use crate::collide::proxies::Proxies;
use crate::parallel::lanes::LaneSet;
use std::ops::Range;

/// Bodies in cell order: copies of what the search compares, so that it reads memory in order.
#[derive(Default, Debug)]
pub(super) struct Sorted {
    x: Vec<f32>,
    y: Vec<f32>,
    velocity_x: Vec<f32>,
    velocity_y: Vec<f32>,
    reach: Vec<f32>,
    pub(super) body: Vec<u32>,
    cell: Vec<u32>,
    pub(super) len: usize,
}

/// Entries behind the last one, so that eight can be read from any.
const PADDING: usize = 8;

impl Sorted {
    /// Lays bodies out by cell. `start[c + 1]` holds where cell `c` begins; afterwards, where it ends.
    pub(super) fn fill(&mut self, proxies: &Proxies, bodies: &[u32], cells: &[u32], start: &mut [u32]) {
        self.len = bodies.len();
        let (all, padded) = (proxies.len(), self.len + PADDING);
        for column in [&mut self.x, &mut self.y, &mut self.velocity_x, &mut self.velocity_y, &mut self.reach] {
            column.resize(padded, 0.0);
        }
        self.body.resize(padded, 0);
        self.cell.resize(padded, 0);
        // One length for all columns on either side: each index is checked once, not once per column.
        let from = [&proxies.x, &proxies.y, &proxies.velocity_x, &proxies.velocity_y, &proxies.reach, &proxies.slack];
        let from = from.map(|column| &column[..all]);
        let to = [&mut self.x, &mut self.y, &mut self.velocity_x, &mut self.velocity_y, &mut self.reach];
        let [x, y, velocity_x, velocity_y, reach] = to.map(|column| &mut column[..padded]);
        let (to_body, to_cell) = (&mut self.body[..padded], &mut self.cell[..padded]);
        for (&body, &cell) in bodies.iter().zip(cells) {
            let next = &mut start[cell as usize + 1];
            let (i, place) = (body as usize, *next as usize);
            *next += 1;
            x[place] = from[0][i];
            y[place] = from[1][i];
            velocity_x[place] = from[2][i];
            velocity_y[place] = from[3][i];
            // Distances here come from local coordinates.
            reach[place] = from[4][i] + 2.0 * from[5][i];
            to_body[place] = body;
            to_cell[place] = cell;
        }
    }
}

/// A search for the pairs among sorted bodies.
pub(super) struct Search<'a> {
    pub(super) sorted: &'a Sorted,
    /// Pairs of two bodies from here on are not wanted.
    pub(super) pairing: usize,
    /// Length of a step, in seconds.
    pub(super) dt: f32,
    pub(super) lanes: LaneSet,
    /// Whose neighbours are looked for, as places in cell order.
    pub(super) places: Range<usize>,
    pub(super) pairs: &'a mut Vec<Pair>,
}

/// Room for the rounding of everything that follows from the coordinates.
const MORE: f32 = 1.001;

/// Appends a pair, lower index first, if that is wanted.
#[inline(always)]
pub(super) fn emit(pairs: &mut Vec<Pair>, pairing: usize, a: u32, b: u32) {
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    if (low as usize) < pairing {
        pairs.push([low, high]);
    }
}

/// Where the two runs of a body lie that hold all its neighbours not yet met.
#[inline(always)]
fn runs(start: &[u32], columns: usize, cell: usize, place: usize) -> [(usize, usize); 2] {
    let above = cell + columns;
    [(place + 1, start[cell + 2] as usize), (start[above - 1] as usize, start[above + 2] as usize)]
}

impl Search<'_> {
    /// Every pair of neighbours of which one, the first in cell order, is among `places`. `start` holds where each cell begins, `columns` how many cells a row has.
    pub(super) fn neighbours(mut self, start: &[u32], columns: usize) {
        #[cfg(target_arch = "x86_64")]
        if self.lanes.has_avx2() {
            // SAFETY: the processor has AVX2, or these lanes would not be there.
            return unsafe { self.neighbours_avx2(start, columns) };
        }
        for place in self.places.clone() {
            for (first, end) in runs(start, columns, self.sorted.cell[place] as usize, place) {
                for other in first..end {
                    if self.may_touch(place, other) {
                        self.emit(place, other);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn may_touch(&self, a: usize, b: usize) -> bool {
        let Sorted { x, y, velocity_x, velocity_y, reach, .. } = self.sorted;
        let length = |x: f32, y: f32| (x * x + y * y).sqrt();
        let distance = length(x[b] - x[a], y[b] - y[a]);
        let speed = length(velocity_x[b] - velocity_x[a], velocity_y[b] - velocity_y[a]);
        distance <= (reach[a] + reach[b] + self.dt * speed) * MORE
    }

    #[inline(always)]
    fn emit(&mut self, a: usize, b: usize) {
        emit(self.pairs, self.pairing, self.sorted.body[a], self.sorted.body[b]);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn neighbours_avx2(mut self, start: &[u32], columns: usize) {
        use std::arch::x86_64::*;
        let sorted = self.sorted;
        // One length for all: each place is checked once, not once per column.
        let padded = sorted.len + PADDING;
        let (xs, ys, reaches) = (&sorted.x[..padded], &sorted.y[..padded], &sorted.reach[..padded]);
        let (velocities_x, velocities_y) = (&sorted.velocity_x[..padded], &sorted.velocity_y[..padded]);
        let cells = &sorted.cell[..padded];
        let (dt, more) = (_mm256_set1_ps(self.dt), _mm256_set1_ps(MORE));
        for place in self.places.clone() {
            let one = |column: &[f32]| _mm256_set1_ps(column[place]);
            let (x, y, reach) = (one(xs), one(ys), one(reaches));
            let (velocity_x, velocity_y) = (one(velocities_x), one(velocities_y));
            for (first, end) in runs(start, columns, cells[place] as usize, place) {
                let mut first = first;
                loop {
                    let eight = |column: &[f32]| {
                        let run: &[f32; 8] = column[first..first + 8].try_into().expect("eight");
                        // SAFETY: the pointer covers eight floats.
                        unsafe { _mm256_loadu_ps(run.as_ptr()) }
                    };
                    let length =
                        |x: __m256, y: __m256| _mm256_sqrt_ps(_mm256_add_ps(_mm256_mul_ps(x, x), _mm256_mul_ps(y, y)));
                    let distance = length(_mm256_sub_ps(eight(xs), x), _mm256_sub_ps(eight(ys), y));
                    let speed = length(
                        _mm256_sub_ps(eight(velocities_x), velocity_x),
                        _mm256_sub_ps(eight(velocities_y), velocity_y),
                    );
                    let within = _mm256_add_ps(_mm256_add_ps(reach, eight(reaches)), _mm256_mul_ps(dt, speed));
                    let near = _mm256_cmp_ps::<_CMP_LE_OQ>(distance, _mm256_mul_ps(within, more));
                    let hits = _mm256_movemask_ps(near) as u32;
                    // Lanes behind the end of the run are not meant.
                    let left = end.saturating_sub(first).min(8) as u32;
                    let mut hits = hits & ((1 << left) - 1);
                    while hits != 0 {
                        self.emit(place, first + hits.trailing_zeros() as usize);
                        hits &= hits - 1;
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
