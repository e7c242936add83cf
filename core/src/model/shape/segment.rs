//! Segments: pieces of ground, alone or one after the other as a chain.

use super::ShapeError;
use glam::Vec2;

/// A line from one end to the other, solid from one side: what comes from its left, seen along it, touches it; what comes from its
/// right passes. For statics. Lengths in meters, seen from its middle.
///
/// One after the other they make a chain: each knows the far ends of its neighbours, and what slides over a joint does not feel it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Segment {
    end: Vec2,
    before: Option<Vec2>,
    after: Option<Vec2>,
}

impl Segment {
    /// A segment from one point to another, and its middle. Of those before and after it in a chain, if there are, their far ends.
    ///
    /// # Errors
    /// If a point is not finite, or one is where the next is.
    pub fn new(before: Option<Vec2>, from: Vec2, to: Vec2, after: Option<Vec2>) -> Result<(Self, Vec2), ShapeError> {
        let middle = from * 0.5 + to * 0.5;
        let end = (to - from) * 0.5;
        let seen = |point: Option<Vec2>| point.map(|point| point - middle);
        let segment = Self { end, before: seen(before), after: seen(after) };
        if ![before, Some(from), Some(to), after].into_iter().flatten().all(Vec2::is_finite) {
            return Err(ShapeError::NotFinite);
        }
        if segment.is_valid() { Ok((segment, middle)) } else { Err(ShapeError::Joint) }
    }

    /// Where it begins and where it ends, seen from its middle.
    pub fn ends(&self) -> [Vec2; 2] {
        [-self.end, self.end]
    }

    /// The far end of the segment before it, seen from its middle.
    pub fn before(&self) -> Option<Vec2> {
        self.before
    }

    /// The far end of the segment after it, seen from its middle.
    pub fn after(&self) -> Option<Vec2> {
        self.after
    }

    pub(crate) fn is_valid(&self) -> bool {
        let size = self.end.length();
        let is_far = |point: Option<Vec2>, from: Vec2| point.is_none_or(|point| (point - from).length() > 1e-4 * size);
        size > 0.0 && size.is_finite() && is_far(self.before, -self.end) && is_far(self.after, self.end)
    }
}
