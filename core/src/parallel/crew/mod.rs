//! Several threads that solve one batch together, stage by stage.
//!
//! A stage is cut into pieces, and each of the crew's seats has a run of them. A member takes the pieces of its seat one after the
//! other, then those that are left of other seats, and the stage ends when all are done. Nobody waits for a member that has
//! taken none: one that comes late, or whose processor was taken away between two pieces, finds the stages it missed done.
//! Who takes which piece does not matter, as pieces of one stage share nothing; but who takes the same ones in every stage finds
//! what these are about in his cache.
//!
//! Source: stages of claimed blocks, of which each worker begins with its own, as in the solver of Box2D v3 (E. Catto).
//!
//! # Who hears of what
//!
//! What is written in a stage is handed on along one way only, from whoever has done pieces to the one who finished the
//! last (`done`), and from there to all who waited for the stage (`stage`). A member waits for every stage before it
//! claims a piece of the next, so a claim hands on nothing; nor does the count that begins anew, as it is begun before
//! the stage is. These [`Orderings`] are all there are: the rest is relaxed.
//!
//! `loom` goes through every order in which the members may meet, and shows for each of the orderings that without it a
//! member misses what another wrote:
//!
//! ```sh
//! RUSTFLAGS="--cfg loom" CARGO_TARGET_DIR=target/loom cargo test --release -p atoll-loom crew
//! ```

use std::cell::Cell;
use std::marker::PhantomData;
use sync::{AtomicBool, AtomicU32, AtomicU64, Ordering};

#[cfg(all(test, loom))]
mod loom_tests;

#[cfg(not(loom))]
mod sync {
    pub(super) use std::hint::spin_loop;
    pub(super) use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
    pub(super) use std::thread::yield_now;

    /// How often a member looks before it lets others have the processor.
    pub(super) const PATIENCE: u32 = 2000;
}

#[cfg(loom)]
mod sync {
    pub(super) use loom::hint::spin_loop;
    pub(super) use loom::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
    pub(super) use loom::thread::yield_now;

    /// A model tries every order: looking twice shows no more than looking once.
    pub(super) const PATIENCE: u32 = 0;
}

/// The orderings by which members hear of each other's work. Types, so that checks can try weaker ones.
pub(crate) trait Orderings {
    /// Pieces are done: hands on what was done to them, and takes up, for whoever finds that these were the last, what was done to
    /// all others.
    const PIECES_DONE: Ordering = Ordering::AcqRel;
    /// The next stage begins: hands on all that was done in the one before.
    const STAGE_BEGINS: Ordering = Ordering::Release;
    /// A stage is seen to have begun: takes that up.
    const STAGE_SEEN: Ordering = Ordering::Acquire;
}

/// The orderings of every crew that works.
pub(crate) struct Needed;

impl Orderings for Needed {}

/// What the members share.
pub(crate) struct Crew<O = Needed> {
    /// The stage under way.
    stage: AtomicU32,
    /// Pieces of it that are known to be done.
    done: AtomicU32,
    /// A member panicked: the others must not wait for its piece.
    abandoned: AtomicBool,
    seats: Box<[Seat]>,
    orderings: PhantomData<O>,
}

/// Where a member sits. In memory of its own, as mostly nobody else asks for it.
#[repr(align(128))]
struct Seat {
    /// The last stage of which one of its pieces was claimed, and in the low half how many were.
    claimed: AtomicU64,
}

/// One of a crew, or somebody who works alone.
pub(crate) struct Member<'a, O = Needed> {
    crew: Option<&'a Crew<O>>,
    seat: usize,
    /// The stage this member comes to next.
    stage: Cell<u32>,
}

impl<O: Orderings> Crew<O> {
    /// A crew of so many seats, at least one.
    pub(crate) fn new(seats: usize) -> Self {
        Self {
            stage: AtomicU32::new(0),
            done: AtomicU32::new(0),
            abandoned: AtomicBool::new(false),
            seats: (0..seats).map(|_| Seat { claimed: AtomicU64::new(0) }).collect(),
            orderings: PhantomData,
        }
    }

    /// A member, for one thread. The seat is the one of that number, counted around; several may share it.
    pub(crate) fn member(&self, seat: usize) -> Member<'_, O> {
        Member { crew: Some(self), seat: seat % self.seats.len(), stage: Cell::new(0) }
    }

    /// Where the pieces of a seat begin, of so many.
    fn first_of(&self, seat: usize, pieces: u32) -> u32 {
        (seat * pieces as usize).div_ceil(self.seats.len()) as u32
    }

    /// The next piece of a stage that falls to a seat, for the caller alone, who has waited for the stage before.
    fn claim(&self, seat: usize, stage: u32, pieces: u32) -> Option<u32> {
        let (first, end) = (self.first_of(seat, pieces), self.first_of(seat + 1, pieces));
        if first == end {
            return None;
        }
        let claimed = &self.seats[seat].claimed;
        let mut state = claimed.load(Ordering::Relaxed);
        loop {
            // As long as a stage is under way there is no claim of a later one, and it does not end before all are claimed.
            let count = match stage.wrapping_sub((state >> 32) as u32) as i32 {
                0 => state as u32,
                later if later > 0 => 0,
                _ => return None,
            };
            if first + count >= end {
                return None;
            }
            let next = u64::from(stage) << 32 | u64::from(count + 1);
            match claimed.compare_exchange_weak(state, next, Ordering::Relaxed, Ordering::Relaxed) {
                Ok(_) => return Some(first + count),
                Err(now) => state = now,
            }
        }
    }

    /// Notes that so many pieces more are done. Who does the last has seen all that the others did, and begins the next stage.
    fn finish(&self, stage: u32, count: u32, pieces: u32) {
        if self.done.fetch_add(count, O::PIECES_DONE) + count == pieces {
            self.done.store(0, Ordering::Relaxed);
            self.stage.store(stage.wrapping_add(1), O::STAGE_BEGINS);
        }
    }

    /// Waits for pieces that others have taken. Then all that was done in the stage is seen.
    fn wait(&self, stage: u32) {
        let mut looks = 0;
        while self.stage.load(O::STAGE_SEEN) == stage {
            assert!(!self.abandoned.load(Ordering::Relaxed), "another thread of this rank panicked");
            looks += 1;
            if looks < sync::PATIENCE { sync::spin_loop() } else { sync::yield_now() }
        }
    }
}

impl<'a, O: Orderings> Member<'a, O> {
    /// Somebody without a crew: all pieces in order.
    pub(crate) fn alone() -> Self {
        Self { crew: None, seat: 0, stage: Cell::new(0) }
    }

    /// One stage of so many pieces, at least one: those that fall to this member. After the last it waits until all are
    /// done. Every member calls it with the same number, in the same order of stages, and takes all there are.
    ///
    /// An iterator, not a function that is given the work: what is done to a piece must be compiled within the caller,
    /// for the caller's processor (see [`super::lanes`]).
    #[inline(always)]
    pub(crate) fn pieces(&self, pieces: u32) -> Pieces<'a, O> {
        let stage = self.stage.get();
        self.stage.set(stage.wrapping_add(1));
        Pieces { crew: self.crew, seat: self.seat, others: 0, stage, pieces, next: 0, claimed: 0 }
    }
}

/// The pieces of a stage that fall to one member.
pub(crate) struct Pieces<'a, O: Orderings = Needed> {
    crew: Option<&'a Crew<O>>,
    seat: usize,
    /// How many seats have nothing left, from its own on.
    others: usize,
    stage: u32,
    pieces: u32,
    /// Without a crew, the next piece.
    next: u32,
    /// How many pieces were taken that are not yet reported as done.
    claimed: u32,
}

impl<O: Orderings> Pieces<'_, O> {
    /// The next piece of a crew's stage.
    fn claim(&mut self, crew: &Crew<O>) -> Option<u32> {
        let seats = crew.seats.len();
        while self.others < seats {
            let piece = crew.claim((self.seat + self.others) % seats, self.stage, self.pieces);
            if piece.is_some() {
                self.claimed += 1;
                return piece;
            }
            self.others += 1;
        }
        let claimed = std::mem::take(&mut self.claimed);
        if claimed > 0 {
            crew.finish(self.stage, claimed, self.pieces);
        }
        crew.wait(self.stage);
        None
    }
}

impl<O: Orderings> Iterator for Pieces<'_, O> {
    type Item = u32;
    #[inline(always)]
    fn next(&mut self) -> Option<u32> {
        let Some(crew) = self.crew else {
            let piece = self.next;
            self.next += 1;
            return (piece < self.pieces).then_some(piece);
        };
        self.claim(crew)
    }
}

impl<O: Orderings> Drop for Pieces<'_, O> {
    #[inline(always)]
    fn drop(&mut self) {
        // Only a panic leaves a piece undone.
        if let Some(crew) = self.crew.filter(|_| self.claimed > 0) {
            crew.abandoned.store(true, Ordering::Relaxed);
        }
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use std::thread;

    #[test]
    fn every_piece_is_done_once_and_stages_do_not_overlap() {
        let crew = Crew::<Needed>::new(2);
        let done: Vec<AtomicU64> = (0..50).map(|_| AtomicU64::new(0)).collect();
        thread::scope(|scope| {
            for seat in 0..3 {
                let (crew, done) = (&crew, &done);
                scope.spawn(move || {
                    let member = crew.member(seat);
                    for stage in 0..200 {
                        for piece in member.pieces(50) {
                            let before = done[piece as usize].fetch_add(1, Ordering::Relaxed);
                            assert_eq!(before, stage);
                        }
                        // After a stage, all of it is seen.
                        assert!(done.iter().all(|count| count.load(Ordering::Relaxed) > stage));
                    }
                });
            }
        });
        assert!(done.iter().all(|count| count.load(Ordering::Relaxed) == 200));
    }

    #[test]
    fn a_member_that_comes_late_finds_all_done() {
        let crew = Crew::<Needed>::new(4);
        let work = || {
            let member = crew.member(1);
            (0..10).map(|_| member.pieces(3).count()).sum::<usize>()
        };
        assert_eq!((work(), work()), (30, 0));
    }

    #[test]
    fn nobody_waits_for_a_member_that_panicked() {
        let crew = Crew::<Needed>::new(2);
        let run = || {
            let member = crew.member(0);
            let mut pieces = member.pieces(1);
            assert_eq!(pieces.next(), None, "a piece to panic with");
        };
        let ends = thread::scope(|scope| [scope.spawn(run), scope.spawn(run)].map(|thread| thread.join().is_err()));
        assert_eq!(ends, [true, true]);
    }

    #[test]
    fn each_seat_has_its_own_pieces_and_then_those_of_others() {
        for (seats, seat, pieces, order) in [
            (2, 0, 4, vec![0, 1, 2, 3]),
            (2, 1, 4, vec![2, 3, 0, 1]),
            (3, 4, 5, vec![2, 3, 4, 0, 1]),
            (3, 2, 1, vec![0]),
        ] {
            let crew = Crew::<Needed>::new(seats);
            assert!(crew.member(seat).pieces(pieces).eq(order), "seat {seat} of {seats}");
        }
    }
}
