//! Between two steps tiles move to where there is less to do, as saved blocks. Which rank holds a tile decides how a world is
//! computed and never what comes out, so it may follow measured times, which the physics must never see.
//!
//! Every so many steps all ranks tell each other how long they worked in each; where the busiest has clearly more to do than the
//! mean, they tell what each tile cost, all compute the same new assignment from that, and those that lose tiles send them to
//! those that get them. Time is that of threads on a core: who waits, or shares a core with others, is not busy for it.

mod clock;
mod handover;
mod retile;

use super::halo::RankHalo;
use super::{RankError, RankFacts, records, unreadable};
use crate::config::Balance;
use crate::plan::{Assignment, Plan};
use atoll_core::{StepReport, TileId, World};
use atoll_transport::{Collective, Counting, Rank, Stats, Transport};
use bytemuck::{Pod, Zeroable};
pub(crate) use clock::thread_time;
use handover::Move;
pub(super) use retile::Retiler;
use std::time::{Duration, Instant};
use tracing::info;

/// Ranks tell each other how busy they are after so many steps, and one more for every [`RANKS_A_STEP`]: the cost of telling
/// grows with the square of their number.
const EVERY: usize = 16;
/// See [`EVERY`].
const RANKS_A_STEP: usize = 32;

/// After how many steps so many ranks tell each other how busy they are, where tiles may move.
pub(crate) fn steps_between(ranks: usize) -> usize {
    EVERY + ranks / RANKS_A_STEP
}

/// Whether tiles may move by what they took, where the busiest rank took so long and the mean of all so long.
pub(crate) fn is_uneven(most: u64, mean: u64) -> bool {
    most > mean + mean / TOO_BUSY
}

/// Where no tile ever moves, ranks tell each other for the summary alone.
const RARELY: usize = 100;

/// Tiles may move where the busiest rank has a twentieth more to do than the mean: less is hardly measured.
const TOO_BUSY: u64 = 20;

/// How busy a rank has been, and what has come of it.
pub(super) struct Balancer {
    by: Balance,
    every: usize,
    /// How long this rank had worked before the step under way.
    before: Duration,
    /// How long it worked in each step since ranks last told each other, in nanoseconds.
    worked: Vec<u64>,
    /// Sum over steps of the busiest rank's time, in means of all ranks, and how many steps that are.
    busiest: (f64, u64),
    /// Tiles that went from any rank to another.
    moved: u64,
    /// How long that took this rank.
    time: Duration,
    /// What ranks sent each other for it.
    pub(super) sent: Stats,
}

/// What a tile cost.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct TileCost {
    tile: u64,
    cost: u64,
}

impl Balancer {
    /// Begins to book times, if there is more than one rank.
    pub(super) fn start(plan: &Plan, world: &mut World) -> Option<Self> {
        let ranks = plan.assignment.ranks();
        if ranks == 1 {
            return None;
        }
        let by = plan.config.run.balance;
        let often = steps_between(ranks);
        let every = match by {
            Balance::Measured | Balance::Bodies => often,
            Balance::Off => often.max(RARELY),
            Balance::Shuffled => 1,
        };
        world.book_time(thread_time);
        Some(Self {
            by,
            every,
            before: Duration::ZERO,
            worked: Vec::new(),
            busiest: (0.0, 0),
            moved: 0,
            time: Duration::ZERO,
            sent: Stats::default(),
        })
    }

    /// How long it has taken this rank so far.
    pub(super) fn time(&self) -> Duration {
        self.time
    }

    /// Brings what came of it to the summary.
    pub(super) fn tell_of(&self, facts: &mut RankFacts) {
        facts.balance_nanos = self.time.as_nanos() as u64;
        facts.tiles_moved = self.moved;
        facts.imbalance = (self.busiest.0 / self.busiest.1.max(1) as f64 * 1e6) as u64;
    }

    /// Books a step; when it is time, lets tiles move, unless that step was the last.
    ///
    /// # Errors
    /// If a rank is lost, or sends what cannot be read.
    pub(super) fn after_step<T: Transport>(
        &mut self,
        last: &StepReport,
        is_last: bool,
        world: &mut World,
        halo: &mut RankHalo<Counting<T>>,
    ) -> Result<(), RankError> {
        let worked = world.booked_time() + halo.worked();
        self.worked.push((worked - std::mem::replace(&mut self.before, worked)).as_nanos() as u64);
        if !is_last && self.worked.len() < self.every {
            return Ok(());
        }
        let (begun, sent) = (Instant::now(), halo.transport().stats());
        let is_uneven = self.tell(world.has_failed(), halo.transport())?;
        if is_uneven && !is_last {
            let assignment = match self.by {
                Balance::Off => None,
                Balance::Shuffled => Some(halo.assignment().shuffled(last.step)),
                Balance::Measured | Balance::Bodies => {
                    let costs = self.costs(world, halo.transport())?;
                    halo.assignment().refined(world.partition(), &costs)
                }
            };
            if let Some(assignment) = assignment {
                self.hand_over(assignment, world, halo)?;
            }
        }
        // What is told next is of the steps to come.
        world.take_booked_times().for_each(drop);
        self.time += begun.elapsed();
        self.sent += halo.transport().stats().since(&sent);
        Ok(())
    }

    /// Lets all ranks hear how long each worked, and whether it has failed: then its state is not fit to be moved. Says whether
    /// tiles may move.
    fn tell(&mut self, has_failed: bool, transport: &mut impl Transport) -> Result<bool, RankError> {
        let steps = self.worked.len();
        self.worked.push(has_failed.into());
        let told = transport.all_gather(bytemuck::cast_slice(&self.worked)).map_err(RankError::Transport)?;
        self.worked.clear();
        let told: Vec<Vec<u64>> =
            told.chunks(1).map(records).collect::<Result<_, _>>().map_err(RankError::Transport)?;
        if let Some(rank) = told.iter().position(|told| told.len() != steps + 1) {
            return Err(RankError::Transport(unreadable(Rank::from_index(rank))));
        }
        for step in 0..steps {
            let (most, sum) = told.iter().fold((0, 0), |(most, sum), told| (told[step].max(most), told[step] + sum));
            if sum > 0 {
                self.busiest.0 += most as f64 * told.len() as f64 / sum as f64;
                self.busiest.1 += 1;
            }
        }
        let worked = || told.iter().map(|told| told[..steps].iter().sum::<u64>());
        let (most, mean) = (worked().max().unwrap_or(0), worked().sum::<u64>() / told.len() as u64);
        let may_move = match self.by {
            Balance::Measured => is_uneven(most, mean),
            Balance::Bodies | Balance::Shuffled => true,
            Balance::Off => false,
        };
        Ok(may_move && told.iter().all(|told| told[steps] == 0))
    }

    /// What each tile cost since that was last asked, by tile, on every rank alike.
    fn costs(&self, world: &mut World, transport: &mut impl Transport) -> Result<Vec<u64>, RankError> {
        let cost = |tile: TileId, cost: u64| TileCost { tile: tile.0.into(), cost };
        let own: Vec<TileCost> = match self.by {
            Balance::Bodies => world.views().map(|view| cost(view.id(), view.bodies().len() as u64)).collect(),
            _ => world.take_booked_times().map(|(tile, time)| cost(tile, time.as_nanos() as u64)).collect(),
        };
        let told = transport.all_gather(bytemuck::cast_slice(&own)).map_err(RankError::Transport)?;
        let mut costs = vec![0; world.partition().tiles()];
        for (rank, told) in told.chunks(1).enumerate() {
            for TileCost { tile, cost } in records(told).map_err(RankError::Transport)? {
                let place = usize::try_from(tile).ok().and_then(|tile| costs.get_mut(tile));
                *place.ok_or_else(|| RankError::Transport(unreadable(Rank::from_index(rank))))? = cost;
            }
        }
        Ok(costs)
    }

    /// Lets all tiles go to where a new assignment has them.
    fn hand_over<T: Transport>(
        &mut self,
        assignment: Assignment,
        world: &mut World,
        halo: &mut RankHalo<Counting<T>>,
    ) -> Result<(), RankError> {
        let moves: Vec<Move> = halo.assignment().moves(&assignment).collect();
        halo.assign(assignment);
        self.moved += moves.len() as u64;
        info!(step = world.step_count(), tiles = moves.len(), "tiles move");
        handover::hand_over(&moves, world, halo.transport(), handover::ROUND)
    }
}
