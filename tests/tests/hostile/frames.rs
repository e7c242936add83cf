//! Frames of another rank.

use crate::memory::asked;
use crate::random::{
    GREED, below, change_bits, change_number, change_the_end, noise, number, one_of, overwrite, rounds,
};
use crate::tally::Tally;
use atoll::scene::SplitMix64;
use atoll_core::{
    Body, CodecError, ContactRecord, Exchange, Frames, GhostRecord, Halo, Inbox, KindId, MigrantRecord, Outbox, TileId,
    step,
};
use atoll_tests::fuzz::{self, FRAME, Letter, Outcome};
use atoll_tests::scenes;
use bytemuck::{Pod, cast_slice_mut};
use std::mem::{offset_of, size_of_val};

/// Every kind of refusal.
const KINDS: [&str; 6] = ["header", "version", "out of step", "length", "wrong tile", "bad record"];

fn kind(error: &CodecError) -> &'static str {
    match error {
        CodecError::Header { .. } => KINDS[0],
        CodecError::Version { .. } => KINDS[1],
        CodecError::OutOfStep { .. } => KINDS[2],
        CodecError::Length { .. } => KINDS[3],
        CodecError::WrongTile { .. } => KINDS[4],
        CodecError::BadRecord { .. } => KINDS[5],
    }
}

/// What is done to a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Aim {
    /// It is as it should be, whatever its records hold.
    Nothing,
    /// It never was one.
    Noise,
    /// Some bits, anywhere.
    Bits,
    /// One bit, of the header or what is said of the first message.
    EarlyBit,
    /// All bytes from some place on.
    TheEnd,
    /// It is too short.
    Cut,
    /// It is too long.
    Extended,
    /// The version of the format.
    Format,
    /// The step, or the sync point.
    Moment,
    /// The number of messages.
    Messages,
    /// The number of records of one sort, of one message.
    Count,
    /// A tile of the grid that this rank does not hold, or one that no grid has.
    Tile,
    /// The kind of a body, or of a ghost.
    Kind,
}

impl Aim {
    const ALL: [Self; 13] = [
        Self::Nothing,
        Self::Noise,
        Self::Bits,
        Self::EarlyBit,
        Self::TheEnd,
        Self::Cut,
        Self::Extended,
        Self::Format,
        Self::Moment,
        Self::Messages,
        Self::Count,
        Self::Tile,
        Self::Kind,
    ];

    /// Of what kind a refusal may be, or must, where the frame cannot be accepted any more.
    fn kinds(self) -> (&'static [&'static str], bool) {
        match self {
            Self::Nothing => (&[], false),
            Self::Noise => (&["header", "version"], true),
            Self::Bits | Self::EarlyBit | Self::TheEnd => (&KINDS, false),
            Self::Cut => (&["header", "length"], true),
            Self::Extended => (&["length"], true),
            Self::Format => (&["version"], true),
            Self::Moment => (&["out of step"], true),
            // Other bytes are taken for what is said of messages.
            Self::Messages => (&["length", "wrong tile", "bad record"], true),
            // Or for records: there are too few or too many for it to be accepted.
            Self::Count => (&["length", "bad record"], true),
            Self::Tile => (&["wrong tile"], true),
            Self::Kind => (&["bad record"], true),
        }
    }
}

/// Records of any bits.
fn records<T: Pod>(random: &mut SplitMix64) -> Vec<T> {
    let mut records = vec![T::zeroed(); one_of(random, &[0, 0, 1, 2, 7])];
    cast_slice_mut::<T, u8>(&mut records).fill_with(|| random.bits() as u8);
    records
}

/// Messages that this rank may get, whatever their records hold.
fn messages(random: &mut SplitMix64) -> Vec<Letter> {
    let message = |random: &mut SplitMix64| {
        let mut message = Letter {
            from: TileId(random.bits() as u32 % fuzz::TILES),
            to: TileId(0),
            migrants: records(random),
            contacts: records(random),
            ghosts: records(random),
            refreshes: records(random),
            impulses: records(random),
        };
        let ghosts = message.ghosts.iter_mut().map(|ghost| &mut ghost.body);
        message
            .migrants
            .iter_mut()
            .map(|migrant| &mut migrant.body)
            .chain(ghosts)
            .for_each(|body| body.kind = KindId(0));
        message
    };
    (0..below(random, 5)).map(|_| message(random)).collect()
}

fn written(messages: &[Letter]) -> Vec<u8> {
    fuzz::frame((0, 0), messages.iter().map(Letter::message))
}

/// Where the frame of some messages has the kinds of bodies and ghosts.
fn kinds_of_bodies(messages: &[Letter]) -> Vec<usize> {
    let mut at = FRAME.header + FRAME.counts * messages.len();
    let mut places = Vec::new();
    for Letter { migrants, contacts, ghosts, refreshes, impulses, .. } in messages {
        places
            .extend((0..migrants.len()).map(|i| at + i * size_of::<MigrantRecord>() + offset_of!(MigrantRecord, body)));
        at += migrants.len() * size_of::<MigrantRecord>() + contacts.len() * size_of::<ContactRecord>();
        places.extend((0..ghosts.len()).map(|i| at + i * size_of::<GhostRecord>() + offset_of!(GhostRecord, body)));
        at += ghosts.len() * size_of::<GhostRecord>() + size_of_val(&refreshes[..]) + size_of_val(&impulses[..]);
    }
    assert_eq!(at, written(messages).len());
    places.iter().map(|body| body + offset_of!(Body, kind)).collect()
}

/// A frame with something done to it. None if there is nothing in it to do that to.
fn frame(random: &mut SplitMix64, aim: Aim) -> Option<Vec<u8>> {
    let messages = messages(random);
    let mut bytes = written(&messages);
    let first = (!messages.is_empty()).then_some(FRAME.header);
    // What is said of one of the messages.
    let said = first.map(|first| first + FRAME.counts * below(random, messages.len()));
    match aim {
        Aim::Nothing => {}
        Aim::Noise => {
            let length = below(random, 600);
            bytes = noise(random, length);
        }
        Aim::Bits => {
            let end = bytes.len();
            change_bits(random, &mut bytes, end);
        }
        Aim::EarlyBit => {
            let bit = below(random, 8 * (first? + FRAME.counts));
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        Aim::TheEnd => change_the_end(random, &mut bytes),
        Aim::Cut => bytes.truncate(below(random, bytes.len())),
        Aim::Extended => {
            let extra = 1 + below(random, 100);
            bytes.extend(noise(random, extra));
        }
        Aim::Format => change_number(random, &mut bytes, FRAME.format),
        Aim::Moment => {
            let at = one_of(random, &[FRAME.step, FRAME.step + 4, FRAME.sync]);
            change_number(random, &mut bytes, at);
        }
        Aim::Messages => change_number(random, &mut bytes, FRAME.messages),
        Aim::Count => {
            let at = said? + 8 + 4 * below(random, 5);
            change_number(random, &mut bytes, at);
        }
        Aim::Tile if random.coin() => {
            let tile = fuzz::TILES + one_of(random, &[0, 1, u32::MAX - fuzz::TILES]);
            overwrite(&mut bytes, said?, tile);
        }
        Aim::Tile => change_number(random, &mut bytes, said? + 4),
        Aim::Kind => {
            let places = kinds_of_bodies(&messages);
            let at = (!places.is_empty()).then(|| one_of(random, &places))?;
            change_number(random, &mut bytes, at);
        }
    }
    Some(bytes)
}

/// Bytes that reading a frame asks for, whatever becomes of it, and that.
fn cost(bytes: &[u8]) -> (usize, Outcome<CodecError>) {
    let mut cost = 0;
    let outcome = fuzz::codec_by(bytes, |inbox| {
        let (asked, result) = asked(|| inbox.decode(bytes));
        cost = asked;
        result
    });
    (cost, outcome)
}

/// What a frame of some length with few messages may cost.
fn allowed(length: usize) -> usize {
    8 * length + 1024
}

/// What any frame may cost. An empty message takes 28 bytes of a frame and 128 of memory, and a vector that doubles
/// until it holds them asks for up to four times that in all.
fn allowed_at_most(length: usize) -> usize {
    20 * length + 1024
}

#[test]
fn random_frames_neither_panic_nor_fill_the_memory() {
    let mut random = SplitMix64::after(1, 0);
    let mut tally = Tally::default();
    for round in 0..rounds(1_000_000) {
        let aim = one_of(&mut random, &Aim::ALL);
        let Some(bytes) = frame(&mut random, aim) else { continue };
        let (asked, outcome) = cost(&bytes);
        assert!(asked <= allowed(bytes.len()), "round {round}: {asked} bytes for {}: {bytes:02x?}", bytes.len());
        let (kinds, must) = aim.kinds();
        let hit = outcome.refusals.first().map_or(!must, |error| kinds.contains(&kind(error)));
        assert!(hit, "round {round}: {aim:?} came to {outcome:?}: {bytes:02x?}");
        tally.count(&outcome, kind);
    }
    tally.check(20, &KINDS);
}

#[test]
fn a_frame_costs_what_it_brings_and_not_what_it_announces() {
    let mut random = SplitMix64::after(2, 0);
    // As many empty messages as fit: what costs most for its length.
    let many = vec![Letter { from: TileId(1), to: TileId(0), ..Letter::default() }; 40_000];
    let bytes = written(&many);
    let (asked, Outcome { accepted, .. }) = cost(&bytes);
    assert!(accepted && asked <= allowed_at_most(bytes.len()), "{asked} bytes for {}", bytes.len());
    // The same bytes, announced as something else: another number of messages, other counts, other tiles.
    let mut unchanged = 0;
    for _ in 0..rounds(1000) {
        let mut changed = bytes.clone();
        let at = FRAME.messages + 4 * below(&mut random, 1 + FRAME.counts / 4 * many.len());
        overwrite(&mut changed, at, one_of(&mut random, &GREED));
        let (asked, outcome) = cost(&changed);
        assert!(asked <= allowed_at_most(bytes.len()), "{asked} bytes for {}, changed at {at}", bytes.len());
        assert_eq!(outcome.accepted, changed == bytes, "{} at {at}: {outcome:?}", number(&changed, at));
        unchanged += usize::from(outcome.accepted);
    }
    assert!(unchanged < rounds(1000) / 10, "{unchanged} changed nothing");
}

/// A halo within one rank that encodes every message as if each tile were on a rank of its own.
struct Scribe {
    frames: Frames,
    records: [usize; 5],
}

impl Halo for Scribe {
    type Error = ();

    fn exchange(&mut self, outbox: &mut Outbox, inbox: &mut Inbox) -> Result<(), ()> {
        const RANKS: usize = 5;
        // The last rank, which writes them, holds no tile.
        self.frames.deal(outbox, RANKS, RANKS - 1, &|tile| tile.0 as usize);
        for (rank, &length) in self.frames.lengths().iter().enumerate() {
            let mut bytes = vec![0; length];
            self.frames.encode(outbox, rank, &mut bytes);
            let messages: Vec<_> = outbox.messages().filter(|message| message.to.0 as usize == rank).collect();
            if !messages.is_empty() {
                assert_eq!(bytes, fuzz::frame(outbox.moment(), messages.iter().copied()));
            }
            for message in messages {
                let atoll_core::Message { migrants, contacts, ghosts, refreshes, impulses, .. } = message;
                let counts = [migrants.len(), contacts.len(), ghosts.len(), refreshes.len(), impulses.len()];
                self.records.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
            }
        }
        let _ = outbox.deliver(inbox);
        Ok(())
    }
}

/// All aims here are taken by the layout that frames have according to their description.
#[test]
fn frames_are_written_as_described() {
    let mut sim = scenes::room(8, 5).start_on((2, 2), Exchange::Substep);
    let mut scribe = Scribe { frames: Frames::default(), records: [0; 5] };
    for _ in 0..60 {
        step(&mut sim.world, &mut scribe).unwrap();
    }
    assert!(scribe.records.iter().all(|&sum| sum > 0), "not of every sort: {:?}", scribe.records);
    let empty = written(&[]);
    assert_eq!((empty.len(), number(&empty, FRAME.format)), (FRAME.header, atoll_core::FORMAT));
    assert_eq!(written(&[Letter::default()]).len(), FRAME.header + FRAME.counts);
}
