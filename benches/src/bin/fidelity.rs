//! What theory knows exactly, beside what Atoll, Box2D v3 and rapier2d make of it.
//!
//! ```sh
//! cargo run --release -p atoll-benches --features peers --bin fidelity
//! ```
//!
//! See `atoll_benches::fidelity`. Prints a table in Markdown to stdout, and one line of JSON per row to stderr.

use atoll_benches::fidelity::{self, HERTZ};
use clap::Parser;
use std::process::ExitCode;

/// What theory knows exactly, beside what Atoll, Box2D v3 and rapier2d make of it.
#[derive(Debug, Parser)]
#[command(name = "fidelity")]
struct Cli {
    /// Only cases whose name has this in it.
    #[arg(long, default_value = "")]
    only: String,
    /// Steps per second.
    #[arg(long, value_delimiter = ',', default_values_t = HERTZ, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    hertz: Vec<u32>,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    match fidelity::table(&cli.only, &cli.hertz, |row| eprintln!("{row}")) {
        Ok(table) => {
            print!("{table}");
            ExitCode::SUCCESS
        }
        Err(failure) => {
            eprintln!("fidelity: {}", failure.message);
            ExitCode::from(failure.exit)
        }
    }
}
