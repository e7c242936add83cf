//! One rank of a test of the shared-memory transport, or the launcher of some.
//!
//! - `ipc_rank cases FOLDER NAME...` runs conformance cases and leaves how they ended in FOLDER.
//! - `ipc_rank rounds FOLDER COUNT` exchanges so many rounds, with messages that grow now and then, or until it is told
//!   to stop; leaves its run folder in FOLDER, writes how many rounds it made, or its error.
//! - `ipc_rank grow FROM TO` has rank 1 send messages twice as long each round, from FROM bytes on and below TO.
//! - `ipc_rank launch RANKS MODE...` launches ranks that run another mode.

use atoll_transport::conformance::{case, process::record};
use atoll_transport::iceoryx2::{self, Control, LaunchOptions, join, launch, stop_requested};
use atoll_transport::{Incoming, Rank, Transport, TransportError};
use std::io::{Write, stdout};
use std::iter::successors;
use std::path::Path;
use std::process::{Command, ExitCode, id};
use std::{env, fs};

/// The exit code of a rank that lost another one.
const LOST: u8 = 3;

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words.as_slice() {
        ["cases", folder, names @ ..] => cases(Path::new(folder), names),
        ["rounds", folder, count] => told(rounds(Path::new(folder), count.parse().expect("a number of rounds"))),
        ["grow", from, to] => told(grow(from.parse().expect("a length"), to.parse().expect("a length"))),
        ["launch", ranks, mode @ ..] => {
            assert!(!iceoryx2::is_rank_process());
            let rank = |_| {
                let mut command = Command::new(env::current_exe().expect("this program has a path"));
                command.args(mode);
                command
            };
            let ranks = ranks.parse().expect("a number of ranks");
            let exits = launch(ranks, LaunchOptions::default(), &|| Control::Run, rank).expect("the run starts");
            for exit in exits {
                print!("rank {}, {}: {}", exit.rank, exit.status, String::from_utf8_lossy(&exit.stdout));
            }
            ExitCode::SUCCESS
        }
        _ => panic!("not understood: {words:?}"),
    }
}

/// Writes what came of it, if anybody is left to read that.
fn told(result: Result<u64, TransportError>) -> ExitCode {
    let _ = match &result {
        Ok(count) => writeln!(stdout(), "{count} rounds"),
        Err(error) => writeln!(stdout(), "{error}"),
    };
    if result.is_ok() { ExitCode::SUCCESS } else { ExitCode::from(LOST) }
}

fn cases(folder: &Path, names: &[&str]) -> ExitCode {
    let cases: Vec<_> = names.iter().map(|name| case(name).expect("a case of that name")).collect();
    let endpoint = join().expect("all ranks join");
    record(endpoint, &cases, folder).expect("outcomes can be written");
    ExitCode::SUCCESS
}

fn rounds(folder: &Path, count: u64) -> Result<u64, TransportError> {
    let mut endpoint = join()?;
    let (own, size) = (endpoint.rank(), endpoint.size());
    let run = env::var("ATOLL_RANK_FOLDER").expect("a rank knows its run folder");
    write_whole(folder, &format!("run.{own}"), &run);
    write_whole(folder, &format!("process.{own}"), &id().to_string());
    let mut incoming = Incoming::default();
    for round in 0..count {
        let length = |from: Rank, to: Rank| (from.index() * 7 + to.index() + (round as usize % 64) * 400) % 30_000;
        let lengths: Vec<usize> = Rank::all(size).map(|to| length(own, to)).collect();
        let outgoing = endpoint.prepare(&lengths)?;
        outgoing.iter_mut().for_each(|(to, bytes)| bytes.fill(round as u8 ^ to.0 as u8));
        if stop_requested() {
            outgoing.set_flag_word(0);
        }
        endpoint.exchange(&mut incoming)?;
        for (from, bytes) in incoming.iter() {
            assert_eq!(bytes.len(), length(from, own), "from rank {from} in round {round}");
            assert!(bytes.iter().all(|&byte| byte == round as u8 ^ own.0 as u8), "from rank {from} in round {round}");
        }
        if incoming.flag_word() == 0 {
            return Ok(round + 1);
        }
    }
    Ok(count)
}

fn grow(from: usize, to: usize) -> Result<u64, TransportError> {
    let mut endpoint = join()?;
    let (own, size) = (endpoint.rank(), endpoint.size());
    let mut incoming = Incoming::default();
    let mut count = 0;
    for length in successors(Some(from), |length| length.checked_mul(2)).take_while(|&length| length < to) {
        count += 1;
        let lengths = vec![if own == Rank(1) { length } else { 0 }; size];
        endpoint.prepare(&lengths)?.iter_mut().for_each(|(_, bytes)| bytes.fill(count as u8));
        endpoint.exchange(&mut incoming)?;
        let bytes = incoming.from(Rank(1));
        assert!(bytes.len() == length && bytes.iter().all(|&byte| byte == count as u8), "{length} bytes");
    }
    Ok(count)
}

/// Writes a file that is seen whole or not at all.
fn write_whole(folder: &Path, name: &str, text: &str) {
    let draft = folder.join(format!("{name}.draft"));
    fs::write(&draft, text).expect("the folder can be written");
    fs::rename(draft, folder.join(name)).expect("a file can be renamed");
}
