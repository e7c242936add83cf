//! The conformance suite on the backends that need nothing but this process.

use std::sync::mpsc::{RecvTimeoutError, channel as pipe};
use std::thread;
use std::time::Duration;

use atoll_transport::channel::{self, ChannelOptions};
use atoll_transport::conformance::{CASES, Case, Harness, Outcome, case, check_all};
use atoll_transport::local::Local;
use atoll_transport::{Rank, RankFailure};

/// Turns a hang into a failure. No run is expected to take a fraction of it.
const WATCHDOG: Duration = Duration::from_secs(240);

struct LocalHarness;

impl Harness for LocalHarness {
    fn supports(&self, size: usize) -> bool {
        size == 1
    }

    fn run(&self, _size: usize, case: &'static Case) -> Vec<Outcome> {
        let result = thread::spawn(|| (case.body)(&mut Local::new())).join();
        vec![result.map_err(|payload| RankFailure::from_panic(Rank(0), payload)).into()]
    }
}

struct ChannelHarness;

impl Harness for ChannelHarness {
    fn run(&self, size: usize, case: &'static Case) -> Vec<Outcome> {
        let options = ChannelOptions { peer_timeout: case.peer_timeout };
        channel::run(size, options, |mut endpoint| (case.body)(&mut endpoint)).into_iter().map(Outcome::from).collect()
    }
}

fn check_under_watchdog(harness: impl Harness + Send + 'static) -> usize {
    let (sender, receiver) = pipe();
    thread::spawn(move || sender.send(check_all(&harness)));
    match receiver.recv_timeout(WATCHDOG) {
        Ok(Ok(runs)) => runs,
        Ok(Err(failures)) => panic!("{}", failures.join("\n")),
        Err(RecvTimeoutError::Timeout) => panic!("a case hangs"),
        Err(RecvTimeoutError::Disconnected) => panic!("the suite itself panicked"),
    }
}

#[test]
fn local_conforms() {
    let runs = CASES.iter().filter(|case| case.sizes.contains(&1)).count();
    assert_eq!(check_under_watchdog(LocalHarness), runs);
}

#[test]
fn channel_conforms() {
    let runs: usize = CASES.iter().map(|case| case.sizes.len()).sum();
    assert_eq!(check_under_watchdog(ChannelHarness), runs);
}

#[test]
fn names_are_unique() {
    for wanted in CASES {
        assert!(std::ptr::eq(case(wanted.name).unwrap(), wanted), "two cases are called {}", wanted.name);
    }
    assert!(case("no such case").is_none());
}

/// A suite that cannot fail proves nothing: a harness whose ranks do not end as the cases say is found out.
#[test]
fn wrong_endings_are_reported() {
    struct Careless;
    impl Harness for Careless {
        fn supports(&self, size: usize) -> bool {
            size == 2
        }
        fn run(&self, size: usize, _case: &'static Case) -> Vec<Outcome> {
            vec![Outcome::Finished; size]
        }
    }
    let failures = check_all(&Careless).unwrap_err();
    assert_eq!(failures.len(), 2, "the panic and the abort are missed: {failures:?}");
    assert!(failures[0].starts_with("peer_panics on 2 ranks: rank 1: Finished"), "{failures:?}");
}
