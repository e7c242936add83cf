//! The program as a user meets it: exit codes, one line per complaint, files, interrupts.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

const SMALL: &str = "[scene]\nkind = \"rooms\"\nbodies = 400\n[run]\nsteps = 5\ntiles = [2, 2]\n";

fn atoll(folder: &Path) -> Command {
    std::fs::write(folder.join("small.toml"), SMALL).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_atoll"));
    command.current_dir(folder).env_remove("RUST_LOG").args(["run", "small.toml"]);
    command
}

fn run(folder: &Path, arguments: &str) -> (Option<i32>, String, String) {
    let Output { status, stdout, stderr } = atoll(folder).args(arguments.split_whitespace()).output().unwrap();
    (status.code(), String::from_utf8(stdout).unwrap(), String::from_utf8(stderr).unwrap())
}

#[track_caller]
fn refused(arguments: &str, exit: i32, expected: &str) {
    let folder = tempfile::tempdir().unwrap();
    let (code, stdout, stderr) = run(folder.path(), arguments);
    assert_eq!((code, stdout.as_str()), (Some(exit), ""), "{stderr}");
    assert!(stderr.starts_with(&format!("atoll: {expected}")), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
}

#[test]
fn bad_input_takes_one_line_and_exit_code_2() {
    refused("--bodies -5", 2, "--bodies -5: must be a whole number");
    refused("--ranks 0", 2, "--ranks 0: must be a whole number within 1");
    refused("--threads 0", 2, "--threads 0: must be");
    refused("--tiles 0x3", 2, "--tiles 0x3: must be");
    refused("--set hertz=nan", 2, "--set physics.hertz=nan: must be positive and finite");
    refused("--set scene.kind=room", 2, "--set scene.kind=room: must be \"rooms\" or \"pile\"; did you mean rooms?");
    refused("--set sovler=pgs", 2, "--set sovler=pgs: unknown key; did you mean physics.solver?");
    refused("--rnks 2", 2, "unexpected argument '--rnks' found");
    refused("--transport local --ranks 2", 2, "--transport local: one rank at most");
    refused("--transport mpi", 2, "--transport mpi: not built into this version yet");
    refused("--out records", 2, "--out records: not built into this version yet");
    refused("--record-every 5", 2, "--record-every 5: not built into this version yet");
    refused("--json no/such/folder/summary.json", 2, "--json no/such/folder/summary.json: ");
    refused("--json .", 2, "--json .: it is a directory");
}

#[test]
fn a_state_that_is_not_finite_takes_one_line_and_exit_code_4() {
    for ranks in 1..=3 {
        let arguments = format!("--quiet --ranks {ranks} --set hertz=1 --set substeps=1 --set gravity=[3e38,3e38]");
        refused(&arguments, 4, "step ");
    }
}

#[test]
fn the_summary_reaches_the_file_whole_and_has_every_key() {
    let folder = tempfile::tempdir().unwrap();
    let (code, stdout, stderr) = run(folder.path(), "--quiet --ranks 2 --json summary.json");
    assert_eq!((code, stderr.as_str()), (Some(0), ""));
    let text = std::fs::read_to_string(folder.path().join("summary.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    for key in [
        "version",
        "scene",
        "seed",
        "config_hash",
        "bodies",
        "steps",
        "interrupted",
        "ranks",
        "threads",
        "tiles",
        "transport",
        "build_s",
        "wall_s",
        "ms_per_step",
        "state_hash",
        "contact_hash",
        "bodies_lost",
        "escaped",
        "contacts",
        "border_contact_fraction",
        "ghosts",
        "migrations",
        "islands",
        "largest_island",
        "bytes_sent",
        "messages_sent",
        "mass",
        "kinetic_energy",
        "mean_half_v2",
        "mean_spin2",
        "momentum",
        "max_penetration",
        "mean_penetration",
        "phases",
        "peak_rss_bytes",
    ] {
        assert!(json.get(key).is_some(), "{key} is missing");
    }
    assert_eq!((&json["bodies"], &json["bodies_lost"], &json["ranks"]), (&400.into(), &0.into(), &2.into()));
    assert_eq!(json["tiles"], serde_json::json!([2, 2]));
    let hash = json["state_hash"].as_str().unwrap();
    assert!(hash.len() == 32 && stdout.contains(hash), "{stdout}");
    assert!(json["phases"]["substeps"]["mean_ms"].is_f64() && json["phases"]["substeps"]["max_rank_ms"].is_f64());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "something else was left behind");
}

#[test]
fn idle_ranks_are_mentioned_once() {
    let folder = tempfile::tempdir().unwrap();
    let (code, _, stderr) = run(folder.path(), "--quiet --ranks 7");
    assert_eq!(code, Some(0));
    assert_eq!(stderr, "atoll: 3 of 7 ranks stay idle: there are only 4 tiles; use fewer ranks or more tiles\n");
}

#[test]
fn a_closed_reader_is_no_failure() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = atoll(folder.path()).arg("--quiet").stdout(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_all_ranks_after_one_step_with_a_summary() {
    let folder = tempfile::tempdir().unwrap();
    for signal in ["-INT", "-TERM"] {
        let mut child = atoll(folder.path())
            .args(["--steps", "100000000", "--ranks", "3", "--json", "summary.json"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // The first line of progress tells that it is under way.
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        assert!(lines.next().unwrap().unwrap().starts_with("step "));
        let killed = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        assert!(killed.success());
        let rest: Vec<String> = lines.map(Result::unwrap).collect();
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130), "{rest:?}");
        assert!(rest.iter().any(|line| line.starts_with("atoll: stopping after this step")), "{rest:?}");
        assert!(String::from_utf8(output.stdout).unwrap().contains(", interrupted"));
        let text = std::fs::read_to_string(folder.path().join("summary.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        let steps = json["steps"].as_u64().unwrap();
        assert!(json["interrupted"] == true && steps > 0 && steps < 100_000_000);
        assert_eq!(json["bodies_lost"], 0);
    }
}

#[test]
fn help_and_version_are_no_failure() {
    for argument in ["--help", "--version"] {
        let output = Command::new(env!("CARGO_BIN_EXE_atoll")).arg(argument).output().unwrap();
        assert_eq!(output.status.code(), Some(0));
        assert!(String::from_utf8(output.stdout).unwrap().contains("atoll"));
    }
    assert_eq!(Command::new(env!("CARGO_BIN_EXE_atoll")).output().unwrap().status.code(), Some(2));
}
