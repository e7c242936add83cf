//! What a run leaves on disk.
//!
//! ```text
//! DIR/run.toml        the configuration with every value that was used; `atoll run` this file to repeat the run
//! DIR/summary.json    as --json writes it, once the run has ended
//! DIR/log.csv         figures over time, a row after every so many steps (log_file.rs)
//! DIR/timings.csv     as --timings writes it, once the run has ended
//! DIR/tilings.jsonl   the tiles, where these follow the bodies (tilings.rs)
//! DIR/commands.jsonl  what was done while it ran, and is planned; `atoll run DIR/run.toml --commands` this file repeats it
//! DIR/lock            held by every process of the run
//! DIR/rank-00000/     segments of the recording, a folder for each rank (recording/)
//! DIR/snapshots/      (snapshot/)
//! ```

mod answers_file;
mod claim;
pub(crate) mod durable;
mod ended;
mod error;
mod log_file;
pub(crate) mod recording;
mod run_folder;
pub(crate) mod snapshot;
mod tilings;

pub(crate) use answers_file::AnswersFile;
pub(crate) use claim::Claim;
pub use ended::{Ended, EndedError};
pub use error::FolderError;
pub use log_file::LogError;
pub(crate) use log_file::{LogFile, Rows};
pub use run_folder::RunFolder;
pub(crate) use tilings::{TilingsFile, in_letters};
