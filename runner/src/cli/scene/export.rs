//! `atoll scene export`: the start of a configuration, or a recorded step of a run, as the files of a scene.

use super::super::args::SceneExportArgs;
use super::target::Target;
use crate::command::{Action, Script};
use crate::config::Config;
use crate::error::{Exit, RunError};
use crate::folder::RunFolder;
use crate::folder::recording::Row;
use crate::look::frame::Frame;
use crate::look::recorded::Recorded;
use crate::plan::{check_held, check_list};
use crate::scene::file::FARTHEST;
use crate::scene::file::write::World;
use crate::scene::{Scene, SceneFile};
use atoll_core::{Body, Command, GlobalId, KindId, Rot};
use glam::{DVec2, Vec2};

/// Does it.
///
/// # Errors
/// If there is nothing to be written, or it cannot be.
pub(super) fn run(args: &SceneExportArgs) -> Result<Exit, RunError> {
    let SceneExportArgs { from, out, bodies_as, step, overwrite, values } = args;
    let target = Target::check(out, *bodies_as, *overwrite, from)?;
    match (from.is_dir(), step) {
        (true, Some(step)) => of_run(args, *step, &target)?,
        (true, None) => return Err(unsuitable("--step", "say which recorded step of this run to write")),
        (false, Some(step)) => {
            return Err(unsuitable(&format!("--step {step}"), "only the folder of a run has steps; leave it out"));
        }
        (false, None) => {
            let config = Config::load(from, &values.overrides()?)?;
            let scene = Scene::open(&config.scene)?;
            check_list(scene.bodies())?;
            let mut bodies = Vec::with_capacity(scene.bodies() as usize);
            for body in scene.iter() {
                bodies.push(body?);
            }
            let world = World {
                name: scene.file().map_or(Some(config.scene.kind.name()), SceneFile::name),
                domain: scene.domain(),
                physics: config.unusual_physics(),
                kinds: &scene.kinds(),
                names: scene.file().map_or(&[], SceneFile::kind_names),
                statics: scene.statics(),
            };
            target.write(&world, bodies)?;
        }
    }
    Ok(Exit::Done)
}

/// What was recorded of a step.
fn of_run(args: &SceneExportArgs, step: u64, target: &Target<'_>) -> Result<(), RunError> {
    if let Some(option) = args.values.first() {
        return Err(unsuitable(option, "a run that was made has its values; leave it out"));
    }
    let recorded = Recorded::open(&args.from)?;
    let folder = RunFolder::new("export", &args.from);
    let mut config = folder.begun()?;
    if let Some(gravity) = gravity_of_commands(&folder, step)? {
        config.params.gravity = gravity;
    }
    // As they are recorded and as bodies, which are sorted.
    let (rows, each) = (recorded.recording().rows(step), size_of::<Row>() + size_of::<Body>() * 3 / 2);
    check_held(&format!("{rows} bodies"), rows.saturating_mul(each as u64))?;
    let mut frame = Frame::default();
    recorded.read(step, &mut frame)?;
    if let Some(row) = frame.bodies.iter().find(|row| row.x.abs().max(row.y.abs()) > FARTHEST) {
        let reason =
            format!("body {} is more than 1e9 m out there, where no scene has any; name an earlier step", row.id);
        return Err(unsuitable(&format!("--step {step}"), &reason));
    }
    let (setting, [low, high]) = (recorded.setting(), recorded.recording().facts().domain);
    let name = format!("{}, step {step}", config.scene.kind.title());
    let statics: Vec<_> = setting.statics.iter().map(|fixed| fixed.begun_at(step, config.params.dt)).collect();
    let world = World {
        name: Some(&name),
        domain: (low, high),
        physics: config.unusual_physics(),
        kinds: &setting.kinds,
        names: &setting.names,
        statics: &statics,
    };
    target.write(&world, frame.bodies.iter().map(body).collect())
}

/// What commands made of gravity until a step, if any did.
fn gravity_of_commands(folder: &RunFolder, step: u64) -> Result<Option<Vec2>, RunError> {
    let path = folder.commands();
    if !path.is_file() {
        return Ok(None);
    }
    let script = Script::load_recorded(&path)?;
    let made = script.lines.iter().filter(|line| line.step <= step).rev().find_map(|line| match &line.action {
        Action::Do(commands) => commands.iter().rev().find_map(|command| match command {
            Command::SetGravity(gravity) => Some(*gravity),
            _ => None,
        }),
        _ => None,
    });
    Ok(made)
}

/// A body as it was recorded.
fn body(row: &Row) -> Body {
    let Row { id, x, y, angle, vx, vy, omega, kind, .. } = *row;
    Body {
        id: GlobalId(id),
        position: DVec2::new(x, y),
        rotation: Rot::from_angle(angle),
        velocity: Vec2::new(vx, vy),
        angular_velocity: omega,
        kind: KindId(kind),
    }
}

fn unsuitable(option: &str, reason: &str) -> RunError {
    RunError::Unsuitable { option: option.to_owned(), reason: reason.to_owned() }
}
