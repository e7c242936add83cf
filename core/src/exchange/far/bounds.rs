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

/// All statics, to find those that sweep over a rectangle in a step.
pub(crate) struct StaticsByPlace<'a> {
    setup: &'a Setup,
    step: u64,
    /// Those that the terrain does not find.
    others: Bounds,
}

impl<'a> StaticsByPlace<'a> {
    pub(crate) fn new(setup: &'a Setup, step: u64) -> Self {
        let bounds = |&row: &u32| {
            let [low, high] = setup.static_box(row, step);
            (row as usize, low, high)
        };
        Self { setup, step, others: Bounds::new(setup.terrain.at_large().iter().map(bounds).collect()) }
    }

    /// Adds the rows of those that meet a rectangle, in any order, and maybe more than once.
    pub(crate) fn meeting(&self, low: DVec2, high: DVec2, rows: &mut Vec<u32>) {
        rows.extend(self.others.meeting(low, high).map(|row| row as u32));
        self.setup.terrain.meeting(low, high, |row| {
            let meets = |[own_low, own_high]: [DVec2; 2]| own_low.cmple(high).all() && own_high.cmpge(low).all();
            if self.setup.path(row).is_none() || meets(self.setup.static_box(row, self.step)) {
                rows.push(row);
            }
        });
    }
}
