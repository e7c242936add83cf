//! One rank of an MPI job that runs cases of the conformance suite: `mpirun -n SIZE mpi_rank METHOD FOLDER CASE...`,
//! where METHOD is `alltoallv`, `sparse`, or `mixed` for both by turns. How each case ended is left in FOLDER.

use atoll_transport::conformance::process::{record, recorded};
use atoll_transport::conformance::{Case, Ending, case};
use atoll_transport::launched;
use atoll_transport::mpi::{Method, Mpi, MpiOptions};
use atoll_transport::{Collective, Incoming, Outgoing, Rank, Transport, TransportError};
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// How long a rank that has lost another leaves the others to say how they ended, before it ends the job.
const GRACE: Duration = Duration::from_secs(20);

/// An endpoint that may change its method after every round.
struct Endpoint {
    mpi: Mpi,
    mixed: bool,
}

impl Transport for Endpoint {
    fn rank(&self) -> Rank {
        self.mpi.rank()
    }

    fn size(&self) -> usize {
        self.mpi.size()
    }

    fn prepare(&mut self, lengths: &[usize]) -> Result<&mut Outgoing, TransportError> {
        self.mpi.prepare(lengths)
    }

    fn exchange(&mut self, incoming: &mut Incoming) -> Result<(), TransportError> {
        self.mpi.exchange(incoming)?;
        if self.mixed {
            self.mpi.set_method(match self.mpi.method() {
                Method::Alltoallv => Method::Sparse,
                Method::Sparse => Method::Alltoallv,
            });
        }
        Ok(())
    }

    fn abort(&mut self, reason: &str) -> ! {
        self.mpi.abort(reason)
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [method, folder, names @ ..] = arguments.as_slice() else { panic!("give METHOD FOLDER CASE...") };
    let (method, mixed) = match method.as_str() {
        "alltoallv" => (Method::Alltoallv, false),
        "sparse" => (Method::Sparse, false),
        "mixed" => (Method::Alltoallv, true),
        other => panic!("no method {other}"),
    };
    let folder = Path::new(folder);
    let cases: Vec<&'static Case> = names.iter().map(|name| case(name).expect("a case of that name")).collect();

    // As programs do: they agree over what is given to begin with, and then change it.
    let mut mpi = Mpi::init(MpiOptions::default()).expect("MPI starts");
    assert_eq!(
        launched().map(|launched| launched.size),
        Some(mpi.size()),
        "the launcher is not that of {}",
        Mpi::library()
    );
    mpi.barrier().expect("every rank starts");
    mpi.set_method(method);
    let peer_timeout = cases.iter().map(|case| case.peer_timeout).min().expect("at least one case");
    mpi.set_peer_timeout(peer_timeout).expect("not zero");

    let mut endpoint = Endpoint { mpi, mixed };
    if cases.iter().any(|case| case.victim_ends == Ending::Panics) {
        // The panic takes the endpoint along, which ends the job.
        record(endpoint, &cases, folder).expect("outcomes can be written");
        panic!("the job goes on after a panic");
    }
    if !record(&mut endpoint, &cases, folder).expect("outcomes can be written") {
        endpoint.abort("a check failed");
    }
    // Ranks come to the end one after another.
    sleep(Duration::from_millis(40) * endpoint.rank().0);
    let size = endpoint.size();
    if let Err(error) = endpoint.mpi.close() {
        let started = Instant::now();
        let told = || cases.iter().all(|case| Rank::all(size).all(|rank| recorded(folder, case, rank).is_some()));
        while !told() && started.elapsed() < GRACE {
            sleep(Duration::from_millis(10));
        }
        endpoint.abort(&error.to_string());
    }
}
