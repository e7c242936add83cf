//! Reading a table of TOML key by key: every key must be known, and every value of its form.

use super::super::{Place, SceneError};
use crate::wording::{did_you_mean, exponential, nearest};
use glam::{DVec2, Vec2};
use std::collections::BTreeSet;
use std::path::Path;
use toml::{Table, Value};

/// A table of a scene's file, of which keys are taken one after the other.
pub(super) struct Entries<'a> {
    file: &'a Path,
    /// As errors call it, such as `[[kinds]] 2`; empty for the file as a whole.
    name: String,
    table: &'a Table,
    /// Keys that were asked for.
    known: Vec<&'static str>,
}

impl<'a> Entries<'a> {
    pub(super) fn new(file: &'a Path, name: String, table: &'a Table) -> Self {
        Self { file, name, table, known: Vec::new() }
    }

    /// A table within this one, or within a list in it.
    pub(super) fn within(&self, name: &str, table: &'a Table) -> Self {
        Self::new(self.file, format!("{}, {name}", self.name), table)
    }

    /// Whether a key is there.
    pub(super) fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// That something is wrong with a key, which may have a value.
    pub(super) fn refuse(&self, key: &str, reason: impl Into<String>) -> SceneError {
        let written = self.table.get(key).map(|value| format!(" = {}", short(value))).unwrap_or_default();
        let path =
            if self.name.is_empty() { format!("{key}{written}") } else { format!("{}, {key}{written}", self.name) };
        SceneError::bad(self.file, Place { name: Some(path), ..Place::default() }, reason)
    }

    /// The value of a key, if it is there.
    pub(super) fn value(&mut self, key: &'static str) -> Option<&'a Value> {
        self.known.push(key);
        self.table.get(key)
    }

    /// The value of a key, if it is there, read.
    pub(super) fn get<T>(
        &mut self,
        key: &'static str,
        must: &str,
        read: impl FnOnce(&'a Value) -> Option<T>,
    ) -> Result<Option<T>, SceneError> {
        let Some(value) = self.value(key) else { return Ok(None) };
        read(value).map(Some).ok_or_else(|| self.refuse(key, format!("must be {must}")))
    }

    /// That a key which must be there is not.
    pub(super) fn missing(&self, key: &str, must: &str) -> SceneError {
        self.refuse(key, format!("is missing: must be {must}"))
    }

    pub(super) fn text(&mut self, key: &'static str, must: &str) -> Result<Option<&'a str>, SceneError> {
        self.get(key, must, Value::as_str)
    }

    pub(super) fn whole(&mut self, key: &'static str) -> Result<Option<u64>, SceneError> {
        self.get(key, "a whole number, at least 0", |value| value.as_integer()?.try_into().ok())
    }

    /// A finite number of 64 bits.
    pub(super) fn number(&mut self, key: &'static str, must: &str) -> Result<Option<f64>, SceneError> {
        self.get(key, must, |value| number(value).filter(|number| number.is_finite()))
    }

    /// A finite number of 32 bits.
    pub(super) fn float(&mut self, key: &'static str, must: &str) -> Result<Option<f32>, SceneError> {
        self.get(key, must, float)
    }

    /// True or false.
    pub(super) fn truth(&mut self, key: &'static str) -> Result<Option<bool>, SceneError> {
        self.get(key, "true or false", Value::as_bool)
    }

    /// A whole number of some type.
    pub(super) fn integer<T: TryFrom<i64>>(&mut self, key: &'static str, must: &str) -> Result<Option<T>, SceneError> {
        self.get(key, must, |value| value.as_integer()?.try_into().ok())
    }

    /// A table.
    pub(super) fn table(&mut self, key: &'static str) -> Result<Option<&'a Table>, SceneError> {
        let must = format!("a table: write [{key}]");
        self.get(key, &must, Value::as_table)
    }

    /// Many tables.
    pub(super) fn tables(&mut self, key: &'static str) -> Result<Vec<&'a Table>, SceneError> {
        let must = format!("tables: write [[{key}]] before each");
        let tables = |value: &'a Value| value.as_array()?.iter().map(Value::as_table).collect();
        Ok(self.get(key, &must, tables)?.unwrap_or_default())
    }

    /// Refuses keys that nobody has asked for.
    pub(super) fn finish(&self) -> Result<(), SceneError> {
        let Some(key) = self.table.keys().find(|key| !self.known.contains(&key.as_str())) else { return Ok(()) };
        let suggestion = nearest(self.known.iter().copied(), key);
        let hint = if suggestion.is_some() {
            did_you_mean(&suggestion)
        } else {
            let mut told = BTreeSet::new();
            let known: Vec<&str> = self.known.iter().copied().filter(|key| told.insert(*key)).collect();
            format!("; there are {}", known.join(", "))
        };
        Err(self.refuse(key, format!("unknown key{hint}")))
    }
}

/// What was read, or none if that is a fault, which is told later.
pub(super) fn keep<T>(faults: &mut Vec<SceneError>, read: Result<T, SceneError>) -> Option<T> {
    read.map_err(|fault| faults.push(fault)).ok()
}

/// A number as TOML has it, whole or not.
pub(super) fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
}

/// A finite number of 32 bits.
pub(super) fn float(value: &Value) -> Option<f32> {
    number(value).map(|number| number as f32).filter(|number| number.is_finite())
}

/// Two finite numbers of 32 bits.
pub(super) fn pair(value: &Value) -> Option<Vec2> {
    match value.as_array()?.as_slice() {
        [x, y] => Some(Vec2::new(float(x)?, float(y)?)),
        _ => None,
    }
}

/// Two numbers of 64 bits.
pub(super) fn place(value: &Value) -> Option<DVec2> {
    match value.as_array()?.as_slice() {
        [x, y] => Some(DVec2::new(number(x)?, number(y)?)),
        _ => None,
    }
}

/// A value on one line, the beginning of a long one.
fn short(value: &Value) -> String {
    let text = match value {
        Value::Table(_) => "{...}".to_owned(),
        Value::Array(_) => "[...]".to_owned(),
        Value::Float(number) => exponential(*number),
        _ => value.to_string(),
    };
    if text.chars().count() > 60 { text.chars().take(57).chain("...".chars()).collect() } else { text }
}
