//! Two circles: one point on the line of centers.

use super::Manifold;
use crate::model::math::dot;
use glam::Vec2;

#[inline(always)]
pub(super) fn collide(radius_a: f32, radius_b: f32, offset: Vec2) -> Manifold {
    let distance = dot(offset, offset).sqrt();
    // Circles upon one another are pushed apart along x: any direction will do, if it is always the same.
    let normal = if distance > 0.0 { offset / distance } else { Vec2::X };
    let separation = distance - radius_a - radius_b;
    Manifold::single(normal, normal * (radius_a + 0.5 * separation), separation, 0)
}
