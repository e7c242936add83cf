//! What the benchmarks share. Each is a program of its own in `bin/`:
//!
//! | program | question |
//! |---|---|
//! | `step` | How long does a step of the reported experiment take, and how much memory? |
//! | `growth` | Does a body cost more in a larger world, and in a larger tile? |
//! | `building` | What does one rank of many take until the first step? |
//! | `scaling` | What do ranks and threads bring, beside the report's figures and a projection? |
//! | `strategies` | What do threads bring within one tile, by islands, by coloring, and by both? |
//! | `choices` | What does each choice of the report cost, in time and in quality? |
//! | `islands` | Which search for islands is fastest, and what does a second thread bring? |
//! | `exchange` | What does an exchange cost over each transport, and what do two ranks bring? |
//! | `output` | What do recording and snapshots cost a run, and how long does it take to compare two recordings? |
//! | `peers` | How do Box2D and rapier2d do on the same scene? With `--features peers` only. |
//! | `fidelity` | How near do Atoll, Box2D and rapier2d come to theory? With `--features peers` only. |
//!
//! They print a table to stderr and one line of JSON per row to stdout, so that
//! `cargo run --release -p atoll-benches --bin step > row.json` shows the one and keeps the other.

pub mod exchange;
#[cfg(feature = "peers")]
pub mod fidelity;
#[cfg(feature = "peers")]
pub mod peers;

use atoll::{Config, Summary};

/// A configuration file.
#[derive(Clone, Copy, Debug)]
pub struct File {
    /// What errors call it.
    pub name: &'static str,
    /// Its content.
    pub text: &'static str,
}

/// The file of that name in `configs/`.
macro_rules! file {
    ($name:literal) => {
        File { name: concat!("configs/", $name), text: include_str!(concat!("../../configs/", $name)) }
    };
}

/// The reported experiment.
pub const NORMAL: File = file!("normal.toml");

/// The same with more bodies in one corner.
pub const SKEWED: File = file!("skewed.toml");

/// Many bodies of which few touch.
pub const SPARSE: File = file!("sparse.toml");

/// A heap that forms from falling bodies.
pub const PILE: File = file!("pile.toml");

/// A heap that is one island from the start.
pub const SINGLE_ISLAND: File = file!("single_island.toml");

/// The most memory this process ever held, in bytes; zero where the system does not tell.
pub fn peak_rss_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.split_whitespace().next()?.parse().ok());
    peak.unwrap_or(0_u64) * 1024
}

/// Runs a configuration, some of whose keys have other values than in the file, as after `--set`.
///
/// # Errors
/// If it cannot be run, loses a body, or a body escapes.
pub fn run(file: File, overrides: &[(&str, &str)]) -> Result<Summary, String> {
    let summary = run_whatever_escapes(file, overrides)?;
    match summary.escaped {
        0 => Ok(summary),
        escaped => Err(format!("{escaped} bodies escaped: these times mean nothing")),
    }
}

/// As [`run`], where it is part of the result how many bodies escape.
///
/// # Errors
/// If it cannot be run, or loses a body.
pub fn run_whatever_escapes(file: File, overrides: &[(&str, &str)]) -> Result<Summary, String> {
    let config = Config::from_toml_str(file.name, file.text, overrides).map_err(|error| error.to_string())?;
    let summary = atoll::run(&config).map_err(|error| error.to_string())?;
    match summary.bodies_lost {
        0 => Ok(summary),
        lost => Err(format!("{lost} bodies lost: these times mean nothing")),
    }
}

/// Runs NORMAL on one rank of one thread. `tiles` is as in a configuration: `auto`, or columns and rows, such as `12x12`.
///
/// # Errors
/// As [`run`].
pub fn normal(bodies: u64, tiles: &str, steps: u64) -> Result<Summary, String> {
    let (bodies, steps) = (bodies.to_string(), steps.to_string());
    run(NORMAL, &[("bodies", &bodies), ("tiles", tiles), ("steps", &steps), ("ranks", "1"), ("threads", "1")])
}

/// The arguments of a benchmark: whole numbers above zero, with these defaults.
///
/// # Errors
/// If there are too many, or one is something else.
pub fn arguments<const N: usize>(names: [&str; N], defaults: [u64; N]) -> Result<[u64; N], String> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    numbers(&given, names, defaults)
}

/// As [`arguments`], with a word before the numbers that chooses one of several parts. Says whether a part is to be run:
/// without a word all are.
///
/// # Errors
/// As [`arguments`], and if there is no such part.
pub fn part_and_arguments<const N: usize>(
    parts: &[&str],
    names: [&str; N],
    defaults: [u64; N],
) -> Result<(impl Fn(&str) -> bool + use<N>, [u64; N]), String> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let (chosen, rest) = part(&given, parts)?;
    let chosen = chosen.map(str::to_owned);
    Ok((move |part: &str| chosen.as_ref().is_none_or(|chosen| chosen == part), numbers(rest, names, defaults)?))
}

/// The word in front, if there is one, and what follows it.
fn part<'a>(given: &'a [String], parts: &[&str]) -> Result<(Option<&'a str>, &'a [String]), String> {
    match given {
        [word, rest @ ..] if parts.contains(&word.as_str()) => Ok((Some(word), rest)),
        [word, ..] if word.starts_with(char::is_alphabetic) => {
            Err(format!("the first argument may be {}, not {word}", parts.join(", ")))
        }
        _ => Ok((None, given)),
    }
}

fn numbers<const N: usize>(given: &[String], names: [&str; N], defaults: [u64; N]) -> Result<[u64; N], String> {
    let mut values = defaults;
    if given.len() > N {
        return Err(format!("at most {N} numbers: {}", names.join(", ")));
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
        let summary = normal(500, "auto", 2).unwrap();
        assert_eq!((summary.bodies, summary.steps, summary.ranks, summary.threads), (500, 2, 1, 1));
        assert_eq!(normal(500, "2x3", 2).unwrap().tiles, [2, 3]);
    }

    #[test]
    fn every_file_runs_with_other_values() {
        for file in [NORMAL, SPARSE, PILE, SINGLE_ISLAND] {
            let summary = run(file, &[("bodies", "200"), ("steps", "2"), ("tiles", "1x1"), ("threads", "2")]).unwrap();
            assert_eq!((summary.bodies, summary.steps, summary.threads), (200, 2, 2), "{}", file.name);
        }
        let error = run(PILE, &[("bodies", "none")]).unwrap_err();
        assert!(error.contains("scene.bodies") || error.contains("bodies=none"), "{error}");
    }

    #[test]
    fn words_and_numbers() {
        let given = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let read = |text: &str| {
            let given = given(text);
            let (part, rest) = part(&given, &["worlds", "tiles"])?;
            Ok((part.map(str::to_owned), numbers(rest, ["REPEATS", "STEPS"], [3, 100])?))
        };
        let tiles = Some("tiles".to_owned());
        assert_eq!(read(""), Ok((None, [3, 100])));
        assert_eq!(read("5 20"), Ok((None, [5, 20])));
        assert_eq!(read("tiles"), Ok((tiles.clone(), [3, 100])));
        assert_eq!(read("tiles 5"), Ok((tiles, [5, 100])));
        for (text, told) in [
            ("tile", "the first argument may be worlds, tiles, not tile"),
            ("5 tiles", "STEPS must be a whole number above zero, not tiles"),
            ("0", "REPEATS must be a whole number above zero, not 0"),
            ("1 2 3", "at most 2 numbers: REPEATS, STEPS"),
        ] {
            let error: String = read(text).unwrap_err();
            assert_eq!(error, told);
        }
    }
}
