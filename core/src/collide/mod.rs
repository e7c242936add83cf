//! Who touches whom, and how: pairs of near bodies, and their manifolds with the impulses of the step before.

pub(crate) mod broad_phase;
mod cull;
pub(crate) mod hollows;
pub(crate) mod manifold;
pub(crate) mod narrow_phase;
pub(crate) mod passage;
mod piece_boxes;
pub(crate) mod proxies;
pub(crate) mod seams;
mod touch;
mod wide;
