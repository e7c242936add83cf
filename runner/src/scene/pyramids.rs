//! `pyramids`: a square of pyramids of boxes, each row of them on a floor of its own. They stand.
//!
//! Pyramids are filled one after another, the lowest row of boxes first. Bodies take no draws: every seed gives the same
//! world.

use super::lattice::block;
use super::{Layout, statics, table};
use atoll_core::{Body, GlobalId, Kind, KindId, Rot, Shape, StaticBody};
use glam::{DVec2, Vec2};

/// Side of a box, in meters.
const SIDE: f64 = 1.0;
/// Between boxes of a row, in meters: near enough to count as contacts, and they do not press.
const GAP: f64 = 0.01;
/// Between the lowest rows of neighbouring pyramids, and around all of them, in meters.
const SPACE: f64 = 1.0;
/// Thickness of the floors, in meters.
const FLOOR: f64 = 1.0;
/// Between the top of a pyramid and the floor above, in meters.
const HEADROOM: f64 = 2.0;

/// The layout of `pyramids`.
#[derive(Debug)]
pub(super) struct Pyramids {
    bodies: u64,
    base: u64,
    /// Pyramids along x, and floors along y, of which the uppermost may be empty.
    side: u64,
}

impl Pyramids {
    pub(super) fn new(bodies: u64, base: u64) -> Self {
        let pyramids = bodies.div_ceil(Self::boxes(base));
        let root = pyramids.isqrt();
        Self { bodies, base, side: if root * root < pyramids { root + 1 } else { root } }
    }

    /// Boxes of a pyramid with so many at its base.
    fn boxes(base: u64) -> u64 {
        base * (base + 1) / 2
    }

    /// From one pyramid to the next, along each axis, in meters.
    fn pitch(&self) -> DVec2 {
        let base = self.base as f64;
        DVec2::new(base * SIDE + (base - 1.0) * GAP + SPACE, FLOOR + base * SIDE + HEADROOM)
    }

    /// Row and place in the row of a box of a pyramid.
    fn row(&self, index: u64) -> (u64, u64) {
        let (mut row, mut place) = (0, index);
        while place >= self.base - row {
            place -= self.base - row;
            row += 1;
        }
        (row, place)
    }
}

impl Layout for Pyramids {
    fn bodies(&self) -> u64 {
        self.bodies
    }

    fn kinds(&self) -> Vec<Kind> {
        table([Shape::rectangle(SIDE as f32, SIDE as f32)])
    }

    fn domain(&self) -> (DVec2, DVec2) {
        let size = self.pitch() * self.side as f64 + DVec2::new(SPACE, 0.0);
        let low = DVec2::new(0.0, -FLOOR);
        (low, low + size)
    }

    fn statics(&self) -> Vec<StaticBody> {
        let (low, high) = self.domain();
        let floor = |row: u64| {
            let top = self.pitch().y * row as f64;
            statics::wall(GlobalId(row), DVec2::new(low.x, top - FLOOR), DVec2::new(high.x, top))
        };
        (0..self.side).map(floor).collect()
    }

    fn body(&self, index: u64, id: GlobalId, _seed: u64) -> Body {
        let (pyramid, box_) = (index / Self::boxes(self.base), index % Self::boxes(self.base));
        let corner = self.pitch() * DVec2::new((pyramid % self.side) as f64, (pyramid / self.side) as f64);
        let (row, place) = self.row(box_);
        // Each row starts half a box further in.
        let x = SPACE + 0.5 * SIDE + (SIDE + GAP) * (0.5 * row as f64 + place as f64);
        let position = corner + DVec2::new(x, SIDE * (row as f64 + 0.5));
        let (rotation, velocity) = (Rot::IDENTITY, Vec2::ZERO);
        Body { id, position, rotation, velocity, angular_velocity: 0.0, kind: KindId(0) }
    }

    fn extent(&self, first: u64, last: u64) -> (DVec2, DVec2) {
        let pyramid = |body: u64| body / Self::boxes(self.base);
        let [rows, columns] = block(pyramid(first), pyramid(last), self.side);
        let corner =
            |end: usize, more: u64| self.pitch() * DVec2::new((columns[end] + more) as f64, (rows[end] + more) as f64);
        (corner(0, 0), corner(1, 1) + DVec2::X * SPACE)
    }
}

#[cfg(test)]
mod tests {
    use super::super::statics::rectangle;
    use super::*;

    fn place(pyramids: &Pyramids, index: u64) -> DVec2 {
        pyramids.body(index, GlobalId(index), 1).position
    }

    #[test]
    fn twenty_two_thousand_boxes_are_twenty_by_twenty_pyramids() {
        let pyramids = Pyramids::new(22_000, 10);
        assert_eq!((pyramids.side, Pyramids::boxes(10), pyramids.statics().len()), (20, 55, 20));
        assert_eq!(place(&pyramids, 0), DVec2::new(1.5, 0.5));
        assert_eq!(place(&pyramids, 54), DVec2::new(1.5 + 4.5 * 1.01, 9.5));
        assert_eq!(place(&pyramids, 55).y, 0.5);
        assert_eq!(place(&pyramids, 20 * 55), DVec2::new(1.5, 13.5));
    }

    #[test]
    fn boxes_of_a_row_leave_a_gap_and_rows_touch() {
        for base in [2, 3, 10, 100] {
            let pyramids = Pyramids::new(Pyramids::boxes(base), base);
            assert_eq!(pyramids.side, 1);
            for index in 1..Pyramids::boxes(base) {
                let (last, this) = (place(&pyramids, index - 1), place(&pyramids, index));
                let expected =
                    if this.y == last.y { (this.x - last.x - SIDE - GAP).abs() } else { this.y - last.y - SIDE };
                assert!(expected.abs() < 1e-9, "base {base}: {last} {this}");
            }
            assert_eq!(pyramids.row(Pyramids::boxes(base) - 1), (base - 1, 0));
        }
    }

    #[test]
    fn any_number_stands_on_floors_and_pyramids_keep_apart() {
        for (bodies, base, side) in [(1, 10, 1), (55, 10, 1), (56, 10, 2), (300, 10, 3), (7, 2, 2), (1000, 4, 10)] {
            let pyramids = Pyramids::new(bodies, base);
            assert_eq!(pyramids.side, side, "{bodies} bodies");
            let (low, high) = pyramids.domain();
            let floors: Vec<_> = pyramids.statics().iter().map(rectangle).collect();
            for index in 0..bodies {
                let place = place(&pyramids, index);
                assert!((place - 0.5).cmpgt(low).all() && (place + 0.5).cmplt(high).all(), "{place}");
                let floor = (index / Pyramids::boxes(base) / side) as usize;
                assert!(place.y - 0.5 * SIDE >= floors[floor].1.y, "{place} is below its floor");
                assert!(floors.get(floor + 1).is_none_or(|above| place.y + 1.0 < above.0.y), "{place}: no headroom");
            }
            if bodies > Pyramids::boxes(base) {
                // The last of the lowest row and the first of the next pyramid.
                let (last, next) = (place(&pyramids, base - 1), place(&pyramids, Pyramids::boxes(base)));
                assert!((next.x - last.x - SIDE - SPACE).abs() < 1e-9 || side == 1, "{last} {next}");
            }
        }
    }
}
