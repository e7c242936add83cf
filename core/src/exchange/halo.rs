//! The one thing physics asks of the outside, and what all ranks must hear.

use super::mail::{Inbox, Outbox};
use crate::model::id::{GlobalId, TileId};
use thiserror::Error;

/// Carries the messages of one sync point.
///
/// `exchange` is called by every rank of a run the same number of times. It must bring each message of each rank's
/// outbox to the inbox of the rank that holds its destination tile, and every rank's [`Verdict`] to every rank, before
/// it returns. Order of arrival does not matter. Within one rank [`Outbox::deliver`] does it all.
pub trait Halo {
    /// What the outside can fail with.
    type Error;

    /// One sync point.
    fn exchange(&mut self, outbox: &mut Outbox, inbox: &mut Inbox) -> Result<(), Self::Error>;
}

/// The halo of a world that holds every tile of its grid: each message is delivered on the spot.
#[derive(Clone, Copy, Default, Debug)]
pub struct Loopback;

/// A message for a tile that the world does not hold, where nobody carries it to those who do.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[error(
    "there is a message for tile {tile}, which this world does not hold; give the world every tile of its grid, or carry messages by a halo of your own"
)]
pub struct NotHere {
    /// Its destination.
    pub tile: TileId,
}

impl Halo for Loopback {
    type Error = NotHere;

    fn exchange(&mut self, outbox: &mut Outbox, inbox: &mut Inbox) -> Result<(), NotHere> {
        match outbox.deliver(inbox) {
            Some(tile) => Err(NotHere { tile }),
            None => Ok(()),
        }
    }
}

/// What every rank must know of every other: rides on each exchange.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Verdict {
    /// Somebody asks the run to stop.
    pub stop: bool,
    /// A check failed: the step and the lowest body concerned.
    pub failure: Option<(u64, GlobalId)>,
}

impl Verdict {
    /// Joins two: any stop, the earliest failure.
    pub fn merge(self, other: Self) -> Self {
        let failure = match (self.failure, other.failure) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        Self { stop: self.stop | other.stop, failure }
    }

    /// As a word for the outside to carry: the least word of all ranks stands for all their verdicts joined. A failure
    /// hides a stop, which makes no difference: it ends the run.
    pub fn to_word(self) -> u128 {
        match self {
            // A run never counts as many steps as would make this one of the words below.
            Self { failure: Some((step, id)), .. } => u128::from(step) << 64 | u128::from(id.0),
            Self { stop: true, .. } => Self::STOP,
            Self { stop: false, .. } => Self::NOTHING,
        }
    }

    /// Reads [`to_word`](Self::to_word).
    pub fn from_word(word: u128) -> Self {
        match word {
            Self::NOTHING => Self::default(),
            Self::STOP => Self { stop: true, failure: None },
            _ => Self { stop: false, failure: Some(((word >> 64) as u64, GlobalId(word as u64))) },
        }
    }

    const NOTHING: u128 = u128::MAX;
    const STOP: u128 = u128::MAX - 1;
}
