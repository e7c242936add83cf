//! The program `atoll`: runs the scenes of `configs/` on any number of ranks and threads, with the same bits.
//!
//! The physics is in `atoll_core`, the bytes between ranks in `atoll_transport`; here they meet. [`run`] does without
//! a terminal what `atoll run` does with one:
//!
//! ```
//! let text = "[scene]\nkind = \"rooms\"\nbodies = 500\n[run]\nsteps = 3\ntiles = [2, 2]\n";
//! let one = atoll::run(&atoll::Config::from_toml_str("example", text, &[])?)?;
//! let two = atoll::run(&atoll::Config::from_toml_str("example", text, &[("ranks", "2")])?)?;
//! assert_eq!(one.state_hash, two.state_hash);
//! assert_eq!(one.bodies_lost, 0);
//! # Ok::<(), atoll::RunError>(())
//! ```

#![forbid(unsafe_code)]

pub mod cli;
pub mod compare;
pub mod config;
pub mod error;
pub mod folder;
pub mod launch;
pub mod plan;
pub mod rank;
pub mod scene;
pub mod summary;

pub use config::Config;
pub use error::RunError;
pub use summary::Summary;

use plan::Plan;
use rank::Observer;

/// Runs a configuration from start to end in this process and returns its summary. Prints nothing.
///
/// # Errors
/// If the configuration makes no world, a rank is lost, or the physics ends in a state that is not finite. Bodies lost
/// are no error here: the summary counts them.
pub fn run(config: &Config) -> Result<Summary, RunError> {
    run_with(config, &Observer::default())
}

/// As [`run`], with progress shown and a way to stop early.
///
/// # Errors
/// As [`run`].
pub fn run_with(config: &Config, observer: &Observer) -> Result<Summary, RunError> {
    launch::run(&Plan::new(config)?, observer)
}
