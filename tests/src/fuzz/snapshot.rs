//! Blocks of saved tiles, as `World::restore` reads them.

use super::assert_one_line;
use crate::scenes;
use crate::world::Scene;
use atoll_core::{Exchange, Hashes, Loopback, RestoreError, SNAPSHOT_FORMAT, TileId, World, step};
use xxhash_rust::xxh3::xxh3_64;

/// Where the checksum of a block ends and what it is of begins.
const CHECKSUM_END: usize = 16;
/// Length of the header of a block; its last 32 bytes are the hashes.
pub const BLOCK_HEADER: usize = 64;

const TILES: (u32, u32) = (2, 2);
const TILE: TileId = TileId(0);

/// A world to restore the first of four tiles to.
pub fn fresh() -> World {
    let scene = Scene { bodies: Vec::new(), ..scenes::pile(4, 4) };
    World::new(&scene.blueprint(TILES, Exchange::Step), &[TILE]).expect("a world that can be built")
}

/// A block of that tile as it should be, with bodies, ghosts and contacts of every sort.
pub fn block() -> Vec<u8> {
    let mut sim = scenes::pile(4, 4).start_on(TILES, Exchange::Step);
    sim.run(40);
    let mut bytes = Vec::new();
    let saved = sim.world.save(&mut bytes);
    assert!(saved[0].tile == TILE && saved[0].bodies > 2 && saved[0].contacts > 2, "{saved:?}");
    bytes.truncate(saved[0].length);
    bytes
}

/// Writes format, tile and checksum as whoever saves would have written them.
pub fn seal(block: &mut [u8]) {
    if block.len() >= CHECKSUM_END {
        let checksum = xxh3_64(&block[CHECKSUM_END..]);
        block[..4].copy_from_slice(&SNAPSHOT_FORMAT.to_le_bytes());
        block[4..8].copy_from_slice(&TILE.0.to_le_bytes());
        block[8..CHECKSUM_END].copy_from_slice(&checksum.to_le_bytes());
    }
}

fn restored(block: &[u8]) -> Result<World, RestoreError> {
    let mut world = fresh();
    world.restore(TILE, block).map(|()| world)
}

/// A block is refused in one line. One that was sealed anew, with the hashes of what is in it, is refused or means what
/// it says: saved again it is the same bytes, and a world can be stepped from there, if not to any sense.
pub fn snapshot(bytes: &[u8]) -> bool {
    if let Err(error) = restored(bytes) {
        assert_one_line(error);
    }
    let mut forged = bytes.to_vec();
    seal(&mut forged);
    let mut result = restored(&forged);
    if let Err(RestoreError::Hashes { restored: Hashes { state, contact }, .. }) = result {
        forged[BLOCK_HEADER - 32..BLOCK_HEADER].copy_from_slice(&[state, contact].map(u128::to_le_bytes).concat());
        seal(&mut forged);
        result = restored(&forged);
    }
    match result {
        Err(error) => {
            assert_one_line(error);
            false
        }
        Ok(mut world) => {
            let mut again = Vec::new();
            world.save(&mut again);
            assert!(again == forged, "{forged:02x?} were taken for {again:02x?}");
            // It may fail, and must not panic.
            let _ = (0..2).try_for_each(|_| step(&mut world, &mut Loopback).map(|_| ()));
            true
        }
    }
}
