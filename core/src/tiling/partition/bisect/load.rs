//! What there is to do in a tile, counted.

use super::super::bisection::tiles_of_first;
use crate::model::id::TileId;
use bytemuck::{Pod, Zeroable};

/// What a contact takes, in what a body takes that touches nothing: 19 ns.
pub(super) const CONTACT: u32 = 7;

/// What a ghost takes.
pub(super) const GHOST: u32 = 13;

/// What a contact takes that is solved for others.
const SOLVED_FOR_OTHERS: u32 = 10;

/// Deeper cuts than this are told of with the last of these.
const DEPTH: usize = 24;

/// What a tile has to do, in bodies that touch nothing.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Load {
    /// Which tile.
    pub tile: TileId,
    /// What comes of its own bodies.
    pub own: u32,
    /// What comes of others' bodies: of those that the first cut of the domain has cut off, those that the next one has, and so on.
    pub others: [u32; DEPTH],
}

impl Load {
    /// That of one of so many tiles with so many bodies, contacts of its own and contacts that it solves for others, and with ghosts of
    /// which these are the owners, those of each together.
    pub(crate) fn new(tiles: usize, tile: TileId, counts: [usize; 3], ghosts: &[TileId]) -> Self {
        let [bodies, contacts, solved] = counts.map(|count| count as u64);
        let own = bodies + u64::from(CONTACT) * contacts;
        let all = u64::from(GHOST) * ghosts.len() as u64 + u64::from(SOLVED_FOR_OTHERS) * solved;
        let mut others = [0; DEPTH];
        for ghosts_of_one in ghosts.chunk_by(|a, b| a == b) {
            let depth = parting(tiles, tile, ghosts_of_one[0]).min(DEPTH - 1);
            others[depth] += all * ghosts_of_one.len() as u64 / ghosts.len() as u64;
        }
        let told = |load: u64| u32::try_from(load).unwrap_or(u32::MAX);
        Self { tile, own: told(own), others: others.map(told) }
    }

    /// That of a tile in which there is nothing.
    pub(super) fn nothing(tile: TileId) -> Self {
        Self { tile, own: 0, others: [0; DEPTH] }
    }

    /// All of it.
    pub(super) fn all(&self) -> u64 {
        self.up_to(DEPTH)
    }

    /// All of it, but for what comes of bodies that were cut off by deeper cuts than these first ones.
    pub(super) fn up_to(&self, cuts: usize) -> u64 {
        u64::from(self.own) + self.others[..cuts.min(DEPTH)].iter().copied().map(u64::from).sum::<u64>()
    }
}

/// How many cuts two of so many tiles have on the same side before they are parted.
fn parting(tiles: usize, a: TileId, b: TileId) -> usize {
    let (mut tiles, mut a, mut b, mut depth) = (tiles, a.0 as usize, b.0 as usize, 0);
    while tiles > 1 {
        let first = tiles_of_first(tiles);
        match (a < first, b < first) {
            (true, true) => tiles = first,
            (false, false) => (tiles, a, b) = (tiles - first, a - first, b - first),
            _ => break,
        }
        depth += 1;
    }
    depth
}
