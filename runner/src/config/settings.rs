//! What a file and the command line say, key by key, and reading it with types and ranges. What nobody gave is `None`.

use super::error::{ConfigError, Given, Origin};
use super::spelling;
use crate::wording::{exponential, nearest, toml_fault};
use std::collections::BTreeMap;
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// What may be said of tiles.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum TilesChoice {
    /// As suits the scene.
    Auto,
    /// They are cut and joined.
    Adaptive,
    /// Their borders move.
    Bisected,
    /// Columns and rows.
    Counts([u32; 2]),
}

/// A value for a key from the command line. It wins over the file, and a later one over an earlier one.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Override {
    origin: Origin,
    key: String,
    value: String,
}

impl Override {
    /// From `--set`, already taken apart: the full path of a key or an unambiguous last part, and a TOML value, in
    /// which strings may go without quotes.
    pub fn set(key: &str, value: &str) -> Self {
        Self { origin: Origin::Set, key: key.trim().to_owned(), value: value.trim().to_owned() }
    }

    /// From the text after `--set`.
    pub fn parse(text: &str) -> Result<Self, ConfigError> {
        let (key, value) =
            text.split_once('=').ok_or_else(|| ConfigError::NotAnAssignment { text: text.to_owned() })?;
        Ok(Self::set(key, value))
    }

    /// From an option of its own, which errors will name.
    pub fn option(option: &'static str, key: &'static str, value: &str) -> Self {
        Self { origin: Origin::Option(option), key: key.to_owned(), value: value.to_owned() }
    }
}

/// One value and where it came from.
struct Setting {
    value: Value,
    given: Given,
    read: bool,
    /// What it won over, if the command line said that too: it must make sense all the same.
    beneath: Option<Box<Setting>>,
}

/// Everything that was given.
pub(super) struct Settings {
    file: String,
    /// The keys there are.
    keys: Vec<&'static str>,
    all: BTreeMap<&'static str, Setting>,
    /// Whether the run was begun before: then files that it was begun with may be gone.
    pub(super) is_begun: bool,
}

impl Settings {
    /// `keys` are the full paths of all keys there are; what is none of them is refused.
    pub(super) fn new(
        file: &str,
        text: &str,
        overrides: &[Override],
        keys: impl Iterator<Item = &'static str>,
    ) -> Result<Self, ConfigError> {
        let table: Table = text.parse().map_err(|error| syntax_error(file, text, &error))?;
        let mut settings = Self { file: file.to_owned(), keys: keys.collect(), all: BTreeMap::new(), is_begun: false };
        for (section, content) in table {
            settings.add_section(&section, content)?;
        }
        for one in overrides {
            let key = spelling::resolve(&settings.keys, &one.key, &one.value, one.origin.clone())?;
            // What is no TOML value is a string without its quotes.
            let value = one.value.parse().unwrap_or_else(|_| Value::String(one.value.clone()));
            settings.insert(key, value, one.value.clone(), one.origin.clone());
        }
        Ok(settings)
    }

    /// One section of another file, which is read already.
    pub(super) fn of_section(
        file: &str,
        section: &str,
        content: Table,
        keys: impl Iterator<Item = &'static str>,
    ) -> Result<Self, ConfigError> {
        let mut settings = Self { file: file.to_owned(), keys: keys.collect(), all: BTreeMap::new(), is_begun: false };
        settings.add_section(section, Value::Table(content))?;
        Ok(settings)
    }

    fn add_section(&mut self, section: &str, content: Value) -> Result<(), ConfigError> {
        let (file, keys) = (self.file.clone(), self.keys.clone());
        let unknown = |key: String, value: &Value| {
            let suggestion = spelling::nearest_key(&keys, &key);
            let given = Given { origin: Origin::File(file.clone()), key, value: one_line(value) };
            ConfigError::UnknownKey { given, suggestion }
        };
        let sections = || keys.iter().map(|key| key.split_once('.').map_or(*key, |(section, _)| section));
        let is_known = sections().any(|known| known == section);
        let content = match content {
            Value::Table(content) if is_known => content,
            Value::Table(_) => {
                let suggestion = nearest(sections(), section).map(|word| format!("[{word}]"));
                return Err(ConfigError::UnknownSection { file, section: section.to_owned(), suggestion });
            }
            value if is_known => {
                let given = Given { origin: Origin::File(file), key: section.to_owned(), value: one_line(&value) };
                let must = format!("a table; give its keys below a line [{section}]");
                return Err(ConfigError::BadValue { given, must, suggestion: None });
            }
            value => return Err(unknown(section.to_owned(), &value)),
        };
        for (name, value) in content {
            let path = format!("{section}.{name}");
            let key = keys.iter().find(|&&key| key == path).ok_or_else(|| unknown(path, &value))?;
            let written = one_line(&value);
            self.insert(key, value, written, Origin::File(self.file.clone()));
        }
        Ok(())
    }

    fn insert(&mut self, key: &'static str, value: Value, written: String, origin: Origin) {
        let given = Given { origin, key: key.to_owned(), value: written };
        let beneath = self.all.remove(key).filter(|before| !matches!(before.given.origin, Origin::File(_)));
        self.all.insert(key, Setting { value, given, read: false, beneath: beneath.map(Box::new) });
    }

    /// Refuses whatever was given and never read.
    pub(super) fn finish(self, reason: impl Fn(&str) -> String) -> Result<(), ConfigError> {
        match self.all.into_iter().find(|(_, setting)| !setting.read) {
            Some((key, setting)) => Err(ConfigError::Inapplicable { given: setting.given, reason: reason(key) }),
            None => Ok(()),
        }
    }

    /// What was given for a key, and where.
    pub(super) fn given(&self, key: &str) -> Option<&Given> {
        self.all.get(key).map(|setting| &setting.given)
    }

    /// That the value of `key`, which was given, must be something else.
    pub(super) fn refusal(&self, key: &str, must: impl Display) -> ConfigError {
        let given = self.given(key).expect("only values that were given are refused").clone();
        ConfigError::BadValue { given, must: must.to_string(), suggestion: None }
    }

    pub(super) fn missing(&self, key: &'static str, must: String) -> ConfigError {
        ConfigError::Missing { file: self.file.clone(), key, must }
    }

    fn get<T>(
        &mut self,
        key: &'static str,
        must: impl Display,
        convert: impl Fn(&Value) -> Option<T>,
    ) -> Result<Option<T>, ConfigError> {
        debug_assert!(self.keys.contains(&key), "{key} is not in the list of keys");
        let Some(setting) = self.all.get_mut(key) else { return Ok(None) };
        setting.read = true;
        let mut said = std::iter::successors(Some(&*setting), |setting| setting.beneath.as_deref());
        match said.find(|setting| convert(&setting.value).is_none()) {
            Some(Setting { given, .. }) => {
                Err(ConfigError::BadValue { given: given.clone(), must: must.to_string(), suggestion: None })
            }
            None => Ok(convert(&setting.value)),
        }
    }

    /// A whole number; `1e6` counts as one.
    pub(super) fn integer(
        &mut self,
        key: &'static str,
        range: RangeInclusive<u64>,
    ) -> Result<Option<u64>, ConfigError> {
        let must = format!("a whole number within {} to {}", range.start(), range.end());
        let whole = |value: &Value| value_as_u64(value).filter(|number| range.contains(number));
        self.get(key, must, whole)
    }

    /// A number within bounds.
    pub(super) fn number(&mut self, key: &'static str, range: RangeInclusive<f64>) -> Result<Option<f64>, ConfigError> {
        let must = format!("a number within {} to {}", range.start(), range.end());
        let within = |value: &Value| value_as_f64(value).filter(|number| range.contains(number));
        self.get(key, must, within)
    }

    /// A number whose bounds are checked where it is used.
    pub(super) fn float(&mut self, key: &'static str) -> Result<Option<f32>, ConfigError> {
        self.get(key, "a number of at most 3.4e38", value_as_f32)
    }

    /// Two numbers, `[x, y]`.
    pub(super) fn pair(&mut self, key: &'static str) -> Result<Option<[f32; 2]>, ConfigError> {
        let pair = |value: &Value| match value.as_array()?.as_slice() {
            [x, y] => Some([value_as_f32(x)?, value_as_f32(y)?]),
            _ => None,
        };
        self.get(key, "two numbers of at most 3.4e38, such as [0, -10]", pair)
    }

    /// `"auto"` or a whole number from one on; `None` stands for auto.
    pub(super) fn threads(&mut self, key: &'static str, most: u64) -> Result<Option<usize>, ConfigError> {
        let threads = |value: &Value| match value {
            Value::String(text) if text == "auto" => Some(None),
            number => Some(Some(value_as_u64(number).filter(|number| (1..=most).contains(number))? as usize)),
        };
        Ok(self.get(key, format!("\"auto\", or a whole number within 1 to {most}"), threads)?.flatten())
    }

    /// `"auto"`, `"bisected"`, `"adaptive"`, `[columns, rows]` or `"COLUMNSxROWS"`.
    pub(super) fn tiles(&mut self, key: &'static str, most: u32) -> Result<Option<TilesChoice>, ConfigError> {
        let count = |number: u64| u32::try_from(number).ok().filter(|number| (1..=most).contains(number));
        let tiles = |value: &Value| match value {
            Value::String(text) if text == "auto" => Some(TilesChoice::Auto),
            Value::String(text) if text == "adaptive" => Some(TilesChoice::Adaptive),
            Value::String(text) if text == "bisected" => Some(TilesChoice::Bisected),
            Value::String(text) => {
                let (columns, rows) = text.split_once(['x', 'X'])?;
                Some(TilesChoice::Counts([count(columns.parse().ok()?)?, count(rows.parse().ok()?)?]))
            }
            Value::Array(pair) => match pair.as_slice() {
                [columns, rows] => {
                    Some(TilesChoice::Counts([count(value_as_u64(columns)?)?, count(value_as_u64(rows)?)?]))
                }
                _ => None,
            },
            _ => None,
        };
        let must = format!(
            "\"auto\", \"bisected\", \"adaptive\", or columns and rows as [17, 17] or \"17x17\", each within 1 to {most}"
        );
        self.get(key, must, tiles)
    }

    /// Any text.
    pub(super) fn text(&mut self, key: &'static str, must: &str) -> Result<Option<String>, ConfigError> {
        self.get(key, must, |value| value.as_str().map(str::to_owned))
    }

    /// A path: from the folder of the configuration where that gives it, from the working folder where the command line does.
    pub(super) fn path(&mut self, key: &'static str) -> Result<Option<PathBuf>, ConfigError> {
        let path =
            self.get(key, "a path", |value| value.as_str().filter(|path| !path.is_empty()).map(PathBuf::from))?;
        let from_file = matches!(self.given(key), Some(Given { origin: Origin::File(_), .. }));
        let folder = Path::new(&self.file).parent().filter(|_| from_file).unwrap_or(Path::new(""));
        Ok(path.map(|path| folder.join(path)))
    }

    /// Yes or no.
    pub(super) fn flag(&mut self, key: &'static str) -> Result<Option<bool>, ConfigError> {
        self.get(key, "true or false", Value::as_bool)
    }

    /// One of some words.
    pub(super) fn choice<T: Copy>(&mut self, key: &'static str, words: &[(&str, T)]) -> Result<Option<T>, ConfigError> {
        let word = |value: &Value| words.iter().find(|(word, _)| value.as_str() == Some(word)).map(|(_, value)| *value);
        self.get(key, one_of(words), word).map_err(|error| match error {
            ConfigError::BadValue { given, must, .. } => {
                let suggestion = nearest(words.iter().map(|(word, _)| *word), given.value.trim_matches('"'));
                ConfigError::BadValue { given, must, suggestion }
            }
            error => error,
        })
    }
}

/// The words that may be said.
pub(super) fn one_of<T>(words: &[(&str, T)]) -> String {
    let quoted: Vec<String> = words.iter().map(|(word, _)| format!("\"{word}\"")).collect();
    match quoted.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => quoted.concat(),
    }
}

fn value_as_u64(value: &Value) -> Option<u64> {
    match *value {
        Value::Integer(number) => u64::try_from(number).ok(),
        // 2^53: up to there every whole number has a float of its own.
        Value::Float(number) if number.fract() == 0.0 && (0.0..=9_007_199_254_740_992.0).contains(&number) => {
            Some(number as u64)
        }
        _ => None,
    }
}

fn value_as_f64(value: &Value) -> Option<f64> {
    match *value {
        Value::Integer(number) => Some(number as f64),
        Value::Float(number) => Some(number),
        _ => None,
    }
}

fn value_as_f32(value: &Value) -> Option<f32> {
    let wide = value_as_f64(value)?;
    let narrow = wide as f32;
    (!(wide.is_finite() && narrow.is_infinite())).then_some(narrow)
}

/// A value as TOML would write it, on one line.
fn one_line(value: &Value) -> String {
    match value {
        Value::Float(number) => return exponential(*number),
        Value::Array(all) => return format!("[{}]", all.iter().map(one_line).collect::<Vec<_>>().join(", ")),
        _ => {}
    }
    let text: Vec<String> = value.to_string().lines().map(|line| line.trim().to_owned()).collect();
    text.join(" ")
}

fn syntax_error(file: &str, text: &str, error: &toml::de::Error) -> ConfigError {
    let (line, message) = toml_fault(text, error);
    ConfigError::Syntax { file: file.to_owned(), line, message }
}
