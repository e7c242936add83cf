//! Several threads that solve one batch together, stage by stage.
//!
//! A stage is cut into pieces; each member takes the next piece that is left, and none begins a stage before all have
//! ended the one before. Who takes which piece does not matter: pieces of one stage share nothing.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread;

/// How often a member looks before it lets others have the processor.
const PATIENCE: u32 = 4000;

/// What the members share.
#[derive(Debug)]
pub(super) struct Crew {
    size: u32,
    /// The next piece of the stage under way.
    next: AtomicU32,
    arrived: AtomicU32,
    /// Stages that all have ended.
    stages: AtomicU32,
    /// A member panicked: the others must not wait for it.
    abandoned: AtomicBool,
}

/// One of a crew, or somebody who works alone.
#[derive(Clone, Copy)]
pub(super) struct Member<'a>(Option<&'a Crew>);

impl Crew {
    pub(super) fn new(size: usize) -> Self {
        Self {
            size: size as u32,
            next: AtomicU32::new(0),
            arrived: AtomicU32::new(0),
            stages: AtomicU32::new(0),
            abandoned: AtomicBool::new(false),
        }
    }

    /// To be called once by each of as many threads as the crew has members, all at once.
    pub(super) fn member(&self) -> Member<'_> {
        Member(Some(self))
    }

    /// Waits for the others. What each wrote before is seen by all after: arriving releases it and acquires what those
    /// before released, and the last to arrive hands all of that on through `stages`.
    fn wait(&self) {
        let stage = self.stages.load(Ordering::Relaxed);
        if self.arrived.fetch_add(1, Ordering::AcqRel) + 1 == self.size {
            self.next.store(0, Ordering::Relaxed);
            self.arrived.store(0, Ordering::Relaxed);
            self.stages.store(stage.wrapping_add(1), Ordering::Release);
            return;
        }
        let mut looks = 0;
        while self.stages.load(Ordering::Acquire) == stage {
            assert!(!self.abandoned.load(Ordering::Relaxed), "another thread of this rank panicked");
            looks += 1;
            if looks < PATIENCE { std::hint::spin_loop() } else { thread::yield_now() }
        }
    }
}

impl<'a> Member<'a> {
    /// Somebody without a crew: all pieces in order.
    pub(super) const ALONE: Self = Self(None);

    /// One stage of so many pieces: those that fall to this member. After the last it waits for the others. Every member
    /// calls it with the same number, in the same order of stages, and takes all there are.
    ///
    /// An iterator, not a function that is given the work: what is done to a piece must be compiled within the caller,
    /// for the caller's processor (see [`super::lanes`]).
    #[inline(always)]
    pub(super) fn pieces(self, pieces: u32) -> Pieces<'a> {
        Pieces { crew: self.0, next: 0, pieces }
    }
}

/// The pieces of a stage that fall to one member.
pub(super) struct Pieces<'a> {
    crew: Option<&'a Crew>,
    next: u32,
    pieces: u32,
}

impl Iterator for Pieces<'_> {
    type Item = u32;
    #[inline(always)]
    fn next(&mut self) -> Option<u32> {
        let piece = match self.crew {
            None => self.next,
            Some(crew) => crew.next.fetch_add(1, Ordering::Relaxed),
        };
        if piece < self.pieces {
            self.next = piece + 1;
            return Some(piece);
        }
        if let Some(crew) = self.crew {
            crew.wait();
        }
        None
    }
}

impl Drop for Pieces<'_> {
    #[inline(always)]
    fn drop(&mut self) {
        // Nobody is to wait for a member that panicked.
        if let Some(crew) = self.crew.filter(|_| thread::panicking()) {
            crew.abandoned.store(true, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicU64;

    #[test]
    fn every_piece_is_done_once_and_stages_do_not_overlap() {
        let crew = Crew::new(3);
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
                    }
                });
            }
        });
        assert!(done.iter().all(|count| count.load(Ordering::Relaxed) == 200));
    }

    #[test]
    fn nobody_waits_for_a_member_that_panicked() {
        let crew = Crew::new(2);
        let ends = thread::scope(|scope| {
            let run = || {
                let member = crew.member();
                assert!(member.pieces(2).count() <= 2);
                for _ in member.pieces(1) {
                    std::panic::resume_unwind(Box::new("on purpose"));
                }
            };
            let threads = [scope.spawn(run), scope.spawn(run)];
            threads.map(|thread| thread.join().is_err())
        });
        assert_eq!(ends, [true, true]);
    }
}
