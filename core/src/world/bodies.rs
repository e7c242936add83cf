//! The bodies of a world, one by one and by name: they come, are looked at, and go.

use super::World;
use super::locator::{Locator, Place};
use crate::model::body::Body;
use crate::model::error::SetupError;
use crate::model::id::{GlobalId, KindId};
use crate::model::kind::{Kind, KindRow};
use crate::model::names::Names;
use crate::tiling::tile::Tile;
use rayon::prelude::*;
use std::sync::Arc;

impl World {
    /// Adds a body if one of this world's tiles owns it, and says whether. Give every rank every body, in the same
    /// order, or each its own. Takes the same time however many bodies there are; under the name of one that was just removed,
    /// as long as removing one from a world that may sleep.
    ///
    /// # Errors
    /// If its state is not finite, its position beyond 1e30 m, its rotation not of length one, its kind unknown, or its name
    /// taken: by a static, or by a body that was added to this world or is there. That bodies of different ranks have different
    /// names is for the caller to see to.
    pub fn add(&mut self, body: Body) -> Result<bool, SetupError> {
        self.setup.check_body(&body)?;
        self.greatest_name = self.greatest_name.max(body.id);
        if self.removed.contains(body.id) {
            self.forget_ghosts(body.id);
        }
        let owner = self.setup.partition.locate(body.position);
        let Some(place) = self.place_of(owner) else { return Ok(false) };
        if !self.knows_names {
            self.locate_all();
        }
        let free = match self.locator.get_mut() {
            Some(locator) => locator.look_up(body.id, &self.tiles).is_none(),
            None => self.names.insert(body.id),
        };
        if !free {
            return Err(SetupError::NameTaken { id: body.id });
        }
        self.put(place, body);
        Ok(true)
    }

    /// As [`add`](Self::add), under a name that no body has had here, whatever its `id` says; gives that name. With several
    /// ranks, each must have been given every body.
    ///
    /// # Errors
    /// As [`add`](Self::add); no name is used up then.
    pub fn insert(&mut self, body: Body) -> Result<GlobalId, SetupError> {
        let id = GlobalId(self.greatest_name.0.checked_add(1).ok_or(SetupError::NameTaken { id: self.greatest_name })?);
        let body = Body { id, ..body };
        self.setup.check_body(&body)?;
        self.greatest_name = id;
        if let Some(place) = self.place_of(self.setup.partition.locate(body.position)) {
            if self.knows_names {
                self.names.insert(id);
            }
            self.put(place, body);
        }
        Ok(id)
    }

    /// Adds a body under a name that is free to a tile.
    fn put(&mut self, place: usize, mut body: Body) {
        body.angular_velocity = self.setup.kind(body.kind).turning(body.angular_velocity);
        let at = self.tiles[place].add(body);
        if let Some(locator) = self.locator.get_mut() {
            locator.insert(body.id, Place { tile: place as u32, at });
        }
        self.note_change(place);
    }

    /// The body of that name, if it is one of this world's. The first time this is asked, all are looked at; from then on it takes
    /// the same time however many there are.
    pub fn get(&self, id: GlobalId) -> Option<Body> {
        let Place { tile, at } = self.locator.get_or_init(|| Locator::new(&self.tiles)).find(id, &self.tiles)?;
        Some(self.tiles[tile as usize].at(at))
    }

    /// Removes the body of that name, with the forces upon it, and says whether it was one of this world's; a static stays. Tell every
    /// rank. Takes as long as [`get`](Self::get); where bodies may [`sleep`](crate::Params::sleep), also that of a look at each tile, for
    /// those that rest on it there.
    pub fn remove(&mut self, id: GlobalId) -> bool {
        if self.is_static(id) {
            return false;
        }
        self.removed.push(id);
        self.stop_pushing(id);
        if self.setup.params.sleep {
            self.tiles.iter_mut().for_each(|tile| tile.wake_beside_ghost(id));
        }
        self.locate_all();
        let may_have_left = self.tiles.len() < self.setup.partition.tiles();
        let found = self.locator.get_mut().and_then(|locator| locator.remove(id, may_have_left, &self.tiles));
        let Some(Place { tile, at }) = found else { return false };
        self.tiles[tile as usize].remove(id, at);
        self.note_change(tile as usize);
        true
    }

    /// Whether a body was to be removed since the last step.
    pub(crate) fn was_removed(&self, id: GlobalId) -> bool {
        self.removed.contains(id)
    }

    /// Once the step, or a restored moment, knows nothing of who was removed before it.
    pub(super) fn forget_removed(&mut self) {
        self.removed.clear();
    }

    /// Every owned body.
    pub fn bodies(&self) -> impl Iterator<Item = Body> + '_ {
        self.tiles.iter().flat_map(Tile::present).map(|(_, body)| body)
    }

    /// How many there are.
    pub fn body_count(&self) -> usize {
        self.tiles.iter().map(Tile::count).sum()
    }

    /// How many pairs of bodies there are at least that touch, or nearly do, however they are turned: of one kind, in one square that
    /// is no wider than they are. Takes the time of sorting the bodies of each tile.
    pub fn crowding(&self) -> u64 {
        let of_tile = |tile: &Tile| {
            let square = |(_, body): (_, Body)| {
                let kind = self.setup.kind(body.kind);
                let width = f64::from(2.0 * kind.inner_radius);
                let [x, y] = (body.position / width).floor().to_array().map(|place| place as i64 as u64);
                // Squares that are taken for one make no difference to speak of.
                let mix = |hash: u64, word: u64| (hash.rotate_left(29) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                kind.touches(kind).then(|| mix(mix(mix(0, body.kind.0.into()), x), y))
            };
            let mut squares: Vec<u64> = tile.present().filter_map(square).collect();
            squares.sort_unstable();
            squares.chunk_by(|a, b| a == b).map(|alike| (alike.len() * (alike.len() - 1) / 2) as u64).sum::<u64>()
        };
        self.tiles.par_iter().map(of_tile).sum()
    }

    /// Whether a static has this name.
    pub fn is_static(&self, id: GlobalId) -> bool {
        self.setup.is_static(id)
    }

    /// Adds a row to the table of kinds, and gives its number. Tell every rank, between the same two steps. A larger body than any
    /// there was makes the halo wider.
    ///
    /// # Errors
    /// If a size is not positive, or a number out of range.
    pub fn add_kind(&mut self, kind: &Kind) -> Result<KindId, SetupError> {
        let row = KindId(self.setup.dynamic_kinds as u32);
        let widens = Arc::make_mut(&mut self.setup).add_kind(kind)?;
        self.inbox.kinds = self.setup.dynamic_kinds as u32;
        if widens {
            self.settle();
            let setup = &self.setup;
            self.tiles.par_iter_mut().for_each(|tile| tile.follow_kinds(setup));
            self.forget_works();
        } else {
            self.tiles.iter_mut().for_each(Tile::move_kinds_of_statics);
        }
        Ok(row)
    }

    /// The table of kinds as it is now.
    pub fn kinds(&self) -> impl ExactSizeIterator<Item = Kind> + '_ {
        self.setup.kinds[..self.setup.dynamic_kinds].iter().map(KindRow::kind)
    }

    /// Settles which place those bodies have that came since the last step, and that others left. A step begins with this; whoever
    /// wants to see the tiles before, by [`views`](Self::views), asks for it. Copies that other tiles have of a body that was removed, and
    /// their contacts with it, stay until the step.
    pub fn settle(&mut self) {
        if !std::mem::take(&mut self.is_unsettled) {
            return;
        }
        for (place, _) in self.tiles.iter().enumerate().filter(|(_, tile)| tile.changes.is_some()) {
            self.places.forget_tile(place);
        }
        self.tiles.par_iter_mut().for_each(Tile::settle);
        self.changed = true;
    }

    /// The tile that owns a body, and its place there, if it is one of this world's and was there in the last step.
    pub(crate) fn owned(&self, id: GlobalId) -> Option<(&Tile, usize)> {
        let Place { tile, at } = self.locator.get_or_init(|| Locator::new(&self.tiles)).find(id, &self.tiles)?;
        Some((&self.tiles[tile as usize], at as usize)).filter(|&(tile, at)| at < tile.owned)
    }

    /// Where a body is, for who is about to change it.
    pub(super) fn look_up(&mut self, id: GlobalId) -> Option<Place> {
        self.locate_all();
        self.locator.get_mut()?.look_up(id, &self.tiles)
    }

    /// Makes the locator, if there is none; it knows which names are taken.
    fn locate_all(&mut self) {
        if self.locator.get().is_none() {
            self.locator = Locator::new(&self.tiles).into();
        }
        (self.names, self.knows_names) = (Names::default(), false);
    }

    /// Contacts with a body of that name mean nothing from here on, in whichever tile.
    pub(super) fn forget_ghosts(&mut self, id: GlobalId) {
        self.tiles.iter_mut().for_each(|tile| tile.forget_ghost(id));
    }

    /// Something is there to be settled in a tile.
    fn note_change(&mut self, tile: usize) {
        self.is_unsettled = true;
        self.places.forget_tile(tile);
    }

    /// After a step: bodies that went from tile to tile are found in their new ones.
    pub(super) fn follow_bodies(&mut self) {
        self.forget_removed();
        let bodies = || self.tiles.iter().map(Tile::count).sum();
        let Some(locator) = self.locator.get_mut() else { return };
        if locator.is_stale(bodies()) {
            self.locator.take();
            return;
        }
        for &number in &self.busy {
            locator.follow(number, &mut self.tiles[number as usize]);
        }
    }

    /// After tiles came or went: nobody is where he was.
    pub(super) fn forget_places(&mut self) {
        self.locator.take();
        self.knows_names = false;
        self.places.forget();
    }
}
