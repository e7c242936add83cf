//! Blocks of saved tiles, as `World::restore` reads them.

use super::Outcome;
use crate::scenes;
use crate::world::Scene;
use atoll_core::{Body, Contact, Exchange, Hashes, Loopback, RestoreError, SNAPSHOT_FORMAT, TileId, World, step};
use xxhash_rust::xxh3::xxh3_64;

/// Where things stand in a block, in bytes.
#[derive(Debug)]
pub struct BlockLayout {
    /// Where the header has the checksum.
    pub checksum: usize,
    /// Where it has four counts, which the checksum is of, as it is of all that follows.
    pub counts: usize,
    /// Where it has the hashes.
    pub hashes: usize,
    /// Its length.
    pub header: usize,
    /// Bytes of a body, of a time of rest, of a ghost, of a contact and its key: what the counts are of, in that order.
    pub records: [usize; 4],
}

/// After the description of the format alone.
pub const BLOCK: BlockLayout = BlockLayout {
    checksum: 8,
    counts: 16,
    hashes: 32,
    header: 64,
    records: [size_of::<Body>(), 4, size_of::<Body>() + size_of::<TileId>(), 8 + size_of::<Contact>()],
};

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
    let BlockLayout { checksum: place, counts, .. } = BLOCK;
    if block.len() >= counts {
        let checksum = xxh3_64(&block[counts..]);
        block[..4].copy_from_slice(&SNAPSHOT_FORMAT.to_le_bytes());
        block[4..place].copy_from_slice(&TILE.0.to_le_bytes());
        block[place..counts].copy_from_slice(&checksum.to_le_bytes());
    }
}

fn restored(block: &[u8]) -> Result<World, RestoreError> {
    let mut world = fresh();
    world.restore(TILE, block).map(|()| world)
}

/// A block is refused in one line. One that was sealed anew, with the hashes of what is in it, is refused or means what
/// it says: saved again it is the same bytes, and a world can be stepped from there, if not to any sense.
pub fn snapshot(bytes: &[u8]) -> Outcome<RestoreError> {
    let mut outcome = Outcome::of(restored(bytes));
    let mut forged = bytes.to_vec();
    seal(&mut forged);
    let mut result = restored(&forged);
    if let Err(RestoreError::Hashes { restored: Hashes { state, contact }, .. }) = result {
        outcome.refusals.extend(Outcome::of(result).refusals);
        forged[BLOCK.hashes..BLOCK.header].copy_from_slice(&[state, contact].map(u128::to_le_bytes).concat());
        seal(&mut forged);
        result = restored(&forged);
    }
    if let Ok(world) = &mut result {
        let mut again = Vec::new();
        world.save(&mut again);
        assert!(again == forged, "{forged:02x?} were taken for {again:02x?}");
        // It may fail, and must not panic.
        let _ = (0..2).try_for_each(|_| step(world, &mut Loopback).map(|_| ()));
    }
    let Outcome { accepted, refusals } = Outcome::of(result);
    outcome.refusals.extend(refusals);
    Outcome { accepted, ..outcome }
}
