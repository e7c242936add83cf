//! One pair: whether and where its bodies touch within the step, and the contact that comes of it.
//!
//! A contact of bodies that meet fast must act as they touch and not before: its normal is that of the touch, and friction
//! pulls where surfaces are then (E. Routh, "Dynamics of a System of Rigid Bodies", 1860, for what one collision of rough
//! bodies leaves). So both are moved along their free path, turning included, until they touch, by conservative advancement
//! (B. Mirtich, "Impulse-based Dynamic Simulation of Rigid Body Systems", 1996; E. Catto, "Continuous Collision", GDC 2013), or
//! where one is round and the other hardly turns in closed form (`touch/straight.rs`), and the contact is made there, with the
//! separation that leads to it from where they are now. Who would pass by makes none.

mod kept;
mod meeting;
mod stopped;
mod straight;

use kept::is_shared;
pub(super) use kept::{pressed, recycle};
pub(super) use meeting::{Meeting, Met, meet};
pub(super) use stopped::{Stopped, sooner};
pub(super) use straight::Course;

use crate::collide::broad_phase::Pair;
use crate::collide::manifold::chain::Lies;
use crate::collide::manifold::{Manifold, ManifoldPoint, collide, convex, scale_of};
use crate::model::contact::{Contact, ContactPoint};
use crate::model::kind::{Form, KindRow};
use crate::model::math::{Rot, clamp, cross, dot, max, min, right_perp, tangent, turn};
use crate::model::piece::Piece;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::Vec2;

/// The search for a touch ends with surfaces this near, in m; from deeper than the second it takes a step back. Of small bodies both are
/// less: see [`scale_of`].
pub(super) const NEAR: f32 = 0.0002;
pub(super) const DEEP: f32 = -0.01;

/// Surfaces nearer than this touch, in m.
pub(super) const TOUCHING: f32 = 0.002;

/// Who rolls comes no nearer than this in half a step, and goes no further away, in m.
pub(super) const ROLLING: f32 = 0.0005;

/// Steps of the search, at most. A last one mends what they leave.
pub(super) const ROUNDS: usize = 3;

/// The same against segments of chains; and how far it goes there, at least, past ends where nothing touches, in m: of what is shorter by no
/// more than a part, so as not to go past all of it.
pub(super) const MORE_ROUNDS: usize = 12;
pub(super) const LEAST_WAY: f32 = 0.002;
pub(super) const LEAST_PART: f32 = 0.5;

/// The cosine between a segment's normal and that of its contact with what lies on it, at least.
const LIES: f32 = 0.99;

/// Slower than this, in m/s, nothing runs against a corner.
pub(super) const CREEPING: f32 = 0.01;

/// Corners pass over each other that overlap by less than what touches, and by less than this part of the lesser half extent.
pub(super) const PASSABLE: f32 = 0.1;

/// One body of a pair.
struct Side<'a> {
    kind: &'a KindRow,
    rotation: Rot,
    velocity: Vec2,
    angular_velocity: f32,
}

impl<'a> Side<'a> {
    #[inline(always)]
    fn new(tile: &Tile, index: u32, setup: &'a Setup) -> Self {
        let (bodies, i) = (&tile.bodies, index as usize);
        Self {
            kind: setup.kind(bodies.kind[i]),
            rotation: bodies.rotation[i],
            velocity: bodies.velocity[i],
            angular_velocity: bodies.angular_velocity[i],
        }
    }

    fn moves(&self) -> bool {
        self.kind.inv_mass > 0.0
    }

    #[inline(always)]
    fn is_round(&self) -> bool {
        self.kind.form == Form::Round
    }

    /// How it will have turned after some seconds, in four parts, as in the substeps of a step: as far as that can be followed, a radian
    /// each.
    #[inline(always)]
    fn turning(&self, time: f32) -> Rot {
        if self.is_round() {
            return Rot::IDENTITY;
        }
        let angle = clamp(0.25 * time * self.angular_velocity, -1.0, 1.0);
        let quarter = Rot { c: 1.0, s: tangent(angle) }.normalized();
        let half = quarter.after(quarter);
        half.after(half)
    }

    /// The greatest speed that turning gives a point of its surface that it brings nearer, in m/s.
    #[inline(always)]
    fn sweep(&self) -> f32 {
        self.kind.not_round * (self.kind.bounding_radius * self.angular_velocity.abs())
    }

    /// How far its surface, at a point of a contact, comes along a normal as it turns so, in m.
    #[inline(always)]
    fn swing(&self, turning: Rot, arm: Vec2, normal: Vec2) -> f32 {
        self.kind.not_round * ((turning.c - 1.0) * dot(arm, normal) + turning.s * cross(arm, normal))
    }
}

/// Two bodies on their way.
struct Approach<'a> {
    a: Side<'a>,
    b: Side<'a>,
    /// From the center of A to that of B, now, in m.
    offset: Vec2,
    /// Velocity of B as seen from A, in m/s.
    between: Vec2,
    /// Which pieces of them meet; none where both are circles or boxes.
    pieces: Option<[&'a Piece; 2]>,
    /// Their numbers, as features of contacts name them (see [`Contact::pieces`]).
    features: u32,
    /// Whether another tile has a copy of their contact: see [`is_shared`].
    shared: bool,
    /// Where one is a segment of a chain, and the other lay on its face in the last step: how far behind it that may be.
    lies: Lies,
}

/// A manifold, and the moment in which it is one.
#[derive(Clone, Copy)]
struct Moment {
    /// From now, in s.
    time: f32,
    manifold: Manifold,
    /// At that time.
    offset: Vec2,
    turning_a: Rot,
    turning_b: Rot,
}

/// How far surfaces of two bodies can move against each other within the step, in m.
#[inline(always)]
pub(super) fn far(tile: &Tile, pair: Pair, setup: &Setup) -> f32 {
    Approach::new(tile, pair, setup).far(setup.params.dt)
}

/// Whether surfaces move by less than the speculative distance within the step.
#[inline(always)]
pub(super) fn is_slow(tile: &Tile, pair: Pair, setup: &Setup) -> bool {
    far(tile, pair, setup) < setup.params.speculative_distance
}

/// The contact of bodies A and B, of one piece each, if there is one, and the separation of its points. Not inlined: kernels ask for it seldom, and with
/// it the compiler would take many minutes over them.
#[inline(never)]
pub(super) fn touch(tile: &Tile, pair: Pair, known: Option<&Contact>, setup: &Setup) -> Option<(Contact, [f32; 2])> {
    let mut pair = Approach::of_pieces(tile, pair, [0, 0], setup);
    if let Some(pieces) = pair.pieces {
        pair.lies = lies(pieces, known, setup);
    }
    pair.touch_unless_passing(known, setup)
}

/// Where one of two pieces is a segment, and the other had a contact with it along the normal of its face: how far behind it that may be.
#[inline(always)]
pub(super) fn lies(pieces: [&Piece; 2], known: Option<&Contact>, setup: &Setup) -> Lies {
    let known = known?;
    let has_lain = |(piece, rotation): (&Piece, Rot)| {
        piece.side.is_some() && dot(rotation.rotate(piece.outline.normal(0)), known.normal).abs() > LIES
    };
    let [a, b] = pieces;
    let lies = has_lain((a, known.rotation_a)) || has_lain((b, known.rotation_b));
    lies.then_some(0.5 * setup.params.speculative_distance)
}

impl<'a> Approach<'a> {
    #[inline(always)]
    fn new(tile: &Tile, pair: Pair, setup: &'a Setup) -> Self {
        let [a, b] = pair;
        let offset = (tile.bodies.position[b as usize] - tile.bodies.position[a as usize]).as_vec2();
        let (a, b) = (Side::new(tile, a, setup), Side::new(tile, b, setup));
        let between = b.velocity - a.velocity;
        Self { a, b, offset, between, pieces: None, features: 0, shared: is_shared(tile, pair, setup), lies: None }
    }

    /// Of two pieces, if they have some.
    fn of_pieces(tile: &Tile, pair: Pair, [a, b]: [usize; 2], setup: &'a Setup) -> Self {
        let mut pair = Self::new(tile, pair, setup);
        if !(pair.a.kind.form.is_simple() && pair.b.kind.form.is_simple()) {
            pair.pieces = Some([&pair.a.kind.pieces[a], &pair.b.kind.pieces[b]]);
            pair.features = Contact::features_of(a as u32, b as u32);
        }
        pair
    }

    /// The contact of two pieces, or of bodies of one piece each, if there is one.
    fn touch_unless_passing(&self, known: Option<&Contact>, setup: &Setup) -> Option<(Contact, [f32; 2])> {
        if self.pass_by(setup) { None } else { self.roll_or_touch(known, self.far(setup.params.dt), setup) }
    }

    /// As [`Self::touch`], or that of a disc that [rolls](Self::roll) on another.
    fn roll_or_touch(&self, known: Option<&Contact>, far: f32, setup: &Setup) -> Option<(Contact, [f32; 2])> {
        let has_round = self.pieces.is_some() && (self.a.is_round() || self.b.is_round());
        let may_roll = has_round && far < setup.params.speculative_distance;
        let rolls = known.filter(|_| may_roll).and_then(|known| self.roll(known, setup));
        rolls.or_else(|| self.touch(known, far, setup))
    }

    /// The contact, if there is one, of bodies whose surfaces can move so [`far`](Self::far).
    #[inline(always)]
    fn touch(&self, known: Option<&Contact>, far: f32, setup: &Setup) -> Option<(Contact, [f32; 2])> {
        let reach = setup.params.speculative_distance + far;
        let now = self.at(0.0, reach);
        let nearest = now.manifold.nearest()?.separation;
        let (scale, is_slow) = (self.scale(), far < setup.params.speculative_distance);
        let near = if self.is_straight(setup.params.dt) { 0.0 } else { scale * NEAR };
        // Who rests is held as he is; who comes only now, as he will touch.
        let rests = is_slow && nearest < scale * TOUCHING && known.is_some_and(|known| self.pressed(known));
        let is_now = (nearest < near || rests) && !now.manifold.is_distance();
        // Speeds that overflow tell of no other moment.
        if is_now || far.is_infinite() {
            return self.contact(&self.over_corner(now), known, setup);
        }
        // Near ones may be driven together within the step: as they will be when they pass, or who passes by would be turned aside. A
        // substep more, as the last one looks beyond the step.
        let is_near = nearest < setup.params.speculative_distance;
        let time = if is_near { setup.params.dt + setup.h } else { setup.params.dt };
        let (then, touches) = self.first_touch(&now, reach, time);
        if touches || is_near { self.contact(&self.over_corner(then), known, setup) } else { None }
    }

    /// As it is, or where two corners meet that overlap by less than is worth a stumble, and hardly come nearer across: the moment with
    /// what lets one pass over the other. What lies on a floor of boxes lies a little in each, and must not catch on the next.
    fn over_corner(&self, at: Moment) -> Moment {
        let &[one, two] = at.manifold.points() else { return at };
        let touching = self.scale() * TOUCHING;
        let touches = one.separation < touching || two.separation < touching;
        let along = right_perp(at.manifold.normal);
        let overlap = dot(two.anchor - one.anchor, along).abs();
        let [a, b] = [&self.a, &self.b].map(|side| min(side.kind.extent.x, side.kind.extent.y));
        let little = min(touching, PASSABLE * min(a, b));
        let is_little = overlap < little;
        let closing = self.closing(&at, one.anchor);
        if !self.is_solid() || !touches || !is_little || closing <= CREEPING {
            return at;
        }
        let pieces = self.pieces.unwrap_or([&self.a.kind.pieces[0], &self.b.kind.pieces[0]]);
        let rotations = [at.turning_a.after(self.a.rotation), at.turning_b.after(self.b.rotation)];
        // From the piece of A to that of B.
        let [a, b] = [0, 1].map(|side: usize| rotations[side].rotate(pieces[side].center));
        let across = if dot(at.offset + b - a, along) < 0.0 { -along } else { along };
        // Two points that are near each other may be a short edge, too, of what is over the other as a whole.
        let reach = |side: usize, direction: Vec2| pieces[side].reach(rotations[side].unrotate(direction));
        let has_short_edge = pieces.iter().any(|piece| piece.has_edge_shorter_than(little));
        if has_short_edge && reach(0, across) + reach(1, -across) - dot(at.offset, across) > little {
            return at;
        }
        let over = |normal: Vec2, overlap: f32| {
            let mut manifold = Manifold { normal, ..Manifold::EMPTY };
            manifold.push(ManifoldPoint { separation: -overlap, ..one });
            let over = Moment { manifold, ..at };
            (self.closing(&over, one.anchor) < 0.25 * closing).then_some(over)
        };
        if let Some(over) = over(across, overlap) {
            return over;
        }
        // Where corners are not square, it may be another face of one of them that is glided along: the one that it is least behind.
        let (mut best, mut least) = (at, little);
        for side in [0, 1] {
            for face in pieces[side].outline.normals() {
                let out = rotations[side].rotate(face);
                let normal = if side == 0 { out } else { -out };
                let overlap = reach(0, normal) + reach(1, -normal) - dot(at.offset, normal);
                if overlap < least
                    && let Some(over) = over(normal, overlap)
                {
                    (best, least) = (over, overlap);
                }
            }
        }
        best
    }

    /// Whether none of the pieces is a segment, which is solid from one side alone.
    #[inline(always)]
    fn is_solid(&self) -> bool {
        self.pieces.is_none_or(|pieces| pieces.iter().all(|piece| piece.side.is_none()))
    }

    /// Whether they stay apart by where their centers are nearest within the step, as most do that are fast.
    #[inline(always)]
    fn pass_by(&self, setup: &Setup) -> bool {
        let Self { a, b, offset, between, .. } = self;
        let nearest = -dot(*offset, *between) / max(dot(*between, *between), f32::MIN_POSITIVE);
        // Where speeds overflow nothing is known: then they do not pass.
        let gap = *offset + *between * min(max(nearest, 0.0), setup.params.dt);
        let near = a.kind.bounding_radius + b.kind.bounding_radius + setup.params.speculative_distance;
        dot(gap, gap) > near * near
    }

    /// See [`scale_of`].
    #[inline(always)]
    fn scale(&self) -> f32 {
        scale_of([self.a.kind.bounding_radius, self.b.kind.bounding_radius])
    }

    /// How far surfaces can move against each other within the step, in m.
    #[inline(always)]
    fn far(&self, dt: f32) -> f32 {
        dt * (dot(self.between, self.between).sqrt() + self.a.sweep() + self.b.sweep())
    }

    /// What will be after some seconds if nothing else happens.
    #[inline(always)]
    fn at(&self, time: f32, reach: f32) -> Moment {
        // Now nothing has moved, not even at a speed that overflows.
        let (offset, turning_a, turning_b) = if time > 0.0 {
            (self.offset + self.between * time, self.a.turning(time), self.b.turning(time))
        } else {
            (self.offset, Rot::IDENTITY, Rot::IDENTITY)
        };
        let (rotation_a, rotation_b) = (turning_a.after(self.a.rotation), turning_b.after(self.b.rotation));
        let manifold = match self.pieces {
            None => collide(self.a.kind, rotation_a, self.b.kind, rotation_b, offset, reach),
            Some(pieces) => {
                let found = convex::collide(pieces, [rotation_a, rotation_b], offset, (reach, self.scale()), self.lies);
                found.named(self.features)
            }
        };
        Moment { time, manifold, offset, turning_a, turning_b }
    }

    /// Speed at which the surfaces come nearer at a point, in m/s.
    #[inline(always)]
    fn closing(&self, at: &Moment, anchor: Vec2) -> f32 {
        let velocity_a = turn(self.a.angular_velocity, anchor);
        let velocity_b = turn(self.b.angular_velocity, anchor - at.offset);
        -dot(self.between + velocity_b - velocity_a, at.manifold.normal)
    }

    /// The moment in which the two, apart now, touch, and whether that is within so many seconds; if not, the last one in which it was seen
    /// that they do not yet, or of round ones and what hardly turns about that in which they are nearest.
    #[inline(never)]
    fn first_touch(&self, now: &Moment, reach: f32, dt: f32) -> (Moment, bool) {
        if self.a.is_round() && self.b.is_round() {
            // Two circles touch where the square of their centers' distance has come down to that of their radii's sum.
            let (Self { offset, between, .. }, sum) = (self, self.a.kind.bounding_radius + self.b.kind.bounding_radius);
            let (square, half, rest) =
                (dot(*between, *between), -dot(*offset, *between), dot(*offset, *offset) - sum * sum);
            let root = half * half - square * rest;
            let time = rest / (half + max(root, 0.0).sqrt());
            let touches = half > 0.0 && root >= 0.0 && time <= dt;
            let nearest = min(max(half / max(square, f32::MIN_POSITIVE), 0.0), dt);
            return (self.at(if touches { max(time, 0.0) } else { nearest }, reach), touches);
        }
        let (sweep, scale) = (self.a.sweep() + self.b.sweep(), self.scale());
        let mut at = *now;
        // Who goes beyond a segment is let through, and so must not come there by a step of the search.
        let (is_straight, is_let_through) = (self.is_straight(dt), !self.is_solid());
        for _ in 0..if is_let_through { MORE_ROUNDS } else { ROUNDS } {
            let Some(nearest) = at.manifold.nearest() else { return (at, false) };
            // What is apart along a direction stays so for as long as nothing moves further along it.
            let bound = -dot(self.between, at.manifold.normal) + sweep;
            let left = dt - at.time;
            if bound * left < nearest.separation {
                return (at, false);
            }
            if is_straight {
                let (time, touches) = self.first_touch_straight(dt);
                return (self.at(time, reach), touches);
            }
            // Half as if the fastest corner led, half as if the nearest point did; or all as if that corner did.
            let closing = if is_let_through { bound } else { max(self.closing(&at, nearest.anchor), 0.0) };
            let speed = 0.5 * (bound + closing);
            // Who is let through may go away from where he is nearest, and still come to the face.
            let whole = dot(self.between, self.between).sqrt() + sweep;
            let time = nearest.separation / if speed > 0.0 { speed } else { whole };
            let time = if at.manifold.is_distance() { max(time, self.least_way() / whole) } else { time };
            at = self.at(at.time + min(time, left), reach);
            if at.manifold.is_distance() {
                continue;
            }
            let Some(nearest) = at.manifold.nearest() else { return (at, false) };
            if nearest.separation < scale * DEEP {
                break;
            }
            if nearest.separation < scale * NEAR {
                return (at, true);
            }
        }
        if at.manifold.is_distance() {
            return (at, false);
        }
        // Of two points the further one may be the first to touch; where one is too deep, it is that one's moment.
        let Some(&nearest) = at.manifold.nearest() else { return (at, false) };
        let points = if nearest.separation < 0.0 { &[nearest] } else { at.manifold.points() };
        let mut soonest = f32::INFINITY;
        for point in points {
            let closing = self.closing(&at, point.anchor);
            if closing > 0.0 {
                soonest = min(soonest, point.separation / closing);
            }
        }
        if soonest == f32::INFINITY {
            return (at, true);
        }
        let time = at.time + soonest;
        if time <= dt { (self.at(max(time, 0.0), reach), true) } else { (at, false) }
    }

    /// See [`LEAST_WAY`].
    fn least_way(&self) -> f32 {
        let segment = self.pieces.and_then(|pieces| pieces.into_iter().find(|piece| piece.side.is_some()));
        segment.map_or(LEAST_WAY, |segment| {
            let [to, from] = segment.outline.edge(0);
            min(LEAST_WAY, LEAST_PART * dot(to - from, to - from).sqrt())
        })
    }

    /// The contact with the geometry of a moment, and the separations that its points have now.
    #[inline(never)]
    fn contact(&self, at: &Moment, known: Option<&Contact>, setup: &Setup) -> Option<(Contact, [f32; 2])> {
        let Moment { time, manifold, offset, turning_a, turning_b } = at;
        let normal = manifold.normal;
        if manifold.is_distance() {
            return None;
        }
        // A second point may come down upon a static within the step, by itself or as the blow at the first turns the body: by as much
        // as that one is stopped. Between moving bodies the next step is soon enough.
        let is_fixed = self.a.kind.inv_mass * self.b.kind.inv_mass == 0.0;
        let closing = manifold.points.map(|point| self.closing(at, point.anchor));
        let mut kept = Manifold { normal, ..Manifold::EMPTY };
        for (k, point) in manifold.points().iter().enumerate() {
            let blow = if manifold.count == 2 { 0.5 * max(closing[1 - k], 0.0) } else { 0.0 };
            let closing = max(closing[k] + blow, 0.0);
            // A speed that overflows is not one that can wait for the next step.
            let ahead =
                if is_fixed || closing.is_infinite() { max(setup.params.dt - time, 0.0) * closing } else { 0.0 };
            if point.separation < setup.params.speculative_distance + ahead {
                kept.push(*point);
            }
        }
        if kept.count == 0 {
            return None;
        }
        let points = kept.points.map(|point| {
            let old = known.and_then(|known| known.points().iter().find(|old| old.feature == point.feature));
            ContactPoint {
                anchor: point.anchor,
                separation: point.separation,
                normal_impulse: old.map_or(0.0, |old| old.normal_impulse),
                tangent_impulse: old.map_or(0.0, |old| old.tangent_impulse),
                feature: point.feature,
            }
        });
        let (rotation_a, rotation_b) = (turning_a.after(self.a.rotation), turning_b.after(self.b.rotation));
        let contact = Contact { normal, offset: *offset, rotation_a, rotation_b, points };
        if *time == 0.0 {
            return Some((contact, points.map(|point| point.separation)));
        }
        // As the rows of the solver will see the way there, each body's own surface turning with it.
        let moved = dot(self.between, normal) * time;
        let separation = points.map(|point| {
            let out = normal * (0.5 * max(point.separation, 0.0));
            let on_a = self.a.swing(*turning_a, point.anchor - out, normal);
            let on_b = self.b.swing(*turning_b, point.anchor + out - *offset, normal);
            point.separation - (moved + (on_b - on_a))
        });
        Some((contact, separation))
    }
}
