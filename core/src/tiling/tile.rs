//! A tile: a rectangle of the domain, the bodies it owns, and what it remembers of their contacts.

use crate::collide::broad_phase::quadtree::Quadtree;
use crate::exchange::record::{GhostRecord, Unseen};
use crate::exchange::rim::Rim;
use crate::islands::sleep::Sleep;
use crate::model::body::Bodies;
use crate::model::contact::{ContactCache, PairKey, Slot, SlotKind};
use crate::model::id::{GlobalId, TileId};
use crate::model::params::BroadPhase;
use crate::model::strays::Strays;
use crate::solver::index::GraphNode;
use crate::state::hash::Hashes;
use crate::state::violation::Violation;
use crate::step::standstill::Standstill;
use crate::tiling::blueprint::Setup;
use crate::tiling::changes::Changes;
use crate::tiling::partition::Region;
use crate::tiling::pushes::Push;
use crate::tiling::statics::Near;
use std::time::Duration;

/// The unit of physics: one step of a tile is a function of its state and of the messages it received.
#[derive(Debug)]
pub(crate) struct Tile {
    pub(crate) id: TileId,
    pub(crate) region: Region,
    /// Bodies in here are nobody else's business.
    pub(crate) interior: Region,
    /// The part of the domain in the region. Local coordinates, where single precision will do, count from its low corner.
    pub(crate) rectangle: Region,
    /// Owned bodies, then ghosts, then statics.
    pub(crate) bodies: Bodies,
    pub(crate) owned: usize,
    /// Who came and left since the last step, and is not settled.
    pub(crate) changes: Option<Box<Changes>>,
    /// Owned bodies that came in this step, or changed places as others left: their contacts of before are among the strays.
    pub(crate) newcomers: Vec<u32>,
    /// Whether owned bodies beside the newcomers are far from the places where they were. Who remembers these takes note, and takes it back.
    pub(crate) is_rearranged: bool,
    /// Places of owned bodies that left, ascending. Empty but between the two halves of the first sync point.
    pub(crate) gaps: Vec<u32>,
    /// Who is pushed by forces in the step under way, by body; before its first sync point owned ones alone.
    pub(crate) pushes: Vec<Push>,
    /// Owned bodies that may concern other tiles, for the next step.
    pub(crate) rim: Rim,
    /// One per ghost: the impulse it is given in every substep.
    pub(crate) unseen: Vec<Unseen>,
    /// One per ghost, ascending.
    pub(crate) ghost_owners: Vec<TileId>,
    /// Rows of the setup's statics, ascending: those that its bodies may come to in this step, and maybe more, of those reached. Between a
    /// change of its region and the next sync point those that it knew before.
    pub(crate) statics: Vec<u32>,
    /// Of all that reach its region.
    pub(crate) reached: Vec<u32>,
    /// Where its bodies are, if statics are many.
    pub(crate) near: Near,
    /// What was solved last, and from the narrow phase on what is to be solved. Between the first sync point and that those of newcomers
    /// and ghosts mean nothing.
    pub(crate) contacts: ContactCache,
    /// The other remembered contacts, filled in the first sync point.
    pub(crate) strays: Strays,
    /// Who rests; empty unless `sleep` is on.
    pub(crate) sleep: Sleep,
    /// What it was like as its last step began, if all rested.
    pub(crate) standstill: Option<Box<Standstill>>,
    /// How well the contacts of the last step were solved, if that was measured.
    pub(crate) violation: Violation,
    /// The bodies by place, where the parameters ask for it. Never shows in a result.
    pub(crate) quadtree: Option<Box<Quadtree>>,
    /// What happened in the step under way.
    pub(crate) counts: TileCounts,
    /// Time worked on it since that was last asked for, where it is booked.
    pub(crate) booked: Duration,
}

/// How fast anything in a tile is as a step begins, at most.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Fastest {
    /// In rad/s.
    pub(crate) spin: f32,
    /// How far it would go in the step along an axis, in m.
    pub(crate) way: f32,
}

/// What a tile counts in a step.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct TileCounts {
    pub(crate) contacts: u64,
    pub(crate) border_contacts: u64,
    pub(crate) migrations: u64,
    /// Ghosts that other tiles were sent.
    pub(crate) ghosts: u64,
    /// Bodies that left for a tile that is no neighbour.
    pub(crate) leaps: u64,
    /// Whether an owned body reaches further in the step than the halo.
    pub(crate) far: bool,
    pub(crate) fastest: Fastest,
    pub(crate) islands: u64,
    pub(crate) largest_island: u64,
    pub(crate) asleep: u64,
    pub(crate) colors: u64,
    /// The lowest owned body whose state is no longer finite.
    pub(crate) not_finite: Option<GlobalId>,
    /// What must never happen, and did.
    pub(crate) fault: Option<Fault>,
}

/// A tile that stands still takes the time of one of so many times fewer bodies.
const AT_STANDSTILL: u64 = 32;

/// What ends a run because its results could not be trusted any more.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Fault {
    /// A message spoke of a body that is not known here.
    Protocol,
    /// This thread's floating-point unit does not compute as IEEE 754 has it by default.
    FloatMode,
}

impl Tile {
    pub(crate) fn new(id: TileId, setup: &Setup) -> Self {
        Self::within(id, setup.statics_of(id), setup)
    }

    /// An empty tile of which it is known already which statics reach it.
    pub(crate) fn within(id: TileId, reached: Vec<u32>, setup: &Setup) -> Self {
        let (region, rectangle) = (setup.partition.region(id), setup.partition.rectangle(id));
        let quadtree = || Box::new(Quadtree::new(rectangle.size().as_vec2().to_array()));
        Self {
            id,
            region,
            interior: region.shrunk(setup.inset(false)),
            rectangle,
            bodies: Bodies::default(),
            owned: 0,
            changes: None,
            newcomers: Vec::new(),
            is_rearranged: false,
            pushes: Vec::new(),
            gaps: Vec::new(),
            rim: Rim::default(),
            unseen: Vec::new(),
            ghost_owners: Vec::new(),
            statics: reached.clone(),
            reached,
            near: Near::default(),
            contacts: ContactCache::default(),
            strays: Strays::default(),
            sleep: Sleep::default(),
            standstill: None,
            violation: Violation::default(),
            quadtree: (setup.params.broad_phase == BroadPhase::Quadtree).then(quadtree),
            counts: TileCounts::default(),
            booked: Duration::ZERO,
        }
    }

    /// A tile of the same bodies that remembers nothing but how well its contacts were solved.
    pub(crate) fn copy_bodies(&self, setup: &Setup) -> Self {
        let mut bodies = self.bodies.clone();
        bodies.truncate(self.owned);
        Self { bodies, owned: self.owned, violation: self.violation, ..self.emptied(setup) }
    }

    /// An empty tile that knows the same statics.
    pub(crate) fn emptied(&self, setup: &Setup) -> Self {
        Self { statics: self.statics.clone(), ..Self::within(self.id, self.reached.clone(), setup) }
    }

    /// Whether it owns nothing: then a step has nothing to do here.
    pub(crate) fn is_idle(&self) -> bool {
        self.owned == 0
    }

    /// About how long a step takes here, in what a body without contacts takes.
    pub(crate) fn work(&self) -> u64 {
        let work = self.owned + 2 * self.ghosts() + 2 * self.contacts.len();
        let stands_still = self.standstill.as_ref().is_some_and(|standstill| standstill.is_known());
        if stands_still { work as u64 / AT_STANDSTILL } else { work as u64 }
    }

    /// Whether it owns nothing and remembers nothing.
    pub(crate) fn is_bare(&self) -> bool {
        self.is_idle() && !self.bodies.has_room()
    }

    /// What an idle tile remembers is forgotten, and its memory given back: there may be very many of them.
    pub(crate) fn lay_bare(&mut self) {
        debug_assert!(self.is_idle());
        self.bodies = Bodies::default();
        self.contacts = ContactCache::default();
        self.strays = Strays::default();
        self.rim = Rim::default();
        self.newcomers = Vec::new();
        self.gaps = Vec::new();
        self.unseen = Vec::new();
        self.ghost_owners = Vec::new();
        self.sleep = Sleep::default();
        self.standstill = None;
        self.violation = Violation::default();
    }

    /// Gives the tile another region. Whom it owns and what it remembers is settled with the next step, as if all bodies had moved.
    pub(crate) fn move_borders(&mut self, setup: &Setup) {
        let Self { region, interior, rectangle, quadtree, .. } = Self::within(self.id, Vec::new(), setup);
        let is_same = region == self.region;
        (self.region, self.interior, self.rectangle) = (region, interior, rectangle);
        self.standstill = None;
        // A neighbour's border may have moved where this one's have not.
        self.rim.is_known = false;
        if !is_same {
            self.quadtree = quadtree;
            self.reached = setup.statics_of(self.id);
            self.near = Near::default();
        }
    }

    /// Finds where in the tile its bodies concern no other, however large they are.
    pub(crate) fn find_interior(&mut self, setup: &Setup) {
        let large = setup.has_large() && self.bodies.kind[..self.owned].iter().any(|&kind| setup.is_large(kind));
        self.interior = self.region.shrunk(setup.inset(large));
    }

    /// Puts one more ghost behind those that there are.
    #[inline]
    pub(crate) fn take_ghost(&mut self, owner: TileId, GhostRecord { body, unseen, rested }: GhostRecord) {
        self.bodies.push(body);
        self.unseen.push(unseen);
        self.sleep.push_ghost(rested);
        self.ghost_owners.push(owner);
    }

    pub(crate) fn ghosts(&self) -> usize {
        self.unseen.len()
    }

    /// Tells, once owned bodies have come and gone, of which slots contacts still mean whom they meant: others are known by name.
    pub(crate) fn who_stays(&self) -> impl Fn(Slot) -> bool + use<> {
        let mut is_newcomer = vec![false; self.owned];
        self.newcomers.iter().for_each(|&index| is_newcomer[index as usize] = true);
        move |slot| match slot.kind() {
            SlotKind::Owned(index) => is_newcomer.get(index) == Some(&false),
            SlotKind::Ghost(_) => false,
            SlotKind::Static(_) => true,
        }
    }

    /// Index into [`Tile::bodies`] of a slot.
    #[inline(always)]
    pub(crate) fn index(&self, slot: Slot) -> usize {
        slot.index(self.owned, self.ghosts())
    }

    /// The place of the static of that name, if it mattered here in the last step.
    pub(crate) fn place_of_static(&self, id: GlobalId) -> Option<usize> {
        let first = self.owned + self.ghosts();
        let statics = self.bodies.id.get(first..)?;
        Some(first + statics.iter().position(|&name| name == id)?)
    }

    /// Index into [`Tile::bodies`] of the static in a row of the setup, if the tile knows it in this step.
    pub(crate) fn index_of_static(&self, row: u32, setup: &Setup) -> Option<usize> {
        let first = self.owned + self.ghosts();
        if let Ok(place) = self.statics.binary_search(&row) {
            return Some(first + place);
        }
        // What only lies on somebody's way is behind those.
        let (kind, rest) = (setup.statics.get(row as usize)?.kind, first + self.statics.len());
        Some(rest + self.bodies.kind.get(rest..)?.iter().position(|&other| other == kind)?)
    }

    /// The names of a contact's bodies, the lower first, and whether the slot order is the other way round.
    #[inline(always)]
    pub(crate) fn pair_of(&self, key: PairKey) -> (GlobalId, GlobalId) {
        let (a, b) = (self.bodies.id[self.index(key.low())], self.bodies.id[self.index(key.high())]);
        if a < b { (a, b) } else { (b, a) }
    }

    /// Sends islands to sleep, which takes their bodies' velocities, or wakes them (see [`Sleep::decide`]).
    pub(crate) fn fall_asleep(&mut self, nodes: &[GraphNode], roots: &[u32], setup: &Setup) {
        if setup.params.sleep {
            self.sleep.resize(self.owned);
            let (velocity, angular_velocity) = (&mut self.bodies.velocity, &mut self.bodies.angular_velocity);
            self.counts.asleep = self.sleep.decide(nodes, roots, velocity, angular_velocity, setup);
        }
    }

    /// How long one of its bodies that is no static has rested, in s; zero where nobody may sleep.
    pub(crate) fn rested(&self, body: usize) -> f32 {
        self.sleep.rested(body, self.owned)
    }

    /// Whether that is long enough to sleep, if all of its island have.
    pub(crate) fn rests(&self, body: usize, setup: &Setup) -> bool {
        setup.params.sleep && self.rested(body) >= setup.params.sleep_time
    }

    /// Notes who has rested in this step.
    pub(crate) fn count_rest(&mut self, setup: &Setup) {
        if setup.params.sleep {
            let bodies = &self.bodies;
            let speed = |i: usize| {
                let reach = setup.kind(bodies.kind[i]).bounding_radius;
                bodies.velocity[i].length() + reach * bodies.angular_velocity[i].abs()
            };
            let rests = |i: usize| speed(i) < setup.sleep_speed(bodies.kind[i]);
            self.sleep.count_on(rests, setup);
        }
    }

    pub(crate) fn hashes(&self) -> Hashes {
        let mut hashes = Hashes::default();
        for index in 0..self.owned {
            hashes.add_body(&self.bodies.get(index));
        }
        for (&id, &still) in self.bodies.id.iter().zip(self.sleep.still()) {
            hashes.add_rest(id, still);
        }
        for (key, contact) in self.contacts.iter() {
            hashes.add_contact(self.id, self.pair_of(key), contact);
        }
        hashes
    }
}
