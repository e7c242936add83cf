//! Squares that are cut in four, again and again: a quadtree for each cell of a grid, whose leaves are the tiles.
//!
//! The nodes of a tree lie in the order of a walk that comes to a node before its parts, and each knows where the walk goes on
//! that leaves these out: so a search needs no stack, and finds leaves in ascending order.

use super::grid::{Grid, Span};
use super::{Region, census};
use crate::model::error::SetupError;
use crate::model::id::TileId;
use glam::DVec2;

/// A square is cut no more often than this.
pub(super) const MOST_LEVELS: u8 = 24;

/// What a node holds in place of a tile that was cut.
const CUT: u32 = u32::MAX;

#[derive(Clone, PartialEq, Debug)]
pub(super) struct Forest {
    roots: Grid,
    /// By tile: how often its root was cut.
    levels: Vec<u8>,
    /// The most of these.
    deepest: u8,
    /// Where each tile is among `nodes`.
    leaves: Vec<u32>,
    nodes: Vec<Node>,
    /// Where the tree of each root begins among `nodes`; and where the last one ends.
    trees: Vec<u32>,
}

#[derive(Clone, PartialEq, Debug)]
struct Node {
    /// Infinite where it is outermost.
    region: Region,
    /// Where the nodes end that are parts of this one.
    end: u32,
    /// Which tile it is, or [`CUT`].
    tile: u32,
}

impl Forest {
    pub(super) fn new(roots: Grid, levels: &[u8]) -> Result<Self, SetupError> {
        let deepest = levels.iter().copied().max().unwrap_or(0);
        let leaves = Vec::with_capacity(levels.len());
        let mut forest = Self { levels: levels.to_vec(), deepest, leaves, nodes: Vec::new(), trees: vec![0], roots };
        let mut unread = levels.iter().copied();
        for root in 0..forest.roots.cells() as u32 {
            let rectangle = forest.roots.rectangle(root);
            forest.grow(rectangle, 0, &mut unread)?;
            forest.trees.push(forest.nodes.len() as u32);
        }
        match unread.next() {
            None => Ok(forest),
            Some(_) => Err(SetupError::BadForest { tile: TileId(forest.leaves.len() as u32) }),
        }
    }

    /// Appends a node and all its parts.
    fn grow(
        &mut self,
        rectangle: Region,
        level: u8,
        levels: &mut (impl Iterator<Item = u8> + Clone),
    ) -> Result<(), SetupError> {
        let tile = self.leaves.len() as u32;
        let refused = SetupError::BadForest { tile: TileId(tile) };
        let leaf = levels.clone().next().ok_or(refused.clone())?;
        let place = self.nodes.len();
        self.nodes.push(Node { region: self.opened(rectangle), end: 0, tile: CUT });
        if leaf == level {
            levels.next();
            self.nodes[place].tile = tile;
            self.leaves.push(place as u32);
        } else {
            let parts = census::quarters(&rectangle);
            if leaf < level || level == MOST_LEVELS || parts.iter().any(|part| part.min.cmpge(part.max).any()) {
                return Err(refused);
            }
            for part in parts {
                self.grow(part, level + 1, levels)?;
            }
        }
        self.nodes[place].end = self.nodes.len() as u32;
        Ok(())
    }

    /// A rectangle of the domain, and what lies beyond of it where it is outermost.
    fn opened(&self, Region { min, max }: Region) -> Region {
        let (low, high) = (self.roots.min(), self.roots.max());
        Region {
            min: DVec2::select(min.cmple(low), DVec2::NEG_INFINITY, min),
            max: DVec2::select(max.cmpge(high), DVec2::INFINITY, max),
        }
    }

    pub(super) fn roots(&self) -> &Grid {
        &self.roots
    }

    pub(super) fn levels(&self) -> &[u8] {
        &self.levels
    }

    pub(super) fn region(&self, tile: TileId) -> Region {
        self.nodes[self.leaves[tile.0 as usize] as usize].region
    }

    pub(super) fn rectangle(&self, tile: TileId) -> Region {
        let Region { min, max } = self.region(tile);
        Region { min: min.max(self.roots.min()), max: max.min(self.roots.max()) }
    }

    pub(super) fn locate(&self, point: DVec2) -> TileId {
        let root = self.roots.locate(point) as usize;
        let (mut at, end) = (self.trees[root], self.trees[root + 1]);
        while at < end {
            let node = &self.nodes[at as usize];
            if !node.region.contains(point) {
                at = node.end;
            } else if node.tile == CUT {
                at += 1;
            } else {
                return TileId(node.tile);
            }
        }
        // What is no number is in no part of its root.
        let first = self.nodes[self.trees[root] as usize..].iter().find(|node| node.tile != CUT);
        TileId(first.expect("every tree has a leaf").tile)
    }

    pub(super) fn meeting(&self, low: DVec2, high: DVec2) -> Meeting<'_> {
        Meeting { forest: self, low, high, roots: self.roots.span(low, high), at: 0, end: 0 }
    }

    /// As [`cell`](super::Partition::cell).
    pub(super) fn cell(&self, tile: TileId) -> ([u64; 2], [u64; 2]) {
        let deepest = self.deepest;
        let corner = self.rectangle(tile).min;
        let root = self.trees.partition_point(|&first| first <= self.leaves[tile.0 as usize]) as u32 - 1;
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
    /// The next node of this one.
    at: u32,
    end: u32,
}

impl Iterator for Meeting<'_> {
    type Item = TileId;

    fn next(&mut self) -> Option<TileId> {
        loop {
            while self.at < self.end {
                let node = &self.forest.nodes[self.at as usize];
                if !node.region.meets(self.low, self.high) {
                    self.at = node.end;
                    continue;
                }
                self.at += 1;
                if node.tile != CUT {
                    return Some(TileId(node.tile));
                }
            }
            let root = self.roots.next()? as usize;
            (self.at, self.end) = (self.forest.trees[root], self.forest.trees[root + 1]);
        }
    }
}
