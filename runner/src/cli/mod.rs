//! The program as a person meets it: the command line, the verbs, one file each, and what goes to the terminal.

pub(crate) mod args;
mod console;
mod diff;
mod drive;
mod export;
mod info;
mod interrupt;
mod output;
mod progress;
mod project;
mod render;
mod report;
mod run;
mod scene;
mod view;

use crate::error::{Exit, RunError};
use args::{Cli, Command};
use clap::Parser;
use clap::error::ErrorKind;
use std::process::ExitCode;
use std::{env, io, panic, thread};

/// Reads the command line and does what it says.
pub fn main() -> ExitCode {
    let parsed = with_room(|| Cli::try_parse().map_err(|error| usage(&error)));
    let command = match parsed {
        Ok(Ok(cli)) => view::as_run(cli.command),
        Ok(Err(exit)) => return exit,
        Err(error) => {
            console::complain(&format!("cannot start a thread: {error}"));
            return ExitCode::from(Exit::Usage as u8);
        }
    };
    let begun = console::init(matches!(&command, Command::Run(args) if args.trace.is_some()));
    interrupt::outlive_file_limits();
    if matches!(command, Command::Diff(_) | Command::Info(_) | Command::Report(_) | Command::Scene(_)) {
        interrupt::quit_on_signals();
    }
    let result = begun.and_then(|()| match &command {
        Command::Run(args) => run::run(args),
        Command::View(args) => view::run(args),
        Command::Diff(args) => diff::run(args),
        Command::Render(args) => render::run(args),
        Command::Info(args) => info::run(args),
        Command::Report(args) => report::run(args),
        Command::Project(args) => project::run(args),
        Command::Export(args) => export::run(args),
        Command::Scene(args) => scene::run(args),
    });
    let exit = result.unwrap_or_else(|error| {
        if !matches!(error, RunError::ToldElsewhere { .. }) {
            console::complain(&error);
        }
        match (&command, error.exit()) {
            (_, Exit::Output) => Exit::Output,
            // One code tells of all that keeps a comparison from its answer.
            (Command::Diff(_), _) => Exit::Usage,
            (_, exit) => exit,
        }
    });
    ExitCode::from(exit as u8)
}

/// What describes all options to clap takes more stack than all the rest of a run, and some systems give little of it.
const ROOM: usize = 1 << 20;

/// Does something, where this thread has little stack on one that has enough. Not always: a thread takes addresses, of which some
/// systems give few.
fn with_room<T: Send>(act: impl FnOnce() -> T + Send) -> io::Result<T> {
    if !has_small_stack() {
        return Ok(act());
    }
    thread::scope(|scope| {
        let thread = thread::Builder::new().stack_size(ROOM).spawn_scoped(scope, act)?;
        Ok(thread.join().unwrap_or_else(|payload| panic::resume_unwind(payload)))
    })
}

#[cfg(unix)]
fn has_small_stack() -> bool {
    let limit = rustix::process::getrlimit(rustix::process::Resource::Stack);
    limit.current.is_some_and(|bytes| bytes < ROOM as u64)
}

#[cfg(not(unix))]
fn has_small_stack() -> bool {
    false
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
            console::complain(&args::one_line(error, env::args_os().skip(1)));
            ExitCode::from(Exit::Usage as u8)
        }
    }
}
