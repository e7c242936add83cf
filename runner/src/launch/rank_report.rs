//! What a rank in a process of its own reports to the process that started it: one line of JSON on its standard output.

use crate::error::Exit;
use crate::rank::trace::RankTrace;
use crate::rank::{Gathered, RankEnd, RankError, RankFacts};
use atoll_core::TileFacts;
use atoll_transport::{Rank, RankFailure, TransportError};
use bytemuck::Pod;
use serde::{Deserialize, Serialize};

/// How a rank ended.
#[derive(Serialize, Deserialize)]
enum Report {
    /// It completed so many steps and came to this.
    Ended { complete: u64, result: Result<Option<Figures>, Trouble> },
    /// Its code panicked.
    Panicked { complete: u64, message: String },
    /// It aborted.
    Aborted { reason: String },
}

/// The figures of all ranks as the 64-bit words they consist of, and what their threads did.
#[derive(Serialize, Deserialize)]
struct Figures {
    ranks: Vec<u64>,
    tiles: Vec<u64>,
    trace: Option<Vec<RankTrace>>,
}

/// Why a rank ended early.
#[derive(Serialize, Deserialize)]
enum Trouble {
    /// The transport failed, as [`TransportError::to_text`] says it.
    Transport(String),
    /// Anything else, in words, with an exit code.
    Other { text: String, exit: u8 },
}

/// Writes how a rank ended. What it failed of must be a loss, or in words already ([`RankError::Told`]): anything else
/// loses its exit code. It completed so many steps, also where it
/// could not say so itself.
pub(super) fn write(end: &Result<RankEnd, RankFailure>, complete: u64) -> String {
    let report = match end {
        Ok(RankEnd { complete, result }) => {
            let result = match result {
                Ok(gathered) => Ok(gathered.as_ref().map(|gathered| Figures {
                    ranks: bytemuck::cast_slice(&gathered.ranks).to_vec(),
                    tiles: bytemuck::cast_slice(&gathered.tiles).to_vec(),
                    trace: gathered.trace.clone(),
                })),
                Err(error) => Err(trouble(error)),
            };
            Report::Ended { complete: *complete, result }
        }
        Err(RankFailure::Aborted { reason, .. }) => Report::Aborted { reason: reason.clone() },
        Err(RankFailure::Panicked { message, .. }) => Report::Panicked { complete, message: message.clone() },
        Err(failure) => Report::Panicked { complete, message: failure.to_string() },
    };
    let mut line = serde_json::to_string(&report).expect("numbers and words, under names");
    line.push('\n');
    line
}

fn trouble(error: &RankError) -> Trouble {
    match (error, error.transport()) {
        (_, Some(error)) => Trouble::Transport(error.to_text()),
        (RankError::Told { text, exit }, None) => Trouble::Other { text: text.clone(), exit: *exit as u8 },
        (error, None) => Trouble::Other { text: format!("{error:?}"), exit: Exit::PeerLost as u8 },
    }
}

/// Reads what a rank wrote, if that is a whole report: how it ended, and the steps it had completed where that does not
/// say so.
pub(super) fn read(rank: Rank, bytes: &[u8]) -> Option<(Result<RankEnd, RankFailure>, u64)> {
    let mut before = 0;
    let end = match serde_json::from_slice(bytes).ok()? {
        Report::Ended { complete, result } => {
            let result = match result {
                Ok(None) => Ok(None),
                Ok(Some(Figures { ranks, tiles, trace })) => {
                    Ok(Some(Gathered { ranks: records(&ranks)?, tiles: records(&tiles)?, trace }))
                }
                Err(Trouble::Transport(text)) => Err(RankError::Transport(TransportError::from_text(&text)?)),
                Err(Trouble::Other { text, exit }) => Err(RankError::Told { text, exit: Exit::from_code(exit) }),
            };
            Ok(RankEnd { complete, result })
        }
        Report::Panicked { complete, message } => {
            before = complete;
            Err(RankFailure::Panicked { rank, message })
        }
        Report::Aborted { reason } => Err(RankFailure::Aborted { rank, reason }),
    };
    Some((end, before))
}

fn records<T: Pod>(words: &[u64]) -> Option<Vec<T>> {
    bytemuck::try_cast_slice(words).ok().map(<[T]>::to_vec)
}

const _: () = assert!(align_of::<RankFacts>() == 8 && align_of::<TileFacts>() == 8, "both consist of 64-bit words");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rank::trace::Slice;
    use std::time::Duration;

    fn there_and_back(end: Result<RankEnd, RankFailure>) -> Result<RankEnd, RankFailure> {
        let line = write(&end, 17);
        assert_eq!(line.matches('\n').count(), 1);
        let (read, before) = read(Rank(3), line.as_bytes()).expect("a whole report");
        assert_eq!(before, if read.is_ok() { 0 } else { 17 });
        read
    }

    #[test]
    fn figures_arrive_bit_for_bit() {
        let ranks = vec![RankFacts { steps: u64::MAX, wait_nanos: 7, ..RankFacts::default() }; 3];
        let tiles = vec![TileFacts { mass: 0.1 + 0.2, max_violation: -0.0, ..TileFacts::default() }; 2];
        let slice = Slice { thread: 1, name: 0, of: Some((1, u64::MAX)), start: -5, nanos: 7 };
        let names = ["substeps", "tile"].map(str::to_owned).to_vec();
        let trace = Some(vec![RankTrace { left_out: 3, doubt: 2, names, slices: vec![slice] }]);
        let gathered = Gathered { ranks, tiles, trace };
        let end = there_and_back(Ok(RankEnd { complete: 9, result: Ok(Some(gathered.clone())) })).unwrap();
        assert_eq!(end.complete, 9);
        let arrived = end.result.unwrap().unwrap();
        assert_eq!(arrived, gathered);
        assert!(arrived.tiles[0].max_violation.is_sign_negative());
    }

    #[test]
    fn troubles_keep_what_the_outcome_needs() {
        let transport = |error| there_and_back(Ok(RankEnd { complete: 4, result: Err(RankError::Transport(error)) }));
        for error in [
            TransportError::PeerLost { rank: Rank(1), reason: "it panicked".to_owned() },
            TransportError::Timeout { rank: Rank(2), waited: Duration::from_millis(1500) },
            TransportError::Usage { message: "rank 3: two\nlengths".to_owned() },
        ] {
            let end = transport(error.clone()).unwrap();
            assert!(matches!(end.result, Err(RankError::Transport(arrived)) if arrived == error));
        }
        let told = RankError::Told { text: "in words".to_owned(), exit: Exit::Physics };
        let end = there_and_back(Ok(RankEnd { complete: 4, result: Err(told) })).unwrap();
        let Err(RankError::Told { text, exit }) = end.result else { panic!("told in words") };
        assert_eq!((text.as_str(), exit), ("in words", Exit::Physics));

        let panicked = RankFailure::Panicked { rank: Rank(3), message: "boom".to_owned() };
        assert_eq!(there_and_back(Err(panicked.clone())).unwrap_err(), panicked);
    }

    #[test]
    fn half_a_report_is_none() {
        let line = write(&Ok(RankEnd { complete: 1, result: Ok(None) }), 1);
        for length in 0..line.len() - 1 {
            assert!(read(Rank(0), &line.as_bytes()[..length]).is_none(), "{length}");
        }
    }
}
