//! The memory of one round: what a rank sends and what it receives.
//!
//! Both types hide where their bytes live, so that a backend can hand out memory of its own: each kind of memory is a
//! variant of two private enums and a file here. Inside one process it is one `Vec<u8>` per rank ([`owned`]): a message
//! is moved, never copied, and the buffer that arrives from a peer is the next one to be filled for it. Between processes
//! of one machine it is a slice of shared memory per rank (`loaned`): written once, read in place. A message-passing library
//! gets one buffer with a part for each rank (`flat`).

mod buffers;
#[cfg(feature = "mpi")]
mod flat;
#[cfg(feature = "iceoryx2")]
mod loaned;
mod owned;

use crate::{Rank, TransportError};
pub use buffers::Buffers;
#[cfg(feature = "mpi")]
pub(crate) use flat::Flat;
#[cfg(feature = "iceoryx2")]
pub(crate) use loaned::{Header, Loan, LoanedFrame, LoanedIncoming, LoanedOutgoing, Message};
use owned::{OwnedIncoming, OwnedOutgoing};
use std::time::Duration;

/// The flag word of a rank that has nothing to say: the greatest, so that any other wins over it.
const NO_WORD: u128 = u128::MAX;

/// One writable buffer per destination, of exactly the length that was asked for in
/// [`prepare`](crate::Transport::prepare), and the flag word of this rank.
///
/// The buffers hold arbitrary bytes of earlier rounds until they are written. Parallel code shares the slices of
/// [`iter_mut`](Outgoing::iter_mut) between threads, not this type, whose memory may be bound to one thread.
#[derive(Debug)]
pub struct Outgoing {
    memory: OutgoingMemory,
    size: usize,
    flag_word: u128,
    /// Whether the buffers were prepared and not yet sent.
    ready: bool,
}

/// Where the bytes to send are.
#[derive(Debug)]
pub(crate) enum OutgoingMemory {
    Owned(OwnedOutgoing),
    #[cfg(feature = "iceoryx2")]
    Loaned(LoanedOutgoing),
    #[cfg(feature = "mpi")]
    Flat(Flat),
}

impl Outgoing {
    pub(crate) fn new(size: usize, memory: OutgoingMemory) -> Outgoing {
        Outgoing { memory, size, flag_word: NO_WORD, ready: false }
    }

    /// For backends that move a buffer per rank.
    pub(crate) fn owned(size: usize) -> Outgoing {
        Outgoing::new(size, OutgoingMemory::Owned(OwnedOutgoing::new(size)))
    }

    /// For the backend whose ranks share memory.
    #[cfg(feature = "iceoryx2")]
    pub(crate) fn loaned(own: Rank, size: usize) -> Outgoing {
        Outgoing::new(size, OutgoingMemory::Loaned(LoanedOutgoing::new(own, size)))
    }

    /// For backends that scatter one buffer.
    #[cfg(feature = "mpi")]
    pub(crate) fn flat(size: usize) -> Outgoing {
        Outgoing::new(size, OutgoingMemory::Flat(Flat::new(size)))
    }

    /// The number of destinations, which is the number of ranks.
    pub fn size(&self) -> usize {
        self.size
    }

    /// The buffer that goes to `rank`.
    ///
    /// # Panics
    /// If there is no such rank.
    pub fn to(&mut self, rank: Rank) -> &mut [u8] {
        match &mut self.memory {
            OutgoingMemory::Owned(frames) => frames.to(rank),
            #[cfg(feature = "iceoryx2")]
            OutgoingMemory::Loaned(frames) => frames.to(rank),
            #[cfg(feature = "mpi")]
            OutgoingMemory::Flat(flat) => flat.part_mut(rank),
        }
    }

    /// Every destination with its buffer, in rank order.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = (Rank, &mut [u8])> {
        let frames = match &mut self.memory {
            OutgoingMemory::Owned(frames) => FramesMut::Owned(frames.iter_mut()),
            #[cfg(feature = "iceoryx2")]
            OutgoingMemory::Loaned(frames) => FramesMut::Loaned(frames.iter_mut()),
            #[cfg(feature = "mpi")]
            OutgoingMemory::Flat(flat) => FramesMut::Flat(flat.iter_mut()),
        };
        Rank::all(self.size).zip(frames)
    }

    /// Sets the word that goes to every rank beside the messages; [`Incoming::flag_word`] is the least of all. Without
    /// this it is `u128::MAX`, which is never less than another's.
    pub fn set_flag_word(&mut self, word: u128) {
        self.flag_word = word;
    }

    /// The word of this rank.
    pub(crate) fn flag_word(&self) -> u128 {
        self.flag_word
    }

    /// The buffers of a backend that moves one per rank.
    fn as_owned(&mut self) -> &mut OwnedOutgoing {
        match &mut self.memory {
            OutgoingMemory::Owned(frames) => frames,
            #[cfg(any(feature = "iceoryx2", feature = "mpi"))]
            _ => unreachable!("an endpoint keeps the kind of memory it was made with"),
        }
    }

    /// The buffers of the backend whose ranks share memory.
    #[cfg(feature = "iceoryx2")]
    pub(crate) fn as_loaned(&mut self) -> &mut LoanedOutgoing {
        match &mut self.memory {
            OutgoingMemory::Loaned(frames) => frames,
            _ => unreachable!("an endpoint keeps the kind of memory it was made with"),
        }
    }

    /// The buffer of a backend that scatters one.
    #[cfg(feature = "mpi")]
    pub(crate) fn as_flat(&mut self) -> &mut Flat {
        match &mut self.memory {
            OutgoingMemory::Flat(flat) => flat,
            _ => unreachable!("an endpoint keeps the kind of memory it was made with"),
        }
    }

    /// Begins a prepare: what an earlier one prepared is discarded, whether or not the lengths are right.
    pub(crate) fn begin_prepare(&mut self, rank: Rank, lengths: &[usize]) -> Result<(), TransportError> {
        (self.flag_word, self.ready) = (NO_WORD, false);
        if lengths.len() == self.size {
            return Ok(());
        }
        Err(TransportError::usage(format!(
            "rank {rank}: prepare was given {} lengths for {} ranks; give one per rank, 0 for nothing to send",
            lengths.len(),
            self.size
        )))
    }

    /// Ends a prepare: the buffers have the lengths asked for.
    pub(crate) fn end_prepare(&mut self) {
        self.ready = true;
    }

    /// Begins the sending: the round is spent from here on.
    pub(crate) fn begin_exchange(&mut self, rank: Rank) -> Result<(), TransportError> {
        if std::mem::take(&mut self.ready) {
            Ok(())
        } else {
            Err(TransportError::usage(format!(
                "rank {rank}: exchange without prepare; prepare every round, with lengths 0 for nothing to send"
            )))
        }
    }
}

/// The buffers of [`Outgoing`], in rank order.
enum FramesMut<'a> {
    Owned(std::slice::IterMut<'a, Vec<u8>>),
    #[cfg(feature = "iceoryx2")]
    Loaned(std::slice::IterMut<'a, LoanedFrame>),
    #[cfg(feature = "mpi")]
    Flat(flat::PartsMut<'a>),
}

impl<'a> Iterator for FramesMut<'a> {
    type Item = &'a mut [u8];

    fn next(&mut self) -> Option<&'a mut [u8]> {
        match self {
            FramesMut::Owned(frames) => frames.next().map(Vec::as_mut_slice),
            #[cfg(feature = "iceoryx2")]
            FramesMut::Loaned(frames) => frames.next().map(LoanedFrame::bytes),
            #[cfg(feature = "mpi")]
            FramesMut::Flat(parts) => parts.next(),
        }
    }
}

/// What one round brought: one message from every rank, this one included, and the least of all flag words.
///
/// Keep one value and pass it to every exchange: its old messages become the memory of later ones, and then a warm
/// exchange allocates nothing. The messages stay valid until the next exchange that is given this value, or until it is
/// dropped. As with [`Outgoing`], share the slices between threads, not the value.
#[derive(Debug, Default)]
pub struct Incoming {
    memory: IncomingMemory,
    size: usize,
    flag_word: u128,
    waited: Duration,
}

/// Where the received bytes are.
#[derive(Debug)]
pub(crate) enum IncomingMemory {
    Owned(OwnedIncoming),
    #[cfg(feature = "iceoryx2")]
    Loaned(LoanedIncoming),
    #[cfg(feature = "mpi")]
    Flat(Flat),
}

impl Default for IncomingMemory {
    fn default() -> IncomingMemory {
        IncomingMemory::Owned(OwnedIncoming::default())
    }
}

impl Incoming {
    /// The number of sources: the number of ranks, or 0 before the first exchange.
    pub fn size(&self) -> usize {
        self.size
    }

    /// What `rank` sent, possibly nothing.
    ///
    /// # Panics
    /// If there is no such rank, or before the first exchange.
    pub fn from(&self, rank: Rank) -> &[u8] {
        match &self.memory {
            IncomingMemory::Owned(frames) => frames.from(rank),
            #[cfg(feature = "iceoryx2")]
            IncomingMemory::Loaned(frames) => frames.from(rank),
            #[cfg(feature = "mpi")]
            IncomingMemory::Flat(flat) => flat.part(rank),
        }
    }

    /// Every source with what it sent, in rank order.
    pub fn iter(&self) -> impl Iterator<Item = (Rank, &[u8])> {
        Rank::all(self.size).map(|rank| (rank, self.from(rank)))
    }

    /// The least of the words that the ranks set in this round.
    pub fn flag_word(&self) -> u128 {
        self.flag_word
    }

    /// The part of the exchange in which this rank, having sent everything, waited for others, or for bytes on their way.
    pub fn waited(&self) -> Duration {
        self.waited
    }

    /// Begins a round among so many ranks, whose flag words are all to be [`hear`](Incoming::hear)d.
    pub(crate) fn begin(&mut self, size: usize) {
        (self.size, self.flag_word) = (size, NO_WORD);
    }

    /// Takes the flag word of one rank into account.
    pub(crate) fn hear(&mut self, word: u128) {
        self.flag_word = self.flag_word.min(word);
    }

    /// Takes in the message of a rank, of a backend that moves [`Buffers`], and its flag word.
    ///
    /// # Panics
    /// If there is no such rank, or the exchange was not [begun](Buffers::begin_exchange).
    pub fn accept(&mut self, from: Rank, message: Vec<u8>, word: u128) {
        self.as_owned().replace(from, message);
        self.hear(word);
    }

    /// Ends a round in which the rank [waited](Incoming::waited) so long.
    pub fn end(&mut self, waited: Duration) {
        self.waited = waited;
    }

    /// Buffers for a backend that moves one per rank. Memory of another kind, from another endpoint, is given back.
    fn as_owned(&mut self) -> &mut OwnedIncoming {
        #[cfg(any(feature = "iceoryx2", feature = "mpi"))]
        if !matches!(self.memory, IncomingMemory::Owned(_)) {
            self.memory = IncomingMemory::default();
        }
        match &mut self.memory {
            IncomingMemory::Owned(frames) => frames,
            #[cfg(any(feature = "iceoryx2", feature = "mpi"))]
            _ => unreachable!("it was replaced"),
        }
    }

    /// Places for the backend whose ranks share memory. Memory of another kind is given up.
    #[cfg(feature = "iceoryx2")]
    pub(crate) fn as_loaned(&mut self) -> &mut LoanedIncoming {
        if !matches!(self.memory, IncomingMemory::Loaned(_)) {
            self.memory = IncomingMemory::Loaned(LoanedIncoming::default());
        }
        match &mut self.memory {
            IncomingMemory::Loaned(frames) => frames,
            _ => unreachable!("it was replaced"),
        }
    }

    /// The buffer for a backend that gathers into one. Memory of another kind is given up.
    #[cfg(feature = "mpi")]
    pub(crate) fn as_flat(&mut self) -> &mut Flat {
        if !matches!(self.memory, IncomingMemory::Flat(_)) {
            self.memory = IncomingMemory::Flat(Flat::new(self.size));
        }
        match &mut self.memory {
            IncomingMemory::Flat(flat) => flat,
            _ => unreachable!("it was replaced"),
        }
    }

    /// Forgets every message, so that a failed round cannot be mistaken for a received one.
    pub fn clear(&mut self) {
        *self = Incoming::default();
    }
}
