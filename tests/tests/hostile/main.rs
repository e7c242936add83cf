//! Hostile input: a million frames, fifty thousand saved tiles, twenty thousand segments of recordings, ten thousand
//! configurations and a few thousand command lines that nobody would write, against the targets of [`atoll_tests::fuzz`]. No
//! panic, no error of two lines, and no more memory than the bytes that came can justify.

use atoll::scene::SplitMix64;
use atoll_core::{KindId, Message, TileId};
use atoll_tests::{fuzz, program};
use bytemuck::Pod;
use proptest::prelude::*;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    /// Bytes this thread has asked for so far; what it gave back counts too.
    static ASKED: Cell<usize> = const { Cell::new(0) };
}

struct CountAll;

fn ask(bytes: usize) {
    // A thread that ends may have lost its counter already.
    let _ = ASKED.try_with(|asked| asked.set(asked.get() + bytes));
}

// SAFETY: every call is passed on unchanged to the system allocator, which keeps the contract.
unsafe impl GlobalAlloc for CountAll {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ask(layout.size());
        // SAFETY: the caller keeps the contract of `alloc`, which is the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        ask(layout.size());
        // SAFETY: the caller keeps the contract of `alloc_zeroed`, which is the same.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ask(size);
        // SAFETY: the caller keeps the contract of `realloc`, and `pointer` came from the system allocator.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`, and `pointer` came from the system allocator.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: CountAll = CountAll;

/// `usual` rounds, or a tenth of it where assertions slow everything down.
const fn rounds(usual: usize) -> usize {
    if cfg!(debug_assertions) { usual / 10 } else { usual }
}

/// A number below `end`.
fn below(random: &mut SplitMix64, end: usize) -> usize {
    (random.bits() % end as u64) as usize
}

/// One of some things.
fn one_of<'a, T: ?Sized>(random: &mut SplitMix64, things: &[&'a T]) -> &'a T {
    things[below(random, things.len())]
}

fn noise(random: &mut SplitMix64, length: usize) -> Vec<u8> {
    (0..length).map(|_| random.bits() as u8).collect()
}

/// Records of any bits.
fn records<T: Pod>(random: &mut SplitMix64) -> Vec<T> {
    let count = [0, 0, 1, 2, 7][below(random, 5)];
    let mut records = vec![T::zeroed(); count];
    for byte in bytemuck::cast_slice_mut::<T, u8>(&mut records) {
        *byte = random.bits() as u8;
    }
    records
}

/// A frame that is what it should be, whatever its records hold.
fn genuine(random: &mut SplitMix64) -> Vec<u8> {
    let messages: Vec<Message> = (0..below(random, 5))
        .map(|_| {
            let mut message = Message {
                from: TileId(random.bits() as u32 % fuzz::TILES),
                to: TileId(0),
                migrants: records(random),
                contacts: records(random),
                ghosts: records(random),
                refreshes: records(random),
                impulses: records(random),
            };
            let ghosts = message.ghosts.iter_mut().map(|ghost| &mut ghost.body);
            message.migrants.iter_mut().chain(ghosts).for_each(|body| body.kind = KindId(0));
            message
        })
        .collect();
    fuzz::frame(messages.iter())
}

/// Length of the counts of one message.
const COUNTS: usize = 7 * 4;
/// Numbers that a length must not be believed to be.
const GREED: [u32; 6] = [1, 0xffff, 0x7fff_ffff, 0x8000_0000, u32::MAX - 1, u32::MAX];

/// A frame that came from the wrong place, in one of many ways.
fn frame(random: &mut SplitMix64) -> Vec<u8> {
    if below(random, 8) == 0 {
        let length = below(random, 600);
        return noise(random, length);
    }
    let mut bytes = genuine(random);
    let header = 22 + 16 * usize::from(bytes[17]);
    let overwrite = |bytes: &mut [u8], at: usize, number: u32| {
        let end = (at + 4).min(bytes.len());
        bytes[at..end].copy_from_slice(&number.to_le_bytes()[..end - at]);
    };
    match below(random, 8) {
        0 => {}
        1 => {
            for _ in 0..=below(random, 8) {
                let bit = below(random, 8 * bytes.len());
                bytes[bit / 8] ^= 1 << (bit % 8);
            }
        }
        // In the header and the counts alone.
        2 => {
            let bit = below(random, 8 * bytes.len().min(header + COUNTS));
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        3 => bytes.truncate(below(random, bytes.len())),
        4 => {
            let extra = 1 + below(random, 100);
            bytes.extend(noise(random, extra));
        }
        // The number of messages, or one of the counts.
        5 => {
            let at = header - 4 + 4 * below(random, 8);
            let (number, any) = (GREED[below(random, GREED.len())], random.bits() as u32);
            let at = at.min(bytes.len() - 4);
            overwrite(&mut bytes, at, if random.coin() { number } else { any });
        }
        // Another version, step or sync point.
        6 => {
            let at = [0, 4, 12][below(random, 3)];
            overwrite(&mut bytes, at, random.bits() as u32 >> below(random, 32));
        }
        _ => {
            let at = below(random, bytes.len());
            let length = bytes.len() - at;
            bytes.splice(at.., noise(random, length));
        }
    }
    bytes
}

/// Bytes that reading a frame asks for, whatever the result, and whether it was taken for one.
fn cost(bytes: &[u8]) -> (usize, bool) {
    fuzz::receive(|inbox| {
        let before = ASKED.get();
        let accepted = inbox.decode(bytes).is_ok();
        (ASKED.get() - before, accepted)
    })
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
    let mut accepted = 0;
    let count = rounds(1_000_000);
    for round in 0..count {
        let bytes = frame(&mut random);
        let (asked, taken) = cost(&bytes);
        assert!(asked <= allowed(bytes.len()), "round {round}: {asked} bytes for {}: {bytes:02x?}", bytes.len());
        assert_eq!(fuzz::codec(&bytes), taken);
        accepted += usize::from(taken);
    }
    assert!(accepted > count / 20 && accepted < count / 2, "{accepted} of {count} accepted: the noise reaches nothing");
}

#[test]
fn a_frame_costs_what_it_brings_and_not_what_it_announces() {
    let mut random = SplitMix64::after(2, 0);
    // As many empty messages as fit: what costs most for its length.
    let empty = Message { from: TileId(1), to: TileId(0), ..Message::default() };
    let many = vec![empty; 40_000];
    let bytes = fuzz::frame(many.iter());
    let (asked, accepted) = cost(&bytes);
    assert!(accepted && asked <= allowed_at_most(bytes.len()), "{asked} bytes for {}", bytes.len());
    // The same bytes, announced as something else.
    for _ in 0..rounds(1000) {
        let mut bytes = bytes.clone();
        let at = 16 + 4 * below(&mut random, 1 + 7 * many.len());
        bytes[at..at + 4].copy_from_slice(&GREED[below(&mut random, GREED.len())].to_le_bytes());
        let (asked, accepted) = cost(&bytes);
        assert!(asked <= allowed_at_most(bytes.len()), "{asked} bytes for {}, changed at {at}", bytes.len());
        assert!(!accepted || (at - 20) % COUNTS < 8, "believed what stands at {at}");
    }
}

/// A saved tile that was changed in one of many ways.
fn saved_tile(random: &mut SplitMix64, genuine: &[u8]) -> Vec<u8> {
    let mut bytes = genuine.to_vec();
    let few = 1 + below(random, 600);
    match below(random, 6) {
        0 => bytes = noise(random, few),
        1 => bytes.truncate(below(random, genuine.len())),
        2 => bytes.extend(noise(random, few)),
        // One of the counts.
        3 => {
            let at = fuzz::BLOCK_HEADER - 48 + 4 * below(random, 4);
            bytes[at..at + 4].copy_from_slice(&GREED[below(random, GREED.len())].to_le_bytes());
        }
        4 => {
            let at = below(random, bytes.len());
            let length = bytes.len() - at;
            bytes.splice(at.., noise(random, length));
        }
        _ => {
            for _ in 0..=below(random, 8) {
                let bit = below(random, 8 * bytes.len());
                bytes[bit / 8] ^= 1 << (bit % 8);
            }
        }
    }
    bytes
}

#[test]
fn saved_tiles_that_were_changed() {
    let mut random = SplitMix64::after(5, 0);
    let genuine = fuzz::block();
    assert!(fuzz::snapshot(&genuine));
    let (mut accepted, count) = (0, rounds(50_000));
    for round in 0..count {
        let mut bytes = saved_tile(&mut random, &genuine);
        accepted += usize::from(fuzz::snapshot(&bytes));
        fuzz::seal(&mut bytes);
        let mut world = fuzz::fresh();
        let before = ASKED.get();
        let _ = world.restore(TileId(0), &bytes);
        let asked = ASKED.get() - before;
        assert!(asked <= allowed(bytes.len()), "round {round}: {asked} bytes for {}: {bytes:02x?}", bytes.len());
    }
    assert!(accepted > count / 50 && accepted < count / 2, "{accepted} of {count} accepted");
}

/// A segment that was changed in one of many ways, more often than not in its footer.
fn segment(random: &mut SplitMix64, genuine: &[u8]) -> Vec<u8> {
    let mut bytes = genuine.to_vec();
    let footer = fuzz::footer(genuine).unwrap();
    let start = [0, footer, footer][below(random, 3)];
    let at = start + below(random, genuine.len() - start);
    match below(random, 4) {
        0 => bytes.truncate(at),
        1 => drop(bytes.drain(at..(at + 1 + below(random, 8)).min(genuine.len()))),
        2 => {
            let few = 1 + below(random, 8);
            bytes.splice(at..at, noise(random, few));
        }
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

/// Writes where the footer is, if there is room for that, so that a longer or shorter one is found.
fn end_segment(bytes: &mut [u8], footer: usize) {
    if let Some(length) = bytes.len().checked_sub(footer + 8) {
        let end = bytes.len() - 8;
        bytes[end..].copy_from_slice(&[&(length as u32).to_le_bytes()[..], b"PAR1"].concat());
    }
}

/// Gives a segment to the target. It is read twice, each time through buffers of a fixed size, and a small one costs no more.
#[track_caller]
fn read_segment(bytes: &[u8]) -> bool {
    let before = ASKED.get();
    let accepted = fuzz::segment(bytes);
    let asked = ASKED.get() - before;
    assert!(asked <= 1 << 20, "{asked} bytes for {}: {bytes:02x?}", bytes.len());
    accepted
}

#[test]
fn segments_that_were_changed() {
    let mut random = SplitMix64::after(6, 0);
    let genuine = fuzz::segment_file();
    assert!(read_segment(&genuine));
    let count = rounds(20_000);
    let accepted = (0..count).filter(|_| read_segment(&segment(&mut random, &genuine))).count();
    assert!(accepted > count / 50 && accepted < count / 2, "{accepted} of {count} accepted");
    // Each small number of the footer as a huge one, of seven bits in a byte, the highest of which says that it goes on.
    let footer = fuzz::footer(&genuine).unwrap();
    for at in footer..genuine.len() - 8 {
        let mut bytes = genuine.clone();
        bytes.splice(at..=at, [0xfe, 0xff, 0xff, 0xff, 0x07]);
        end_segment(&mut bytes, footer);
        read_segment(&bytes);
    }
}

#[test]
fn random_messages_within_a_collective_call() {
    let mut random = SplitMix64::after(3, 0);
    for _ in 0..rounds(5000) {
        let length = [3, 11, 8 * 7 + 3, below(&mut random, 100)][below(&mut random, 4)];
        let bytes = noise(&mut random, length);
        fuzz::transport(&bytes);
    }
}

/// The text of every file of `configs/`, with the keys that are commented out put into force now and then.
fn files() -> Vec<String> {
    let folder = program::root().join("configs");
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = entries.filter(|path| path.extension().is_some_and(|end| end == "toml")).collect();
    files.sort();
    assert!(files.len() >= 4, "{files:?}");
    files.iter().map(|path| std::fs::read_to_string(path).unwrap()).collect()
}

/// Values that somebody might write.
const VALUES: &[&str] = &[
    "0",
    "1",
    "2",
    "7",
    "64",
    "100",
    "-1",
    "-0.0",
    "0.5",
    "2.5",
    "1e-45",
    "1e-300",
    "3e38",
    "1e39",
    "1e400",
    "inf",
    "-inf",
    "nan",
    "true",
    "false",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "9223372036854775808",
    "10000000000",
    "0x7f",
    "1_0",
    "\"\"",
    "\"auto\"",
    "\"3x3\"",
    "\"0x7\"",
    "\"65535x65535\"",
    "[0, -10]",
    "[nan, 0]",
    "[3e38, 3e38]",
    "[1]",
    "[[]]",
    "[2, 2]",
    "{}",
    "{ a = 1 }",
    "1979-05-27T07:32:00Z",
    "'''\na\nb'''",
    "\"\\u0000\"",
    "\"\\r\\n\"",
    "grid",
    "\"quadtree\"",
    "\"pgs\"",
    "\"substep\"",
    "\"step\"",
    "\"frozen\"",
    "\"pile\"",
    "\"rooms\"",
    "\"mpi\"",
    "\"local\"",
    "=",
    "\"",
    "[[[[[[[[[[[[[[[[",
    "é",
    "\u{2028}",
];

/// Keys of sections, as the files have them.
fn keys(files: &[String]) -> Vec<&str> {
    let lines = files.iter().flat_map(|text| text.lines());
    let names = lines.filter_map(|line| Some(line.trim_start_matches("# ").split_once(" = ")?.0));
    let mut keys: Vec<_> = names.filter(|name| name.bytes().all(|b| b.is_ascii_lowercase() || b == b'_')).collect();
    keys.sort_unstable();
    keys.dedup();
    keys
}

/// A configuration with something done to it, and overrides behind it.
fn configuration(random: &mut SplitMix64, files: &[String], keys: &[&str]) -> Vec<u8> {
    let text = &files[below(random, files.len())];
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for _ in 0..below(random, 4) {
        let at = below(random, lines.len());
        let name = lines[at].trim_start_matches("# ").split_once(" = ").map(|(name, _)| name.to_owned());
        match (below(random, 6), name) {
            (0, _) => drop(lines.remove(at)),
            (1, _) => lines.insert(at, lines[at].clone()),
            (2, _) => lines[at] = lines[at].trim_start_matches("# ").to_owned(),
            (3 | 4, Some(name)) => lines[at] = format!("{name} = {}", one_of(random, VALUES)),
            (..) => lines.insert(at, format!("{} = {}", one_of(random, keys), one_of(random, VALUES))),
        }
    }
    let mut bytes = lines.join("\n").into_bytes();
    if below(random, 3) == 0 {
        let at = below(random, bytes.len());
        bytes[at] = one_of(random, &[b"\n", b"\"", b"=", b"[", b"\r", b"\\", b"#", b"\x07", b"9", b"."])[0];
    }
    // Few bodies more often than not, so that something is planned.
    for _ in 0..below(random, 4) {
        let (key, value) = (one_of(random, keys), one_of(random, VALUES));
        bytes.extend(format!("\0{key}={value}").bytes());
    }
    if below(random, 3) > 0 {
        bytes.extend(b"\0bodies=100");
    }
    bytes
}

#[test]
fn mutated_configurations() {
    let files = files();
    let keys = keys(&files);
    assert!(keys.len() > 25 && keys.contains(&"margin_cap"), "{keys:?}");
    let mut random = SplitMix64::after(4, 0);
    let count = rounds(10_000);
    let accepted = (0..count).filter(|_| fuzz::config(&configuration(&mut random, &files, &keys))).count();
    assert!(accepted > count / 50 && accepted < count / 2, "{accepted} of {count} accepted");
}

fn any_argument() -> impl Strategy<Value = String> {
    let option = prop::sample::select(
        &[
            "run",
            "--ranks",
            "--threads",
            "--transport",
            "--tiles",
            "--bodies",
            "--steps",
            "--seed",
            "--set",
            "--json",
            "--peer-timeout",
            "--out",
            "--record-every",
            "--checkpoint-every",
            "--overwrite",
            "--resume",
            "--restarts",
            "--quiet",
            "--help",
            "--version",
            "help",
            "--",
            "-",
            "world.toml",
        ][..],
    );
    let value = || prop::sample::select(VALUES);
    let key = prop::sample::select(&["hertz", "scene.bodies", "run", "sleep", "solvr", "", "a\nb", "=", "tiles"][..]);
    prop_oneof![
        4 => option.clone().prop_map(str::to_owned),
        2 => value().prop_map(str::to_owned),
        2 => (key, value()).prop_map(|(key, value)| format!("{key}={value}")),
        1 => (option, value()).prop_map(|(option, value)| format!("{option}={value}")),
        1 => any::<String>(),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(rounds(5000) as u32) })]

    #[test]
    fn any_command_line(mut line in prop::collection::vec(any_argument(), 0..8), verb in 0..4_u8) {
        if verb > 0 {
            line.splice(0..0, ["run".to_owned(), "world.toml".to_owned()]);
        }
        fuzz::arguments(line.join("\0").as_bytes());
    }

    #[test]
    fn any_bytes_as_a_command_line(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        fuzz::arguments(&bytes);
        fuzz::config(&bytes);
    }
}
