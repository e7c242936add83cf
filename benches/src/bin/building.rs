//! What it takes until the first step: planning a run and building one rank's part of the world, in a process of its own, beside
//! building all of it on one rank.
//!
//! ```sh
//! cargo run --release -p atoll-benches --bin building [BODIES [RANKS]]
//! ```
//!
//! A cluster begins as fast as its slowest rank, so a rank must neither make nor count bodies that are not its own. Three ranks
//! are tried: the first, one in the middle, the last.

use atoll::Config;
use atoll::internals::{Plan, part_of_scene};
use atoll_transport::Rank;
use std::process::{Command, ExitCode};
use std::time::Instant;

/// What a process took: seconds, bytes at most, bodies.
#[derive(Clone, Copy)]
struct Cost {
    seconds: f64,
    bytes: u64,
    bodies: u64,
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match arguments.first().map(String::as_str) {
        Some("--part") => part(&arguments[1..]),
        _ => compare(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("building: {error}");
            ExitCode::FAILURE
        }
    }
}

/// In a process of its own: plans, builds, and tells what that took.
fn part(arguments: &[String]) -> Result<(), String> {
    let [bodies, ranks, rank] = arguments else { return Err("--part BODIES RANKS RANK".to_owned()) };
    let begun = Instant::now();
    let text = "[scene]\nkind = \"rooms\"\n";
    let overrides = [("bodies", bodies.as_str()), ("ranks", ranks.as_str())];
    let config = Config::from_toml_str("building", text, &overrides).map_err(|error| error.to_string())?;
    let plan = Plan::new(&config).map_err(|error| error.to_string())?;
    let rank = Rank(rank.parse().map_err(|_| format!("no rank: {rank}"))?);
    let world = part_of_scene(&plan, rank).map_err(|error| error.to_string())?;
    let seconds = begun.elapsed().as_secs_f64();
    println!("{seconds} {} {}", atoll_benches::peak_rss_bytes(), world.bodies().count());
    Ok(())
}

fn compare() -> Result<(), String> {
    let [bodies, ranks] = atoll_benches::arguments(["BODIES", "RANKS"], [50_000_000, 64])?;
    let whole = cost(bodies, 1, 0)?;
    eprintln!("{:>8}{:>8}{:>12}{:>10}{:>10}{:>10}{:>10}", "ranks", "rank", "bodies", "s", "MB", "time", "memory");
    for (ranks, rank) in [(1, 0), (ranks, 0), (ranks, ranks / 2), (ranks, ranks - 1)] {
        let part = if ranks == 1 { whole } else { cost(bodies, ranks, rank)? };
        let (time, memory) = (whole.seconds / part.seconds, whole.bytes as f64 / part.bytes as f64);
        let megabytes = part.bytes as f64 * 1e-6;
        let Cost { seconds, bodies: own, bytes } = part;
        eprintln!(
            "{ranks:>8}{rank:>8}{own:>12}{seconds:>10.3}{megabytes:>10.1}{:>10}{:>10}",
            ratio(time),
            ratio(memory)
        );
        println!(
            r#"{{"bench":"building","bodies":{bodies},"ranks":{ranks},"rank":{rank},"own_bodies":{own},"seconds":{seconds:.4},"peak_bytes":{bytes}}}"#
        );
    }
    Ok(())
}

/// As a part of the whole.
fn ratio(times: f64) -> String {
    format!("1/{times:.1}")
}

fn cost(bodies: u64, ranks: u64, rank: u64) -> Result<Cost, String> {
    let program = std::env::current_exe().map_err(|error| error.to_string())?;
    let given = [bodies, ranks, rank].map(|number| number.to_string());
    let output = Command::new(program).arg("--part").args(given).output().map_err(|error| error.to_string())?;
    let said = String::from_utf8_lossy(&output.stdout);
    let told: Vec<&str> = said.split_whitespace().collect();
    let cost = match told[..] {
        [seconds, bytes, bodies] => seconds.parse().ok().zip(bytes.parse().ok()).zip(bodies.parse().ok()),
        _ => None,
    };
    let ((seconds, bytes), bodies) = cost.ok_or_else(|| String::from_utf8_lossy(&output.stderr).trim().to_owned())?;
    Ok(Cost { seconds, bytes, bodies })
}
