//! How much memory a run takes, and whether this machine has it.

use crate::config::OutputConfig;
use crate::error::RunError;

/// Refuses a world that this machine cannot hold, before it tries to. `here` is how many of the ranks it surely holds.
pub(super) fn check(
    bodies: u64,
    tiles: u64,
    ranks: u64,
    here: u64,
    output: Option<&OutputConfig>,
) -> Result<(), RunError> {
    // A body takes 48 bytes and its contacts as much again and more; an empty tile a few buffers, and four bytes in
    // every rank's map of tiles; a pair of ranks a channel. What is written is copied first: records twice.
    let copies = if output.is_some_and(|output| output.record_every.is_some()) { 100 } else { 0 };
    let saved = if output.is_some() { 200 } else { 0 };
    let each = 200 + copies + saved;
    let needed = (bodies.saturating_mul(each) + tiles * 1000) / ranks * here + here * (4 * tiles + 500 * ranks);
    let available = std::fs::read_to_string("/proc/meminfo").ok().and_then(|facts| {
        let line = facts.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
        Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
    });
    match available {
        Some(available) if needed > available => Err(RunError::TooLarge { bodies, tiles, ranks, needed, available }),
        _ => Ok(()),
    }
}
