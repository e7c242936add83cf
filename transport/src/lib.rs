//! Bytes between the ranks of a run.
//!
//! A run has `size` ranks, threads or processes, that advance in rounds. In each round every rank sends one message,
//! possibly empty, to every rank and receives one from each. [`Transport`] is that round; what the bytes mean is the
//! caller's business.
//!
//! ```
//! use atoll_transport::channel::{self, ChannelOptions};
//! use atoll_transport::{Collective, Incoming, Transport};
//!
//! let results = channel::run(3, ChannelOptions::default(), |mut endpoint| {
//!     let mut incoming = Incoming::default();
//!     for round in 0..10 {
//!         // One byte to every rank, written where the backend wants it.
//!         let outgoing = endpoint.prepare(&[1, 1, 1])?;
//!         for (to, buffer) in outgoing.iter_mut() {
//!             buffer[0] = round + to.0 as u8;
//!         }
//!         endpoint.exchange(&mut incoming)?;
//!         for (_from, message) in incoming.iter() {
//!             assert_eq!(message, [round + endpoint.rank().0 as u8]);
//!         }
//!     }
//!     endpoint.all_sum_u64(1)
//! });
//! for result in results {
//!     assert_eq!(result.expect("no rank panics")?, 3);
//! }
//! # Ok::<(), atoll_transport::TransportError>(())
//! ```
//!
//! # The contract
//!
//! What every backend promises, and [`conformance`] tests:
//!
//! 1. **Identity.** [`rank`](Transport::rank) and [`size`](Transport::size) never change; the ranks are `0 .. size`.
//! 2. **A round** is one [`prepare`](Transport::prepare), giving the length of every message and returning buffers of
//!    exactly these lengths, and one [`exchange`](Transport::exchange), which sends them and returns when the
//!    message of every rank has arrived. A message to oneself is allowed and costs at most one copy. An empty message
//!    is a message. Nothing is lost, duplicated, truncated or reordered, and a message of one round is never seen in
//!    another, however much faster one rank is than the next.
//!    Beside its messages every rank may [set a flag word](Outgoing::set_flag_word); every rank gets the [least of
//!    all](Incoming::flag_word) of the same round, also from ranks that send it nothing.
//! 3. **Lockstep.** Every rank makes the same sequence of exchanges. A rank can therefore be at most one round ahead of
//!    a peer, so *at most two messages are ever unread between two ranks*, and a backend needs no more room than that
//!    to send without waiting.
//! 4. **Memory.** Both sides of a round lie in memory of the backend: [`Outgoing`] is encoded into in place, and
//!    [`Incoming`] is read in place until the next exchange that is given the same value, which returns that memory
//!    first. At least three such values may hold messages at once. With one, after the first rounds, an exchange of
//!    messages no longer than before allocates no memory for them. Neither type says what the memory is: a buffer moved
//!    from thread to thread, a loaned slice of shared memory, or a part of one flat buffer that a message-passing
//!    library scatters and gathers.
//! 5. **Misuse** is answered with [`TransportError::Usage`]: a wrong number of lengths, or an exchange without a
//!    prepare. Nothing is sent and the endpoint stays usable. A prepare that fails, like one that succeeds, discards
//!    what was prepared before.
//! 6. **Lost ranks.** When a rank panics, aborts or leaves, every other rank that still needs something from it fails
//!    with [`TransportError::PeerLost`], and one that stays silent for the peer timeout gives
//!    [`TransportError::Timeout`]. No rank waits for ever. The error names the rank *where it began*: if rank 1
//!    gives up because rank 2 is gone, rank 0 hears of rank 2. What a rank had sent before it left still arrives, so
//!    ranks may end a run at different times. After such an error every call gives the same error again.
//!    Where the ranks are processes of one job, the end of a rank may be the end of all, before they can say anything. A
//!    rank that itself cannot go on, for want of memory or of its launcher, is lost in this sense, to itself as well.
//! 7. **Abort.** [`abort`](Transport::abort) tells the other ranks why and never returns. Where ranks are threads, or
//!    processes that a launcher watches over, it unwinds the calling thread with an [`Aborted`] payload and leaves the
//!    process alone. Where they are processes of one job, it ends them all, with the reason on standard error.
//!
//! # Backends
//!
//! | module | ranks are | for |
//! |---|---|---|
//! | [`local`] | the calling thread, alone | one rank |
//! | [`channel`] | threads of one process | one machine, and emulating any other run |
//! | `iceoryx2`, with the cargo feature `iceoryx2` | processes of one machine, which share memory | one machine |
//! | `mpi`, with the cargo feature `mpi` | processes of an MPI job | clusters, and one machine |
//!
//! # A backend of your own
//!
//! It keeps [`Buffers`], and in an exchange moves them to where they go, however that is done: here two threads by a pipe each way. What of
//! the contract is about ranks that are lost is left to you; [`conformance`] tells whether you keep it.
//!
//! ```
//! use atoll_transport::{Aborted, Buffers, Incoming, Outgoing, Rank, Transport, TransportError};
//! use std::sync::mpsc::{Receiver, Sender, channel};
//! use std::time::Duration;
//!
//! struct Pipe {
//!     rank: Rank,
//!     buffers: Buffers,
//!     to: Sender<(Vec<u8>, u128)>,
//!     from: Receiver<(Vec<u8>, u128)>,
//! }
//!
//! impl Transport for Pipe {
//!     fn rank(&self) -> Rank {
//!         self.rank
//!     }
//!
//!     fn size(&self) -> usize {
//!         2
//!     }
//!
//!     fn prepare(&mut self, lengths: &[usize]) -> Result<&mut Outgoing, TransportError> {
//!         self.buffers.prepare(lengths)
//!     }
//!
//!     fn exchange(&mut self, incoming: &mut Incoming) -> Result<(), TransportError> {
//!         let peer = Rank(1 - self.rank.0);
//!         let word = self.buffers.begin_exchange(incoming)?;
//!         let own = self.buffers.take(self.rank, incoming);
//!         incoming.accept(self.rank, own, word);
//!         let lost = || TransportError::PeerLost { rank: peer, reason: "its pipe is closed".to_owned() };
//!         self.to.send((self.buffers.take(peer, incoming), word)).map_err(|_| lost())?;
//!         let (message, word) = self.from.recv().map_err(|_| lost())?;
//!         incoming.accept(peer, message, word);
//!         incoming.end(Duration::ZERO);
//!         Ok(())
//!     }
//!
//!     fn abort(&mut self, reason: &str) -> ! {
//!         Aborted::unwind(self.rank, reason)
//!     }
//! }
//!
//! let ((to_one, from_zero), (to_zero, from_one)) = (channel(), channel());
//! let pipe = |rank, to, from| Pipe { rank, buffers: Buffers::new(rank, 2), to, from };
//! let (mut zero, mut one) = (pipe(Rank(0), to_one, from_one), pipe(Rank(1), to_zero, from_zero));
//! let other = std::thread::spawn(move || {
//!     one.prepare(&[3, 0])?.to(Rank(0)).copy_from_slice(b"one");
//!     one.exchange(&mut Incoming::default())
//! });
//! let mut incoming = Incoming::default();
//! zero.prepare(&[0, 0])?.set_flag_word(7);
//! zero.exchange(&mut incoming)?;
//! assert_eq!((incoming.from(Rank(1)), incoming.flag_word()), (&b"one"[..], 7));
//! other.join().expect("it ends")?;
//! # Ok::<(), TransportError>(())
//! ```
//!
//! [`Counting`] wraps any of them and counts traffic; [`Collective`] adds barrier, gather and ordered reductions.

// Allowed in the few files that meet memory shared with other processes.
#![deny(unsafe_code)]

pub mod channel;
mod collective;
pub mod conformance;
mod error;
mod frame;
#[cfg(feature = "iceoryx2")]
pub mod iceoryx2;
mod launched;
pub mod local;
#[cfg(feature = "mpi")]
pub mod mpi;
mod origin;
mod patience;
mod rank;
#[cfg(feature = "iceoryx2")]
mod seat;
mod stats;

pub use collective::Collective;
pub use error::{Aborted, RankFailure, TransportError};
pub use frame::{Buffers, Incoming, Outgoing};
pub use launched::{Launched, launched, ranks_here};
pub use rank::Rank;
pub use stats::{Counting, Stats};

/// One rank's end of a run. The [crate page](crate) states the contract that implementations keep.
pub trait Transport {
    /// The rank this endpoint belongs to.
    fn rank(&self) -> Rank;

    /// The number of ranks.
    fn size(&self) -> usize;

    /// Starts a round in which `lengths[r]` bytes go to rank `r`, this rank included, and returns the backend's own
    /// memory to write them into. Its contents are arbitrary until written.
    ///
    /// Preparing again before the exchange starts over.
    ///
    /// # Errors
    /// [`Usage`](TransportError::Usage) if there is not one length per rank. Otherwise the error that ended the run.
    fn prepare(&mut self, lengths: &[usize]) -> Result<&mut Outgoing, TransportError>;

    /// Sends what was prepared and receives exactly one message, possibly empty, from every rank, this one included.
    ///
    /// The messages that `incoming` held are given back first. After an error it holds nothing to rely on.
    ///
    /// # Errors
    /// [`Usage`](TransportError::Usage) if nothing was prepared; [`PeerLost`](TransportError::PeerLost) or
    /// [`Timeout`](TransportError::Timeout) if a message cannot arrive or does not.
    fn exchange(&mut self, incoming: &mut Incoming) -> Result<(), TransportError>;

    /// Ends this rank and lets every other rank know why.
    ///
    /// Where ranks are threads or watched processes, this unwinds the calling thread with an [`Aborted`] payload and
    /// never ends the process. Where they are processes of one job, it ends them all.
    fn abort(&mut self, reason: &str) -> !;
}

macro_rules! forward_transport {
    ($($pointer:ty),*) => {$(
        impl<T: Transport + ?Sized> Transport for $pointer {
            fn rank(&self) -> Rank {
                (**self).rank()
            }

            fn size(&self) -> usize {
                (**self).size()
            }

            fn prepare(&mut self, lengths: &[usize]) -> Result<&mut Outgoing, TransportError> {
                (**self).prepare(lengths)
            }

            fn exchange(&mut self, incoming: &mut Incoming) -> Result<(), TransportError> {
                (**self).exchange(incoming)
            }

            fn abort(&mut self, reason: &str) -> ! {
                (**self).abort(reason)
            }
        }
    )*};
}

forward_transport!(&mut T, Box<T>);
