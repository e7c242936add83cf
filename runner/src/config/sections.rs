//! What a configuration holds, section by section, and what is usual where nobody says.

use super::forms;
use crate::scene::{SceneKind, SceneSpec};
use atoll_core::Params;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// More tiles along an axis cannot be named in 32 bits for both.
pub(crate) const MOST_TILES: u32 = 65_535;

/// More threads of a rank are of no use to it.
pub(crate) const MOST_THREADS: u64 = 1024;

/// Everything a run depends on.
#[derive(Clone, PartialEq, Debug)]
pub struct Config {
    /// What there is at the start.
    pub scene: SceneSpec,
    /// How long, and on what.
    pub run: RunConfig,
    /// The numbers of a step.
    pub params: Params,
    /// What is written while it runs.
    pub output: OutputConfig,
}

/// `[run]`
#[derive(Clone, PartialEq, Debug)]
pub struct RunConfig {
    /// How many steps.
    pub steps: u64,
    /// How many ranks share the tiles. With transport mpi the launcher decides, and this is only what it should be.
    pub ranks: usize,
    /// Whether that number was asked for on the command line, so that another one is an error.
    pub ranks_asked_for: bool,
    /// Threads of each rank; `None` gives them all cores that there are.
    pub threads: Option<usize>,
    /// What carries bytes between ranks; `None` chooses by their number.
    pub transport: Option<TransportKind>,
    /// Columns and rows of tiles, or of the squares that are cut into tiles where these are adaptive; `None` chooses by scene and
    /// physics, never by ranks or threads.
    pub tiles: Option<[u32; 2]>,
    /// Whether tiles follow the bodies, and how; `None` leaves all of them equal.
    pub retiling: Option<Retiling>,
    /// A rank that stays silent for so long is given up.
    pub peer_timeout: Duration,
    /// How ranks exchange messages with transport mpi.
    pub mpi_exchange: MpiExchange,
    /// By what tiles move from rank to rank.
    pub balance: Balance,
}

/// That tiles follow the bodies.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Retiling {
    /// In which way.
    pub how: Retile,
    /// So many steps lie between two times at which that is looked at.
    pub every: u64,
}

/// How tiles follow the bodies.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Retile {
    /// They are cut in four and joined.
    Adaptive {
        /// A tile with more to do is cut, and four that together have less than half of that are joined: in bodies that touch
        /// nothing, of which a contact counts as six.
        max_bodies: u64,
    },
    /// There are as many as ever, and their borders move: as many as columns and rows come to.
    Bisected,
}

impl RunConfig {
    /// How much a tile has to do at most, where tiles are cut and joined.
    pub fn max_bodies(&self) -> Option<u64> {
        match self.retiling?.how {
            Retile::Adaptive { max_bodies } => Some(max_bodies),
            Retile::Bisected => None,
        }
    }

    /// Whether borders of tiles move.
    pub fn is_bisected(&self) -> bool {
        self.retiling.is_some_and(|retiling| retiling.how == Retile::Bisected)
    }
}

/// `[output]`: of runs that were given a folder for it, or a file for their log.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct OutputConfig {
    /// The bodies are recorded every so many steps; `None` records nothing.
    pub record_every: Option<u64>,
    /// A snapshot to go on from is written every so many steps; `None` writes none.
    pub checkpoint_every: Option<u64>,
    /// The log gets a row every so many steps.
    pub log_every: u64,
}

/// How ranks exchange messages over MPI. Both ways give the same bits.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub enum MpiExchange {
    /// `MPI_Ialltoallv`: right up to hundreds of ranks.
    #[default]
    Alltoallv,
    /// Messages only between ranks that have some: right for thousands.
    Sparse,
}

/// By what tiles move from rank to rank while it runs. It changes no bit of a result.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub enum Balance {
    /// By the time that each tile took.
    #[default]
    Measured,
    /// By the bodies in each tile.
    Bodies,
    /// Not at all: who holds a tile at the start holds it to the end.
    Off,
    /// About half of all tiles go to another rank after every step, to test that nothing depends on it.
    Shuffled,
}

impl Balance {
    /// As in a configuration.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Bodies => "bodies",
            Self::Off => "off",
            Self::Shuffled => "shuffled",
        }
    }
}

/// What carries bytes between ranks.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TransportKind {
    /// One rank, alone.
    Local,
    /// Ranks are threads of this process.
    Channel,
    /// Ranks are processes of this machine that share memory.
    Iceoryx2,
    /// Ranks are processes that an MPI launcher started.
    Mpi,
}

impl TransportKind {
    /// As in a configuration.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Local => "local",
            Self::Channel => "channel",
            Self::Iceoryx2 => "iceoryx2",
            Self::Mpi => "mpi",
        }
    }

    /// Whether this program was built with it.
    pub fn is_built_in(self) -> bool {
        match self {
            Self::Local | Self::Channel => true,
            Self::Iceoryx2 => cfg!(feature = "iceoryx2"),
            Self::Mpi => cfg!(feature = "mpi"),
        }
    }
}

/// What is usual where nobody says.
impl Default for RunConfig {
    fn default() -> Self {
        Self {
            steps: 600,
            ranks: 1,
            ranks_asked_for: false,
            threads: None,
            transport: None,
            tiles: None,
            retiling: None,
            peer_timeout: Duration::from_secs(30),
            mpi_exchange: MpiExchange::default(),
            balance: Balance::default(),
        }
    }
}

impl Retiling {
    /// In the usual way of cutting and joining.
    pub const ADAPTIVE: Self = Self { how: Retile::Adaptive { max_bodies: 48_000 }, every: 32 };

    /// As often as is usual where borders move.
    pub const BISECTED: Self = Self { how: Retile::Bisected, every: 24 };
}

impl Default for OutputConfig {
    fn default() -> Self {
        Self { record_every: None, checkpoint_every: None, log_every: 10 }
    }
}

impl Config {
    /// What is usual for a scene.
    pub(super) fn usual(kind: SceneKind) -> Self {
        let (run, output) = (RunConfig::default(), OutputConfig::default());
        let params = kind.usual_params();
        Self { scene: SceneSpec::usual(kind), run, params, output }
    }

    /// The files that its scene is read from, if they are open.
    pub(crate) fn scene_files(&self) -> Vec<PathBuf> {
        let SceneKind::File(spec) = &self.scene.kind else { return Vec::new() };
        spec.file().iter().flat_map(|file| file.paths()).map(Path::to_owned).collect()
    }

    /// Steps in a second.
    pub fn hertz(&self) -> f64 {
        f64::from(forms::hertz(self.params.dt))
    }

    /// The transport that was chosen, or the one that suits the number of ranks.
    pub fn transport(&self) -> TransportKind {
        let suitable = if self.run.ranks == 1 { TransportKind::Local } else { TransportKind::Channel };
        self.run.transport.unwrap_or(suitable)
    }
}
