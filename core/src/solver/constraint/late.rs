//! What bounces lose of the step, made good where that can be told.
//!
//! A bounce comes at the end of the step, and until then who was stopped went along the surface that it met. Two free bodies that met
//! beside each other parted from elsewhere than they touched: up to a sixth of their angular momentum was lost at 60 Hz. So two bodies that touch
//! nobody else go on, once they have bounced, by what that changed of their velocities, for the rest of the step. Under gravity they part
//! slower, by what that takes of their speed until then.

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
}

impl Late {
    /// Finds the bounces whose bodies touch nobody else, and tells how long these go on.
    pub(super) fn find(&mut self, bounces: [&mut [Bounce]; 2], source: Source<'_>) {
        let Self { contacts, .. } = self;
        contacts.clear();
        if !bounces.iter().any(|bounces| bounces.iter().any(Bounce::parts)) {
            return;
        }
        contacts.resize(source.tile.bodies.len(), 0);
        for contact in 0..source.contacts.bodies.len() {
            source.moving(contact).for_each(|body| contacts[body as usize] = (contacts[body as usize] + 1).min(2));
        }
        for bounce in bounces.into_iter().flatten().filter(|bounce| bounce.parts()) {
            let is_alone = bounce.moving().all(|body| contacts[body as usize] == 1);
            if is_alone && !source.is_pushed(bounce.contact as usize) {
                bounce.go_on(source);
            }
        }
    }

    /// Notes the velocities of bodies that are to go on. They do so from where they touched: contacts are soft, and who was held for the rest
    /// of the step has sunk in a little.
    pub(super) fn begin(&mut self, bounces: &[Bounce], lanes: &[Lane], columns: &Columns, bodies: &mut SolverBodies) {
        self.before.clear();
        for bounce in bounces.iter().filter(|bounce| bounce.left > 0.0) {
            let at = lanes[bounce.contact as usize];
            let (sides, points, lane) = at.rows(columns);
            let (velocity, pose) = (at.bodies(&bodies.velocity), at.bodies_mut(&mut bodies.pose));
            let came = points.iter().filter(|point| point.first_separation[lane] >= 0.0);
            let sunk = came.map(|point| -sides.separation(point, lane, velocity, pose)).fold(0.0, max);
            sides.move_apart(lane, sunk, velocity, pose);
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
        let approaches = [0, 1].map(|point| match self.answers[point] {
            Answer::Part(_) => Some(source.approach(contact, point).0),
            _ => None,
        });
        let touch = approaches.iter().flatten().fold(f32::INFINITY, |first, approach| min(first, approach.time()));
        if touch > dt {
            return self.put_off();
        }
        let (left, mut fastest) = (dt - touch, (0.0, 0.0));
        let mut answers = self.answers;
        for (answer, approach) in answers.iter_mut().zip(&approaches) {
            let (Answer::Part(Parting { closing, speed, .. }), Some(approach)) = (answer, approach) else { continue };
            let taken = approach.pull * left;
            if *speed <= SURELY_UP * max(taken, 0.0) {
                return;
            }
            (*closing, *speed) = (*closing - taken, *speed - taken);
            if *speed > fastest.0 {
                fastest = (*speed, taken);
            }
        }
        // They part as fast as on the average from the touch on.
        let (speed, taken) = fastest;
        if speed > 0.0 {
            (self.answers, self.left) = (answers, left * (1.0 + 0.5 * taken / speed));
        }
    }

    /// The last substep looks beyond the step, and has stopped whom only the next one is to: that is taken back, all of it.
    fn put_off(&mut self) {
        let (least, most) = (f32::NEG_INFINITY, f32::INFINITY);
        let all = Answer::NotYet(Passing { closing: 0.0, lost: 0.0, least, most, held: false });
        self.answers.iter_mut().filter(|answer| matches!(answer, Answer::Part(_))).for_each(|answer| *answer = all);
    }
}
