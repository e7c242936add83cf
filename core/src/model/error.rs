//! What can go wrong, and what to do about it.

use crate::model::id::{GlobalId, KindId, TileId};
use thiserror::Error;

/// A world that cannot be built.
#[derive(Clone, PartialEq, Debug, Error)]
pub enum SetupError {
    /// A row of the table of kinds.
    #[error(
        "kind {}: sizes and density must be positive, damping and friction at least 0, restitution within 0 to 1, all of them \
         finite, and neither so small that its mass or inertia is none nor so large that these are beyond 1e30", kind.0
    )]
    BadKind {
        /// Its row.
        kind: KindId,
    },
    /// Belts are statics.
    #[error("kind {}: its surface runs, which only that of a static can: set surface_speed to 0", kind.0)]
    SurfaceMoves {
        /// Its row.
        kind: KindId,
    },
    /// Segments have no mass.
    #[error("kind {}: a segment has no area, and so no mass: use it for statics, or a capsule", kind.0)]
    SegmentMoves {
        /// Its row.
        kind: KindId,
    },
    /// A static body.
    #[error(
        "static body {id}: its name must be its own, its position finite and within 1e30 m, its rotation of \
         length one, its sizes and density positive and finite, friction at least 0, restitution within 0 to 1, its speed \
         at most 1e9 m/s"
    )]
    BadStatic {
        /// Its name.
        id: GlobalId,
    },
    /// A dynamic body, or what one is to become.
    #[error("body {id}: {fault}")]
    BadBody {
        /// Its name.
        id: GlobalId,
        /// What is wrong with it.
        fault: BodyFault,
    },
    /// What is to be done to a body.
    #[error(
        "body {id}: velocities, impulses and forces must be finite numbers, and lead to no more than 1e9 m/s and rad/s; give \
         smaller ones"
    )]
    NotFinite {
        /// Its name.
        id: GlobalId,
    },
    /// Two dynamic bodies of one name.
    #[error("body {id}: another body has this name; give each its own")]
    NameTaken {
        /// The name.
        id: GlobalId,
    },
    /// A parameter out of range.
    #[error("parameter {name} = {value}: must be {must}")]
    BadParam {
        /// The field of `Params`.
        name: &'static str,
        /// What it held.
        value: f64,
        /// What it may hold.
        must: &'static str,
    },
    /// The tile grid.
    #[error("tile grid of {columns} x {rows} tiles over {width} x {height} m: {must}")]
    BadGrid {
        /// Tiles along x.
        columns: u32,
        /// Tiles along y.
        rows: u32,
        /// Width of the domain in meters.
        width: f64,
        /// Height of the domain in meters.
        height: f64,
        /// What is asked of it.
        must: &'static str,
    },
    /// No cut of squares into tiles.
    #[error("tile {tile} of a forest: its level is not that of a part of a square, or the part would have no width")]
    BadForest {
        /// The first tile that is not in order.
        tile: TileId,
    },
    /// No cut of a domain in two, again and again.
    #[error("cut {cut} of a bisection does not lie within what it cuts, or leaves a part without a width")]
    BadBisection {
        /// The first cut that is not in order.
        cut: u32,
    },
    /// Tiles that become one are not all of one world, or a partition does not follow from another.
    #[error(
        "tile {tile}: the new partition does not follow from the one there is, or joins it with tiles that are elsewhere"
    )]
    TornApart {
        /// Which of the old partition, or the first.
        tile: TileId,
    },
    /// Frozen ghosts take nothing over within a step.
    #[error("ghosts = \"frozen\" goes with exchange = \"step\" only: read-only copies are heard of once a step")]
    FrozenSubsteps,
    /// Inner loops compiled for what is not there.
    #[error("instructions = \"{wanted}\": this processor does not have them all; use \"auto\"")]
    NoInstructions {
        /// Those that were asked for.
        wanted: &'static str,
    },
    /// A tile outside the grid, or named twice.
    #[error("tile {tile}: outside the grid, or given twice")]
    BadTile {
        /// Its name.
        tile: TileId,
    },
}

/// What is wrong with a dynamic body.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
pub enum BodyFault {
    /// Its state has numbers that are none.
    #[error("its position, rotation and velocities must be finite numbers")]
    NotFinite,
    /// It is farther out than can be reckoned with.
    #[error("its position must be within 1e30 m along each axis")]
    TooFar,
    /// Its rotation is none.
    #[error("its rotation must be of length one: a cosine and a sine whose squares add up to 1")]
    NoRotation,
    /// Its kind is no row of the table.
    #[error("there is no kind {}; use a row of the table of kinds", .0.0)]
    NoKind(KindId),
    /// Its name is that of a static.
    #[error("a static has this name; give each its own")]
    NameOfStatic,
}

/// A frame of bytes that is not one of ours.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
pub enum CodecError {
    /// The header does not decode.
    #[error("a frame of {length} bytes has no readable header: {reason}")]
    Header {
        /// Bytes received.
        length: usize,
        /// What the decoder said.
        reason: String,
    },
    /// Written by another version of the program.
    #[error("a frame of format {found} where {expected} is spoken: run the same version on every rank")]
    Version {
        /// In the frame.
        found: u32,
        /// Ours.
        expected: u32,
    },
    /// From another step or sync point: the ranks are out of step.
    #[error("a frame of step {found_step}, sync point {found_sync}, where step {step}, sync point {sync} is under way")]
    OutOfStep {
        /// Step in the frame.
        found_step: u64,
        /// Sync point in the frame.
        found_sync: u32,
        /// Our step.
        step: u64,
        /// Our sync point.
        sync: u32,
    },
    /// Lengths that do not add up.
    #[error("a frame of {length} bytes announces {announced}")]
    Length {
        /// Bytes received.
        length: usize,
        /// Bytes its header speaks of.
        announced: u64,
    },
    /// A message for a tile that lives elsewhere, or from a tile outside the grid.
    #[error("a message from tile {from} to tile {to}, which this rank does not hold")]
    WrongTile {
        /// Source.
        from: TileId,
        /// Destination.
        to: TileId,
    },
    /// A record that names a row the table of kinds does not have.
    #[error("a record of body {id} that no table entry describes")]
    BadRecord {
        /// The body.
        id: GlobalId,
    },
}

/// Why a step ended early. Every rank reports the same one.
#[derive(Clone, PartialEq, Debug, Error)]
pub enum StepError<E> {
    /// The halo failed: the transport's own error.
    #[error(transparent)]
    Halo(E),
    /// A position or velocity is no longer a finite number.
    #[error("step {step}: the state of body {id} is no longer finite; a shorter time step or a speed limit may help")]
    NonFinite {
        /// The step in which it appeared, counted from 0.
        step: u64,
        /// The lowest such body of the whole world.
        id: GlobalId,
    },
    /// A thread of this rank flushes small numbers to zero or rounds in another direction.
    #[error(
        "step {step}: the floating-point mode of a thread was changed (flush-to-zero, or another rounding); results \
         would differ between ranks: find the library that sets it"
    )]
    FloatMode {
        /// The step.
        step: u64,
    },
    /// Two tiles disagree about what was sent: a bug, memory gone bad, or a halo that lost something.
    #[error("step {step}: tile {tile} received state of a body it does not know")]
    Protocol {
        /// The step.
        step: u64,
        /// The receiving tile.
        tile: TileId,
    },
    /// An earlier step failed, and has left the world halfway.
    #[error(
        "step {step} failed and has left this world halfway: restore every tile of it, and tell it by resume_at which step is next"
    )]
    Halfway {
        /// The step that failed.
        step: u64,
    },
}

impl<E> StepError<E> {
    /// The same, of another halo.
    pub(crate) fn map_halo<F>(self, map: impl FnOnce(E) -> F) -> StepError<F> {
        match self {
            Self::Halo(error) => StepError::Halo(map(error)),
            Self::NonFinite { step, id } => StepError::NonFinite { step, id },
            Self::FloatMode { step } => StepError::FloatMode { step },
            Self::Protocol { step, tile } => StepError::Protocol { step, tile },
            Self::Halfway { step } => StepError::Halfway { step },
        }
    }
}
