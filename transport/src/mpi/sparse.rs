//! A round as messages between ranks that have something to say to each other.
//!
//! This is the nonblocking consensus of T. Hoefler, C. Siebert and A. Lumsdaine, *Scalable communication protocols for
//! dynamic sparse data exchange*, PPoPP 2010. Nobody announces anything. A rank sends synchronously, so that it knows
//! when its messages are being received; then it enters a nonblocking barrier, and goes on receiving what comes. When
//! the barrier ends, every message of the round is being received. Here the barrier is the reduction of the flag
//! words, which have to reach all ranks anyway. A rank that is still in the barrier may see messages of the next round,
//! but of no later one, so two tags by turns keep rounds apart.

use std::ffi::c_int;
use std::time::{Duration, Instant};

use super::control::Found;
use super::raw::{Pending, Place, from_halves};
use super::session::Session;
use crate::{Incoming, Outgoing, Rank, TransportError};

/// The longest message, in bytes: what one call can send.
pub(super) const LONGEST: usize = c_int::MAX as usize;

impl Session {
    /// Exchanges one round with `MPI_Issend`, `MPI_Improbe` and `MPI_Iallreduce`, and returns how long it waited.
    pub(super) fn sparse(
        &mut self,
        outgoing: &mut Outgoing,
        incoming: &mut Incoming,
        started: Instant,
    ) -> Result<Duration, TransportError> {
        let Session { data, watch, least, transfers, places, .. } = self;
        let (own, size) = (data.rank(), data.size());
        let tag = (watch.rounds() % 2) as c_int;
        let word = outgoing.flag_word();
        let (sent, received) = (outgoing.as_flat(), incoming.as_flat());

        let to_oneself = sent.part(own);
        received.clear_parts(size);
        received.place(own, 0..to_oneself.len());
        received.fit(to_oneself.len());
        received.part_mut(own).copy_from_slice(to_oneself);

        transfers.begin(sent.take(), received.take(), sent.place_of(own).len());
        for to in Rank::all(size).filter(|&rank| rank != own && !sent.place_of(rank).is_empty()) {
            transfers.send_synchronously(data, to, tag, sent.place_of(to));
        }
        places.clear();
        let mut reduction: Option<Pending<_>> = None;
        // What comes is not known; it is about as much as what goes.
        let bytes = 2 * Rank::all(size).map(|to| sent.place_of(to).len()).sum::<usize>();
        let waited = watch.wait(started, bytes, || {
            let mut found = Found::Nothing;
            while let Some(message) = data.arrived(tag) {
                places.push((message.from, transfers.receive_arrived(message)));
                found = Found::Something;
            }
            // All that this rank sends is being received, and all it has seen is here.
            let idle = transfers.test();
            match &mut reduction {
                Some(reduction) => found = if reduction.test() && idle { Found::All } else { found },
                None if idle => {
                    reduction = Some(least.of_all(data, word));
                    found = Found::Something;
                }
                None => {}
            }
            found
        })?;
        let mut ended = transfers.end();
        let starts = append(&mut ended.incoming, ended.taken, &ended.extra);
        let used = ended.taken + ended.extra.iter().map(Vec::len).sum::<usize>();
        sent.put(ended.outgoing);
        received.put(ended.incoming);
        received.fit(used);
        for (from, place) in places.drain(..) {
            let part = match place {
                Place::Buffer(part) => part,
                Place::Extra(number) => starts[number]..starts[number] + ended.extra[number].len(),
            };
            received.place(from, part);
        }
        let [_, word] = reduction.expect("the wait ends with it").finish();
        incoming.hear(from_halves([word[0], word[1]]));
        Ok(waited)
    }
}

/// Copies messages for which there was no room behind the `used` bytes of the buffer, and returns where each begins.
fn append(buffer: &mut Vec<u8>, used: usize, messages: &[Vec<u8>]) -> Vec<usize> {
    let mut starts = Vec::with_capacity(messages.len());
    if !messages.is_empty() {
        buffer.truncate(used);
    }
    for message in messages {
        starts.push(buffer.len());
        buffer.extend_from_slice(message);
    }
    if !messages.is_empty() {
        // Room for a little more, as a round is often a little larger than the one before.
        buffer.resize(buffer.len() + buffer.len() / 4, 0);
    }
    starts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_without_room_go_behind_the_others() {
        let mut buffer = vec![1, 2, 3, 9, 9];
        assert_eq!(append(&mut buffer, 3, &[]), []);
        assert_eq!(buffer, [1, 2, 3, 9, 9]);
        assert_eq!(append(&mut buffer, 3, &[vec![4, 5], vec![], vec![6; 3]]), [3, 5, 5]);
        assert_eq!(buffer[..8], [1, 2, 3, 4, 5, 6, 6, 6]);
        assert_eq!(buffer.len(), 10);
    }
}
