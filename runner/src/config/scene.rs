//! The section `[scene]`, read and written: which scene, how large, and what only it has.

use super::error::ConfigError;
use super::settings::{Settings, one_of};
use super::words::whole;
use crate::scene::{SceneKind, SceneSpec};
use toml::Value;

/// More bodies than this are taken for a slip of the finger.
const MOST_BODIES: u64 = 10_000_000_000;

/// Reads which scene it is to be.
pub(super) fn read(settings: &mut Settings) -> Result<SceneSpec, ConfigError> {
    type Read = fn(&mut Settings) -> Result<SceneKind, ConfigError>;
    // By name: how to read what only this scene has.
    let kinds: [(&str, Read); 7] = [
        ("rooms", read_rooms),
        ("pile", read_pile),
        ("pyramids", read_pyramids),
        ("sparse", |_| Ok(SceneKind::Sparse)),
        ("single-island", |_| Ok(SceneKind::SingleIsland)),
        ("stack", |_| Ok(SceneKind::Stack)),
        ("slope", read_slope),
    ];
    let chosen = settings.choice("scene.kind", &kinds)?;
    let kind = chosen.ok_or_else(|| settings.missing("scene.kind", one_of(&kinds)))?(settings)?;
    let bodies = settings.integer("scene.bodies", kind.least_bodies()..=MOST_BODIES, kind.usual_bodies())?;
    let seed = settings.integer("scene.seed", 0..=i64::MAX as u64, 1)?;
    Ok(SceneSpec { kind, bodies, seed })
}

/// Every key of this scene, with its value.
pub(super) fn entries(scene: &SceneSpec) -> Vec<(&'static str, Value)> {
    let SceneSpec { kind, bodies, seed } = *scene;
    let mut entries =
        vec![("scene.kind", Value::from(kind.name())), ("scene.bodies", whole(bodies)), ("scene.seed", whole(seed))];
    match kind {
        SceneKind::Rooms { power } => entries.push(("scene.power", power.into())),
        SceneKind::Pile { jitter } => entries.push(("scene.jitter", jitter.into())),
        SceneKind::Pyramids { base } => entries.push(("scene.base", whole(base))),
        SceneKind::Sparse | SceneKind::SingleIsland | SceneKind::Stack => {}
        SceneKind::Slope { angle, friction } => {
            entries.extend([("scene.angle", angle.into()), ("scene.friction", friction.into())]);
        }
    }
    entries
}

fn read_rooms(settings: &mut Settings) -> Result<SceneKind, ConfigError> {
    Ok(SceneKind::Rooms { power: settings.number("scene.power", 0.1..=10.0, 1.0)? })
}

fn read_pile(settings: &mut Settings) -> Result<SceneKind, ConfigError> {
    Ok(SceneKind::Pile { jitter: settings.number("scene.jitter", 0.0..=0.25, 0.01)? })
}

fn read_pyramids(settings: &mut Settings) -> Result<SceneKind, ConfigError> {
    Ok(SceneKind::Pyramids { base: settings.integer("scene.base", 2..=100, 10)? })
}

fn read_slope(settings: &mut Settings) -> Result<SceneKind, ConfigError> {
    let angle = settings.number("scene.angle", 0.0..=60.0, 25.0)?;
    Ok(SceneKind::Slope { angle, friction: settings.number("scene.friction", 0.0..=2.0, 0.6)? })
}
