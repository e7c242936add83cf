//! A run that is driven by another program: commands come in on standard input while it runs, a line each, and a line
//! `{"until": STEP}` says that there are none before that step, so that the run goes on until there and waits.

use crate::command::{Word, word};
use crate::error::RunError;
use crate::rank::{Held, Host, Next};
use crate::wording::unmarked;
use std::collections::VecDeque;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, stdin};
use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex};
use std::thread;
use std::time::Duration;

/// Hears what is said, and lets the run meet when it is time for it.
#[derive(Default, Debug)]
pub(super) struct Driver {
    said: Mutex<Said>,
    more: Condvar,
}

/// What was said and not done yet.
#[derive(Default, Debug)]
struct Said {
    /// By step: the number of the line, and its text.
    lines: VecDeque<(u64, u64, String)>,
    /// Nothing will be said for steps before this one.
    until: u64,
    /// Nothing more will be said at all.
    is_over: bool,
    /// After how many steps the others last heard that there is nothing to do yet.
    waited_after: Option<u64>,
}

impl Said {
    fn hear(&mut self, number: u64, text: String) {
        let step = match word(number, &text, self.until) {
            Ok(Word::Until(until)) => {
                // Who goes on to a step that is made is told anew where the run waits.
                if self.waited_after.is_some_and(|made| until <= made) {
                    self.waited_after = None;
                }
                self.until = self.until.max(until);
                return;
            }
            // What does not say when is meant for when the run waits next. What breaks a promise comes too late, however soon it is heard.
            Ok(Word::Line(line, _)) => line.step.max(self.until),
            // All ranks will say what is wrong with it.
            Err(_) => self.until,
        };
        let place = self.lines.partition_point(|&(other, ..)| other <= step);
        self.lines.insert(place, (step, number, text));
    }

    /// Whether there is something to be done after so many steps.
    fn is_due(&self, steps: u64) -> bool {
        self.lines.front().is_some_and(|&(step, ..)| step <= steps)
    }

    fn waits(&self, steps: u64) -> bool {
        self.until <= steps && !self.is_over
    }
}

/// Where a rank finds standard input or output (0 or 1), if it is not this process's own but that of who started it.
pub(super) fn standard(number: u32) -> Option<PathBuf> {
    #[cfg(feature = "iceoryx2")]
    let is_rank_process = atoll_transport::iceoryx2::is_rank_process();
    #[cfg(not(feature = "iceoryx2"))]
    let is_rank_process = false;
    is_rank_process.then(|| PathBuf::from(format!("/proc/{}/fd/{number}", std::os::unix::process::parent_id())))
}

impl Driver {
    /// Listens to standard input, or to what stands for it.
    ///
    /// # Errors
    /// If that cannot be read.
    pub(super) fn listen() -> Result<Arc<Self>, RunError> {
        let from: Box<dyn Read + Send> = match standard(0) {
            None => Box::new(stdin()),
            Some(path) => Box::new(File::open(path).map_err(|error| RunError::Unsuitable {
                option: "--commands -".to_owned(),
                reason: format!("standard input cannot be read: {error}; give a file, or a pipe"),
            })?),
        };
        let driver = Arc::new(Self::default());
        let heard = Arc::clone(&driver);
        // It ends with the process, whoever still speaks.
        thread::spawn(move || heard.hear_all(BufReader::new(from)));
        Ok(driver)
    }

    fn hear_all(&self, from: impl BufRead) {
        for (number, line) in (1..).zip(from.split(b'\n')) {
            let Ok(line) = line else { break };
            let text = unmarked(String::from_utf8_lossy(&line).trim().to_owned());
            if !text.is_empty() {
                self.lock().hear(number, text);
                self.more.notify_all();
            }
        }
        self.lock().is_over = true;
        self.more.notify_all();
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Said> {
        self.said.lock().expect("nobody panics who holds it")
    }
}

impl Host for Driver {
    fn calls(&self, steps: u64) -> bool {
        let said = self.lock();
        said.is_due(steps) || said.waits(steps)
    }

    fn next(&self, steps: u64, patience: Duration) -> Next {
        let mut said = self.lock();
        let waits = |said: &Said| !said.is_due(steps) && said.waits(steps);
        let has_told = |said: &Said| said.waited_after == Some(steps);
        let is_quiet = |said: &mut Said| waits(said) && has_told(said);
        said = self.more.wait_timeout_while(said, patience, is_quiet).expect("nobody panics who holds it").0;
        // At first, and at once, it is said that there is nothing to do: whoever drives may wait for that.
        if waits(&said) && !has_told(&said) {
            said.waited_after = Some(steps);
            return Next::Announce;
        }
        if said.is_due(steps) {
            let mut text = String::new();
            while said.is_due(steps) {
                let (_, number, line) = said.lines.pop_front().expect("one is due");
                let line = if let Ok(Word::Line(_, line)) = word(number, &line, steps) { line } else { line };
                text += &format!("{number}\t{line}\n");
            }
            return Next::Do(text.into_bytes());
        }
        if said.waits(steps) { Next::Wait } else { Next::GoOn }
    }

    fn answer(&self, _question: &[u8], _held: &Held<'_>) -> Vec<u8> {
        Vec::new()
    }

    fn hear(&self, _answers: Vec<Vec<u8>>) {}

    fn undone(&self) -> Option<(usize, u64)> {
        let lines = &self.lock().lines;
        lines.front().map(|(step, ..)| (lines.len(), *step))
    }

    fn lingers(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    fn driver(text: &str) -> Driver {
        let driver = Driver::default();
        driver.hear_all(text.as_bytes());
        driver
    }

    #[test]
    fn lines_are_due_at_their_steps_and_nothing_is_waited_for_once_all_is_said() {
        let all =
            "{\"until\": 3}\n{\"remove\": 1}\n\n{\"step\": 5, \"remove\": 2}\n{\"step\": 4, \"wake\": 1}\nnonsense\n";
        let driver = driver(all);
        assert_eq!([2, 3, 4, 5, 6].map(|steps| driver.calls(steps)), [false, true, true, true, true]);
        assert_eq!(driver.next(2, Duration::ZERO), Next::GoOn);
        let expected = "2\t{\"step\":3,\"remove\":1}\n6\tnonsense\n";
        assert_eq!(driver.next(3, Duration::ZERO), Next::Do(expected.as_bytes().to_vec()));
        assert_eq!(driver.next(3, Duration::ZERO), Next::GoOn);
        let Next::Do(rest) = driver.next(5, Duration::ZERO) else { panic!("two lines are due") };
        assert!(String::from_utf8(rest).unwrap().starts_with("5\t{\"step\":4,"));
        assert!(!driver.calls(100));
        assert_eq!(driver.undone(), None);
        driver.lock().hear(7, "{\"step\": 2, \"remove\": 3}".to_owned());
        assert_eq!([2, 3].map(|steps| driver.calls(steps)), [false, true]);
        driver.lock().lines.clear();
        driver.lock().hear(7, "{\"step\": 50, \"remove\": 3}".to_owned());
        assert_eq!(driver.undone(), Some((1, 50)));
    }

    #[test]
    fn a_run_waits_for_who_has_not_said_how_far_to_go() {
        let driver = Driver::default();
        assert!(driver.calls(0) && driver.lingers());
        // Who drives step by step is kept waiting at none.
        let begun = Instant::now();
        assert_eq!(driver.next(0, Duration::from_secs(60)), Next::Announce);
        assert!(begun.elapsed() < Duration::from_secs(30), "{:?}", begun.elapsed());
        assert_eq!(driver.next(0, Duration::from_millis(1)), Next::Wait);
        driver.lock().hear(1, "{\"until\": 0}".to_owned());
        assert_eq!(driver.next(0, Duration::from_secs(60)), Next::Announce);
        assert_eq!(driver.next(0, Duration::from_millis(1)), Next::Wait);
        // One that goes on with a run begins later.
        let resumed = Driver::default();
        assert_eq!(resumed.next(5, Duration::from_secs(60)), Next::Announce);
        resumed.lock().hear(1, "{\"until\": 5}".to_owned());
        assert_eq!(resumed.next(5, Duration::from_secs(60)), Next::Announce);
        driver.lock().hear(1, "{\"until\": 7}".to_owned());
        assert!(!driver.calls(6) && driver.calls(7));
        assert_eq!(driver.next(0, Duration::ZERO), Next::GoOn);
    }
}
