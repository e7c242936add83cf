//! Models of a crew, and of crews whose orderings are too weak.

use super::*;
use loom::cell::Cell as Seen;
use loom::thread;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// A crew with what it works on.
struct Work<O> {
    crew: Crew<O>,
    /// As many as a stage has pieces. Each is given its number of the stage by whoever takes the piece.
    things: Vec<Seen<u32>>,
    stages: u32,
}

impl<O: Orderings> Work<O> {
    fn new(seats: u32, stages: u32, pieces: u32) -> Self {
        Self { crew: Crew::new(seats as usize), things: (0..pieces).map(|_| Seen::new(0)).collect(), stages }
    }

    /// What one member does; returns how many pieces fell to it. A stage's pieces are the things in another order than
    /// in the stage before, so that what one member wrote is another's to read. The cells see to it that whoever touches
    /// a thing has seen what was done to it before; the counts, that it was done once in each stage.
    fn member(&self, seat: u32) -> u32 {
        let (member, pieces) = (self.crew.member(seat as usize), self.things.len() as u32);
        let mut taken = 0;
        for stage in 0..self.stages {
            for piece in member.pieces(pieces) {
                let thing = &self.things[((piece + stage) % pieces) as usize];
                assert_eq!(thing.get(), stage, "stages overlap, or a piece was done twice or never");
                thing.set(stage + 1);
                taken += 1;
            }
        }
        // After the last stage, all of it is seen.
        self.things.iter().for_each(|thing| assert_eq!(thing.get(), self.stages));
        taken
    }
}

/// Every order of events in which no thread is interrupted more often than `interrupted` in all, beside where it waits:
/// each one more takes ten times longer, and three who wait for each other may be made to wait for ever.
fn check<O: Orderings + 'static>(members: u32, stages: u32, pieces: u32, interrupted: usize) {
    let mut model = loom::model::Builder::new();
    model.preemption_bound = Some(interrupted);
    model.check(move || {
        let work = Arc::new(Work::<O>::new(members.min(2), stages, pieces));
        let spawn = |seat| {
            let work = work.clone();
            thread::spawn(move || work.member(seat))
        };
        let others: Vec<_> = (1..members).map(spawn).collect();
        let own = work.member(0);
        let all = own + others.into_iter().map(|other| other.join().unwrap()).sum::<u32>();
        assert_eq!(all, stages * pieces);
    });
}

#[test]
fn loom_each_piece_is_done_once_and_seen_in_the_next_stage() {
    check::<Needed>(2, 2, 2, 4);
    check::<Needed>(2, 3, 1, 4);
    check::<Needed>(3, 2, 2, 1);
    check::<Needed>(3, 1, 3, 1);
}

#[test]
fn loom_a_member_that_comes_late_finds_all_done() {
    loom::model(|| {
        let work = Arc::new(Work::<Needed>::new(2, 2, 2));
        assert_eq!(work.member(0), 4);
        let late = work.clone();
        assert_eq!(thread::spawn(move || late.member(1)).join().unwrap(), 0);
    });
}

#[test]
fn loom_nobody_waits_for_a_member_that_panicked() {
    loom::model(|| {
        let crew = Arc::new(Crew::<Needed>::new(1));
        // Whoever gets the piece drops it undone, as a panic does.
        let run = |crew: &Crew<Needed>| {
            let member = crew.member(0);
            let mut pieces = member.pieces(1);
            catch_unwind(AssertUnwindSafe(|| pieces.next())).map_err(drop)
        };
        let others = crew.clone();
        let other = thread::spawn(move || run(&others));
        let mut ends = [run(&crew), other.join().unwrap()];
        ends.sort();
        assert_eq!(ends, [Ok(Some(0)), Err(())]);
    });
}

/// Asserts that a model finds an access that was not told of another.
fn misses_something<O: Orderings + 'static>() {
    let found = catch_unwind(|| check::<O>(2, 2, 2, 3)).expect_err("no order of events shows that this is too weak");
    let what = found.downcast_ref::<String>().map_or("", |text| text);
    assert!(what.contains("Causality violation"), "not what a weak ordering leads to: {what}");
}

#[test]
fn loom_pieces_that_are_done_must_be_handed_on() {
    struct Weak;
    impl Orderings for Weak {
        const PIECES_DONE: Ordering = Ordering::Acquire;
    }
    misses_something::<Weak>();
}

#[test]
fn loom_whoever_is_last_must_take_up_what_others_did() {
    struct Weak;
    impl Orderings for Weak {
        const PIECES_DONE: Ordering = Ordering::Release;
    }
    misses_something::<Weak>();
}

#[test]
fn loom_a_stage_that_begins_must_hand_on_the_one_before() {
    struct Weak;
    impl Orderings for Weak {
        const STAGE_BEGINS: Ordering = Ordering::Relaxed;
    }
    misses_something::<Weak>();
}

#[test]
fn loom_a_stage_that_is_seen_to_begin_must_be_taken_up() {
    struct Weak;
    impl Orderings for Weak {
        const STAGE_SEEN: Ordering = Ordering::Relaxed;
    }
    misses_something::<Weak>();
}
