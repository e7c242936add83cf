//! What a run leaves on disk.
//!
//! ```text
//! DIR/run.toml        the configuration with every value that was used; `atoll run` this file to repeat the run
//! DIR/summary.json    as --json writes it, once the run has ended
//! DIR/lock            held by every process of the run
//! DIR/rank-00000/     segments of the recording, a folder for each rank (recording/)
//! DIR/snapshots/      (snapshot/)
//! ```

mod claim;
pub(crate) mod durable;
mod ended;
mod error;
pub(crate) mod recording;
mod run_folder;
pub(crate) mod snapshot;

pub(crate) use claim::Claim;
pub use ended::{Ended, EndedError};
pub use error::FolderError;
pub use run_folder::RunFolder;
