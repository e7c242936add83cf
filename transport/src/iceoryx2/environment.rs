//! How a launcher tells a process which rank of which run it is.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use super::run_folder::RunFolder;
use crate::{Rank, TransportError};

const FOLDER: &str = "ATOLL_RANK_FOLDER";
const RANK: &str = "ATOLL_RANK";
const SIZE: &str = "ATOLL_RANKS";
const PEER_TIMEOUT: &str = "ATOLL_RANK_PEER_TIMEOUT_US";

/// Whether this process was started by [`launch`](super::launch) as a rank, and should [`join`](super::join).
pub fn is_rank_process() -> bool {
    env::var_os(FOLDER).is_some()
}

/// Which rank this process was started as, if as any.
pub fn process_rank() -> Option<Rank> {
    Environment::get().ok().map(|environment| environment.rank)
}

/// What a rank has to know to join.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Environment {
    pub(super) folder: RunFolder,
    pub(super) rank: Rank,
    pub(super) size: usize,
    pub(super) peer_timeout: Duration,
}

impl Environment {
    /// Passes this on to a process about to be started.
    pub(super) fn set(&self, command: &mut Command) {
        command.env(FOLDER, self.folder.path());
        command.env(RANK, self.rank.to_string());
        command.env(SIZE, self.size.to_string());
        command.env(PEER_TIMEOUT, self.peer_timeout.as_micros().to_string());
    }

    /// That of this process.
    pub(super) fn get() -> Result<Environment, TransportError> {
        let text = |name| env::var(name).unwrap_or_default();
        let folder = env::var_os(FOLDER).map(PathBuf::from);
        parse(folder.as_deref(), &text(RANK), &text(SIZE), &text(PEER_TIMEOUT)).ok_or_else(|| {
            TransportError::usage(format!(
                "this process is not a rank of a run ({FOLDER}, {RANK}, {SIZE} or {PEER_TIMEOUT} is missing or wrong); \
                 start it by the launcher"
            ))
        })
    }
}

fn parse(folder: Option<&Path>, rank: &str, size: &str, peer_timeout: &str) -> Option<Environment> {
    let (rank, size): (u32, usize) = (rank.parse().ok()?, size.parse().ok()?);
    let peer_timeout = Duration::from_micros(peer_timeout.parse().ok()?);
    let folder = RunFolder::at(folder?.to_owned());
    ((rank as usize) < size).then_some(Environment { folder, rank: Rank(rank), size, peer_timeout })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rank_knows_its_place_or_is_told_that_it_has_none() {
        let folder = Path::new("/run/user/17-ab");
        let environment = parse(Some(folder), "2", "3", "1500").unwrap();
        assert_eq!((environment.rank, environment.size), (Rank(2), 3));
        assert_eq!(environment.peer_timeout, Duration::from_micros(1500));
        for (rank, size, timeout) in [("3", "3", "1"), ("", "3", "1"), ("0", "0", "1"), ("0", "1", "-1")] {
            assert_eq!(parse(Some(folder), rank, size, timeout), None, "{rank} {size} {timeout}");
        }
        assert_eq!(parse(None, "0", "1", "1"), None);
        assert!(!is_rank_process());
        assert!(Environment::get().unwrap_err().to_string().contains("start it by the launcher"));
    }
}
