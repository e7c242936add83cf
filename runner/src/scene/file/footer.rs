//! Whether the footer of a Parquet file can be given to the library, which takes its word for how long its lists are and asks
//! for as much memory.
//!
//! The footer is a structure of Thrift's compact protocol. Here it is gone through from end to end: no list may have more
//! entries than there are bytes left.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

/// What stands at both ends of the file.
const LETTERS: &[u8; 4] = b"PAR1";

/// Deeper than this, no writer nests.
const DEEPEST: u32 = 16;

/// Refuses files whose footers say what cannot be.
///
/// # Errors
/// What is wrong, or what the system says.
pub(super) fn check(mut file: &File) -> io::Result<()> {
    let length = file.metadata()?.len();
    if length < 12 {
        return Err(io::Error::other(if length == 0 { "the file is empty" } else { "it is too short" }));
    }
    let mut end = [0; 8];
    file.seek(SeekFrom::End(-8))?;
    file.read_exact(&mut end)?;
    if end[4..] != *LETTERS {
        return Err(io::Error::other("it does not end as one"));
    }
    let size = u64::from(u32::from_le_bytes([end[0], end[1], end[2], end[3]]));
    if size > length - 12 {
        return Err(io::Error::other("its footer is longer than the file"));
    }
    let mut footer = Vec::new();
    file.seek(SeekFrom::End(-8 - size as i64))?;
    file.take(size).read_to_end(&mut footer)?;
    file.seek(SeekFrom::Start(0))?;
    let mut walk = Walk { rest: &footer };
    walk.structure(0).ok_or_else(|| io::Error::other("its footer is not as any writer makes it"))
}

/// A way through bytes.
struct Walk<'a> {
    rest: &'a [u8],
}

impl Walk<'_> {
    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.rest.split_first()?;
        self.rest = rest;
        Some(*first)
    }

    fn skip(&mut self, count: u64) -> Option<()> {
        self.rest = self.rest.get(usize::try_from(count).ok()?..)?;
        Some(())
    }

    fn varint(&mut self) -> Option<u64> {
        let mut value = 0_u64;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Some(value);
            }
        }
        None
    }

    /// A value of one of the protocol's types; within a list, truths take a byte each.
    fn value(&mut self, kind: u8, in_list: bool, depth: u32) -> Option<()> {
        match kind {
            1 | 2 => {
                if in_list {
                    self.skip(1)
                } else {
                    Some(())
                }
            }
            3 => self.skip(1),
            4..=6 => self.varint().map(drop),
            7 => self.skip(8),
            8 => {
                let length = self.varint()?;
                self.skip(length)
            }
            9 | 10 => self.list(depth + 1),
            12 => self.structure(depth + 1),
            // Maps and UUIDs, of which there are none.
            _ => None,
        }
    }

    fn list(&mut self, depth: u32) -> Option<()> {
        let head = self.byte()?;
        let count = if head >> 4 == 15 { self.varint()? } else { u64::from(head >> 4) };
        if depth > DEEPEST || count > self.rest.len() as u64 {
            return None;
        }
        (0..count).try_for_each(|_| self.value(head & 15, true, depth))
    }

    fn structure(&mut self, depth: u32) -> Option<()> {
        if depth > DEEPEST {
            return None;
        }
        loop {
            let head = self.byte()?;
            if head == 0 {
                return Some(());
            }
            if head >> 4 == 0 {
                self.varint()?;
            }
            self.value(head & 15, false, depth)?;
        }
    }
}
