//! What the benchmarks share. Each is a program of its own in `bin/`:
//!
//! | program | question |
//! |---|---|
//! | `step` | How long does a step of the reported experiment take, and how much memory? |
//! | `growth` | Does a body cost more in a larger world? |
//! | `islands` | Which search for islands is fastest, and what does a second thread bring? |
//! | `peers` | How do Box2D and rapier2d do on the same scene? With `--features peers` only. |
//!
//! They print a table to stderr and one line of JSON per row to stdout, so that
//! `cargo run --release -p atoll-benches --bin step > row.json` shows the one and keeps the other.

#[cfg(feature = "peers")]
pub mod peers;

use atoll::{Config, Summary};

/// The reported experiment.
const NORMAL: &str = include_str!("../../configs/normal.toml");

/// Runs NORMAL on one rank of one thread.
///
/// # Errors
/// If it cannot be run, or loses a body.
pub fn normal(bodies: u64, steps: u64) -> Result<Summary, String> {
    let (bodies, steps) = (bodies.to_string(), steps.to_string());
    let overrides = [("bodies", bodies.as_str()), ("steps", &steps), ("ranks", "1"), ("threads", "1")];
    let config = Config::from_toml_str("configs/normal.toml", NORMAL, &overrides).map_err(|error| error.to_string())?;
    let summary = atoll::run(&config).map_err(|error| error.to_string())?;
    match (summary.bodies_lost, summary.escaped) {
        (0, 0) => Ok(summary),
        (lost, escaped) => Err(format!("{lost} bodies lost and {escaped} escaped: these times mean nothing")),
    }
}

/// The arguments of a benchmark: whole numbers above zero, with these defaults.
///
/// # Errors
/// If there are too many, or one is something else.
pub fn arguments<const N: usize>(names: [&str; N], defaults: [u64; N]) -> Result<[u64; N], String> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let mut values = defaults;
    if given.len() > N {
        return Err(format!("at most {N} arguments: {}", names.join(", ")));
    }
    for ((text, name), value) in given.iter().zip(names).zip(&mut values) {
        *value = text
            .parse()
            .ok()
            .filter(|&number| number > 0)
            .ok_or_else(|| format!("{name} must be a whole number above zero, not {text}"))?;
    }
    Ok(values)
}

/// The middle one, or the mean of the two in the middle.
///
/// # Panics
/// If there are none.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians() {
        assert_eq!(median(vec![3.0]), 3.0);
        assert_eq!(median(vec![9.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![9.0, 1.0, 2.0, 4.0]), 3.0);
    }

    #[test]
    fn the_experiment_runs_at_a_small_size() {
        let summary = normal(500, 2).unwrap();
        assert_eq!((summary.bodies, summary.steps, summary.ranks, summary.threads), (500, 2, 1, 1));
    }
}
