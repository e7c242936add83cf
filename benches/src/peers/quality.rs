//! What the end of a run looks like, measured by the same code for every engine.

use super::Failure;
use super::case::Case;
use ::atoll_core::{Body, Facts, TileId, World};
use serde::{Deserialize, Serialize};

/// Figures of a final state.
#[derive(Clone, Copy, PartialEq, Default, Debug, Serialize, Deserialize)]
pub struct Quality {
    /// Pairs of bodies that touch: some point nearer than Atoll's speculative distance.
    pub contacts: u64,
    /// Energy of motion, rotation included, in J.
    pub kinetic_energy: f64,
    /// The same by the mass of all bodies, in J/kg.
    pub kinetic_energy_per_kg: f64,
    /// Mean over bodies of v^2 / 2, in m^2/s^2.
    pub mean_half_v2: f64,
    /// Mean depth of the contact points that overlap, in meters.
    pub mean_penetration: f64,
    /// The deepest, in meters.
    pub max_penetration: f64,
    /// Bodies outside of the rectangle they must not leave.
    pub escaped: u64,
}

/// Measures the final bodies of an engine.
///
/// # Errors
/// If a state is not finite or a body is missing.
pub fn measure(case: &Case, bodies: &[Body]) -> Result<Quality, Failure> {
    let (scene, blueprint) = (&case.plan.scene, &case.plan.blueprint);
    if bodies.len() as u64 != scene.bodies() {
        let message = format!("{} of {} bodies are left at the end", bodies.len(), scene.bodies());
        return Err(Failure::broken(message));
    }
    let tiles: Vec<TileId> = (0..blueprint.partition.tiles() as u32).map(TileId).collect();
    // What moved on a path stands where it has come to.
    let mut blueprint = blueprint.clone();
    for fixed in &mut blueprint.statics {
        (fixed.position, fixed.rotation) = fixed.pose(case.steps, blueprint.params.dt);
        fixed.path = None;
    }
    let mut world = World::new(&blueprint, &tiles).map_err(Failure::broken)?;
    for &body in bodies {
        world.add(body).map_err(|error| Failure::broken(format!("at the end: {error}")))?;
    }
    let tiles = atoll_core::finish(world, &mut atoll_core::Loopback).map_err(Failure::broken)?;
    let facts = Facts::total(tiles);
    Ok(Quality {
        contacts: facts.contacts,
        kinetic_energy: facts.kinetic_energy,
        kinetic_energy_per_kg: facts.kinetic_energy / facts.mass,
        mean_half_v2: facts.mean_half_v2,
        mean_penetration: facts.mean_penetration,
        max_penetration: facts.max_penetration,
        escaped: bodies.iter().filter(|body| scene.has_escaped(body)).count() as u64,
    })
}
