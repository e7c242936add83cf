//! What a world is made of: names, bodies, shapes, materials, contacts, and every number that a step depends on.

mod abutting;
pub(crate) mod body;
pub(crate) mod contact;
pub(crate) mod convex;
pub(crate) mod error;
pub(crate) mod id;
pub(crate) mod kind;
pub(crate) mod math;
pub(crate) mod names;
pub(crate) mod params;
pub(crate) mod path;
pub(crate) mod piece;
pub(crate) mod shape;
pub(crate) mod softness;
pub(crate) mod strays;
