//! What may be done to a world between two steps, as values that can be sent, written down and repeated.

use super::World;
use super::forces::{Force, Load};
use super::locator::Place;
use crate::model::body::Body;
use crate::model::contact::SlotKind;
use crate::model::error::{BodyFault, SetupError};
use crate::model::id::{GlobalId, KindId};
use crate::model::kind::{Kind, KindRow};
use crate::model::math::cross;
use crate::model::params::Params;
use crate::model::path::Path;
use glam::{DVec2, Vec2};
use std::sync::Arc;

/// Something to be done to a world before its next step.
#[derive(Clone, PartialEq, Debug)]
pub enum Command {
    /// A body comes.
    Add(Body),
    /// The body of that name goes.
    Remove(GlobalId),
    /// A body moves otherwise from here on.
    SetVelocity {
        /// Whose.
        id: GlobalId,
        /// Of its center, in m/s.
        velocity: Vec2,
        /// In rad/s, counter-clockwise.
        angular_velocity: f32,
    },
    /// A body is struck.
    Impulse {
        /// Which.
        id: GlobalId,
        /// In N s.
        impulse: Vec2,
        /// Where, in the world, in m; none: at its center.
        at: Option<DVec2>,
        /// Beside that, about its center, in N m s, counter-clockwise.
        angular: f32,
    },
    /// A body is pushed through some steps: its velocity changes in every substep, as by gravity, and by force times time over mass in a
    /// step. What of it would move it, from rest, by more than nine tenths of [`Params::speculative_distance`] within one step comes as
    /// a blow, as that step begins: so it is known where it goes. Every rank keeps it for who bears that name in those steps, as bodies go
    /// from rank to rank, until that one is removed: begin it once the body is there.
    Force {
        /// Which.
        id: GlobalId,
        /// In N.
        force: Vec2,
        /// About its center, in N m, counter-clockwise.
        torque: f32,
        /// How many steps.
        steps: u64,
    },
    /// A body becomes one of another kind. Its contacts begin anew.
    SetKind {
        /// Which body.
        id: GlobalId,
        /// Row of the table.
        kind: KindId,
    },
    /// The table of kinds has one more row.
    AddKind(Kind),
    /// Gravity is this from here on, in m/s^2. Where it changes, everybody wakes.
    SetGravity(Vec2),
    /// A body, and what touches it, sleeps no longer.
    Wake(GlobalId),
}

impl World {
    /// Does something to the world, now: the next step begins with it done. Says whether it concerned a body of this world, or all.
    /// With several ranks give each the same commands in the same order, between the same two steps; then the result does not
    /// depend on how many they are.
    ///
    /// # Errors
    /// As [`check`](Self::check); as [`outcome`](Self::outcome), of a body of this world; and if a body is added whose name is taken.
    /// The world is left as it was.
    pub fn command(&mut self, command: &Command) -> Result<bool, SetupError> {
        self.check(command)?;
        match *command {
            Command::Add(body) => self.add(body),
            Command::Remove(id) => Ok(self.remove(id)),
            Command::SetVelocity { id, .. } | Command::Impulse { id, .. } | Command::Wake(id) => {
                self.change(id, |world, body| world.outcome(command, body))
            }
            Command::Force { id, force, torque, steps } => {
                let body = self.look_up(id).map(|Place { tile, at }| self.tiles[tile as usize].at(at));
                body.map_or(Ok(()), |body| self.outcome(command, body).map(drop))?;
                if steps > 0 {
                    self.forces.push(Force::new(id, Load { force, torque }, steps));
                }
                Ok(body.is_some())
            }
            Command::SetKind { id, .. } => {
                self.settle();
                self.forget_ghosts(id);
                let changed = self.change(id, |world, body| world.outcome(command, body))?;
                if let Some(Place { tile, at }) = self.look_up(id) {
                    let is_it = |slot| matches!(slot, SlotKind::Owned(index) if index == at as usize);
                    self.tiles[tile as usize].forget_contacts(|slot| is_it(slot.kind()));
                    self.places.forget_tile(tile as usize);
                }
                Ok(changed)
            }
            Command::AddKind(ref kind) => self.add_kind(kind).map(|_| true),
            Command::SetGravity(gravity) => {
                if gravity != self.gravity() {
                    Arc::make_mut(&mut self.setup).params.gravity = gravity;
                    self.tiles.iter_mut().for_each(|tile| tile.sleep.wake_all());
                }
                Ok(true)
            }
        }
    }

    /// Whether a command can be done at all; the same on every rank, as it asks for no body that there must be.
    ///
    /// # Errors
    /// If a number in it is not finite, a speed or gravity is beyond 1e9, it names a kind that there is not, or a body or kind that it adds
    /// is none.
    pub fn check(&self, command: &Command) -> Result<(), SetupError> {
        let finite = |id: GlobalId, are: bool| if are { Ok(()) } else { Err(SetupError::NotFinite { id }) };
        match *command {
            Command::Add(body) => {
                finite(body.id, !is_too_fast(&body))?;
                self.setup.check_body(&body)
            }
            Command::SetVelocity { id, velocity, angular_velocity } => {
                finite(id, velocity.is_finite() && angular_velocity.is_finite())
            }
            Command::Impulse { id, impulse, at, angular } => {
                finite(id, impulse.is_finite() && at.is_none_or(DVec2::is_finite) && angular.is_finite())
            }
            Command::Force { id, force, torque, .. } => finite(id, force.is_finite() && torque.is_finite()),
            Command::SetKind { id, kind } => {
                let fault = BodyFault::NoKind(kind);
                if self.setup.has_kind(kind) { Ok(()) } else { Err(SetupError::BadBody { id, fault }) }
            }
            Command::AddKind(ref kind) => self.setup.check_kind(kind),
            Command::SetGravity(gravity) => {
                let value = f64::from(gravity.abs().max_element());
                if value > MOST_GRAVITY {
                    let must = "at most 1e9 m/s^2 along an axis";
                    return Err(SetupError::BadParam { name: "gravity", value, must });
                }
                Params { gravity, ..self.setup.params.clone() }.check()
            }
            Command::Remove(_) | Command::Wake(_) => Ok(()),
        }
    }

    /// Gravity as it is now, in m/s^2.
    pub fn gravity(&self) -> Vec2 {
        self.setup.params.gravity
    }

    /// What a command that can be done makes of the body it is about, which may be another rank's: the same wherever it is worked
    /// out. A force leaves it as it is until the next step.
    ///
    /// # Errors
    /// If the velocities that it leads to, a force within one step, are beyond [`Path::FASTEST`].
    ///
    /// # Panics
    /// If there is no kind as that of the body, or the one that it is to become: [`check`](Self::check) tells.
    pub fn outcome(&self, command: &Command, body: Body) -> Result<Body, SetupError> {
        let kind = self.setup.kind(body.kind);
        let mut after = body;
        match *command {
            Command::SetVelocity { velocity, angular_velocity, .. } => {
                (after.velocity, after.angular_velocity) = (velocity, angular_velocity);
            }
            Command::Impulse { impulse, at, angular, .. } => strike(&mut after, kind, impulse, at, angular),
            Command::Force { force, torque, .. } => {
                let dt = self.setup.params.dt;
                strike(&mut after, kind, force * dt, None, torque * dt);
            }
            Command::SetKind { kind, .. } => after.kind = kind,
            Command::Add(_) | Command::Remove(_) | Command::AddKind(_) | Command::SetGravity(_) | Command::Wake(_) => {}
        }
        after.angular_velocity = self.setup.kind(after.kind).turning(after.angular_velocity);
        match command {
            _ if !after.is_finite() || is_too_fast(&after) && !is_too_fast(&body) => {
                Err(SetupError::NotFinite { id: body.id })
            }
            Command::Force { .. } => Ok(body),
            _ => Ok(after),
        }
    }

    /// Changes a body, which wakes; says whether it is here.
    pub(super) fn change(
        &mut self,
        id: GlobalId,
        change: impl FnOnce(&Self, Body) -> Result<Body, SetupError>,
    ) -> Result<bool, SetupError> {
        let Some(Place { tile, at }) = self.look_up(id) else { return Ok(false) };
        let body = change(self, self.tiles[tile as usize].at(at))?;
        self.tiles[tile as usize].change_at(at, body);
        Ok(true)
    }
}

/// Gravity that comes while a run goes on, along an axis, in m/s^2: what falls for long must have speeds that are numbers.
const MOST_GRAVITY: f64 = 1e9;

/// Whether it goes or turns faster than anything here may.
fn is_too_fast(body: &Body) -> bool {
    f64::from(body.velocity.abs().max_element().max(body.angular_velocity.abs())) > Path::FASTEST
}

/// What an impulse does to a body.
fn strike(body: &mut Body, kind: &KindRow, impulse: Vec2, at: Option<DVec2>, angular: f32) {
    let arm = at.map_or(Vec2::ZERO, |at| (at - body.position).as_vec2());
    body.velocity += impulse * kind.inv_mass;
    body.angular_velocity += (angular + cross(arm, impulse)) / kind.inertia;
}

#[cfg(test)]
mod tests;
