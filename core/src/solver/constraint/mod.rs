//! Constraints between two bodies, laid out for vectors: groups of eight, their rows, and what a pass does to a group.

pub(crate) mod groups;
pub(crate) mod kernels;
pub(crate) mod rows;
