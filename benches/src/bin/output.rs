//! What recording and snapshots cost a run, and how long the comparison of two recordings takes.
//!
//! ```sh
//! cargo run --release -p atoll-benches --bin output [REPEATS [STEPS]]
//! ```
//!
//! NORMAL on one rank of one thread, in turns: writing nothing, a record every tenth step, a snapshot every hundredth. The
//! time is that of all steps and of waiting until everything is written. Folders are made where temporary files go (`TMPDIR`).

use atoll::Observer;
use atoll::compare;
use atoll::config::Config;
use atoll::internals::{Plan, RunFolder, run_plan};
use atoll_benches::{NORMAL, arguments, median};
use serde_json::json;
use std::fs;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;
use tempfile::tempdir;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("output: {error}");
            ExitCode::FAILURE
        }
    }
}

/// What is written, as in a configuration.
const MODES: [(&str, Option<(&str, &str)>); 3] =
    [("nothing", None), ("records", Some(("record_every", "10"))), ("snapshots", Some(("checkpoint_every", "100")))];

fn run() -> Result<(), String> {
    let [repeats, steps] = arguments(["REPEATS", "STEPS"], [5, 200])?;
    let parent = tempdir().map_err(|error| error.to_string())?;
    let mut times = MODES.map(|_| Vec::new());
    let mut bodies = 0;
    let folder = |mode: &str, which: u64| parent.path().join(format!("{mode}-{which}"));
    for repeat in 0..repeats {
        for ((name, every), times) in MODES.iter().zip(&mut times) {
            // The last two of each are kept, to be compared.
            let folder = folder(name, repeat % 2);
            let _ = fs::remove_dir_all(&folder);
            let summary = run_into(&folder, *every, steps).map_err(|error| error.to_string())?;
            bodies = summary.bodies;
            times.push(summary.wall_s * 1e3 / steps as f64);
        }
    }
    let medians = times.map(median);
    for ((name, _), ms) in MODES.iter().zip(medians) {
        let ratio = ms / medians[0];
        let bytes = size(&folder(name, 0)) as f64 / bodies as f64;
        eprintln!("{name:<10} {ms:>8.2} ms/step {ratio:>6.3} x {bytes:>8.1} bytes/body in all");
        let row =
            json!({ "bench": "output", "writes": name, "ms_per_step": ms, "ratio": ratio, "bytes_per_body": bytes });
        println!("{row}");
    }
    if repeats > 1 {
        let start = Instant::now();
        let [a, b] = [0, 1].map(|which| folder("records", which));
        let same = compare::compare(&a, &b, None, |_, _| {}).map_err(|error| error.to_string())?.identical;
        let (seconds, run) = (start.elapsed().as_secs_f64(), medians[1] * 1e-3 * steps as f64);
        let told = if same { "identical" } else { "different" };
        eprintln!("diff       {seconds:>8.2} s, a run {run:.2} s: {told}");
        println!("{}", json!({ "bench": "output", "diff_s": seconds, "run_s": run, "identical": same }));
    }
    Ok(())
}

fn run_into(folder: &Path, every: Option<(&str, &str)>, steps: u64) -> Result<atoll::Summary, atoll::RunError> {
    let steps = steps.to_string();
    let mut overrides = vec![("steps", steps.as_str()), ("ranks", "1"), ("threads", "1")];
    overrides.extend(every);
    let config = Config::from_toml_str(NORMAL.name, NORMAL.text, &overrides)?;
    let plan = match every {
        Some(_) => Plan::beginning(&config, RunFolder::new("the folder", folder))?,
        None => Plan::new(&config)?,
    };
    let _claim = plan.claim(None)?;
    run_plan(&plan, &Observer::default())
}

/// Bytes of all files in a folder.
fn size(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .map(|entry| if entry.path().is_dir() { size(&entry.path()) } else { entry.metadata().map_or(0, |m| m.len()) })
        .sum()
}
