//! Which color a body has, and why.

use super::canvas::Rgb;
use super::colors::{self, Scale};
use crate::folder::recording::Row;
use crate::look::frame::{Frame, Setting};
use glam::DVec2;

/// What the color of a body tells.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
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
pub(super) struct Range {
    /// What has the last color of the scale, in m/s or rad/s.
    pub most: f32,
}

impl Range {
    /// Grows to what all but one in a hundred bodies have, rounded up to 1, 2 or 5 times a power of ten; shrinks never, so
    /// that a film does not flicker.
    pub(super) fn grow(&mut self, by: ColorBy, frame: &Frame) {
        let of: fn(&Row) -> f32 = match by {
            ColorBy::Speed => speed,
            ColorBy::Spin => |row| row.omega.abs(),
            _ => return,
        };
        let every = (frame.bodies.len() / SAMPLE).max(1) as u64;
        // By their names, as they come in another order on other ranks.
        let sample = frame.bodies.iter().filter(|row| row.id.is_multiple_of(every));
        let mut values: Vec<f32> = sample.map(of).filter(|value| value.is_finite()).collect();
        if values.is_empty() {
            return;
        }
        let at = (values.len() - 1) * 99 / 100;
        let high = *values.select_nth_unstable_by(at, f32::total_cmp).1;
        self.most = self.most.max(round_up(f64::from(high.max(1e-3))) as f32);
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

fn speed(row: &Row) -> f32 {
    (row.vx * row.vx + row.vy * row.vy).sqrt()
}

/// Gives the bodies of a frame their colors.
#[derive(Debug)]
pub(super) struct Paint<'a> {
    by: ColorBy,
    setting: &'a Setting,
    frame: &'a Frame,
    table: Vec<Rgb>,
    per_unit: f32,
}

impl<'a> Paint<'a> {
    pub(super) fn new(by: ColorBy, setting: &'a Setting, frame: &'a Frame, range: Range) -> Self {
        let table = match by {
            ColorBy::Spin => Scale::Ways.table(),
            _ => Scale::Amount.table(),
        };
        Self { by, setting, frame, table, per_unit: 255.0 / range.most }
    }

    /// The color of the body with that index.
    #[inline]
    pub(super) fn color(&self, index: usize, row: &Row) -> Rgb {
        let live = self.frame.live.as_ref();
        match self.by {
            ColorBy::Kind => colors::distinct(row.kind),
            ColorBy::Speed => self.table[(speed(row) * self.per_unit).min(255.0) as usize],
            ColorBy::Spin => self.table[(127.5 + 0.5 * row.omega * self.per_unit).clamp(0.0, 255.0) as usize],
            ColorBy::Tile => {
                let tile = self.setting.grid.locate(DVec2::new(row.x, row.y)).0 as usize;
                let columns = self.setting.grid.columns();
                colors::tile(tile % columns, tile / columns)
            }
            ColorBy::Rank => {
                let ranks = &self.frame.ranks;
                let at = ranks.partition_point(|(_, end)| *end <= index);
                colors::distinct(ranks.get(at).map_or(0, |(rank, _)| *rank))
            }
            ColorBy::Contacts => {
                live.and_then(|live| live.contacts.get(index)).map_or(colors::UNKNOWN, |&count| contacts(count))
            }
            ColorBy::Asleep => match live.and_then(|live| live.asleep.get(index)) {
                Some(true) => colors::ASLEEP,
                Some(false) => colors::AWAKE,
                // Where none may sleep, nothing is said.
                None => live.map_or(colors::UNKNOWN, |_| colors::AWAKE),
            },
        }
    }
}

/// The color of a body with so many contacts.
pub(super) fn contacts(count: u16) -> Rgb {
    Scale::Amount.at(f32::from(count.min(MOST_CONTACTS)) / f32::from(MOST_CONTACTS))
}
