//! How tiles follow the bodies: cut where there is much to do, joined where there is little, by exact counts alone.

use super::forest::{Forest, MOST_LEVELS};
use super::grid::Grid;
use super::{Cut, Partition, Region};
use crate::model::error::SetupError;
use crate::model::id::TileId;
use bytemuck::{Pod, Zeroable};
use glam::DVec2;
use std::ops::Range;

/// What a contact takes, in what a body takes that touches nothing. Measured on NORMAL, whose contacts grow five-fold while its
/// bodies stay as many: 145 ns and 23 ns a step.
pub(crate) const CONTACT: u64 = 6;

/// Four tiles are joined when together they have no more to do than this part of what one tile may have: so that who comes and
/// goes does not have tiles cut and joined in turns.
const JOINED: u64 = 2;

/// The parts of a tile are at least so many widths of the halo wide; below, most of their work would be ghosts.
const LEAST_WIDTHS: f64 = 4.0;

/// When tiles are cut.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Adaptive {
    /// A tile with more to do is cut in four, if the parts are not too small: in bodies that touch nothing, of which a contact
    /// counts as six.
    pub max_bodies: u64,
    /// The least width and height of a part, in meters.
    pub least_side: f64,
}

/// A tile, or a part that it is to be cut into, and what there is to do. The parts of one tile follow each other in the
/// order in which tiles are counted.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Census {
    /// The tile that it is, or is a part of.
    pub tile: TileId,
    /// How often its root was cut.
    pub level: u32,
    /// In bodies that touch nothing.
    pub load: u64,
}

/// Tiles of two partitions that take up the same place. One of both ranges has a single tile.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Change {
    /// Of the old one.
    pub old: Range<u32>,
    /// Of the new one.
    pub new: Range<u32>,
}

impl Change {
    /// Whether the tile stays as it was, but for its name.
    pub fn is_none(&self) -> bool {
        self.old.len() == 1 && self.new.len() == 1
    }
}

/// The four parts of a rectangle: lower left, lower right, upper left, upper right.
pub(super) fn quarters(&Region { min, max }: &Region) -> [Region; 4] {
    let middle = 0.5 * (min + max);
    let (min, max) = ([min.x, middle.x, max.x], [min.y, middle.y, max.y]);
    [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(column, row)| Region {
        min: DVec2::new(min[column], max[row]),
        max: DVec2::new(min[column + 1], max[row + 1]),
    })
}

impl Adaptive {
    /// Tiles with no more to do, and no smaller than some widths of a halo, in meters.
    pub fn new(max_bodies: u64, halo_width: f64) -> Self {
        Self { max_bodies, least_side: LEAST_WIDTHS * halo_width }
    }

    /// Counts what there is to do in a tile, or in the parts that it is to be cut into, of bodies with their places and what each
    /// takes. What is beyond its rectangle counts in the part that is next to it. Changes the order of the bodies.
    pub(crate) fn count(
        &self,
        tile: TileId,
        level: u8,
        rectangle: Region,
        all: &mut [(DVec2, u64)],
        census: &mut Vec<Census>,
    ) {
        let load = all.iter().map(|(_, load)| load).sum();
        let is_wide = (0.5 * rectangle.size()).cmpge(DVec2::splat(self.least_side)).all();
        if load <= self.max_bodies || !is_wide || level == MOST_LEVELS {
            census.push(Census { tile, level: u32::from(level), load });
            return;
        }
        let parts = quarters(&rectangle);
        let middle = parts[3].min;
        let (lower, upper) = separate(all, |(place, _)| place.y >= middle.y);
        let ((a, b), (c, d)) =
            (separate(lower, |(place, _)| place.x >= middle.x), separate(upper, |(place, _)| place.x >= middle.x));
        for (part, bodies) in parts.into_iter().zip([a, b, c, d]) {
            self.count(tile, level + 1, part, bodies, census);
        }
    }
}

/// Brings those to the end for which something holds, and tells them from the others.
fn separate<T>(all: &mut [T], is_high: impl Fn(&T) -> bool) -> (&mut [T], &mut [T]) {
    let mut low = 0;
    for i in 0..all.len() {
        if !is_high(&all[i]) {
            all.swap(low, i);
            low += 1;
        }
    }
    all.split_at_mut(low)
}

impl Partition {
    /// A [`forest`](Self::forest) over columns x rows of squares, in which no tile has more bodies than the rule says. `bodies`
    /// gives places, and for how many bodies each of them stands.
    ///
    /// # Errors
    /// If that makes no tiles.
    pub fn adaptive(
        min: DVec2,
        max: DVec2,
        [columns, rows]: [u32; 2],
        rule: &Adaptive,
        bodies: impl Iterator<Item = (DVec2, u64)>,
    ) -> Result<Self, SetupError> {
        let grid = Grid::new(min, max, columns, rows)?;
        let (mut by_root, mut census) = (vec![Vec::new(); grid.cells()], Vec::new());
        bodies.for_each(|body| by_root[grid.locate(body.0) as usize].push(body));
        for (root, own) in (0..).zip(&mut by_root) {
            rule.count(TileId(root), 0, grid.rectangle(root), own, &mut census);
        }
        let levels: Vec<u8> = census.iter().map(|part| part.level as u8).collect();
        Forest::new(grid, &levels).map(|forest| Self(Cut::Forest(forest)))
    }

    /// What becomes of a forest by a census of all its tiles, ascending: tiles are cut as it says, and four that have little to do
    /// are joined. Nothing if all stays as it is.
    ///
    /// # Errors
    /// If that is not a census of this partition.
    pub fn adapted(&self, rule: &Adaptive, census: &[Census]) -> Result<Option<Self>, SetupError> {
        let Cut::Forest(forest) = &self.0 else { return Ok(None) };
        let (mut rest, mut levels) = (census, Vec::with_capacity(census.len()));
        for _ in 0..forest.roots().cells() {
            join(&mut rest, 0, rule, &mut levels).ok_or(SetupError::BadForest { tile: TileId(levels.len() as u32) })?;
        }
        let levels: Vec<u8> = levels.into_iter().map(|(level, _)| level).collect();
        if levels == forest.levels() {
            return Ok(None);
        }
        Forest::new(forest.roots().clone(), &levels).map(|forest| Some(Self(Cut::Forest(forest))))
    }

    /// What of a forest becomes what of another over the same squares, in ascending order, tiles that stay as they are included; of a
    /// bisection all tiles stay, though their borders move. Nothing if the two do not go together.
    pub fn changes(&self, new: &Self) -> Option<Vec<Change>> {
        let is_alike = (self.tiles(), self.min(), self.max()) == (new.tiles(), new.min(), new.max());
        let (a, b) = match (&self.0, &new.0) {
            (Cut::Forest(a), Cut::Forest(b)) => (a, b),
            (Cut::Bisection(_), Cut::Bisection(_)) if is_alike => {
                let same = |tile| Change { old: tile..tile + 1, new: tile..tile + 1 };
                return Some((0..self.tiles() as u32).map(same).collect());
            }
            _ => return None,
        };
        if a.roots() != b.roots() {
            return None;
        }
        let mut changes = Vec::with_capacity(a.levels().len().max(b.levels().len()));
        let (mut old, mut new) = (0, 0);
        while let (Some(&from), Some(&to)) = (a.levels().get(old), b.levels().get(new)) {
            // How far the tiles of one reach that fill a tile of the other, which is larger.
            let filled = |levels: &[u8], first: usize, level: u8| {
                let mut left = 1_u64 << (2 * (MOST_LEVELS - level));
                let mut end = first;
                while left > 0 {
                    left -= 1 << (2 * (MOST_LEVELS - levels[end]));
                    end += 1;
                }
                end
            };
            let (end, new_end) = if from <= to {
                (old + 1, filled(b.levels(), new, from))
            } else {
                (filled(a.levels(), old, to), new + 1)
            };
            changes.push(Change { old: old as u32..end as u32, new: new as u32..new_end as u32 });
            (old, new) = (end, new_end);
        }
        Some(changes)
    }
}

/// Reads a node of a level and its parts from a census, and writes what is left of them when who has little to do is joined. Nothing
/// if there is no such node.
fn join(census: &mut &[Census], level: u8, rule: &Adaptive, levels: &mut Vec<(u8, u64)>) -> Option<()> {
    let (next, rest) = census.split_first()?;
    if next.level == u32::from(level) {
        levels.push((level, next.load));
        *census = rest;
        return Some(());
    }
    if next.level < u32::from(level) || level == MOST_LEVELS {
        return None;
    }
    let first = levels.len();
    for _ in 0..4 {
        join(census, level + 1, rule, levels)?;
    }
    let parts = &levels[first..];
    let load: u64 = parts.iter().map(|(_, load)| load).sum();
    if parts.len() == 4 && load * JOINED <= rule.max_bodies {
        levels.truncate(first);
        levels.push((level, load));
    }
    Some(())
}
