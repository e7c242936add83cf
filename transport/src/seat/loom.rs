//! The seats under the model checker [loom], which runs each of these tests in every order in which its threads can come
//! to the words that they share, and lets each look see every value that the memory model allows:
//!
//! ```sh
//! RUSTFLAGS="--cfg loom" CARGO_TARGET_DIR=target/loom cargo test --release -p atoll-loom seat
//! ```
//!
//! Here nobody wakes after a while, so a thread that sleeps through what it waits for is a deadlock, which loom reports.
//! Bytes that are used before they may be are a race, which it reports as well. Each claim is also tried where one
//! ordering is too weak for it, and has to be found wrong there: that the check notices is part of the check.
//!
//! Loom takes accesses of the ordering SeqCst for weaker ones, but knows fences of it; that is why seats use fences. It does
//! not know that nothing comes between what an exchange finds and what it puts there; that is why a sleeper exchanges its
//! marks as well, and does not merely store them, which costs nothing beside a sleep.
//!
//! [loom]: https://docs.rs/loom

use ::loom::cell::UnsafeCell;
use ::loom::model::Builder;
use ::loom::sync::atomic::{AtomicU32, AtomicU64, fence};
use ::loom::sync::{Condvar, Mutex};
use ::loom::thread;

use std::sync::Arc;

use super::*;

/// A counter on which a thread sleeps as on a futex: the kernel looks at the count and begins the sleep under a lock, which
/// whoever wakes takes as well.
struct Futex {
    count: AtomicU32,
    queue: Mutex<()>,
    woken: Condvar,
}

impl Bell for Futex {
    fn load(&self, order: Ordering) -> u32 {
        self.count.load(order)
    }

    fn fetch_add(&self, count: u32, order: Ordering) -> u32 {
        self.count.fetch_add(count, order)
    }

    fn sleep(&self, at: u32, _: Duration) {
        let queue = self.queue.lock().unwrap();
        if self.count.load(Relaxed) == at {
            drop(self.woken.wait(queue).unwrap());
        }
    }

    fn wake(&self) {
        let _queue = self.queue.lock().unwrap();
        self.woken.notify_one();
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

macro_rules! memory {
    ($(#[$doc:meta])* $name:ident $($different:item)?) => {
        $(#[$doc])*
        struct $name;

        impl Memory for $name {
            type Bell = Futex;
            type Word = AtomicU64;
            $($different)?

            fn fence(order: Ordering) {
                fence(order);
            }
        }
    };
}

memory!(
    /// As production has it.
    True
);
memory!(
    /// What is told may come after the look that follows it.
    HalfFenced const FENCE: Ordering = Ordering::AcqRel;
);
memory!(
    /// What was done before may come after it is told.
    TellsLittle const TELL: Ordering = Relaxed;
);
memory!(
    /// What was done before may not be seen where it is told.
    SeesLittle const SEE: Ordering = Relaxed;
);
memory!(
    /// Whoever comes takes whatever mark there is.
    TakesAny
    fn take(word: &AtomicU64, _: u64) -> bool {
        word.swap(0, SeqCst) != 0
    }
);

/// A seat that nothing has happened to.
fn seat<M: Memory<Bell = Futex, Word = AtomicU64>>() -> Seat<M> {
    let bell = Futex { count: AtomicU32::new(0), queue: Mutex::new(()), woken: Condvar::new() };
    let [mark, completed, gone] = std::array::from_fn(|_| AtomicU64::new(0));
    Seat { bell, mark, completed, gone }
}

/// Threads are taken off the processor at most so often where they could go on, unless LOOM_MAX_PREEMPTIONS says otherwise.
/// Nearly all errors show with two (M. Musuvathi and S. Qadeer, *Iterative context bounding*, PLDI 2007); each more takes
/// five times as long.
const PREEMPTIONS: usize = 4;

fn check(body: impl Fn() + Sync + Send + 'static) {
    let mut model = Builder::new();
    model.preemption_bound.get_or_insert(PREEMPTIONS);
    model.check(body);
}

/// There is always time left.
fn for_ever() -> Option<Duration> {
    Some(Duration::MAX)
}

/// Two ranks send to a third, which sleeps until the last message it misses, as in a round.
fn sleep_until_the_last_message<M: Memory<Bell = Futex, Word = AtomicU64> + 'static>() {
    check(|| {
        let shared = Arc::new((seat::<M>(), [AtomicU32::new(0), AtomicU32::new(0)]));
        for sender in 0..2 {
            let shared = Arc::clone(&shared);
            thread::spawn(move || {
                shared.1[sender].store(1, Relaxed);
                shared.0.ring();
            });
        }
        let (seat, sent) = &*shared;
        loop {
            let rung = seat.rung();
            let missing = sent.iter().filter(|sent| sent.load(Relaxed) == 0).count() as u32;
            if missing == 0 {
                break;
            }
            seat.sleep(rung.wrapping_add(missing), for_ever);
        }
    });
}

#[test]
fn a_sleeper_wakes_at_the_last_message_it_misses() {
    sleep_until_the_last_message::<True>();
}

#[test]
#[should_panic(expected = "deadlock")]
fn without_its_fence_a_sleeper_misses_the_last_message() {
    sleep_until_the_last_message::<HalfFenced>();
}

#[test]
#[should_panic(expected = "deadlock")]
fn a_message_that_is_not_there_when_it_is_rung_for_is_waited_for_in_vain() {
    sleep_until_the_last_message::<TellsLittle>();
}

#[test]
#[should_panic(expected = "deadlock")]
fn a_message_that_is_not_seen_when_it_is_rung_for_is_waited_for_in_vain() {
    sleep_until_the_last_message::<SeesLittle>();
}

/// A rank sleeps twice, for one message each time; who rang first may still be about to wake it when it sleeps anew.
fn sleep_again<M: Memory<Bell = Futex, Word = AtomicU64> + 'static>() {
    check(|| {
        let shared = Arc::new(seat::<M>());
        for _ in 0..2 {
            let shared = Arc::clone(&shared);
            thread::spawn(move || shared.ring());
        }
        for count in 1..=2 {
            while !reached(shared.rung(), count) {
                shared.sleep(count, for_ever);
            }
        }
    });
}

#[test]
fn whoever_comes_late_wakes_nobody_else() {
    sleep_again::<True>();
}

#[test]
#[should_panic(expected = "deadlock")]
fn who_comes_late_and_takes_any_mark_takes_that_of_the_next_wait() {
    sleep_again::<TakesAny>();
}

/// A rank leaves while another one sleeps that waits for many messages, of which one comes.
fn sleep_while_one_leaves<M: Memory<Bell = Futex, Word = AtomicU64> + 'static>() {
    check(|| {
        let shared = Arc::new([seat::<M>(), seat::<M>()]);
        let leaving = Arc::clone(&shared);
        thread::spawn(move || leaving[0].leave([&leaving[1]].into_iter()));
        let sending = Arc::clone(&shared);
        thread::spawn(move || sending[1].ring());
        let [peer, own] = &*shared;
        loop {
            let rung = own.rung();
            if peer.is_gone() {
                break;
            }
            own.sleep(rung.wrapping_add(60), for_ever);
        }
    });
}

#[test]
fn an_alarm_wakes_whatever_is_missing() {
    sleep_while_one_leaves::<True>();
}

#[test]
#[should_panic(expected = "deadlock")]
fn without_its_fence_a_sleeper_misses_an_alarm() {
    sleep_while_one_leaves::<HalfFenced>();
}

#[test]
#[should_panic(expected = "deadlock")]
fn a_rank_that_leaves_after_its_alarm_is_waited_for_in_vain() {
    sleep_while_one_leaves::<TellsLittle>();
}

/// One rank uses some bytes and then tells; another one sees that and uses them.
fn hand_on<M: Memory<Bell = Futex, Word = AtomicU64> + 'static>(tell: fn(&Seat<M>), sees: fn(&Seat<M>) -> bool) {
    check(move || {
        let shared = Arc::new((seat::<M>(), UnsafeCell::new(())));
        let telling = Arc::clone(&shared);
        thread::spawn(move || {
            telling.1.with_mut(|_| ());
            tell(&telling.0);
        });
        while !sees(&shared.0) {
            thread::yield_now();
        }
        shared.1.with_mut(|_| ());
    });
}

/// The three ways to hand something on: what was sent before a ring, what was received before a round is called complete,
/// and what was sent before leaving.
fn hand_on_by<M: Memory<Bell = Futex, Word = AtomicU64> + 'static>(way: usize) {
    match way {
        0 => hand_on::<M>(Seat::ring, |seat| seat.rung() == 1),
        1 => hand_on::<M>(|seat| seat.complete(1), |seat| seat.completed() == 1),
        _ => hand_on::<M>(|seat| seat.leave([].into_iter()), Seat::is_gone),
    }
}

#[test]
fn what_was_done_before_it_was_told_is_seen() {
    (0..3).for_each(hand_on_by::<True>);
}

macro_rules! races {
    ($($name:ident: $memory:ident, $way:literal;)*) => {$(
        #[test]
        #[should_panic(expected = "Causality violation")]
        fn $name() {
            hand_on_by::<$memory>($way);
        }
    )*};
}

races! {
    a_weak_ring_hands_on_no_message: TellsLittle, 0;
    a_weak_look_at_the_bell_finds_no_message: SeesLittle, 0;
    a_round_weakly_complete_gives_no_memory_back: TellsLittle, 1;
    a_weak_look_at_what_is_complete_gets_no_memory_back: SeesLittle, 1;
    leaving_weakly_hands_on_no_message: TellsLittle, 2;
    a_weak_look_at_who_is_gone_finds_no_message: SeesLittle, 2;
}
