//! Whether what is to be done before the first step there is to make can be: asked before the folder of a run is touched.

use super::presence::{Crowds, Present, acts, spoken_of};
use super::refusal;
use crate::command::{Line, State};
use crate::error::{Exit, RunError};
use crate::plan::Plan;
use atoll_core::{SetupError, World};

/// Where a run is about to be overwritten by one with a file of commands, whether those before the first step can be done. For one
/// process of a run to ask.
///
/// # Errors
/// If not, or the scene cannot be read.
pub(crate) fn check_commands(plan: &Plan) -> Result<(), RunError> {
    let overwrites = plan.output.as_ref().is_some_and(|output| output.begins && output.folder.holds_run());
    let Some(script) = plan.commands.to_come().filter(|_| overwrites && !plan.commands.skips) else { return Ok(()) };
    let lines = &script.lines[..script.lines.partition_point(|line| line.step == 0)];
    if lines.is_empty() {
        return Ok(());
    }
    let mut present: Present = spoken_of(lines).into_iter().map(|id| (id, None)).collect();
    let mut greatest = plan.blueprint.statics.iter().map(|fixed| fixed.id).max();
    for body in plan.scene.near(|_, _| true) {
        let body = body?;
        greatest = greatest.max(Some(body.id));
        present.entry(body.id).and_modify(|known| *known = Some(body));
    }
    let state = State::new(greatest.map_or(0, |id| id.0.saturating_add(1)));
    rehearse(plan, lines, present, state)?.map_err(|(line, reason)| {
        let text = refusal(&script.path.display().to_string(), (line.number, line.name.as_deref()), 0, &reason);
        RunError::Relayed { text: format!("{text}; {}", super::MEND), exit: Exit::Usage }
    })
}

/// Whether lines can be done, one after the other, where commands have led to a `state` and of the bodies that lines speak of these
/// are `present`; if not, which is the first that cannot, and why.
///
/// # Errors
/// If no world can be made of the plan.
pub(super) fn rehearse<'a>(
    plan: &Plan,
    lines: &'a [Line],
    mut present: Present,
    mut state: State,
) -> Result<Result<(), (&'a Line, String)>, SetupError> {
    // The rest of the world is that of a rank which holds no bodies.
    let mut world = World::new(&plan.blueprint, &[])?;
    state.prepare(&mut world)?;
    let mut crowds = Crowds::default();
    for line in lines {
        let commands = match acts(line, state.next, &mut present, &crowds, &world) {
            Ok(commands) => commands,
            Err(reason) => return Ok(Err((line, reason))),
        };
        for command in &commands {
            world.command(command)?;
            state.note(command, 0);
        }
        crowds.note(&commands);
    }
    Ok(Ok(()))
}
