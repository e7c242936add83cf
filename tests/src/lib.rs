//! What the integration tests share. The tests themselves are in `tests/`, one file per subject.

pub mod browser;
pub mod fuzz;
#[cfg(feature = "mpi")]
pub mod mpi;
pub mod page;
pub mod processes;
pub mod program;
pub mod ranks;
pub mod scenes;
pub mod ways;
pub mod world;
