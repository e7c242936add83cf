//! Narrow phase: from pairs to contacts, in canonical order, each with the impulses it had.

use crate::collide::broad_phase::Pair;
use crate::collide::manifold::{Manifold, collide};
use crate::collide::proxies::Proxies;
use crate::model::contact::{Contact, ContactCache, ContactPoint, PairKey, Slot};
use crate::model::math::{Rot, dot, turn};
use crate::model::shape::KindRow;
use crate::parallel::team::Team;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use glam::Vec2;
use std::ops::Range;

/// A contact's geometry may be kept only while each box turned by less than this cosine (11 degrees).
const RECYCLE_COSINE: f32 = 0.98;

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

    fn append(&mut self, other: &mut Self) {
        self.cache.append(&mut other.cache);
        self.separation.append(&mut other.separation);
        self.bodies.append(&mut other.bodies);
    }

    /// Contacts, and border contacts, of which body A is owned: so that each is counted by one tile.
    pub(crate) fn count(&self, owned: usize) -> (u64, u64) {
        let (mut all, mut border) = (0, 0);
        for (&[a, _], &key) in self.bodies.iter().zip(&self.cache.keys) {
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
    /// Per owned body where its pairs begin in `sorted`.
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
        self.sort(tile.owned);
        contacts.clear();
        let sorted = &self.sorted[..];
        let pieces = team.pieces(sorted.len(), GRAIN);
        if pieces == 1 {
            return find_among(sorted, tile, setup, contacts);
        }
        self.parts.resize_with(pieces, Contacts::default);
        let parts = team.ranges(sorted.len(), GRAIN).zip(&mut self.parts).collect();
        team.for_each(parts, |(range, part): (Range<usize>, &mut Contacts)| {
            find_among(&sorted[range], tile, setup, part);
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
        self.start.resize(tile.owned + 2, 0);
        for pair in &self.near {
            self.start[pair[0] as usize + 2] += 1;
        }
    }

    /// Sorts the pairs: counted by their lower index, then by hand within the few of each body.
    fn sort(&mut self, owned: usize) {
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
        for body in 0..owned {
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
        kept += usize::from(proxies.is_pair(offset, pair));
    }
    near.truncate(kept);
}

/// Appends the contacts among some sorted pairs.
fn find_among(sorted: &[Pair], tile: &Tile, setup: &Setup, contacts: &mut Contacts) {
    let ghosts = tile.ghosts();
    let key_of = |[low, high]: Pair| {
        let slot = |index: u32| Slot::from_index(index as usize, tile.owned, ghosts);
        PairKey::new(slot(low), slot(high))
    };
    let keys = &tile.contacts.keys;
    let mut old = sorted.first().map_or(0, |&first| keys.partition_point(|&key| key < key_of(first)));
    for &[low, high] in sorted {
        let key = key_of([low, high]);
        // Both lists ascend: one pass over the old contacts serves all pairs.
        while old < keys.len() && keys[old] < key {
            old += 1;
        }
        let known = (old < keys.len() && keys[old] == key).then(|| &tile.contacts.contacts[old]);
        let ids = (tile.bodies.id[low as usize], tile.bodies.id[high as usize]);
        let (a, b, pair) = if ids.0 < ids.1 { (low, high, ids) } else { (high, low, (ids.1, ids.0)) };
        let strange = key.is_border()
            || low as usize >= tile.arrived
            || (high as usize) < tile.owned && high as usize >= tile.arrived;
        let stray = if strange { tile.strays.find(pair) } else { None };
        if let Some((contact, separation)) = touch(tile, [a, b], stray.or(known), setup) {
            contacts.cache.push(key, contact);
            contacts.separation.push(separation);
            contacts.bodies.push([a, b]);
        }
    }
}

/// One side of a contact.
struct Side<'a> {
    kind: &'a KindRow,
    rotation: Rot,
    velocity: Vec2,
    angular_velocity: f32,
}

impl<'a> Side<'a> {
    #[inline(always)]
    fn new(tile: &Tile, index: u32, setup: &'a Setup) -> Self {
        let (bodies, i) = (&tile.bodies, index as usize);
        Self {
            kind: setup.kind(bodies.kind[i]),
            rotation: bodies.rotation[i],
            velocity: bodies.velocity[i],
            angular_velocity: bodies.angular_velocity[i],
        }
    }

    #[inline(always)]
    fn is_round(&self) -> bool {
        self.kind.shape.is_round()
    }

    /// How the body turned since `then`. A round body's contacts do not turn with it.
    #[inline(always)]
    fn turned(&self, then: Rot) -> Rot {
        if self.is_round() { Rot::IDENTITY } else { then.to(self.rotation) }
    }
}

/// The contact of bodies A and B, if there is one, and the separation of its points.
#[inline(always)]
fn touch(tile: &Tile, [a, b]: Pair, known: Option<&Contact>, setup: &Setup) -> Option<(Contact, [f32; 2])> {
    let offset = (tile.bodies.position[b as usize] - tile.bodies.position[a as usize]).as_vec2();
    let (side_a, side_b) = (Side::new(tile, a, setup), Side::new(tile, b, setup));
    // The contact rule: separation < speculative distance + closing speed x dt.
    let holds = |normal: Vec2, anchor: Vec2, separation: f32| {
        let velocity_a = side_a.velocity + turn(side_a.angular_velocity, anchor);
        let velocity_b = side_b.velocity + turn(side_b.angular_velocity, anchor - offset);
        let closing = -dot(velocity_b - velocity_a, normal);
        let ahead = if closing > 0.0 { closing * setup.params.dt } else { 0.0 };
        separation < setup.params.speculative_distance + ahead
    };
    if let Some(known) = known
        && let Some(separation) = recycle(known, &side_a, &side_b, offset, setup)
    {
        let near = known.points().iter().zip(separation).any(|(point, s)| holds(known.normal, point.anchor, s));
        if near {
            return Some((*known, separation));
        }
    }
    let manifold = {
        let between = side_b.velocity - side_a.velocity;
        let spin = |side: &Side<'_>| side.kind.bounding_radius * side.angular_velocity.abs();
        let speed = dot(between, between).sqrt() + spin(&side_a) + spin(&side_b);
        let reach = setup.params.speculative_distance + setup.params.dt * speed;
        collide(side_a.kind, side_a.rotation, side_b.kind, side_b.rotation, offset, reach)
    };
    let mut kept = Manifold { normal: manifold.normal, ..Manifold::EMPTY };
    for point in manifold.points() {
        if holds(manifold.normal, point.anchor, point.separation) {
            kept.push(*point);
        }
    }
    if kept.count == 0 {
        return None;
    }
    let points = kept.points.map(|point| {
        let old = known.and_then(|known| known.points().iter().find(|old| old.feature == point.feature));
        ContactPoint {
            anchor: point.anchor,
            separation: point.separation,
            normal_impulse: old.map_or(0.0, |old| old.normal_impulse),
            tangent_impulse: old.map_or(0.0, |old| old.tangent_impulse),
            feature: point.feature,
        }
    });
    let contact =
        Contact { normal: kept.normal, offset, rotation_a: side_a.rotation, rotation_b: side_b.rotation, points };
    Some((contact, [points[0].separation, points[1].separation]))
}

/// The separations of a contact whose manifold still serves: the bodies have hardly moved against each other.
///
/// Source: contact recycling in Box2D v3.2 (E. Catto). Without it manifolds jump between features and piles jitter for
/// ever. Here a round body's contacts do not turn with it, so that rolling keeps them.
#[inline(always)]
fn recycle(known: &Contact, a: &Side<'_>, b: &Side<'_>, offset: Vec2, setup: &Setup) -> Option<[f32; 2]> {
    let (turned_a, turned_b) = (a.turned(known.rotation_a), b.turned(known.rotation_b));
    if !(turned_a.c > RECYCLE_COSINE && turned_b.c > RECYCLE_COSINE) {
        return None;
    }
    // Relative motion as seen from the body that turns its contacts, or from the world where there is none.
    let frame = if a.is_round() { turned_b } else { turned_a };
    let moved = frame.unrotate(offset) - known.offset;
    let twist = if a.is_round() || b.is_round() {
        0.0
    } else {
        let extent = |side: &Side<'_>| if side.kind.inv_mass > 0.0 { side.kind.bounding_radius } else { 0.0 };
        turned_a.to(turned_b).s.abs() * crate::model::math::max(extent(a), extent(b))
    };
    if dot(moved, moved).sqrt() + twist >= setup.params.recycle_distance {
        return None;
    }
    let shift = offset - known.offset;
    Some(known.points.map(|point| {
        let (arm_a, arm_b) = (point.anchor, point.anchor - known.offset);
        let swing = (turned_b.rotate(arm_b) - arm_b) - (turned_a.rotate(arm_a) - arm_a);
        point.separation + dot(shift + swing, known.normal)
    }))
}
