//! What each rank brings to the summary.

use crate::scene::Scene;
use atoll_core::{Phase, StepReport, TileFacts, World};
use bytemuck::{Pod, Zeroable};

/// How many phases a step has.
pub const PHASES: usize = Phase::ALL.len();

/// What one rank brings to the summary. Plain data, so that it travels as bytes.
#[derive(Clone, Copy, PartialEq, Default, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct RankFacts {
    /// Those of its tiles, as [`Hashes::to_words`].
    pub hashes: [u64; 4],
    /// Steps made.
    pub steps: u64,
    /// Of those, the ones that were made before the run went on from a snapshot.
    pub resumed_at: u64,
    /// Whether it was asked to stop early: 0 or 1.
    pub interrupted: u64,
    /// Bodies outside of the rectangle they must not leave.
    pub escaped: u64,
    /// Ghosts in the last step.
    pub ghosts: u64,
    /// Bodies received from other tiles, in the whole run.
    pub migrations: u64,
    /// Islands in the last step, each tile's counted apart.
    pub islands: u64,
    /// Bodies in the largest of them.
    pub largest_island: u64,
    /// Bodies whose islands sleep after the last step.
    pub asleep: u64,
    /// Colors of the contacts of one tile in the last step, at most.
    pub colors: u64,
    /// Bytes sent to other ranks by steps.
    pub bytes_sent: u64,
    /// Messages sent to other ranks by steps.
    pub messages_sent: u64,
    /// The most memory of the process, counted by one rank of it.
    pub peak_rss_bytes: u64,
    /// Time until the first step.
    pub build_nanos: u64,
    /// Time of all steps.
    pub wall_nanos: u64,
    /// Time in which the exchange waited for other ranks.
    pub wait_nanos: u64,
    /// Time in which the state was copied to be written, or the disk was waited for.
    pub output_nanos: u64,
    /// Time of each phase, in the order of [`Phase::ALL`].
    pub phase_nanos: [u64; PHASES],
}

/// What all ranks have to say at the end of a run.
#[derive(Clone, PartialEq, Debug)]
pub struct Gathered {
    /// By rank.
    pub ranks: Vec<RankFacts>,
    /// Of all tiles, in no order in particular.
    pub tiles: Vec<TileFacts>,
}

impl RankFacts {
    /// What the world of a rank and its last step have to say.
    pub fn new(world: &World, last: &StepReport, scene: &Scene) -> Self {
        Self {
            hashes: world.hashes().to_words(),
            steps: world.step_count(),
            escaped: world.bodies().filter(|body| scene.has_escaped(body)).count() as u64,
            ghosts: last.ghosts,
            islands: last.islands,
            largest_island: last.largest_island,
            asleep: last.asleep,
            colors: last.colors,
            phase_nanos: Phase::ALL.map(|phase| world.timings().total(phase).as_nanos() as u64),
            ..Self::default()
        }
    }
}
