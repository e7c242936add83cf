//! The records that messages are made of.

use crate::model::body::Body;
use crate::model::contact::Contact;
use crate::model::id::GlobalId;
use bytemuck::{Pod, Zeroable};
use glam::Vec2;

/// A contact on the move, known by the names of its bodies, the lower first.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct ContactRecord {
    /// Body A.
    pub low: GlobalId,
    /// Body B.
    pub high: GlobalId,
    /// One if the sending tile owned body A, zero if it owned body B alone: where two tiles hold an entry of one pair, that one wins. Two
    /// if the receiving tile owns neither, and is to solve it for others.
    pub standing: u64,
    /// Geometry and impulses.
    pub contact: Contact,
}

impl ContactRecord {
    pub(crate) const OF_OWNER_OF_LOW: u64 = 1;
    pub(crate) const OF_OWNER_OF_HIGH: u64 = 0;
    pub(crate) const LENT: u64 = 2;
}

/// An impulse and its moment about a body's center: what a ghost is given in every substep.
#[derive(Clone, Copy, PartialEq, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Unseen {
    /// N s.
    pub linear: Vec2,
    /// N m s.
    pub angular: f32,
}

impl Unseen {
    pub(crate) fn add(&mut self, linear: Vec2, angular: f32) {
        self.linear += linear;
        self.angular += angular;
    }
}

/// A body that changes owner: 56 bytes.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct MigrantRecord {
    /// The body.
    pub body: Body,
    /// How long it has rested, in s; zero where nobody may sleep.
    pub rested: f32,
    /// Zero; fills the record to a multiple of its alignment.
    pub padding: u32,
}

/// A ghost on its way: 64 bytes.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct GhostRecord {
    /// A bit-exact copy.
    pub body: Body,
    /// The sum of the body's stored impulses from contacts that the receiving tile does not solve.
    pub unseen: Unseen,
    /// As in [`MigrantRecord`].
    pub rested: f32,
}

/// A ghost's state after a substep: 48 bytes. Velocities and displacements are mass-weighted (times the square root of
/// mass or inertia), as the solver holds them, so that the copy is exact.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct GhostRefresh {
    /// Which body.
    pub id: GlobalId,
    /// Velocity x, y and angular velocity, mass-weighted.
    pub velocity: [f32; 3],
    /// Displacement x, y of the step so far, and of its rotation what the cosine lacks of one, and the sine: all mass-weighted.
    pub pose: [f32; 4],
    /// As in [`GhostRecord`].
    pub unseen: Unseen,
}

/// What one owner's copy of a border contact did in a step.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct BorderImpulse {
    /// Body A.
    pub low: GlobalId,
    /// Body B.
    pub high: GlobalId,
    /// The one or two points.
    pub points: [BorderPoint; 2],
}

/// One point of a [`BorderImpulse`].
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct BorderPoint {
    /// As in [`crate::ContactPoint`].
    pub feature: u32,
    /// Sum over substeps of the impulse along the normal, restitution included, in N s.
    pub total_normal: f32,
    /// Sum over substeps of the impulse along the tangent, in N s.
    pub total_tangent: f32,
    /// The last substep's impulse along the normal, restitution excluded, in N s.
    pub normal: f32,
    /// The last substep's impulse along the tangent, in N s.
    pub tangent: f32,
    /// Speed of the fastest blow that its contact gives back or passes on as the sender knows it, in m/s; less than zero if it does not
    /// bounce.
    pub blow: f32,
}
