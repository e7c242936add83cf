//! How long a step of the reported experiment takes on one thread, and the memory it needs: 700,000 bodies, 200 steps.
//!
//! ```sh
//! cargo run --release -p atoll-benches --bin step [REPEATS [BODIES [STEPS]]]
//! ```
//!
//! The table gives the median of the repeats, by phase; the JSON has every repeat.

use atoll_benches::{arguments, median, normal};
use std::process::ExitCode;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("step: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), String> {
    let [repeats, bodies, steps] = arguments(["REPEATS", "BODIES", "STEPS"], [3, 700_000, 200])?;
    let runs = (0..repeats).map(|_| normal(bodies, "auto", steps)).collect::<Result<Vec<_>, _>>()?;
    let first = &runs[0];
    if runs.iter().any(|run| run.state_hash != first.state_hash) {
        return Err("two repeats of one run differ".to_owned());
    }

    let all: Vec<f64> = runs.iter().map(|run| run.ms_per_step).collect();
    let ms_per_step = median(all.clone());
    let [columns, rows] = first.tiles;
    eprintln!("NORMAL, {bodies} bodies, {steps} steps, {columns} x {rows} tiles, 1 thread, median of {repeats}");
    eprintln!("{:<14}{:>10}", "phase", "ms/step");
    for (index, (name, _)) in first.phases.iter().enumerate() {
        let phase = median(runs.iter().map(|run| run.phases[index].1.mean_ms).collect());
        eprintln!("{:<14}{phase:>10.3}", name.replace('_', " "));
    }
    eprintln!("{:<14}{ms_per_step:>10.3}", "step");
    // Of the process, whose repeats all need the same.
    let peak = first.peak_rss_bytes;
    eprintln!("{:<14}{:>10.0} MB", "memory", peak as f64 * 1e-6);
    let hash = &first.state_hash;
    println!(
        r#"{{"bench":"step","bodies":{bodies},"steps":{steps},"tiles":[{columns},{rows}],"ms_per_step":{ms_per_step:.3},"repeats_ms_per_step":{all:.3?},"peak_rss_bytes":{peak},"state_hash":"{hash}"}}"#
    );
    Ok(())
}
