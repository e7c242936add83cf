//! Cells sorted in memory, built anew each step.
//!
//! Small bodies are binned by center into cells so wide that overlapping ones lie in neighbouring cells; a counting
//! sort lays each row of cells out as one run of memory, so a body meets all its neighbours in two runs: the rest of
//! its own cell with the next, and three cells of the row above. Large bodies query the cells they cover, and are then
//! paired among themselves by the same method, one level up. Cost per body: constant at constant density; each level
//! holds only bodies larger than the last.
//!
//! What counts as small is chosen by estimated cost from a histogram of sizes.

use super::{Pair, Proxies};
use crate::math;

/// Up to this many bodies are simply tried against each other.
const FEW: usize = 24;

/// Buffers of the grid, shared by all tiles of a thread.
#[derive(Default, Debug)]
pub(crate) struct Grid {
    /// Bodies not yet binned, and those too large for the level under way.
    rest: Vec<u32>,
    large: Vec<u32>,
    /// For each binned body its cell.
    cell: Vec<u32>,
    /// Bodies of this level in cell order, and copies of their proxies.
    sorted: Vec<Entry>,
    /// First body of each cell; one more at the end.
    start: Vec<u32>,
}

/// A body in its cell: 20 bytes, everything the search reads.
#[derive(Clone, Copy, Default, Debug)]
struct Entry {
    x: f32,
    y: f32,
    half_x: f32,
    half_y: f32,
    body: u32,
}

impl Entry {
    fn of(proxies: &Proxies, body: u32) -> Self {
        let i = body as usize;
        Self { x: proxies.x[i], y: proxies.y[i], half_x: proxies.half_x[i], half_y: proxies.half_y[i], body }
    }

    #[inline(always)]
    fn near(&self, other: &Self, slack: f32) -> bool {
        ((self.x - other.x).abs() <= self.half_x + other.half_x + slack)
            & ((self.y - other.y).abs() <= self.half_y + other.half_y + slack)
    }
}

/// Appends a pair, lower index first, unless neither body is owned.
#[inline(always)]
fn emit(pairs: &mut Vec<Pair>, owned: usize, a: u32, b: u32) {
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    if (low as usize) < owned {
        pairs.push((low, high));
    }
}

/// Where the cells lie. One column and one row of empty cells surround the others, so that neighbours always exist.
struct Layout {
    origin: [f32; 2],
    per_meter: f32,
    columns: usize,
    rows: usize,
}

impl Layout {
    /// Cells at least `cell` wide over the given box, no more than about two per body.
    fn new(low: [f32; 2], high: [f32; 2], cell: f32, bodies: usize) -> Self {
        let (width, height) = (high[0] - low[0], high[1] - low[1]);
        let widest = |cell: f32| (f64::from(width / cell) + 1.0) * (f64::from(height / cell) + 1.0);
        let mut cell = cell;
        while widest(cell) > 2.0 * bodies as f64 + 64.0 {
            cell *= 1.25;
        }
        let per_meter = 1.0 / cell;
        let count = |size: f32| (size * per_meter) as usize + 1;
        Self { origin: low, per_meter, columns: count(width) + 2, rows: count(height) + 2 }
    }

    fn cells(&self) -> usize {
        self.columns * self.rows
    }

    /// Bodies outside the box are held in its outermost cells: never further from a neighbour than they are.
    #[inline(always)]
    fn column(&self, x: f32) -> usize {
        (((x - self.origin[0]) * self.per_meter) as usize).min(self.columns - 3) + 1
    }

    #[inline(always)]
    fn row(&self, y: f32) -> usize {
        (((y - self.origin[1]) * self.per_meter) as usize).min(self.rows - 3) + 1
    }
}

impl Grid {
    /// Appends every pair of proxies that [`Proxies::overlap`], at least one of them owned; and, where local
    /// coordinates round, a few that do not.
    pub(crate) fn find_pairs(&mut self, proxies: &Proxies, pairs: &mut Vec<Pair>) {
        self.rest.clear();
        self.rest.extend(0..proxies.len() as u32);
        while self.rest.len() > FEW {
            let limit = choose_limit(proxies, &self.rest);
            let half = |body: u32| math::max(proxies.half_x[body as usize], proxies.half_y[body as usize]);
            self.large.clear();
            let large = &mut self.large;
            self.rest.retain(|&body| {
                let small = half(body) <= limit || half(body).is_nan();
                if !small {
                    large.push(body);
                }
                small
            });
            let layout = self.bin(proxies, limit);
            self.pair_small(&layout, proxies, pairs);
            self.pair_large(&layout, proxies, limit, pairs);
            std::mem::swap(&mut self.rest, &mut self.large);
        }
        for (i, &a) in self.rest.iter().enumerate() {
            let entry = Entry::of(proxies, a);
            for &b in &self.rest[i + 1..] {
                if entry.near(&Entry::of(proxies, b), proxies.slack) {
                    emit(pairs, proxies.owned, a, b);
                }
            }
        }
    }

    /// Sorts the bodies of `rest` by cell.
    fn bin(&mut self, proxies: &Proxies, limit: f32) -> Layout {
        // Bodies far outside the tile share its outermost cells: one stray must not make all cells coarse.
        let (mut low, mut high) = bounds(proxies, &self.rest);
        for axis in 0..2 {
            let (least, most) = (-proxies.size[axis], 2.0 * proxies.size[axis]);
            (low[axis], high[axis]) = (math::clamp(low[axis], least, most), math::clamp(high[axis], least, most));
        }
        let cell = (2.0 * limit + proxies.slack) * 1.001;
        let layout = Layout::new(low, high, cell, self.rest.len());
        self.start.clear();
        self.start.resize(layout.cells() + 2, 0);
        self.cell.clear();
        // Counted two places ahead: after the running sum `start[c + 1]` is where cell c begins, and once the bodies
        // are laid out, where it ends: then `start[c]` is where it begins.
        for &body in &self.rest {
            let i = body as usize;
            let cell = layout.row(proxies.y[i]) * layout.columns + layout.column(proxies.x[i]);
            self.cell.push(cell as u32);
            self.start[cell + 2] += 1;
        }
        let mut sum = 0;
        for start in &mut self.start {
            sum += *start;
            *start = sum;
        }
        self.sorted.clear();
        self.sorted.resize(self.rest.len(), Entry::default());
        for (&body, &cell) in self.rest.iter().zip(&self.cell) {
            let place = &mut self.start[cell as usize + 1];
            self.sorted[*place as usize] = Entry::of(proxies, body);
            *place += 1;
        }
        layout
    }

    fn pair_small(&self, layout: &Layout, proxies: &Proxies, pairs: &mut Vec<Pair>) {
        let (owned, slack) = (proxies.owned, proxies.slack);
        for row in 1..layout.rows - 1 {
            for cell in row * layout.columns + 1..(row + 1) * layout.columns - 1 {
                let (first, end) = (self.start[cell] as usize, self.start[cell + 1] as usize);
                if first == end {
                    continue;
                }
                let next_end = self.start[cell + 2] as usize;
                let above = cell + layout.columns;
                let above = &self.sorted[self.start[above - 1] as usize..self.start[above + 2] as usize];
                for i in first..end {
                    let entry = self.sorted[i];
                    for other in &self.sorted[i + 1..next_end] {
                        if entry.near(other, slack) {
                            emit(pairs, owned, entry.body, other.body);
                        }
                    }
                    for other in above {
                        if entry.near(other, slack) {
                            emit(pairs, owned, entry.body, other.body);
                        }
                    }
                }
            }
        }
    }

    fn pair_large(&self, layout: &Layout, proxies: &Proxies, limit: f32, pairs: &mut Vec<Pair>) {
        for &body in &self.large {
            let entry = Entry::of(proxies, body);
            let (reach_x, reach_y) =
                (entry.half_x + limit + proxies.slack, entry.half_y + limit + proxies.slack);
            let columns = layout.column(entry.x - reach_x)..=layout.column(entry.x + reach_x);
            for row in layout.row(entry.y - reach_y)..=layout.row(entry.y + reach_y) {
                let first = self.start[row * layout.columns + columns.start()] as usize;
                let end = self.start[row * layout.columns + columns.end() + 1] as usize;
                for other in &self.sorted[first..end] {
                    if entry.near(other, proxies.slack) {
                        emit(pairs, proxies.owned, entry.body, other.body);
                    }
                }
            }
        }
    }
}

/// The box around the centers of some bodies.
fn bounds(proxies: &Proxies, bodies: &[u32]) -> ([f32; 2], [f32; 2]) {
    let mut low = [f32::INFINITY; 2];
    let mut high = [f32::NEG_INFINITY; 2];
    for &body in bodies {
        for (axis, v) in [proxies.x[body as usize], proxies.y[body as usize]].into_iter().enumerate() {
            low[axis] = math::min(v, low[axis]);
            high[axis] = math::max(v, high[axis]);
        }
    }
    (low, high)
}

/// The greatest half extent that still counts as small: the one of least estimated work.
///
/// Sizes are counted in classes half an octave wide. With n small bodies spread over an area A, cells of side 2u give
/// about 9/2 n (2u)^2 / A candidates per small body; a large body of half extent v meets n (2u + 2v)^2 / A.
fn choose_limit(proxies: &Proxies, bodies: &[u32]) -> f32 {
    const CLASSES: usize = 64;
    /// The class of the smallest float we tell apart, 2^-16 m.
    const FIRST: u32 = (127 - 16) << 1;
    let mut counts = [0_u32; CLASSES];
    let mut greatest = [0.0_f32; CLASSES];
    for &body in bodies {
        let half = math::max(proxies.half_x[body as usize], proxies.half_y[body as usize]);
        let class = ((half.to_bits() >> 22).saturating_sub(FIRST) as usize).min(CLASSES - 1);
        counts[class] += 1;
        greatest[class] = math::max(half, greatest[class]);
    }
    let (low, high) = bounds(proxies, bodies);
    let mut best = (f64::INFINITY, 0.0);
    let mut small = 0;
    for limit in 0..CLASSES {
        if counts[limit] == 0 {
            continue;
        }
        small += counts[limit];
        let u = f64::from(greatest[limit]);
        // Cells are no use below the size of what they lie in.
        let area = (f64::from(high[0] - low[0]) + 2.0 * u) * (f64::from(high[1] - low[1]) + 2.0 * u);
        let density = f64::from(small) / area;
        let mut cost = f64::from(small) * (1.0 + 4.5 * density * (2.0 * u) * (2.0 * u));
        let mut large = 0;
        for class in limit + 1..CLASSES {
            let reach = 2.0 * (u + f64::from(greatest[class]));
            cost += f64::from(counts[class]) * (8.0 + density * reach * reach);
            large += counts[class];
        }
        // What is left over is binned again.
        cost += 8.0 * f64::from(large);
        if cost < best.0 {
            best = (cost, greatest[limit]);
        }
    }
    best.1
}
