//! Who owns what, and who needs to know: the geometry of tiles.

use crate::model::error::SetupError;
use crate::model::id::TileId;
use glam::{DVec2, Vec2};
use std::ops::RangeInclusive;

#[cfg(test)]
mod tests;

/// The domain cut into columns x rows equal tiles.
///
/// A tile holds the half-open rectangle between its edges; the outermost ones reach to infinity, so that every point of
/// the plane belongs to exactly one tile.
#[derive(Clone, PartialEq, Debug)]
pub struct TileGrid {
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

impl TileGrid {
    /// Cuts the rectangle from `min` to `max` into equal tiles.
    pub fn new(min: DVec2, max: DVec2, columns: u32, rows: u32) -> Result<Self, SetupError> {
        let size = max - min;
        let refuse = |must| SetupError::BadGrid { columns, rows, width: size.x, height: size.y, must };
        if !(min.is_finite() && max.is_finite() && size.x > 0.0 && size.y > 0.0) {
            return Err(refuse("the domain must be finite, its maximum above its minimum"));
        }
        if columns == 0 || rows == 0 {
            return Err(refuse("there must be at least one column and one row"));
        }
        if u64::from(columns) * u64::from(rows) > u64::from(u32::MAX) {
            return Err(refuse("at most 2^32 tiles can be named"));
        }
        let grid = Self { x: Axis::new(min.x, max.x, columns), y: Axis::new(min.y, max.y, rows) };
        let rising = |axis: &Axis| axis.edges.windows(2).all(|pair| pair[0] < pair[1]);
        if rising(&grid.x) && rising(&grid.y) { Ok(grid) } else { Err(refuse("the tiles must have a width")) }
    }

    /// Tiles along x.
    pub fn columns(&self) -> usize {
        self.x.count()
    }

    /// Tiles along y.
    pub fn rows(&self) -> usize {
        self.y.count()
    }

    /// How many tiles there are.
    pub fn tiles(&self) -> usize {
        self.columns() * self.rows()
    }

    /// The low corner of the domain.
    pub fn min(&self) -> DVec2 {
        DVec2::new(self.x.edges[0], self.y.edges[0])
    }

    /// The high corner of the domain.
    pub fn max(&self) -> DVec2 {
        DVec2::new(self.x.edges[self.columns()], self.y.edges[self.rows()])
    }

    /// Width and height of a tile, in meters.
    pub fn tile_size(&self) -> DVec2 {
        (self.max() - self.min()) / DVec2::new(self.columns() as f64, self.rows() as f64)
    }

    /// The tile that owns a body whose center of mass is at `point`.
    #[inline]
    pub fn locate(&self, point: DVec2) -> TileId {
        self.tile_at(self.x.locate(point.x), self.y.locate(point.y))
    }

    /// The rectangle a tile owns; infinite where the tile is outermost.
    #[inline]
    pub fn region(&self, tile: TileId) -> Region {
        // In 32 bits, in which division is fast.
        let columns = self.columns() as u32;
        let (column, row) = ((tile.0 % columns) as usize, (tile.0 / columns) as usize);
        let ((min_x, max_x), (min_y, max_y)) = (self.x.span(column), self.y.span(row));
        Region { min: DVec2::new(min_x, min_y), max: DVec2::new(max_x, max_y) }
    }

    /// A finite point to measure a tile's coordinates from: the low corner of its rectangle.
    pub(crate) fn corner(&self, tile: TileId) -> DVec2 {
        let (column, row) = (tile.0 as usize % self.columns(), tile.0 as usize / self.columns());
        DVec2::new(self.x.edges[column], self.y.edges[row])
    }

    /// Every tile whose region, grown by `reach` on all sides, meets the box of the given half extents around `center`.
    /// In ascending order. Never assumes that these are neighbours of anything.
    pub fn reached(&self, center: DVec2, half: Vec2, reach: f64) -> impl Iterator<Item = TileId> + '_ {
        let (columns, rows) = self.reached_span(center, half, reach);
        rows.flat_map(move |row| columns.clone().map(move |column| self.tile_at(column, row)))
    }

    /// Whether two tiles share an edge or a corner, or are the same.
    pub(crate) fn are_neighbours(&self, a: TileId, b: TileId) -> bool {
        let place = |tile: TileId| (tile.0 as usize % self.columns(), tile.0 as usize / self.columns());
        let ((ax, ay), (bx, by)) = (place(a), place(b));
        ax.abs_diff(bx) <= 1 && ay.abs_diff(by) <= 1
    }

    /// Whether a tile is among those [`TileGrid::reached`].
    #[inline]
    pub(crate) fn reaches(&self, tile: TileId, center: DVec2, half: Vec2, reach: f64) -> bool {
        let (region, half) = (self.region(tile), half.as_dvec2() + DVec2::splat(reach));
        let (low, high) = (center - half, center + half);
        // Bitwise `&`: four comparisons without a branch.
        (low.x < region.max.x) & (low.y < region.max.y) & (high.x >= region.min.x) & (high.y >= region.min.y)
    }

    #[inline]
    fn reached_span(&self, center: DVec2, half: Vec2, reach: f64) -> (RangeInclusive<usize>, RangeInclusive<usize>) {
        let (half_x, half_y) = (f64::from(half.x) + reach, f64::from(half.y) + reach);
        (
            self.x.locate(center.x - half_x)..=self.x.locate(center.x + half_x),
            self.y.locate(center.y - half_y)..=self.y.locate(center.y + half_y),
        )
    }

    fn tile_at(&self, column: usize, row: usize) -> TileId {
        TileId((row * self.columns() + column) as u32)
    }
}

/// The rectangle a tile owns, in world coordinates, half-open.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Region {
    /// Low corner, inside.
    pub min: DVec2,
    /// High corner, outside.
    pub max: DVec2,
}

impl Region {
    /// The same rectangle moved inward on every side; a point within it is further than `inset` from any other tile.
    pub(crate) fn shrunk(&self, inset: f64) -> Self {
        Self { min: self.min + DVec2::splat(inset), max: self.max - DVec2::splat(inset) }
    }

    /// Whether a point lies within.
    #[inline(always)]
    pub fn contains(&self, point: DVec2) -> bool {
        // Bitwise `&`: four comparisons without a branch.
        (point.x >= self.min.x) & (point.x < self.max.x) & (point.y >= self.min.y) & (point.y < self.max.y)
    }
}
