//! The one thing physics asks of the outside.

use super::mail::{Inbox, Outbox};
use crate::model::error::StepError;
use crate::model::id::TileId;
use thiserror::Error;

/// Carries the messages of one sync point.
///
/// `exchange` is called by every rank of a run the same number of times. It must bring each message of each rank's
/// outbox to the inbox of the rank that holds its destination tile, and every rank's [`Verdict`](crate::Verdict) to every
/// rank, before it returns. Order of arrival does not matter. Within one rank [`Outbox::deliver`] does it all.
///
/// Each exactly once: a message that is lost, or comes twice, is not always noticed, and then the result is another. A halo that cannot
/// see to that returns an error, upon which the step fails.
pub trait Halo {
    /// What the outside can fail with.
    type Error;

    /// One sync point.
    fn exchange(&mut self, outbox: &mut Outbox, inbox: &mut Inbox) -> Result<(), Self::Error>;
}

/// A sync point of a halo whose type is not told: so the step is compiled once, and not for every halo again.
pub(crate) type Carry<'a> = dyn FnMut(&mut Outbox, &mut Inbox) -> Result<(), NotCarried> + 'a;

/// A sync point has failed; [`through`] knows why.
#[derive(Debug)]
pub(crate) struct NotCarried;

/// Does what needs a halo.
pub(crate) fn through<H: Halo, R>(
    halo: &mut H,
    act: impl FnOnce(&mut Carry<'_>) -> Result<R, StepError<NotCarried>>,
) -> Result<R, StepError<H::Error>> {
    let mut failure = None;
    let done = act(&mut |outbox, inbox| {
        halo.exchange(outbox, inbox).map_err(|error| {
            failure = Some(error);
            NotCarried
        })
    });
    done.map_err(|error| error.map_halo(|NotCarried| failure.expect("it has just been kept")))
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
