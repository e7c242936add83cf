//! The halo of the physics over a transport: one frame per pair of ranks and sync point.

use super::balance::thread_time;
use crate::plan::Assignment;
use atoll_core::{CodecError, Frames, Halo, Inbox, Outbox, RestoreError, TileId, Verdict};
use atoll_transport::{Incoming, Rank, Transport, TransportError};
use std::time::Duration;
use thiserror::Error;
use tracing::trace_span;

/// Why a sync point failed.
#[derive(Clone, PartialEq, Debug, Error)]
pub(crate) enum ExchangeError {
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
    /// A tile came that cannot be taken over.
    #[error("rank {from} handed over what cannot be read: {error}")]
    Tile {
        /// Who gave it up.
        from: Rank,
        /// What is wrong with it.
        error: RestoreError,
    },
}

/// One rank's halo.
#[derive(Debug)]
pub(crate) struct RankHalo<T> {
    transport: T,
    assignment: Assignment,
    /// What goes to each rank; kept for its memory.
    frames: Frames,
    /// What came last; kept for its memory.
    incoming: Incoming,
    waited: Duration,
    worked: Duration,
}

impl<T: Transport> RankHalo<T> {
    /// A halo that finds tiles by `assignment`, which every rank must hold alike.
    pub(crate) fn new(transport: T, assignment: Assignment) -> Self {
        let (frames, incoming) = Default::default();
        Self { transport, assignment, frames, incoming, waited: Duration::ZERO, worked: Duration::ZERO }
    }

    /// Who holds which tile.
    pub(crate) fn assignment(&self) -> &Assignment {
        &self.assignment
    }

    /// Both who holds which tile, and the transport.
    pub(crate) fn parts(&mut self) -> (&Assignment, &mut T) {
        (&self.assignment, &mut self.transport)
    }

    /// From here on tiles are held by others, on every rank alike.
    pub(crate) fn assign(&mut self, assignment: Assignment) {
        self.assignment = assignment;
    }

    /// How long this rank has worked in all sync points, and not waited.
    pub(crate) fn worked(&self) -> Duration {
        self.worked
    }

    /// How long this rank has waited for others in all sync points.
    pub(crate) fn waited(&self) -> Duration {
        self.waited
    }

    /// The transport, for what ranks do together outside of steps.
    pub(crate) fn transport(&mut self) -> &mut T {
        &mut self.transport
    }
}

impl<T: Transport> Halo for RankHalo<T> {
    type Error = ExchangeError;

    fn exchange(&mut self, outbox: &mut Outbox, inbox: &mut Inbox) -> Result<(), ExchangeError> {
        let begun = thread_time();
        let (own, size) = (self.transport.rank().index(), self.transport.size());
        self.frames.deal(outbox, size, own, &|tile: TileId| self.assignment.rank_of(tile));
        let outgoing = self.transport.prepare(self.frames.lengths())?;
        outgoing.set_flag_word(outbox.verdict().to_word());
        for (to, bytes) in outgoing.iter_mut().filter(|(_, bytes)| !bytes.is_empty()) {
            self.frames.encode(outbox, to.index(), bytes);
        }
        self.worked += thread_time().saturating_sub(begun);
        {
            let _span = trace_span!("wait").entered();
            self.transport.exchange(&mut self.incoming)?;
        }
        self.waited += self.incoming.waited();
        let begun = thread_time();
        // What stays on this rank never becomes bytes.
        let _ = outbox.deliver(inbox);
        inbox.hear(Verdict::from_word(self.incoming.flag_word()));
        for (from, bytes) in self.incoming.iter().filter(|(_, bytes)| !bytes.is_empty()) {
            inbox.decode(bytes).map_err(|error| ExchangeError::Frame { from, error })?;
        }
        self.worked += thread_time().saturating_sub(begun);
        Ok(())
    }
}
