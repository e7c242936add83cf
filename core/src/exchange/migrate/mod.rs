//! The first sync point: bodies change owner, and ghosts are made anew.
//!
//! The old owner does all the sending: it locates each body's owner anew, sends those that left with their contacts,
//! and sends every body's ghosts on the new owner's behalf. So one exchange suffices, and a receiver needs to know
//! nothing but the body: whose it is follows from where it is.

mod contacts;
mod place;
mod receive;
#[cfg(test)]
mod tests;

pub(crate) use receive::receive;

use crate::exchange::mail::Mailbag;
use crate::exchange::overlap::Outline;
use crate::exchange::record::{ContactRecord, GhostRecord, MigrantRecord, Unseen};
use crate::exchange::rim::{Rim, RimBody};
use crate::exchange::unseen::GhostNames;
use crate::model::id::TileId;
use crate::tiling::blueprint::Setup;
use crate::tiling::partition::Surroundings;
use crate::tiling::tile::Tile;

/// Buffers of [`send`] and [`receive`], shared by all tiles of a thread.
#[derive(Default, Debug)]
pub(crate) struct MigrateWork {
    /// For every owned body 0, or one more than its place in `border`; and a zero for all that are not owned.
    mark: Vec<u32>,
    border: Vec<Border>,
    sends: Vec<Send>,
    /// Contacts that concern others: places in the tile's.
    concerned: Vec<u32>,
    /// Contacts of bodies that leave, each with the tile that gets it.
    contacts: Vec<(TileId, ContactRecord)>,
    /// What is sent, by destination.
    parcels: Vec<Parcel>,
    /// The tiles around.
    around: Surroundings,
    arrivals: Vec<MigrantRecord>,
    ghosts: receive::Ghosts,
    ghost_names: GhostNames,
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

/// Something to be sent, and where to, in one number that sorts by destination: the tile, what it is, and which of them.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Parcel(u64);

/// What a [`Parcel`] holds, and which: among the bodies of the tile's rim, `contacts` or `sends`.
enum What {
    Migrant(usize),
    Contact(usize),
    Ghost(usize),
}

impl Parcel {
    const CONTACT: u32 = 1 << 30;
    const GHOST: u32 = 1 << 31;

    fn new(to: TileId, what: u32) -> Self {
        Self(u64::from(to.0) << 32 | u64::from(what))
    }

    fn to(self) -> TileId {
        TileId((self.0 >> 32) as u32)
    }

    fn what(self) -> What {
        let what = self.0 as u32;
        if what < Self::CONTACT {
            What::Migrant(what as usize)
        } else if what < Self::GHOST {
            What::Contact((what - Self::CONTACT) as usize)
        } else {
            What::Ghost((what - Self::GHOST) as usize)
        }
    }
}

/// Writes everything other tiles must hear from this one. What is no longer owned here leaves a gap, until the tile has heard of
/// the others; of its contacts those serve on that are between owned bodies that stay, and of those and statics.
pub(crate) fn send(tile: &mut Tile, bag: &mut Mailbag, work: &mut MigrateWork, setup: &Setup) {
    find_border(tile, work, setup);
    contacts::sort_out(tile, work, setup);
    let MigrateWork { border, sends, contacts, parcels, .. } = work;
    tile.counts.ghosts = sends.len() as u64;
    parcels.extend((Parcel::GHOST..).zip(&*sends).map(|(what, send)| Parcel::new(send.target, what)));
    parcels.extend((Parcel::CONTACT..).zip(&*contacts).map(|(what, &(to, _))| Parcel::new(to, what)));
    let rim = &tile.rim.bodies;
    for Border { rim: place, owner, .. } in border.drain(..) {
        if owner != tile.id {
            tile.gaps.push(rim[place as usize].index);
            tile.counts.leaps += u64::from(!setup.partition.are_neighbours(tile.id, owner));
            parcels.push(Parcel::new(owner, place));
        }
    }
    parcels.sort_unstable();
    for parcel in parcels.drain(..) {
        bag.address(tile.id, parcel.to());
        match parcel.what() {
            What::Migrant(place) => {
                let RimBody { body, index, .. } = rim[place];
                bag.migrants.push(MigrantRecord { body, rested: tile.rested(index as usize), padding: 0 });
            }
            What::Contact(contact) => bag.contacts.push(contacts[contact].1),
            What::Ghost(send) => {
                let Send { rim: place, unseen, .. } = sends[send];
                let RimBody { body, index, .. } = rim[place as usize];
                bag.ghosts.push(GhostRecord { body, unseen, rested: tile.rested(index as usize) });
            }
        }
    }
    sends.clear();
    contacts.clear();
}

/// Finds the bodies near or beyond the tile's border, their owners, and who needs a ghost of them.
fn find_border(tile: &mut Tile, work: &mut MigrateWork, setup: &Setup) {
    work.mark.clear();
    work.mark.resize(tile.owned + 1, 0);
    Rim::find(tile, setup);
    tile.rim.is_known = false;
    let partition = &setup.partition;
    work.around.look_around(partition, tile.id, 2.0 * setup.inset(false));
    for (place, rim) in (0..).zip(&tile.rim.bodies) {
        let position = rim.body.position;
        let owner = if tile.region.contains(position) { tile.id } else { partition.locate(position) };
        let outline = Outline::of_rim(rim, setup);
        tile.counts.far |= setup.goes_far(rim.body.velocity)
            || setup.is_large(rim.body.kind) && !outline.is_within_halo_of(owner, setup);
        let first_send = work.sends.len() as u32;
        for target in outline.reached(setup, &work.around).filter(|&target| target != owner) {
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
