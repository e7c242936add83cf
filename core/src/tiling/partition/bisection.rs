//! A rectangle cut in two, again and again, wherever that shares what there is to do: a k-d tree whose leaves are the tiles.
//!
//! Orthogonal recursive bisection: M. J. Berger, S. H. Bokhari, "A partitioning strategy for nonuniform problems on
//! multiprocessors", 1987. Where to cut is in `bisect.rs`.

use super::Region;
use super::tree::Tree;
use crate::model::error::SetupError;
use crate::model::id::TileId;
use bytemuck::{Pod, Zeroable};
use glam::DVec2;
use std::ops::Range;

/// Cuts are made at whole parts of the domain, so many along each axis.
pub(super) const PARTS: u64 = 1 << 32;

/// Where a rectangle is cut in two.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Bisector {
    /// 0 if it is cut across the x axis, into a left and a right part; 1 if across the y axis, into a lower and an upper one.
    pub axis: u32,
    /// Where on that axis, counted from the low side of the domain in parts of 2^-32 of its size.
    pub at: u32,
}

/// A part of the domain, in whole [`PARTS`] of it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Block {
    pub(super) min: [u64; 2],
    pub(super) max: [u64; 2],
}

impl Block {
    pub(super) const ALL: Self = Self { min: [0; 2], max: [PARTS; 2] };

    /// The two parts it is cut into, if the cut lies within.
    pub(super) fn cut(self, Bisector { axis, at }: Bisector) -> Option<[Self; 2]> {
        let (axis, at) = (axis as usize, u64::from(at));
        if axis > 1 || !(self.min[axis] + 1..self.max[axis]).contains(&at) {
            return None;
        }
        let (mut low, mut high) = (self, self);
        (low.max[axis], high.min[axis]) = (at, at);
        Some([low, high])
    }
}

/// How many tiles the first of two parts gets of those that a rectangle is cut into.
pub(super) fn tiles_of_first(tiles: usize) -> usize {
    tiles / 2
}

#[derive(Clone, PartialEq, Debug)]
pub(super) struct Bisection {
    min: DVec2,
    max: DVec2,
    /// In the order of a walk that comes to a rectangle before its parts.
    cuts: Vec<Bisector>,
    /// By tile.
    blocks: Vec<Block>,
    tree: Tree,
}

impl Bisection {
    pub(super) fn new(min: DVec2, max: DVec2, cuts: &[Bisector]) -> Result<Self, SetupError> {
        let mut bisection = Self { min, max, cuts: cuts.to_vec(), blocks: Vec::new(), tree: Tree::default() };
        if !(min.is_finite() && max.is_finite()) {
            return Err(SetupError::BadBisection { cut: 0 });
        }
        let mut unread = (0..).zip(cuts.iter().copied());
        bisection.grow(Block::ALL, cuts.len() + 1, &mut unread)?;
        Ok(bisection)
    }

    /// Appends a rectangle and all its parts.
    fn grow(
        &mut self,
        block: Block,
        tiles: usize,
        cuts: &mut impl Iterator<Item = (u32, Bisector)>,
    ) -> Result<(), SetupError> {
        let rectangle = self.rectangle_of(block);
        let region = rectangle.opened(self.min, self.max);
        if tiles == 1 {
            let cut = self.tree.tiles() as u32;
            if rectangle.min.cmpge(rectangle.max).any() {
                return Err(SetupError::BadBisection { cut });
            }
            self.blocks.push(block);
            self.tree.push_tile(region);
            return Ok(());
        }
        let (number, cut) = cuts.next().expect("a cut for every two tiles");
        let [low, high] = block.cut(cut).ok_or(SetupError::BadBisection { cut: number })?;
        let (node, first) = (self.tree.open(region), tiles_of_first(tiles));
        self.grow(low, first, cuts)?;
        self.grow(high, tiles - first, cuts)?;
        self.tree.close(node);
        Ok(())
    }

    fn rectangle_of(&self, Block { min, max }: Block) -> Region {
        let edge = |[x, y]: [u64; 2]| {
            let part = |count: u64| count as f64 / PARTS as f64;
            let place = self.min + (self.max - self.min) * DVec2::new(part(x), part(y));
            let is_last = glam::BVec2::new(x == PARTS, y == PARTS);
            DVec2::select(is_last, self.max, place)
        };
        Region { min: edge(min), max: edge(max) }
    }

    pub(super) fn min(&self) -> DVec2 {
        self.min
    }

    pub(super) fn max(&self) -> DVec2 {
        self.max
    }

    pub(super) fn cuts(&self) -> &[Bisector] {
        &self.cuts
    }

    pub(super) fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    pub(super) fn tiles(&self) -> usize {
        self.blocks.len()
    }

    pub(super) fn region(&self, tile: TileId) -> Region {
        *self.tree.region(tile)
    }

    pub(super) fn locate(&self, point: DVec2) -> TileId {
        self.tree.locate(0..self.tree.nodes(), point)
    }

    pub(super) fn meeting(&self, low: DVec2, high: DVec2) -> Meeting<'_> {
        Meeting { tree: &self.tree, low, high, nodes: 0..self.tree.nodes() }
    }
}

/// The tiles that meet a box, ascending.
#[derive(Clone, Debug)]
pub(super) struct Meeting<'a> {
    tree: &'a Tree,
    low: DVec2,
    high: DVec2,
    nodes: Range<u32>,
}

impl Iterator for Meeting<'_> {
    type Item = TileId;

    fn next(&mut self) -> Option<TileId> {
        self.tree.next_met(&mut self.nodes, self.low, self.high)
    }
}
