//! Who is inside the sensors of a world.

use super::places::bounds;
use crate::collide::manifold::nearest;
use crate::model::body::Body;
use crate::model::id::GlobalId;
use crate::world::World;

impl World {
    /// The sensors among this world's bodies. Those among statics every world knows.
    pub fn sensors(&self) -> Vec<Body> {
        if !self.setup.kinds[..self.setup.dynamic_kinds].iter().any(|kind| kind.sensor) {
            return Vec::new();
        }
        self.bodies().filter(|body| self.setup.kind(body.kind).sensor).collect()
    }

    /// Who of this world's bodies is inside a sensor, between two steps: pairs of the sensor and the body, ascending. The sensors are
    /// all that are statics, and those given: with several ranks, [the sensors](Self::sensors) of all of them together; then the
    /// answers of all ranks, joined, are those of one rank that holds everything. Inside is whose shape has a point in common with the
    /// sensor's. No sensor is inside another; masks and groups hold as for contacts.
    pub fn inside_sensors(&self, moving: &[Body]) -> Vec<(GlobalId, GlobalId)> {
        let setup = &self.setup;
        let fixed = setup.statics_at(self.step).filter(|body| setup.kind(body.kind).sensor);
        let is_sensor = |body: &&Body| setup.has_kind(body.kind) && setup.kind(body.kind).sensor;
        let mut sensors: Vec<Body> = fixed.chain(moving.iter().filter(is_sensor).copied()).collect();
        sensors.sort_unstable_by_key(|sensor| sensor.id);
        sensors.iter().flat_map(|sensor| self.inside(sensor).into_iter().map(|body| (sensor.id, body))).collect()
    }

    /// Who of this world's bodies is inside one sensor, as [`inside_sensors`](Self::inside_sensors) tells it; nobody if it is no sensor.
    pub fn inside_sensor(&self, sensor: GlobalId, moving: &[Body]) -> Vec<GlobalId> {
        let setup = &self.setup;
        let fixed = setup.row_named(sensor).map(|row| setup.static_at(row, self.step));
        let found =
            fixed.or_else(|| moving.iter().find(|body| body.id == sensor && setup.has_kind(body.kind)).copied());
        found.filter(|found| setup.kind(found.kind).sensor).map_or_else(Vec::new, |found| self.inside(&found))
    }

    fn inside(&self, sensor: &Body) -> Vec<GlobalId> {
        let (setup, kind) = (&self.setup, self.setup.kind(sensor.kind));
        let mut found = Vec::new();
        self.visit_bodies(bounds(sensor, setup), |body| {
            let other = setup.kind(body.kind);
            if other.sensor || !kind.filter.admits(&other.filter) {
                return;
            }
            let offset = (body.position - sensor.position).as_vec2();
            let manifold = nearest(kind, sensor.rotation, other, body.rotation, offset, 0.0);
            if manifold.nearest().is_some_and(|point| point.separation <= 0.0) {
                found.push(body.id);
            }
        });
        found.sort_unstable();
        found
    }
}
