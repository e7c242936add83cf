//! Owners, ghosts and border contacts against the definitions, on random worlds that are anything but comfortable:
//! bodies larger than tiles, bodies faster than a tile a step, bodies outside the domain.

use crate::Loopback;
use crate::model::body::{Body, StaticBody};
use crate::model::contact::{Contact, SlotKind};
use crate::model::id::{GlobalId, KindId, TileId};
use crate::model::math::Rot;
use crate::model::params::{Exchange, Params};
use crate::step;
use crate::testing::{any_convex, any_kind, any_rotation, cases, rectangle};
use crate::tiling::blueprint::Blueprint;
use crate::tiling::partition::Partition;
use crate::tiling::tile::Tile;
use crate::world::World;
use glam::{DVec2, Vec2};
use proptest::prelude::*;
use std::collections::BTreeMap;

mod examples;

#[derive(Clone, Debug)]
struct Scene {
    blueprint: Blueprint,
    bodies: Vec<Body>,
}

impl Scene {
    fn world(&self) -> World {
        let tiles: Vec<_> = (0..self.blueprint.partition.tiles() as u32).map(TileId).collect();
        let mut world = World::new(&self.blueprint, &tiles).unwrap();
        for &body in &self.bodies {
            assert!(world.add(body).unwrap());
        }
        world
    }

    /// The same bodies where nothing has a border.
    fn on_one_tile(&self) -> Self {
        let mut scene = self.clone();
        let grid = &self.blueprint.partition;
        scene.blueprint.partition = Partition::uniform(grid.min(), grid.max(), 1, 1).unwrap();
        scene
    }
}

fn any_body(kinds: usize, domain: DVec2) -> impl Strategy<Value = Body> {
    let within = (0.0..1.0, 0.0..1.0);
    let heap = (0.40..0.60, 0.45..0.55);
    let outside = (-1.0..2.0, -1.0..2.0);
    let place = prop_oneof![4 => within, 4 => heap, 1 => outside];
    let slow = -3.0_f32..3.0;
    let fast = -400.0_f32..400.0;
    let velocity = prop_oneof![3 => (slow.clone(), slow), 1 => (fast.clone(), fast)];
    (0..kinds, place, any_rotation(), velocity, -40.0_f32..40.0).prop_map(
        move |(kind, (x, y), rotation, (vx, vy), angular_velocity)| Body {
            id: GlobalId(0),
            position: DVec2::new(x, y) * domain,
            rotation,
            velocity: Vec2::new(vx, vy),
            angular_velocity,
            kind: KindId(kind as u32),
        },
    )
}

fn any_scene(bodies: usize, gravity: f32) -> impl Strategy<Value = Scene> {
    let kinds = prop::collection::vec(prop_oneof![2 => any_kind(0.1, 4.0), 1 => any_convex(0.1, 2.0)], 1..5);
    // Some tiles have bodies that are too far inside to matter to others.
    let grid = (1_u32..=7, 1_u32..=5, prop_oneof![2 => 0.4_f64..4.0, 1 => 4.0_f64..25.0]);
    let exchange = prop_oneof![Just(Exchange::Step), Just(Exchange::Substep)];
    let large = prop_oneof![Just(f32::INFINITY), 0.1_f32..2.0];
    (kinds, grid, (exchange, large), 1_u32..=5)
        .prop_flat_map(move |(kinds, (columns, rows, side), exchange, sort_interval)| {
            let domain = DVec2::new(side * f64::from(columns), side * f64::from(rows));
            let bodies = prop::collection::vec(any_body(kinds.len(), domain), 0..=bodies);
            (bodies, Just((kinds, columns, rows, domain, exchange, sort_interval)))
        })
        .prop_map(move |(mut bodies, (kinds, columns, rows, domain, (exchange, large_radius), sort_interval))| {
            let gravity = Vec2::new(0.0, gravity);
            let params = Params { exchange, sort_interval, gravity, large_radius, ..Params::default() };
            let floor = StaticBody {
                id: GlobalId(0),
                position: DVec2::new(0.5 * domain.x, -1.0),
                rotation: Rot::IDENTITY,
                kind: rectangle(2.0 * domain.x as f32, 2.0),
                path: None,
            };
            // Names in no relation to places.
            let count = bodies.len() as u64;
            for (i, body) in (0..).zip(&mut bodies) {
                body.id = GlobalId(1 + (i * 7 + 3) % (count.next_multiple_of(7) + 1));
            }
            bodies.sort_by_key(|body| body.id);
            bodies.dedup_by_key(|body| body.id);
            bodies.reverse();
            let partition = Partition::uniform(DVec2::ZERO, domain, columns, rows).unwrap();
            Scene { blueprint: Blueprint { params, partition, kinds, statics: vec![floor] }, bodies }
        })
}

/// All bodies by name; refuses one that is there twice.
fn by_name(world: &World) -> BTreeMap<GlobalId, Body> {
    let mut bodies = BTreeMap::new();
    for body in world.bodies() {
        assert!(bodies.insert(body.id, body).is_none(), "body {} is owned twice", body.id);
    }
    bodies
}

fn bytes(body: &Body) -> &[u8] {
    bytemuck::bytes_of(body)
}

/// Half extents of a body's AABB grown by how it may turn, and by its margin: by as far as it may come in a step, within limits, or by
/// as far as it does along that axis.
fn grown(world: &World, body: &Body) -> DVec2 {
    let (setup, params) = (&world.setup, &world.setup.params);
    let speed = (body.velocity.x * body.velocity.x + body.velocity.y * body.velocity.y).sqrt();
    let any_way = (speed * params.dt).clamp(params.margin_floor, params.margin_cap);
    let margin = (body.velocity.abs() * params.dt).max(Vec2::splat(any_way));
    let kind = setup.kind(body.kind);
    let turns = if kind.not_round > 0.0 { kind.bounding_radius * body.angular_velocity.abs() * params.dt } else { 0.0 };
    let half = (kind.half_extents(body.rotation) + Vec2::splat(turns)).min(Vec2::splat(kind.bounding_radius));
    (half + margin).as_dvec2()
}

/// Whether that box meets the region of a tile grown by so much, with tiles half-open.
fn reaches(world: &World, tile: TileId, body: &Body, far: f64) -> bool {
    let region = world.setup.partition.region(tile);
    let reach = grown(world, body) + DVec2::splat(far);
    let (low, high) = (body.position - reach, body.position + reach);
    low.x < region.max.x && high.x >= region.min.x && low.y < region.max.y && high.y >= region.min.y
}

/// Whether a tile is to have a ghost of a body, whatever else there is.
fn needs(world: &World, tile: TileId, body: &Body) -> bool {
    reaches(world, tile, body, world.setup.halo_of(body.kind, body.velocity))
}

/// Whether a body lies where another may come to that goes far or is large, with so much room in meters.
fn is_reached(world: &World, body: &Body, far: &Body, room: f64) -> bool {
    (world.setup.goes_far(far.velocity) || world.setup.is_large(far.kind)) && boxes_meet(world, body, far, room)
}

fn boxes_meet(world: &World, a: &Body, b: &Body, room: f64) -> bool {
    (a.position - b.position).abs().cmple(grown(world, a) + grown(world, b) + DVec2::splat(room)).all()
}

/// Who owns what, and who has a ghost of whom, after a step, given the bodies before it.
fn check_owners_and_ghosts(world: &World, before: &BTreeMap<GlobalId, Body>) {
    let grid = &world.setup.partition;
    let after = by_name(world);
    assert!(after.keys().eq(before.keys()), "a body was lost or made");
    for tile in world.tile_states() {
        for id in &tile.bodies.id[..tile.owned] {
            let owner = grid.locate(before[id].position);
            assert_eq!(owner, tile.id, "body {id} of tile {owner} is owned by {}", tile.id);
        }
        // A tile that owns nothing solves nothing, and nobody's copy is kept.
        let owned: Vec<_> = tile.bodies.id[..tile.owned].iter().map(|id| before[id]).collect();
        let is_reached = |body: &Body, room: f64| owned.iter().any(|far| is_reached(world, body, far, room));
        let others: Vec<_> = before
            .values()
            .map(|body| (grid.locate(body.position), body))
            .filter(|&(owner, _)| owner != tile.id && !owned.is_empty())
            .collect();
        let ghosts = tile.owned..tile.owned + tile.ghosts();
        let held: Vec<_> =
            tile.ghost_owners.iter().copied().zip(tile.bodies.id[ghosts.clone()].iter().copied()).collect();
        let is_held = |owner, body: &Body| held.contains(&(owner, body.id));
        // Two that go far and meet where nobody is may have nobody to tell of it.
        let may_lack = |body: &Body| world.setup.goes_far(body.velocity);
        let is_wanted = |&(owner, body): &(TileId, &Body)| {
            needs(world, tile.id, body)
                || is_reached(body, -ROUNDING) && !may_lack(body)
                || is_reached(body, ROUNDING) && is_held(owner, body)
        };
        let mut wanted: Vec<_> = others.into_iter().filter(is_wanted).collect();
        wanted.sort_by_key(|&(owner, body)| (owner, body.id));
        let names: Vec<_> = wanted.iter().map(|&(owner, body)| (owner, body.id)).collect();
        assert_eq!(held, names, "ghosts of tile {}", tile.id);
        for (index, (_, body)) in ghosts.zip(wanted) {
            let ghost = tile.bodies.get(index);
            assert_eq!(bytes(&ghost), bytes(body), "the ghost of body {} in tile {} is no copy", body.id, tile.id);
        }
    }
}

/// More than the rounding of a place in a tile's own coordinates, in meters.
const ROUNDING: f64 = 1e-4;

type PairOfNames = (GlobalId, GlobalId);

/// The contacts of a tile's own bodies by the names of both, and the other body's owner.
fn contacts_of(tile: &Tile) -> BTreeMap<PairOfNames, (Option<TileId>, Contact)> {
    let owner = |kind| match kind {
        SlotKind::Owned(_) => Some(tile.id),
        SlotKind::Ghost(ghost) => Some(tile.ghost_owners[ghost]),
        SlotKind::Static(_) => None,
    };
    let own = tile.contacts.iter().filter(|(key, _)| key.is_own());
    own.map(|(key, contact)| (tile.pair_of(key), (owner(key.high().kind()), *contact))).collect()
}

fn without_impulses(contact: &Contact) -> Contact {
    let mut contact = *contact;
    for point in &mut contact.points {
        (point.normal_impulse, point.tangent_impulse) = (0.0, 0.0);
    }
    contact
}

/// Both owners hold every border contact, with one geometry, and in `substep` with the same impulses, given the bodies before the step.
/// Of two that go far and are known to each other's tiles by hearsay alone, one owner may.
fn check_border_contacts(world: &World, before: &BTreeMap<GlobalId, Body>) -> usize {
    let tiles: Vec<_> = world.tile_states().iter().map(|tile| (tile.id, contacts_of(tile))).collect();
    let mut border = 0;
    for (id, contacts) in &tiles {
        for (pair, (peer, contact)) in contacts {
            let Some(peer) = peer.filter(|peer| peer != id) else { continue };
            let theirs = &tiles[peer.0 as usize].1;
            let far = [pair.0, pair.1].map(|id| &before[&id]);
            // A tile reaches what it owns.
            let are_known =
                far.iter().all(|body| needs(world, peer, body)) || far.iter().all(|body| needs(world, *id, body));
            if far.iter().all(|body| world.setup.goes_far(body.velocity)) && !are_known {
                continue;
            }
            let (back, other) =
                theirs.get(pair).unwrap_or_else(|| panic!("tile {peer} does not see {pair:?} of tile {id}"));
            assert_eq!(*back, Some(*id));
            let (mut mine, mut other) = (*contact, *other);
            if world.setup.params.exchange == Exchange::Step {
                (mine, other) = (without_impulses(&mine), without_impulses(&other));
            }
            assert_eq!(
                bytemuck::bytes_of(&mine),
                bytemuck::bytes_of(&other),
                "{pair:?}: {mine:?} in tile {id}, {other:?} in tile {peer}"
            );
            border += 1;
        }
    }
    border
}

/// A contact as its tile stored it: of whom, with whose body, and the impulse upon either body with its moments.
struct Push {
    tile: TileId,
    pair: PairOfNames,
    /// Owners of the two bodies when it was stored.
    owners: [Option<TileId>; 2],
    /// Impulse x, y and moment, upon either body.
    upon: [[f64; 3]; 2],
    /// Either body as the tile knew it then; a static is none.
    bodies: [Option<Body>; 2],
}

/// Every contact held, from the definition of its numbers: a sum over points of normal and tangent impulse at the anchor.
fn pushes(world: &World) -> Vec<Push> {
    let mut pushes = Vec::new();
    for tile in world.tile_states() {
        for (pair, (peer, contact)) in contacts_of(tile) {
            let mut upon = [[0.0; 3]; 2];
            for point in contact.points() {
                let (n, t) = (f64::from(point.normal_impulse), f64::from(point.tangent_impulse));
                let (normal, anchor, offset) =
                    (contact.normal.as_dvec2(), point.anchor.as_dvec2(), contact.offset.as_dvec2());
                let tangent = DVec2::new(normal.y, -normal.x);
                let impulse = normal * n + tangent * t;
                // Friction acts at each surface, half the gap from the anchor.
                let gap = 0.5 * f64::from(point.separation.max(0.0));
                for (sign, arm, sum) in [(-1.0, anchor, 0), (1.0, anchor - offset, 1)] {
                    upon[sum][0] += sign * impulse.x;
                    upon[sum][1] += sign * impulse.y;
                    upon[sum][2] += sign * (arm.perp_dot(normal) * n + (arm.perp_dot(tangent) - sign * gap) * t);
                }
            }
            let owns = |id: GlobalId| tile.bodies.id[..tile.owned].contains(&id);
            let owner = |id: GlobalId| if owns(id) { Some(tile.id) } else { peer };
            let moving = tile.owned + tile.ghosts();
            let row = |id: GlobalId| tile.bodies.id[..moving].iter().position(|known| *known == id);
            let bodies = [pair.0, pair.1].map(|id| row(id).map(|row| tile.bodies.get(row)));
            pushes.push(Push { tile: tile.id, pair, owners: [owner(pair.0), owner(pair.1)], upon, bodies });
        }
    }
    pushes
}

/// Every ghost is given what its owner stored for contacts that the ghost's tile does not solve, by the owners and places that its
/// owner knew: those with partners that are neither that tile's now nor, like the ghost, near it.
fn check_unseen(world: &World, bodies: &BTreeMap<GlobalId, Body>, before: &[Push]) {
    for tile in world.tile_states() {
        let is_near = |body: &Body| world.setup.overlap.is_some_and(|depth| reaches(world, tile.id, body, depth));
        for (unseen, id) in tile.unseen.iter().zip(&tile.bodies.id[tile.owned..]) {
            let (mut wanted, mut size) = ([0.0; 3], 1e-6);
            let body = &bodies[id];
            let owner_now = |id: &GlobalId| bodies.get(id).map(|body| world.setup.partition.locate(body.position));
            let of_body = |push: &&Push| push.pair.0 == *id || push.pair.1 == *id;
            // Of who is gone a tile does not know whether it would have solved what was.
            let comes = |body: &Body| needs(world, tile.id, body) || owner_now(&body.id) == Some(tile.id);
            let is_here = |id: &GlobalId| world.setup.is_static(*id) || bodies.get(id).is_some_and(comes);
            let is_told_all = world.setup.params.exchange == Exchange::Substep && needs(world, tile.id, body);
            let all_here = |push: &Push| [push.pair.0, push.pair.1].iter().all(is_here);
            // Of what goes far others may tell, and tiles may know otherwise.
            let goes_far = |body: &Body| world.setup.goes_far(body.velocity);
            let is_slow = |push: &Push| {
                let now = [push.pair.0, push.pair.1].iter().filter_map(|id| bodies.get(id)).all(|body| !goes_far(body));
                now && push.bodies.iter().flatten().all(|body| !goes_far(body))
            };
            if is_told_all && !before.iter().filter(of_body).all(|push| all_here(push) && is_slow(push)) {
                continue;
            }
            // What was only on the way of somebody is told of by another than its owner, as it is.
            let mut owners = before;
            if !needs(world, tile.id, body) {
                let is_come_to =
                    |large: &Body| world.setup.is_large(large.kind) && boxes_meet(world, body, large, ROUNDING);
                let mut owned = tile.bodies.id[..tile.owned].iter();
                if !owned.any(|large| is_come_to(&bodies[large])) {
                    owners = &[];
                }
                // Who came or has new neighbours may know otherwise of what was, and of who goes far it may be another that tells.
                let moved = |push: &Push| {
                    [push.pair.0, push.pair.1].iter().zip(push.owners).any(|(id, owner)| owner_now(id) != owner)
                };
                let is_far = world.setup.goes_far(body.velocity);
                if !owners.is_empty() && is_far || owners.iter().filter(of_body).any(moved) {
                    continue;
                }
            }
            for push in owners {
                for (me, other) in [(0, 1), (1, 0)] {
                    let names = [push.pair.0, push.pair.1];
                    let name = names[me];
                    // Its owner knows where its own bodies go; a tile that is told of all knows where each is now.
                    let is_own = is_told_all || push.owners[other] == Some(push.tile);
                    let owner = if is_own { owner_now(&names[other]) } else { push.owners[other] };
                    let partner = if is_told_all { bodies.get(&names[other]).copied() } else { push.bodies[other] };
                    let is_seen =
                        owner == Some(tile.id) || is_near(&bodies[id]) && partner.as_ref().is_none_or(is_near);
                    if name == *id && push.owners[me] == Some(push.tile) {
                        for (sum, value) in wanted.iter_mut().zip(push.upon[me]) {
                            *sum += if is_seen { 0.0 } else { value };
                            // What is left out leaves rounding.
                            size += if is_seen && !is_told_all { 0.0 } else { value.abs() };
                        }
                    }
                }
            }
            let given = [unseen.linear.x, unseen.linear.y, unseen.angular].map(f64::from);
            let error = given.iter().zip(wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(error <= 1e-5 * size, "body {id} as a ghost of tile {}: {given:?}, not {wanted:?}", tile.id);
        }
    }
}

/// Every contact of the world with its geometry, each once.
fn all_contacts(world: &World) -> BTreeMap<PairOfNames, Vec<u8>> {
    let contacts = world.tile_states().iter().flat_map(contacts_of);
    contacts.map(|(pair, (_, contact))| (pair, bytemuck::bytes_of(&without_impulses(&contact)).to_vec())).collect()
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn owners_ghosts_and_border_contacts_are_as_defined(scene in any_scene(40, -10.0)) {
        let mut world = scene.world();
        for _ in 0..8 {
            let (before, stored) = (by_name(&world), pushes(&world));
            step(&mut world, &mut Loopback).unwrap();
            check_owners_and_ghosts(&world, &before);
            check_unseen(&world, &before, &stored);
            check_border_contacts(&world, &before);
        }
    }

    /// In the first step no contact has a history: cutting the world into tiles must not change which there are.
    #[test]
    fn tiles_see_the_contacts_that_one_tile_sees(scene in any_scene(60, 0.0)) {
        let (mut whole, mut cut) = (scene.on_one_tile().world(), scene.world());
        let counted = step(&mut whole, &mut Loopback).unwrap();
        let report = step(&mut cut, &mut Loopback).unwrap();
        // A static that only lies on the way of what goes far is forgotten where it is far from the tile.
        let goes_far = |id| scene.bodies.iter().any(|body| body.id == id && whole.setup.goes_far(body.velocity));
        // And two that go far may meet where nobody is.
        let is_lasting =
            |(low, high): &PairOfNames| !(goes_far(*high) && (whole.setup.is_static(*low) || goes_far(*low)));
        let lasting = |world: &World| {
            let mut contacts = all_contacts(world);
            contacts.retain(|pair, _| is_lasting(pair));
            contacts
        };
        prop_assert_eq!(lasting(&cut), lasting(&whole));
        let before = scene.bodies.iter().map(|body| (body.id, *body)).collect();
        let held = check_border_contacts(&cut, &before) as u64;
        if all_contacts(&whole).keys().all(|(low, high)| !(goes_far(*low) && goes_far(*high))) {
            prop_assert_eq!(report.contacts, counted.contacts, "each contact is counted once");
            prop_assert_eq!(report.border_contacts * 2, held);
        } else {
            prop_assert!(report.contacts <= counted.contacts && report.border_contacts * 2 >= held);
        }
    }
}
