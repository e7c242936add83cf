//! The table of all keys: how each is called, whether results depend on it, where its value is kept and what it may be.
//!
//! All else follows from it: how a configuration is read and written, the text that its hash is of, the order of both, and what
//! a misspelt key may have meant. To add a key, add a field to what keeps it ([`super::sections`], [`Params`] or [`SceneKind`]),
//! with its default, and a line here.
//!
//! [`Params`]: atoll_core::Params

use super::error::ConfigError;
use super::forms::{
    Flag, Float, Form, Hertz, MaxBodies, Number, OptionalWhole, OptionalWord, Pair, Ranks, Seconds, Threads, TileCount,
    Tiles, Whole, Word,
};
use super::scene_forms::{SceneBodies, SceneDigest, ScenePath, SceneWord};
use super::sections::Config;
use super::settings::Settings;
use super::words;
use crate::scene::SceneKind;
use Concern::{How, What};
use toml::Value;

/// What a key is about.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Concern {
    /// What is computed: results depend on it.
    What,
    /// How it is computed, or what is written meanwhile: it changes no bit of a result.
    How,
}

/// A key.
pub(super) struct Key {
    /// Its full path.
    pub(super) name: &'static str,
    /// Whether results depend on it.
    pub(super) concern: Concern,
    value: &'static dyn Form,
}

impl Key {
    /// Takes its value, if it was given.
    pub(super) fn read(&self, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        self.value.read(self.name, settings, config)
    }

    /// Its value as a file would say it; none where there is nothing to say. The configuration stays as it is.
    pub(super) fn write(&self, config: &mut Config) -> Option<Value> {
        self.value.write(config)
    }
}

const fn key(name: &'static str, concern: Concern, value: &'static dyn Form) -> Key {
    Key { name, concern, value }
}

/// More bodies than this are taken for a slip of the finger.
pub(super) const MOST_BODIES: u64 = 10_000_000_000;

/// Steps are counted in 32 bits where they are recorded.
const MOST_STEPS: u64 = u32::MAX as u64;

/// Every key there is, in the order of the documentation.
pub(super) static KEYS: &[Key] = &[
    key("scene.kind", What, &SceneWord),
    key("scene.path", How, &ScenePath),
    key("scene.digest", What, &SceneDigest),
    key("scene.bodies", What, &SceneBodies),
    key("scene.seed", What, &Whole(seed, |_| 0..=i64::MAX as u64)),
    key("scene.power", What, &Number(power, 0.1..=10.0)),
    key("scene.jitter", What, &Number(jitter, 0.0..=0.25)),
    key("scene.base", What, &Whole(base, |_| 2..=100)),
    key("scene.angle", What, &Number(angle, 0.0..=60.0)),
    key("scene.friction", What, &Number(friction, 0.0..=2.0)),
    key("run.steps", What, &Whole(|c| Some(&mut c.run.steps), |_| 1..=MOST_STEPS)),
    key("run.ranks", How, &Ranks),
    key("run.threads", How, &Threads),
    key("run.transport", How, &OptionalWord(|c| &mut c.run.transport, words::TRANSPORT)),
    key("run.tiles", What, &Tiles),
    key("run.max_bodies", What, &MaxBodies),
    key("run.tile_count", What, &TileCount),
    key("run.retile_every", What, &Whole(retile_every, |_| 1..=MOST_STEPS)),
    key("run.peer_timeout", How, &Seconds(|c| &mut c.run.peer_timeout, 0.001..=1e6)),
    key("run.instructions", How, &Word(|c| &mut c.params.instructions, words::INSTRUCTIONS)),
    key("run.mpi_exchange", How, &Word(|c| &mut c.run.mpi_exchange, words::MPI_EXCHANGE)),
    key("run.balance", How, &Word(|c| &mut c.run.balance, words::BALANCE)),
    // Of numbers without bounds here, the physics checks them.
    key("physics.hertz", What, &Hertz),
    key("physics.substeps", What, &Whole(|c| Some(&mut c.params.substeps), |_| 0..=u64::from(u32::MAX))),
    key("physics.gravity", What, &Pair(|c| &mut c.params.gravity)),
    key("physics.linear_damping", What, &Float(|c| &mut c.params.linear_damping)),
    key("physics.angular_damping", What, &Float(|c| &mut c.params.angular_damping)),
    key("physics.max_linear_speed", What, &Float(|c| &mut c.params.max_linear_speed)),
    key("physics.max_angular_speed", What, &Float(|c| &mut c.params.max_angular_speed)),
    key("physics.contact_hertz", What, &Float(|c| &mut c.params.contact_hertz)),
    key("physics.contact_damping_ratio", What, &Float(|c| &mut c.params.contact_damping_ratio)),
    key("physics.push_out_speed", What, &Float(|c| &mut c.params.push_out_speed)),
    key("physics.speculative_distance", What, &Float(|c| &mut c.params.speculative_distance)),
    key("physics.recycle_distance", What, &Float(|c| &mut c.params.recycle_distance)),
    key("physics.restitution_threshold", What, &Float(|c| &mut c.params.restitution_threshold)),
    key("physics.margin_floor", What, &Float(|c| &mut c.params.margin_floor)),
    key("physics.margin_cap", What, &Float(|c| &mut c.params.margin_cap)),
    key("physics.sort_interval", What, &Whole(|c| Some(&mut c.params.sort_interval), |_| 0..=u64::from(u32::MAX))),
    key("physics.broad_phase", How, &Word(|c| &mut c.params.broad_phase, words::BROAD_PHASE)),
    key("physics.solver", What, &Word(|c| &mut c.params.solver, words::SOLVER)),
    key("physics.iterations", What, &Whole(|c| Some(&mut c.params.iterations), |_| 0..=u64::from(u32::MAX))),
    key("physics.baumgarte", What, &Float(|c| &mut c.params.baumgarte)),
    key("physics.linear_slop", What, &Float(|c| &mut c.params.linear_slop)),
    key("physics.islands", How, &Word(|c| &mut c.params.island_search, words::ISLANDS)),
    key("physics.parallel", How, &Word(|c| &mut c.params.parallel, words::PARALLEL)),
    key("physics.exchange", What, &Word(|c| &mut c.params.exchange, words::EXCHANGE)),
    key("physics.ghosts", What, &Word(|c| &mut c.params.ghosts, words::GHOSTS)),
    key("physics.sleep", What, &Flag(|c| &mut c.params.sleep)),
    key("physics.sleep_speed", What, &Float(|c| &mut c.params.sleep_speed)),
    key("physics.sleep_time", What, &Float(|c| &mut c.params.sleep_time)),
    key("output.record_every", How, &OptionalWhole(|c| &mut c.output.record_every, 1..=MOST_STEPS)),
    key("output.checkpoint_every", How, &OptionalWhole(|c| &mut c.output.checkpoint_every, 1..=MOST_STEPS)),
    key("output.log_every", How, &Whole(|c| Some(&mut c.output.log_every), |_| 1..=MOST_STEPS)),
];

// What only some tilings and scenes have.

fn retile_every(config: &mut Config) -> Option<&mut u64> {
    config.run.retiling.as_mut().map(|retiling| &mut retiling.every)
}

fn seed(config: &mut Config) -> Option<&mut u64> {
    if let SceneKind::File(_) = config.scene.kind { None } else { Some(&mut config.scene.seed) }
}

fn power(config: &mut Config) -> Option<&mut f64> {
    if let SceneKind::Rooms { power } = &mut config.scene.kind { Some(power) } else { None }
}

fn jitter(config: &mut Config) -> Option<&mut f64> {
    if let SceneKind::Pile { jitter } = &mut config.scene.kind { Some(jitter) } else { None }
}

fn base(config: &mut Config) -> Option<&mut u64> {
    if let SceneKind::Pyramids { base } = &mut config.scene.kind { Some(base) } else { None }
}

fn angle(config: &mut Config) -> Option<&mut f64> {
    if let SceneKind::Slope { angle, .. } = &mut config.scene.kind { Some(angle) } else { None }
}

fn friction(config: &mut Config) -> Option<&mut f64> {
    if let SceneKind::Slope { friction, .. } = &mut config.scene.kind { Some(friction) } else { None }
}

/// The names of all keys, in the order of the documentation.
pub(super) fn names() -> impl Iterator<Item = &'static str> + Clone {
    KEYS.iter().map(|key| key.name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// Everything that a configuration keeps, a line for each figure, as `Debug` tells it.
    fn kept(config: &Config) -> Vec<String> {
        format!("{config:#?}").lines().map(|line| line.trim().to_owned()).collect()
    }

    fn config(kind: &str, overrides: &[(&str, &str)]) -> Config {
        let text = format!("[scene]\nkind = \"{kind}\"\n");
        Config::from_toml_str("test", &text, overrides).unwrap()
    }

    #[test]
    fn names_are_in_sections_and_told_once() {
        for key in KEYS {
            let (section, name) = key.name.split_once('.').unwrap();
            assert!(["scene", "run", "physics", "output"].contains(&section) && !name.contains('.'), "{}", key.name);
            assert!(section != "output" || key.concern == How, "{}", key.name);
        }
        assert_eq!(names().collect::<BTreeSet<_>>().len(), KEYS.len());
    }

    /// Whoever adds a field and forgets its key is told here: some other value of each key changes a figure of its own, and
    /// no figure is left that none changes.
    #[test]
    fn every_figure_that_a_configuration_keeps_has_a_key() {
        let others = [
            ("run.steps", "7"),
            ("run.ranks", "2"),
            ("run.threads", "3"),
            ("run.transport", "channel"),
            ("run.tiles", "[4, 5]"),
            ("run.peer_timeout", "2.5"),
            ("run.instructions", "portable"),
            ("run.mpi_exchange", "sparse"),
            ("run.balance", "off"),
            ("physics.gravity", "[1, -9]"),
            ("physics.broad_phase", "quadtree"),
            ("physics.solver", "pgs"),
            ("physics.islands", "dfs"),
            ("physics.parallel", "serial"),
            ("physics.exchange", "substep"),
            ("physics.ghosts", "frozen"),
            ("physics.sleep", "true"),
            ("physics.baumgarte", "0.5"),
            ("physics.margin_floor", "0.07"),
            ("physics.margin_cap", "0.7"),
        ];
        let usual = config("rooms", &[("max_bodies", "9")]);
        let (mut changed, before) = (BTreeSet::new(), kept(&usual));
        // A number of tiles does not go with what they have at most; it is kept where columns and rows are.
        let keys = KEYS.iter().filter(|key| !key.name.starts_with("scene.") && key.name != "run.tile_count");
        for key in keys {
            let value = others.iter().find(|(name, _)| *name == key.name).map_or("11", |(_, value)| value);
            let other = config("rooms", &[("max_bodies", "9"), (key.name, value)]);
            assert_ne!(usual, other, "{} changes nothing", key.name);
            let after = kept(&other);
            // Options and pairs take more lines; the first that differs names the field.
            let first = before.iter().zip(&after).position(|(a, b)| a != b).unwrap();
            assert!(changed.insert(first), "{} changes the figure of another key: {}", key.name, before[first]);
        }
        let start = before.iter().position(|line| line.starts_with("run:")).unwrap();
        let is_figure = |line: &str| line.split_once(": ").is_some_and(|(_, value)| !value.ends_with(['{', '(']));
        let forgotten: Vec<_> = (start..before.len())
            .filter(|at| is_figure(&before[*at]) && !changed.contains(at))
            .map(|at| before[at].as_str())
            .collect();
        // Where the number of ranks comes from is part of that key, and which bodies are large is taken from the scene.
        assert_eq!(forgotten, ["ranks_asked_for: false,", "large_radius: inf,"]);
    }
}
