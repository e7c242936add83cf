//! Several shapes on one body.

use super::mass::Mass;
use super::{Shape, ShapeError};
use crate::model::math::Rot;
use glam::{DVec2, Vec2};
use std::sync::Arc;

/// A compound has no more parts than this.
pub const MOST_PARTS: usize = 256;

/// A shape at its place on a body: of a circle, a box or a polygon.
#[derive(Clone, PartialEq, Debug)]
pub struct Part {
    /// Outline, around its own center of mass.
    pub shape: Shape,
    /// Its center of mass, seen from that of the body, in meters.
    pub position: Vec2,
    /// How it is turned against the body.
    pub rotation: Rot,
}

/// Shapes that move as one, around their common center of mass.
#[derive(Clone, PartialEq, Debug)]
pub struct Compound(Arc<[Part]>);

impl Compound {
    /// Some parts as one body, moved so that their center of mass lies at the origin, and where that was, in meters. Where parts lie
    /// upon each other, there is twice as much. What lies around its center of mass already stays where it is.
    ///
    /// # Errors
    /// If there is no part or more than [`MOST_PARTS`], or one that is no circle, box or polygon with finite numbers.
    pub fn new(mut parts: Vec<Part>) -> Result<(Self, Vec2), ShapeError> {
        if !(1..=MOST_PARTS).contains(&parts.len()) {
            return Err(ShapeError::Parts { count: parts.len() });
        }
        for (part, number) in parts.iter().zip(1..) {
            if matches!(part.shape, Shape::Segment(_) | Shape::Compound(_)) {
                return Err(ShapeError::Part { number });
            }
            let length = part.rotation.c * part.rotation.c + part.rotation.s * part.rotation.s;
            let is_turn = (length - 1.0).abs() < 1e-3;
            if !(part.shape.is_valid() && part.position.is_finite() && is_turn) {
                return Err(ShapeError::NotFinite);
            }
        }
        let center = Mass::sum(parts.iter().map(Part::mass)).center;
        let reach = parts.iter().map(Part::reach).fold(0.0, f32::max);
        if center.length() <= 1e-6 * f64::from(reach) {
            return Ok((Self(parts.into()), Vec2::ZERO));
        }
        for part in &mut parts {
            part.position = (part.position.as_dvec2() - center).as_vec2();
        }
        Ok((Self(parts.into()), center.as_vec2()))
    }

    /// The shapes that it is made of.
    pub fn parts(&self) -> &[Part] {
        &self.0
    }

    pub(crate) fn mass(&self) -> Mass {
        Mass::sum(self.0.iter().map(Part::mass))
    }
}

impl Part {
    fn mass(&self) -> Mass {
        let (c, s) = (f64::from(self.rotation.c), f64::from(self.rotation.s));
        let place = |at: DVec2| self.position.as_dvec2() + DVec2::new(c * at.x - s * at.y, s * at.x + c * at.y);
        self.shape.mass().placed(place)
    }

    /// How far it reaches from the center of the body, in meters.
    pub(crate) fn reach(&self) -> f32 {
        self.position.length() + self.shape.bounding_radius()
    }
}
