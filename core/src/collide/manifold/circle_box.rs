//! A circle and a box: the box's point nearest to the center of the circle.

use super::Manifold;
use crate::model::math::{Rot, clamp, dot};
use glam::Vec2;

/// In the frame of the box: the normal from box to circle, the nearest point on the box's surface, the separation.
#[inline(always)]
fn nearest(half: Vec2, center: Vec2, radius: f32) -> (Vec2, Vec2, f32) {
    let inside = Vec2::new(clamp(center.x, -half.x, half.x), clamp(center.y, -half.y, half.y));
    let away = center - inside;
    let distance = dot(away, away).sqrt();
    if distance > 0.0 {
        return (away / distance, inside, distance - radius);
    }
    // The center lies within the box: leave through the nearest face.
    let (depth_x, depth_y) = (half.x - center.x.abs(), half.y - center.y.abs());
    let side = |v: f32| if v < 0.0 { -1.0 } else { 1.0 };
    if depth_x < depth_y {
        let normal = Vec2::new(side(center.x), 0.0);
        (normal, Vec2::new(normal.x * half.x, center.y), -depth_x - radius)
    } else {
        let normal = Vec2::new(0.0, side(center.y));
        (normal, Vec2::new(center.x, normal.y * half.y), -depth_y - radius)
    }
}

#[inline(always)]
pub(super) fn box_first(half: Vec2, rotation: Rot, radius: f32, offset: Vec2) -> Manifold {
    let (normal, surface, separation) = nearest(half, rotation.unrotate(offset), radius);
    let anchor = surface + normal * (0.5 * separation);
    Manifold::single(rotation.rotate(normal), rotation.rotate(anchor), separation, 0)
}

#[inline(always)]
pub(super) fn circle_first(radius: f32, half: Vec2, rotation: Rot, offset: Vec2) -> Manifold {
    let (normal, surface, separation) = nearest(half, rotation.unrotate(-offset), radius);
    let anchor = surface + normal * (0.5 * separation);
    Manifold::single(-rotation.rotate(normal), offset + rotation.rotate(anchor), separation, 0)
}
