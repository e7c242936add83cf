//! Frames of a recording: while one is shown, the next is read.

use super::{End, Show, Shown};
use crate::error::RunError;
use crate::look::frame::Frame;
use crate::look::recorded::Recorded;
use crate::rank::StopFlag;
use atoll_transport::Rank;
use std::sync::mpsc;
use std::thread;

/// Records that are so many steps apart from the first to the last that is complete; by default all of them.
///
/// # Errors
/// If not all of them were recorded.
pub(crate) fn records(recorded: &Recorded, every: Option<u64>) -> Result<Shown, RunError> {
    let (recording, between) = (recorded.recording(), recorded.recording().facts().record_every);
    let last = recording.steps().last().copied().unwrap_or_default();
    let every = every.unwrap_or(between);
    if every == 0 || !every.is_multiple_of(between) {
        let reason = format!("{}; give a multiple of {between}", what_is_recorded(recorded));
        return Err(RunError::Unsuitable { option: format!("--every {every}"), reason });
    }
    Ok(Shown { first: 0, every, last: last - last % every })
}

/// The steps that can be shown, as a reason why others cannot.
pub(crate) fn what_is_recorded(recorded: &Recorded) -> String {
    let (recording, between) = (recorded.recording(), recorded.recording().facts().record_every);
    format!(
        "what is recorded is every {between} steps, up to {}",
        recording.steps().last().copied().unwrap_or_default()
    )
}

/// Lets `show` see these records, all of which must be there, until somebody asks to `stop`.
///
/// # Errors
/// What `show` returns, or if a record cannot be read.
pub(crate) fn show_recorded(
    recorded: &Recorded,
    shown: Shown,
    stop: &StopFlag,
    show: &mut Show<'_>,
) -> Result<End, RunError> {
    // Two frames go round: memory for no more.
    let (fill, empty) = mpsc::channel();
    let (take, full) = mpsc::channel();
    for _ in 0..2 {
        fill.send(Frame::default()).expect("its receiver is here");
    }
    // Whatever ends it, both channels close then, and so the reader ends.
    thread::scope(move |scope| {
        let read = move || {
            for step in shown.steps() {
                let Ok(mut frame) = empty.recv() else { return };
                let read = recorded.read(step, &mut frame).map(|()| frame);
                let failed = read.is_err();
                if take.send(read).is_err() || failed {
                    return;
                }
            }
        };
        let reader = thread::Builder::new().name("reader".to_owned()).spawn_scoped(scope, read);
        reader.map_err(|error| RunError::Threads { rank: Rank(0), threads: 1, reason: error.to_string() })?;
        for frame in full {
            if stop.is_requested() {
                return Ok(End::Interrupted);
            }
            let frame = frame?;
            show(&frame)?;
            // The last ones need not come back.
            let _ = fill.send(frame);
        }
        Ok(End::Complete)
    })
}
