//! The domain cut into tiles: which point is whose, and what a tile holds.

pub(crate) mod partition;
pub(crate) mod tile;
