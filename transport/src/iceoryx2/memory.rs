//! Loaned slices as memory that can be written without fear.

#![allow(unsafe_code)]

use std::mem::MaybeUninit;
use std::ops::Range;

use iceoryx2::sample_mut_uninit::SampleMutUninit;
use iceoryx2::service::ipc_threadsafe::Service;
use rustix::io::Errno;
use rustix::mm::{Advice, madvise};

use crate::frame::{Header, Loan};

/// A slice as iceoryx2 loans it.
type Raw = SampleMutUninit<Service, [MaybeUninit<u8>], Header>;

/// Hands out a loaned slice with the bytes that happen to be in it.
pub(super) fn with_old_bytes(loan: Raw) -> Loan {
    // SAFETY: the slice lies in a mapped file, whose bytes were zeroed by the kernel or written since: they have some
    // value, and any is good for a `u8`.
    unsafe { loan.assume_init() }
}

/// Which parts of one publisher's memory are known to be backed by pages.
///
/// Shared memory gets its pages on first access, and where there are none left, that access kills the process (SIGBUS).
/// So the pages of a slice are asked for before it is handed out, which fails like any other call. The same few slices
/// come again and again: a warm round asks for nothing.
#[derive(Debug, Default)]
pub(super) struct Backed {
    known: Vec<Range<usize>>,
}

impl Backed {
    /// Forgets everything, as the memory may lie elsewhere now.
    pub(super) fn forget(&mut self) {
        self.known.clear();
    }

    /// Asks for all pages of `loan`.
    ///
    /// # Errors
    /// If there is no memory for them.
    pub(super) fn ensure(&mut self, loan: &mut Loan) -> Result<(), Errno> {
        let bytes = loan.payload_mut();
        let page = rustix::param::page_size();
        // Whole pages from the first byte on. They are all within the mapping, which consists of pages.
        let start = bytes.as_ptr() as usize / page * page;
        let end = (bytes.as_ptr() as usize + bytes.len()).next_multiple_of(page);
        if self.known.iter().any(|known| known.start == start && known.end >= end) {
            return Ok(());
        }
        let address = bytes.as_mut_ptr().wrapping_byte_sub(bytes.as_ptr() as usize - start);
        // SAFETY: the pages are mapped and writable as long as the loan lives, and this advice changes no byte of them.
        match unsafe { madvise(address.cast(), end - start, Advice::LinuxPopulateWrite) } {
            // Before Linux 5.14 one cannot ask; the look at the free space when a segment grows has to do.
            Ok(()) | Err(Errno::INVAL) => {}
            Err(error) => return Err(error),
        }
        match self.known.iter_mut().find(|known| known.start == start) {
            Some(known) => known.end = end,
            None => self.known.push(start..end),
        }
        Ok(())
    }
}
