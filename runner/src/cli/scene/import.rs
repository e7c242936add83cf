//! `atoll scene import`: what another program has saved, as the files of a scene.

use super::super::args::SceneImportArgs;
use super::super::console::complain;
use super::target::Target;
use crate::error::{Exit, RunError};
use crate::plan::check_held;
use crate::scene::import;

/// Does it.
///
/// # Errors
/// If the file cannot be read, or has things in it that there is no counterpart for and that are not to be left out.
pub(super) fn run(args: &SceneImportArgs) -> Result<Exit, RunError> {
    let SceneImportArgs { from, out, bodies_as, lossy, overwrite } = args;
    let target = Target::check(out, *bodies_as, *overwrite, from)?;
    let room = |needed| check_held(&format!("the bodies of {}", from.display()), needed);
    let mut imported = import::read(from, room)?;
    if let Some(left_out) = imported.left_out() {
        if !lossy {
            let reason = format!("there is no counterpart for {left_out}; leave these out with --lossy");
            return Err(RunError::Unsuitable { option: from.display().to_string(), reason });
        }
        complain(&format!("left out: {left_out}"));
    }
    let bodies = std::mem::take(&mut imported.bodies);
    let name = from.file_stem().unwrap_or_default().to_string_lossy();
    target.write(&imported.world(&name), bodies)?;
    Ok(Exit::Done)
}
