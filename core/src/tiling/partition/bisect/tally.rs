//! What bodies bring to do in the blocks of a level, counted by whoever has them.

use super::super::Partition;
use super::super::bisection::{Bisector, Block, PARTS};
use super::load::{CONTACT, GHOST};
use super::profile::BINS;
use glam::DVec2;

/// What a contact adds to what its bodies take where they are ghosts: it is one of those that are solved for others, and half of
/// those that a ghost has are counted where the other body is.
const OF_GHOST: u32 = 15;

/// A place, in whole [`PARTS`] of the domain, and what a body there brings to do.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    at: [u32; 2],
    /// Where it is owned; nothing where it is a ghost.
    own: u32,
    /// Where it is a ghost.
    ghost: u32,
}

impl Point {
    pub(super) fn new(place: DVec2, min: DVec2, size: DVec2, bodies: u32, contacts: u32) -> Self {
        let parts = PARTS as f64;
        let [x, y] = ((place - min) / size * parts).to_array();
        let at = [x, y].map(|at| at.clamp(0.0, parts - 1.0) as u32);
        let sum =
            |body: u32, contact: u32| bodies.saturating_mul(body).saturating_add(contacts.saturating_mul(contact));
        Self { at, own: sum(1, CONTACT), ghost: sum(GHOST, OF_GHOST) }
    }
}

/// Some of the bodies of a tile, and what they bring to do, in a block.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// The number of the block in its level.
    pub(super) block: u32,
    pub(super) points: Vec<Point>,
    /// From where to where there are any, along either axis.
    extent: [[u32; 2]; 2],
}

impl Group {
    fn new(block: u32, points: Vec<Point>) -> Self {
        let mut extent = [[u32::MAX, 0]; 2];
        for point in &points {
            for (at, [min, max]) in point.at.iter().zip(&mut extent) {
                (*min, *max) = ((*min).min(*at), (*max).max(*at));
            }
        }
        Self { block, points, extent }
    }
}

/// The bodies of a tile, and what they bring to do, while a bisection is found: by the blocks in which they are.
#[derive(Clone, Debug)]
pub struct Tally {
    pub(super) groups: Vec<Group>,
}

impl Tally {
    /// That of bodies at some places, with how many contacts each has.
    pub(crate) fn new(partition: &Partition, bodies: impl Iterator<Item = (DVec2, u32)>) -> Self {
        let (min, size) = (partition.min(), partition.max() - partition.min());
        Self::of_points(bodies.map(|(place, contacts)| Point::new(place, min, size, 1, contacts)).collect())
    }

    pub(super) fn of_points(points: Vec<Point>) -> Self {
        Self { groups: vec![Group::new(0, points)] }
    }

    /// Goes down to the blocks that those of its level have been cut into, each by its cut into two of these numbers; nobody counts in a
    /// tile.
    pub(super) fn go_down(&mut self, halo: [f64; 2], halves: &[(Bisector, [Option<u32>; 2])]) {
        for group in std::mem::take(&mut self.groups) {
            let (Bisector { axis, at }, numbers) = halves[group.block as usize];
            if numbers == [None; 2] {
                continue;
            }
            let (axis, halo) = (axis as usize, halo[axis as usize] as u32);
            let (low, high) = (at.saturating_sub(halo), at.saturating_add(halo));
            let [min, max] = group.extent[axis];
            if max < low || min >= high {
                // All of them lie on one side, and are no ghosts of the other.
                self.groups.extend(numbers[usize::from(max >= low)].map(|block| Group { block, ..group }));
                continue;
            }
            let as_ghost = |point: &Point| Point { own: 0, ..*point };
            let (mut of_low, mut of_high) = (Vec::new(), Vec::new());
            for point in &group.points {
                let place = point.at[axis];
                if place < at {
                    of_low.push(*point);
                } else if place < high {
                    of_low.push(as_ghost(point));
                }
                if place >= at {
                    of_high.push(*point);
                } else if place >= low {
                    of_high.push(as_ghost(point));
                }
            }
            for (number, points) in numbers.into_iter().zip([of_low, of_high]) {
                if let Some(block) = number.filter(|_| !points.is_empty()) {
                    self.groups.push(Group::new(block, points));
                }
            }
        }
    }
}

/// What is in each bin.
type Bins = [[u32; 3]; BINS];

/// What the points of a tally bring to do in a block: the columns of a bin are what comes of its own bodies, what those
/// would bring as ghosts, and what ghosts bring.
#[derive(Clone, Debug)]
pub(super) struct Counts([Bins; 2]);

impl Counts {
    pub(super) fn new(block: Block, points: &[Point]) -> Self {
        let mut bins: [Bins; 2] = [[[0; 3]; BINS]; 2];
        let per_part = [0, 1].map(|axis| BINS as f64 / (block.max[axis] - block.min[axis]) as f64);
        for point in points {
            let column = usize::from(point.own == 0);
            for (axis, bins) in bins.iter_mut().enumerate() {
                // Ghosts may lie beside the block.
                let at = f64::from(point.at[axis]) - block.min[axis] as f64;
                let bin = &mut bins[((at * per_part[axis]) as usize).min(BINS - 1)];
                bin[0] = bin[0].saturating_add(point.own);
                bin[1 + column] = bin[1 + column].saturating_add(point.ghost);
            }
        }
        Self(bins)
    }

    /// As words: for each axis the first bin that is not empty, how many there are from there on, and these.
    pub(super) fn write(&self, words: &mut Vec<u32>) {
        for bins in &self.0 {
            let is_full = |bin: &[u32; 3]| *bin != [0; 3];
            let first = bins.iter().position(is_full).unwrap_or(0);
            let end = bins.iter().rposition(is_full).map_or(first, |last| last + 1);
            words.extend([first as u32, (end - first) as u32]);
            words.extend(bins[first..end].iter().flatten());
        }
    }
}
