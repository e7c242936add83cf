//! The boxes of sixteen pairs: what `manifold/box_box.rs` does for two, in the same words and with the same bits.

use super::manifolds::Manifolds;
use super::moments::{Points, Search, Shaped, Shapes};
use super::pairs::{Pairs, WidePairs};
use crate::collide::broad_phase::Pair;
use crate::collide::manifold::box_box::{EQUAL, PREFERENCE};
use crate::model::contact::Contact;
use crate::parallel::lanes::Wide;
use crate::parallel::vectors::{Vectors, absolute, less, negated};
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// Sixteen pairs of boxes.
#[derive(Default, Debug)]
pub(in crate::collide) struct WideBoxes(WidePairs);

impl Shaped for WideBoxes {
    #[inline(always)]
    fn set(&mut self, lane: usize, tile: &Tile, bodies: Pair, known: Option<&Contact>, setup: &Setup) {
        self.0.set(lane, tile, bodies, known, setup);
    }

    #[inline(always)]
    fn look<V: Wide>(&self, points: &mut Points, search: Search, setup: &Setup) {
        points.look(&self.0.load::<V>(setup), &Boxes, search, setup);
    }
}

/// Minus one for what is less than zero, else one.
#[inline(always)]
fn sign<V: Wide>(x: V) -> V {
    negated(x).if_positive(V::splat(-1.0), V::splat(1.0))
}

/// Separations of two boxes along the axes of the first; `offset` in its frame, `turn` from its frame to the other's.
#[inline(always)]
fn separations<V: Wide>(half: Vectors<V>, other: Vectors<V>, turn: Vectors<V>, offset: Vectors<V>) -> Vectors<V> {
    let (c, s) = (absolute(turn.x), absolute(turn.y));
    let reach = Vectors::new(c.mul(other.x).add(s.mul(other.y)), s.mul(other.x).add(c.mul(other.y)));
    Vectors::new(absolute(offset.x), absolute(offset.y)).minus(half).minus(reach)
}

/// From a corner to the nearest point of an edge, and where on the edge that lies: 0 to 1.
#[inline(always)]
pub(super) fn nearest<V: Wide>(corner: Vectors<V>, ends: [Vectors<V>; 2]) -> (Vectors<V>, V) {
    let edge = ends[1].minus(ends[0]);
    let part = corner.minus(ends[0]).dot(edge).div(edge.dot(edge)).max(V::splat(0.0)).min(V::splat(1.0));
    (ends[0].plus(edge.scaled(part)).minus(corner), part)
}

/// Boxes, of half extents that pairs tell.
struct Boxes;

impl<V: Wide> Shapes<V> for Boxes {
    #[inline(always)]
    fn manifolds(&self, pairs: &Pairs<V>, offset: Vectors<V>, turning: [Vectors<V>; 2], reach: V) -> Manifolds<V> {
        let (one, zero, half) = (V::splat(1.0), V::splat(0.0), V::splat(0.5));
        let rotation = [turning[0].rotate(pairs.rotation[0]), turning[1].rotate(pairs.rotation[1])];
        let turn = rotation[0].to(rotation[1]);
        let (in_a, in_b) = (rotation[0].unrotate(offset), rotation[1].unrotate(offset));
        let along_a = separations(pairs.half[0], pairs.half[1], turn, in_a);
        let along_b = separations(pairs.half[1], pairs.half[0], turn, in_b);
        let (most_a, most_b) = (along_a.x.max(along_a.y), along_b.x.max(along_b.y));
        let beyond = less(reach, most_a).max(less(reach, most_b));
        // The reference box, at the origin and unturned, and the incident box.
        let [of_x_a, of_x_b] = [less(along_a.y, along_a.x), less(along_b.y, along_b.x)];
        let are_of_one_axis = of_x_a.if_positive(of_x_b, one.sub(of_x_b));
        let cosine = are_of_one_axis.if_positive(absolute(turn.x), absolute(turn.y));
        let preference = less(V::splat(EQUAL), cosine).if_positive(V::splat(PREFERENCE).mul(pairs.scale()), zero);
        let from_b = less(most_a.add(preference), most_b);
        let reference = Vectors::pick(from_b, pairs.half[1], pairs.half[0]);
        let incident = Vectors::pick(from_b, pairs.half[0], pairs.half[1]);
        let turn = Vectors::new(turn.x, from_b.if_positive(negated(turn.y), turn.y));
        let center = Vectors::pick(from_b, in_b.opposite(), in_a);
        let along = Vectors::pick(from_b, along_b, along_a);
        // The reference face, and a frame of normal `n` and tangent `t`, both along the axes.
        let by_x = less(along.y, along.x);
        let side = sign(by_x.if_positive(center.x, center.y));
        let n = Vectors::new(by_x.if_positive(side, zero), by_x.if_positive(zero, side));
        let t = Vectors::new(by_x.if_positive(zero, negated(side)), by_x.if_positive(side, zero));
        let height = by_x.if_positive(reference.x, reference.y);
        let width = by_x.if_positive(reference.y, reference.x);
        let face = by_x.if_positive(zero, V::splat(2.0)).add(side.if_positive(zero, one));
        // The incident edge: of the face that looks most against `n`, its ends in the order of `t`.
        let seen = turn.unrotate(n);
        let by_x = less(absolute(seen.y), absolute(seen.x));
        let side = negated(sign(by_x.if_positive(seen.x, seen.y)));
        let middle =
            Vectors::new(by_x.if_positive(side.mul(incident.x), zero), by_x.if_positive(zero, side.mul(incident.y)));
        let along_edge = Vectors::new(
            by_x.if_positive(zero, negated(side).mul(incident.x)),
            by_x.if_positive(side.mul(incident.y), zero),
        );
        let edge = by_x.if_positive(zero, V::splat(2.0)).add(side.if_positive(zero, one));
        let [of_a, of_b] = [from_b.if_positive(edge, face), from_b.if_positive(face, edge)];
        let features = of_a.mul(V::splat(8.0)).add(of_b.mul(V::splat(2.0)));
        let first = from_b.if_positive(one, zero);
        let (middle, along_edge) = (center.plus(turn.rotate(middle)), turn.rotate(along_edge));
        let ends = [middle.plus(along_edge), middle.minus(along_edge)];
        let place = [ends[0].dot(t), ends[1].dot(t)];
        let rise = [ends[0].dot(n).sub(height), ends[1].dot(n).sub(height)];
        // Where no face opposes the edge it is the corner that counts, on one side or the other.
        let high = less(width, place[0]);
        let corner = high.max(less(place[1], negated(width)));
        // The edge clipped to the width of the face.
        let span = place[1].sub(place[0]);
        let slope = span.if_positive(rise[1].sub(rise[0]).div(span), zero);
        let mut at = Manifolds {
            some: beyond.if_positive(zero, one),
            two: corner.if_positive(zero, one),
            tells: zero,
            normal: n,
            anchor: [offset; 2],
            separation: [zero; 2],
            feature: [features.add(first), features.add(one.sub(first))],
        };
        let (mut clipped, mut gaps, mut parts, mut distances) = ([zero; 2], [offset; 2], [zero; 2], [zero; 2]);
        for end in 0..2 {
            clipped[end] = place[end].max(negated(width)).min(width);
            let shift = clipped[end].sub(place[end]);
            let separation = rise[end].add(slope.mul(shift));
            // Around a corner a slanted edge is nearer than straight up from the face.
            (gaps[end], parts[end]) = nearest(n.scaled(height).plus(t.scaled(clipped[end])), ends);
            distances[end] = gaps[end].dot(gaps[end]).sqrt();
            let around = absolute(shift).if_positive(separation, zero);
            let separation = around.if_positive(distances[end].min(separation), separation);
            at.separation[end] = separation;
            at.anchor[end] = t.scaled(clipped[end]).plus(n.scaled(height.add(half.mul(separation))));
        }
        let point = n.scaled(height).plus(t.scaled(high.if_positive(clipped[0], clipped[1])));
        let gap = Vectors::pick(high, gaps[0], gaps[1]);
        let distance = high.if_positive(distances[0], distances[1]);
        let away = Vectors::pick(distance, Vectors::new(gap.x.div(distance), gap.y.div(distance)), n);
        let part = high.if_positive(parts[0], parts[1]);
        at.normal = Vectors::pick(corner, away, n);
        at.anchor[0] = Vectors::pick(corner, point.plus(gap.scaled(half)), at.anchor[0]);
        at.separation[0] = corner.if_positive(distance, at.separation[0]);
        let end = less(part, half).if_positive(first, one.sub(first));
        at.feature[0] = corner.if_positive(features.add(end), at.feature[0]);
        // Back to the frame of the world, and of body A.
        let back = Vectors::pick(from_b, rotation[1], rotation[0]);
        let normal = back.rotate(at.normal);
        at.normal = Vectors::pick(from_b, normal.opposite(), normal);
        for anchor in &mut at.anchor {
            let from_center = back.rotate(*anchor);
            *anchor = Vectors::pick(from_b, offset.plus(from_center), from_center);
        }
        at
    }
}
