//! In what two configurations differ.

use std::collections::BTreeMap;

/// A key that two configurations give different values.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Difference {
    /// Its full path.
    pub key: String,
    /// The value in the first, as TOML, or `nothing`.
    pub ours: String,
    /// The value in the second, as TOML, or `nothing`.
    pub theirs: String,
}

/// All keys in which two texts as of [`Config::canonical`](super::Config::canonical) differ: those of the first in its
/// order, then those that are in the second alone. The texts may come from anywhere.
pub(crate) fn differences(ours: &str, theirs: &str) -> Vec<Difference> {
    if ours == theirs {
        return Vec::new();
    }
    let (ours, theirs) = (pairs(ours), pairs(theirs));
    // Of keys that are there more than once, the first counts.
    let look_up = |pairs: &[_]| pairs.iter().rev().copied().collect::<BTreeMap<&str, &str>>();
    let (our_values, their_values) = (look_up(&ours), look_up(&theirs));
    let only_theirs = theirs.iter().filter(|(key, _)| !our_values.contains_key(key));
    let keys = ours.iter().chain(only_theirs).map(|(key, _)| *key);
    let value = |values: &BTreeMap<_, &str>, key| (*values.get(key).unwrap_or(&"nothing")).to_owned();
    let all = keys.map(|key| Difference {
        key: key.to_owned(),
        ours: value(&our_values, key),
        theirs: value(&their_values, key),
    });
    all.filter(|one| one.ours != one.theirs).collect()
}

/// The first key in which two texts as of [`Config::identity`](super::Config::identity) differ that cannot be of one run:
/// one that goes on may make more steps, or fewer.
pub(crate) fn other_run(ours: &str, theirs: &str) -> Option<Difference> {
    differences(ours, theirs).into_iter().find(|difference| difference.key != "run.steps")
}

fn pairs(text: &str) -> Vec<(&str, &str)> {
    text.lines().map(|line| line.split_once(" = ").unwrap_or((line, ""))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;

    #[test]
    fn all_keys_that_differ_are_found_and_no_others() {
        let canonical = |kind: &str, overrides: &[(&str, &str)]| {
            let text = format!("[scene]\nkind = \"{kind}\"\nbodies = 500\n");
            Config::from_toml_str("test", &text, overrides).unwrap().canonical([2, 2])
        };
        let found = |ours: &str, theirs: &str| {
            let all = differences(ours, theirs).into_iter();
            all.map(|one| format!("{}: {}, {}", one.key, one.ours, one.theirs)).collect::<Vec<_>>()
        };
        let usual = canonical("rooms", &[]);
        assert!(differences(&usual, &usual).is_empty());
        assert_eq!(
            found(&usual, &canonical("rooms", &[("hertz", "90"), ("steps", "7"), ("ranks", "2")])),
            ["run.steps: 600, 7", "physics.hertz: 60.0, 90.0"]
        );
        assert_eq!(
            found(&usual, &canonical("sparse", &[])),
            ["scene.kind: \"rooms\", \"sparse\"", "scene.power: 1.0, nothing"]
        );
        assert_eq!(found(&usual, &format!("{usual}physics.new = 1\n")), ["physics.new: nothing, 1"]);
        assert_eq!(found("a = 1\nnonsense\n", "a = 1\n"), ["nonsense: , nothing"]);
        assert_eq!(
            found("b = 1\na = 1\nb = 2\n", "d = 1\nc = 1\nb = 3\nb = 1\n"),
            ["b: 1, 3", "a: 1, nothing", "b: 1, 3", "d: nothing, 1", "c: nothing, 1"]
        );
    }
}
