//! Counts what passes between ranks.

use std::ops::AddAssign;

use crate::{Incoming, Outgoing, Rank, Transport, TransportError};

/// Traffic of one rank with the *other* ranks. What a rank sends to itself is not counted, nor are empty messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stats {
    /// Completed exchanges.
    pub exchanges: u64,
    /// Messages sent that were not empty.
    pub messages_sent: u64,
    /// Messages received that were not empty.
    pub messages_received: u64,
    /// Bytes sent.
    pub bytes_sent: u64,
    /// Bytes received.
    pub bytes_received: u64,
}

impl Stats {
    /// What was added since `earlier`, an older reading of the same endpoint.
    pub fn since(&self, earlier: &Stats) -> Stats {
        Stats {
            exchanges: self.exchanges - earlier.exchanges,
            messages_sent: self.messages_sent - earlier.messages_sent,
            messages_received: self.messages_received - earlier.messages_received,
            bytes_sent: self.bytes_sent - earlier.bytes_sent,
            bytes_received: self.bytes_received - earlier.bytes_received,
        }
    }
}

impl AddAssign for Stats {
    fn add_assign(&mut self, other: Stats) {
        self.exchanges += other.exchanges;
        self.messages_sent += other.messages_sent;
        self.messages_received += other.messages_received;
        self.bytes_sent += other.bytes_sent;
        self.bytes_received += other.bytes_received;
    }
}

/// A transport that counts its traffic and otherwise behaves as the one it wraps.
///
/// Only exchanges that succeed are counted.
#[derive(Debug)]
pub struct Counting<T> {
    inner: T,
    stats: Stats,
    /// Messages and bytes of the round that is prepared.
    prepared: (u64, u64),
}

impl<T: Transport> Counting<T> {
    /// Counts from zero what passes through `inner`.
    pub fn new(inner: T) -> Counting<T> {
        Counting { inner, stats: Stats::default(), prepared: (0, 0) }
    }

    /// What was counted so far.
    pub fn stats(&self) -> Stats {
        self.stats
    }

    /// Gives the wrapped transport back.
    pub fn into_inner(self) -> T {
        self.inner
    }
}

/// The number of non-empty messages between `own` and other ranks, and the sum of their lengths.
fn traffic(own: Rank, lengths: impl Iterator<Item = usize>) -> (u64, u64) {
    let others = lengths.enumerate().filter(|&(index, length)| index != own.index() && length > 0);
    others.fold((0, 0), |(messages, bytes), (_, length)| (messages + 1, bytes + length as u64))
}

impl<T: Transport> Transport for Counting<T> {
    fn rank(&self) -> Rank {
        self.inner.rank()
    }

    fn size(&self) -> usize {
        self.inner.size()
    }

    fn prepare(&mut self, lengths: &[usize]) -> Result<&mut Outgoing, TransportError> {
        self.prepared = traffic(self.inner.rank(), lengths.iter().copied());
        self.inner.prepare(lengths)
    }

    fn exchange(&mut self, incoming: &mut Incoming) -> Result<(), TransportError> {
        self.inner.exchange(incoming)?;
        let received = traffic(self.inner.rank(), incoming.iter().map(|(_, frame)| frame.len()));
        self.stats += Stats {
            exchanges: 1,
            messages_sent: self.prepared.0,
            messages_received: received.0,
            bytes_sent: self.prepared.1,
            bytes_received: received.1,
        };
        Ok(())
    }

    fn abort(&mut self, reason: &str) -> ! {
        self.inner.abort(reason)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::local::Local;

    #[test]
    fn messages_to_oneself_and_failed_rounds_do_not_count() {
        let mut counting = Counting::new(Local::new());
        let mut incoming = Incoming::default();
        counting.prepare(&[100]).unwrap();
        counting.exchange(&mut incoming).unwrap();
        assert!(counting.prepare(&[1, 2]).is_err());
        assert!(counting.exchange(&mut incoming).is_err());
        assert_eq!(counting.stats(), Stats { exchanges: 1, ..Stats::default() });
    }

    #[test]
    fn traffic_leaves_out_the_own_and_the_empty() {
        assert_eq!(traffic(Rank(1), [3, 50, 0, 4].into_iter()), (2, 7));
    }

    #[test]
    fn since_undoes_addition() {
        let first = Stats { exchanges: 1, messages_sent: 2, messages_received: 3, bytes_sent: 4, bytes_received: 5 };
        let mut second = first;
        second += first;
        assert_eq!(second.since(&first), first);
    }
}
