//! Cells as wide as the bodies sorted into them: where they lie, and who is in those around.

use crate::model::math;
use std::ops::{Range, RangeInclusive};

/// Where the cells lie. One column and one row of empty cells surround the others, so that neighbours always exist.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Layout {
    origin: [f32; 2],
    per_meter: f32,
    columns: usize,
    rows: usize,
}

impl Layout {
    /// Cells of this width over the given box.
    pub(super) fn new(low: [f32; 2], high: [f32; 2], cell: f32) -> Self {
        let per_meter = 1.0 / cell;
        let [columns, rows] = [0, 1].map(|axis| ((high[axis] - low[axis]) * per_meter) as u32 as usize + 3);
        Self { origin: low, per_meter, columns, rows }
    }

    /// Cells at least `cell` wide over the given box, no more than about two per body.
    pub(super) fn few(low: [f32; 2], high: [f32; 2], mut cell: f32, bodies: usize) -> Self {
        let (width, height) = (high[0] - low[0], high[1] - low[1]);
        let widest = |cell: f32| (f64::from(width / cell) + 1.0) * (f64::from(height / cell) + 1.0);
        while widest(cell) > 2.0 * bodies as f64 + 64.0 {
            cell *= 1.25;
        }
        Self::new(low, high, cell)
    }

    pub(super) fn cells(&self) -> usize {
        self.columns * self.rows
    }

    /// Of one cell, in m^2.
    pub(super) fn area(&self) -> f64 {
        f64::from(self.per_meter).powi(-2)
    }

    /// Bodies outside the box are held in its outermost cells: never further from a neighbour than they are.
    #[inline(always)]
    pub(super) fn column(&self, x: f32) -> usize {
        self.place(x, 0, self.columns) as usize
    }

    #[inline(always)]
    pub(super) fn row(&self, y: f32) -> usize {
        self.place(y, 1, self.rows) as usize
    }

    /// Between which heights everybody in a row is.
    pub(super) fn heights(&self, row: usize) -> Range<f32> {
        let cell = 1.0 / self.per_meter;
        let edge = |row: usize| self.origin[1] + row as f32 * cell;
        // Heights are rounded, and the outermost rows hold all beyond.
        let more = 0.01 * cell + 8.0 * f32::EPSILON * self.origin[1].abs();
        let low = if row <= 1 { f32::NEG_INFINITY } else { edge(row - 1) - more };
        let high = if row + 2 >= self.rows { f32::INFINITY } else { edge(row) + more };
        low..high
    }

    #[inline(always)]
    pub(super) fn cell(&self, x: f32, y: f32) -> u32 {
        self.place(y, 1, self.rows) * self.columns as u32 + self.place(x, 0, self.columns)
    }

    #[inline(always)]
    fn place(&self, v: f32, axis: usize, count: usize) -> u32 {
        // By way of a signed number, which processors make eight of at once.
        math::clamp((v - self.origin[axis]) * self.per_meter, 0.0, (count - 3) as f32) as i32 as u32 + 1
    }
}

/// Numbered cells whose bodies lie one cell after the other.
pub(super) trait Cells: Sync {
    /// Where the two runs of a body lie that hold all its neighbours not yet met: the rest of its own cell with the next, and three cells
    /// of the row above.
    fn runs(&self, cell: usize, place: usize) -> [(usize, usize); 2];

    /// Tells of everybody in some rows, of each of which some columns are wanted, a run at a time.
    fn each_run(
        &self,
        rows: RangeInclusive<usize>,
        columns: impl Fn(usize) -> RangeInclusive<usize>,
        tell: impl FnMut(Range<usize>),
    );
}

/// Every cell of a layout, numbered row by row.
pub(super) struct Dense<'a> {
    /// Where each begins.
    start: &'a [u32],
    columns: usize,
}

impl<'a> Dense<'a> {
    pub(super) fn new(start: &'a [u32], layout: &Layout) -> Self {
        Self { start, columns: layout.columns }
    }
}

impl Cells for Dense<'_> {
    #[inline(always)]
    fn runs(&self, cell: usize, place: usize) -> [(usize, usize); 2] {
        let (start, above) = (self.start, cell + self.columns);
        [(place + 1, start[cell + 2] as usize), (start[above - 1] as usize, start[above + 2] as usize)]
    }

    fn each_run(
        &self,
        rows: RangeInclusive<usize>,
        columns: impl Fn(usize) -> RangeInclusive<usize>,
        mut tell: impl FnMut(Range<usize>),
    ) {
        for row in rows {
            let (first, columns) = (row * self.columns, columns(row));
            if !columns.is_empty() {
                tell(self.start[first + columns.start()] as usize..self.start[first + columns.end() + 1] as usize);
            }
        }
    }
}

/// Those cells of a layout that hold somebody, numbered in the same order: as many as bodies, however far these are apart.
#[derive(Default, Debug)]
pub(super) struct Sparse {
    /// Row and column of each, and where it begins.
    keys: Vec<u64>,
    start: Vec<u32>,
    /// Of each the end of its next, and beginning and end of those above.
    around: Vec<[u32; 3]>,
    by_key: Vec<(u64, u32)>,
}

/// So that those of a row follow each other.
fn key(column: usize, row: usize) -> u64 {
    (row as u64) << 32 | column as u64
}

const ROW: u64 = 1 << 32;

impl Sparse {
    /// Numbers the cells of these bodies, which are told by their columns and rows; `number` is told theirs.
    pub(super) fn fill(&mut self, bodies: impl Iterator<Item = (u32, [usize; 2])>, mut number: impl FnMut(u32, u32)) {
        let Self { keys, start, around, by_key } = self;
        by_key.clear();
        by_key.extend(bodies.map(|(body, [column, row])| (key(column, row), body)));
        by_key.sort_unstable();
        keys.clear();
        start.clear();
        around.clear();
        for (place, &(key, body)) in by_key.iter().enumerate() {
            if keys.last() != Some(&key) {
                keys.push(key);
                start.push(place as u32);
            }
            number(body, keys.len() as u32 - 1);
        }
        start.push(by_key.len() as u32);
        let (mut first, mut end) = (0, 0);
        for (cell, &key) in keys.iter().enumerate() {
            let next = cell + 1 + usize::from(keys.get(cell + 1) == Some(&(key + 1)));
            first = pass(keys, first, key + ROW - 1);
            end = pass(keys, end, key + ROW + 2);
            around.push([next, first, end].map(|cell| start[cell]));
        }
    }

    pub(super) fn len(&self) -> usize {
        self.keys.len()
    }

    /// Where each begins, and the last ends.
    pub(super) fn start(&self) -> &[u32] {
        &self.start
    }
}

/// The first cell from one on that is not before a key.
fn pass(keys: &[u64], from: usize, key: u64) -> usize {
    from + keys[from..].iter().take_while(|&&other| other < key).count()
}

impl Cells for Sparse {
    #[inline(always)]
    fn runs(&self, cell: usize, place: usize) -> [(usize, usize); 2] {
        let [next, first, end] = self.around[cell].map(|place| place as usize);
        [(place + 1, next), (first, end)]
    }

    fn each_run(
        &self,
        rows: RangeInclusive<usize>,
        columns: impl Fn(usize) -> RangeInclusive<usize>,
        mut tell: impl FnMut(Range<usize>),
    ) {
        let from = |key| self.keys.partition_point(|&other| other < key);
        let mut row = *rows.start();
        while row <= *rows.end() {
            let columns = columns(row);
            let end = from(key(columns.end() + 1, row));
            if !columns.is_empty() {
                tell(self.start[from(key(*columns.start(), row))] as usize..self.start[end] as usize);
            }
            // Rows without anybody are passed over.
            row = self.keys.get(end).map_or(usize::MAX, |key| ((key >> 32) as usize).max(row + 1));
        }
    }
}
