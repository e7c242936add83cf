//! Two boxes: separating axes, then the incident edge clipped against the reference face.
//!
//! Source: the separating axis theorem for oriented boxes (S. Gottschalk et al., "OBBTree", 1996) and edge clipping as
//! in E. Catto's Box2D-Lite; where the boxes are apart and no faces oppose each other, the nearest points of corner and
//! edge instead, so that boxes passing corner to corner do not meet an invisible wall.

use super::{Manifold, ManifoldPoint};
use crate::model::math::{Rot, clamp, dot, min};
use glam::Vec2;

/// A face of B becomes the reference only if it separates by so much more than an [equal](EQUAL) one of A, in meters (a quarter of the length below which two
/// surfaces touch; of small bodies a part, see [`scale_of`](super::scale_of)): keeps the choice from flickering between two equal faces.
pub(in crate::collide) const PREFERENCE: f32 = 0.0005;

/// Two faces are equal whose normals have a greater cosine. Of others the one that separates more tells where the two push: what lands with a
/// corner near one of the other must not be pushed by its own side.
pub(in crate::collide) const EQUAL: f32 = 0.999;

/// Separation of two boxes along the axes of the first; `offset` in its frame, `turn` from its frame to the other's.
#[inline(always)]
fn separations(half: Vec2, other: Vec2, turn: Rot, offset: Vec2) -> Vec2 {
    let (c, s) = (turn.c.abs(), turn.s.abs());
    let reach = Vec2::new(c * other.x + s * other.y, s * other.x + c * other.y);
    offset.abs() - half - reach
}

#[inline(always)]
fn larger(v: Vec2) -> f32 {
    if v.x > v.y { v.x } else { v.y }
}

#[inline(always)]
pub(super) fn collide(
    half_a: Vec2,
    rot_a: Rot,
    half_b: Vec2,
    rot_b: Rot,
    offset: Vec2,
    (reach, scale): (f32, f32),
) -> Manifold {
    let turn = rot_a.to(rot_b);
    let (in_a, in_b) = (rot_a.unrotate(offset), rot_b.unrotate(offset));
    let along_a = separations(half_a, half_b, turn, in_a);
    let along_b = separations(half_b, half_a, turn, in_b);
    let (most_a, most_b) = (larger(along_a), larger(along_b));
    if most_a > reach || most_b > reach {
        return Manifold::EMPTY;
    }
    let are_of_one_axis = (along_a.x > along_a.y) == (along_b.x > along_b.y);
    let cosine = if are_of_one_axis { turn.c.abs() } else { turn.s.abs() };
    if most_b > most_a + if cosine > EQUAL { PREFERENCE * scale } else { 0.0 } {
        let back = Rot { c: turn.c, s: -turn.s };
        let mut manifold = against_face(half_b, half_a, back, -in_b, along_b, true);
        manifold.normal = -rot_b.rotate(manifold.normal);
        for point in &mut manifold.points {
            point.anchor = offset + rot_b.rotate(point.anchor);
        }
        manifold
    } else {
        let mut manifold = against_face(half_a, half_b, turn, in_a, along_a, false);
        manifold.normal = rot_a.rotate(manifold.normal);
        for point in &mut manifold.points {
            point.anchor = rot_a.rotate(point.anchor);
        }
        manifold
    }
}

/// The manifold of the reference box, which `is_b` or A, at the origin and unturned, with an incident box.
fn against_face(half: Vec2, incident: Vec2, turn: Rot, offset: Vec2, along: Vec2, is_b: bool) -> Manifold {
    // The reference face, and a frame of normal `n` and tangent `t`, both along the axes.
    let sign = |v: f32| if v < 0.0 { -1.0 } else { 1.0 };
    let (n, t, height, width, face) = if along.x > along.y {
        let side = sign(offset.x);
        (Vec2::new(side, 0.0), Vec2::new(0.0, side), half.x, half.y, u32::from(side < 0.0))
    } else {
        let side = sign(offset.y);
        (Vec2::new(0.0, side), Vec2::new(-side, 0.0), half.y, half.x, 2 + u32::from(side < 0.0))
    };
    // The incident edge: of the face that looks most against `n`, its ends in the order of `t`.
    let seen = turn.unrotate(n);
    let (middle, along_edge, edge) = if seen.x.abs() > seen.y.abs() {
        let side = -sign(seen.x);
        (Vec2::new(side * incident.x, 0.0), Vec2::new(0.0, side * incident.y), u32::from(side < 0.0))
    } else {
        let side = -sign(seen.y);
        (Vec2::new(0.0, side * incident.y), Vec2::new(-side * incident.x, 0.0), 2 + u32::from(side < 0.0))
    };
    let middle = offset + turn.rotate(middle);
    let along_edge = turn.rotate(along_edge);
    // The edge's ends, counter-clockwise in the incident box, run against `t`.
    let ends = [middle + along_edge, middle - along_edge];
    let features = if is_b { edge << 3 | face << 1 | 1 } else { face << 3 | edge << 1 };
    let place = ends.map(|end| (dot(end, t), dot(end, n) - height));

    if place[1].0 < -width || place[0].0 > width {
        let corner = n * height + t * if place[0].0 > width { width } else { -width };
        return corner_to_edge(corner, ends, n, features);
    }
    // Clip the edge to the width of the face.
    let (span, rise) = (place[1].0 - place[0].0, place[1].1 - place[0].1);
    let slope = if span > 0.0 { rise / span } else { 0.0 };
    let mut manifold = Manifold { normal: n, ..Manifold::EMPTY };
    for (end, &(at, separation)) in (0..).zip(&place) {
        let clipped = clamp(at, -width, width);
        let mut separation = separation + slope * (clipped - at);
        if clipped != at && separation > 0.0 {
            // Around a corner a slanted edge is nearer than straight up from the face.
            let gap = nearest(n * height + t * clipped, ends).0;
            separation = min(dot(gap, gap).sqrt(), separation);
        }
        let anchor = t * clipped + n * (height + 0.5 * separation);
        manifold.push(ManifoldPoint { anchor, separation, feature: features ^ end });
    }
    manifold
}

/// Where no face opposes the edge: the nearest points of the reference's corner and the incident edge.
fn corner_to_edge(corner: Vec2, ends: [Vec2; 2], n: Vec2, features: u32) -> Manifold {
    let (gap, part) = nearest(corner, ends);
    let distance = dot(gap, gap).sqrt();
    let normal = if distance > 0.0 { gap / distance } else { n };
    let feature = features ^ u32::from(part >= 0.5);
    Manifold::single(normal, corner + gap * 0.5, distance, feature)
}

/// From a corner to the nearest point of an edge, and where on the edge that lies: 0 to 1.
fn nearest(corner: Vec2, ends: [Vec2; 2]) -> (Vec2, f32) {
    let edge = ends[1] - ends[0];
    let part = clamp(dot(corner - ends[0], edge) / dot(edge, edge), 0.0, 1.0);
    (ends[0] + edge * part - corner, part)
}
