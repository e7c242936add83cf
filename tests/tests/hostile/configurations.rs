//! Configurations.

use crate::random::{below, one_of, rounds};
use crate::tally::Tally;
use crate::values::VALUES;
use atoll::config::ConfigError;
use atoll::scene::SplitMix64;
use atoll_tests::{fuzz, program};

/// Every kind of refusal that a text can meet. Not among them: a file that cannot be read, a scene in one, and an assignment without an equals
/// sign, as none is given; and an ambiguous key, as no two keys end alike today.
const KINDS: [&str; 6] = ["syntax", "unknown key", "unknown section", "missing", "bad value", "inapplicable"];

fn kind(error: &ConfigError) -> &'static str {
    match error {
        ConfigError::Read { .. } => "read",
        ConfigError::Syntax { .. } => "syntax",
        ConfigError::UnknownKey { .. } => "unknown key",
        ConfigError::UnknownSection { .. } => "unknown section",
        ConfigError::AmbiguousKey { .. } => "ambiguous key",
        ConfigError::NotAnAssignment { .. } => "no assignment",
        ConfigError::Missing { .. } => "missing",
        ConfigError::BadValue { .. } => "bad value",
        ConfigError::NotBuiltIn { .. } => "not built in",
        ConfigError::Inapplicable { .. } => "inapplicable",
        ConfigError::Scene(_) => "scene",
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
    if below(random, 20) == 0 {
        bytes.extend(b"\0transport=\"mpi\"");
    }
    bytes
}

#[test]
fn mutated_configurations() {
    let files = files();
    let keys = keys(&files);
    assert!(keys.len() > 25 && keys.contains(&"margin_cap"), "{keys:?}");
    let mut random = SplitMix64::after(4, 0);
    let mut tally = Tally::default();
    for _ in 0..rounds(10_000) {
        tally.count(&fuzz::config(&configuration(&mut random, &files, &keys)), kind);
    }
    let mut kinds = KINDS.to_vec();
    // A transport, in a build without it.
    kinds.extend((!cfg!(feature = "mpi")).then_some("not built in"));
    tally.check(50, &kinds);
}
