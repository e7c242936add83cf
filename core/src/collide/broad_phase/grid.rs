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
use crate::parallel::lanes::{Kernel, LANES, Lanes, Row};
use crate::parallel::team::Team;

/// Bodies in a piece of work, at least.
const GRAIN: usize = 1024;

/// Up to this many bodies are simply tried against each other.
const FEW: usize = 24;

/// Of many bodies, sizes are counted of one of so many: a number that nothing is likely to repeat after.
const SAMPLED: usize = 7;

/// Buffers of the grid, shared by all tiles of a thread.
#[derive(Default, Debug)]
pub(crate) struct Grid {
    /// Numbers from zero.
    everybody: Vec<u32>,
    /// Bodies too large for the level under way, as places in it, and by their own numbers.
    large: Vec<u32>,
    larger: Vec<u32>,
    /// The bodies of the level under way, if it is not the first.
    rest: Vec<u32>,
    /// Their x, y, extent and radius.
    columns: [Vec<f32>; 4],
    /// For each body of the level its cell; and where each cell begins in `sorted`.
    cell: Vec<u32>,
    start: Vec<u32>,
    /// Bodies of this level in cell order.
    sorted: Sorted,
}

/// The bodies that one level sorts into cells: all of a tile, or those too large for the level before.
#[derive(Clone, Copy)]
pub(super) struct Level<'a> {
    /// Columns of [`Proxies`], of these bodies.
    pub(super) x: &'a [f32],
    pub(super) y: &'a [f32],
    pub(super) extent: &'a [f32],
    pub(super) radius: &'a [f32],
    pub(super) body: &'a [u32],
}

/// Where the cells lie. One column and one row of empty cells surround the others, so that neighbours always exist.
#[derive(Clone, Copy)]
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
        self.place(x, 0, self.columns) as usize
    }

    #[inline(always)]
    fn row(&self, y: f32) -> usize {
        self.place(y, 1, self.rows) as usize
    }

    #[inline(always)]
    fn cell(&self, x: f32, y: f32) -> u32 {
        self.place(y, 1, self.rows) * self.columns as u32 + self.place(x, 0, self.columns)
    }

    #[inline(always)]
    fn place(&self, v: f32, axis: usize, count: usize) -> u32 {
        // By way of a signed number, which processors make eight of at once.
        math::clamp((v - self.origin[axis]) * self.per_meter, 0.0, (count - 3) as f32) as i32 as u32 + 1
    }
}

impl Grid {
    /// Appends every pair, and some that are none (see the contract in [`super`]).
    pub(crate) fn find_pairs(&mut self, proxies: &Proxies, team: Team, pairs: &mut Vec<Pair>) {
        let count = proxies.len();
        let known = self.everybody.len();
        self.everybody.extend(known as u32..count.max(known) as u32);
        let everybody = std::mem::take(&mut self.everybody);
        let all = Level {
            x: &proxies.x,
            y: &proxies.y,
            extent: &proxies.extent,
            radius: &proxies.radius,
            body: &everybody[..count],
        };
        self.pair_level(&all, proxies, team, pairs);
        while self.larger.len() > FEW {
            std::mem::swap(&mut self.larger, &mut self.rest);
            let rest = std::mem::take(&mut self.rest);
            let mut columns = std::mem::take(&mut self.columns);
            for (to, from) in columns.iter_mut().zip([&proxies.x, &proxies.y, &proxies.extent, &proxies.radius]) {
                to.clear();
                to.extend(rest.iter().map(|&body| from[body as usize]));
            }
            let [x, y, extent, radius] = columns.each_ref().map(|column| &column[..]);
            self.pair_level(&Level { x, y, extent, radius, body: &rest }, proxies, team, pairs);
            (self.rest, self.columns) = (rest, columns);
        }
        for (i, &a) in self.larger.iter().enumerate() {
            for &b in &self.larger[i + 1..] {
                if proxies.overlap([a, b]) {
                    emit(pairs, proxies.pairing, a, b);
                }
            }
        }
        self.everybody = everybody;
    }

    /// Pairs the small bodies of a level among themselves, and with those too large for it, whom it leaves in `larger`.
    fn pair_level(&mut self, level: &Level<'_>, proxies: &Proxies, team: Team, pairs: &mut Vec<Pair>) {
        self.larger.clear();
        if level.body.len() <= FEW {
            return self.larger.extend_from_slice(level.body);
        }
        let most = choose_limit(level, proxies);
        let small = proxies.lanes.run(Part { level, most, large: &mut self.large });
        self.larger.extend(self.large.iter().map(|&i| level.body[i as usize]));
        let layout = self.bin(level, &small, proxies);
        self.pair_small(&layout, proxies, team, pairs);
        self.pair_large(&layout, proxies, small.greatest, pairs);
    }

    /// Sorts the small bodies of a level by cell.
    fn bin(&mut self, level: &Level<'_>, small: &Small, proxies: &Proxies) -> Layout {
        // Bodies far outside the tile share its outermost cells: one stray must not make all cells coarse.
        let Small { mut low, mut high, greatest } = *small;
        for axis in 0..2 {
            let (least, most) = (-proxies.size[axis], 2.0 * proxies.size[axis]);
            (low[axis], high[axis]) = (math::clamp(low[axis], least, most), math::clamp(high[axis], least, most));
        }
        let layout = Layout::new(low, high, 2.0 * greatest * 1.001, level.body.len());
        self.cell.clear();
        self.cell.resize(level.body.len(), 0);
        proxies.lanes.run(Bin { level, layout, cell: &mut self.cell });
        // The large ones lie behind all others.
        self.large.iter().for_each(|&i| self.cell[i as usize] = layout.cells() as u32);
        self.start.clear();
        self.start.resize(layout.cells() + 3, 0);
        // Counted two places ahead: after the running sum `start[c + 1]` is where cell c begins, and once the bodies
        // are laid out, where it ends: then `start[c]` is where it begins.
        self.cell.iter().for_each(|&cell| self.start[cell as usize + 2] += 1);
        let mut sum = 0;
        for start in &mut self.start {
            sum += *start;
            *start = sum;
        }
        self.sorted.fill(level, &self.cell, &mut self.start, self.large.len());
        layout
    }

    fn pair_small(&self, layout: &Layout, proxies: &Proxies, team: Team, pairs: &mut Vec<Pair>) {
        let (sorted, pairing, lanes) = (&self.sorted, proxies.pairing, proxies.lanes);
        team.append(pairs, sorted.len, GRAIN, |places, pairs| {
            Search { sorted, pairing, lanes, places, pairs }.neighbours(&self.start, layout.columns);
        });
    }

    fn pair_large(&self, layout: &Layout, proxies: &Proxies, limit: f32, pairs: &mut Vec<Pair>) {
        for &body in &self.larger {
            let i = body as usize;
            let (x, y, slack, half) = (proxies.x[i], proxies.y[i], proxies.slack(i), proxies.half(i));
            let [reach_x, reach_y] = half.map(|half| half + slack + limit);
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

/// Parts the bodies of a level: those that extend no more than this are small.
struct Part<'a> {
    level: &'a Level<'a>,
    most: f32,
    large: &'a mut Vec<u32>,
}

/// The small bodies of a level: the box around their centers, and the greatest extent.
struct Small {
    low: [f32; 2],
    high: [f32; 2],
    greatest: f32,
}

/// Blocks of eight among which large bodies are looked for at once.
const BLOCKS: usize = 8;

impl Kernel for Part<'_> {
    type Output = Small;

    #[inline(always)]
    fn run<V: Lanes>(self) -> Small {
        let Self { level: Level { x, y, extent, .. }, most, large } = self;
        large.clear();
        let (infinity, edge) = (V::splat(f32::INFINITY), V::splat(most));
        let nothing = V::splat(f32::NEG_INFINITY);
        let (mut low_x, mut low_y, mut high_x, mut high_y, mut greatest) =
            (infinity, infinity, nothing, nothing, nothing);
        for first in (0..x.len()).step_by(BLOCKS * LANES) {
            let end = x.len().min(first + BLOCKS * LANES);
            let mut largest = nothing;
            for i in (first..end).step_by(LANES) {
                let (x, y, extent) = (eight(x, i), eight(y, i), eight::<V>(extent, i));
                let beyond = extent.sub(edge);
                low_x = beyond.if_positive(infinity, x).min(low_x);
                low_y = beyond.if_positive(infinity, y).min(low_y);
                high_x = beyond.if_positive(nothing, x).max(high_x);
                high_y = beyond.if_positive(nothing, y).max(high_y);
                greatest = beyond.if_positive(nothing, extent).max(greatest);
                largest = extent.max(largest);
            }
            if fold(largest, math::max) > most {
                large.extend((first as u32..end as u32).filter(|&i| extent[i as usize] > most));
            }
        }
        Small {
            low: [fold(low_x, math::min), fold(low_y, math::min)],
            high: [fold(high_x, math::max), fold(high_y, math::max)],
            greatest: fold(greatest, math::max),
        }
    }
}

/// Eight numbers from here on; where there are fewer, some of them again.
#[inline(always)]
fn eight<V: Lanes>(from: &[f32], first: usize) -> V {
    match from[first..].first_chunk() {
        Some(row) => V::load(row),
        None => V::load(&std::array::from_fn(|lane| from[(first + lane).min(from.len() - 1)])),
    }
}

#[inline(always)]
fn fold<V: Lanes>(v: V, both: fn(f32, f32) -> f32) -> f32 {
    let mut row: Row = [0.0; LANES];
    v.store(&mut row);
    row.into_iter().reduce(both).expect("eight")
}

/// Tells each body of a level its cell.
struct Bin<'a> {
    level: &'a Level<'a>,
    layout: Layout,
    cell: &'a mut [u32],
}

impl Kernel for Bin<'_> {
    type Output = ();

    /// As plain numbers, which the compiler takes as many of at once as there is room for.
    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Self { level: Level { x, y, .. }, layout, cell } = self;
        for ((cell, &x), &y) in cell.iter_mut().zip(*x).zip(*y) {
            *cell = layout.cell(x, y);
        }
    }
}

/// The bodies of one class of sizes.
#[derive(Clone, Copy, Default)]
struct Class {
    count: f64,
    /// The greatest half extent.
    greatest: f32,
    /// Sums over the bodies: of both half extents, and of their product.
    extents: f64,
    area: f64,
}

/// The greatest half extent that may count as small: the one of least estimated work.
///
/// Sizes are counted in classes half an octave wide. With n small bodies spread over an area A, cells of side 2u give
/// about 9/2 n (2u)^2 / A candidates per small body, and a large body of half extents v, w meets
/// n (2u + 2v) (2u + 2w) / A. The constants are nanoseconds, measured: the search among small bodies compares eight at
/// once.
fn choose_limit(level: &Level<'_>, proxies: &Proxies) -> f32 {
    const CLASSES: usize = 64;
    /// The class of the smallest float we tell apart, 2^-16 m.
    const FIRST: u32 = (127 - 16) << 1;
    let mut classes = [Class::default(); CLASSES];
    let bodies = level.body.len();
    let step = if bodies < 256 * SAMPLED { 1 } else { SAMPLED };
    let of = step as f64;
    for (&body, &extent) in level.body.iter().zip(level.extent).step_by(step) {
        let class = &mut classes[((extent.to_bits() >> 22).saturating_sub(FIRST) as usize).min(CLASSES - 1)];
        // What reaches beyond the tile meets nobody there.
        let [x, y] = proxies.half(body as usize);
        let (x, y) = (math::min(x, proxies.size[0]), math::min(y, proxies.size[1]));
        class.count += of;
        class.greatest = math::max(extent, class.greatest);
        class.extents += of * f64::from(x + y);
        class.area += of * f64::from(x * y);
    }
    let area = f64::from(proxies.size[0]) * f64::from(proxies.size[1]);
    let mut best = (f64::INFINITY, CLASSES - 1);
    let mut small = 0.0;
    for limit in (0..CLASSES).filter(|&class| classes[class].count > 0.0) {
        small += classes[limit].count;
        let (u, density) = (f64::from(classes[limit].greatest), small / area);
        let mut cost = small * (10.0 + 0.4 * 4.5 * density * 4.0 * u * u);
        for large in &classes[limit + 1..] {
            let covered = 4.0 * (large.count * u * u + u * large.extents + large.area);
            cost += 60.0 * large.count + 2.0 * density * covered;
        }
        if cost < best.0 {
            best = (cost, limit);
        }
    }
    // Where the next class begins: those that were not counted may be a little larger.
    let next = (FIRST + best.1 as u32 + 1) << 22;
    if best.1 + 1 == CLASSES { f32::INFINITY } else { f32::from_bits(next) }
}
