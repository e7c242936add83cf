//! The calls of the MPI library, each with the memory that it works on.
//!
//! An operation under way owns its memory, and gives it back when it is complete. Let go of before that, it leaks the
//! memory, because the library may still write to it. (The requests of the `mpi` crate panic or end the process instead.)
//! The library's return codes say nothing, as its default is to end the job at any error.
#![allow(unsafe_code)]

mod communicator;
mod least;
mod transfers;

use std::ffi::c_int;
use std::mem::ManuallyDrop;

use ::mpi::Threading;
use ::mpi::environment::Universe;
use ::mpi::ffi;

pub(super) use self::communicator::Communicator;
pub(super) use self::least::{Least, from_halves, to_halves};
pub(super) use self::transfers::{Place, Transfers};

/// The library at work: initialized by this process, to be finalized by this thread.
pub(super) struct Library {
    universe: ManuallyDrop<Universe>,
}

impl Library {
    /// Initializes the library for a process of which one thread calls it, and gives the level of threading that it
    /// grants if that is not enough. None if it was initialized before.
    pub(super) fn initialize() -> Option<Result<Library, Threading>> {
        let (universe, granted) = ::mpi::initialize_with_threading(Threading::Funneled)?;
        Some(if granted >= Threading::Funneled {
            Ok(Library { universe: ManuallyDrop::new(universe) })
        } else {
            Err(granted)
        })
    }

    /// Finalizes the library, which waits until every rank does. Dropped without this it stays initialized.
    pub(super) fn finalize(self) {
        drop(ManuallyDrop::into_inner(self.universe));
    }
}

/// Ends every process of the job. It may take a while, and for ever where the network is cut.
pub(super) fn abort_job(code: i32) {
    // SAFETY: only reads the communicator of all ranks, which exists as long as the library is initialized.
    unsafe { ffi::MPI_Abort(ffi::RSMPI_COMM_WORLD, code) };
}

/// Ends this process without any cleaning up, which might wait for other processes.
pub(super) fn exit_at_once(code: i32) -> ! {
    // SAFETY: takes no memory and does not return.
    unsafe { libc::_exit(code) }
}

/// A number of bytes as the library counts them.
fn count(bytes: usize) -> c_int {
    c_int::try_from(bytes).expect("no call is given more bytes than 32 bits count")
}

/// A null request, which is complete.
fn no_request() -> ffi::MPI_Request {
    // SAFETY: a constant of the library.
    unsafe { ffi::RSMPI_REQUEST_NULL }
}

/// Whether all of these operations are complete; moves them on.
fn test_all(requests: &mut [ffi::MPI_Request]) -> bool {
    let mut done = 0;
    let number = c_int::try_from(requests.len()).expect("fewer requests than 32 bits count");
    // SAFETY: `number` requests lie there, each started by this file and not freed, and the statuses are not wanted.
    unsafe { ffi::MPI_Testall(number, requests.as_mut_ptr(), &mut done, ffi::RSMPI_STATUSES_IGNORE) };
    done != 0
}

/// Starts an operation and returns its request.
fn started(start: impl FnOnce(*mut ffi::MPI_Request)) -> ffi::MPI_Request {
    let mut request = no_request();
    start(&mut request);
    request
}

/// One operation under way and its memory.
#[must_use = "an operation that is let go of leaks its memory"]
pub(super) struct Pending<M> {
    request: [ffi::MPI_Request; 1],
    memory: ManuallyDrop<M>,
}

impl<M> Pending<M> {
    fn new(request: ffi::MPI_Request, memory: M) -> Pending<M> {
        Pending { request: [request], memory: ManuallyDrop::new(memory) }
    }

    /// Whether it is complete; moves it on.
    pub(super) fn test(&mut self) -> bool {
        test_all(&mut self.request)
    }

    /// Gives the memory back.
    ///
    /// # Panics
    /// If the operation was not found complete.
    pub(super) fn finish(self) -> M {
        assert!(self.request[0] == no_request(), "the operation is still under way");
        ManuallyDrop::into_inner(self.memory)
    }
}
