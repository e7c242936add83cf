//! Files of scenes.

use crate::memory::asked;
use crate::random::{below, change_bits, noise, one_of, rounds};
use atoll::scene::{SceneError, SplitMix64};
use atoll_tests::fuzz::{self, Outcome, ScenePart};

/// Words that stand in the place of others.
const WORDS: [&str; 22] = [
    "nan",
    "-inf",
    "1e308",
    "-1",
    "0",
    "18446744073709551615",
    "9223372036854775808",
    "1e-320",
    "\"",
    ",",
    "\n",
    "=",
    "[",
    "]]",
    "kind",
    "id",
    "\u{feff}",
    "{",
    "crate",
    "circle",
    "x",
    "0x1p3",
];

/// A file of a scene with something done to it.
fn changed(random: &mut SplitMix64, part: ScenePart, genuine: &[u8]) -> Vec<u8> {
    let mut bytes = genuine.to_vec();
    let at = below(random, bytes.len());
    // More often than not the footer, where there is one.
    let at = if part == ScenePart::Parquet && random.coin() { bytes.len() - 1 - below(random, 700) } else { at };
    match below(random, 6) {
        0 => bytes.truncate(at),
        1 => drop(bytes.drain(at..(at + 1 + below(random, 8)).min(genuine.len()))),
        2 => {
            let few = 1 + below(random, 8);
            bytes.splice(at..at, noise(random, few));
        }
        3 if part != ScenePart::Parquet => {
            let end = (at + below(random, 6)).min(bytes.len());
            bytes.splice(at..end, one_of(random, &WORDS).bytes());
        }
        3 => bytes[at] = random.bits() as u8,
        4 => {
            // A huge number, of seven bits in a byte.
            bytes.splice(at..=at, [0xfe, 0xff, 0xff, 0xff, 0x07]);
        }
        _ => {
            let end = bytes.len();
            change_bits(random, &mut bytes, end);
        }
    }
    bytes
}

/// Gives a file to the target: a small one costs little, whatever it says of itself. Of its pages, the library believes how long
/// they are once unpacked, in 32 bits.
#[track_caller]
fn read(part: ScenePart, bytes: &[u8]) -> Outcome<SceneError> {
    let (asked, outcome) = asked(|| fuzz::scene_part(part, bytes));
    let most = if part == ScenePart::Parquet { 1 << 33 } else { 1 << 22 };
    assert!(asked <= most, "{asked} bytes for {} of {part:?}: {bytes:02x?}", bytes.len());
    outcome
}

#[test]
fn scenes_that_were_changed() {
    for part in ScenePart::ALL {
        let mut random = SplitMix64::after(17, 0);
        let genuine = part.genuine();
        assert!(read(part, &genuine).accepted, "{part:?}");
        let (mut accepted, all) = (0, rounds(10_000));
        for _ in 0..all {
            accepted += usize::from(read(part, &changed(&mut random, part, &genuine)).accepted);
        }
        assert!(accepted > all / 200 && accepted < all / 2, "{accepted} of {all} {part:?} were accepted");
    }
}
