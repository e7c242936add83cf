//! The calls of the MPI library, each with the memory that it works on.
//!
//! An operation under way owns its memory, and gives it back when it is complete. Let go of before that, it leaks the
//! memory, because the library may still write to it. (The requests of the `mpi` crate panic or end the process instead.)
//! The library's return codes say nothing, as its default is to end the job at any error.
#![allow(unsafe_code)]

use std::ffi::{c_int, c_void};
use std::mem::{ManuallyDrop, MaybeUninit, forget, take};
use std::ops::Range;

use ::mpi::Threading;
use ::mpi::environment::Universe;
use ::mpi::ffi;

use crate::Rank;

/// The most bytes that one call sends; longer messages go in pieces.
const PIECE: usize = 1 << 30;

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

/// Ranks that can talk to each other without being heard by other such groups.
pub(super) struct Communicator {
    handle: ffi::MPI_Comm,
    rank: Rank,
    size: usize,
}

impl Communicator {
    /// All ranks of the job. All make this call together.
    pub(super) fn of_all_ranks(_library: &Library) -> Communicator {
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

    pub(super) fn rank(&self) -> Rank {
        self.rank
    }

    pub(super) fn size(&self) -> usize {
        self.size
    }

    fn number_of(&self, rank: Rank) -> c_int {
        assert!(rank.index() < self.size, "there is no rank {rank}");
        c_int::try_from(rank.0).expect("the library numbers ranks with 31 bits")
    }

    /// Gives the communicator back. Every rank does it, after its last operation.
    pub(super) fn free(mut self) {
        // SAFETY: the handle was made by `MPI_Comm_dup` and is not used again.
        unsafe { ffi::MPI_Comm_free(&mut self.handle) };
    }

    /// Sends `send[r * n ..][.. n]` to rank `r` and receives the same from it into `receive`, where the length of both
    /// is `n` times the number of ranks, the same everywhere.
    pub(super) fn all_to_all(&self, mut send: Vec<u64>, mut receive: Vec<u64>) -> Pending<[Vec<u64>; 2]> {
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
    pub(super) fn barrier(&self) -> Pending<()> {
        // SAFETY: uses no memory of the caller.
        let request = started(|request| unsafe {
            ffi::MPI_Ibarrier(self.handle, request);
        });
        Pending::new(request, ())
    }

    /// Sends some bytes to one rank.
    pub(super) fn send(&self, to: Rank, tag: c_int, bytes: Vec<u8>) -> Pending<Vec<u8>> {
        let (to, length) = (self.number_of(to), count(bytes.len()));
        // SAFETY: the bytes belong to the operation until it is complete.
        let request = started(|request| unsafe {
            ffi::MPI_Isend(bytes.as_ptr().cast(), length, ffi::RSMPI_UINT8_T, to, tag, self.handle, request);
        });
        Pending::new(request, bytes)
    }

    /// A message of this tag that has arrived, if there is one. It has to be received.
    pub(super) fn arrived(&self, tag: c_int) -> Option<Arrived> {
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

/// Starts an operation and returns its request.
fn started(start: impl FnOnce(*mut ffi::MPI_Request)) -> ffi::MPI_Request {
    let mut request = no_request();
    start(&mut request);
    request
}

/// A message that has arrived and is not yet received.
pub(super) struct Arrived {
    handle: ffi::MPI_Message,
    pub(super) from: Rank,
    pub(super) length: usize,
}

impl Arrived {
    /// Receives it into memory of its own.
    pub(super) fn receive(self) -> Pending<Vec<u8>> {
        let mut bytes = vec![0; self.length];
        // SAFETY: the place is as long as the message and belongs to the operation until it is complete.
        let request = unsafe { self.receive_at(bytes.as_mut_ptr()) };
        Pending::new(request, bytes)
    }

    /// # Safety
    /// So many bytes as the message has can be written at `place` until the operation is complete.
    unsafe fn receive_at(mut self, place: *mut u8) -> ffi::MPI_Request {
        let length = count(self.length);
        // SAFETY: the caller keeps the place; the message has not been received, as that takes `self`.
        started(|request| unsafe {
            ffi::MPI_Imrecv(place.cast(), length, ffi::RSMPI_UINT8_T, &mut self.handle, request);
        })
    }
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

/// The messages of one round under way, and the two buffers in which they lie.
///
/// Lists are kept from round to round.
#[derive(Default)]
pub(super) struct Transfers {
    requests: Vec<ffi::MPI_Request>,
    outgoing: Vec<u8>,
    incoming: Vec<u8>,
    /// Up to where messages are received into `incoming`.
    taken: usize,
    /// Lengths and starts, of what is sent and of what is received.
    tables: [Vec<c_int>; 4],
    /// Messages for which there was no room in `incoming`.
    extra: Vec<Vec<u8>>,
}

/// The memory of a round that is over.
pub(super) struct Ended {
    pub(super) outgoing: Vec<u8>,
    pub(super) incoming: Vec<u8>,
    /// Up to where messages were received into `incoming`.
    pub(super) taken: usize,
    /// Messages for which there was no room in it.
    pub(super) extra: Vec<Vec<u8>>,
}

/// Where a message was received that nobody had announced.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// A part of the buffer.
    Buffer(Range<usize>),
    /// Memory of its own, by its number.
    Extra(usize),
}

impl Transfers {
    /// Begins a round with what is to be sent and with memory to receive into, which is in use up to `taken`.
    pub(super) fn begin(&mut self, outgoing: Vec<u8>, incoming: Vec<u8>, taken: usize) {
        assert!(self.requests.is_empty(), "the round before is not over");
        (self.outgoing, self.incoming, self.taken) = (outgoing, incoming, taken);
    }

    /// Whether everything started is complete; moves it on.
    pub(super) fn test(&mut self) -> bool {
        test_all(&mut self.requests)
    }

    /// Ends a round and gives the memory back.
    ///
    /// # Panics
    /// If something was not found complete.
    pub(super) fn end(&mut self) -> Ended {
        let done = self.requests.iter().all(|&request| request == no_request());
        assert!(done, "messages are still under way");
        self.requests.clear();
        Ended {
            outgoing: take(&mut self.outgoing),
            incoming: take(&mut self.incoming),
            taken: self.taken,
            extra: take(&mut self.extra),
        }
    }

    /// Sends and receives what lies at the beginning of both buffers: so many bytes for each rank, in rank order and
    /// without gaps, of which those of this rank itself stay as they are. Every rank makes this call, and each pair
    /// means the same length.
    pub(super) fn all_to_all(
        &mut self,
        communicator: &Communicator,
        send: impl Iterator<Item = usize>,
        receive: impl Iterator<Item = usize>,
    ) {
        let Transfers { tables: [lengths_out, starts_out, lengths_in, starts_in], .. } = self;
        let sent = tabulate(send, communicator.rank, lengths_out, starts_out);
        let received = tabulate(receive, communicator.rank, lengths_in, starts_in);
        assert!(lengths_out.len() == communicator.size && lengths_in.len() == communicator.size, "a length per rank");
        assert!(sent <= self.outgoing.len() && received <= self.incoming.len(), "the buffers hold all parts");
        assert!(self.taken == 0, "the beginning of the buffer is free");
        self.taken = received;
        // The address of a vector that never held anything is 1, and that is how one library says `MPI_IN_PLACE`.
        self.outgoing.reserve_exact(usize::from(self.outgoing.is_empty()));
        self.incoming.reserve_exact(usize::from(self.incoming.is_empty()));
        let outgoing = self.outgoing.as_ptr().cast::<c_void>();
        let incoming = self.incoming.as_mut_ptr().cast::<c_void>();
        // SAFETY: the tables have an entry per rank, all parts lie within their buffers, and all of this stays where it
        // is until the operation is complete.
        let request = started(|request| unsafe {
            let byte = ffi::RSMPI_UINT8_T;
            let (lengths, starts) = (lengths_out.as_ptr(), starts_out.as_ptr());
            let (lengths_in, starts_in) = (lengths_in.as_ptr(), starts_in.as_ptr());
            let all = communicator.handle;
            ffi::MPI_Ialltoallv(outgoing, lengths, starts, byte, incoming, lengths_in, starts_in, byte, all, request);
        });
        self.requests.push(request);
    }

    /// Sends one part of the outgoing buffer.
    pub(super) fn send(&mut self, communicator: &Communicator, to: Rank, tag: c_int, part: Range<usize>) {
        let to = communicator.number_of(to);
        for piece in pieces(part) {
            let bytes = &self.outgoing[piece];
            // SAFETY: nobody writes to the bytes, and they stay where they are, until the operation is complete.
            self.requests.push(started(|request| unsafe {
                let (length, byte) = (count(bytes.len()), ffi::RSMPI_UINT8_T);
                ffi::MPI_Isend(bytes.as_ptr().cast(), length, byte, to, tag, communicator.handle, request);
            }));
        }
    }

    /// Sends one part of the outgoing buffer, in one piece, and is complete no sooner than it is being received.
    pub(super) fn send_synchronously(&mut self, communicator: &Communicator, to: Rank, tag: c_int, part: Range<usize>) {
        let to = communicator.number_of(to);
        let bytes = &self.outgoing[part];
        // SAFETY: as in `send`.
        self.requests.push(started(|request| unsafe {
            let (length, byte) = (count(bytes.len()), ffi::RSMPI_UINT8_T);
            ffi::MPI_Issend(bytes.as_ptr().cast(), length, byte, to, tag, communicator.handle, request);
        }));
    }

    /// Receives into one part of the incoming buffer, which is as long as what was sent and lies behind all others.
    pub(super) fn receive(&mut self, communicator: &Communicator, from: Rank, tag: c_int, part: Range<usize>) {
        let from = communicator.number_of(from);
        let mut place = self.take_part(&part);
        for piece in pieces(part) {
            // SAFETY: no other operation has this part, and it stays where it is until this one is complete.
            self.requests.push(started(|request| unsafe {
                let (length, byte) = (count(piece.len()), ffi::RSMPI_UINT8_T);
                ffi::MPI_Irecv(place.cast(), length, byte, from, tag, communicator.handle, request);
            }));
            place = place.wrapping_add(piece.len());
        }
    }

    /// Receives a message behind all others, or into new memory if there is no room.
    pub(super) fn receive_arrived(&mut self, message: Arrived) -> Place {
        let part = self.taken..self.taken + message.length;
        let (place, pointer) = if part.end <= self.incoming.len() {
            let pointer = self.take_part(&part);
            (Place::Buffer(part), pointer)
        } else {
            self.extra.push(vec![0; message.length]);
            let number = self.extra.len() - 1;
            (Place::Extra(number), self.extra[number].as_mut_ptr())
        };
        // SAFETY: the place is as long as the message, no other operation has it, and it stays where it is until this
        // one is complete: moving a vector does not move what is in it.
        let request = unsafe { message.receive_at(pointer) };
        self.requests.push(request);
        place
    }

    /// Takes a part that no operation has, and says where it is. (A slice would claim the other parts as well.)
    fn take_part(&mut self, part: &Range<usize>) -> *mut u8 {
        let free = self.taken <= part.start && part.start <= part.end && part.end <= self.incoming.len();
        assert!(free, "no free part of the buffer");
        self.taken = part.end;
        self.incoming.as_mut_ptr().wrapping_add(part.start)
    }
}

impl Drop for Transfers {
    fn drop(&mut self) {
        if self.requests.iter().any(|&request| request != no_request()) {
            forget((take(&mut self.outgoing), take(&mut self.incoming), take(&mut self.tables), take(&mut self.extra)));
        }
    }
}

/// Writes lengths, with 0 for `own`, and the sums of those before each, and returns the sum of all.
fn tabulate(lengths: impl Iterator<Item = usize>, own: Rank, table: &mut Vec<c_int>, starts: &mut Vec<c_int>) -> usize {
    table.clear();
    starts.clear();
    let total = lengths.fold(0, |start: usize, length| {
        starts.push(count(start));
        table.push(count(length));
        start + length
    });
    table[own.index()] = 0;
    total
}

/// Cuts a part into pieces that one call can send.
fn pieces(part: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let end = part.end;
    part.step_by(PIECE).map(move |start| start..end.min(start + PIECE))
}

/// The reduction of a word of 128 bits to the least one.
pub(super) struct Least {
    word: ffi::MPI_Datatype,
    operation: ffi::MPI_Op,
}

/// Writes the lesser of each two words to `kept`. A word is two numbers of 64 bits, the more significant one first.
unsafe extern "C" fn keep_least(other: *mut c_void, kept: *mut c_void, length: *mut c_int, _: *mut ffi::MPI_Datatype) {
    let (other, kept) = (other.cast::<[u64; 2]>(), kept.cast::<[u64; 2]>());
    // SAFETY: the library passes the length of both lists.
    let length = usize::try_from(unsafe { *length }).unwrap_or(0);
    for index in 0..length {
        // SAFETY: both lists have so many words, if perhaps not aligned.
        unsafe {
            let least = other.add(index).read_unaligned().min(kept.add(index).read_unaligned());
            kept.add(index).write_unaligned(least);
        }
    }
}

impl Least {
    pub(super) fn new(_library: &Library) -> Least {
        let (mut word, mut operation) = (MaybeUninit::uninit(), MaybeUninit::uninit());
        // SAFETY: the library is initialized; the calls write the places they are given; `keep_least` is commutative and
        // associative and reads and writes so many words as it is told.
        unsafe {
            // One element, so that no algorithm cuts a word in two.
            ffi::MPI_Type_contiguous(2, ffi::RSMPI_UINT64_T, word.as_mut_ptr());
            ffi::MPI_Type_commit(word.as_mut_ptr());
            ffi::MPI_Op_create(Some(keep_least), 1, operation.as_mut_ptr());
            Least { word: word.assume_init(), operation: operation.assume_init() }
        }
    }

    /// Begins to find the least word of all ranks. The second vector is the result, as `[high, low]`.
    pub(super) fn of_all(&self, communicator: &Communicator, word: u128) -> Pending<[Vec<u64>; 2]> {
        let own = to_halves(word).to_vec();
        let mut least = vec![0; 2];
        // SAFETY: both buffers hold one word and belong to the operation until it is complete.
        let request = started(|request| unsafe {
            let (from, to) = (own.as_ptr().cast(), least.as_mut_ptr().cast());
            ffi::MPI_Iallreduce(from, to, 1, self.word, self.operation, communicator.handle, request);
        });
        Pending::new(request, [own, least])
    }

    /// Gives the operation back to the library.
    pub(super) fn free(mut self) {
        // SAFETY: both were made by this type and are not used again.
        unsafe {
            ffi::MPI_Op_free(&mut self.operation);
            ffi::MPI_Type_free(&mut self.word);
        }
    }
}

/// A word as two numbers, the more significant one first.
pub(super) fn to_halves(word: u128) -> [u64; 2] {
    [(word >> 64) as u64, word as u64]
}

/// Undoes [`to_halves`].
pub(super) fn from_halves([high, low]: [u64; 2]) -> u128 {
    u128::from(high) << 64 | u128::from(low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_cover_a_part_without_gaps() {
        let cut = |part| pieces(part).collect::<Vec<_>>();
        assert_eq!(cut(7..7), []);
        assert_eq!(cut(7..8), vec![7..8]);
        assert_eq!(cut(1..PIECE + 1), vec![1..PIECE + 1]);
        assert_eq!(cut(1..2 * PIECE + 2), [1..PIECE + 1, PIECE + 1..2 * PIECE + 1, 2 * PIECE + 1..2 * PIECE + 2]);
    }

    #[test]
    fn tables_have_lengths_and_starts() {
        let (mut lengths, mut starts) = (vec![9], vec![9]);
        assert_eq!(tabulate([3, 0, 4, 5].into_iter(), Rank(2), &mut lengths, &mut starts), 12);
        assert_eq!((lengths, starts), (vec![3, 0, 0, 5], vec![0, 3, 3, 7]));
    }

    #[test]
    #[should_panic(expected = "more bytes than 32 bits count")]
    fn a_table_past_32_bits_is_refused() {
        tabulate([1 << 30, 1 << 30, 1].into_iter(), Rank(0), &mut Vec::new(), &mut Vec::new());
    }

    #[test]
    fn halves_keep_the_order_of_words() {
        let words = [0, 1, u128::from(u64::MAX), 1 << 64, (1 << 64) + 1, u128::MAX - 1, u128::MAX];
        for pair in words.windows(2) {
            assert!(to_halves(pair[0]) < to_halves(pair[1]));
        }
        assert!(words.iter().all(|&word| from_halves(to_halves(word)) == word));
    }

    #[test]
    fn the_lesser_words_are_kept() {
        let mut other: Vec<[u64; 2]> = [5, 1 << 64, u128::MAX].map(to_halves).to_vec();
        let mut kept: Vec<[u64; 2]> = [6, 3, u128::MAX].map(to_halves).to_vec();
        let mut length = 3;
        // SAFETY: both lists have three words, and the type is not looked at.
        unsafe {
            keep_least(other.as_mut_ptr().cast(), kept.as_mut_ptr().cast(), &mut length, std::ptr::null_mut());
        }
        assert_eq!(kept, [5, 3, u128::MAX].map(to_halves));
    }
}
