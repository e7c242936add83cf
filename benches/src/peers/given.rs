//! What every engine is given: a world, and how many threads.

use ::atoll_core::{Blueprint, Body};

/// Low and high corner of a room.
pub type Corners = [[f64; 2]; 2];

/// A world before an engine has it.
pub trait Given {
    /// Everything but its bodies.
    fn blueprint(&self) -> &Blueprint;

    /// Its bodies, in the order of their ids.
    fn bodies(&self) -> impl Iterator<Item = Body>;

    /// The room of the body of that index: what is in another one never meets it.
    fn home(&self, index: u64) -> Corners;

    /// Threads to step it on.
    fn threads(&self) -> usize;

    /// Sum of the masses of the bodies, in kg.
    fn mass(&self) -> f64 {
        let kinds = &self.blueprint().kinds;
        let masses: Vec<f64> =
            kinds.iter().map(|kind| f64::from(kind.material.density) * f64::from(kind.shape.area())).collect();
        self.bodies().map(|body| masses[body.kind.0 as usize]).sum()
    }
}
