//! Shapes, materials, and the table of kinds that joins them.

use crate::model::error::SetupError;
use crate::model::id::KindId;
use glam::Vec2;

/// The outline of a body, around its center of mass. Lengths in meters.
#[derive(Clone, Copy, PartialEq, Debug)]
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

    /// Radius of the smallest circle around the center that holds the shape, in meters.
    pub fn bounding_radius(&self) -> f32 {
        match *self {
            Self::Circle { radius } => radius,
            Self::Box { half } => (half.x * half.x + half.y * half.y).sqrt(),
        }
    }

    /// Radius of the largest circle around the center within the shape, in meters.
    pub(crate) fn inner_radius(&self) -> f32 {
        match *self {
            Self::Circle { radius } => radius,
            Self::Box { half } => half.min_element(),
        }
    }

    /// Area in square meters.
    pub fn area(&self) -> f32 {
        match *self {
            Self::Circle { radius } => std::f32::consts::PI * radius * radius,
            Self::Box { half } => 4.0 * half.x * half.y,
        }
    }

    /// Moment of inertia about the center, per unit of mass, in square meters.
    pub fn inertia_per_mass(&self) -> f32 {
        match *self {
            Self::Circle { radius } => 0.5 * radius * radius,
            Self::Box { half } => (half.x * half.x + half.y * half.y) / 3.0,
        }
    }

    /// Whether the outline stays as it is however the body is turned. Then turning brings no point of it nearer, its
    /// surface comes nearer no faster than its center does, a normal impulse does not turn it, and its contacts do not
    /// turn with it. So only for a circle around the center of mass: a capsule, or a box with rounded corners, is not round.
    pub(crate) fn is_round(&self) -> bool {
        match self {
            Self::Circle { .. } => true,
            Self::Box { .. } => false,
        }
    }

    fn is_valid(&self) -> bool {
        let positive = |x: f32| x > 0.0 && x.is_finite();
        match *self {
            Self::Circle { radius } => positive(radius),
            Self::Box { half } => positive(half.x) && positive(half.y),
        }
    }
}

/// What a body is made of.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Material {
    /// Mass per area in kg/m^2; more makes a body heavier.
    pub density: f32,
    /// Coulomb's coefficient; two bodies mix by the geometric mean.
    pub friction: f32,
    /// Part of the approach speed a bounce gives back, 0 to 1; two bodies mix by the greater.
    pub restitution: f32,
}

impl Default for Material {
    fn default() -> Self {
        Self { density: 1.0, friction: 0.6, restitution: 0.0 }
    }
}

impl Material {
    fn is_valid(&self) -> bool {
        self.density > 0.0
            && self.density.is_finite()
            && self.friction >= 0.0
            && self.friction.is_finite()
            && (0.0..=1.0).contains(&self.restitution)
    }
}

/// A shape and a material: one row of the table that every rank holds alike.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Kind {
    /// Outline.
    pub shape: Shape,
    /// Stuff.
    pub material: Material,
}

impl Kind {
    /// Whether there can be bodies of it: its shape has a size, and all of its numbers are finite and in their ranges.
    pub fn is_valid(&self) -> bool {
        self.shape.is_valid() && self.material.is_valid()
    }
}

/// A kind with everything the step derives from it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KindRow {
    pub(crate) shape: Shape,
    pub(crate) material: Material,
    /// Half extents of what turns (zero for a circle) and the radius around it (zero for a box): the half width of the
    /// AABB is `|c| * extent.x + |s| * extent.y + radius` for both.
    pub(crate) extent: Vec2,
    pub(crate) radius: f32,
    pub(crate) bounding_radius: f32,
    /// One if the shape changes as it turns, zero if it [is round](Shape::is_round).
    pub(crate) not_round: f32,
    /// Masses; zero, and so are the inverses, for a static kind.
    pub(crate) mass: f32,
    pub(crate) inertia: f32,
    pub(crate) inv_mass: f32,
    /// Square roots of the masses and of their inverses, for mass-weighted velocities.
    pub(crate) root_mass: f32,
    pub(crate) root_inertia: f32,
    pub(crate) root_inv_mass: f32,
    pub(crate) root_inv_inertia: f32,
}

impl KindRow {
    pub(crate) fn dynamic(kind: &Kind, id: KindId) -> Result<Self, SetupError> {
        let row = Self::checked(kind).ok_or(SetupError::BadKind { kind: id })?;
        let mass = kind.material.density * kind.shape.area();
        let inertia = mass * kind.shape.inertia_per_mass();
        let (inv_mass, inv_inertia) = (1.0 / mass, 1.0 / inertia);
        if !(inv_mass.is_finite() && inv_inertia.is_finite() && inv_mass > 0.0 && inv_inertia > 0.0) {
            return Err(SetupError::BadKind { kind: id });
        }
        Ok(Self {
            mass,
            inertia,
            inv_mass,
            root_mass: mass.sqrt(),
            root_inertia: inertia.sqrt(),
            root_inv_mass: inv_mass.sqrt(),
            root_inv_inertia: inv_inertia.sqrt(),
            ..row
        })
    }

    /// Half extents, radius, bounding radius: of a round body the first are zero.
    #[inline(always)]
    pub(crate) fn outline(&self) -> [f32; 4] {
        [self.extent.x, self.extent.y, self.radius, self.bounding_radius]
    }

    /// Mass and moment of inertia.
    #[inline(always)]
    pub(crate) fn masses(&self) -> [f32; 2] {
        [self.mass, self.inertia]
    }

    pub(crate) fn fixed(kind: &Kind) -> Option<Self> {
        Self::checked(kind)
    }

    fn checked(kind: &Kind) -> Option<Self> {
        if !kind.is_valid() {
            return None;
        }
        let (extent, radius) = match kind.shape {
            Shape::Circle { radius } => (Vec2::ZERO, radius),
            Shape::Box { half } => (half, 0.0),
        };
        Some(Self {
            shape: kind.shape,
            material: kind.material,
            extent,
            radius,
            bounding_radius: kind.shape.bounding_radius(),
            not_round: if kind.shape.is_round() { 0.0 } else { 1.0 },
            mass: 0.0,
            inertia: 0.0,
            inv_mass: 0.0,
            root_mass: 0.0,
            root_inertia: 0.0,
            root_inv_mass: 0.0,
            root_inv_inertia: 0.0,
        })
    }

    /// Half width and half height of the AABB at a rotation, in meters.
    #[inline(always)]
    pub(crate) fn half_extents(&self, rotation: crate::model::math::Rot) -> Vec2 {
        let (c, s) = (rotation.c.abs(), rotation.s.abs());
        Vec2::new(
            c * self.extent.x + s * self.extent.y + self.radius,
            s * self.extent.x + c * self.extent.y + self.radius,
        )
    }
}
