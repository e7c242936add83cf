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

/// So many rectangles are looked at together: these may be swept by very many.
const TOGETHER: usize = 256;

/// Shows for each of some rectangles, by its number, the rows of the statics that sweep over it in a step, ascending, if there are any. Where a
/// static comes in the step is found once for many rectangles, however many it may come to at any time.
pub(crate) fn each_swept(
    rectangles: &[(DVec2, DVec2)],
    setup: &Setup,
    step: u64,
    mut show: impl FnMut(usize, &[(usize, u32)]),
) {
    for (part, some) in rectangles.chunks(TOGETHER).enumerate() {
        for swept in sweeping(some, setup, step).chunk_by(|one, two| one.0 == two.0) {
            show(TOGETHER * part + swept[0].0, swept);
        }
    }
}

/// The same of rectangles that are looked at together, each static with the number of its rectangle.
fn sweeping(rectangles: &[(DVec2, DVec2)], setup: &Setup, step: u64) -> Vec<(usize, u32)> {
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
