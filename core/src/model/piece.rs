//! The convex pieces that contacts of all shapes but circles and boxes are found by.

use crate::model::abutting::join_abutting;
use crate::model::convex::Convex;
use crate::model::math::{dot, max};
use crate::model::shape::{Polygon, Segment, Shape};
use glam::Vec2;
use std::sync::Arc;

/// A convex polygon and what is within a radius of it, in the frame of its body. One corner makes a disc.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    pub(crate) outline: Convex,
    pub(crate) radius: f32,
    /// Mean of its corners.
    pub(crate) center: Vec2,
    /// Of a segment that is solid from one side.
    pub(crate) side: Option<Side>,
}

/// How a segment goes on at its ends.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Side {
    pub(crate) start: Joint,
    pub(crate) end: Joint,
}

/// An end of a segment.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Joint {
    /// It does not: contacts here may have any normal between the segment's and this one.
    Free(Vec2),
    /// It juts out, and the next segment has this normal. Contacts with one between these belong to the segment that the joint ends.
    Convex { normal: Vec2, is_end: bool },
    /// Nothing touches it here but along the segment's normal.
    Concave,
}

impl Piece {
    pub(super) fn new(corners: &[Vec2], radius: f32) -> Self {
        Self::with_normals(corners, &outward(corners), radius)
    }

    fn with_normals(corners: &[Vec2], normals: &[Vec2], radius: f32) -> Self {
        let center = corners.iter().sum::<Vec2>() / corners.len() as f32;
        Self { outline: Convex::new(corners, normals), radius, center, side: None }
    }

    fn of_polygon(polygon: &Polygon) -> Self {
        match *polygon.corners() {
            [from, to] => Self::of_line(from, to, polygon.radius()),
            ref corners => Self::new(corners, polygon.radius()),
        }
    }

    /// A line is a box without height: four corners, and faces at its ends.
    fn of_line(from: Vec2, to: Vec2, radius: f32) -> Self {
        let corners = [from, to, to, from];
        let out = outward(&corners)[0];
        let along = Vec2::new(-out.y, out.x);
        Self::with_normals(&corners, &[out, along, -out, -along], radius)
    }

    fn of_segment(segment: &Segment) -> Self {
        let [from, to] = segment.ends();
        // Its free side is on its left, its solid one on its right: the face from its end to its start.
        let mut piece = Self::new(&[to, from], 0.0);
        let out = piece.outline.normal(0);
        let along = -(out.perp());
        let joint = |other: Option<Vec2>, end: Vec2, is_end: bool| {
            let Some(other) = other else { return Joint::Free(if is_end { along } else { -along }) };
            let way = (if is_end { other - end } else { end - other }).as_dvec2();
            let normal = way.perp().normalize_or_zero().as_vec2();
            let juts_out = dot(normal, along) * if is_end { 1.0 } else { -1.0 } > 1e-4;
            if juts_out { Joint::Convex { normal, is_end } } else { Joint::Concave }
        };
        piece.side = Some(Side { start: joint(segment.before(), from, false), end: joint(segment.after(), to, true) });
        piece
    }

    /// A segment that reaches so much further back from its start, or on from its end, where it is hollow.
    pub(crate) fn lengthened(&self, at_end: bool, by: f32) -> Self {
        let [to, from] = self.outline.edge(0);
        let normal = self.outline.normal(0);
        let out = Vec2::new(normal.y, -normal.x) * by;
        let corners = if at_end { [to + out, from] } else { [to, from - out] };
        Self { outline: Convex::new(&corners, &[normal, self.outline.normal(1)]), ..*self }
    }

    /// Whether it is neither a disc nor a segment that is solid from one side.
    pub(crate) fn has_faces(&self) -> bool {
        self.outline.count() > 1 && self.side.is_none()
    }

    /// How far it reaches along a direction, from the center of the body that holds it.
    pub(crate) fn reach(&self, direction: Vec2) -> f32 {
        self.outline.corners().fold(f32::NEG_INFINITY, |most, corner| max(most, dot(corner, direction))) + self.radius
    }

    /// Whether an edge that has a length has less than that.
    pub(crate) fn has_edge_shorter_than(&self, length: f32) -> bool {
        let edges = (0..self.outline.count()).map(|face| self.outline.edge(face));
        edges.map(|[from, to]| dot(to - from, to - from)).any(|square| square > 0.0 && square < length * length)
    }

    /// Half extents of an upright rectangle around the center of the body that holds it.
    pub(crate) fn half_extents(&self) -> Vec2 {
        self.outline.corners().fold(Vec2::ZERO, |most, corner| most.max(corner.abs())) + self.radius
    }
}

/// The normals out of the faces from each corner to the next.
fn outward(corners: &[Vec2]) -> Vec<Vec2> {
    let next = corners.iter().cycle().skip(1);
    // In double precision, rounded once.
    let normal = |(&from, &to): (&Vec2, &Vec2)| (-(to - from).as_dvec2().perp()).normalize_or_zero().as_vec2();
    corners.iter().zip(next).map(normal).collect()
}

/// The convex pieces of a shape: of several shapes fewer, where some are one together.
pub(crate) fn pieces(shape: &Shape) -> Arc<[Piece]> {
    match shape {
        Shape::Circle { radius } => [Piece::new(&[Vec2::ZERO], *radius)].into(),
        Shape::Box { half } => {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            [Piece::new(&corners.map(|(x, y)| *half * Vec2::new(x, y)), 0.0)].into()
        }
        Shape::Polygon(polygon) => [Piece::of_polygon(polygon)].into(),
        Shape::Segment(segment) => [Piece::of_segment(segment)].into(),
        Shape::Compound(compound) => {
            let placed = compound.parts().iter().flat_map(|part| {
                let place = |corner: Vec2| part.position + part.rotation.rotate(corner);
                let own: Vec<Piece> = pieces(&part.shape).iter().map(|piece| piece.placed(place)).collect();
                own
            });
            let mut all = placed.collect();
            join_abutting(&mut all);
            all.into()
        }
    }
}

impl Piece {
    fn placed(&self, place: impl Fn(Vec2) -> Vec2) -> Self {
        let corners: Vec<Vec2> = self.outline.corners().map(place).collect();
        match corners[..] {
            [from, to, again, _] if to == again => Self::of_line(from, to, self.radius),
            _ => Self::new(&corners, self.radius),
        }
    }
}
