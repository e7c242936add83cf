//! Where a domain is cut in two, again and again, so that every tile has as much to do as any other, by exact counts alone.
//!
//! All ranks go down the tree together, level by level. Each counts what its bodies bring to do in bins along either axis of every
//! block of the level; who holds the tile in the middle of a block adds that up, finds the cut, and tells all.

mod load;
mod profile;
mod tally;

pub use load::Load;
pub use tally::Tally;

use super::bisection::{Bisection, Bisector, Block, PARTS, tiles_of_first};
use super::{Cut, Partition};
use crate::model::error::SetupError;
use crate::model::id::TileId;
use bytemuck::{Pod, Zeroable};
use glam::DVec2;
use profile::{BINS, Inner, Profile, Sums};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::iter;
use tally::{Counts, Group, Point};

/// A cut stays where it is while it is off by no more than this part of what its first part should have to do.
const TOLERANCE: f64 = 1.0 / 64.0;

/// What another axis would sever must be less than this part of what a cut severs now, for the cut to be turned.
const TURNED: f64 = 0.6;

/// And so many times what that spares must be more than all that there is to do in the block, whose bodies move for it.
const WORTH: f64 = 16.0;

/// So many places of a sample make a tally, whose sums then fit.
const TALLIED: usize = 1 << 14;

/// Whether the first of two parts has about the share that it should have.
fn is_fair(share: f64, [low, high]: [f64; 2]) -> bool {
    ((1.0 - share) * low - share * high).abs() <= TOLERANCE * share * (low + high)
}

/// A tile is at least so many times as wide as the next number is away from the greatest coordinate of the domain.
const LEAST_WIDTH: f64 = 1000.0;

/// The least width of a tile along either axis, in parts of the domain.
fn least_width(min: DVec2, max: DVec2) -> [u64; 2] {
    let spacing = |far: f64| far.next_up() - far;
    let far = min.abs().max(max.abs());
    let least = LEAST_WIDTH * DVec2::new(spacing(far.x), spacing(far.y)) / (max - min) * PARTS as f64;
    least.to_array().map(|parts| (parts.ceil() as u64).clamp(1, PARTS))
}

/// A block that is to be cut.
#[derive(Clone, Copy, Debug)]
struct Node {
    block: Block,
    /// The first of its tiles, and how many there are.
    first: usize,
    tiles: usize,
    /// The place of its cut among all, and how many led to it.
    cut: usize,
    depth: usize,
    /// Whether the same tiles were cut off across the same axes before, all the way down to here.
    is_old: bool,
    /// Whether that was at the same places.
    is_same: bool,
}

/// Where a block is cut.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Decision {
    /// The number of the block in its level.
    block: u32,
    cut: Bisector,
}

/// A bisection on its way, known alike to all ranks.
#[derive(Clone, Debug)]
pub struct Bisecting {
    min: DVec2,
    max: DVec2,
    /// The width of the halo along either axis, in parts of the domain.
    halo: [f64; 2],
    /// The least width of a tile along either axis, in parts of the domain.
    least: [u64; 2],
    /// The cuts that there were before, if there were any.
    old: Vec<Bisector>,
    /// What each tile had to do, where there were any.
    loads: Vec<Load>,
    /// All that those before each had to do.
    sums: Vec<u64>,
    /// The blocks of this level.
    nodes: Vec<Node>,
    /// Of each block whose turn has come, the cut; of the others, nothing yet.
    cuts: Vec<Bisector>,
}

impl Bisecting {
    fn new(min: DVec2, max: DVec2, tiles: usize, halo_width: f64) -> Result<Self, SetupError> {
        let halo = (halo_width / (max - min) * PARTS as f64).to_array();
        let root = Node { block: Block::ALL, first: 0, tiles, cut: 0, depth: 0, is_old: false, is_same: false };
        let nodes = if tiles > 1 { vec![root] } else { Vec::new() };
        let cuts = vec![Bisector { axis: 0, at: 0 }; tiles - 1];
        let (least, old, loads, sums) = (least_width(min, max), Vec::new(), Vec::new(), Vec::new());
        let bisecting = Self { min, max, halo, least, old, loads, sums, nodes, cuts };
        if bisecting.nodes.iter().any(|root| ![0, 1].into_iter().any(|axis| bisecting.fits(root, axis))) {
            let (columns, rows, DVec2 { x: width, y: height }) = (tiles as u32, 1, max - min);
            let must = "so far from the origin there must be fewer for each to have a width";
            return Err(SetupError::BadGrid { columns, rows, width, height, must });
        }
        Ok(bisecting)
    }

    /// Whether a block can be cut across an axis as often as it will be.
    fn fits(&self, node: &Node, axis: usize) -> bool {
        node.block.max[axis] - node.block.min[axis] >= node.tiles as u64 * self.least[axis]
    }

    /// From where to where a block can be cut across an axis, so that each part can be cut as often as it will be.
    fn room(&self, node: &Node, axis: usize) -> [u64; 2] {
        let (first, least) = (tiles_of_first(node.tiles), self.least[axis]);
        let rest = (node.tiles - first) as u64 * least;
        [node.block.min[axis] + first as u64 * least, node.block.max[axis].saturating_sub(rest)]
    }

    /// Whether all blocks are cut.
    pub fn is_done(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Whether nobody need count anything to cut the blocks of this level.
    pub fn is_clear(&self) -> bool {
        self.nodes.iter().all(|node| self.settled(node).is_some())
    }

    /// What the bodies of a tally bring to do in the blocks of this level on which must be decided: for each in which there are any, a
    /// tile whose holder is to decide, and what it must know.
    pub fn counts(&self, tally: &Tally) -> Vec<(TileId, Vec<u32>)> {
        let counts = |group: &Group| {
            let node = &self.nodes[group.block as usize];
            let mut words = vec![group.block];
            Counts::new(node.block, &group.points).write(&mut words);
            (TileId((node.first + tiles_of_first(node.tiles)) as u32), words)
        };
        let open = tally.groups.iter().filter(|group| self.settled(&self.nodes[group.block as usize]).is_none());
        open.map(counts).collect()
    }

    /// Where to cut the blocks of which these are all [counts](Self::counts), in any order, one after the other.
    ///
    /// # Errors
    /// If they are no counts.
    pub fn decide(&self, mut counts: &[u32]) -> Result<Vec<Decision>, SetupError> {
        let mut sums = BTreeMap::new();
        while !counts.is_empty() {
            counts = self.add_up(counts, &mut sums).ok_or(SetupError::BadBisection { cut: 0 })?;
        }
        let decide = |(&block, bins)| Decision { block, cut: self.best(&self.nodes[block as usize], bins) };
        Ok(sums.par_iter().map(decide).collect())
    }

    /// Adds the first of some counts to the sums of its block, and gives the others. Nothing if it cannot be read.
    fn add_up<'a>(&self, words: &'a [u32], sums: &mut BTreeMap<u32, [Sums; 2]>) -> Option<&'a [u32]> {
        let (&block, mut words) = words.split_first()?;
        self.nodes.get(block as usize)?;
        for sums in sums.entry(block).or_insert([[[0; 3]; BINS]; 2]) {
            let ([first, count], rest) = words.split_first_chunk()?;
            let bins = sums.get_mut(*first as usize..)?.get_mut(..*count as usize)?;
            let (more, rest) = rest.split_at_checked(3 * bins.len())?;
            for (sum, more) in bins.iter_mut().flatten().zip(more) {
                *sum += u64::from(*more);
            }
            words = rest;
        }
        Some(words)
    }

    /// The cut of a block that gives each part of its tiles what is due, across the axis where least is severed.
    fn best(&self, node: &Node, bins: &[Sums; 2]) -> Bisector {
        let Node { block, tiles, .. } = *node;
        let profiles = [0, 1].map(|axis| Profile::new(block.min[axis], block.max[axis], &bins[axis]));
        if profiles[0].total() <= 0.0 {
            return self.default(node);
        }
        let (known, first) = (self.old(node), tiles_of_first(tiles));
        let share = first as f64 / tiles as f64;
        let place = |axis: usize| {
            let (profile, halo) = (&profiles[axis], self.halo[axis]);
            let known = known.filter(|known| known.axis as usize == axis);
            let inner = known.map_or_else(Default::default, |_| self.inner(node));
            if let Some(known) = known.filter(|known| is_fair(share, profile.sides(f64::from(known.at), halo, inner))) {
                return known;
            }
            let [least, most] = self.room(node, axis);
            let at = (profile.place(share, halo, inner).round() as u64).clamp(least, most);
            Bisector { axis: axis as u32, at: at as u32 }
        };
        match [0, 1].map(|axis| self.fits(node, axis)) {
            [true, true] => {
                let cuts = [0, 1].map(place);
                let severed = [0, 1].map(|axis| profiles[axis].severed(f64::from(cuts[axis].at), self.halo[axis]));
                let axis = match known {
                    None => usize::from(severed[1] < severed[0]),
                    Some(known) => {
                        let (old, other) = (known.axis as usize, 1 - known.axis as usize);
                        let spared = severed[old] - severed[other];
                        let turns = severed[other] < TURNED * severed[old] && WORTH * spared > profiles[0].total();
                        if turns { other } else { old }
                    }
                };
                cuts[axis]
            }
            [x_fits, _] => place(usize::from(!x_fits)),
        }
    }

    /// The cut of a block in which there is nothing: the one that was, or across the longer side that has room for it.
    fn default(&self, node: &Node) -> Bisector {
        let Node { block, tiles, .. } = *node;
        self.old(node).unwrap_or_else(|| {
            let sides = [0, 1].map(|axis| block.max[axis] - block.min[axis]);
            let longer = usize::from(sides[1] > sides[0]);
            let axis = if self.fits(node, longer) { longer } else { 1 - longer };
            let at = block.min[axis] + sides[axis] / tiles as u64 * tiles_of_first(tiles) as u64;
            Bisector { axis: axis as u32, at: at as u32 }
        })
    }

    /// The cut that a block had, if that can be made in it and leaves room for all others.
    fn old(&self, node: &Node) -> Option<Bisector> {
        let old = *self.old.get(node.cut).filter(|_| node.is_old)?;
        let [least, most] = self.room(node, old.axis as usize);
        (least..=most).contains(&u64::from(old.at)).then_some(old)
    }

    /// The cut of a block of which nobody need count anything: the one that it had, if that shares well what its tiles have to do now.
    fn settled(&self, node: &Node) -> Option<Bisector> {
        let first = tiles_of_first(node.tiles);
        let all = |from: usize, to: usize| (self.sums[to] - self.sums[from]) as f64;
        self.old(node).filter(|_| node.is_same).filter(|_| {
            let middle = node.first + first;
            let sides = [all(node.first, middle), all(middle, node.first + node.tiles)];
            is_fair(first as f64 / node.tiles as f64, sides)
        })
    }

    /// What came of the ghosts of the inner cuts of each part of a block.
    fn inner(&self, node: &Node) -> [Inner; 2] {
        let inner = |tiles: &[Load]| {
            let outer: u64 = tiles.iter().map(|load| load.up_to(node.depth + 1)).sum();
            let all: u64 = tiles.iter().map(Load::all).sum();
            Inner { inner: (all - outer) as f64, outer: outer as f64 }
        };
        let (low, high) = self.loads[node.first..node.first + node.tiles].split_at(tiles_of_first(node.tiles));
        [inner(low), inner(high)]
    }

    /// Cuts the blocks of this level, with what was [decided](Self::decide) on any rank, and has this rank's bodies go down with them.
    ///
    /// # Errors
    /// If a cut does not lie within what it cuts.
    pub fn cut(&mut self, decisions: &[Decision], tallies: &mut [Tally]) -> Result<(), SetupError> {
        let without = |node| self.settled(node).unwrap_or_else(|| self.default(node));
        let mut level: Vec<Bisector> = self.nodes.iter().map(without).collect();
        for decision in decisions {
            *level.get_mut(decision.block as usize).ok_or(SetupError::BadBisection { cut: 0 })? = decision.cut;
        }
        let (mut halves, mut next) = (Vec::with_capacity(level.len()), Vec::with_capacity(2 * level.len()));
        for (node, cut) in self.nodes.iter().zip(level) {
            let bad = SetupError::BadBisection { cut: node.cut as u32 };
            let blocks = node.block.cut(cut).ok_or_else(|| bad.clone())?;
            let is_old = self.old(node).is_some_and(|old| old.axis == cut.axis);
            let is_same = node.is_same && self.old(node) == Some(cut);
            let (first, tiles) = (node.first, tiles_of_first(node.tiles));
            let depth = node.depth + 1;
            let low = Node { block: blocks[0], first, tiles, cut: node.cut + 1, depth, is_old, is_same };
            let (first, tiles) = (first + tiles, node.tiles - tiles);
            let high = Node { block: blocks[1], first, tiles, cut: node.cut + low.tiles, depth, is_old, is_same };
            if !(self.fits(&low, cut.axis as usize) && self.fits(&high, cut.axis as usize)) {
                return Err(bad);
            }
            let parts = [low, high].map(|part| {
                let number = next.len() as u32;
                (part.tiles > 1).then(|| {
                    next.push(part);
                    number
                })
            });
            self.cuts[node.cut] = cut;
            halves.push((cut, parts));
        }
        tallies.par_iter_mut().for_each(|tally| tally.go_down(self.halo, &halves));
        self.nodes = next;
        Ok(())
    }

    /// What has come of it, if anything has changed.
    ///
    /// # Errors
    /// If a tile has no width.
    pub fn partition(self) -> Result<Option<Partition>, SetupError> {
        (self.cuts != self.old).then(|| Partition::bisection(self.min, self.max, &self.cuts)).transpose()
    }
}

impl Partition {
    /// Cuts the rectangle from `min` to `max` in two again and again, as a list of cuts has it in which each comes before those of
    /// its parts, the lower first: of so many tiles as are left, half, rounded down, lie in the lower part. Tiles are counted in that
    /// order.
    ///
    /// # Errors
    /// If a cut does not lie within what it cuts, or a part would have no width.
    pub fn bisection(min: DVec2, max: DVec2, cuts: &[Bisector]) -> Result<Self, SetupError> {
        Bisection::new(min, max, cuts).map(|bisection| Self(Cut::Bisection(bisection)))
    }

    /// Cuts the rectangle into so many tiles of as much to do each, whose halos are so wide, in meters. `bodies` gives places, and for
    /// how many bodies each of them stands.
    ///
    /// # Errors
    /// If that makes no tiles.
    pub fn bisected(
        min: DVec2,
        max: DVec2,
        tiles: u32,
        halo_width: f64,
        bodies: impl Iterator<Item = (DVec2, u64)>,
    ) -> Result<Self, SetupError> {
        let point = |(place, bodies)| Point::new(place, min, max - min, u32::try_from(bodies).unwrap_or(u32::MAX), 0);
        let points: Vec<Point> = bodies.map(point).collect();
        let mut tallies: Vec<Tally> = points.chunks(TALLIED).map(|some| Tally::of_points(some.to_vec())).collect();
        let mut bisecting = Bisecting::new(min, max, tiles.max(1) as usize, halo_width)?;
        while !bisecting.is_done() {
            let counts: Vec<u32> =
                tallies.iter().flat_map(|tally| bisecting.counts(tally)).flat_map(|(_, words)| words).collect();
            let decisions = bisecting.decide(&counts)?;
            bisecting.cut(&decisions, &mut tallies)?;
        }
        Self::bisection(min, max, &bisecting.cuts)
    }

    /// Begins to cut a [`bisection`](Self::bisection) anew, so that all its tiles, whose halos are so wide, in meters, have as much to
    /// do; `loads` tells what each has to do now, in any order. Cuts stay where they will do. Nothing if it is none.
    ///
    /// # Errors
    /// If there is no such tile, or no room for so many.
    pub fn bisect(&self, loads: &[Load], halo_width: f64) -> Result<Option<Bisecting>, SetupError> {
        let Cut::Bisection(bisection) = &self.0 else { return Ok(None) };
        let mut all: Vec<Load> = (0..bisection.tiles() as u32).map(|tile| Load::nothing(TileId(tile))).collect();
        for load in loads {
            *all.get_mut(load.tile.0 as usize).ok_or(SetupError::BadBisection { cut: 0 })? = *load;
        }
        let mut bisecting = Bisecting::new(self.min(), self.max(), bisection.tiles(), halo_width)?;
        let mut sum = 0;
        bisecting.sums = iter::once(0).chain(all.iter().map(|load| (sum += load.all(), sum).1)).collect();
        (bisecting.loads, bisecting.old) = (all, bisection.cuts().to_vec());
        bisecting.nodes.iter_mut().for_each(|root| (root.is_old, root.is_same) = (true, true));
        Ok(Some(bisecting))
    }
}
