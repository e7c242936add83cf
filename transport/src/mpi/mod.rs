//! Ranks as processes of an MPI job, on one machine or many.
//!
//! Behind the cargo feature `mpi`, which needs an MPI library to build with. The program is started by that library's own
//! launcher, as in `mpirun -n 4 program`; with another one's, each process finds itself alone, which a program can
//! tell by [`launched`]. Each process calls [`Mpi::init`] once and passes the endpoint to the code that needs it.
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
//!   [`abort`](Transport::abort) or [`abort_with`](Mpi::abort_with), which end all processes of the job.
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
mod notice;
mod pause;
mod raw;
mod session;
mod sparse;

use std::fmt;
use std::io::{Write, stderr, stdout};
use std::marker::PhantomData;
use std::thread;
use std::time::{Duration, Instant};

use self::alltoallv::longest_in_collective;
use self::raw::Library;
use self::session::Session;
use crate::{Incoming, Outgoing, Rank, Transport, TransportError};

/// The exit code of a job that a rank ended by [`abort`](Transport::abort) or by a panic.
pub const ABORTED: i32 = 3;

/// How long ending the job may take before the process ends by itself. Where the network is cut, the library may wait
/// for ever.
const ABORT_LIMIT: Duration = Duration::from_secs(3);

/// How long a rank stays that ends the job, because some launchers lose what was printed just before.
const LAST_WORDS: Duration = Duration::from_millis(100);

/// How long a rank stays that another has told why the run is over: that one says so, and ends the job itself.
const HEARING: Duration = Duration::from_secs(3);

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

/// What a launcher says about this process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Launched {
    /// How many ranks it has started.
    pub size: usize,
    /// Which of them this is.
    pub rank: Rank,
}

/// What the launcher says, if there was one that says it: `mpirun` of Open MPI or of MPICH and those like it, or `srun`.
///
/// If its number of ranks is not the [size](Transport::size) of the run, the program was started by the launcher of
/// another MPI than the one that it was built with.
pub fn launched() -> Option<Launched> {
    launched_in(|name| std::env::var(name).ok())
}

/// Whether a launcher of MPI started this process, or another one in a way that MPI understands, so that it can join
/// others.
pub fn can_join_others() -> bool {
    ["OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK"].iter().any(|name| std::env::var_os(name).is_some())
}

fn launched_in(variable: impl Fn(&str) -> Option<String>) -> Option<Launched> {
    let number = |name| variable(name)?.parse().ok();
    let names = [
        ("OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"),
        ("PMI_SIZE", "PMI_RANK"),
        // The last, as a launcher within a job of Slurm may have been started by srun itself.
        ("SLURM_STEP_NUM_TASKS", "SLURM_PROCID"),
    ];
    let found = |(size, rank)| Some(Launched { size: number(size)? as usize, rank: Rank(number(rank)?) });
    names.into_iter().find_map(found)
}

/// The endpoint of one process in an MPI job. It stays on the thread that made it.
pub struct Mpi {
    rank: Rank,
    size: usize,
    method: Method,
    /// Of the round that is prepared.
    prepared: Method,
    outgoing: Outgoing,
    state: State,
    /// Whether another rank has told all others why the run is over.
    told_by_other: bool,
    /// The library is to be called by one thread.
    stays_on_thread: PhantomData<*const ()>,
}

enum State {
    Open(Box<Session>),
    Failed(TransportError),
    Closed,
}

impl Mpi {
    /// Joins the job. Every process calls this, once.
    ///
    /// # Errors
    /// [`Usage`](TransportError::Usage) if the library was initialized before or cannot be used by a program of several
    /// threads, or if the peer timeout is zero. A library that cannot start ends the process, with a message of its
    /// own.
    pub fn init(options: MpiOptions) -> Result<Mpi, TransportError> {
        check_peer_timeout(options.peer_timeout)?;
        let library = match Library::initialize() {
            Some(Ok(library)) => library,
            Some(Err(granted)) => {
                return Err(TransportError::usage(format!(
                    "{} grants threads as in {granted:?} only, and at least Funneled is needed; use one that was built \
                     with threads",
                    Mpi::library()
                )));
            }
            None => return Err(TransportError::usage("MPI was initialized before in this process; do that once")),
        };
        let session = Session::new(library, options.peer_timeout);
        let (rank, size) = (session.data.rank(), session.data.size());
        Ok(Mpi {
            rank,
            size,
            method: options.method,
            prepared: options.method,
            outgoing: Outgoing::flat(size),
            state: State::Open(Box::new(session)),
            told_by_other: false,
            stays_on_thread: PhantomData,
        })
    }

    /// The name and version of the MPI library, in its own words, on one line. It need not be initialized.
    pub fn library() -> String {
        let version = ::mpi::environment::library_version().unwrap_or_else(|_| "an MPI library".to_owned());
        // Behind the version some tell how and when they were built.
        let line = version.split(['\n', '\0', ',']).next().unwrap_or_default();
        line.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// How rounds are exchanged.
    pub fn method(&self) -> Method {
        self.method
    }

    /// Exchanges rounds in this way from the next prepare on. Every rank switches at the same round.
    pub fn set_method(&mut self, method: Method) {
        self.method = method;
    }

    /// Changes the peer timeout of [`MpiOptions`].
    ///
    /// # Errors
    /// [`Usage`](TransportError::Usage) if it is zero.
    pub fn set_peer_timeout(&mut self, peer_timeout: Duration) -> Result<(), TransportError> {
        check_peer_timeout(peer_timeout)?;
        if let State::Open(session) = &mut self.state {
            session.watch.peer_timeout = peer_timeout;
        }
        Ok(())
    }

    /// Whether it was another rank that told this one why the run is over. That one has found it out, and can best tell
    /// the user.
    pub fn told_by_other(&self) -> bool {
        self.told_by_other
    }

    /// Waits until every rank has closed its endpoint or dropped it, and finalizes the library. After that the endpoint
    /// is of no more use.
    ///
    /// # Errors
    /// If another rank gives up meanwhile, or does not come within the peer timeout, or if the endpoint had failed before.
    /// Then the process must end by [`abort_with`](Mpi::abort_with).
    pub fn close(&mut self) -> Result<(), TransportError> {
        match std::mem::replace(&mut self.state, State::Closed) {
            State::Closed => Ok(()),
            State::Open(session) => session.leave().inspect_err(|error| self.state = State::Failed(error.clone())),
            State::Failed(error) => {
                self.state = State::Failed(error.clone());
                Err(error)
            }
        }
    }

    /// Ends this process with this exit code, without any cleaning up, which might wait for other ranks.
    pub fn exit_at_once(code: i32) -> ! {
        raw::exit_at_once(code)
    }

    /// Ends all processes of the job, with this exit code, and says nothing. Once the endpoint is closed, this process
    /// alone.
    pub fn abort_with(&mut self, code: i32) -> ! {
        if self.told_by_other {
            thread::sleep(HEARING);
        }
        // If no thread can be had, there is still the library.
        let _ = thread::Builder::new().spawn(move || {
            thread::sleep(ABORT_LIMIT);
            raw::exit_at_once(code);
        });
        let _ = stdout().flush();
        thread::sleep(LAST_WORDS);
        match self.state {
            State::Closed => std::process::exit(code),
            State::Open(_) | State::Failed(_) => raw::abort_job(code),
        }
        raw::exit_at_once(code)
    }

    /// The session, where there is still one.
    fn session(&mut self) -> Result<&mut Session, TransportError> {
        match &mut self.state {
            State::Open(session) => Ok(session),
            State::Failed(error) => Err(error.clone()),
            State::Closed => {
                let rank = self.rank;
                Err(TransportError::usage(format!(
                    "rank {rank}: the endpoint is closed; close it after the last round"
                )))
            }
        }
    }

    /// Refuses lengths that cannot be sent.
    fn check_lengths(&self, lengths: &[usize]) -> Result<(), TransportError> {
        let rank = self.rank;
        let total = lengths.iter().try_fold(0, |total: usize, &length| total.checked_add(length));
        if total.is_none_or(|total| isize::try_from(total).is_err()) {
            return Err(TransportError::usage(format!(
                "rank {rank}: the messages of one round are longer than any memory; send less in a round"
            )));
        }
        let too_long = |(to, &length): (usize, &usize)| to != rank.index() && length > sparse::LONGEST;
        match lengths.iter().enumerate().position(too_long) {
            Some(to) if self.method == Method::Sparse => Err(TransportError::usage(format!(
                "rank {rank}: {} bytes to rank {to} in one message, and the sparse exchange sends at most {}; send less \
                 in a round, or use the exchange by alltoallv",
                lengths[to],
                sparse::LONGEST
            ))),
            _ => Ok(()),
        }
    }
}

fn check_peer_timeout(peer_timeout: Duration) -> Result<(), TransportError> {
    if peer_timeout.is_zero() {
        return Err(TransportError::usage("the peer timeout is zero, so every wait would fail; give it some seconds"));
    }
    Ok(())
}

impl Transport for Mpi {
    fn rank(&self) -> Rank {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    fn prepare(&mut self, lengths: &[usize]) -> Result<&mut Outgoing, TransportError> {
        self.session()?;
        self.outgoing.begin_prepare(self.rank, lengths)?;
        self.check_lengths(lengths)?;
        self.prepared = self.method;
        self.outgoing.as_flat().arrange(lengths, longest_in_collective(self.size));
        self.outgoing.end_prepare();
        Ok(&mut self.outgoing)
    }

    fn exchange(&mut self, incoming: &mut Incoming) -> Result<(), TransportError> {
        self.session()?;
        self.outgoing.begin_exchange(self.rank)?;
        let State::Open(session) = &mut self.state else { unreachable!("there is a session") };
        let started = Instant::now();
        incoming.begin(self.size);
        let result = match self.prepared {
            Method::Alltoallv => session.alltoallv(&mut self.outgoing, incoming, started),
            Method::Sparse => session.sparse(&mut self.outgoing, incoming, started),
        };
        match result {
            Ok(waited) => {
                session.watch.count_round();
                incoming.end(waited);
                Ok(())
            }
            Err(error) => {
                session.watch.give_up(&error);
                self.told_by_other = session.watch.told_by_other();
                self.state = State::Failed(error.clone());
                incoming.clear();
                Err(error)
            }
        }
    }

    /// Prints the reason on standard error and ends all processes of the job with exit code [`ABORTED`].
    fn abort(&mut self, reason: &str) -> ! {
        // A closed standard error must not keep the job from ending.
        let _ = stderr().write_all(format!("rank {}: {reason}\n", self.rank).as_bytes());
        self.abort_with(ABORTED)
    }
}

impl fmt::Debug for Mpi {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let state = match &self.state {
            State::Open(_) => "open",
            State::Failed(_) => "failed",
            State::Closed => "closed",
        };
        f.debug_struct("Mpi")
            .field("rank", &self.rank)
            .field("size", &self.size)
            .field("method", &self.method)
            .field("state", &state)
            .finish_non_exhaustive()
    }
}

impl Drop for Mpi {
    fn drop(&mut self) {
        if thread::panicking() && !matches!(self.state, State::Closed) {
            self.abort_with(ABORTED);
        }
        // Who wants to know calls it.
        let _ = self.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_library_says_its_name_on_one_line() {
        let name = Mpi::library();
        assert!(name.contains("MPI") && !name.contains('\n'), "{name}");
    }

    #[test]
    fn launchers_say_how_many_ranks_there_are_and_which_this_is() {
        let with = |variables: &'static [(&str, &str)]| {
            launched_in(move |asked| Some(variables.iter().find(|(name, _)| *name == asked)?.1.to_owned()))
        };
        let launched = |size, rank| Some(Launched { size, rank: Rank(rank) });
        assert_eq!(with(&[("OMPI_COMM_WORLD_SIZE", "4"), ("OMPI_COMM_WORLD_RANK", "3")]), launched(4, 3));
        assert_eq!(with(&[("PMI_SIZE", "8"), ("PMI_RANK", "0")]), launched(8, 0));
        let within_slurm = &[
            ("SLURM_STEP_NUM_TASKS", "2"),
            ("SLURM_PROCID", "1"),
            ("OMPI_COMM_WORLD_SIZE", "16"),
            ("OMPI_COMM_WORLD_RANK", "9"),
        ];
        assert_eq!(with(&within_slurm[..2]), launched(2, 1));
        assert_eq!(with(within_slurm), launched(16, 9));
        assert_eq!(with(&[("PMI_SIZE", "many"), ("PMI_RANK", "0")]), None);
        assert_eq!(with(&[("HOME", "1")]), None);
    }

    #[test]
    fn a_peer_timeout_of_zero_is_refused_before_anything_else() {
        let error = Mpi::init(MpiOptions { peer_timeout: Duration::ZERO, ..MpiOptions::default() }).unwrap_err();
        assert!(error.to_string().contains("peer timeout is zero"), "{error}");
    }
}
