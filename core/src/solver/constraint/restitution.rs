//! Restitution: points that came in fast and pressed get part of their speed back, once, after the last substep.

use super::groups::{Bounce, Groups};
use super::rows::Source;
use crate::collide::broad_phase::Pair;
use crate::model::contact::Contact;
use crate::model::math::{dot, max, turn};
use crate::solver::bodies::SolverBodies;
use crate::tiling::tile::Tile;
use glam::Vec2;

impl Groups {
    /// Finds the points that may bounce, in canonical order.
    pub(crate) fn find_bounces(&mut self, source: Source<'_>) {
        self.bounces.clear();
        for (i, contact) in source.contacts.cache.contacts.iter().enumerate() {
            let sides = source.contacts.bodies[i];
            let [a, b] =
                sides.map(|body| source.setup.kind(source.tile.bodies.kind[body as usize]).material.restitution);
            let restitution = max(a, b);
            if restitution > 0.0 && self.is_solved(i as u32) {
                for point in 0..contact.point_count() {
                    let closing = closing_speed(source.tile, sides, contact, point);
                    if closing > source.setup.params.restitution_threshold {
                        let (contact, point) = (i as u32, point as u32);
                        self.bounces.push(Bounce { contact, point, speed: restitution * closing });
                    }
                }
            }
        }
    }

    /// One pass over them, in canonical order.
    pub(crate) fn apply_restitution(&mut self, bodies: &mut SolverBodies) {
        for bounce in &self.bounces {
            let at = self.lanes[bounce.contact as usize];
            let (sides, points, lane) = at.rows_mut(&mut self.columns);
            let velocity = at.bodies_mut(&mut bodies.velocity);
            sides.bounce(&mut points[bounce.point as usize], lane, bounce.speed, velocity);
        }
    }
}

/// Speed at which a point's surfaces come nearer, in m/s.
fn closing_speed(tile: &Tile, [a, b]: Pair, contact: &Contact, point: usize) -> f32 {
    let anchor = contact.points[point].anchor;
    let velocity = |body: u32, arm: Vec2| {
        let i = body as usize;
        tile.bodies.velocity[i] + turn(tile.bodies.angular_velocity[i], arm)
    };
    -dot(velocity(b, anchor - contact.offset) - velocity(a, anchor), contact.normal)
}
