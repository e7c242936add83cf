//! Upright rectangles around bodies, in an order in which those that meet another are found.

use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::DVec2;

/// Some of a tile's bodies, with the low and high corners of upright rectangles around them: from left to right by the low ones.
pub(super) struct Bounds {
    all: Vec<(usize, DVec2, DVec2)>,
    /// How far to the right any comes of those up to each.
    right: Vec<f64>,
}

impl Bounds {
    pub(super) fn new(mut all: Vec<(usize, DVec2, DVec2)>) -> Self {
        all.sort_unstable_by(|(_, a, _), (_, b, _)| a.x.total_cmp(&b.x));
        let mut right = f64::NEG_INFINITY;
        let furthest = |(_, _, high): &(usize, DVec2, DVec2)| {
            right = right.max(high.x);
            right
        };
        let right = all.iter().map(furthest).collect();
        Self { all, right }
    }

    pub(super) fn of_statics(tile: &Tile, setup: &Setup) -> Self {
        let bound = |row: usize| {
            let fixed = tile.bodies.get(row);
            let half = setup.kind(fixed.kind).half_extents(fixed.rotation).as_dvec2();
            (row, fixed.position - half, fixed.position + half)
        };
        Self::new((tile.owned + tile.ghosts()..tile.bodies.len()).map(bound).collect())
    }

    /// Those that meet a rectangle.
    pub(super) fn meeting(&self, low: DVec2, high: DVec2) -> impl Iterator<Item = usize> + '_ {
        let first = self.right.partition_point(|&right| right < low.x);
        let near = self.all[first..].iter().take_while(move |(_, own, _)| own.x <= high.x);
        near.filter(move |(_, own_low, own_high)| own_low.cmple(high).all() && own_high.cmpge(low).all())
            .map(|(row, ..)| *row)
    }
}
