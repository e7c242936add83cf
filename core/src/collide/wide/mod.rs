//! Sixteen pairs at once, in lanes: what the rest of `collide` does for one, in the same words and with the same bits.

pub(super) mod boxes;
pub(super) mod discs;
mod manifolds;
pub(super) mod moments;
mod outlines;
pub(super) mod pairs;
pub(super) mod polygons;
pub(super) mod segments;
mod touches;
