//! Messages as bytes, for ranks that do not share memory. The only place that knows `bincode`.
//!
//! A frame is everything one rank tells another at one sync point:
//!
//! ```text
//! header   bincode, fixed-width little-endian: format, step, sync point, verdict, number of messages
//! counts   per message seven u32: source, destination, and how many of each of the five records
//! records  per message the five arrays, as they lie in memory
//! ```
//!
//! `bincode` 2.0.1 is its last release and is pinned; only the header goes through it. Records are plain old data
//! (`bytemuck`), copied in and out with one `memcpy` each, which needs no alignment of the frame.

use crate::error::CodecError;
use crate::halo::{Inbox, Message, Outbox, Verdict};
use crate::id::{GlobalId, TileId};
use bincode::config::{Configuration, Fixint, Limit, LittleEndian};
use bincode::{Decode, Encode};
use bytemuck::Pod;

#[cfg(test)]
mod tests;

/// The version of the frame; grows with every change of any record.
pub const FORMAT: u32 = 1;

#[derive(Encode, Decode)]
struct Header {
    format: u32,
    step: u64,
    sync: u32,
    stop: bool,
    failure: Option<(u64, u64)>,
    messages: u32,
}

const HEADER_LIMIT: usize = 64;
const COUNTS: usize = 7 * 4;

fn config() -> Configuration<LittleEndian, Fixint, Limit<HEADER_LIMIT>> {
    bincode::config::standard().with_fixed_int_encoding().with_limit()
}

impl Header {
    fn of(outbox: &Outbox, messages: usize) -> Self {
        let (step, sync) = outbox.moment();
        let Verdict { stop, failure } = outbox.verdict();
        let failure = failure.map(|(step, id)| (step, id.0));
        Self { format: FORMAT, step, sync, stop, failure, messages: messages as u32 }
    }

    fn length(&self) -> usize {
        // Fixed-width integers; an Option is a byte and its content.
        4 + 8 + 4 + 1 + (1 + if self.failure.is_some() { 16 } else { 0 }) + 4
    }
}

/// The five arrays of a message, each as one expression: their order on the wire.
macro_rules! each_array {
    ($message:expr, $array:ident => $body:expr) => {{
        {
            let $array = $message.migrants;
            $body;
        }
        {
            let $array = $message.contacts;
            $body;
        }
        {
            let $array = $message.ghosts;
            $body;
        }
        {
            let $array = $message.refreshes;
            $body;
        }
        {
            let $array = $message.impulses;
            $body;
        }
    }};
}

/// Borrows of a message's arrays, so that [`each_array`] serves reading and writing.
struct Arrays<M, C, G, R, I> {
    migrants: M,
    contacts: C,
    ghosts: G,
    refreshes: R,
    impulses: I,
}

macro_rules! arrays {
    (& $message:expr) => {
        Arrays {
            migrants: &$message.migrants,
            contacts: &$message.contacts,
            ghosts: &$message.ghosts,
            refreshes: &$message.refreshes,
            impulses: &$message.impulses,
        }
    };
    (&mut $message:expr) => {
        Arrays {
            migrants: &mut $message.migrants,
            contacts: &mut $message.contacts,
            ghosts: &mut $message.ghosts,
            refreshes: &mut $message.refreshes,
            impulses: &mut $message.impulses,
        }
    };
}

fn message_length(message: &Message) -> usize {
    let mut length = COUNTS;
    each_array!(arrays!(&message), array => length += std::mem::size_of_val(array.as_slice()));
    length
}

impl Outbox {
    /// Writes into `lengths`, for each of `size` ranks, how many bytes its frame takes. The own rank gets none: its
    /// messages are for [`Outbox::deliver`].
    pub fn frame_lengths(&self, size: usize, rank_of: &dyn Fn(TileId) -> usize, own: usize, lengths: &mut Vec<usize>) {
        lengths.clear();
        lengths.resize(size, Header::of(self, 0).length());
        for message in self.messages() {
            lengths[rank_of(message.to)] += message_length(message);
        }
        lengths[own] = 0;
    }

    /// Writes the frame for `rank` into `bytes`, whose length [`Outbox::frame_lengths`] gave.
    ///
    /// # Panics
    /// If the length is another one.
    pub fn encode(&self, rank: usize, rank_of: &dyn Fn(TileId) -> usize, bytes: &mut [u8]) {
        let mine = || self.messages().filter(|message| rank_of(message.to) == rank);
        let header = Header::of(self, mine().count());
        let mut at = bincode::encode_into_slice(&header, bytes, config()).expect("the header fits its frame");
        let mut put = |source: &[u8]| {
            bytes[at..at + source.len()].copy_from_slice(source);
            at += source.len();
        };
        for message in mine() {
            put(&message.from.0.to_le_bytes());
            put(&message.to.0.to_le_bytes());
            each_array!(arrays!(&message), array => put(&(array.len() as u32).to_le_bytes()));
        }
        for message in mine() {
            each_array!(arrays!(&message), array => put(bytemuck::cast_slice(array)));
        }
        assert_eq!(at, bytes.len(), "the frame has the length announced");
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
    /// Reads another rank's frame, straight from the bytes it came in.
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
            let message = self.receive(from, to).ok_or(CodecError::WrongTile { from, to })?;
            each_array!(arrays!(&mut message), array => reader.take_records(counts.take_u32()?, array)?);
            // A kind that the table does not have would be an index out of bounds later on.
            let bodies = message.migrants.iter().chain(message.ghosts.iter().map(|ghost| &ghost.body));
            if let Some(unknown) = bodies.into_iter().find(|body| body.kind.0 >= kinds) {
                return Err(CodecError::BadRecord { id: unknown.id });
            }
        }
        if !reader.rest.is_empty() {
            return Err(CodecError::Length { length, announced: (length - reader.rest.len()) as u64 });
        }
        let failure = header.failure.map(|(step, id)| (step, GlobalId(id)));
        self.hear(Verdict { stop: header.stop, failure });
        Ok(())
    }
}
