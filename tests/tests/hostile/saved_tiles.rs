//! Blocks of saved tiles.

use crate::memory::asked;
use crate::random::{
    GREED, below, change_bits, change_number, change_the_end, noise, number, one_of, overwrite, rounds,
};
use crate::tally::Tally;
use atoll::scene::SplitMix64;
use atoll_core::{RestoreError, TileId};
use atoll_tests::fuzz::{self, BLOCK};

/// Every kind of refusal that a block can meet. Not among them are those about which tile is asked for, which is not said
/// by the block.
const KINDS: [&str; 9] =
    ["version", "other tile", "length", "damaged", "bad body", "bad rest", "bad ghost", "bad contact", "hashes"];

fn kind(error: &RestoreError) -> &'static str {
    match error {
        RestoreError::NotHere { .. } | RestoreError::NotToBeTaken { .. } => "not here",
        RestoreError::Version { .. } => KINDS[0],
        RestoreError::OtherTile { .. } => KINDS[1],
        RestoreError::Length { .. } => KINDS[2],
        RestoreError::Damaged { .. } => KINDS[3],
        RestoreError::BadBody { .. } => KINDS[4],
        RestoreError::BadRest { .. } => KINDS[5],
        RestoreError::BadGhost { .. } => KINDS[6],
        RestoreError::BadContact { .. } => KINDS[7],
        RestoreError::Hashes { .. } => KINDS[8],
    }
}

/// Where the header has the count of bodies, of times of rest, of ghosts, or of contacts.
fn place_of_count(which: usize) -> usize {
    BLOCK.counts + 4 * which
}

/// Lets some records of one sort be told of as records of another, so that lengths add up as before.
fn recount(random: &mut SplitMix64, block: &mut [u8]) {
    let (from, to) = loop {
        let (from, to) = (below(random, 4), below(random, 4));
        if from != to && (1..=count(block, from)).any(|gone| fits(gone, from, to)) {
            break (from, to);
        }
    };
    let ways: Vec<usize> = (1..=count(block, from)).filter(|&gone| fits(gone, from, to)).collect();
    let gone = one_of(random, &ways);
    let more = count(block, to) + gone * BLOCK.records[from] / BLOCK.records[to];
    overwrite(block, place_of_count(from), (count(block, from) - gone) as u32);
    overwrite(block, place_of_count(to), more as u32);
}

fn count(block: &[u8], which: usize) -> usize {
    number(block, place_of_count(which)) as usize
}

/// Whether some records of one sort take as many bytes as some of another.
fn fits(records: usize, from: usize, to: usize) -> bool {
    (records * BLOCK.records[from]).is_multiple_of(BLOCK.records[to])
}

/// A saved tile that was changed in one of many ways, and of what kind the refusal must be once it is sealed anew, if there
/// is one of which that can be said.
fn saved_tile(random: &mut SplitMix64, genuine: &[u8]) -> (Vec<u8>, Option<&'static str>) {
    let mut bytes = genuine.to_vec();
    let few = 1 + below(random, 600);
    let mut must = Some("length");
    match below(random, 8) {
        // Of that length, whatever the counts are.
        0 => bytes = noise(random, few),
        1 => bytes.truncate(below(random, genuine.len())),
        2 => bytes.extend(noise(random, few)),
        3 => {
            let at = place_of_count(below(random, 4));
            let greedy = one_of(random, &GREED);
            assert_ne!(number(&bytes, at), greedy, "that changes nothing");
            overwrite(&mut bytes, at, greedy);
        }
        other => {
            must = None;
            match other {
                // Any field of the header.
                4 => {
                    let at = 4 * below(random, BLOCK.header / 4);
                    change_number(random, &mut bytes, at);
                }
                5 => recount(random, &mut bytes),
                6 => change_the_end(random, &mut bytes),
                _ => change_bits(random, &mut bytes, genuine.len()),
            }
        }
    }
    (bytes, must)
}

/// What restoring a block of some length may cost.
fn allowed(length: usize) -> usize {
    8 * length + 1024
}

#[test]
fn saved_tiles_that_were_changed() {
    let mut random = SplitMix64::after(5, 0);
    let genuine = fuzz::block();
    assert!(fuzz::snapshot(&genuine).accepted);
    let records = (0..4).map(|which| count(&genuine, which) * BLOCK.records[which]);
    assert_eq!(BLOCK.header + records.sum::<usize>(), genuine.len(), "the layout is another one");
    let mut tally = Tally::default();
    for round in 0..rounds(50_000) {
        let (mut bytes, must) = saved_tile(&mut random, &genuine);
        tally.count(&fuzz::snapshot(&bytes), kind);
        fuzz::seal(&mut bytes);
        let mut world = fuzz::fresh();
        let (asked, result) = asked(|| world.restore(TileId(0), &bytes));
        assert!(asked <= allowed(bytes.len()), "round {round}: {asked} bytes for {}: {bytes:02x?}", bytes.len());
        if let Some(must) = must {
            let refused = result.as_ref().err().map(kind);
            assert_eq!(refused, Some(must), "round {round}: {result:?}: {bytes:02x?}");
        }
    }
    tally.check(50, &KINDS);
}
