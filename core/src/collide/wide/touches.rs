//! Where and when the bodies of sixteen pairs touch within the step, at least one of each pair being round: what `touch.rs` does
//! for one pair of any bodies, in the same words and with the same bits.
//!
//! Where a center lies in a core, or speeds overflow, it says so, and leaves the pair to that.

use super::pairs::Pairs;
use crate::collide::cull::passes;
use crate::collide::touch::{Course, DEEP, NEAR, ROUNDS, TOUCHING};
use crate::parallel::lanes::Wide;
use crate::parallel::vectors::{Vectors, less, tangent};
use crate::tiling::blueprint::Setup;

/// Manifolds of one point, and the moments in which they are those.
#[derive(Clone, Copy)]
struct RoundMoments<V> {
    /// From now, in s.
    time: V,
    normal: Vectors<V>,
    anchor: Vectors<V>,
    separation: V,
    /// At that time: from the center of A to that of B, how both have turned, and their rotations.
    offset: Vectors<V>,
    turning: [Vectors<V>; 2],
    rotation: [Vectors<V>; 2],
    /// Distance of the center of the round body from the other's core. None within it is known.
    distance: V,
}

/// What comes of sixteen pairs.
#[derive(Clone, Copy)]
pub(super) struct Touches<V> {
    /// Positive if they make a contact.
    pub(super) meets: V,
    /// Positive if that cannot be told here.
    pub(super) unsure: V,
    pub(super) normal: Vectors<V>,
    pub(super) offset: Vectors<V>,
    pub(super) rotation: [Vectors<V>; 2],
    pub(super) anchor: Vectors<V>,
    /// Of the contact, and as it is now.
    pub(super) separation: V,
    pub(super) now: V,
}

impl<V: Wide> RoundMoments<V> {
    /// `yes` where a number is positive, else `no`.
    #[inline(always)]
    fn pick(positive: V, yes: &Self, no: &Self) -> Self {
        Self {
            time: positive.if_positive(yes.time, no.time),
            normal: Vectors::pick(positive, yes.normal, no.normal),
            anchor: Vectors::pick(positive, yes.anchor, no.anchor),
            separation: positive.if_positive(yes.separation, no.separation),
            offset: Vectors::pick(positive, yes.offset, no.offset),
            turning: Vectors::pick_both(positive, &yes.turning, &no.turning),
            rotation: Vectors::pick_both(positive, &yes.rotation, &no.rotation),
            // One that was not known is not forgotten.
            distance: positive.if_positive(yes.distance.min(no.distance), no.distance),
        }
    }
}

impl<V: Wide> Touches<V> {
    /// No contacts.
    #[inline(always)]
    pub(super) fn none() -> Self {
        let (zero, none) = (V::splat(0.0), Vectors::new(V::splat(0.0), V::splat(0.0)));
        Self {
            meets: zero,
            unsure: zero,
            normal: none,
            offset: none,
            rotation: [none; 2],
            anchor: none,
            separation: zero,
            now: zero,
        }
    }

    /// `yes` where a number is positive, else `no`.
    #[inline(always)]
    pub(super) fn pick(positive: V, yes: &Self, no: &Self) -> Self {
        Self {
            meets: positive.if_positive(yes.meets, no.meets),
            unsure: positive.if_positive(yes.unsure, no.unsure),
            normal: Vectors::pick(positive, yes.normal, no.normal),
            offset: Vectors::pick(positive, yes.offset, no.offset),
            rotation: Vectors::pick_both(positive, &yes.rotation, &no.rotation),
            anchor: Vectors::pick(positive, yes.anchor, no.anchor),
            separation: positive.if_positive(yes.separation, no.separation),
            now: positive.if_positive(yes.now, no.now),
        }
    }
}

impl<V: Wide> Pairs<V> {
    /// One for a body that is not round.
    #[inline(always)]
    fn not_round(&self, side: usize) -> V {
        self.half[side].x.if_positive(V::splat(1.0), V::splat(0.0))
    }

    /// How a body will have turned after some seconds.
    #[inline(always)]
    fn turned_after(&self, side: usize, time: V) -> Vectors<V> {
        let one = V::splat(1.0);
        let angle = V::splat(0.25).mul(time).mul(self.spin[side]).max(V::splat(-1.0)).min(one);
        let quarter = Vectors::new(one, tangent(angle));
        let quarter = quarter.scaled(one.div(quarter.dot(quarter).sqrt()));
        let half = quarter.rotate(quarter);
        let identity = Vectors::new(one, V::splat(0.0));
        Vectors::pick(self.half[side].x, half.rotate(half), identity)
    }

    /// What will be after some seconds if nothing else happens.
    #[inline(always)]
    fn at(&self, time: V) -> RoundMoments<V> {
        let (offset, turning) = self.moved(time);
        self.manifolds(time, offset, turning)
    }

    /// From the center of A to that of B, and how both will have turned, after some seconds.
    #[inline(always)]
    pub(super) fn moved(&self, time: V) -> (Vectors<V>, [Vectors<V>; 2]) {
        let identity = Vectors::new(V::splat(1.0), V::splat(0.0));
        let offset = Vectors::pick(time, self.offset.plus(self.between.scaled(time)), self.offset);
        let turning = [
            Vectors::pick(time, self.turned_after(0, time), identity),
            Vectors::pick(time, self.turned_after(1, time), identity),
        ];
        (offset, turning)
    }

    #[inline(always)]
    fn now(&self) -> RoundMoments<V> {
        let identity = Vectors::new(V::splat(1.0), V::splat(0.0));
        self.manifolds(V::splat(0.0), self.offset, [identity; 2])
    }

    /// As in `manifold/round.rs`.
    #[inline(always)]
    fn manifolds(&self, time: V, offset: Vectors<V>, turning: [Vectors<V>; 2]) -> RoundMoments<V> {
        let (one, zero) = (V::splat(1.0), V::splat(0.0));
        let rotations = [turning[0].rotate(self.rotation[0]), turning[1].rotate(self.rotation[1])];
        let core = self.half[0].x;
        let (half, rotation) = (self.core_of(self.half), self.core_of(rotations));
        let way = core.if_positive(one, zero.sub(one));
        let rounding = self.radius[0].add(self.radius[1]);
        let center = rotation.back().rotate(offset.scaled(way));
        let inside = half.hold(center);
        let away = center.minus(inside);
        let distance = away.dot(away).sqrt();
        let normal = away.scaled(one.div(distance));
        let separation = distance.sub(rounding);
        let surface = center.minus(normal.scaled(distance));
        let core_radius = core.if_positive(self.radius[0], self.radius[1]);
        let out = core_radius.add(V::splat(0.5).mul(separation));
        let anchor = rotation.rotate(surface.plus(normal.scaled(out)));
        let from = offset.scaled(one.sub(self.not_round(0)));
        RoundMoments {
            time,
            normal: rotation.rotate(normal).scaled(way),
            anchor: from.plus(anchor),
            separation,
            offset,
            turning,
            rotation: rotations,
            distance,
        }
    }

    /// Speed at which the surfaces come nearer at some points.
    #[inline(always)]
    pub(super) fn closing(&self, anchor: Vectors<V>, offset: Vectors<V>, normal: Vectors<V>) -> V {
        let zero = V::splat(0.0);
        let turn = [self.spin[0], self.spin[1]];
        let (arm_a, arm_b) = (anchor, anchor.minus(offset));
        let velocity_a = Vectors::new(zero.sub(turn[0]).mul(arm_a.y), turn[0].mul(arm_a.x));
        let velocity_b = Vectors::new(zero.sub(turn[1]).mul(arm_b.y), turn[1].mul(arm_b.x));
        zero.sub(self.between.plus(velocity_b).minus(velocity_a).dot(normal))
    }

    /// How far a body's surface, at a point, comes along a normal as it turns so.
    #[inline(always)]
    pub(super) fn swing(&self, side: usize, turning: Vectors<V>, arm: Vectors<V>, normal: Vectors<V>) -> V {
        let way = turning.x.sub(V::splat(1.0)).mul(arm.dot(normal)).add(turning.y.mul(arm.cross(normal)));
        self.not_round(side).mul(way)
    }

    /// How far the surfaces, at a point with such a separation, come apart along a normal as both bodies turn so: each one's own surface
    /// turns with it.
    #[inline(always)]
    pub(super) fn swing_apart(
        &self,
        turning: [Vectors<V>; 2],
        offset: Vectors<V>,
        normal: Vectors<V>,
        anchor: Vectors<V>,
        separation: V,
    ) -> V {
        let out = normal.scaled(V::splat(0.5).mul(separation.max(V::splat(0.0))));
        let on_a = self.swing(0, turning[0], anchor.minus(out), normal);
        let on_b = self.swing(1, turning[1], anchor.plus(out).minus(offset), normal);
        on_b.sub(on_a)
    }

    /// Within so many seconds a touch is looked for: of those that are near a substep beyond the step, as in `touch.rs`.
    #[inline(always)]
    pub(super) fn ahead(&self, near: V, setup: &Setup) -> V {
        near.if_positive(self.dt.add(V::splat(setup.h)), self.dt)
    }

    /// The contacts of all pairs.
    #[inline(always)]
    pub(super) fn touch(&self, setup: &Setup) -> Touches<V> {
        let (one, zero, dt) = (V::splat(1.0), V::splat(0.0), self.dt);
        let speculative = V::splat(setup.params.speculative_distance);
        let now = self.now();
        let far = self.far();
        let nearest = now.separation;
        let is_slow = less(far, speculative);
        let scale = self.scale();
        let touching = less(nearest, scale.mul(V::splat(TOUCHING))).mul(is_slow).mul(self.pressed);
        let searched = scale.mul(V::splat(NEAR));
        let searched = less(self.sweep(0).add(self.sweep(1)).mul(dt), searched).if_positive(zero, searched);
        let is_now = less(nearest, searched).max(touching);
        // Who passes by, who may touch later, and who is near anyway.
        let passes = passes(self.offset, self.between, self.bound[0].add(self.bound[1]), setup);
        let later = is_now.max(passes).if_positive(zero, one);
        let mut at = now;
        let near = less(nearest, speculative);
        let mut meets = is_now.max(near);
        if later.any_positive() {
            let found;
            (at, found) = self.first_touch(&now, later, near, setup);
            meets = meets.max(found);
        }
        let closing = self.closing(at.anchor, at.offset, at.normal).max(zero);
        let ahead = self.fixed.if_positive(dt.sub(at.time).max(zero).mul(closing), zero);
        let holds = less(at.separation, speculative.add(ahead));
        let moved = self.between.dot(at.normal).mul(at.time);
        let swung = self.swing_apart(at.turning, at.offset, at.normal, at.anchor, at.separation);
        let before = at.separation.sub(moved.add(swung));
        // Where there is no distance, or speeds overflow.
        let is_sure = at.distance.min(less(far, V::splat(f32::MAX)));
        Touches {
            meets: passes.if_positive(zero, meets.mul(holds)),
            unsure: is_sure.if_positive(zero, one),
            normal: at.normal,
            offset: at.offset,
            rotation: at.rotation,
            anchor: at.anchor,
            separation: at.separation,
            now: at.time.if_positive(before, at.separation),
        }
    }

    /// The ways of the round ones, seen from the others.
    #[inline(always)]
    fn course(&self) -> Course<V> {
        let (one, back) = (V::splat(1.0), self.core_of(self.rotation).back());
        let way = self.half[0].x.if_positive(one, V::splat(0.0).sub(one));
        Course {
            center: back.rotate(self.offset.scaled(way)),
            velocity: back.rotate(self.between.scaled(way)),
            half: self.core_of(self.half),
            radius: self.radius[0].add(self.radius[1]),
        }
    }

    /// The moments in which those pairs of whom it is asked, apart now, touch, and for whom that is within the time that is looked
    /// [`ahead`](Self::ahead); for the others the last that was looked at, or of circles, and of those that hardly turn, about that in
    /// which they are nearest.
    #[inline(always)]
    fn first_touch(&self, now: &RoundMoments<V>, asked: V, near: V, setup: &Setup) -> (RoundMoments<V>, V) {
        let (one, zero, dt) = (V::splat(1.0), V::splat(0.0), self.ahead(near, setup));
        let mixed = self.not_round(0).max(self.not_round(1)).mul(asked);
        // Two circles touch where the square of their centers' distance has come down to that of their radii's sum.
        let sum = self.bound[0].add(self.bound[1]);
        let square = self.between.dot(self.between);
        let half = zero.sub(self.offset.dot(self.between));
        let rest = self.offset.dot(self.offset).sub(sum.mul(sum));
        let root = half.mul(half).sub(square.mul(rest));
        let time = rest.div(half.add(root.max(zero).sqrt()));
        let nearest = half.div(square.max(V::splat(f32::MIN_POSITIVE))).max(zero).min(dt);
        let meet =
            less(zero, half).mul(less(root, zero).if_positive(zero, one)).mul(less(dt, time).if_positive(zero, one));
        let mut found = mixed.if_positive(zero, meet).mul(asked);
        // Who has a moment of touch already, to be found once more or as it is; and who is still looked for.
        let (mut last, mut at) = (found.if_positive(time.max(zero), nearest), *now);
        let mut exact = mixed.if_positive(zero, found.max(near.mul(asked)));
        if mixed.any_positive() {
            let (sweep, scale) = (self.sweep(0).add(self.sweep(1)), self.scale());
            let straight = less(sweep.mul(dt), scale.mul(V::splat(NEAR))).mul(mixed);
            if straight.any_positive() {
                let bound = sweep.sub(self.between.dot(now.normal));
                let comes = less(bound.mul(dt), now.separation).if_positive(zero, straight);
                let (time, touches) = self.course().first_touch(dt);
                found = found.max(touches.mul(comes));
                last = comes.if_positive(time, last);
                exact = exact.max(comes);
            }
            let (mut going, mut ending) = (mixed.sub(straight), zero);
            for _ in 0..ROUNDS {
                // What is apart along a direction stays so for as long as nothing moves further along it.
                let bound = zero.sub(self.between.dot(at.normal)).add(sweep);
                let left = dt.sub(at.time);
                going = less(bound.mul(left), at.separation).if_positive(zero, going);
                if !going.any_positive() {
                    break;
                }
                // Half as if the fastest corner led, half as if the nearest point did.
                let speed = V::splat(0.5).mul(bound.add(self.closing(at.anchor, at.offset, at.normal).max(zero)));
                let next = self.at(at.time.add(at.separation.div(speed).min(left)));
                at = RoundMoments::pick(going, &next, &at);
                let deep = less(at.separation, scale.mul(V::splat(DEEP))).mul(going);
                let near = less(at.separation, scale.mul(V::splat(NEAR))).mul(going);
                ending = ending.max(deep);
                found = found.max(deep.if_positive(zero, near));
                going = near.max(deep).if_positive(zero, going);
            }
            ending = ending.max(going);
            let closing = self.closing(at.anchor, at.offset, at.normal);
            let closes = less(zero, closing).mul(ending);
            let time = at.time.add(at.separation.div(closing));
            let in_time = less(dt, time).if_positive(zero, closes);
            found = found.max(closes.if_positive(zero, ending)).max(in_time);
            last = in_time.if_positive(time.max(zero), last);
            exact = exact.max(in_time);
        }
        if exact.any_positive() {
            let then = self.at(last);
            at = RoundMoments::pick(exact, &then, &at);
        }
        (at, found)
    }
}
