//! A body that something stops on its way, and what it touches then.

use super::{Approach, Moment, NEAR, TOUCHING};
use crate::collide::broad_phase::Pair;
use crate::collide::manifold::ManifoldPoint;
use crate::model::contact::Contact;
use crate::model::math::{cross, dot, max, min};
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::Vec2;

/// A search for a touch is begun so often, at most.
const SEARCHES: usize = 8;

/// How a body goes on from the moment in which it touches a static: along that, as if both were smooth and nothing bounced.
pub(in crate::collide) struct Stopped {
    /// That moment, from now, in s, as near as it was looked for; now, if they do not touch within the step.
    time: f32,
    /// The same exactly, and how far they are apart, in m, if they touch already or do not at all.
    order: [f32; 2],
    /// What holds the body off the surface from then on, in m.
    lift: Vec2,
    /// From then on.
    velocity: Vec2,
    angular_velocity: f32,
    /// The contact that stops it, and the separation of its points now.
    by: Option<(Contact, [f32; 2])>,
}

impl Stopped {
    /// The body of a pair that has such a contact, and of which the other is a static. None where nothing is known of them.
    pub(in crate::collide) fn new(tile: &Tile, (bodies, contact): (Pair, &Contact), setup: &Setup) -> Option<Self> {
        let (pair, dt) = (Approach::of_pieces(tile, bodies, contact.piece_numbers(), setup), setup.params.dt);
        // Speeds that overflow tell of no other moment.
        if !pair.far(dt).is_finite() {
            return None;
        }
        let body = if pair.a.moves() { &pair.a } else { &pair.b };
        let (mut velocity, mut angular_velocity) = (body.velocity, body.angular_velocity);
        let (at, order, separation, by);
        if let Some(then) = pair.meets(dt, setup) {
            let [speed, turn, closing] = pair.stop(&then)?;
            separation = then.manifold.nearest()?.separation;
            let is_now = then.time == 0.0;
            let left = if is_now || closing == 0.0 { 0.0 } else { separation / closing };
            order = [then.time + left, if is_now { separation } else { 0.0 }];
            velocity += pair.out(&then) * speed;
            angular_velocity += turn;
            by = pair.contact(&then, Some(contact), setup);
            at = then;
        } else {
            at = pair.at(0.0, f32::INFINITY);
            let [now, then] =
                [at, pair.at(dt, f32::INFINITY)].map(|at| at.manifold.nearest().map(|point| point.separation));
            separation = min(now?, then?);
            order = [f32::INFINITY, separation];
            by = None;
        }
        let lift = pair.out(&at) * max(2.0 * NEAR - separation, 0.0);
        Some(Self { time: at.time, order, lift, velocity, angular_velocity, by })
    }

    /// Ascending from who stops it first.
    pub(in crate::collide) fn order(&self) -> [f32; 2] {
        self.order
    }

    /// The contact that stops it, and the separation of its points now, if they touch within the step.
    pub(in crate::collide) fn by(&self) -> Option<(Contact, [f32; 2])> {
        self.by
    }

    /// The contact, and the separation of its points now, that the body makes with another static on its way from there, if it touches that
    /// within the step. The one given is that of its free way.
    pub(in crate::collide) fn touch(
        &self,
        tile: &Tile,
        (bodies, contact): (Pair, &Contact),
        setup: &Setup,
    ) -> Option<(Contact, [f32; 2])> {
        let mut pair = Approach::of_pieces(tile, bodies, contact.piece_numbers(), setup);
        let (offset, turned) = (pair.offset, [pair.a.turning(self.time), pair.b.turning(self.time)]);
        pair.offset += pair.between * self.time;
        for (side, turned) in [&mut pair.a, &mut pair.b].into_iter().zip(turned) {
            side.rotation = turned.after(side.rotation);
        }
        let (body, lift) = if pair.a.moves() { (&mut pair.a, -self.lift) } else { (&mut pair.b, self.lift) };
        (body.velocity, body.angular_velocity) = (self.velocity, self.angular_velocity);
        pair.offset += lift;
        pair.between = pair.b.velocity - pair.a.velocity;
        let at = pair.meets(max(setup.params.dt - self.time, 0.0), setup)?;
        let (found, mut separation) = pair.contact(&at, Some(contact), setup)?;
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

impl Approach<'_> {
    /// The moment in which they touch, if that is within so many seconds.
    fn meets(&self, dt: f32, setup: &Setup) -> Option<Moment> {
        let reach = setup.params.speculative_distance + self.far(dt);
        let mut at = self.at(0.0, reach);
        // Who glides along must not seem to touch what the search did not come to the end of.
        for _ in 0..SEARCHES {
            let nearest = at.manifold.nearest()?.separation;
            let is_distance = at.manifold.is_distance();
            if nearest < NEAR && !is_distance {
                return Some(at);
            }
            let touches;
            (at, touches) = self.first_touch(&at, reach, dt);
            if !touches {
                return None;
            }
        }
        None
    }
    /// Away from the static, of which the other is.
    fn out(&self, at: &Moment) -> Vec2 {
        if self.a.moves() { -at.manifold.normal } else { at.manifold.normal }
    }

    /// What stops the body where it touches the static: how much speed it gets out of that, and how much spin; and how fast the two came
    /// nearer.
    fn stop(&self, at: &Moment) -> Option<[f32; 3]> {
        let (points, out) = (at.manifold.points(), self.out(at));
        let (body, center) = if self.a.moves() { (&self.a, Vec2::ZERO) } else { (&self.b, at.offset) };
        let [inv_mass, inv_inertia] = [body.kind.root_inv_mass, body.kind.root_inv_inertia].map(|root| root * root);
        let of_point =
            |point: &ManifoldPoint| [max(self.closing(at, point.anchor), 0.0), cross(point.anchor - center, out)];
        let nearest = at.manifold.nearest()?;
        let [closing, arm] = of_point(nearest);
        if let [one, two] = points
            && max(one.separation, two.separation) < TOUCHING
            && inv_inertia > 0.0
        {
            // It comes down flat.
            let ([one, arm_of_one], [two, arm_of_two]) = (of_point(one), of_point(two));
            let turn = (two - one) / (arm_of_two - arm_of_one);
            if turn.is_finite() {
                return Some([one - turn * arm_of_one, turn, closing]);
            }
        }
        let impulse = closing / (inv_mass + inv_inertia * arm * arm);
        Some([inv_mass * impulse, inv_inertia * arm * impulse, closing])
    }
}
