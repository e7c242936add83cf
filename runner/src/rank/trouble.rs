//! Trouble of one rank, of which all hear together.

use crate::error::{Exit, RunError};
use crate::wording::OneLine;
use atoll_transport::{Collective, Transport, TransportError};

/// Why ranks do not run together.
#[derive(Debug)]
pub(crate) enum Refusal {
    /// Some rank is not ready, or not like the others. Every rank has the same.
    Known(RunError),
    /// They could not even talk.
    Transport(TransportError),
}

/// Lets all ranks hear whether any of them is in trouble, and which: that of the lowest. Every rank gets the same, and none
/// before all were asked.
///
/// # Errors
/// The trouble, or that they cannot talk.
pub(crate) fn all_well(transport: &mut impl Transport, trouble: Option<&RunError>) -> Result<(), Refusal> {
    let own = trouble.map(in_words).unwrap_or_default();
    let words = transport.all_gather(own.as_bytes()).map_err(Refusal::Transport)?;
    match words.into_iter().find(|words| !words.is_empty()) {
        Some(words) => Err(Refusal::Known(relayed(&String::from_utf8_lossy(&words), None))),
        None => Ok(()),
    }
}

/// Exit code and words of an error, on one line.
pub(super) fn in_words(error: &RunError) -> String {
    format!("{} {}", error.exit() as u8, OneLine(&error.to_string()))
}

/// The error that was put in words, which is that of one rank or of all.
pub(super) fn relayed(error: &str, rank: Option<usize>) -> RunError {
    let (code, text) = error.split_once(' ').unwrap_or(("", error));
    let text = rank.map_or(text.to_owned(), |rank| format!("rank {rank}: {text}"));
    RunError::Relayed { text, exit: code.parse().map_or(Exit::Usage, Exit::from_code) }
}
