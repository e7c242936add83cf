//! A rank that dies in the middle of a run: all others end soon, the exit code says so, a line names the dead one, and
//! nothing is left behind.

use atoll_tests::processes::{self, RankProcess, left_in_shared_memory};
use atoll_tests::program::{Ended, LIMIT, Running};
use atoll_tests::ways::Way;
use atoll_tests::world::noise;
use std::collections::BTreeSet;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

const RANKS: usize = 4;
/// So many that no run comes to its end by itself.
const STEPS: u64 = 4_000_000_000;

/// One test at a time: each looks at what is left in shared memory, which all runs use.
fn alone() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// How often each kind of death is tried; `ATOLL_LOSSES` sets another number.
fn times() -> u64 {
    std::env::var("ATOLL_LOSSES").map_or(1, |text| text.parse().expect("ATOLL_LOSSES is a number"))
}

fn command(way: Way) -> std::process::Command {
    let mut command = way.command(RANKS, "configs/quickstart.toml");
    command.args(["--steps", &STEPS.to_string(), "--tiles", "5x5"]);
    command
}

/// The line that names the lost rank and the last complete step.
fn named(ended: &Ended, rank: usize) -> Option<u64> {
    let start = format!("atoll: rank {rank} was lost after ");
    let steps =
        ended.complaints().into_iter().find_map(|line| line.strip_prefix(&start)?.split_once(" of 4000000000 steps: "));
    steps.map(|(complete, _)| complete.parse().expect("a number of steps"))
}

#[test]
fn a_rank_that_panics_ends_all_others() {
    let (_alone, before) = (alone(), processes::shared_memory());
    for way in Way::all().into_iter().filter(|way| way.supports(RANKS)) {
        for time in 0..times() {
            let rank = (noise(1, time) * RANKS as f64) as usize;
            let step = (noise(2, time) * 600.0) as u64;
            let ended = Running::start(command(way).args(["--quiet", "--panic-at", &format!("{rank}@{step}")])).end();
            assert_eq!(ended.code, Some(3), "{way}, rank {rank} at step {step}: {ended}");
            let complaint = format!("rank {rank} panicked: as --panic-at asks");
            assert!(ended.stderr.contains(&complaint), "{way}, rank {rank} at step {step}: {ended}");
            assert_eq!(named(&ended, rank), Some(step), "{way}: {ended}");
            assert_nothing_left(way, &before);
        }
    }
}

#[test]
fn a_rank_that_is_killed_ends_all_others() {
    let (_alone, before) = (alone(), processes::shared_memory());
    for way in Way::all().into_iter().filter(|way| way.has_processes()) {
        for time in 0..times() {
            let mut running = Running::start(&mut command(way));
            let ranks = processes::ranks_of(&running, RANKS);
            if let Way::Mpi(_) = way {
                // What is left of ranks that are killed while MPI starts is that library's business.
                running.wait_for_line("step ");
            }
            sleep(Duration::from_secs_f64(2.0 * noise(3, time)));
            let victim = &ranks[(noise(4, time) * RANKS as f64) as usize];
            victim.signal("KILL");
            wait_for_end(&ranks);
            let ended = running.end();
            let rank = victim.rank;
            if way == Way::Iceoryx2 {
                assert_eq!(ended.code, Some(3), "{way}: {ended}");
                assert!(named(&ended, rank).is_some(), "{way}: rank {rank} is not named: {ended}");
                assert!(ended.stderr.contains("killed by signal 9"), "{way}: {ended}");
            } else {
                // The launcher ends the job, and says whom it missed.
                assert!(ended.code != Some(0), "{way}: {ended}");
                assert!(processes::job_names(&ended, victim), "{way}: rank {rank} is not named: {ended}");
            }
            assert_nothing_left(way, &before);
        }
    }
}

/// A rank that hangs is found out by the peer timeout alone.
#[test]
fn a_rank_that_hangs_is_given_up() {
    let (_alone, before) = (alone(), processes::shared_memory());
    for way in Way::all().into_iter().filter(|way| way.has_processes()) {
        let mut running = Running::start(command(way).args(["--peer-timeout", "4"]));
        let ranks = processes::ranks_of(&running, RANKS);
        running.wait_for_line("step ");
        ranks[2].signal("STOP");
        let ended = running.end();
        assert_eq!(ended.code, Some(3), "{way}: {ended}");
        assert!(named(&ended, 2).is_some(), "{way}: rank 2 is not named: {ended}");
        let lines = ended.complaints().into_iter().filter(|line| line.contains(" was lost after ")).count();
        assert_eq!(lines, 1, "{way}: one for all, of whoever found it out: {ended}");
        wait_for_end(&ranks);
        assert_nothing_left(way, &before);
    }
}

fn assert_nothing_left(way: Way, before: &BTreeSet<String>) {
    let left = left_in_shared_memory(before);
    assert!(left.is_empty(), "{way}: left behind {left:?}");
}

fn wait_for_end(ranks: &[RankProcess]) {
    let deadline = Instant::now() + LIMIT;
    while ranks.iter().any(RankProcess::lives) {
        assert!(Instant::now() < deadline, "ranks live on");
        sleep(Duration::from_millis(10));
    }
}
