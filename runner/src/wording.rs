//! Words of others in a line of ours: harmless to a terminal, and what they may have meant. Numbers as people write them.

use atoll_core::Shape;
use glam::Vec2;
use std::fmt::{self, Write as _};
use std::path::Path;
use toml::Value;

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

/// Shows a path as a shell takes it, in a command that is to be copied.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Typed<'a>(pub &'a Path);

impl fmt::Display for Typed<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = self.0.display().to_string();
        let is_plain = |c: char| c.is_alphanumeric() || "/._-+=:,@%".contains(c);
        if path.chars().all(is_plain) { f.write_str(&path) } else { write!(f, "'{}'", path.replace('\'', r"'\''")) }
    }
}

/// A text without the mark that some editors begin files with.
pub(crate) fn unmarked(mut text: String) -> String {
    const MARK: char = '\u{feff}';
    if text.starts_with(MARK) {
        text.drain(..MARK.len_utf8());
    }
    text
}

/// What is wrong with a text that should be TOML, and in which line, from 1.
pub(crate) fn toml_fault(text: &str, error: &toml::de::Error) -> (usize, String) {
    let span = error.span().unwrap_or(0..0);
    let start = span.start.min(text.len());
    let line = text.as_bytes()[..start].iter().filter(|&&byte| byte == b'\n').count() + 1;
    let message = error.message().lines().collect::<Vec<_>>().join(", ");
    let message = match text.get(span) {
        Some(key) if message == "duplicate key" => format!("{key} is given twice; leave one of them out"),
        _ if message.contains(" as i128") => "a whole number that 64 bits have room for must stand here".to_owned(),
        _ => message,
    };
    (line, message)
}

/// Words at least this similar (normalized Damerau-Levenshtein, 0 to 1) are offered as what was meant.
const SIMILAR: f64 = 0.6;

/// The word most like `text`, whose letters may be large or small, if any is like it.
pub(crate) fn nearest<'a>(words: impl Iterator<Item = &'a str>, text: &str) -> Option<String> {
    nearest_by(words, |word| match word.eq_ignore_ascii_case(text) {
        true => 1.0,
        false => strsim::normalized_damerau_levenshtein(word, text),
    })
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

/// So many of something.
pub(crate) fn plural(count: u64, word: &str) -> String {
    format!("{count} {}", form_for(count, word))
}

/// The form of a word that stands behind such a number.
pub(crate) fn form_for(count: u64, word: &str) -> String {
    match (count, word.strip_suffix('y')) {
        (1, _) => word.to_owned(),
        (_, Some(stem)) => format!("{stem}ies"),
        _ if word.ends_with('x') => format!("{word}es"),
        _ => format!("{word}s"),
    }
}

/// So many of something, where that changes.
pub(crate) fn between(fewest: u64, most: u64, word: &str) -> String {
    if fewest == most { plural(most, word) } else { format!("{fewest} to {}", plural(most, word)) }
}

/// A number as TOML has it, with an exponent where it would be long.
pub(crate) fn exponential(number: f64) -> String {
    let is_long = number.is_finite() && number != 0.0 && !(1e-5..1e9).contains(&number.abs());
    if is_long { format!("{number:e}") } else { Value::Float(number).to_string() }
}

/// A number with as many digits behind the point as asked for, or with an exponent where these would not show it, or it would be long.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Figure(pub f64);

impl fmt::Display for Figure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (places, size) = (f.precision().unwrap_or(6), self.0.abs());
        let shows = size == 0.0 || (0.1_f64.powi(places as i32)..1e9).contains(&size);
        if shows { write!(f, "{:.places$}", self.0) } else { write!(f, "{:.2e}", self.0) }
    }
}

/// A number with as few digits as it takes, up to four behind the point.
pub(crate) fn short(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// What a shape is, and how large, in meters.
pub(crate) fn shape(shape: &Shape) -> String {
    let size = |width: f32, height: f32| format!("{} × {} m", short(width.into()), short(height.into()));
    let reach = |(low, high): (Vec2, Vec2), (corners, radius): (Vec<Vec2>, f32)| {
        corners.into_iter().fold((low, high), |(low, high), at| (low.min(at - radius), high.max(at + radius)))
    };
    let (low, high) = shape.outlines().into_iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), reach);
    let whole = size(high.x - low.x, high.y - low.y);
    match shape {
        Shape::Circle { radius } => format!("circle, {} m", short(f64::from(2.0 * radius))),
        Shape::Box { .. } => format!("box, {whole}"),
        Shape::Polygon(polygon) => match (polygon.corners().len(), polygon.radius() > 0.0) {
            (2, _) => {
                let (length, width) = (2.0 * (shape.bounding_radius()), 2.0 * polygon.radius());
                format!("capsule, {}", size(length, width))
            }
            (corners, false) => format!("polygon of {corners} corners, {whole}"),
            (corners, true) => format!("polygon of {corners} round corners, {whole}"),
        },
        Shape::Segment(_) => format!("segment, {} m", short(f64::from(2.0 * shape.bounding_radius()))),
        Shape::Compound(compound) => format!("compound of {} parts, {whole}", compound.parts().len()),
    }
}

/// A number that is written as the shortest decimal which files lead back to the same bits of 32.
pub(crate) fn shortest(number: f32) -> f64 {
    let shortest: f64 = number.to_string().parse().expect("a number is written as one");
    // A file's numbers are rounded twice, to 64 bits and then to 32. Of all numbers, 7.038531e-26 alone ends elsewhere.
    let same = (shortest as f32).to_bits() == number.to_bits();
    if same { shortest } else { number.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_shown_as_a_shell_takes_them() {
        let typed = |path: &str| Typed(Path::new(path)).to_string();
        assert_eq!(typed("runs/a-1.b"), "runs/a-1.b");
        assert_eq!(typed("my runs/a"), "'my runs/a'");
        assert_eq!(typed("it's $HOME"), r"'it'\''s $HOME'");
    }
}
