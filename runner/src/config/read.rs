//! Reading a configuration, and refusing what cannot be.

use super::error::{ConfigError, Given, Origin};
use super::keys::{self, KEYS};
use super::sections::{Config, TransportKind};
use super::settings::{Override, Settings};
use crate::scene::SceneKind;
use atoll_core::SetupError;
use std::path::Path;

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

    /// As [`load_begun`](Self::load_begun), from text. `name` stands for it in errors.
    pub(crate) fn from_begun_str(name: &str, text: &str) -> Result<Self, ConfigError> {
        Self::read(name, text, &[], |_| true)
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

    /// All keys, in the order of their table. `has` says which transports will do.
    pub(super) fn read(
        name: &str,
        text: &str,
        overrides: &[Override],
        has: fn(TransportKind) -> bool,
    ) -> Result<Self, ConfigError> {
        let mut settings = Settings::new(name, text, overrides, keys::names())?;
        // Whatever stands here, the scene, which is the first key, replaces it by what is usual for it.
        let mut config = Self::usual(SceneKind::Stack);
        KEYS.iter().try_for_each(|key| key.read(&mut settings, &mut config))?;
        check(&config, &settings, has)?;
        settings.finish(|key| match key.starts_with("scene.") {
            true => format!("scenes of this kind have no {key}; leave it out"),
            false => "tiles stay as they are here; add tiles = \"adaptive\", or leave it out".to_owned(),
        })?;
        Ok(config)
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
