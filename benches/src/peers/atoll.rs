//! The scene in Atoll: all tiles in this process, messages delivered on the spot.

use super::given::Given;
use super::{Failure, Simulation};
use ::atoll_core::{Body, Kind, Loopback, World};

/// This version of Atoll.
pub fn version() -> String {
    // The workspace has one.
    env!("CARGO_PKG_VERSION").to_owned()
}

/// A scene in Atoll.
#[derive(Debug)]
pub struct Simulated {
    world: World,
    kinds: Vec<Kind>,
}

impl Simulated {
    /// Builds it; steps use the rayon pool they are called in.
    ///
    /// # Errors
    /// If the scene makes no world.
    pub fn new(given: &impl Given) -> Result<Self, Failure> {
        let blueprint = given.blueprint();
        let mut world = World::whole(blueprint).map_err(Failure::refused)?;
        for body in given.bodies() {
            world.add(body).map_err(Failure::refused)?;
        }
        Ok(Self { world, kinds: blueprint.kinds.clone() })
    }
}

impl Simulation for Simulated {
    fn step(&mut self) -> Result<(), String> {
        atoll_core::step(&mut self.world, &mut Loopback).map(|_| ()).map_err(|error| error.to_string())
    }

    fn mass(&self) -> f64 {
        let mass = |body: Body| {
            let kind = &self.kinds[body.kind.0 as usize];
            f64::from(kind.material.density) * f64::from(kind.shape.area())
        };
        self.world.bodies().map(mass).sum()
    }

    fn bodies(&self) -> Vec<Body> {
        let mut bodies: Vec<Body> = self.world.bodies().collect();
        bodies.sort_unstable_by_key(|body| body.id);
        bodies
    }
}
