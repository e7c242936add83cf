//! Restitution: points that came in fast and pressed get part of their speed back, once, after the last substep.

use super::groups::{Answer, Bounce, Groups};
use super::rows::Source;
use crate::collide::broad_phase::Pair;
use crate::model::contact::Contact;
use crate::model::math::{dot, max, turn};
use crate::solver::bodies::SolverBodies;
use glam::Vec2;

impl Groups {
    /// Finds the contacts that may bounce, in canonical order.
    pub(crate) fn find_bounces(&mut self, source: Source<'_>) {
        self.bounces.clear();
        for (i, contact) in source.contacts.cache.contacts.iter().enumerate() {
            let sides = source.contacts.bodies[i];
            let [a, b] =
                sides.map(|body| source.setup.kind(source.tile.bodies.kind[body as usize]).material.restitution);
            let restitution = max(a, b);
            if restitution > 0.0 && self.is_solved(i as u32) {
                let threshold = source.setup.params.restitution_threshold;
                let mut answers = [Answer::Rest; 2];
                for (point, answer) in answers.iter_mut().enumerate().take(contact.point_count()) {
                    let closing = closing_speed(source, sides, contact, point, source.contacts.separation[i][point]);
                    if closing > threshold {
                        *answer = Answer::Part(restitution * closing);
                    } else if closing < 0.0 && contact.points[point].normal_impulse == 0.0 {
                        *answer = Answer::NotYet(threshold);
                    }
                }
                if answers != [Answer::Rest; 2] {
                    self.bounces.push(Bounce { contact: i as u32, answers });
                }
            }
        }
    }

    /// Whether a contact is among those.
    pub(crate) fn may_bounce(&self, contact: u32) -> bool {
        self.bounces.binary_search_by_key(&contact, |bounce| bounce.contact).is_ok()
    }

    /// Some passes over them, in canonical order: who bounces off two others at once comes to the speeds that both want after
    /// several. An impulse changes the energy by half of itself times the sum of the speeds at which its point parts before and
    /// after. So with restitution 1 nothing is lost or gained where each point parts as fast as it came.
    pub(crate) fn apply_restitution(&mut self, bodies: &mut SolverBodies) {
        const PASSES: usize = 8;
        for _ in 0..PASSES {
            for bounce in &self.bounces {
                let at = self.lanes[bounce.contact as usize];
                let (sides, points, pressed, lane) = at.pressed_mut(&mut self.kept);
                sides.bounce(points, pressed, lane, bounce.answers, at.bodies_mut(&mut bodies.velocity));
            }
        }
    }
}

/// Speed at which a point's surfaces will come nearer as they touch, in m/s: that of now, and what a gravity that only one of
/// the bodies feels adds over the gap between them. Without that each bounce loses a step's fall.
fn closing_speed(source: Source<'_>, sides: Pair, contact: &Contact, point: usize, separation: f32) -> f32 {
    let (bodies, setup) = (&source.tile.bodies, source.setup);
    let anchor = contact.points[point].anchor;
    let motion = |body: u32, arm: Vec2| {
        let i = body as usize;
        let kind = setup.kind(bodies.kind[i]);
        let falls = kind.inv_mass > 0.0;
        let gravity = if falls { setup.params.gravity * kind.dynamics.gravity_scale } else { Vec2::ZERO };
        (bodies.velocity[i] + turn(bodies.angular_velocity[i], arm), gravity)
    };
    let ((velocity_a, gravity_a), (velocity_b, gravity_b)) =
        (motion(sides[0], anchor), motion(sides[1], anchor - contact.offset));
    let closing = -dot(velocity_b - velocity_a, contact.normal);
    let pull = -dot(gravity_b - gravity_a, contact.normal);
    if closing > 0.0 { max(closing * closing + 2.0 * pull * max(separation, 0.0), 0.0).sqrt() } else { closing }
}
