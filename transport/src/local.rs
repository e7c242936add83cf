//! One rank alone: messages to oneself, in memory.

use crate::error::Aborted;
use crate::{Buffers, Incoming, Outgoing, Rank, Transport, TransportError};
use std::time::Duration;

/// The only rank of a run of size 1.
///
/// ```
/// use atoll_transport::{Incoming, Rank, Transport, local::Local};
///
/// let mut local = Local::new();
/// local.prepare(&[5])?.to(Rank(0)).copy_from_slice(b"atoll");
/// let mut incoming = Incoming::default();
/// local.exchange(&mut incoming)?;
/// assert_eq!(incoming.from(Rank(0)), b"atoll");
/// # Ok::<(), atoll_transport::TransportError>(())
/// ```
#[derive(Debug)]
pub struct Local {
    buffers: Buffers,
}

impl Local {
    /// The endpoint of a run of one rank.
    pub fn new() -> Local {
        Local { buffers: Buffers::new(Rank(0), 1) }
    }
}

impl Default for Local {
    fn default() -> Local {
        Local::new()
    }
}

impl Transport for Local {
    fn rank(&self) -> Rank {
        Rank(0)
    }

    fn size(&self) -> usize {
        1
    }

    fn prepare(&mut self, lengths: &[usize]) -> Result<&mut Outgoing, TransportError> {
        self.buffers.prepare(lengths)
    }

    fn exchange(&mut self, incoming: &mut Incoming) -> Result<(), TransportError> {
        let word = self.buffers.begin_exchange(incoming)?;
        let message = self.buffers.take(Rank(0), incoming);
        incoming.accept(Rank(0), message, word);
        incoming.end(Duration::ZERO);
        Ok(())
    }

    fn abort(&mut self, reason: &str) -> ! {
        Aborted::unwind(self.rank(), reason)
    }
}
