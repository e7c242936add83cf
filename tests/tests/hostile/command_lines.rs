//! Command lines.

use crate::random::rounds;
use crate::tally::Tally;
use crate::values::VALUES;
use atoll_tests::fuzz::{self, NoRun, Outcome};
use clap::error::ErrorKind;
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};
use std::cell::RefCell;

/// Every kind of refusal that a line can meet, and what makes no run either. Others of the parser need options that do not
/// exist here (with several values, with `=` alone), or a line that is no text.
const KINDS: [&str; 10] = [
    "no configuration",
    "another verb",
    "invalid value",
    "unknown argument",
    "invalid subcommand",
    "value validation",
    "too many values",
    "argument conflict",
    "missing required argument",
    "help",
];

fn kind(why: &NoRun) -> &'static str {
    match why {
        NoRun::Config(_) => "no configuration",
        NoRun::OtherVerb => "another verb",
        NoRun::Parser(kind) => match kind {
            ErrorKind::InvalidValue => "invalid value",
            ErrorKind::UnknownArgument => "unknown argument",
            ErrorKind::InvalidSubcommand => "invalid subcommand",
            ErrorKind::ValueValidation => "value validation",
            ErrorKind::TooManyValues => "too many values",
            ErrorKind::ArgumentConflict => "argument conflict",
            ErrorKind::MissingRequiredArgument => "missing required argument",
            ErrorKind::DisplayHelp
            | ErrorKind::DisplayVersion
            | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => "help",
            _ => "other",
        },
    }
}

/// Options that take a value.
const OPTIONS: &[&str] = &[
    "--ranks",
    "--threads",
    "--transport",
    "--tiles",
    "--bodies",
    "--steps",
    "--seed",
    "--set",
    "--json",
    "--peer-timeout",
    "--out",
    "--record-every",
    "--checkpoint-every",
    "--resume",
    "--restarts",
];

/// Other words that mean something.
const WORDS: &[&str] = &[
    "run",
    "diff",
    "info",
    "export",
    "--overwrite",
    "--quiet",
    "--help",
    "--version",
    "help",
    "--",
    "-",
    "world.toml",
];

const KEYS: &[&str] = &["hertz", "scene.bodies", "run", "sleep", "solvr", "", "a\nb", "=", "tiles"];

/// An argument, or two that go together.
fn any_arguments() -> impl Strategy<Value = Vec<String>> {
    let option = || prop::sample::select(OPTIONS);
    let word = || prop::sample::select(WORDS);
    let value = || prop::sample::select(VALUES);
    let key = prop::sample::select(KEYS);
    prop_oneof![
        8 => (option(), value()).prop_map(|(option, value)| vec![option.to_owned(), value.to_owned()]),
        2 => (option(), value()).prop_map(|(option, value)| vec![format!("{option}={value}")]),
        4 => (key, value()).prop_map(|(key, value)| vec!["--set".to_owned(), format!("{key}={value}")]),
        1 => (word(), value()).prop_map(|(word, value)| vec![format!("{word}={value}")]),
        3 => word().prop_map(|word| vec![word.to_owned()]),
        1 => option().prop_map(|option| vec![option.to_owned()]),
        1 => value().prop_map(|value| vec![value.to_owned()]),
        1 => any::<String>().prop_map(|text| vec![text]),
    ]
}

/// Runs a target on many inputs, and tells what became of them.
fn tally<S: Strategy>(of: S, target: impl Fn(S::Value) -> Outcome<NoRun>) -> Tally {
    let config = ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(rounds(5000) as u32) };
    let tally = RefCell::new(Tally::default());
    let run = TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha)).run(&of, |input| {
        tally.borrow_mut().count(&target(input), kind);
        Ok(())
    });
    run.unwrap_or_else(|error| panic!("{error}"));
    tally.into_inner()
}

#[test]
fn any_command_line() {
    let verbs: &[&[&str]] = &[&[], &["run"], &["run", "world.toml"], &["diff", "a", "b"], &["info", "a"]];
    let verb = prop_oneof![1 => Just(0), 1 => Just(1), 12 => Just(2), 1 => Just(3), 1 => Just(4)];
    let lines = (verb, prop::collection::vec(any_arguments(), 0..4));
    let tally = tally(lines, |(verb, rest)| {
        let verb = verbs[verb].iter().map(|&word| word.to_owned());
        let line: Vec<String> = verb.chain(rest.into_iter().flatten()).collect();
        fuzz::arguments(line.join("\0").as_bytes())
    });
    tally.check(50, &KINDS);
}

#[test]
fn any_bytes_as_a_command_line() {
    tally(prop::collection::vec(any::<u8>(), 0..200), |bytes| {
        fuzz::config(&bytes);
        fuzz::arguments(&bytes)
    });
}
