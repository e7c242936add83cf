//! The domain cut into tiles: what stands in it for good, which point is whose, and what a tile holds.

pub(crate) mod blueprint;
pub(crate) mod chains;
pub(crate) mod changes;
mod memory;
pub(crate) mod partition;
pub(crate) mod pushes;
pub(crate) mod regroup;
pub(crate) mod statics;
pub(crate) mod terrain;
pub(crate) mod tile;
