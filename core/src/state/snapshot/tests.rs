//! Blocks there and back, and bytes that are no blocks. That a run goes on as if it had never stopped is tested with
//! several ranks, on the outside.

use super::{HEADER, SNAPSHOT_FORMAT, SavedTile, UNCHECKED, checksum};
use crate::Loopback;
use crate::model::body::{Body, StaticBody};
use crate::model::id::{GlobalId, KindId, TileId};
use crate::model::math::Rot;
use crate::model::params::Params;
use crate::state::hash::Hashes;
use crate::state::snapshot::RestoreError;
use crate::step::step;
use crate::testing::{circle, rectangle};
use crate::tiling::blueprint::Blueprint;
use crate::tiling::partition::Partition;
use crate::tiling::tile::Tile;
use crate::world::World;
use glam::{DVec2, Vec2};

const FLOOR: GlobalId = GlobalId(0);

/// Boxes and discs on a floor, close together.
fn blueprint(columns: u32, sleep: bool) -> Blueprint {
    let params = Params { gravity: Vec2::new(0.0, -10.0), sleep, ..Params::default() };
    let partition = Partition::uniform(DVec2::new(-4.0, -1.0), DVec2::new(4.0, 4.0), columns, 1).unwrap();
    let floor = StaticBody::new(FLOOR, rectangle(20.0, 2.0), DVec2::new(0.0, -1.0));
    Blueprint { params, partition, kinds: vec![circle(0.25), rectangle(0.5, 0.5)], statics: vec![floor] }
}

fn empty(blueprint: &Blueprint) -> World {
    let tiles: Vec<_> = (0..blueprint.partition.tiles() as u32).map(TileId).collect();
    World::new(blueprint, &tiles).unwrap()
}

/// After some steps: with several columns there are contacts over the borders, with sleep some bodies rest.
fn world(columns: u32, sleep: bool) -> World {
    let mut world = empty(&blueprint(columns, sleep));
    for k in 0..8 {
        let body = Body {
            id: GlobalId(20 - k),
            position: DVec2::new(0.51 * (k % 4) as f64 - 0.7, 0.25 + 0.51 * (k / 4) as f64),
            rotation: Rot::IDENTITY,
            velocity: Vec2::new(0.0, -0.1),
            angular_velocity: 0.0,
            kind: KindId(u32::from(k % 3 > 0)),
        };
        assert!(world.add(body).unwrap());
    }
    for _ in 0..10 {
        step(&mut world, &mut Loopback).unwrap();
    }
    world
}

/// The worlds that the tests look at, each with a fresh one to restore it to. Together they have all there can be.
fn worlds() -> [(World, World); 2] {
    let worlds =
        [(2, false), (1, true)].map(|(columns, sleep)| (world(columns, sleep), empty(&blueprint(columns, sleep))));
    let halves = worlds[0].0.tile_states();
    let border = |tile: &Tile| tile.contacts.keys.iter().any(|key| key.is_border());
    assert!(halves.iter().all(|tile| tile.owned > 2 && tile.ghosts() > 2 && border(tile) && tile.statics.len() == 1));
    let still = worlds[1].0.tile_states()[0].sleep.still();
    assert!(still.len() == 8 && still.iter().any(|&still| still > 0.0));
    worlds
}

fn save(world: &World) -> (Vec<SavedTile>, Vec<u8>) {
    let mut bytes = Vec::new();
    let saved = world.save(&mut bytes);
    (saved, bytes)
}

/// The block of a world's first tile.
fn block_of(world: &World) -> Vec<u8> {
    let (saved, mut bytes) = save(world);
    bytes.truncate(saved[0].length);
    bytes
}

fn restore_all(world: &mut World, saved: &[SavedTile], bytes: &[u8]) {
    let mut rest = bytes;
    for tile in saved {
        world.restore(tile.tile, rest.split_off(..tile.length).unwrap()).unwrap();
    }
    assert!(rest.is_empty());
}

/// Makes the checksum right again.
fn seal(block: &mut [u8]) {
    let checksum = checksum(block).to_le_bytes();
    block[UNCHECKED - checksum.len()..UNCHECKED].copy_from_slice(&checksum);
}

/// Makes the hashes in the header those of what is in the block, and the checksum right.
fn seal_as(block: &mut [u8], hashes: Hashes) {
    let both = [hashes.state, hashes.contact].map(u128::to_le_bytes).concat();
    block[HEADER - both.len()..HEADER].copy_from_slice(&both);
    seal(block);
}

#[test]
fn a_restored_world_is_what_it_was_when_saved() {
    for (original, mut restored) in worlds() {
        let (saved, bytes) = save(&original);
        assert!(saved.iter().map(|tile| tile.tile).eq(original.tiles()));
        assert_eq!(saved.iter().map(|tile| tile.hashes).reduce(Hashes::merge), Some(original.hashes()));
        assert_eq!(saved.iter().map(|tile| tile.bodies).sum::<u64>(), 8);
        let contacts = original.tile_states().iter().map(|tile| tile.contacts.len() as u64);
        assert!(saved.iter().map(|tile| tile.contacts).eq(contacts));

        restore_all(&mut restored, &saved, &bytes);
        restored.resume_at(original.step_count());
        assert_eq!(restored.hashes(), original.hashes());
        assert!(restored.bodies().eq(original.bodies()));
        assert!(save(&restored) == (saved, bytes), "saved again it is something else");
        // Whatever it was before.
        let (saved, bytes) = save(&original);
        for _ in 0..5 {
            step(&mut restored, &mut Loopback).unwrap();
        }
        assert_ne!(restored.hashes(), original.hashes());
        let touching = |world: &World| original.bodies().map(|body| world.touching(body.id)).collect::<Vec<_>>();
        original.bodies().for_each(|body| assert!(restored.remove(body.id)));
        restore_all(&mut restored, &saved, &bytes);
        restored.resume_at(original.step_count());
        assert_eq!(touching(&restored), touching(&original), "bodies are there again");
        assert!(save(&restored) == (saved, bytes), "something of the old tile is left");
    }
}

#[test]
fn whatever_was_in_the_memory_is_replaced() {
    let (original, _) = &worlds()[0];
    let (saved, bytes) = save(original);
    for used in [0, 3, bytes.len(), 2 * bytes.len()] {
        let mut blocks = vec![0xee; used];
        assert_eq!(original.save(&mut blocks), saved);
        assert!(blocks == bytes);
    }
}

#[test]
fn a_block_is_as_small_as_promised() {
    let lengths = |world: &World| save(world).0.iter().map(|tile| tile.length).collect::<Vec<_>>();
    assert_eq!(lengths(&empty(&blueprint(2, false))), [64, 64]);
    let (halves, _) = &worlds()[0];
    let expected = halves.tile_states().iter().map(|t| 64 + 48 * t.owned + 52 * t.ghosts() + 88 * t.contacts.len());
    assert_eq!(lengths(halves), expected.collect::<Vec<_>>());
}

#[test]
fn any_bit_changed_is_noticed() {
    for (original, mut restored) in worlds() {
        let block = block_of(&original);
        for bit in 0..8 * block.len() {
            let mut changed = block.clone();
            changed[bit / 8] ^= 1 << (bit % 8);
            assert!(restored.restore(TileId(0), &changed).is_err(), "bit {} of byte {}", bit % 8, bit / 8);
        }
        assert_eq!(restored.bodies().count(), 0, "a block that is refused leaves nothing behind");
    }
}

#[test]
fn a_block_that_is_cut_short_or_goes_on_is_refused() {
    for (original, mut restored) in worlds() {
        let block = block_of(&original);
        let length_is_wrong = |result| matches!(result, Err(RestoreError::Length { tile: TileId(0), .. }));
        for length in 0..block.len() {
            let mut cut = block[..length].to_vec();
            assert!(length_is_wrong(restored.restore(TileId(0), &cut)), "{length} bytes");
            if length > UNCHECKED {
                seal(&mut cut);
                assert!(length_is_wrong(restored.restore(TileId(0), &cut)), "{length} bytes, sealed");
            }
        }
        for extra in 1..100 {
            let mut longer = block.clone();
            longer.resize(block.len() + extra, 0);
            seal(&mut longer);
            assert!(length_is_wrong(restored.restore(TileId(0), &longer)), "{extra} bytes more");
        }
    }
}

/// Not even who knows how blocks are made gets more than a tile out of one.
#[test]
fn a_forged_block_is_refused_or_is_what_it_says() {
    let (mut refused, mut accepted) = (0, 0);
    for (original, mut restored) in worlds() {
        let block = block_of(&original);
        for byte in UNCHECKED..block.len() {
            let change = [1, 0x80, 0xff][byte % 3];
            let mut forged = block.clone();
            forged[byte] ^= change;
            seal(&mut forged);
            let mut result = restored.restore(TileId(0), &forged);
            if let Err(RestoreError::Hashes { restored: hashes, .. }) = result {
                seal_as(&mut forged, hashes);
                result = restored.restore(TileId(0), &forged);
            }
            if let Err(error) = result {
                assert!(error.to_string().starts_with("saved tile 0: "), "{error}");
                refused += 1;
                continue;
            }
            assert!(block_of(&restored) == forged, "byte {byte} changed by {change:#x}");
            // What comes of it may fail, but must not panic.
            let _ = (0..2).try_for_each(|_| step(&mut restored, &mut Loopback).map(|_| ()));
            restored = empty(&blueprint(original.tile_states().len() as u32, original.setup.params.sleep));
            accepted += 1;
        }
    }
    assert!(refused > 100 && accepted > 1000, "{refused} refused, {accepted} accepted");
}

#[test]
fn noise_is_refused() {
    let (original, mut restored) = worlds().into_iter().next().unwrap();
    let block = block_of(&original);
    let mut state = 1_u64;
    let mut next = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        state >> 33
    };
    for round in 0..20_000 {
        let kept = [0, UNCHECKED, 32, HEADER][round % 4];
        let length = if round % 3 == 0 { block.len() } else { kept + next() as usize % 300 };
        let mut noise: Vec<u8> = block.iter().copied().take(kept).collect();
        noise.resize_with(length, || next() as u8);
        if length > UNCHECKED {
            seal(&mut noise);
        }
        assert!(restored.restore(TileId(0), &noise).is_err(), "{noise:02x?}");
    }
}

#[test]
fn what_does_not_fit_is_named() {
    let [(halves, _), (sleeper, _)] = worlds();
    // A tile with something done to it before it is saved, against a world that knows better.
    let error = |columns: u32, sleep: bool, change: &dyn Fn(&mut Tile)| {
        let mut changed = world(columns, sleep);
        change(&mut changed.tile_states_mut()[0]);
        empty(&blueprint(columns, sleep)).restore(TileId(0), &block_of(&changed)).unwrap_err()
    };
    let tile = TileId(0);
    let body = |change: &dyn Fn(&mut Tile)| error(2, false, change);
    let id = halves.tile_states()[0].bodies.id[1];
    assert_eq!(body(&|t| t.bodies.kind[1] = KindId(2)), RestoreError::BadBody { tile, id });
    assert_eq!(body(&|t| t.bodies.velocity[1].x = f32::NAN), RestoreError::BadBody { tile, id });
    assert_eq!(body(&|t| t.bodies.position[1].y = f64::INFINITY), RestoreError::BadBody { tile, id });
    assert_eq!(body(&|t| t.bodies.id[1] = FLOOR), RestoreError::BadBody { tile, id: FLOOR });

    let owned = halves.tile_states()[0].owned;
    let id = halves.tile_states()[0].bodies.id[owned + 1];
    for owner in [TileId(0), TileId(2)] {
        assert_eq!(error(2, false, &|t| t.ghost_owners[1] = owner), RestoreError::BadGhost { tile, id });
    }
    assert_eq!(body(&|t| t.bodies.id[owned + 1] = FLOOR), RestoreError::BadGhost { tile, id: FLOOR });
    let first = halves.tile_states()[0].bodies.id[owned];
    assert_eq!(body(&|t| t.bodies.id.swap(owned, owned + 1)), RestoreError::BadGhost { tile, id: first });

    let bad = RestoreError::BadContact { tile, contact: 1 };
    assert_eq!(body(&|t| t.contacts.keys.swap(0, 1)), bad);
    assert_eq!(body(&|t| t.contacts.keys[1] = t.contacts.keys[0]), bad);
    assert_eq!(body(&|t| t.contacts.contacts[1].points[0].normal_impulse = f32::INFINITY), bad);

    let rest = |change: &dyn Fn(&mut Tile)| error(1, true, change);
    assert_eq!(rest(&|t| t.sleep = crate::islands::sleep::Sleep::of(vec![0.5, -1.0])), RestoreError::BadRest { tile });
    assert_eq!(rest(&|t| t.sleep = crate::islands::sleep::Sleep::of(vec![f32::NAN])), RestoreError::BadRest { tile });
    let result = empty(&blueprint(1, false)).restore(tile, &block_of(&sleeper));
    assert_eq!(result, Err(RestoreError::BadRest { tile }));

    // The right block at the wrong place, of the wrong version, for the wrong world.
    let block = block_of(&halves);
    let mut world = World::new(&blueprint(2, false), &[TileId(1)]).unwrap();
    assert_eq!(world.restore(tile, &block), Err(RestoreError::NotHere { tile }));
    let found = RestoreError::OtherTile { tile: TileId(1), found: tile };
    assert_eq!(world.restore(TileId(1), &block), Err(found));
    let mut later = block.clone();
    later[0] += 1;
    let found = RestoreError::Version { tile, found: SNAPSHOT_FORMAT + 1, expected: SNAPSHOT_FORMAT };
    assert_eq!(empty(&blueprint(2, false)).restore(tile, &later), Err(found));
    let mut other = blueprint(2, false);
    other.statics[0].id = GlobalId(1);
    let result = empty(&other).restore(tile, &block);
    assert!(matches!(result, Err(RestoreError::Hashes { tile: TileId(0), .. })), "{result:?}");
}

/// A slot counts from the first of its sort; none may count past the last.
#[test]
fn contacts_of_bodies_that_are_not_there_are_refused() {
    let (original, mut restored) = worlds().into_iter().next().unwrap();
    let tile = &original.tile_states()[0];
    let block = block_of(&original);
    let last = tile.contacts.own() - 1;
    let at = block.len() - 88 * tile.contacts.len() + 8 * last;
    let (owned, ghosts) = (tile.owned as u64, tile.ghosts() as u64);
    let (ghost, fixed) = (1 << 30, 1 << 31);
    let mut restore = |low: u64, high: u64| {
        let mut forged = block.clone();
        forged[at..at + 8].copy_from_slice(&(low << 32 | high).to_le_bytes());
        seal(&mut forged);
        restored.restore(TileId(0), &forged)
    };
    let low = owned - 1;
    for high in [ghost + ghosts - 1, fixed] {
        assert!(!matches!(restore(low, high), Err(RestoreError::BadContact { .. })), "{high:x}");
    }
    for (low, high) in
        [(low, owned), (low, low), (low, ghost + ghosts), (low, fixed + 1), (owned, ghost), (ghost + 1, ghost)]
    {
        let refused = Err(RestoreError::BadContact { tile: TileId(0), contact: last });
        assert_eq!(restore(low, high), refused, "{low:x}, {high:x}");
    }
}
