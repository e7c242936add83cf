//! Ranks as processes of an MPI job, on one machine or many.
//!
//! Behind the cargo feature `mpi`, which needs an MPI library to build with. The program is started by that library's own
//! launcher, as in `mpirun -n 4 program`; with another one's, each process finds itself alone, which a program can
//! tell by [`launched()`](crate::launched()). Each process calls [`Mpi::init`] once and passes the endpoint to the code that needs it.
//!
//! There are two ways to exchange a round, a [`Method`] each, with the same results. Every rank switches at the same
//! round.
//!
//! # How a rank ends
//!
//! - **Well:** [`close`](Mpi::close), or dropping the endpoint, waits until every rank does so and finalizes the
//!   library. Ranks may come there at different times, within the peer timeout; a final barrier of the program makes
//!   them come together.
//! - **After an error** of an exchange or of `close` the job cannot be saved, as the library cannot go on without a
//!   rank. Dropping the endpoint then does nothing; finalizing would wait for ever. The process must end by
//!   [`abort`](crate::Transport::abort) or [`abort_with`](Mpi::abort_with), which end all processes of the job.
//! - **By a panic:** an endpoint that is dropped by one ends the job with [`ABORTED`], after the panic's message was
//!   printed.
//!
//! So in most cases the loss of one rank is also the end of the others, and it is the lost rank's own message that tells
//! why. A rank that leaves early or is silent is found out by the others, though, and named in their error.
//!
//! # How a lost rank is found out
//!
//! The library has no notion of a peer that is gone; an operation that needs it just never ends. So nothing here blocks:
//! a rank that waits asks the library again and again, and now and then looks for notices of other ranks: that one left
//! before this round, or gave up, and why. At the peer timeout it asks all others for a sign of life, which each gives
//! that waits itself, and a second later blames the lowest one that gave none: it computes for too long, hangs, or is
//! cut off. Of several that find it out, the lowest speaks. These notices go from every rank to every other, but only where
//! something is wrong, or at the end. Starting and finalizing the library itself have no deadline: if a rank dies just
//! then, it is up to the launcher to end the others.
//!
//! Where a host is cut off, the ranks on both sides end; the launcher may still wait for that host, Open MPI's for many
//! minutes. Start it under a time limit where that matters.

mod alltoallv;
mod control;
mod endpoint;
mod notice;
mod pause;
mod raw;
mod session;
mod sparse;

use std::time::Duration;

pub use self::endpoint::Mpi;

/// The exit code of a job that a rank ended by [`abort`](crate::Transport::abort) or by a panic.
pub const ABORTED: i32 = 3;

/// How a round is exchanged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// `MPI_Ialltoall` for the lengths, then `MPI_Ialltoallv`. Every rank hears from every other in each round, which is
    /// right for hundreds of ranks.
    #[default]
    Alltoallv,
    /// Messages go only between ranks that have something to say (nonblocking consensus: Hoefler, Siebert and Lumsdaine,
    /// 2010), which is right for many thousands of ranks. A message is at most 2 GiB long.
    Sparse,
}

/// How the ranks of a job are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MpiOptions {
    /// How long a rank waits in one exchange for the others before it asks who is still there, more than zero. Default
    /// 30 s.
    ///
    /// It must exceed the longest time by which one rank may lag behind another.
    pub peer_timeout: Duration,
    /// The same on every rank. Default [`Method::Alltoallv`].
    pub method: Method,
}

impl Default for MpiOptions {
    fn default() -> MpiOptions {
        MpiOptions { peer_timeout: Duration::from_secs(30), method: Method::default() }
    }
}
