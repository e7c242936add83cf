//! The seats of all ranks, in a file that every process of a run maps.
//!
//! A rank that has nothing to do looks at its own bell, first awake and then asleep in the kernel (a futex). iceoryx2's own
//! events cost a socket per pair of ranks and a system call per message.

#![allow(unsafe_code)]

use std::fs::OpenOptions;
use std::hint::spin_loop;
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::ptr::{NonNull, null_mut};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering, fence};
use std::thread;
use std::time::{Duration, Instant};

use rustix::fs::Timespec;
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};
use rustix::thread::futex;

use crate::Rank;
use crate::seat::{Bell, Memory, Word};

/// Looks at the bell before the processor is offered to others: some microseconds.
const SPINS: u32 = 500;

/// Offers of the processor to others before this rank sleeps.
const YIELDS: u32 = 20;

/// Memory that several processes map.
#[derive(Debug)]
struct Mapped;

impl Memory for Mapped {
    type Bell = AtomicU32;
    type Word = AtomicU64;

    fn fence(order: Ordering) {
        fence(order);
    }
}

impl Bell for AtomicU32 {
    fn load(&self, order: Ordering) -> u32 {
        self.load(order)
    }

    fn fetch_add(&self, count: u32, order: Ordering) -> u32 {
        self.fetch_add(count, order)
    }

    fn sleep(&self, at: u32, limit: Duration) {
        let limit = Timespec { tv_sec: limit.as_secs() as i64, tv_nsec: i64::from(limit.subsec_nanos()) };
        // However it returns: whoever sleeps looks again.
        let _ = futex::wait(self, futex::Flags::empty(), at, Some(&limit));
    }

    fn wake(&self) {
        // It fails for addresses that are none; the worst that follows is a sleep that lasts its time.
        let _ = futex::wake(self, futex::Flags::empty(), 1);
    }
}

impl Word for AtomicU64 {
    fn load(&self, order: Ordering) -> u64 {
        self.load(order)
    }

    fn store(&self, value: u64, order: Ordering) {
        self.store(value, order);
    }

    fn swap(&self, value: u64, order: Ordering) -> u64 {
        self.swap(value, order)
    }

    fn exchange(&self, old: u64, new: u64, order: Ordering) -> bool {
        self.compare_exchange(old, new, order, order).is_ok()
    }
}

/// What lies in the file, once for each rank.
type Seat = crate::seat::Seat<Mapped>;

/// The seats of all ranks, mapped into this process.
#[derive(Debug)]
pub(super) struct Board {
    seats: NonNull<Seat>,
    size: usize,
}

// SAFETY: the mapping belongs to the process, not to a thread, and everything in it is atomic.
unsafe impl Send for Board {}
// SAFETY: as above.
unsafe impl Sync for Board {}

impl Board {
    /// Makes the file of a board where everything is zero.
    pub(super) fn create(path: &Path, size: usize) -> io::Result<()> {
        let mut file = OpenOptions::new().write(true).create_new(true).mode(0o600).open(path)?;
        // Written and not merely lengthened, so that no later access can find the file system full.
        file.write_all(&vec![0; Board::bytes(size)])
    }

    /// Maps the board of a run of `size` ranks.
    pub(super) fn open(path: &Path, size: usize) -> io::Result<Board> {
        let file = OpenOptions::new().read(true).write(true).open(path)?;
        if file.metadata()?.len() != Board::bytes(size) as u64 {
            return Err(io::Error::new(io::ErrorKind::InvalidData, "it is not the board of a run of this size"));
        }
        let (access, flags) = (ProtFlags::READ | ProtFlags::WRITE, MapFlags::SHARED);
        // SAFETY: a new mapping at an address of the kernel's choice, of a file at least as long.
        let address = unsafe { mmap(null_mut(), Board::bytes(size), access, flags, &file, 0) }?;
        let seats = NonNull::new(address.cast()).ok_or(io::ErrorKind::OutOfMemory)?;
        Ok(Board { seats, size })
    }

    fn bytes(size: usize) -> usize {
        size * size_of::<Seat>()
    }

    fn seat(&self, rank: Rank) -> &Seat {
        assert!(rank.index() < self.size, "rank {rank} of {}", self.size);
        // SAFETY: the mapping holds `size` seats for as long as `self` lives, page-aligned; every bit pattern is a
        // seat, and all processes access it through atomics only.
        unsafe { self.seats.add(rank.index()).as_ref() }
    }

    /// Tells `rank` that a message was sent to it.
    pub(super) fn ring(&self, rank: Rank) {
        self.seat(rank).ring();
    }

    /// Wakes `rank` whatever it waits for.
    pub(super) fn alarm(&self, rank: Rank) {
        self.seat(rank).alarm();
    }

    /// The count of the bell of `rank`. Messages counted in it are there to be received.
    pub(super) fn rung(&self, rank: Rank) -> u32 {
        self.seat(rank).rung()
    }

    /// Returns when the bell of `rank`, which is this process, shows that `missing` messages came after it stood at
    /// `seen`, at an alarm, or after `limit`. May return early.
    pub(super) fn wait(&self, rank: Rank, seen: u32, missing: u32, limit: Duration, spin: bool) {
        let seat = self.seat(rank);
        for look in 0..if spin { SPINS + YIELDS } else { YIELDS } {
            if seat.rung() != seen {
                return;
            }
            if spin && look < SPINS { spin_loop() } else { thread::yield_now() }
        }
        let started = Instant::now();
        let left = || Some(limit.saturating_sub(started.elapsed())).filter(|left| !left.is_zero());
        seat.sleep(seen.wrapping_add(missing), left);
    }

    /// Records that `rank` has received everything of that many rounds.
    pub(super) fn complete(&self, rank: Rank, rounds: u64) {
        self.seat(rank).complete(rounds);
    }

    /// Of how many rounds `rank` has received everything.
    pub(super) fn completed(&self, rank: Rank) -> u64 {
        self.seat(rank).completed()
    }

    /// Records that `rank` sends and receives no more, and wakes all others.
    pub(super) fn leave(&self, rank: Rank) {
        let others = Rank::all(self.size).filter(|&other| other != rank);
        self.seat(rank).leave(others.map(|other| self.seat(other)));
    }

    /// Whether `rank` sends no more. What it had sent is there to be received.
    pub(super) fn is_gone(&self, rank: Rank) -> bool {
        self.seat(rank).is_gone()
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        // SAFETY: this mapping, whose borrows end with `self`. It cannot fail for a mapping that exists.
        let _ = unsafe { munmap(self.seats.as_ptr().cast(), Board::bytes(self.size)) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    const LONG: Duration = Duration::from_secs(60);

    /// The same board mapped twice, as by two processes.
    fn boards(name: &str, size: usize) -> (Arc<Board>, Board) {
        let path = std::env::temp_dir().join(format!("atoll-board-{name}-{}", std::process::id()));
        Board::create(&path, size).unwrap();
        let pair = (Arc::new(Board::open(&path, size).unwrap()), Board::open(&path, size).unwrap());
        assert!(Board::open(&path, size + 1).is_err(), "a board of another size is refused");
        std::fs::remove_file(&path).unwrap();
        pair
    }

    #[test]
    fn a_sleeper_wakes_at_the_last_message_it_misses() {
        let (sleeper, ringer) = boards("last", 2);
        for round in 0..200 {
            let seen = sleeper.rung(Rank(1));
            let board = Arc::clone(&sleeper);
            let thread = thread::spawn(move || {
                let started = Instant::now();
                while board.rung(Rank(1)).wrapping_sub(seen) < 3 {
                    board.wait(Rank(1), seen, 3, LONG, round % 2 == 0);
                }
                started.elapsed()
            });
            for _ in 0..3 {
                ringer.ring(Rank(1));
            }
            assert!(thread.join().unwrap() < LONG, "slept through the bell");
        }
    }

    #[test]
    fn an_alarm_wakes_whatever_is_missing() {
        let (sleeper, ringer) = boards("alarm", 3);
        let seen = sleeper.rung(Rank(2));
        let board = Arc::clone(&sleeper);
        let thread = thread::spawn(move || {
            let started = Instant::now();
            while !board.is_gone(Rank(0)) {
                board.wait(Rank(2), seen, 60, LONG, false);
            }
            started.elapsed()
        });
        thread::sleep(Duration::from_millis(20));
        ringer.leave(Rank(0));
        assert!(thread.join().unwrap() < LONG, "slept through the alarm");
        assert!(!sleeper.is_gone(Rank(1)));
    }

    #[test]
    fn a_wait_ends_after_its_limit_where_the_count_wraps() {
        let (board, _) = boards("limit", 1);
        board.seat(Rank(0)).ring_by(u32::MAX);
        let seen = board.rung(Rank(0));
        board.wait(Rank(0), seen, 4, Duration::from_millis(5), true);
        assert_eq!(board.rung(Rank(0)), seen);
    }

    #[test]
    fn each_rank_counts_its_own_rounds() {
        let (one, other) = boards("rounds", 2);
        one.complete(Rank(0), 7);
        assert_eq!((other.completed(Rank(0)), other.completed(Rank(1))), (7, 0));
    }
}
