//! `single-island`: boxes and circles as wide as each other, laid like bricks between two walls in a low heap, so that
//! all are connected from the first step on, and stay so.
//!
//! Bodies take one draw each: the kind.

use super::lattice::block;
use super::random::SplitMix64;
use super::{Layout, random_kind, statics, table};
use atoll_core::{Body, GlobalId, Kind, Rot, Shape, StaticBody};
use glam::{DVec2, Vec2};

/// Width of every body, and between centers at the start, in meters: all of a row touch.
const WIDTH: f64 = 0.4;
/// Between the uppermost row and the top of the domain, in meters.
const HEADROOM: f64 = 1.0;
/// So many times as wide as high: bodies deep down in a high heap are pressed far into each other.
const ASPECT: u64 = 40;
/// Draws of one body.
const DRAWS: u64 = 1;

/// The layout of `single-island`.
#[derive(Debug)]
pub(super) struct SingleIsland {
    bodies: u64,
    columns: u64,
    rows: u64,
}

impl SingleIsland {
    pub(super) fn new(bodies: u64) -> Self {
        let rows = (bodies / ASPECT).isqrt().max(1);
        let columns = bodies.div_ceil(rows);
        Self { bodies, columns, rows: bodies.div_ceil(columns) }
    }
}

impl Layout for SingleIsland {
    fn bodies(&self) -> u64 {
        self.bodies
    }

    fn kinds(&self) -> Vec<Kind> {
        table([Shape::rectangle(WIDTH as f32, WIDTH as f32), Shape::circle(0.5 * WIDTH as f32)])
    }

    fn domain(&self) -> (DVec2, DVec2) {
        // Half a body more than a row: every other one is shifted by so much.
        (DVec2::ZERO, DVec2::new(WIDTH * (self.columns as f64 + 0.5), WIDTH * self.rows as f64 + HEADROOM))
    }

    fn statics(&self) -> Vec<StaticBody> {
        let (low, high) = self.domain();
        statics::open_box(low, high)
    }

    fn body(&self, index: u64, id: GlobalId, seed: u64) -> Body {
        let mut random = SplitMix64::after(seed, DRAWS * index);
        let kind = random_kind(&mut random);
        let (column, row) = (index % self.columns, index / self.columns);
        let shift = if row % 2 == 1 { 0.5 } else { 0.0 };
        let position = DVec2::new(column as f64 + 0.5 + shift, row as f64 + 0.5) * WIDTH;
        Body { id, position, rotation: Rot::IDENTITY, velocity: Vec2::ZERO, angular_velocity: 0.0, kind }
    }

    fn extent(&self, first: u64, last: u64) -> (DVec2, DVec2) {
        let [rows, columns] = block(first, last, self.columns);
        // Every other row is shifted by half a body.
        let place = |end: usize, x: f64| DVec2::new(columns[end] as f64 + x, rows[end] as f64 + 0.5) * WIDTH;
        (place(0, 0.5), place(1, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_closed_and_stand_on_each_other_for_any_number() {
        for bodies in [1, 2, 3, 7, 100, 2001] {
            let heap = SingleIsland::new(bodies);
            assert!(heap.columns * heap.rows >= bodies && heap.columns * (heap.rows - 1) < bodies);
            let (low, high) = heap.domain();
            let place = |index| heap.body(index, GlobalId(3 + index), 9).position;
            for index in 0..bodies {
                let here = place(index);
                let half = DVec2::splat(0.5 * WIDTH - 1e-9);
                assert!((here - half).cmpge(low).all() && (here + half).cmple(high).all(), "{here}");
                if index % heap.columns > 0 {
                    assert!((here.x - place(index - 1).x - WIDTH).abs() < 1e-9 && here.y == place(index - 1).y);
                }
                if index >= heap.columns {
                    let below = place(index - heap.columns);
                    assert!((here.y - below.y - WIDTH).abs() < 1e-9 && (here.x - below.x).abs() < 0.5 * WIDTH + 1e-9);
                }
            }
        }
    }
}
