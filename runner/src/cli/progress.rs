//! How far a run has come: a bar on a terminal, a line every two seconds elsewhere.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, IsTerminal, Write};
use std::time::{Duration, Instant};

/// Between two lines.
const INTERVAL: Duration = Duration::from_secs(2);

/// Whether to show progress.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(super) enum Show {
    /// Nothing at all.
    #[default]
    Nothing,
    /// On stderr, as suits it.
    OnStderr,
}

/// The progress of one run.
#[derive(Debug)]
pub(super) enum Progress {
    /// Shows nothing.
    Hidden,
    /// Draws a bar on a terminal.
    Bar(ProgressBar),
    /// Writes lines.
    Lines(Lines),
}

impl Progress {
    /// Progress from a step towards so many.
    pub(super) fn new(show: Show, from: u64, steps: u64) -> Self {
        match show {
            Show::Nothing => Self::Hidden,
            Show::OnStderr if io::stderr().is_terminal() => {
                let style = ProgressStyle::with_template("{bar:40} {pos} of {len} steps, {per_sec}, {eta} left")
                    .expect("the template is well formed");
                let bar = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::stderr()).with_position(from);
                // So that what was made before does not count for the speed.
                bar.reset_eta();
                Self::Bar(bar.with_style(style))
            }
            Show::OnStderr => Self::Lines(Lines::new(from, steps, Instant::now())),
        }
    }

    /// So many steps are made.
    pub(super) fn made(&mut self, steps: u64) {
        match self {
            Self::Hidden => {}
            Self::Bar(bar) => bar.set_position(steps),
            Self::Lines(lines) => {
                if let Some(line) = lines.made(steps, Instant::now()) {
                    // Nobody may be listening any more, which is no reason to end the run.
                    let _ = writeln!(io::stderr(), "{line}");
                }
            }
        }
    }

    /// The run is over, early or not.
    pub(super) fn finish(self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

/// What a line needs to know.
#[derive(Debug)]
pub(super) struct Lines {
    steps: u64,
    /// When the last line was written, and how many steps were made then.
    last: (Instant, u64),
}

impl Lines {
    fn new(from: u64, steps: u64, now: Instant) -> Self {
        Self { steps, last: (now, from) }
    }

    /// A line, if it is time for one.
    fn made(&mut self, made: u64, now: Instant) -> Option<String> {
        let (then, before) = self.last;
        let passed = now.duration_since(then);
        if passed < INTERVAL || made == self.steps {
            return None;
        }
        let rate = (made - before) as f64 / passed.as_secs_f64();
        let left = (self.steps - made) as f64 / rate;
        self.last = (now, made);
        Some(format!("step {made} of {}, {rate:.1} steps/s, {left:.0} s left", self.steps))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_every_two_seconds_with_rate_and_time_left() {
        let start = Instant::now();
        let mut lines = Lines::new(0, 100, start);
        assert_eq!(lines.made(10, start + Duration::from_secs(1)), None);
        let line = lines.made(20, start + Duration::from_secs(2));
        assert_eq!(line.as_deref(), Some("step 20 of 100, 10.0 steps/s, 8 s left"));
        assert_eq!(lines.made(30, start + Duration::from_secs(3)), None);
        let line = lines.made(40, start + Duration::from_secs(6));
        assert_eq!(line.as_deref(), Some("step 40 of 100, 5.0 steps/s, 12 s left"));
        assert_eq!(lines.made(100, start + Duration::from_secs(60)), None);
    }
}
