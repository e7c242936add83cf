//! Bodies as polygons.

use atoll_core::{Rot, Shape};
use glam::{DVec2, Vec2};
use std::f32::consts::TAU;

/// Corners of a circle; round corners have as many for their part of one.
const ROUND: usize = 24;

/// A polygon that a shape is made of, in the frame of its body.
#[derive(Clone, Debug)]
pub(super) struct Figure {
    /// Counter-clockwise, in m.
    corners: Vec<Vec2>,
    /// What VTK calls its form: a line, a quad, or a polygon.
    cell_type: u8,
}

/// The polygons that a shape is made of: one, but of a compound one for each part.
pub(super) fn figures(shape: &Shape) -> Vec<Figure> {
    let figure = |(corners, radius): (Vec<Vec2>, f32)| {
        let cell_type = match (&corners[..], radius == 0.0) {
            ([_, _], true) => 3,
            ([_, _, _, _], true) => 9,
            _ => 7,
        };
        Figure { corners: if radius == 0.0 { corners } else { rounded(&corners, radius) }, cell_type }
    };
    shape.outlines().into_iter().map(figure).collect()
}

/// The outline of what is within a radius of a convex polygon.
fn rounded(corners: &[Vec2], radius: f32) -> Vec<Vec2> {
    let at = |angle: f32| {
        let turn = Rot::from_angle(angle);
        Vec2::new(turn.c, turn.s) * radius
    };
    if let [center] = *corners {
        return (0..ROUND).map(|number| center + at(TAU * number as f32 / ROUND as f32)).collect();
    }
    let count = corners.len();
    let normal = |i: usize| {
        let along = corners[(i + 1) % count] - corners[i % count];
        direction(Vec2::new(along.y, -along.x))
    };
    let mut outline = Vec::new();
    for (i, &corner) in corners.iter().enumerate() {
        let (from, to) = (normal(i + count - 1), normal(i));
        let turn = (to - from).rem_euclid(TAU);
        let parts = ((turn / TAU * ROUND as f32).ceil() as usize).max(1);
        outline.extend((0..=parts).map(|part| corner + at(from + turn * part as f32 / parts as f32)));
    }
    outline
}

/// The direction of a vector, in rad.
fn direction(v: Vec2) -> f32 {
    Rot { c: v.x, s: v.y }.angle()
}

/// What a part of a body covers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline<'a> {
    /// Of the body, in m.
    pub(super) center: DVec2,
    /// How it is turned.
    pub(super) rotation: Rot,
    /// What is turned.
    pub(super) figure: &'a Figure,
}

impl Outline<'_> {
    /// How many corners it has.
    pub(super) fn corners(&self) -> usize {
        self.figure.corners.len()
    }

    /// What VTK calls its form.
    pub(super) fn cell_type(&self) -> u8 {
        self.figure.cell_type
    }

    /// One of its corners, counter-clockwise, in m.
    pub(super) fn corner(&self, number: usize) -> DVec2 {
        let Rot { c, s } = self.rotation;
        self.center + DVec2::new(c.into(), s.into()).rotate(self.figure.corners[number].as_dvec2())
    }
}
