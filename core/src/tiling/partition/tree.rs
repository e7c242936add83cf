//! Nested rectangles, of which the innermost are the tiles.
//!
//! Nodes lie in the order of a walk that comes to a node before its parts, and each knows where the walk goes on that leaves these
//! out: so a search needs no stack, and finds tiles in ascending order.

use super::Region;
use crate::model::id::TileId;
use glam::DVec2;
use std::ops::Range;

/// What a node holds in place of a tile that was cut.
const CUT: u32 = u32::MAX;

#[derive(Clone, Default, PartialEq, Debug)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// Where each tile is among `nodes`.
    leaves: Vec<u32>,
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

impl Tree {
    /// Appends a node whose parts follow; [`close`](Self::close) says where they end.
    pub(super) fn open(&mut self, region: Region) -> usize {
        self.nodes.push(Node { region, end: 0, tile: CUT });
        self.nodes.len() - 1
    }

    /// Ends the parts of a node.
    pub(super) fn close(&mut self, node: usize) {
        self.nodes[node].end = self.nodes.len() as u32;
    }

    /// Appends the next tile.
    pub(super) fn push_tile(&mut self, region: Region) {
        let (place, tile) = (self.nodes.len() as u32, self.tiles() as u32);
        self.nodes.push(Node { region, end: place + 1, tile });
        self.leaves.push(place);
    }

    pub(super) fn nodes(&self) -> u32 {
        self.nodes.len() as u32
    }

    pub(super) fn tiles(&self) -> usize {
        self.leaves.len()
    }

    pub(super) fn region(&self, tile: TileId) -> &Region {
        &self.nodes[self.place(tile) as usize].region
    }

    /// Where a tile is among the nodes.
    pub(super) fn place(&self, tile: TileId) -> u32 {
        self.leaves[tile.0 as usize]
    }

    /// The tile among some whole nodes that holds a point; the first of them, if it is no number.
    pub(super) fn locate(&self, Range { start, end }: Range<u32>, point: DVec2) -> TileId {
        let mut at = start;
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
        let first = self.nodes[start as usize..].iter().find(|node| node.tile != CUT);
        TileId(first.expect("every tree has a leaf").tile)
    }

    /// The next tile from a node on, before an end, that meets a box; moves on behind it.
    pub(super) fn next_met(&self, nodes: &mut Range<u32>, low: DVec2, high: DVec2) -> Option<TileId> {
        while nodes.start < nodes.end {
            let node = &self.nodes[nodes.start as usize];
            if !node.region.meets(low, high) {
                nodes.start = node.end;
                continue;
            }
            nodes.start += 1;
            if node.tile != CUT {
                return Some(TileId(node.tile));
            }
        }
        None
    }
}
