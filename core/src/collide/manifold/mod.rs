//! Manifolds: where and along what two shapes touch: of two boxes, and of a round body and any other.
//!
//! All of them see body A at the origin and body B at `offset`, in world directions. Of shapes that are neither round nor boxes
//! the convex pieces meet one by one.

pub(super) mod box_box;
pub(super) mod chain;
pub(super) mod convex;
mod round;
#[cfg(test)]
mod tests;

use crate::model::contact::ContactPoint;
use crate::model::kind::{Form, KindRow};
use crate::model::math::Rot;
use crate::parallel::lanes::Arithmetic;
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

    /// The same, of B and A, seen from A, from which B lies at `offset`; it was seen from B.
    fn swapped(mut self, offset: Vec2) -> Self {
        self.points[..self.count].iter_mut().for_each(|point| point.anchor += offset);
        self.turned_round()
    }

    /// The same, seen from where all is turned back.
    fn rotated(mut self, rotation: Rot) -> Self {
        self.normal = rotation.rotate(self.normal);
        self.points[..self.count].iter_mut().for_each(|point| point.anchor = rotation.rotate(point.anchor));
        self
    }

    /// The same, of B and A.
    fn turned_round(self) -> Self {
        Self { normal: -self.normal, ..self }
    }

    /// The same, its features being those of these pieces.
    pub(super) fn named(mut self, pieces: u32) -> Self {
        self.points[..self.count].iter_mut().for_each(|point| point.feature |= pieces);
        self
    }

    /// Whether its point only tells how far the two are from each other, and is none that they touch at: they do so elsewhere, or later.
    pub(crate) fn is_distance(&self) -> bool {
        self.count == 1 && self.points[0].feature == ContactPoint::ABSENT
    }

    /// The same without the points with some anchors, if any is left.
    pub(super) fn without(self, is_gone: impl Fn(Vec2) -> bool) -> Option<Self> {
        let mut left = Self { count: 0, ..self };
        self.points().iter().filter(|point| !is_gone(point.anchor)).for_each(|&point| left.push(point));
        (left.count > 0).then_some(left)
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

/// One by this bounding radius, in m.
const PER_ROOMY: f32 = 8.0;

/// What is near, touches, or counts as one is so as seen from the smaller of two bodies, if that is small: which part of such a length
/// counts, by their bounding radii.
#[inline(always)]
pub(in crate::collide) fn scale_of<V: Arithmetic>([a, b]: [V; 2]) -> V {
    a.min(b).mul(V::splat(PER_ROOMY)).min(V::splat(1.0))
}

/// The manifold of two bodies, circles or boxes, whose surfaces are nearer than `reach`; further ones may give none.
#[inline(always)]
pub(crate) fn collide(a: &KindRow, rot_a: Rot, b: &KindRow, rot_b: Rot, offset: Vec2, reach: f32) -> Manifold {
    let scale = scale_of([a.bounding_radius, b.bounding_radius]);
    match (a.form, b.form) {
        (Form::Box, Form::Box) => box_box::collide(a.extent, rot_a, b.extent, rot_b, offset, (reach, scale)),
        _ => round::collide(a, rot_a, b, rot_b, offset),
    }
}

/// The manifold of two bodies of any shapes where they are nearest.
pub(crate) fn nearest(a: &KindRow, rot_a: Rot, b: &KindRow, rot_b: Rot, offset: Vec2, reach: f32) -> Manifold {
    if a.form.is_simple() && b.form.is_simple() {
        return collide(a, rot_a, b, rot_b, offset, reach);
    }
    let scale = scale_of([a.bounding_radius, b.bounding_radius]);
    let pairs = a.pieces.iter().flat_map(|a| b.pieces.iter().map(move |b| [a, b]));
    let mut least = (f32::INFINITY, Manifold::EMPTY);
    for pair in pairs {
        let manifold = convex::collide(pair, [rot_a, rot_b], offset, (reach, scale), None);
        if let Some(nearest) = manifold.nearest()
            && nearest.separation < least.0
        {
            least = (nearest.separation, manifold);
        }
    }
    least.1
}
