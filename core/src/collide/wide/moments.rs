//! Where and when the bodies of sixteen pairs touch within the step, in up to two points: what `touch.rs` does for one pair, in the same
//! words and with the same bits.
//!
//! Where speeds overflow, or a corner may pass over another, it cannot tell, and leaves the pair to that.

use super::manifolds::Manifolds;
use super::pairs::{Outlook, Pairs, WidePairs};
use crate::collide::broad_phase::Pair;
use crate::collide::cull::passes;
use crate::collide::manifold::chain::Lies;
use crate::collide::touch::{CREEPING, DEEP, LEAST_WAY, MORE_ROUNDS, NEAR, PASSABLE, ROLLING, ROUNDS, TOUCHING};
use crate::model::contact::{Contact, ContactPoint};
use crate::model::math::Rot;
use crate::model::piece::Piece;
use crate::parallel::lanes::{Quad, WIDE, Wide, WideRow};
use crate::parallel::vectors::{Vectors, absolute, less, negated};
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::Vec2;

/// Moments of sixteen pairs, and their manifolds in these.
#[derive(Clone, Copy)]
struct Moments<V> {
    /// From now, in s.
    time: V,
    /// At that time: from the center of A to that of B, and how both have turned.
    offset: Vectors<V>,
    turning: [Vectors<V>; 2],
    manifolds: Manifolds<V>,
}

/// The shapes of sixteen pairs.
pub(super) trait Shapes<V: Wide> {
    /// Whether one of each two is a segment of a chain: who goes beyond that is let through, so that no step of a search may bring him
    /// there.
    const OF_SEGMENTS: bool = false;

    /// Whether one of each two may be a disc, which rolls.
    const WITH_DISCS: bool = false;

    /// How far a search for their touch goes at least past where nothing touches: see [`LEAST_WAY`].
    #[inline(always)]
    fn least_way(&self) -> V {
        V::splat(LEAST_WAY)
    }

    /// Their manifolds once B has come to `offset` from A, and both have turned so. Further ones than `reach` may give none.
    fn manifolds(&self, pairs: &Pairs<V>, offset: Vectors<V>, turning: [Vectors<V>; 2], reach: V) -> Manifolds<V>;
}

/// The moment of touch is looked for in so few lanes of sixteen only when there are no others.
const FEW: usize = 6;

/// When the moments of touch are looked for, which most pairs do not need.
#[derive(Clone, Copy, PartialEq)]
pub(in crate::collide) enum Search {
    /// At once, where it pays for all sixteen.
    WhereManyNeedIt,
    Always,
}

/// Sixteen pairs, and the shapes of their bodies.
pub(in crate::collide) trait Shaped: Default {
    /// As [`Outlook::NEEDS_REGISTERS`].
    const NEED_REGISTERS: bool = false;

    /// As [`Outlook::set`].
    fn set(&mut self, lane: usize, tile: &Tile, bodies: Pair, known: Option<&Contact>, setup: &Setup);

    /// Looks at all lanes.
    fn look<V: Wide>(&self, points: &mut Points, search: Search, setup: &Setup);
}

/// Sixteen pairs of pieces of two bodies.
pub(in crate::collide) trait WidePieces: Shaped {
    /// The bodies.
    fn pairs(&mut self) -> &mut WidePairs;

    /// Puts two pieces of the bodies of a lane into it. Where one is a segment, whether the other [lies](Lies) on it.
    fn set_pieces(&mut self, lane: usize, pieces: [&Piece; 2], lies: Lies);
}

/// What can be said of pairs whose contacts have up to two points.
#[derive(Default, Debug)]
pub(in crate::collide) struct PointOutlook<S> {
    pairs: S,
    points: Points,
}

impl<S: Shaped> Outlook for PointOutlook<S> {
    const NEEDS_REGISTERS: bool = S::NEED_REGISTERS;

    #[inline(always)]
    fn set(&mut self, lane: usize, tile: &Tile, bodies: Pair, known: Option<&Contact>, setup: &Setup) {
        self.pairs.set(lane, tile, bodies, known, setup);
    }

    #[inline(always)]
    fn look<V: Wide>(&mut self, search: Search, setup: &Setup) {
        self.pairs.look::<V>(&mut self.points, search, setup);
    }

    #[inline(always)]
    fn is_unsure(&self, lane: usize) -> bool {
        self.points.is_unsure(lane)
    }

    #[inline(always)]
    fn is_postponed(&self, lane: usize) -> bool {
        self.points.is_postponed(lane)
    }

    #[inline(always)]
    fn meets(&self, lane: usize) -> bool {
        self.points.meets(lane)
    }

    #[inline(always)]
    fn contact(&self, lane: usize, known: Option<&Contact>) -> (Contact, [f32; 2]) {
        self.points.contact(lane, 0, known)
    }
}

/// What comes of sixteen pairs.
#[derive(Default, Debug)]
pub(in crate::collide) struct Points {
    /// Positive if that cannot be told here.
    unsure: WideRow,
    /// Positive if the moment of touch was not looked for yet.
    postponed: WideRow,
    /// Positive if a contact has this point.
    holds: [WideRow; 2],
    feature: [WideRow; 2],
    /// Normal and offset, both rotations, of a [`Contact`]; anchor, separation there and now of its points.
    frames: [Quad; WIDE],
    rotations: [Quad; WIDE],
    points: [[Quad; WIDE]; 2],
}

impl<V: Wide> Moments<V> {
    /// `yes` where a number is positive, else `no`.
    #[inline(always)]
    fn pick(positive: V, yes: &Self, no: &Self) -> Self {
        Self {
            time: positive.if_positive(yes.time, no.time),
            offset: Vectors::pick(positive, yes.offset, no.offset),
            turning: Vectors::pick_both(positive, &yes.turning, &no.turning),
            manifolds: Manifolds::pick(positive, &yes.manifolds, &no.manifolds),
        }
    }
}

impl Points {
    /// As [`Outlook::is_unsure`].
    #[inline(always)]
    pub(in crate::collide) fn is_unsure(&self, lane: usize) -> bool {
        self.unsure[lane] > 0.0
    }

    /// As [`Outlook::is_postponed`].
    #[inline(always)]
    pub(in crate::collide) fn is_postponed(&self, lane: usize) -> bool {
        self.postponed[lane] > 0.0
    }

    /// As [`Outlook::meets`].
    #[inline(always)]
    pub(in crate::collide) fn meets(&self, lane: usize) -> bool {
        self.holds[0][lane] + self.holds[1][lane] > 0.0
    }

    /// Looks at pairs of such shapes.
    #[inline(always)]
    pub(super) fn look<V: Wide, S: Shapes<V>>(&mut self, pairs: &Pairs<V>, shapes: &S, search: Search, setup: &Setup) {
        let (one, zero) = (V::splat(1.0), V::splat(0.0));
        let (dt, speculative) = (pairs.dt, V::splat(setup.params.speculative_distance));
        let far = pairs.far();
        let reach = speculative.add(far);
        let turning = [Vectors::new(one, zero); 2];
        let manifolds = shapes.manifolds(pairs, pairs.offset, turning, reach);
        let now = Moments { time: zero, offset: pairs.offset, turning, manifolds };
        let (_, separation) = manifolds.least();
        let is_slow = less(far, speculative);
        let scale = pairs.scale();
        let rests = less(separation, scale.mul(V::splat(TOUCHING))).mul(is_slow).mul(pairs.pressed);
        // Discs that come straight touch in a moment that is known exactly.
        let has_straight = S::WITH_DISCS && !S::OF_SEGMENTS;
        let straight = if has_straight { pairs.is_straight() } else { zero };
        let is_now = less(separation, straight.if_positive(zero, scale.mul(V::splat(NEAR)))).max(rests);
        let is_now = manifolds.tells.if_positive(zero, is_now);
        let passes = passes(pairs.offset, pairs.between, pairs.bound[0].add(pairs.bound[1]), setup);
        let mut asked = passes.if_positive(zero, manifolds.some);
        let (mut rolling, mut rolls) = (now, zero);
        let may_roll = pairs.is_round().mul(pairs.pressed).mul(passes.if_positive(zero, is_slow));
        if S::WITH_DISCS && may_roll.any_positive() {
            (rolling, rolls) = pairs.roll_on(shapes, setup);
            rolls = rolls.mul(may_roll);
        }
        asked = asked.max(rolls);
        let later = is_now.max(rolls).if_positive(zero, asked);
        let near = less(separation, speculative);
        let within = pairs.ahead(near, setup);
        let later = pairs.come_near(&now, within).if_positive(later, zero);
        let (straight, later) = (straight.mul(later), straight.if_positive(zero, later));
        later.store(&mut self.postponed);
        let count = self.postponed.iter().fold(0, |count, &later| count + usize::from(later > 0.0));
        let mut at = now;
        let mut meets = is_now.max(near);
        if count > if search == Search::Always { 0 } else { FEW } {
            self.postponed = [0.0; WIDE];
            let found;
            (at, found) = pairs.first_moments(shapes, &now, later, reach, within);
            meets = meets.max(found);
        }
        (at, meets) = (Moments::pick(rolls, &rolling, &at), meets.max(rolls));
        let found = &at.manifolds;
        meets = found.tells.if_positive(zero, meets.mul(asked).mul(found.some));
        let moved = pairs.between.dot(found.normal).mul(at.time);
        let closing = pairs.closing_of_both(&at);
        for point in 0..2 {
            let (anchor, separation) = (found.anchor[point], found.separation[point]);
            let blow = found.two.if_positive(V::splat(0.5).mul(closing[1 - point].max(zero)), zero);
            let closing = closing[point].add(blow).max(zero);
            let ahead = pairs.fixed.if_positive(dt.sub(at.time).max(zero).mul(closing), zero);
            let there = if point == 0 { meets } else { meets.mul(found.two) };
            less(separation, speculative.add(ahead)).mul(there).store(&mut self.holds[point]);
            let swung = pairs.swing_apart(at.turning, at.offset, found.normal, anchor, separation);
            let before = separation.sub(moved.add(swung));
            let now = at.time.if_positive(before, separation);
            V::store_quads([anchor.x, anchor.y, separation, now], &mut self.points[point]);
            found.feature[point].store(&mut self.feature[point]);
        }
        // Speeds that overflow tell of no other moment; and who may pass over a corner, or comes straight, is looked at alone.
        let unsure = if S::WITH_DISCS { straight } else { pairs.run_into_corners(found, closing[0]) };
        less(far, V::splat(0.125 * f32::MAX)).if_positive(unsure, one).store(&mut self.unsure);
        let [a, b] = [at.turning[0].rotate(pairs.rotation[0]), at.turning[1].rotate(pairs.rotation[1])];
        V::store_quads([found.normal.x, found.normal.y, at.offset.x, at.offset.y], &mut self.frames);
        V::store_quads([a.x, a.y, b.x, b.y], &mut self.rotations);
    }

    /// The contact of a pair, if it makes one, of these pieces, with the impulses of the last one, and the separation of its points now.
    #[inline(always)]
    pub(in crate::collide) fn contact(&self, lane: usize, pieces: u32, known: Option<&Contact>) -> (Contact, [f32; 2]) {
        let ([nx, ny, x, y], [ca, sa, cb, sb]) = (self.frames[lane], self.rotations[lane]);
        // Of two points it may be the second alone that holds.
        let first = usize::from(self.holds[0][lane] == 0.0);
        let (mut contact, mut now) = (
            Contact {
                normal: Vec2::new(nx, ny),
                offset: Vec2::new(x, y),
                rotation_a: Rot { c: ca, s: sa },
                rotation_b: Rot { c: cb, s: sb },
                points: [self.point(lane, first, pieces, known), ContactPoint::NONE],
            },
            [self.points[first][lane][3], 0.0],
        );
        if first == 0 && self.holds[1][lane] > 0.0 {
            contact.points[1] = self.point(lane, 1, pieces, known);
            now[1] = self.points[1][lane][3];
        }
        (contact, now)
    }

    #[inline(always)]
    fn point(&self, lane: usize, point: usize, pieces: u32, known: Option<&Contact>) -> ContactPoint {
        let [x, y, separation, _] = self.points[point][lane];
        let feature = self.feature[point][lane] as u32 | pieces;
        let old = known.and_then(|known| known.points().iter().find(|old| old.feature == feature));
        let (normal_impulse, tangent_impulse) = old.map_or((0.0, 0.0), |old| (old.normal_impulse, old.tangent_impulse));
        ContactPoint { anchor: Vec2::new(x, y), separation, normal_impulse, tangent_impulse, feature }
    }
}

impl<V: Wide> Pairs<V> {
    /// What will be after some seconds if nothing else happens.
    #[inline(always)]
    fn moments(&self, shapes: &impl Shapes<V>, time: V, reach: V) -> Moments<V> {
        let (offset, turning) = self.moved(time);
        Moments { time, offset, turning, manifolds: shapes.manifolds(self, offset, turning, reach) }
    }

    /// One where nothing turns by as much as counts (see `touch/straight.rs`).
    #[inline(always)]
    fn is_straight(&self) -> V {
        less(self.sweep(0).add(self.sweep(1)).mul(self.dt), self.scale().mul(V::splat(NEAR)))
    }

    /// One where a body is round.
    #[inline(always)]
    fn is_round(&self) -> V {
        let (one, zero) = (V::splat(1.0), V::splat(0.0));
        self.half[0].x.if_positive(self.half[1].x.if_positive(zero, one), one)
    }

    /// Round bodies that roll on the others, as they are in the middle of the step, and one where they do: see `roll` of `touch/kept.rs`.
    #[inline(always)]
    fn roll_on<S: Shapes<V>>(&self, shapes: &S, setup: &Setup) -> (Moments<V>, V) {
        let (zero, half) = (V::splat(0.0), V::splat(0.5));
        let time = half.mul(self.dt);
        let mut then = self.moments(shapes, time, V::splat(f32::INFINITY));
        let found = &mut then.manifolds;
        let (anchor, separation) = found.nearest();
        let normal = found.normal;
        let on_a = self.swing(0, then.turning[0], anchor, normal);
        let on_b = self.swing(1, then.turning[1], anchor.minus(then.offset), normal);
        let nearer = self.between.dot(normal).mul(time).add(on_b.sub(on_a));
        let now = separation.sub(nearer);
        let (scale, speculative) = (self.scale(), V::splat(setup.params.speculative_distance));
        let most = scale.mul(V::splat(TOUCHING)).min(speculative);
        let rolls = less(absolute(nearer), scale.mul(V::splat(ROLLING))).mul(less(now, most));
        let rolls = found.tells.if_positive(zero, rolls.mul(found.some));
        // As if they had come so near at once, along the normal.
        found.anchor[0] = anchor.minus(normal.scaled(half.mul(nearer)));
        then.offset = then.offset.minus(normal.scaled(nearer));
        (found.separation[0], found.two, then.time) = (now, zero, zero);
        (then, rolls)
    }

    /// The greatest speed at which anything of B comes nearer to anything of A along a normal, in m/s.
    #[inline(always)]
    fn bound_along(&self, normal: Vectors<V>) -> V {
        negated(self.between.dot(normal)).add(self.sweep(0).add(self.sweep(1)))
    }

    /// How fast both points come nearer, in m/s. Written out, as a closure might be compiled without the instructions of its kernel.
    #[inline(always)]
    fn closing_of_both(&self, at: &Moments<V>) -> [V; 2] {
        let Manifolds { anchor, normal, .. } = at.manifolds;
        [self.closing(anchor[0], at.offset, normal), self.closing(anchor[1], at.offset, normal)]
    }

    /// One for those that may touch within the rest of so many seconds: what is apart along a direction stays so for as long as nothing
    /// moves further along it.
    #[inline(always)]
    fn come_near(&self, at: &Moments<V>, dt: V) -> V {
        let (_, separation) = at.manifolds.least();
        let way = self.bound_along(at.manifolds.normal).mul(dt.sub(at.time));
        less(way, separation).if_positive(V::splat(0.0), V::splat(1.0))
    }

    /// One for those of which one corner runs into another, at such a speed, that it overlaps by so little that it may pass over it: see
    /// `touch.rs`.
    #[inline(always)]
    fn run_into_corners(&self, at: &Manifolds<V>, closing: V) -> V {
        let (_, nearest) = at.least();
        let overlap = absolute(at.anchor[1].minus(at.anchor[0]).cross(at.normal));
        let (a, b) = (self.half[0].x.min(self.half[0].y), self.half[1].x.min(self.half[1].y));
        let touching = self.scale().mul(V::splat(TOUCHING));
        let overlaps = less(overlap, touching.min(V::splat(PASSABLE).mul(a.min(b))));
        at.two.mul(overlaps).mul(less(nearest, touching)).mul(less(V::splat(CREEPING), closing))
    }

    /// The moments in which those pairs of whom it is asked, apart now, touch, and for whom that is within so many seconds; for the
    /// others the last that was looked at.
    #[inline(always)]
    fn first_moments<S: Shapes<V>>(&self, shapes: &S, now: &Moments<V>, asked: V, reach: V, dt: V) -> (Moments<V>, V) {
        let zero = V::splat(0.0);
        let (mut at, mut going, mut ending, mut found) = (*now, asked, zero, zero);
        let scale = self.scale();
        for _ in 0..if S::OF_SEGMENTS { MORE_ROUNDS } else { ROUNDS } {
            let (anchor, separation) = at.manifolds.nearest();
            let (bound, left) = (self.bound_along(at.manifolds.normal), dt.sub(at.time));
            going = self.come_near(&at, dt).if_positive(going, zero);
            if !going.any_positive() {
                break;
            }
            // Half as if the fastest corner led, half as if the nearest point did; or all as if that corner did.
            let closing = self.closing(anchor, at.offset, at.manifolds.normal).max(zero);
            let closing = if S::OF_SEGMENTS { bound } else { closing };
            let speed = V::splat(0.5).mul(bound.add(closing));
            let mut time = separation.div(speed);
            if S::OF_SEGMENTS {
                let whole = self.between.dot(self.between).sqrt().add(self.sweep(0).add(self.sweep(1)));
                time = separation.div(speed.if_positive(speed, whole));
                time = at.manifolds.tells.if_positive(time.max(shapes.least_way().div(whole)), time);
            }
            let next = self.moments(shapes, at.time.add(time.min(left)), reach);
            at = Moments::pick(going, &next, &at);
            going = going.mul(at.manifolds.some);
            let (_, separation) = at.manifolds.least();
            let touches = at.manifolds.tells.if_positive(zero, going);
            let deep = less(separation, scale.mul(V::splat(DEEP))).mul(touches);
            let near = less(separation, scale.mul(V::splat(NEAR))).mul(touches);
            ending = ending.max(deep);
            found = found.max(deep.if_positive(zero, near));
            going = near.max(deep).if_positive(zero, going);
        }
        let last = at.manifolds;
        ending = last.tells.if_positive(zero, ending.max(going));
        // Of two points the further one may be the first to touch.
        let never = V::splat(f32::INFINITY);
        let closing = self.closing_of_both(&at);
        let first = less(zero, closing[0]).if_positive(last.separation[0].div(closing[0]), never);
        let second = less(zero, closing[1]).if_positive(last.separation[1].div(closing[1]), never);
        // Where one is too deep, it is that one's moment.
        let (second_is_nearest, nearest) = last.least();
        let of_nearest = second_is_nearest.if_positive(second, first);
        let of_any = last.two.if_positive(first.min(second), first);
        let soonest = less(nearest, zero).if_positive(of_nearest, of_any);
        let closes = less(soonest, never).mul(ending);
        let time = at.time.add(soonest);
        let exact = less(dt, time).if_positive(zero, closes);
        found = found.max(closes.if_positive(zero, ending));
        if exact.any_positive() {
            let then = self.moments(shapes, time.max(zero), reach);
            at = Moments::pick(exact, &then, &at);
            found = found.max(exact.mul(then.manifolds.some));
        }
        (at, found)
    }
}
