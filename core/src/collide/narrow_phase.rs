//! Narrow phase: from pairs to contacts, in canonical order, each with the impulses it had.

use crate::collide::broad_phase::Pair;
use crate::collide::eight_pairs::{EightPairs, Outlook};
use crate::collide::proxies::Proxies;
use crate::collide::touch::{is_slow, recycle, touch};
use crate::model::contact::{Contact, ContactCache, PairKey, Slot};
use crate::parallel::lanes::{Kernel, LANES, Lanes};
use crate::parallel::team::Team;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use std::ops::Range;

/// Candidates, and pairs, in a piece of work, at least.
const GRAIN: usize = 2048;

/// The contacts of a tile, in canonical order: ascending by their bodies' slots, whatever order the pairs came in.
#[derive(Default, Debug)]
pub(crate) struct Contacts {
    pub(crate) cache: ContactCache,
    /// For each contact the separation of its points now.
    pub(crate) separation: Vec<[f32; 2]>,
    /// For each contact the indices of body A, the one with the lower GlobalId, and body B.
    pub(crate) bodies: Vec<Pair>,
}

impl Contacts {
    fn clear(&mut self) {
        self.cache.clear();
        self.separation.clear();
        self.bodies.clear();
    }

    /// Adds the contact of a pair, if there is one; of a slow one there may be an outlook.
    #[inline(always)]
    fn find(&mut self, tile: &Tile, setup: &Setup, named: Named<'_>, slow: Option<(&Outlook, usize)>) {
        let Named { key, bodies, known } = named;
        if let (Some(known), Some((outlook, lane))) = (known, slow) {
            if outlook.rolls(lane) {
                let separation = outlook.roll(lane, self.cache.push(key, *known));
                return self.push_bodies(bodies, separation);
            }
            if let Some(separation) = recycle(tile, bodies, known, setup) {
                self.cache.push(key, *known);
                return self.push_bodies(bodies, separation);
            }
        }
        if let Some((contact, separation)) = touch(tile, bodies, known, setup) {
            self.cache.push(key, contact);
            self.push_bodies(bodies, separation);
        }
    }

    #[inline(always)]
    fn push_bodies(&mut self, bodies: Pair, separation: [f32; 2]) {
        self.bodies.push(bodies);
        self.separation.push(separation);
    }

    fn append(&mut self, other: &mut Self) {
        self.cache.append(&mut other.cache);
        self.separation.append(&mut other.separation);
        self.bodies.append(&mut other.bodies);
    }

    /// Contacts, and border contacts, of which body A is owned: so that each is counted by one tile.
    pub(crate) fn count(&self, owned: usize) -> (u64, u64) {
        let (mut all, mut border) = (0, 0);
        for (&[a, _], &key) in self.bodies.iter().zip(&self.cache.keys[..self.cache.own()]) {
            let is_border = key.is_border();
            let counts = !is_border || (a as usize) < owned;
            all += u64::from(counts);
            border += u64::from(counts && is_border);
        }
        (all, border)
    }
}

/// Buffers of the narrow phase, shared by all tiles of a thread.
#[derive(Default, Debug)]
pub(crate) struct NarrowPhase {
    near: Vec<Pair>,
    sorted: Vec<Pair>,
    /// Per body that may be a pair's first where its pairs begin in `sorted`.
    start: Vec<u32>,
    /// What each of several threads finds.
    parts: Vec<Contacts>,
}

impl NarrowPhase {
    /// Finds the contacts of a tile among candidate pairs.
    pub(crate) fn find(
        &mut self,
        tile: &Tile,
        proxies: &Proxies,
        candidates: &[Pair],
        setup: &Setup,
        team: Team,
        contacts: &mut Contacts,
    ) {
        self.cull(tile, proxies, candidates, team);
        self.sort(proxies.pairing);
        contacts.clear();
        let sorted = &self.sorted[..];
        let pieces = team.pieces(sorted.len(), GRAIN);
        if pieces == 1 {
            return setup.lanes.run(FindAmong { sorted, tile, setup, contacts });
        }
        self.parts.resize_with(pieces, Contacts::default);
        let parts = team.ranges(sorted.len(), GRAIN).zip(&mut self.parts).collect();
        team.for_each(parts, |(range, part): (Range<usize>, &mut Contacts)| {
            setup.lanes.run(FindAmong { sorted: &sorted[range], tile, setup, contacts: part });
        });
        self.parts.iter_mut().for_each(|part| contacts.append(part));
    }

    /// Keeps the candidates that are pairs, and counts them by their lower index.
    fn cull(&mut self, tile: &Tile, proxies: &Proxies, candidates: &[Pair], team: Team) {
        self.near.clear();
        team.append(&mut self.near, candidates.len(), GRAIN, |range, near| {
            cull(tile, proxies, &candidates[range], near)
        });
        self.start.clear();
        self.start.resize(proxies.pairing + 2, 0);
        for pair in &self.near {
            self.start[pair[0] as usize + 2] += 1;
        }
    }

    /// Sorts the pairs: counted by their lower index, then by hand within the few of each body.
    fn sort(&mut self, firsts: usize) {
        let mut sum = 0;
        for start in &mut self.start {
            sum += *start;
            *start = sum;
        }
        self.sorted.clear();
        self.sorted.resize(self.near.len(), [0, 0]);
        for &pair in &self.near {
            let place = &mut self.start[pair[0] as usize + 1];
            self.sorted[*place as usize] = pair;
            *place += 1;
        }
        for body in 0..firsts {
            let (first, end) = (self.start[body] as usize, self.start[body + 1] as usize);
            if end - first > 1 {
                self.sorted[first..end].sort_unstable();
            }
        }
    }
}

/// Appends the candidates that are pairs. Every one is written down and counted or not: a branch here would be a coin
/// toss.
fn cull(tile: &Tile, proxies: &Proxies, candidates: &[Pair], near: &mut Vec<Pair>) {
    let position = &tile.bodies.position;
    let mut kept = near.len();
    near.resize(kept + candidates.len(), [0, 0]);
    for &pair in candidates {
        let offset = (position[pair[1] as usize] - position[pair[0] as usize]).as_vec2();
        near[kept] = pair;
        kept += usize::from(proxies.is_wanted(pair)) & usize::from(proxies.is_pair(offset, pair));
    }
    near.truncate(kept);
}

/// Appends the contacts among some sorted pairs.
struct FindAmong<'a> {
    sorted: &'a [Pair],
    tile: &'a Tile,
    setup: &'a Setup,
    contacts: &'a mut Contacts,
}

/// A pair as its contact names it.
#[derive(Clone, Copy)]
struct Named<'a> {
    key: PairKey,
    /// Bodies A and B.
    bodies: Pair,
    known: Option<&'a Contact>,
}

impl Kernel for FindAmong<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Self { sorted, tile, setup, contacts } = self;
        let mut names = Names::new(tile, sorted);
        let (mut eight, mut outlook) = (EightPairs::default(), Outlook::default());
        // In a pile nearly all have a contact that may roll on; where bodies fly few do. Both ways give the same bits.
        if 2 * tile.contacts.len() < sorted.len() {
            for &pair in sorted {
                let named = names.name(pair);
                let is_slow = named.known.is_some() && is_slow(tile, named.bodies, setup);
                if is_slow {
                    eight.set(0, tile, named.bodies, setup);
                    eight.look::<V>(setup, &mut outlook);
                }
                contacts.find(tile, setup, named, is_slow.then_some((&outlook, 0)));
            }
            return;
        }
        for pairs in sorted.chunks(LANES) {
            let mut named = [Named { key: PairKey::default(), bodies: [0, 0], known: None }; LANES];
            for (lane, &pair) in pairs.iter().enumerate() {
                named[lane] = names.name(pair);
                eight.set(lane, tile, named[lane].bodies, setup);
            }
            eight.look::<V>(setup, &mut outlook);
            for (lane, &named) in named[..pairs.len()].iter().enumerate() {
                contacts.find(tile, setup, named, outlook.is_slow(lane, setup).then_some((&outlook, lane)));
            }
        }
    }
}

/// Names pairs that ascend: one pass over the contacts of the last step serves them all.
struct Names<'a> {
    tile: &'a Tile,
    ghosts: usize,
    /// The first contact of the last step that is not before the pairs so far.
    old: usize,
}

impl<'a> Names<'a> {
    fn new(tile: &'a Tile, sorted: &[Pair]) -> Self {
        let mut names = Self { tile, ghosts: tile.ghosts(), old: 0 };
        if let Some(&first) = sorted.first() {
            let first = names.key(first);
            names.old = tile.contacts.keys.partition_point(|&key| key < first);
        }
        names
    }

    #[inline(always)]
    fn key(&self, [low, high]: Pair) -> PairKey {
        let slot = |index: u32| Slot::from_index(index as usize, self.tile.owned, self.ghosts);
        PairKey::new(slot(low), slot(high))
    }

    #[inline(always)]
    fn name(&mut self, [low, high]: Pair) -> Named<'a> {
        let (tile, keys) = (self.tile, &self.tile.contacts.keys[..]);
        let key = self.key([low, high]);
        while self.old < keys.len() && keys[self.old] < key {
            self.old += 1;
        }
        let known = (self.old < keys.len() && keys[self.old] == key).then(|| &tile.contacts.contacts[self.old]);
        let ids = (tile.bodies.id[low as usize], tile.bodies.id[high as usize]);
        let (bodies, pair) = if ids.0 < ids.1 { ([low, high], ids) } else { ([high, low], (ids.1, ids.0)) };
        let strange = key.is_border()
            || low as usize >= tile.arrived
            || (high as usize) < tile.owned && high as usize >= tile.arrived;
        let stray = if strange { tile.strays.find(pair, key.is_own()) } else { None };
        Named { key, bodies, known: stray.or(known) }
    }
}
