//! What is looked at, and where it is on an image.

use crate::look::frame::Setting;
use atoll_core::StaticBody;
use glam::DVec2;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// What stands around the domain is shown for so much of the longer side of the domain, and no more.
const AROUND: f64 = 0.03;
/// Around all of it so much of the longer side stays free.
const FREE: f64 = 0.01;

/// A rectangle of the world, in meters.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(from = "[f64; 4]", into = "[f64; 4]")]
pub(crate) struct View {
    /// Its low corner.
    pub low: DVec2,
    /// Its high corner.
    pub high: DVec2,
}

/// Sides that a view can have, in m.
const SIDES: RangeInclusive<f64> = 1e-6..=1e13;

impl View {
    /// Whether it is a rectangle, neither so small nor so large that its scale is no longer a number to calculate with.
    pub(crate) fn is_sound(&self) -> bool {
        let has_side = |low: f64, high: f64| low.abs() <= 1e15 && SIDES.contains(&(high - low));
        has_side(self.low.x, self.high.x) && has_side(self.low.y, self.high.y)
    }
}

impl From<[f64; 4]> for View {
    fn from([x0, y0, x1, y1]: [f64; 4]) -> Self {
        Self { low: DVec2::new(x0, y0), high: DVec2::new(x1, y1) }
    }
}

impl From<View> for [f64; 4] {
    fn from(View { low, high }: View) -> Self {
        [low.x, low.y, high.x, high.y]
    }
}

/// The domain, and of what stands around it so much that one sees what it is.
pub(crate) fn whole_view(setting: &Setting) -> View {
    let (low, high) = (setting.partition.min(), setting.partition.max());
    let side = (high - low).max_element();
    let extents = setting.statics.iter().map(extent);
    let (least, most) = extents.fold((low, high), |(least, most), (from, to)| (least.min(from), most.max(to)));
    let (around, free) = (DVec2::splat(AROUND * side), DVec2::splat(FREE * side));
    View { low: least.max(low - around) - free, high: most.min(high + around) + free }
}

/// Low and high corner of a static.
fn extent(fixed: &StaticBody) -> (DVec2, DVec2) {
    let half = fixed.kind.shape.half_extents(fixed.rotation).as_dvec2();
    (fixed.position - half, fixed.position + half)
}

/// A view upon an image: as large as there is room for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    /// Pixels of a meter.
    pub scale: f64,
    /// Where the image's lower left corner is in the world.
    origin: DVec2,
    /// Of the image.
    height: f64,
}

impl Fit {
    /// In the middle of a rectangle of an image of that height, from its upper left to its lower right corner.
    pub(super) fn within(view: &View, [low, high]: [[f64; 2]; 2], height: f64) -> Self {
        let (size, low, high) = (view.high - view.low, DVec2::from(low), DVec2::from(high));
        let scale = ((high - low) / size).min_element();
        let middle = 0.5 * (low + high);
        let origin = 0.5 * (view.low + view.high) - DVec2::new(middle.x, height - middle.y) / scale;
        Self { scale, origin, height }
    }

    /// Where a point of the world is on the image.
    #[inline]
    pub(super) fn place(&self, point: DVec2) -> [f64; 2] {
        let from = (point - self.origin) * self.scale;
        [from.x, self.height - from.y]
    }
}
