//! Why a run ended early, and with which exit code.

pub use crate::command::ScriptError;
pub use crate::config::ConfigError;
pub use crate::folder::recording::RecordingError;
pub use crate::folder::snapshot::SnapshotError;
pub use crate::folder::{EndedError, FolderError, LogError};
pub use crate::scene::SceneError;

use crate::wording::Typed;
use atoll_core::{GlobalId, SetupError, TileId};
use atoll_transport::Rank;
use std::path::PathBuf;
use thiserror::Error;

/// What the program's exit code says.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub enum Exit {
    /// All steps were made and every check passed.
    Done = 0,
    /// What was compared is not the same.
    Differs = 1,
    /// Bad input or usage.
    Usage = 2,
    /// A rank was lost.
    PeerLost = 3,
    /// The physics failed a check.
    Physics = 4,
    /// Output could not be written.
    Output = 5,
    /// Interrupted; of a run the summary tells how far it came.
    Interrupted = 130,
}

impl Exit {
    /// The exit code of that number; a number that is none of them stands for a lost rank.
    pub fn from_code(code: u8) -> Self {
        let all =
            [Self::Done, Self::Differs, Self::Usage, Self::PeerLost, Self::Physics, Self::Output, Self::Interrupted];
        all.into_iter().find(|exit| *exit as u8 == code).unwrap_or(Self::PeerLost)
    }
}

/// A run that has no summary, or could not write it.
#[derive(Debug, Error)]
pub enum RunError {
    /// The configuration.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The world it describes.
    #[error("this configuration makes no world: {0}")]
    Setup(#[from] SetupError),
    /// A file of a scene, as it is when bodies are read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// More than this machine can hold.
    #[error(
        "too large for {within}: {what} need about {} of memory, and {} are free: use fewer",
        size(*.needed),
        size(*.available)
    )]
    TooLarge {
        /// What sets the bound.
        within: &'static str,
        /// Bodies, and what else was asked for or is so by default.
        what: String,
        /// Bytes, estimated.
        needed: u64,
        /// Bytes free.
        available: u64,
    },
    /// More bodies at one place than any world is meant to have.
    #[error(
        "too crowded: at least {pairs} pairs of the {bodies} bodies are nearer to each other than they are wide, and each would \
         be a contact; give them more room, or make them smaller"
    )]
    Crowded {
        /// Pairs that are too near, at least.
        pairs: u64,
        /// Bodies.
        bodies: u64,
    },
    /// An option, or what stands for one, that does not suit what it is used with.
    #[error("{option}: {reason}")]
    Unsuitable {
        /// What was given.
        option: String,
        /// Why not, and what else to give.
        reason: String,
    },
    /// `RUST_LOG`.
    #[error("RUST_LOG = {value}: {reason}; write a level or target=level, such as atoll=debug")]
    LogFilter {
        /// Its value.
        value: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A path to write to, found unusable before the run.
    #[error("{option} {}: {reason}; give a path that can be written", .path.display())]
    BadOutput {
        /// What it was given with.
        option: &'static str,
        /// The path.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// A path to write to at which there is, or will be, what must not be lost.
    #[error("{option} {}: that is {what} and must not be written over; give another path", .path.display())]
    TakenOutput {
        /// What it was given with.
        option: &'static str,
        /// The path.
        path: PathBuf,
        /// What is there.
        what: String,
    },
    /// A path at which pictures cannot be written, as its ending is unknown or what it takes is not there.
    #[error("--out {}: {reason}", .path.display())]
    BadFilm {
        /// The path.
        path: PathBuf,
        /// Why, and what would help.
        reason: String,
    },
    /// A file of commands.
    #[error(transparent)]
    Script(#[from] ScriptError),
    /// A folder for the run's output that cannot be used.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A run that is to go on and is at its end.
    #[error("all {steps} steps of this run are made already, see {}; {}", .summary.display(), if *.goes_on {
        "give more --steps to go on"
    } else {
        "it left no snapshot to go on from: for more steps begin another run with --out"
    })]
    Complete {
        /// What it came to.
        summary: PathBuf,
        /// How many it was to make.
        steps: u64,
        /// Whether it left a snapshot to go on from.
        goes_on: bool,
    },
    /// A recording that cannot be written or read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A snapshot that cannot be used.
    #[error(transparent)]
    Snapshot(#[from] SnapshotError),
    /// A log that cannot be gone on with.
    #[error("{0}; bring back a good copy of it, or move it away, and a new one is begun")]
    Log(LogError),
    /// A rank whose threads cannot be had.
    #[error(
        "rank {rank} cannot start {}: {reason}; use fewer threads or ranks",
        if *.threads == 1 { "a thread".to_owned() } else { format!("{threads} threads") }
    )]
    Threads {
        /// The rank.
        rank: Rank,
        /// How many it wanted.
        threads: usize,
        /// What the system said.
        reason: String,
    },
    /// A rank is gone, or sends what cannot be read.
    #[error("rank {rank} was lost after {complete} of {steps} steps: {reason}")]
    PeerLost {
        /// The rank where the trouble began.
        rank: Rank,
        /// Steps that every remaining rank has completed.
        complete: u64,
        /// Steps asked for.
        steps: u64,
        /// What happened to it.
        reason: String,
    },
    /// A transport whose ranks are processes was asked for where there is only this one.
    #[error("transport {transport} runs ranks as processes of their own, each the program itself; use `atoll run`")]
    NeedsProcesses {
        /// Its name.
        transport: &'static str,
    },
    /// The processes of a run were not started alike.
    #[error("rank {rank} was started with {what} {found}, and most ranks with {expected}; start all of them alike")]
    Mismatch {
        /// The odd one.
        rank: Rank,
        /// In what it differs.
        what: String,
        /// What it has.
        found: String,
        /// What the others have.
        expected: String,
    },
    /// The processes that are to be the ranks cannot be started, or do not find together.
    #[error("{0}")]
    Ranks(String),
    /// What a rank in a process of its own said.
    #[error("{text}")]
    Relayed {
        /// Its words.
        text: String,
        /// The exit code they go with.
        exit: Exit,
    },
    /// What the user has been told already, by this rank or another.
    #[error("see what was said before")]
    ToldElsewhere {
        /// The exit code that goes with it.
        exit: Exit,
    },
    /// The transport was used wrongly.
    #[error("the transport refused after {complete} of {steps} steps: {reason}")]
    Transport {
        /// Steps completed.
        complete: u64,
        /// Steps asked for.
        steps: u64,
        /// What it said.
        reason: String,
    },
    /// A position or velocity is no longer a number.
    #[error(
        "step {step}: the state of body {id} is no longer finite; a higher physics.hertz, or a limit such as \
         physics.max_linear_speed, may help"
    )]
    NonFinite {
        /// The step, counted from 0.
        step: u64,
        /// The lowest such body.
        id: GlobalId,
    },
    /// Two tiles disagree.
    #[error("step {step}: tile {tile} received state of a body it does not know; please report this")]
    Protocol {
        /// The step, counted from 0.
        step: u64,
        /// The tile.
        tile: TileId,
    },
    /// A thread's floating-point unit was switched to another mode.
    #[error(
        "step {step}: the floating-point mode of a thread was changed (flush-to-zero, or another rounding), so results \
         would differ between ranks; find the library that sets it"
    )]
    FloatMode {
        /// The step, counted from 0.
        step: u64,
    },
    /// Bodies are missing, or there are too many.
    #[error("the physics failed a check: {found} bodies at the end of a world of {expected}; please report this")]
    BodiesLost {
        /// At the start.
        expected: u64,
        /// At the end.
        found: u64,
    },
    /// A result could not be written.
    #[error("cannot write {}: {reason}", .path.display())]
    Output {
        /// The path.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// What a run wrote was not there any more at its end.
    #[error(
        "{} is gone: somebody removed it while the run wrote there, so the folder does not hold all of the run; begin anew \
         with --out", .path.display()
    )]
    Gone {
        /// A file that should be there.
        path: PathBuf,
    },
    /// A run that could not write any more, and stopped.
    #[error(
        "{why}; stopped after {complete} of {steps} steps, and what was written before is whole: mend this and go on with \
         `atoll run --resume {}`", Typed(.folder)
    )]
    StoppedWriting {
        /// What could not be written.
        why: String,
        /// Steps completed.
        complete: u64,
        /// Steps asked for.
        steps: u64,
        /// The folder of the run.
        folder: PathBuf,
    },
    /// A run without a folder that could not write its log any more, and stopped.
    #[error("{why}; stopped after {complete} of {steps} steps")]
    StoppedLogging {
        /// What could not be written.
        why: String,
        /// Steps completed.
        complete: u64,
        /// Steps asked for.
        steps: u64,
    },
}

/// Bytes, as people read them.
fn size(bytes: u64) -> String {
    let (bytes, giga) = (bytes as f64, 1e9);
    if bytes < 0.1 * giga { format!("{:.1} MB", bytes * 1e-6) } else { format!("{:.1} GB", bytes / giga) }
}

impl RunError {
    /// Whether a world of so many bodies ended with as many, if so many were lost.
    ///
    /// # Errors
    /// If not.
    pub fn check_bodies(expected: u64, lost: i64) -> Result<(), Self> {
        let found = expected.wrapping_add_signed(lost.wrapping_neg());
        if lost == 0 { Ok(()) } else { Err(Self::BodiesLost { expected, found }) }
    }

    /// The exit code that tells of this error.
    pub fn exit(&self) -> Exit {
        match self {
            Self::Recording(RecordingError::Write { .. })
            | Self::Output { .. }
            | Self::Folder(FolderError::Full { .. })
            | Self::Gone { .. }
            | Self::StoppedWriting { .. }
            | Self::StoppedLogging { .. } => Exit::Output,
            Self::Config(_)
            | Self::Setup(_)
            | Self::Scene(_)
            | Self::Unsuitable { .. }
            | Self::LogFilter { .. }
            | Self::BadOutput { .. }
            | Self::TakenOutput { .. }
            | Self::BadFilm { .. }
            | Self::Script(_)
            | Self::Folder(_)
            | Self::Snapshot(_)
            | Self::Recording(_)
            | Self::Log(_)
            | Self::TooLarge { .. }
            | Self::Crowded { .. }
            | Self::Threads { .. }
            | Self::NeedsProcesses { .. }
            | Self::Mismatch { .. }
            | Self::Ranks(_) => Exit::Usage,
            Self::Relayed { exit, .. } | Self::ToldElsewhere { exit } => *exit,
            Self::PeerLost { .. } | Self::Transport { .. } => Exit::PeerLost,
            Self::NonFinite { .. } | Self::Protocol { .. } | Self::FloatMode { .. } | Self::BodiesLost { .. } => {
                Exit::Physics
            }
            Self::Complete { .. } => Exit::Done,
        }
    }
}
