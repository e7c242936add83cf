//! Which color a body has, and why.

use super::canvas::Rgb;
use super::colors::{self, Scale};
use crate::folder::recording::Row;
use crate::look::frame::{Frame, Setting};
use atoll_core::{Partition, TileId};
use glam::DVec2;
use serde::{Deserialize, Serialize};

/// What the color of a body tells.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum ColorBy {
    /// Its shape and material.
    Kind,
    /// How fast it moves.
    Speed,
    /// How fast it turns, and which way.
    Spin,
    /// Which tile holds its center.
    Tile,
    /// Which rank has it.
    Rank,
    /// How many contacts it has; of a run only.
    Contacts,
    /// Whether it sleeps; of a run only.
    Asleep,
}

/// From so many contacts on the color stays as it is.
pub(super) const MOST_CONTACTS: u16 = 6;
/// The scale of speeds and spins is made from so many bodies, at least, if there are as many.
const SAMPLE: usize = 4096;

/// What colors of speed and of spin are measured by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Range {
    /// What has the last color of the scale, in m/s or rad/s.
    pub most: f32,
}

impl Range {
    /// Grows to what all but one in a hundred bodies have, rounded up to 1, 2 or 5 times a power of ten; shrinks never, so
    /// that a film does not flicker.
    pub(crate) fn grow(&mut self, by: ColorBy, frame: &Frame) {
        if !by.is_measured() {
            return;
        }
        let every = (frame.bodies.len() / SAMPLE).max(1) as u64;
        // By their names, as they come in another order on other ranks.
        let sample = frame.bodies.iter().filter(|row| row.id.is_multiple_of(every));
        let mut values: Vec<f32> = sample.map(|row| by.measure(row.vx, row.vy, row.omega)).collect();
        self.grow_to(&mut values);
    }

    /// As [`grow`](Self::grow), to some of the values there are.
    pub(crate) fn grow_to(&mut self, values: &mut Vec<f32>) {
        values.retain(|value| value.is_finite());
        if values.is_empty() {
            return;
        }
        let at = values.len() - 1 - values.len() / 100;
        let high = *values.select_nth_unstable_by(at, f32::total_cmp).1;
        self.most = self.most.max(round_up(f64::from(high.max(1e-3))) as f32);
    }
}

impl ColorBy {
    /// All there are.
    pub(crate) const ALL: [Self; 7] =
        [Self::Kind, Self::Speed, Self::Spin, Self::Tile, Self::Rank, Self::Contacts, Self::Asleep];

    /// Whether its colors are those of a scale that fits what there is.
    pub(crate) fn is_measured(self) -> bool {
        matches!(self, Self::Speed | Self::Spin)
    }

    /// Whether only a run under way can tell.
    pub(crate) fn needs_run(self) -> bool {
        matches!(self, Self::Contacts | Self::Asleep)
    }

    /// What the scale of a body's color measures: speed in m/s, or spin in rad/s.
    #[inline]
    pub(crate) fn measure(self, vx: f32, vy: f32, omega: f32) -> f32 {
        if self == Self::Spin { omega.abs() } else { (vx * vx + vy * vy).sqrt() }
    }
}

/// The least of 1, 2 and 5 times powers of ten that is not less.
pub(super) fn round_up(value: f64) -> f64 {
    let mut power = 1.0;
    while power < value {
        power *= 10.0;
    }
    while power * 0.1 >= value {
        power *= 0.1;
    }
    [0.2, 0.5].into_iter().map(|part| part * power).find(|rounded| *rounded >= value * (1.0 - 1e-9)).unwrap_or(power)
}

impl Default for Range {
    fn default() -> Self {
        Self { most: 1e-3 }
    }
}

/// Colors by what is known of one body.
#[derive(Debug)]
pub(crate) struct Tint {
    by: ColorBy,
    table: Vec<Rgb>,
    per_unit: f32,
}

impl Tint {
    /// As a legend with that range tells.
    pub(crate) fn new(by: ColorBy, range: Range) -> Self {
        let scale = if by == ColorBy::Spin { Scale::Ways } else { Scale::Amount };
        Self { by, table: scale.table(), per_unit: 255.0 / range.most }
    }

    /// Of a body that moves and turns so: by speed, or else by spin.
    #[inline]
    pub(crate) fn moving(&self, vx: f32, vy: f32, omega: f32) -> Rgb {
        let along = match self.by {
            ColorBy::Spin => (127.5 + 0.5 * omega * self.per_unit).clamp(0.0, 255.0),
            _ => (self.by.measure(vx, vy, omega) * self.per_unit).min(255.0),
        };
        self.table[along as usize]
    }

    /// Of a body in a tile.
    pub(crate) fn tile(tile: TileId, partition: &Partition) -> Rgb {
        // Equal tiles are told apart by columns and rows; others, which have none, by their names.
        let columns = if partition.is_uniform() { partition.roots()[0] } else { u32::MAX };
        colors::tile((tile.0 % columns) as usize, (tile.0 / columns) as usize)
    }

    /// Of a kind, or a rank.
    #[inline]
    pub(crate) fn numbered(number: u32) -> Rgb {
        colors::distinct(number)
    }

    /// Of a body with so many contacts.
    pub(crate) fn contacts(count: u16) -> Rgb {
        contacts(count)
    }

    /// Of a body that sleeps, or does not, as far as is known.
    pub(crate) fn asleep(asleep: Option<bool>) -> Rgb {
        match asleep {
            Some(true) => colors::ASLEEP,
            Some(false) => colors::AWAKE,
            None => colors::UNKNOWN,
        }
    }
}

/// Gives the bodies of a frame their colors.
#[derive(Debug)]
pub(super) struct Paint<'a> {
    by: ColorBy,
    setting: &'a Setting,
    frame: &'a Frame,
    tint: Tint,
}

impl<'a> Paint<'a> {
    pub(super) fn new(by: ColorBy, setting: &'a Setting, frame: &'a Frame, range: Range) -> Self {
        Self { by, setting, frame, tint: Tint::new(by, range) }
    }

    /// The color of the body with that index.
    #[inline]
    pub(super) fn color(&self, index: usize, row: &Row) -> Rgb {
        let live = self.frame.live.as_ref();
        match self.by {
            ColorBy::Kind => Tint::numbered(row.kind),
            ColorBy::Speed | ColorBy::Spin => self.tint.moving(row.vx, row.vy, row.omega),
            ColorBy::Tile => {
                let partition = self.frame.partition(self.setting);
                Tint::tile(partition.locate(DVec2::new(row.x, row.y)), partition)
            }
            ColorBy::Rank => {
                let ranks = &self.frame.ranks;
                let at = ranks.partition_point(|(_, end)| *end <= index);
                Tint::numbered(ranks.get(at).map_or(0, |(rank, _)| *rank))
            }
            ColorBy::Contacts => {
                live.and_then(|live| live.contacts.get(index)).map_or(colors::UNKNOWN, |&count| contacts(count))
            }
            // Where none may sleep, nothing is said.
            ColorBy::Asleep => Tint::asleep(live.map(|live| live.asleep.get(index).copied().unwrap_or(false))),
        }
    }
}

/// The color of a body with so many contacts.
pub(super) fn contacts(count: u16) -> Rgb {
    Scale::Amount.at(f32::from(count.min(MOST_CONTACTS)) / f32::from(MOST_CONTACTS))
}
