//! Options that give values of a configuration, for every verb that runs one.

use crate::config::{ConfigError, Override};
use clap::Args;

/// Values of a configuration that win over the file's.
#[derive(Default, Debug, Args)]
pub struct ValueArgs {
    /// Ranks that share the tiles [default: the configuration's, else 1].
    #[arg(long, value_name = "N")]
    pub ranks: Option<String>,
    /// Threads of each rank [default: the configuration's, else auto].
    #[arg(long, value_name = "T")]
    pub threads: Option<String>,
    /// What carries bytes between ranks: local, channel, iceoryx2 or mpi [default: local for one rank, else channel].
    #[arg(long, value_name = "NAME")]
    pub transport: Option<String>,
    /// Dynamic bodies.
    #[arg(long, value_name = "N")]
    pub bodies: Option<String>,
    /// Steps to make.
    #[arg(long, value_name = "S")]
    pub steps: Option<String>,
    /// Chooses among the random variants of the scene.
    #[arg(long, value_name = "N")]
    pub seed: Option<String>,
    /// Any key of the configuration, by its full path or an unambiguous last part; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Give up a rank that stays silent for so long.
    #[arg(long, value_name = "SECONDS")]
    pub peer_timeout: Option<String>,
}

impl ValueArgs {
    /// The values that win over the file's. An option of its own wins over `--set`.
    ///
    /// # Errors
    /// On a `--set` without an equals sign.
    pub fn overrides(&self) -> Result<Vec<Override>, ConfigError> {
        let mut overrides = self.set.iter().map(|text| Override::parse(text)).collect::<Result<Vec<_>, _>>()?;
        overrides.extend(given(&self.options()));
        Ok(overrides)
    }

    /// The first of these options that was given, if any was.
    pub fn first(&self) -> Option<&'static str> {
        let set = (!self.set.is_empty()).then_some("--set");
        set.or_else(|| self.options().iter().find_map(|(option, _, value)| value.as_ref().map(|_| *option)))
    }

    fn options(&self) -> [Given<'_>; 7] {
        [
            ("--ranks", "run.ranks", &self.ranks),
            ("--threads", "run.threads", &self.threads),
            ("--transport", "run.transport", &self.transport),
            ("--bodies", "scene.bodies", &self.bodies),
            ("--steps", "run.steps", &self.steps),
            ("--seed", "scene.seed", &self.seed),
            ("--peer-timeout", "run.peer_timeout", &self.peer_timeout),
        ]
    }
}

/// An option, the key it gives a value to, and the value if there is one.
pub(super) type Given<'a> = (&'static str, &'static str, &'a Option<String>);

/// Those that have a value.
pub(super) fn given(options: &[Given<'_>]) -> impl Iterator<Item = Override> {
    options.iter().filter_map(|(option, key, value)| Some(Override::option(option, key, value.as_ref()?)))
}

/// How many times as fast as real time.
pub(super) fn times(text: &str) -> Result<f64, &'static str> {
    let times = text.parse().ok().filter(|times: &f64| (1e-3..=1e6).contains(times));
    times.ok_or("must be seconds of the world in one, from 0.001 to 1e6")
}
