//! What a key or a word may have meant that is none.

use super::error::{ConfigError, Given, Origin};
use crate::wording::nearest_by;

/// The key that `text` names: a full path, or the last part of exactly one.
pub(super) fn resolve(
    keys: &[&'static str],
    text: &str,
    value: &str,
    origin: Origin,
) -> Result<&'static str, ConfigError> {
    if let Some(key) = keys.iter().find(|&&key| key == text) {
        return Ok(key);
    }
    let candidates: Vec<&'static str> = keys.iter().filter(|key| last_part(key) == text).copied().collect();
    let given = || Given { origin: origin.clone(), key: text.to_owned(), value: value.to_owned() };
    match candidates[..] {
        [key] => Ok(key),
        [] => Err(ConfigError::UnknownKey { given: given(), suggestion: nearest_key(keys, text) }),
        _ => {
            let candidates = candidates.iter().map(|&key| key.to_owned()).collect();
            Err(ConfigError::AmbiguousKey { given: given(), candidates })
        }
    }
}

/// The key whose last part is most like that of `text`; of several, the one most alike in whole.
pub(super) fn nearest_key(keys: &[&str], text: &str) -> Option<String> {
    let likeness = |key: &str| {
        let part = strsim::normalized_damerau_levenshtein(last_part(key), last_part(text));
        part + 0.01 * strsim::normalized_damerau_levenshtein(key, text)
    };
    nearest_by(keys.iter().copied(), likeness)
}

fn last_part(key: &str) -> &str {
    key.rsplit_once('.').map_or(key, |(_, part)| part)
}

#[cfg(test)]
mod tests {
    use super::super::keys;
    use super::*;

    fn named(text: &str) -> Result<&'static str, ConfigError> {
        resolve(&keys::names().collect::<Vec<_>>(), text, "1", Origin::Set)
    }

    #[test]
    fn full_paths_and_unambiguous_last_parts_are_found() {
        assert_eq!(named("physics.solver"), Ok("physics.solver"));
        assert_eq!(named("solver"), Ok("physics.solver"));
        assert_eq!(named("steps"), Ok("run.steps"));
    }

    #[test]
    fn ambiguous_last_parts_are_refused_with_all_they_may_mean() {
        const DOUBLE: &[&str] = &["scene.size", "run.size", "run.other"];
        let error = resolve(DOUBLE, "size", "1", Origin::Set).unwrap_err();
        assert_eq!(error.to_string(), "--set size=1: ambiguous, write one of scene.size, run.size");
        assert_eq!(resolve(DOUBLE, "run.size", "1", Origin::Set), Ok("run.size"));
    }

    #[test]
    fn unknown_keys_come_with_the_nearest_one() {
        for (typed, meant) in [
            ("sovler", "physics.solver"),
            ("physics.substep", "physics.substeps"),
            ("run.bodies", "scene.bodies"),
            ("scene.knid", "scene.kind"),
        ] {
            let error = named(typed).unwrap_err().to_string();
            assert_eq!(error, format!("--set {typed}=1: unknown key; did you mean {meant}?"));
        }
        assert_eq!(named("zzz").unwrap_err().to_string(), "--set zzz=1: unknown key");
    }
}
