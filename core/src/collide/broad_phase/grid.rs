//! Cells sorted in memory, built anew each step.
//!
//! Small bodies are binned by center into cells so wide that overlapping ones lie in neighbouring cells; a counting
//! sort lays each row of cells out as one run of memory, so a body meets all its neighbours in two runs: the rest of
//! its own cell with the next, and three cells of the row above. Large bodies query the cells they cover, and are then
//! paired among themselves by the same method, one level up. Cost per body: constant at constant density; each level
//! holds only bodies larger than the last.
//!
//! What counts as small is chosen by estimated cost from a histogram of sizes.

use super::Pair;
use super::search::{Search, Sorted, emit};
use crate::collide::proxies::Proxies;
use crate::model::math;
use crate::parallel::team::Team;

/// Bodies in a piece of work, at least.
const GRAIN: usize = 4096;

/// Up to this many bodies are simply tried against each other.
const FEW: usize = 24;

/// Buffers of the grid, shared by all tiles of a thread.
#[derive(Default, Debug)]
pub(crate) struct Grid {
    /// Bodies not yet binned, and those too large for the level under way.
    rest: Vec<u32>,
    large: Vec<u32>,
    /// For each binned body its cell; and where each cell begins in `sorted`.
    cell: Vec<u32>,
    start: Vec<u32>,
    /// Bodies of this level in cell order.
    sorted: Sorted,
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
        (((x - self.origin[0]) * self.per_meter) as i32).clamp(0, self.columns as i32 - 3) as usize + 1
    }

    #[inline(always)]
    fn row(&self, y: f32) -> usize {
        (((y - self.origin[1]) * self.per_meter) as i32).clamp(0, self.rows as i32 - 3) as usize + 1
    }
}

impl Grid {
    /// Appends every pair, and some that are none (see the contract in [`super`]).
    pub(crate) fn find_pairs(&mut self, proxies: &Proxies, team: Team, pairs: &mut Vec<Pair>) {
        self.rest.clear();
        self.rest.extend(0..proxies.len() as u32);
        while self.rest.len() > FEW {
            let limit = choose_limit(proxies, &self.rest);
            self.large.clear();
            let large = &mut self.large;
            self.rest.retain(|&body| {
                let extent = proxies.extent(body);
                let small = extent <= limit || extent.is_nan();
                if !small {
                    large.push(body);
                }
                small
            });
            let layout = self.bin(proxies, limit);
            self.pair_small(&layout, proxies, team, pairs);
            self.pair_large(&layout, proxies, limit, pairs);
            std::mem::swap(&mut self.rest, &mut self.large);
        }
        for (i, &a) in self.rest.iter().enumerate() {
            for &b in &self.rest[i + 1..] {
                if proxies.overlap([a, b]) {
                    emit(pairs, proxies.pairing, a, b);
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
        let cell = 2.0 * limit * 1.001;
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
        self.sorted.fill(proxies, &self.rest, &self.cell, &mut self.start);
        layout
    }

    fn pair_small(&self, layout: &Layout, proxies: &Proxies, team: Team, pairs: &mut Vec<Pair>) {
        let (sorted, dt, pairing, lanes) = (&self.sorted, proxies.dt, proxies.pairing, proxies.lanes);
        team.append(pairs, sorted.len, GRAIN, |places, pairs| {
            Search { sorted, dt, pairing, lanes, places, pairs }.neighbours(&self.start, layout.columns);
        });
    }

    fn pair_large(&self, layout: &Layout, proxies: &Proxies, limit: f32, pairs: &mut Vec<Pair>) {
        for &body in &self.large {
            let i = body as usize;
            let (x, y) = (proxies.x[i], proxies.y[i]);
            let reach_x = proxies.half_x[i] + proxies.slack[i] + limit;
            let reach_y = proxies.half_y[i] + proxies.slack[i] + limit;
            let columns = layout.column(x - reach_x)..=layout.column(x + reach_x);
            for row in layout.row(y - reach_y)..=layout.row(y + reach_y) {
                let first = self.start[row * layout.columns + columns.start()] as usize;
                let end = self.start[row * layout.columns + columns.end() + 1] as usize;
                for &other in &self.sorted.body[first..end] {
                    if proxies.overlap([body, other]) {
                        emit(pairs, proxies.pairing, body, other);
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

/// The bodies of one class of sizes.
#[derive(Clone, Copy, Default)]
struct Class {
    count: u32,
    /// The greatest half extent.
    greatest: f32,
    /// Sums over the bodies: of both half extents, and of their product.
    extents: f64,
    area: f64,
}

/// The greatest half extent that still counts as small: the one of least estimated work.
///
/// Sizes are counted in classes half an octave wide. With n small bodies spread over an area A, cells of side 2u give
/// about 9/2 n (2u)^2 / A candidates per small body, and a large body of half extents v, w meets
/// n (2u + 2v) (2u + 2w) / A. The constants are nanoseconds, measured: the search among small bodies compares eight at
/// once.
fn choose_limit(proxies: &Proxies, bodies: &[u32]) -> f32 {
    const CLASSES: usize = 64;
    /// The class of the smallest float we tell apart, 2^-16 m.
    const FIRST: u32 = (127 - 16) << 1;
    let mut classes = [Class::default(); CLASSES];
    for &body in bodies {
        let (x, y) = (proxies.half_x[body as usize], proxies.half_y[body as usize]);
        let extent = proxies.extent(body);
        let class = &mut classes[((extent.to_bits() >> 22).saturating_sub(FIRST) as usize).min(CLASSES - 1)];
        // What reaches beyond the tile meets nobody there.
        let (x, y) = (math::min(x, proxies.size[0]), math::min(y, proxies.size[1]));
        class.count += 1;
        class.greatest = math::max(extent, class.greatest);
        class.extents += f64::from(x + y);
        class.area += f64::from(x * y);
    }
    let area = f64::from(proxies.size[0]) * f64::from(proxies.size[1]);
    let mut best = (f64::INFINITY, 0.0);
    let mut small = 0.0;
    for limit in (0..CLASSES).filter(|&class| classes[class].count > 0) {
        small += f64::from(classes[limit].count);
        let (u, density) = (f64::from(classes[limit].greatest), small / area);
        let mut cost = small * (10.0 + 0.4 * 4.5 * density * 4.0 * u * u);
        for large in &classes[limit + 1..] {
            let covered = 4.0 * (f64::from(large.count) * u * u + u * large.extents + large.area);
            cost += 60.0 * f64::from(large.count) + 2.0 * density * covered;
        }
        if cost < best.0 {
            best = (cost, classes[limit].greatest);
        }
    }
    best.1
}
