//! Bodies as polygons.

use atoll_core::{Rot, Shape};
use glam::{DVec2, Vec2};
use std::f32::consts::TAU;

/// Corners of a circle.
const ROUND: usize = 24;

/// What a body covers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    /// In m.
    pub(super) center: DVec2,
    /// How it is turned.
    pub(super) rotation: Rot,
    /// What is turned.
    pub(super) shape: Shape,
}

impl Outline {
    /// How many corners it has.
    pub(super) fn corners(&self) -> usize {
        match self.shape {
            Shape::Box { .. } => 4,
            Shape::Circle { .. } => ROUND,
        }
    }

    /// What VTK calls its form: a quad, or a polygon.
    pub(super) fn cell_type(&self) -> u8 {
        match self.shape {
            Shape::Box { .. } => 9,
            Shape::Circle { .. } => 7,
        }
    }

    /// One of its corners, counter-clockwise, in m.
    pub(super) fn corner(&self, number: usize) -> DVec2 {
        let Rot { c, s } = self.rotation;
        let axis = DVec2::new(c.into(), s.into());
        let offset = match self.shape {
            Shape::Box { half } => {
                let sign =
                    Vec2::new(if matches!(number, 0 | 3) { -1.0 } else { 1.0 }, if number < 2 { -1.0 } else { 1.0 });
                half * sign
            }
            Shape::Circle { radius } => {
                let turn = Rot::from_angle(TAU * number as f32 / ROUND as f32);
                Vec2::new(turn.c, turn.s) * radius
            }
        };
        self.center + axis.rotate(offset.as_dvec2())
    }
}
