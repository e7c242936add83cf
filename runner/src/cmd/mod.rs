//! The verbs of the program, one file each.

pub mod run;

use crate::args::{self, Cli, Command};
use crate::config::OneLine;
use crate::error::{Exit, RunError};
use crate::telemetry;
use clap::Parser;
use clap::error::ErrorKind;
use std::fmt::Display;
use std::io::{self, Write};
use std::process::ExitCode;

/// Reads the command line and does what it says.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    let result = telemetry::init().and_then(|()| match &cli.command {
        Command::Run(args) => run::run(args),
    });
    let exit = result.unwrap_or_else(|error| {
        if !matches!(error, RunError::ToldElsewhere { .. }) {
            complain(&error);
        }
        error.exit()
    });
    ExitCode::from(exit as u8)
}

/// On one line, whatever names and values the user has given.
pub(crate) fn complain(error: &dyn Display) {
    // In one piece, so that nothing that others say comes between, and whether or not anybody listens.
    let line = format!("atoll: {}\n", OneLine(&error.to_string()));
    let _ = io::stderr().write_all(line.as_bytes());
}

/// Help and version as they are; complaints on one line.
fn usage(error: &clap::Error) -> ExitCode {
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            // Nobody may be reading; that is no failure.
            let _ = error.print();
            ExitCode::from(if error.use_stderr() { Exit::Usage } else { Exit::Done } as u8)
        }
        _ => {
            eprintln!("atoll: {}", args::one_line(error));
            ExitCode::from(Exit::Usage as u8)
        }
    }
}
