//! Ranks as processes of one machine that share memory, by way of [iceoryx2]. Linux only.
//!
//! A launcher process starts the others and watches over them: [`launch`]. A process that finds itself started so
//! ([`is_rank_process`]) calls [`join`], once, and has an endpoint like any other. A message is written once, by its
//! sender, into memory that its receiver reads in place: [`Outgoing`](crate::Outgoing) holds loaned slices,
//! [`Incoming`](crate::Incoming) received ones. Messages to others begin at multiples of 8 bytes. At most three values
//! of [`Incoming`](crate::Incoming) hold messages at once; an exchange with a fourth may fail.
//!
//! ```no_run
//! use atoll_transport::Collective;
//! use atoll_transport::iceoryx2::{self, Control, LaunchOptions};
//! use std::process::Command;
//!
//! if iceoryx2::is_rank_process() {
//!     let mut endpoint = iceoryx2::join()?;
//!     println!("{}", endpoint.all_sum_u64(1)?);
//! } else {
//!     let program = std::env::current_exe()?;
//!     let options = LaunchOptions::default();
//!     let exits = iceoryx2::launch(4, options, &|| Control::Run, |_rank| Command::new(&program))?;
//!     assert!(exits.iter().all(|exit| exit.status.success() && exit.stdout == b"4\n"));
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # A rank process
//!
//! Its standard input belongs to this module from [`join`] on: the launcher tells there who has ended, and that it is
//! to stop ([`stop_requested`]). If the launcher is gone, every wait ends with
//! [`PeerLost`](crate::TransportError::PeerLost), which blames the rank itself and says why, and 5 s later the process
//! ends with exit code 3, whatever it is doing. Its standard output then leads nowhere, so that `println!` panics.
//!
//! # How a rank ends
//!
//! As among threads, the first failure is recorded, here in a file of the run, before anybody can notice it, and all
//! ranks report that record. A rank that is killed has no time for that, so the launcher records it. Dropping an
//! endpoint while panicking counts as a panic. After [`abort`](crate::Transport::abort) has unwound, ending the process
//! is up to the program. When a rank was lost, by a signal or with an exit code that is not 0, the launcher gives the
//! others [some time](LaunchOptions::grace) to end by themselves.
//!
//! Dropping an endpoint waits until the others have received what it sent, which they are about to do, at most for the
//! peer timeout.
//!
//! # What is left
//!
//! Nothing. All files of a run are in a folder of its own below `/dev/shm/atoll-<user>` (`ATOLL_RUN_FOLDERS` names another
//! place), all its shared memory bears the run's name, and the launcher removes both when its ranks have ended. If it
//! cannot, because it was killed, the next launch by the same user does.
//!
//! # Memory
//!
//! Each directed pair of ranks has a segment in `/dev/shm` that grows with the longest message and never shrinks; only
//! pages that were written to take memory, those of some messages at a time. A run that needs more than there is, at
//! the start or later, ends with an error that says so.
//!
//! [iceoryx2]: https://iceoryx.io

#[cfg(not(target_os = "linux"))]
compile_error!("the feature `iceoryx2` of atoll-transport needs Linux; leave it out elsewhere");

mod board;
mod endpoint;
mod environment;
mod launch;
mod limits;
mod memory;
mod notices;
mod ports;
mod record;
mod run_folder;

use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::SeqCst;

pub use self::endpoint::Iceoryx2;
pub use self::environment::{is_rank_process, process_rank};
pub use self::launch::{Control, LaunchError, LaunchOptions, RankExit, check, launch};
pub use self::limits::MAX_RANKS;
pub use self::notices::stop_requested;

use self::environment::Environment;
use crate::TransportError;

/// Makes the endpoint of this process, which [`launch`] started as a rank, and returns when all ranks are connected.
///
/// # Errors
/// [`Usage`](TransportError::Usage) if this process is no rank, or has joined before;
/// [`PeerLost`](TransportError::PeerLost) if a rank ends, or cannot join, before all have joined.
pub fn join() -> Result<Iceoryx2, TransportError> {
    static JOINED: AtomicBool = AtomicBool::new(false);
    let environment = Environment::get()?;
    if JOINED.swap(true, SeqCst) {
        return Err(TransportError::usage(format!(
            "rank {}: this process has joined its run before; keep the endpoint",
            environment.rank
        )));
    }
    Iceoryx2::join(environment)
}
