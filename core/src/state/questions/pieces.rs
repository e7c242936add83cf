//! What is asked of a convex piece, in the frame of its body and in double precision.

use crate::model::piece::Piece;
use glam::DVec2;

/// The edges of a piece, each with its normal.
fn edges(piece: &Piece) -> impl Iterator<Item = (DVec2, DVec2, DVec2)> + '_ {
    let corners = piece.outline.corners();
    let edges = corners.clone().zip(corners.cycle().skip(1)).zip(piece.outline.normals());
    edges.map(|((from, to), normal)| (from.as_dvec2(), to.as_dvec2(), normal.as_dvec2()))
}

fn corners(piece: &Piece) -> impl Iterator<Item = DVec2> + '_ {
    piece.outline.corners().map(|corner| corner.as_dvec2())
}

/// Whether a point is in it or on it.
pub(super) fn holds(piece: &Piece, point: DVec2) -> bool {
    let radius = f64::from(piece.radius);
    let is_within = piece.outline.count() > 2 && edges(piece).all(|(from, _, normal)| normal.dot(point - from) <= 0.0);
    is_within || radius > 0.0 && edges(piece).any(|(from, to, _)| distance(point, from, to) <= radius)
}

/// Whether it has a point in common with the convex polygon of these corners, counter-clockwise.
pub(super) fn meets(piece: &Piece, other: &[DVec2]) -> bool {
    let sides = || (0..other.len()).map(|i| (other[i], other[(i + 1) % other.len()]));
    let radius = f64::from(piece.radius);
    let within = |point: DVec2| sides().all(|(from, to)| (to - from).perp_dot(point - from) >= 0.0);
    let are_near = |(from, to, _): (DVec2, DVec2, DVec2)| sides().any(|side| gap((from, to), side) <= radius);
    corners(piece).any(within) || other.iter().any(|&corner| holds(piece, corner)) || edges(piece).any(are_near)
}

/// Where a line from outside enters it, and the normal there. A segment is entered from its free side only.
pub(super) fn enter(piece: &Piece, start: DVec2, along: DVec2) -> Option<(f64, DVec2)> {
    let radius = f64::from(piece.radius);
    let free = if piece.side.is_some() { 1 } else { piece.outline.count() };
    let faces = edges(piece).take(free).filter_map(|(from, to, normal)| {
        let (speed, edge) = (normal.dot(along), to - from);
        // A line has faces at its ends that are no wider than a point: corners are looked at below.
        if speed >= 0.0 || edge == DVec2::ZERO {
            return None;
        }
        let fraction = (normal.dot(from - start) + radius) / speed;
        let place = (start + along * fraction - from).dot(edge);
        (place >= 0.0 && place <= edge.length_squared()).then_some((fraction, normal))
    });
    let rounds = corners(piece).filter_map(|corner| {
        let (offset, square) = (start - corner, along.length_squared());
        let half = offset.dot(along);
        let nearest = offset - along * (half / square);
        let rest = radius * radius - nearest.length_squared();
        if half >= 0.0 || rest < 0.0 || radius == 0.0 {
            return None;
        }
        let fraction = -half / square - (rest / square).sqrt();
        Some((fraction, (offset + along * fraction) / radius))
    });
    faces.chain(rounds).filter(|(fraction, _)| *fraction >= 0.0).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Of a point from a line between two others.
fn distance(point: DVec2, from: DVec2, to: DVec2) -> f64 {
    let (edge, offset) = (to - from, point - from);
    let square = edge.length_squared();
    let part = if square > 0.0 { (offset.dot(edge) / square).clamp(0.0, 1.0) } else { 0.0 };
    (offset - edge * part).length()
}

/// Of two lines, zero where they cross.
fn gap((a, b): (DVec2, DVec2), (c, d): (DVec2, DVec2)) -> f64 {
    let are_apart = |from: DVec2, to: DVec2, one: DVec2, other: DVec2| {
        (to - from).perp_dot(one - from) * (to - from).perp_dot(other - from) > 0.0
    };
    let parallel = (b - a).perp_dot(d - c) == 0.0;
    if !parallel && !are_apart(a, b, c, d) && !are_apart(c, d, a, b) {
        return 0.0;
    }
    distance(a, c, d).min(distance(b, c, d)).min(distance(c, a, b)).min(distance(d, a, b))
}
