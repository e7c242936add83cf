//! Where and when the boxes of sixteen pairs touch within the step: what `touch.rs` and `manifold/box_box.rs` do for one pair, in
//! the same words and with the same bits.
//!
//! Where speeds overflow, it says so, and leaves the pair to those.

use super::cull::passes;
use super::manifold::box_box::PREFERENCE;
use super::touch::{DEEP, NEAR, ROUNDS};
use super::wide_pairs::{Outlook, Pairs, TOUCHING, WidePairs};
use super::wide_touches::both;
use crate::model::contact::{Contact, ContactPoint};
use crate::model::math::Rot;
use crate::parallel::lanes::{Quad, WIDE, Wide, WideRow};
use crate::parallel::vectors::{Vectors, absolute, less};
use crate::tiling::blueprint::Setup;
use glam::Vec2;

/// Manifolds of up to two points, and the moments in which they are those. What is asked of them is one, or else zero.
#[derive(Clone, Copy)]
struct Moments<V> {
    /// From now, in s.
    time: V,
    /// At that time: from the center of A to that of B, and how both have turned.
    offset: Vectors<V>,
    turning: [Vectors<V>; 2],
    /// Whether there is a point, and whether there is a second.
    some: V,
    two: V,
    normal: Vectors<V>,
    anchor: [Vectors<V>; 2],
    separation: [V; 2],
    feature: [V; 2],
}

/// What comes of sixteen pairs of boxes.
#[derive(Default, Debug)]
pub(super) struct BoxOutlook {
    /// Positive if that cannot be told here.
    unsure: WideRow,
    /// Positive if a contact has this point.
    holds: [WideRow; 2],
    feature: [WideRow; 2],
    /// Normal and offset, both rotations, of a [`Contact`]; anchor, separation there and now of its points.
    frames: [Quad; WIDE],
    rotations: [Quad; WIDE],
    points: [[Quad; WIDE]; 2],
}

/// With the sign that it has not.
#[inline(always)]
fn negated<V: Wide>(x: V) -> V {
    V::splat(-0.0).sub(x)
}

#[inline(always)]
fn opposite<V: Wide>(v: Vectors<V>) -> Vectors<V> {
    Vectors::new(negated(v.x), negated(v.y))
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
fn nearest<V: Wide>(corner: Vectors<V>, ends: [Vectors<V>; 2]) -> (Vectors<V>, V) {
    let edge = ends[1].minus(ends[0]);
    let part = corner.minus(ends[0]).dot(edge).div(edge.dot(edge)).max(V::splat(0.0)).min(V::splat(1.0));
    (ends[0].plus(edge.scaled(part)).minus(corner), part)
}

impl<V: Wide> Moments<V> {
    /// `yes` where a number is positive, else `no`.
    #[inline(always)]
    fn pick(positive: V, yes: &Self, no: &Self) -> Self {
        Self {
            time: positive.if_positive(yes.time, no.time),
            offset: Vectors::pick(positive, yes.offset, no.offset),
            turning: both(positive, &yes.turning, &no.turning),
            some: positive.if_positive(yes.some, no.some),
            two: positive.if_positive(yes.two, no.two),
            normal: Vectors::pick(positive, yes.normal, no.normal),
            anchor: both(positive, &yes.anchor, &no.anchor),
            separation: [
                positive.if_positive(yes.separation[0], no.separation[0]),
                positive.if_positive(yes.separation[1], no.separation[1]),
            ],
            feature: [
                positive.if_positive(yes.feature[0], no.feature[0]),
                positive.if_positive(yes.feature[1], no.feature[1]),
            ],
        }
    }

    /// Anchor and separation of the point with the least.
    #[inline(always)]
    fn nearest(&self) -> (Vectors<V>, V) {
        let second = self.two.mul(less(self.separation[1], self.separation[0]));
        let anchor = Vectors::pick(second, self.anchor[1], self.anchor[0]);
        (anchor, second.if_positive(self.separation[1], self.separation[0]))
    }
}

impl Outlook for BoxOutlook {
    #[inline(always)]
    fn look<V: Wide>(&mut self, pairs: &WidePairs, setup: &Setup) {
        let (one, zero) = (V::splat(1.0), V::splat(0.0));
        let (both, fixed) = (pairs.load::<V>(setup), V::load(&pairs.fixed));
        let (dt, speculative) = (both.dt, V::splat(setup.params.speculative_distance));
        let far = both.far();
        let reach = speculative.add(far);
        let identity = Vectors::new(one, zero);
        let now = both.boxes(zero, both.offset, [identity; 2], reach);
        let (_, separation) = now.nearest();
        let is_slow = less(far, speculative);
        let is_now = less(separation, V::splat(NEAR)).max(less(separation, V::splat(TOUCHING)).mul(is_slow));
        let passes = passes(both.offset, both.between, both.bound[0].add(both.bound[1]), setup);
        let asked = passes.if_positive(zero, now.some);
        let later = is_now.if_positive(zero, asked);
        let mut at = now;
        let mut meets = is_now.max(less(separation, speculative));
        if later.any_positive() {
            let (then, found) = both.boxes_touch(&now, later, reach);
            at = Moments::pick(found, &then, &now);
            meets = meets.max(found);
        }
        meets = meets.mul(asked).mul(at.some);
        let moved = both.between.dot(at.normal).mul(at.time);
        for point in 0..2 {
            let (anchor, separation) = (at.anchor[point], at.separation[point]);
            let closing = both.closing(anchor, at.offset, at.normal).max(zero);
            let ahead = fixed.if_positive(dt.sub(at.time).mul(closing), zero);
            let there = if point == 0 { meets } else { meets.mul(at.two) };
            less(separation, speculative.add(ahead)).mul(there).store(&mut self.holds[point]);
            let on_a = both.swing(0, at.turning[0], anchor, at.normal);
            let on_b = both.swing(1, at.turning[1], anchor.minus(at.offset), at.normal);
            let before = separation.sub(moved.add(on_b.sub(on_a)));
            let now = at.time.if_positive(before, separation);
            V::store_quads([anchor.x, anchor.y, separation, now], &mut self.points[point]);
            at.feature[point].store(&mut self.feature[point]);
        }
        // Speeds that overflow tell of no other moment.
        less(far, V::splat(0.125 * f32::MAX)).if_positive(zero, one).store(&mut self.unsure);
        let [a, b] = [at.turning[0].rotate(both.rotation[0]), at.turning[1].rotate(both.rotation[1])];
        V::store_quads([at.normal.x, at.normal.y, at.offset.x, at.offset.y], &mut self.frames);
        V::store_quads([a.x, a.y, b.x, b.y], &mut self.rotations);
    }

    #[inline(always)]
    fn is_unsure(&self, lane: usize) -> bool {
        self.unsure[lane] > 0.0
    }

    #[inline(always)]
    fn meets(&self, lane: usize) -> bool {
        self.holds[0][lane] + self.holds[1][lane] > 0.0
    }

    #[inline(always)]
    fn contact(&self, lane: usize, known: Option<&Contact>) -> (Contact, [f32; 2]) {
        let ([nx, ny, x, y], [ca, sa, cb, sb]) = (self.frames[lane], self.rotations[lane]);
        // Of two points it may be the second alone that holds.
        let first = usize::from(self.holds[0][lane] == 0.0);
        let (mut contact, mut now) = (
            Contact {
                normal: Vec2::new(nx, ny),
                offset: Vec2::new(x, y),
                rotation_a: Rot { c: ca, s: sa },
                rotation_b: Rot { c: cb, s: sb },
                points: [self.point(lane, first, known), ContactPoint::NONE],
            },
            [self.points[first][lane][3], 0.0],
        );
        if first == 0 && self.holds[1][lane] > 0.0 {
            contact.points[1] = self.point(lane, 1, known);
            now[1] = self.points[1][lane][3];
        }
        (contact, now)
    }
}

impl<V: Wide> Pairs<V> {
    /// What will be of boxes after some seconds if nothing else happens.
    #[inline(always)]
    fn boxes_at(&self, time: V, reach: V) -> Moments<V> {
        let (offset, turning) = self.moved(time);
        self.boxes(time, offset, turning, reach)
    }

    /// As in `manifold/box_box.rs`.
    #[inline(always)]
    fn boxes(&self, time: V, offset: Vectors<V>, turning: [Vectors<V>; 2], reach: V) -> Moments<V> {
        let (one, zero, half) = (V::splat(1.0), V::splat(0.0), V::splat(0.5));
        let rotation = [turning[0].rotate(self.rotation[0]), turning[1].rotate(self.rotation[1])];
        let turn = rotation[0].to(rotation[1]);
        let (in_a, in_b) = (rotation[0].unrotate(offset), rotation[1].unrotate(offset));
        let along_a = separations(self.half[0], self.half[1], turn, in_a);
        let along_b = separations(self.half[1], self.half[0], turn, in_b);
        let (most_a, most_b) = (along_a.x.max(along_a.y), along_b.x.max(along_b.y));
        let beyond = less(reach, most_a).max(less(reach, most_b));
        // The reference box, at the origin and unturned, and the incident box.
        let from_b = less(most_a.add(V::splat(PREFERENCE)), most_b);
        let reference = Vectors::pick(from_b, self.half[1], self.half[0]);
        let incident = Vectors::pick(from_b, self.half[0], self.half[1]);
        let turn = Vectors::new(turn.x, from_b.if_positive(negated(turn.y), turn.y));
        let center = Vectors::pick(from_b, opposite(in_b), in_a);
        let along = Vectors::pick(from_b, along_b, along_a);
        // The reference face, and a frame of normal `n` and tangent `t`, both along the axes.
        let by_x = less(along.y, along.x);
        let side = sign(by_x.if_positive(center.x, center.y));
        let n = Vectors::new(by_x.if_positive(side, zero), by_x.if_positive(zero, side));
        let t = Vectors::new(by_x.if_positive(zero, negated(side)), by_x.if_positive(side, zero));
        let height = by_x.if_positive(reference.x, reference.y);
        let width = by_x.if_positive(reference.y, reference.x);
        let face = by_x.if_positive(zero, V::splat(16.0)).add(side.if_positive(zero, V::splat(8.0)));
        // The incident edge: of the face that looks most against `n`, its ends in the order of `t`.
        let seen = turn.unrotate(n);
        let by_x = less(absolute(seen.y), absolute(seen.x));
        let side = negated(sign(by_x.if_positive(seen.x, seen.y)));
        let middle =
            Vectors::new(by_x.if_positive(side.mul(incident.x), zero), by_x.if_positive(zero, side.mul(incident.y)));
        let edge = Vectors::new(
            by_x.if_positive(zero, negated(side).mul(incident.x)),
            by_x.if_positive(side.mul(incident.y), zero),
        );
        let face = face.add(by_x.if_positive(zero, V::splat(4.0))).add(side.if_positive(zero, V::splat(2.0)));
        let features = face.add(from_b.if_positive(V::splat(32.0), zero));
        let (middle, edge) = (center.plus(turn.rotate(middle)), turn.rotate(edge));
        let ends = [middle.plus(edge), middle.minus(edge)];
        let place = [ends[0].dot(t), ends[1].dot(t)];
        let rise = [ends[0].dot(n).sub(height), ends[1].dot(n).sub(height)];
        // Where no face opposes the edge it is the corner that counts, on one side or the other.
        let high = less(width, place[0]);
        let corner = high.max(less(place[1], negated(width)));
        // The edge clipped to the width of the face.
        let span = place[1].sub(place[0]);
        let slope = span.if_positive(rise[1].sub(rise[0]).div(span), zero);
        let mut at = Moments {
            time,
            offset,
            turning,
            some: beyond.if_positive(zero, one),
            two: corner.if_positive(zero, one),
            normal: n,
            anchor: [offset; 2],
            separation: [zero; 2],
            feature: [features, features.add(one)],
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
        let second = less(part, half).if_positive(zero, one);
        at.feature[0] = corner.if_positive(features.add(second), features);
        // Back to the frame of the world, and of body A.
        let back = Vectors::pick(from_b, rotation[1], rotation[0]);
        let normal = back.rotate(at.normal);
        at.normal = Vectors::pick(from_b, opposite(normal), normal);
        for anchor in &mut at.anchor {
            let from_center = back.rotate(*anchor);
            *anchor = Vectors::pick(from_b, offset.plus(from_center), from_center);
        }
        at
    }

    /// The moments in which those pairs of whom it is asked, apart now, touch, and for whom that is within the step.
    #[inline(always)]
    fn boxes_touch(&self, now: &Moments<V>, asked: V, reach: V) -> (Moments<V>, V) {
        let (zero, dt) = (V::splat(0.0), self.dt);
        let sweep = self.sweep(0).add(self.sweep(1));
        let (mut at, mut going, mut ending, mut found) = (*now, asked, zero, zero);
        for _ in 0..ROUNDS {
            let (anchor, separation) = at.nearest();
            // What is apart along a direction stays so for as long as nothing moves further along it.
            let bound = negated(self.between.dot(at.normal)).add(sweep);
            let left = dt.sub(at.time);
            going = less(bound.mul(left), separation).if_positive(zero, going);
            if !going.any_positive() {
                break;
            }
            // Half as if the fastest corner led, half as if the nearest point did.
            let closing = self.closing(anchor, at.offset, at.normal).max(zero);
            let speed = V::splat(0.5).mul(bound.add(closing));
            let next = self.boxes_at(at.time.add(separation.div(speed).min(left)), reach);
            at = Moments::pick(going, &next, &at);
            going = going.mul(at.some);
            let (_, separation) = at.nearest();
            let deep = less(separation, V::splat(DEEP)).mul(going);
            let near = less(separation, V::splat(NEAR)).mul(going);
            ending = ending.max(deep);
            found = found.max(deep.if_positive(zero, near));
            going = near.max(deep).if_positive(zero, going);
        }
        ending = ending.max(going);
        let (anchor, separation) = at.nearest();
        let closing = self.closing(anchor, at.offset, at.normal);
        let closes = less(zero, closing).mul(ending);
        let time = at.time.add(separation.div(closing));
        let exact = less(dt, time).if_positive(zero, closes);
        found = found.max(closes.if_positive(zero, ending));
        if exact.any_positive() {
            let then = self.boxes_at(time.max(zero), reach);
            at = Moments::pick(exact, &then, &at);
            found = found.max(exact.mul(then.some));
        }
        (at, found)
    }
}

impl BoxOutlook {
    #[inline(always)]
    fn point(&self, lane: usize, point: usize, known: Option<&Contact>) -> ContactPoint {
        let [x, y, separation, _] = self.points[point][lane];
        let feature = self.feature[point][lane] as u32;
        let old = known.and_then(|known| known.points().iter().find(|old| old.feature == feature));
        let (normal_impulse, tangent_impulse) = old.map_or((0.0, 0.0), |old| (old.normal_impulse, old.tangent_impulse));
        ContactPoint { anchor: Vec2::new(x, y), separation, normal_impulse, tangent_impulse, feature }
    }
}
