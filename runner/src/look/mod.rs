//! What is made of a run for people and other programs to look at, while it goes on or from what it has left.

pub mod compare;
mod convex;
pub(crate) mod film;
pub(crate) mod frame;
pub(crate) mod live;
pub(crate) mod picture;
pub(crate) mod recorded;
pub(crate) mod report;
pub(crate) mod source;
pub(crate) mod vtk;
