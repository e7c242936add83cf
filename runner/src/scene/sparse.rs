//! `sparse`: the mixture of `rooms` at a fourth of its density in one walled square, flying in all directions without
//! gravity. Few bodies touch at a time, and those that do are many small islands.
//!
//! Bodies take four draws each, in this order: kind, velocity along x, velocity along y, angular velocity.

use super::lattice::Lattice;
use super::random::SplitMix64;
use super::{Layout, mixture, random_kind, statics};
use atoll_core::{Body, GlobalId, Kind, Rot, StaticBody};
use glam::{DVec2, Vec2};

/// Area for each body, in square meters: four times that of `rooms`.
const AREA: f64 = 8.4;
/// Thickness of the walls, in meters. They stand inside the border of the square.
const WALL: f64 = 2.0;
/// Between the border of the square and the outermost centers at the start, in meters.
const INSET: f64 = 2.5;
/// Components of the velocities lie in plus or minus this, in m/s.
const SPEED: f64 = 20.0;
/// Angular velocities lie in plus or minus this, in rad/s.
const SPIN: f64 = 5.0;
/// Draws of one body.
const DRAWS: u64 = 4;

/// With fewer bodies, at this density, the walls would leave them little space.
pub(crate) const LEAST_BODIES: u64 = 100;

/// The layout of `sparse`.
#[derive(Debug)]
pub(super) struct Sparse {
    bodies: u64,
    lattice: Lattice,
    /// Side of the square, in meters.
    side: f64,
}

impl Sparse {
    pub(super) fn new(bodies: u64) -> Self {
        Self { bodies, lattice: Lattice::of(bodies), side: (AREA * bodies as f64).sqrt() }
    }

    /// Where a body starts, in meters.
    fn position(&self, body: u64) -> DVec2 {
        DVec2::from(self.lattice.relative(body).map(|r| INSET + r * (self.side - 2.0 * INSET)))
    }
}

impl Layout for Sparse {
    fn bodies(&self) -> u64 {
        self.bodies
    }

    fn kinds(&self) -> Vec<Kind> {
        mixture()
    }

    fn domain(&self) -> (DVec2, DVec2) {
        (DVec2::ZERO, DVec2::splat(self.side))
    }

    fn statics(&self) -> Vec<StaticBody> {
        let (low, high) = self.domain();
        statics::room(0, low, high, WALL).to_vec()
    }

    fn body(&self, index: u64, id: GlobalId, seed: u64) -> Body {
        let mut random = SplitMix64::after(seed, DRAWS * index);
        let kind = random_kind(&mut random);
        let velocity = Vec2::new(random.within(SPEED) as f32, random.within(SPEED) as f32);
        let angular_velocity = random.within(SPIN) as f32;
        Body { id, position: self.position(index), rotation: Rot::IDENTITY, velocity, angular_velocity, kind }
    }

    fn extent(&self, first: u64, last: u64) -> (DVec2, DVec2) {
        self.lattice.corners(first, last).map(|body| self.position(body)).into()
    }
}

#[cfg(test)]
mod tests {
    use super::super::statics::rectangle;
    use super::*;

    #[test]
    fn bodies_start_apart_inside_the_walls_and_fly_everywhere() {
        for bodies in [LEAST_BODIES, 1000, 20_001] {
            let sparse = Sparse::new(bodies);
            let walls = sparse.statics();
            assert!(walls.len() == 4 && (rectangle(&walls[3]).1 - sparse.side).length() < 1e-3);
            let free = (DVec2::splat(WALL + 0.2), DVec2::splat(sparse.side - WALL - 0.2));
            let mut quadrants = [0_u64; 4];
            for index in 0..bodies {
                let body = sparse.body(index, GlobalId(4 + index), 1);
                assert!(body.position.cmpge(free.0).all() && body.position.cmple(free.1).all(), "{body:?}");
                assert!(
                    body.velocity.abs().cmple(Vec2::splat(SPEED as f32)).all() && body.angular_velocity.abs() <= 5.0
                );
                quadrants[usize::from(body.velocity.x > 0.0) + 2 * usize::from(body.velocity.y > 0.0)] += 1;
            }
            assert!(quadrants.iter().all(|&count| count > bodies / 8), "{quadrants:?}");
            let lattice = (sparse.side - 2.0 * INSET) / sparse.lattice.side as f64;
            assert!(lattice > 2.0, "{bodies} bodies start {lattice} m apart");
        }
    }

    #[test]
    fn it_is_a_fourth_as_dense_as_rooms() {
        let rooms = super::super::rooms::Rooms::new(700_000, 1.0);
        let area = |layout: &dyn Layout| {
            let (low, high) = layout.domain();
            (high - low).element_product() / layout.bodies() as f64
        };
        let ratio = area(&Sparse::new(100_000)) / area(&rooms);
        assert!((ratio - 4.0).abs() < 0.05, "{ratio}");
    }
}
