//! Slices that several threads work on at once, each on elements of its own.

use std::cell::Cell;
use std::marker::PhantomData;
use std::ops::Range;

/// A slice that was borrowed mutably and is now shared among threads which promise to stay out of each other's way.
pub(crate) struct Shared<'a, T> {
    start: *mut T,
    len: usize,
    borrow: PhantomData<&'a mut [T]>,
}

// SAFETY: it only hands out elements through unsafe methods whose callers promise that no two threads meet.
unsafe impl<T: Send> Send for Shared<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Send> Sync for Shared<'_, T> {}

impl<'a, T> Shared<'a, T> {
    pub(crate) fn new(slice: &'a mut [T]) -> Self {
        Self { start: slice.as_mut_ptr(), len: slice.len(), borrow: PhantomData }
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Some elements for this thread alone.
    ///
    /// # Safety
    /// As long as they are borrowed, nobody else may use any of them.
    #[inline(always)]
    #[allow(clippy::mut_from_ref)]
    pub(crate) unsafe fn range(&self, range: Range<usize>) -> &mut [T] {
        assert!(range.start <= range.end && range.end <= self.len);
        // SAFETY: within the borrowed slice, and the caller sees to it that nobody else uses these.
        unsafe { std::slice::from_raw_parts_mut(self.start.add(range.start), range.len()) }
    }

    /// All elements, to read and write some of them.
    ///
    /// # Safety
    /// As long as they are borrowed, no element that this thread writes may be used by another, and none that it reads
    /// may be written by another.
    #[inline(always)]
    pub(crate) unsafe fn cells(&self) -> &[Cell<T>] {
        // SAFETY: `Cell<T>` has the layout of `T`; the slice was borrowed mutably; the caller sees to the rest.
        unsafe { std::slice::from_raw_parts(self.start.cast::<Cell<T>>(), self.len) }
    }
}
