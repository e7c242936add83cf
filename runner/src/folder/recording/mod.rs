//! Recordings: the states of all bodies at every so many steps, in Parquet files that common tools read.
//!
//! ```text
//! DIR/rank-00000/                                a folder for each rank
//!    steps-0000000000-0000000090.parquet         a segment: at most ten records, named by its first and last step
//!    .steps-0000000100.parquet.tmp               the segment under way; no one may rely on it
//! ```
//!
//! A Parquet file without its footer cannot be read, so a segment gets its name when it is complete, and a run that is
//! killed loses no more than the segments under way. A record is one row group, and its rows are the bodies of one rank in the
//! order of its tiles. Each file says in its metadata which run it is of ([`RunFacts`]), which rank of how many wrote it, and
//! for each of its records the step, the number of rows and a checksum of their bytes in the file.
//!
//! | column | type | |
//! |---|---|---|
//! | `step` | unsigned, 32 bits | steps made since the start |
//! | `id` | unsigned, 64 bits | the body's name |
//! | `x`, `y` | f64 | center of mass, m |
//! | `angle` | f32 | rad, from -pi to pi |
//! | `vx`, `vy` | f32 | m/s |
//! | `omega` | f32 | rad/s |
//! | `kind` | unsigned, 32 bits | row of the table of kinds, which with all that never moves is in the metadata ([`Stage`]) |
//!
//! Recordings of format 1 have no such column and no such table.

mod error;
mod facts;
mod layout;
mod reader;
mod record;
mod remove;
mod segment;
mod stage;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;
mod writer;

pub use error::RecordingError;
pub use facts::RunFacts;
pub(crate) use reader::OfRun;
pub use reader::Recording;
pub use record::{Record, Row};
pub(crate) use remove::remove_after;
pub(crate) use segment::Segment;
pub(crate) use stage::distinct_kinds;
pub use stage::{Stage, StageText};
pub use writer::RecordingWriter;

use std::path::{Path, PathBuf};

/// Records in a segment, at most.
pub(crate) const RECORDS_PER_SEGMENT: usize = 10;

/// The folder of a rank within that of a run.
pub fn rank_folder(run: &Path, rank: u32) -> PathBuf {
    run.join(format!("rank-{rank:05}"))
}

/// Whether the folder of a rank may have that name.
pub(crate) fn is_rank_folder(name: &str) -> bool {
    rank_of_folder(name).is_some()
}

/// The rank whose folder has that name.
fn rank_of_folder(name: &str) -> Option<u32> {
    name.strip_prefix("rank-")?.parse().ok().filter(|rank| name == format!("rank-{rank:05}"))
}

/// The name of a complete segment.
fn segment_name(first: u64, last: u64) -> String {
    format!("steps-{first:010}-{last:010}.parquet")
}

/// The name of a segment under way.
fn open_segment_name(first: u64) -> String {
    format!(".steps-{first:010}.parquet.tmp")
}

/// Whether a file has the name of a segment under way.
fn is_open_segment(name: &str) -> bool {
    name.starts_with(".steps-") && name.ends_with(".parquet.tmp")
}

/// Whether a file of that name is a segment, complete or under way.
pub(crate) fn is_segment(name: &str) -> bool {
    is_open_segment(name) || steps_of_segment(name).is_some()
}

/// The first and the last step of a complete segment with that name.
fn steps_of_segment(name: &str) -> Option<(u64, u64)> {
    let (first, last) = name.strip_prefix("steps-")?.strip_suffix(".parquet")?.split_once('-')?;
    let steps = (first.parse().ok()?, last.parse().ok()?);
    (name == segment_name(steps.0, steps.1)).then_some(steps)
}
