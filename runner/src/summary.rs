//! What became of a run: the figures of all ranks joined, as JSON and as a table for people.

use crate::plan::Plan;
use crate::scene::Scene;
use crate::timings::RankTimings;
use atoll_core::{Facts, Hashes, Phase, StepReport, TileFacts, World};
use bytemuck::{Pod, Zeroable};
use serde::{Serialize, Serializer};
use std::fmt;

const PHASES: usize = Phase::ALL.len();

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

    fn timings(&self, rank: usize, threads: usize) -> RankTimings {
        let rest = self.wall_nanos.saturating_sub(self.phase_nanos.iter().sum::<u64>() + self.output_nanos);
        let mut phases = Vec::with_capacity(PHASES + 3);
        for (phase, nanos) in Phase::ALL.into_iter().zip(self.phase_nanos) {
            if phase == Phase::Exchange {
                // The part in which nothing was done but wait is told apart.
                let waited = self.wait_nanos.min(nanos);
                phases.extend([(phase.name(), nanos - waited), ("wait", waited)]);
            } else {
                phases.push((phase.name(), nanos));
            }
        }
        phases.extend([("output", self.output_nanos), ("other", rest)]);
        let steps = self.steps - self.resumed_at;
        RankTimings { rank, threads, steps, wall_nanos: self.wall_nanos, phases }
    }
}

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
    /// Its seed.
    pub seed: u64,
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
    /// Columns and rows of tiles.
    pub tiles: [u32; 2],
    /// What carried bytes between ranks.
    pub transport: &'static str,
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
    /// Copies of bodies held by tiles other than their owner's, in the last step.
    pub ghosts: u64,
    /// Changes of owner, in the whole run.
    pub migrations: u64,
    /// Groups of bodies in contact in the last step, each tile's counted apart.
    pub islands: u64,
    /// Bodies in the largest of them.
    pub largest_island: u64,
    /// Bodies whose islands sleep after the last step.
    pub asleep: u64,
    /// Colors of the contacts of one tile in the last step, at most; zero where they are not colored.
    pub colors: u64,
    /// Bytes sent from rank to rank by steps.
    pub bytes_sent: u64,
    /// Messages sent from rank to rank by steps.
    pub messages_sent: u64,
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
    pub constraint_violation: f64,
    /// The greatest, in m/s.
    pub max_constraint_violation: f64,
    /// Time of each phase; `wait` is the part of the exchange in which a rank waited for others, `other` what no phase
    /// accounts for, such as threads out of work.
    #[serde(serialize_with = "as_map")]
    pub phases: Vec<(&'static str, PhaseTime)>,
    /// The most memory held, summed over processes.
    pub peak_rss_bytes: u64,
    /// The time of each rank, for a file of its own.
    #[serde(skip)]
    pub timings: Vec<RankTimings>,
}

impl Summary {
    /// Joins what the ranks and the tiles have to say.
    pub fn new(plan: &Plan, Gathered { ranks, tiles }: Gathered) -> Self {
        let sum = |field: fn(&RankFacts) -> u64| ranks.iter().map(field).sum::<u64>();
        let most = |field: fn(&RankFacts) -> u64| ranks.iter().map(field).max().unwrap_or(0);
        let facts = Facts::total(tiles);
        let hashes = ranks.iter().map(|rank| Hashes::from_words(rank.hashes)).fold(Hashes::default(), Hashes::merge);
        let (steps, resumed_at) = (most(|rank| rank.steps), most(|rank| rank.resumed_at));
        let made = steps - resumed_at;
        let threads = plan.config.run.threads;
        let timings: Vec<_> = ranks.iter().enumerate().map(|(rank, facts)| facts.timings(rank, threads)).collect();
        let wall_s = most(|rank| rank.wall_nanos) as f64 * 1e-9;
        let fraction = |part: u64, whole: u64| if whole > 0 { part as f64 / whole as f64 } else { 0.0 };
        Self {
            version: env!("CARGO_PKG_VERSION"),
            scene: plan.config.scene.kind.name(),
            seed: plan.config.scene.seed,
            config_hash: plan.config.hash(plan.tiles),
            bodies: plan.scene.bodies(),
            steps,
            resumed_at,
            interrupted: most(|rank| rank.interrupted) > 0,
            ranks: ranks.len(),
            threads,
            tiles: plan.tiles,
            transport: plan.transport.name(),
            build_s: most(|rank| rank.build_nanos) as f64 * 1e-9,
            wall_s,
            ms_per_step: wall_s * 1e3 / made.max(1) as f64,
            state_hash: format!("{:032x}", hashes.state),
            contact_hash: format!("{:032x}", hashes.contact),
            bodies_lost: plan.scene.bodies() as i64 - facts.bodies as i64,
            escaped: sum(|rank| rank.escaped),
            contacts: facts.contacts,
            border_contact_fraction: fraction(facts.border_contacts, facts.contacts),
            ghosts: sum(|rank| rank.ghosts),
            migrations: sum(|rank| rank.migrations),
            islands: sum(|rank| rank.islands),
            largest_island: most(|rank| rank.largest_island),
            asleep: sum(|rank| rank.asleep),
            colors: most(|rank| rank.colors),
            bytes_sent: sum(|rank| rank.bytes_sent),
            messages_sent: sum(|rank| rank.messages_sent),
            mass: facts.mass,
            kinetic_energy: facts.kinetic_energy,
            mean_half_v2: facts.mean_half_v2,
            mean_spin2: facts.mean_spin2,
            momentum: facts.momentum,
            max_penetration: facts.max_penetration,
            mean_penetration: facts.mean_penetration,
            constraint_violation: facts.mean_violation,
            max_constraint_violation: facts.max_violation,
            phases: phases(&timings),
            peak_rss_bytes: sum(|rank| rank.peak_rss_bytes),
            timings,
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

/// The closing report.
impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [columns, rows] = self.tiles;
        let plural = |count: u64, word: &str| format!("{count} {word}{}", if count == 1 { "" } else { "s" });
        let (ranks, threads) = (plural(self.ranks as u64, "rank"), plural(self.threads as u64, "thread"));
        writeln!(f, "{}: {} bodies, seed {}, {columns} x {rows} tiles", self.scene, self.bodies, self.seed)?;
        writeln!(f, "{ranks} ({}), {threads} each; built in {:.2} s", self.transport, self.build_s)?;
        let early = if self.interrupted { ", interrupted" } else { "" };
        let rate = if self.wall_s > 0.0 { (self.steps - self.resumed_at) as f64 / self.wall_s } else { 0.0 };
        let each = self.ms_per_step;
        let after = if self.resumed_at > 0 { format!(" after the first {}", self.resumed_at) } else { String::new() };
        let steps = plural(self.steps - self.resumed_at, "step");
        writeln!(f, "{steps}{after} in {:.2} s: {each:.3} ms per step, {rate:.1} steps/s{early}", self.wall_s)?;
        self.write_phases(f)?;
        self.write_facts(f)
    }
}

impl Summary {
    fn write_phases(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let total: f64 = self.phases.iter().map(|(_, time)| time.mean_ms).sum();
        let share = |ms: f64| if total > 0.0 { 100.0 * ms / total } else { 0.0 };
        writeln!(f)?;
        writeln!(f, "{:<14}{:>10}{:>9}{:>15}", "phase", "ms/step", "share", "slowest rank")?;
        for (name, time) in &self.phases {
            let (mean, slowest) = (time.mean_ms, format!("{:.3} (#{})", time.max_rank_ms, time.slowest_rank));
            writeln!(f, "{:<14}{mean:>10.3}{:>7.1} %{slowest:>15}", name.replace('_', " "), share(mean))?;
        }
        writeln!(f, "{:<14}{total:>10.3}{:>7.1} %", "total", share(total))?;
        writeln!(f)
    }

    fn write_facts(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let row = |f: &mut fmt::Formatter<'_>, name: &str, text: fmt::Arguments<'_>| writeln!(f, "{name:<14}{text}");
        let mega = 1e-6;
        row(f, "bodies", format_args!("{}, {} lost, {} escaped", self.bodies, self.bodies_lost, self.escaped))?;
        let border = 100.0 * self.border_contact_fraction;
        row(f, "contacts", format_args!("{} touching, {border:.2} % across tiles", self.contacts))?;
        let (mean, most) = (self.mean_penetration, self.max_penetration);
        row(f, "overlap", format_args!("{mean:.5} m on the average, {most:.5} m at most"))?;
        let (mean, most) = (self.constraint_violation, self.max_constraint_violation);
        row(f, "violation", format_args!("{mean:.5} m/s on the average after the last solve, {most:.5} m/s at most"))?;
        let (islands, largest, colors) = (self.islands, self.largest_island, self.colors);
        let asleep = if self.asleep > 0 { format!(", {} bodies asleep", self.asleep) } else { String::new() };
        row(f, "islands", format_args!("{islands}, the largest of {largest} bodies{asleep}; {colors} colors"))?;
        let (half_v2, spin2) = (self.mean_half_v2, self.mean_spin2);
        row(f, "motion", format_args!("mean v^2/2 {half_v2:.6} m^2/s^2, mean spin^2 {spin2:.6} rad^2/s^2"))?;
        let [x, y] = self.momentum;
        row(f, "energy", format_args!("{:.6e} J, momentum ({x:.6e}, {y:.6e}) kg m/s", self.kinetic_energy))?;
        row(
            f,
            "tiles",
            format_args!("{} ghosts in the last step, {} migrations in all", self.ghosts, self.migrations),
        )?;
        let sent = self.bytes_sent as f64 * mega;
        row(f, "sent", format_args!("{sent:.1} MB between ranks in {} messages", self.messages_sent))?;
        row(f, "memory", format_args!("{:.0} MB at most", self.peak_rss_bytes as f64 * mega))?;
        row(f, "config hash", format_args!("{}", self.config_hash))?;
        row(f, "state hash", format_args!("{}", self.state_hash))?;
        row(f, "contact hash", format_args!("{}", self.contact_hash))
    }
}
