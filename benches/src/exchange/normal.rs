//! NORMAL on two ranks of every transport, beside one rank.

use super::Method;
use crate::median;
use serde_json::Value;
use std::process::Command;

/// A run that the others are compared with, and they.
const ALONE: &str = "local";

/// What became of one run.
struct Run {
    ms_per_step: f64,
    /// Of a step: the exchange, waiting for slower ranks excluded. See [`unwaited`].
    exchange_ms: f64,
    wait_ms: f64,
    state_hash: String,
}

/// Runs NORMAL so often over each transport, in turns, and prints medians of the ratios within each turn.
///
/// # Errors
/// If a run fails or results differ.
pub fn compare(repeats: u64, steps: u64) -> Result<(), String> {
    let mut ways = vec![(ALONE, Method::Channel)];
    ways.extend(Method::all().into_iter().filter_map(|method| Some((method.transport()?, method))));
    let mut runs: Vec<Vec<Run>> = ways.iter().map(|_| Vec::new()).collect();
    for _ in 0..repeats {
        for (runs, &(transport, method)) in runs.iter_mut().zip(&ways) {
            runs.push(run(transport, method, steps)?);
        }
    }
    eprintln!("\nNORMAL, {steps} steps, 2 ranks x 1 thread beside 1 x 1, medians of {repeats} turns");
    eprintln!("{:>14}{:>10}{:>10}{:>14}{:>10}{:>10}", "", "ms/step", "speedup", "exchange ms", "share", "wait ms");
    for (index, (transport, method)) in ways.iter().enumerate() {
        let name = if *transport == ALONE { ALONE } else { method.name() };
        let of = |value: &dyn Fn(&Run) -> f64| median(runs[index].iter().map(value).collect());
        let ms = of(&|run| run.ms_per_step);
        let speedups: Vec<f64> =
            runs[0].iter().zip(&runs[index]).map(|(alone, run)| alone.ms_per_step / run.ms_per_step).collect();
        let (speedup, share) = (median(speedups.clone()), of(&|run| run.exchange_ms / run.ms_per_step));
        let (exchange, wait) = (of(&|run| run.exchange_ms), of(&|run| run.wait_ms));
        eprintln!("{name:>14}{ms:>10.2}{speedup:>10.3}{exchange:>14.3}{:>8.2} %{wait:>10.3}", 100.0 * share);
        println!(
            r#"{{"bench":"exchange-normal","method":"{name}","ranks":{},"steps":{steps},"ms_per_step":{ms:.3},"speedup":{speedup:.3},"repeats_speedup":{speedups:.3?},"exchange_ms":{exchange:.4},"exchange_share":{share:.5},"wait_ms":{wait:.3},"state_hash":"{}"}}"#,
            if name == ALONE { 1 } else { 2 },
            runs[index][0].state_hash,
        );
        if runs[index].iter().any(|run| run.state_hash != runs[0][0].state_hash) {
            return Err(format!("{name} gave another state hash than one rank"));
        }
    }
    Ok(())
}

fn run(transport: &str, method: Method, steps: u64) -> Result<Run, String> {
    let program = std::env::current_exe().map_err(|error| error.to_string())?;
    let ranks = if transport == ALONE { 1 } else { 2 };
    let mut command = if transport == ALONE { Command::new(&program) } else { method.command(&program, ranks) };
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let (json, csv) = (folder.path().join("summary.json"), folder.path().join("timings.csv"));
    command.args([
        "run",
        concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/normal.toml"),
        "--quiet",
        "--transport",
        transport,
    ]);
    command.args(["--threads", "1", "--ranks", &ranks.to_string(), "--steps", &steps.to_string()]);
    if method == Method::Sparse {
        command.args(["--set", "mpi_exchange=sparse"]);
    }
    command.arg("--json").arg(&json).arg("--timings").arg(&csv);
    let output = command.output().map_err(|error| format!("{command:?}: {error}"))?;
    if !output.status.success() {
        return Err(format!("{command:?}: {}", String::from_utf8_lossy(&output.stderr)));
    }
    let read = |path| std::fs::read_to_string(path).map_err(|error| error.to_string());
    let summary: Value = serde_json::from_str(&read(json)?).map_err(|error| error.to_string())?;
    let number = |value: &Value| value.as_f64().ok_or("a figure is missing from the summary");
    Ok(Run {
        ms_per_step: number(&summary["ms_per_step"])?,
        exchange_ms: unwaited(&read(csv)?).ok_or("the timings cannot be read")?,
        wait_ms: number(&summary["phases"]["wait"]["mean_ms"])?,
        state_hash: summary["state_hash"].as_str().unwrap_or_default().to_owned(),
    })
}

/// What an exchange costs a rank that has nobody to wait for, in ms per step, at most: the least over ranks of encoding,
/// sending, and waiting for anything, bytes under way included. Where one rank is slower in every step, the time of that
/// one is nearly free of waiting; where they take turns, this is too much rather than too little.
fn unwaited(timings: &str) -> Option<f64> {
    let mut of_ranks = Vec::new();
    for line in timings.lines().skip(1) {
        let columns: Vec<&str> = line.split(',').collect();
        let (rank, phase, ms) =
            (columns.first()?.parse::<usize>().ok()?, *columns.get(3)?, columns.get(4)?.parse::<f64>().ok()?);
        if of_ranks.len() <= rank {
            of_ranks.resize(rank + 1, 0.0);
        }
        if ["exchange", "wait"].contains(&phase) {
            of_ranks[rank] += ms;
        }
    }
    of_ranks.into_iter().reduce(f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rank_that_waits_least_tells_what_an_exchange_costs() {
        let csv = "rank,threads,steps,phase,mean_ms,share\n0,1,9,exchange,0.5,0\n0,1,9,wait,3.0,0\n0,1,9,solve,7,0\n\
                   1,1,9,exchange,0.75,0\n1,1,9,wait,0.25,0\n";
        assert_eq!(unwaited(csv), Some(1.0));
        assert_eq!(unwaited("rank\nx"), None);
    }
}
