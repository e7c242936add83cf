//! The one thing physics asks of the outside.

use super::mail::{Inbox, Outbox};
use crate::model::id::TileId;
use thiserror::Error;

/// Carries the messages of one sync point.
///
/// `exchange` is called by every rank of a run the same number of times. It must bring each message of each rank's
/// outbox to the inbox of the rank that holds its destination tile, and every rank's [`Verdict`](crate::Verdict) to every
/// rank, before it returns. Order of arrival does not matter. Within one rank [`Outbox::deliver`] does it all.
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
