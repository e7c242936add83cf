//! How many threads each rank of this process gets.

use crate::config::{Config, MOST_THREADS, TransportKind};
use atoll_transport::ranks_here;
use std::thread;

/// Those that were asked for; else the cores that this process may use (its affinity and the quota of its group are heeded), shared
/// by the ranks of this machine. Results do not depend on it.
pub(super) fn of_each_rank(config: &Config) -> usize {
    let cores = || thread::available_parallelism().map_or(1, usize::from);
    config.run.threads.unwrap_or_else(|| match config.transport() {
        TransportKind::Local => share(cores(), cores(), 1),
        TransportKind::Channel | TransportKind::Iceoryx2 => share(cores(), cores(), config.run.ranks),
        TransportKind::Mpi => share(cores(), online().unwrap_or_else(cores), ranks_here().unwrap_or(config.run.ranks)),
    })
}

/// What falls to one of so many ranks of a machine with so many cores, if it may use some of them: a launcher may have bound it to
/// cores of its own, or to some that it has in common with others.
fn share(usable: usize, cores: usize, ranks: usize) -> usize {
    usable.min(cores / ranks.max(1)).clamp(1, MOST_THREADS as usize)
}

/// The cores of this machine, whoever may use them.
fn online() -> Option<usize> {
    let list = std::fs::read_to_string("/sys/devices/system/cpu/online").ok()?;
    count(list.trim())
}

/// Numbers in a list such as `0-3,8`.
fn count(list: &str) -> Option<usize> {
    let range = |part: &str| {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        Some(last.parse::<usize>().ok()?.checked_sub(first.parse().ok()?)? + 1)
    };
    list.split(',').map(range).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_share_the_machine() {
        // Bound to nothing; to a core each; to eight cores that four have in common.
        assert_eq!([share(16, 16, 1), share(16, 16, 3), share(16, 16, 40)], [16, 5, 1]);
        assert_eq!([share(1, 16, 16), share(1, 16, 2), share(8, 16, 2), share(8, 16, 8)], [1, 1, 8, 2]);
        assert_eq!([count("0-3,8"), count("0"), count("3-1"), count("all")], [Some(5), Some(1), None, None]);
    }

    #[test]
    fn who_asks_is_given_as_many() {
        let threads = |overrides: &[(&str, &str)]| {
            of_each_rank(&Config::from_toml_str("test", "[scene]\nkind = \"stack\"\n", overrides).unwrap())
        };
        assert_eq!([threads(&[("threads", "7")]), threads(&[("threads", "7"), ("ranks", "2")])], [7, 7]);
        assert_eq!(threads(&[("threads", "auto"), ("ranks", "1000")]), 1);
    }
}
