//! A world: the tiles of one rank, and what it takes to step them.

use crate::exchange::halo::{Halo, Verdict};
use crate::exchange::mail::{Inbox, Mail, Outbox};
use crate::model::body::Body;
use crate::model::error::{SetupError, StepError};
use crate::model::id::{GlobalId, TileId};
use crate::model::math::float_mode_is_default;
use crate::model::names::Names;
use crate::parallel::team::Team;
use crate::state::hash::Hashes;
use crate::step::phase::{Phase, Stopwatch, Timings};
use crate::step::stage::{Bench, Hand, Shop, Work};
use crate::tiling::blueprint::{Blueprint, Setup};
use crate::tiling::tile::{Fault, Tile};
use rayon::prelude::*;
use std::sync::{Arc, Mutex};

/// The tiles one rank holds. The bodies of other ranks' tiles are elsewhere.
#[derive(Debug)]
pub struct World {
    pub(crate) setup: Arc<Setup>,
    tiles: Vec<Tile>,
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
            outbox: Outbox::new(tiles.len()),
            tiles,
            names: Names::default(),
            hands: Vec::new(),
            inbox,
            step: 0,
            sync: 0,
            verdict: Verdict::default(),
            timings: Timings::default(),
            measures: false,
            warned_of_leaps: false,
        }
    }

    /// The same bodies at the same step, in a world that remembers no contacts: to look at.
    pub(crate) fn copy_bodies(&self) -> Self {
        let tiles = self.tiles.iter().map(|tile| tile.copy_bodies(&self.setup)).collect();
        let verdict = Verdict { stop: false, ..self.verdict };
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
        Ok(true)
    }

    /// Every owned body.
    pub fn bodies(&self) -> impl Iterator<Item = Body> + '_ {
        self.tiles.iter().flat_map(|tile| (0..tile.owned).map(|i| tile.bodies.get(i)))
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

    /// Asks that the next step, and the last one of a run that was asked to stop, measure how well its contacts are
    /// solved: [`TileFacts`](crate::TileFacts) then tell.
    pub fn measure_next_step(&mut self) {
        self.measures = true;
    }

    /// Time spent in each phase so far, as shares of the wall clock.
    pub fn timings(&self) -> &Timings {
        &self.timings
    }

    pub(crate) fn tile_states(&self) -> &[Tile] {
        &self.tiles
    }

    pub(crate) fn tile_states_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }

    /// Starts a step: no sync point passed, nothing counted.
    pub(crate) fn begin_step(&mut self) {
        self.sync = 0;
        let threads = rayon::current_num_threads();
        if self.hands.len() < threads {
            self.hands.resize_with(threads, Mutex::default);
        }
        for tile in &mut self.tiles {
            tile.counts = Default::default();
        }
        // Where threads help within tiles, each of them is asked once a step; else in every stage.
        if threads > 1
            && !apart(self.tiles.len())
            && !rayon::broadcast(|_| float_mode_is_default()).into_iter().all(|ok| ok)
        {
            self.tiles.iter_mut().for_each(|tile| tile.counts.fault = Some(Fault::FloatMode));
        }
    }

    /// Ends a step, in which so many bodies outran their tiles: the clock, and the lowest body whose state is not finite.
    pub(crate) fn end_step(&mut self, leaps: u64, not_finite: Option<GlobalId>) {
        let threads = if apart(self.tiles.len()) { rayon::current_num_threads() as u32 } else { 1 };
        for hand in &mut self.hands {
            let hand = hand.get_mut().expect("no stage panicked");
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
            self.verdict = self.verdict.merge(Verdict { stop: false, failure: Some((self.step, id)) });
        }
        self.measures = false;
        self.step += 1;
    }

    /// Whether this rank already knows that the run has failed; its state is then not fit to be sent.
    pub(crate) fn has_failed(&self) -> bool {
        self.verdict.failure.is_some()
    }

    /// One sync point. What all ranks together have to say comes back.
    pub(crate) fn exchange<H: Halo>(&mut self, halo: &mut H) -> Result<Verdict, StepError<H::Error>> {
        let mut watch = Stopwatch::start();
        self.outbox.verdict = self.verdict;
        (self.outbox.step, self.outbox.sync) = (self.step, self.sync);
        self.inbox.begin(self.step, self.sync);
        self.sync += 1;
        halo.exchange(&mut self.outbox, &mut self.inbox).map_err(StepError::Halo)?;
        self.inbox.end(&mut self.outbox);
        watch.lap(Phase::Exchange, &mut self.timings);
        Ok(self.inbox.verdict)
    }

    /// A stage over all tiles, in parallel; each result at its tile's place.
    pub(crate) fn each_tile<R: Send>(&mut self, stage: impl Fn(&mut Bench<'_>) -> R + Sync) -> Vec<R> {
        let results = self.each(|_, _| true, |bench, _| stage(bench));
        results.into_iter().map(|result| result.expect("every tile was wanted")).collect()
    }

    /// A stage over the tiles that own bodies: only they have something to tell, or to solve.
    pub(crate) fn each_owner(&mut self, stage: impl Fn(&mut Bench<'_>) + Sync) {
        self.each(|tile, _| !tile.is_idle(), |bench, _| stage(bench));
    }

    /// A stage over the tiles that own bodies, are about to, or have until now.
    pub(crate) fn each_heir(&mut self, stage: impl Fn(&mut Bench<'_>) + Sync) {
        self.each(|tile, mail| !tile.is_bare() || mail.brings_migrants(), |bench, _| stage(bench));
    }

    /// As [`each_owner`](Self::each_owner), for what a tile keeps from stage to stage.
    pub(crate) fn each_solver(&mut self, stage: impl Fn(&mut Bench<'_>) + Sync) {
        self.each(|tile, _| !tile.is_idle(), |bench, own| stage(&mut bench.with_work(own.get_or_insert_default())));
    }

    /// A stage over the tiles that are wanted, in parallel.
    fn each<R: Send>(
        &mut self,
        wanted: impl Fn(&Tile, Mail<'_>) -> bool + Sync,
        stage: impl Fn(&mut Bench<'_>, &mut Option<Box<Work>>) -> R + Sync,
    ) -> Vec<Option<R>> {
        let apart = apart(self.tiles.len());
        let Self { setup, hands, works, tiles, outbox, inbox, step, measures, .. } = self;
        let team = if apart { Team::ALONE } else { Team::of_pool() };
        let shop = Shop { setup, step: *step, team, measures: *measures };
        let (hands, inbox) = (&*hands, &*inbox);
        let run = |(place, ((tile, outgoing), own)): (usize, ((&mut Tile, _), &mut Option<Box<Work>>))| {
            let mail = inbox.mail(place);
            if !wanted(tile, mail) {
                *own = None;
                return None;
            }
            let mut hand = hands[rayon::current_thread_index().unwrap_or(0)].lock().expect("no stage panicked");
            if !float_mode_is_default() {
                tile.counts.fault = Some(Fault::FloatMode);
            }
            Some(stage(&mut Bench::new(shop, tile, (outgoing, mail), &mut hand), own))
        };
        if !apart {
            tiles.iter_mut().zip(&mut outbox.bags).zip(works).enumerate().map(run).collect()
        } else {
            let tiles = tiles.par_iter_mut().with_max_len(1);
            tiles.zip(&mut outbox.bags).zip(works).enumerate().map(run).collect()
        }
    }
}
