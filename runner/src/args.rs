//! The command line. Values stay text here: the configuration checks them, whether they come from a file or from
//! here.

use crate::config::Origin;
use crate::config::{ConfigError, OneLine, Override, Place};
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use std::str::FromStr;

/// Very large 2-D rigid-body worlds: one trajectory, bit for bit, on one core, one machine or a cluster.
#[derive(Debug, Parser)]
#[command(name = "atoll", version, arg_required_else_help = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a scene and report what became of it.
    Run(RunArgs),
}

/// Options of `atoll run`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct RunArgs {
    /// The configuration, a TOML file such as configs/quickstart.toml.
    pub config: PathBuf,
    /// Ranks that share the tiles [default: the configuration's, else 1].
    #[arg(long, value_name = "N")]
    pub ranks: Option<String>,
    /// Threads of each rank [default: the configuration's, else 1].
    #[arg(long, value_name = "T")]
    pub threads: Option<String>,
    /// What carries bytes between ranks: local, channel, iceoryx2 or mpi [default: local for one rank, else channel].
    #[arg(long, value_name = "NAME")]
    pub transport: Option<String>,
    /// Columns and rows of tiles, such as 17x17, or auto.
    #[arg(long, value_name = "CxR")]
    pub tiles: Option<String>,
    /// Dynamic bodies.
    #[arg(long, value_name = "N")]
    pub bodies: Option<String>,
    /// Steps to make.
    #[arg(long, value_name = "S")]
    pub steps: Option<String>,
    /// Chooses among the random variants of the scene.
    #[arg(long, value_name = "N")]
    pub seed: Option<String>,
    /// Any key of the configuration, by its full path or an unambiguous last part; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Give up a rank that stays silent for so long.
    #[arg(long, value_name = "SECONDS")]
    pub peer_timeout: Option<String>,
    /// Write the summary to this file, as JSON.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write where the time of each rank went to this file, as CSV.
    #[arg(long, value_name = "FILE")]
    pub timings: Option<PathBuf>,
    /// Record the trajectory to this folder (not in this version yet).
    #[arg(long, value_name = "DIR")]
    pub out: Option<String>,
    /// Record every so many steps (not in this version yet).
    #[arg(long, value_name = "K")]
    pub record_every: Option<String>,
    /// Show no progress, only the closing report.
    #[arg(long)]
    pub quiet: bool,
    /// Let a rank panic before a step, to see what becomes of the others.
    #[arg(long, value_name = "RANK@STEP", hide = true)]
    pub panic_at: Option<PanicAt>,
}

/// Where a rank is to panic.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PanicAt {
    /// The rank.
    pub rank: u32,
    /// The step, counted from 0.
    pub step: u64,
}

impl FromStr for PanicAt {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let parts = text.split_once('@').and_then(|(rank, step)| Some((rank.parse().ok()?, step.parse().ok()?)));
        parts.map(|(rank, step)| Self { rank, step }).ok_or("write RANK@STEP, such as 2@100")
    }
}

impl RunArgs {
    /// The values that win over the file's. An option of its own wins over `--set`.
    ///
    /// # Errors
    /// On a `--set` without an equals sign, and on options that a later version brings.
    pub fn overrides(&self) -> Result<Vec<Override>, ConfigError> {
        for (option, value) in [("--out", &self.out), ("--record-every", &self.record_every)] {
            if let Some(value) = value {
                let place = Place { origin: Origin::Option(option), key: String::new(), value: value.clone() };
                let instead = format!("--json FILE for the closing figures, without {option}");
                return Err(ConfigError::NotYet { place, instead });
            }
        }
        let mut overrides = self.set.iter().map(|text| Override::parse(text)).collect::<Result<Vec<_>, _>>()?;
        let options = [
            ("--ranks", "run.ranks", &self.ranks),
            ("--threads", "run.threads", &self.threads),
            ("--transport", "run.transport", &self.transport),
            ("--tiles", "run.tiles", &self.tiles),
            ("--bodies", "scene.bodies", &self.bodies),
            ("--steps", "run.steps", &self.steps),
            ("--seed", "scene.seed", &self.seed),
            ("--peer-timeout", "run.peer_timeout", &self.peer_timeout),
        ];
        let given = options.iter().filter_map(|(option, key, value)| Some((option, key, value.as_ref()?)));
        overrides.extend(given.map(|(option, key, value)| Override::option(option, key, value)));
        Ok(overrides)
    }
}

/// What clap has to say about bad usage, on one line.
pub fn one_line(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let said =
        |line: &&str| !(line.is_empty() || line.starts_with("Usage:") || line.starts_with("For more information"));
    let lines: Vec<&str> = text.lines().map(str::trim).filter(said).collect();
    let line = lines.join(" ").replace(" tip: ", "; ");
    // What was typed is quoted as it was typed.
    format!("{}; see atoll run --help", OneLine(line.strip_prefix("error: ").unwrap_or(&line)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(line: &str) -> Result<Cli, clap::Error> {
        Cli::try_parse_from(line.split_whitespace())
    }

    #[test]
    fn the_definition_is_consistent() {
        <Cli as clap::CommandFactory>::command().debug_assert();
    }

    #[test]
    fn options_become_overrides_that_win_over_set() {
        let Command::Run(args) =
            parse("atoll run c.toml --seed 3 --set seed=2 --set solver=pgs --bodies -5").unwrap().command;
        let expected = [
            Override::set("seed", "2"),
            Override::set("solver", "pgs"),
            Override::option("--bodies", "scene.bodies", "-5"),
            Override::option("--seed", "scene.seed", "3"),
        ];
        assert_eq!(args.overrides().unwrap(), expected);
    }

    #[test]
    fn later_options_say_what_to_do() {
        let Command::Run(args) = parse("atoll run c.toml --out runs").unwrap().command;
        let error = args.overrides().unwrap_err().to_string();
        assert!(error.starts_with("--out runs: not built into this version yet"), "{error}");
    }

    #[test]
    fn bad_usage_takes_one_line() {
        for (line, expected) in [
            ("atoll run c.toml --rnks 2", "unexpected argument '--rnks' found; a similar argument exists: '--ranks'"),
            ("atoll run", "the following required arguments were not provided: <CONFIG>"),
            ("atoll runn c.toml", "unrecognized subcommand 'runn'; a similar subcommand exists: 'run'"),
        ] {
            let text = one_line(&parse(line).unwrap_err());
            assert!(text.starts_with(expected) && !text.contains('\n'), "{text}");
        }
        let error = Cli::try_parse_from(["atoll", "ru\r\u{1b}[2Jn"]).unwrap_err();
        assert!(one_line(&error).starts_with("unrecognized subcommand 'ru n'"), "{}", one_line(&error));
    }
}
