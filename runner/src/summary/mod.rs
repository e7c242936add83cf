//! What became of a run: the figures of all ranks joined. Its fields are the JSON file; [`table`] is for people.

mod machine;
mod table;
pub(crate) mod timings;
pub(crate) mod trace;

pub use timings::RankTimings;

use crate::config::Retile;
use crate::plan::Plan;
use crate::rank::trace::RankTrace;
use crate::rank::{Gathered, RankFacts};
use atoll_core::{Facts, Hashes};
use serde::{Serialize, Serializer};

/// The time of one phase.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct PhaseTime {
    /// Per step, mean over ranks, in milliseconds.
    pub mean_ms: f64,
    /// Per step, on the rank that took longest, in milliseconds.
    pub max_rank_ms: f64,
    /// That rank.
    pub slowest_rank: usize,
}

/// What became of a run. The fields are the keys of the JSON file, in its order.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Summary {
    /// Of the program.
    pub version: &'static str,
    /// Kind of scene.
    pub scene: &'static str,
    /// As people are told of it.
    #[serde(skip)]
    pub(crate) title: String,
    /// Its seed.
    pub seed: u64,
    /// Whether that has a say in it: not where bodies are read from files.
    #[serde(skip)]
    pub(crate) is_seeded: bool,
    /// Fingerprint of everything in the configuration that the result depends on.
    pub config_hash: String,
    /// Dynamic bodies at the start.
    pub bodies: u64,
    /// Steps made.
    pub steps: u64,
    /// Where the run last went on from a snapshot: times, migrations and what was sent are counted from that step. 0 where it
    /// began at the start.
    pub resumed_at: u64,
    /// Whether the run was stopped before all steps were made.
    pub interrupted: bool,
    /// Ranks.
    pub ranks: usize,
    /// Threads of each rank.
    pub threads: usize,
    /// Columns and rows of tiles, or of the squares that they are cut from.
    pub tiles: [u32; 2],
    /// Bodies that a tile has at most before it is cut, if tiles follow the bodies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_bodies: Option<u64>,
    /// How tiles follow the bodies, if they do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retile: Option<Retile>,
    /// How many tiles there are after the last step.
    pub tile_count: u64,
    /// What carried bytes between ranks.
    pub transport: &'static str,
    /// The machine of rank 0, in words.
    pub machine: String,
    /// Until the first step, in seconds.
    pub build_s: f64,
    /// All steps, in seconds.
    pub wall_s: f64,
    /// Mean of a step, in milliseconds.
    pub ms_per_step: f64,
    /// Fingerprint of all bodies.
    pub state_hash: String,
    /// Fingerprint of all contacts.
    pub contact_hash: String,
    /// Bodies at the start less bodies at the end; anything but 0 is a bug.
    pub bodies_lost: i64,
    /// Bodies outside of the rectangle they must not leave.
    pub escaped: u64,
    /// Touching manifolds at the final positions.
    pub contacts: u64,
    /// The part of them between bodies of two tiles, 0 to 1.
    pub border_contact_fraction: f64,
    /// Copies of bodies held by tiles other than their owner's, in the last step; none, as all that is of that step, where the run went on
    /// from a snapshot and made no step.
    pub ghosts: Option<u64>,
    /// Changes of owner, in the whole run.
    pub migrations: u64,
    /// Groups of bodies in contact in the last step, each tile's counted apart.
    pub islands: Option<u64>,
    /// Bodies in the largest of them.
    pub largest_island: Option<u64>,
    /// Bodies whose islands sleep after the last step.
    pub asleep: Option<u64>,
    /// Colors of the contacts of one tile in the last step, at most; zero where they are not colored.
    pub colors: Option<u64>,
    /// Bytes sent from rank to rank by steps.
    pub bytes_sent: u64,
    /// Messages sent from rank to rank by steps.
    pub messages_sent: u64,
    /// The busiest rank's time on a core in a step over the mean of all ranks', the mean over all steps: 1 where all have as much
    /// to do.
    pub imbalance: f64,
    /// Tiles that went from one rank to another to make it less.
    pub tiles_moved: u64,
    /// In kg.
    pub mass: f64,
    /// In J, rotation included.
    pub kinetic_energy: f64,
    /// Mean over bodies of v^2 / 2, in m^2/s^2.
    pub mean_half_v2: f64,
    /// Mean over bodies of the squared angular velocity, in rad^2/s^2.
    pub mean_spin2: f64,
    /// In kg m/s.
    pub momentum: [f64; 2],
    /// The deepest overlap, in m.
    pub max_penetration: f64,
    /// Mean over overlapping contact points, in m.
    pub mean_penetration: f64,
    /// Mean speed at which contact points still came nearer than they may after the last solve, in m/s.
    pub constraint_violation: Option<f64>,
    /// The greatest, in m/s.
    pub max_constraint_violation: Option<f64>,
    /// Time of each phase; `wait` is the part of the exchange in which a rank waited for others, `other` what no phase
    /// accounts for, such as threads out of work.
    #[serde(serialize_with = "as_map")]
    pub phases: Vec<(&'static str, PhaseTime)>,
    /// The most memory held, summed over processes.
    pub peak_rss_bytes: u64,
    /// The time of each rank, for a file of its own.
    #[serde(skip)]
    pub timings: Vec<RankTimings>,
    /// What each rank did in the steps that somebody wanted to see, for a file of its own.
    #[serde(skip)]
    pub(crate) trace: Option<Vec<RankTrace>>,
}

impl Summary {
    /// Joins what the ranks and the tiles have to say.
    pub(crate) fn new(plan: &Plan, Gathered { ranks, tiles, trace }: Gathered) -> Self {
        let all = ranks.iter().copied().reduce(RankFacts::join).unwrap_or_default();
        let facts = Facts::total(tiles);
        let hashes = Hashes::from_words(all.hashes);
        let made = all.steps - all.resumed_at;
        // A snapshot tells nothing of how the step before it went.
        let made_any = made > 0 || all.resumed_at == 0;
        let threads = plan.threads;
        let timings: Vec<_> =
            ranks.iter().enumerate().map(|(rank, facts)| RankTimings::new(rank, threads, facts)).collect();
        let wall_s = all.wall_nanos as f64 * 1e-9;
        let fraction = |part: u64, whole: u64| if whole > 0 { part as f64 / whole as f64 } else { 0.0 };
        Self {
            version: env!("CARGO_PKG_VERSION"),
            scene: plan.config.scene.kind.name(),
            title: plan.config.scene.kind.title().into_owned(),
            seed: plan.config.scene.seed,
            is_seeded: plan.scene.file().is_none(),
            config_hash: plan.config.hash(plan.tiles),
            bodies: all.expected,
            steps: all.steps,
            resumed_at: all.resumed_at,
            interrupted: all.interrupted > 0,
            ranks: ranks.len(),
            threads,
            tiles: plan.tiles,
            max_bodies: plan.config.run.max_bodies(),
            retile: plan.config.run.retiling.map(|retiling| retiling.how),
            tile_count: all.tile_count,
            transport: plan.transport.name(),
            machine: machine::words(),
            build_s: all.build_nanos as f64 * 1e-9,
            wall_s,
            ms_per_step: wall_s * 1e3 / made.max(1) as f64,
            state_hash: format!("{:032x}", hashes.state),
            contact_hash: format!("{:032x}", hashes.contact),
            bodies_lost: all.expected as i64 - facts.bodies as i64,
            escaped: all.escaped,
            contacts: facts.contacts,
            border_contact_fraction: fraction(facts.border_contacts, facts.contacts),
            ghosts: made_any.then_some(all.ghosts),
            migrations: all.migrations,
            islands: made_any.then_some(all.islands),
            largest_island: made_any.then_some(all.largest_island),
            asleep: made_any.then_some(all.asleep),
            colors: made_any.then_some(all.colors),
            bytes_sent: all.bytes_sent,
            messages_sent: all.messages_sent,
            imbalance: if all.imbalance > 0 { all.imbalance as f64 * 1e-6 } else { 1.0 },
            tiles_moved: all.tiles_moved,
            mass: facts.mass,
            kinetic_energy: facts.kinetic_energy,
            mean_half_v2: facts.mean_half_v2,
            mean_spin2: facts.mean_spin2,
            momentum: facts.momentum,
            max_penetration: facts.max_penetration,
            mean_penetration: facts.mean_penetration,
            constraint_violation: made_any.then_some(facts.mean_violation),
            max_constraint_violation: made_any.then_some(facts.max_violation),
            phases: phases(&timings),
            peak_rss_bytes: all.peak_rss_bytes,
            timings,
            trace,
        }
    }

    /// As JSON, with a line for each key.
    pub fn to_json(&self) -> Vec<u8> {
        let mut text = serde_json::to_vec_pretty(self).expect("figures and words, under names");
        text.push(b'\n');
        text
    }
}

/// Each phase over all ranks.
fn phases(ranks: &[RankTimings]) -> Vec<(&'static str, PhaseTime)> {
    let names = ranks.first().map_or(&[][..], |rank| &rank.phases);
    let time = |phase: usize| {
        let ms = |rank: &RankTimings| rank.mean_ms(rank.phases[phase].1);
        let most = ranks.iter().map(ms).fold(0.0, f64::max);
        let slowest_rank = ranks.iter().position(|rank| ms(rank) == most).unwrap_or(0);
        let mean_ms = ranks.iter().map(ms).sum::<f64>() / ranks.len() as f64;
        PhaseTime { mean_ms, max_rank_ms: most, slowest_rank }
    };
    names.iter().enumerate().map(|(i, &(name, _))| (name, time(i))).collect()
}

fn as_map<S: Serializer>(phases: &[(&'static str, PhaseTime)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(phases.iter().copied())
}
