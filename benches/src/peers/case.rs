//! What is compared: a scene of the configurations or of any file, of a size, for a number of steps.

use super::Failure;
use super::given::{Corners, Given};
use ::atoll::internals::Plan;
use ::atoll::{Config, Override};
use ::atoll_core::{Blueprint, Body, GlobalId};
use clap::ValueEnum;
use std::fmt;
use std::path::Path;

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
    /// Its name, or that of its file.
    pub scene: String,
    /// Steps to make; may be zero.
    pub steps: u64,
    /// Threads to make them on.
    pub threads: usize,
    /// The scene and Atoll's tiles for it.
    pub plan: Plan,
}

/// What the command line says about a case; the scene knows the rest.
#[derive(Clone, Copy, Default, Debug)]
pub struct Wishes<'a> {
    /// How many dynamic bodies.
    pub bodies: Option<u64>,
    /// How many steps.
    pub steps: Option<u64>,
    /// How many threads; one if nothing is said.
    pub threads: Option<usize>,
    /// Atoll's columns and rows of tiles, as in a configuration.
    pub tiles: Option<&'a str>,
}

impl Case {
    /// Reads the configuration of the scene.
    ///
    /// # Errors
    /// If it cannot be read, or makes no world.
    pub fn new(scene: SceneName, wishes: Wishes<'_>) -> Result<Self, Failure> {
        let path = format!("{}/../configs/{scene}.toml", env!("CARGO_MANIFEST_DIR"));
        let wishes = Wishes { bodies: wishes.bodies.or(scene.bodies()), ..wishes };
        let case = Self::read(Path::new(&path), wishes)?;
        Ok(Self { scene: scene.to_string(), steps: wishes.steps.unwrap_or_else(|| scene.steps()), ..case })
    }

    /// Reads a configuration, or a file of a scene.
    ///
    /// # Errors
    /// If it cannot be read, makes no world, or has what only Atoll knows.
    pub fn read(path: &Path, wishes: Wishes<'_>) -> Result<Self, Failure> {
        let threads = wishes.threads.unwrap_or(1);
        let mut overrides = vec![
            Override::set("ranks", "1"),
            Override::set("threads", &threads.to_string()),
            Override::set("physics.sleep", "false"),
        ];
        overrides.extend(wishes.bodies.map(|bodies| Override::set("bodies", &bodies.to_string())));
        overrides.extend(wishes.tiles.map(|tiles| Override::set("tiles", tiles)));
        let config = Config::load(path, &overrides).map_err(Failure::refused)?;
        let plan = Plan::new(&config).map_err(Failure::refused)?;
        // Nobody asks again whether they can be read.
        plan.scene.iter().try_for_each(|body| body.map(drop)).map_err(Failure::refused)?;
        let scene = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let case = Self { scene, steps: wishes.steps.unwrap_or(config.run.steps), threads, plan };
        case.check().map(|()| case)
    }

    /// Refuses what the other engines do not have, or have in another way.
    fn check(&self) -> Result<(), Failure> {
        let blueprint = &self.plan.blueprint;
        let kinds = || blueprint.kinds.iter().chain(blueprint.statics.iter().map(|fixed| &fixed.kind));
        let unlike = [
            (kinds().any(|kind| kind.sensor), "sensors"),
            (kinds().any(|kind| kind.material.surface_speed != 0.0), "surfaces that move"),
            (kinds().any(|kind| kind.filter.group != 0), "groups of bodies"),
        ];
        match unlike.iter().find(|(has, _)| *has) {
            None => Ok(()),
            Some((_, what)) => Err(Failure::refused(format!(
                "{} has {what}, which not every engine knows, or not alike; leave them out",
                self.scene
            ))),
        }
    }
}

impl Given for Case {
    fn blueprint(&self) -> &Blueprint {
        &self.plan.blueprint
    }

    fn bodies(&self) -> impl Iterator<Item = Body> {
        self.plan.scene.iter().map(|body| body.expect("read before"))
    }

    fn home(&self, index: u64) -> Corners {
        // Those in files have any names, and one home.
        let id = GlobalId(self.plan.scene.statics().len() as u64 + index);
        let (low, high) = self.plan.scene.home(id).expect("one of this scene");
        [low.to_array(), high.to_array()]
    }

    fn threads(&self) -> usize {
        self.threads
    }
}
