//! Bodies that come to a tile or leave it between two steps because somebody asked for it. They are noted at once and settled
//! before the tile is stepped, all together, so that one of many costs next to nothing.

use super::blueprint::Setup;
use super::statics::Near;
use super::tile::Tile;
use crate::model::body::Body;
use crate::model::contact::{Slot, SlotKind};
use crate::model::id::{GlobalId, KindId};
use rustc_hash::FxHashSet;
use std::ops::Deref;

/// What is not settled yet.
#[derive(Clone, Default, Debug)]
pub(crate) struct Changes {
    /// Owned bodies that were removed.
    gone: Vec<GlobalId>,
    added: Vec<Body>,
    /// How many of these left again.
    left: usize,
}

impl Changes {
    /// Those that came and are still there.
    fn added(&self) -> impl Iterator<Item = Body> + '_ {
        self.added.iter().copied().filter(|body| body.kind != LEFT)
    }

    /// Tells of an owned body whether it was removed.
    fn is_gone(&self) -> impl Fn(GlobalId) -> bool + use<> {
        let gone: FxHashSet<GlobalId> = self.gone.iter().copied().collect();
        move |id| gone.contains(&id)
    }
}

/// The new place of who is gone.
const GONE: u32 = u32::MAX;

/// Who is so few places nearer to the first than he was is found as fast.
const NEAR: usize = 64;

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
    /// The owned bodies as they are now, each with its place: those that came since the last step stand behind all that were there.
    pub(crate) fn present(&self) -> impl Iterator<Item = (u32, Body)> + '_ {
        let changes = self.changes.as_deref();
        let is_gone = changes.filter(|changes| !changes.gone.is_empty()).map(Changes::is_gone);
        let stays = move |&index: &usize| is_gone.as_ref().is_none_or(|is_gone| !is_gone(self.bodies.id[index]));
        let stayed = (0..self.owned).filter(stays).map(|index| (index as u32, self.bodies.get(index)));
        let added = (self.owned as u32..).zip(changes.into_iter().flat_map(|changes| &changes.added));
        stayed.chain(added.filter(|(_, body)| body.kind != LEFT).map(|(place, &body)| (place, body)))
    }

    /// How many these are.
    pub(crate) fn count(&self) -> usize {
        let changed = |changes: &Changes| self.owned - changes.gone.len() + changes.added.len() - changes.left;
        self.changes.as_deref().map_or(self.owned, changed)
    }

    /// The place of one of them, who is there, if it has not left for another tile: it is sought where it was last seen; then, as
    /// others may have left, a little before; elsewhere last of all.
    pub(crate) fn find(&self, id: GlobalId, was: u32) -> Option<u32> {
        let ids = &self.bodies.id[..self.owned];
        if self.came(id, was) || ids.get(was as usize) == Some(&id) {
            return Some(was);
        }
        let (before, after) = ids.split_at((was as usize).min(self.owned));
        let found = before.iter().rposition(|&name| name == id);
        let index = found.or_else(|| Some(before.len() + after.iter().position(|&name| name == id)?))?;
        Some(index as u32)
    }

    /// Whether that is the place of one that came since the last step.
    fn came(&self, id: GlobalId, place: u32) -> bool {
        let place = (place as usize).checked_sub(self.owned);
        place.and_then(|place| self.added_at(place)).is_some_and(|body| body.id == id && body.kind != LEFT)
    }

    /// The one at a place.
    pub(crate) fn at(&self, place: u32) -> Body {
        match (place as usize).checked_sub(self.owned) {
            None => self.bodies.get(place as usize),
            Some(place) => *self.added_at(place).expect("somebody came"),
        }
    }

    /// Puts another of its name in its place; it wakes.
    pub(crate) fn change_at(&mut self, place: u32, body: Body) {
        match (place as usize).checked_sub(self.owned) {
            None => {
                self.bodies.set(place as usize, body);
                self.sleep.wake(place as usize);
                self.rim.is_known = false;
            }
            Some(place) => self.changes.as_deref_mut().expect("somebody came").added[place] = body,
        }
    }

    /// One of those that came since the last step.
    fn added_at(&self, place: usize) -> Option<&Body> {
        self.changes.as_deref()?.added.get(place)
    }

    /// Adds a body, and gives its place.
    pub(crate) fn add(&mut self, body: Body) -> u32 {
        let added = &mut self.changes.get_or_insert_default().added;
        added.push(body);
        (self.owned + added.len()) as u32 - 1
    }

    /// Removes a body that is there, and was last seen at that place.
    pub(crate) fn remove(&mut self, id: GlobalId, was: u32) {
        let came = self.came(id, was);
        let changes = self.changes.get_or_insert_default();
        if came {
            changes.added[was as usize - self.owned].kind = LEFT;
            changes.left += 1;
        } else {
            changes.gone.push(id);
        }
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
            ..self.emptied(setup)
        };
        copy.settle();
        Settled::Copy(Box::new(copy))
    }

    /// Makes those that came owned bodies, behind all there are, and forgets those that left with their contacts. All others keep
    /// their order, so that it makes no difference how often this is done. Takes time for the tile.
    pub(crate) fn settle(&mut self) {
        let Some(changes) = self.changes.take() else { return };
        self.is_rearranged |= changes.gone.len() + changes.left > NEAR;
        let rests = !self.sleep.still().is_empty();
        if rests {
            self.sleep.resize(self.owned);
        }
        let mut owned = self.owned;
        if !changes.gone.is_empty() {
            owned = 0;
            // For each its new place.
            let mut places = Vec::with_capacity(self.owned);
            let is_gone = changes.is_gone();
            for &id in &self.bodies.id[..self.owned] {
                let stays = !is_gone(id);
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
        self.standstill = None;
        self.rim.is_known = false;
    }

    /// Forgets the contacts with some bodies; whatever rests on one of them wakes.
    pub(crate) fn forget_contacts(&mut self, with: impl Fn(Slot) -> bool) {
        self.wake_beside(&with);
        self.contacts.retain(|key| !(with(key.low()) || with(key.high())));
    }

    /// Whatever rests on some bodies wakes.
    fn wake_beside(&mut self, with: impl Fn(Slot) -> bool) {
        if self.sleep.still().is_empty() {
            return;
        }
        for key in self.contacts.keys.iter().filter(|key| with(key.low()) || with(key.high())) {
            for slot in [key.low(), key.high()] {
                if let SlotKind::Owned(index) = slot.kind() {
                    self.sleep.wake(index);
                }
            }
        }
    }

    /// Goes on with a setup that has one dynamic kind more, and as wide a halo as before: the rows of statics' kinds are one further on.
    pub(crate) fn move_kinds_of_statics(&mut self) {
        let dynamic = self.owned + self.ghosts();
        self.bodies.kind.iter_mut().skip(dynamic).for_each(|kind| kind.0 += 1);
    }

    /// Goes on with a setup that has more kinds, and a wider halo: statics are of other rows, and more of them matter.
    pub(crate) fn follow_kinds(&mut self, setup: &Setup) {
        self.reached = setup.statics_of(self.id);
        self.near = Near::default();
        let before = std::mem::replace(&mut self.statics, self.reached.clone());
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
        self.find_interior(setup);
        self.rim.is_known = false;
    }

    /// Forgets the contacts with the ghost of that name, if there is one.
    pub(crate) fn forget_ghost(&mut self, id: GlobalId) {
        if let Some(is_it) = self.ghost(id) {
            self.forget_contacts(is_it);
        }
    }

    /// Whatever rests on the ghost of that name wakes, if there is one.
    pub(crate) fn wake_beside_ghost(&mut self, id: GlobalId) {
        if let Some(is_it) = self.ghost(id) {
            self.wake_beside(is_it);
        }
    }

    /// Tells of a slot whether it is that of the ghost of that name, if there is one.
    fn ghost(&self, id: GlobalId) -> Option<impl Fn(Slot) -> bool + use<>> {
        let ghosts = &self.bodies.id[self.owned..self.owned + self.ghosts()];
        let ghost = ghosts.iter().position(|&name| name == id)?;
        Some(move |slot: Slot| matches!(slot.kind(), SlotKind::Ghost(number) if number == ghost))
    }
}
