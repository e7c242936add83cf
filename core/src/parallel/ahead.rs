//! Reading ahead: what a long pass will come to is asked for in time. Processors foresee that themselves, but not across the many
//! columns of a tile, each of which ends after a few pages.

/// Asks for the memory where an element of a column lies, which may be behind its end. Changes nothing but how long a read takes.
#[inline(always)]
pub(crate) fn fetch<T>(column: &[T], place: usize) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: every x86-64 has the instruction, and it may be given any address.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(column.as_ptr().wrapping_add(place).cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (column, place);
}
