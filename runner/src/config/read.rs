//! Reading a configuration, and refusing what cannot be.

use super::error::{ConfigError, Given, Origin};
use super::keys::{self, KEYS};
use super::sections::{Config, TransportKind};
use super::settings::{Override, Settings};
use crate::scene::{self, SceneKind};
use crate::wording::unmarked;
use atoll_core::SetupError;
use std::path::Path;
use toml::{Table, Value};

impl Config {
    /// Reads a configuration file.
    pub fn load(path: &Path, overrides: &[Override]) -> Result<Self, ConfigError> {
        let (file, text) = read_file(path)?;
        if scene::file::is_scene(&text) {
            return Self::load_scene(path, overrides);
        }
        Self::read(&file, &text, overrides, Readers::new(false))
    }

    /// What is usual for a scene in files, read from the file of that scene itself.
    fn load_scene(path: &Path, overrides: &[Override]) -> Result<Self, ConfigError> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let scene = [("kind", Value::from(SceneKind::FILE)), ("path", Value::from(name.as_ref()))];
        let scene: Table = scene.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        let text = Table::from_iter([("scene".to_owned(), Value::Table(scene))]).to_string();
        Self::read(&path.display().to_string(), &text, overrides, Readers::new(false))
    }

    /// Reads the configuration of a run that was begun somewhere, perhaps on a transport that this program lacks.
    pub fn load_begun(path: &Path) -> Result<Self, ConfigError> {
        let (file, text) = read_file(path)?;
        Self::read(&file, &text, &[], Readers::new(true))
    }

    /// As [`load_begun`](Self::load_begun), from text. `name` stands for it in errors.
    pub(crate) fn from_begun_str(name: &str, text: &str) -> Result<Self, ConfigError> {
        Self::read(name, text, &[], Readers::new(true))
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
        Self::read(name, text, &overrides, Readers::new(false))
    }

    /// All keys, in the order of their table.
    pub(super) fn read(
        name: &str,
        text: &str,
        overrides: &[Override],
        Readers { has, is_begun }: Readers,
    ) -> Result<Self, ConfigError> {
        let mut settings = Settings::new(name, text, overrides, keys::names())?;
        settings.is_begun = is_begun;
        // Whatever stands here, the scene, which is the first key, replaces it by what is usual for it.
        let mut config = Self::usual(SceneKind::Stack);
        KEYS.iter().try_for_each(|key| key.read(&mut settings, &mut config))?;
        check(&config, &settings, has)?;
        settings.finish(|key| match key {
            "run.max_bodies" => "tiles that are bisected have as much to do as each other; leave it out".to_owned(),
            "run.tile_count" => "goes with tiles = \"bisected\" alone: say that, or leave it out".to_owned(),
            key if key.starts_with("scene.") => format!("scenes of this kind have no {key}; leave it out"),
            _ => "tiles stay as they are here; add tiles = \"bisected\" or \"adaptive\", or leave it out".to_owned(),
        })?;
        Ok(config)
    }
}

/// Who reads a configuration.
pub(super) struct Readers {
    /// Which transports will do.
    has: fn(TransportKind) -> bool,
    /// Whether the run was begun before, and is only to be known.
    is_begun: bool,
}

impl Readers {
    pub(super) fn new(is_begun: bool) -> Self {
        Self { has: if is_begun { |_| true } else { TransportKind::is_built_in }, is_begun }
    }
}

/// A file's name as errors call it, and its text.
fn read_file(path: &Path) -> Result<(String, String), ConfigError> {
    let file = path.display().to_string();
    match std::fs::read_to_string(path) {
        Ok(text) => Ok((file, unmarked(text))),
        Err(error) => Err(ConfigError::Read { file, reason: error.to_string() }),
    }
}

/// Refuses what does not go together, and what the physics cannot compute with.
fn check(config: &Config, settings: &Settings, has: fn(TransportKind) -> bool) -> Result<(), ConfigError> {
    if let Some(kind) = config.run.transport {
        let given = || settings.given("run.transport").expect("nobody else chooses one").clone();
        if !has(kind) {
            return Err(ConfigError::NotBuiltIn { given: given(), feature: kind.name() });
        }
        let ranks = config.run.ranks;
        if kind == TransportKind::Local && ranks > 1 {
            let reason = format!("one rank at most, and this run has {ranks}; use transport channel, or ranks 1");
            return Err(ConfigError::Inapplicable { given: given(), reason });
        }
    }
    check_params(config, settings)
}

/// Refuses what the physics cannot compute with.
pub(super) fn check_params(config: &Config, settings: &Settings) -> Result<(), ConfigError> {
    config.params.check().map_err(|error| refused_param(settings, error))
}

/// The core's refusal of a parameter, in terms of the key that gave it.
fn refused_param(settings: &Settings, error: SetupError) -> ConfigError {
    let (name, value, must) = match error {
        SetupError::FrozenSubsteps if settings.given("physics.ghosts").is_some() => {
            let default = if settings.given("physics.exchange").is_none() { ", the default of this scene" } else { "" };
            let must = format!("\"dynamic\" with exchange = \"substep\"{default}; or use exchange = \"step\"");
            return settings.refusal("physics.ghosts", must);
        }
        SetupError::BadParam { name: "dt", value, must } => ("hertz", 1.0 / value, must),
        SetupError::BadParam { name, value, must } => (name, value, must),
        other => unreachable!("parameters are refused as parameters, not with: {other}"),
    };
    let key = format!("physics.{name}");
    if settings.given(&key).is_some() {
        return settings.refusal(&key, must);
    }
    // A default that does not suit something else that was given.
    let given = Given { origin: Origin::Default, key, value: value.to_string() };
    ConfigError::BadValue { given, must: must.to_owned(), suggestion: None }
}
