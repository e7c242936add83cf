//! Several threads that solve one batch together, stage by stage.
//!
//! A stage is cut into pieces; each member takes the next piece that is left, and the stage ends when all its pieces are
//! done. Nobody waits for a member that has taken none: one that comes late, or whose processor was taken away between
//! two pieces, finds the stages it missed done. Who takes which piece does not matter: pieces of one stage share nothing.
//!
//! Source: stages of claimed blocks, as in the solver of Box2D v3 (E. Catto).

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::thread;

/// How often a member looks before it lets others have the processor.
const PATIENCE: u32 = 2000;

/// What the members share.
#[derive(Default, Debug)]
pub(crate) struct Crew {
    /// The stage under way, and in the low half its next piece.
    state: AtomicU64,
    /// Pieces of the stage under way that are done.
    done: AtomicU32,
    /// A member panicked: the others must not wait for its piece.
    abandoned: AtomicBool,
}

/// One of a crew, or somebody who works alone.
pub(crate) struct Member<'a> {
    crew: Option<&'a Crew>,
    /// The stage this member comes to next.
    stage: Cell<u32>,
}

impl Crew {
    /// A member, for one thread.
    pub(crate) fn member(&self) -> Member<'_> {
        Member { crew: Some(self), stage: Cell::new(0) }
    }

    /// The next piece of a stage, for the caller alone. What was done in earlier stages is seen: `state` hands it on.
    fn claim(&self, stage: u32, pieces: u32) -> Option<u32> {
        let mut state = self.state.load(Ordering::Acquire);
        loop {
            let piece = state as u32;
            if (state >> 32) as u32 != stage || piece >= pieces {
                return None;
            }
            match self.state.compare_exchange_weak(state, state + 1, Ordering::Acquire, Ordering::Acquire) {
                Ok(_) => return Some(piece),
                Err(now) => state = now,
            }
        }
    }

    /// Notes that a piece is done. The last one to do so has seen all that the others did, and begins the next stage.
    fn finish(&self, stage: u32, pieces: u32) {
        if self.done.fetch_add(1, Ordering::AcqRel) + 1 == pieces {
            self.done.store(0, Ordering::Relaxed);
            self.state.store(u64::from(stage.wrapping_add(1)) << 32, Ordering::Release);
        }
    }

    /// Waits for pieces that others have taken.
    fn wait(&self, stage: u32) {
        let mut looks = 0;
        while (self.state.load(Ordering::Acquire) >> 32) as u32 == stage {
            assert!(!self.abandoned.load(Ordering::Relaxed), "another thread of this rank panicked");
            looks += 1;
            if looks < PATIENCE { std::hint::spin_loop() } else { thread::yield_now() }
        }
    }
}

impl<'a> Member<'a> {
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
    pub(crate) fn pieces(&self, pieces: u32) -> Pieces<'a> {
        let stage = self.stage.get();
        self.stage.set(stage.wrapping_add(1));
        Pieces { crew: self.crew, stage, pieces, next: 0, claimed: false }
    }
}

/// The pieces of a stage that fall to one member.
pub(crate) struct Pieces<'a> {
    crew: Option<&'a Crew>,
    stage: u32,
    pieces: u32,
    /// Without a crew, the next piece.
    next: u32,
    /// Whether a piece was taken that is not yet reported as done.
    claimed: bool,
}

impl Iterator for Pieces<'_> {
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

impl Drop for Pieces<'_> {
    #[inline(always)]
    fn drop(&mut self) {
        // Only a panic leaves a piece undone.
        if let Some(crew) = self.crew.filter(|_| self.claimed) {
            crew.abandoned.store(true, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_piece_is_done_once_and_stages_do_not_overlap() {
        let crew = Crew::default();
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
        let crew = Crew::default();
        let work = || {
            let member = crew.member();
            (0..10).map(|_| member.pieces(3).count()).sum::<usize>()
        };
        assert_eq!((work(), work()), (30, 0));
    }

    #[test]
    fn nobody_waits_for_a_member_that_panicked() {
        let crew = Crew::default();
        let run = || {
            let member = crew.member();
            let mut pieces = member.pieces(1);
            assert_eq!(pieces.next(), None, "a piece to panic with");
        };
        let ends = thread::scope(|scope| [scope.spawn(run), scope.spawn(run)].map(|thread| thread.join().is_err()));
        assert_eq!(ends, [true, true]);
    }
}
