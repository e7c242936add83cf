//! Ranks that can talk to each other, and what goes on outside of rounds.

use std::ffi::{c_int, c_void};
use std::mem::MaybeUninit;

use ::mpi::ffi;

use super::{Library, Pending, count, started};
use crate::Rank;

/// Ranks that can talk to each other without being heard by other such groups.
pub(in crate::mpi) struct Communicator {
    pub(super) handle: ffi::MPI_Comm,
    pub(super) rank: Rank,
    pub(super) size: usize,
}

impl Communicator {
    /// All ranks of the job. All make this call together.
    pub(in crate::mpi) fn of_all_ranks(_library: &Library) -> Communicator {
        let (mut handle, mut rank, mut size) = (MaybeUninit::uninit(), 0, 0);
        // SAFETY: the library is initialized, and each call writes the place that it is given.
        let handle = unsafe {
            ffi::MPI_Comm_dup(ffi::RSMPI_COMM_WORLD, handle.as_mut_ptr());
            ffi::MPI_Comm_rank(ffi::RSMPI_COMM_WORLD, &mut rank);
            ffi::MPI_Comm_size(ffi::RSMPI_COMM_WORLD, &mut size);
            handle.assume_init()
        };
        let size = usize::try_from(size).expect("a job has some ranks");
        Communicator { handle, rank: Rank(rank.unsigned_abs()), size }
    }

    pub(in crate::mpi) fn rank(&self) -> Rank {
        self.rank
    }

    pub(in crate::mpi) fn size(&self) -> usize {
        self.size
    }

    pub(super) fn number_of(&self, rank: Rank) -> c_int {
        assert!(rank.index() < self.size, "there is no rank {rank}");
        c_int::try_from(rank.0).expect("the library numbers ranks with 31 bits")
    }

    /// Gives the communicator back. Every rank does it, after its last operation.
    pub(in crate::mpi) fn free(mut self) {
        // SAFETY: the handle was made by `MPI_Comm_dup` and is not used again.
        unsafe { ffi::MPI_Comm_free(&mut self.handle) };
    }

    /// Sends `send[r * n ..][.. n]` to rank `r` and receives the same from it into `receive`, where the length of both
    /// is `n` times the number of ranks, the same everywhere.
    pub(in crate::mpi) fn all_to_all(&self, mut send: Vec<u64>, mut receive: Vec<u64>) -> Pending<[Vec<u64>; 2]> {
        assert!(send.len() == receive.len() && send.len().is_multiple_of(self.size), "as many words for every rank");
        let each = count(send.len() / self.size);
        // SAFETY: both buffers hold `each` words per rank and belong to the operation until it is complete.
        let request = started(|request| unsafe {
            let (from, to) = (send.as_mut_ptr().cast::<c_void>(), receive.as_mut_ptr().cast());
            let word = ffi::RSMPI_UINT64_T;
            ffi::MPI_Ialltoall(from, each, word, to, each, word, self.handle, request);
        });
        Pending::new(request, [send, receive])
    }

    /// Begins a barrier.
    pub(in crate::mpi) fn barrier(&self) -> Pending<()> {
        // SAFETY: uses no memory of the caller.
        let request = started(|request| unsafe {
            ffi::MPI_Ibarrier(self.handle, request);
        });
        Pending::new(request, ())
    }

    /// Sends some bytes to one rank.
    pub(in crate::mpi) fn send(&self, to: Rank, tag: c_int, bytes: Vec<u8>) -> Pending<Vec<u8>> {
        let (to, length) = (self.number_of(to), count(bytes.len()));
        // SAFETY: the bytes belong to the operation until it is complete.
        let request = started(|request| unsafe {
            ffi::MPI_Isend(bytes.as_ptr().cast(), length, ffi::RSMPI_UINT8_T, to, tag, self.handle, request);
        });
        Pending::new(request, bytes)
    }

    /// A message of this tag that has arrived, if there is one. It has to be received.
    pub(in crate::mpi) fn arrived(&self, tag: c_int) -> Option<Arrived> {
        let mut found = 0;
        // The library need not write the whole status, so it begins with zeros.
        let (mut handle, mut status) = (MaybeUninit::uninit(), MaybeUninit::zeroed());
        // SAFETY: each place is written by the call; handle and status only where something is found.
        unsafe {
            let any = ffi::RSMPI_ANY_SOURCE;
            ffi::MPI_Improbe(any, tag, self.handle, &mut found, handle.as_mut_ptr(), status.as_mut_ptr());
        }
        if found == 0 {
            return None;
        }
        let mut length = 0;
        // SAFETY: a message was found, so both places are written, and zeros are a status as well.
        let (handle, status) = unsafe { (handle.assume_init(), status.assume_init()) };
        // SAFETY: the status is that of a message of bytes.
        unsafe { ffi::MPI_Get_count(&status, ffi::RSMPI_UINT8_T, &mut length) };
        let length = usize::try_from(length).expect("a message is of whole bytes");
        Some(Arrived { handle, from: Rank(status.MPI_SOURCE.unsigned_abs()), length })
    }
}

/// A message that has arrived and is not yet received.
pub(in crate::mpi) struct Arrived {
    handle: ffi::MPI_Message,
    pub(in crate::mpi) from: Rank,
    pub(in crate::mpi) length: usize,
}

impl Arrived {
    /// Receives it into memory of its own.
    pub(in crate::mpi) fn receive(self) -> Pending<Vec<u8>> {
        let mut bytes = vec![0; self.length];
        // SAFETY: the place is as long as the message and belongs to the operation until it is complete.
        let request = unsafe { self.receive_at(bytes.as_mut_ptr()) };
        Pending::new(request, bytes)
    }

    /// # Safety
    /// So many bytes as the message has can be written at `place` until the operation is complete.
    pub(super) unsafe fn receive_at(mut self, place: *mut u8) -> ffi::MPI_Request {
        let length = count(self.length);
        // SAFETY: the caller keeps the place; the message has not been received, as that takes `self`.
        started(|request| unsafe {
            ffi::MPI_Imrecv(place.cast(), length, ffi::RSMPI_UINT8_T, &mut self.handle, request);
        })
    }
}
