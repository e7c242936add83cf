//! What can be wrong with the files of a scene: always one line that names the file, the place in it, what is wrong there, and how
//! to mend it.

use crate::wording::OneLine;
use std::fmt;
use std::path::Path;
use thiserror::Error;

/// Files that make no scene.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
pub enum SceneError {
    /// A file cannot be read.
    #[error("{}: cannot read {what}: {}", OneLine(.file), OneLine(.reason))]
    Read {
        /// Its path.
        file: String,
        /// What it was to be.
        what: &'static str,
        /// What the system said.
        reason: String,
    },
    /// A file that holds what cannot be.
    #[error("{}{}: {}", OneLine(.file), place, OneLine(.reason))]
    Bad {
        /// Its path.
        file: String,
        /// Where in it.
        place: Place,
        /// What is wrong, and how to mend it.
        reason: String,
    },
}

/// A place in a file of a scene.
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub struct Place {
    /// A line, counted from 1.
    pub line: Option<u64>,
    /// A row of data, counted from 1.
    pub row: Option<u64>,
    /// A key or a column, perhaps with the value it has there.
    pub name: Option<String>,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.row, self.line) {
            (Some(row), Some(line)) => write!(f, ", row {row} (line {line})")?,
            (Some(row), None) => write!(f, ", row {row}")?,
            (None, Some(line)) => write!(f, ", line {line}")?,
            (None, None) => {}
        }
        match &self.name {
            Some(name) if self.row.is_some() || self.line.is_some() => write!(f, ", {}", OneLine(name)),
            Some(name) => write!(f, ": {}", OneLine(name)),
            None => Ok(()),
        }
    }
}

impl SceneError {
    /// Something wrong at a place.
    pub(super) fn bad(file: &Path, place: Place, reason: impl Into<String>) -> Self {
        Self::Bad { file: file.display().to_string(), place, reason: reason.into() }
    }

    /// Something wrong with the whole file.
    pub(super) fn whole(file: &Path, reason: impl Into<String>) -> Self {
        Self::bad(file, Place::default(), reason)
    }

    /// The same of a row that stands in the scene's own file, named as the other tables of that are.
    pub(super) fn of_table(mut self) -> Self {
        if let Self::Bad { place, .. } = &mut self
            && let Some(row) = place.row.take()
        {
            let name = place.name.take().map(|name| format!(", {name}")).unwrap_or_default();
            place.name = Some(format!("[[body]] {}{name}", row - 1));
        }
        self
    }

    /// That so much more is wrong in the same way.
    pub(super) fn and_more(mut self, more: usize) -> Self {
        if let (Self::Bad { reason, .. }, 1..) = (&mut self, more) {
            reason.push_str(&format!("; there are {more} more like this"));
        }
        self
    }

    /// Where something is wrong and what, for what is in no file.
    pub(super) fn without_file(self) -> String {
        match self {
            Self::Bad { place: Place { name: Some(name), .. }, reason, .. } => {
                format!("{}: {}", OneLine(&name), OneLine(&reason))
            }
            other => other.to_string(),
        }
    }

    /// What the system says.
    pub(super) fn read(file: &Path, what: &'static str, reason: impl fmt::Display) -> Self {
        Self::Read { file: file.display().to_string(), what, reason: reason.to_string() }
    }
}
