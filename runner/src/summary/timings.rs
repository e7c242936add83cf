//! Where the time of each rank went, as a table for `--timings`.

use crate::rank::RankFacts;
use std::fmt::Write as _;

/// The first line of the table.
const HEADER: &str = "rank,threads,steps,phase,mean_ms,share";

/// The time of one rank, in nanoseconds of the wall clock.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct RankTimings {
    /// The rank.
    pub rank: usize,
    /// Its threads.
    pub threads: usize,
    /// Steps made.
    pub steps: u64,
    /// All steps, from the first to the last.
    pub wall_nanos: u64,
    /// The time of each phase in the order of the step, in nanoseconds; `wait`, the part of the exchange in which the rank
    /// waited for others; `output`; and `other`, which nothing of that accounts for.
    pub phases: Vec<(&'static str, u64)>,
}

impl RankTimings {
    /// Those of a rank that has so many threads.
    pub fn new(rank: usize, threads: usize, facts: &RankFacts) -> Self {
        let steps = facts.steps - facts.resumed_at;
        Self { rank, threads, steps, wall_nanos: facts.wall_nanos, phases: facts.phases() }
    }

    /// Mean time of a step spent in so many nanoseconds in all, in milliseconds.
    pub fn mean_ms(&self, nanos: u64) -> f64 {
        nanos as f64 * 1e-6 / self.steps.max(1) as f64
    }
}

/// The table: a header, then for each rank a line per phase and one for the whole `step`. `mean_ms` is per step, in
/// milliseconds; `share` is the part of the rank's time, 0 to 1.
pub(crate) fn to_csv(ranks: &[RankTimings]) -> String {
    let mut text = format!("{HEADER}\n");
    for one in ranks {
        let RankTimings { rank, threads, steps, wall_nanos, .. } = *one;
        let mut line = |phase: &str, nanos: u64| {
            let (mean_ms, share) = (one.mean_ms(nanos), nanos as f64 / wall_nanos.max(1) as f64);
            writeln!(text, "{rank},{threads},{steps},{phase},{mean_ms:.6},{share:.6}")
                .expect("a string takes any text");
        };
        one.phases.iter().for_each(|&(phase, nanos)| line(phase, nanos));
        line("step", wall_nanos);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_for_each_phase_of_each_rank_and_one_for_the_whole() {
        let phases = vec![("solve", 3_000_000), ("other", 1_000_000)];
        let first = RankTimings { rank: 0, threads: 2, steps: 4, wall_nanos: 4_000_000, phases };
        let idle = RankTimings { rank: 1, steps: 0, wall_nanos: 0, phases: vec![("solve", 0)], ..first.clone() };
        let expected = "rank,threads,steps,phase,mean_ms,share\n\
            0,2,4,solve,0.750000,0.750000\n\
            0,2,4,other,0.250000,0.250000\n\
            0,2,4,step,1.000000,1.000000\n\
            1,2,0,solve,0.000000,0.000000\n\
            1,2,0,step,0.000000,0.000000\n";
        assert_eq!(to_csv(&[first, idle]), expected);
    }
}
