//! What so many ranks would take for a run whose course is known.

use super::course::{Course, Moment, Tiling};
use super::network::{Load, Network};
use crate::config::Balance;
use crate::plan::Assignment;
use crate::rank::balance::{is_uneven, steps_between};
use atoll_core::{Change, Partition, TileId};
use serde::Serialize;

/// What handing over a tile costs who gives it up and who takes it over together, in seconds for each of its bodies: measured with
/// 16 ranks on NORMAL.
const MOVE: f64 = 120e-9;

/// Bytes of a tile on its way, for each of its bodies and about as many contacts.
const MOVED_BYTES: f64 = 150.0;

/// A thread more helps with a tile for so many of its bodies, about.
const WORTH_A_THREAD: u64 = 2000;

/// What a number of ranks would take, by one rule of dealing tiles. Times are of a step, in milliseconds.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Prediction {
    /// How many ranks.
    pub ranks: usize,
    /// Threads of each.
    pub threads: usize,
    /// The rule, as in `run.balance`.
    pub balance: &'static str,
    /// Mean of a step.
    pub ms_per_step: f64,
    /// Mean over the last quarter of all steps.
    pub last_quarter_ms: f64,
    /// Of the busiest rank in its tiles, the mean over all steps.
    pub work_ms: f64,
    /// The busiest rank's work over the mean of all ranks', the mean over all steps.
    pub imbalance: f64,
    /// Of the busiest rank with its messages, and of all ranks on their way.
    pub exchange_ms: f64,
    /// Of ranks that hand tiles over.
    pub moving_ms: f64,
    /// What ranks wait for others, their mean.
    pub waiting_ms: f64,
    /// Times as fast as one rank of one thread.
    pub speedup: f64,
    /// That divided by all threads of all ranks.
    pub efficiency: f64,
    /// Over the last quarter of all steps.
    pub last_quarter_efficiency: f64,
    /// Tiles that went to other ranks.
    pub tiles_moved: u64,
    /// Ranks without a tile.
    pub idle_ranks: usize,
}

/// How many ranks, and what they have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Machine {
    pub ranks: usize,
    pub threads: usize,
    pub network: Network,
}

/// Sums over steps, in seconds.
#[derive(Clone, Copy, Default)]
struct Sums {
    steps: f64,
    time: f64,
    alone: f64,
    work: f64,
    mean_work: f64,
    imbalance: f64,
    exchange: f64,
    moving: f64,
}

impl Sums {
    /// Adds one of these so many times.
    fn add(&mut self, times: f64, one: Self) {
        self.steps += times;
        self.time += times * one.time;
        self.alone += times * one.alone;
        self.work += times * one.work;
        self.mean_work += times * one.mean_work;
        self.imbalance += times * one.imbalance;
        self.exchange += times * one.exchange;
        self.moving += times * one.moving;
    }
}

/// Goes through a course as if so many ranks made it.
pub(super) fn predict(course: &Course, machine: Machine, balance: Balance) -> Prediction {
    let Machine { ranks, threads, network } = machine;
    let (mut tiling, mut next) = (&course.tilings[0].partition, 1);
    let mut countings = course.countings.iter().peekable();
    let mut assignment = Assignment::balanced(tiling, &course.windows[0].bodies, ranks);
    let (every, mut since) = (steps_between(ranks) as u64, 0);
    let mut costs = vec![0.0; tiling.tiles()];
    let (mut loads, mut loads_of) = (Vec::new(), None);
    let (mut all, mut last, mut tiles_moved) = (Sums::default(), Sums::default(), 0);
    let steps = course.moments.last().map_or(0, |moment| moment.step + moment.steps);
    for moment in &course.moments {
        let (mut moving, mut counting_alone) = ((0, 0.0), 0.0);
        if let Some(new) = course.tilings.get(next).filter(|tiling| tiling.step <= moment.step) {
            let bodies = &course.windows[course.window(moment.step.max(1) - 1)].bodies;
            (assignment, moving) = follow(&assignment, new, bodies, &network);
            costs = dealt(&costs, &new.changes);
            (tiling, next, loads_of) = (&new.partition, next + 1, None);
        }
        while let Some((_, counting)) = countings.next_if(|(step, _)| *step <= moment.step) {
            moving.1 += counting.seconds(ranks, &network);
            counting_alone += counting.seconds(1, &network);
        }
        let window = course.window(moment.step);
        if loads_of != Some(window) {
            loads = messages(course, window, &assignment);
            loads_of = Some(window);
        }
        let work = work(moment, &course.windows[window].bodies, &assignment, threads);
        let busiest = work.iter().copied().fold(0.0, f64::max);
        let mean = work.iter().sum::<f64>() / ranks as f64;
        let with_messages = work.iter().zip(&loads).map(|(work, load)| work + network.busy(load)).fold(0.0, f64::max);
        let time = with_messages + course.syncs * network.sync(ranks);
        let mut one = Sums {
            time,
            alone: moment.tiles.iter().copied().map(f64::from).sum::<f64>()
                + moment.rest
                + counting_alone / moment.steps as f64,
            work: busiest,
            mean_work: mean,
            imbalance: busiest / mean.max(f64::MIN_POSITIVE),
            exchange: time - busiest,
            ..Sums::default()
        };
        costs.iter_mut().zip(&moment.tiles).for_each(|(sum, time)| *sum += f64::from(*time) * moment.steps as f64);
        since += moment.steps;
        if balance != Balance::Off && since >= every && ranks > 1 {
            let nanos: Vec<u64> = match balance {
                Balance::Bodies => course.windows[window].bodies.clone(),
                _ => costs.iter().map(|cost| (cost * 1e9) as u64).collect(),
            };
            if let Some(better) = better(&assignment, tiling, &nanos, balance) {
                let (moved, seconds) = moves(&assignment, &better, &course.windows[window].bodies, &network);
                moving = (moving.0 + moved, moving.1 + seconds);
                (assignment, loads_of) = (better, None);
            }
            costs.fill(0.0);
            since = 0;
        }
        tiles_moved += moving.0;
        one.moving = moving.1 / moment.steps as f64;
        one.time += one.moving;
        all.add(moment.steps as f64, one);
        if moment.step >= steps - steps.div_ceil(4) {
            last.add(moment.steps as f64, one);
        }
    }
    let ms = |sum: f64| 1e3 * sum / all.steps.max(1.0);
    let speedup = |sums: &Sums| if sums.time > 0.0 { sums.alone / sums.time } else { 1.0 };
    let hands = (ranks * threads) as f64;
    Prediction {
        ranks,
        threads,
        balance: balance.name(),
        ms_per_step: ms(all.time),
        last_quarter_ms: 1e3 * last.time / last.steps.max(1.0),
        work_ms: ms(all.work),
        imbalance: all.imbalance / all.steps.max(1.0),
        exchange_ms: ms(all.exchange),
        moving_ms: ms(all.moving),
        waiting_ms: ms(all.work - all.mean_work),
        speedup: speedup(&all),
        efficiency: speedup(&all) / hands,
        last_quarter_efficiency: speedup(&last) / hands,
        tiles_moved,
        idle_ranks: assignment.idle_ranks(),
    }
}

/// What each rank works in a step, in seconds. Its threads take the longest tiles first; what no tile accounts for is shared by
/// tiles.
fn work(moment: &Moment, bodies: &[u64], assignment: &Assignment, threads: usize) -> Vec<f64> {
    let ranks = assignment.ranks_of_tiles();
    let rest = moment.rest / ranks.len() as f64;
    if threads == 1 {
        let mut work = vec![0.0; assignment.ranks()];
        for (&rank, &time) in ranks.iter().zip(&moment.tiles) {
            work[rank as usize] += f64::from(time) + rest;
        }
        return work;
    }
    let mut tiles = vec![Vec::new(); assignment.ranks()];
    for ((&rank, &time), &bodies) in ranks.iter().zip(&moment.tiles).zip(bodies) {
        tiles[rank as usize].push((f64::from(time) + rest, bodies));
    }
    tiles.into_iter().map(|tiles| makespan(tiles, threads)).collect()
}

/// How long so many hands take for some tiles, of which they take the longest first: each takes so long for one of them, and has so
/// many bodies.
fn makespan(tiles: Vec<(f64, u64)>, hands: usize) -> f64 {
    if tiles.len() < hands {
        // Whoever has none helps another, as far as that is worth it.
        let shared = tiles.iter().map(|(time, _)| time).sum::<f64>() / hands as f64;
        let alone = tiles.iter().map(|&(time, bodies)| time / (bodies / WORTH_A_THREAD).max(1) as f64);
        return alone.fold(shared, f64::max);
    }
    let mut jobs: Vec<f64> = tiles.into_iter().map(|(time, _)| time).collect();
    jobs.sort_unstable_by(|a, b| b.total_cmp(a));
    let mut busy = vec![0.0_f64; hands];
    for job in jobs {
        let least = busy.iter_mut().min_by(|a, b| a.total_cmp(b)).expect("there are hands");
        *least += job;
    }
    busy.into_iter().fold(0.0, f64::max)
}

/// What ranks send each other in a step, by rank.
fn messages(course: &Course, window: usize, assignment: &Assignment) -> Vec<Load> {
    let mut loads = vec![Load::default(); assignment.ranks()];
    let mut pairs = Vec::new();
    for &(from, to, bytes) in &course.windows[window].told {
        let (from, to) = (assignment.rank_of(TileId(from)), assignment.rank_of(TileId(to)));
        if from != to {
            loads[from].bytes[0] += bytes;
            loads[to].bytes[1] += bytes;
            pairs.push((from, to));
        }
    }
    pairs.sort_unstable();
    pairs.dedup();
    for (from, to) in pairs {
        loads[from].messages[0] += course.syncs;
        loads[to].messages[1] += course.syncs;
    }
    loads
}

/// Who holds the tiles that a tiling begins with, and how many tiles move for it, and how long that takes: who holds the first of
/// those that are joined gets the others.
fn follow(old: &Assignment, new: &Tiling, bodies: &[u64], network: &Network) -> (Assignment, (u64, f64)) {
    let joined = old.joined(&new.changes);
    let moved = if joined == *old { (0, 0.0) } else { moves(old, &joined, bodies, network) };
    (joined.followed(&new.changes), moved)
}

/// What tiles cost so far, dealt out to those that they became.
fn dealt(costs: &[f64], changes: &[Change]) -> Vec<f64> {
    let dealt = changes.iter().flat_map(|change| {
        let sum: f64 = change.old.clone().map(|tile| costs[tile as usize]).sum();
        change.new.clone().map(move |_| sum / change.new.len() as f64)
    });
    dealt.collect()
}

/// The assignment that ranks would change to.
fn better(assignment: &Assignment, partition: &Partition, costs: &[u64], balance: Balance) -> Option<Assignment> {
    let mut sums = vec![0; assignment.ranks()];
    for (&rank, &cost) in assignment.ranks_of_tiles().iter().zip(costs) {
        sums[rank as usize] += cost;
    }
    let (most, mean) = (sums.iter().copied().max().unwrap_or(0), sums.iter().sum::<u64>() / sums.len() as u64);
    let may_move = balance == Balance::Bodies || is_uneven(most, mean);
    may_move.then(|| assignment.refined(partition, costs)).flatten()
}

/// How many tiles move, and how long that takes.
fn moves(old: &Assignment, new: &Assignment, bodies: &[u64], network: &Network) -> (u64, f64) {
    let (mut moved, mut busy) = (0, vec![0.0_f64; old.ranks()]);
    for (tile, from, to) in old.moves(new) {
        let bodies = bodies[tile.0 as usize] as f64;
        for rank in [from, to] {
            busy[rank] += bodies * (0.5 * MOVE + MOVED_BYTES / network.bandwidth);
        }
        moved += 1;
    }
    (moved, busy.into_iter().fold(0.0, f64::max) + network.sync(old.ranks()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    /// Eight tiles in a row, of which each tells its neighbours a thousand bytes, over 64 steps.
    fn course(tiles: [f32; 8]) -> Course {
        let moment = |step| Moment { step, steps: 1, tiles: tiles.to_vec(), rest: 0.0 };
        let told = (0..7).flat_map(|tile| [(tile, tile + 1, 1e3), (tile + 1, tile, 1e3)]).collect();
        let partition = Partition::uniform(DVec2::ZERO, DVec2::new(8.0, 1.0), 8, 1).unwrap();
        Course::of(partition, (0..64).map(moment).collect(), told, vec![1000; 8])
    }

    fn machine(ranks: usize, threads: usize) -> Machine {
        Machine { ranks, threads, network: Network { latency: 1e-5, bandwidth: 1e9 } }
    }

    #[test]
    fn one_rank_takes_what_its_tiles_take_and_even_ones_their_share() {
        let course = course([1e-3; 8]);
        let alone = predict(&course, machine(1, 1), Balance::Off);
        assert!((alone.ms_per_step - 8.0).abs() < 1e-5 && (alone.efficiency - 1.0).abs() < 1e-9, "{alone:?}");
        assert_eq!((alone.exchange_ms, alone.waiting_ms), (0.0, 0.0));
        let two = predict(&course, machine(2, 1), Balance::Measured);
        assert!((two.work_ms - 4.0).abs() < 1e-5 && (two.imbalance - 1.0).abs() < 1e-6 && two.tiles_moved == 0);
        // A sync point: two latencies and what a rank does; the rest are its messages.
        let sync = 1e3 * machine(2, 1).network.sync(2);
        assert!(two.exchange_ms > sync && two.exchange_ms < sync + 0.01, "{two:?}");
        let threads = predict(&course, machine(1, 4), Balance::Off);
        assert!((threads.work_ms - 2.0).abs() < 1e-5 && (threads.efficiency - 1.0).abs() < 1e-5, "{threads:?}");
        // A thread more is worth nothing to a tile of a thousand bodies.
        let idle = predict(&course, machine(1, 64), Balance::Off);
        assert!((idle.work_ms - 1.0).abs() < 1e-5, "{idle:?}");
        assert!((makespan(vec![(8.0, 20_000)], 64) - 0.8).abs() < 1e-9 && makespan(vec![(8.0, 20_000)], 4) == 2.0);
        let many = predict(&course, machine(100, 1), Balance::Off);
        assert!(many.idle_ranks == 92 && many.work_ms > 0.99 && many.efficiency < 0.08, "{many:?}");
    }

    #[test]
    fn tiles_that_take_longer_are_dealt_anew_where_that_is_measured() {
        let course = course([7e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3]);
        let [off, bodies, measured] =
            [Balance::Off, Balance::Bodies, Balance::Measured].map(|rule| predict(&course, machine(2, 1), rule));
        // By bodies all tiles are alike.
        assert!((off.work_ms - 10.0).abs() < 1e-4 && (bodies.work_ms - 10.0).abs() < 1e-4, "{off:?} {bodies:?}");
        assert!(measured.tiles_moved == 3 && (7.0..8.0).contains(&measured.work_ms), "{measured:?}");
        assert!(measured.moving_ms > 0.0 && measured.last_quarter_efficiency > 0.98, "{measured:?}");
    }
}
