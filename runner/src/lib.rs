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
//!
//! What there is to use:
//!
//! - [`Config`] says what to run, by the [keys](config) of a file; [`scene`] which bodies there are at the start.
//! - [`world`] makes the world of it, for a program that steps it itself.
//! - [`run`], and [`run_with`] an [`Observer`]: a [`Listener`] hears how it goes, a [`StopFlag`] ends it early. What comes of it
//!   is a [`Summary`] or a [`RunError`].
//! - [`recording`] reads what `atoll run --out` has recorded, [`compare`] says whether two recordings hold the same.
//! - [`main`] is the program itself, for a binary that brings it along.

#![forbid(unsafe_code)]

mod cli;
mod command;
pub mod config;
pub mod error;
mod folder;
mod launch;
mod look;
mod plan;
mod project;
mod quiet;
mod rank;
pub mod scene;
mod summary;
mod wording;

pub use cli::main;
pub use config::{Config, ConfigError, Override};
pub use error::{Exit, RunError};
pub use look::compare;
pub use rank::{Listener, Observer, StopFlag};
pub use summary::{PhaseTime, RankTimings, Summary};

use atoll_core::World;
use atoll_transport::Rank;
use plan::Plan;

/// The world of a configuration as its run begins with it, whole, for a program that [steps](atoll_core::step) it itself, on threads of its
/// own. Commands, output, and tilings that follow the bodies, are a matter of runs.
///
/// ```
/// use atoll_core::{Loopback, step};
///
/// let text = "[scene]\nkind = \"rooms\"\nbodies = 500\n[run]\nsteps = 3\ntiles = [2, 2]\n";
/// let config = atoll::Config::from_toml_str("example", text, &[])?;
/// let mut world = atoll::world(&config)?;
/// for _ in 0..3 {
///     step(&mut world, &mut Loopback)?;
/// }
/// assert_eq!(format!("{:032x}", world.hashes().state), atoll::run(&config)?.state_hash);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// If the configuration makes no world, one that is too crowded for a step, or its files cannot be read.
pub fn world(config: &Config) -> Result<World, RunError> {
    let mut config = config.clone();
    config.run.ranks = 1;
    let plan = Plan::new(&config)?;
    let world = rank::part_of_scene(&plan, Rank(0))?;
    let bodies = world.body_count() as u64;
    rank::not_crowded(world.crowding(), bodies)?;
    plan.scene.lost(bodies).map_or(Ok(world), |error| Err(error.into()))
}

/// Runs a configuration from start to end in this process and returns its summary. Prints nothing.
///
/// # Errors
/// If the configuration makes no world, a rank is lost, or the physics ends in a state that is not finite. Bodies lost
/// are no error here: the summary counts them.
pub fn run(config: &Config) -> Result<Summary, RunError> {
    run_with(config, &Observer::default())
}

/// As [`run`], with somebody who hears how it goes and a way to stop early.
///
/// ```
/// use std::sync::{Arc, Mutex};
///
/// #[derive(Debug, Default)]
/// struct Steps(Mutex<Vec<u64>>);
///
/// impl atoll::Listener for Steps {
///     fn begins(&self, _from: u64, _steps: u64) {}
///     fn made(&self, steps: u64) {
///         self.0.lock().unwrap().push(steps);
///     }
///     fn ends(&self) {}
///     fn note(&self, _text: &str) {}
/// }
///
/// let text = "[scene]\nkind = \"stack\"\n[run]\nsteps = 3\nranks = 2\n";
/// let steps = Arc::new(Steps::default());
/// let observer = atoll::Observer { listener: Some(steps.clone()), ..atoll::Observer::default() };
/// atoll::run_with(&atoll::Config::from_toml_str("example", text, &[])?, &observer)?;
/// assert_eq!(*steps.0.lock().unwrap(), [1, 2, 3]);
/// # Ok::<(), atoll::RunError>(())
/// ```
///
/// # Errors
/// As [`run`].
pub fn run_with(config: &Config, observer: &Observer) -> Result<Summary, RunError> {
    launch::run(&Plan::new(config)?, observer)
}

/// Reading what a run has recorded: `atoll run --out DIR --record-every K`.
pub mod recording {
    pub use crate::folder::Ended;
    pub use crate::folder::recording::{Recording, RecordingError, Row, RunFacts, Stage};
}

/// What the tests, benchmarks and fuzz targets of this workspace need beside the face of the crate. It may change at any time.
#[doc(hidden)]
pub mod internals {
    pub use crate::cli::args::{Cli, Command, one_line};
    pub use crate::command::rehearse;
    pub use crate::folder::RunFolder;
    pub use crate::folder::recording::{Record, RecordingWriter, StageText, rank_folder};
    pub use crate::launch::run as run_plan;
    pub use crate::look::live::overhear;
    pub use crate::plan::Plan;
    pub use crate::project::{Network, Prediction, Projection, Wanted};
    pub use crate::rank::{Held, Host, Next, PanicAt, Watcher, part_of_scene};
    pub use crate::scene::import::check as check_import;

    /// Bodies as the Parquet file of a scene.
    ///
    /// # Errors
    /// What the library says.
    pub fn parquet_of_bodies(bodies: &[atoll_core::Body]) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let columns = crate::scene::file::write::columns(bodies);
        crate::scene::file::write::parquet(&mut bytes, &columns, bodies)?;
        Ok(bytes)
    }
}
