//! The outlines of sixteen convex pieces: what `Convex` does for one, in the same words and with the same bits.

use super::boxes::nearest;
use crate::model::math::max;
use crate::model::piece::Piece;
use crate::model::shape::MOST_CORNERS;
use crate::parallel::lanes::{Quad, WIDE, Wide, WideRow};
use crate::parallel::vectors::{Vectors, absolute, less};

/// Columns of an outline, four figures each (see `Convex::quads`).
const QUADS: usize = MOST_CORNERS;

/// A convex piece in each of sixteen lanes, in the frame of its body.
#[derive(Debug)]
pub(super) struct WideOutlines {
    quads: [[Quad; WIDE]; QUADS],
    corners: WideRow,
    radii: WideRow,
}

impl Default for WideOutlines {
    fn default() -> Self {
        Self { quads: [[[0.0; 4]; WIDE]; QUADS], corners: [0.0; WIDE], radii: [0.0; WIDE] }
    }
}

impl WideOutlines {
    /// Puts a piece into a lane.
    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, piece: &Piece) {
        for (column, quad) in self.quads.iter_mut().zip(&piece.outline.quads()) {
            column[lane] = *quad;
        }
        self.corners[lane] = piece.outline.count() as f32;
        self.radii[lane] = piece.radius;
    }

    /// The corners of the one that has most.
    #[inline(always)]
    pub(super) fn most_corners(&self) -> usize {
        self.corners.iter().fold(0.0, |most, &count| max(most, count)) as usize
    }

    #[inline(always)]
    pub(super) fn radii<V: Wide>(&self) -> V {
        V::load(&self.radii)
    }

    /// As vectors, as far as so many corners go.
    #[inline(always)]
    pub(super) fn polygon<V: Wide>(&self, corners: usize) -> Polygon<V> {
        let mut columns = [[V::splat(0.0); MOST_CORNERS]; 4];
        for (column, quads) in columns.iter_mut().zip(self.quads.chunks(2)) {
            column[..4].copy_from_slice(&V::load_quads(&quads[0]));
            if corners > 4 {
                column[4..].copy_from_slice(&V::load_quads(&quads[1]));
            }
        }
        let none = Vectors::new(V::splat(0.0), V::splat(0.0));
        let (mut corners, mut normals) = ([none; MOST_CORNERS], [none; MOST_CORNERS]);
        for i in 0..MOST_CORNERS {
            corners[i] = Vectors::new(columns[0][i], columns[1][i]);
            normals[i] = Vectors::new(columns[2][i], columns[3][i]);
        }
        Polygon { corners, normals, count: V::load(&self.corners), most: self.most_corners() }
    }
}

/// Sixteen polygons, as `Convex`.
#[derive(Clone, Copy)]
pub(super) struct Polygon<V> {
    pub(super) corners: [Vectors<V>; MOST_CORNERS],
    pub(super) normals: [Vectors<V>; MOST_CORNERS],
    pub(super) count: V,
    /// None of them has more corners.
    pub(super) most: usize,
}

/// One face of each of sixteen polygons, of which a figure is greatest.
#[derive(Clone, Copy)]
pub(super) struct Face<V> {
    pub(super) figure: V,
    pub(super) number: V,
    /// From which corner to which.
    pub(super) ends: [Vectors<V>; 2],
    pub(super) normal: Vectors<V>,
}

impl<V: Wide> Face<V> {
    /// Less than any.
    #[inline(always)]
    pub(super) fn none() -> Self {
        let (zero, none) = (V::splat(0.0), Vectors::new(V::splat(0.0), V::splat(0.0)));
        Self { figure: V::splat(f32::NEG_INFINITY), number: zero, ends: [none; 2], normal: none }
    }

    /// `yes` where a number is positive, else `no`.
    #[inline(always)]
    pub(super) fn pick(positive: V, yes: &Self, no: &Self) -> Self {
        Self {
            figure: positive.if_positive(yes.figure, no.figure),
            number: positive.if_positive(yes.number, no.number),
            ends: [Vectors::pick(positive, yes.ends[0], no.ends[0]), Vectors::pick(positive, yes.ends[1], no.ends[1])],
            normal: Vectors::pick(positive, yes.normal, no.normal),
        }
    }
}

impl<V: Wide> Polygon<V> {
    /// The same, turned and then moved, as far as so many corners go.
    #[inline(always)]
    pub(super) fn seen(&self, turn: Vectors<V>, offset: Vectors<V>, corners: usize) -> Self {
        let mut seen = *self;
        for i in 0..corners {
            seen.corners[i] = offset.plus(turn.rotate(self.corners[i]));
            seen.normals[i] = turn.rotate(self.normals[i]);
        }
        seen
    }

    /// A face, of which this is the figure.
    #[inline(always)]
    pub(super) fn face(&self, number: usize, figure: V) -> Face<V> {
        let first = self.corners[0];
        let next = if number + 1 < MOST_CORNERS {
            let goes_on = self.count.sub(V::splat((number + 1) as f32));
            Vectors::pick(goes_on, self.corners[number + 1], first)
        } else {
            first
        };
        let (number, corner, normal) = (V::splat(number as f32), self.corners[number], self.normals[number]);
        Face { figure, number, ends: [corner, next], normal }
    }

    /// The face along which another lies furthest out, and how far.
    #[inline(always)]
    pub(super) fn separate(&self, other: &Self) -> Face<V> {
        let mut most = Face::none();
        for number in 0..self.most {
            let (corner, normal) = (self.corners[number], self.normals[number]);
            let mut least = V::splat(f32::INFINITY);
            for &at in &other.corners[..other.most] {
                least = at.minus(corner).dot(normal).min(least);
            }
            let further = least.sub(most.figure);
            most = Face::pick(further, &self.face(number, least), &most);
        }
        most
    }

    /// As [`Convex::nearest`](crate::model::convex::Convex::nearest) of one with faces.
    #[inline(always)]
    pub(super) fn nearest(&self, point: Vectors<V>) -> (Vectors<V>, V, V) {
        let (one, zero, two) = (V::splat(1.0), V::splat(0.0), V::splat(2.0));
        let mut most = Face::none();
        for number in 0..self.most {
            let height = point.minus(self.corners[number]).dot(self.normals[number]);
            most = Face::pick(height.sub(most.figure), &self.face(number, height), &most);
        }
        let (height, [from, to]) = (most.figure, most.ends);
        let edge = to.minus(from);
        let before = point.minus(from).dot(edge).if_positive(zero, one);
        let behind = less(point.minus(to).dot(edge), zero).if_positive(zero, one);
        let outside = height.if_positive(one, zero);
        let is_corner = before.max(behind).mul(outside);
        let follower = most.number.add(one);
        let next = self.count.sub(follower).if_positive(follower, zero);
        let away = point.minus(Vectors::pick(before, from, to));
        let distance = away.dot(away).sqrt();
        let direction = Vectors::new(away.x.div(distance), away.y.div(distance));
        let normal = Vectors::pick(is_corner.mul(distance.if_positive(one, zero)), direction, most.normal);
        let at_corner = two.mul(before.if_positive(most.number, next)).add(one);
        let at = is_corner.if_positive(at_corner, two.mul(most.number));
        (normal, is_corner.if_positive(distance, height), at)
    }
}

/// An edge of each of sixteen polygons, clipped to a face of another, as `clip` of `manifold/convex.rs` does it.
pub(super) struct Clipped<V> {
    /// One where it is not over the face, or around a corner of it, else zero.
    pub(super) none: V,
    /// One where it has a length, and so both points; else zero.
    pub(super) two: V,
    pub(super) anchor: [Vectors<V>; 2],
    pub(super) separation: [V; 2],
}

/// From the ends of the face and its normal, those of the edge, and the radii around both.
#[inline(always)]
pub(super) fn clip<V: Wide>(
    [from, to]: [Vectors<V>; 2],
    n: Vectors<V>,
    ends: [Vectors<V>; 2],
    [radius, other_radius]: [V; 2],
) -> Clipped<V> {
    let (one, zero, half) = (V::splat(1.0), V::splat(0.0), V::splat(0.5));
    let t = Vectors::new(zero.sub(n.y), n.x);
    let width = to.minus(from).dot(t);
    let from_face = [ends[1].minus(from), ends[0].minus(from)];
    let place = [from_face[0].dot(t), from_face[1].dot(t)];
    let heights = [from_face[0].dot(n), from_face[1].dot(n)];
    let beside = less(place[1], zero).max(less(width, place[0]));
    let (span, rise) = (place[1].sub(place[0]), heights[1].sub(heights[0]));
    let slope = span.if_positive(rise.div(span), zero);
    let spans = span.if_positive(one, zero);
    let rounded = radius.add(other_radius).if_positive(one, zero);
    let mut clipped =
        Clipped { none: width.if_positive(beside, one), two: spans, anchor: [from; 2], separation: [zero; 2] };
    for end in 0..2 {
        let at = place[end].max(zero).min(width);
        let shift = at.sub(place[end]);
        let height = span.if_positive(heights[end], heights[end].min(heights[1])).add(slope.mul(shift));
        // Around a corner a slanted edge is nearer than straight up from the face.
        let corner = from.plus(t.scaled(at));
        let (gap, part) = nearest(corner, ends);
        let distance = gap.dot(gap).sqrt();
        let around = absolute(shift).if_positive(height, zero);
        // Round corners meet along the line between them.
        let is_corner = less(zero, part).mul(less(part, one)).if_positive(zero, one);
        let is_round = is_corner.mul(less(distance, height)).mul(rounded);
        let there = if end == 0 { one } else { spans };
        clipped.none = clipped.none.max(around.if_positive(is_round, zero).mul(there));
        let separation = around.if_positive(distance.min(height), height).sub(radius).sub(other_radius);
        clipped.separation[end] = separation;
        clipped.anchor[end] = corner.plus(n.scaled(radius.add(half.mul(separation))));
    }
    clipped
}
