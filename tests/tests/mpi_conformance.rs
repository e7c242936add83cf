//! The conformance suite on ranks that are processes of an MPI job, with the launcher of the MPI that this test is
//! linked with.

use atoll_tests::mpi::mpirun;
use atoll_tests::program::{Ended, run};
use atoll_transport::Rank;
use atoll_transport::conformance::process::recorded;
use atoll_transport::conformance::{CASES, Case, Ending, Harness, Outcome, check_all, victim};
use atoll_transport::mpi::{ABORTED, Mpi};
use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};
use tempfile::TempDir;

/// A job has more ranks than this machine may have cores, so jobs run one after another.
static ONE_JOB: Mutex<()> = Mutex::new(());

struct MpiHarness {
    method: &'static str,
    sizes: &'static [usize],
    /// By number of ranks, how the cases ended in which no rank is lost. They share a job.
    healthy: RefCell<HashMap<usize, TempDir>>,
}

impl MpiHarness {
    fn new(method: &'static str, sizes: &'static [usize]) -> Self {
        Self { method, sizes, healthy: RefCell::default() }
    }

    /// Runs a job to its end, whatever that is.
    fn job(&self, size: usize, cases: &[&Case]) -> (TempDir, Ended) {
        let folder = TempDir::new().expect("a folder for outcomes");
        let mut command = mpirun(size);
        command.arg(env!("CARGO_BIN_EXE_mpi_rank")).arg(self.method).arg(folder.path());
        command.args(cases.iter().map(|case| case.name));
        let _alone = ONE_JOB.lock().unwrap_or_else(PoisonError::into_inner);
        let ended = run(&mut command);
        (folder, ended)
    }

    fn healthy(&self, size: usize, case: &Case) -> Vec<Outcome> {
        let mut healthy = self.healthy.borrow_mut();
        let folder = healthy.entry(size).or_insert_with(|| {
            let wanted = |case: &&Case| !case.loses_victim && case.sizes.contains(&size);
            let (folder, ended) = self.job(size, &CASES.iter().filter(wanted).collect::<Vec<_>>());
            assert_eq!(ended.code, Some(0), "{} on {size} ranks: {ended}", self.method);
            folder
        });
        outcomes(folder, size, case).collect::<Option<_>>().expect("a job that ends well leaves every outcome")
    }

    /// A loss always ends the job, soon, with an exit code that says so. Where a rank ends the job itself, it says why;
    /// where one is missed, every rank lives to tell.
    fn lossy(&self, size: usize, case: &Case) -> Vec<Outcome> {
        let (folder, ended) = self.job(size, &[case]);
        let about = format!("{} by {} on {size} ranks: {ended}", case.name, self.method);
        assert_eq!(ended.code, Some(ABORTED), "{about}");
        let victim = victim(size);
        let (said, all_tell) = match case.victim_ends {
            Ending::Panics => ("lost on purpose".to_owned(), false),
            Ending::Aborts => (format!("rank {victim}: lost on purpose"), false),
            Ending::Finishes => (format!("rank {victim}"), true),
        };
        assert!(ended.stderr.contains(&said), "{about}");
        let silent = || Outcome::Panicked("it ended with the job".to_owned());
        let outcomes: Vec<_> = outcomes(&folder, size, case).map(|outcome| outcome.unwrap_or_else(silent)).collect();
        if all_tell {
            assert_eq!(outcomes, vec![Outcome::Finished; size], "{about}");
        }
        outcomes
    }
}

fn outcomes(folder: &TempDir, size: usize, case: &Case) -> impl Iterator<Item = Option<Outcome>> {
    Rank::all(size).map(|rank| recorded(folder.path(), case, rank))
}

impl Harness for MpiHarness {
    fn supports(&self, size: usize) -> bool {
        self.sizes.contains(&size)
    }

    fn loss_ends_every_rank(&self) -> bool {
        true
    }

    fn run(&self, size: usize, case: &'static Case) -> Vec<Outcome> {
        if case.loses_victim { self.lossy(size, case) } else { self.healthy(size, case) }
    }
}

#[track_caller]
fn assert_conforms(method: &'static str, sizes: &'static [usize]) {
    println!("{}", Mpi::library());
    let harness = MpiHarness::new(method, sizes);
    let expected: usize = CASES.iter().map(|case| case.sizes.iter().filter(|size| sizes.contains(size)).count()).sum();
    match check_all(&harness) {
        Ok(runs) => assert_eq!(runs, expected),
        Err(failures) => panic!("{}", failures.join("\n")),
    }
}

#[test]
fn alltoallv_conforms() {
    assert_conforms("alltoallv", &[1, 2, 4, 8]);
}

#[test]
fn sparse_conforms() {
    assert_conforms("sparse", &[1, 2, 4, 8]);
}

#[test]
fn methods_can_be_mixed() {
    assert_conforms("mixed", &[3]);
}
