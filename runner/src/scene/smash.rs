//! `smash`: a wall of small boxes at rest, without gravity, and one large and heavy box that flies into it. The scene of that
//! name in the benchmarks of Box2D (E. Catto), at any size.
//!
//! The large box has index 0; those of the wall follow column by column. Bodies take no draws: every seed gives the same world.

use super::lattice::block;
use super::{Layout, table};
use atoll_core::{Body, GlobalId, Kind, KindId, Material, Rot, Shape, StaticBody};
use glam::{DVec2, Vec2};

/// Side of a box of the wall, in meters. They touch.
const SIDE: f64 = 0.4;
/// From the middle of the domain's left quarter to the first column, in meters.
const AWAY: f64 = 30.0;
/// The large box: side in meters, density in kg/m^2, where it starts, in meters, and how fast it comes, in m/s.
const LARGE: f64 = 8.0;
const DENSITY: f32 = 8.0;
const START: DVec2 = DVec2::new(-20.0, 0.0);
const SPEED: f32 = 40.0;
/// What is hit flies: so much room there is around the wall, in its widths.
const ROOM: f64 = 6.0;

/// The layout of `smash`.
#[derive(Debug)]
pub(super) struct Smash {
    bodies: u64,
    /// Boxes in a column: two for three in a row.
    rows: u64,
}

impl Smash {
    pub(super) fn new(bodies: u64) -> Self {
        Self { bodies, rows: (bodies.saturating_sub(1) * 2 / 3).isqrt().max(1) }
    }

    /// Width and height of the wall, in meters.
    fn size(&self) -> DVec2 {
        let columns = self.bodies.saturating_sub(1).div_ceil(self.rows);
        DVec2::new(columns as f64, self.rows as f64) * SIDE
    }

    /// Where a box of the wall starts, in meters.
    fn place(&self, column: u64, row: u64) -> DVec2 {
        DVec2::new(AWAY + SIDE * column as f64, SIDE * (row as f64 - (self.rows / 2) as f64))
    }
}

impl Layout for Smash {
    fn bodies(&self) -> u64 {
        self.bodies
    }

    fn kinds(&self) -> Vec<Kind> {
        let mut kinds =
            table([Shape::rectangle(LARGE as f32, LARGE as f32), Shape::rectangle(SIDE as f32, SIDE as f32)]);
        kinds[0].material = Material { density: DENSITY, ..kinds[0].material };
        kinds
    }

    fn domain(&self) -> (DVec2, DVec2) {
        let (size, around) = (self.size(), ROOM * self.size().max_element().max(LARGE));
        let (low, high) = ((START.x - SIDE).min(AWAY - around), AWAY + size.x + around);
        (DVec2::new(low - LARGE, -around), DVec2::new(high, around))
    }

    fn statics(&self) -> Vec<StaticBody> {
        Vec::new()
    }

    fn body(&self, index: u64, id: GlobalId, _seed: u64) -> Body {
        let still = Body::at_rest(id, KindId(1), DVec2::ZERO);
        match index.checked_sub(1) {
            None => Body {
                kind: KindId(0),
                position: START,
                velocity: Vec2::new(SPEED, 0.0),
                rotation: Rot::IDENTITY,
                ..still
            },
            Some(small) => Body { position: self.place(small / self.rows, small % self.rows), ..still },
        }
    }

    fn extent(&self, first: u64, last: u64) -> (DVec2, DVec2) {
        let wall = (last > 0).then(|| {
            let [columns, rows] = block(first.max(1) - 1, last - 1, self.rows);
            [0, 1].map(|end| self.place(columns[end], rows[end]))
        });
        let large = (first == 0).then_some([START; 2]);
        let [low, high] = match (wall, large) {
            (Some(wall), Some(large)) => [wall[0].min(large[0]), wall[1].max(large[1])],
            (wall, large) => wall.or(large).expect("there is a first body"),
        };
        (low, high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_scene_of_box2d_at_its_size_and_like_it_at_others() {
        let smash = Smash::new(9601);
        assert_eq!((smash.rows, smash.size()), (80, DVec2::new(48.0, 32.0)));
        let place = |index| smash.body(index, GlobalId(index), 1).position;
        assert_eq!(
            [place(0), place(1), place(80), place(9600)].map(|place| place * 10.0).map(DVec2::round),
            [DVec2::new(-200.0, 0.0), DVec2::new(300.0, -160.0), DVec2::new(300.0, 156.0), DVec2::new(776.0, 156.0),]
        );
        for bodies in [1, 2, 3, 100, 20_000] {
            let smash = Smash::new(bodies);
            let (low, high) = smash.domain();
            for index in 0..bodies {
                let place = smash.body(index, GlobalId(index), 1).position;
                assert!((place - LARGE).cmpgt(low).all() && (place + LARGE).cmplt(high).all(), "{bodies}: {place}");
            }
        }
    }
}
