//! Bodies that come to a tile or leave it between two steps because somebody asked for it. They are noted at once and settled
//! before the tile is stepped, all together, so that one of many costs next to nothing.

use super::blueprint::Setup;
use super::tile::Tile;
use crate::model::body::Body;
use crate::model::contact::{PairKey, Slot, SlotKind};
use crate::model::id::{GlobalId, KindId};
use rustc_hash::FxHashSet;
use std::ops::Deref;

/// What is not settled yet.
#[derive(Clone, Default, Debug)]
pub(crate) struct Changes {
    /// Owned bodies that were removed.
    gone: FxHashSet<GlobalId>,
    added: Vec<Body>,
    /// How many of these left again.
    left: usize,
}

impl Changes {
    /// Those that came and are still there.
    fn added(&self) -> impl Iterator<Item = Body> + '_ {
        self.added.iter().copied().filter(|body| body.kind != LEFT)
    }
}

/// The new place of who is gone.
const GONE: u32 = u32::MAX;

/// The kind of those that came and left again: so that others keep their places.
const LEFT: KindId = KindId(u32::MAX);

/// A tile with nothing left to settle.
pub(crate) enum Settled<'a> {
    Itself(&'a Tile),
    Copy(Box<Tile>),
}

impl Deref for Settled<'_> {
    type Target = Tile;

    fn deref(&self) -> &Tile {
        match self {
            Self::Itself(tile) => tile,
            Self::Copy(tile) => tile,
        }
    }
}

impl Tile {
    /// The owned bodies as they are now.
    pub(crate) fn present(&self) -> impl Iterator<Item = Body> + '_ {
        let changes = self.changes.as_deref();
        let stays = move |&index: &usize| changes.is_none_or(|changes| !changes.gone.contains(&self.bodies.id[index]));
        let stayed = (0..self.owned).filter(stays).map(|index| self.bodies.get(index));
        stayed.chain(changes.into_iter().flat_map(Changes::added))
    }

    /// How many these are.
    pub(crate) fn count(&self) -> usize {
        let changed = |changes: &Changes| self.owned - changes.gone.len() + changes.added.len() - changes.left;
        self.changes.as_deref().map_or(self.owned, changed)
    }

    /// The places, among the bodies that came since the last step, of those that are still there.
    pub(crate) fn added(&self) -> impl Iterator<Item = (u32, Body)> + '_ {
        let all = self.changes.iter().flat_map(|changes| (0..).zip(&changes.added));
        all.filter(|(_, body)| body.kind != LEFT).map(|(place, &body)| (place, body))
    }

    /// One of them.
    pub(crate) fn added_at(&self, place: u32) -> Body {
        self.changes.as_deref().expect("somebody came").added[place as usize]
    }

    /// Whether one of the owned bodies is still there.
    pub(crate) fn is_present(&self, id: GlobalId) -> bool {
        self.changes.as_deref().is_none_or(|changes| !changes.gone.contains(&id))
    }

    /// Adds a body, and says where among the [`added`](Self::added) it is.
    pub(crate) fn add(&mut self, body: Body) -> u32 {
        let added = &mut self.changes.get_or_insert_default().added;
        added.push(body);
        added.len() as u32 - 1
    }

    /// Changes one of those that came.
    pub(crate) fn change_added(&mut self, place: u32, change: impl FnOnce(&mut Body)) {
        change(&mut self.changes.as_deref_mut().expect("somebody came").added[place as usize]);
    }

    /// Removes one of those that came.
    pub(crate) fn remove_added(&mut self, place: u32) {
        let changes = self.changes.as_deref_mut().expect("somebody came");
        changes.added[place as usize].kind = LEFT;
        changes.left += 1;
    }

    /// Removes one of the owned bodies, which is there.
    pub(crate) fn remove(&mut self, id: GlobalId) {
        self.changes.get_or_insert_default().gone.insert(id);
    }

    /// Where there was something to settle: a copy in which it is settled, that remembers all that a step depends on.
    pub(crate) fn settled(&self, setup: &Setup) -> Settled<'_> {
        if self.changes.is_none() {
            return Settled::Itself(self);
        }
        let mut copy = Self {
            bodies: self.bodies.clone(),
            owned: self.owned,
            unseen: self.unseen.clone(),
            ghost_owners: self.ghost_owners.clone(),
            contacts: self.contacts.clone(),
            sleep: self.sleep.clone(),
            violation: self.violation,
            changes: self.changes.clone(),
            ..Self::with_statics(self.id, self.statics.clone(), setup)
        };
        copy.settle();
        Settled::Copy(Box::new(copy))
    }

    /// Makes those that came owned bodies, behind all there are, and forgets those that left with their contacts. All others keep
    /// their order, so that it makes no difference how often this is done. Takes time for the tile.
    pub(crate) fn settle(&mut self) {
        let Some(changes) = self.changes.take() else { return };
        let rests = !self.sleep.still().is_empty();
        if rests {
            self.sleep.resize(self.owned);
        }
        let mut owned = self.owned;
        if !changes.gone.is_empty() {
            owned = 0;
            // For each its new place.
            let mut places = Vec::with_capacity(self.owned);
            for id in &self.bodies.id[..self.owned] {
                let stays = !changes.gone.contains(id);
                places.push(if stays { owned as u32 } else { GONE });
                owned += usize::from(stays);
            }
            self.forget_contacts(|slot| matches!(slot.kind(), SlotKind::Owned(index) if places[index] == GONE));
            self.contacts.renumber(|slot| match slot.kind() {
                SlotKind::Owned(index) => Slot::from_index(places[index] as usize, usize::MAX, 0),
                _ => slot,
            });
            let stays = |index: usize| places.get(index) != Some(&GONE);
            self.bodies.retain(stays);
            self.sleep.retain(stays);
        }
        // Ghosts and statics of the last step stand behind the owned bodies.
        let added: Vec<Body> = changes.added().collect();
        self.bodies.replace(owned..owned, &added);
        self.owned = owned + added.len();
        if rests {
            self.sleep.resize(self.owned);
        }
        self.newcomers.clear();
        self.rim.is_known = false;
    }

    /// Forgets the contacts with some bodies; whatever rests on one of them wakes.
    pub(crate) fn forget_contacts(&mut self, with: impl Fn(Slot) -> bool) {
        let forgets = |key: PairKey| with(key.low()) || with(key.high());
        if !self.sleep.still().is_empty() {
            for key in self.contacts.keys.iter().filter(|key| forgets(**key)) {
                for slot in [key.low(), key.high()] {
                    if let SlotKind::Owned(index) = slot.kind() {
                        self.sleep.wake(index);
                    }
                }
            }
        }
        self.contacts.retain(|key| !forgets(key));
    }

    /// Goes on with a setup that has more kinds: statics are of other rows, and where the halo became wider more of them matter.
    pub(crate) fn follow_kinds(&mut self, setup: &Setup) {
        let statics = setup.statics_of(self.id);
        let before = std::mem::replace(&mut self.statics, statics);
        // None of those before is missing.
        self.contacts.renumber(|slot| match slot.kind() {
            SlotKind::Static(number) => {
                let place = self.statics.partition_point(|&row| row < before[number]);
                Slot::from_index(place, 0, 0)
            }
            _ => slot,
        });
        if !self.bodies.is_empty() {
            self.bodies.truncate(self.owned + self.ghosts());
            // Where they are the next step tells.
            self.push_statics(setup, 0);
        }
        self.interior = self.region.shrunk(setup.inset);
        self.rim.is_known = false;
    }

    /// Forgets the contacts with the ghost of that name, if there is one.
    pub(crate) fn forget_ghost(&mut self, id: GlobalId) {
        let ghosts = &self.bodies.id[self.owned..self.owned + self.ghosts()];
        if let Some(ghost) = ghosts.iter().position(|&name| name == id) {
            self.forget_contacts(|slot| matches!(slot.kind(), SlotKind::Ghost(number) if number == ghost));
        }
    }
}
