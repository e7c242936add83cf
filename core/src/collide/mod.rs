//! Who touches whom, and how: pairs of near bodies, and their manifolds with the impulses of the step before.

pub(crate) mod broad_phase;
mod cull;
mod eight_boxes;
mod eight_pairs;
mod eight_touches;
pub(crate) mod manifold;
pub(crate) mod narrow_phase;
pub(crate) mod proxies;
mod touch;
