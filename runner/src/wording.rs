//! Words of others in a line of ours: harmless to a terminal, and what they may have meant. Numbers as people write them.

use std::fmt::{self, Write as _};

/// Shows a text that somebody else wrote on one line, and harmless to a terminal: each run of line breaks and other
/// control characters becomes a space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OneLine<'a>(pub &'a str);

impl fmt::Display for OneLine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let broken = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
        for (i, part) in self.0.split(broken).filter(|part| !part.is_empty()).enumerate() {
            if i > 0 {
                f.write_char(' ')?;
            }
            f.write_str(part)?;
        }
        Ok(())
    }
}

/// Words at least this similar (normalized Damerau-Levenshtein, 0 to 1) are offered as what was meant.
const SIMILAR: f64 = 0.6;

/// The word most like `text`, if any is like it.
pub(crate) fn nearest<'a>(words: impl Iterator<Item = &'a str>, text: &str) -> Option<String> {
    nearest_by(words, |word| strsim::normalized_damerau_levenshtein(word, text))
}

/// The word of the greatest likeness, if that is enough.
pub(crate) fn nearest_by<'a>(words: impl Iterator<Item = &'a str>, likeness: impl Fn(&str) -> f64) -> Option<String> {
    let best = words.map(|word| (likeness(word), word)).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 >= SIMILAR).then(|| best.1.to_owned())
}

/// What to add to a refusal of a word, if another is like it.
pub(crate) fn did_you_mean(suggestion: &Option<String>) -> String {
    suggestion.as_ref().map(|word| format!("; did you mean {word}?")).unwrap_or_default()
}

/// A number that is written as the shortest decimal which files lead back to the same bits of 32.
pub(crate) fn shortest(number: f32) -> f64 {
    let shortest: f64 = number.to_string().parse().expect("a number is written as one");
    // A file's numbers are rounded twice, to 64 bits and then to 32. Of all numbers, 7.038531e-26 alone ends elsewhere.
    let same = (shortest as f32).to_bits() == number.to_bits();
    if same { shortest } else { number.into() }
}
