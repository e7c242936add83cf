//! A rectangle cut into columns and rows of equal cells.

use super::Region;
use crate::model::error::SetupError;
use glam::DVec2;

/// Cells, row by row: cell `row * columns + column`.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Grid {
    x: Axis,
    y: Axis,
}

/// One direction of the grid: its edges, computed once, so that every rank compares against the same bits.
#[derive(Clone, PartialEq, Debug)]
struct Axis {
    edges: Vec<f64>,
    per_meter: f64,
}

impl Axis {
    fn new(min: f64, max: f64, count: u32) -> Self {
        let edges = (0..=count).map(|i| min + (max - min) * (f64::from(i) / f64::from(count))).collect();
        Self { edges, per_meter: f64::from(count) / (max - min) }
    }

    fn count(&self) -> usize {
        self.edges.len() - 1
    }

    /// The slot that holds `v`: a guess by multiplication, settled by comparing with the edges. NaN goes to the first.
    #[inline]
    fn locate(&self, v: f64) -> usize {
        let last = self.count() - 1;
        let mut slot = (((v - self.edges[0]) * self.per_meter) as usize).min(last);
        while slot < last && v >= self.edges[slot + 1] {
            slot += 1;
        }
        while slot > 0 && v < self.edges[slot] {
            slot -= 1;
        }
        slot
    }

    fn span(&self, slot: usize) -> (f64, f64) {
        let low = if slot == 0 { f64::NEG_INFINITY } else { self.edges[slot] };
        let high = if slot + 1 == self.count() { f64::INFINITY } else { self.edges[slot + 1] };
        (low, high)
    }
}

impl Grid {
    pub(super) fn new(min: DVec2, max: DVec2, columns: u32, rows: u32) -> Result<Self, SetupError> {
        let size = max - min;
        let refuse = |must| SetupError::BadGrid { columns, rows, width: size.x, height: size.y, must };
        if !(min.is_finite() && max.is_finite() && size.x > 0.0 && size.y > 0.0) {
            return Err(refuse("the domain must be finite, its maximum above its minimum"));
        }
        if columns == 0 || rows == 0 {
            return Err(refuse("there must be at least one column and one row"));
        }
        if u64::from(columns) * u64::from(rows) > u64::from(u32::MAX) {
            return Err(refuse("fewer than 2^32 tiles can be named"));
        }
        let grid = Self { x: Axis::new(min.x, max.x, columns), y: Axis::new(min.y, max.y, rows) };
        let rising = |axis: &Axis| axis.edges.windows(2).all(|pair| pair[0] < pair[1]);
        if rising(&grid.x) && rising(&grid.y) { Ok(grid) } else { Err(refuse("the tiles must have a width")) }
    }

    pub(super) fn columns(&self) -> usize {
        self.x.count()
    }

    pub(super) fn rows(&self) -> usize {
        self.y.count()
    }

    pub(super) fn cells(&self) -> usize {
        self.columns() * self.rows()
    }

    pub(super) fn min(&self) -> DVec2 {
        DVec2::new(self.x.edges[0], self.y.edges[0])
    }

    pub(super) fn max(&self) -> DVec2 {
        DVec2::new(self.x.edges[self.columns()], self.y.edges[self.rows()])
    }

    /// Column and row of a cell.
    #[inline]
    pub(super) fn place(&self, cell: u32) -> [usize; 2] {
        // In 32 bits, in which division is fast.
        let columns = self.columns() as u32;
        [(cell % columns) as usize, (cell / columns) as usize]
    }

    #[inline]
    pub(super) fn locate(&self, point: DVec2) -> u32 {
        (self.y.locate(point.y) * self.columns() + self.x.locate(point.x)) as u32
    }

    /// A cell's rectangle; infinite where it is outermost.
    #[inline]
    pub(super) fn region(&self, cell: u32) -> Region {
        let [column, row] = self.place(cell);
        let ((min_x, max_x), (min_y, max_y)) = (self.x.span(column), self.y.span(row));
        Region { min: DVec2::new(min_x, min_y), max: DVec2::new(max_x, max_y) }
    }

    /// A cell's rectangle within the domain.
    pub(super) fn rectangle(&self, cell: u32) -> Region {
        let [column, row] = self.place(cell);
        Region {
            min: DVec2::new(self.x.edges[column], self.y.edges[row]),
            max: DVec2::new(self.x.edges[column + 1], self.y.edges[row + 1]),
        }
    }

    /// The cells that meet a box, both of whose corners belong to it, ascending.
    #[inline]
    pub(super) fn span(&self, low: DVec2, high: DVec2) -> Span {
        let (left, bottom) = (self.x.locate(low.x) as u32, self.y.locate(low.y) as u32);
        let (right, top) = (self.x.locate(high.x) as u32, self.y.locate(high.y) as u32);
        let columns = self.columns() as u32;
        let (first, last) = (bottom * columns + left, top * columns + right);
        // A box without a point, as of what is no number, meets nothing.
        let next = if left <= right { first } else { last.saturating_add(1) };
        Span { next, last, width: right.saturating_sub(left), column: 0, columns }
    }
}

/// Some columns of some rows, cell by cell.
#[derive(Clone, Debug)]
pub(super) struct Span {
    next: u32,
    last: u32,
    /// One less than the columns.
    width: u32,
    column: u32,
    /// Of the grid.
    columns: u32,
}

impl Iterator for Span {
    type Item = u32;

    #[inline]
    fn next(&mut self) -> Option<u32> {
        if self.next > self.last {
            return None;
        }
        let cell = self.next;
        if self.column < self.width {
            self.column += 1;
            self.next += 1;
        } else {
            self.column = 0;
            // Behind the last cell there may be no number left.
            self.next = (cell - self.width).saturating_add(self.columns);
            if cell == self.last {
                (self.next, self.last) = (1, 0);
            }
        }
        Some(cell)
    }
}
