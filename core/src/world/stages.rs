//! How a world goes through a step: stage by stage over the tiles that have something to do.

use super::World;
use crate::exchange::halo::{Carry, NotCarried};
use crate::exchange::mail::Mailbag;
use crate::exchange::verdict::Verdict;
use crate::model::error::StepError;
use crate::model::id::GlobalId;
use crate::model::math::float_mode_is_default;
use crate::parallel::team::Team;
use crate::state::figures::Figures;
use crate::step::phase::{Phase, Stopwatch};
use crate::step::stage::{Bench, Hand, Shop, Work};
use crate::tiling::tile::{Fault, Tile, TileCounts};
use std::sync::Mutex;

/// Steps with less to do, in what bodies without contacts take, are one thread's where the caller is no thread of the pool: to wake these
/// in every stage, and to be woken by them, takes longer than what they do.
const LITTLE: u64 = 1000;

impl World {
    /// Starts a step: no sync point passed, nothing counted.
    pub(crate) fn begin_step(&mut self) {
        self.settle();
        self.places.forget();
        self.borders_moved = self.follow_borders();
        self.sync = 0;
        let threads = rayon::current_num_threads();
        if self.hands.len() < threads {
            self.hands.resize_with(threads, Mutex::default);
        }
        if std::mem::take(&mut self.changed) {
            let tiles = (0..).zip(&self.tiles);
            self.busy.clear();
            self.busy.extend(tiles.filter(|(_, tile)| !tile.is_bare()).map(|(place, _)| place));
        }
        for &place in &self.busy {
            self.tiles[place as usize].counts = TileCounts::default();
        }
        self.share_out();
    }

    /// Shares out the busy tiles to threads.
    fn share_out(&mut self) {
        let work = self.busy.iter().map(|&place| self.tiles[place as usize].work());
        let is_little = || rayon::current_thread_index().is_none() && work.clone().sum::<u64>() < LITTLE;
        let threads = if is_little() { 1 } else { rayon::current_num_threads() };
        self.schedule.share_out(work, threads);
        self.schedule.begin_with(self.first);
    }

    /// Ends a step, in which so many bodies outran their tiles: the clock, and the lowest body whose state is not finite.
    pub(crate) fn end_step(&mut self, leaps: u64, not_finite: Option<GlobalId>) {
        let threads = self.busy.len().clamp(1, self.schedule.threads()) as u32;
        self.figures = std::mem::take(&mut self.takes_figures).then(Box::default);
        for hand in &mut self.hands {
            let hand = hand.get_mut().expect("no stage panicked");
            if let Some(figures) = &mut self.figures {
                figures.merge(&std::mem::take(&mut hand.figures));
            }
            self.booked += std::mem::take(&mut hand.booked);
            self.timings.add_share(&std::mem::take(&mut hand.timings), threads);
        }
        if leaps > 0 && !self.borders_moved && !self.warned_of_leaps {
            self.warned_of_leaps = true;
            tracing::warn!(
                "step {}: {leaps} bodies moved past a neighbouring tile; larger tiles or a speed limit are faster",
                self.step
            );
        }
        if let Some(id) = not_finite {
            self.verdict = self.verdict.merge(Verdict { failure: Some((self.step, id)), ..Verdict::default() });
        }
        (self.verdict.meet, self.verdict.far) = (false, false);
        self.measures = false;
        self.step += 1;
        self.follow_bodies();
    }

    /// Does what belongs to a step or an exchange, unless an earlier one has failed; keeps in mind if this one does.
    pub(crate) fn unless_halfway<R, E>(
        &mut self,
        act: impl FnOnce(&mut Self) -> Result<R, StepError<E>>,
    ) -> Result<R, StepError<E>> {
        if let Some(step) = self.halfway {
            return Err(StepError::Halfway { step });
        }
        let step = self.step;
        let done = act(self);
        // What is no longer finite is told by every step that follows.
        let is_halfway = done.as_ref().is_err_and(|error| !matches!(error, StepError::NonFinite { .. }));
        self.halfway = is_halfway.then_some(step);
        done
    }

    /// Keeps in mind what another rank has said of a failure: what was sent to it is lost here as well.
    pub(crate) fn hear_of(&mut self, verdict: &Verdict) {
        self.verdict = self.verdict.merge(Verdict { failure: verdict.failure, ..Verdict::default() });
    }

    /// Forgets that a step has failed, what it had to say, what the next one is asked for, what pushes at bodies, and where all are: statics
    /// move as another step has it.
    pub(crate) fn begin_anew(&mut self) {
        (self.halfway, self.verdict, self.next_partition) = (None, Verdict::default(), None);
        (self.measures, self.takes_figures) = (false, false);
        self.forces.clear();
        self.forget_removed();
        self.places.forget();
        self.outbox.bags.clear();
        for hand in &mut self.hands {
            let hand = hand.get_mut().expect("no stage panicked");
            hand.outgoing.clear();
            hand.figures = Figures::default();
        }
        self.forget_works();
    }

    /// Whether this rank already knows that the run has failed; its state is then not fit to be sent.
    pub fn has_failed(&self) -> bool {
        self.verdict.failure.is_some() || self.halfway.is_some()
    }

    /// Lets all ranks hear with the next sync point whether a body of a tile that had something to do goes far.
    pub(crate) fn tell_of_far_bodies(&mut self) {
        self.verdict.far = self.busy.iter().any(|&place| self.tiles[place as usize].counts.far);
    }

    /// One sync point. What all ranks together have to say comes back.
    pub(crate) fn exchange(&mut self, halo: &mut Carry<'_>) -> Result<Verdict, StepError<NotCarried>> {
        let _span = tracing::trace_span!("exchange", sync = self.sync).entered();
        let mut watch = Stopwatch::start();
        self.outbox.verdict = self.verdict;
        (self.outbox.step, self.outbox.sync) = (self.step, self.sync);
        self.outbox.bags.resize_with(self.hands.len(), Mailbag::default);
        for (hand, bag) in self.hands.iter_mut().zip(&mut self.outbox.bags) {
            std::mem::swap(&mut hand.get_mut().expect("no stage panicked").outgoing, bag);
        }
        self.inbox.begin(self.step, self.sync);
        self.sync += 1;
        halo(&mut self.outbox, &mut self.inbox).map_err(StepError::Halo)?;
        self.inbox.end(&mut self.outbox);
        watch.lap(Phase::Exchange, &mut self.timings);
        Ok(self.inbox.verdict)
    }

    /// Counts those tiles among the busy ones that bodies come to.
    pub(crate) fn welcome_heirs(&mut self) {
        let Self { busy, tiles, inbox, .. } = self;
        let owners = busy.len();
        for heir in inbox.heirs() {
            let tile = &mut tiles[heir as usize];
            if tile.is_bare() {
                tile.counts = TileCounts::default();
                busy.push(heir);
            }
        }
        if busy.len() > owners {
            busy.sort_unstable();
            busy.dedup();
            self.share_out();
        }
    }

    /// Counts those tiles no longer among the busy ones that bodies have left. Now it is known who works on what: where
    /// threads help within tiles, each of them is asked how it computes, once a step; else in every stage.
    pub(crate) fn dismiss_idle(&mut self) {
        let Self { busy, dismissed, tiles, works, .. } = self;
        dismissed.clear();
        dismissed.extend(busy.extract_if(.., |&mut place| tiles[place as usize].is_idle()));
        for &place in &*dismissed {
            works[place as usize] = None;
        }
        self.share_out();
        if self.schedule.helps() && !rayon::broadcast(|_| float_mode_is_default()).into_iter().all(|ok| ok) {
            self.busy.iter().for_each(|&place| self.tiles[place as usize].counts.fault = Some(Fault::FloatMode));
        }
    }

    /// A stage over the busy tiles, in parallel; their results in order.
    pub(crate) fn each_tile<R: Send>(&mut self, stage: impl Fn(&mut Bench<'_>) -> R + Sync) -> Vec<R> {
        self.each(|bench, _| stage(bench))
    }

    /// As [`each_tile`](Self::each_tile), with work that each tile keeps from stage to stage.
    pub(crate) fn each_tile_apart(&mut self, stage: impl Fn(&mut Bench<'_>) + Sync) {
        self.each(|bench, own| stage(&mut bench.with_work(own.get_or_insert_default())));
    }

    /// As [`each_tile_apart`](Self::each_tile_apart), over those tiles that do not stand still in this step.
    pub(crate) fn each_tile_under_way(&mut self, stage: impl Fn(&mut Bench<'_>) + Sync) {
        self.each_tile_apart(|bench| {
            if !bench.work.outlook.stands_still() {
                stage(bench);
            }
        });
    }

    fn each<R: Send>(&mut self, stage: impl Fn(&mut Bench<'_>, &mut Option<Box<Work>>) -> R + Sync) -> Vec<R> {
        let Self { setup, hands, schedule, works, tiles, busy, inbox, .. } = self;
        let &mut Self { step, measures, takes_figures, clock, .. } = self;
        let shop = Shop { setup, step, measures, takes_figures };
        for hand in hands.iter_mut() {
            hand.get_mut().expect("no stage panicked").booked_until = None;
        }
        let inbox = &*inbox;
        let run = |team: Team, (place, tile, own): (usize, &mut Tile, &mut Option<Box<Work>>), hand: &mut Hand| {
            if !float_mode_is_default() {
                tile.counts.fault = Some(Fault::FloatMode);
            }
            // Reading such a clock takes a while: where one tile ends the thread's next begins.
            let begun = clock.map(|clock| hand.booked_until.take().unwrap_or_else(clock));
            let result = stage(&mut Bench::new(shop, team.booked_by(clock), tile, inbox.mail(place), hand), own);
            if let Some((clock, begun)) = clock.zip(begun) {
                let now = clock();
                let worked = Team::add_help(now.saturating_sub(begun));
                tile.booked += worked;
                hand.booked += worked;
                hand.booked_until = Some(now);
            }
            result
        };
        let mut rest = (0, &mut tiles[..], &mut works[..]);
        let tiles = busy.iter().map(|&place| {
            let place = place as usize;
            let (first, tiles, works) = std::mem::take(&mut rest);
            let (tile, tiles) = tiles[place - first..].split_first_mut().expect("busy tiles are tiles");
            let (work, works) = works[place - first..].split_first_mut().expect("busy tiles are tiles");
            rest = (place + 1, tiles, works);
            (place, tile, work)
        });
        schedule.run(tiles, hands, run)
    }
}
