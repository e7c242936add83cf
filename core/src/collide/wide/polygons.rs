//! The convex pieces of sixteen pairs: what `manifold/convex.rs` does for two, in the same words and with the same bits.

use super::manifolds::Manifolds;
use super::moments::{Points, Search, Shaped, Shapes, WidePieces};
use super::outlines::{Face, Polygon, WideOutlines, clip};
use super::pairs::{Pairs, WidePairs};
use crate::collide::broad_phase::Pair;
use crate::collide::manifold::box_box::{EQUAL, PREFERENCE};
use crate::collide::manifold::chain::Lies;
use crate::model::contact::Contact;
use crate::model::piece::Piece;
use crate::parallel::lanes::Wide;
use crate::parallel::vectors::{Vectors, absolute, less};
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// A piece of each body of sixteen pairs, all of which have faces.
#[derive(Default, Debug)]
pub(in crate::collide) struct WidePolygons {
    pairs: WidePairs,
    outlines: [WideOutlines; 2],
}

impl Shaped for WidePolygons {
    const NEED_REGISTERS: bool = true;

    #[inline(always)]
    fn set(&mut self, lane: usize, tile: &Tile, bodies: Pair, known: Option<&Contact>, setup: &Setup) {
        let kinds = bodies.map(|body| setup.kind(tile.bodies.kind[body as usize]));
        self.pairs.set(lane, tile, bodies, known, setup);
        self.set_pieces(lane, [&kinds[0].pieces[0], &kinds[1].pieces[0]], None);
    }

    #[inline(always)]
    fn look<V: Wide>(&self, points: &mut Points, search: Search, setup: &Setup) {
        let mut pairs = self.pairs.load::<V>(setup);
        let [a, b] = &self.outlines;
        pairs.radius = [a.radii(), b.radii()];
        let most = a.most_corners().max(b.most_corners());
        points.look(&pairs, &Polygons([a.polygon(most), b.polygon(most)]), search, setup);
    }
}

impl WidePieces for WidePolygons {
    #[inline(always)]
    fn pairs(&mut self) -> &mut WidePairs {
        &mut self.pairs
    }

    #[inline(always)]
    fn set_pieces(&mut self, lane: usize, pieces: [&Piece; 2], _: Lies) {
        self.outlines.iter_mut().zip(pieces).for_each(|(outlines, piece)| outlines.set(lane, piece));
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
            least = Self::lesser(&least, &Self { distance, normal: normal.opposite(), on_first: point, feature });
        }
        least
    }
}

/// Both pieces of sixteen pairs, in the frames of their bodies.
struct Polygons<V>([Polygon<V>; 2]);

impl<V: Wide> Shapes<V> for Polygons<V> {
    #[inline(always)]
    fn manifolds(&self, pairs: &Pairs<V>, offset: Vectors<V>, turning: [Vectors<V>; 2], reach: V) -> Manifolds<V> {
        let (one, zero, half) = (V::splat(1.0), V::splat(0.0), V::splat(0.5));
        let rotation = [turning[0].rotate(pairs.rotation[0]), turning[1].rotate(pairs.rotation[1])];
        let a = &self.0[0];
        let most = a.most.max(self.0[1].most);
        let b = &self.0[1].seen(rotation[0].to(rotation[1]), rotation[0].unrotate(offset), most);
        let rounding = pairs.radius[0].add(pairs.radius[1]);
        let (face_a, face_b) = (a.separate(b), b.separate(a));
        let beyond = less(reach, face_a.figure.sub(rounding)).max(less(reach, face_b.figure.sub(rounding)));
        let are_equal = less(face_a.normal.dot(face_b.normal), V::splat(-EQUAL));
        let preference = are_equal.if_positive(V::splat(PREFERENCE).mul(pairs.scale()), zero);
        let from_b = less(face_a.figure.add(preference), face_b.figure);
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
        let [from, to] = reference.ends;
        let clipped = clip(reference.ends, n, edge.ends, [radius, other_radius]);
        let mut at = Manifolds {
            some: beyond.if_positive(zero, one),
            two: clipped.two.mul(clipped.none.if_positive(zero, one)),
            tells: zero,
            normal: n,
            anchor: clipped.anchor,
            separation: clipped.separation,
            feature: [features.add(first), features.add(one.sub(first))],
        };
        // An end of a line has no width: those that overlap part there nevertheless.
        let widest = face_a.figure.max(face_b.figure);
        let is_end = clipped.none.mul(widest.if_positive(zero, one));
        let apart_at_corners = clipped.none.mul(widest.if_positive(one, zero)).mul(at.some);
        let slants = edge.ends[1].minus(edge.ends[0]).dot(n);
        let deepest = Vectors::pick(zero.sub(slants), edge.ends[1], edge.ends[0]);
        let apart = absolute(from.x.sub(to.x)).max(absolute(from.y.sub(to.y)));
        let on_face = Vectors::pick(apart, deepest.minus(n.scaled(height)), from);
        let separation = height.sub(radius).sub(other_radius);
        let anchor = on_face.plus(n.scaled(radius.add(half.mul(separation))));
        at.separation[0] = is_end.if_positive(separation, at.separation[0]);
        at.anchor[0] = Vectors::pick(is_end, anchor, at.anchor[0]);
        let mut normal = Vectors::pick(from_b, n.opposite(), n);
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
