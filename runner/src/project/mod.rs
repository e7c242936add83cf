//! What more ranks would bring, without having them: a run is made here on one thread, what each tile takes and what tiles tell
//! each other is kept, and then any number of ranks goes through that course in thought.
//!
//! What is left out: ranks whose cores are slower for what others on the same processor do, and the noise of an operating system.

mod counting;
mod course;
mod fit;
mod network;
mod plot;
mod predict;
mod table;

pub(crate) use fit::measured;
pub use network::Network;
pub(crate) use plot::svg;
pub use predict::Prediction;

use crate::config::{Balance, Retile};
use crate::error::RunError;
use crate::plan::Plan;
use crate::rank::Observer;
use atoll_transport::Rank;
use course::Course;
use predict::{Machine, predict};
use rayon::ThreadPoolBuilder;
use serde::Serialize;

/// The rules of dealing tiles that are compared.
const RULES: [Balance; 3] = [Balance::Off, Balance::Bodies, Balance::Measured];

/// What is wanted.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// Numbers of ranks.
    pub ranks: Vec<usize>,
    /// Threads of each.
    pub threads: usize,
    /// How many times the run is made here.
    pub times: u32,
    /// Between them.
    pub network: Network,
    /// Where that was measured, if it was.
    pub measured: Option<Measured>,
}

/// Where a network was measured. The fields are keys of the JSON file.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Measured {
    /// By which transport, as in `run.transport`.
    pub transport: &'static str,
    /// Among how many ranks.
    pub ranks: usize,
}

/// What some numbers of ranks would take. The fields are the keys of the JSON file.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Projection {
    /// Kind of scene.
    pub scene: &'static str,
    /// Fingerprint of what was run.
    pub config_hash: String,
    /// Bodies.
    pub bodies: u64,
    /// Steps.
    pub steps: u64,
    /// Columns and rows of tiles, or of the squares that they are cut from.
    pub tiles: [u32; 2],
    /// Bodies that a tile has at most before it is cut, if tiles follow the bodies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_bodies: Option<u64>,
    /// How tiles follow the bodies, if they do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retile: Option<Retile>,
    /// Of the network, in seconds.
    pub latency_s: f64,
    /// Of a rank, each way, in bytes per second.
    pub bandwidth: f64,
    /// Where these were measured, if they were.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured: Option<Measured>,
    /// Mean of a step here, on one thread, in milliseconds.
    pub ms_per_step_alone: f64,
    /// By ranks, and for each by rule.
    pub predictions: Vec<Prediction>,
}

impl Projection {
    /// Makes the steps of a plan of one rank here, and goes through them with every number of ranks. None if somebody asked
    /// to stop before all were made.
    ///
    /// # Errors
    /// If no world can be made of it, or its state is no longer finite.
    pub fn make(plan: &Plan, wanted: &Wanted, observer: &Observer) -> Result<Option<Self>, RunError> {
        let failed = |reason: String| RunError::Threads { rank: Rank(0), threads: 1, reason };
        let pool = ThreadPoolBuilder::new().num_threads(1).build().map_err(|error| failed(error.to_string()))?;
        let Some(course) = pool.install(|| Course::run(plan, wanted.times, observer))? else { return Ok(None) };
        let &Wanted { ref ranks, threads, network, measured, .. } = wanted;
        let one = |ranks: usize, rule| predict(&course, Machine { ranks, threads, network }, rule);
        let rules = |ranks: usize| if ranks == 1 { &RULES[..1] } else { &RULES };
        let predictions = ranks.iter().flat_map(|&ranks| rules(ranks).iter().map(move |&rule| (ranks, rule)));
        let alone = predict(&course, Machine { ranks: 1, threads: 1, network }, Balance::Off);
        Ok(Some(Self {
            scene: plan.config.scene.kind.name(),
            config_hash: plan.config.hash(plan.tiles),
            bodies: plan.scene.bodies(),
            steps: plan.config.run.steps,
            tiles: plan.tiles,
            max_bodies: plan.config.run.max_bodies(),
            retile: plan.config.run.retiling.map(|retiling| retiling.how),
            latency_s: network.latency,
            bandwidth: network.bandwidth,
            measured,
            ms_per_step_alone: alone.ms_per_step,
            predictions: predictions.map(|(ranks, rule)| one(ranks, rule)).collect(),
        }))
    }
}
