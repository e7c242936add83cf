//! One rank's end of a job: its rounds, how it fails and how it ends.

use std::fmt;
use std::io::{Write, stderr, stdout};
use std::marker::PhantomData;
use std::thread;
use std::time::{Duration, Instant};

use super::alltoallv::longest_in_collective;
use super::raw::{self, Library};
use super::session::Session;
use super::{ABORTED, Method, MpiOptions, sparse};
use crate::{Incoming, Outgoing, Rank, Transport, TransportError};

/// How long ending the job may take before the process ends by itself. Where the network is cut, the library may wait
/// for ever.
const ABORT_LIMIT: Duration = Duration::from_secs(3);

/// How long a rank stays that ends the job, because some launchers lose what was printed just before.
const LAST_WORDS: Duration = Duration::from_millis(100);

/// How long a rank stays that another has told why the run is over: that one says so, and ends the job itself.
const HEARING: Duration = Duration::from_secs(3);

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
    fn a_peer_timeout_of_zero_is_refused_before_anything_else() {
        let error = Mpi::init(MpiOptions { peer_timeout: Duration::ZERO, ..MpiOptions::default() }).unwrap_err();
        assert!(error.to_string().contains("peer timeout is zero"), "{error}");
    }
}
