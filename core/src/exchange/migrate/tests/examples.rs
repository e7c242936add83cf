//! Worlds of two tiles and a few discs, of which all is known.

use super::{PairOfNames, contacts_of};
use crate::Loopback;
use crate::exchange::halo::Halo;
use crate::exchange::mail::{Inbox, Mailbag, Outbox};
use crate::exchange::migrate::{MigrateWork, receive, send};
use crate::exchange::record::Unseen;
use crate::model::body::Body;
use crate::model::contact::{Contact, ContactPoint, PairKey, Slot};
use crate::model::id::{GlobalId, KindId, TileId};
use crate::model::kind::Kind;
use crate::model::math::Rot;
use crate::model::params::{Exchange, Params};
use crate::testing::circle;
use crate::tiling::blueprint::{Blueprint, Setup};
use crate::tiling::partition::Partition;
use crate::tiling::tile::Tile;
use crate::world::World;
use crate::{StepError, step};
use glam::{DVec2, Vec2};
use std::convert::Infallible;

fn two_tiles(exchange: Exchange, kinds: Vec<Kind>) -> Blueprint {
    let partition = Partition::uniform(DVec2::new(-10.0, -10.0), DVec2::new(10.0, 10.0), 2, 1).unwrap();
    Blueprint { params: Params { exchange, ..Params::default() }, partition, kinds, statics: vec![] }
}

fn disc(id: u64, x: f64, y: f64, vx: f32) -> Body {
    Body {
        id: GlobalId(id),
        position: DVec2::new(x, y),
        rotation: Rot::IDENTITY,
        velocity: Vec2::new(vx, 0.0),
        angular_velocity: 0.0,
        kind: KindId(0),
    }
}

#[test]
fn a_tile_has_little_more_room_than_bodies() {
    let mut blueprint = two_tiles(Exchange::Step, vec![circle(0.01)]);
    blueprint.params.sort_interval = 3;
    let mut world = World::whole(&blueprint).unwrap();
    // Discs in rows, every other one of which goes to the right, and none of which touches another.
    for i in 0..8000_u32 {
        let (column, row) = (i % 200, i / 200);
        let speed = if row % 2 == 0 { 8.0 } else { -8.0 };
        world.add(disc(i.into(), 0.09 * f64::from(column) - 9.0, 0.45 * f64::from(row) - 9.0, speed)).unwrap();
    }
    let mut migrations = 0;
    for _ in 0..10 {
        migrations += step(&mut world, &mut Loopback).unwrap().migrations;
        for tile in world.tile_states() {
            let (bodies, room) = (tile.bodies.len(), tile.bodies.velocity.capacity());
            assert!(bodies > 3000 && room <= bodies * 5 / 4, "{bodies} bodies and room for {room}");
        }
    }
    assert!(migrations > 100, "{migrations}");
}

/// The contact of a pair as each tile holds it.
fn impulses(world: &World, pair: PairOfNames) -> Vec<Option<f32>> {
    let tiles = world.tile_states().iter();
    tiles.map(|tile| contacts_of(tile).get(&pair).map(|(_, contact)| contact.points[0].normal_impulse)).collect()
}

#[test]
fn a_contact_migrates_with_its_impulses() {
    // Two discs pressed together drift over the border: first one crosses, then the other. The impulse of a step is
    // the next one's start, wherever it is made.
    for exchange in [Exchange::Step, Exchange::Substep] {
        let blueprint = two_tiles(exchange, vec![circle(0.5)]);
        let mut world = World::new(&blueprint, &[TileId(0), TileId(1)]).unwrap();
        let pair = (GlobalId(1), GlobalId(2));
        // Overlapping a little, so that they stay in contact; the left one pushes the right one along.
        for body in [disc(1, -1.60, 0.0, 2.4), disc(2, -0.61, 0.0, 2.0)] {
            world.add(body).unwrap();
        }
        let mut seen = Vec::new();
        for _ in 0..90 {
            step(&mut world, &mut Loopback).unwrap();
            let held = impulses(&world, pair);
            let holders = [held[0].is_some(), held[1].is_some()];
            if holders != [false, false] && seen.last() != Some(&holders) {
                seen.push(holders);
            }
        }
        assert_eq!(seen, [[true, false], [true, true], [false, true]], "{exchange:?}");
    }
}

/// Two tiles of one border contact, as a step leaves them, and how far each body then moves; the marks tell the two
/// copies of the contact apart. Gives what either tile remembers of the contact after the next exchange.
fn exchange_by_hand(moves: [f64; 2], marks: [f32; 2]) -> [Option<f32>; 2] {
    let setup = Setup::new(&two_tiles(Exchange::Step, vec![circle(0.5)])).unwrap();
    let bodies = [disc(1, -0.3, 0.0, 0.0), disc(2, 0.3, 0.0, 0.0)];
    let mut tiles = [0, 1].map(|id| Tile::new(TileId(id), &setup));
    for (i, tile) in tiles.iter_mut().enumerate() {
        tile.bodies.push(Body { position: bodies[i].position + DVec2::new(moves[i], 0.0), ..bodies[i] });
        tile.bodies.push(bodies[1 - i]);
        tile.owned = 1;
        tile.unseen.push(Unseen::default());
        tile.ghost_owners.push(TileId(1 - i as u32));
        let mut contact: Contact = bytemuck::Zeroable::zeroed();
        contact.points[1].feature = ContactPoint::ABSENT;
        contact.points[0].normal_impulse = marks[i];
        tile.contacts.push(PairKey::new(Slot::from_index(0, 1, 1), Slot::from_index(1, 1, 1)), contact);
    }
    let mut outbox = Outbox { bags: vec![Mailbag::default(); 2], ..Outbox::default() };
    let mut inbox = Inbox::new([TileId(0), TileId(1)].into_iter(), 2, 1);
    let mut work = MigrateWork::default();
    for (tile, bag) in tiles.iter_mut().zip(&mut outbox.bags) {
        send(tile, bag, &mut work, &setup);
    }
    assert_eq!(outbox.deliver(&mut inbox), None);
    inbox.end(&mut outbox);
    let mut remembered = [None; 2];
    for (i, tile) in tiles.iter_mut().enumerate() {
        receive(tile, inbox.mail(i), &mut work, &setup, 0);
        remembered[i] =
            tile.strays.find((GlobalId(1), GlobalId(2)), true).map(|contact| contact.points[0].normal_impulse);
    }
    remembered
}

#[test]
fn of_two_entries_that_of_the_lower_bodys_owner_wins() {
    let (mine, theirs) = (5.0, 7.0);
    // Nobody moves: each remembers its own.
    assert_eq!(exchange_by_hand([0.0, 0.0], [mine, theirs]), [Some(mine), Some(theirs)]);
    // Body 1 joins body 2, and the entry comes with it; tile 0 keeps one that no body of its own needs.
    assert_eq!(exchange_by_hand([0.4, 0.0], [mine, theirs])[1], Some(mine));
    // Body 2 joins body 1, whose tile knows better.
    assert_eq!(exchange_by_hand([0.0, -0.4], [mine, theirs])[0], Some(mine));
    // They change places: both end up with the entry of the tile that owned body 1.
    assert_eq!(exchange_by_hand([0.4, -0.4], [mine, theirs]), [Some(mine), Some(mine)]);
}

/// A halo that loses what one sync point carries.
struct Lossy {
    loses: (u64, u32),
}

impl Halo for Lossy {
    type Error = Infallible;

    fn exchange(&mut self, outbox: &mut Outbox, inbox: &mut Inbox) -> Result<(), Self::Error> {
        if outbox.moment() == self.loses {
            inbox.hear(outbox.verdict());
        } else {
            let _ = outbox.deliver(inbox);
        }
        Ok(())
    }
}

#[test]
fn a_lost_message_is_noticed() {
    let blueprint = two_tiles(Exchange::Substep, vec![circle(0.5)]);
    let outcome = |loses| {
        let mut world = World::new(&blueprint, &[TileId(0), TileId(1)]).unwrap();
        for body in [disc(1, -0.45, 0.0, 1.0), disc(2, 0.45, 0.0, -1.0)] {
            world.add(body).unwrap();
        }
        let mut halo = Lossy { loses };
        (0..3).try_for_each(|_| step(&mut world, &mut halo).map(|_| ()))
    };
    assert_eq!(outcome((9, 0)), Ok(()));
    // A substep's refresh of the ghosts.
    assert_eq!(outcome((1, 2)), Err(StepError::Protocol { step: 1, tile: TileId(0) }));
}

#[test]
fn a_pair_that_one_tile_knows_of_by_hearsay_ends_no_run() {
    // Disc 4 goes over the tile of disc 3, which therefore tells its own tile of that one; there disc 2 meets it. The tile of disc 3
    // hears nothing of disc 2.
    let side = 3.86;
    let partition = Partition::uniform(DVec2::ZERO, DVec2::new(4.0 * side, 5.0 * side), 4, 5).unwrap();
    for exchange in [Exchange::Step, Exchange::Substep] {
        let params = Params { exchange, ..Params::default() };
        let kinds = vec![circle(1.0)];
        let mut world =
            World::whole(&Blueprint { params, partition: partition.clone(), kinds, statics: vec![] }).unwrap();
        for (id, place, velocity) in [
            (4, DVec2::new(7.80, 8.67), Vec2::new(-220.9, 300.5)),
            (3, DVec2::new(2.71, 2.05), Vec2::new(172.6, 189.0)),
            (2, DVec2::new(7.92, 9.80), Vec2::new(-106.5, -171.5)),
        ] {
            world.add(Body { velocity, ..disc(id, place.x, place.y, 0.0) }).unwrap();
        }
        let pair = (GlobalId(2), GlobalId(3));
        step(&mut world, &mut Loopback).unwrap();
        let known = world.tile_states().iter().filter(|tile| contacts_of(tile).contains_key(&pair)).count();
        assert_eq!(known, 1, "{exchange:?}: the pair is not that of which this is to tell");
        for _ in 0..10 {
            step(&mut world, &mut Loopback).unwrap();
        }
    }
}
