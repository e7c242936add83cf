//! What processes tell each other before they run together: whether each is ready, and that all mean the same run.

use super::trouble::{Refusal, in_words, relayed};
use crate::error::RunError;
use crate::folder::FolderError;
use crate::folder::snapshot::Snapshot;
use crate::plan::Plan;
use atoll_transport::{Collective, Rank, Transport};
use std::collections::BTreeMap;

/// Stands in front of the words of a rank that is not ready.
const ERROR: &str = "error";

/// Stands in front of the words of a rank that speaks for all: which rank it is makes no difference.
const COMMON_ERROR: &str = "common error";

/// Tells all ranks whether this one is ready and hears the same of them. Gives back what was prepared where all are
/// ready for the same run.
///
/// # Errors
/// Whatever is wrong with any of them, the same on every rank.
pub(crate) fn agree<T>(
    transport: &mut impl Transport,
    prepared: Result<T, RunError>,
    plan_of: impl FnOnce(&T) -> &Plan,
) -> Result<T, Refusal> {
    let hello = match &prepared {
        Ok(prepared) => hello(plan_of(prepared)),
        Err(error) => {
            // Output is the business of one rank.
            let of_one = matches!(
                error,
                RunError::BadOutput { .. }
                    | RunError::TakenOutput { .. }
                    | RunError::Folder(FolderError::Unusable { .. } | FolderError::Full { .. })
            );
            let name = if of_one { COMMON_ERROR } else { ERROR };
            vec![(name.to_owned(), in_words(error))]
        }
    };
    let hellos = transport.all_gather(encode(&hello).as_bytes()).map_err(Refusal::Transport)?;
    let hellos: Vec<Hello> = hellos.iter().map(|bytes| decode(bytes)).collect();
    match (refusal(&hellos), prepared) {
        (Some(error), _) | (None, Err(error)) => Err(Refusal::Known(error)),
        (None, Ok(prepared)) => Ok(prepared),
    }
}

/// Names and values, a line each.
type Hello = Vec<(String, String)>;

/// Everything that every rank must have alike.
fn hello(plan: &Plan) -> Hello {
    let run = &plan.config.run;
    let lines = [
        ("program version", env!("CARGO_PKG_VERSION").to_owned()),
        ("message format", atoll_core::FORMAT.to_string()),
        ("number of ranks", run.ranks.to_string()),
        ("configuration", plan.config.hash(plan.tiles)),
        ("mpi_exchange", format!("{:?}", run.mpi_exchange).to_lowercase()),
        ("output", format!("{:?}", plan.output.as_ref().map(|output| (output.folder.path(), output.every)))),
        ("log", format!("{:?}", plan.log)),
        ("commands", plan.commands.hello()),
        ("snapshots of steps", format!("{:?}", plan.found.snapshots.iter().map(Snapshot::step).collect::<Vec<_>>())),
    ];
    lines.map(|(name, value)| (name.to_owned(), value)).into()
}

fn encode(hello: &Hello) -> String {
    hello.iter().map(|(name, value)| format!("{name}\t{value}\n")).collect()
}

/// Whatever another version may have sent, it gives lines.
fn decode(bytes: &[u8]) -> Hello {
    let text = String::from_utf8_lossy(bytes);
    let pair = |line: &str| line.split_once('\t').map(|(name, value)| (name.to_owned(), value.to_owned()));
    text.lines().filter_map(pair).collect()
}

/// What keeps these ranks from running together, if anything does.
fn refusal(hellos: &[Hello]) -> Option<RunError> {
    let value = |hello: &Hello, name: &str| hello.iter().find(|line| line.0 == name).map(|line| line.1.clone());
    let errors: Vec<Option<String>> = hellos.iter().map(|hello| value(hello, ERROR)).collect();
    if let Some(rank) = errors.iter().position(Option::is_some) {
        let everywhere = errors.iter().all(|error| *error == errors[rank]);
        return errors[rank].as_deref().map(|error| relayed(error, (!everywhere).then_some(rank)));
    }
    if let Some(error) = hellos.iter().find_map(|hello| value(hello, COMMON_ERROR)) {
        return Some(relayed(&error, None));
    }
    // In the order in which they explain each other: another version has other hashes as well.
    for (name, _) in hellos.first()? {
        let values: Vec<String> =
            hellos.iter().map(|hello| value(hello, name).unwrap_or_else(|| "nothing".to_owned())).collect();
        let mut votes = BTreeMap::<&String, usize>::new();
        values.iter().for_each(|value| *votes.entry(value).or_default() += 1);
        // The most common; among equals that of the lowest rank.
        let most = votes.values().max().copied()?;
        let expected = values.iter().find(|value| votes[value] == most)?;
        if let Some(rank) = values.iter().position(|value| value != expected) {
            let (what, found, expected) = (name.clone(), values[rank].clone(), expected.clone());
            return Some(RunError::Mismatch { rank: Rank::from_index(rank), what, found, expected });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use atoll_transport::channel::{self, ChannelOptions};

    fn plan(overrides: &[(&str, &str)]) -> Result<Plan, RunError> {
        let text = "[scene]\nkind = \"rooms\"\nbodies = 100\n[run]\nranks = 4\n";
        Plan::new(&Config::from_toml_str("test", text, overrides)?)
    }

    /// What four ranks say when one of them, the third, was started otherwise.
    fn third_rank_has(overrides: &[(&str, &str)]) -> Vec<String> {
        let ends = channel::run(4, ChannelOptions::default(), |mut endpoint| {
            let own = if endpoint.rank() == Rank(2) { plan(overrides) } else { plan(&[]) };
            match agree(&mut endpoint, own, |plan| plan) {
                Ok(_) => "agreed".to_owned(),
                Err(Refusal::Known(error)) => format!("{}: {error}", error.exit() as u8),
                Err(Refusal::Transport(error)) => panic!("{error}"),
            }
        });
        ends.into_iter().map(|end| end.expect("no rank panics")).collect()
    }

    #[test]
    fn like_ranks_agree() {
        assert_eq!(third_rank_has(&[]), ["agreed"; 4]);
        // How a rank computes is its own business.
        assert_eq!(third_rank_has(&[("threads", "2"), ("broad_phase", "quadtree")]), ["agreed"; 4]);
    }

    #[test]
    fn the_odd_rank_is_named_by_all() {
        for (key, value, what) in [
            ("seed", "2", "configuration "),
            ("ranks", "3", "number of ranks 3, and most ranks with 4"),
            ("mpi_exchange", "sparse", "mpi_exchange sparse, and most ranks with alltoallv"),
        ] {
            for text in third_rank_has(&[(key, value)]) {
                assert!(text.starts_with(&format!("2: rank 2 was started with {what}")), "{text}");
            }
        }
    }

    #[test]
    fn a_rank_that_is_not_ready_is_heard_by_all() {
        for text in third_rank_has(&[("bodies", "-1")]) {
            assert!(text.starts_with("2: rank 2: --set scene.bodies=-1: must be"), "{text}");
        }
    }

    #[test]
    fn what_all_say_is_said_once() {
        let error = refusal(&[
            vec![(ERROR.to_owned(), "2 no such file".to_owned())],
            vec![(ERROR.to_owned(), "2 no such file".to_owned())],
        ]);
        assert_eq!(error.map(|error| error.to_string()).as_deref(), Some("no such file"));
        let strange = refusal(&[decode(b"version\t1\n"), decode(b"\xff\xfe"), decode(b"version\t1\n")]);
        assert!(strange.unwrap().to_string().starts_with("rank 1 was started with version nothing, and most"));
    }
}
