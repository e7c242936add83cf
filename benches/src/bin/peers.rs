//! One scene, or any world of yours, body for body, in Atoll, in Box2D v3 and in rapier2d: time, memory, and what is left at the end.
//!
//! ```sh
//! cargo run --release -p atoll-benches --features peers --bin peers -- --scene pile
//! cargo run --release -p atoll-benches --features peers --bin peers -- my_world.toml --steps 300
//! ```
//!
//! What is set alike and what each engine keeps: see `atoll_benches::peers`. Needs a C compiler and Rust 1.95.

use atoll_benches::peers::case::{Case, SceneName, Wishes};
use atoll_benches::peers::report::{self, Row};
use atoll_benches::peers::{Engine, Failure, Run, children, run};
use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// One scene in Atoll, in Box2D v3 and in rapier2d.
#[derive(Debug, Parser)]
#[command(name = "peers")]
struct Cli {
    /// A configuration or a scene's file.
    #[arg(required_unless_present = "scene", conflicts_with = "scene")]
    file: Option<PathBuf>,
    /// One of the scenes that come with Atoll.
    #[arg(long, value_enum)]
    scene: Option<SceneName>,
    /// Dynamic bodies [default: the configuration's; pile 20000].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    bodies: Option<u64>,
    /// Steps of a run [default: 200; pile 600; those of the file].
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u64).range(1..))]
    steps: Option<u64>,
    /// Threads of each engine.
    #[arg(long, value_name = "T", default_value = "1", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: u16,
    /// Which engines.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "atoll,box2d,rapier")]
    engines: Vec<Engine>,
    /// Runs of each engine, whose medians are told.
    #[arg(long, value_name = "R", default_value = "3", value_parser = clap::value_parser!(u16).range(1..))]
    repeat: u16,
    /// Atoll's columns and rows of tiles, such as 4x2 [default: the configuration's].
    #[arg(long, value_name = "CxR")]
    tiles: Option<String>,
    /// A run that takes longer is ended.
    #[arg(long, value_name = "SECONDS", default_value = "3600")]
    timeout: u32,
    /// Make one run of this engine in this process and print it.
    #[arg(long, hide = true)]
    child: Option<Engine>,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let ended = match cli.child {
        Some(engine) => child(&cli, engine),
        None => parent(&cli),
    };
    match ended {
        Ok(code) => code,
        Err(failure) => {
            eprintln!("peers: {}", failure.message);
            ExitCode::from(failure.exit)
        }
    }
}

fn case(cli: &Cli) -> Result<Case, Failure> {
    let wishes = Wishes {
        bodies: cli.bodies,
        steps: cli.steps,
        threads: Some(usize::from(cli.threads)),
        tiles: cli.tiles.as_deref(),
    };
    match (&cli.file, cli.scene) {
        (Some(path), _) => Case::read(path, wishes),
        (None, Some(scene)) => Case::new(scene, wishes),
        (None, None) => unreachable!("one of them is required"),
    }
}

fn child(cli: &Cli, engine: Engine) -> Result<ExitCode, Failure> {
    let run = run(engine, &case(cli)?)?;
    println!("{}", serde_json::to_string(&run).map_err(Failure::broken)?);
    Ok(ExitCode::SUCCESS)
}

/// The engines take turns, so that a machine that gets slower meanwhile does so for all.
fn parent(cli: &Cli) -> Result<ExitCode, Failure> {
    let case = case(cli)?;
    let given: Vec<String> = std::env::args().skip(1).collect();
    let mut code = 0;
    let mut runs: Vec<(Engine, Result<Vec<Run>, ()>)> = Vec::new();
    for &engine in &cli.engines {
        if !runs.iter().any(|(other, _)| *other == engine) {
            runs.push((engine, Ok(Vec::new())));
        }
    }
    for _ in 0..cli.repeat {
        for (engine, made) in &mut runs {
            let Ok(all) = made else { continue };
            let arguments = [given.as_slice(), &["--child".to_owned(), engine.to_string()]].concat();
            match children::run(*engine, &arguments, Duration::from_secs(cli.timeout.into())) {
                Ok(run) => all.push(run),
                Err(failure) => {
                    eprintln!("peers: {}", failure.message.replacen("peers: ", "", 1));
                    code = code.max(failure.exit);
                    *made = Err(());
                }
            }
        }
    }
    let row = |(engine, runs): &(Engine, Result<Vec<Run>, ()>)| Row::new(*engine, &case, runs.as_deref().ok()?);
    let rows: Vec<Row> = runs.iter().filter_map(row).collect();
    for row in &rows {
        println!("{}", serde_json::to_string(row).map_err(Failure::broken)?);
    }
    eprint!("{}", report::table(&rows, usize::from(cli.repeat)));
    Ok(ExitCode::from(code))
}
