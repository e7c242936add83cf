//! What is compared: a scene of the configurations, of a size, for a number of steps.

use super::Failure;
use super::given::{Corners, Given};
use ::atoll::Config;
use ::atoll::internals::Plan;
use ::atoll_core::{Blueprint, Body, GlobalId};
use clap::ValueEnum;
use std::fmt;

/// A scene, by the name of its configuration.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum SceneName {
    /// Four rooms of bodies that fly about.
    Normal,
    /// As normal, crowded towards one corner.
    Skewed,
    /// A heap that settles between two walls.
    Pile,
    /// Pyramids of boxes.
    Pyramids,
    /// One large pyramid.
    #[value(name = "large_pyramid")]
    LargePyramid,
    /// A wall of boxes, and a large one that flies into it.
    Smash,
    /// Bodies of two triangles fall into a basin.
    Compounds,
    /// Pentagons in a basin, and a box that goes to and fro among them.
    Junkyard,
    /// Boxes in a round drum that turns.
    Washer,
    /// Boxes in a square drum that turns.
    Tumbler,
}

impl SceneName {
    fn steps(self) -> u64 {
        match self {
            Self::Pile => 600,
            Self::LargePyramid | Self::Compounds | Self::Washer => 500,
            Self::Junkyard => 800,
            Self::Tumbler => 750,
            Self::Smash => 300,
            _ => 200,
        }
    }

    /// Where not the configuration's.
    fn bodies(self) -> Option<u64> {
        (self == Self::Pile).then_some(20_000)
    }
}

impl fmt::Display for SceneName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Normal => "normal",
            Self::Skewed => "skewed",
            Self::Pile => "pile",
            Self::Pyramids => "pyramids",
            Self::LargePyramid => "large_pyramid",
            Self::Smash => "smash",
            Self::Compounds => "compounds",
            Self::Junkyard => "junkyard",
            Self::Washer => "washer",
            Self::Tumbler => "tumbler",
        })
    }
}

/// A scene with everything that is asked of it.
#[derive(Debug)]
pub struct Case {
    /// Its name.
    pub scene: SceneName,
    /// Steps to make; may be zero.
    pub steps: u64,
    /// Threads to make them on.
    pub threads: usize,
    /// The scene and Atoll's tiles for it.
    pub plan: Plan,
}

/// What the command line says about a case; the scene knows the rest.
#[derive(Clone, Default, Debug)]
pub struct Wishes {
    /// How many dynamic bodies.
    pub bodies: Option<u64>,
    /// How many steps.
    pub steps: Option<u64>,
    /// How many threads; one if nothing is said.
    pub threads: Option<usize>,
    /// Atoll's columns and rows of tiles, as in a configuration.
    pub tiles: Option<String>,
}

impl Case {
    /// Reads the configuration of the scene.
    ///
    /// # Errors
    /// If it cannot be read, or makes no world.
    pub fn new(scene: SceneName, wishes: &Wishes) -> Result<Self, Failure> {
        let path = format!("{}/../configs/{scene}.toml", env!("CARGO_MANIFEST_DIR"));
        let name = format!("configs/{scene}.toml");
        let text = std::fs::read_to_string(path)
            .map_err(|error| Failure::refused(format!("{name}: {error}; run from a checkout that has this scene")))?;
        let threads = wishes.threads.unwrap_or(1);
        let bodies = wishes.bodies.or(scene.bodies()).map(|bodies| bodies.to_string());
        let threads_text = threads.to_string();
        let mut overrides = vec![("ranks", "1"), ("threads", &threads_text), ("physics.sleep", "false")];
        overrides.extend(bodies.as_deref().map(|bodies| ("bodies", bodies)));
        overrides.extend(wishes.tiles.as_deref().map(|tiles| ("tiles", tiles)));
        let config = Config::from_toml_str(&name, &text, &overrides).map_err(Failure::refused)?;
        let plan = Plan::new(&config).map_err(Failure::refused)?;
        Ok(Self { scene, steps: wishes.steps.unwrap_or_else(|| scene.steps()), threads, plan })
    }
}

impl Given for Case {
    fn blueprint(&self) -> &Blueprint {
        &self.plan.blueprint
    }

    fn bodies(&self) -> impl Iterator<Item = Body> {
        self.plan.scene.iter().map(|body| body.expect("scenes of this crate are made, not read"))
    }

    fn home(&self, index: u64) -> Corners {
        let id = GlobalId(self.plan.scene.statics().len() as u64 + index);
        let (low, high) = self.plan.scene.home(id).expect("one of this scene");
        [low.to_array(), high.to_array()]
    }

    fn threads(&self) -> usize {
        self.threads
    }
}
