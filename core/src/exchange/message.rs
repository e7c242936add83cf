//! How tiles speak to each other: messages, and the one thing physics asks of the outside.

use crate::model::body::Body;
use crate::model::contact::Contact;
use crate::model::id::{GlobalId, TileId};
use bytemuck::{Pod, Zeroable};
use glam::Vec2;

/// Carries the messages of one sync point.
///
/// `exchange` is called by every rank of a run the same number of times. It must bring each message of each rank's
/// outbox to the inbox of the rank that holds its destination tile, and every rank's [`Verdict`] to every rank, before
/// it returns. Order of arrival does not matter. Within one rank [`Outbox::deliver`] does it all.
pub trait Halo {
    /// What the outside can fail with.
    type Error;

    /// One sync point.
    fn exchange(&mut self, outbox: &mut Outbox, inbox: &mut Inbox) -> Result<(), Self::Error>;
}

/// What one tile tells another at one sync point. Most of it is empty most of the time.
#[derive(Clone, Default, Debug)]
pub struct Message {
    /// Source.
    pub from: TileId,
    /// Destination.
    pub to: TileId,
    /// Bodies that change owner.
    pub migrants: Vec<Body>,
    /// Contacts of those bodies.
    pub contacts: Vec<ContactRecord>,
    /// Copies of bodies the destination does not own and needs.
    pub ghosts: Vec<GhostRecord>,
    /// The ghosts' state after a substep, in the order of the step's ghost list.
    pub refreshes: Vec<GhostRefresh>,
    /// What border contacts did in the whole step.
    pub impulses: Vec<BorderImpulse>,
}

impl Message {
    fn clear(&mut self) {
        self.migrants.clear();
        self.contacts.clear();
        self.ghosts.clear();
        self.refreshes.clear();
        self.impulses.clear();
    }
}

/// A contact on the move, known by the names of its bodies, the lower first.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct ContactRecord {
    /// Body A.
    pub low: GlobalId,
    /// Body B.
    pub high: GlobalId,
    /// One if the sending tile owned body A, else zero: where two tiles hold an entry of one pair, that one wins.
    pub from_owner_of_low: u64,
    /// Geometry and impulses.
    pub contact: Contact,
}

/// An impulse and its moment about a body's center: what a ghost is given in every substep.
#[derive(Clone, Copy, PartialEq, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Unseen {
    /// N s.
    pub linear: Vec2,
    /// N m s.
    pub angular: f32,
}

impl Unseen {
    pub(crate) fn add(&mut self, linear: Vec2, angular: f32) {
        self.linear += linear;
        self.angular += angular;
    }
}

/// A ghost on its way: 64 bytes.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct GhostRecord {
    /// A bit-exact copy.
    pub body: Body,
    /// The sum of the body's stored impulses from contacts that the receiving tile does not solve.
    pub unseen: Unseen,
    /// Zero; fills the record to a multiple of its alignment.
    pub padding: u32,
}

/// A ghost's state after a substep: 40 bytes. Velocities and displacements are mass-weighted (times the square root of
/// mass or inertia), as the solver holds them, so that the copy is exact.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct GhostRefresh {
    /// Velocity x, y and angular velocity, mass-weighted.
    pub velocity: [f32; 3],
    /// Displacement x, y of the step so far, mass-weighted; cosine minus one, and mass-weighted sine, of its rotation.
    pub pose: [f32; 4],
    /// As in [`GhostRecord`].
    pub unseen: Unseen,
}

/// What one owner's copy of a border contact did in a step.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct BorderImpulse {
    /// Body A.
    pub low: GlobalId,
    /// Body B.
    pub high: GlobalId,
    /// The one or two points.
    pub points: [BorderPoint; 2],
}

/// One point of a [`BorderImpulse`].
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct BorderPoint {
    /// As in [`crate::ContactPoint`].
    pub feature: u32,
    /// Sum over substeps of the impulse along the normal, restitution included, in N s.
    pub total_normal: f32,
    /// Sum over substeps of the impulse along the tangent, in N s.
    pub total_tangent: f32,
    /// The last substep's impulse along the normal, restitution excluded, in N s.
    pub normal: f32,
    /// The last substep's impulse along the tangent, in N s.
    pub tangent: f32,
    /// Zero.
    pub padding: u32,
}

impl BorderPoint {
    pub(crate) const NONE: Self = Self {
        feature: crate::model::contact::ContactPoint::ABSENT,
        total_normal: 0.0,
        total_tangent: 0.0,
        normal: 0.0,
        tangent: 0.0,
        padding: 0,
    };
}

/// What every rank must know of every other: rides on each exchange.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Verdict {
    /// Somebody asks the run to stop.
    pub stop: bool,
    /// A check failed: the step and the lowest body concerned.
    pub failure: Option<(u64, GlobalId)>,
}

impl Verdict {
    /// Joins two: any stop, the earliest failure.
    pub fn merge(self, other: Self) -> Self {
        let failure = match (self.failure, other.failure) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        Self { stop: self.stop | other.stop, failure }
    }

    /// As a word for the outside to carry: the least word of all ranks stands for all their verdicts joined. A failure
    /// hides a stop, which makes no difference: it ends the run.
    pub fn to_word(self) -> u128 {
        match self {
            // A run never counts as many steps as would make this one of the words below.
            Self { failure: Some((step, id)), .. } => u128::from(step) << 64 | u128::from(id.0),
            Self { stop: true, .. } => Self::STOP,
            Self { stop: false, .. } => Self::NOTHING,
        }
    }

    /// Reads [`to_word`](Self::to_word).
    pub fn from_word(word: u128) -> Self {
        match word {
            Self::NOTHING => Self::default(),
            Self::STOP => Self { stop: true, failure: None },
            _ => Self { stop: false, failure: Some(((word >> 64) as u64, GlobalId(word as u64))) },
        }
    }

    const NOTHING: u128 = u128::MAX;
    const STOP: u128 = u128::MAX - 1;
}

/// The messages one tile sends, or receives, at one sync point. Keeps its buffers: those beyond `used` are empty.
#[derive(Clone, Default, Debug)]
pub(crate) struct Mailbag {
    messages: Vec<Message>,
    used: usize,
}

impl Mailbag {
    pub(crate) fn clear(&mut self) {
        self.messages[..self.used].iter_mut().for_each(Message::clear);
        self.used = 0;
    }

    /// The message from one tile to another; begins one if there is none yet.
    pub(crate) fn message(&mut self, from: TileId, to: TileId) -> &mut Message {
        // A tile has few neighbours: searching beats hashing.
        let known = self.messages[..self.used].iter().position(|m| m.to == to && m.from == from);
        let index = known.unwrap_or_else(|| {
            self.begin();
            let index = self.used - 1;
            (self.messages[index].from, self.messages[index].to) = (from, to);
            index
        });
        &mut self.messages[index]
    }

    fn begin(&mut self) -> &mut Message {
        if self.used == self.messages.len() {
            self.messages.push(Message::default());
        }
        self.used += 1;
        &mut self.messages[self.used - 1]
    }

    /// Swaps the messages for tiles of `inbox` against empty buffers and keeps the others.
    fn hand_over(&mut self, inbox: &mut Inbox) {
        let mut kept = 0;
        for i in 0..self.used {
            match inbox.bag(self.messages[i].to) {
                Some(bag) => std::mem::swap(bag.begin(), &mut self.messages[i]),
                None => {
                    self.messages.swap(kept, i);
                    kept += 1;
                }
            }
        }
        self.used = kept;
    }

    pub(crate) fn messages(&self) -> &[Message] {
        &self.messages[..self.used]
    }

    fn messages_mut(&mut self) -> &mut [Message] {
        &mut self.messages[..self.used]
    }

    /// Ascending by source: the order in which messages apply.
    fn sort(&mut self) {
        self.messages_mut().sort_unstable_by_key(|message| message.from);
    }
}

/// Everything this rank's tiles send at one sync point.
#[derive(Debug, Default)]
pub struct Outbox {
    /// One per tile of this rank, in the order of the world's tiles.
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

    /// Hands over every message for a tile that `inbox` holds, without copying, and this rank's own verdict.
    pub fn deliver(&mut self, inbox: &mut Inbox) {
        inbox.hear(self.verdict);
        self.bags.iter_mut().for_each(|bag| bag.hand_over(inbox));
    }

    /// All messages.
    pub fn messages(&self) -> impl Iterator<Item = &Message> {
        self.bags.iter().flat_map(Mailbag::messages)
    }

    /// All messages, each with its bag and its place in there.
    pub(crate) fn numbered_messages(&self) -> impl Iterator<Item = ((u32, u32), &Message)> {
        let bags = (0..).zip(&self.bags);
        bags.flat_map(|(bag, mail)| (0..).zip(mail.messages()).map(move |(place, message)| ((bag, place), message)))
    }

    pub(crate) fn numbered_message(&self, (bag, place): (u32, u32)) -> &Message {
        &self.bags[bag as usize].messages()[place as usize]
    }
}

/// Everything this rank's tiles receive at one sync point.
#[derive(Debug, Default)]
pub struct Inbox {
    /// One per tile of this rank, in the order of the world's tiles.
    pub(crate) bags: Vec<Mailbag>,
    /// For every tile of the grid its place in `bags`, or `ELSEWHERE`.
    places: Vec<u32>,
    pub(crate) kinds: u32,
    pub(crate) verdict: Verdict,
    pub(crate) step: u64,
    pub(crate) sync: u32,
}

const ELSEWHERE: u32 = u32::MAX;

impl Inbox {
    pub(crate) fn new(tiles: &[TileId], grid_tiles: usize, kinds: usize) -> Self {
        let mut places = vec![ELSEWHERE; grid_tiles];
        for (place, tile) in (0..).zip(tiles) {
            places[tile.0 as usize] = place;
        }
        let bags = vec![Mailbag::default(); tiles.len()];
        Self { bags, places, kinds: kinds as u32, ..Self::default() }
    }

    /// All messages received so far: by tile, and for one tile in the order they came in.
    pub fn messages(&self) -> impl Iterator<Item = &Message> {
        self.bags.iter().flat_map(Mailbag::messages)
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

    /// A place for one more message to `tile`; `None` if it lives elsewhere.
    pub(crate) fn receive(&mut self, from: TileId, to: TileId) -> Option<&mut Message> {
        if from.0 as usize >= self.places.len() {
            return None;
        }
        let message = self.bag(to)?.begin();
        (message.from, message.to) = (from, to);
        Some(message)
    }

    fn bag(&mut self, tile: TileId) -> Option<&mut Mailbag> {
        let place = *self.places.get(tile.0 as usize)?;
        self.bags.get_mut(place as usize)
    }

    pub(crate) fn begin(&mut self, step: u64, sync: u32) {
        self.bags.iter_mut().for_each(Mailbag::clear);
        self.verdict = Verdict::default();
        (self.step, self.sync) = (step, sync);
    }

    pub(crate) fn sort(&mut self) {
        self.bags.iter_mut().for_each(Mailbag::sort);
    }
}
