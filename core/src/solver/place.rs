//! Where a body of the tile stands among the solver's bodies.

/// The place of a body that is not solved: it has no contact, or sleeps.
pub(crate) const NOT_SOLVED: u32 = u32::MAX;

/// The place of every static. No body that moves comes first in a batch.
pub(crate) const STATIC: u32 = 0;
