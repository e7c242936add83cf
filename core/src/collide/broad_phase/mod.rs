//! Broad phase: which pairs of bodies may touch within this step.
//!
//! The contract, whichever structure finds them: every pair with a body before
//! [`Proxies::pairing`](super::proxies::Proxies::pairing) that [`Cull`](super::cull::Cull) takes for one, in any order; pairs that
//! are none may be among them. That test reads the bodies' own bits, not the tile's local coordinates, so two tiles that both see
//! a pair agree on it.

mod cells;
pub(crate) mod grid;
pub(crate) mod quadtree;
#[allow(unsafe_code)]
mod search;
#[cfg(test)]
pub(super) mod tests;

/// A pair of indices into owned, ghosts and statics; the lower first.
pub(crate) type Pair = [u32; 2];
