//! Who of a tile's bodies is pushed by forces in the step under way.

use crate::model::body::Body;
use crate::model::id::GlobalId;
use crate::model::kind::KindRow;
use crate::model::math::{max, min};
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::Vec2;
use rustc_hash::FxHashMap;

/// What pushes at a body in a step: in N, and about its center in N m.
#[derive(Clone, Copy, PartialEq, Default, Debug)]
pub(crate) struct Load {
    pub(crate) force: Vec2,
    pub(crate) torque: f32,
}

/// A body of a tile that is pushed, owned or a ghost.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Push {
    pub(crate) body: u32,
    id: GlobalId,
    /// Velocity and angular velocity gained in a substep, in m/s and rad/s.
    pub(crate) gain: [f32; 3],
}

impl Load {
    pub(crate) fn add(&mut self, other: Self) {
        self.force += other.force;
        self.torque += other.torque;
    }

    /// In m/s^2, and rad/s^2.
    fn acceleration(self, kind: &KindRow) -> (Vec2, f32) {
        (self.force * kind.inv_mass, kind.turning(self.torque / kind.inertia))
    }

    /// The part of it that acts in every substep. Contacts are made of what comes as near as the speculative distance, moving as it does
    /// as the step begins: a tenth of that is left to gravity.
    fn steady(self, kind: &KindRow, setup: &Setup) -> f32 {
        let ((linear, angular), substeps) = (self.acceleration(kind), setup.params.integrations() as f32);
        let gained = (linear.length() + angular.abs() * kind.bounding_radius) * setup.params.dt;
        let way = gained * 0.5 * (substeps + 1.0) * setup.h;
        min(0.9 * setup.params.speculative_distance / max(way, f32::MIN_POSITIVE), 1.0)
    }

    /// What the rest of it makes of a body at once.
    pub(crate) fn strike(self, body: Body, setup: &Setup) -> Body {
        let kind = setup.kind(body.kind);
        let ((linear, angular), time) = (self.acceleration(kind), (1.0 - self.steady(kind, setup)) * setup.params.dt);
        Body {
            velocity: body.velocity + linear * time,
            angular_velocity: body.angular_velocity + angular * time,
            ..body
        }
    }

    fn push(self, body: u32, id: GlobalId, kind: &KindRow, setup: &Setup) -> Push {
        let ((linear, angular), time) = (self.acceleration(kind), self.steady(kind, setup) * setup.h);
        Push { body, id, gain: [linear.x * time, linear.y * time, angular * time] }
    }
}

impl Tile {
    /// Before the first sync point: pushes a body that has its place.
    pub(crate) fn push_at(&mut self, place: u32, load: &Load, setup: &Setup) {
        let Body { id, kind, .. } = self.at(place);
        self.pushes.push(load.push(place, id, setup.kind(kind), setup));
    }

    /// After it: finds those that came, and ghosts. Of a tile that has changed, or where one is not where it was, as it left, or all were
    /// sorted anew, every body is looked at.
    pub(crate) fn aim(&mut self, loads: &FxHashMap<GlobalId, Load>, has_changed: bool, setup: &Setup) {
        let (bodies, owned, dynamic) = (&self.bodies, self.owned, self.owned + self.ghosts());
        let known = self.pushes.len();
        self.pushes.retain(|push| bodies.id[..owned].get(push.body as usize) == Some(&push.id));
        let all = if has_changed || self.pushes.len() < known { 0..dynamic } else { owned..dynamic };
        for body in all.map(|body| body as u32).chain(self.newcomers.iter().copied()) {
            let (id, kind) = (bodies.id[body as usize], bodies.kind[body as usize]);
            if let Some(load) = loads.get(&id) {
                self.pushes.push(load.push(body, id, setup.kind(kind), setup));
            }
        }
        self.pushes.sort_unstable_by_key(|push| push.body);
        self.pushes.dedup_by_key(|push| push.body);
    }

    /// What a body gains in a substep by forces, if it is pushed.
    #[inline(always)]
    pub(crate) fn gain(&self, body: usize) -> Option<[f32; 3]> {
        if self.pushes.is_empty() {
            return None;
        }
        let found = self.pushes.binary_search_by_key(&(body as u32), |push| push.body);
        found.ok().map(|place| self.pushes[place].gain)
    }
}
