//! Signals that ask a run to stop.

use super::console::complain;
use crate::rank::StopFlag;
use std::error::Error;
use std::time::{Duration, Instant};
use tracing::warn;

/// Signals so close to each other are one request: `timeout` and closing terminals signal a process and its group.
const AS_ONE: Duration = Duration::from_millis(500);

/// A flag that Ctrl-C, SIGTERM and SIGHUP raise. The second time, `quit` is called. Where these signals cannot be
/// handled, the flag is one that nobody raises, and a warning says so. `announce` tells whether to say what happens.
pub(super) fn stop_on_signals(announce: bool, quit: impl Fn() + Send + 'static) -> StopFlag {
    let flag = StopFlag::default();
    let raised = flag.clone();
    let mut first = None;
    let heard = move || {
        let first = *first.get_or_insert_with(Instant::now);
        if raised.request() {
            if announce {
                complain(&"stopping after this step; interrupt again to quit at once");
            }
        } else if first.elapsed() > AS_ONE {
            quit();
        }
    };
    if let Err(error) = listen(heard) {
        warn!("interrupts will end the run without a summary: {error}");
    }
    flag
}

/// Calls `heard` at every signal, on a thread of its own.
#[cfg(unix)]
fn listen(mut heard: impl FnMut() + Send + 'static) -> Result<(), Box<dyn Error>> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let all = if outlives_its_terminal() { &[SIGINT, SIGTERM][..] } else { &[SIGINT, SIGTERM, SIGHUP] };
    let mut signals = signal_hook::iterator::Signals::new(all)?;
    let listen = move || signals.forever().for_each(|_| heard());
    std::thread::Builder::new().name("signals".to_owned()).spawn(listen)?;
    Ok(())
}

#[cfg(not(unix))]
fn listen(heard: impl FnMut() + Send + 'static) -> Result<(), Box<dyn Error>> {
    Ok(ctrlc::set_handler(heard)?)
}

/// Whether it was started by `nohup` or the like, which lets it ignore SIGHUP.
#[cfg(unix)]
fn outlives_its_terminal() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    ignored.is_some_and(|ignored| ignored & 1 << (signal_hook::consts::SIGHUP - 1) != 0)
}
