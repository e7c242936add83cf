//! Manifolds: where and along what two shapes touch: of two boxes, and of a round body and any other.
//!
//! All of them see body A at the origin and body B at `offset`, in world directions. A new shape needs a line in [`collide`] for
//! every pair it forms.

pub(super) mod box_box;
mod round;
#[cfg(test)]
mod tests;

use crate::model::contact::ContactPoint;
use crate::model::math::Rot;
use crate::model::shape::{KindRow, Shape};
use glam::Vec2;

/// A point of a manifold.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct ManifoldPoint {
    /// Midway between the two surfaces, from the center of A.
    pub(crate) anchor: Vec2,
    /// Distance of the surfaces; negative: overlap.
    pub(crate) separation: f32,
    /// Which features make it; stays the same while they do.
    pub(crate) feature: u32,
}

/// Up to two points and their common normal, from A to B.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Manifold {
    pub(crate) normal: Vec2,
    pub(crate) points: [ManifoldPoint; 2],
    pub(crate) count: usize,
}

impl ManifoldPoint {
    const NONE: Self = Self { anchor: Vec2::ZERO, separation: 0.0, feature: ContactPoint::ABSENT };
}

impl Manifold {
    pub(crate) const EMPTY: Self = Self { normal: Vec2::ZERO, points: [ManifoldPoint::NONE; 2], count: 0 };

    fn single(normal: Vec2, anchor: Vec2, separation: f32, feature: u32) -> Self {
        let point = ManifoldPoint { anchor, separation, feature };
        Self { normal, points: [point, ManifoldPoint::NONE], count: 1 }
    }

    pub(crate) fn push(&mut self, point: ManifoldPoint) {
        self.points[self.count] = point;
        self.count += 1;
    }

    #[inline(always)]
    pub(crate) fn points(&self) -> &[ManifoldPoint] {
        &self.points[..self.count]
    }

    /// The point with the least separation.
    #[inline(always)]
    pub(crate) fn nearest(&self) -> Option<&ManifoldPoint> {
        match self.count {
            0 => None,
            2 if self.points[1].separation < self.points[0].separation => Some(&self.points[1]),
            _ => Some(&self.points[0]),
        }
    }
}

/// The manifold of two bodies whose surfaces are nearer than `reach`; further ones may give none.
#[inline(always)]
pub(crate) fn collide(a: &KindRow, rot_a: Rot, b: &KindRow, rot_b: Rot, offset: Vec2, reach: f32) -> Manifold {
    match (a.shape, b.shape) {
        (Shape::Box { half: ha }, Shape::Box { half: hb }) => box_box::collide(ha, rot_a, hb, rot_b, offset, reach),
        _ => round::collide(a, rot_a, b, rot_b, offset),
    }
}
