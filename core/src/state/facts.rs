//! What a world looks like at its end: counted per tile in f64, added up in tile order.

use super::figures::Overlaps;
use crate::collide::narrow_phase::Contacts;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use bytemuck::{Pod, Zeroable};

/// The facts of one tile; plain data, so that ranks can gather them as bytes.
#[derive(Clone, Copy, PartialEq, Default, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct TileFacts {
    /// The tile, as in [`crate::TileId`].
    pub tile: u64,
    /// Bodies it owns.
    pub bodies: u64,
    /// Touching manifolds (a point nearer than the speculative distance), each counted by one tile.
    pub contacts: u64,
    /// Those of them between bodies of two tiles.
    pub border_contacts: u64,
    /// Contact points that overlap.
    pub overlaps: u64,
    /// Sum of their depths, in meters.
    pub penetration: f64,
    /// The deepest, in meters.
    pub max_penetration: f64,
    /// Contact points looked at after the last solve, if it was measured ([`crate::World::measure_next_step`]).
    pub solved_points: u64,
    /// Sum of the speeds at which their surfaces still came nearer than they may, in m/s.
    pub violation: f64,
    /// The greatest of these, in m/s.
    pub max_violation: f64,
    /// Sum of masses, in kg.
    pub mass: f64,
    /// Energy of motion, rotation included, in J.
    pub kinetic_energy: f64,
    /// Sum over bodies of v^2 / 2, in m^2/s^2.
    pub half_v2: f64,
    /// Sum over bodies of the squared angular velocity, in rad^2/s^2.
    pub spin2: f64,
    /// Sum of mass times velocity, in kg m/s.
    pub momentum: [f64; 2],
}

impl TileFacts {
    /// Measures a tile whose contacts were just found at its bodies' positions.
    pub(crate) fn measure(tile: &Tile, contacts: &Contacts, setup: &Setup) -> Self {
        let mut facts = Self { tile: u64::from(tile.id.0), bodies: tile.owned as u64, ..Self::default() };
        let bodies = &tile.bodies;
        for i in 0..tile.owned {
            let kind = setup.kind(bodies.kind[i]);
            let (velocity, spin) = (bodies.velocity[i].as_dvec2(), f64::from(bodies.angular_velocity[i]));
            let (mass, inertia) = (f64::from(kind.mass), f64::from(kind.inertia));
            let half_v2 = 0.5 * (velocity.x * velocity.x + velocity.y * velocity.y);
            facts.mass += mass;
            facts.half_v2 += half_v2;
            facts.spin2 += spin * spin;
            facts.kinetic_energy += mass * half_v2 + 0.5 * inertia * spin * spin;
            facts.momentum[0] += mass * velocity.x;
            facts.momentum[1] += mass * velocity.y;
        }
        let violation = tile.violation;
        (facts.solved_points, facts.violation, facts.max_violation) = (violation.points, violation.sum, violation.max);
        let found = Overlaps::among(tile, contacts, 0..tile.contacts.own(), setup);
        (facts.contacts, facts.border_contacts) = (found.contacts, found.border_contacts);
        (facts.overlaps, facts.penetration, facts.max_penetration) = (found.points, found.depth, found.most);
        facts
    }
}

/// The facts of a whole world.
#[derive(Clone, Copy, PartialEq, Default, Debug)]
pub struct Facts {
    /// Dynamic bodies.
    pub bodies: u64,
    /// Touching manifolds.
    pub contacts: u64,
    /// Those between bodies of two tiles.
    pub border_contacts: u64,
    /// Contact points that overlap.
    pub overlaps: u64,
    /// Their mean depth, in meters.
    pub mean_penetration: f64,
    /// The deepest, in meters.
    pub max_penetration: f64,
    /// Mean speed at which contact points still came nearer than they may after the last solve, in m/s; zero if not
    /// measured.
    pub mean_violation: f64,
    /// The greatest, in m/s.
    pub max_violation: f64,
    /// Mass, in kg.
    pub mass: f64,
    /// Energy of motion, rotation included, in J.
    pub kinetic_energy: f64,
    /// Mean over bodies of v^2 / 2, in m^2/s^2.
    pub mean_half_v2: f64,
    /// Mean over bodies of the squared angular velocity, in rad^2/s^2.
    pub mean_spin2: f64,
    /// Momentum, in kg m/s.
    pub momentum: [f64; 2],
}

impl Facts {
    /// Adds the tiles up, in the order of their names whatever order they come in.
    pub fn total(tiles: impl IntoIterator<Item = TileFacts>) -> Self {
        let mut tiles: Vec<_> = tiles.into_iter().collect();
        tiles.sort_unstable_by_key(|tile| tile.tile);
        let mut total = Self::default();
        let (mut penetration, mut half_v2, mut spin2) = (0.0, 0.0, 0.0);
        let (mut solved_points, mut violation) = (0, 0.0);
        for tile in &tiles {
            total.bodies += tile.bodies;
            total.contacts += tile.contacts;
            total.border_contacts += tile.border_contacts;
            total.overlaps += tile.overlaps;
            penetration += tile.penetration;
            total.max_penetration = f64::max(total.max_penetration, tile.max_penetration);
            solved_points += tile.solved_points;
            violation += tile.violation;
            total.max_violation = f64::max(total.max_violation, tile.max_violation);
            total.mass += tile.mass;
            total.kinetic_energy += tile.kinetic_energy;
            half_v2 += tile.half_v2;
            spin2 += tile.spin2;
            total.momentum[0] += tile.momentum[0];
            total.momentum[1] += tile.momentum[1];
        }
        let mean = |sum: f64, count: u64| if count > 0 { sum / count as f64 } else { 0.0 };
        total.mean_penetration = mean(penetration, total.overlaps);
        total.mean_violation = mean(violation, solved_points);
        total.mean_half_v2 = mean(half_v2, total.bodies);
        total.mean_spin2 = mean(spin2, total.bodies);
        total
    }
}
