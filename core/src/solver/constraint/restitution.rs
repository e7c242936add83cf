//! Restitution: points that came in fast and pressed get part of their speed back, once, after the last substep.

use super::approach::{Approach, Meeting};
use super::bounce::{Answer, Parting, Passing};
use super::columns::Columns;
use super::groups::{Bounce, Groups, Lane, Times};
use super::rows::Source;
use crate::islands::union_find::{join, root_of};
use crate::model::contact::Contact;
use crate::model::kind::KindRow;
use crate::model::math::{dot, max, min, right_perp, turn};
use crate::model::params::Exchange;
use crate::parallel::lanes::Quad;
use crate::solver::batches::{Batch, Batches};
use crate::solver::bodies::SolverBodies;
use glam::Vec2;

/// At most so many passes over contacts that bounce, and over those with statics after that.
const PASSES: usize = 8;
const PASSES_OFF_STATICS: usize = 200;

/// The part of the speed at which a contact closed that a pass may leave wrong.
const EXACT: f32 = 1e-5;

/// What takes so many times the speed at which bodies came nearer is more than that takes, however the solver rounds.
const SURELY: f32 = 1.001;

/// A heavy body that comes in gives a light one twice its own speed, at most, and that a lighter one twice that.
const PASSED_ON: f32 = 4.0;

/// In so many steps gravity gives what lies in a pile the speed at which it may come nearer and part.
const STILL: f32 = 4.0;

impl Groups {
    /// Finds the contacts that may bounce, in the order in which they do in each batch; with blows that come from elsewhere: the
    /// contact, ascending, and the speed in m/s.
    pub(crate) fn find_bounces(&mut self, batches: &Batches, source: Source<'_>, heard: &[(u32, f32)]) {
        self.bounces.clear();
        self.bouncing.clear();
        self.bounces_at_once.clear();
        self.energies.clear();
        let threshold = source.setup.params.least_bounce();
        for (i, contact) in source.tile.contacts.contacts.iter().enumerate() {
            let kinds = source.kinds_of(i);
            let restitution = max(kinds[0].material.restitution, kinds[1].material.restitution);
            if restitution > 0.0 && self.is_solved(i as u32) {
                let mut answers = [Answer::Hold; 2];
                let mut fastest = f32::NEG_INFINITY;
                for (point, answer) in answers.iter_mut().enumerate().take(contact.point_count()) {
                    let Meeting { closing, slip, lead: [lead, slides], push } = source.meeting(i, point);
                    fastest = max(fastest, closing);
                    *answer = if closing > threshold {
                        let speed = max(restitution * closing + lead, 0.0);
                        Answer::Part(Parting { closing: closing + lead, slip, speed, slides })
                    } else if source.holds(i, point, closing) {
                        Answer::Hold
                    } else {
                        let least = SURELY * max(closing, 0.0) + source.fall(i) + push;
                        let lost = (restitution - 1.0) * source.contacts.separation[i][point];
                        Answer::NotYet(Passing { closing, lost, least, most: max(-closing, 0.0), held: false })
                    };
                }
                self.add_bounce(i, (fastest, answers), source, batches);
            }
        }
        if !heard.is_empty() || self.bounces.iter().chain(&self.bounces_at_once).any(Bounce::parts) {
            self.leave_held(source);
            self.leave_unstruck(source, heard);
            self.hold_beside(batches, source);
        } else {
            self.bounces.clear();
            self.bounces_at_once.clear();
        }
        self.bouncing.extend(self.bounces.iter().map(|bounce| (bounce.contact, bounce.blow, bounce.passes_on())));
        self.bouncing.sort_unstable_by_key(|(contact, ..)| *contact);
        let name = |bounce: &Bounce| source.tile.pair_of(source.tile.contacts.keys[bounce.contact as usize]);
        if source.setup.params.exchange == Exchange::Substep {
            // By names: then both tiles that solve a contact at their border come to the same, if they know the same.
            self.bounces.sort_by_cached_key(name);
            self.bounces_at_once.sort_by_cached_key(name);
        }
        // Who comes in faster first: that may be all it takes, where several throw the same body back.
        let first = |bounce: &Bounce, other: &Bounce| other.closing.total_cmp(&bounce.closing);
        let Self { bounces, bounces_at_once, lanes, energies, late, on, .. } = self;
        late.find([bounces, bounces_at_once], heard.is_empty(), source);
        let batch = |bounce: &Bounce| lanes[bounce.contact as usize].base;
        bounces.sort_by(first);
        bounces_at_once.sort_by(|one, other| batch(one).cmp(&batch(other)).then_with(|| first(one, other)));
        if !(bounces.is_empty() && bounces_at_once.is_empty()) {
            energies.find([bounces, bounces_at_once], lanes, on, source);
        }
    }

    fn add_bounce(
        &mut self,
        contact: usize,
        (closing, answers): (f32, [Answer; 2]),
        source: Source<'_>,
        batches: &Batches,
    ) {
        let mut moving = source.moving(contact);
        let moving = [moving.next(), moving.next()];
        let off_static = moving[1].is_none();
        let at_once = batches.of_body(self.lanes[contact].base as usize).at_once;
        let bounces = if at_once { &mut self.bounces_at_once } else { &mut self.bounces };
        bounces.push(Bounce {
            contact: contact as u32,
            moving,
            closing,
            blow: 0.0,
            left: 0.0,
            rise: 0.0,
            off_static,
            answers,
        });
    }

    /// Contacts that never bounce hold, too, beside what parts or passes on: what pressed there against a blow that is given back would
    /// throw the body that lies between the two.
    fn hold_beside(&mut self, batches: &Batches, source: Source<'_>) {
        for (i, contact) in source.tile.contacts.contacts.iter().enumerate() {
            let kinds = source.kinds_of(i);
            let is_dead = kinds.iter().all(|kind| kind.material.restitution == 0.0);
            let is_beside = || source.moving(i).any(|body| self.struck[body as usize].0);
            if is_dead && is_beside() && self.is_solved(i as u32) {
                let speeds = (0..contact.point_count()).map(|point| source.meeting(i, point).closing);
                let fastest = speeds.fold(f32::NEG_INFINITY, max);
                self.add_bounce(i, (fastest, [Answer::Hold; 2]), source, batches);
            }
        }
    }

    /// Has points hold that are not to bounce yet, but where both bodies fly. What presses there in a pile is not a blow alone, but also
    /// what lies above: without it that would be thrown down, and what bounces off would have more energy than there was. But no load
    /// presses where they moved apart: there a blow came within the step, and they are to come nearer as fast as that at most, which
    /// gives no energy.
    fn leave_held(&mut self, source: Source<'_>) {
        let Self { bounces, bounces_at_once, held, .. } = self;
        let sides = |contact: usize| source.contacts.bodies[contact].map(|body| body as usize);
        let asked = bounces.iter().chain(&*bounces_at_once).filter(|bounce| bounce.passes_on());
        let mut asked = asked.peekable();
        if asked.peek().is_none() {
            return;
        }
        held.clear();
        held.resize(source.tile.bodies.len(), None);
        for contact in asked.map(|bounce| bounce.contact as usize) {
            for (body, kind) in sides(contact).into_iter().zip(source.kinds_of(contact)) {
                held[body] = (kind.inv_mass > 0.0).then_some(false);
            }
        }
        for (i, contact) in source.tile.contacts.contacts.iter().enumerate() {
            let mut points = 0..contact.point_count();
            if sides(i).iter().any(|&body| held[body] == Some(false))
                && points.any(|point| source.holds(i, point, source.meeting(i, point).closing))
            {
                sides(i).into_iter().for_each(|body| held[body] = held[body].and(Some(true)));
            }
        }
        let is_held = |bounce: &Bounce| sides(bounce.contact as usize).iter().any(|&body| held[body] == Some(true));
        for bounce in bounces.iter_mut().chain(bounces_at_once).filter(|bounce| is_held(bounce)) {
            let fall = source.fall(bounce.contact as usize);
            for answer in &mut bounce.answers {
                match answer {
                    Answer::NotYet(passing) if passing.most > fall => passing.held = true,
                    Answer::NotYet(_) => *answer = Answer::Hold,
                    _ => {}
                }
            }
        }
    }

    /// And those that no blow comes to, from one to the next, from where something comes in fast: who comes slowly is stopped, with all that
    /// lies on him. Passed on, that would come as slowly in each step, and be stopped as often.
    ///
    /// What only holds is left out of it all, but beside what parts or passes on.
    fn leave_unstruck(&mut self, source: Source<'_>, heard: &[(u32, f32)]) {
        let Self { bounces, bounces_at_once, on, struck, .. } = self;
        join_all(on, source, bounces.iter().chain(&*bounces_at_once).filter(|bounce| bounce.passes_on()));
        struck.clear();
        struck.resize(source.tile.bodies.len(), (false, 0.0));
        for bounce in bounces.iter().chain(&*bounces_at_once).filter(|bounce| bounce.parts()) {
            for body in bounce.moving() {
                struck[body as usize].0 = true;
                let fastest = &mut struck[root_of(on, body) as usize].1;
                *fastest = max(*fastest, bounce.closing);
            }
        }
        for bounce in bounces.iter().filter(|bounce| bounce.passes_on()) {
            let first = heard.partition_point(|(contact, _)| *contact < bounce.contact);
            let of_contact = heard[first..].iter().take_while(|(contact, _)| *contact == bounce.contact);
            if let Some(speed) = of_contact.map(|(_, speed)| *speed).reduce(max) {
                bounce.moving().for_each(|body| {
                    let fastest = &mut struck[root_of(on, body) as usize].1;
                    *fastest = max(*fastest, speed);
                });
            }
        }
        for bounces in [&mut *bounces, &mut *bounces_at_once] {
            for bounce in bounces.iter_mut().filter(|bounce| bounce.parts() || bounce.passes_on()) {
                bounce.blow = bounce.moving().map(|body| struck[root_of(on, body) as usize].1).fold(0.0, max);
                for answer in &mut bounce.answers {
                    if let Answer::NotYet(passing @ Passing { held: false, .. }) = answer {
                        passing.most = PASSED_ON * bounce.blow;
                        if passing.is_stuck(bounce.blow, source.setup) {
                            *answer = Answer::Hold;
                        }
                    }
                }
            }
            for bounce in bounces.iter_mut().filter(|bounce| bounce.blow == 0.0) {
                bounce.answers.iter_mut().filter(|answer| answer.passes_on()).for_each(|answer| *answer = Answer::Hold);
            }
        }
        for bounce in bounces.iter().chain(&*bounces_at_once).filter(|bounce| bounce.passes_on()) {
            bounce.moving().for_each(|body| struck[body as usize].0 = true);
        }
        for bounces in [bounces, bounces_at_once] {
            bounces.retain(|bounce| bounce.moving().any(|body| struck[body as usize].0));
        }
    }

    /// Whether a contact whose batch keeps its rows is among those.
    pub(crate) fn may_bounce(&self, contact: u32) -> bool {
        self.blow(contact) >= 0.0
    }

    /// Speed of the blow that such a contact gives back or passes on, in m/s; less than zero if it does not bounce.
    pub(crate) fn blow(&self, contact: u32) -> f32 {
        self.bouncing_of(contact).map_or(-1.0, |(_, blow, _)| *blow)
    }

    /// Whether a contact could pass on a blow that comes from elsewhere, as far as is known: it does not only part, or hold.
    pub(crate) fn may_pass_on(&self, contact: u32) -> bool {
        self.bouncing_of(contact).is_none_or(|(.., passes_on)| *passes_on)
    }

    fn bouncing_of(&self, contact: u32) -> Option<&(u32, f32, bool)> {
        let place = self.bouncing.binary_search_by_key(&contact, |(contact, ..)| *contact);
        place.ok().map(|place| &self.bouncing[place])
    }

    /// Bounces of all batches that keep their rows.
    pub(crate) fn apply_restitution(&mut self, bodies: &mut SolverBodies) {
        let Self { bounces, lanes, kept, energies, late, times, .. } = self;
        late.begin(bounces, lanes, kept, bodies);
        energies.keep(None, lanes, kept, bodies, |rows, velocity| bounce(bounces, lanes, rows, velocity, times));
        late.make_good(bodies);
    }

    /// Bounces of a batch that is solved at once.
    pub(crate) fn apply_restitution_at_once(&mut self, batch: &Batch, bodies: &mut SolverBodies) {
        let Self { bounces_at_once: bounces, lanes, at_once, energies, late, times, .. } = self;
        let before =
            |place: usize| bounces.partition_point(|bounce| (lanes[bounce.contact as usize].base as usize) < place);
        let own = before(batch.bodies.start)..before(batch.bodies.end);
        let bounces = &mut bounces[own];
        late.begin(bounces, lanes, at_once, bodies);
        energies.keep(Some(batch), lanes, at_once, bodies, |rows, velocity| {
            bounce(bounces, lanes, rows, &mut velocity[..batch.bodies.end], times);
        });
        late.make_good(bodies);
    }
}

/// For each body of the tile a lower one that it bounces off, or that one, or itself.
pub(super) fn join_all<'b>(on: &mut Vec<u32>, source: Source<'_>, bounces: impl Iterator<Item = &'b Bounce>) {
    on.clear();
    on.extend(0..source.tile.bodies.len() as u32);
    for bounce in bounces {
        if let [Some(one), Some(other)] = bounce.moving {
            join(on, [one, other]);
        }
    }
}

impl Bounce {
    /// Those of its bodies that are no statics.
    pub(super) fn moving(&self) -> impl Iterator<Item = u32> {
        self.moving.into_iter().flatten()
    }

    pub(super) fn parts(&self) -> bool {
        self.answers.iter().any(|answer| matches!(answer, Answer::Part(_)))
    }

    fn passes_on(&self) -> bool {
        self.answers.iter().any(Answer::passes_on)
    }
}

impl Answer {
    fn passes_on(&self) -> bool {
        matches!(self, Self::NotYet(_))
    }
}

/// Passes over contacts that may bounce, in their order, while one changes anything: who bounces off two others at once comes to the
/// speeds that both want after several, and off two statics with normals that are nearly one after many, which are few contacts. An
/// impulse changes the energy by half of itself times the sum of the speeds at which its point parts before and after. So with
/// restitution 1 nothing is lost or gained where each point parts as fast as it came.
///
/// A contact is passed over while nothing has moved its bodies since it let them be.
fn bounce(bounces: &[Bounce], lanes: &[Lane], columns: &mut Columns, velocity: &mut [Quad], times: &mut Times) {
    let Some(first) = bounces.iter().map(|bounce| lanes[bounce.contact as usize].base as usize).min() else { return };
    let Times { moved, looked } = times;
    moved.clear();
    moved.resize(velocity.len() - first, 0);
    looked.clear();
    looked.resize(bounces.len(), 0);
    let mut time = 0;
    let mut pass = |looked: &mut u32, bounce: &Bounce| {
        let at = lanes[bounce.contact as usize];
        let (sides, points, totals, lane) = at.totals_mut(columns);
        let places = sides.places(lane).map(|place| at.base as usize + place);
        if places.iter().all(|&place| moved[place - first] < *looked) {
            return false;
        }
        time += 1;
        *looked = time;
        let least = EXACT * max(bounce.closing, 0.0);
        let acts = sides.bounce(points, totals, lane, bounce.answers, least, at.bodies_mut(velocity));
        if acts {
            places.into_iter().filter(|&place| velocity[place][3] != 0.0).for_each(|place| moved[place - first] = time);
        }
        acts
    };
    let mut acts = |all: bool| {
        let which = bounces.iter().zip(&mut *looked).filter(|(bounce, _)| all || bounce.off_static);
        which.fold(false, |acts, (bounce, looked)| pass(looked, bounce) | acts)
    };
    if (0..PASSES).all(|_| acts(true)) {
        let _ = (0..PASSES_OFF_STATICS).all(|_| acts(false));
    }
}

impl<'a> Source<'a> {
    fn kinds_of(self, contact: usize) -> [&'a KindRow; 2] {
        self.contacts.bodies[contact].map(|body| self.setup.kind(self.tile.bodies.kind[body as usize]))
    }

    /// Those of its bodies that are no statics.
    pub(super) fn moving(self, contact: usize) -> impl Iterator<Item = u32> {
        let sides = self.contacts.bodies[contact].into_iter().zip(self.kinds_of(contact));
        sides.filter(|(_, kind)| kind.inv_mass > 0.0).map(|(body, _)| body)
    }

    /// What gravity gives the bodies of a contact in [`STILL`] steps, in m/s.
    fn fall(self, contact: usize) -> f32 {
        let params = &self.setup.params;
        let scales = self.kinds_of(contact).map(|kind| kind.dynamics.gravity_scale.abs());
        STILL * max(scales[0], scales[1]) * params.gravity.length() * params.dt
    }

    /// Whether a point that comes nearer at that speed, in m/s, held its bodies in the last step, and does so yet: they come nearer or
    /// part slowly, as what lies in a pile does. Without gravity nothing lies.
    fn holds(self, contact: usize, point: usize, closing: f32) -> bool {
        let is_slow = || {
            let fall = self.fall(contact);
            closing.abs() <= fall + min(self.setup.params.restitution_threshold, 2.0 * fall)
        };
        self.tile.contacts.contacts[contact].points[point].normal_impulse > 0.0 && is_slow()
    }

    /// How a point's surfaces meet, or are about to.
    fn meeting(self, contact: usize, point: usize) -> Meeting {
        let (approach, slip, axes) = self.approach(contact, point);
        let [a_falls, b_falls] = self.kinds_of(contact).map(|kind| kind.inv_mass > 0.0);
        let gain = if a_falls && b_falls { Vec2::ZERO } else { self.bodies.static_gain_in(contact as u32) };
        if gain == Vec2::ZERO {
            let closing = if approach.closing > 0.0 { approach.touching() } else { approach.closing };
            return Meeting { closing, slip, lead: [0.0; 2], push: 0.0 };
        }
        let gain = if a_falls { -gain } else { gain };
        approach.of_oscillating(axes.map(|axis| dot(gain, axis)), slip, self.setup)
    }

    /// How a body's surface moves as the step begins, so far from its center, where a belt runs along this direction.
    pub(super) fn surface_velocity(self, body: usize, arm: Vec2, along: Vec2) -> Vec2 {
        let (bodies, setup) = (&self.tile.bodies, self.setup);
        let belt = along * setup.kind(bodies.kind[body]).material.surface_speed;
        bodies.velocity[body] + turn(bodies.angular_velocity[body], arm) + belt
    }

    /// How a point's surfaces come nearer, how fast they slide along each other, and normal and tangent.
    pub(super) fn approach(self, contact: usize, point: usize) -> (Approach, f32, [Vec2; 2]) {
        let (bodies, setup, [a, b]) = (&self.tile.bodies, self.setup, self.contacts.bodies[contact]);
        let separation = max(self.contacts.separation[contact][point], 0.0);
        let Contact { normal, offset, points, .. } = &self.tile.contacts.contacts[contact];
        let (anchor, tangent) = (points[point].anchor, right_perp(*normal));
        let motion = |body: u32, arm: Vec2, runs: f32| {
            let i = body as usize;
            let kind = setup.kind(bodies.kind[i]);
            let falls = kind.inv_mass > 0.0;
            let gravity = if falls { setup.params.gravity * kind.dynamics.gravity_scale } else { Vec2::ZERO };
            (self.surface_velocity(i, arm, tangent * runs), gravity)
        };
        let ((velocity_a, gravity_a), (velocity_b, gravity_b)) =
            (motion(a, anchor, 1.0), motion(b, anchor - offset, -1.0));
        let (velocity, gravity) = (velocity_b - velocity_a, gravity_b - gravity_a);
        let approach = Approach { separation, closing: -dot(velocity, *normal), pull: -dot(gravity, *normal) };
        (approach, dot(velocity, tangent), [*normal, tangent])
    }
}
