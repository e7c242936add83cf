//! Jobs of different lengths, shared out to threads so that all of these end at about the same time.
//!
//! Each thread is given the jobs that it begins with, the longest first; who has done with its own takes over from others. A job
//! that would keep a thread busy when all others have done is one that these help with, as its [`Team`].
//!
//! Source: longest processing time first (R. L. Graham, Bounds on Multiprocessing Timing Anomalies, 1969).

use super::team::Team;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Who takes which of some jobs, which are numbered.
#[derive(Default, Debug)]
pub(crate) struct Schedule {
    /// For each thread its jobs, the longest first.
    shares: Vec<Share>,
    /// For each job how many threads are to work on it.
    teams: Vec<usize>,
}

#[derive(Default, Debug)]
struct Share {
    jobs: Vec<usize>,
    /// How many of them were taken, or more.
    taken: AtomicUsize,
}

impl Share {
    fn take(&self) -> Option<usize> {
        self.jobs.get(self.taken.fetch_add(1, Ordering::Relaxed)).copied()
    }
}

impl Schedule {
    /// Shares out jobs of these lengths to so many threads.
    pub(crate) fn share_out(&mut self, lengths: impl IntoIterator<Item = u64>, threads: usize) {
        let mut jobs: Vec<(u64, usize)> = lengths.into_iter().zip(0..).collect();
        self.teams.clear();
        self.teams.resize(jobs.len(), 1);
        self.shares.truncate(threads);
        self.shares.iter_mut().for_each(|share| share.jobs.clear());
        self.shares.resize_with(threads, Share::default);
        if threads == 1 {
            return self.shares[0].jobs.extend(0..jobs.len());
        }
        jobs.sort_unstable_by_key(|&(length, job)| (Reverse(length), job));
        let total: u64 = jobs.iter().map(|job| job.0).sum();
        let mut ends: BinaryHeap<_> = (0..threads).map(|thread| Reverse((0, thread))).collect();
        let (mut late, mut longest) = (Vec::new(), 0);
        for (length, job) in jobs {
            let mut first = ends.peek_mut().expect("a thread");
            let Reverse((end, thread)) = &mut *first;
            *end += length;
            self.shares[*thread].jobs.push(job);
            // An eighth later than if all ended at once.
            if 8 * threads as u64 * *end > 9 * total {
                late.push((length, job));
                longest += length;
            }
        }
        for (length, job) in late {
            self.teams[job] = (threads as u64 * length).div_ceil(longest).max(2) as usize;
        }
    }

    /// Has a single thread begin with that job, and end with the one before.
    pub(crate) fn begin_with(&mut self, job: usize) {
        if let [Share { jobs, .. }] = &mut self.shares[..] {
            let first = job % jobs.len().max(1);
            jobs.rotate_left(first);
        }
    }

    /// To how many threads jobs were shared out.
    pub(crate) fn threads(&self) -> usize {
        self.shares.len()
    }

    /// Whether there is a job for more threads than one.
    pub(crate) fn helps(&self) -> bool {
        self.teams.iter().any(|&threads| threads > 1)
    }

    /// Runs `work` on each of the jobs that were shared out, with the team that is to do it and with a seat, of which there is one for
    /// each thread of this pool; the results in the order of the jobs.
    ///
    /// Who waits within a job for others to help may help with other jobs, but begins none: he has no second seat.
    pub(crate) fn run<J: Send, S: Send, R: Send>(
        &mut self,
        jobs: impl Iterator<Item = J>,
        seats: &[Mutex<S>],
        work: impl Fn(Team, J, &mut S) -> R + Sync,
    ) -> Vec<R> {
        self.shares.iter_mut().for_each(|share| *share.taken.get_mut() = 0);
        let jobs: Vec<_> = jobs.map(|job| Mutex::new(Some(job))).collect();
        let done = Mutex::new(Vec::with_capacity(jobs.len()));
        let (shares, teams) = (&self.shares, &self.teams);
        let take_part = || {
            let thread = rayon::current_thread_index().unwrap_or(0);
            let Ok(mut seat) = seats[thread].try_lock() else { return };
            let mut results = Vec::new();
            let (others, own) = shares.split_at(thread.min(shares.len()));
            for share in own.iter().chain(others) {
                while let Some(number) = share.take() {
                    let job = jobs[number].lock().expect("nobody panics with it").take().expect("taken once");
                    results.push((number, work(Team::of(teams[number]), job, &mut seat)));
                }
            }
            done.lock().expect("nobody panics with it").append(&mut results);
        };
        match jobs.len().min(shares.len()) {
            0 | 1 => take_part(),
            several => rayon::in_place_scope(|scope| {
                (1..several).for_each(|_| scope.spawn(|_| take_part()));
                take_part();
            }),
        }
        let mut done = done.into_inner().expect("nobody panics with it");
        done.sort_unstable_by_key(|&(number, _)| number);
        done.into_iter().map(|(_, result)| result).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::cases;
    use proptest::prelude::*;
    use rayon::ThreadPoolBuilder;

    fn shared_out(lengths: &[u64], threads: usize) -> Schedule {
        let mut schedule = Schedule::default();
        // What it was used for before does not matter.
        schedule.share_out([5, 3, 1], 3);
        schedule.share_out(lengths.iter().copied(), threads);
        schedule
    }

    proptest! {
        #![proptest_config(cases(256))]

        #[test]
        fn threads_end_together_or_are_helped(lengths in prop::collection::vec(0_u64..1000, 0..60), threads in 1_usize..9) {
            let schedule = shared_out(&lengths, threads);
            let mut all: Vec<usize> = schedule.shares.iter().flat_map(|share| share.jobs.iter().copied()).collect();
            all.sort_unstable();
            prop_assert!(all.into_iter().eq(0..lengths.len()));
            let total: u64 = lengths.iter().sum();
            for Share { jobs, .. } in &schedule.shares {
                prop_assert!(threads == 1 || jobs.is_sorted_by_key(|&job| Reverse(lengths[job])));
                let alone: u64 = jobs.iter().filter(|&&job| schedule.teams[job] == 1).map(|&job| lengths[job]).sum();
                prop_assert!(threads == 1 || 8 * threads as u64 * alone <= 9 * total, "{alone} of {total}");
            }
            prop_assert!(schedule.teams.iter().all(|&team| (1..=threads.max(2)).contains(&team)));
        }
    }

    #[test]
    fn who_is_late_is_helped() {
        assert_eq!(shared_out(&[7], 4).teams, [4]);
        assert_eq!(shared_out(&[7, 7], 6).teams, [3, 3]);
        assert_eq!(shared_out(&[5; 15], 16).teams, [1; 15]);
        assert_eq!(shared_out(&[100, 1, 1], 2).teams, [2, 1, 1]);
        // The last of them would begin when all others end.
        assert_eq!(shared_out(&[1; 17], 4).teams.iter().filter(|&&team| team == 4).count(), 1);
        assert!(!shared_out(&[1; 20], 4).helps() && !shared_out(&[7, 7], 1).helps());
    }

    #[test]
    fn every_job_is_done_once_also_where_threads_help() {
        let pool = ThreadPoolBuilder::new().num_threads(4).build().expect("threads");
        // Also of those that were shared out to one thread, whichever runs them.
        for (count, threads) in [(0, 4), (1, 4), (3, 4), (4, 4), (50, 4), (50, 1)] {
            let seats: Vec<_> = (0..4).map(|_| Mutex::new(0)).collect();
            let mut schedule = shared_out(&vec![1; count], threads);
            for _ in 0..20 {
                let results = pool.install(|| {
                    schedule.run(0..count, &seats, |team, job, seat| {
                        *seat += 1;
                        // All of a pool to help, however few are asked.
                        assert!(team.is_alone() || !team.map(100, 1, |range| range.len()).is_empty());
                        Team::of(4).map(1000, 1, |range| range.len()).into_iter().sum::<usize>() + job
                    })
                });
                assert!(results.into_iter().eq(1000..1000 + count));
            }
            assert_eq!(seats.into_iter().map(|seat| seat.into_inner().expect("no panic")).sum::<usize>(), 20 * count);
        }
    }
}
