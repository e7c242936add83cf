//! A world: the tiles of one rank, and what it takes to step them.

mod bodies;
mod command;
mod forces;
mod handover;
mod locator;
mod retile;
mod stages;

use crate::exchange::mail::{Inbox, Outbox};
use crate::exchange::verdict::Verdict;
use crate::model::error::SetupError;
use crate::model::id::{GlobalId, TileId};
use crate::model::names::{Names, Noted};
use crate::parallel::schedule::Schedule;
use crate::parallel::team::Team;
use crate::state::figures::Figures;
use crate::state::hash::Hashes;
use crate::state::questions::Places;
use crate::state::view::TileView;
use crate::step::phase::Timings;
use crate::step::stage::{Hand, Work};
use crate::tiling::blueprint::{Blueprint, Setup};
use crate::tiling::partition::Partition;
use crate::tiling::tile::Tile;
pub use command::Command;
use forces::{Force, Load};
use locator::Locator;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::sync::{Arc, Mutex, OnceLock};
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
    /// Whether tiles have bodies that came or left since the last step, and did not settle it.
    is_unsettled: bool,
    /// Of the bodies that were added here, as long as these are all, and nobody has looked for one.
    names: Names,
    /// Whether that is so; or else a locator knows them.
    knows_names: bool,
    /// The greatest of all bodies and statics that this world was told of.
    greatest_name: GlobalId,
    /// Of the bodies that were to be removed since the last step, wherever they were.
    removed: Noted,
    /// Where each body is, once anybody has asked.
    locator: OnceLock<Locator>,
    /// Where all are, once anybody has asked.
    pub(crate) places: Places,
    /// What pushes at bodies for some steps.
    forces: Vec<Force>,
    /// What of these acts in the step under way, all together upon each body.
    loads: FxHashMap<GlobalId, Load>,
    /// One per thread.
    hands: Vec<Mutex<Hand>>,
    /// Which thread takes which of the busy tiles.
    schedule: Schedule,
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
    /// Whether a run may end while ranks meet.
    pub(crate) ends_in_meetings: bool,
    figures: Option<Box<Figures>>,
    /// Whether it was said that bodies outrun their tiles.
    warned_of_leaps: bool,
    /// Where a single thread begins among the busy tiles.
    first: usize,
    /// How the domain is cut from the next step on, if that changes.
    next_partition: Option<Partition>,
    /// Whether it has changed with the step under way.
    borders_moved: bool,
    /// The step that failed and left all of this halfway.
    halfway: Option<u64>,
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
            works: tiles.iter().map(|_| None).collect(),
            outbox: Outbox::default(),
            tiles,
            busy: Vec::new(),
            dismissed: Vec::new(),
            changed: true,
            is_unsettled: false,
            names: Names::default(),
            knows_names: true,
            greatest_name: setup.statics.iter().map(|fixed| fixed.id).max().unwrap_or_default(),
            removed: Noted::default(),
            locator: OnceLock::new(),
            places: Places::default(),
            forces: Vec::new(),
            loads: FxHashMap::default(),
            hands: Vec::new(),
            schedule: Schedule::default(),
            inbox,
            step: 0,
            sync: 0,
            verdict: Verdict::default(),
            timings: Timings::default(),
            clock: None,
            booked: Duration::ZERO,
            measures: false,
            takes_figures: false,
            ends_in_meetings: false,
            figures: None,
            warned_of_leaps: false,
            first: 0,
            next_partition: None,
            borders_moved: false,
            halfway: None,
            setup,
        }
    }

    /// The same bodies at the same step, in a world that remembers no contacts: to look at.
    pub(crate) fn copy_bodies(&self) -> Self {
        let tiles = self.tiles.iter().map(|tile| tile.settled(&self.setup).copy_bodies(&self.setup)).collect();
        let verdict = Verdict { stop: false, meet: false, far: false, ..self.verdict };
        Self { step: self.step, verdict, halfway: self.halfway, ..Self::of(Arc::clone(&self.setup), tiles) }
    }

    /// What there is to see of each of the [`tiles`](Self::tiles), in their order, as the last step left it, or
    /// [`settle`](Self::settle).
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
        let hashes = |tile: &Tile| tile.settled(&self.setup).hashes();
        self.tiles.par_iter().map(hashes).reduce(Hashes::default, Hashes::merge)
    }

    /// Asks all ranks to stop: every rank's next step reports `stopped`, and so does each after it.
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

    /// Says that the run may end in any meeting: each step that leads to one measures and takes figures as the last one of a run that
    /// was asked to stop.
    pub fn end_in_meetings(&mut self) {
        self.ends_in_meetings = true;
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
            figures.add_bodies(&tile.settled(&self.setup), &self.setup, Team::ALONE);
            figures
        };
        let both = |mut all: Box<Figures>, other: Box<Figures>| {
            all.merge(&other);
            all
        };
        *self.tiles.par_iter().filter(|tile| tile.count() > 0).map(of_tile).reduce(Box::default, both)
    }

    /// Has the time that is worked on each tile booked from here on. Times never enter a result.
    pub fn book_time(&mut self, clock: Clock) {
        self.clock = Some(clock);
    }

    /// Has one thread, where it works on all tiles, begin with another than the first: who comes first finds less in the caches, and
    /// is booked more time. It shows nowhere else.
    #[doc(hidden)]
    pub fn begin_with(&mut self, place: usize) {
        self.first = place;
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
        // Where all are here, each is at its own number.
        let is_at = |place: usize| self.tiles.get(place).is_some_and(|other| other.id == tile);
        let own = tile.0 as usize;
        if is_at(own) { Some(own) } else { self.tiles.binary_search_by_key(&tile, |tile| tile.id).ok() }
    }

    pub(crate) fn tile_states(&self) -> &[Tile] {
        &self.tiles
    }

    /// Forgets all that was derived of tiles and is kept from step to step: it must never show.
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
        let greatest = tile.bodies.id[..tile.owned].iter().copied().max();
        self.greatest_name = self.greatest_name.max(greatest.unwrap_or_default());
        self.tiles[place] = tile;
        self.changed = true;
        self.forget_places();
    }
}
