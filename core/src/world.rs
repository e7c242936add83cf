//! A world: the tiles of one rank, and what it takes to step them.

use crate::exchange::message::{Halo, Inbox, Mailbag, Outbox, Verdict};
use crate::model::body::Body;
use crate::model::error::{SetupError, StepError};
use crate::model::id::TileId;
use crate::model::math::float_mode_is_default;
use crate::model::params::Exchange;
use crate::parallel::team::Team;
use crate::state::hash::Hashes;
use crate::step::phase::{Phase, Stopwatch, Timings};
use crate::step::stage::{Bench, Work};
use crate::tiling::blueprint::{Blueprint, Setup};
use crate::tiling::tile::{Fault, Tile};
use rayon::prelude::*;
use std::sync::Mutex;

/// The tiles one rank holds. The bodies of other ranks' tiles are elsewhere.
#[derive(Debug)]
pub struct World {
    pub(crate) setup: Setup,
    tiles: Vec<Tile>,
    works: Vec<Mutex<Work>>,
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
        let inbox = Inbox::new(&names, setup.grid.tiles(), setup.dynamic_kinds);
        let outbox = Outbox { bags: vec![Mailbag::default(); names.len()], ..Outbox::default() };
        let tiles = names.into_iter().map(|id| Tile::new(id, &setup)).collect();
        Ok(Self {
            setup,
            tiles,
            works: Vec::new(),
            outbox,
            inbox,
            step: 0,
            sync: 0,
            verdict: Verdict::default(),
            timings: Timings::default(),
            measures: false,
            warned_of_leaps: false,
        })
    }

    /// Adds a body if one of this world's tiles owns it, and says whether. Give every rank every body, in the same
    /// order, or each its own.
    ///
    /// # Errors
    /// If its state is not finite, its rotation not of length one, its kind unknown, or its name a static's. That no
    /// two bodies of the world share a name is for the caller to see to.
    pub fn add(&mut self, body: Body) -> Result<bool, SetupError> {
        let turned = (body.rotation.c * body.rotation.c + body.rotation.s * body.rotation.s - 1.0).abs() < 1e-3;
        if !(body.is_finite() && turned && self.setup.knows(&body)) {
            return Err(SetupError::BadBody { id: body.id });
        }
        let owner = self.setup.grid.locate(body.position);
        let Ok(place) = self.tiles.binary_search_by_key(&owner, |tile| tile.id) else { return Ok(false) };
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
        let works = match self.setup.params.exchange {
            Exchange::Step => threads,
            Exchange::Substep => self.tiles.len(),
        };
        if self.works.len() < works {
            self.works.resize_with(works, Mutex::default);
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

    /// Ends a step: the clock, and what went wrong.
    pub(crate) fn end_step(&mut self) {
        let threads = if apart(self.tiles.len()) { rayon::current_num_threads() as u32 } else { 1 };
        for work in &mut self.works {
            let work = work.get_mut().expect("no stage panicked");
            self.timings.add_share(&std::mem::take(&mut work.timings), threads);
        }
        let leaps: u64 = self.tiles.iter().map(|tile| tile.counts.leaps).sum();
        if leaps > 0 && !self.warned_of_leaps {
            self.warned_of_leaps = true;
            tracing::warn!(
                "step {}: {leaps} bodies moved past a neighbouring tile; larger tiles or a speed limit are faster",
                self.step
            );
        }
        if let Some(id) = self.tiles.iter().filter_map(|tile| tile.counts.not_finite).min() {
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
        self.inbox.sort();
        self.outbox.bags.iter_mut().for_each(Mailbag::clear);
        watch.lap(Phase::Exchange, &mut self.timings);
        Ok(self.inbox.verdict)
    }

    /// A stage over all tiles, in parallel; each result at its tile's place.
    pub(crate) fn each_tile<R: Send>(&mut self, stage: impl Fn(&mut Bench<'_>) -> R + Sync) -> Vec<R> {
        let Self { setup, works, tiles, outbox, inbox, step, measures, .. } = self;
        let (setup, works, step, measures) = (&*setup, &*works, *step, *measures);
        let apart = apart(tiles.len());
        let team = if apart { Team::ALONE } else { Team::of_pool() };
        let per_tile = setup.params.exchange == Exchange::Substep;
        let run = |(place, ((tile, outgoing), incoming)): (usize, ((&mut Tile, _), _))| {
            let work = if per_tile { place } else { rayon::current_thread_index().unwrap_or(0) };
            let mut work = works[work].lock().expect("no stage panicked");
            if !float_mode_is_default() {
                tile.counts.fault = Some(Fault::FloatMode);
            }
            stage(&mut Bench { tile, work: &mut work, outgoing, incoming, setup, step, team, measures })
        };
        if !apart {
            tiles.iter_mut().zip(&mut outbox.bags).zip(&inbox.bags).enumerate().map(run).collect()
        } else {
            let tiles = tiles.par_iter_mut().with_max_len(1);
            tiles.zip(&mut outbox.bags).zip(&inbox.bags).enumerate().map(run).collect()
        }
    }
}
