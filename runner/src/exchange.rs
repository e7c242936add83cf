//! The halo of the physics over a transport: one frame per pair of ranks and sync point.

use crate::assignment::Assignment;
use atoll_core::{CodecError, Halo, Inbox, Outbox, TileId};
use atoll_transport::{Incoming, Rank, Transport, TransportError};
use thiserror::Error;

/// Why a sync point failed.
#[derive(Clone, PartialEq, Debug, Error)]
pub enum ExchangeError {
    /// The bytes did not come through.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// They came through and make no sense.
    #[error("rank {from} sent what cannot be read: {error}")]
    Frame {
        /// The sender.
        from: Rank,
        /// What is wrong with it.
        error: CodecError,
    },
}

/// One rank's halo.
#[derive(Debug)]
pub struct RankHalo<'a, T> {
    transport: T,
    assignment: &'a Assignment,
    /// Bytes for each rank; kept for its memory.
    lengths: Vec<usize>,
    /// What came last; kept for its memory.
    incoming: Incoming,
}

impl<'a, T: Transport> RankHalo<'a, T> {
    /// A halo that finds tiles by `assignment`, which every rank must hold alike.
    pub fn new(transport: T, assignment: &'a Assignment) -> Self {
        Self { transport, assignment, lengths: Vec::new(), incoming: Incoming::default() }
    }

    /// The transport, for what ranks do together outside of steps.
    pub fn transport(&mut self) -> &mut T {
        &mut self.transport
    }
}

impl<T: Transport> Halo for RankHalo<'_, T> {
    type Error = ExchangeError;

    fn exchange(&mut self, outbox: &mut Outbox, inbox: &mut Inbox) -> Result<(), ExchangeError> {
        let (own, size) = (self.transport.rank(), self.transport.size());
        let rank_of = |tile: TileId| self.assignment.rank_of(tile);
        let others = || Rank::all(size).filter(|&rank| rank != own);

        outbox.frame_lengths(size, &rank_of, own.index(), &mut self.lengths);
        let outgoing = self.transport.prepare(&self.lengths)?;
        for to in others() {
            outbox.encode(to.index(), &rank_of, outgoing.to(to));
        }
        self.transport.exchange(&mut self.incoming)?;
        // What stays on this rank never becomes bytes.
        outbox.deliver(inbox);
        for from in others() {
            inbox.decode(self.incoming.from(from)).map_err(|error| ExchangeError::Frame { from, error })?;
        }
        Ok(())
    }
}
