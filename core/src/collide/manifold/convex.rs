//! Two convex pieces: separating axes, then the incident edge clipped against the reference face, as of boxes; where they are apart and
//! no faces oppose each other, the nearest points of both.
//!
//! All are rounded: a disc is a corner, a capsule a line, each with a radius around it. Sources as for boxes (`box_box.rs`); the radius
//! around polygons as in Box2D (E. Catto).

use super::box_box::{EQUAL, PREFERENCE};
use super::chain::{self, Lies};
use super::{Manifold, ManifoldPoint};
use crate::model::convex::Convex;
use crate::model::math::{Rot, clamp, dot, min};
use crate::model::piece::{Piece, Side};
use glam::Vec2;

/// The manifold of two pieces whose surfaces are nearer than `reach`, of B at `offset` from A; further ones may give none. `scale` is that
/// of their bodies ([`scale_of`](super::scale_of)). Where one is a segment of a chain, `lies` tells how far behind it the other may be that
/// has lain on its face.
#[inline(never)]
pub(in crate::collide) fn collide(
    [a, b]: [&Piece; 2],
    [rot_a, rot_b]: [Rot; 2],
    offset: Vec2,
    (reach, scale): (f32, f32),
    lies: Lies,
) -> Manifold {
    match (a.side, b.side) {
        (_, Some(side)) => on_segment([b, a], side, [rot_b, rot_a], -offset, reach, lies).swapped(offset),
        (Some(side), None) => on_segment([a, b], side, [rot_a, rot_b], offset, reach, lies),
        (None, None) => {
            let other = b.outline.seen(rot_a.to(rot_b), rot_a.unrotate(offset));
            polygons(&a.outline, &other, [a.radius, b.radius], (reach, scale)).rotated(rot_a)
        }
    }
}

/// The manifold of a segment and a piece.
#[inline(never)]
fn on_segment(
    [segment, piece]: [&Piece; 2],
    side: Side,
    [rot_segment, rot_piece]: [Rot; 2],
    offset: Vec2,
    reach: f32,
    lies: Lies,
) -> Manifold {
    let (turn, seen) = (rot_segment.to(rot_piece), rot_segment.unrotate(offset));
    let other = piece.outline.seen(turn, seen);
    let center = turn.rotate(piece.center) + seen;
    chain::collide(&segment.outline, side, (&other, piece.radius, center), reach, lies).rotated(rot_segment)
}

fn polygons(a: &Convex, b: &Convex, [radius_a, radius_b]: [f32; 2], (reach, scale): (f32, f32)) -> Manifold {
    if b.count() == 1 {
        let (normal, distance, _) = a.nearest(b.corner(0));
        return of_point(b.corner(0) - normal * distance, normal, distance, [radius_a, radius_b], 0);
    }
    if a.count() == 1 {
        let (normal, distance, _) = b.nearest(a.corner(0));
        return of_point(a.corner(0), -normal, distance, [radius_a, radius_b], 0);
    }
    let rounding = radius_a + radius_b;
    let (face_a, most_a) = a.separate(b);
    if most_a - rounding > reach {
        return Manifold::EMPTY;
    }
    let (face_b, most_b) = b.separate(a);
    if most_b - rounding > reach {
        return Manifold::EMPTY;
    }
    let overlap = most_a <= 0.0 && most_b <= 0.0;
    let are_equal = dot(a.normal(face_a), b.normal(face_b)) < -EQUAL;
    let found = if most_b > most_a + if are_equal { PREFERENCE * scale } else { 0.0 } {
        against_face(b, face_b, a, (most_b, overlap), [radius_b, radius_a], true).map(Manifold::turned_round)
    } else {
        against_face(a, face_a, b, (most_a, overlap), [radius_a, radius_b], false)
    };
    found.unwrap_or_else(|| corners(a, b, [radius_a, radius_b]))
}

/// From a point on the core of A to one of B along a normal.
fn of_point(on_a: Vec2, normal: Vec2, distance: f32, [radius_a, radius_b]: [f32; 2], feature: u32) -> Manifold {
    let separation = distance - radius_a - radius_b;
    Manifold::single(normal, on_a + normal * (radius_a + 0.5 * separation), separation, feature)
}

/// What is between a face and the edge of the other that looks most against it, if that is over the face, or the two overlap.
fn against_face(
    reference: &Convex,
    face: usize,
    other: &Convex,
    (height, overlap): (f32, bool),
    radii: [f32; 2],
    is_b: bool,
) -> Option<Manifold> {
    let edge = other.against(reference.normal(face));
    let features = if is_b { edge << 4 | face << 1 | 1 } else { face << 4 | edge << 1 } as u32;
    let manifold = clip(reference.edge(face), reference.normal(face), other.edge(edge), radii, features);
    // An end of a line has no width: those that overlap part there nevertheless.
    if manifold.is_none() && overlap {
        let n = reference.normal(face);
        let ([corner, next], [from, to]) = (reference.edge(face), other.edge(edge));
        let deepest = if dot(to - from, n) < 0.0 { to } else { from };
        let on_face = if corner == next { corner } else { deepest - n * height };
        return Some(of_point(on_face, n, height, radii, features));
    }
    manifold
}

/// The points of an incident edge over a face: two, or one if that has no length. Lengths and radii in meters.
pub(super) fn clip(
    [from, to]: [Vec2; 2],
    n: Vec2,
    ends: [Vec2; 2],
    [radius, other_radius]: [f32; 2],
    features: u32,
) -> Option<Manifold> {
    let t = Vec2::new(-n.y, n.x);
    let width = dot(to - from, t);
    // The edge's ends, counter-clockwise in its own polygon, run against `t`.
    let place = [ends[1], ends[0]].map(|end| (dot(end - from, t), dot(end - from, n)));
    if width <= 0.0 || place[1].0 < 0.0 || place[0].0 > width {
        return None;
    }
    let (span, rise) = (place[1].0 - place[0].0, place[1].1 - place[0].1);
    let slope = if span > 0.0 { rise / span } else { 0.0 };
    let mut manifold = Manifold { normal: n, ..Manifold::EMPTY };
    for (end, &(at, height)) in (0..).zip(&place) {
        let height = if span > 0.0 { height } else { min(height, place[1].1) };
        let clipped = clamp(at, 0.0, width);
        let mut height = height + slope * (clipped - at);
        if clipped != at && height > 0.0 {
            // Around a corner a slanted edge is nearer than straight up from the face.
            let (gap, is_corner) = gap(from + t * clipped, ends);
            if is_corner && gap < height && radius + other_radius > 0.0 {
                // Round corners meet along the line between them.
                return None;
            }
            height = min(gap, height);
        }
        let separation = height - radius - other_radius;
        let anchor = from + t * clipped + n * (radius + 0.5 * separation);
        manifold.push(ManifoldPoint { anchor, separation, feature: features ^ end });
        if span <= 0.0 {
            break;
        }
    }
    Some(manifold)
}

/// How far a corner is from an edge, and whether it is nearest to an end of it.
fn gap(corner: Vec2, ends: [Vec2; 2]) -> (f32, bool) {
    let edge = ends[1] - ends[0];
    let part = clamp(dot(corner - ends[0], edge) / dot(edge, edge), 0.0, 1.0);
    let gap = ends[0] + edge * part - corner;
    (dot(gap, gap).sqrt(), part <= 0.0 || part >= 1.0)
}

/// The nearest points of two polygons that are apart: at a corner of one of them.
#[cold]
fn corners(a: &Convex, b: &Convex, radii: [f32; 2]) -> Manifold {
    let mut least = (f32::INFINITY, Vec2::Y, Vec2::ZERO, 0);
    for (corner, point) in b.corners().enumerate() {
        let (normal, distance, at) = a.nearest(point);
        if distance < least.0 {
            least = (distance, normal, point - normal * distance, 1 << 8 | at << 3 | corner as u32);
        }
    }
    for (corner, point) in a.corners().enumerate() {
        let (normal, distance, at) = b.nearest(point);
        if distance < least.0 {
            least = (distance, -normal, point, 1 << 9 | at << 3 | corner as u32);
        }
    }
    let (distance, normal, on_a, feature) = least;
    of_point(on_a, normal, distance, radii, feature)
}
