//! Narrow phase: from pairs to contacts, in canonical order, each with the impulses it had.

mod contacts;
mod meetings;
mod names;
mod sorted;

pub(crate) use contacts::Contacts;
pub(in crate::collide) use contacts::New;

use crate::collide::broad_phase::Pair;
use crate::collide::piece_boxes::PieceBoxes;
use crate::collide::proxies::Proxies;
use crate::collide::touch::{is_slow, recycle, touch};
use crate::collide::wide::boxes::WideBoxes;
use crate::collide::wide::discs::WideDiscs;
use crate::collide::wide::moments::{PointOutlook, Search};
use crate::collide::wide::pairs::{Outlook, RoundOutlook};
use crate::collide::wide::polygons::WidePolygons;
use crate::collide::wide::segments::WideSegments;
use crate::model::contact::{Contact, PairKey};
use crate::parallel::lanes::{Kernel, Lanes, WIDE};
use crate::parallel::team::Team;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use bytemuck::Zeroable;
use contacts::{Found, Places};
use meetings::Meetings;
use names::{Named, Names};
use sorted::Sorted;
use std::ops::Range;

/// Candidates, and pairs, in a piece of work, at least.
const GRAIN: usize = 1024;

/// Buffers of the narrow phase, shared by all tiles of a thread.
#[derive(Default, Debug)]
pub(crate) struct NarrowPhase {
    sorted: Sorted,
    /// For each body whether its contacts are known by name alone.
    by_name: Vec<bool>,
    boxes: PieceBoxes,
    found: Found,
    /// What each of several threads finds.
    parts: Vec<Found>,
}

impl NarrowPhase {
    /// Finds the contacts of a tile among candidate pairs: from here on it remembers these.
    /// Each pair is looked at as if it were alone (but see [`seams`](super::seams)).
    pub(crate) fn find(
        &mut self,
        tile: &mut Tile,
        proxies: &Proxies,
        candidates: &[Pair],
        setup: &Setup,
        team: Team,
        contacts: &mut Contacts,
    ) {
        self.sorted.find(tile, proxies, candidates, setup, team);
        self.mark_newcomers(tile);
        self.boxes.place(tile, self.sorted.pairs(), setup, team);
        contacts.begin();
        let Self { sorted, by_name, boxes, found, parts } = self;
        let (sorted, among) = (sorted.pairs(), FindAmong { sorted: sorted.pairs(), by_name, boxes, tile, setup });
        if team.pieces(sorted.len(), GRAIN) > 1 {
            parts.resize_with(team.pieces(sorted.len(), GRAIN), Found::default);
            let ranges = team.ranges(sorted.len(), GRAIN).zip(&mut *parts);
            team.for_each(ranges.collect(), |(range, part): (Range<usize>, &mut Found)| {
                part.clear();
                setup.lanes.run((FindAmong { sorted: &sorted[range], ..among }, part));
            });
            return contacts.gather(parts, &mut tile.contacts, team);
        }
        // What outlives the step is found where it was for the tile before, in the cache.
        std::mem::swap(&mut contacts.bodies, &mut found.bodies);
        std::mem::swap(&mut contacts.separation, &mut found.separation);
        found.clear();
        setup.lanes.run((among, &mut *found));
        found.end();
        std::mem::swap(&mut contacts.bodies, &mut found.bodies);
        std::mem::swap(&mut contacts.separation, &mut found.separation);
        tile.contacts.copy_from(found.keys(), found.contacts());
    }

    fn mark_newcomers(&mut self, tile: &Tile) {
        self.by_name.clear();
        self.by_name.resize(tile.owned, false);
        tile.newcomers.iter().for_each(|&newcomer| self.by_name[newcomer as usize] = true);
        self.by_name.resize(tile.owned + tile.ghosts(), true);
        self.by_name.resize(tile.bodies.len(), false);
    }
}

/// Appends the contacts among some sorted pairs to those there are.
#[derive(Clone, Copy)]
struct FindAmong<'a> {
    sorted: &'a [Pair],
    by_name: &'a [bool],
    boxes: &'a PieceBoxes,
    tile: &'a Tile,
    setup: &'a Setup,
}

/// So many pairs are sorted by kinds at a time.
const BLOCK: usize = 256;

/// Pairs of a block by kinds: of two round bodies, of one and a box, of boxes, of a polygon and a box or another, of a polygon and a round
/// body, of a segment and any of these. Of each kind there are two lists: first those that had no contact in the last step, most of whom
/// do not touch yet, then those that had one, most of whom do. And a last one of pairs with other shapes.
struct Lists {
    /// Places in the block.
    places: [[u8; BLOCK]; LISTS],
    count: [usize; LISTS],
}

const LISTS: usize = 13;

/// Of boxes.
const NEW_BOXES: usize = 4;
const KNOWN_BOXES: usize = 5;

/// Of polygons.
const NEW_POLYGONS: usize = 6;
const KNOWN_POLYGONS: usize = 7;

/// Of a segment and a round body, a box or a polygon.
const NEW_ON_SEGMENTS: usize = 8;
const KNOWN_ON_SEGMENTS: usize = 9;

/// Of a round body and a polygon.
const ROUND_ON_POLYGONS: usize = 10;

/// Of bodies one of which is made of pieces.
const OF_PIECES: usize = 12;

/// The first list of two [`Form`](crate::model::kind::Form)s.
const LIST_OF: [[usize; 5]; 5] = [
    [0, 2, ROUND_ON_POLYGONS, NEW_ON_SEGMENTS, OF_PIECES],
    [2, NEW_BOXES, NEW_POLYGONS, NEW_ON_SEGMENTS, OF_PIECES],
    [ROUND_ON_POLYGONS, NEW_POLYGONS, NEW_POLYGONS, NEW_ON_SEGMENTS, OF_PIECES],
    [NEW_ON_SEGMENTS, NEW_ON_SEGMENTS, NEW_ON_SEGMENTS, OF_PIECES, OF_PIECES],
    [OF_PIECES; 5],
];

impl Lists {
    #[inline(always)]
    fn new(pairs: &[Pair], named: &[Named<'_>; BLOCK], tile: &Tile, setup: &Setup) -> Self {
        let mut lists = Self { places: [[0; BLOCK]; LISTS], count: [0; LISTS] };
        for (place, (&pair, named)) in pairs.iter().zip(named).enumerate() {
            let [a, b] = pair.map(|body| setup.kind(tile.bodies.kind[body as usize]).form as usize);
            let list = LIST_OF[a][b] + usize::from(named.known.is_some());
            lists.push(list.min(OF_PIECES), place as u8);
        }
        lists
    }

    #[inline(always)]
    fn push(&mut self, list: usize, place: u8) {
        self.places[list][self.count[list]] = place;
        self.count[list] += 1;
    }

    #[inline(always)]
    fn get(&self, list: usize) -> &[u8] {
        &self.places[list][..self.count[list]]
    }
}

/// Some pairs, and what comes of each: a contact, and the separation of its points now.
struct Block<'a> {
    named: [Named<'a>; BLOCK],
    outcome: [Outcome; BLOCK],
    /// The contacts of those that are found anew.
    found: [Contact; BLOCK],
    separation: [[f32; 2]; BLOCK],
}

/// What comes of a pair.
#[derive(Clone, Copy, PartialEq)]
enum Outcome {
    Nothing,
    /// The contact that is known, as it is.
    Known,
    Found,
    /// Any number, one for each two of their pieces.
    Several,
}

impl Kernel for (FindAmong<'_>, &mut Found) {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let (among, found) = self;
        let FindAmong { sorted, by_name, tile, setup, .. } = among;
        let mut names = Names::new(tile, by_name, sorted);
        let nobody = Named { key: PairKey::default(), bodies: [0, 0], known: None, old: 0 };
        let mut block = Block {
            named: [nobody; BLOCK],
            outcome: [Outcome::Nothing; BLOCK],
            found: [Contact::zeroed(); BLOCK],
            separation: [[0.0; 2]; BLOCK],
        };
        // Once for all blocks: to fill them with zeros takes longer than a few pairs.
        let (mut round, mut boxes) = (RoundOutlook::default(), PointOutlook::<WideBoxes>::default());
        let (mut polygons, mut segments) =
            (PointOutlook::<WidePolygons>::default(), PointOutlook::<WideSegments>::default());
        let (mut discs, mut meetings) = (PointOutlook::<WideDiscs>::default(), Meetings::default());
        for pairs in sorted.chunks(BLOCK) {
            names.name(pairs, &mut block.named);
            let mut lists = Lists::new(pairs, &block.named, tile, setup);
            for list in 0..NEW_BOXES {
                setup.lanes.run(Find { block: &mut block, list: lists.get(list), tile, setup, outlook: &mut round });
            }
            block.keep_known(&mut lists, [KNOWN_BOXES, NEW_BOXES], tile, setup);
            block.keep_known(&mut lists, [KNOWN_POLYGONS, NEW_POLYGONS], tile, setup);
            block.keep_known(&mut lists, [KNOWN_ON_SEGMENTS, NEW_ON_SEGMENTS], tile, setup);
            let list = lists.get(NEW_BOXES);
            setup.lanes.run(Find { block: &mut block, list, tile, setup, outlook: &mut boxes });
            let list = lists.get(NEW_POLYGONS);
            setup.lanes.run(Find { block: &mut block, list, tile, setup, outlook: &mut polygons });
            let list = lists.get(NEW_ON_SEGMENTS);
            setup.lanes.run(Find { block: &mut block, list, tile, setup, outlook: &mut segments });
            for list in [ROUND_ON_POLYGONS, ROUND_ON_POLYGONS + 1] {
                setup.lanes.run(Find { block: &mut block, list: lists.get(list), tile, setup, outlook: &mut discs });
            }
            if lists.get(OF_PIECES).is_empty() {
                block.keep(pairs.len(), found);
            } else {
                lists.get(OF_PIECES).iter().for_each(|&place| block.outcome[usize::from(place)] = Outcome::Several);
                meetings.find(lists.get(OF_PIECES), &block.named, &among);
                block.keep_several(pairs.len(), &meetings, found);
            }
        }
    }
}

/// Finds the contacts of pairs of one kind: a kernel of its own, as all in one would be more than a compiler can look over.
struct Find<'b, 'a, O> {
    block: &'b mut Block<'a>,
    list: &'b [u8],
    tile: &'b Tile,
    setup: &'b Setup,
    outlook: &'b mut O,
}

impl<O: Outlook> Kernel for Find<'_, '_, O> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        self.block.find::<V, O>(self.list, self.outlook, self.tile, self.setup);
    }
}

impl Block<'_> {
    /// Appends the contacts of so many pairs. Every one is written down, and counted if there is one: a branch would be a coin toss.
    #[inline(always)]
    fn keep(&self, pairs: usize, found: &mut Found) {
        let mut kept = 0;
        // One length for all: each place is checked once, not once per column.
        let Places { keys, contacts, separation, bodies } = found.places(pairs);
        let (keys, contacts) = (&mut keys[..pairs], &mut contacts[..pairs]);
        let (separation, bodies) = (&mut separation[..pairs], &mut bodies[..pairs]);
        for i in 0..pairs {
            let (named, found) = (&self.named[i], &self.found[i]);
            let contact = if self.outcome[i] == Outcome::Known { named.known.unwrap_or(found) } else { found };
            (keys[kept], bodies[kept]) = (named.key, named.bodies);
            (contacts[kept], separation[kept]) = (*contact, self.separation[i]);
            kept += usize::from(self.outcome[i] != Outcome::Nothing);
        }
        found.add(kept);
    }

    /// As [`keep`](Self::keep), with those contacts of pairs of which one body is made of pieces.
    #[inline(never)]
    fn keep_several(&self, pairs: usize, meetings: &Meetings<'_>, found: &mut Found) {
        let mut meetings = meetings.found();
        for (named, place) in self.named[..pairs].iter().zip(0..) {
            let mut keep = |contact: &Contact, now| found.push(named.key, *contact, now, named.bodies);
            match self.outcome[place] {
                Outcome::Nothing => {}
                Outcome::Known => keep(named.known.expect("it is known"), self.separation[place]),
                Outcome::Found => keep(&self.found[place], self.separation[place]),
                Outcome::Several => {
                    while let Some((_, contact, now)) = meetings.next_if(|&(of, ..)| of == place) {
                        keep(contact, now);
                    }
                }
            }
        }
    }

    /// Finds the contacts of pairs of one kind.
    #[inline(always)]
    fn find<V: Lanes, O: Outlook>(&mut self, list: &[u8], outlook: &mut O, tile: &Tile, setup: &Setup) {
        let (mut left, mut count) = ([0; BLOCK], list.len());
        left[..count].copy_from_slice(list);
        for search in [Search::WhereManyNeedIt, Search::Always] {
            let mut postponed = 0;
            for first in (0..count).step_by(WIDE) {
                let lanes = WIDE.min(count - first);
                // In lanes that are left over, the first of them again.
                let mut places = [left[first]; WIDE];
                places[..lanes].copy_from_slice(&left[first..][..lanes]);
                let in_lanes = V::HAS_REGISTERS || !O::NEEDS_REGISTERS;
                if in_lanes {
                    for (lane, &place) in places.iter().enumerate() {
                        let Named { bodies, known, .. } = self.named[usize::from(place)];
                        outlook.set(lane, tile, bodies, known, setup);
                    }
                    outlook.look::<V::Wide>(search, setup);
                }
                for (lane, &number) in places[..lanes].iter().enumerate() {
                    let (place, Named { bodies, known, .. }) = (usize::from(number), self.named[usize::from(number)]);
                    // What there is no contact of is written down as well: a branch would be a coin toss.
                    let (mut meets, mut found) = (outlook.meets(lane), outlook.contact(lane, known));
                    if outlook.is_unsure(lane) || !in_lanes {
                        let touch = touch(tile, bodies, known, setup);
                        (meets, found) = (touch.is_some(), touch.unwrap_or(found));
                    }
                    self.outcome[place] = if meets { Outcome::Found } else { Outcome::Nothing };
                    (self.found[place], self.separation[place]) = found;
                    // Those that are looked at again are written over then.
                    left[postponed] = number;
                    postponed += usize::from(outlook.is_postponed(lane));
                }
            }
            count = postponed;
        }
    }

    /// Keeps those known contacts of a list whose manifold of before still serves, and leaves the others to be found anew.
    #[inline(always)]
    fn keep_known(&mut self, lists: &mut Lists, [known, new]: [usize; 2], tile: &Tile, setup: &Setup) {
        for i in 0..lists.count[known] {
            let place = lists.places[known][i];
            let Named { bodies, known, .. } = self.named[usize::from(place)];
            if let Some(known) = known
                && is_slow(tile, bodies, setup)
                && let Some(separation) = recycle(tile, bodies, known, setup)
            {
                (self.outcome[usize::from(place)], self.separation[usize::from(place)]) = (Outcome::Known, separation);
            } else {
                lists.push(new, place);
            }
        }
    }
}
