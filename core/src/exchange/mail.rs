//! How messages lie in memory: those that one thread's tiles write together, column by column, and for each receiver
//! the list of its own.
//!
//! A tile writes its messages one after the other, so all their ghosts are one array, and so on: a message is five
//! ranges. Within a rank nothing is copied: outbox and inbox swap their bags, and a receiver is told where to look. Which
//! thread a tile was on decides in which bag its messages lie, and shows nowhere: receivers sort by source.

use super::record::{BorderImpulse, ContactRecord, GhostRecord, GhostRefresh, MigrantRecord};
use super::verdict::Verdict;
use crate::model::id::TileId;

/// What one tile tells another at one sync point. Most of it is empty most of the time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Message<'a> {
    /// Source.
    pub from: TileId,
    /// Destination.
    pub to: TileId,
    /// Bodies that change owner.
    pub migrants: &'a [MigrantRecord],
    /// Contacts of those bodies.
    pub contacts: &'a [ContactRecord],
    /// Copies of bodies the destination does not own and needs.
    pub ghosts: &'a [GhostRecord],
    /// The ghosts' state after a substep, in the order of the step's ghost list.
    pub refreshes: &'a [GhostRefresh],
    /// What border contacts did in the whole step.
    pub impulses: &'a [BorderImpulse],
}

/// Where a message begins in each column of its bag. It ends where the next one begins.
#[derive(Clone, Copy, Default, Debug)]
struct Envelope {
    from: TileId,
    to: TileId,
    migrants: u32,
    contacts: u32,
    ghosts: u32,
    refreshes: u32,
    impulses: u32,
}

/// Messages at one sync point, one after the other.
#[derive(Clone, Default, Debug)]
pub(crate) struct Mailbag {
    envelopes: Vec<Envelope>,
    pub(crate) migrants: Vec<MigrantRecord>,
    pub(crate) contacts: Vec<ContactRecord>,
    pub(crate) ghosts: Vec<GhostRecord>,
    pub(crate) refreshes: Vec<GhostRefresh>,
    pub(crate) impulses: Vec<BorderImpulse>,
}

impl Mailbag {
    pub(crate) fn clear(&mut self) {
        self.envelopes.clear();
        self.migrants.clear();
        self.contacts.clear();
        self.ghosts.clear();
        self.refreshes.clear();
        self.impulses.clear();
    }

    pub(crate) fn len(&self) -> usize {
        self.envelopes.len()
    }

    /// Begins the next message: what is pushed to the columns from now on is in it.
    pub(crate) fn begin(&mut self, from: TileId, to: TileId) {
        let end = self.end();
        self.envelopes.push(Envelope { from, to, ..end });
    }

    /// As [`begin`](Self::begin), if the message under way is not for `to` already.
    pub(crate) fn address(&mut self, from: TileId, to: TileId) {
        if self.envelopes.last().is_none_or(|last| (last.from, last.to) != (from, to)) {
            self.begin(from, to);
        }
    }

    /// Where a message would begin that comes after all there are.
    fn end(&self) -> Envelope {
        Envelope {
            migrants: self.migrants.len() as u32,
            contacts: self.contacts.len() as u32,
            ghosts: self.ghosts.len() as u32,
            refreshes: self.refreshes.len() as u32,
            impulses: self.impulses.len() as u32,
            ..Envelope::default()
        }
    }

    /// Bytes that it keeps for envelopes.
    #[cfg(test)]
    pub(crate) fn room(&self) -> usize {
        self.envelopes.capacity() * size_of::<Envelope>()
    }

    /// One of the messages, in the order they were begun.
    pub(crate) fn message(&self, place: usize) -> Message<'_> {
        let first = self.envelopes[place];
        let end = self.envelopes.get(place + 1).copied().unwrap_or_else(|| self.end());
        Message {
            from: first.from,
            to: first.to,
            migrants: &self.migrants[first.migrants as usize..end.migrants as usize],
            contacts: &self.contacts[first.contacts as usize..end.contacts as usize],
            ghosts: &self.ghosts[first.ghosts as usize..end.ghosts as usize],
            refreshes: &self.refreshes[first.refreshes as usize..end.refreshes as usize],
            impulses: &self.impulses[first.impulses as usize..end.impulses as usize],
        }
    }

    pub(crate) fn messages(&self) -> impl Iterator<Item = Message<'_>> + Clone {
        (0..self.len()).map(|place| self.message(place))
    }
}

/// Everything this rank's tiles send at one sync point.
#[derive(Debug, Default)]
pub struct Outbox {
    /// One per thread.
    pub(crate) bags: Vec<Mailbag>,
    pub(crate) verdict: Verdict,
    pub(crate) step: u64,
    pub(crate) sync: u32,
}

impl Outbox {
    /// This rank's verdict, which every rank must hear.
    pub fn verdict(&self) -> Verdict {
        self.verdict
    }

    /// The step under way, counted from 0, and the sync point within it.
    pub fn moment(&self) -> (u64, u32) {
        (self.step, self.sync)
    }

    /// Sees to it that every message for a tile that `inbox` holds is received there, without copying, and this rank's
    /// own verdict. Returns the destination of the first message that is for others to receive, if there is one. All
    /// stay readable here until the sync point is over.
    #[must_use = "messages for tiles of other ranks are still to be sent"]
    pub fn deliver(&mut self, inbox: &mut Inbox) -> Option<TileId> {
        inbox.hear(self.verdict);
        let mut for_others = None;
        for (bag, mail) in (0..).zip(&self.bags) {
            for (place, message) in (0..).zip(mail.messages()) {
                if !inbox.route(message.from, message.to, bag, place, !message.migrants.is_empty())
                    && for_others.is_none()
                {
                    for_others = Some(message.to);
                }
            }
        }
        for_others
    }

    /// All messages.
    pub fn messages(&self) -> impl Iterator<Item = Message<'_>> {
        self.bags.iter().flat_map(Mailbag::messages)
    }

    /// All messages, each with its bag and its place in there.
    pub(crate) fn numbered_messages(&self) -> impl Iterator<Item = ((u32, u32), Message<'_>)> {
        let bags = (0..).zip(&self.bags);
        bags.flat_map(|(bag, mail)| (0..).zip(mail.messages()).map(move |(place, message)| ((bag, place), message)))
    }

    pub(crate) fn numbered_message(&self, (bag, place): (u32, u32)) -> Message<'_> {
        self.bags[bag as usize].message(place as usize)
    }
}

/// Where a message lies that one of this rank's tiles receives.
#[derive(Clone, Copy, Default, Debug)]
struct Route {
    /// Place of the receiver among this rank's tiles.
    to: u32,
    from: TileId,
    /// Whose bag it lies in, or [`DECODED`].
    bag: u32,
    /// Place in the bag.
    message: u32,
    /// Whether bodies come with it.
    brings_migrants: bool,
}

/// The bag of what came from other ranks.
const DECODED: u32 = u32::MAX;

/// Everything this rank's tiles receive at one sync point.
#[derive(Debug, Default)]
pub struct Inbox {
    /// For every tile of the grid its place among this rank's, or `ELSEWHERE`.
    places: Vec<u32>,
    /// The bags of this rank's own tiles, once the sync point is over.
    sent_here: Vec<Mailbag>,
    pub(crate) decoded: Mailbag,
    routes: Vec<Route>,
    /// The routes by receiver, and for each receiver by sender: the order in which messages apply.
    sorted: Vec<Route>,
    /// Per tile of this rank where its routes end in `sorted`; they begin where those of the tile before end.
    ends: Vec<u32>,
    pub(crate) kinds: u32,
    pub(crate) verdict: Verdict,
    pub(crate) step: u64,
    pub(crate) sync: u32,
}

const ELSEWHERE: u32 = u32::MAX;

impl Inbox {
    pub(crate) fn new(tiles: impl Iterator<Item = TileId>, grid_tiles: usize, kinds: usize) -> Self {
        let mut inbox = Self { places: vec![ELSEWHERE; grid_tiles], kinds: kinds as u32, ..Self::default() };
        inbox.hold(tiles);
        inbox
    }

    /// From here on it is for these tiles, in the order of the world's.
    pub(crate) fn hold(&mut self, tiles: impl Iterator<Item = TileId>) {
        self.places.fill(ELSEWHERE);
        let mut count = 0;
        for tile in tiles {
            self.places[tile.0 as usize] = count;
            count += 1;
        }
        self.ends.clear();
        self.ends.resize(count as usize, 0);
        self.routes.clear();
        self.sorted.clear();
    }

    /// The messages of other ranks decoded so far, in the order they came in.
    pub fn messages(&self) -> impl Iterator<Item = Message<'_>> + Clone {
        self.decoded.messages()
    }

    /// What has been heard so far, all verdicts joined.
    pub fn verdict(&self) -> Verdict {
        self.verdict
    }

    /// Whether a tile lives in this world.
    pub fn holds(&self, tile: TileId) -> bool {
        self.places.get(tile.0 as usize).is_some_and(|&place| place != ELSEWHERE)
    }

    /// Joins another rank's verdict to what this rank has heard.
    pub fn hear(&mut self, verdict: Verdict) {
        self.verdict = self.verdict.merge(verdict);
    }

    /// Begins one more message of another rank, in [`Inbox::decoded`]; says no if its tile lives elsewhere.
    pub(crate) fn receive(&mut self, from: TileId, to: TileId, brings_migrants: bool) -> bool {
        let place = self.decoded.len() as u32;
        let known = (from.0 as usize) < self.places.len() && self.route(from, to, DECODED, place, brings_migrants);
        if known {
            self.decoded.begin(from, to);
        }
        known
    }

    /// Notes where a message lies; says no if its tile lives elsewhere.
    fn route(&mut self, from: TileId, to: TileId, bag: u32, message: u32, brings_migrants: bool) -> bool {
        let holds = self.holds(to);
        if holds {
            self.routes.push(Route { to: self.places[to.0 as usize], from, bag, message, brings_migrants });
        }
        holds
    }

    pub(crate) fn begin(&mut self, step: u64, sync: u32) {
        self.decoded.clear();
        self.routes.clear();
        self.verdict = Verdict::default();
        (self.step, self.sync) = (step, sync);
    }

    /// Ends the sync point: takes the bags of what was sent here and leaves empty ones, and sorts what each tile
    /// receives. Takes time for each tile and each message.
    pub(crate) fn end(&mut self, outbox: &mut Outbox) {
        std::mem::swap(&mut self.sent_here, &mut outbox.bags);
        outbox.bags.iter_mut().for_each(Mailbag::clear);
        let Self { routes, sorted, ends, .. } = self;
        // Counted at first; adding up gives where each begins; placing moves that on to where each ends.
        ends.fill(0);
        for route in routes.iter() {
            ends[route.to as usize] += 1;
        }
        let mut sum = 0;
        for end in ends.iter_mut() {
            sum += std::mem::replace(end, sum);
        }
        sorted.clear();
        sorted.resize(routes.len(), Route::default());
        for route in routes.iter() {
            let end = &mut ends[route.to as usize];
            sorted[*end as usize] = *route;
            *end += 1;
        }
        let mut begin = 0;
        for &end in ends.iter() {
            let own = &mut sorted[begin as usize..end as usize];
            // One thread's tiles come in order; those of others, here or elsewhere, come in between.
            if !own.is_sorted_by_key(|route| route.from) {
                own.sort_by_key(|route| route.from);
            }
            begin = end;
        }
    }

    /// Places of the tiles that bodies come to, in any order, some perhaps more than once.
    pub(crate) fn heirs(&self) -> impl Iterator<Item = u32> {
        self.routes.iter().filter(|route| route.brings_migrants).map(|route| route.to)
    }

    /// What one of this rank's tiles receives.
    pub(crate) fn mail(&self, place: usize) -> Mail<'_> {
        let begin = if place == 0 { 0 } else { self.ends[place - 1] };
        let routes = &self.sorted[begin as usize..self.ends[place] as usize];
        Mail { routes, sent_here: &self.sent_here, decoded: &self.decoded }
    }
}

/// What one tile receives at one sync point: messages by ascending source.
#[derive(Clone, Copy)]
pub(crate) struct Mail<'a> {
    routes: &'a [Route],
    sent_here: &'a [Mailbag],
    decoded: &'a Mailbag,
}

impl<'a> Mail<'a> {
    pub(crate) fn message(self, place: usize) -> Message<'a> {
        let Route { bag, message, .. } = self.routes[place];
        let bag = if bag == DECODED { self.decoded } else { &self.sent_here[bag as usize] };
        bag.message(message as usize)
    }

    pub(crate) fn messages(self) -> impl Iterator<Item = Message<'a>> {
        (0..self.routes.len()).map(move |place| self.message(place))
    }
}
