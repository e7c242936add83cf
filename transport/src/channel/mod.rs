//! Ranks as threads of one process, joined by channels.
//!
//! Every directed pair of ranks has a channel of its own, of two messages, which is all that lockstep leaves unread. A
//! channel shared by several senders would stay open while any of them lives and so hide a dead one.
//!
//! [`run`] starts the threads, and is what programs and tests want. [`connect`] gives the unconnected ends for threads
//! that are started in some other way.
//!
//! # How a rank ends
//!
//! A rank's channels close when its [`Channel`] is dropped, and that is how its peers notice: at once, where they wait
//! for it, and after what it had sent has been received. If the drop is part of a panic, it counts as one. So keep
//! the endpoint inside the code that may panic, and drop it where the rank's work is done.
//!
//! The first failure is recorded, before the channels of that rank close, in a slot that all ranks share. A rank that
//! finds a channel closed reports that record, so all name the same culprit through any chain of ranks that gave up in
//! between. A rank that simply left is recorded only when another one still needs it.

mod links;
mod run;
#[cfg(test)]
mod tests;

use std::time::Duration;

pub use self::run::run;

use self::links::Links;
use crate::error::Aborted;
use crate::{Buffers, Incoming, Outgoing, Rank, Transport, TransportError};

/// How the ranks of a run are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChannelOptions {
    /// How long a rank waits in one exchange for the others before it gives up, more than zero. Default 30 s.
    ///
    /// It must exceed the longest time by which one rank may lag behind another. Raising it lengthens the wait for a
    /// rank that hangs; ranks that panic or leave are noticed at once in any case.
    pub peer_timeout: Duration,
}

impl Default for ChannelOptions {
    fn default() -> ChannelOptions {
        ChannelOptions { peer_timeout: Duration::from_secs(30) }
    }
}

/// Joins `size` ranks, each with all others, and returns their ends in rank order.
///
/// This makes `size * (size - 1)` channels, of well under a kilobyte each.
///
/// # Errors
/// [`Usage`](TransportError::Usage) if there are no ranks, or more than 32 bits can number, or if the peer timeout is
/// zero.
pub fn connect(size: usize, options: ChannelOptions) -> Result<Vec<Builder>, TransportError> {
    if size == 0 || u32::try_from(size).is_err() {
        return Err(TransportError::usage(format!(
            "cannot join {size} ranks; ask for at least 1 and at most {}",
            u32::MAX
        )));
    }
    if options.peer_timeout.is_zero() {
        return Err(TransportError::usage("the peer timeout is zero, so every wait would fail; give it some seconds"));
    }
    Ok(links::join(size, options.peer_timeout).into_iter().map(|links| Builder { links }).collect())
}

/// The end of one rank on its way to that rank's thread.
///
/// Dropping it unbuilt tells the other ranks that this one never started.
#[derive(Debug)]
pub struct Builder {
    links: Links,
}

impl Builder {
    /// The rank this end is for.
    pub fn rank(&self) -> Rank {
        self.links.rank()
    }

    /// Makes the endpoint. Call this on the rank's own thread.
    pub fn build(mut self) -> Channel {
        self.links.join_run();
        let buffers = Buffers::new(self.links.rank(), self.links.size());
        Channel { links: self.links, buffers }
    }
}

/// The endpoint of one rank among threads.
#[derive(Debug)]
pub struct Channel {
    links: Links,
    buffers: Buffers,
}

impl Transport for Channel {
    fn rank(&self) -> Rank {
        self.links.rank()
    }

    fn size(&self) -> usize {
        self.links.size()
    }

    fn prepare(&mut self, lengths: &[usize]) -> Result<&mut Outgoing, TransportError> {
        self.links.check()?;
        self.buffers.prepare(lengths)
    }

    fn exchange(&mut self, incoming: &mut Incoming) -> Result<(), TransportError> {
        self.links.check()?;
        let word = self.buffers.begin_exchange(incoming)?;
        let result = self.links.exchange((&mut self.buffers, word), incoming);
        if result.is_err() {
            incoming.clear();
        }
        result
    }

    fn abort(&mut self, reason: &str) -> ! {
        self.links.abort(reason);
        Aborted::unwind(self.links.rank(), reason)
    }
}
