//! The sync points within a step, for `exchange = "substep"`: ghosts are refreshed after every substep, and what both
//! owners of a border contact found is averaged once at the end.
//!
//! Who hears what follows from the border contacts alone. Both owners of a contact hold it, made from the same bits,
//! so the bodies that one side sends are exactly those the other expects, in the order of its ghost list.

use crate::collide::narrow_phase::Contacts;
use crate::exchange::mail::{Mail, Mailbag};
use crate::exchange::record::{BorderImpulse, BorderPoint, GhostRefresh, Unseen};
use crate::model::contact::{Contact, ContactPoint, SlotKind};
use crate::model::id::{GlobalId, TileId};
use crate::solver::Solver;
use crate::tiling::tile::{Fault, Tile};

#[cfg(test)]
mod tests;

/// The border contacts of a tile and who must hear of them; made once a step.
#[derive(Default, Debug)]
pub(crate) struct Border {
    /// Owned bodies in contact with ghosts, once for each tile these belong to; sorted.
    sends: Vec<Outgoing>,
    /// What adds to a sent body's unseen impulse.
    feeds: Vec<Feed>,
    /// Ghosts in contact, sorted by (owner, GlobalId), which is the order of ghosts.
    ghosts: Vec<u32>,
    /// Border contacts by the names of their bodies, sorted.
    contacts: Vec<BorderContact>,
    /// Places in `sends` in the order they are sent: by peer, and for each as its ghosts are ordered.
    send_order: Vec<u32>,
    /// Places in `contacts` in the order they are sent: by peer.
    contact_order: Vec<u32>,
    /// For every owned body the range of its `sends`; all empty between steps.
    sends_of: Vec<(u32, u32)>,
}

/// An owned body that another tile has as a ghost in a contact.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Outgoing {
    /// Before the peer, so that the sends of one body are neighbours while they are collected.
    body: u32,
    peer: TileId,
}

/// A contact that counts as unseen for a sent body.
#[derive(Debug)]
struct Feed {
    send: u32,
    contact: u32,
    upon_a: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct BorderContact {
    pair: (GlobalId, GlobalId),
    contact: u32,
    peer: TileId,
    /// Whether this tile owns body A; it then does not own body B.
    owns_a: bool,
}

impl Border {
    /// Finds the border contacts of the step.
    pub(crate) fn find(&mut self, tile: &Tile, contacts: &Contacts) {
        self.sends.clear();
        self.feeds.clear();
        self.ghosts.clear();
        self.contacts.clear();
        for (i, &key) in (0..).zip(&contacts.cache.keys) {
            if let SlotKind::Ghost(ghost) = key.high().kind() {
                let (low, peer) = (tile.index(key.low()) as u32, tile.ghost_owners[ghost]);
                let pair = tile.pair_of(key);
                self.sends.push(Outgoing { body: low, peer });
                self.ghosts.push(ghost as u32);
                let owns_a = tile.bodies.id[low as usize] == pair.0;
                self.contacts.push(BorderContact { pair, contact: i, peer, owns_a });
            }
        }
        self.sends.sort_unstable();
        self.sends.dedup();
        self.ghosts.sort_unstable();
        self.ghosts.dedup();
        self.contacts.sort_unstable();
        let Self { sends, contacts: by_pair, send_order, contact_order, .. } = self;
        send_order.clear();
        send_order.extend(0..sends.len() as u32);
        send_order.sort_unstable_by_key(|&i| {
            let Outgoing { body, peer } = sends[i as usize];
            (peer, tile.bodies.id[body as usize])
        });
        contact_order.clear();
        contact_order.extend(0..by_pair.len() as u32);
        contact_order.sort_unstable_by_key(|&i| (by_pair[i as usize].peer, i));
        self.find_feeds(tile, contacts);
    }

    fn find_feeds(&mut self, tile: &Tile, contacts: &Contacts) {
        if self.sends.is_empty() {
            return;
        }
        self.sends_of.clear();
        self.sends_of.resize(tile.owned, (0, 0));
        for (i, send) in (0..).zip(&self.sends) {
            let range = &mut self.sends_of[send.body as usize];
            if range.0 == range.1 {
                range.0 = i;
            }
            range.1 = i + 1;
        }
        for (contact, &key) in (0..).zip(&contacts.cache.keys) {
            for (body, partner) in [(key.low(), key.high()), (key.high(), key.low())] {
                let SlotKind::Owned(body) = body.kind() else { continue };
                let owner = owner_of(tile, partner);
                let upon_a = contacts.bodies[contact as usize][0] == body as u32;
                let (first, end) = self.sends_of[body];
                for send in (first..end).filter(|&send| owner != Some(self.sends[send as usize].peer)) {
                    self.feeds.push(Feed { send, contact, upon_a });
                }
            }
        }
    }

    /// Tells every peer the state of its ghosts.
    pub(crate) fn send_refresh(&self, tile: &Tile, solver: &Solver, contacts: &Contacts, bag: &mut Mailbag) {
        let mut unseen = vec![Unseen::default(); self.sends.len()];
        for feed in &self.feeds {
            let (linear, on_a, on_b) = solver.current(contacts, feed.contact).impulse();
            let unseen = &mut unseen[feed.send as usize];
            if feed.upon_a {
                unseen.add(-linear, on_a);
            } else {
                unseen.add(linear, on_b);
            }
        }
        for &i in &self.send_order {
            let Outgoing { body, peer } = self.sends[i as usize];
            let (velocity, pose) = solver.bodies.state_of(body);
            bag.address(tile.id, peer);
            bag.refreshes.push(GhostRefresh { velocity, pose, unseen: unseen[i as usize] });
        }
    }

    /// Takes over the owners' state of the ghosts in contact.
    pub(crate) fn refresh(&self, tile: &mut Tile, solver: &mut Solver, mail: Mail<'_>) {
        let mut ghosts = self.ghosts.iter().peekable();
        for message in mail.messages() {
            for refresh in message.refreshes {
                let of_peer = |ghost: &&u32| tile.ghost_owners[**ghost as usize] == message.from;
                match ghosts.next_if(of_peer) {
                    Some(&ghost) => solver.bodies.refresh(tile.owned + ghost as usize, refresh),
                    None => tile.counts.fault = Some(Fault::Protocol),
                }
            }
        }
        if ghosts.next().is_some() {
            tile.counts.fault = Some(Fault::Protocol);
        }
        for border in &self.contacts {
            solver.refresh_separation(border.contact);
        }
    }

    /// Tells every peer what this tile's copies of their common contacts did in the whole step.
    pub(crate) fn send_impulses(&self, tile: &Tile, solver: &Solver, contacts: &Contacts, bag: &mut Mailbag) {
        for &i in &self.contact_order {
            let border = &self.contacts[i as usize];
            let (low, high) = border.pair;
            let points = solver.border_points(contacts, border.contact);
            bag.address(tile.id, border.peer);
            bag.impulses.push(BorderImpulse { low, high, points });
        }
    }

    /// Moves both copies of every border contact to their mean. Points that only one side has are left alone.
    pub(crate) fn average(&self, tile: &mut Tile, solver: &mut Solver, contacts: &Contacts, mail: Mail<'_>) {
        for impulse in mail.messages().flat_map(|message| message.impulses) {
            let pair = (impulse.low, impulse.high);
            match self.contacts.binary_search_by_key(&pair, |border| border.pair) {
                Ok(i) => {
                    let border = &self.contacts[i];
                    for theirs in impulse.points.iter().filter(|point| point.feature != ContactPoint::ABSENT) {
                        solver.move_to_mean(contacts, border.contact, border.owns_a, theirs);
                    }
                }
                Err(_) => tile.counts.fault = Some(Fault::Protocol),
            }
        }
    }
}

/// The tile that owns a body; none owns a static.
fn owner_of(tile: &Tile, slot: crate::model::contact::Slot) -> Option<TileId> {
    match slot.kind() {
        SlotKind::Owned(_) => Some(tile.id),
        SlotKind::Ghost(ghost) => Some(tile.ghost_owners[ghost]),
        SlotKind::Static(_) => None,
    }
}

impl Solver {
    /// A contact with the impulses it has at this moment.
    fn current(&self, contacts: &Contacts, contact: u32) -> Contact {
        let mut current = contacts.cache.contacts[contact as usize];
        let count = current.point_count();
        for (k, point) in current.points[..count].iter_mut().enumerate() {
            let now = self.groups.point(contact, k);
            (point.normal_impulse, point.tangent_impulse) = (now.normal, now.tangent);
        }
        current
    }

    fn border_points(&self, contacts: &Contacts, contact: u32) -> [BorderPoint; 2] {
        let points = &contacts.cache.contacts[contact as usize].points;
        let count = contacts.cache.contacts[contact as usize].point_count();
        std::array::from_fn(|k| {
            let now = if k < count { self.groups.point(contact, k) } else { BorderPoint::NONE };
            BorderPoint { feature: points[k].feature, ..now }
        })
    }

    fn move_to_mean(&mut self, contacts: &Contacts, contact: u32, owns_a: bool, theirs: &BorderPoint) {
        let points = contacts.cache.contacts[contact as usize].points();
        if let Some(k) = points.iter().position(|point| point.feature == theirs.feature) {
            let mine = self.groups.point(contact, k);
            let mean = |a: f32, b: f32| 0.5 * (a + b);
            let normal = mean(mine.total_normal, theirs.total_normal) - mine.total_normal;
            let tangent = mean(mine.total_tangent, theirs.total_tangent) - mine.total_tangent;
            self.apply_impulse(contact, k, owns_a, normal, tangent);
            self.groups.set_impulses(contact, k, mean(mine.normal, theirs.normal), mean(mine.tangent, theirs.tangent));
        }
    }
}
