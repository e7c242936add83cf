//! The least of the words of all ranks.

use std::ffi::{c_int, c_void};
use std::mem::MaybeUninit;

use ::mpi::ffi;

use super::communicator::Communicator;
use super::{Library, Pending, started};

/// The reduction of a word of 128 bits to the least one.
pub(in crate::mpi) struct Least {
    word: ffi::MPI_Datatype,
    operation: ffi::MPI_Op,
}

/// Writes the lesser of each two words to `kept`. A word is two numbers of 64 bits, the more significant one first.
unsafe extern "C" fn keep_least(other: *mut c_void, kept: *mut c_void, length: *mut c_int, _: *mut ffi::MPI_Datatype) {
    let (other, kept) = (other.cast::<[u64; 2]>(), kept.cast::<[u64; 2]>());
    // SAFETY: the library passes the length of both lists.
    let length = usize::try_from(unsafe { *length }).unwrap_or(0);
    for index in 0..length {
        // SAFETY: both lists have so many words, if perhaps not aligned.
        unsafe {
            let least = other.add(index).read_unaligned().min(kept.add(index).read_unaligned());
            kept.add(index).write_unaligned(least);
        }
    }
}

impl Least {
    pub(in crate::mpi) fn new(_library: &Library) -> Least {
        let (mut word, mut operation) = (MaybeUninit::uninit(), MaybeUninit::uninit());
        // SAFETY: the library is initialized; the calls write the places they are given; `keep_least` is commutative and
        // associative and reads and writes so many words as it is told.
        unsafe {
            // One element, so that no algorithm cuts a word in two.
            ffi::MPI_Type_contiguous(2, ffi::RSMPI_UINT64_T, word.as_mut_ptr());
            ffi::MPI_Type_commit(word.as_mut_ptr());
            ffi::MPI_Op_create(Some(keep_least), 1, operation.as_mut_ptr());
            Least { word: word.assume_init(), operation: operation.assume_init() }
        }
    }

    /// Begins to find the least word of all ranks. The second vector is the result, as `[high, low]`.
    pub(in crate::mpi) fn of_all(&self, communicator: &Communicator, word: u128) -> Pending<[Vec<u64>; 2]> {
        let own = to_halves(word).to_vec();
        let mut least = vec![0; 2];
        // SAFETY: both buffers hold one word and belong to the operation until it is complete.
        let request = started(|request| unsafe {
            let (from, to) = (own.as_ptr().cast(), least.as_mut_ptr().cast());
            ffi::MPI_Iallreduce(from, to, 1, self.word, self.operation, communicator.handle, request);
        });
        Pending::new(request, [own, least])
    }

    /// Gives the operation back to the library.
    pub(in crate::mpi) fn free(mut self) {
        // SAFETY: both were made by this type and are not used again.
        unsafe {
            ffi::MPI_Op_free(&mut self.operation);
            ffi::MPI_Type_free(&mut self.word);
        }
    }
}

/// A word as two numbers, the more significant one first.
pub(in crate::mpi) fn to_halves(word: u128) -> [u64; 2] {
    [(word >> 64) as u64, word as u64]
}

/// Undoes [`to_halves`].
pub(in crate::mpi) fn from_halves([high, low]: [u64; 2]) -> u128 {
    u128::from(high) << 64 | u128::from(low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_keep_the_order_of_words() {
        let words = [0, 1, u128::from(u64::MAX), 1 << 64, (1 << 64) + 1, u128::MAX - 1, u128::MAX];
        for pair in words.windows(2) {
            assert!(to_halves(pair[0]) < to_halves(pair[1]));
        }
        assert!(words.iter().all(|&word| from_halves(to_halves(word)) == word));
    }

    #[test]
    fn the_lesser_words_are_kept() {
        let mut other: Vec<[u64; 2]> = [5, 1 << 64, u128::MAX].map(to_halves).to_vec();
        let mut kept: Vec<[u64; 2]> = [6, 3, u128::MAX].map(to_halves).to_vec();
        let mut length = 3;
        // SAFETY: both lists have three words, and the type is not looked at.
        unsafe {
            keep_least(other.as_mut_ptr().cast(), kept.as_mut_ptr().cast(), &mut length, std::ptr::null_mut());
        }
        assert_eq!(kept, [5, 3, u128::MAX].map(to_halves));
    }
}
