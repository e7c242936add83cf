//! The sync points within a step, for `exchange = "substep"`: ghosts are refreshed after every substep, and what both
//! owners of a border contact found is averaged at the end; where something bounces, before and after that.
//!
//! Who hears what follows from contacts and from who is near whom. Both owners of a border contact hold it, made from the same
//! bits, so each hears of the other's body. What a tile solves for others (see [`overlap`](super::overlap)) it may remember
//! otherwise than they do: then it hears of ghosts that it does not solve, or nothing of one that it does, which flies on by
//! itself until the next step.

use crate::collide::narrow_phase::Contacts;
use crate::exchange::far;
use crate::exchange::mail::{Mail, Mailbag};
use crate::exchange::record::{BorderImpulse, BorderPoint, GhostRefresh, Unseen};
use crate::model::contact::{Contact, ContactCache, ContactPoint, PairKey, Slot, SlotKind};
use crate::model::id::{GlobalId, TileId};
use crate::model::math::max;
use crate::solver::Solver;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::{Fault, Tile};
use near::Near;
use settle::Beside;
use std::ops::Range;

mod near;
mod settle;
#[cfg(test)]
mod tests;

/// The border contacts of a tile and who must hear of them; made once a step.
#[derive(Default, Debug)]
pub(crate) struct Border {
    /// Owned bodies in contacts that other tiles solve, once for each of these; sorted.
    sends: Vec<Outgoing>,
    /// Their bodies, each once.
    sent: Vec<u32>,
    /// What adds to a sent body's unseen impulse.
    feeds: Vec<Feed>,
    /// Ghosts in contact with owned bodies, sorted by (owner, GlobalId), which is the order of ghosts.
    ghosts: Vec<u32>,
    beside: Beside,
    /// Contacts that are solved for others.
    scratch: Range<u32>,
    /// Border contacts by the names of their bodies, sorted.
    contacts: Vec<BorderContact>,
    /// For each of these and each of its points the impulses of the step so far, along the normal and the tangent.
    totals: Vec<[[f32; 2]; 2]>,
    /// Places in `sends` in the order they are sent: by peer, and for each as its ghosts are ordered.
    send_order: Vec<u32>,
    /// Places in `contacts` in the order they are sent: by peer.
    contact_order: Vec<u32>,
    /// For every owned body the range of its `sends`; all empty between steps.
    sends_of: Vec<(u32, u32)>,
    /// See [`heard`](Self::heard).
    heard: Vec<(u32, f32)>,
    near: Near,
    /// The contacts of owned bodies that are of ghosts, or of bodies that are near to other tiles or sent; ascending.
    outer: Vec<u32>,
}

/// An owned body that another tile has as a ghost in a contact that it solves.
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
    /// Whether one of the bodies goes far: then each owner may know of others that it meets before.
    far: bool,
}

impl Border {
    /// Finds the border contacts of the step.
    pub(crate) fn find(&mut self, tile: &Tile, contacts: &Contacts, setup: &Setup) {
        self.sends.clear();
        self.feeds.clear();
        self.ghosts.clear();
        self.contacts.clear();
        self.heard.clear();
        let own = tile.contacts.own();
        self.scratch = own as u32..tile.contacts.len() as u32;
        self.near.find(tile, setup);
        self.outer.clear();
        for (i, &[a, b]) in (0..).zip(&contacts.bodies[..own]) {
            if self.near.knows(a) | self.near.knows(b) {
                self.outer.push(i);
            }
        }
        for &i in &self.outer {
            let key = tile.contacts.keys[i as usize];
            send_near(tile, key, &self.near, &mut self.sends);
            if let SlotKind::Ghost(ghost) = key.high().kind() {
                let (low, peer) = (tile.index(key.low()) as u32, tile.ghost_owners[ghost]);
                if far::may_be_unknown(tile, low as usize, ghost, setup) {
                    continue;
                }
                let pair = tile.pair_of(key);
                self.sends.push(Outgoing { body: low, peer });
                self.ghosts.push(ghost as u32);
                let owns_a = tile.bodies.id[low as usize] == pair.0;
                let goes_far = |slot| setup.goes_far(tile.bodies.velocity[tile.index(slot)]);
                let far = goes_far(key.low()) || goes_far(key.high());
                self.contacts.push(BorderContact { pair, contact: i, peer, owns_a, far });
            }
        }
        self.sends.sort_unstable();
        self.sends.dedup();
        self.sent.clear();
        self.sent.extend(self.sends.chunk_by(|a, b| a.body == b.body).map(|sends| sends[0].body));
        self.ghosts.sort_unstable();
        self.ghosts.dedup();
        self.find_outer_of_sent(contacts);
        self.contacts.sort_unstable();
        self.totals.clear();
        self.totals.resize(self.contacts.len(), [[0.0; 2]; 2]);
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
        self.find_beside(tile, contacts);
    }

    /// The owned bodies that other tiles hear of.
    pub(crate) fn sent(&self) -> &[u32] {
        &self.sent
    }

    /// Counts the contacts of sent bodies among the outer ones: who touches a large ghost may be near to no other tile.
    fn find_outer_of_sent(&mut self, contacts: &Contacts) {
        let Self { near, sent, outer, scratch, .. } = self;
        if sent.iter().all(|&body| near.knows(body)) {
            return;
        }
        let is_outer = |&body: &u32| near.knows(body) || sent.binary_search(&body).is_ok();
        let own = (0..scratch.start).zip(&contacts.bodies);
        outer.clear();
        outer.extend(own.filter(|(_, bodies)| bodies.iter().any(is_outer)).map(|(contact, _)| contact));
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
        for &contact in &self.outer {
            let key = tile.contacts.keys[contact as usize];
            for (body, partner) in [(key.low(), key.high()), (key.high(), key.low())] {
                let SlotKind::Owned(body) = body.kind() else { continue };
                let (first, end) = self.sends_of[body];
                if first == end {
                    continue;
                }
                let owner = owner_of(tile, partner);
                let near = self.near.of(body);
                let upon_a = contacts.bodies[contact as usize][0] == body as u32;
                for send in first..end {
                    let peer = self.sends[send as usize].peer;
                    if owner != Some(peer) && !(near.contains(&peer) && self.near.solves(peer, tile, partner)) {
                        self.feeds.push(Feed { send, contact, upon_a });
                    }
                }
            }
        }
    }

    /// Tells every peer the state of its ghosts, but of those that sleep.
    pub(crate) fn send_refresh(&self, tile: &Tile, solver: &Solver, bag: &mut Mailbag) {
        let mut unseen = vec![Unseen::default(); self.sends.len()];
        for feed in &self.feeds {
            let (linear, on_a, on_b) = solver.current(&tile.contacts, feed.contact).impulse();
            let unseen = &mut unseen[feed.send as usize];
            if feed.upon_a {
                unseen.add(-linear, on_a);
            } else {
                unseen.add(linear, on_b);
            }
        }
        for &i in &self.send_order {
            let Outgoing { body, peer } = self.sends[i as usize];
            if !solver.bodies.is_solved(body) {
                continue;
            }
            let (velocity, pose) = solver.bodies.state_of(body);
            bag.address(tile.id, peer);
            let id = tile.bodies.id[body as usize];
            bag.refreshes.push(GhostRefresh { id, velocity, pose, unseen: unseen[i as usize] });
        }
    }

    /// Takes over the owners' state of the ghosts in contact. Of who rests its owner may say nothing: then it sleeps, and stays where it was.
    pub(crate) fn refresh(&self, tile: &mut Tile, solver: &mut Solver, mail: Mail<'_>, setup: &Setup) {
        let rests = |tile: &Tile, ghost: usize| tile.rests(tile.owned + ghost, setup);
        for ghost in (0..tile.ghosts()).filter(|&ghost| rests(tile, ghost)) {
            let (row, unseen) = (tile.owned + ghost, tile.unseen[ghost]);
            let held = GhostRefresh { id: tile.bodies.id[row], velocity: [0.0; 3], pose: [0.0; 4], unseen };
            solver.bodies.refresh(row, &held);
        }
        let mut awaited = self.ghosts.iter().map(|&ghost| ghost as usize).peekable();
        let mut all_known = true;
        for message in mail.messages() {
            let first = tile.ghost_owners.partition_point(|&owner| owner < message.from);
            let count = tile.ghost_owners[first..].partition_point(|&owner| owner == message.from);
            let mut names = (first..).zip(&tile.bodies.id[tile.owned + first..tile.owned + first + count]);
            for refresh in message.refreshes {
                // Both lists ascend.
                let Some((ghost, _)) = names.by_ref().find(|(_, id)| **id == refresh.id) else {
                    all_known = false;
                    break;
                };
                while let Some(silent) = awaited.next_if(|&next| next < ghost) {
                    all_known &= rests(tile, silent);
                }
                awaited.next_if_eq(&ghost);
                solver.bodies.refresh(tile.owned + ghost, refresh);
            }
        }
        if !(awaited.all(|silent| rests(tile, silent)) && all_known) {
            tile.counts.fault = Some(Fault::Protocol);
        }
        let contacts = self.contacts.iter().map(|border| border.contact).chain(self.scratch.clone());
        for contact in contacts {
            if solver.groups.is_solved(contact) {
                solver.refresh_separation(contact);
            }
        }
    }

    /// Adds what border contacts did in a substep to what they did in the step.
    pub(crate) fn add_impulses(&mut self, tile: &Tile, solver: &Solver) {
        let both = self.contacts.iter().zip(&mut self.totals);
        for (border, totals) in both.filter(|(border, _)| solver.groups.is_solved(border.contact)) {
            let count = tile.contacts.contacts[border.contact as usize].point_count();
            for (k, total) in totals[..count].iter_mut().enumerate() {
                let now = solver.groups.impulses(border.contact, k);
                *total = [total[0] + now[0], total[1] + now[1]];
            }
        }
    }

    /// Takes in what border contacts that bounced did then.
    pub(crate) fn add_bounces(&mut self, tile: &Tile, solver: &Solver) {
        let both = self.contacts.iter().zip(&mut self.totals);
        for (border, totals) in both.filter(|(border, _)| solver.groups.may_bounce(border.contact)) {
            let count = tile.contacts.contacts[border.contact as usize].point_count();
            for (k, total) in totals[..count].iter_mut().enumerate() {
                *total = solver.groups.totals(border.contact, k);
            }
        }
    }

    /// Tells every peer what this tile's copies of their common contacts did in the whole step.
    pub(crate) fn send_impulses(&self, tile: &Tile, solver: &Solver, bag: &mut Mailbag) {
        for &i in &self.contact_order {
            let border = &self.contacts[i as usize];
            if !solver.groups.is_solved(border.contact) {
                continue;
            }
            let (low, high) = border.pair;
            let points = solver.border_points(&tile.contacts, border.contact, &self.totals[i as usize]);
            bag.address(tile.id, border.peer);
            bag.impulses.push(BorderImpulse { low, high, points });
        }
    }

    /// Moves both copies of every border contact to their mean, or to the lesser one where bodies go far, and of those that `bounced`.
    /// Points that only one side has are left alone, as are contacts that one side sleeps through. Returns whether the other tiles
    /// told of blows that this one did not know of: see [`heard`](Self::heard).
    pub(crate) fn average(&mut self, tile: &mut Tile, solver: &mut Solver, mail: Mail<'_>, bounced: bool) -> bool {
        let before = self.heard.len();
        for impulse in mail.messages().flat_map(|message| message.impulses) {
            let pair = (impulse.low, impulse.high);
            // One for each two pieces of the pair that touch; features tell them apart.
            let first = self.contacts.partition_point(|border| border.pair < pair);
            let of_pair = self.contacts[first..].iter().take_while(|border| border.pair == pair);
            if of_pair.clone().next().is_none() {
                tile.counts.fault = Some(Fault::Protocol);
            }
            for (border, totals) in of_pair.zip(&mut self.totals[first..]) {
                if !solver.groups.is_solved(border.contact) {
                    continue;
                }
                for theirs in impulse.points.iter().filter(|point| point.feature != ContactPoint::ABSENT) {
                    let is_known = solver.move_together(&tile.contacts, border, totals, theirs, bounced);
                    if is_known
                        && theirs.blow > max(solver.groups.blow(border.contact), 0.0)
                        && solver.groups.may_pass_on(border.contact)
                    {
                        self.heard.push((border.contact, theirs.blow));
                    }
                }
            }
        }
        self.heard.sort_unstable_by_key(|(contact, _)| *contact);
        self.heard.len() > before
    }

    /// Blows that come to border contacts from the other side, as far as told in this step: the contact, ascending, and the speed of
    /// the blow in m/s.
    pub(crate) fn heard(&self) -> &[(u32, f32)] {
        &self.heard
    }
}

/// Notes who must hear of the owned bodies of a contact as they solve it as well.
fn send_near(tile: &Tile, key: PairKey, near: &Near, sends: &mut Vec<Outgoing>) {
    for (body, partner) in [(key.low(), key.high()), (key.high(), key.low())] {
        let SlotKind::Owned(index) = body.kind() else { continue };
        let peers = near.of(index).iter().filter(|&&peer| near.solves(peer, tile, partner));
        sends.extend(peers.map(|&peer| Outgoing { body: index as u32, peer }));
    }
}

/// The tile that owns a body; none owns a static.
fn owner_of(tile: &Tile, slot: Slot) -> Option<TileId> {
    match slot.kind() {
        SlotKind::Owned(_) => Some(tile.id),
        SlotKind::Ghost(ghost) => Some(tile.ghost_owners[ghost]),
        SlotKind::Static(_) => None,
    }
}

impl Solver {
    /// A contact with the impulses it has at this moment.
    fn current(&self, contacts: &ContactCache, contact: u32) -> Contact {
        let mut current = contacts.contacts[contact as usize];
        if !self.groups.is_solved(contact) {
            return current;
        }
        let count = current.point_count();
        for (k, point) in current.points[..count].iter_mut().enumerate() {
            [point.normal_impulse, point.tangent_impulse] = self.groups.impulses(contact, k);
        }
        current
    }

    fn border_points(&self, contacts: &ContactCache, contact: u32, totals: &[[f32; 2]; 2]) -> [BorderPoint; 2] {
        let known = &contacts.contacts[contact as usize];
        let (points, count) = (&known.points, known.point_count());
        let blow = self.groups.blow(contact);
        std::array::from_fn(|k| {
            let [normal, tangent] = if k < count { self.groups.impulses(contact, k) } else { [0.0; 2] };
            let ([total_normal, total_tangent], feature) = (totals[k], points[k].feature);
            BorderPoint { feature, total_normal, total_tangent, normal, tangent, blow }
        })
    }

    /// Whether the contact has that point.
    fn move_together(
        &mut self,
        contacts: &ContactCache,
        border: &BorderContact,
        totals: &mut [[f32; 2]; 2],
        theirs: &BorderPoint,
        bounced: bool,
    ) -> bool {
        let BorderContact { contact, owns_a, far, .. } = *border;
        // Each owner may know others with whom its body bounces, or whom it meets first. The lesser impulse is the one that is sure:
        // it gives nobody more energy than there was. Where one owner alone sees the blow both take the lesser, or there would be momentum
        // that nobody had.
        let may_bounce = self.groups.may_bounce(contact);
        let lesser = far || bounced && (may_bounce || theirs.blow >= 0.0);
        let points = contacts.contacts[contact as usize].points();
        let Some(k) = points.iter().position(|point| point.feature == theirs.feature) else { return false };
        let ([normal, tangent], now) = (totals[k], self.groups.impulses(contact, k));
        // Both owners must come to the same: of equal ones that of body A's.
        let (less, equal) = (theirs.total_normal < normal, theirs.total_normal == normal);
        let theirs_counts = less || equal && !owns_a;
        let common = |mine: f32, theirs: f32| match (lesser, theirs_counts) {
            (false, _) => 0.5 * (mine + theirs),
            (true, true) => theirs,
            (true, false) => mine,
        };
        let total = [common(normal, theirs.total_normal), common(tangent, theirs.total_tangent)];
        self.apply_impulse(contact, k, owns_a, total[0] - normal, total[1] - tangent);
        totals[k] = total;
        self.groups.set_totals(contact, k, total);
        self.groups.set_impulses(contact, k, [common(now[0], theirs.normal), common(now[1], theirs.tangent)]);
        true
    }
}
