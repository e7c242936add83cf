//! The threads that work inside one tile, where others would else have done long before ([`super::schedule`]).
//!
//! How many there are never shows in a result: work is cut into ranges, each range's result is a function of the range,
//! and results are taken in the order of the ranges or are independent of it.

use super::crew::{Crew, Member, Needed};
use rayon::prelude::*;
use std::cell::Cell;
use std::ops::Range;
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

/// What a team works on one thing that is shared.
struct Account {
    clock: Option<Clock>,
    worked: AtomicU64,
}

impl Account {
    /// Lets `share` have work booked here, wherever it is done.
    fn open<R>(clock: Option<Clock>, share: impl FnOnce(&Self) -> R) -> R {
        let account = Self { clock, worked: AtomicU64::new(0) };
        let begun = clock.map(|clock| clock());
        let result = share(&account);
        if let Some((clock, begun)) = clock.zip(begun) {
            let here = clock().saturating_sub(begun).as_nanos() as i64;
            HELP.set(HELP.get() + account.worked.into_inner() as i64 - here);
        }
        result
    }

    fn book<R>(&self, work: impl FnOnce() -> R) -> R {
        let Some(clock) = self.clock else { return work() };
        let begun = clock();
        let result = work();
        self.worked.fetch_add(clock().saturating_sub(begun).as_nanos() as u64, Ordering::Relaxed);
        result
    }
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

    /// Runs `work` on each of some things; the results in order.
    pub(crate) fn for_each<T: Send, R: Send>(self, things: Vec<T>, work: impl Fn(T) -> R + Sync) -> Vec<R> {
        if self.is_alone() || things.len() == 1 {
            things.into_iter().map(work).collect()
        } else {
            Account::open(self.clock, |account| {
                let piece = |thing| {
                    let _span = tracing::trace_span!("piece").entered();
                    account.book(|| work(thing))
                };
                things.into_par_iter().with_max_len(1).map(piece).collect()
            })
        }
    }

    /// Runs `work` once for every thread: on this thread, and on those that come to help. Some may run one after the
    /// other, if nobody comes. Each is a member of one crew.
    pub(crate) fn together(self, work: impl Fn(Member<'_>) + Sync) {
        let crew = Crew::<Needed>::new(self.threads);

        Account::open(self.clock, |account| {
            let work = || {
                let _span = tracing::trace_span!("crew").entered();
                // The same seat for the same thread, in whatever it helps.
                account.book(|| work(crew.member(rayon::current_thread_index().unwrap_or(0))));
            };
            rayon::in_place_scope(|scope| {
                for _ in 1..self.threads {
                    scope.spawn(|_| work());
                }
                work();
            });
        });
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
