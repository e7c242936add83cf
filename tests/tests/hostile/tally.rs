//! What became of all input of one sort.

use atoll_tests::fuzz::Outcome;
use std::collections::BTreeMap;

/// How often input was accepted, and how often refused, by kind.
#[derive(Default, Debug)]
pub(crate) struct Tally {
    rounds: usize,
    accepted: usize,
    refused: BTreeMap<&'static str, usize>,
}

impl Tally {
    pub(crate) fn count<E>(&mut self, outcome: &Outcome<E>, kind: impl Fn(&E) -> &'static str) {
        self.rounds += 1;
        self.accepted += usize::from(outcome.accepted);
        for refusal in &outcome.refusals {
            *self.refused.entry(kind(refusal)).or_default() += 1;
        }
    }

    /// Asserts that one in `few` to one in two were accepted, and that the refusals were of these kinds, all of them.
    #[track_caller]
    pub(crate) fn check(&self, few: usize, kinds: &[&str]) {
        let mut kinds = kinds.to_vec();
        kinds.sort_unstable();
        assert!(self.refused.keys().eq(&kinds), "not of every kind, or of one more, {kinds:?}: {self:?}");
        assert!(
            self.accepted > self.rounds / few && self.accepted < self.rounds / 2,
            "too few or too many were accepted: {self:?}"
        );
    }
}
