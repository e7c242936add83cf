//! What a body costs in worlds of 200,000 to 2,000,000: NORMAL at one density and one size of tile, one thread.
//!
//! ```sh
//! cargo run --release -p atoll-benches --bin growth [REPEATS [STEPS]]
//! ```
//!
//! A step should cost the same per body, however many there are. The sizes take turns, so that a machine that gets
//! slower meanwhile does so for all of them; the table gives medians, and the ratio to the smallest world.

use atoll_benches::{arguments, median, normal};
use std::process::ExitCode;

const BODIES: [u64; 4] = [200_000, 500_000, 1_000_000, 2_000_000];

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("growth: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), String> {
    let [repeats, steps] = arguments(["REPEATS", "STEPS"], [3, 100])?;
    let mut nanoseconds = BODIES.map(|_| Vec::new());
    let mut tiles = BODIES.map(|_| [0; 2]);
    for _ in 0..repeats {
        for (size, &bodies) in BODIES.iter().enumerate() {
            let summary = normal(bodies, steps)?;
            nanoseconds[size].push(summary.ms_per_step * 1e6 / bodies as f64);
            tiles[size] = summary.tiles;
        }
    }

    eprintln!("NORMAL, {steps} steps, 1 thread, median of {repeats}");
    eprintln!("{:>10}{:>10}{:>13}{:>16}{:>9}", "bodies", "tiles", "bodies/tile", "ns/body/step", "ratio");
    let smallest = median(nanoseconds[0].clone());
    for ((bodies, all), [columns, rows]) in BODIES.into_iter().zip(nanoseconds).zip(tiles) {
        let per_tile = bodies / u64::from(columns * rows);
        let each = median(all.clone());
        let ratio = each / smallest;
        let grid = format!("{columns}x{rows}");
        eprintln!("{bodies:>10}{grid:>10}{per_tile:>13}{each:>16.2}{ratio:>9.3}");
        println!(
            r#"{{"bench":"growth","bodies":{bodies},"steps":{steps},"tiles":[{columns},{rows}],"ns_per_body_step":{each:.2},"repeats_ns_per_body_step":{all:.2?},"ratio":{ratio:.3}}}"#
        );
    }
    Ok(())
}
