//! Shapes: the outlines of bodies.

mod compound;
mod mass;
mod polygon;
mod segment;
#[cfg(test)]
mod tests;

pub use compound::{Compound, MOST_PARTS, Part};
pub use polygon::{MOST_CORNERS, Polygon};
pub use segment::Segment;

use crate::model::math::Rot;
use glam::{DVec2, Vec2};
use mass::Mass;
use thiserror::Error;

/// Why there can be no such shape.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
pub enum ShapeError {
    /// A number that cannot be.
    #[error("sizes must be positive and finite, points finite, a radius at least 0")]
    NotFinite,
    /// Too many corners.
    #[error(
        "its convex hull has {count} corners; use at most {MOST_CORNERS}, or several polygons as the parts of a compound"
    )]
    Corners {
        /// How many.
        count: usize,
    },
    /// Points on one line.
    #[error("its points lie on one line; give three that do not, or two and a radius for a capsule")]
    Flat,
    /// A capsule that is hardly more than a line.
    #[error("its radius is less than a ten thousandth of its length; give a greater one, or a box")]
    Thin,
    /// Parts of a compound.
    #[error("a compound of {count} parts; use 1 to {MOST_PARTS}")]
    Parts {
        /// How many.
        count: usize,
    },
    /// A part of a compound.
    #[error("part {number} of a compound is a segment or a compound; use circles, boxes and polygons")]
    Part {
        /// Counted from one.
        number: usize,
    },
    /// Points of a chain.
    #[error("two points of a chain, one after the other, lie upon each other; leave one out")]
    Joint,
}

/// The outline of a body, around its center of mass. Lengths in meters.
#[derive(Clone, PartialEq, Debug)]
pub enum Shape {
    /// A disc.
    Circle {
        /// Radius.
        radius: f32,
    },
    /// A rectangle, its sides along the body's axes.
    Box {
        /// Half the width and half the height.
        half: Vec2,
    },
    /// A convex polygon, capsule or box with round corners.
    Polygon(Polygon),
    /// One side of a line, of a static.
    Segment(Segment),
    /// Several of the first three.
    Compound(Compound),
}

impl Shape {
    /// A disc of the given radius, in meters.
    pub const fn circle(radius: f32) -> Self {
        Self::Circle { radius }
    }

    /// A rectangle of the given whole width and height, in meters.
    pub const fn rectangle(width: f32, height: f32) -> Self {
        Self::Box { half: Vec2::new(0.5 * width, 0.5 * height) }
    }

    /// The convex hull of some points around its center of mass; see [`Polygon::hull`].
    ///
    /// # Errors
    /// As there.
    pub fn polygon(points: &[Vec2], radius: f32) -> Result<Self, ShapeError> {
        Polygon::hull(points, radius).map(|(polygon, _)| Self::Polygon(polygon))
    }

    /// What is within a radius of a line along the x axis of the body, of the given length, in meters.
    ///
    /// # Errors
    /// If a size is not positive and finite, or the radius next to nothing beside the length.
    pub fn capsule(length: f32, radius: f32) -> Result<Self, ShapeError> {
        if !(length > 0.0 && length.is_finite()) {
            return Err(ShapeError::NotFinite);
        }
        let end = Vec2::new(0.5 * length, 0.0);
        Self::polygon(&[-end, end], radius)
    }

    /// Several circles, boxes and polygons around their common center of mass; see [`Compound::new`].
    ///
    /// # Errors
    /// As there.
    pub fn compound(parts: Vec<Part>) -> Result<Self, ShapeError> {
        Compound::new(parts).map(|(compound, _)| Self::Compound(compound))
    }

    /// Radius of a circle around the center that holds the shape, in meters: the smallest, but for compounds, of which it holds the
    /// circles around their parts.
    pub fn bounding_radius(&self) -> f32 {
        let length = |v: Vec2| (v.x * v.x + v.y * v.y).sqrt();
        match self {
            Self::Circle { radius } => *radius,
            Self::Box { half } => length(*half),
            Self::Polygon(polygon) => {
                polygon.corners().iter().map(|&corner| length(corner)).fold(0.0, f32::max) + polygon.radius()
            }
            Self::Segment(segment) => length(segment.ends()[1]),
            Self::Compound(compound) => compound.parts().iter().map(Part::reach).fold(0.0, f32::max),
        }
    }

    /// Radius of the largest circle around the center within the shape, in meters; of several parts, within the thinnest.
    pub(crate) fn inner_radius(&self) -> f32 {
        match self {
            Self::Circle { radius } => *radius,
            Self::Box { half } => half.min_element(),
            Self::Polygon(polygon) => {
                let corners = polygon.corners();
                let next = corners.iter().cycle().skip(1);
                let height = |(&from, &to): (&Vec2, &Vec2)| from.perp_dot(to) / (to - from).length();
                corners.iter().zip(next).map(height).fold(f32::INFINITY, f32::min) + polygon.radius()
            }
            Self::Segment(_) => 0.0,
            Self::Compound(compound) => {
                compound.parts().iter().map(|part| part.shape.inner_radius()).fold(f32::INFINITY, f32::min)
            }
        }
    }

    /// The convex parts that it is made of, for whoever draws it: their corners, counter-clockwise, seen from the center of the body,
    /// and how far around these each reaches, in meters. A disc has one corner; a capsule, and a segment, two.
    pub fn outlines(&self) -> Vec<(Vec<Vec2>, f32)> {
        match self {
            Self::Circle { radius } => vec![(vec![Vec2::ZERO], *radius)],
            Self::Box { half: Vec2 { x, y } } => {
                vec![(vec![Vec2::new(-x, -y), Vec2::new(*x, -y), Vec2::new(*x, *y), Vec2::new(-x, *y)], 0.0)]
            }
            Self::Polygon(polygon) => vec![(polygon.corners().to_vec(), polygon.radius())],
            Self::Segment(segment) => vec![(segment.ends().to_vec(), 0.0)],
            Self::Compound(compound) => {
                let placed = |part: &Part| {
                    let place = |corner: Vec2| part.position + part.rotation.rotate(corner);
                    let outlines = part.shape.outlines().into_iter();
                    outlines.map(|(corners, radius)| (corners.into_iter().map(place).collect(), radius)).collect()
                };
                compound.parts().iter().flat_map(|part| -> Vec<(Vec<Vec2>, f32)> { placed(part) }).collect()
            }
        }
    }

    /// Half the width and half the height of the smallest upright rectangle around the center that holds the shape, turned so, in
    /// meters.
    pub fn half_extents(&self, rotation: Rot) -> Vec2 {
        let (c, s) = (rotation.c.abs(), rotation.s.abs());
        match self {
            Self::Circle { radius } => Vec2::splat(*radius),
            Self::Box { half } => Vec2::new(c * half.x + s * half.y, s * half.x + c * half.y),
            _ => {
                let reach = |(corners, radius): (Vec<Vec2>, f32)| {
                    let turned = corners.iter().map(|&corner| rotation.rotate(corner).abs());
                    turned.fold(Vec2::ZERO, Vec2::max) + radius
                };
                self.outlines().into_iter().map(reach).fold(Vec2::ZERO, Vec2::max)
            }
        }
    }

    /// How wide it is where it is narrowest, in meters: of a compound, the narrowest of its parts; of a segment, nothing.
    pub fn width(&self) -> f32 {
        let across = |(corners, radius): (Vec<Vec2>, f32)| {
            let height = |(i, &from): (usize, &Vec2)| {
                let along = (corners[(i + 1) % corners.len()] - from).normalize_or_zero();
                corners.iter().map(|&corner| along.perp_dot(corner - from)).fold(0.0, f32::max)
            };
            let narrowest = corners.iter().enumerate().map(height).fold(f32::INFINITY, f32::min);
            narrowest + 2.0 * radius
        };
        self.outlines().into_iter().map(across).fold(f32::INFINITY, f32::min)
    }

    /// Area in square meters.
    pub fn area(&self) -> f32 {
        match self {
            Self::Circle { radius } => std::f32::consts::PI * radius * radius,
            Self::Box { half } => 4.0 * half.x * half.y,
            _ => self.mass().area as f32,
        }
    }

    /// Moment of inertia about the center, per unit of mass, in square meters.
    pub fn inertia_per_mass(&self) -> f32 {
        match self {
            Self::Circle { radius } => 0.5 * radius * radius,
            Self::Box { half } => (half.x * half.x + half.y * half.y) / 3.0,
            _ => {
                let mass = self.mass();
                (mass.moment / mass.area) as f32
            }
        }
    }

    fn mass(&self) -> Mass {
        match self {
            Self::Circle { radius } => Mass::of_disc(DVec2::ZERO, (*radius).into()),
            Self::Box { half } => {
                let half = half.as_dvec2();
                let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
                Mass::of_rounded(&corners.map(|(x, y)| half * DVec2::new(x, y)), 0.0)
            }
            Self::Polygon(polygon) => polygon.mass(),
            Self::Segment(segment) => Mass::of_rounded(&segment.ends().map(Vec2::as_dvec2), 0.0),
            Self::Compound(compound) => compound.mass(),
        }
    }

    /// Whether the outline stays as it is however the body is turned. Then turning brings no point of it nearer, its
    /// surface comes nearer no faster than its center does, a normal impulse does not turn it, and its contacts do not
    /// turn with it. So only for a circle around the center of mass: a capsule, or a box with rounded corners, is not round.
    pub(crate) fn is_round(&self) -> bool {
        matches!(self, Self::Circle { .. })
    }

    /// Whether its numbers are finite and its sizes positive.
    pub(crate) fn is_valid(&self) -> bool {
        let positive = |x: f32| x > 0.0 && x.is_finite();
        match self {
            Self::Circle { radius } => positive(*radius),
            Self::Box { half } => positive(half.x) && positive(half.y),
            Self::Segment(segment) => segment.is_valid(),
            // Made valid.
            Self::Polygon(_) | Self::Compound(_) => true,
        }
    }
}
