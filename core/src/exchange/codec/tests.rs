//! Frames there and back, and bytes that are no frames.

use super::{COUNTS, FORMAT, Frames};
use crate::exchange::mail::{Inbox, Mailbag, Message, Outbox};
use crate::exchange::record::{BorderImpulse, ContactRecord, GhostRecord, GhostRefresh, MigrantRecord};
use crate::exchange::verdict::Verdict;
use crate::model::body::Body;
use crate::model::error::CodecError;
use crate::model::id::{GlobalId, KindId, TileId};
use crate::testing::cases;
use bytemuck::Pod;
use proptest::prelude::*;
use std::collections::BTreeSet;

/// Kinds that the receiving world knows.
const KINDS: usize = 3;

/// Bytes of any value as records of some sort; any bits will do, NaN too.
fn records<T: Pod>(seed: u64, count: usize) -> Vec<T> {
    let mut state = seed;
    let mut record = || {
        let mut record = T::zeroed();
        for byte in bytemuck::bytes_of_mut(&mut record) {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            *byte = (state >> 56) as u8;
        }
        record
    };
    (0..count).map(|_| record()).collect()
}

/// Writes one more message.
fn fill(bag: &mut Mailbag, (from, to): (TileId, TileId), seed: u64, counts: [usize; 5]) {
    bag.begin(from, to);
    bag.migrants.extend(records::<MigrantRecord>(seed, counts[0]));
    bag.contacts.extend(records::<ContactRecord>(seed ^ 1, counts[1]));
    bag.ghosts.extend(records::<GhostRecord>(seed ^ 2, counts[2]));
    bag.refreshes.extend(records::<GhostRefresh>(seed ^ 3, counts[3]));
    bag.impulses.extend(records::<BorderImpulse>(seed ^ 4, counts[4]));
    // Rows of the table that exist: all others are refused.
    let ghosts = bag.ghosts.iter_mut().map(|ghost| &mut ghost.body);
    for body in bag.migrants.iter_mut().map(|migrant| &mut migrant.body).chain(ghosts) {
        body.kind = KindId(body.kind.0 % KINDS as u32);
    }
}

/// A message for comparison: its tiles and the bytes of its arrays.
type Flat = (TileId, TileId, [Vec<u8>; 5]);

fn flat(message: Message<'_>) -> Flat {
    fn bytes<T: Pod>(records: &[T]) -> Vec<u8> {
        bytemuck::cast_slice(records).to_vec()
    }
    let Message { from, to, migrants, contacts, ghosts, refreshes, impulses } = message;
    (from, to, [bytes(migrants), bytes(contacts), bytes(ghosts), bytes(refreshes), bytes(impulses)])
}

/// The messages of a rank's outbox, as `(from, to, seed, counts)`.
type Letters = Vec<(u32, u32, u64, [usize; 5])>;

/// The tile of index `t` is on rank `t % ranks`.
fn tiles_of(rank: usize, ranks: usize, tiles: u32) -> Vec<TileId> {
    (0..tiles).filter(|tile| *tile as usize % ranks == rank).map(TileId).collect()
}

fn outbox(rank: usize, ranks: usize, tiles: u32, letters: &Letters) -> Outbox {
    let own = tiles_of(rank, ranks, tiles);
    let mut outbox = Outbox { bags: vec![Mailbag::default(); own.len()], step: 12, sync: 3, ..Outbox::default() };
    let mut told = BTreeSet::new();
    for &(from, to, seed, counts) in letters {
        let (from, to) = (TileId(from % tiles), TileId(to % tiles));
        // One message for each destination at most.
        if let Ok(place) = own.binary_search(&from)
            && told.insert((from, to))
        {
            fill(&mut outbox.bags[place], (from, to), seed, counts);
        }
    }
    outbox
}

fn inbox(rank: usize, ranks: usize, tiles: u32) -> Inbox {
    let mut inbox = Inbox::new(tiles_of(rank, ranks, tiles).into_iter(), tiles as usize, KINDS);
    inbox.begin(12, 3);
    inbox
}

fn frame(outbox: &Outbox, own: usize, to: usize, ranks: usize) -> Vec<u8> {
    let rank_of = |tile: TileId| tile.0 as usize % ranks;
    let mut frames = Frames::default();
    frames.deal(outbox, ranks, own, &rank_of);
    let lengths = frames.lengths();
    assert_eq!((lengths.len(), lengths[own]), (ranks, 0), "the own rank gets no frame");
    let mut bytes = vec![0xee; lengths[to]];
    frames.encode(outbox, to, &mut bytes);
    bytes
}

fn any_verdict() -> impl Strategy<Value = Verdict> {
    let failure = prop::option::of((any::<u64>(), any::<u64>().prop_map(GlobalId)));
    (any::<[bool; 3]>(), failure).prop_map(|([stop, meet, far], failure)| Verdict { stop, meet, far, failure })
}

fn any_letters() -> impl Strategy<Value = Letters> {
    let few = || prop_oneof![3 => Just(0_usize), 2 => 1..4_usize, 1 => 4..40_usize];
    let counts = [few(), few(), few(), few(), few()];
    prop::collection::vec((any::<u32>(), any::<u32>(), any::<u64>(), counts), 0..30)
}

proptest! {
    #![proptest_config(cases(128))]

    #[test]
    fn every_message_arrives_whole_and_once(
        ranks in 1_usize..=5,
        tiles in 1_u32..=12,
        letters in any_letters(),
    ) {
        let mut outboxes: Vec<_> =
            (0..ranks).map(|rank| outbox(rank, ranks, tiles, &letters)).collect();
        let mut sent: Vec<_> = outboxes.iter().flat_map(|outbox| outbox.messages().map(flat)).collect();
        let bring_bodies = |(_, to, arrays): &Flat| !arrays[0].is_empty() && to.0 < tiles;
        let heirs: BTreeSet<TileId> = sent.iter().filter(|flat| bring_bodies(flat)).map(|flat| flat.1).collect();
        let mut received = Vec::new();
        let mut inboxes: Vec<_> = (0..ranks).map(|rank| inbox(rank, ranks, tiles)).collect();
        for (rank, inbox) in inboxes.iter_mut().enumerate() {
            // In no order in particular.
            for from in (0..ranks).rev().filter(|&from| from != rank) {
                let frame = frame(&outboxes[from], from, rank, ranks);
                if !frame.is_empty() {
                    inbox.decode(&frame).unwrap();
                }
            }
        }
        for (rank, mut inbox) in inboxes.into_iter().enumerate() {
            let _ = outboxes[rank].deliver(&mut inbox);
            inbox.end(&mut outboxes[rank]);
            for (place, tile) in tiles_of(rank, ranks, tiles).into_iter().enumerate() {
                let mail = inbox.mail(place);
                prop_assert!(mail.messages().is_sorted_by_key(|message| message.from));
                prop_assert!(mail.messages().all(|message| message.to == tile));
                prop_assert_eq!(inbox.heirs().any(|heir| heir as usize == place), heirs.contains(&tile));
                received.extend(mail.messages().map(flat));
            }
        }
        sent.sort();
        received.sort();
        prop_assert_eq!(received, sent);
    }

    #[test]
    fn the_least_word_stands_for_all_verdicts(verdicts in prop::collection::vec(any_verdict(), 1..5)) {
        let joined = verdicts.iter().copied().reduce(Verdict::merge).unwrap();
        let word = verdicts.iter().map(|verdict| verdict.to_word()).min().unwrap();
        let heard = Verdict::from_word(word);
        prop_assert_eq!(heard.failure, joined.failure);
        prop_assert!(heard.stop == joined.stop || joined.failure.is_some());
        prop_assert!(heard.meet == joined.meet || joined.stop || joined.failure.is_some());
        prop_assert!(heard.is_far() == joined.is_far() || joined.failure.is_some());
    }
}

/// A frame from tile 1 to tiles 0 and 2 with at least one record of each sort, and the rank that gets it.
fn small_frame() -> Vec<u8> {
    let letters = vec![(1, 0, 5, [1, 1, 1, 0, 0]), (1, 2, 6, [0, 0, 0, 2, 1])];
    frame(&outbox(1, 2, 4, &letters), 1, 0, 2)
}

/// What was decoded, encoded again.
fn again(inbox: &Inbox) -> Vec<u8> {
    let Inbox { decoded, step, sync, .. } = inbox;
    let outbox = Outbox { bags: vec![decoded.clone()], step: *step, sync: *sync, ..Outbox::default() };
    frame(&outbox, 1, 0, 2)
}

#[test]
fn a_frame_cut_short_is_refused() {
    let bytes = small_frame();
    for length in 0..bytes.len() {
        let result = inbox(0, 2, 4).decode(&bytes[..length]);
        assert!(
            matches!(result, Err(CodecError::Header { .. } | CodecError::Length { .. })),
            "{length} of {} bytes: {result:?}",
            bytes.len()
        );
    }
}

#[test]
fn a_changed_byte_is_refused_or_is_what_the_frame_now_says() {
    let bytes = small_frame();
    let (mut refused, mut accepted) = (0, 0);
    for at in 0..bytes.len() {
        for change in 1..=255_u8 {
            let mut changed = bytes.clone();
            changed[at] ^= change;
            let mut inbox = inbox(0, 2, 4);
            match inbox.decode(&changed) {
                Ok(()) => {
                    assert_eq!(again(&inbox), changed, "byte {at} changed by {change:#x}");
                    accepted += 1;
                }
                Err(error) => {
                    assert!(!error.to_string().is_empty());
                    refused += 1;
                }
            }
        }
    }
    // Of the bytes of records nearly any is a record; of the header and the counts hardly one may change.
    assert!(refused > 16 * 255 && accepted > 300 * 255, "{refused} refused, {accepted} accepted");
}

#[test]
fn bytes_behind_a_frame_are_refused() {
    for extra in [1, 7, COUNTS, 1_000] {
        let mut bytes = small_frame();
        let announced = bytes.len() as u64;
        bytes.resize(bytes.len() + extra, 0);
        let refused = inbox(0, 2, 4).decode(&bytes);
        assert_eq!(refused, Err(CodecError::Length { length: bytes.len(), announced }));
    }
}

#[test]
fn what_does_not_fit_is_named() {
    let error = |bytes: &[u8], mut inbox: Inbox| inbox.decode(bytes).unwrap_err();
    let bytes = small_frame();

    let mut other_version = bytes.clone();
    other_version[0] ^= 8;
    assert_eq!(error(&other_version, inbox(0, 2, 4)), CodecError::Version { found: FORMAT ^ 8, expected: FORMAT });
    assert!(error(&other_version, inbox(0, 2, 4)).to_string().contains("same version on every rank"));

    let mut later = inbox(0, 2, 4);
    later.begin(12, 4);
    let found = CodecError::OutOfStep { found_step: 12, found_sync: 3, step: 12, sync: 4 };
    assert_eq!(error(&bytes, later), found);
    let mut later = inbox(0, 2, 4);
    later.begin(13, 3);
    assert!(error(&bytes, later).to_string().contains("step 12, sync point 3, where step 13"));

    // A rank that holds other tiles, and a grid that has fewer.
    assert_eq!(error(&bytes, inbox(1, 2, 4)), CodecError::WrongTile { from: TileId(1), to: TileId(0) });
    assert_eq!(error(&bytes, inbox(0, 1, 1)), CodecError::WrongTile { from: TileId(1), to: TileId(0) });

    // A kind out of the table, in a migrant and in a ghost.
    for ghost in [false, true] {
        let mut outbox = outbox(1, 2, 4, &vec![(1, 0, 9, [1, 0, 1, 0, 0])]);
        let bag = &mut outbox.bags[0];
        let body = if ghost { &mut bag.ghosts[0].body } else { &mut bag.migrants[0].body };
        (body.id, body.kind) = (GlobalId(42), KindId(KINDS as u32));
        let refused = error(&frame(&outbox, 1, 0, 2), inbox(0, 2, 4));
        assert_eq!(refused, CodecError::BadRecord { id: GlobalId(42) });
    }
}

#[test]
#[should_panic(expected = "length")]
fn a_buffer_of_another_length_is_a_bug_of_the_caller() {
    let outbox = outbox(1, 2, 4, &vec![(1, 0, 9, [1, 0, 0, 0, 0])]);
    let mut frames = Frames::default();
    frames.deal(&outbox, 2, 1, &|_| 0);
    frames.encode(&outbox, 0, &mut vec![0; 1_000]);
}

/// Bytes that an inbox keeps for messages.
fn kept(inbox: &Inbox) -> usize {
    fn room<T>(records: &Vec<T>) -> usize {
        records.capacity() * size_of::<T>()
    }
    let Mailbag { migrants, contacts, ghosts, refreshes, impulses, .. } = &inbox.decoded;
    inbox.decoded.room() + room(migrants) + room(contacts) + room(ghosts) + room(refreshes) + room(impulses)
}

#[test]
fn hostile_bytes_neither_panic_nor_fill_the_memory() {
    let genuine = small_frame();
    let header = genuine.len() - records_of(&genuine);
    let mut state = 1_u64;
    let mut next = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    let mut accepted = 0;
    for round in 0..100_000 {
        let mut bytes: Vec<u8>;
        if round % 4 == 0 {
            // Noise from the first byte on.
            bytes = (0..next() % 300).map(|_| next() as u8).collect();
        } else {
            // A genuine frame up to some place, and noise or greed behind it.
            bytes = genuine.clone();
            let at = (next() as usize) % (header + 8);
            let greed = [0, 1, 0x7fff_ffff, 0x8000_0000, u32::MAX, next() as u32][next() as usize % 6];
            let end = (at + 4).min(bytes.len());
            bytes[at..end].copy_from_slice(&greed.to_le_bytes()[..end - at]);
            bytes.truncate(bytes.len() - (next() as usize % 3) * 9);
        }
        let mut inbox = inbox(0, 2, 4);
        accepted += u32::from(inbox.decode(&bytes).is_ok());
        assert!(kept(&inbox) <= 16 * bytes.len() + 1_024, "{} bytes kept for {} received", kept(&inbox), bytes.len());
    }
    assert!(accepted > 0, "every frame was refused: the noise reaches nothing");
}

/// Bytes of the records of [`small_frame`].
fn records_of(frame: &[u8]) -> usize {
    let records = size_of::<MigrantRecord>()
        + size_of::<ContactRecord>()
        + size_of::<GhostRecord>()
        + 2 * size_of::<GhostRefresh>()
        + size_of::<BorderImpulse>();
    assert!(records < frame.len());
    records
}

#[test]
fn the_wire_is_as_narrow_as_promised() {
    assert_eq!(size_of::<Body>(), 48);
    assert!(size_of::<GhostRecord>() <= 64);
    assert!(size_of::<GhostRefresh>() <= 48);
}
