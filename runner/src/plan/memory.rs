//! How much memory a run takes, and whether this machine has it.

use crate::config::{Config, OutputConfig, TransportKind};
use crate::error::RunError;
use crate::scene::SceneKind;
use atoll_core::{Blueprint, Body};
use std::{fs, thread};

/// A thread's stack.
const STACK: u64 = 2 << 20;

/// Addresses that the allocator of glibc sets aside for each thread, where there are as many, up to [`ARENAS`] for a core.
/// What one thread has set aside another may lack.
const ARENA: u64 = 64 << 20;
const ARENAS: u64 = 8;

/// What a process takes whatever it computes, beside what it has when it asks.
const PROCESS: u64 = 16 << 20;

/// Refuses a world that this machine cannot hold, or a process not within its limits, before it tries to.
pub(super) fn check(
    blueprint: &Blueprint,
    bodies: u64,
    config: &Config,
    threads: usize,
    output: Option<&OutputConfig>,
) -> Result<(), RunError> {
    let (ranks, tiles) = (config.run.ranks as u64, blueprint.partition.tiles() as u64);
    // What is written is copied first: records twice.
    let copies = if output.is_some_and(|output| output.record_every.is_some()) { 100 } else { 0 };
    let saved = if output.is_some() { 200 } else { 0 };
    // What is read from files is sorted first.
    let read = if matches!(config.scene.kind, SceneKind::File(_)) { size_of::<Body>() as u64 } else { 0 };
    let world = blueprint.memory(bodies).saturating_add(bodies.saturating_mul(copies + saved + read));
    // Every rank has its share, four bytes for each tile in a map, and a channel to every other.
    let of = |held: u64| (world / ranks).saturating_mul(held).saturating_add(held * (4 * tiles + 500 * ranks));
    let what = || format!("{bodies} bodies on {tiles} tiles with {ranks} ranks");
    // Of an MPI job the others may be anywhere.
    let here = if config.transport() == TransportKind::Mpi { 1 } else { ranks };
    within_machine(of(here), what)?;
    let in_process = match config.transport() {
        TransportKind::Local | TransportKind::Channel => ranks,
        TransportKind::Iceoryx2 | TransportKind::Mpi => 1,
    };
    // Those of the ranks, and those that hear signals and show progress.
    let threads = in_process * (threads as u64 + u64::from(output.is_some())) + 2;
    let left = left_of_limit();
    let cores = thread::available_parallelism().map_or(1, |cores| cores.get() as u64);
    let arenas = if left.is_some_and(|left| left >= ARENA) { threads.min(ARENAS * cores) * ARENA } else { 0 };
    within_limit(of(in_process) + threads * STACK + arenas + PROCESS, left, what)
}

/// Refuses so many bodies to be listed by this process and sorted, before it tries to.
///
/// # Errors
/// If there is no room for them.
pub(crate) fn check_list(bodies: u64) -> Result<(), RunError> {
    // They are sorted by keys of at most half their size.
    check_held(&format!("{bodies} bodies"), bodies.saturating_mul(size_of::<Body>() as u64 * 3 / 2))
}

/// Refuses so many bytes to be held by this process for something, before it tries to.
///
/// # Errors
/// If there is no room for them.
pub(crate) fn check_held(what: &str, needed: u64) -> Result<(), RunError> {
    let what = || what.to_owned();
    within_machine(needed, what)?;
    within_limit(needed.saturating_add(PROCESS), left_of_limit(), what)
}

fn within_machine(needed: u64, what: impl Fn() -> String) -> Result<(), RunError> {
    within("this machine", needed, free(), what)
}

fn within_limit(needed: u64, left: Option<u64>, what: impl Fn() -> String) -> Result<(), RunError> {
    within("the limit on a process (ulimit -v)", needed, left, what)
}

/// `what` needs so much is said if less is available.
fn within(
    within: &'static str,
    needed: u64,
    available: Option<u64>,
    what: impl Fn() -> String,
) -> Result<(), RunError> {
    match available {
        Some(available) if needed > available => Err(RunError::TooLarge { within, what: what(), needed, available }),
        _ => Ok(()),
    }
}

/// Bytes that the machine has to spare, if it says so.
fn free() -> Option<u64> {
    let facts = fs::read_to_string("/proc/meminfo").ok()?;
    let line = facts.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

/// Bytes that this process may still ask for, if there is a limit.
fn left_of_limit() -> Option<u64> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let soft = limits.lines().find_map(|line| line.strip_prefix("Max address space")?.split_whitespace().next())?;
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let size = status.lines().find_map(|line| line.strip_prefix("VmSize:"))?;
    let taken = size.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024;
    Some(soft.parse::<u64>().ok()?.saturating_sub(taken))
}
