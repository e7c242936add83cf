//! What bounces lose of the step, made good where that can be told.
//!
//! A bounce comes at the end of the step, and until then who was stopped went along the surface that it met. Two free bodies that met
//! beside each other parted from elsewhere than they touched: up to a sixth of their angular momentum was lost at 60 Hz. So two bodies of a
//! tile, or one and a static, that touch nobody else go on, once they have bounced, by what that changed of their velocities, for the rest of
//! the step, but no further than the smaller one is thick. Under gravity they part slower, by what that takes of their speed until then.

use super::bounce::{Answer, Parting, Passing};
use super::columns::Columns;
use super::groups::{Bounce, Lane};
use super::rows::Source;
use crate::model::math::{max, min};
use crate::parallel::lanes::Quad;
use crate::solver::bodies::SolverBodies;

/// Who parts faster than so many times what gravity takes of that until the step ends does not come down again before.
const SURELY_UP: f32 = 2.0;

/// Bodies that bounce alone.
#[derive(Default, Debug)]
pub(super) struct Late {
    /// For each body of the tile how many contacts it has: none, one, or more.
    contacts: Vec<u8>,
    /// The solver's bodies that go on, for how long, in s, and their velocities before they bounce.
    before: Vec<(usize, f32, Quad)>,
    /// The contacts whose bodies have risen in this step.
    risen: Vec<u32>,
}

impl Late {
    /// Finds the bounces whose bodies touch nobody else, and tells how long these go on; for the first time in a step, or anew, once more has been heard.
    pub(super) fn find(&mut self, bounces: [&mut [Bounce]; 2], is_first: bool, source: Source<'_>) {
        let Self { contacts, risen, .. } = self;
        contacts.clear();
        if is_first {
            risen.clear();
        }
        risen.sort_unstable();
        if !bounces.iter().any(|bounces| bounces.iter().any(Bounce::parts)) {
            return;
        }
        contacts.resize(source.tile.bodies.len(), 0);
        for contact in 0..source.contacts.bodies.len() {
            source.moving(contact).for_each(|body| contacts[body as usize] = (contacts[body as usize] + 1).min(2));
        }
        for bounce in bounces.into_iter().flatten().filter(|bounce| bounce.parts()) {
            let is_alone = bounce.moving().all(|body| contacts[body as usize] == 1);
            if is_alone && !source.is_driven(bounce.contact as usize) {
                bounce.go_on(source);
                if risen.binary_search(&bounce.contact).is_ok() {
                    bounce.rise = 0.0;
                }
            }
        }
    }

    /// Notes the velocities of bodies that are to go on. They do so from where they touched: contacts are soft, and who was held for the rest
    /// of the step has sunk in a little.
    pub(super) fn begin(
        &mut self,
        bounces: &mut [Bounce],
        lanes: &[Lane],
        columns: &Columns,
        bodies: &mut SolverBodies,
    ) {
        self.before.clear();
        for bounce in bounces.iter_mut().filter(|bounce| bounce.left > 0.0) {
            let at = lanes[bounce.contact as usize];
            let (sides, points, lane) = at.rows(columns);
            let (velocity, pose) = (at.bodies(&bodies.velocity), at.bodies_mut(&mut bodies.pose));
            let came = points.iter().filter(|point| point.first_separation[lane] >= 0.0);
            let sunk = came.map(|point| -sides.separation(point, lane, velocity, pose)).fold(0.0, max);
            sides.move_apart(lane, sunk + bounce.rise, velocity, pose);
            // Once, however often they are asked to bounce.
            if std::mem::take(&mut bounce.rise) != 0.0 {
                self.risen.push(bounce.contact);
            }
            let places = bounce.moving().map(|body| bodies.places()[body as usize].get());
            self.before.extend(places.map(|place| (place, bounce.left, bodies.velocity[place])));
        }
    }

    /// Has them go on, once they have bounced.
    pub(super) fn make_good(&mut self, bodies: &mut SolverBodies) {
        self.before.drain(..).for_each(|(place, time, before)| bodies.go_on(place, before, time));
    }
}

impl Bounce {
    /// Notes how long its bodies go on, unless gravity brings them back by then.
    fn go_on(&mut self, source: Source<'_>) {
        let (contact, dt) = (self.contact as usize, source.setup.params.dt);
        let (mut touch, mut fastest, mut slowest, mut pull) = (f32::INFINITY, 0.0, f32::INFINITY, 0.0);
        for (point, answer) in self.answers.iter().enumerate() {
            if let Answer::Part(Parting { speed, .. }) = *answer {
                let approach = source.approach(contact, point).0;
                (touch, pull) = (min(approach.time(), touch), approach.pull);
                (fastest, slowest) = (max(speed, fastest), min(speed, slowest));
            }
        }
        if touch > dt {
            return self.put_off();
        }
        // Nobody knows who stands there.
        let left = min(dt - touch, source.inner_radius(contact) / fastest);
        let taken = pull * left;
        if slowest <= SURELY_UP * max(taken, 0.0) {
            return;
        }
        for answer in &mut self.answers {
            if let Answer::Part(Parting { closing, speed, .. }) = answer {
                (*closing, *speed) = (*closing - taken, *speed - taken);
            }
        }
        (self.left, self.rise) = (left, 0.5 * taken * left);
    }

    /// The last substep looks beyond the step, and has stopped whom only the next one is to: that is taken back, all of it.
    fn put_off(&mut self) {
        let (least, most) = (f32::NEG_INFINITY, f32::INFINITY);
        let all = Answer::NotYet(Passing { closing: 0.0, lost: 0.0, least, most, held: false });
        self.answers.iter_mut().filter(|answer| matches!(answer, Answer::Part(_))).for_each(|answer| *answer = all);
    }
}

impl Source<'_> {
    /// Of the smaller of a contact's bodies that move, in m.
    fn inner_radius(self, contact: usize) -> f32 {
        let inner = self.moving(contact).map(|body| self.setup.kind(self.tile.bodies.kind[body as usize]).inner_radius);
        inner.fold(f32::INFINITY, min)
    }
}
