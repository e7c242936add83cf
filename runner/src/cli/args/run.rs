//! Options of `atoll run`.

use super::values::{ValueArgs, given};
use crate::config::{ConfigError, Override};
use crate::rank::{PanicAt, TraceSteps};
use clap::{ArgGroup, Args};
use std::net::IpAddr;
use std::path::PathBuf;

/// Options of `atoll run`.
#[derive(Default, Debug, Args)]
#[command(allow_negative_numbers = true, groups = ["logged", "commanded"].map(|name| ArgGroup::new(name).multiple(true)))]
pub struct RunArgs {
    /// The configuration, a TOML file such as configs/quickstart.toml. May be left out with --resume.
    #[arg(required_unless_present = "resume")]
    pub config: Option<PathBuf>,
    /// What wins over the file's values.
    #[command(flatten)]
    pub values: ValueArgs,
    /// Columns and rows of tiles, such as 17x17; auto; bisected or adaptive: they follow the bodies.
    #[arg(long, value_name = "CxR")]
    pub tiles: Option<String>,
    /// Write the summary to this file, as JSON.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write where the time of each rank went to this file, as CSV.
    #[arg(long, value_name = "FILE")]
    pub timings: Option<PathBuf>,
    /// Write what each thread of each rank did, and when, to this file, for ui.perfetto.dev or chrome://tracing, as JSON.
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// Trace the steps A to B - 1, counted from 0 [default: the first ten, as viewers open no more than some hundred
    /// megabytes].
    #[arg(long, value_name = "A..B", requires = "trace")]
    pub trace_steps: Option<TraceSteps>,
    /// Write figures over time to this file, as CSV: energies, contacts, overlaps, times. With --out they are in DIR/log.csv.
    #[arg(long, value_name = "FILE", group = "logged")]
    pub log: Option<PathBuf>,
    /// Add figures every so many steps [default: the configuration's, else 10].
    #[arg(long, value_name = "K", requires = "logged")]
    pub log_every: Option<String>,
    /// Write configuration, summary and log to this folder, which must be new or empty, and records and snapshots as asked for.
    #[arg(long, value_name = "DIR", groups = ["folder", "logged"])]
    pub out: Option<PathBuf>,
    /// Go on with the run in this folder from its newest snapshot. With CONFIG, begin it there if there is none yet.
    #[arg(long, value_name = "DIR", groups = ["folder", "logged", "commanded"])]
    pub resume: Option<PathBuf>,
    /// Record every so many steps [default: the configuration's, else never].
    #[arg(long, value_name = "K", requires = "folder")]
    pub record_every: Option<String>,
    /// Write a snapshot every so many steps [default: the configuration's, else never].
    #[arg(long, value_name = "K", requires = "folder")]
    pub checkpoint_every: Option<String>,
    /// Let --out replace what is in its folder.
    #[arg(long, requires = "out", conflicts_with = "resume")]
    pub overwrite: bool,
    /// Go on from the newest snapshot up to so many times where a rank is lost.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "folder")]
    pub restarts: u32,
    /// Do what this file says while it runs, a line of JSON for each command; with - what comes in on standard input, so that
    /// another program drives the run. docs/worlds.md tells what there is to say. With --resume, from where it goes on.
    #[arg(long, value_name = "FILE", group = "commanded")]
    pub commands: Option<PathBuf>,
    /// Write answers and events to this file, a line of JSON for each; with - to standard output, and no closing report.
    #[arg(long, value_name = "FILE")]
    pub answers: Option<PathBuf>,
    /// Leave out commands that cannot be done, and go on.
    #[arg(long, requires = "commanded")]
    pub skip_refused: bool,
    /// Let a page in the browser look while it goes on; its address is told.
    #[arg(long, group = "commanded")]
    pub view: bool,
    /// Serve that page at this port [default: any that is free].
    #[arg(long, value_name = "P", requires = "view")]
    pub port: Option<u16>,
    /// Serve it at this address of this machine, so that others can look who know what is told [default: 127.0.0.1].
    #[arg(long, value_name = "ADDRESS", requires = "view")]
    pub bind: Option<IpAddr>,
    /// Open that page in a browser.
    #[arg(long, requires = "view")]
    pub open: bool,
    /// Let pages look before the first step, and after the last one until somebody asks to stop.
    #[arg(skip)]
    pub lingers: bool,
    /// Seconds of the world in a second at first, while a page can look; 0: as many as can be.
    #[arg(skip)]
    pub speed: f64,
    /// Show no progress, only the closing report.
    #[arg(long)]
    pub quiet: bool,
    /// Let a rank panic before a step, to see what becomes of the others.
    #[arg(long, value_name = "RANK@STEP", hide = true)]
    pub panic_at: Option<PanicAt>,
}

impl RunArgs {
    /// The values that win over the file's. An option of its own wins over `--set`.
    ///
    /// # Errors
    /// On a `--set` without an equals sign.
    pub fn overrides(&self) -> Result<Vec<Override>, ConfigError> {
        let mut overrides = self.values.overrides()?;
        overrides.extend(given(&[
            ("--tiles", "run.tiles", &self.tiles),
            ("--record-every", "output.record_every", &self.record_every),
            ("--checkpoint-every", "output.checkpoint_every", &self.checkpoint_every),
            ("--log-every", "output.log_every", &self.log_every),
        ]));
        Ok(overrides)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::args::{Cli, Command, one_line};
    use clap::Parser;
    use std::path::Path;

    fn parse(line: &str) -> Result<RunArgs, String> {
        match Cli::try_parse_from(["atoll", "run"].into_iter().chain(line.split_whitespace())) {
            Ok(Cli { command: Command::Run(args) }) => Ok(*args),
            Ok(_) => unreachable!("the verb is run"),
            Err(error) => Err(one_line(&error, ["run"])),
        }
    }

    #[test]
    fn options_become_overrides_that_win_over_set() {
        let line = "c.toml --seed 3 --set seed=2 --set solver=pgs --bodies -5 --out d --record-every 0";
        let expected = [
            Override::set("seed", "2"),
            Override::set("solver", "pgs"),
            Override::option("--bodies", "scene.bodies", "-5"),
            Override::option("--seed", "scene.seed", "3"),
            Override::option("--record-every", "output.record_every", "0"),
        ];
        assert_eq!(parse(line).unwrap().overrides().unwrap(), expected);
    }

    #[test]
    fn a_run_goes_on_with_and_without_a_configuration() {
        let args = parse("--resume runs/a --restarts 3 --checkpoint-every 100").unwrap();
        assert_eq!((args.config, args.resume.as_deref(), args.restarts), (None, Some(Path::new("runs/a")), 3));
        let args = parse("c.toml --resume runs/a").unwrap();
        assert_eq!((args.config.as_deref(), args.restarts), (Some(Path::new("c.toml")), 0));
        let args = parse("c.toml --out runs/a --overwrite --record-every 5").unwrap();
        assert!(args.out.is_some() && args.overwrite);
    }

    #[test]
    fn options_for_a_folder_need_one() {
        let missing = "the following required arguments were not provided: ";
        let folder = format!("{missing}<--out <DIR>|--resume <DIR>>; see atoll run --help");
        for option in ["--record-every 5", "--checkpoint-every 5", "--restarts 1"] {
            assert_eq!(parse(&format!("c.toml {option}")).unwrap_err(), folder, "{option}");
        }
        for line in ["c.toml --log-every 5 --log a.csv", "c.toml --log-every 5 --out d --log a.csv"] {
            assert!(parse(line).unwrap().log.is_some(), "{line}");
        }
        assert!(parse("c.toml --view --skip-refused").unwrap().skip_refused);
        for (line, expected) in [
            (
                "c.toml --log-every 5",
                "the following required arguments were not provided: <--log <FILE>|--out <DIR>|--r",
            ),
            (
                "c.toml --skip-refused",
                "the following required arguments were not provided: <--resume <DIR>|--commands <FILE>|--view>; see",
            ),
            ("c.toml --overwrite", "the following required arguments were not provided: --out <DIR>; see"),
            ("--overwrite --resume d", "the argument '--overwrite' cannot be used with '--resume <DIR>'; see"),
            ("c.toml --out d --resume d", "the argument '--out <DIR>' cannot be used with '--resume <DIR>'; see"),
            ("c.toml --out d --restarts -1", "invalid value '-1' for '--restarts <N>': "),
            ("c.toml --out d --out d", "the argument '--out <DIR>' cannot be used multiple times; see"),
        ] {
            let error = parse(line).unwrap_err();
            assert!(error.starts_with(expected), "{line}: {error}");
        }
    }

    #[test]
    fn a_configuration_that_is_missing_is_asked_for() {
        for line in ["", "--out d", "--ranks 2"] {
            assert_eq!(
                parse(line).unwrap_err(),
                "the following required arguments were not provided: <CONFIG>; name a configuration such as \
                 configs/quickstart.toml, or go on with a run by --resume DIR; see atoll run --help"
            );
        }
    }
}
