//! Messages as bytes, for ranks that do not share memory. The only place that knows `bincode`.
//!
//! A frame is everything one rank tells another at one sync point:
//!
//! ```text
//! header   bincode, fixed-width little-endian: format, step, sync point, number of messages
//! counts   per message seven u32: source, destination, and how many of each of the five records
//! records  per message the five arrays, as they lie in memory
//! ```
//!
//! Ranks that have no message for each other exchange no frame. The verdict, which every rank must hear, travels beside
//! the frames, as a word.
//!
//! `bincode` 2.0.1 is its last release and is pinned; only the header goes through it. Records are plain old data
//! (`bytemuck`), copied in and out with one `memcpy` each, which needs no alignment of the frame.

use crate::exchange::mail::{Inbox, Mailbag, Message, Outbox};
use crate::model::error::CodecError;
use crate::model::id::TileId;
use bincode::config::{Configuration, Fixint, Limit, LittleEndian};
use bincode::{Decode, Encode};
use bytemuck::{Pod, cast_slice};

#[cfg(test)]
mod tests;

/// The version of the frame; grows with every change of any record.
pub const FORMAT: u32 = 6;

#[derive(Encode, Decode)]
struct Header {
    format: u32,
    step: u64,
    sync: u32,
    messages: u32,
}

/// Bytes of a header: its integers have fixed widths.
const HEADER: usize = 4 + 8 + 4 + 4;
const COUNTS: usize = 7 * 4;

fn config() -> Configuration<LittleEndian, Fixint, Limit<HEADER>> {
    bincode::config::standard().with_fixed_int_encoding().with_limit()
}

/// The five arrays of a message, in their order on the wire: how many records, and their bytes.
fn arrays<'a>(message: &Message<'a>) -> [(usize, &'a [u8]); 5] {
    [
        (message.migrants.len(), cast_slice(message.migrants)),
        (message.contacts.len(), cast_slice(message.contacts)),
        (message.ghosts.len(), cast_slice(message.ghosts)),
        (message.refreshes.len(), cast_slice(message.refreshes)),
        (message.impulses.len(), cast_slice(message.impulses)),
    ]
}

impl Message<'_> {
    /// How many bytes it takes in a frame.
    pub fn encoded_length(&self) -> usize {
        COUNTS + arrays(self).iter().map(|(_, bytes)| bytes.len()).sum::<usize>()
    }
}

/// The messages of an outbox dealt out to ranks, a frame for each. Keep one value: it keeps its memory.
#[derive(Default, Debug)]
pub struct Frames {
    /// Bytes of each rank's frame.
    lengths: Vec<usize>,
    /// Where each rank's messages end in `order`; they begin where those of the rank before end.
    ends: Vec<usize>,
    /// Every message for another rank, by rank, as its bag and its place in there.
    order: Vec<(u32, u32)>,
}

impl Frames {
    /// Deals out the messages for `size` ranks. The rank `own` gets none: its messages are for [`Outbox::deliver`].
    /// Takes time for each message and each rank.
    pub fn deal(&mut self, outbox: &Outbox, size: usize, own: usize, rank_of: &dyn Fn(TileId) -> usize) {
        let Self { lengths, ends, order } = self;
        lengths.clear();
        lengths.resize(size, 0);
        // Counted at first, one place further on, so that adding up gives where each begins.
        ends.clear();
        ends.resize(size + 1, 0);
        order.clear();
        if size == 1 {
            return;
        }
        let others = || outbox.numbered_messages().map(|(place, m)| (place, m, rank_of(m.to))).filter(|m| m.2 != own);
        for (_, message, rank) in others() {
            lengths[rank] += message.encoded_length() + if lengths[rank] == 0 { HEADER } else { 0 };
            ends[rank + 1] += 1;
        }
        for rank in 0..size {
            ends[rank + 1] += ends[rank];
        }
        order.resize(ends[size], (0, 0));
        for (place, _, rank) in others() {
            order[ends[rank]] = place;
            ends[rank] += 1;
        }
        ends.truncate(size);
    }

    /// How many bytes the frame of each rank takes; zero where there is nothing to say.
    pub fn lengths(&self) -> &[usize] {
        &self.lengths
    }

    /// Writes the frame for `rank` into `bytes`. The outbox must be the one that was dealt out, as it was.
    ///
    /// # Panics
    /// If `bytes` has another length than [`lengths`](Self::lengths) says.
    pub fn encode(&self, outbox: &Outbox, rank: usize, bytes: &mut [u8]) {
        assert_eq!(bytes.len(), self.lengths[rank], "the frame has the length announced");
        let start = if rank == 0 { 0 } else { self.ends[rank - 1] };
        let order = &self.order[start..self.ends[rank]];
        if order.is_empty() {
            return;
        }
        let messages = || order.iter().map(|&place| outbox.numbered_message(place));
        let (step, sync) = outbox.moment();
        let header = Header { format: FORMAT, step, sync, messages: order.len() as u32 };
        let mut at = bincode::encode_into_slice(&header, bytes, config()).expect("the header fits its frame");
        let mut put = |source: &[u8]| {
            bytes[at..at + source.len()].copy_from_slice(source);
            at += source.len();
        };
        for message in messages() {
            put(&message.from.0.to_le_bytes());
            put(&message.to.0.to_le_bytes());
            arrays(&message).iter().for_each(|(count, _)| put(&(*count as u32).to_le_bytes()));
        }
        for message in messages() {
            arrays(&message).iter().for_each(|(_, bytes)| put(bytes));
        }
    }
}

/// The unread rest of a frame.
struct Reader<'a> {
    rest: &'a [u8],
    length: usize,
}

impl<'a> Reader<'a> {
    fn take(&mut self, bytes: u64) -> Result<&'a [u8], CodecError> {
        let read = self.length - self.rest.len();
        let fits = usize::try_from(bytes).ok().and_then(|bytes| self.rest.split_at_checked(bytes));
        let (taken, rest) =
            fits.ok_or(CodecError::Length { length: self.length, announced: (read as u64).saturating_add(bytes) })?;
        self.rest = rest;
        Ok(taken)
    }

    fn take_u32(&mut self) -> Result<u32, CodecError> {
        Ok(u32::from_le_bytes(self.take(4)?.try_into().expect("four bytes")))
    }

    /// Appends `count` records. Nothing is allocated before the bytes were seen to be there.
    fn take_records<T: Pod>(&mut self, count: u32, to: &mut Vec<T>) -> Result<(), CodecError> {
        let bytes = self.take(u64::from(count) * size_of::<T>() as u64)?;
        let before = to.len();
        to.resize(before + count as usize, T::zeroed());
        bytemuck::cast_slice_mut(&mut to[before..]).copy_from_slice(bytes);
        Ok(())
    }
}

impl Inbox {
    /// Reads another rank's frame, which is not empty, straight from the bytes it came in.
    ///
    /// # Errors
    /// On bytes that are not a frame of this version, step and sync point, whole and with nothing after it, for tiles
    /// of this world. Never panics, and allocates in proportion to the bytes given.
    pub fn decode(&mut self, bytes: &[u8]) -> Result<(), CodecError> {
        let (length, kinds) = (bytes.len(), self.kinds);
        let header_error = |reason: String| CodecError::Header { length, reason };
        let (header, read): (Header, usize) =
            bincode::decode_from_slice(bytes, config()).map_err(|error| header_error(error.to_string()))?;
        if header.format != FORMAT {
            return Err(CodecError::Version { found: header.format, expected: FORMAT });
        }
        if (header.step, header.sync) != (self.step, self.sync) {
            return Err(CodecError::OutOfStep {
                found_step: header.step,
                found_sync: header.sync,
                step: self.step,
                sync: self.sync,
            });
        }
        let mut reader = Reader { rest: &bytes[read..], length };
        let counts = reader.take(u64::from(header.messages) * COUNTS as u64)?;
        let mut counts = Reader { rest: counts, length };
        for _ in 0..header.messages {
            let (from, to) = (TileId(counts.take_u32()?), TileId(counts.take_u32()?));
            let mut announced = [0; 5];
            for count in &mut announced {
                *count = counts.take_u32()?;
            }
            if !self.receive(from, to, announced[0] > 0) {
                return Err(CodecError::WrongTile { from, to });
            }
            let Mailbag { migrants, contacts, ghosts, refreshes, impulses, .. } = &mut self.decoded;
            let (known_migrants, known_ghosts) = (migrants.len(), ghosts.len());
            reader.take_records(announced[0], migrants)?;
            reader.take_records(announced[1], contacts)?;
            reader.take_records(announced[2], ghosts)?;
            reader.take_records(announced[3], refreshes)?;
            reader.take_records(announced[4], impulses)?;
            // A kind that the table does not have would be an index out of bounds later on.
            let migrants = migrants[known_migrants..].iter().map(|migrant| &migrant.body);
            let mut bodies = migrants.chain(ghosts[known_ghosts..].iter().map(|ghost| &ghost.body));
            if let Some(unknown) = bodies.find(|body| body.kind.0 >= kinds) {
                return Err(CodecError::BadRecord { id: unknown.id });
            }
        }
        if !reader.rest.is_empty() {
            return Err(CodecError::Length { length, announced: (length - reader.rest.len()) as u64 });
        }
        Ok(())
    }
}
