//! Whether what is to be done before the first step can be: asked before another run gives way to this one.

use super::presence::{Crowds, Present, acts, spoken_of};
use crate::command::{Line, ScriptError, State};
use crate::error::RunError;
use crate::plan::Plan;
use atoll_core::World;

/// Where a run is about to be overwritten by one with a file of commands, whether those before the first step can be done. For one
/// process of a run to ask.
///
/// # Errors
/// If not, or the scene cannot be read.
pub(crate) fn check_commands(plan: &Plan) -> Result<(), RunError> {
    let overwrites = plan.output.as_ref().is_some_and(|output| output.begins && output.folder.holds_run());
    let Some(script) = plan.commands.to_come().filter(|_| overwrites && !plan.commands.skips) else { return Ok(()) };
    let lines = &script.lines[..script.lines.partition_point(|line| line.step == 0)];
    rehearse(plan, lines).map_err(|error| match error {
        Failed::Scene(error) => error,
        Failed::Line(line, reason) => {
            let reason = format!("step 0: {reason}; {}", super::MEND);
            ScriptError::Line { path: script.path.clone(), line, reason }.into()
        }
    })
}

enum Failed {
    Scene(RunError),
    Line(u64, String),
}

fn rehearse(plan: &Plan, lines: &[Line]) -> Result<(), Failed> {
    if lines.is_empty() {
        return Ok(());
    }
    let failed = |error: RunError| Failed::Scene(error);
    // Of bodies only those are looked at that lines speak of; the rest of the world is that of a rank which holds none.
    let mut world = World::new(&plan.blueprint, &[]).map_err(|error| failed(error.into()))?;
    let mut present: Present = spoken_of(lines).into_iter().map(|id| (id, None)).collect();
    let mut greatest = plan.blueprint.statics.iter().map(|fixed| fixed.id).max();
    for body in plan.scene.near(|_, _| true) {
        let body = body.map_err(|error| failed(error.into()))?;
        greatest = greatest.max(Some(body.id));
        present.entry(body.id).and_modify(|known| *known = Some(body));
    }
    let mut state = State::new(greatest.map_or(0, |id| id.0.saturating_add(1)));
    let mut crowds = Crowds::default();
    for line in lines {
        let refused = |reason: String| Failed::Line(line.number, reason);
        let commands = acts(line, state.next, &mut present, &crowds, &world).map_err(refused)?;
        for command in &commands {
            world.command(command).map_err(|error| refused(error.to_string()))?;
            state.note(command, 0);
        }
        crowds.note(&commands);
    }
    Ok(())
}
