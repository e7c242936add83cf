//! The convex pieces of sixteen pairs: what `manifold/convex.rs` does for two, in the same words and with the same bits.

use super::broad_phase::Pair;
use super::manifold::box_box::PREFERENCE;
use super::wide_boxes::nearest;
use super::wide_moments::{Moments, Points, Search, Shaped, Shapes, opposite};
use super::wide_pairs::{Pairs, WidePairs};
use crate::model::math::max;
use crate::model::piece::Piece;
use crate::model::shape::MOST_CORNERS;
use crate::parallel::lanes::{Quad, WIDE, Wide, WideRow};
use crate::parallel::vectors::{Vectors, absolute, less};
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// Columns of an outline, four figures each (see `Convex::quads`).
const QUADS: usize = MOST_CORNERS;

/// A piece of each body of sixteen pairs, all of which have faces.
#[derive(Debug)]
pub(super) struct WidePolygons {
    pub(super) pairs: WidePairs,
    outlines: [[[Quad; WIDE]; QUADS]; 2],
    corners: [WideRow; 2],
    radii: [WideRow; 2],
}

impl Default for WidePolygons {
    fn default() -> Self {
        Self {
            pairs: WidePairs::default(),
            outlines: [[[[0.0; 4]; WIDE]; QUADS]; 2],
            corners: [[0.0; WIDE]; 2],
            radii: [[0.0; WIDE]; 2],
        }
    }
}

impl Shaped for WidePolygons {
    const NEED_REGISTERS: bool = true;

    #[inline(always)]
    fn set(&mut self, lane: usize, tile: &Tile, bodies: Pair, pressed: bool, setup: &Setup) {
        let kinds = bodies.map(|body| setup.kind(tile.bodies.kind[body as usize]));
        self.pairs.set(lane, tile, bodies, pressed, setup);
        self.set_pieces(lane, [&kinds[0].pieces[0], &kinds[1].pieces[0]]);
    }

    #[inline(always)]
    fn look<V: Wide>(&self, points: &mut Points, search: Search, setup: &Setup) {
        let mut pairs = self.pairs.load::<V>(setup);
        pairs.radius = [V::load(&self.radii[0]), V::load(&self.radii[1])];
        let most = [self.most_corners(0), self.most_corners(1)];
        let polygons = Polygons([self.polygon(0, most), self.polygon(1, most)]);
        points.look(&pairs, &polygons, search, setup);
    }
}

impl WidePolygons {
    /// Puts two pieces of the bodies of a lane into it.
    #[inline(always)]
    pub(super) fn set_pieces(&mut self, lane: usize, pieces: [&Piece; 2]) {
        for (side, piece) in pieces.into_iter().enumerate() {
            let quads = piece.outline.quads();
            for (column, quad) in self.outlines[side].iter_mut().zip(&quads) {
                column[lane] = *quad;
            }
            self.corners[side][lane] = piece.outline.count() as f32;
            self.radii[side][lane] = piece.radius;
        }
    }

    /// Those of the polygons that have most.
    #[inline(always)]
    fn most_corners(&self, side: usize) -> usize {
        self.corners[side].iter().fold(0.0, |most, &count| max(most, count)) as usize
    }

    #[inline(always)]
    fn polygon<V: Wide>(&self, side: usize, most: [usize; 2]) -> Polygon<V> {
        let mut columns = [[V::splat(0.0); MOST_CORNERS]; 4];
        for (column, quads) in columns.iter_mut().zip(self.outlines[side].chunks(2)) {
            column[..4].copy_from_slice(&V::load_quads(&quads[0]));
            if most[0].max(most[1]) > 4 {
                column[4..].copy_from_slice(&V::load_quads(&quads[1]));
            }
        }
        let none = Vectors::new(V::splat(0.0), V::splat(0.0));
        let (mut corners, mut normals) = ([none; MOST_CORNERS], [none; MOST_CORNERS]);
        for i in 0..MOST_CORNERS {
            corners[i] = Vectors::new(columns[0][i], columns[1][i]);
            normals[i] = Vectors::new(columns[2][i], columns[3][i]);
        }
        Polygon { corners, normals, count: V::load(&self.corners[side]), most: most[side] }
    }
}

/// Sixteen polygons, as `Convex`.
#[derive(Clone, Copy)]
struct Polygon<V> {
    corners: [Vectors<V>; MOST_CORNERS],
    normals: [Vectors<V>; MOST_CORNERS],
    count: V,
    /// None of them has more corners.
    most: usize,
}

/// One face of each of sixteen polygons, of which a figure is greatest.
#[derive(Clone, Copy)]
struct Face<V> {
    figure: V,
    number: V,
    /// From which corner to which.
    ends: [Vectors<V>; 2],
    normal: Vectors<V>,
}

impl<V: Wide> Face<V> {
    /// Less than any.
    #[inline(always)]
    fn none() -> Self {
        let (zero, none) = (V::splat(0.0), Vectors::new(V::splat(0.0), V::splat(0.0)));
        Self { figure: V::splat(f32::NEG_INFINITY), number: zero, ends: [none; 2], normal: none }
    }

    /// `yes` where a number is positive, else `no`.
    #[inline(always)]
    fn pick(positive: V, yes: &Self, no: &Self) -> Self {
        Self {
            figure: positive.if_positive(yes.figure, no.figure),
            number: positive.if_positive(yes.number, no.number),
            ends: [Vectors::pick(positive, yes.ends[0], no.ends[0]), Vectors::pick(positive, yes.ends[1], no.ends[1])],
            normal: Vectors::pick(positive, yes.normal, no.normal),
        }
    }
}

/// The nearest points of two polygons, as far as they are known.
#[derive(Clone, Copy)]
struct Gap<V> {
    distance: V,
    /// From the first to the second, of length one.
    normal: Vectors<V>,
    on_first: Vectors<V>,
    feature: V,
}

impl<V: Wide> Gap<V> {
    /// Wider than any.
    #[inline(always)]
    fn none() -> Self {
        let (zero, none) = (V::splat(0.0), Vectors::new(V::splat(0.0), V::splat(0.0)));
        Self { distance: V::splat(f32::INFINITY), normal: none, on_first: none, feature: zero }
    }

    /// The lesser, or else the first.
    #[inline(always)]
    fn lesser(first: &Self, other: &Self) -> Self {
        let less = first.distance.sub(other.distance);
        Self {
            distance: less.if_positive(other.distance, first.distance),
            normal: Vectors::pick(less, other.normal, first.normal),
            on_first: Vectors::pick(less, other.on_first, first.on_first),
            feature: less.if_positive(other.feature, first.feature),
        }
    }

    /// Of two that are apart: at a corner of one of them.
    #[inline(always)]
    fn between(a: &Polygon<V>, b: &Polygon<V>) -> Self {
        let mut least = Self::none();
        for (number, &point) in b.corners[..b.most].iter().enumerate() {
            let (normal, distance, at) = a.nearest(point);
            let on_first = point.minus(normal.scaled(distance));
            let feature = at.mul(V::splat(8.0)).add(V::splat(256.0 + number as f32));
            least = Self::lesser(&least, &Self { distance, normal, on_first, feature });
        }
        for (number, &point) in a.corners[..a.most].iter().enumerate() {
            let (normal, distance, at) = b.nearest(point);
            let feature = at.mul(V::splat(8.0)).add(V::splat(512.0 + number as f32));
            least = Self::lesser(&least, &Self { distance, normal: opposite(normal), on_first: point, feature });
        }
        least
    }
}

impl<V: Wide> Polygon<V> {
    /// The same, turned and then moved, as far as so many corners go.
    #[inline(always)]
    fn seen(&self, turn: Vectors<V>, offset: Vectors<V>, corners: usize) -> Self {
        let mut seen = *self;
        for i in 0..corners {
            seen.corners[i] = offset.plus(turn.rotate(self.corners[i]));
            seen.normals[i] = turn.rotate(self.normals[i]);
        }
        seen
    }

    /// A face, of which this is the figure.
    #[inline(always)]
    fn face(&self, number: usize, figure: V) -> Face<V> {
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
    fn separate(&self, other: &Self) -> Face<V> {
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
    fn nearest(&self, point: Vectors<V>) -> (Vectors<V>, V, V) {
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

/// Both pieces of sixteen pairs, in the frames of their bodies.
struct Polygons<V>([Polygon<V>; 2]);

impl<V: Wide> Shapes<V> for Polygons<V> {
    #[inline(always)]
    fn manifolds(
        &self,
        pairs: &Pairs<V>,
        time: V,
        offset: Vectors<V>,
        turning: [Vectors<V>; 2],
        reach: V,
    ) -> Moments<V> {
        let (one, zero, half) = (V::splat(1.0), V::splat(0.0), V::splat(0.5));
        let rotation = [turning[0].rotate(pairs.rotation[0]), turning[1].rotate(pairs.rotation[1])];
        let a = &self.0[0];
        let most = a.most.max(self.0[1].most);
        let b = &self.0[1].seen(rotation[0].to(rotation[1]), rotation[0].unrotate(offset), most);
        let rounding = pairs.radius[0].add(pairs.radius[1]);
        let (face_a, face_b) = (a.separate(b), b.separate(a));
        let beyond = less(reach, face_a.figure.sub(rounding)).max(less(reach, face_b.figure.sub(rounding)));
        let from_b = less(face_a.figure.add(V::splat(PREFERENCE)), face_b.figure);
        let reference = Face::pick(from_b, &face_b, &face_a);
        let (height, n) = (reference.figure, reference.normal);
        // The edge of the other that looks most against it.
        let mut edge = Face::none();
        for number in 0..most {
            let normal = Vectors::pick(from_b, a.normals[number], b.normals[number]);
            let against = zero.sub(normal.dot(n));
            let [in_a, in_b] = [a.face(number, against), b.face(number, against)];
            edge = Face::pick(against.sub(edge.figure), &Face::pick(from_b, &in_a, &in_b), &edge);
        }
        let of_a = from_b.if_positive(edge.number, reference.number);
        let of_b = from_b.if_positive(reference.number, edge.number);
        let features = of_a.mul(V::splat(16.0)).add(of_b.mul(V::splat(2.0)));
        let first = from_b.if_positive(one, zero);
        let radius = from_b.if_positive(pairs.radius[1], pairs.radius[0]);
        let other_radius = from_b.if_positive(pairs.radius[0], pairs.radius[1]);
        // Clipped to the face.
        let [from, to] = reference.ends;
        let t = Vectors::new(zero.sub(n.y), n.x);
        let width = to.minus(from).dot(t);
        let from_face = [edge.ends[1].minus(from), edge.ends[0].minus(from)];
        let place = [from_face[0].dot(t), from_face[1].dot(t)];
        let heights = [from_face[0].dot(n), from_face[1].dot(n)];
        let beside = less(place[1], zero).max(less(width, place[0]));
        let (span, rise) = (place[1].sub(place[0]), heights[1].sub(heights[0]));
        let slope = span.if_positive(rise.div(span), zero);
        let spans = span.if_positive(one, zero);
        let mut at = Moments {
            time,
            offset,
            turning,
            some: beyond.if_positive(zero, one),
            two: spans,
            normal: n,
            anchor: [offset; 2],
            separation: [zero; 2],
            feature: [features.add(first), features.add(one.sub(first))],
        };
        let mut none = width.if_positive(beside, one);
        for end in 0..2 {
            let clipped = place[end].max(zero).min(width);
            let shift = clipped.sub(place[end]);
            let height = span.if_positive(heights[end], heights[end].min(heights[1])).add(slope.mul(shift));
            // Around a corner a slanted edge is nearer than straight up from the face.
            let corner = from.plus(t.scaled(clipped));
            let (gap, part) = nearest(corner, edge.ends);
            let distance = gap.dot(gap).sqrt();
            let around = absolute(shift).if_positive(height, zero);
            // Round corners meet along the line between them.
            let is_corner = less(zero, part).mul(less(part, one)).if_positive(zero, one);
            let is_round = is_corner.mul(less(distance, height)).mul(rounding.if_positive(one, zero));
            let there = if end == 0 { one } else { spans };
            none = none.max(around.if_positive(is_round, zero).mul(there));
            let separation = around.if_positive(distance.min(height), height).sub(radius).sub(other_radius);
            at.separation[end] = separation;
            at.anchor[end] = corner.plus(n.scaled(radius.add(half.mul(separation))));
        }
        // An end of a line has no width: those that overlap part there nevertheless.
        let is_end = none.mul(height.if_positive(zero, one));
        let apart_at_corners = none.mul(height.if_positive(one, zero)).mul(at.some);
        at.two = at.two.mul(none.if_positive(zero, one));
        let slants = edge.ends[1].minus(edge.ends[0]).dot(n);
        let deepest = Vectors::pick(zero.sub(slants), edge.ends[1], edge.ends[0]);
        let apart = absolute(from.x.sub(to.x)).max(absolute(from.y.sub(to.y)));
        let on_face = Vectors::pick(apart, deepest.minus(n.scaled(height)), from);
        let separation = height.sub(radius).sub(other_radius);
        let anchor = on_face.plus(n.scaled(radius.add(half.mul(separation))));
        at.separation[0] = is_end.if_positive(separation, at.separation[0]);
        at.anchor[0] = Vectors::pick(is_end, anchor, at.anchor[0]);
        let mut normal = Vectors::pick(from_b, opposite(n), n);
        if apart_at_corners.any_positive() {
            let gap = Gap::between(a, b);
            let separation = gap.distance.sub(pairs.radius[0]).sub(pairs.radius[1]);
            let anchor = gap.on_first.plus(gap.normal.scaled(pairs.radius[0].add(half.mul(separation))));
            normal = Vectors::pick(apart_at_corners, gap.normal, normal);
            at.anchor[0] = Vectors::pick(apart_at_corners, anchor, at.anchor[0]);
            at.separation[0] = apart_at_corners.if_positive(separation, at.separation[0]);
            at.feature[0] = apart_at_corners.if_positive(gap.feature, at.feature[0]);
        }
        // Back to the frame of the world.
        at.normal = rotation[0].rotate(normal);
        for anchor in &mut at.anchor {
            *anchor = rotation[0].rotate(*anchor);
        }
        at
    }
}
