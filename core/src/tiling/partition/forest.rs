//! Squares that are cut in four, again and again: a quadtree for each cell of a grid, whose leaves are the tiles.

use super::grid::{Grid, Span};
use super::tree::Tree;
use super::{Region, census};
use crate::model::error::SetupError;
use crate::model::id::TileId;
use glam::DVec2;
use std::ops::Range;

/// A square is cut no more often than this.
pub(super) const MOST_LEVELS: u8 = 24;

#[derive(Clone, PartialEq, Debug)]
pub(super) struct Forest {
    roots: Grid,
    /// By tile: how often its root was cut.
    levels: Vec<u8>,
    /// The most of these.
    deepest: u8,
    tree: Tree,
    /// Where the tree of each root begins among the nodes; and where the last one ends.
    trees: Vec<u32>,
}

impl Forest {
    pub(super) fn new(roots: Grid, levels: &[u8]) -> Result<Self, SetupError> {
        let deepest = levels.iter().copied().max().unwrap_or(0);
        let mut forest = Self { levels: levels.to_vec(), deepest, tree: Tree::default(), trees: vec![0], roots };
        let mut unread = levels.iter().copied();
        for root in 0..forest.roots.cells() as u32 {
            let rectangle = forest.roots.rectangle(root);
            forest.grow(rectangle, 0, &mut unread)?;
            forest.trees.push(forest.tree.nodes());
        }
        match unread.next() {
            None => Ok(forest),
            Some(_) => Err(SetupError::BadForest { tile: TileId(forest.tree.tiles() as u32) }),
        }
    }

    /// Appends a node and all its parts.
    fn grow(
        &mut self,
        rectangle: Region,
        level: u8,
        levels: &mut (impl Iterator<Item = u8> + Clone),
    ) -> Result<(), SetupError> {
        let refused = SetupError::BadForest { tile: TileId(self.tree.tiles() as u32) };
        let leaf = levels.clone().next().ok_or(refused.clone())?;
        let region = rectangle.opened(self.roots.min(), self.roots.max());
        if leaf == level {
            levels.next();
            self.tree.push_tile(region);
            return Ok(());
        }
        let parts = census::quarters(&rectangle);
        if leaf < level || level == MOST_LEVELS || parts.iter().any(|part| part.min.cmpge(part.max).any()) {
            return Err(refused);
        }
        let node = self.tree.open(region);
        for part in parts {
            self.grow(part, level + 1, levels)?;
        }
        self.tree.close(node);
        Ok(())
    }

    pub(super) fn roots(&self) -> &Grid {
        &self.roots
    }

    pub(super) fn levels(&self) -> &[u8] {
        &self.levels
    }

    pub(super) fn region(&self, tile: TileId) -> Region {
        *self.tree.region(tile)
    }

    pub(super) fn locate(&self, point: DVec2) -> TileId {
        let root = self.roots.locate(point) as usize;
        self.tree.locate(self.trees[root]..self.trees[root + 1], point)
    }

    pub(super) fn meeting(&self, low: DVec2, high: DVec2) -> Meeting<'_> {
        Meeting { forest: self, low, high, roots: self.roots.span(low, high), nodes: 0..0 }
    }

    /// As [`cell`](super::Partition::cell).
    pub(super) fn cell(&self, tile: TileId, corner: DVec2) -> ([u64; 2], [u64; 2]) {
        let deepest = self.deepest;
        let root = self.trees.partition_point(|&first| first <= self.tree.place(tile)) as u32 - 1;
        let Region { min, max } = self.roots.rectangle(root);
        // Exact but for rounding: corners are parts of the root in powers of two.
        let cells = f64::from(1_u32 << deepest);
        let within = ((corner - min) / (max - min) * cells).round();
        let [column, row] = self.roots.place(root).map(|place| (place as u64) << deepest);
        let all = [self.roots.columns(), self.roots.rows()].map(|count| (count as u64) << deepest);
        ([column + within.x as u64, row + within.y as u64], all)
    }
}

/// The leaves that meet a box, ascending.
#[derive(Clone, Debug)]
pub(super) struct Meeting<'a> {
    forest: &'a Forest,
    low: DVec2,
    high: DVec2,
    /// Trees that are still to come.
    roots: Span,
    /// What is to come of this one.
    nodes: Range<u32>,
}

impl Iterator for Meeting<'_> {
    type Item = TileId;

    fn next(&mut self) -> Option<TileId> {
        loop {
            let met = self.forest.tree.next_met(&mut self.nodes, self.low, self.high);
            if met.is_some() {
                return met;
            }
            let root = self.roots.next()? as usize;
            self.nodes = self.forest.trees[root]..self.forest.trees[root + 1];
        }
    }
}
