//! Who owns what, and who needs to know: the geometry of tiles.

mod bisect;
mod bisection;
mod census;
mod forest;
mod grid;
mod surroundings;
#[cfg(test)]
mod tests;
mod tree;

pub use bisect::{Bisecting, Decision, Load, Tally};
use bisection::Bisection;
pub use bisection::Bisector;
pub(crate) use census::CONTACT;
pub use census::{Adaptive, Census, Change};

use crate::model::error::SetupError;
use crate::model::id::TileId;
use forest::Forest;
use glam::{DVec2, Vec2};
use grid::{Grid, Span};
pub(crate) use surroundings::Surroundings;

/// How the domain is cut into tiles.
///
/// Each tile holds the half-open rectangle between its edges; the outermost ones reach to infinity, so that every point of
/// the plane belongs to exactly one tile. Tiles may be of any sizes, and border any number of others.
#[derive(Clone, PartialEq, Debug)]
pub struct Partition(Cut);

#[derive(Clone, PartialEq, Debug)]
enum Cut {
    /// Equal tiles.
    Uniform(Grid),
    /// Tiles that are cut in four as often as there is reason to.
    Forest(Forest),
    /// Tiles that are cut in two wherever that shares what there is to do.
    Bisection(Bisection),
}

impl Partition {
    /// Cuts the rectangle from `min` to `max` into columns x rows of equal tiles, of which tile `row * columns + column` lies
    /// there.
    ///
    /// # Errors
    /// If that makes no tiles.
    pub fn uniform(min: DVec2, max: DVec2, columns: u32, rows: u32) -> Result<Self, SetupError> {
        Grid::new(min, max, columns, rows).map(|grid| Self(Cut::Uniform(grid)))
    }

    /// Cuts the rectangle into columns x rows of equal squares, and those into four again and again, until each has the level
    /// that is given: how often it was cut. Tiles are counted square by square, and in each in the order of a Z curve: lower
    /// left, lower right, upper left, upper right.
    ///
    /// # Errors
    /// If that makes no tiles, or the levels are not those of such a cut.
    pub fn forest(min: DVec2, max: DVec2, columns: u32, rows: u32, levels: &[u8]) -> Result<Self, SetupError> {
        Forest::new(Grid::new(min, max, columns, rows)?, levels).map(|forest| Self(Cut::Forest(forest)))
    }

    /// Whether all tiles are equal.
    pub fn is_uniform(&self) -> bool {
        matches!(self.0, Cut::Uniform(_))
    }

    /// The levels of all tiles, if it is a [`forest`](Self::forest): with [`roots`](Self::roots) they tell all of it.
    pub fn levels(&self) -> Option<&[u8]> {
        match &self.0 {
            Cut::Uniform(_) | Cut::Bisection(_) => None,
            Cut::Forest(forest) => Some(forest.levels()),
        }
    }

    /// The cuts, if it is a [`bisection`](Self::bisection): they tell all of it.
    pub fn cuts(&self) -> Option<&[Bisector]> {
        match &self.0 {
            Cut::Uniform(_) | Cut::Forest(_) => None,
            Cut::Bisection(bisection) => Some(bisection.cuts()),
        }
    }

    /// Columns and rows of tiles; of a forest those of the squares that are cut further; of a bisection, a row of all.
    pub fn roots(&self) -> [u32; 2] {
        let of_grid = |grid: &Grid| [grid.columns() as u32, grid.rows() as u32];
        match &self.0 {
            Cut::Uniform(grid) => of_grid(grid),
            Cut::Forest(forest) => of_grid(forest.roots()),
            Cut::Bisection(bisection) => [bisection.tiles() as u32, 1],
        }
    }

    /// How many tiles there are.
    pub fn tiles(&self) -> usize {
        match &self.0 {
            Cut::Uniform(grid) => grid.cells(),
            Cut::Forest(forest) => forest.levels().len(),
            Cut::Bisection(bisection) => bisection.tiles(),
        }
    }

    /// The low corner of the domain.
    pub fn min(&self) -> DVec2 {
        match &self.0 {
            Cut::Uniform(grid) => grid.min(),
            Cut::Forest(forest) => forest.roots().min(),
            Cut::Bisection(bisection) => bisection.min(),
        }
    }

    /// The high corner of the domain.
    pub fn max(&self) -> DVec2 {
        match &self.0 {
            Cut::Uniform(grid) => grid.max(),
            Cut::Forest(forest) => forest.roots().max(),
            Cut::Bisection(bisection) => bisection.max(),
        }
    }

    /// The tile that owns a body whose center of mass is at `point`.
    #[inline]
    pub fn locate(&self, point: DVec2) -> TileId {
        match &self.0 {
            Cut::Uniform(grid) => TileId(grid.locate(point)),
            Cut::Forest(forest) => forest.locate(point),
            Cut::Bisection(bisection) => bisection.locate(point),
        }
    }

    /// The rectangle a tile owns; infinite where the tile is outermost.
    ///
    /// # Panics
    /// If there is no such tile.
    #[inline]
    pub fn region(&self, tile: TileId) -> Region {
        match &self.0 {
            Cut::Uniform(grid) => grid.region(tile.0),
            Cut::Forest(forest) => forest.region(tile),
            Cut::Bisection(bisection) => bisection.region(tile),
        }
    }

    /// The part of the domain that a tile owns.
    ///
    /// # Panics
    /// If there is no such tile.
    pub fn rectangle(&self, tile: TileId) -> Region {
        match &self.0 {
            Cut::Uniform(grid) => grid.rectangle(tile.0),
            Cut::Forest(_) | Cut::Bisection(_) => self.region(tile).closed(self.min(), self.max()),
        }
    }

    /// Where a tile's low corner is, counted in columns and rows of the smallest tiles, and how many of these there are.
    pub fn cell(&self, tile: TileId) -> ([u64; 2], [u64; 2]) {
        match &self.0 {
            Cut::Uniform(grid) => {
                (grid.place(tile.0).map(|place| place as u64), [grid.columns() as u64, grid.rows() as u64])
            }
            Cut::Forest(forest) => forest.cell(tile, self.rectangle(tile).min),
            Cut::Bisection(bisection) => (bisection.blocks()[tile.0 as usize].min, [bisection::PARTS; 2]),
        }
    }

    /// Every tile whose region, grown by `reach` on all sides, meets the box of the given half extents around `center`.
    /// In ascending order. Never assumes that these are neighbours of anything.
    #[inline]
    pub fn reached(&self, center: DVec2, half: Vec2, reach: f64) -> impl Iterator<Item = TileId> + '_ {
        let half = half.as_dvec2() + DVec2::splat(reach);
        self.met(center - half, center + half)
    }

    /// The tiles that share an edge or a corner with one, and this itself, in ascending order.
    pub fn around(&self, tile: TileId) -> impl Iterator<Item = TileId> + '_ {
        let Region { min, max } = self.rectangle(tile);
        self.met(DVec2::new(min.x.next_down(), min.y.next_down()), max)
    }

    /// The tiles that meet a box, both of whose corners belong to it, in ascending order.
    #[inline]
    pub fn met(&self, low: DVec2, high: DVec2) -> impl Iterator<Item = TileId> + '_ {
        match &self.0 {
            Cut::Uniform(grid) => Met::Uniform(grid.span(low, high)),
            Cut::Forest(forest) => Met::Forest(forest.meeting(low, high)),
            Cut::Bisection(bisection) => Met::Bisection(bisection.meeting(low, high)),
        }
    }

    /// Whether two tiles share an edge or a corner, or are the same.
    pub(crate) fn are_neighbours(&self, a: TileId, b: TileId) -> bool {
        let (a, b) = (self.region(a), self.region(b));
        a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
    }

    /// Whether a tile is among those [`reached`](Self::reached).
    #[inline]
    pub(crate) fn reaches(&self, tile: TileId, center: DVec2, half: Vec2, reach: f64) -> bool {
        let half = half.as_dvec2() + DVec2::splat(reach);
        self.region(tile).meets(center - half, center + half)
    }
}

/// The tiles that meet a box, ascending.
#[derive(Clone, Debug)]
enum Met<'a> {
    Uniform(Span),
    Forest(forest::Meeting<'a>),
    Bisection(bisection::Meeting<'a>),
}

impl Iterator for Met<'_> {
    type Item = TileId;

    #[inline]
    fn next(&mut self) -> Option<TileId> {
        match self {
            Met::Uniform(span) => span.next().map(TileId),
            Met::Forest(meeting) => meeting.next(),
            Met::Bisection(meeting) => meeting.next(),
        }
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

    /// A rectangle of a domain, and what lies beyond of that where it is outermost.
    fn opened(self, low: DVec2, high: DVec2) -> Self {
        Self {
            min: DVec2::select(self.min.cmple(low), DVec2::NEG_INFINITY, self.min),
            max: DVec2::select(self.max.cmpge(high), DVec2::INFINITY, self.max),
        }
    }

    /// The part of it that lies in a domain.
    fn closed(self, low: DVec2, high: DVec2) -> Self {
        Self { min: self.min.max(low), max: self.max.min(high) }
    }

    /// Width and height, in meters.
    pub fn size(&self) -> DVec2 {
        self.max - self.min
    }

    /// Whether it meets a box, both of whose corners belong to that.
    #[inline(always)]
    pub(crate) fn meets(&self, low: DVec2, high: DVec2) -> bool {
        // Bitwise `&`: four comparisons without a branch.
        (low.x < self.max.x) & (low.y < self.max.y) & (high.x >= self.min.x) & (high.y >= self.min.y)
    }

    /// The point within that is nearest to a point; what is no number counts as little.
    pub(crate) fn nearest(&self, point: DVec2) -> DVec2 {
        let nearest = |v: f64, min: f64, max: f64| v.max(min).min(max.next_down());
        DVec2::new(nearest(point.x, self.min.x, self.max.x), nearest(point.y, self.min.y, self.max.y))
    }

    /// Whether a point lies within.
    #[inline(always)]
    pub fn contains(&self, point: DVec2) -> bool {
        // Bitwise `&`: four comparisons without a branch.
        (point.x >= self.min.x) & (point.x < self.max.x) & (point.y >= self.min.y) & (point.y < self.max.y)
    }
}
