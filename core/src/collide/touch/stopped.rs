//! Two bodies that stop each other on their way, and what one of them touches then.

use super::{Approach, Moment, NEAR, Side, TOUCHING};
use crate::collide::broad_phase::Pair;
use crate::model::contact::Contact;
use crate::model::math::{cross, dot, max, min, turn};
use crate::model::piece::Piece;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::Vec2;
use std::cmp::Ordering;

/// A search for a touch is begun so often, at most.
const SEARCHES: usize = 8;

/// A bow leads no further off a straight way than this, in m; of small bodies less, see [`scale_of`](crate::collide::manifold::scale_of).
const MOST_BOW: f32 = 0.008;

/// How two bodies go on from the moment in which they touch: along each other, as if both were smooth and nothing bounced.
pub(in crate::collide) struct Stopped {
    /// That moment, from now, in s, as near as it was looked for; now, if they do not touch within the step.
    time: f32,
    /// The same exactly, and how far they are apart, in m, if they touch already or do not at all.
    order: [f32; 2],
    /// How fast they came nearer then, in m/s.
    closing: f32,
    /// What holds the two off each other from then on, in m: the body that moves off the static, or B off A.
    lift: Vec2,
    /// From then on, of A and of B; where one of them is a static, whichever moves goes on so.
    ways: [Way; 2],
    /// The contact that stops them, and the separation of its points now.
    by: Option<(Contact, [f32; 2])>,
    /// Whether a corner [passes over](Approach::over_corner) another.
    passes: bool,
}

/// How a body moves on.
#[derive(Clone, Copy)]
struct Way {
    velocity: Vec2,
    angular_velocity: f32,
}

impl Stopped {
    /// The bodies of a pair that has such a contact. None where nothing is known of them.
    pub(in crate::collide) fn new(tile: &Tile, of: (Pair, &Contact), setup: &Setup) -> Option<Self> {
        Self::look(tile, of, true, setup)
    }

    /// The same where no corner passes over another.
    pub(in crate::collide) fn at_corner(tile: &Tile, of: (Pair, &Contact), setup: &Setup) -> Option<Self> {
        Self::look(tile, of, false, setup)
    }

    fn look(tile: &Tile, (bodies, contact): (Pair, &Contact), may_pass: bool, setup: &Setup) -> Option<Self> {
        let (pair, dt) = (Approach::of_pieces(tile, bodies, contact.piece_numbers(), setup), setup.params.dt);
        // Speeds that overflow tell of no other moment.
        if !pair.far(dt).is_finite() {
            return None;
        }
        let (at, ways, closing, order, separation, by, passes);
        if let Some(met) = pair.meets(dt, setup) {
            let nearest = met.manifold.nearest()?;
            let (speed, is_now) = (max(pair.closing(&met, nearest.anchor), 0.0), met.time == 0.0);
            let left = if is_now || speed == 0.0 { 0.0 } else { nearest.separation / speed };
            order = [met.time + left, if is_now { nearest.separation } else { 0.0 }];
            let then = if may_pass { pair.over_corner(met) } else { met };
            passes = then.manifold.normal != met.manifold.normal;
            separation = then.manifold.nearest()?.separation;
            (ways, closing) = pair.stop(&then)?;
            by = pair.contact(&then, Some(contact), setup);
            at = then;
        } else {
            at = pair.at(0.0, f32::INFINITY);
            let [now, then] =
                [at, pair.at(dt, f32::INFINITY)].map(|at| at.manifold.nearest().map(|point| point.separation));
            separation = min(now?, then?);
            ways = pair.ways();
            closing = 0.0;
            order = [f32::INFINITY, separation];
            (by, passes) = (None, false);
        }
        // Who turns as he glides along comes down on a bow, and not straight.
        let sinks = |way: &Way| (cross(way.velocity, at.manifold.normal) * way.angular_velocity).abs();
        let bow = max(sinks(&ways[0]), sinks(&ways[1])) * (dt - at.time) * (dt - at.time);
        let scale = pair.scale();
        let above = scale * (2.0 * NEAR) + min(bow, scale * MOST_BOW);
        let lift = pair.out(at.manifold.normal) * max(above - separation, 0.0);
        Some(Self { time: at.time, order, closing, lift, ways, by, passes })
    }

    /// Ascending from who stop each other first.
    pub(in crate::collide) fn order(&self) -> [f32; 2] {
        self.order
    }

    /// How fast they came nearer as they touched, in m/s.
    pub(in crate::collide) fn closing(&self) -> f32 {
        self.closing
    }

    /// Whether a corner passes over another, as if there were nothing beside it.
    pub(in crate::collide) fn passes_over_corner(&self) -> bool {
        self.passes
    }

    /// The velocity from then on of the one that moves, where the other is a static, in m/s.
    pub(in crate::collide) fn velocity(&self) -> Vec2 {
        self.ways[0].velocity
    }

    /// The contact that stops them, and the separation of its points now, if they touch within the step.
    pub(in crate::collide) fn by(&self) -> Option<(Contact, [f32; 2])> {
        self.by
    }

    /// The contact, and the separation of its points now, that comes of their ways from there, if there is one within the step: of other
    /// pieces of the two, or of the body and another static. The one given is that of their free ways.
    pub(in crate::collide) fn touch(
        &self,
        tile: &Tile,
        (bodies, contact): (Pair, &Contact),
        setup: &Setup,
    ) -> Option<(Contact, [f32; 2])> {
        let pair = Approach::of_pieces(tile, bodies, contact.piece_numbers(), setup);
        self.touch_of(pair, Some(contact), setup)
    }

    /// The same with a segment of a chain, in the place of that which a static is.
    pub(in crate::collide) fn touch_segment(
        &self,
        tile: &Tile,
        (bodies, numbers): (Pair, [usize; 2]),
        segment: &Piece,
        setup: &Setup,
    ) -> Option<(Contact, [f32; 2])> {
        let mut pair = Approach::of_pieces(tile, bodies, numbers, setup);
        let moves = [pair.a.moves(), pair.b.moves()];
        for (piece, moves) in pair.pieces.as_mut()?.iter_mut().zip(moves) {
            *piece = if moves { piece } else { segment };
        }
        self.touch_of(pair, None, setup)
    }

    fn touch_of(&self, mut pair: Approach<'_>, known: Option<&Contact>, setup: &Setup) -> Option<(Contact, [f32; 2])> {
        let (offset, turned) = (pair.offset, [pair.a.turning(self.time), pair.b.turning(self.time)]);
        pair.offset += pair.between * self.time;
        for ((side, turned), way) in [&mut pair.a, &mut pair.b].into_iter().zip(turned).zip(self.ways) {
            side.rotation = turned.after(side.rotation);
            if side.moves() {
                (side.velocity, side.angular_velocity) = (way.velocity, way.angular_velocity);
            }
        }
        pair.offset += pair.out(self.lift);
        pair.between = pair.b.velocity - pair.a.velocity;
        let at = pair.over_corner(pair.meets(max(setup.params.dt - self.time, 0.0), setup)?);
        let (found, mut separation) = pair.contact(&at, known, setup)?;
        // As the rows of the solver will see the first part of the way.
        let moved = dot(pair.offset - offset, found.normal);
        for (now, point) in separation.iter_mut().zip(found.points()) {
            let out = found.normal * (0.5 * max(point.separation, 0.0));
            let arms = [point.anchor - out, point.anchor + out - found.offset];
            let on_a = pair.a.swing(turned[0], at.turning_a.unrotate(arms[0]), found.normal);
            let on_b = pair.b.swing(turned[1], at.turning_b.unrotate(arms[1]), found.normal);
            *now -= moved + (on_b - on_a);
        }
        Some((found, separation))
    }
}

/// Which of two [orders](Stopped::order) is the sooner one.
pub(in crate::collide) fn sooner(one: [f32; 2], other: [f32; 2]) -> Ordering {
    one[0].total_cmp(&other[0]).then(one[1].total_cmp(&other[1]))
}

impl Approach<'_> {
    /// The moment in which they touch, if that is within so many seconds.
    fn meets(&self, dt: f32, setup: &Setup) -> Option<Moment> {
        let reach = setup.params.speculative_distance + self.far(dt);
        let mut at = self.at(0.0, reach);
        let is_straight = self.is_straight(dt);
        let near = if is_straight { 0.0 } else { self.scale() * NEAR };
        // Who glides along must not seem to touch what the search did not come to the end of.
        for _ in 0..SEARCHES {
            let nearest = at.manifold.nearest()?.separation;
            let is_distance = at.manifold.is_distance();
            if nearest < near && !is_distance {
                return Some(at);
            }
            let touches;
            (at, touches) = self.first_touch(&at, reach, dt);
            if !touches {
                return None;
            }
            if is_straight {
                return Some(at);
            }
        }
        None
    }

    /// What points from A to B as seen from the body that moves: from the static to that. Of two that move, as it is; and so back again.
    fn out(&self, normal: Vec2) -> Vec2 {
        if self.b.moves() { normal } else { -normal }
    }

    /// How they go on if nothing stops them.
    fn ways(&self) -> [Way; 2] {
        let way = |side: &Side<'_>| Way { velocity: side.velocity, angular_velocity: side.angular_velocity };
        match [self.a.moves(), self.b.moves()] {
            [true, false] => [way(&self.a); 2],
            [false, _] => [way(&self.b); 2],
            _ => [&self.a, &self.b].map(way),
        }
    }

    /// How they go on from where they touch, as if both were smooth, and how fast they came nearer.
    fn stop(&self, at: &Moment) -> Option<([Way; 2], f32)> {
        let nearest = at.manifold.nearest()?.anchor;
        let closing = max(self.closing(at, nearest), 0.0);
        let ways = if self.a.moves() && self.b.moves() {
            self.glide(at, (nearest, closing))
        } else {
            [self.stop_at_static(at, (nearest, closing)); 2]
        };
        Some((ways, closing))
    }

    /// How two that move go on from the point in which they touch, closing so fast: each sees the other glide over its surface. That turns no
    /// more, or it would come into the way; what else they do is for the next step.
    fn glide(&self, at: &Moment, (anchor, closing): (Vec2, f32)) -> [Way; 2] {
        let turning = turn(self.b.angular_velocity, anchor - at.offset) - turn(self.a.angular_velocity, anchor);
        let glide = self.between + turning + at.manifold.normal * closing;
        [Vec2::ZERO, glide].map(|velocity| Way { velocity, angular_velocity: 0.0 })
    }

    /// How the one of the two that moves goes on from the point in which it touches the static, closing so fast.
    fn stop_at_static(&self, at: &Moment, (anchor, closing): (Vec2, f32)) -> Way {
        let out = self.out(at.manifold.normal);
        let (body, center) = if self.a.moves() { (&self.a, Vec2::ZERO) } else { (&self.b, at.offset) };
        let [inv_mass, inv_inertia] = [body.kind.root_inv_mass, body.kind.root_inv_inertia].map(|root| root * root);
        let arm = |anchor: Vec2| cross(anchor - center, out);
        let changed = |speed: f32, turn: f32| Way {
            velocity: body.velocity + out * speed,
            angular_velocity: body.angular_velocity + turn,
        };
        if let [one, two] = at.manifold.points()
            && max(one.separation, two.separation) < self.scale() * TOUCHING
            && inv_inertia > 0.0
        {
            // It comes down flat.
            let [closing_of_one, closing_of_two] = [one, two].map(|point| max(self.closing(at, point.anchor), 0.0));
            let turn = (closing_of_two - closing_of_one) / (arm(two.anchor) - arm(one.anchor));
            if turn.is_finite() {
                return changed(closing_of_one - turn * arm(one.anchor), turn);
            }
        }
        let arm = arm(anchor);
        let impulse = closing / (inv_mass + inv_inertia * arm * arm);
        changed(inv_mass * impulse, inv_inertia * arm * impulse)
    }
}
