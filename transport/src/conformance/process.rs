//! For backends whose ranks are processes: each leaves its outcomes in files, and the harness reads them.

use std::fs;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use super::{Case, Outcome};
use crate::{Rank, RankFailure, Transport};

/// Runs cases one after another on the endpoint of this process and leaves in `folder` how each of them ended.
///
/// The endpoint is dropped as by a panic where a case panics, and then the remaining cases do not run. Returns whether
/// all of them ran to their end.
///
/// # Errors
/// If an outcome cannot be written.
pub fn record<T: Transport>(transport: T, cases: &[&'static Case], folder: &Path) -> io::Result<bool> {
    let rank = transport.rank();
    let mut transport = Some(transport);
    for case in cases {
        let Some(mut endpoint) = transport.take() else { return Ok(false) };
        let body = AssertUnwindSafe(move || {
            (case.body)(&mut endpoint);
            endpoint
        });
        let result = catch_unwind(body).map_err(|payload| RankFailure::from_panic(rank, payload));
        let outcome = Outcome::from(result.map(|endpoint| transport = Some(endpoint)));
        fs::write(file(folder, case, rank), to_text(&outcome))?;
    }
    Ok(transport.is_some())
}

/// How a case ended on one rank, if that rank lived to tell.
pub fn recorded(folder: &Path, case: &Case, rank: Rank) -> Option<Outcome> {
    from_text(&fs::read_to_string(file(folder, case, rank)).ok()?)
}

fn file(folder: &Path, case: &Case, rank: Rank) -> PathBuf {
    folder.join(format!("{}.{rank}", case.name))
}

fn to_text(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Finished => "finished\n".to_owned(),
        Outcome::Panicked(text) => format!("panicked\n{text}"),
        Outcome::Aborted(reason) => format!("aborted\n{reason}"),
    }
}

fn from_text(text: &str) -> Option<Outcome> {
    let (word, rest) = text.split_once('\n')?;
    match word {
        "finished" => Some(Outcome::Finished),
        "panicked" => Some(Outcome::Panicked(rest.to_owned())),
        "aborted" => Some(Outcome::Aborted(rest.to_owned())),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outcomes_survive_as_text() {
        let outcomes =
            [Outcome::Finished, Outcome::Panicked("two\nlines\n".to_owned()), Outcome::Aborted(String::new())];
        for outcome in outcomes {
            assert_eq!(from_text(&to_text(&outcome)), Some(outcome));
        }
        assert_eq!(from_text("finish"), None);
    }
}
