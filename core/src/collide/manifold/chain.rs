//! A segment that is solid from one side, and a convex piece.
//!
//! Normals at its ends lie between its own and those of its neighbours, so that nothing meets an edge where there is only a joint.
//! Source: one-sided chains with ghost vertices as in Box2D (E. Catto); here a joint that juts out belongs to one of its two segments.

use super::Manifold;
use super::convex::clip;
use crate::model::contact::ContactPoint;
use crate::model::convex::Convex;
use crate::model::math::{dot, max, min};
use crate::model::piece::{Joint, Side};
use glam::Vec2;
use std::ops::RangeInclusive;

/// Normals of faces that differ by less count as one.
pub(in crate::collide) const SAME: f32 = 1e-5;

/// What is further makes no contact yet, in m.
pub(in crate::collide) const FAR: f32 = 0.05;

/// A segment reaches so much further than it is long, as part of its length: rounding leaves no gap at a joint.
pub(in crate::collide) const BEYOND: f32 = 1e-5;

/// What comes out at a joint along a normal that is turned by more than this from that of a segment does not touch it there: the sine.
pub(in crate::collide) const ASLANT: f32 = 0.01;

/// How far the whole of a piece may be behind a segment that it lies on, in m; none for one that does not.
pub(in crate::collide) type Lies = Option<f32>;

/// The distance of a piece from an end of a segment, and their manifold.
type AtEnd = Option<(f32, Manifold)>;

/// The manifold of a segment, of which `own` has the face first, and a piece, seen from the body of the segment. `center` is that of
/// the piece, which is before the segment; or over it, where the piece [lies](Lies) there already and no more than so far behind. What has no
/// contact with it here, as another segment has, only [tells how far it is](Manifold::is_distance); what is further than `reach` need not.
pub(super) fn collide(
    own: &Convex,
    side: Side,
    (other, radius, center): (&Convex, f32, Vec2),
    reach: f32,
    lies: Lies,
) -> Manifold {
    let [to, from] = own.edge(0);
    let along = to - from;
    let length = dot(along, along).sqrt();
    let along = along / length;
    let n = Vec2::new(-along.y, along.x);
    let (heights, places) = (other.along(from, n), other.along(from, along));
    let (number, lowest) = Convex::least(&heights);
    let ((_, highest), (_, first), (_, last)) = (Convex::most(&heights), Convex::least(&places), Convex::most(&places));
    let far = reach + radius;
    if lowest > far || highest < -far || first > length + far || last < -far {
        return Manifold::EMPTY;
    }
    let (corner, number) = (other.corner(number), number as u32);
    let is_over = (0.0..=length).contains(&dot(corner - from, along));
    let is_center_over = (0.0..=length).contains(&dot(center - from, along));
    let is_pressed = is_center_over && lies.is_some_and(|most| highest + radius >= -most);
    let is_in_front = dot(center - from, n) >= 0.0;
    let is_before = is_pressed || is_in_front;
    // A round one with an edge that leans out beyond the end comes down with the edge's other corner.
    let of_lowest = || is_over.then(|| of_corner(corner, lowest, n, radius, 1 << 9 | number));
    let over = is_before.then(|| against_face(own, n, other, radius).or_else(of_lowest)).flatten();
    // What is between the ends has nothing to do with these.
    let is_within = first >= BEYOND * length && last <= length - BEYOND * length;
    let behind = -(radius + lies.unwrap_or(0.0));
    if let Some(over) = over
        && is_within
        && highest >= behind
    {
        return over;
    }
    // What has come behind the segment around an end of it is not pressed into its face.
    let is_behind = |over: &Manifold| over.nearest().is_some_and(|nearest| nearest.separation < 0.0);
    // Its lowest corner may be above the surface by no more than rounding then.
    let band = behind..=max(radius, lowest);
    let comes = || {
        comes_to(other, [from, along, n], length, band) || [from, to].iter().any(|&end| other.nearest(end).1 <= radius)
    };
    let over = over.filter(|over| !is_behind(over) || comes());
    // What lies over the segment with its nearest point is nearest there.
    if let Some(over) = over
        && lowest > 0.0
        && is_over
    {
        return over;
    }
    let (mut touched, mut nearest): (AtEnd, AtEnd) = (None, None);
    // How far from a joint what comes out there rather along the normal of the next segment; and where it does along its own.
    let (mut beyond, mut leaves) = (f32::NEG_INFINITY, [false; 2]);
    for (number, end, joint) in [(0, from, side.start), (1, to, side.end)] {
        let (outward, distance, _) = other.nearest(end);
        let normal = -outward;
        let far = if other.count() == 1 { 0.0 } else { SAME };
        let is_out = |limit: Vec2| is_before || dot(center - end, limit) >= 0.0;
        let may = match joint {
            Joint::Free(limit) => is_out(limit) && is_between(normal, [n, limit], [far, -far]),
            Joint::Convex { normal: limit, is_end } => {
                let turn = turned(n, normal, limit);
                if turn >= far && dot(normal, limit) >= dot(normal, n) {
                    beyond = max(beyond, distance);
                } else {
                    leaves[number as usize] = is_in_front && turn >= ASLANT && lowest <= radius && distance > lowest;
                }
                is_end && is_out(limit) && is_between(normal, [n, limit], [far, far])
            }
            Joint::Concave => false,
        };
        let separation = distance - radius;
        let at_end = |feature| Manifold::single(normal, end + normal * (0.5 * separation), separation, feature);
        let is_least = |known: &AtEnd| known.is_none_or(|(least, _)| distance < least);
        if may && is_least(&touched) {
            touched = Some((distance, at_end(if other.count() == 1 { 0 } else { 1 << 8 | number })));
        }
        // Whoever is on the solid side, but for a joint, is let through.
        if is_before && is_least(&nearest) {
            nearest = Some((distance, at_end(ContactPoint::ABSENT)));
        }
    }
    let is_far = |manifold: &Manifold| manifold.nearest().is_some_and(|nearest| nearest.separation > FAR);
    // There the next segment has it, or this one from the joint.
    let over = over.and_then(|over| over.without(|anchor| is_at_left_end(dot(anchor - from, along), length, leaves)));
    match (over, touched.filter(|(_, at_end)| !is_far(at_end)), nearest) {
        // What lies over an edge is deep in the wall below it, or within its rounding, and touches what is before the edge.
        (Some(_), None, Some((_, nearest))) if lowest <= radius && beyond > lowest => nearest,
        // Both are ways out.
        (Some(over), Some((distance, at_end)), _) => {
            if lowest <= 0.0 && distance <= lowest {
                over
            } else {
                at_end
            }
        }
        // Along the segment's normal what reaches beyond it may be nearer than what is over it.
        (Some(over), None, Some((_, nearest))) if is_far(&over) && is_far(&nearest) => nearest,
        (Some(over), None, _) => over,
        (None, Some((_, at_end)), _) => at_end,
        (None, None, Some((_, nearest))) => nearest,
        (None, None, None) => touched.map_or(Manifold::EMPTY, |(_, at_end)| at_end),
    }
}

/// Whether a place along a segment is an end that something leaves.
fn is_at_left_end(place: f32, length: f32, [start, end]: [bool; 2]) -> bool {
    start && place <= BEYOND * length || end && place >= length - BEYOND * length
}

/// Whether the corners and edges of a piece come between the ends of a segment at one of some heights over it. The segment is told by where it
/// starts, its direction and its normal.
fn comes_to(other: &Convex, [from, along, n]: [Vec2; 3], length: f32, heights: RangeInclusive<f32>) -> bool {
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    let mut here = other.corner(other.count() - 1) - from;
    for corner in other.corners() {
        let there = corner - from;
        let (first, last) = (dot(here, n), dot(there, n));
        let (lowest, highest) = (max(min(first, last), *heights.start()), min(max(first, last), *heights.end()));
        if lowest <= highest {
            let part_at = |height: f32| (first - height) / (first - last);
            let parts = if first == last { [0.0, 1.0] } else { [lowest, highest].map(part_at) };
            for place in parts.map(|part| dot(here + (there - here) * part, along)) {
                (low, high) = (min(low, place), max(high, place));
            }
        }
        here = there;
    }
    low <= length && high >= 0.0
}

/// Along the segment's own normal, as far as the piece is over it.
fn against_face(own: &Convex, n: Vec2, other: &Convex, radius: f32) -> Option<Manifold> {
    let [to, from] = own.edge(0);
    if other.count() == 1 {
        let point = other.corner(0);
        let (along, height) = (dot(point - from, to - from), dot(point - from, n));
        let square = dot(to - from, to - from);
        let is_over = (-BEYOND * square..=(1.0 + BEYOND) * square).contains(&along);
        return is_over.then(|| of_corner(point, height, n, radius, 0));
    }
    let edge = other.against(n);
    clip([to, from], n, other.edge(edge), [0.0, radius], (edge as u32) << 1)
}

/// A corner, with a radius around it, so high over a segment.
fn of_corner(corner: Vec2, height: f32, n: Vec2, radius: f32, feature: u32) -> Manifold {
    let separation = height - radius;
    Manifold::single(n, corner - n * (height - 0.5 * separation), separation, feature)
}

/// Whether a unit vector lies between two others, nearer to each other than half a turn, and so far from each.
fn is_between(v: Vec2, [one, other]: [Vec2; 2], [from_one, from_other]: [f32; 2]) -> bool {
    turned(one, v, other) >= from_one && turned(other, v, one) >= from_other
}

/// How far a unit vector is turned from one to another: the sine of that angle.
fn turned(from: Vec2, v: Vec2, to: Vec2) -> f32 {
    let way = if from.perp_dot(to) < 0.0 { -1.0 } else { 1.0 };
    way * from.perp_dot(v)
}
