//! A run that is looked at is the run that is not.

use atoll_tests::page::{Heard, Page, Served};
use atoll_tests::program::{self, run_to_summary};
use atoll_tests::ways::Way;
use serde_json::{Value, json};
use std::net::TcpListener;
use std::time::{Duration, Instant};
use tempfile::tempdir;

/// So many that a page is there before they are made.
const STEPS: u32 = if cfg!(debug_assertions) { 120 } else { 800 };

/// A run of so many steps.
fn small(steps: u32) -> Vec<String> {
    format!("--bodies 3000 --tiles 4x4 --steps {steps}").split(' ').map(str::to_owned).collect()
}

/// What a page is told next of a sort.
fn heard(page: &mut Page, of: &str) -> Value {
    let begun = Instant::now();
    loop {
        assert!(begun.elapsed() < program::LIMIT, "nothing is said of {of}");
        match page.hear().expect("it is said before the end") {
            Heard::Said(said) if said["type"] == of => break said,
            Heard::Said(_) => {}
            Heard::Frame(number, ..) => page.wish(&json!({ "do": "ack", "frame": number })),
        }
    }
}

fn hashes(summary: &Value) -> [&Value; 3] {
    ["state_hash", "contact_hash", "steps"].map(|key| &summary[key])
}

pub(crate) fn domain(hello: &Value) -> [f64; 4] {
    let domain = &hello["sources"][0]["domain"];
    [0, 1, 2, 3].map(|i| domain[i].as_f64().unwrap())
}

#[test]
fn a_run_under_the_eyes_of_a_restless_page_comes_to_the_same_hashes() {
    let folder = tempdir().unwrap();
    let config = "configs/quickstart.toml";
    let moves = ["--set", "balance=shuffled", "--set", "max_bodies=100", "--set", "retile_every=2"];
    let alone = run_to_summary(
        Way::Channel.command(2, config).args(small(STEPS)).args(moves),
        &folder.path().join("alone.json"),
    );
    for way in Way::all() {
        let ranks = if way == Way::Local { 1 } else { 2 };
        let json = folder.path().join("watched.json");
        let mut command = way.command(ranks, config);
        let served = Served::start(command.args(small(STEPS)).args(moves).args(["--view", "--json"]).arg(&json));
        let mut page = Page::open(&served);
        let hello = page.hello();
        assert_eq!((&hello["recorded"], &hello["last_step"]), (&json!(false), &json!(STEPS)), "{way}");
        page.fidget(domain(&hello), Duration::from_secs(60));
        let ended = served.end();
        assert_eq!(ended.code, Some(0), "{way}: {ended}");
        assert!(page.frames > 2, "{way}: {} frames", page.frames);
        let watched = program::summary(&json);
        assert_eq!(hashes(&watched), hashes(&alone), "{way}");
        // What is sent for the page is not what steps send.
        if way == Way::Channel {
            assert_eq!(watched["bytes_sent"], alone["bytes_sent"]);
        }
    }
}

#[test]
fn what_is_viewed_waits_for_the_first_page_and_stays_until_it_is_interrupted() {
    let served =
        Served::start(program::command().args(["view", "configs/quickstart.toml", "--ranks", "2"]).args(small(120)));
    std::thread::sleep(Duration::from_millis(300));
    let mut page = Page::open(&served);
    let hello = page.hello();
    // Real time, though nobody looks for a while.
    let Some(Heard::Said(pace)) = page.hear() else { panic!("it is told how fast time is to go on") };
    assert_eq!(pace, json!({ "type": "pace", "playing": true, "times": 1.0 }));
    page.look(domain(&hello), [320, 240], "kind");
    let begun = Instant::now();
    assert_eq!(page.frame().unwrap().0, 0, "it begins when somebody looks");
    let figures = heard(&mut page, "figures")["figures"].clone();
    assert!(figures.as_array().unwrap().contains(&json!(["bodies", "3,000"])), "all are there already: {figures}");
    drop(page);
    std::thread::sleep(Duration::from_millis(300));
    let mut page = Page::open(&served);
    page.look(domain(&hello), [320, 240], "kind");
    while page.frame().unwrap().0 < 120 {}
    assert!(begun.elapsed() > Duration::from_millis(1900), "two seconds of the world in {:?}", begun.elapsed());
    // One who comes late sees the end.
    let mut late = Page::open(&served);
    late.look(domain(&hello), [320, 240], "speed");
    assert_eq!(late.frame().unwrap().0, 120);
    let address = served.address().to_owned();
    served.interrupt();
    let ended = served.end();
    assert_eq!(ended.code, Some(0), "{ended}");
    assert!(ended.stdout.contains("120 steps in "), "{ended}");
    assert!(ended.stderr.contains("waits for the first page, then goes on at 1 x real time; --speed"), "{ended}");
    assert_eq!(page.frame(), None);
    TcpListener::bind(address).expect("the port is free again");
}

#[test]
fn a_page_is_told_what_is_refused_and_why_a_run_failed() {
    let folder = tempdir().unwrap();
    let acts = folder.path().join("acts.jsonl");
    std::fs::write(&acts, "{\"step\": 3, \"remove\": 777777}\n").unwrap();
    for way in Way::all() {
        let mut command = way.command(if way == Way::Local { 1 } else { 2 }, "configs/quickstart.toml");
        let served = Served::start(command.args(small(4_000_000_000)).arg("--view"));
        let mut page = Page::open(&served);
        page.wish(&json!({ "do": "command", "line": "{\"remove\": 999999}" }));
        let note = heard(&mut page, "note")["text"].as_str().unwrap().to_owned();
        assert!(
            note.starts_with("a hand on the page: step ") && note.ends_with("there is no body 999999; left out"),
            "{note}"
        );
        served.interrupt();
        if let Way::Mpi(_) = way {
            // What mpirun does about an interrupt of its own is its business.
            served.end();
        } else {
            heard(&mut page, "over");
            assert_eq!(served.end().code, Some(130), "{way}");
        }
    }
    let mut command = program::command();
    command.args(["view", "configs/quickstart.toml", "--ranks", "2", "--commands"]).arg(&acts);
    let served = Served::start(command.args(["--bodies", "500", "--tiles", "4x4"]));
    let mut page = Page::open(&served);
    let hello = page.hello();
    page.look(domain(&hello), [320, 240], "kind");
    let has_failed = |served: Served, mut page: Page, expected: &str| {
        let why = heard(&mut page, "failed")["why"].as_str().unwrap().to_owned();
        assert!(why.contains(expected), "{why}");
        let ended = served.end();
        assert_eq!((ended.code, ended.stderr.contains(&why)), (Some(2), true), "{ended}");
    };
    has_failed(served, page, "line 1: step 3: there is no body 777777");
    // A record that is damaged.
    let recorded = folder.path().join("recorded");
    let mut command = program::command();
    let ended = program::run(
        command
            .args(["run", "configs/quickstart.toml", "--record-every", "10", "--out"])
            .arg(&recorded)
            .args(small(20)),
    );
    assert_eq!(ended.code, Some(0), "{ended}");
    let segment = recorded.join("rank-00000/steps-0000000000-0000000020.parquet");
    let mut bytes = std::fs::read(&segment).unwrap();
    bytes[40] ^= 1;
    std::fs::write(&segment, bytes).unwrap();
    let info = program::run(program::command().arg("info").arg(&segment));
    assert_eq!((info.code, info.stderr.contains("are not those that were written")), (Some(2), true), "{info}");
    let served = Served::start(program::command().arg("view").arg(&recorded));
    let mut page = Page::open(&served);
    let hello = page.hello();
    page.look(domain(&hello), [320, 240], "kind");
    has_failed(served, page, "the bytes of step 0 are not those that were written");
}

#[test]
fn who_interrupts_a_run_that_stands_still_gets_its_snapshot_and_summary() {
    let folder = tempdir().unwrap();
    let out = folder.path().join("out");
    let mut command = program::command();
    command
        .args(["run", "configs/quickstart.toml", "--ranks", "2", "--set", "balance=shuffled", "--view"])
        .args(["--set", "max_bodies=100", "--set", "retile_every=1"])
        .args(["--checkpoint-every", "1000", "--out"])
        .arg(&out);
    let served = Served::start(command.args(small(4_000_000_000)));
    let mut page = Page::open(&served);
    let hello = page.hello();
    page.wish(&json!({ "do": "pause" }));
    page.look(domain(&hello), [320, 240], "kind");
    let (step, _) = page.frame().unwrap();
    page.wish(&json!({ "do": "step", "by": 3 }));
    // Tiles are cut, and go to other ranks, between any two steps, and the page hears what they are and who holds them.
    let tiles = heard(&mut page, "tiles")["worlds"][0].clone();
    let levels = tiles["levels"].as_str().unwrap();
    assert!(levels.len() > 16 && levels.contains('b'), "{tiles}");
    assert_eq!(tiles["rank_of_tile"].as_array().map(Vec::len), Some(levels.len()), "{tiles}");
    assert_ne!(tiles["rank_of_tile"], hello["sources"][0]["rank_of_tile"]);
    while page.frame().unwrap().0 < step + 3 {}
    served.interrupt();
    let ended = served.end();
    assert_eq!(ended.code, Some(130), "{ended}");
    let summary = program::summary(&out.join("summary.json"));
    // The step under way when it was asked to stop.
    assert!((step + 3..=step + 5).contains(&(summary["steps"].as_u64().unwrap() as u32)), "{step} {summary:#}");
    let more = (summary["steps"].as_u64().unwrap() + 60).to_string();
    let resumed = program::run(program::command().args(["run", "--steps", &more, "--resume"]).arg(&out));
    assert_eq!(resumed.code, Some(0), "{resumed}");
}
