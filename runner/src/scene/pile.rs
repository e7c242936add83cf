//! `pile`: rows of boxes and circles that drop onto a floor between two walls and settle to one island.
//!
//! Bodies take two draws each, in this order: kind, shift along x.

use super::lattice::block;
use super::random::SplitMix64;
use super::{Layout, mixture, random_kind, statics};
use atoll_core::{Body, GlobalId, Kind, Rot, StaticBody};
use glam::{DVec2, Vec2};

/// Between centers at the start, in meters.
const SPACING: f64 = 0.5;
/// Center of the first body, in meters.
const FIRST: DVec2 = DVec2::new(0.5, 0.3);
/// Draws of one body.
const DRAWS: u64 = 2;

/// The layout of `pile`.
#[derive(Debug)]
pub(super) struct Pile {
    bodies: u64,
    columns: u64,
    rows: u64,
    jitter: f64,
}

impl Pile {
    pub(super) fn new(bodies: u64, jitter: f64) -> Self {
        let rows = (bodies / 2).isqrt().max(1);
        Self { bodies, columns: bodies.div_ceil(rows), rows, jitter }
    }
}

impl Layout for Pile {
    fn bodies(&self) -> u64 {
        self.bodies
    }

    fn kinds(&self) -> Vec<Kind> {
        mixture()
    }

    fn domain(&self) -> (DVec2, DVec2) {
        (DVec2::ZERO, DVec2::new(SPACING * self.columns as f64 + 0.5, SPACING * self.rows as f64 + 1.0))
    }

    fn statics(&self) -> Vec<StaticBody> {
        let (low, high) = self.domain();
        statics::open_box(low, high)
    }

    fn body(&self, index: u64, id: GlobalId, seed: u64) -> Body {
        let mut random = SplitMix64::after(seed, DRAWS * index);
        let kind = random_kind(&mut random);
        let shift = random.within(self.jitter);
        let (column, row) = (index % self.columns, index / self.columns);
        let position = FIRST + DVec2::new(SPACING * column as f64 + shift, SPACING * row as f64);
        Body { id, position, rotation: Rot::IDENTITY, velocity: Vec2::ZERO, angular_velocity: 0.0, kind }
    }

    fn extent(&self, first: u64, last: u64) -> (DVec2, DVec2) {
        let [rows, columns] = block(first, last, self.columns);
        let place = |end: usize| FIRST + DVec2::new(columns[end] as f64, rows[end] as f64) * SPACING;
        (place(0) - DVec2::X * self.jitter, place(1) + DVec2::X * self.jitter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twenty_thousand_bodies_are_two_hundred_by_one_hundred() {
        let pile = Pile::new(20_000, 0.01);
        assert_eq!((pile.columns, pile.rows), (200, 100));
        assert_eq!(pile.domain(), (DVec2::ZERO, DVec2::new(100.5, 51.0)));
        assert_eq!(pile.body(0, GlobalId(3), 1).position.y, 0.3);
        assert_eq!(pile.body(200, GlobalId(203), 1).position.y, 0.8);
    }

    #[test]
    fn bodies_start_free_of_the_walls_for_any_number() {
        for bodies in [1, 2, 3, 7, 100, 2001] {
            let pile = Pile::new(bodies, 0.01);
            assert!(pile.columns * pile.rows >= bodies);
            let (low, high) = pile.domain();
            for index in 0..bodies {
                let place = pile.body(index, GlobalId(3 + index), 9).position;
                assert!(place.x - 0.2 > low.x && place.x + 0.2 < high.x, "{place}");
                assert!(place.y - 0.2 > low.y && place.y + 0.2 < high.y, "{place}");
            }
        }
    }
}
