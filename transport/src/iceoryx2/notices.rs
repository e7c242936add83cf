//! What the launcher tells a rank: lines on the rank's standard input.

use std::io::{BufRead, Write, stderr};
use std::process;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::SeqCst;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use super::board::Board;
use crate::Rank;

/// How long a rank whose launcher is gone may take to end by itself.
const GRACE: Duration = Duration::from_secs(5);

/// The exit code of a rank that was still there after that, which is that of a lost rank.
const LAUNCHER_GONE: i32 = 3;

/// Whether the launcher asked this process to stop.
static STOP: AtomicBool = AtomicBool::new(false);

/// Whether the launcher of this rank process has asked all ranks to stop; always false in other processes.
///
/// The ranks hear of it one by one, so they have to agree in a round on where they stop.
pub fn stop_requested() -> bool {
    STOP.load(SeqCst)
}

/// One line from the launcher.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Notice {
    /// The process of a rank has ended.
    Ended {
        rank: Rank,
        /// A clause that begins with "it", in one line.
        how: String,
    },
    /// All ranks are to stop.
    Stop,
}

impl Notice {
    pub(super) fn to_line(&self) -> String {
        match self {
            Notice::Ended { rank, how } => format!("ended {rank} {how}\n"),
            Notice::Stop => "stop\n".to_owned(),
        }
    }

    pub(super) fn from_line(line: &str) -> Option<Notice> {
        let line = line.trim_end_matches('\n');
        if line == "stop" {
            return Some(Notice::Stop);
        }
        let (rank, how) = line.strip_prefix("ended ")?.split_once(' ')?;
        Some(Notice::Ended { rank: Rank(rank.parse().ok()?), how: how.to_owned() })
    }
}

/// What a rank has heard so far.
#[derive(Debug, Default)]
pub(super) struct Heard {
    /// Whether there is anything in `ended`; a look at it costs nothing.
    some_ended: AtomicBool,
    ended: Mutex<Vec<(Rank, String)>>,
    launcher_gone: AtomicBool,
}

impl Heard {
    /// How the process of `rank` ended, if it did.
    pub(super) fn how_it_ended(&self, rank: Rank) -> Option<String> {
        if !self.some_ended.load(SeqCst) {
            return None;
        }
        let ended = self.ended.lock().unwrap_or_else(PoisonError::into_inner);
        ended.iter().find(|(other, _)| *other == rank).map(|(_, how)| how.clone())
    }

    /// Whether nobody watches over this run any more.
    pub(super) fn is_launcher_gone(&self) -> bool {
        self.launcher_gone.load(SeqCst)
    }

    /// Takes in one line. Lines that say nothing known are of a later version and left alone.
    fn take(&self, line: &str) {
        match Notice::from_line(line) {
            Some(Notice::Stop) => STOP.store(true, SeqCst),
            Some(Notice::Ended { rank, how }) => {
                self.ended.lock().unwrap_or_else(PoisonError::into_inner).push((rank, how));
                self.some_ended.store(true, SeqCst);
            }
            None => {}
        }
    }
}

/// Reads notices for rank `own` from `input` on a thread of its own until the launcher closes it, which it never does
/// while this process lives: then the launcher is gone, and after a grace this process ends, whatever it does.
pub(super) fn listen(
    mut input: impl BufRead + Send + 'static,
    own: Rank,
    board: Arc<Board>,
) -> std::io::Result<Arc<Heard>> {
    let heard = Arc::new(Heard::default());
    let told = Arc::clone(&heard);
    thread::Builder::new().name("notices".to_owned()).spawn(move || {
        let mut line = String::new();
        while matches!(input.read_line(&mut line), Ok(1..)) {
            told.take(&line);
            line.clear();
            board.alarm(own);
        }
        told.launcher_gone.store(true, SeqCst);
        board.alarm(own);
        thread::sleep(GRACE);
        // Whether or not anybody can hear it.
        let _ =
            writeln!(stderr(), "rank {own}: the launcher of this run is gone, so this rank ends; start the run again");
        process::exit(LAUNCHER_GONE);
    })?;
    Ok(heard)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notices_survive_as_lines() {
        let notices = [Notice::Stop, Notice::Ended { rank: Rank(12), how: "it was killed by signal 9".to_owned() }];
        for notice in notices {
            let line = notice.to_line();
            assert!(line.ends_with('\n') && line.matches('\n').count() == 1, "{line:?}");
            assert_eq!(Notice::from_line(&line), Some(notice));
        }
        for line in ["", "stopped", "ended", "ended x it left", "ended 4"] {
            assert_eq!(Notice::from_line(line), None, "{line:?}");
        }
    }

    #[test]
    fn a_rank_knows_who_ended_and_how() {
        let heard = Heard::default();
        assert_eq!(heard.how_it_ended(Rank(2)), None);
        heard.take("ended 2 it ended with exit code 4\n");
        heard.take("a later version says more\n");
        assert_eq!(heard.how_it_ended(Rank(2)).as_deref(), Some("it ended with exit code 4"));
        assert_eq!(heard.how_it_ended(Rank(1)), None);
        assert!(!heard.is_launcher_gone());
    }
}
