//! Broad phase: which pairs of bodies may touch within this step.
//!
//! The contract, whichever structure finds them: every pair with a body before
//! [`Proxies::pairing`](super::proxies::Proxies::pairing) that [`Cull`](super::cull::Cull) takes for one, in any order; pairs that
//! are none may be among them, and those need not that stay apart as seen from one of the two (see `slant.rs`). That test reads the
//! bodies' own bits, not the tile's local coordinates, so two tiles that both see a pair agree on it.

mod cells;
pub(crate) mod grid;
pub(crate) mod quadtree;
#[allow(unsafe_code)]
mod search;
mod slant;
#[cfg(test)]
pub(super) mod tests;

use super::proxies::Proxies;
use crate::model::body::Bodies;
use crate::parallel::team::Team;
use crate::tiling::blueprint::Setup;

/// Among whom pairs are looked for, and by whom.
#[derive(Clone, Copy)]
pub(crate) struct Field<'a> {
    pub(crate) proxies: &'a Proxies,
    pub(crate) bodies: &'a Bodies,
    pub(crate) setup: &'a Setup,
    pub(crate) team: Team,
}

/// A pair of indices into owned, ghosts and statics; the lower first.
pub(crate) type Pair = [u32; 2];
