//! Two convex pieces: separating axes, then the incident edge clipped against the reference face, as of boxes; where they are apart and
//! no faces oppose each other, the nearest points of both.
//!
//! All are rounded: a disc is a corner, a capsule a line, each with a radius around it. Sources as for boxes (`box_box.rs`); the radius
//! around polygons as in Box2D (E. Catto).

use super::box_box::PREFERENCE;
use super::{Manifold, ManifoldPoint, chain};
use crate::model::math::{Rot, clamp, dot, min};
use crate::model::piece::Piece;
use crate::model::shape::MOST_CORNERS;
use glam::Vec2;

/// A polygon seen from somewhere.
#[derive(Clone, Copy)]
pub(super) struct Outline {
    corners: [Vec2; MOST_CORNERS],
    normals: [Vec2; MOST_CORNERS],
    count: usize,
}

impl Outline {
    pub(super) fn of(piece: &Piece) -> Self {
        Self::seen(piece, Rot::IDENTITY, Vec2::ZERO)
    }

    pub(super) fn seen(piece: &Piece, turn: Rot, offset: Vec2) -> Self {
        let mut seen = Self {
            corners: [Vec2::ZERO; MOST_CORNERS],
            normals: [Vec2::ZERO; MOST_CORNERS],
            count: piece.corners().len(),
        };
        for (to, &from) in seen.corners.iter_mut().zip(piece.corners()) {
            *to = offset + turn.rotate(from);
        }
        for (to, &from) in seen.normals.iter_mut().zip(piece.normals()) {
            *to = turn.rotate(from);
        }
        seen
    }

    pub(super) fn corners(&self) -> &[Vec2] {
        &self.corners[..self.count]
    }

    fn normals(&self) -> &[Vec2] {
        &self.normals[..self.count]
    }

    /// The ends of the edge that begins at a corner.
    pub(super) fn edge(&self, number: usize) -> [Vec2; 2] {
        [self.corners[number], self.corners[(number + 1) % self.count]]
    }

    /// The face along which another lies furthest out, and how far.
    fn separate(&self, other: &Self) -> (usize, f32) {
        let mut most = (0, f32::NEG_INFINITY);
        for (face, (&corner, &normal)) in self.corners().iter().zip(self.normals()).enumerate() {
            let least = other.corners().iter().fold(f32::INFINITY, |least, &at| min(dot(at - corner, normal), least));
            if least > most.1 {
                most = (face, least);
            }
        }
        most
    }

    /// The edge that looks most against a normal.
    pub(super) fn against(&self, normal: Vec2) -> usize {
        let mut most = (0, f32::INFINITY);
        for (edge, &own) in self.normals().iter().enumerate() {
            let along = dot(own, normal);
            if along < most.1 {
                most = (edge, along);
            }
        }
        most.0
    }

    /// Its point nearest to another, or if that is inside the nearest way out: direction from here to there, distance, and where on
    /// the outline: twice the number of an edge or corner, one more for a corner.
    pub(super) fn nearest(&self, point: Vec2) -> (Vec2, f32, u32) {
        if self.count == 1 {
            let away = point - self.corners[0];
            let distance = dot(away, away).sqrt();
            // Discs upon one another part along an axis: any direction will do, if it is always the same.
            let normal = if distance > 0.0 { away / distance } else { Vec2::Y };
            return (normal, distance, 1);
        }
        let mut most = (0, f32::NEG_INFINITY);
        for (face, (&corner, &normal)) in self.corners().iter().zip(self.normals()).enumerate() {
            let distance = dot(point - corner, normal);
            if distance > most.1 {
                most = (face, distance);
            }
        }
        let (face, height) = most;
        let (normal, [from, to]) = (self.normals[face], self.edge(face));
        if height <= 0.0 {
            return (normal, height, 2 * face as u32);
        }
        let corner = if dot(point - from, to - from) <= 0.0 {
            face
        } else if dot(point - to, to - from) >= 0.0 {
            (face + 1) % self.count
        } else {
            return (normal, height, 2 * face as u32);
        };
        let away = point - self.corners[corner];
        let distance = dot(away, away).sqrt();
        (if distance > 0.0 { away / distance } else { normal }, distance, 2 * corner as u32 + 1)
    }
}

/// The manifold of two pieces whose surfaces are nearer than `reach`, of B at `offset` from A; further ones may give none.
#[inline(never)]
pub(in crate::collide) fn collide([a, b]: [&Piece; 2], [rot_a, rot_b]: [Rot; 2], offset: Vec2, reach: f32) -> Manifold {
    if b.side.is_some() {
        let back = collide([b, a], [rot_b, rot_a], -offset, reach);
        return back.swapped(offset);
    }
    let (turn, seen) = (rot_a.to(rot_b), rot_a.unrotate(offset));
    let (own, other) = (Outline::of(a), Outline::seen(b, turn, seen));
    let radii = [a.radius, b.radius];
    let mut manifold = match a.side {
        Some(side) => chain::collide(&own, side, &other, b.radius, turn.rotate(b.center) + seen),
        None => polygons(&own, &other, radii, reach),
    };
    manifold.normal = rot_a.rotate(manifold.normal);
    for point in &mut manifold.points[..manifold.count] {
        point.anchor = rot_a.rotate(point.anchor);
    }
    manifold
}

fn polygons(a: &Outline, b: &Outline, [radius_a, radius_b]: [f32; 2], reach: f32) -> Manifold {
    if b.count == 1 {
        let (normal, distance, _) = a.nearest(b.corners[0]);
        return of_point(b.corners[0] - normal * distance, normal, distance, [radius_a, radius_b], 0);
    }
    if a.count == 1 {
        let (normal, distance, _) = b.nearest(a.corners[0]);
        return of_point(a.corners[0], -normal, distance, [radius_a, radius_b], 0);
    }
    let ((face_a, most_a), (face_b, most_b)) = (a.separate(b), b.separate(a));
    let rounding = radius_a + radius_b;
    if most_a - rounding > reach || most_b - rounding > reach {
        return Manifold::EMPTY;
    }
    let found = if most_b > most_a + PREFERENCE {
        against_face(b, face_b, a, most_b, [radius_b, radius_a], 1 << 7).map(Manifold::turned_round)
    } else {
        against_face(a, face_a, b, most_a, [radius_a, radius_b], 0)
    };
    found.unwrap_or_else(|| corners(a, b, [radius_a, radius_b]))
}

/// From a point on the core of A to one of B along a normal.
fn of_point(on_a: Vec2, normal: Vec2, distance: f32, [radius_a, radius_b]: [f32; 2], feature: u32) -> Manifold {
    let separation = distance - radius_a - radius_b;
    Manifold::single(normal, on_a + normal * (radius_a + 0.5 * separation), separation, feature)
}

/// What is between a face and the edge of the other that looks most against it, if that is over the face.
fn against_face(
    reference: &Outline,
    face: usize,
    other: &Outline,
    height: f32,
    radii: [f32; 2],
    features: u32,
) -> Option<Manifold> {
    let edge = other.against(reference.normals[face]);
    let features = features | (face as u32) << 4 | (edge as u32) << 1;
    let manifold = clip(reference.edge(face), reference.normals[face], other.edge(edge), radii, features);
    // An end of a line has no width: those that overlap part there nevertheless.
    if manifold.is_none() && height <= 0.0 {
        let n = reference.normals[face];
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
        manifold.push(ManifoldPoint { anchor, separation, feature: features | end });
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
fn corners(a: &Outline, b: &Outline, radii: [f32; 2]) -> Manifold {
    let mut least = (f32::INFINITY, Vec2::Y, Vec2::ZERO, 0);
    for (corner, &point) in b.corners().iter().enumerate() {
        let (normal, distance, at) = a.nearest(point);
        if distance < least.0 {
            least = (distance, normal, point - normal * distance, 1 << 8 | at << 3 | corner as u32);
        }
    }
    for (corner, &point) in a.corners().iter().enumerate() {
        let (normal, distance, at) = b.nearest(point);
        if distance < least.0 {
            least = (distance, -normal, point, 1 << 9 | at << 3 | corner as u32);
        }
    }
    let (distance, normal, on_a, feature) = least;
    of_point(on_a, normal, distance, radii, feature)
}
