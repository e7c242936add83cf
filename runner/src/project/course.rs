//! What a run takes, tile by tile: its steps made here on one thread, each tile's time and what it tells others kept over time.

use super::counting::{Alone, Counting};
use crate::error::RunError;
use crate::plan::Plan;
use crate::plan::tiles::{self, Unfollowed};
use crate::rank::balance::thread_time;
use crate::rank::{Observer, part_of_scene};
use atoll_core::{Change, Halo, Inbox, Loopback, NotHere, Outbox, Partition, SetupError, StepError, World};
use atoll_transport::Rank;
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// So many times of tiles are kept; of longer runs the means over several steps.
const MOST_TIMES: u64 = 1 << 26;

/// What tiles tell each other is kept as the mean over so many steps.
const TRAFFIC: u64 = 16;

/// With every time that a run is made, the tile that each step begins with is so many further on.
const FIRST: usize = 31;

/// What a tile tells another: from, to, bytes in a step.
pub(super) type Told = (u32, u32, f64);

/// A run, as it went on one thread.
#[derive(Clone, Debug)]
pub(super) struct Course {
    /// In the order of their steps.
    pub moments: Vec<Moment>,
    /// Of [`TRAFFIC`] steps each, or fewer.
    pub windows: Vec<Window>,
    /// How the domain is cut, in the order of steps: at first, and whenever that changes.
    pub tilings: Vec<Tiling>,
    /// Where tiles follow the bodies, every time that was looked at, before which step.
    pub countings: Vec<(u64, Counting)>,
    /// Sync points of a step.
    pub syncs: f64,
}

/// Tiles from a step on.
#[derive(Clone, Debug)]
pub(super) struct Tiling {
    /// The first of its steps.
    pub step: u64,
    pub partition: Partition,
    /// What became what; empty for the first.
    pub changes: Vec<Change>,
}

/// Some steps with the same tiles.
#[derive(Clone, Debug)]
pub(super) struct Window {
    /// The first of them.
    pub step: u64,
    /// What tiles tell each other in each.
    pub told: Vec<Told>,
    /// Bodies of each tile before the first.
    pub bodies: Vec<u64>,
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
    /// Makes the steps of a plan of one rank, on this thread, so many times: the least that a tile took in a step is what it takes
    /// when nothing disturbs it. None if somebody asked to stop before all were made.
    ///
    /// # Errors
    /// If no world can be made of it, or its state is no longer finite.
    pub(super) fn run(plan: &Plan, times: u32, observer: &Observer) -> Result<Option<Self>, RunError> {
        let Some(mut course) = Self::make(plan, 0, observer)? else { return Ok(None) };
        for time in 1..times {
            let Some(again) = Self::make(plan, time, observer)? else { return Ok(None) };
            course.moments.iter_mut().zip(&again.moments).for_each(|(moment, again)| moment.take_least(again));
            let countings = course.countings.iter_mut().zip(&again.countings);
            countings.for_each(|((_, counting), (_, again))| counting.take_least(again));
        }
        Ok(Some(course))
    }

    /// Makes the steps of a plan once.
    fn make(plan: &Plan, time: u32, observer: &Observer) -> Result<Option<Self>, RunError> {
        let mut world = part_of_scene(plan, Rank(0))?;
        world.book_time(thread_time);
        // Of several times, each has other tiles be the first.
        world.begin_with(FIRST * time as usize);
        let (steps, partition) = (plan.config.run.steps, world.partition().clone());
        let stride = (steps * partition.tiles() as u64).div_ceil(MOST_TIMES).max(1);
        let tilings = vec![Tiling { step: 0, partition, changes: Vec::new() }];
        let mut course = Self { moments: Vec::new(), windows: Vec::new(), tilings, countings: Vec::new(), syncs: 0.0 };
        let mut tap = Tap::default();
        let told = observer.steps(true, 0, steps);
        for step in 0..steps {
            if observer.stop.is_requested() {
                return Ok(None);
            }
            let changed = course.retile(plan, step, &mut world).map_err(RunError::Setup)?;
            if changed || course.windows.last().is_none_or(|window| window.step + TRAFFIC <= step) {
                course.end_window(&mut tap);
                // Those of the first step have come, and have no place yet.
                world.settle();
                course.windows.push(Window { step, told: Vec::new(), bodies: bodies(&world) });
            }
            // What was done until here is none of the step's.
            let before = thread_time();
            atoll_core::step(&mut world, &mut tap).map_err(|error| match error {
                StepError::NonFinite { step, id } => RunError::NonFinite { step, id },
                StepError::Protocol { step, tile } => RunError::Protocol { step, tile },
                StepError::FloatMode { step } => RunError::FloatMode { step },
                StepError::Halfway { .. } => unreachable!("it ends with the step that failed"),
                StepError::Halo(NotHere { tile }) => RunError::Protocol { step, tile },
            })?;
            course.add((step, stride), thread_time().saturating_sub(before), &mut world);
            observer.complete.store(step + 1, Ordering::Relaxed);
            told.made(step + 1);
        }
        course.end_window(&mut tap);
        course.moments.iter_mut().for_each(Moment::divide);
        course.syncs = tap.syncs as f64 / steps as f64;
        Ok(Some(course))
    }

    /// Lets tiles follow the bodies when it is time to. Says whether any changed.
    fn retile(&mut self, plan: &Plan, step: u64, world: &mut World) -> Result<bool, SetupError> {
        let Some((rule, every)) = tiles::rule(&plan.config, &plan.blueprint.kinds) else { return Ok(false) };
        if !step.is_multiple_of(every) {
            return Ok(false);
        }
        let mut alone = Alone::begin();
        let new = rule.follow(world, &mut alone).map_err(|error| match error {
            Unfollowed::Unreadable(_) => unreachable!("what a rank tells itself"),
            Unfollowed::Torn(error) => error,
        })?;
        alone.has_agreed();
        let changed = new.map(|partition| {
            let changes = world.partition().changes(&partition).expect("one follows from the other");
            world.retile(&partition).map(|()| Tiling { step, partition, changes })
        });
        self.countings.push((step, alone.end()));
        let Some(tiling) = changed.transpose()? else { return Ok(false) };
        // What was booked before is another moment's.
        world.take_booked_times().for_each(drop);
        self.tilings.push(tiling);
        Ok(true)
    }

    /// Keeps what was told in the window that ends.
    fn end_window(&mut self, tap: &mut Tap) {
        let told = tap.take();
        if let Some(window) = self.windows.last_mut() {
            window.told = told;
        }
    }

    /// Adds a step that took so long, to a moment of so many.
    fn add(&mut self, (step, stride): (u64, u64), took: Duration, world: &mut World) {
        let tiling = self.tilings.last().expect("there is one").step;
        if self.moments.last().is_none_or(|moment| moment.steps == stride || tiling == step) {
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

    /// The window of a step, by its place.
    pub(super) fn window(&self, step: u64) -> usize {
        self.windows.partition_point(|window| window.step <= step) - 1
    }
}

impl Moment {
    /// Of two runs alike, what took less time.
    fn take_least(&mut self, other: &Self) {
        self.tiles.iter_mut().zip(&other.tiles).for_each(|(time, other)| *time = time.min(*other));
        self.rest = self.rest.min(other.rest);
    }

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
    pub(super) fn of(partition: Partition, moments: Vec<Moment>, told: Vec<Told>, bodies: Vec<u64>) -> Self {
        let tilings = vec![Tiling { step: 0, partition, changes: Vec::new() }];
        let windows = moments.iter().step_by(TRAFFIC as usize);
        let windows = windows.map(|first| Window { step: first.step, told: told.clone(), bodies: bodies.clone() });
        Self { windows: windows.collect(), moments, tilings, countings: Vec::new(), syncs: 1.0 }
    }
}
