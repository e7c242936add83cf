//! The section `[scene]`: which scene, how large, and what only it has.

use super::error::ConfigError;
use super::resolved::whole;
use super::settings::{Settings, one_of};
use crate::scene::{rooms, sparse};
use atoll_core::{Exchange, Params};
use glam::Vec2;
use toml::Value;

/// More bodies than this are taken for a slip of the finger.
const MOST_BODIES: u64 = 10_000_000_000;

/// `[scene]`
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SceneConfig {
    /// Which scene.
    pub kind: SceneKind,
    /// How many dynamic bodies.
    pub bodies: u64,
    /// Chooses among the random variants of the scene.
    pub seed: u64,
}

/// A scene and what only it has.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum SceneKind {
    /// The reported experiment.
    Rooms {
        /// Relative coordinates are raised to this power: above 1, the low corner is denser.
        power: f64,
    },
    /// A heap between two walls.
    Pile {
        /// Greatest shift of a body along x at the start, in meters.
        jitter: f64,
    },
    /// Many pyramids of boxes.
    Pyramids {
        /// Boxes in the lowest row of each.
        base: u64,
    },
    /// Bodies that fly about and seldom meet.
    Sparse,
    /// A heap in which everything touches from the start.
    SingleIsland,
    /// A tower of boxes.
    Stack,
    /// Boxes on an incline.
    Slope {
        /// Of the incline, in degrees.
        angle: f64,
        /// Coulomb's coefficient, of the incline and of the boxes.
        friction: f64,
    },
}

impl SceneKind {
    /// As in a configuration.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rooms { .. } => "rooms",
            Self::Pile { .. } => "pile",
            Self::Pyramids { .. } => "pyramids",
            Self::Sparse => "sparse",
            Self::SingleIsland => "single-island",
            Self::Stack => "stack",
            Self::Slope { .. } => "slope",
        }
    }

    /// What the parameters are where nobody gives them.
    pub fn usual_params(self) -> Params {
        match self {
            Self::Rooms { .. } | Self::Sparse => Params::default(),
            // Whatever rests needs its borders to converge.
            Self::Pile { .. } | Self::Pyramids { .. } | Self::SingleIsland | Self::Stack | Self::Slope { .. } => {
                Params { gravity: Vec2::new(0.0, -10.0), exchange: Exchange::Substep, ..Params::default() }
            }
        }
    }
}

impl SceneConfig {
    pub(super) fn read(settings: &mut Settings) -> Result<Self, ConfigError> {
        type Read = fn(&mut Settings) -> Result<SceneKind, ConfigError>;
        // By name: how to read what only this scene has, and the least and the usual number of bodies.
        let kinds: [(&str, (Read, u64, u64)); 7] = [
            ("rooms", (read_rooms, rooms::LEAST_BODIES, 700_000)),
            ("pile", (read_pile, 1, 100_000)),
            ("pyramids", (read_pyramids, 1, 22_000)),
            ("sparse", (|_| Ok(SceneKind::Sparse), sparse::LEAST_BODIES, 100_000)),
            ("single-island", (|_| Ok(SceneKind::SingleIsland), 1, 100_000)),
            ("stack", (|_| Ok(SceneKind::Stack), 1, 10)),
            ("slope", (read_slope, 1, 1)),
        ];
        let chosen = settings.choice("scene.kind", &kinds)?;
        let (read, least, usual) = chosen.ok_or_else(|| settings.missing("scene.kind", one_of(&kinds)))?;
        let kind = read(settings)?;
        let bodies = settings.integer("scene.bodies", least..=MOST_BODIES, usual)?;
        let seed = settings.integer("scene.seed", 0..=i64::MAX as u64, 1)?;
        Ok(Self { kind, bodies, seed })
    }

    /// Every key of this scene, with its value.
    pub(super) fn entries(&self) -> Vec<(&'static str, Value)> {
        let Self { kind, bodies, seed } = *self;
        let mut entries = vec![
            ("scene.kind", Value::from(kind.name())),
            ("scene.bodies", whole(bodies)),
            ("scene.seed", whole(seed)),
        ];
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
