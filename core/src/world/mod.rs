//! A world: the tiles of one rank, and what it takes to step them.

mod handover;
mod retile;
mod stages;

use crate::exchange::mail::{Inbox, Outbox};
use crate::exchange::verdict::Verdict;
use crate::model::body::Body;
use crate::model::error::SetupError;
use crate::model::id::TileId;
use crate::model::names::Names;
use crate::parallel::team::Team;
use crate::state::figures::Figures;
use crate::state::hash::Hashes;
use crate::state::view::TileView;
use crate::step::phase::Timings;
use crate::step::stage::{Hand, Work};
use crate::tiling::blueprint::{Blueprint, Setup};
use crate::tiling::partition::Partition;
use crate::tiling::tile::Tile;
use rayon::prelude::*;
use std::sync::{Arc, Mutex};
use std::time::Duration;

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
    /// By which the time spent on each tile is booked, if it is.
    clock: Option<Clock>,
    /// So far.
    booked: Duration,
    /// Whether the next step measures how well its contacts are solved.
    pub(crate) measures: bool,
    /// Whether the next step takes figures, and what the last one took.
    pub(crate) takes_figures: bool,
    figures: Option<Box<Figures>>,
    /// Whether it was said that bodies outrun their tiles.
    warned_of_leaps: bool,
}

/// A clock to book the time of tiles by: how long the thread that asks has worked so far, or how late it is.
pub type Clock = fn() -> Duration;

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
        let outside = names.iter().copied().find(|tile| tile.0 as usize >= setup.partition.tiles());
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
        let all: Vec<_> = (0..blueprint.partition.tiles() as u32).map(TileId).collect();
        Self::new(blueprint, &all)
    }

    /// A world of some tiles, which are in ascending order.
    fn of(setup: Arc<Setup>, tiles: Vec<Tile>) -> Self {
        let inbox = Inbox::new(tiles.iter().map(|tile| tile.id), setup.partition.tiles(), setup.dynamic_kinds);
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
            clock: None,
            booked: Duration::ZERO,
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
        let owner = self.setup.partition.locate(body.position);
        let Some(place) = self.place_of(owner) else { return Ok(false) };
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

    /// How the domain is cut, at this step.
    pub fn partition(&self) -> &Partition {
        &self.setup.partition
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

    /// Has the time that is worked on each tile booked from here on. Times never enter a result.
    pub fn book_time(&mut self, clock: Clock) {
        self.clock = Some(clock);
    }

    /// All time that was booked so far, of all threads together.
    pub fn booked_time(&self) -> Duration {
        self.booked
    }

    /// The time booked for each tile since this was last asked for, in the order of [`tiles`](Self::tiles), of all threads that
    /// worked on it together.
    pub fn take_booked_times(&mut self) -> impl Iterator<Item = (TileId, Duration)> {
        self.tiles.iter_mut().map(|tile| (tile.id, std::mem::take(&mut tile.booked)))
    }

    /// Time spent in each phase so far, as shares of the wall clock.
    pub fn timings(&self) -> &Timings {
        &self.timings
    }

    /// Where among this world's a tile is, if it is there.
    pub(crate) fn place_of(&self, tile: TileId) -> Option<usize> {
        self.tiles.binary_search_by_key(&tile, |tile| tile.id).ok()
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
}
