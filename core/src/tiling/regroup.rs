//! Tiles that are cut, or joined: the same bodies and contacts, dealt out to others.
//!
//! A body goes to the tile that has its place; what has left its old tile since the last step, to the part next to it, and from
//! there on as it would have. Contacts are dealt out as if their tiles had always been these: to the owners of their bodies, and
//! to who is near to both.

use super::blueprint::Setup;
use super::partition::{Change, Partition};
use super::tile::Tile;
use crate::exchange::overlap::Outline;
use crate::exchange::record::Unseen;
use crate::model::body::Body;
use crate::model::contact::{Contact, ContactCache, PairKey, Slot, SlotKind};
use crate::model::id::{GlobalId, TileId};
use glam::DVec2;
use std::ops::Range;

/// What tiles of one partition are called in the next.
pub(crate) struct Renaming<'a> {
    old: &'a Partition,
    new: &'a Partition,
    /// By old tile: its new name, if it stays as it is.
    names: Vec<Option<TileId>>,
}

impl<'a> Renaming<'a> {
    pub(crate) fn new(old: &'a Partition, new: &'a Partition, changes: &[Change]) -> Self {
        let mut names = vec![None; old.tiles()];
        for change in changes.iter().filter(|change| change.is_none()) {
            names[change.old.start as usize] = Some(TileId(change.new.start));
        }
        Self { old, new, names }
    }

    /// Gives a tile its new name if nothing else changes for it; says whether that is so.
    pub(crate) fn rename(&self, tile: &mut Tile) -> bool {
        let name = |tile: TileId| self.names[tile.0 as usize];
        let Some(id) = name(tile.id) else { return false };
        if tile.ghost_owners.iter().any(|&owner| name(owner).is_none()) {
            return false;
        }
        tile.id = id;
        tile.standstill = None;
        for owner in &mut tile.ghost_owners {
            *owner = name(*owner).unwrap_or(*owner);
        }
        true
    }

    /// Who owns from now on what a tile owned at some place.
    fn heir(&self, tile: TileId, place: DVec2) -> TileId {
        let located = || self.new.locate(self.old.region(tile).nearest(place));
        self.names[tile.0 as usize].unwrap_or_else(located)
    }
}

/// Where a body of an old tile is from now on.
#[derive(Clone, Copy)]
struct Home {
    owner: TileId,
    /// Among the owner's bodies, if that is one of the new tiles.
    index: u32,
}

/// How much what an old tile remembers of a contact counts, where several do: as when a body changes its owner.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Authority {
    /// It owned neither body.
    Scratch,
    /// It did not own body A.
    Owner,
    /// It did.
    OwnerOfA,
}

/// A contact on its way to a new tile.
struct Entry {
    pair: (GlobalId, GlobalId),
    authority: Authority,
    low: End,
    high: End,
    contact: Contact,
}

/// A body of an [`Entry`], as the new tile sees it.
#[derive(Clone, Copy)]
enum End {
    Owned(u32),
    Ghost(TileId, GlobalId),
    Static(u32),
}

/// A new tile, and what it is to remember.
struct Target {
    tile: Tile,
    entries: Vec<Entry>,
    ghosts: Vec<(TileId, Body)>,
}

/// What becomes of tiles that are cut or joined: tiles of these names.
pub(crate) fn regroup(sources: &[Tile], names: Range<u32>, renaming: &Renaming<'_>, setup: &Setup) -> Vec<Tile> {
    let first = names.start;
    let mut targets: Vec<Target> = names
        .clone()
        .map(|id| Target { tile: Tile::new(TileId(id), setup), entries: Vec::new(), ghosts: Vec::new() })
        .collect();
    let mut homes: Vec<Vec<Home>> = Vec::with_capacity(sources.len());
    let mut by_name: Vec<(GlobalId, Home)> = Vec::new();
    for source in sources {
        let settle = |i: usize| {
            let owner = renaming.heir(source.id, source.bodies.position[i]);
            let Tile { bodies, sleep, .. } = &mut targets[(owner.0 - first) as usize].tile;
            if setup.params.sleep {
                sleep.set(bodies.len(), source.rested(i));
            }
            bodies.push(source.bodies.get(i));
            Home { owner, index: bodies.len() as u32 - 1 }
        };
        homes.push((0..source.owned).map(settle).collect());
        if sources.len() > 1 {
            by_name.extend(source.bodies.id.iter().copied().zip(homes[homes.len() - 1].iter().copied()));
        }
    }
    by_name.sort_unstable_by_key(|(id, _)| *id);
    for (source, homes) in sources.iter().zip(&mut homes) {
        for (ghost, &owner) in (source.owned..).zip(&source.ghost_owners) {
            let (id, place) = (source.bodies.id[ghost], source.bodies.position[ghost]);
            let known = by_name.binary_search_by_key(&id, |(id, _)| *id);
            homes.push(known.map_or_else(|_| Home { owner: renaming.heir(owner, place), index: 0 }, |i| by_name[i].1));
        }
        deal(source, homes, &mut targets, setup);
    }
    let bodies: usize = sources.iter().map(|source| source.owned).sum();
    let booked = sources.iter().map(|source| source.booked).sum::<std::time::Duration>();
    let finish = |target: Target| {
        let mut tile = target.finish(setup);
        tile.booked = booked.mul_f64(tile.owned as f64 / bodies.max(1) as f64);
        tile
    };
    targets.into_iter().map(finish).collect()
}

/// Deals out the contacts of an old tile.
fn deal(source: &Tile, homes: &[Home], targets: &mut [Target], setup: &Setup) {
    for (key, contact) in source.contacts.iter() {
        let pair = source.pair_of(key);
        let slots = [key.low(), key.high()];
        let indices = slots.map(|slot| source.index(slot));
        let home = |side: usize| homes.get(indices[side]);
        let authority = match (key.is_own(), key.is_border()) {
            (false, _) => Authority::Scratch,
            (true, true) if source.bodies.id[indices[0]] != pair.0 => Authority::Owner,
            _ => Authority::OwnerOfA,
        };
        for target in targets.iter_mut() {
            let id = target.tile.id;
            let owns = (0..2).any(|side| home(side).is_some_and(|home| home.owner == id));
            let is_near =
                |side: usize| home(side).is_none() || Outline::of(source, indices[side], setup).is_near(id, setup);
            let authority = match (owns, authority) {
                // Who owned one of its bodies knows better.
                (true, Authority::Scratch) => continue,
                (true, authority) => authority,
                (false, _) if (0..2).all(is_near) => Authority::Scratch,
                (false, _) => continue,
            };
            let [low, high] = [0, 1].map(|side| match (home(side), slots[side].kind()) {
                (Some(home), _) if home.owner == id => End::Owned(home.index),
                (Some(home), _) => {
                    target.ghosts.push((home.owner, source.bodies.get(indices[side])));
                    End::Ghost(home.owner, source.bodies.id[indices[side]])
                }
                (None, SlotKind::Static(i)) => End::Static(source.statics[i]),
                (None, _) => unreachable!("every body that moves has a home"),
            });
            target.entries.push(Entry { pair, authority, low, high, contact: *contact });
        }
    }
}

impl Target {
    /// The tile, with ghosts, statics and contacts as a step leaves them.
    fn finish(self, setup: &Setup) -> Tile {
        let Self { mut tile, mut entries, mut ghosts } = self;
        tile.owned = tile.bodies.len();
        if tile.is_idle() {
            return tile;
        }
        ghosts.sort_unstable_by_key(|(owner, body)| (*owner, body.id));
        ghosts.dedup_by_key(|(owner, body)| (*owner, body.id));
        for &(owner, body) in &ghosts {
            tile.bodies.push(body);
            tile.ghost_owners.push(owner);
        }
        tile.unseen = vec![Unseen::default(); ghosts.len()];
        // Where they are the next step tells.
        tile.push_statics(setup, 0);
        let name = |entry: &Entry| (entry.pair, entry.contact.pieces());
        entries.sort_unstable_by(|a, b| name(a).cmp(&name(b)).then(b.authority.cmp(&a.authority)));
        entries.dedup_by_key(|entry| name(entry));
        let (owned, ghost_count) = (tile.owned, ghosts.len());
        let slot = |end: End| {
            let index = match end {
                End::Owned(index) => index as usize,
                End::Ghost(owner, id) => {
                    let place = ghosts.binary_search_by_key(&(owner, id), |(owner, body)| (*owner, body.id));
                    owned + place.expect("the ghosts of all contacts are there")
                }
                // What only lay on somebody's way is forgotten.
                End::Static(row) => owned + ghost_count + tile.statics.binary_search(&row).ok()?,
            };
            Some(Slot::from_index(index, owned, ghost_count))
        };
        let mut contacts: Vec<(PairKey, Contact)> = entries
            .iter()
            .filter_map(|entry| {
                let (a, b) = (slot(entry.low)?, slot(entry.high)?);
                Some((if a < b { PairKey::new(a, b) } else { PairKey::new(b, a) }, entry.contact))
            })
            .collect();
        contacts.sort_unstable_by_key(|(key, contact)| (*key, contact.pieces()));
        let (keys, contacts) = contacts.into_iter().unzip();
        tile.contacts = ContactCache { keys, contacts };
        tile
    }
}
