//! Signals that ask a run, or whatever else is done, to stop.

use super::console::complain;
use crate::error::Exit;
use crate::folder::durable::give_up_begun;
use crate::rank::StopFlag;
use std::error::Error;
#[cfg(unix)]
use std::sync::{Arc, atomic::AtomicBool};
use std::time::{Duration, Instant};
use tracing::warn;

/// Signals so close to each other are one request: `timeout` and closing terminals signal a process and its group.
const AS_ONE: Duration = Duration::from_millis(500);

/// Who asks.
#[derive(Clone, Copy)]
enum Cause {
    /// Somebody, or a batch system.
    User,
    /// The limit on processor time; there is another behind it at which the system kills.
    #[cfg_attr(not(unix), expect(dead_code))]
    Limit,
}

/// A flag that Ctrl-C, SIGTERM, SIGHUP and SIGXCPU raise. The second time, `quit` is called. Where these signals cannot be
/// handled, the flag is one that nobody raises, and a warning says so. `announce` tells whether to say what happens.
pub(super) fn stop_on_signals(announce: bool, quit: impl Fn() + Send + 'static) -> StopFlag {
    let flag = StopFlag::default();
    let raised = flag.clone();
    let mut first = None;
    let heard = move |cause| {
        let first = *first.get_or_insert_with(Instant::now);
        match (raised.request(), cause) {
            (true, _) if !announce => {}
            (true, Cause::User) => complain(&"stopping after this step; interrupt again to quit at once"),
            (true, Cause::Limit) => complain(&"the limit on processor time is reached: stopping after this step"),
            (false, Cause::User) if first.elapsed() > AS_ONE => quit(),
            // The system says so every second.
            (false, _) => {}
        }
    };
    if let Err(error) = listen(heard) {
        warn!("interrupts will end the run without a summary: {error}");
    }
    flag
}

/// Has the same signals end the program with a word, and no file half written behind: for what is no run.
pub(super) fn quit_on_signals() {
    let quit = |_| {
        give_up_begun();
        complain(&"interrupted before it was done");
        std::process::exit(Exit::Interrupted as i32)
    };
    if let Err(error) = listen(quit) {
        warn!("interrupts may leave files behind: {error}");
    }
}

/// Calls `heard` at every signal, on a thread of its own.
#[cfg(unix)]
fn listen(mut heard: impl FnMut(Cause) + Send + 'static) -> Result<(), Box<dyn Error>> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXCPU};
    let all = [SIGINT, SIGTERM, SIGXCPU, SIGHUP];
    let all = if outlives_its_terminal() { &all[..3] } else { &all };
    let mut signals = signal_hook::iterator::Signals::new(all)?;
    let cause = |signal| if signal == SIGXCPU { Cause::Limit } else { Cause::User };
    let listen = move || signals.forever().for_each(|signal| heard(cause(signal)));
    std::thread::Builder::new().name("signals".to_owned()).spawn(listen)?;
    Ok(())
}

#[cfg(not(unix))]
fn listen(mut heard: impl FnMut(Cause) + Send + 'static) -> Result<(), Box<dyn Error>> {
    Ok(ctrlc::set_handler(move || heard(Cause::User))?)
}

/// Lets a write beyond the limit on the size of files fail, which can be told, instead of ending the program.
pub(super) fn outlive_file_limits() {
    // Whatever hears the signal keeps it from doing so.
    #[cfg(unix)]
    if let Err(error) = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::<AtomicBool>::default()) {
        warn!("a file that grows beyond its limit will end the program: {error}");
    }
}

/// Whether it was started by `nohup` or the like, which lets it ignore SIGHUP.
#[cfg(unix)]
fn outlives_its_terminal() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    ignored.is_some_and(|ignored| ignored & 1 << (signal_hook::consts::SIGHUP - 1) != 0)
}
