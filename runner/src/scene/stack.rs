//! `stack`: a tower of boxes on a floor. It stands, hardly sinks, and comes to rest.
//!
//! With two tiles along an axis their border runs through the middle of the tower, along or across. Bodies take no
//! draws: every seed gives the same world.

use super::{Layout, statics, table};
use atoll_core::{Body, GlobalId, Kind, KindId, Rot, Shape, StaticBody};
use glam::{DVec2, Vec2};

/// Side of a box, in meters.
const SIDE: f64 = 1.0;
/// Boxes stand out of line by this, in meters, to the right and to the left in turns: upon a border of tiles each belongs
/// to another tile than its neighbours.
const SHIFT: f64 = 0.01;
/// Thickness of the floor, and above the tower as much, in meters.
const FLOOR: f64 = 2.0;
/// Beside the tower, more than its height by this, in meters: should it fall, it falls on the floor.
const SPACE: f64 = 4.0;

/// The layout of `stack`.
#[derive(Debug)]
pub(super) struct Stack {
    bodies: u64,
}

impl Stack {
    pub(super) fn new(bodies: u64) -> Self {
        Self { bodies }
    }

    fn height(&self) -> f64 {
        SIDE * self.bodies as f64
    }
}

impl Layout for Stack {
    fn bodies(&self) -> u64 {
        self.bodies
    }

    fn kinds(&self) -> Vec<Kind> {
        table([Shape::rectangle(SIDE as f32, SIDE as f32)])
    }

    fn domain(&self) -> (DVec2, DVec2) {
        let x = self.height() + SPACE;
        (DVec2::new(-x, -FLOOR), DVec2::new(x, self.height() + FLOOR))
    }

    fn statics(&self) -> Vec<StaticBody> {
        let (low, high) = self.domain();
        vec![statics::wall(GlobalId(0), low, DVec2::new(high.x, 0.0))]
    }

    fn body(&self, index: u64, id: GlobalId, _seed: u64) -> Body {
        let shift = if index.is_multiple_of(2) { SHIFT } else { -SHIFT };
        let position = DVec2::new(shift, SIDE * (index as f64 + 0.5));
        let (rotation, velocity) = (Rot::IDENTITY, Vec2::ZERO);
        Body { id, position, rotation, velocity, angular_velocity: 0.0, kind: KindId(0) }
    }

    fn extent(&self, first: u64, last: u64) -> (DVec2, DVec2) {
        let place = |shift: f64, index: u64| DVec2::new(shift, SIDE * (index as f64 + 0.5));
        (place(-SHIFT, first), place(SHIFT, last))
    }
}

#[cfg(test)]
mod tests {
    use super::super::statics::rectangle;
    use super::*;

    #[test]
    fn each_box_stands_on_the_one_below_around_the_middle_of_the_domain() {
        for boxes in [1, 2, 10, 300] {
            let stack = Stack::new(boxes);
            let (low, high) = stack.domain();
            assert_eq!((low + high) * 0.5, DVec2::new(0.0, 0.5 * boxes as f64));
            let statics = stack.statics();
            assert_eq!(statics.len(), 1);
            let mut top = rectangle(&statics[0]).1.y;
            assert_eq!(top, 0.0);
            for index in 0..boxes {
                let place = stack.body(index, GlobalId(1 + index), 1).position;
                assert_eq!((place.x.abs(), place.y - 0.5), (SHIFT, top));
                assert_eq!(place.x > 0.0, index % 2 == 0);
                top = place.y + 0.5;
            }
            assert!(top < high.y && high.x > top, "no room above, or to fall");
        }
    }
}
