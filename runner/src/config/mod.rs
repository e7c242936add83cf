//! What to run: the scene, the physics, and how to spread it. Read from TOML, with the command line winning over it.
//!
//! To add a key, name it in `keys.rs`, read it in `Config::read`, and give it out again in `Config::entries`; anything
//! not named there is refused.

mod difference;
mod error;
mod keys;
mod resolved;
mod scene;
mod settings;
#[cfg(test)]
mod tests;
mod words;

pub use difference::{Difference, differences, other_run};
pub use error::{ConfigError, OneLine, Origin, Place};
pub use resolved::{identity, is_resolved};
pub use settings::Override;

use crate::scene::{SceneKind, SceneSpec};
use atoll_core::{Params, SetupError};
use settings::Settings;
use std::path::Path;
use std::time::Duration;

/// More tiles along an axis cannot be named in 32 bits for both.
pub(crate) const MOST_TILES: u32 = 65_535;

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
    /// Threads of each rank.
    pub threads: usize,
    /// What carries bytes between ranks; `None` chooses by their number.
    pub transport: Option<TransportKind>,
    /// Columns and rows of tiles; `None` chooses by scene and physics, never by ranks or threads.
    pub tiles: Option<[u32; 2]>,
    /// A rank that stays silent for so long is given up.
    pub peer_timeout: Duration,
    /// How ranks exchange messages with transport mpi.
    pub mpi_exchange: MpiExchange,
}

/// `[output]`: of runs that were given a folder for it.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct OutputConfig {
    /// The bodies are recorded every so many steps; `None` records nothing.
    pub record_every: Option<u64>,
    /// A snapshot to go on from is written every so many steps; `None` writes none.
    pub checkpoint_every: Option<u64>,
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

impl Config {
    /// Reads a configuration file.
    pub fn load(path: &Path, overrides: &[Override]) -> Result<Self, ConfigError> {
        let (file, text) = read_file(path)?;
        Self::read(&file, &text, overrides, TransportKind::is_built_in)
    }

    /// Reads the configuration of a run that was begun somewhere, perhaps on a transport that this program lacks.
    pub fn load_begun(path: &Path) -> Result<Self, ConfigError> {
        let (file, text) = read_file(path)?;
        Self::read(&file, &text, &[], |_| true)
    }

    /// Reads a configuration from text. `name` stands for it in errors; `overrides` are keys and values as after
    /// `--set`.
    ///
    /// ```
    /// let text = "[scene]\nkind = \"rooms\"\nbodies = 1000\n";
    /// let config = atoll::Config::from_toml_str("example", text, &[("ranks", "2"), ("steps", "10")])?;
    /// assert_eq!((config.run.ranks, config.run.steps), (2, 10));
    /// # Ok::<(), atoll::config::ConfigError>(())
    /// ```
    pub fn from_toml_str(name: &str, text: &str, overrides: &[(&str, &str)]) -> Result<Self, ConfigError> {
        let overrides: Vec<Override> = overrides.iter().map(|(key, value)| Override::set(key, value)).collect();
        Self::read(name, text, &overrides, TransportKind::is_built_in)
    }

    /// The keys in the order of the documentation. `has` says which transports will do.
    fn read(
        name: &str,
        text: &str,
        overrides: &[Override],
        has: fn(TransportKind) -> bool,
    ) -> Result<Self, ConfigError> {
        let mut settings = Settings::new(name, text, overrides)?;
        let scene = scene::read(&mut settings)?;
        let run = read_run(&mut settings, has)?;
        let params = read_params(&mut settings, scene.kind)?;
        let output = read_output(&mut settings)?;
        settings.finish(|key| format!("scenes of this kind have no {key}; leave it out"))?;
        Ok(Self { scene, run, params, output })
    }

    /// The transport that was chosen, or the one that suits the number of ranks.
    pub fn transport(&self) -> TransportKind {
        let suitable = if self.run.ranks == 1 { TransportKind::Local } else { TransportKind::Channel };
        self.run.transport.unwrap_or(suitable)
    }
}

/// A file's name as errors call it, and its text.
fn read_file(path: &Path) -> Result<(String, String), ConfigError> {
    let file = path.display().to_string();
    match std::fs::read_to_string(path) {
        Ok(text) => Ok((file, text)),
        Err(error) => Err(ConfigError::Read { file, reason: error.to_string() }),
    }
}

fn read_run(settings: &mut Settings, has: fn(TransportKind) -> bool) -> Result<RunConfig, ConfigError> {
    let steps = settings.integer("run.steps", 1..=u64::from(u32::MAX), 600)?;
    let threads = settings.integer("run.threads", 1..=1024, 1)? as usize;
    let ranks_asked_for = settings.place("run.ranks").is_some_and(|place| !matches!(place.origin, Origin::File(_)));
    let transport = settings.choice("run.transport", words::TRANSPORT)?;
    if let Some(kind) = transport.filter(|&kind| !has(kind)) {
        let place = settings.place("run.transport").expect("it was given").clone();
        return Err(ConfigError::NotBuiltIn { place, feature: kind.name() });
    }
    // Those of a cluster are for its launcher to limit.
    let most_ranks = if transport == Some(TransportKind::Mpi) { u64::from(u32::MAX) } else { 1024 };
    let ranks = settings.integer("run.ranks", 1..=most_ranks, 1)? as usize;
    if transport == Some(TransportKind::Local) && ranks > 1 {
        let place = settings.place("run.transport").expect("it was given").clone();
        let reason = format!("one rank at most, and this run has {ranks}; use transport channel, or ranks 1");
        return Err(ConfigError::Inapplicable { place, reason });
    }
    let tiles = settings.tiles("run.tiles", MOST_TILES)?;
    let peer_timeout = Duration::from_secs_f64(settings.number("run.peer_timeout", 0.001..=1e6, 30.0)?);
    let mpi_exchange = settings.choice("run.mpi_exchange", words::MPI_EXCHANGE)?.unwrap_or_default();
    Ok(RunConfig { steps, ranks, ranks_asked_for, threads, transport, tiles, peer_timeout, mpi_exchange })
}

fn read_params(settings: &mut Settings, scene: SceneKind) -> Result<Params, ConfigError> {
    let usual = scene.usual_params();
    let whole = 0..=u64::from(u32::MAX);
    let params = Params {
        dt: 1.0 / settings.float("physics.hertz", 60.0)?,
        substeps: settings.integer("physics.substeps", whole.clone(), usual.substeps.into())? as u32,
        gravity: settings.pair("physics.gravity", usual.gravity.to_array())?.into(),
        linear_damping: settings.float("physics.linear_damping", usual.linear_damping)?,
        angular_damping: settings.float("physics.angular_damping", usual.angular_damping)?,
        max_linear_speed: settings.float("physics.max_linear_speed", usual.max_linear_speed)?,
        max_angular_speed: settings.float("physics.max_angular_speed", usual.max_angular_speed)?,
        contact_hertz: settings.float("physics.contact_hertz", usual.contact_hertz)?,
        contact_damping_ratio: settings.float("physics.contact_damping_ratio", usual.contact_damping_ratio)?,
        push_out_speed: settings.float("physics.push_out_speed", usual.push_out_speed)?,
        speculative_distance: settings.float("physics.speculative_distance", usual.speculative_distance)?,
        recycle_distance: settings.float("physics.recycle_distance", usual.recycle_distance)?,
        restitution_threshold: settings.float("physics.restitution_threshold", usual.restitution_threshold)?,
        margin_floor: settings.float("physics.margin_floor", usual.margin_floor)?,
        margin_cap: settings.float("physics.margin_cap", usual.margin_cap)?,
        sort_interval: settings.integer("physics.sort_interval", whole.clone(), usual.sort_interval.into())? as u32,
        exchange: settings.choice("physics.exchange", words::EXCHANGE)?.unwrap_or(usual.exchange),
        broad_phase: settings.choice("physics.broad_phase", words::BROAD_PHASE)?.unwrap_or(usual.broad_phase),
        solver: settings.choice("physics.solver", words::SOLVER)?.unwrap_or(usual.solver),
        iterations: settings.integer("physics.iterations", whole, usual.iterations.into())? as u32,
        baumgarte: settings.float("physics.baumgarte", usual.baumgarte)?,
        linear_slop: settings.float("physics.linear_slop", usual.linear_slop)?,
        island_search: settings.choice("physics.islands", words::ISLANDS)?.unwrap_or(usual.island_search),
        parallel: settings.choice("physics.parallel", words::PARALLEL)?.unwrap_or(usual.parallel),
        ghosts: settings.choice("physics.ghosts", words::GHOSTS)?.unwrap_or(usual.ghosts),
        sleep: settings.flag("physics.sleep", usual.sleep)?,
        sleep_speed: settings.float("physics.sleep_speed", usual.sleep_speed)?,
        sleep_time: settings.float("physics.sleep_time", usual.sleep_time)?,
    };
    params.check().map_err(|error| refused_param(settings, error))?;
    Ok(params)
}

fn read_output(settings: &mut Settings) -> Result<OutputConfig, ConfigError> {
    let mut every = |key| settings.optional_integer(key, 1..=u64::from(u32::MAX));
    Ok(OutputConfig {
        record_every: every("output.record_every")?,
        checkpoint_every: every("output.checkpoint_every")?,
    })
}

/// The core's refusal of a parameter, in terms of the key that gave it.
fn refused_param(settings: &Settings, error: SetupError) -> ConfigError {
    let (name, value, must) = match error {
        SetupError::FrozenSubsteps if settings.place("physics.ghosts").is_some() => {
            let default = if settings.place("physics.exchange").is_none() { ", the default of this scene" } else { "" };
            let must = format!("\"dynamic\" with exchange = \"substep\"{default}; or use exchange = \"step\"");
            return settings.refusal("physics.ghosts", must);
        }
        SetupError::BadParam { name: "dt", value, must } => ("hertz", 1.0 / value, must),
        SetupError::BadParam { name, value, must } => (name, value, must),
        other => unreachable!("parameters are refused as parameters, not with: {other}"),
    };
    let key = format!("physics.{name}");
    if settings.place(&key).is_some() {
        return settings.refusal(&key, must);
    }
    // A default that does not suit something else that was given.
    let place = Place { origin: Origin::Default, key, value: value.to_string() };
    ConfigError::BadValue { place, must: must.to_owned(), suggestion: None }
}
