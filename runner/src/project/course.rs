//! What a run takes, tile by tile: its steps made here on one thread, each tile's time and what it tells others kept over time.

use crate::error::RunError;
use crate::plan::Plan;
use crate::rank::balance::thread_time;
use crate::rank::{Observer, part_of_scene};
use atoll_core::{Halo, Inbox, Loopback, NotHere, Outbox, StepError, World};
use atoll_transport::Rank;
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// So many times of tiles are kept; of longer runs the means over several steps.
const MOST_TIMES: u64 = 1 << 26;

/// What tiles tell each other is kept as the mean over so many steps.
const TRAFFIC: u64 = 16;

/// What a tile tells another: from, to, bytes in a step.
pub(super) type Told = (u32, u32, f64);

/// A run, as it went on one thread.
#[derive(Clone, Debug)]
pub(super) struct Course {
    /// In the order of their steps; all of as many, but perhaps the last.
    pub moments: Vec<Moment>,
    /// One for every [`TRAFFIC`] steps.
    traffic: Vec<Vec<Told>>,
    /// Bodies of each tile before the first step, and then after as many.
    bodies: Vec<Vec<u64>>,
    /// Sync points of a step.
    pub syncs: f64,
}

/// A step, or the mean of some.
#[derive(Clone, Debug)]
pub(super) struct Moment {
    /// The first of its steps.
    pub step: u64,
    /// How many.
    pub steps: u64,
    /// Of a step in each tile, in seconds.
    pub tiles: Vec<f32>,
    /// Of a step, beside what tiles took, in seconds.
    pub rest: f64,
}

impl Course {
    /// Makes the steps of a plan of one rank, on this thread. None if somebody asked to stop before all were made.
    ///
    /// # Errors
    /// If no world can be made of it, or its state is no longer finite.
    pub(super) fn run(plan: &Plan, observer: &Observer) -> Result<Option<Self>, RunError> {
        let mut world = part_of_scene(plan, Rank(0)).map_err(RunError::Setup)?;
        world.book_time(thread_time);
        let (steps, tiles) = (plan.config.run.steps, plan.blueprint.partition.tiles());
        let stride = (steps * tiles as u64).div_ceil(MOST_TIMES).max(1);
        let mut course = Self { moments: Vec::new(), traffic: Vec::new(), bodies: vec![bodies(&world)], syncs: 0.0 };
        let mut tap = Tap::default();
        let (told, mut before) = (observer.steps(true, 0, steps), thread_time());
        for step in 0..steps {
            if observer.stop.is_requested() {
                return Ok(None);
            }
            atoll_core::step(&mut world, &mut tap).map_err(|error| match error {
                StepError::NonFinite { step, id } => RunError::NonFinite { step, id },
                StepError::Protocol { step, tile } => RunError::Protocol { step, tile },
                StepError::FloatMode { step } => RunError::FloatMode { step },
                StepError::Halo(NotHere { tile }) => RunError::Protocol { step, tile },
            })?;
            course.add((step, stride), thread_time().saturating_sub(before), &mut world);
            if (step + 1).is_multiple_of(TRAFFIC) || step + 1 == steps {
                course.traffic.push(tap.take());
                course.bodies.push(bodies(&world));
            }
            // What was done here is none of the step's.
            before = thread_time();
            observer.complete.store(step + 1, Ordering::Relaxed);
            told.made(step + 1);
        }
        course.moments.iter_mut().for_each(Moment::divide);
        course.syncs = tap.syncs as f64 / steps as f64;
        Ok(Some(course))
    }

    /// Adds a step that took so long, to a moment of so many.
    fn add(&mut self, (step, stride): (u64, u64), took: Duration, world: &mut World) {
        if step.is_multiple_of(stride) {
            let tiles = vec![0.0; world.tiles().count()];
            self.moments.push(Moment { step, steps: 0, tiles, rest: 0.0 });
        }
        let moment = self.moments.last_mut().expect("the first step begins one");
        moment.steps += 1;
        let mut rest = took.as_secs_f64();
        for (sum, (_, time)) in moment.tiles.iter_mut().zip(world.take_booked_times()) {
            *sum += time.as_secs_f32();
            rest -= time.as_secs_f64();
        }
        moment.rest += rest.max(0.0);
    }

    /// How many times the traffic has changed before a step.
    pub(super) fn window(&self, step: u64) -> usize {
        ((step / TRAFFIC) as usize).min(self.traffic.len() - 1)
    }

    /// What tiles tell each other in a step of a window.
    pub(super) fn traffic(&self, window: usize) -> &[Told] {
        &self.traffic[window]
    }

    /// Bodies of each tile when a window begins.
    pub(super) fn bodies(&self, window: usize) -> &[u64] {
        &self.bodies[window]
    }
}

impl Moment {
    /// Makes means of sums.
    fn divide(&mut self) {
        self.tiles.iter_mut().for_each(|time| *time /= self.steps as f32);
        self.rest /= self.steps as f64;
    }
}

fn bodies(world: &World) -> Vec<u64> {
    world.views().map(|tile| tile.bodies().len() as u64).collect()
}

/// A halo within one rank that counts what passes between tiles.
#[derive(Default)]
struct Tap {
    bytes: BTreeMap<(u32, u32), u64>,
    steps: u64,
    syncs: u64,
}

impl Tap {
    /// The means of what was counted since this was last asked.
    fn take(&mut self) -> Vec<Told> {
        let steps = std::mem::take(&mut self.steps).max(1) as f64;
        std::mem::take(&mut self.bytes)
            .into_iter()
            .map(|((from, to), bytes)| (from, to, bytes as f64 / steps))
            .collect()
    }
}

impl Halo for Tap {
    type Error = NotHere;

    fn exchange(&mut self, outbox: &mut Outbox, inbox: &mut Inbox) -> Result<(), NotHere> {
        self.syncs += 1;
        self.steps += u64::from(outbox.moment().1 == 0);
        for message in outbox.messages().filter(|message| message.from != message.to) {
            *self.bytes.entry((message.from.0, message.to.0)).or_default() += message.encoded_length() as u64;
        }
        Loopback.exchange(outbox, inbox)
    }
}

#[cfg(test)]
impl Course {
    /// One that was thought up: its moments, each of a step, what tiles tell each other in every one, and their bodies.
    pub(super) fn of(moments: Vec<Moment>, told: Vec<Told>, bodies: Vec<u64>) -> Self {
        let windows = moments.len().div_ceil(TRAFFIC as usize);
        Self { moments, traffic: vec![told; windows], bodies: vec![bodies; windows + 1], syncs: 1.0 }
    }
}
