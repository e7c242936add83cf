//! What every file of a recording says about the run it is of.

use crate::config::{self, Config};
use glam::DVec2;
use std::num::NonZeroU16;
use std::str::FromStr;

/// Grows when older programs could no longer read a recording.
const FORMAT: Format = Format::WithStage;

/// Versions of the layout that this program reads.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Format {
    /// The first, which leaves it to the configuration what bodies look like.
    StatesAlone = 1,
    /// With a column for the kinds of bodies, and a [`Stage`](super::Stage).
    WithStage = 2,
}

impl Format {
    /// From what a file says, by name. The error is what is wrong with it.
    pub(super) fn from_texts<'a>(text: impl Fn(&str) -> Option<&'a str>) -> Result<Self, String> {
        let format: String = parse(&text, "format")?;
        let known = [Self::StatesAlone, Self::WithStage].into_iter().find(|known| known.number() == format);
        known.ok_or_else(|| {
            let told = "bring a program that is newer, or the segment as it was";
            format!("its format is {format}, and this program reads those until {}: {told}", FORMAT.number())
        })
    }

    /// As it is written.
    pub(super) fn number(self) -> String {
        (self as u8).to_string()
    }
}

/// The run a recording is of. In a file's metadata each is a text under its name, with `atoll.` in front.
#[derive(Clone, PartialEq, Debug)]
pub struct RunFacts {
    /// Version of the program that recorded.
    pub version: String,
    /// Kind of scene.
    pub scene: String,
    /// Its seed.
    pub seed: u64,
    /// Steps from one record to the next.
    pub record_every: u64,
    /// Low and high corner of the domain, in m.
    pub domain: [DVec2; 2],
    /// Columns and rows of tiles.
    pub tiles: [u32; 2],
    /// The configuration, as TOML.
    pub config: String,
    /// What the result depends on, as lines of `key = value`.
    pub canonical: String,
}

impl RunFacts {
    /// Those of a run in this domain on these tiles that records every so many steps.
    pub fn new(config: &Config, (low, high): (DVec2, DVec2), tiles: [u32; 2], record_every: u64) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scene: config.scene.kind.name().to_owned(),
            seed: config.scene.seed,
            record_every,
            domain: [low, high],
            tiles,
            config: config.to_toml(tiles),
            canonical: config.canonical(tiles),
        }
    }

    /// As names and texts.
    pub(super) fn to_pairs(&self) -> Vec<(String, String)> {
        let [low, high] = self.domain;
        let [columns, rows] = self.tiles;
        let pairs = [
            ("format", FORMAT.number()),
            ("version", self.version.clone()),
            ("scene", self.scene.clone()),
            ("seed", self.seed.to_string()),
            ("record_every", self.record_every.to_string()),
            // The shortest decimals that lead back to the same bits.
            ("domain", format!("{} {} {} {}", low.x, low.y, high.x, high.y)),
            ("tiles", format!("{columns}x{rows}")),
            ("config", self.config.clone()),
            ("canonical", self.canonical.clone()),
        ];
        pairs.map(|(name, text)| (format!("atoll.{name}"), text)).into()
    }

    /// From what a file says, by name. The error is what is wrong with it.
    pub(super) fn from_texts<'a>(text: impl Fn(&str) -> Option<&'a str>) -> Result<Self, String> {
        let numbers: String = parse(&text, "domain")?;
        let numbers: Option<Vec<f64>> = numbers.split(' ').map(|number| number.parse().ok()).collect();
        let Some(&[x0, y0, x1, y1]) = numbers.as_deref() else { return Err("atoll.domain is unreadable".to_owned()) };
        let tiles: String = parse(&text, "tiles")?;
        // No configuration allows more than 16 bits can say.
        let count = |text: &str| text.parse::<NonZeroU16>().ok().map(|count| u32::from(count.get()));
        let tiles = tiles.split_once('x').and_then(|(columns, rows)| Some([count(columns)?, count(rows)?]));
        let facts = Self {
            version: parse(&text, "version")?,
            scene: parse(&text, "scene")?,
            seed: parse(&text, "seed")?,
            record_every: parse::<u32>(&text, "record_every")?.into(),
            domain: [DVec2::new(x0, y0), DVec2::new(x1, y1)],
            tiles: tiles.ok_or("atoll.tiles is unreadable")?,
            config: parse(&text, "config")?,
            canonical: parse(&text, "canonical")?,
        };
        if facts.record_every == 0 { Err("atoll.record_every is 0".to_owned()) } else { Ok(facts) }
    }

    /// Steps in a second.
    pub(crate) fn hertz(&self) -> Option<f64> {
        let hertz = self.canonical.lines().find_map(|line| line.strip_prefix("physics.hertz = "))?;
        hertz.parse().ok().filter(|hertz: &f64| hertz.is_finite() && *hertz > 0.0)
    }

    /// In what this differs from the facts of another file, if both cannot be of one run. A run that was taken up again may
    /// have been given more steps, but goes on in the version it began in.
    pub(super) fn other_run(&self, other: &Self) -> Option<String> {
        let identity = |facts: &Self| config::identity(Some(facts.record_every), &facts.canonical);
        let differ =
            |key: &str, ours: &str, theirs: &str| Some(format!("{key} is {ours} in the one and {theirs} in the other"));
        if self.version != other.version {
            return differ("version", &self.version, &other.version);
        }
        let one = config::other_run(&identity(self), &identity(other))?;
        differ(&one.key, &one.ours, &one.theirs)
    }
}

/// The fact of that name, read from its text.
pub(super) fn parse<'a, T: FromStr>(text: impl Fn(&str) -> Option<&'a str>, name: &str) -> Result<T, String> {
    let text = text(name).ok_or_else(|| format!("it has no atoll.{name}, which Atoll writes to every segment"))?;
    text.parse().map_err(|_| format!("atoll.{name} is unreadable"))
}
