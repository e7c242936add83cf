//! A round as collective operations: every rank announces to every other how much is coming, and then sends it.

use std::ffi::c_int;
use std::time::{Duration, Instant};

use super::control::Found;
use super::raw::{from_halves, to_halves};
use super::session::Session;
use crate::{Incoming, Outgoing, Rank, TransportError};

/// The tag of messages that are too long for the collective operation. The sparse method has 0 and 1.
const TAG: c_int = 2;

/// Messages longer than this, in bytes, go from rank to rank, where no time is lost by it.
const LONG: usize = 8 << 20;

/// Numbers that each rank announces to each other: a length and the two halves of its flag word.
const RECORD: usize = 3;

/// The longest message that takes part in the collective operation, in bytes.
///
/// The library addresses the memory of all of them with 32 bits. Both ends of a message know its length and so agree on
/// the way that it takes, whatever else the two ranks have to send.
pub(super) fn longest_in_collective(size: usize) -> usize {
    LONG.min(c_int::MAX as usize / size)
}

impl Session {
    /// Exchanges one round with `MPI_Ialltoall` for the lengths and `MPI_Ialltoallv` for the messages, and returns how
    /// long it waited.
    pub(super) fn alltoallv(
        &mut self,
        outgoing: &mut Outgoing,
        incoming: &mut Incoming,
        started: Instant,
    ) -> Result<Duration, TransportError> {
        let Session { data, watch, transfers, records, lengths, .. } = self;
        let (own, size) = (data.rank(), data.size());
        let longest = longest_in_collective(size);

        let [mut announced, mut heard] = std::mem::take(records);
        let [high, low] = to_halves(outgoing.flag_word());
        let sent = outgoing.as_flat();
        announced.clear();
        announced.extend(Rank::all(size).flat_map(|to| [sent.place_of(to).len() as u64, high, low]));
        heard.resize(announced.len(), 0);
        let mut counts = data.all_to_all(announced, heard);
        let mut waited = watch.wait(started, 0, || Found::all_if(counts.test()))?;
        *records = counts.finish();

        lengths.clear();
        for &[length, high, low] in records[1].as_chunks::<RECORD>().0 {
            lengths.push(usize::try_from(length).expect("a message that another rank holds in memory"));
            incoming.hear(from_halves([high, low]));
        }
        let received = incoming.as_flat();
        received.arrange(lengths, longest);
        received.part_mut(own).copy_from_slice(sent.part(own));

        transfers.begin(sent.take(), received.take(), 0);
        let in_collective = |length: usize| if length > longest { 0 } else { length };
        let sizes = Rank::all(size).map(|to| in_collective(sent.place_of(to).len()));
        transfers.all_to_all(data, sizes, lengths.iter().map(|&length| in_collective(length)));
        for other in Rank::all(size).filter(|&rank| rank != own && lengths[rank.index()] > longest) {
            transfers.receive(data, other, TAG, received.place_of(other));
        }
        for other in Rank::all(size).filter(|&rank| rank != own && sent.place_of(rank).len() > longest) {
            transfers.send(data, other, TAG, sent.place_of(other));
        }
        let bytes = Rank::all(size).map(|to| sent.place_of(to).len()).chain(lengths.iter().copied()).sum();
        waited += watch.wait(started, bytes, || Found::all_if(transfers.test()))?;
        let ended = transfers.end();
        sent.put(ended.outgoing);
        received.put(ended.incoming);
        Ok(waited)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_messages_of_the_collective_can_be_addressed() {
        for size in [1, 2, 3, 255, 256, 257, 100_000, c_int::MAX as usize] {
            let all = longest_in_collective(size).checked_mul(size);
            assert!(all.is_some_and(|all| c_int::try_from(all).is_ok()), "{size} ranks");
        }
        assert_eq!(longest_in_collective(2), LONG);
    }
}
