//! Several threads that solve one batch together, stage by stage.
//!
//! A stage is cut into pieces; each member takes the next piece that is left, and the stage ends when all its pieces are
//! done. Nobody waits for a member that has taken none: one that comes late, or whose processor was taken away between
//! two pieces, finds the stages it missed done. Who takes which piece does not matter: pieces of one stage share nothing.
//!
//! Source: stages of claimed blocks, as in the solver of Box2D v3 (E. Catto).
//!
//! # Who hears of what
//!
//! What is written in a stage is handed on along one way only, from whoever finished a piece to the one who finished the
//! last (`done`), and from there to all who waited for the stage (`state`). A member waits for every stage before it
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
    /// A piece is done: hands on what was done to it, and takes up, for whoever finds it was the last, what was done to
    /// all others.
    const PIECE_DONE: Ordering = Ordering::AcqRel;
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
    /// The stage under way, and in the low half its next piece.
    state: AtomicU64,
    /// Pieces of the stage under way that are done.
    done: AtomicU32,
    /// A member panicked: the others must not wait for its piece.
    abandoned: AtomicBool,
    orderings: PhantomData<O>,
}

/// One of a crew, or somebody who works alone.
pub(crate) struct Member<'a, O = Needed> {
    crew: Option<&'a Crew<O>>,
    /// The stage this member comes to next.
    stage: Cell<u32>,
}

impl<O: Orderings> Crew<O> {
    pub(crate) fn new() -> Self {
        Self {
            state: AtomicU64::new(0),
            done: AtomicU32::new(0),
            abandoned: AtomicBool::new(false),
            orderings: PhantomData,
        }
    }

    /// A member, for one thread.
    pub(crate) fn member(&self) -> Member<'_, O> {
        Member { crew: Some(self), stage: Cell::new(0) }
    }

    /// The next piece of a stage, for the caller alone, who has waited for the stage before.
    fn claim(&self, stage: u32, pieces: u32) -> Option<u32> {
        let mut state = self.state.load(Ordering::Relaxed);
        loop {
            let piece = state as u32;
            if (state >> 32) as u32 != stage || piece >= pieces {
                return None;
            }
            match self.state.compare_exchange_weak(state, state + 1, Ordering::Relaxed, Ordering::Relaxed) {
                Ok(_) => return Some(piece),
                Err(now) => state = now,
            }
        }
    }

    /// Notes that a piece is done. The last one to do so has seen all that the others did, and begins the next stage.
    fn finish(&self, stage: u32, pieces: u32) {
        if self.done.fetch_add(1, O::PIECE_DONE) + 1 == pieces {
            self.done.store(0, Ordering::Relaxed);
            self.state.store(u64::from(stage.wrapping_add(1)) << 32, O::STAGE_BEGINS);
        }
    }

    /// Waits for pieces that others have taken. Then all that was done in the stage is seen.
    fn wait(&self, stage: u32) {
        let mut looks = 0;
        while (self.state.load(O::STAGE_SEEN) >> 32) as u32 == stage {
            assert!(!self.abandoned.load(Ordering::Relaxed), "another thread of this rank panicked");
            looks += 1;
            if looks < sync::PATIENCE { sync::spin_loop() } else { sync::yield_now() }
        }
    }
}

impl<'a, O: Orderings> Member<'a, O> {
    /// Somebody without a crew: all pieces in order.
    pub(crate) fn alone() -> Self {
        Self { crew: None, stage: Cell::new(0) }
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
        Pieces { crew: self.crew, stage, pieces, next: 0, claimed: false }
    }
}

/// The pieces of a stage that fall to one member.
pub(crate) struct Pieces<'a, O: Orderings = Needed> {
    crew: Option<&'a Crew<O>>,
    stage: u32,
    pieces: u32,
    /// Without a crew, the next piece.
    next: u32,
    /// Whether a piece was taken that is not yet reported as done.
    claimed: bool,
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
        if self.claimed {
            crew.finish(self.stage, self.pieces);
        }
        let piece = crew.claim(self.stage, self.pieces);
        self.claimed = piece.is_some();
        if piece.is_none() {
            crew.wait(self.stage);
        }
        piece
    }
}

impl<O: Orderings> Drop for Pieces<'_, O> {
    #[inline(always)]
    fn drop(&mut self) {
        // Only a panic leaves a piece undone.
        if let Some(crew) = self.crew.filter(|_| self.claimed) {
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
        let crew = Crew::<Needed>::new();
        let done: Vec<AtomicU64> = (0..50).map(|_| AtomicU64::new(0)).collect();
        thread::scope(|scope| {
            for _ in 0..3 {
                scope.spawn(|| {
                    let member = crew.member();
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
        let crew = Crew::<Needed>::new();
        let work = || {
            let member = crew.member();
            (0..10).map(|_| member.pieces(3).count()).sum::<usize>()
        };
        assert_eq!((work(), work()), (30, 0));
    }

    #[test]
    fn nobody_waits_for_a_member_that_panicked() {
        let crew = Crew::<Needed>::new();
        let run = || {
            let member = crew.member();
            let mut pieces = member.pieces(1);
            assert_eq!(pieces.next(), None, "a piece to panic with");
        };
        let ends = thread::scope(|scope| [scope.spawn(run), scope.spawn(run)].map(|thread| thread.join().is_err()));
        assert_eq!(ends, [true, true]);
    }
}
