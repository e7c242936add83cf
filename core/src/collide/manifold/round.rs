//! A round body and another: the point of that one, or of its core if it is round too, nearest to the center of the round one.
//!
//! One way for all of them, without a branch: kinds come in no order, and a branch on them would be a coin toss.

use super::Manifold;
use crate::model::kind::KindRow;
use crate::model::math::{Rot, clamp, dot};
use glam::Vec2;

/// The manifold of two bodies, one of which is round: it has one point, of feature 0.
#[inline(always)]
pub(super) fn collide(a: &KindRow, rot_a: Rot, b: &KindRow, rot_b: Rot, offset: Vec2) -> Manifold {
    // Seen from the one that has a core, or from B.
    let from_b = a.not_round == 0.0;
    let (core, rotation, way) = if from_b { (b, rot_b, -1.0) } else { (a, rot_a, 1.0) };
    let (half, rounding) = (core.extent, a.radius + b.radius);
    let center = rotation.unrotate(offset * way);
    let inside = Vec2::new(clamp(center.x, -half.x, half.x), clamp(center.y, -half.y, half.y));
    let away = center - inside;
    let distance = dot(away, away).sqrt();
    let (normal, depth) = if distance > 0.0 { (away * (1.0 / distance), distance) } else { leave(half, center) };
    let separation = depth - rounding;
    // Of a center within the core, depth is negative, and leads to where it leaves.
    let surface = center - normal * depth;
    let anchor = rotation.rotate(surface + normal * (core.radius + 0.5 * separation));
    Manifold::single(rotation.rotate(normal) * way, offset * (1.0 - a.not_round) + anchor, separation, 0)
}

/// The center lies within the core: through its nearest face. Circles upon one another part along an axis: any direction will do,
/// if it is always the same.
#[cold]
fn leave(half: Vec2, center: Vec2) -> (Vec2, f32) {
    let (depth_x, depth_y) = (half.x - center.x.abs(), half.y - center.y.abs());
    let side = |v: f32| if v < 0.0 { -1.0 } else { 1.0 };
    if depth_x < depth_y {
        (Vec2::new(side(center.x), 0.0), -depth_x)
    } else {
        (Vec2::new(0.0, side(center.y)), -depth_y)
    }
}
