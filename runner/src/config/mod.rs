//! What to run: the scene, the physics, and how to spread it. Read from TOML, with the command line winning over it.
//!
//! `configs/normal.toml` shows all keys with their defaults. They stand in one table, in `keys.rs`, from which reading and
//! writing follow; to add a key, begin there.

mod difference;
mod error;
mod forms;
mod keys;
mod read;
mod resolved;
mod scene_forms;
mod sections;
mod settings;
mod spelling;
#[cfg(test)]
mod tests;
mod words;

pub(crate) use difference::{Difference, differences, other_run};
pub use error::{ConfigError, Given, Origin};
pub(crate) use resolved::{identity, is_resolved};
pub use sections::{Balance, Config, MpiExchange, OutputConfig, Retile, Retiling, RunConfig, TransportKind};
pub(crate) use sections::{MOST_THREADS, MOST_TILES};
pub use settings::Override;
