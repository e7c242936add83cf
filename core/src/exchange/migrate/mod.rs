//! The first sync point: bodies change owner, and ghosts are made anew.
//!
//! The old owner does all the sending: it locates each body's owner anew, sends those that left with their contacts,
//! and sends every body's ghosts on the new owner's behalf. So one exchange suffices, and a receiver needs to know
//! nothing but the body: whose it is follows from where it is.

use crate::exchange::mail::{Mail, Mailbag};
use crate::exchange::overlap::Outline;
use crate::exchange::record::{ContactRecord, GhostRecord, Unseen};
use crate::exchange::rim::Rim;
use crate::model::contact::{Authority, PairKey, Slot, SlotKind, Stray};
use crate::model::id::{GlobalId, TileId};
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

#[cfg(test)]
mod tests;

/// Buffers of [`send`] and [`receive`], shared by all tiles of a thread.
#[derive(Default, Debug)]
pub(crate) struct MigrateWork {
    /// For every owned body 0, or one more than its place in `border`; all zero between calls.
    mark: Vec<u32>,
    border: Vec<Border>,
    sends: Vec<Send>,
    /// Contacts of bodies that leave, each with the tile that gets it.
    contacts: Vec<(TileId, ContactRecord)>,
    /// What is sent, by destination.
    parcels: Vec<Parcel>,
    departures: Vec<u32>,
    arrivals: Vec<crate::Body>,
    /// Owner, name, and where the record lies: message, place.
    ghosts: Vec<(TileId, GlobalId, u32, u32)>,
}

/// An owned body that may concern other tiles.
#[derive(Debug)]
struct Border {
    /// Among those of the rim.
    rim: u32,
    /// The tile that owns it from now on.
    owner: TileId,
    /// Its part of `sends`.
    first_send: u32,
    end_send: u32,
}

/// A ghost to be sent.
#[derive(Debug)]
struct Send {
    /// Whose, among the bodies of the rim.
    rim: u32,
    target: TileId,
    /// Whether it is near enough to the target that its contacts with others that are so are solved there as well.
    near: bool,
    unseen: Unseen,
}

/// Something to be sent, and where to. Sorts by destination.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Parcel {
    to: TileId,
    what: What,
}

/// An index into the bodies of the tile's rim, `contacts` or `sends`.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum What {
    Migrant(u32),
    Contact(u32),
    Ghost(u32),
}

/// Writes everything other tiles must hear from this one, and takes leave of what is no longer owned here. After this
/// the tile holds owned bodies only, and its cache only contacts among them and with statics.
pub(crate) fn send(tile: &mut Tile, bag: &mut Mailbag, work: &mut MigrateWork, setup: &Setup) {
    find_border(tile, work, setup);
    sort_contacts_out(tile, work, setup);
    let MigrateWork { mark, border, sends, contacts, parcels, departures, .. } = work;
    tile.counts.ghosts = sends.len() as u64;
    parcels.extend((0..).zip(&*sends).map(|(i, send)| Parcel { to: send.target, what: What::Ghost(i) }));
    parcels.extend((0..).zip(&*contacts).map(|(i, &(to, _))| Parcel { to, what: What::Contact(i) }));
    let rim = &tile.rim.bodies;
    for Border { rim: place, owner, .. } in border.drain(..) {
        let index = rim[place as usize].index;
        mark[index as usize] = 0;
        if owner != tile.id {
            departures.push(index);
            tile.counts.leaps += u64::from(!setup.grid.are_neighbours(tile.id, owner));
            parcels.push(Parcel { to: owner, what: What::Migrant(place) });
        }
    }
    parcels.sort_unstable();
    for Parcel { to, what } in parcels.drain(..) {
        bag.address(tile.id, to);
        match what {
            What::Migrant(place) => bag.migrants.push(rim[place as usize].body),
            What::Contact(contact) => bag.contacts.push(contacts[contact as usize].1),
            What::Ghost(send) => {
                let Send { rim: place, unseen, .. } = sends[send as usize];
                bag.ghosts.push(GhostRecord { body: rim[place as usize].body, unseen, padding: 0 });
            }
        }
    }
    sends.clear();
    contacts.clear();
    tile.bodies.truncate(tile.owned);
    tile.unseen.clear();
    tile.ghost_owners.clear();
    if !departures.is_empty() {
        tile.bodies.remove_sorted(departures);
        tile.owned -= departures.len();
        close_gaps(&mut tile.contacts.keys, departures);
        departures.clear();
    }
}

/// Finds the bodies near or beyond the tile's border, their owners, and who needs a ghost of them.
fn find_border(tile: &mut Tile, work: &mut MigrateWork, setup: &Setup) {
    if work.mark.len() < tile.owned {
        work.mark.resize(tile.owned, 0);
    }
    Rim::find(tile, setup);
    tile.rim.is_known = false;
    let grid = &setup.grid;
    for (place, rim) in (0..).zip(&tile.rim.bodies) {
        let (position, goes_far) = (rim.body.position, setup.goes_far(rim.body.velocity));
        tile.counts.far |= goes_far;
        let (owner, outline) = (grid.locate(position), Outline::of_rim(rim));
        let first_send = work.sends.len() as u32;
        for target in grid.reached(position, rim.half, setup.halo_width).filter(|&target| target != owner) {
            let near = outline.is_near(target, setup);
            work.sends.push(Send { rim: place, target, near, unseen: Unseen::default() });
        }
        let end_send = work.sends.len() as u32;
        if owner != tile.id || end_send > first_send {
            work.border.push(Border { rim: place, owner, first_send, end_send });
            work.mark[rim.index as usize] = work.border.len() as u32;
        }
    }
}

/// One pass over the contacts of the last step: sums unseen impulses, finds the contacts of departing bodies, and
/// moves those that cannot be found by slot any more to the strays.
fn sort_contacts_out(tile: &mut Tile, work: &mut MigrateWork, setup: &Setup) {
    tile.strays.clear();
    let mut kept = 0;
    for i in 0..tile.contacts.len() {
        let key = tile.contacts.keys[i];
        let SlotKind::Owned(low) = key.low().kind() else {
            // Of others; they tell each other. Here it serves those who solve it with them.
            let (pair, contact) = (tile.pair_of(key), tile.contacts.contacts[i]);
            tile.strays.push(Stray { pair, authority: Authority::Overlap, contact });
            continue;
        };
        let (high_mark, high_owner) = match key.high().kind() {
            SlotKind::Owned(high) => (work.mark[high], Some(tile.id)),
            SlotKind::Ghost(ghost) => (0, Some(tile.ghost_owners[ghost])),
            SlotKind::Static(_) => (0, None),
        };
        let low_mark = work.mark[low];
        let with_ghost = high_owner.is_some_and(|owner| owner != tile.id);
        let mut stray = with_ghost;
        if low_mark | high_mark != 0 || with_ghost {
            let contact = tile.contacts.contacts[i];
            let pair = tile.pair_of(key);
            let low_is_a = tile.bodies.id[low] == pair.0;
            let (linear, on_a, on_b) = contact.impulse();
            let mut heir = tile.id;
            let sides =
                [(low_mark, low_is_a, high_owner, key.high()), (high_mark, !low_is_a, Some(tile.id), key.low())];
            for (mark, is_a, owner, partner) in sides {
                if mark == 0 {
                    continue;
                }
                let border = &work.border[mark as usize - 1];
                // A ghost is judged by where it was: what comes of it is put right with the first refresh.
                let outline = owner.map(|_| Outline::of(tile, tile.index(partner), setup));
                let is_near = |target| outline.is_none_or(|outline| outline.is_near(target, setup));
                for send in &mut work.sends[border.first_send as usize..border.end_send as usize] {
                    let is_seen = owner == Some(send.target) || send.near && is_near(send.target);
                    if !is_seen {
                        if is_a {
                            send.unseen.add(-linear, on_a);
                        } else {
                            send.unseen.add(linear, on_b);
                        }
                    }
                }
                // Both bodies may leave for one tile: one record is enough.
                if border.owner != tile.id && border.owner != heir {
                    heir = border.owner;
                    let owned_low = low_is_a || !with_ghost;
                    let from_owner_of_low = u64::from(owned_low);
                    let record = ContactRecord { low: pair.0, high: pair.1, from_owner_of_low, contact };
                    work.contacts.push((heir, record));
                }
                stray |= border.owner != tile.id;
            }
            if stray {
                tile.strays.push(Stray { pair, authority: Authority::Own, contact });
            }
        }
        if !stray {
            if kept < i {
                tile.contacts.keys[kept] = key;
                tile.contacts.contacts[kept] = tile.contacts.contacts[i];
            }
            kept += 1;
        }
    }
    tile.contacts.keys.truncate(kept);
    tile.contacts.contacts.truncate(kept);
}

/// Renames the owned slots after the bodies at the given ascending indices were removed. Keeps the order of the keys.
fn close_gaps(keys: &mut [PairKey], gone: &[u32]) {
    let moved = |slot: Slot| match slot.kind() {
        SlotKind::Owned(i) => {
            let before = gone.partition_point(|&g| (g as usize) < i);
            Slot::from_index(i - before, usize::MAX, 0)
        }
        _ => slot,
    };
    for key in keys {
        *key = PairKey::new(moved(key.low()), moved(key.high()));
    }
}

/// Takes in what other tiles sent: arrivals, ghosts, contacts. Sorts the bodies by place when it is time to. A tile that
/// owns nothing solves nothing, and keeps no ghosts.
pub(crate) fn receive(tile: &mut Tile, mail: Mail<'_>, work: &mut MigrateWork, setup: &Setup, step: u64) {
    tile.arrived = tile.owned;
    for message in mail.messages() {
        work.arrivals.clear();
        work.arrivals.extend_from_slice(message.migrants);
        work.arrivals.sort_unstable_by_key(|body| body.id);
        for &body in &work.arrivals {
            tile.bodies.push(body);
        }
        for record in message.contacts {
            let authority = if record.from_owner_of_low != 0 { Authority::ForeignOwner } else { Authority::Foreign };
            let pair = (record.low, record.high);
            tile.strays.push(Stray { pair, authority, contact: record.contact });
        }
    }
    tile.owned = tile.bodies.len();
    tile.counts.migrations = (tile.owned - tile.arrived) as u64;
    tile.strays.settle();
    if tile.is_idle() {
        return tile.lay_bare();
    }
    if step.is_multiple_of(u64::from(setup.params.sort_interval)) {
        sort_by_place(tile, setup);
    }

    work.ghosts.clear();
    for (m, message) in (0..).zip(mail.messages()) {
        let owner = |ghost: &GhostRecord| setup.grid.locate(ghost.body.position);
        work.ghosts.extend((0..).zip(message.ghosts).map(|(g, ghost)| (owner(ghost), ghost.body.id, m, g)));
    }
    work.ghosts.sort_unstable();
    for &(owner, _, m, g) in &work.ghosts {
        let ghost = &mail.message(m as usize).ghosts[g as usize];
        tile.bodies.push(ghost.body);
        tile.unseen.push(ghost.unseen);
        tile.ghost_owners.push(owner);
    }
    tile.push_statics(setup);
}

/// Sorts the owned bodies by (cell, GlobalId), so that neighbours in space are neighbours in memory.
fn sort_by_place(tile: &mut Tile, setup: &Setup) {
    let per_meter = 1.0 / setup.halo_width;
    let cell = |v: f64, corner: f64| ((v - corner) * per_meter).floor() as i32;
    let mut order: Vec<_> = (0..tile.owned)
        .map(|i| {
            let position = tile.bodies.position[i];
            let (row, column) = (cell(position.y, tile.corner.y), cell(position.x, tile.corner.x));
            (row, column, tile.bodies.id[i], i as u32)
        })
        .collect();
    if order.is_sorted() {
        return;
    }
    order.sort_unstable();
    let order: Vec<u32> = order.into_iter().map(|(.., from)| from).collect();
    tile.bodies.permute(&order);
    tile.sleep.permute(&order);
    let mut new_place = vec![0; order.len()];
    for (to, &from) in (0..).zip(&order) {
        new_place[from as usize] = to;
    }
    tile.contacts.rename(|slot| match slot.kind() {
        SlotKind::Owned(i) => Slot::from_index(new_place[i] as usize, usize::MAX, 0),
        _ => slot,
    });
    // The arrivals are anywhere now: every pair may have its contact among the strays.
    tile.arrived = 0;
}
