//! A world: the tiles of one rank, and what it takes to step them.

use crate::exchange::halo::{Carry, NotCarried};
use crate::exchange::mail::{Inbox, Mailbag, Outbox};
use crate::exchange::verdict::Verdict;
use crate::model::body::Body;
use crate::model::error::{SetupError, StepError};
use crate::model::id::{GlobalId, TileId};
use crate::model::math::float_mode_is_default;
use crate::model::names::Names;
use crate::parallel::deal::dealt;
use crate::parallel::team::Team;
use crate::state::figures::Figures;
use crate::state::hash::Hashes;
use crate::state::view::TileView;
use crate::step::phase::{Phase, Stopwatch, Timings};
use crate::step::stage::{Bench, Hand, Shop, Work};
use crate::tiling::blueprint::{Blueprint, Setup};
use crate::tiling::tile::{Fault, Tile, TileCounts};
use rayon::prelude::*;
use std::sync::{Arc, Mutex};

/// The tiles one rank holds. The bodies of other ranks' tiles are elsewhere.
#[derive(Debug)]
pub struct World {
    pub(crate) setup: Arc<Setup>,
    tiles: Vec<Tile>,
    /// Places of the tiles that own bodies, ascending: only these cost anything in a step.
    busy: Vec<u32>,
    /// Those that owned some until this step.
    dismissed: Vec<u32>,
    /// Whether `busy` must be made anew: bodies came or went between two steps.
    changed: bool,
    /// Of the bodies that were added here.
    names: Names,
    /// One per thread.
    hands: Vec<Mutex<Hand>>,
    /// Per tile what it keeps between the stages of a step with several sync points.
    works: Vec<Option<Box<Work>>>,
    outbox: Outbox,
    inbox: Inbox,
    pub(crate) step: u64,
    sync: u32,
    /// What this rank has to say at the next exchange.
    verdict: Verdict,
    timings: Timings,
    /// Whether the next step measures how well its contacts are solved.
    pub(crate) measures: bool,
    /// Whether the next step takes figures, and what the last one took.
    pub(crate) takes_figures: bool,
    figures: Option<Box<Figures>>,
    /// Whether it was said that bodies outrun their tiles.
    warned_of_leaps: bool,
}

/// Whether every thread works on tiles of its own. Where there are fewer tiles than threads, all work on one tile after
/// the other; not both, as who waits for others within a tile might be handed another tile, and its work is taken.
fn apart(tiles: usize) -> bool {
    let threads = rayon::current_num_threads();
    threads > 1 && tiles >= threads
}

impl World {
    /// An empty world of the given tiles. None at all is allowed: a rank without work still takes part in exchanges.
    ///
    /// # Errors
    /// If a parameter, a kind, a static or a tile is out of range.
    pub fn new(blueprint: &Blueprint, tiles: &[TileId]) -> Result<Self, SetupError> {
        let setup = Setup::new(blueprint)?;
        let mut names = tiles.to_vec();
        names.sort_unstable();
        let doubled = names.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0]);
        let outside = names.iter().copied().find(|tile| tile.0 as usize >= setup.grid.tiles());
        if let Some(tile) = doubled.or(outside) {
            return Err(SetupError::BadTile { tile });
        }
        let tiles = names.into_iter().map(|id| Tile::new(id, &setup)).collect();
        Ok(Self::of(Arc::new(setup), tiles))
    }

    /// An empty world of every tile of the grid: one that needs no other rank, and can be stepped with
    /// [`Loopback`](crate::Loopback).
    ///
    /// # Errors
    /// If a parameter, a kind or a static is out of range.
    pub fn whole(blueprint: &Blueprint) -> Result<Self, SetupError> {
        let all: Vec<_> = (0..blueprint.grid.tiles() as u32).map(TileId).collect();
        Self::new(blueprint, &all)
    }

    /// A world of some tiles, which are in ascending order.
    fn of(setup: Arc<Setup>, tiles: Vec<Tile>) -> Self {
        let names: Vec<_> = tiles.iter().map(|tile| tile.id).collect();
        let inbox = Inbox::new(&names, setup.grid.tiles(), setup.dynamic_kinds);
        Self {
            setup,
            works: tiles.iter().map(|_| None).collect(),
            outbox: Outbox::default(),
            tiles,
            busy: Vec::new(),
            dismissed: Vec::new(),
            changed: true,
            names: Names::default(),
            hands: Vec::new(),
            inbox,
            step: 0,
            sync: 0,
            verdict: Verdict::default(),
            timings: Timings::default(),
            measures: false,
            takes_figures: false,
            figures: None,
            warned_of_leaps: false,
        }
    }

    /// The same bodies at the same step, in a world that remembers no contacts: to look at.
    pub(crate) fn copy_bodies(&self) -> Self {
        let tiles = self.tiles.iter().map(|tile| tile.copy_bodies(&self.setup)).collect();
        let verdict = Verdict { stop: false, meet: false, far: false, ..self.verdict };
        Self { step: self.step, verdict, ..Self::of(Arc::clone(&self.setup), tiles) }
    }

    /// Adds a body if one of this world's tiles owns it, and says whether. Give every rank every body, in the same
    /// order, or each its own.
    ///
    /// # Errors
    /// If its state is not finite, its rotation not of length one, its kind unknown, or its name taken: by a static, or
    /// by a body that was added to this world. That bodies of different ranks have different names is for the caller to
    /// see to.
    pub fn add(&mut self, body: Body) -> Result<bool, SetupError> {
        let turned = (body.rotation.c * body.rotation.c + body.rotation.s * body.rotation.s - 1.0).abs() < 1e-3;
        if !(body.is_finite() && turned && self.setup.knows(&body)) {
            return Err(SetupError::BadBody { id: body.id });
        }
        let owner = self.setup.grid.locate(body.position);
        let Ok(place) = self.tiles.binary_search_by_key(&owner, |tile| tile.id) else { return Ok(false) };
        if !self.names.insert(body.id) {
            return Err(SetupError::NameTaken { id: body.id });
        }
        let tile = &mut self.tiles[place];
        // Ghosts and statics of the last step may stand behind the owned bodies.
        tile.bodies.insert(tile.owned, body);
        tile.owned += 1;
        tile.rim.is_known = false;
        self.changed = true;
        Ok(true)
    }

    /// Every owned body.
    pub fn bodies(&self) -> impl Iterator<Item = Body> + '_ {
        self.tiles.iter().flat_map(|tile| (0..tile.owned).map(|i| tile.bodies.get(i)))
    }

    /// What there is to see of each of the [`tiles`](Self::tiles), in their order.
    pub fn views(&self) -> impl Iterator<Item = TileView<'_>> {
        self.tiles.iter().map(TileView::new)
    }

    /// The tiles, ascending.
    pub fn tiles(&self) -> impl Iterator<Item = TileId> + '_ {
        self.tiles.iter().map(|tile| tile.id)
    }

    /// Steps made so far.
    pub fn step_count(&self) -> u64 {
        self.step
    }

    /// Fingerprints of this rank's bodies and contacts; [`Hashes::merge`] those of all ranks.
    pub fn hashes(&self) -> Hashes {
        self.tiles.par_iter().map(Tile::hashes).reduce(Hashes::default, Hashes::merge)
    }

    /// Asks all ranks to stop: every rank's next step reports `stopped`.
    pub fn request_stop(&mut self) {
        self.verdict.stop = true;
    }

    /// Asks all ranks to do something together after the next step: every rank's next step reports `meeting`, unless it
    /// reports `stopped`.
    pub fn request_meeting(&mut self) {
        self.verdict.meet = true;
    }

    /// Asks that the next step, and the last one of a run that was asked to stop, measure how well its contacts are
    /// solved: [`TileFacts`](crate::TileFacts) then tell.
    pub fn measure_next_step(&mut self) {
        self.measures = true;
    }

    /// Asks that the next step, and the last one of a run that was asked to stop, take [`figures`](Self::figures).
    pub fn take_figures_of_next_step(&mut self) {
        self.takes_figures = true;
    }

    /// The figures of this rank's tiles in the last step, if it took them; [`Figures::merge`] those of all ranks.
    pub fn figures(&self) -> Option<&Figures> {
        self.figures.as_deref()
    }

    /// The figures of this rank's bodies between two steps, and no contacts.
    pub fn figures_of_bodies(&self) -> Figures {
        let of_tile = |tile: &Tile| {
            let mut figures = Box::<Figures>::default();
            figures.add_bodies(tile, &self.setup, Team::ALONE);
            figures
        };
        let both = |mut all: Box<Figures>, other: Box<Figures>| {
            all.merge(&other);
            all
        };
        *self.tiles.par_iter().filter(|tile| !tile.is_idle()).map(of_tile).reduce(Box::default, both)
    }

    /// Time spent in each phase so far, as shares of the wall clock.
    pub fn timings(&self) -> &Timings {
        &self.timings
    }

    pub(crate) fn tile_states(&self) -> &[Tile] {
        &self.tiles
    }

    /// Forgets all that was derived of tiles and is kept from step to step: it must never show.
    #[cfg(test)]
    pub(crate) fn forget_works(&mut self) {
        self.works.iter_mut().for_each(|work| *work = None);
    }

    #[cfg(test)]
    pub(crate) fn tile_states_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }

    /// The tiles that had something to do in the step under way.
    pub(crate) fn tiles_of_step(&self) -> impl Iterator<Item = &Tile> {
        self.busy.iter().chain(&self.dismissed).map(|&place| &self.tiles[place as usize])
    }

    /// Puts a tile in the place of another of the same name.
    pub(crate) fn replace_tile(&mut self, place: usize, tile: Tile) {
        self.tiles[place] = tile;
        self.changed = true;
    }

    /// Starts a step: no sync point passed, nothing counted.
    pub(crate) fn begin_step(&mut self) {
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
    }

    /// Ends a step, in which so many bodies outran their tiles: the clock, and the lowest body whose state is not finite.
    pub(crate) fn end_step(&mut self, leaps: u64, not_finite: Option<GlobalId>) {
        let threads = if apart(self.busy.len()) { rayon::current_num_threads() as u32 } else { 1 };
        self.figures = std::mem::take(&mut self.takes_figures).then(Box::default);
        for hand in &mut self.hands {
            let hand = hand.get_mut().expect("no stage panicked");
            if let Some(figures) = &mut self.figures {
                figures.merge(&std::mem::take(&mut hand.figures));
            }
            self.timings.add_share(&std::mem::take(&mut hand.timings), threads);
        }
        if leaps > 0 && !self.warned_of_leaps {
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
    }

    /// Whether this rank already knows that the run has failed; its state is then not fit to be sent.
    pub(crate) fn has_failed(&self) -> bool {
        self.verdict.failure.is_some()
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
        let helped = rayon::current_num_threads() > 1 && !apart(busy.len());
        if helped && !rayon::broadcast(|_| float_mode_is_default()).into_iter().all(|ok| ok) {
            busy.iter().for_each(|&place| tiles[place as usize].counts.fault = Some(Fault::FloatMode));
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

    fn each<R: Send>(&mut self, stage: impl Fn(&mut Bench<'_>, &mut Option<Box<Work>>) -> R + Sync) -> Vec<R> {
        let apart = apart(self.busy.len());
        let Self { setup, hands, works, tiles, busy, inbox, step, measures, takes_figures, .. } = self;
        let team = if apart { Team::ALONE } else { Team::of_pool() };
        let shop = Shop { setup, step: *step, team, measures: *measures, takes_figures: *takes_figures };
        let (hands, inbox) = (&*hands, &*inbox);
        let run = |(place, tile, own): (usize, &mut Tile, &mut Option<Box<Work>>)| {
            let mut hand = hands[rayon::current_thread_index().unwrap_or(0)].lock().expect("no stage panicked");
            if !float_mode_is_default() {
                tile.counts.fault = Some(Fault::FloatMode);
            }
            stage(&mut Bench::new(shop, tile, inbox.mail(place), &mut hand), own)
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
        if !apart {
            return tiles.map(run).collect();
        }
        let dealt = dealt(tiles.collect(), |(_, tile, _)| tile.work(), rayon::current_num_threads());
        let in_place = |job: (usize, &mut Tile, &mut Option<Box<Work>>)| (job.0, run(job));
        let mut results: Vec<_> = dealt.into_par_iter().with_max_len(1).map(in_place).collect();
        results.sort_unstable_by_key(|&(place, _)| place);
        results.into_iter().map(|(_, result)| result).collect()
    }
}
