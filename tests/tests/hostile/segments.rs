//! Segments of recordings.

use crate::memory::asked;
use crate::random::{below, noise, one_of, rounds};
use crate::tally::Tally;
use atoll::recording::RecordingError;
use atoll::scene::SplitMix64;
use atoll_tests::fuzz::{self, Outcome};

/// What a segment may be refused for, by words of the reason.
const REASONS: [&str; 8] = [
    "other steps than its name says",
    "its rank is none",
    "other row groups",
    "do not lie as written",
    "the bytes of step",
    "step 0: ",
    "is unreadable",
    "has a number that cannot be",
];
/// Of another reason, given by the Parquet library, which knows very many.
const OTHER_REASON: &str = "Parquet's own";
/// It says of itself that it is one of several.
const NOTHING: &str = "nothing";

/// Other errors need a second file. Other reasons of ours need a second record, or a text of another length together with
/// what says how long it is.
fn kind(error: &RecordingError) -> &'static str {
    match error {
        RecordingError::BadSegment { reason, .. } => {
            REASONS.into_iter().find(|known| reason.contains(known)).unwrap_or(OTHER_REASON)
        }
        RecordingError::Nothing { .. } => NOTHING,
        other => panic!("{other}"),
    }
}

/// A segment that was changed in one of many ways, more often than not in its footer.
fn segment(random: &mut SplitMix64, genuine: &[u8]) -> Vec<u8> {
    let mut bytes = genuine.to_vec();
    let footer = fuzz::footer(genuine).unwrap();
    let start = [0, footer, footer][below(random, 3)];
    let at = start + below(random, genuine.len() - start);
    match below(random, 6) {
        0 => bytes.truncate(at),
        1 => drop(bytes.drain(at..(at + 1 + below(random, 8)).min(genuine.len()))),
        2 => {
            let few = 1 + below(random, 8);
            bytes.splice(at..at, noise(random, few));
        }
        3 | 4 => rewrite(random, &mut bytes[footer..]),
        _ => {
            for _ in 0..=below(random, 4) {
                let at = start + below(random, genuine.len() - start);
                bytes[at] = random.bits() as u8;
            }
        }
    }
    if random.coin() {
        end_segment(&mut bytes, footer);
    }
    bytes
}

/// Puts other digits into what a footer says in words, which is read only if all around is as it was.
fn rewrite(random: &mut SplitMix64, footer: &mut [u8]) {
    let names: [&[u8]; 9] = [
        b"atoll.steps",
        b"atoll.rank",
        b"atoll.ranks",
        b"atoll.record_every",
        b"atoll.seed",
        b"\"box\":",
        b"\"circle\":",
        b"\"restitution\":",
        b"\"ids\":",
    ];
    let name = one_of(random, &names);
    let at = footer.windows(name.len()).position(|part| part == name).unwrap() + name.len();
    let text = &mut footer[at..at + 6];
    let places: Vec<usize> = (0..text.len()).filter(|&i| matches!(text[i], b'0'..=b':')).collect();
    text[one_of(random, &places)] = one_of(random, b"0123456789:-");
}

/// Writes where the footer is, if there is room for that, so that a longer or shorter one is found.
fn end_segment(bytes: &mut [u8], footer: usize) {
    if let Some(length) = bytes.len().checked_sub(footer + 8) {
        let end = bytes.len() - 8;
        bytes[end..].copy_from_slice(&[&(length as u32).to_le_bytes()[..], b"PAR1"].concat());
    }
}

/// Gives a segment to the target. It is read twice, each time through buffers of a fixed size, and a small one costs no more.
#[track_caller]
fn read_segment(bytes: &[u8]) -> Outcome<RecordingError> {
    let (asked, outcome) = asked(|| fuzz::segment(bytes));
    assert!(asked <= 1 << 20, "{asked} bytes for {}: {bytes:02x?}", bytes.len());
    outcome
}

#[test]
fn segments_that_were_changed() {
    let mut random = SplitMix64::after(6, 0);
    let genuine = fuzz::segment_file();
    assert!(read_segment(&genuine).accepted);
    let mut tally = Tally::default();
    for _ in 0..rounds(20_000) {
        tally.count(&read_segment(&segment(&mut random, &genuine)), kind);
    }
    tally.check(50, &[&REASONS[..], &[OTHER_REASON, NOTHING]].concat());
    // Each small number of the footer as a huge one, of seven bits in a byte, the highest of which says that it goes on.
    let footer = fuzz::footer(&genuine).unwrap();
    for at in footer..genuine.len() - 8 {
        let mut bytes = genuine.clone();
        bytes.splice(at..=at, [0xfe, 0xff, 0xff, 0xff, 0x07]);
        end_segment(&mut bytes, footer);
        read_segment(&bytes);
    }
}
