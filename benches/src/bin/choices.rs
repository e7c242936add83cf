//! What each choice of the report costs, in time and in quality: ours with one of them in its place, and all at once.
//!
//! ```sh
//! cargo run --release -p atoll-benches --bin choices [REPEATS [BODIES [STEPS]]]
//! ```
//!
//! Two scenes on one thread: NORMAL, where bodies meet in passing (by default 200,000 bodies, 100 steps, the default
//! tiles), and a pile of 20,000 bodies that comes to rest over the borders of 4 x 4 tiles within 600 steps. Choices take
//! turns; times are medians. Quality is a function of the configuration and needs no repeats.

use atoll::Summary;
use atoll_benches::{File, NORMAL, PILE, arguments, median, run_whatever_escapes};
use std::process::ExitCode;

type Overrides = &'static [(&'static str, &'static str)];

/// A choice, and what it changes.
const CHOICES: [(&str, Overrides); 8] = [
    ("ours", &[]),
    ("quadtree", &[("broad_phase", "quadtree")]),
    ("islands by dfs", &[("islands", "dfs")]),
    ("each island on one thread", &[("parallel", "islands")]),
    ("pgs", &[("solver", "pgs")]),
    ("exchange per step", &[("exchange", "step")]),
    ("frozen ghosts, per step", &[("exchange", "step"), ("ghosts", "frozen")]),
    (
        "all of them",
        &[
            ("broad_phase", "quadtree"),
            ("islands", "dfs"),
            ("parallel", "islands"),
            ("solver", "pgs"),
            ("exchange", "step"),
            ("ghosts", "frozen"),
        ],
    ),
];

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("choices: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), String> {
    let [repeats, bodies, steps] = arguments(["REPEATS", "BODIES", "STEPS"], [3, 200_000, 100])?;
    let (bodies, steps) = (bodies.to_string(), steps.to_string());
    compare("normal", NORMAL, &[("bodies", &bodies), ("steps", &steps)], repeats)?;
    compare("pile", PILE, &[("bodies", "20000"), ("tiles", "4x4")], repeats)
}

fn compare(name: &str, file: File, scene: &[(&str, &str)], repeats: u64) -> Result<(), String> {
    let mut runs = CHOICES.map(|_| Vec::new());
    for _ in 0..repeats {
        for (runs, (_, choice)) in runs.iter_mut().zip(CHOICES) {
            let overrides: Vec<_> =
                scene.iter().chain(choice).copied().chain([("ranks", "1"), ("threads", "1")]).collect();
            runs.push(run_whatever_escapes(file, &overrides)?);
        }
    }
    let first = &runs[0][0];
    let [columns, rows] = first.tiles;
    eprintln!(
        "{name}, {} bodies, {} steps, {columns} x {rows} tiles, 1 thread, median of {repeats}",
        first.bodies, first.steps
    );
    eprintln!(
        "{:<27}{:>9}{:>8}{:>9}{:>9}{:>11}{:>10}{:>9}{:>9}{:>11}{:>9}",
        "choice", "ms/step", "ratio", "pairs", "solver", "v^2/2", "J/kg", "mean mm", "max mm", "violation", "escaped"
    );
    let ours = median_of(&runs[0], |run| run.ms_per_step);
    for ((choice, _), runs) in CHOICES.into_iter().zip(&runs) {
        let end = &runs[0];
        let ms = median_of(runs, |run| run.ms_per_step);
        let pairs = median_of(runs, |run| phases(run, &["flush", "broad_phase"]));
        let solver = median_of(runs, |run| phases(run, &["islands", "coloring", "prepare", "substeps"]));
        let (per_kg, mean, max) =
            (end.kinetic_energy / end.mass, 1000.0 * end.mean_penetration, 1000.0 * end.max_penetration);
        let (half_v2, escaped) = (end.mean_half_v2, end.escaped);
        let violation = end.constraint_violation.expect("steps were made");
        let ratio = ms / ours;
        eprintln!(
            "{choice:<27}{ms:>9.2}{ratio:>8.2}{pairs:>9.2}{solver:>9.2}{half_v2:>11.4}{per_kg:>10.1e}{mean:>9.2}{max:>9.1}{violation:>11.1e}{escaped:>9}"
        );
        let all: Vec<f64> = runs.iter().map(|run| run.ms_per_step).collect();
        println!(
            r#"{{"bench":"choices","scene":"{name}","choice":"{choice}","bodies":{},"steps":{},"tiles":[{columns},{rows}],"ms_per_step":{ms:.3},"repeats_ms_per_step":{all:.3?},"pairs_ms":{pairs:.3},"solver_ms":{solver:.3},"mean_half_v2":{half_v2:.5},"kinetic_energy_per_kg":{per_kg:.3e},"mean_penetration":{:.6},"max_penetration":{:.6},"constraint_violation":{violation:.3e},"escaped":{escaped}}}"#,
            end.bodies, end.steps, end.mean_penetration, end.max_penetration
        );
    }
    Ok(())
}

fn median_of(runs: &[Summary], number: impl Fn(&Summary) -> f64) -> f64 {
    median(runs.iter().map(number).collect())
}

/// Time of some phases together, in ms per step.
fn phases(run: &Summary, names: &[&str]) -> f64 {
    run.phases.iter().filter(|(name, _)| names.contains(name)).map(|(_, phase)| phase.mean_ms).sum()
}
