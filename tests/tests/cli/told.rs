//! What a run tells, where to, and with which exit code it ends.

use crate::{Desk, SMALL, assert_refused};
use atoll_tests::program::{self, run, watched};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Stdio;

#[test]
fn a_state_that_is_not_finite_ends_all_ranks_with_exit_code_4() {
    let desk = Desk::new(SMALL);
    for ranks in ["1", "3"] {
        let options = ["--quiet", "--ranks", ranks, "--set", "hertz=1", "--set", "gravity=[3e38,3e38]"];
        let ended = run(&mut desk.atoll(options));
        assert_refused(&ended, 4, "step ");
        assert!(ended.stderr.contains("the state of body 16 is no longer finite"), "{ended}");
    }
}

/// They are computed like any others, and the user may want to know.
#[test]
fn bodies_that_escaped_are_told_at_the_end() {
    let desk = Desk::new(SMALL);
    let options = ["--quiet", "--set", "gravity=[1e6,0]", "--steps", "60"];
    let mut command = desk.atoll(options);
    let json = desk.path().join("summary.json");
    let ended = run(command.env("RUST_LOG", "off").arg("--json").arg(&json));
    let escaped = program::summary(&json)["escaped"].as_u64().unwrap();
    assert!(ended.code == Some(0) && escaped > 0 && ended.stdout.contains("state hash"), "{ended}");
    assert_eq!(ended.complaints().len(), 1, "{ended}");
    let line = format!("atoll: {escaped} of 400 bodies escaped: they ended outside of the domain, or of their room");
    assert!(ended.stderr.starts_with(&line), "{ended}");
}

#[cfg(target_os = "linux")]
#[test]
fn output_that_cannot_be_written_in_the_end_gives_exit_code_5() {
    let desk = Desk::new(SMALL);
    let ended = run(&mut desk.atoll(["--quiet", "--json", "/dev/full"]));
    assert_eq!((ended.code, ended.complaints().len()), (Some(5), 1), "{ended}");
    assert!(ended.stderr.starts_with("atoll: cannot write /dev/full: "), "{ended}");
    // The other file is written all the same.
    let ended = run(&mut desk.atoll(["--quiet", "--timings", "/dev/full", "--json", "summary.json"]));
    assert_eq!((ended.code, ended.complaints().len()), (Some(5), 1), "{ended}");
    assert!(ended.stderr.starts_with("atoll: cannot write /dev/full: "), "{ended}");
    assert_eq!(desk.files(), ["summary.json", "world.toml"]);
}

/// A header, then for each rank a line per phase and one for the whole step, which they add up to.
#[test]
fn timings_tell_where_the_time_of_each_rank_went() {
    let desk = Desk::new(SMALL);
    let options = ["--quiet", "--ranks", "2", "--threads", "2", "--timings", "times.csv"];
    let json = program::run_to_summary(&mut desk.atoll(options), &desk.path().join("summary.json"));
    let text = fs::read_to_string(desk.path().join("times.csv")).unwrap();
    assert_eq!(desk.files(), ["summary.json", "times.csv", "world.toml"]);
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("rank,threads,steps,phase,mean_ms,share"));
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let mut phases: Vec<&str> = json["phases"].as_object().unwrap().keys().map(String::as_str).collect();
    phases.sort_unstable();
    for rank in ["0", "1"] {
        let mine: Vec<_> = rows.iter().filter(|row| row[0] == rank).collect();
        assert!(mine.iter().all(|row| row.len() == 6 && row[1..3] == ["2", "5"]), "{text}");
        let (step, parts) = mine.split_last().unwrap();
        let mut named: Vec<&str> = parts.iter().map(|row| row[3]).collect();
        named.sort_unstable();
        assert_eq!((step[3], named), ("step", phases.clone()), "{text}");
        for column in [4, 5] {
            let number = |row: &[&str]| row[column].parse::<f64>().unwrap();
            let sum: f64 = parts.iter().map(|row| number(row)).sum();
            let whole = number(step);
            // Rounded to six places each.
            assert!(whole > 0.0 && (sum - whole).abs() <= 1e-4, "{sum} of {whole} in\n{text}");
        }
    }
    assert_eq!(rows.len(), 2 * (phases.len() + 1), "{text}");
}

/// What a value must be.
type Holds<'a> = &'a dyn Fn(&Value) -> bool;

/// Every key there must be.
#[test]
fn the_summary_has_all_its_keys() {
    let desk = Desk::new(SMALL);
    let json = program::run_to_summary(
        // Tiles that do not end where the rooms do, so that something passes between them.
        &mut desk.atoll(["--quiet", "--ranks", "2", "--threads", "2", "--tiles", "3x3"]),
        &desk.path().join("summary.json"),
    );
    let count = |value: &Value| value.is_u64();
    let number = |value: &Value| value.as_f64().is_some_and(f64::is_finite);
    let fraction = |value: &Value| value.as_f64().is_some_and(|number| (0.0..=1.0).contains(&number));
    let positive = |value: &Value| value.as_f64().is_some_and(|number| number > 0.0);
    let hash = |value: &Value| {
        let digit = |byte: u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte);
        value.as_str().is_some_and(|text| text.len() == 32 && text.bytes().all(digit))
    };
    let pair = |value: &Value| {
        value.as_array().is_some_and(|pair| pair.len() == 2 && pair.iter().all(|number| number.as_f64().is_some()))
    };
    let phases = |value: &Value| {
        let times = |phase: &Value| {
            let time = |key: &str| phase[key].as_f64().filter(|&ms| ms >= 0.0 && ms.is_finite());
            // With a little room: the mean is rounded apart from the greatest.
            time("mean_ms").zip(time("max_rank_ms")).is_some_and(|(mean, most)| mean <= most * (1.0 + 1e-9))
        };
        value.as_object().is_some_and(|phases| !phases.is_empty() && phases.values().all(times))
    };
    let keys: [(&str, Holds); 34] = [
        ("bodies", &|value| *value == 400),
        ("steps", &|value| *value == 5),
        ("ranks", &|value| *value == 2),
        ("threads", &|value| *value == 2),
        ("tiles", &|value| *value == serde_json::json!([3, 3])),
        ("transport", &|value| *value == "channel"),
        ("machine", &|value| value.as_str().is_some_and(|machine| machine.contains(std::env::consts::ARCH))),
        ("wall_s", &positive),
        ("ms_per_step", &positive),
        ("state_hash", &hash),
        ("contact_hash", &hash),
        ("bodies_lost", &|value| *value == 0),
        ("escaped", &|value| *value == 0),
        ("contacts", &count),
        ("border_contact_fraction", &fraction),
        ("ghosts", &count),
        ("migrations", &count),
        ("bytes_sent", &|value| value.as_u64().is_some_and(|bytes| bytes > 0)),
        ("imbalance", &|value| value.as_f64().is_some_and(|imbalance| (1.0..=2.0).contains(&imbalance))),
        ("tiles_moved", &count),
        ("mass", &positive),
        ("kinetic_energy", &positive),
        ("mean_half_v2", &positive),
        ("mean_spin2", &positive),
        ("momentum", &pair),
        ("max_penetration", &number),
        ("mean_penetration", &number),
        ("constraint_violation", &number),
        ("max_constraint_violation", &number),
        ("islands", &count),
        ("largest_island", &count),
        ("asleep", &count),
        ("colors", &count),
        ("phases", &phases),
    ];
    for (key, holds) in keys {
        let value = json.get(key).unwrap_or_else(|| panic!("{key} is missing"));
        assert!(holds(value), "{key} is {value}");
    }
    if cfg!(target_os = "linux") {
        assert!(positive(&json["peak_rss_bytes"]), "peak_rss_bytes is {}", json["peak_rss_bytes"]);
    }
    assert_eq!(desk.files(), ["summary.json", "world.toml"], "something else was left behind");
}

#[test]
fn quiet_leaves_only_the_report() {
    let desk = Desk::new(SMALL);
    let ended = run(&mut desk.atoll(["--quiet", "--json", "summary.json"]));
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{ended}");
    let json = program::summary(&desk.path().join("summary.json"));
    for key in ["state_hash", "contact_hash"] {
        assert!(ended.stdout.contains(json[key].as_str().unwrap()), "{ended}");
    }
    assert!(ended.stdout.contains("0 lost, 0 escaped"), "{ended}");
    assert!(!ended.stdout.contains('\u{1b}'), "escape sequences without a terminal: {ended}");
}

#[test]
fn the_log_is_plain_text_where_there_is_no_terminal() {
    let ended = run(Desk::new(SMALL).atoll(["--quiet", "--ranks", "2"]).env("RUST_LOG", "atoll=info"));
    assert_eq!(ended.code, Some(0), "{ended}");
    assert!(ended.stderr.contains("rank=1") && !ended.stderr.contains('\u{1b}'), "{ended}");
}

#[test]
fn a_summary_replaces_the_one_before() {
    let desk = Desk::new(SMALL);
    let path = desk.path().join("summary.json");
    fs::write(&path, "what was there before, and longer than it ".repeat(1000)).unwrap();
    let json = program::run_to_summary(&mut desk.atoll(["--seed", "7"]), &path);
    assert_eq!(json["seed"], 7);
}

#[test]
fn more_ranks_than_tiles_is_mentioned_once() {
    let desk = Desk::new(SMALL);
    let path = desk.path().join("summary.json");
    let alone = program::run_to_summary(&mut desk.atoll(["--quiet"]), &path);
    let ended = run(&mut desk.atoll(["--quiet", "--ranks", "9", "--json", "summary.json"]));
    assert_eq!((ended.code, ended.complaints().len()), (Some(0), 1), "{ended}");
    assert!(ended.stderr.starts_with("atoll: 5 of 9 ranks stay idle: there are only 4 tiles"), "{ended}");
    let many = program::summary(&path);
    assert_eq!((&many["ranks"], &many["state_hash"]), (&9.into(), &alone["state_hash"]));
}

/// Circles of a pile with the most jitter start up to 0.4 m inside each other. They are pushed apart at no more than
/// the push-out speed of 3 m/s, keep next to nothing of it, and none is thrown out.
#[test]
fn bodies_that_overlap_at_the_start_are_pushed_apart_gently() {
    let desk = Desk::new("[scene]\nkind = \"pile\"\nbodies = 500\njitter = 0.25\n\n[run]\nsteps = 1\ntiles = [3, 2]\n");
    let path = desk.path().join("summary.json");
    let after = |steps: &str| {
        program::run_to_summary(&mut desk.atoll(["--quiet", "--steps", steps, "--set", "gravity=[0,0]"]), &path)
    };
    let value = |json: &Value, key: &str| json[key].as_f64().unwrap();
    let first = after("1");
    assert!(value(&first, "max_penetration") > 0.2, "they hardly overlap: {first:#}");
    for steps in ["1", "5", "20", "60"] {
        let json = after(steps);
        // What a single body at the push-out speed would have, if all others were at rest.
        assert!(value(&json, "mean_half_v2") < 0.5 * 3.0 * 3.0 / 500.0, "after {steps} steps: {json:#}");
        assert_eq!(json["bodies_lost"], 0);
    }
    let last = after("60");
    assert!(value(&last, "max_penetration") < 0.05, "they still overlap: {last:#}");
}

#[test]
fn a_reader_that_has_seen_enough_is_no_failure() {
    let desk = Desk::new(SMALL);
    let mut command = desk.atoll(["--quiet"]);
    let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let status = watched("a run without a reader", move || child.wait().unwrap());
    assert_eq!(status.code(), Some(0));
}

#[test]
fn help_and_version() {
    for (arguments, expected) in [
        (&["--help"][..], "Usage: atoll <COMMAND>"),
        (&["help", "run"], "Usage: atoll run"),
        (&["--version"], concat!("atoll ", env!("CARGO_PKG_VERSION"))),
    ] {
        let ended = run(program::command().args(arguments));
        assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{ended}");
        assert!(ended.stdout.contains(expected), "{ended}");
    }
    let help = run(program::command().args(["run", "--help"])).stdout;
    for option in [
        "--ranks",
        "--threads",
        "--transport",
        "--tiles",
        "--bodies",
        "--steps",
        "--seed",
        "--set",
        "--out",
        "--record-every",
        "--checkpoint-every",
        "--overwrite",
        "--resume",
        "--restarts",
        "--json",
        "--timings",
    ] {
        assert!(help.contains(option), "{option} is not in the help:\n{help}");
    }
    // Nothing asked: the help, as an error.
    let ended = run(&mut program::command());
    assert!(ended.code == Some(2) && ended.stderr.contains("Usage: atoll <COMMAND>"), "{ended}");
}

/// The first command of the README, at a size that suits a test, from wherever one stands.
#[test]
fn the_first_command_works_from_anywhere() {
    let elsewhere = tempfile::tempdir().unwrap();
    let absolute = program::root().join("configs/quickstart.toml");
    let from = |folder: &Path, config: &Path| {
        let json = elsewhere.path().join("summary.json");
        let mut command = program::command();
        command.current_dir(folder).arg("run").arg(config).args(["--quiet", "--bodies", "2000", "--steps", "10"]);
        let json = program::run_to_summary(&mut command, &json);
        assert_eq!((&json["ranks"], &json["transport"]), (&4.into(), &"channel".into()));
        json["state_hash"].clone()
    };
    let at_root = from(program::root(), Path::new("configs/quickstart.toml"));
    assert_eq!(from(elsewhere.path(), &absolute), at_root);
    assert_eq!(from(&program::root().join("core"), Path::new("../configs/quickstart.toml")), at_root);
}
