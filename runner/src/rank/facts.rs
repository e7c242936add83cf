//! What each rank brings to the summary.

use super::trace::RankTrace;
use crate::scene::Scene;
use atoll_core::{Hashes, Phase, StepReport, TileFacts, World};
use bytemuck::{Pod, Zeroable};

/// How many phases a step has.
pub(super) const PHASES: usize = Phase::ALL.len();

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
    /// Bodies that there are to be, of all ranks.
    pub expected: u64,
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
    /// Time in which the state was copied to be written, the disk was waited for, or a row of the log was made.
    pub output_nanos: u64,
    /// Time in which ranks told each other how busy they are, and tiles went from one to another.
    pub balance_nanos: u64,
    /// Tiles of all ranks after the last step.
    pub tile_count: u64,
    /// Tiles that went from one rank to another, of all ranks.
    pub tiles_moved: u64,
    /// The busiest rank's time on a core over the mean of all ranks, the mean over all steps, in millionths.
    pub imbalance: u64,
    /// Time of each phase, in the order of [`Phase::ALL`].
    pub phase_nanos: [u64; PHASES],
}

/// What all ranks have to say at the end of a run.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Gathered {
    /// By rank.
    pub ranks: Vec<RankFacts>,
    /// Of all tiles, in no order in particular.
    pub tiles: Vec<TileFacts>,
    /// What their threads did in some steps, by rank, if anybody wants to see that.
    pub trace: Option<Vec<RankTrace>>,
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
            tile_count: world.partition().tiles() as u64,
            phase_nanos: Phase::ALL.map(|phase| world.timings().total(phase).as_nanos() as u64),
            ..Self::default()
        }
    }

    /// The time of each phase in the order of the step, in nanoseconds, `wait`, the part of the exchange in which it waited for
    /// other ranks, `balance`, in which tiles went from rank to rank, `output`, and `other`, which no phase accounts for, such as threads out of work. They add up to all of it, but for
    /// rounding.
    pub fn phases(&self) -> Vec<(&'static str, u64)> {
        let told = self.phase_nanos.iter().sum::<u64>() + self.balance_nanos + self.output_nanos;
        let rest = self.wall_nanos.saturating_sub(told);
        let mut phases = Vec::with_capacity(PHASES + 4);
        for (phase, nanos) in Phase::ALL.into_iter().zip(self.phase_nanos) {
            if phase == Phase::Exchange {
                // The part in which nothing was done but wait is told apart.
                let waited = self.wait_nanos.min(nanos);
                phases.extend([(phase.name(), nanos - waited), ("wait", waited)]);
            } else {
                phases.push((phase.name(), nanos));
            }
        }
        phases.extend([("balance", self.balance_nanos), ("output", self.output_nanos), ("other", rest)]);
        phases
    }

    /// What two ranks come to together, or two groups of ranks. How each figure joins is said here and nowhere else; the
    /// order in which ranks are joined makes no difference.
    #[must_use]
    pub fn join(self, other: Self) -> Self {
        let most = |figure: fn(&Self) -> u64| figure(&self).max(figure(&other));
        let sum = |figure: fn(&Self) -> u64| figure(&self) + figure(&other);
        // All by name, so that what is added later cannot be forgotten here.
        Self {
            hashes: Hashes::from_words(self.hashes).merge(Hashes::from_words(other.hashes)).to_words(),
            steps: most(|rank| rank.steps),
            resumed_at: most(|rank| rank.resumed_at),
            interrupted: most(|rank| rank.interrupted),
            escaped: sum(|rank| rank.escaped),
            ghosts: sum(|rank| rank.ghosts),
            migrations: sum(|rank| rank.migrations),
            islands: sum(|rank| rank.islands),
            largest_island: most(|rank| rank.largest_island),
            asleep: sum(|rank| rank.asleep),
            colors: most(|rank| rank.colors),
            bytes_sent: sum(|rank| rank.bytes_sent),
            messages_sent: sum(|rank| rank.messages_sent),
            peak_rss_bytes: sum(|rank| rank.peak_rss_bytes),
            // Ranks go side by side, and the whole takes as long as the slowest.
            build_nanos: most(|rank| rank.build_nanos),
            wall_nanos: most(|rank| rank.wall_nanos),
            wait_nanos: most(|rank| rank.wait_nanos),
            output_nanos: most(|rank| rank.output_nanos),
            balance_nanos: most(|rank| rank.balance_nanos),
            // These all ranks know alike.
            expected: most(|rank| rank.expected),
            tile_count: most(|rank| rank.tile_count),
            tiles_moved: most(|rank| rank.tiles_moved),
            imbalance: most(|rank| rank.imbalance),
            phase_nanos: std::array::from_fn(|phase| self.phase_nanos[phase].max(other.phase_nanos[phase])),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Figures of which no two are the same.
    fn rank(seed: u64) -> RankFacts {
        let words: Vec<u64> =
            (0..size_of::<RankFacts>() as u64 / 8).map(|i| (i + 1) * 1000 + seed * (7 + i % 3)).collect();
        bytemuck::pod_read_unaligned(bytemuck::cast_slice(&words))
    }

    #[test]
    fn counts_add_up_and_the_most_is_the_most_of_all() {
        let [a, b, c] = [3, 1, 2].map(rank);
        let all = a.join(b).join(c);
        assert_eq!((all.steps, all.largest_island, all.colors), (a.steps, a.largest_island, a.colors));
        assert_eq!(all.asleep, a.asleep + b.asleep + c.asleep);
        assert_eq!(all.ghosts, a.ghosts + b.ghosts + c.ghosts);
        assert_eq!(all.wall_nanos, a.wall_nanos);
        assert_eq!(all.hashes[0], a.hashes[0] + b.hashes[0] + c.hashes[0]);
        // In any order, and an idle rank changes nothing.
        assert_eq!(c.join(b.join(a)), all);
        assert_eq!(RankFacts::default().join(all), all);
    }
}
