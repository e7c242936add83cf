//! What other ranks see of one rank in shared memory: who rang at its door, whether it sleeps, what it has received,
//! whether it is gone.
//!
//! A sender rings after each message; a rank that has nothing to do sleeps on its bell. It says at which count it wants
//! to be woken, the number of messages that it still misses, so a whole round costs one system call for each side and
//! none where nobody sleeps.
//!
//! The words lie in whatever [`Memory`] there is: the board of `iceoryx2` maps them, and a model checker tries every order
//! in which threads can come to them (`loom.rs`). Both run the same code.

#[cfg(all(loom, test))]
mod loom;

use std::sync::atomic::Ordering::{self, Acquire, Relaxed, Release, SeqCst};
use std::time::Duration;

/// By how much an alarm moves a bell: beyond any number of messages that a sleeper can miss.
pub(crate) const ALARM: u32 = 1 << 16;

/// Set in a mark, so that one whose count is 0 differs from none.
const ASLEEP: u64 = 1 << 32;

/// A counter on which one thread can sleep: a futex.
pub(crate) trait Bell {
    fn load(&self, order: Ordering) -> u32;

    /// Adds and returns the count before.
    fn fetch_add(&self, count: u32, order: Ordering) -> u32;

    /// Sleeps until [`wake`](Bell::wake) or for so long, but not at all if the count is not `at`; nobody can wake between
    /// that look and the sleep. May return early.
    fn sleep(&self, at: u32, limit: Duration);

    /// Wakes the thread that sleeps.
    fn wake(&self);
}

/// A word that threads share.
pub(crate) trait Word {
    fn load(&self, order: Ordering) -> u64;
    fn store(&self, value: u64, order: Ordering);

    /// Puts `value` behind whatever was last there.
    fn swap(&self, value: u64, order: Ordering) -> u64;

    /// Puts `new` where `old` is, and says whether it was.
    fn exchange(&self, old: u64, new: u64, order: Ordering) -> bool;
}

/// Where seats lie. The orderings are right as they are; the model check weakens them to show that it notices.
pub(crate) trait Memory {
    type Bell: Bell;
    type Word: Word;

    /// With which a rank tells what it has done.
    const TELL: Ordering = Release;

    /// With which another one sees that.
    const SEE: Ordering = Acquire;

    /// Between telling one thing and looking at another, where somebody else does it the other way round: one of the two
    /// sees what the other told.
    const FENCE: Ordering = SeqCst;

    fn fence(order: Ordering);

    /// Takes the mark of a sleeper if it is still `mark`, and says whether it was.
    fn take(word: &Self::Word, mark: u64) -> bool {
        word.exchange(mark, 0, Relaxed)
    }
}

/// What the others see of one rank. Alone on its cache lines, two of which processors fetch at once.
///
/// Zeros are the seat of a rank for which nothing has happened.
#[derive(Debug)]
#[repr(C, align(128))]
pub(crate) struct Seat<M: Memory> {
    /// Counts messages that were sent to this rank, and alarms by [`ALARM`].
    bell: M::Bell,
    /// Where this rank sleeps or is about to: [`ASLEEP`] and the count of the bell at which to wake it. Otherwise 0.
    mark: M::Word,
    /// Rounds of which it has received every message.
    completed: M::Word,
    /// Not zero once this rank sends and receives no more.
    gone: M::Word,
}

impl<M: Memory> Seat<M> {
    /// Tells the rank that a message was sent to it.
    pub(crate) fn ring(&self) {
        self.ring_by(1);
    }

    /// Wakes the rank whatever it waits for.
    pub(crate) fn alarm(&self) {
        self.ring_by(ALARM);
    }

    /// Moves the bell by `count`.
    pub(crate) fn ring_by(&self, count: u32) {
        let now = self.bell.fetch_add(count, M::TELL).wrapping_add(count);
        // The sleeper marks that it sleeps before it looks at the bell for the last time, and here it is the other way
        // round, so one of the two sees the other. Whoever takes the mark wakes; the rest save the system call.
        M::fence(M::FENCE);
        let mark = self.mark.load(Relaxed);
        // A mark that is seen here is taken only as it was seen. A ringer that comes late, when the sleeper has gone on and
        // sleeps anew until another count, would otherwise take that mark from those who are to wake it.
        if mark != 0 && reached(now, mark as u32) && M::take(&self.mark, mark) {
            self.bell.wake();
        }
    }

    /// The count of the bell. Messages counted in it are there to be received.
    pub(crate) fn rung(&self) -> u32 {
        self.bell.load(M::SEE)
    }

    /// Sleeps, as the rank itself, until the bell is at `wake_at` or beyond, or until no time is `left`.
    pub(crate) fn sleep(&self, wake_at: u32, mut left: impl FnMut() -> Option<Duration>) {
        loop {
            // Anew before each look: a ringer may have taken the mark.
            self.mark.swap(ASLEEP | u64::from(wake_at), Relaxed);
            M::fence(M::FENCE);
            let now = self.bell.load(Relaxed);
            if reached(now, wake_at) {
                break;
            }
            let Some(left) = left() else { break };
            // However it returns, woken, interrupted, late or because the bell rang just now: look again.
            self.bell.sleep(now, left);
        }
        self.mark.swap(0, Relaxed);
    }

    /// Records that the rank has received everything of that many rounds, and is done with the memory of its senders.
    pub(crate) fn complete(&self, rounds: u64) {
        self.completed.store(rounds, M::TELL);
    }

    /// Of how many rounds the rank has received everything.
    pub(crate) fn completed(&self) -> u64 {
        self.completed.load(M::SEE)
    }

    /// Records that the rank sends and receives no more, and wakes all `others`.
    pub(crate) fn leave<'a>(&self, others: impl Iterator<Item = &'a Seat<M>>)
    where
        M: 'a,
    {
        // First, so that whoever is woken sees it.
        self.gone.store(1, M::TELL);
        others.for_each(Seat::alarm);
    }

    /// Whether the rank sends no more. What it had sent is there to be received.
    pub(crate) fn is_gone(&self) -> bool {
        self.gone.load(M::SEE) != 0
    }
}

/// Whether a bell at `now` is at `target` or past it; both wrap around.
pub(crate) fn reached(now: u32, target: u32) -> bool {
    now.wrapping_sub(target) < u32::MAX / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_wrap_around() {
        let seen = u32::MAX;
        assert!(!reached(seen, seen.wrapping_add(4)) && reached(2, u32::MAX) && reached(7, 7));
    }
}
