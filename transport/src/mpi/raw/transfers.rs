//! The messages of one round.

use std::ffi::{c_int, c_void};
use std::mem::{forget, take};
use std::ops::Range;

use ::mpi::ffi;

use super::communicator::{Arrived, Communicator};
use super::{count, no_request, started, test_all};
use crate::Rank;

/// The most bytes that one call sends; longer messages go in pieces.
const PIECE: usize = 1 << 30;

/// The messages of one round under way, and the two buffers in which they lie.
///
/// Lists are kept from round to round.
#[derive(Default)]
pub(in crate::mpi) struct Transfers {
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
pub(in crate::mpi) struct Ended {
    pub(in crate::mpi) outgoing: Vec<u8>,
    pub(in crate::mpi) incoming: Vec<u8>,
    /// Up to where messages were received into `incoming`.
    pub(in crate::mpi) taken: usize,
    /// Messages for which there was no room in it.
    pub(in crate::mpi) extra: Vec<Vec<u8>>,
}

/// Where a message was received that nobody had announced.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::mpi) enum Place {
    /// A part of the buffer.
    Buffer(Range<usize>),
    /// Memory of its own, by its number.
    Extra(usize),
}

impl Transfers {
    /// Begins a round with what is to be sent and with memory to receive into, which is in use up to `taken`.
    pub(in crate::mpi) fn begin(&mut self, outgoing: Vec<u8>, incoming: Vec<u8>, taken: usize) {
        assert!(self.requests.is_empty(), "the round before is not over");
        (self.outgoing, self.incoming, self.taken) = (outgoing, incoming, taken);
    }

    /// Whether everything started is complete; moves it on.
    pub(in crate::mpi) fn test(&mut self) -> bool {
        test_all(&mut self.requests)
    }

    /// Ends a round and gives the memory back.
    ///
    /// # Panics
    /// If something was not found complete.
    pub(in crate::mpi) fn end(&mut self) -> Ended {
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
    pub(in crate::mpi) fn all_to_all(
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
    pub(in crate::mpi) fn send(&mut self, communicator: &Communicator, to: Rank, tag: c_int, part: Range<usize>) {
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
    pub(in crate::mpi) fn send_synchronously(
        &mut self,
        communicator: &Communicator,
        to: Rank,
        tag: c_int,
        part: Range<usize>,
    ) {
        let to = communicator.number_of(to);
        let bytes = &self.outgoing[part];
        // SAFETY: as in `send`.
        self.requests.push(started(|request| unsafe {
            let (length, byte) = (count(bytes.len()), ffi::RSMPI_UINT8_T);
            ffi::MPI_Issend(bytes.as_ptr().cast(), length, byte, to, tag, communicator.handle, request);
        }));
    }

    /// Receives into one part of the incoming buffer, which is as long as what was sent and lies behind all others.
    pub(in crate::mpi) fn receive(&mut self, communicator: &Communicator, from: Rank, tag: c_int, part: Range<usize>) {
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
    pub(in crate::mpi) fn receive_arrived(&mut self, message: Arrived) -> Place {
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
}
