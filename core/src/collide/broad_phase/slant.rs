//! Large bodies that lie askew: a wall of 200 m at 45 degrees has a rectangle around it that half of a world may be in.

use super::Field;
use crate::model::math::max;
use std::ops::Range;

/// Bodies whose rectangle, not turned, has more than so many times the area of the one that turns with them.
const ASKEW: f32 = 2.0;

/// Rounding of what follows from an offset, as part of it.
const SLACK: f32 = 1e-6;

/// The rectangle that turns with a body, grown by all that the body may come nearer in the step.
pub(super) struct Slant {
    cos: f32,
    sin: f32,
    half: [f32; 2],
}

impl Slant {
    /// Of a body that lies askew.
    pub(super) fn of(body: usize, field: &Field<'_>) -> Option<Self> {
        let Field { proxies, bodies, setup, .. } = field;
        let [width, height, rounding, bound] = setup.kind(bodies.kind[body]).outline();
        let grown = rounding + max(proxies.radius[body] - bound, 0.0);
        let (rotation, half) = (bodies.rotation[body], [width + grown, height + grown]);
        let [across, up] = proxies.half(body);
        let is_askew = across * up > ASKEW * half[0] * half[1];
        is_askew.then_some(Self { cos: rotation.c, sin: rotation.s, half })
    }

    /// Whether it may come to who is there, seen from its center, and reaches so far.
    #[inline(always)]
    pub(super) fn comes_to(&self, [x, y]: [f32; 2], reach: f32) -> bool {
        let along = (self.cos * x + self.sin * y).abs() - self.half[0];
        let across = (self.cos * y - self.sin * x).abs() - self.half[1];
        max(along, across) <= reach + SLACK * (x.abs() + y.abs())
    }

    /// Where it may come to somebody who reaches so far and is between two heights, as seen from its center.
    pub(super) fn span(&self, heights: Range<f32>, reach: f32) -> Range<f32> {
        let (cos, sin) = (self.cos, self.sin);
        let more = SLACK * (heights.start.abs() + heights.end.abs() + self.half[0] + self.half[1]);
        let [along, across] = self.half.map(|half| half + reach + more);
        // -along <= cos x + sin y <= along, and -across <= cos y - sin x <= across.
        let first = strip(cos, sin, along, &heights);
        let second = strip(-sin, cos, across, &heights);
        max(first.start, second.start)..first.end.min(second.end)
    }
}

/// All x of a strip |a x + b y| <= half, of y between two heights.
fn strip(a: f32, b: f32, half: f32, heights: &Range<f32>) -> Range<f32> {
    let [one, two] = [heights.start, heights.end].map(|y| b * y);
    // Of what is level there is all, and of what has no end.
    let (low, high) = ((-half - one.max(two)) / a, (half - one.min(two)) / a);
    if !(a.abs() > f32::EPSILON && low.is_finite() && high.is_finite()) {
        return f32::NEG_INFINITY..f32::INFINITY;
    }
    low.min(high)..low.max(high)
}
