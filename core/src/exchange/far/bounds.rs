//! Upright rectangles around bodies, in an order in which those that meet another are found.

use crate::tiling::blueprint::Setup;
use glam::DVec2;

/// Some bodies' places in a list, with the low and high corners of upright rectangles around them: from left to right by the low ones.
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

    /// Those that meet a rectangle.
    pub(super) fn meeting(&self, low: DVec2, high: DVec2) -> impl Iterator<Item = usize> + '_ {
        let first = self.right.partition_point(|&right| right < low.x);
        let near = self.all[first..].iter().take_while(move |(_, own, _)| own.x <= high.x);
        near.filter(move |(_, own_low, own_high)| own_low.cmple(high).all() && own_high.cmpge(low).all())
            .map(|(row, ..)| *row)
    }
}

/// For each of some rectangles the rows of the statics that sweep over it in a step, ascending: with the number of the rectangle. Where a
/// static comes in the step is found once, for all that it may come to at any time.
pub(crate) fn sweeping(rectangles: &[(DVec2, DVec2)], setup: &Setup, step: u64) -> Vec<(usize, u32)> {
    let (mut met, on_paths) = setup.terrain.meeting(rectangles);
    let bounds = |&row: &u32| {
        let [low, high] = setup.static_box(row, step);
        (row as usize, low, high)
    };
    let others = Bounds::new(on_paths.iter().chain(setup.terrain.at_large()).map(bounds).collect());
    for (number, &(low, high)) in rectangles.iter().enumerate() {
        met.extend(others.meeting(low, high).map(|row| (number, row as u32)));
    }
    met.sort_unstable();
    met.dedup();
    met
}
