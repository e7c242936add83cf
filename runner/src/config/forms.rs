//! Forms of values: how each is read from what was given and written again. [`super::keys`] says which key has which.

use super::error::{ConfigError, Origin};
use super::sections::{Config, MOST_THREADS, MOST_TILES, Retile, Retiling, TransportKind};
use super::settings::{Settings, TilesChoice};
use super::words::{self, Words, word_for};
use crate::wording::shortest;
use glam::Vec2;
use std::ops::RangeInclusive;
use std::time::Duration;
use toml::Value;

/// The form of a value. It is kept in one field, which a function finds in a configuration.
pub(super) trait Form: Sync {
    /// Takes what was given for `key`, if anything was; else what there is stays.
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError>;

    /// What a file would say; none where there is nothing to say. The configuration stays as it is.
    fn write(&self, config: &mut Config) -> Option<Value>;
}

/// Where a value is kept.
type Field<T> = fn(&mut Config) -> &mut T;

/// Where a value is kept that only some scenes have.
type FieldIfAny<T> = fn(&mut Config) -> Option<&mut T>;

/// A number whose bounds the physics checks.
pub(super) struct Float(pub(super) Field<f32>);

impl Form for Float {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        keep(settings.float(key)?, (self.0)(config));
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        Some(float(*(self.0)(config)))
    }
}

/// A number within bounds.
pub(super) struct Number(pub(super) FieldIfAny<f64>, pub(super) RangeInclusive<f64>);

impl Form for Number {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        if let Some(field) = (self.0)(config) {
            keep(settings.number(key, self.1.clone())?, field);
        }
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        (self.0)(config).map(|number| (*number).into())
    }
}

/// A whole number within bounds, which may follow from what stands before it in the table, and which its type can hold.
pub(super) struct Whole<T>(pub(super) FieldIfAny<T>, pub(super) fn(&Config) -> RangeInclusive<u64>);

impl<T: Copy + TryFrom<u64> + TryInto<u64>> Form for Whole<T> {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        let range = (self.1)(config);
        if let Some(field) = (self.0)(config) {
            let given = settings.integer(key, range)?;
            keep(given.and_then(|number| number.try_into().ok()), field);
        }
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        (self.0)(config).and_then(|number| (*number).try_into().ok()).map(whole)
    }
}

/// A whole number that need not be there.
pub(super) struct OptionalWhole(pub(super) Field<Option<u64>>, pub(super) RangeInclusive<u64>);

impl Form for OptionalWhole {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        *(self.0)(config) = settings.integer(key, self.1.clone())?;
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        (self.0)(config).map(whole)
    }
}

/// One of some words.
pub(super) struct Word<T: 'static>(pub(super) Field<T>, pub(super) Words<T>);

impl<T: Copy + PartialEq + Sync> Form for Word<T> {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        keep(settings.choice(key, self.1)?, (self.0)(config));
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        Some(word_for(self.1, *(self.0)(config)).into())
    }
}

/// One of some words, or none.
pub(super) struct OptionalWord<T: 'static>(pub(super) Field<Option<T>>, pub(super) Words<T>);

impl<T: Copy + PartialEq + Sync> Form for OptionalWord<T> {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        *(self.0)(config) = settings.choice(key, self.1)?;
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        (self.0)(config).map(|value| word_for(self.1, value).into())
    }
}

/// True or false.
pub(super) struct Flag(pub(super) Field<bool>);

impl Form for Flag {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        keep(settings.flag(key)?, (self.0)(config));
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        Some((*(self.0)(config)).into())
    }
}

/// Two numbers.
pub(super) struct Pair(pub(super) Field<Vec2>);

impl Form for Pair {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        keep(settings.pair(key)?.map(Vec2::from), (self.0)(config));
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        Some((self.0)(config).to_array().map(float).to_vec().into())
    }
}

/// A length of time.
pub(super) struct Seconds(pub(super) Field<Duration>, pub(super) RangeInclusive<f64>);

impl Form for Seconds {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        keep(settings.number(key, self.1.clone())?.map(Duration::from_secs_f64), (self.0)(config));
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        Some((self.0)(config).as_secs_f64().into())
    }
}

/// The fewest steps in a second.
const LEAST_HERTZ: f32 = 0.001;

/// Steps in a second, of which the inverse is kept.
pub(super) struct Hertz;

impl Form for Hertz {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        let hertz = settings.float(key)?;
        // The physics tells of others that cannot be. In longer steps everybody comes by everybody.
        if hertz.is_some_and(|hertz| (0.0..LEAST_HERTZ).contains(&hertz)) {
            return Err(settings.refusal(key, format!("positive and finite, and at least {LEAST_HERTZ}")));
        }
        keep(hertz.map(f32::recip), &mut config.params.dt);
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        Some(float(hertz(config.params.dt)))
    }
}

/// How many ranks, and whether that was asked for on the command line.
pub(super) struct Ranks;

impl Form for Ranks {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        // Those of a cluster are for its launcher to limit.
        let transport = settings.choice("run.transport", words::TRANSPORT)?;
        let most = if transport == Some(TransportKind::Mpi) { u64::from(u32::MAX) } else { 1024 };
        keep(settings.integer(key, 1..=most)?.map(|ranks| ranks as usize), &mut config.run.ranks);
        let is_asked = |origin: &Origin| !matches!(origin, Origin::File(_));
        config.run.ranks_asked_for = settings.given(key).is_some_and(|given| is_asked(&given.origin));
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        Some(whole(config.run.ranks as u64))
    }
}

/// Threads of each rank, if they are chosen.
pub(super) struct Threads;

impl Form for Threads {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        config.run.threads = settings.threads(key, MOST_THREADS)?;
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        Some(config.run.threads.map_or_else(|| "auto".into(), |threads| whole(threads as u64)))
    }
}

/// Columns and rows of tiles, if they are chosen, or that they follow the bodies.
pub(super) struct Tiles;

impl Form for Tiles {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        match settings.tiles(key, MOST_TILES)? {
            Some(TilesChoice::Adaptive) => config.run.retiling = Some(Retiling::ADAPTIVE),
            Some(TilesChoice::Bisected) => config.run.retiling = Some(Retiling::BISECTED),
            Some(TilesChoice::Counts(counts)) => config.run.tiles = Some(counts),
            Some(TilesChoice::Auto) | None => {}
        }
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        if config.run.is_bisected() {
            return Some("bisected".into());
        }
        config.run.tiles.map(|tiles| tiles.map(Value::from).to_vec().into())
    }
}

/// How many bodies a tile has at most: says that tiles follow the bodies, whatever squares they are cut from.
pub(super) struct MaxBodies;

impl Form for MaxBodies {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        if !config.run.is_bisected()
            && let Some(max_bodies) = settings.integer(key, 1..=u64::from(u32::MAX))?
        {
            config.run.retiling.get_or_insert(Retiling::ADAPTIVE).how = Retile::Adaptive { max_bodies };
        }
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        config.run.max_bodies().map(whole)
    }
}

/// How many tiles there are whose borders move: says that they do, where nothing else is said of tiles.
pub(super) struct TileCount;

impl Form for TileCount {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        if (config.run.retiling.is_none() && config.run.tiles.is_none() || config.run.is_bisected())
            && let Some(count) = settings.integer(key, 1..=u64::from(MOST_TILES))?
        {
            config.run.retiling.get_or_insert(Retiling::BISECTED);
            config.run.tiles = Some([count as u32, 1]);
        }
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        config.run.tiles.filter(|_| config.run.is_bisected()).map(|[count, _]| whole(count.into()))
    }
}

pub(super) fn keep<T>(given: Option<T>, field: &mut T) {
    if let Some(value) = given {
        *field = value;
    }
}

/// A number of things as TOML has it. No key takes more than TOML can say.
pub(super) fn whole(number: u64) -> Value {
    Value::Integer(number.try_into().unwrap_or(i64::MAX))
}

/// The shortest decimal that is read as this number.
fn float(number: f32) -> Value {
    Value::Float(shortest(number))
}

/// The steps per second that a step of this length came from. Of several, the one that is shortest to write.
pub(super) fn hertz(dt: f32) -> f32 {
    let nearest = 1.0 / dt;
    // Each of two divisions rounds by at most half a unit. For every number there is, that makes one unit at most.
    let near = [nearest, nearest.next_down(), nearest.next_up()];
    let exact = near.into_iter().filter(|hertz| hertz.is_finite() && 1.0 / hertz == dt);
    exact.min_by_key(|hertz| hertz.to_string().len()).unwrap_or(nearest)
}
