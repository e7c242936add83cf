//! What a body costs in worlds of 200,000 to 20,000,000, at one size of tile, and in tiles of 900 to 125,000, in one
//! world: NORMAL at one density, one thread.
//!
//! ```sh
//! cargo run --release -p atoll-benches --bin growth [worlds|tiles] [REPEATS [STEPS]]
//! ```
//!
//! A step should cost the same per body, however many there are. The sizes take turns, so that a machine that gets
//! slower meanwhile does so for all of them; the first table gives medians, and the ratio to the smallest world.
//!
//! A tile should fit into a core's cache, and have few ghosts for its bodies: small tiles pay for the one, large ones for
//! the other. The second table shows what the default size (`runner/src/plan/tiles.rs`) is worth: its ratio is to the cheapest.

use atoll_benches::{median, normal, part_and_arguments};
use std::process::ExitCode;

/// A world, and its columns and rows of tiles.
type Case = (u64, &'static str);

/// With the default tiles.
const WORLDS: [Case; 4] = [(200_000, "auto"), (1_000_000, "auto"), (5_000_000, "auto"), (20_000_000, "auto")];

/// About 900, 2,000, 5,000, 10,000, 40,000 and 125,000 bodies in a tile, with grids as near to square as that allows.
const TILES: [Case; 6] =
    [(500_000, "24x23"), (500_000, "16x16"), (500_000, "10x10"), (500_000, "7x7"), (500_000, "4x3"), (500_000, "2x2")];

/// What became of a case.
struct Row {
    bodies: u64,
    tiles: [u32; 2],
    /// Of each repeat, per body and step.
    nanoseconds: Vec<f64>,
}

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
    let (chosen, [repeats, steps]) = part_and_arguments(&["worlds", "tiles"], ["REPEATS", "STEPS"], [3, 100])?;
    if chosen("worlds") {
        let rows = in_turns(&WORLDS, repeats, steps)?;
        let smallest = median(rows[0].nanoseconds.clone());
        table("growth", &rows, steps, smallest);
    }
    if chosen("tiles") {
        let rows = in_turns(&TILES, repeats, steps)?;
        let cheapest = rows.iter().map(|row| median(row.nanoseconds.clone())).fold(f64::INFINITY, f64::min);
        table("growth-tiles", &rows, steps, cheapest);
    }
    Ok(())
}

fn in_turns(cases: &[Case], repeats: u64, steps: u64) -> Result<Vec<Row>, String> {
    let row = |&(bodies, _): &Case| Row { bodies, tiles: [0; 2], nanoseconds: Vec::new() };
    let mut rows: Vec<Row> = cases.iter().map(row).collect();
    for _ in 0..repeats {
        for (row, &(bodies, tiles)) in rows.iter_mut().zip(cases) {
            let summary = normal(bodies, tiles, steps)?;
            row.nanoseconds.push(summary.ms_per_step * 1e6 / bodies as f64);
            row.tiles = summary.tiles;
        }
    }
    Ok(rows)
}

/// `one` is the cost that has the ratio 1.
fn table(bench: &str, rows: &[Row], steps: u64, one: f64) {
    let repeats = rows[0].nanoseconds.len();
    eprintln!("NORMAL, {steps} steps, 1 thread, median of {repeats}");
    eprintln!("{:>10}{:>10}{:>13}{:>16}{:>9}", "bodies", "tiles", "bodies/tile", "ns/body/step", "ratio");
    for Row { bodies, tiles: [columns, rows], nanoseconds } in rows {
        let per_tile = bodies / u64::from(columns * rows);
        let each = median(nanoseconds.clone());
        let ratio = each / one;
        let grid = format!("{columns}x{rows}");
        eprintln!("{bodies:>10}{grid:>10}{per_tile:>13}{each:>16.2}{ratio:>9.3}");
        println!(
            r#"{{"bench":"{bench}","bodies":{bodies},"steps":{steps},"tiles":[{columns},{rows}],"ns_per_body_step":{each:.2},"repeats_ns_per_body_step":{nanoseconds:.2?},"ratio":{ratio:.3}}}"#
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_have_the_sizes_told() {
        for ((bodies, tiles), told) in TILES.into_iter().zip([900.0, 2000.0, 5000.0, 10_000.0, 40_000.0, 125_000.0]) {
            let (columns, rows) = tiles.split_once('x').unwrap();
            let per_tile = bodies as f64 / (columns.parse::<f64>().unwrap() * rows.parse::<f64>().unwrap());
            assert!((per_tile / told - 1.0).abs() < 0.05, "{tiles}: {per_tile} bodies a tile, not {told}");
        }
    }

    #[test]
    fn every_case_has_its_row() {
        let rows = in_turns(&[(300, "auto"), (400, "2x3")], 2, 2).unwrap();
        assert!(rows.iter().all(|row| row.nanoseconds.len() == 2));
        assert_eq!(rows.iter().map(|row| row.bodies).collect::<Vec<_>>(), [300, 400]);
        assert_eq!(rows[1].tiles, [2, 3]);
    }
}
