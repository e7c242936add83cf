//! What signals do to a run: it ends after the step under way, with everything that belongs to an end.
#![cfg(unix)]

use atoll_tests::program::{self, Running};
use serde_json::Value;
use std::process::Command;
use tempfile::{TempDir, tempdir};

/// A run that does not end by itself.
const ENDLESS: [&str; 6] = ["run", "configs/quickstart.toml", "--tiles", "2x2", "--steps", "4000000000"];

/// The endless run, under way, with a folder for its summary.
fn under_way(options: &[&str]) -> (Running, TempDir) {
    start(program::command().args(ENDLESS), options)
}

/// The endless run on so many ranks each, all at the same time: until its first line each takes two seconds.
fn all_under_way<'a>(ranks: impl IntoIterator<Item = &'a str>) -> Vec<(Running, TempDir)> {
    let begin = |ranks| begin(program::command().args(ENDLESS), &["--bodies", "400", "--ranks", ranks]);
    let mut all: Vec<_> = ranks.into_iter().map(begin).collect();
    all.iter_mut().for_each(|(running, _)| running.wait_for_line("step "));
    all
}

fn start(command: &mut Command, options: &[&str]) -> (Running, TempDir) {
    let (mut running, folder) = begin(command, options);
    // The first line of progress: every rank is under way.
    running.wait_for_line("step ");
    (running, folder)
}

fn begin(command: &mut Command, options: &[&str]) -> (Running, TempDir) {
    let folder = tempdir().unwrap();
    (Running::start(command.args(options).arg("--json").arg(folder.path().join("summary.json"))), folder)
}

/// The summary of a run that ends by the signals it was sent.
#[track_caller]
fn interrupted(running: Running, folder: &TempDir) -> Value {
    let ended = running.end();
    assert_eq!(ended.code, Some(130), "{ended}");
    let told = ended.complaints().iter().filter(|line| line.starts_with("atoll: ")).count();
    assert_eq!(told, 1, "{ended}");
    assert!(ended.stdout.contains("interrupted"), "{ended}");
    let summary = program::summary(&folder.path().join("summary.json"));
    assert_eq!(summary["interrupted"], true, "{summary:#}");
    summary
}

/// Ctrl-C and a polite kill end all ranks after the same step, with the summary so far.
#[test]
fn an_interrupt_leaves_a_summary_and_exit_code_130() {
    let ways = ["INT", "TERM", "HUP"].into_iter().flat_map(|signal| [(signal, "1"), (signal, "3")]);
    for ((signal, _), (running, folder)) in ways.clone().zip(all_under_way(ways.map(|(_, ranks)| ranks))) {
        running.signal(signal);
        let summary = interrupted(running, &folder);
        assert!((1..4_000_000_000).contains(&summary["steps"].as_u64().unwrap()), "{summary:#}");
        assert_eq!((&summary["bodies_lost"], &summary["escaped"]), (&0.into(), &0.into()), "{summary:#}");
        assert_eq!(folder.path().read_dir().unwrap().count(), 1, "something else is left");
    }
}

/// `timeout` signals the process and then its group.
#[test]
fn two_signals_at_once_are_one() {
    for (running, folder) in all_under_way(["1", "3"]) {
        let twice = format!("kill -TERM {0}; kill -TERM {0}", running.id());
        assert!(Command::new("sh").args(["-c", &twice]).status().unwrap().success());
        interrupted(running, &folder);
    }
}

#[test]
fn nohup_outlives_its_terminal() {
    let mut nohup = Command::new("nohup");
    nohup.arg(program::command().get_program()).args(ENDLESS);
    let (mut running, folder) = start(program::at_home(&mut nohup), &["--bodies", "400"]);
    running.signal("HUP");
    // Lines come every other second: the second of these was not on its way when the signal came.
    running.wait_for_line("step ");
    running.wait_for_line("step ");
    running.signal("TERM");
    interrupted(running, &folder);
}

/// An interrupted run has gone exactly as far as it says.
#[test]
fn an_interrupted_run_is_the_beginning_of_the_whole_one() {
    let (running, folder) = under_way(&["--ranks", "3"]);
    running.signal("INT");
    let cut = interrupted(running, &folder);
    let steps = cut["steps"].to_string();
    let mut whole = program::command();
    whole.args(&ENDLESS[..4]).args(["--quiet", "--steps", &steps]);
    let whole = program::run_to_summary(&mut whole, &folder.path().join("whole.json"));
    for key in ["steps", "state_hash", "contact_hash", "migrations"] {
        assert_eq!(cut[key], whole[key], "{key}");
    }
}

/// Files that are begun under other names are not left.
#[test]
fn an_interrupted_export_leaves_nothing_half_written() {
    let folder = tempdir().unwrap();
    let export = ["scene", "export", "configs/normal.toml", "--bodies", "1000000", "--bodies-as", "csv", "--out"];
    let running = Running::start(program::command().args(export).arg(folder.path()));
    let names = || folder.path().read_dir().unwrap().map(|file| file.unwrap().file_name().into_string().unwrap());
    while !names().any(|name| name.starts_with(".bodies.csv.")) {
        assert!(!folder.path().join("bodies.csv").exists(), "it was done before it was seen");
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    running.signal("TERM");
    let ended = running.end();
    assert_eq!((ended.code, ended.complaints().len()), (Some(130), 1), "{ended}");
    assert_eq!(names().collect::<Vec<_>>(), Vec::<String>::new());
}
