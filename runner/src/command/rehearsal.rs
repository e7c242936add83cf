//! What lines do to a world by itself, without a run: for tests.

use super::answer::Part;
use super::script::{Script, ScriptError};
use super::text::Action;
use atoll_core::World;
use std::path::Path;

/// Reads lines, and does to a world, now, what can be done of them, and asks what is asked. Says how many were done and how many not.
///
/// # Errors
/// The first line that is no command; nothing is done then.
pub fn rehearse(text: &str, world: &mut World) -> Result<[usize; 2], ScriptError> {
    let script = Script::read(Path::new("commands"), text)?;
    let mut counts = [0; 2];
    let mut count = |is_done: bool| counts[usize::from(!is_done)] += 1;
    for line in script.lines.iter() {
        match &line.action {
            Action::Add(bodies) => bodies.iter().for_each(|new| {
                count(if new.is_named { world.add(new.body) == Ok(true) } else { world.insert(new.body).is_ok() });
            }),
            Action::Do(commands) => commands.iter().for_each(|command| count(world.command(command) == Ok(true))),
            Action::Ask(question) => {
                let answer = serde_json::to_string(&Part::of(question, world, &world.sensors()));
                count(answer.is_ok());
            }
            Action::Tell(..) => count(true),
        }
    }
    Ok(counts)
}
