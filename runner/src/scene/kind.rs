//! Which scenes there are, and what is usual for each.

use super::{rooms, sparse};
use atoll_core::{Exchange, Params};
use glam::Vec2;

/// A scene that is asked for.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SceneSpec {
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
    /// A wall of boxes, and a large one that flies into it.
    Smash,
    /// Boxes on an incline.
    Slope {
        /// Of the incline, in degrees.
        angle: f64,
        /// Coulomb's coefficient, of the incline and of the boxes.
        friction: f64,
    },
}

impl SceneSpec {
    /// What is usual for a kind of scene.
    pub fn usual(kind: SceneKind) -> Self {
        Self { kind, bodies: kind.usual_bodies(), seed: 1 }
    }
}

impl SceneKind {
    /// Every kind, with what is usual for what only it has.
    pub const USUAL: [Self; 8] = [
        Self::Rooms { power: 1.0 },
        Self::Pile { jitter: 0.01 },
        Self::Pyramids { base: 10 },
        Self::Sparse,
        Self::SingleIsland,
        Self::Stack,
        Self::Smash,
        Self::Slope { angle: 25.0, friction: 0.6 },
    ];

    /// As a configuration calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rooms { .. } => "rooms",
            Self::Pile { .. } => "pile",
            Self::Pyramids { .. } => "pyramids",
            Self::Sparse => "sparse",
            Self::SingleIsland => "single-island",
            Self::Stack => "stack",
            Self::Smash => "smash",
            Self::Slope { .. } => "slope",
        }
    }

    /// The fewest bodies that make such a scene.
    pub fn least_bodies(self) -> u64 {
        match self {
            Self::Rooms { .. } => rooms::LEAST_BODIES,
            Self::Sparse => sparse::LEAST_BODIES,
            _ => 1,
        }
    }

    /// How many bodies there are where nobody says.
    pub fn usual_bodies(self) -> u64 {
        match self {
            Self::Rooms { .. } => 700_000,
            Self::Pile { .. } | Self::Sparse | Self::SingleIsland => 100_000,
            Self::Pyramids { .. } => 22_000,
            Self::Stack => 10,
            Self::Smash => 9601,
            Self::Slope { .. } => 1,
        }
    }

    /// What the parameters are where nobody gives them.
    pub fn usual_params(self) -> Params {
        match self {
            Self::Rooms { .. } | Self::Sparse | Self::Smash => Params::default(),
            // Whatever rests needs its borders to converge.
            Self::Pile { .. } | Self::Pyramids { .. } | Self::SingleIsland | Self::Stack | Self::Slope { .. } => {
                Params { gravity: Vec2::new(0.0, -10.0), exchange: Exchange::Substep, ..Params::default() }
            }
        }
    }
}
