//! Options of `atoll view`, and of every verb that lets pages look.

use super::run::RunArgs;
use super::values::{ValueArgs, times};
use clap::Args;
use std::net::IpAddr;
use std::path::PathBuf;

/// Options of `atoll view`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct ViewArgs {
    /// A configuration, which is run to be looked at; or the folder of a run that was recorded, or of two to see side by side.
    #[arg(required = true, num_args = 1..=2, value_name = "SOURCE")]
    pub sources: Vec<PathBuf>,
    /// What wins over the values of a configuration.
    #[command(flatten)]
    pub values: ValueArgs,
    /// Columns and rows of tiles, such as 17x17; auto, bisected or adaptive; of a configuration.
    #[arg(long, value_name = "CxR")]
    pub tiles: Option<String>,
    /// Write configuration, summary, log and what hands do to this folder, which must be new or empty; of a configuration.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Do what this file says while it runs, a line of JSON for each command; of a configuration.
    #[arg(long, value_name = "FILE")]
    pub commands: Option<PathBuf>,
    /// Leave out commands that cannot be done, and go on.
    #[arg(long, requires = "commands")]
    pub skip_refused: bool,
    /// How fast time goes on at first: so many seconds of the world in one, or max, as fast as can be.
    #[arg(long, value_name = "X", default_value = "1", value_parser = speed)]
    pub speed: f64,
    /// Serve the page at this port [default: any that is free].
    #[arg(long, value_name = "P")]
    pub port: Option<u16>,
    /// Serve it at this address of this machine, so that others can look who know what is printed [default: 127.0.0.1].
    #[arg(long, value_name = "ADDRESS")]
    pub bind: Option<IpAddr>,
    /// Open the page in a browser.
    #[arg(long)]
    pub open: bool,
}

impl ViewArgs {
    /// The same as options of a run that stays to be looked at.
    pub(crate) fn into_run(self) -> RunArgs {
        let Self { mut sources, values, tiles, out, commands, skip_refused, speed, port, bind, open } = self;
        RunArgs {
            config: sources.pop(),
            values,
            tiles,
            out,
            commands,
            skip_refused,
            view: true,
            speed,
            port,
            bind,
            open,
            lingers: true,
            ..RunArgs::default()
        }
    }
}

/// 0 is as fast as can be.
fn speed(text: &str) -> Result<f64, String> {
    if text == "max" { Ok(0.0) } else { times(text).map_err(|reason| format!("{reason}, or max")) }
}
