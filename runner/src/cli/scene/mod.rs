//! `atoll scene`: worlds of users' own, in files.

mod check;
mod export;
mod import;
mod target;

use super::args::{SceneArgs, SceneCommand};
use crate::error::{Exit, RunError};

/// Does what the command line says.
///
/// # Errors
/// If files cannot be read or written, or hold what cannot be.
pub(super) fn run(args: &SceneArgs) -> Result<Exit, RunError> {
    match &args.command {
        SceneCommand::Export(args) => export::run(args),
        SceneCommand::Check(args) => check::run(args),
        SceneCommand::Import(args) => import::run(args),
    }
}
