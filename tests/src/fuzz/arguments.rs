//! Command lines.

use super::{Outcome, assert_one_line};
use crate::program;
use atoll::Config;
use atoll::config::ConfigError;
use atoll::internals::{Cli, Command, one_line};
use clap::Parser;
use clap::error::ErrorKind;
use std::ffi::OsString;
use std::iter::once;
use std::path::PathBuf;
use std::sync::LazyLock;

/// The configuration that every command line is given, whatever file it names: files of any name are not for reading.
static CONFIG: LazyLock<PathBuf> = LazyLock::new(|| program::root().join("configs/quickstart.toml"));

#[cfg(unix)]
fn argument(bytes: &[u8]) -> OsString {
    std::os::unix::ffi::OsStringExt::from_vec(bytes.to_vec())
}

#[cfg(not(unix))]
fn argument(bytes: &[u8]) -> OsString {
    String::from_utf8_lossy(bytes).into_owned().into()
}

/// Why a command line makes no run.
#[derive(Debug)]
pub enum NoRun {
    /// The parser of the command line says so, or what help was asked for.
    Parser(ErrorKind),
    /// What it says is no configuration.
    Config(ConfigError),
    /// It is another verb.
    OtherVerb,
}

/// Arguments, the name of the program left out, with a zero byte between any two. They are refused in one line, they
/// ask for help, or they make a configuration.
pub fn arguments(bytes: &[u8]) -> Outcome<NoRun> {
    let given: Vec<OsString> = bytes.split(|&byte| byte == 0).map(argument).collect();
    let refused = |why| Outcome { accepted: false, refusals: vec![why] };
    let cli = match Cli::try_parse_from(once(OsString::from("atoll")).chain(given.iter().cloned())) {
        Ok(cli) => cli,
        Err(error) => {
            let text = one_line(&error, given.first().map(OsString::as_os_str));
            match error.kind() {
                ErrorKind::DisplayHelp
                | ErrorKind::DisplayVersion
                | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {}
                _ => assert_one_line(text),
            }
            return refused(NoRun::Parser(error.kind()));
        }
    };
    let Command::Run(args) = cli.command else { return refused(NoRun::OtherVerb) };
    let config = args.overrides().and_then(|overrides| Config::load(&CONFIG, &overrides));
    let Outcome { accepted, refusals } = Outcome::of(config);
    Outcome { accepted, refusals: refusals.into_iter().map(NoRun::Config).collect() }
}
