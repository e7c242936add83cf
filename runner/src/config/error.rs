//! What can be wrong with a configuration: always one line that names the place, the value, and what is allowed.

use crate::scene::SceneError;
use crate::wording::{OneLine, did_you_mean};
use std::fmt;
use thiserror::Error;

/// Where a value came from.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Origin {
    /// A configuration file, by the name it was given under.
    File(String),
    /// `--set`.
    Set,
    /// An option of its own, such as `--bodies`.
    Option(&'static str),
    /// Nobody gave it.
    Default,
}

/// A value and where it came from, as a person would point at it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Given {
    /// Where from.
    pub origin: Origin,
    /// Full path of the key, or what was written in its place.
    pub key: String,
    /// The value as it was written.
    pub value: String,
}

impl fmt::Display for Given {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (origin, key, value) = (&self.origin, OneLine(&self.key), OneLine(&self.value));
        match origin {
            Origin::File(file) => write!(f, "{}: {key} = {value}", OneLine(file)),
            Origin::Set => write!(f, "--set {key}={value}"),
            Origin::Option(option) => write!(f, "{option} {value}"),
            Origin::Default => write!(f, "{key} = {value} (the default)"),
        }
    }
}

/// A configuration that cannot be used.
#[derive(Clone, PartialEq, Debug, Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{}: cannot read this configuration: {}", OneLine(.file), OneLine(.reason))]
    Read {
        /// Its path.
        file: String,
        /// What the system said.
        reason: String,
    },
    /// The file is not TOML.
    #[error("{}, line {line}: {}", OneLine(.file), OneLine(.message))]
    Syntax {
        /// Its path.
        file: String,
        /// Counted from 1.
        line: usize,
        /// What the parser said.
        message: String,
    },
    /// There is no such key.
    #[error("{given}: unknown key{}", did_you_mean(.suggestion))]
    UnknownKey {
        /// The key in question.
        given: Given,
        /// The nearest key that exists, if any is near.
        suggestion: Option<String>,
    },
    /// There is no such section.
    #[error("{}: unknown section [{}]{}", OneLine(.file), OneLine(.section), did_you_mean(.suggestion))]
    UnknownSection {
        /// The file.
        file: String,
        /// What it called the section.
        section: String,
        /// The nearest section that exists, if any is near.
        suggestion: Option<String>,
    },
    /// The last part of more than one key.
    #[error("{given}: ambiguous, write one of {}", .candidates.join(", "))]
    AmbiguousKey {
        /// The key in question.
        given: Given,
        /// All that it may mean.
        candidates: Vec<String>,
    },
    /// A `--set` without an equals sign.
    #[error("--set {}: write key=value, such as --set physics.substeps=8", OneLine(.text))]
    NotAnAssignment {
        /// What was written.
        text: String,
    },
    /// A key that must be there is not.
    #[error("{}: {key} is missing: must be {must}", OneLine(.file))]
    Missing {
        /// The file.
        file: String,
        /// The key.
        key: &'static str,
        /// What it may be.
        must: String,
    },
    /// A value of the wrong type or out of range.
    #[error("{given}: must be {must}{}", did_you_mean(.suggestion))]
    BadValue {
        /// The value.
        given: Given,
        /// What it may be.
        must: String,
        /// The nearest allowed word, if any is near.
        suggestion: Option<String>,
    },
    /// A transport that this program was built without.
    #[error(
        "{given}: this program was built without it; build it again with `cargo build --release --features {feature}`, \
         or use \"local\" or \"channel\""
    )]
    NotBuiltIn {
        /// The value.
        given: Given,
        /// The feature of the package that brings it.
        feature: &'static str,
    },
    /// A key that means nothing beside another value.
    #[error("{given}: {reason}")]
    Inapplicable {
        /// The value.
        given: Given,
        /// Why it means nothing, and what to do.
        reason: String,
    },
    /// The file of a scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
}
