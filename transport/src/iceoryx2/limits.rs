//! What a run needs of the machine, checked before it starts and before it grows.
//!
//! Shared memory has to be there before it is used: pages are taken on first access, and an access that finds none
//! kills the process.

use rustix::fs::statvfs;
use rustix::process::{Resource, getrlimit, setrlimit};

use crate::Rank;

/// Where the kernel keeps named shared memory.
pub(super) const SHARED_MEMORY: &str = "/dev/shm";

/// The most ranks that one run may have. The number of queues grows with its square; more work for one machine
/// belongs into threads of a rank.
pub const MAX_RANKS: usize = 64;

/// Shared memory that a rank takes, in bytes. Measured, and rounded up.
const RANK_BYTES: u64 = 256 << 10;

/// Shared memory that each directed pair of ranks takes, in bytes: a queue, and messages of some tens of kilobytes.
const PAIR_BYTES: u64 = 96 << 10;

/// Files that a rank has open, its own and the program's. Measured, and rounded up.
const RANK_FILES: u64 = 64;

/// Files that a rank has open for each other rank.
const PEER_FILES: u64 = 10;

/// Shared memory that is left free when messages grow, for what is not counted.
const RESERVE: u64 = 4 << 20;

/// What the machine has to give.
#[derive(Clone, Copy, Debug)]
pub(super) struct Machine {
    /// Free shared memory, in bytes.
    pub(super) shared_memory: u64,
    /// The most files that one process may open.
    pub(super) open_files: u64,
}

impl Machine {
    /// This machine, after raising the limit on open files as far as it goes; processes started from here inherit that.
    pub(super) fn ours() -> Machine {
        let mut files = getrlimit(Resource::Nofile);
        if files.current != files.maximum {
            files.current = files.maximum;
            // Where it is refused, the old limit holds, and is what counts below.
            let _ = setrlimit(Resource::Nofile, files);
        }
        let open_files = getrlimit(Resource::Nofile).current.unwrap_or(u64::MAX);
        Machine { shared_memory: free_shared_memory(), open_files }
    }

    /// Whether so many ranks can run here.
    ///
    /// # Errors
    /// What is missing, as a sentence.
    pub(super) fn check(&self, ranks: usize) -> Result<(), String> {
        if ranks == 0 || ranks > MAX_RANKS {
            return Err(format!(
                "{ranks} ranks asked for, but a run by shared memory has 1 to {MAX_RANKS}: use fewer ranks, with more \
                 threads"
            ));
        }
        let count = ranks as u64;
        let bytes = count * RANK_BYTES + count * (count - 1) * PAIR_BYTES + RESERVE;
        if bytes > self.shared_memory {
            return Err(format!(
                "{SHARED_MEMORY} has {} MB free and {ranks} ranks need about {} MB: \
                 use fewer ranks or enlarge it (docker run --shm-size=1g)",
                self.shared_memory >> 20,
                bytes.div_ceil(1 << 20)
            ));
        }
        let files = RANK_FILES + (count - 1) * PEER_FILES;
        if files > self.open_files {
            return Err(format!(
                "a process may open {} files here and each of {ranks} ranks needs about {files}: \
                 use fewer ranks or raise the limit (ulimit -n {files})",
                self.open_files
            ));
        }
        Ok(())
    }
}

/// Free shared memory, in bytes; 0 if there is no such place.
fn free_shared_memory() -> u64 {
    statvfs(SHARED_MEMORY).map_or(0, |state| state.f_bavail.saturating_mul(state.f_frsize))
}

/// Whether messages may take so many more bytes of shared memory.
///
/// # Errors
/// A clause that begins with "it".
pub(super) fn check_growth(bytes: u64) -> Result<(), String> {
    let free = free_shared_memory();
    if bytes.saturating_add(RESERVE) <= free {
        return Ok(());
    }
    Err(format!(
        "it is out of shared memory: {SHARED_MEMORY} has {} MB free and its messages need {} MB more, \
         use fewer ranks or enlarge it (docker run --shm-size=1g)",
        free >> 20,
        bytes.div_ceil(1 << 20)
    ))
}

/// The clause for a message that found no memory.
pub(super) fn out_of_memory(to: Rank, length: usize, error: &dyn std::fmt::Display) -> String {
    format!(
        "it is out of shared memory for a message of {length} bytes to rank {to} ({error}): {SHARED_MEMORY} has {} MB \
         free, use fewer ranks or enlarge it (docker run --shm-size=1g)",
        free_shared_memory() >> 20
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLENTY: Machine = Machine { shared_memory: 1 << 40, open_files: 1 << 20 };

    #[test]
    fn a_large_machine_takes_as_many_as_are_allowed() {
        assert_eq!(PLENTY.check(1), Ok(()));
        assert_eq!(PLENTY.check(MAX_RANKS), Ok(()));
        for ranks in [0, MAX_RANKS + 1] {
            let refused = PLENTY.check(ranks).unwrap_err();
            assert!(refused.starts_with(&format!("{ranks} ranks asked for")), "{refused}");
        }
    }

    #[test]
    fn what_is_missing_is_told_in_one_line() {
        let small = Machine { shared_memory: 8 << 20, ..PLENTY };
        assert_eq!(small.check(1), Ok(()));
        let refused = small.check(8).unwrap_err();
        assert!(refused.starts_with("/dev/shm has 8 MB free and 8 ranks need about "), "{refused}");
        assert!(refused.contains("--shm-size"), "{refused}");

        let few = Machine { open_files: 100, ..PLENTY };
        assert_eq!(few.check(2), Ok(()));
        let refused = few.check(16).unwrap_err();
        assert!(
            refused.starts_with("a process may open 100 files here and each of 16 ranks needs about "),
            "{refused}"
        );
        assert!(refused.contains("ulimit -n") && !refused.contains('\n'), "{refused}");
    }

    #[test]
    fn this_machine_is_measured() {
        let ours = Machine::ours();
        assert!(ours.shared_memory > 0 && ours.open_files > 0, "{ours:?}");
        let limit = getrlimit(Resource::Nofile);
        assert_eq!(limit.current, limit.maximum, "the limit is raised as far as it goes");
    }

    #[test]
    fn growth_beyond_the_machine_is_refused() {
        assert_eq!(check_growth(1), Ok(()));
        for bytes in [1 << 60, u64::MAX] {
            let refused = check_growth(bytes).unwrap_err();
            assert!(refused.starts_with("it is out of shared memory"), "{refused}");
        }
    }
}
