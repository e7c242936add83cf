//! Reading ahead: what a long pass will come to is asked for in time. Processors foresee that themselves, but not across the many
//! columns of a tile, each of which ends after a few pages.

/// Asks for all the memory of something, which need not be there. Changes nothing but how long a read takes.
#[inline(always)]
pub(crate) fn fetch_whole<T>(what: *const T) {
    const LINE: usize = 64;
    for line in 0..size_of::<T>().div_ceil(LINE) {
        prefetch(what.cast::<u8>().wrapping_add(LINE * line));
    }
}

/// Asks for the memory where an element of a column lies, which may be behind its end. Changes nothing but how long a read takes.
#[inline(always)]
pub(crate) fn fetch<T>(column: &[T], place: usize) {
    prefetch(column.as_ptr().wrapping_add(place));
}

#[inline(always)]
fn prefetch<T>(at: *const T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: every x86-64 has the instruction, and it may be given any address.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(at.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = at;
}
