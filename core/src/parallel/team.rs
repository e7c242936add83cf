//! The threads that work inside one tile, where others would else have done long before ([`super::schedule`]).
//!
//! How many there are never shows in a result: work is cut into ranges, each range's result is a function of the range,
//! and results are taken in the order of the ranges or are independent of it.

use super::crew::{Crew, Member, Needed};
use std::cell::Cell;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// How many threads may work on a tile at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Team {
    threads: usize,
    /// By which what they work is booked, if it is.
    clock: Option<Clock>,
}

/// How long the thread that asks has worked so far.
type Clock = fn() -> Duration;

thread_local! {
    /// Nanoseconds that others have worked for what this thread works on, less those in which it has worked for others.
    static HELP: Cell<i64> = const { Cell::new(0) };
}

impl Team {
    /// One thread: everything in order.
    pub(crate) const ALONE: Self = Self { threads: 1, clock: None };

    /// So many threads. Only for who holds no lock that another piece of the pool's work may ask for.
    pub(crate) fn of(threads: usize) -> Self {
        Self { threads, clock: None }
    }

    /// All threads of this pool.
    pub(crate) fn of_pool() -> Self {
        Self::of(rayon::current_num_threads())
    }

    /// The same team, whose work is booked by this clock.
    pub(crate) fn booked_by(self, clock: Option<Clock>) -> Self {
        Self { clock, ..self }
    }

    /// What is to be booked for what this thread worked on since it last asked, if its own clock has told so much.
    pub(crate) fn add_help(worked: Duration) -> Duration {
        let worked = worked.as_nanos() as i64 + HELP.take();
        Duration::from_nanos(worked.max(0) as u64)
    }

    pub(crate) fn is_alone(self) -> bool {
        self.threads == 1
    }

    pub(crate) fn size(self) -> usize {
        self.threads
    }

    /// How many ranges to cut `len` things into, none shorter than `grain`: some for each thread, so that none waits
    /// long for another.
    pub(crate) fn pieces(self, len: usize, grain: usize) -> usize {
        if self.is_alone() { 1 } else { (len / grain).clamp(1, 4 * self.threads) }
    }

    /// Ranges that make up `0..len`, as many as [`pieces`](Self::pieces).
    pub(crate) fn ranges(self, len: usize, grain: usize) -> impl Iterator<Item = Range<usize>> {
        let pieces = self.pieces(len, grain);
        (0..pieces).map(move |i| i * len / pieces..(i + 1) * len / pieces)
    }

    /// Runs `work` on ranges that make up `0..len`, none shorter than `grain`; their results in order.
    pub(crate) fn map<R: Send>(self, len: usize, grain: usize, work: impl Fn(Range<usize>) -> R + Sync) -> Vec<R> {
        self.for_each(self.ranges(len, grain).collect(), work)
    }

    /// Runs `work` on ranges that make up `0..len`, none shorter than `grain`. What each appends is appended to `all`, in
    /// the order of the ranges.
    pub(crate) fn append<T: Copy + Send>(
        self,
        all: &mut Vec<T>,
        len: usize,
        grain: usize,
        work: impl Fn(Range<usize>, &mut Vec<T>) + Sync,
    ) {
        if self.pieces(len, grain) == 1 {
            return work(0..len, all);
        }
        let parts = self.map(len, grain, |range| {
            let mut part = Vec::new();
            work(range, &mut part);
            part
        });
        parts.iter().for_each(|part| all.extend_from_slice(part));
    }

    /// Runs `work` on each of some things; the results in order. Which thread begins with which is the same wherever there are as many.
    pub(crate) fn for_each<T: Send, R: Send>(self, things: Vec<T>, work: impl Fn(T) -> R + Sync) -> Vec<R> {
        const TAKEN_ONCE: &str = "each piece is taken once, by one thread";
        let count = things.len();
        if self.is_alone() || count <= 1 {
            return things.into_iter().map(work).collect();
        }
        let slots: Vec<_> = things.into_iter().map(|thing| Mutex::new((Some(thing), None))).collect();
        Self { threads: self.threads.min(count), ..self }.together(|member| {
            for piece in member.pieces(count as u32) {
                let _span = tracing::trace_span!("piece").entered();
                let mut slot = slots[piece as usize].lock().expect(TAKEN_ONCE);
                slot.1 = slot.0.take().map(&work);
            }
        });
        slots.into_iter().filter_map(|slot| slot.into_inner().expect(TAKEN_ONCE).1).collect()
    }

    /// Runs `work` once for every thread: on this thread, and on those that come to help. Some may run one after the
    /// other, if nobody comes. Each is a member of one crew.
    pub(crate) fn together(self, work: impl Fn(Member<'_>) + Sync) {
        let crew = Crew::<Needed>::new(self.threads);
        let begun = self.clock.map(|clock| clock());
        let worked = AtomicU64::new(0);
        let work = || {
            let _span = tracing::trace_span!("crew").entered();
            let begun = self.clock.map(|clock| clock());
            // The same seat for the same thread, in whatever it helps.
            work(crew.member(rayon::current_thread_index().unwrap_or(0)));
            worked.fetch_add(self.nanoseconds_since(begun) as u64, Ordering::Relaxed);
        };
        rayon::in_place_scope(|scope| {
            (1..self.threads).for_each(|_| scope.spawn(|_| work()));
            work();
        });
        HELP.set(HELP.get() + worked.into_inner() as i64 - self.nanoseconds_since(begun));
    }

    /// By the clock, if there is one.
    fn nanoseconds_since(self, begun: Option<Duration>) -> i64 {
        self.clock.zip(begun).map_or(0, |(clock, begun)| clock().saturating_sub(begun).as_nanos() as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_make_up_the_whole() {
        for threads in [1, 2, 7] {
            for len in [0, 1, 9, 1000] {
                let team = Team::of(threads);
                let ranges: Vec<_> = team.ranges(len, 10).collect();
                let mut all = vec![usize::MAX];
                team.append(&mut all, len, 10, |range, part| part.extend(range));
                assert!(all[0] == usize::MAX && all[1..].iter().copied().eq(0..len), "{threads} {len}");
                assert!(ranges.len() <= 4 * threads && (ranges.len() == 1 || ranges.iter().all(|r| r.len() >= 10)));
                assert!(ranges.into_iter().flatten().eq(0..len), "{threads} {len}");
            }
        }
    }
}
