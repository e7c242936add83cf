//! Options of `atoll project`.

use super::svg;
use super::values::given;
use crate::config::{ConfigError, Override};
use crate::project::Network;
use clap::Args;
use std::path::PathBuf;

/// More ranks than this are taken for a slip of the finger.
const MOST_RANKS: usize = 1 << 20;

/// Options of `atoll project`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct ProjectArgs {
    /// The configuration, a TOML file such as configs/quickstart.toml. It is run here, on one thread.
    pub config: PathBuf,
    /// Numbers of ranks, such as 1,4,16.
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_values_t = [1, 4, 16, 64], value_parser = ranks)]
    pub ranks: Vec<usize>,
    /// Threads of each rank.
    #[arg(long, value_name = "T", default_value_t = 1, value_parser = threads)]
    pub threads: usize,
    /// Makes the run so many times: what a tile takes in a step is the least that it took.
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub times: u32,
    /// What is between ranks: node, cluster, ethernet, or a latency and a bandwidth such as 2us,10GB/s.
    #[arg(long, value_name = "NETWORK", default_value = "cluster")]
    pub network: Network,
    /// Measures what is between ranks first: those of `run.transport`, as many as `run.ranks` and cores, or two; with MPI,
    /// those that mpirun has started.
    #[arg(long, conflicts_with = "network")]
    pub fit: bool,
    /// Dynamic bodies.
    #[arg(long, value_name = "N")]
    pub bodies: Option<String>,
    /// Steps to make.
    #[arg(long, value_name = "S")]
    pub steps: Option<String>,
    /// Chooses among the random variants of the scene.
    #[arg(long, value_name = "N")]
    pub seed: Option<String>,
    /// Columns and rows of tiles, such as 17x17; auto; bisected or adaptive: they follow the bodies.
    #[arg(long, value_name = "CxR")]
    pub tiles: Option<String>,
    /// Any key of the configuration, by its full path or an unambiguous last part; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Write what comes out to this file, as JSON.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Draw the speedup to this file, as SVG.
    #[arg(long, value_name = "FILE", value_parser = svg())]
    pub plot: Option<PathBuf>,
    /// Show no progress, only the table.
    #[arg(long)]
    pub quiet: bool,
}

impl ProjectArgs {
    /// The values that win over the file's. An option of its own wins over `--set`.
    ///
    /// # Errors
    /// On a `--set` without an equals sign.
    pub fn overrides(&self) -> Result<Vec<Override>, ConfigError> {
        let mut overrides = self.set.iter().map(|text| Override::parse(text)).collect::<Result<Vec<_>, _>>()?;
        overrides.extend(given(&[
            ("--bodies", "scene.bodies", &self.bodies),
            ("--steps", "run.steps", &self.steps),
            ("--seed", "scene.seed", &self.seed),
            ("--tiles", "run.tiles", &self.tiles),
        ]));
        Ok(overrides)
    }
}

fn ranks(text: &str) -> Result<usize, String> {
    whole(text, MOST_RANKS)
}

fn threads(text: &str) -> Result<usize, String> {
    whole(text, crate::config::MOST_THREADS as usize)
}

fn whole(text: &str, most: usize) -> Result<usize, String> {
    let number = text.parse().ok().filter(|number| (1..=most).contains(number));
    number.ok_or_else(|| format!("must be a whole number within 1 to {most}"))
}
