//! Which scenes there are, and what is usual for each.

use super::file::SceneFile;
use super::yards::Yard;
use super::{SceneError, compounds, junkyard, rooms, sparse, tumbler, washer};
use atoll_core::{Exchange, Params};
use glam::Vec2;
use std::borrow::Cow;
use std::fmt;
use std::path::Path;
use std::sync::Arc;

/// A scene that is asked for.
#[derive(Clone, PartialEq, Debug)]
pub struct SceneSpec {
    /// Which scene.
    pub kind: SceneKind,
    /// How many dynamic bodies.
    pub bodies: u64,
    /// Chooses among the random variants of the scene.
    pub seed: u64,
}

/// A scene and what only it has.
#[derive(Clone, PartialEq, Debug)]
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
    /// Bodies of two triangles fall into a basin.
    Compounds,
    /// Pentagons in a basin, and a box that goes to and fro among them.
    Junkyard,
    /// Boxes in a round drum that turns.
    Washer,
    /// Boxes in a square drum that turns.
    Tumbler,
    /// All shapes, and what moves them.
    Zoo,
    /// Boxes on an incline.
    Slope {
        /// Of the incline, in degrees.
        angle: f64,
        /// Coulomb's coefficient, of the incline and of the boxes.
        friction: f64,
    },
    /// What files say.
    File(FileSpec),
}

/// A scene in files.
#[derive(Clone)]
pub struct FileSpec {
    /// Where its text is, from the root of the file system.
    pub path: String,
    /// What tells its content from that of others.
    pub digest: String,
    /// The files, once they are opened.
    file: Option<Arc<SceneFile>>,
}

/// Not what the files hold.
impl fmt::Debug for FileSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FileSpec").field("path", &self.path).field("digest", &self.digest).finish_non_exhaustive()
    }
}

/// Whether it is the same, not whether the same file is open.
impl PartialEq for FileSpec {
    fn eq(&self, other: &Self) -> bool {
        (&self.path, &self.digest) == (&other.path, &other.digest)
    }
}

impl FileSpec {
    /// Opens the files of a scene.
    ///
    /// # Errors
    /// If they hold none.
    pub fn open(path: &Path) -> Result<Self, SceneError> {
        let file = SceneFile::open(path)?;
        let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let whole =
            whole.to_str().ok_or_else(|| SceneError::whole(path, "its path is not UTF-8; move it to another"))?;
        Ok(Self { path: whole.to_owned(), digest: file.digest().to_owned(), file: Some(Arc::new(file)) })
    }

    /// Files that some run was begun with, and that may be gone.
    pub(crate) fn of_begun(path: String, digest: String) -> Self {
        Self { path, digest, file: None }
    }

    /// The files.
    ///
    /// # Errors
    /// If they are not open and cannot be opened, or are others now.
    pub(crate) fn file(&self) -> Result<Arc<SceneFile>, SceneError> {
        if let Some(file) = &self.file {
            return Ok(file.clone());
        }
        let path = Path::new(&self.path);
        let file = SceneFile::open(path)?;
        if file.digest() == self.digest {
            return Ok(Arc::new(file));
        }
        Err(SceneError::whole(
            path,
            format!("it is another scene than the one of the run, whose digest is {}", self.digest),
        ))
    }
}

impl SceneSpec {
    /// What is usual for a kind of scene.
    pub fn usual(kind: SceneKind) -> Self {
        let (bodies, seed) = (kind.usual_bodies(), if matches!(kind, SceneKind::File(_)) { 0 } else { 1 });
        Self { kind, bodies, seed }
    }
}

impl SceneKind {
    /// How configurations call scenes in files.
    pub(crate) const FILE: &str = "file";

    /// Every kind but files, with what is usual for what only it has.
    pub const USUAL: [Self; 13] = [
        Self::Rooms { power: 1.0 },
        Self::Pile { jitter: 0.01 },
        Self::Pyramids { base: 10 },
        Self::Sparse,
        Self::SingleIsland,
        Self::Stack,
        Self::Smash,
        Self::Compounds,
        Self::Junkyard,
        Self::Washer,
        Self::Tumbler,
        Self::Zoo,
        Self::Slope { angle: 25.0, friction: 0.6 },
    ];

    /// As a configuration calls it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Rooms { .. } => "rooms",
            Self::Pile { .. } => "pile",
            Self::Pyramids { .. } => "pyramids",
            Self::Sparse => "sparse",
            Self::SingleIsland => "single-island",
            Self::Stack => "stack",
            Self::Smash => "smash",
            Self::Compounds => "compounds",
            Self::Junkyard => "junkyard",
            Self::Washer => "washer",
            Self::Tumbler => "tumbler",
            Self::Zoo => "zoo",
            Self::Slope { .. } => "slope",
            Self::File(_) => Self::FILE,
        }
    }

    /// As people are told of it: of a scene in a file the name of that.
    pub fn title(&self) -> Cow<'_, str> {
        match self {
            Self::File(spec) => Path::new(&spec.path).file_name().unwrap_or(spec.path.as_ref()).to_string_lossy(),
            _ => self.name().into(),
        }
    }

    /// The fewest bodies that make such a scene.
    pub fn least_bodies(&self) -> u64 {
        match self {
            Self::Rooms { .. } => rooms::LEAST_BODIES,
            Self::Sparse => sparse::LEAST_BODIES,
            Self::File(_) => 0,
            _ => 1,
        }
    }

    /// How many bodies there are where nobody says.
    pub fn usual_bodies(&self) -> u64 {
        match self {
            Self::Rooms { .. } => 700_000,
            Self::Pile { .. } | Self::Sparse | Self::SingleIsland => 100_000,
            Self::Pyramids { .. } => 22_000,
            Self::Stack => 10,
            Self::Smash => 9601,
            Self::Compounds => compounds::Compounds::BODIES,
            Self::Junkyard => junkyard::Junkyard::BODIES,
            Self::Washer => washer::Washer::BODIES,
            Self::Tumbler => tumbler::Tumbler::BODIES,
            Self::Zoo => 1980,
            Self::Slope { .. } => 1,
            Self::File(spec) => spec.file.as_ref().map_or(0, |file| file.count()),
        }
    }

    /// What the parameters are where nobody gives them.
    pub fn usual_params(&self) -> Params {
        match self {
            Self::Rooms { .. } | Self::Sparse | Self::Smash | Self::File(_) => Params::default(),
            // Whatever rests needs its borders to converge.
            Self::Pile { .. }
            | Self::Pyramids { .. }
            | Self::SingleIsland
            | Self::Stack
            | Self::Compounds
            | Self::Junkyard
            | Self::Washer
            | Self::Tumbler
            | Self::Zoo
            | Self::Slope { .. } => {
                Params { gravity: Vec2::new(0.0, -10.0), exchange: Exchange::Substep, ..Params::default() }
            }
        }
    }
}
