//! Cells sorted in memory, built anew each step.
//!
//! Small bodies are binned by center into cells so wide that overlapping ones lie in neighbouring cells; a counting
//! sort lays each row of cells out as one run of memory, so a body meets all its neighbours in two runs: the rest of
//! its own cell with the next, and three cells of the row above. Large bodies query the cells they cover, and are then
//! paired among themselves by the same method, one level up. Cost per body: constant at constant density; each level
//! holds only bodies larger than the last.
//!
//! What counts as small is chosen by estimated cost from a histogram of sizes.
//!
//! Bodies may be anywhere, and closer together than a tile has room for. Where a cell holds many because most cells are far from
//! everybody, only those are kept that hold somebody; and where bodies are closer than was estimated, they are parted anew by what
//! was counted.

use super::cells::{Cells, Dense, Layout, Sparse};
use super::search::{Search, Sorted, emit};
use super::slant::Slant;
use super::{Field, Pair};
use crate::collide::proxies::{NO_PAIRS, Proxies};
use crate::model::math;
use crate::parallel::lanes::{Kernel, LANES, Lanes, Row};
use std::cell::LazyCell;
#[cfg(test)]
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Bodies in a piece of work, at least.
const GRAIN: usize = 1024;

/// Up to this many bodies are simply tried against each other.
const FEW: usize = 24;

/// From this many bodies in a cell on, those cells alone are looked for that hold somebody.
const CROWD: f64 = 16.0;

/// Bodies are closer together than was estimated where so many times as many are in a cell.
const CLOSER: f64 = 4.0;

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
    /// Those cells that hold somebody, where most are empty.
    sparse: Sparse,
    /// Bodies of this level in cell order.
    sorted: Sorted,
    /// Bodies looked at.
    #[cfg(test)]
    pub(super) looks: AtomicUsize,
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

impl Grid {
    /// Appends every pair, and some that are none (see the contract in [`super`]).
    pub(crate) fn find_pairs(&mut self, field: Field<'_>, pairs: &mut Vec<Pair>) {
        let proxies = field.proxies;
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
        self.pair_level(&all, field, pairs);
        while self.larger.len() > FEW {
            std::mem::swap(&mut self.larger, &mut self.rest);
            let rest = std::mem::take(&mut self.rest);
            let mut columns = std::mem::take(&mut self.columns);
            for (to, from) in columns.iter_mut().zip([&proxies.x, &proxies.y, &proxies.extent, &proxies.radius]) {
                to.clear();
                to.extend(rest.iter().map(|&body| from[body as usize]));
            }
            let [x, y, extent, radius] = columns.each_ref().map(|column| &column[..]);
            self.pair_level(&Level { x, y, extent, radius, body: &rest }, field, pairs);
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
    fn pair_level(&mut self, level: &Level<'_>, field: Field<'_>, pairs: &mut Vec<Pair>) {
        let proxies = field.proxies;
        self.larger.clear();
        if level.body.len() <= FEW {
            return self.larger.extend_from_slice(level.body);
        }
        let mut room = f64::from(proxies.size[0]) * f64::from(proxies.size[1]);
        let mut most = choose_limit(level, proxies, room);
        let binned = loop {
            let binned = self.bin(level, most, proxies);
            if binned.crowd <= CLOSER * (1.0 + binned.bodies * binned.layout.area() / room) {
                break binned;
            }
            room = binned.bodies * binned.layout.area() / binned.crowd;
            let less = choose_limit(level, proxies, room);
            if less >= most {
                break binned;
            }
            most = less;
        };
        let large = self.large.iter().filter(|&&i| level.extent[i as usize] < NO_PAIRS);
        self.larger.extend(large.map(|&i| level.body[i as usize]));
        if binned.is_sparse {
            self.pair(&self.sparse, &binned, field, pairs);
        } else {
            self.pair(&Dense::new(&self.start, &binned.layout), &binned, field, pairs);
        }
    }

    /// Sorts by cell those bodies of a level that extend no more than this, and leaves the others in `large`.
    fn bin(&mut self, level: &Level<'_>, most: f32, proxies: &Proxies) -> Binned {
        let small = proxies.lanes.run(Part { level, most, large: &mut self.large });
        let (cell, count) = (2.0 * small.greatest * 1.001, level.body.len());
        let bodies = (count - self.large.len()) as f64;
        // Bodies far outside the tile share its outermost cells: one stray must not make all cells coarse.
        let inside = |corner: [f32; 2]| {
            [0, 1].map(|axis| math::clamp(corner[axis], -proxies.size[axis], 2.0 * proxies.size[axis]))
        };
        let few = Layout::few(inside(small.low), inside(small.high), cell, count);
        let crowd = self.fill_all(level, &few, proxies) / bodies;
        let all = Layout::new(small.low, small.high, cell);
        let is_sparse = crowd > CROWD && few != all;
        let (layout, crowd) = if is_sparse { (all, self.fill_some(level, most, &all) / bodies) } else { (few, crowd) };
        self.sorted.fill(level, &self.cell, &mut self.start, self.large.len());
        Binned { layout, is_sparse, greatest: small.greatest, bodies, crowd }
    }

    /// Tells the small bodies of a level their cells, and where each of these begins. Returns the sum of the squares of how many there
    /// are in each.
    fn fill_all(&mut self, level: &Level<'_>, layout: &Layout, proxies: &Proxies) -> f64 {
        self.cell.clear();
        self.cell.resize(level.body.len(), 0);
        proxies.lanes.run(Bin { level, layout: *layout, cell: &mut self.cell });
        // The large ones lie behind all others.
        self.large.iter().for_each(|&i| self.cell[i as usize] = layout.cells() as u32);
        self.start.clear();
        self.start.resize(layout.cells() + 3, 0);
        // Counted two places ahead: after the running sum `start[c + 1]` is where cell c begins, and once the bodies
        // are laid out, where it ends: then `start[c]` is where it begins.
        let mut met = 0;
        for &cell in &self.cell {
            let count = &mut self.start[cell as usize + 2];
            met += u64::from(*count);
            *count += 1;
        }
        let large = self.large.len() as u64;
        let squares = 2 * met + self.cell.len() as u64 - large * large;
        let mut sum = 0;
        for start in &mut self.start {
            sum += *start;
            *start = sum;
        }
        squares as f64
    }

    /// As [`fill_all`](Self::fill_all), of those cells alone that hold somebody.
    fn fill_some(&mut self, level: &Level<'_>, most: f32, layout: &Layout) -> f64 {
        let is_small = |&i: &u32| level.extent[i as usize] <= most;
        let place = |i: u32| [layout.column(level.x[i as usize]), layout.row(level.y[i as usize])];
        let small = (0..level.body.len() as u32).filter(is_small).map(|i| (i, place(i)));
        self.sparse.fill(small, |i, cell| self.cell[i as usize] = cell);
        self.large.iter().for_each(|&i| self.cell[i as usize] = self.sparse.len() as u32);
        self.start.clear();
        self.start.push(0);
        self.start.extend_from_slice(self.sparse.start());
        let counts = self.sparse.start().windows(2).map(|two| u64::from(two[1] - two[0]));
        counts.map(|count| count * count).sum::<u64>() as f64
    }

    /// Pairs the small bodies among themselves, and with the larger ones.
    fn pair(&self, cells: &impl Cells, binned: &Binned, field: Field<'_>, pairs: &mut Vec<Pair>) {
        let Field { proxies, team, .. } = field;
        let (sorted, pairing, lanes) = (&self.sorted, proxies.pairing, proxies.lanes);
        #[cfg(test)]
        self.looks.fetch_add(sorted.looks(cells), Relaxed);
        team.append(pairs, sorted.len, GRAIN, |places, pairs| {
            Search { sorted, pairing, lanes, places, pairs }.neighbours(cells);
        });
        let (Binned { layout, greatest, .. }, reach) = (binned, LazyCell::new(|| sorted.greatest_radius()));
        for &body in &self.larger {
            let i = body as usize;
            let (x, y, slack, half) = (proxies.x[i], proxies.y[i], proxies.slack(i), proxies.half(i));
            let [reach_x, reach_y] = half.map(|half| half + slack + greatest);
            let slant = Slant::of(i, &field);
            let columns = |row: usize| {
                let (low, high) = match &slant {
                    None => (-reach_x, reach_x),
                    Some(slant) => {
                        let heights = layout.heights(row);
                        let span = slant.span(heights.start - y..heights.end - y, *reach);
                        (math::max(-reach_x, span.start), math::min(reach_x, span.end))
                    }
                };
                layout.column(x + low)..=if low <= high { layout.column(x + high) } else { 0 }
            };
            let rows = layout.row(y - reach_y)..=layout.row(y + reach_y);
            cells.each_run(rows, columns, |places| {
                #[cfg(test)]
                self.looks.fetch_add(places.len(), Relaxed);
                for &other in &self.sorted.body[places] {
                    let (k, seen) = (other as usize, |at: usize| [proxies.x[at] - x, proxies.y[at] - y]);
                    let comes_to = |slant: &Slant| slant.comes_to(seen(k), proxies.radius[k]);
                    if proxies.overlap([body, other]) && slant.as_ref().is_none_or(comes_to) {
                        emit(pairs, pairing, body, other);
                    }
                }
            });
        }
    }
}

/// The small bodies of a level, sorted by cell.
struct Binned {
    layout: Layout,
    is_sparse: bool,
    /// The greatest half extent.
    greatest: f32,
    /// How many there are.
    bodies: f64,
    /// How many there are in the cell of a body, on the average.
    crowd: f64,
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

/// The greatest half extent that may count as small: the one of least estimated work, with so many m^2 of room.
///
/// Sizes are counted in classes half an octave wide. With n small bodies spread over an area A of room, cells of side 2u give
/// about 9/2 n (2u)^2 / A candidates per small body, and a large body of half extents v, w meets
/// n (2u + 2v) (2u + 2w) / A. The constants are nanoseconds, measured: the search among small bodies compares eight at
/// once.
fn choose_limit(level: &Level<'_>, proxies: &Proxies, room: f64) -> f32 {
    const CLASSES: usize = 64;
    /// The class of the smallest float we tell apart, 2^-16 m.
    const FIRST: u32 = (127 - 16) << 1;
    let mut classes = [Class::default(); CLASSES];
    let bodies = level.body.len();
    let step = if bodies < 256 * SAMPLED { 1 } else { SAMPLED };
    let of = step as f64;
    let sampled = level.body.iter().zip(level.extent).step_by(step);
    for (&body, &extent) in sampled.filter(|(_, extent)| **extent < NO_PAIRS) {
        let class = &mut classes[((extent.to_bits() >> 22).saturating_sub(FIRST) as usize).min(CLASSES - 1)];
        // What reaches beyond the tile meets nobody there.
        let [x, y] = proxies.half(body as usize);
        let (x, y) = (math::min(x, proxies.size[0]), math::min(y, proxies.size[1]));
        class.count += of;
        class.greatest = math::max(extent, class.greatest);
        class.extents += of * f64::from(x + y);
        class.area += of * f64::from(x * y);
    }
    let mut best = (f64::INFINITY, CLASSES - 1);
    let mut small = 0.0;
    for limit in (0..CLASSES).filter(|&class| classes[class].count > 0.0) {
        small += classes[limit].count;
        let (u, density) = (f64::from(classes[limit].greatest), small / room);
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
    if best.1 + 1 == CLASSES { f32::MAX } else { f32::from_bits(next) }
}
