//! Kinds: what a body is: its shape, what it is made of, and whom it touches.

use crate::model::error::SetupError;
use crate::model::id::KindId;
use crate::model::math::{Rot, min};
use crate::model::params::Params;
use crate::model::path::Path;
use crate::model::piece::{Piece, pieces};
use crate::model::shape::Shape;
use glam::Vec2;
use std::sync::Arc;

/// What a body is made of.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Material {
    /// Mass per area in kg/m^2; more makes a body heavier.
    pub density: f32,
    /// Coulomb's coefficient; two bodies mix by the geometric mean.
    pub friction: f32,
    /// Part of the approach speed a bounce gives back, 0 to 1; two bodies mix by the greater.
    pub restitution: f32,
    /// How fast its surface runs along its outline, clockwise, in m/s, as that of a conveyor belt: what lies on top is carried to the
    /// right. Of statics alone.
    pub surface_speed: f32,
}

impl Default for Material {
    fn default() -> Self {
        Self { density: 1.0, friction: 0.6, restitution: 0.0, surface_speed: 0.0 }
    }
}

impl Material {
    fn is_valid(&self) -> bool {
        self.density > 0.0
            && self.density.is_finite()
            && self.friction >= 0.0
            && self.friction.is_finite()
            && (0.0..=1.0).contains(&self.restitution)
            && f64::from(self.surface_speed.abs()) <= Path::FASTEST
    }
}

/// How a body moves when nothing touches it, other than most do.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Dynamics {
    /// What the world's gravity is multiplied by.
    pub gravity_scale: f32,
    /// Damping of the velocity beside the world's, in 1/s.
    pub linear_damping: f32,
    /// Damping of the angular velocity beside the world's, in 1/s.
    pub angular_damping: f32,
    /// Whether it never turns, as if its moment of inertia were infinite.
    pub fixed_rotation: bool,
}

impl Default for Dynamics {
    fn default() -> Self {
        Self { gravity_scale: 1.0, linear_damping: 0.0, angular_damping: 0.0, fixed_rotation: false }
    }
}

impl Dynamics {
    /// What gravity is multiplied by, and what velocity and angular velocity are multiplied by in a substep, the world's damping
    /// included; one number unused.
    pub(crate) fn factors(&self, params: &Params) -> [f32; 4] {
        let damped = |world: f32, own: f32| 1.0 / (1.0 + params.substep() * (world + own));
        let linear = damped(params.linear_damping, self.linear_damping);
        let angular = damped(params.angular_damping, self.angular_damping);
        [self.gravity_scale, linear, if self.fixed_rotation { 0.0 } else { angular }, 0.0]
    }

    fn is_valid(&self) -> bool {
        let damping = |rate: f32| rate >= 0.0 && rate.is_finite();
        self.gravity_scale.is_finite() && damping(self.linear_damping) && damping(self.angular_damping)
    }
}

/// Whom a body touches.
///
/// Of two bodies of one group, unless that is 0, a positive one says that they touch, a negative one that they do not. Of others, each
/// must have a category in its mask that the other is of. As in Box2D.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Filter {
    /// What it is, a bit for each category.
    pub categories: u32,
    /// The categories that it touches.
    pub mask: u32,
    /// Whom it touches, or does not, whatever the masks say.
    pub group: i32,
}

impl Default for Filter {
    fn default() -> Self {
        Self { categories: 1, mask: u32::MAX, group: 0 }
    }
}

impl Filter {
    /// Whether two bodies may touch.
    #[inline]
    pub(crate) fn admits(&self, other: &Self) -> bool {
        if self.group != 0 && self.group == other.group {
            return self.group > 0;
        }
        self.categories & other.mask != 0 && other.categories & self.mask != 0
    }
}

/// What a body is: one row of the table that every rank holds alike.
#[derive(Clone, PartialEq, Debug)]
pub struct Kind {
    /// Outline.
    pub shape: Shape,
    /// Stuff.
    pub material: Material,
    /// How it moves by itself.
    pub dynamics: Dynamics,
    /// Whom it touches.
    pub filter: Filter,
    /// Whether it only tells who is inside, and pushes nobody.
    pub sensor: bool,
}

impl Kind {
    /// A shape made of something, that moves as most do and touches all others.
    pub fn new(shape: Shape, material: Material) -> Self {
        Self { shape, material, dynamics: Dynamics::default(), filter: Filter::default(), sensor: false }
    }

    /// Whether there can be bodies of it: its shape has a size, and all of its numbers are finite and in their ranges.
    pub fn is_valid(&self) -> bool {
        self.shape.is_valid() && self.material.is_valid() && self.dynamics.is_valid()
    }
}

/// How contacts of a shape are found.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Form {
    Round = 0,
    Box = 1,
    /// As those of the one convex piece that it is, which has faces and is solid from all sides.
    Polygon = 2,
    /// As those of a segment of a chain.
    Segment = 3,
    /// As those of the convex pieces that it is made of.
    Pieces = 4,
}

impl Form {
    /// Whether contacts with others of these are found without looking at pieces.
    pub(crate) fn is_simple(self) -> bool {
        matches!(self, Self::Round | Self::Box)
    }
}

/// No body has more mass, in kg, or a greater moment of inertia, in kg m^2: their momenta and energies must be numbers.
const MOST_MASS: f32 = 1e30;

/// A kind with everything the step derives from it.
#[derive(Clone, Debug)]
pub(crate) struct KindRow {
    pub(crate) shape: Shape,
    pub(crate) material: Material,
    pub(crate) dynamics: Dynamics,
    pub(crate) filter: Filter,
    pub(crate) sensor: bool,
    pub(crate) form: Form,
    /// The convex pieces of its shape.
    pub(crate) pieces: Arc<[Piece]>,
    pub(crate) inner_radius: f32,
    /// Half extents of what turns (zero for a circle) and the radius around it (zero for a box): the half width of the
    /// AABB is no more than `|c| * extent.x + |s| * extent.y + radius` for all.
    pub(crate) extent: Vec2,
    pub(crate) radius: f32,
    pub(crate) bounding_radius: f32,
    /// One if the shape changes as it turns, zero if it [is round](Shape::is_round).
    pub(crate) not_round: f32,
    /// Masses; zero, and so are the inverses, for a static kind.
    pub(crate) mass: f32,
    pub(crate) inertia: f32,
    pub(crate) inv_mass: f32,
    /// Square roots of the masses and of their inverses, for mass-weighted velocities. Of what never turns the inertia is one, and
    /// its inverse zero.
    pub(crate) root_mass: f32,
    pub(crate) root_inertia: f32,
    pub(crate) root_inv_mass: f32,
    pub(crate) root_inv_inertia: f32,
}

impl KindRow {
    pub(crate) fn dynamic(kind: &Kind, id: KindId) -> Result<Self, SetupError> {
        let row = Self::checked(kind).ok_or(SetupError::BadKind { kind: id })?;
        if matches!(kind.shape, Shape::Segment(_)) {
            return Err(SetupError::SegmentMoves { kind: id });
        }
        if kind.material.surface_speed != 0.0 {
            return Err(SetupError::SurfaceMoves { kind: id });
        }
        let mass = kind.material.density * kind.shape.area();
        let inertia = mass * kind.shape.inertia_per_mass();
        let (inv_mass, inv_inertia) = (1.0 / mass, 1.0 / inertia);
        let is_inverse = |inverse: f32| inverse.is_finite() && inverse >= 1.0 / MOST_MASS;
        if !(is_inverse(inv_mass) && is_inverse(inv_inertia)) {
            return Err(SetupError::BadKind { kind: id });
        }
        Ok(Self {
            mass,
            inertia,
            inv_mass,
            root_mass: mass.sqrt(),
            root_inertia: if kind.dynamics.fixed_rotation { 1.0 } else { inertia.sqrt() },
            root_inv_mass: inv_mass.sqrt(),
            root_inv_inertia: if kind.dynamics.fixed_rotation { 0.0 } else { inv_inertia.sqrt() },
            ..row
        })
    }

    /// The row of the table that it was made of.
    pub(crate) fn kind(&self) -> Kind {
        let &Self { ref shape, material, dynamics, filter, sensor, .. } = self;
        Kind { shape: shape.clone(), material, dynamics, filter, sensor }
    }

    /// Whether bodies of this kind and another touch where they meet.
    #[inline]
    pub(crate) fn touches(&self, other: &Self) -> bool {
        !(self.sensor | other.sensor) && self.filter.admits(&other.filter)
    }

    /// The angular velocity that a body of this kind has where it is to have this one.
    pub(crate) fn turning(&self, angular_velocity: f32) -> f32 {
        if self.dynamics.fixed_rotation { 0.0 } else { angular_velocity }
    }

    /// Half extents, radius, bounding radius: of a round body the first are zero.
    #[inline(always)]
    pub(crate) fn outline(&self) -> [f32; 4] {
        [self.extent.x, self.extent.y, self.radius, self.bounding_radius]
    }

    /// Mass, moment of inertia, and the mass that gravity pulls.
    #[inline(always)]
    pub(crate) fn masses(&self) -> [f32; 3] {
        [self.mass, self.inertia, self.mass * self.dynamics.gravity_scale]
    }

    pub(crate) fn fixed(kind: &Kind) -> Option<Self> {
        Self::checked(kind).filter(|row| row.bounding_radius.is_finite() && kind.shape.area().is_finite())
    }

    fn checked(kind: &Kind) -> Option<Self> {
        if !kind.is_valid() {
            return None;
        }
        let pieces = pieces(&kind.shape);
        let bounding_radius = kind.shape.bounding_radius();
        let (form, extent, radius) = match &kind.shape {
            Shape::Circle { radius } => (Form::Round, Vec2::ZERO, *radius),
            Shape::Box { half } => (Form::Box, *half, 0.0),
            _ => {
                let form = match &pieces[..] {
                    [only] if only.side.is_some() => Form::Segment,
                    [only] if only.has_faces() => Form::Polygon,
                    _ => Form::Pieces,
                };
                (form, extent(&pieces, bounding_radius), 0.0)
            }
        };
        Some(Self {
            shape: kind.shape.clone(),
            material: kind.material,
            dynamics: kind.dynamics,
            filter: kind.filter,
            sensor: kind.sensor,
            form,
            pieces,
            inner_radius: kind.shape.inner_radius(),
            extent,
            radius,
            bounding_radius,
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

    /// Whether it is made of several pieces.
    pub(crate) fn is_compound(&self) -> bool {
        self.pieces.len() > 1
    }

    /// Half width and half height of an AABB at a rotation, in meters. Never more than the bounding radius, of which halos are made: a
    /// rectangle around a polygon reaches further at its corners than the polygon.
    #[inline(always)]
    pub(crate) fn half_extents(&self, rotation: Rot) -> Vec2 {
        self.swept_half_extents(rotation, 0.0)
    }

    /// The same where turning may bring its surface so much further out.
    #[inline(always)]
    pub(crate) fn swept_half_extents(&self, rotation: Rot, sweep: f32) -> Vec2 {
        let (c, s) = (rotation.c.abs(), rotation.s.abs());
        let swept = self.radius + sweep;
        Vec2::new(
            min(c * self.extent.x + s * self.extent.y + swept, self.bounding_radius),
            min(s * self.extent.x + c * self.extent.y + swept, self.bounding_radius),
        )
    }
}

/// Half extents of all pieces together, around the center; never zero, as those of what is round are.
fn extent(pieces: &[Piece], bounding_radius: f32) -> Vec2 {
    let all = pieces.iter().map(Piece::half_extents).fold(Vec2::ZERO, |most, half| most.max(half));
    all.max(Vec2::splat(1e-6 * bounding_radius))
}
