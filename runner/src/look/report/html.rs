//! Pieces of the page. Whatever comes from a file goes through [`Text`].

use crate::wording::form_for;
use std::fmt::{self, Display, Formatter, Write as _};

/// A text as it is shown, whatever characters are in it.
pub(super) struct Text<'a>(pub &'a str);

impl Display for Text<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for letter in self.0.chars() {
            match letter {
                '&' => f.write_str("&amp;")?,
                '<' => f.write_str("&lt;")?,
                '>' => f.write_str("&gt;")?,
                '"' => f.write_str("&quot;")?,
                '\'' => f.write_str("&#39;")?,
                '\n' | '\t' => f.write_char(letter)?,
                // HTML has no place for these, and some turn the direction of what stands around them.
                letter if letter.is_control() || ('\u{202a}'..='\u{202e}').contains(&letter) => {
                    f.write_char('\u{fffd}')?
                }
                letter if ('\u{2066}'..='\u{2069}').contains(&letter) => f.write_char('\u{fffd}')?,
                letter => f.write_char(letter)?,
            }
        }
        Ok(())
    }
}

/// A number with a suffix for its thousands, `12.3k`. A small one has none, as `4.5m` would be read as meters.
pub(super) struct Short(pub f64);

impl Display for Short {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (digits, size) = (f.precision().unwrap_or(3), self.0.abs());
        if size >= 1.0 || size == 0.0 {
            let (number, suffix) = self.parts(digits);
            return write!(f, "{number}{suffix}");
        }
        let text = if size < 1e-3 {
            format!("{:.2e}", self.0)
        } else {
            let places = digits.saturating_sub(1) + (-size.log10()).ceil() as usize;
            format!("{:.places$}", self.0).trim_end_matches('0').to_owned()
        };
        f.write_str(&text.replace('-', "\u{2212}"))
    }
}

/// A number with its unit: `12.3 km`.
pub(super) struct Unit<'a>(pub f64, pub &'a str);

impl Display for Unit<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (number, suffix) = Short(self.0).parts(f.precision().unwrap_or(3));
        write!(f, "{number}\u{a0}{suffix}{}", self.1)
    }
}

impl Short {
    /// The number, to so many digits, and the suffix.
    fn parts(&self, digits: usize) -> (String, &'static str) {
        const SUFFIXES: [&str; 9] = ["p", "n", "\u{b5}", "m", "", "k", "M", "G", "T"];
        let size = self.0.abs();
        if size == 0.0 {
            return ("0".to_owned(), "");
        }
        let thousands = (size.log10() / 3.0 + 1e-12).floor();
        if !size.is_finite() || !(-4.0..=4.0).contains(&thousands) {
            return (format!("{:.2e}", self.0).replace('-', "\u{2212}"), "");
        }
        let scaled = self.0 / 1000_f64.powf(thousands);
        let places = digits.saturating_sub(1 + scaled.abs().log10().max(0.0) as usize);
        let text = format!("{scaled:.places$}");
        let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        (text.replace('-', "\u{2212}"), SUFFIXES[(thousands + 4.0) as usize])
    }
}

/// A whole number, its thousands apart.
pub(super) struct Whole(pub u64);

/// So many of something.
pub(super) fn whole(count: u64, word: &str) -> String {
    format!("{} {}", Whole(count), form_for(count, word))
}

impl Display for Whole {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let digits = self.0.to_string();
        for (i, digit) in digits.chars().enumerate() {
            if i > 0 && (digits.len() - i).is_multiple_of(3) {
                f.write_char(',')?;
            }
            f.write_char(digit)?;
        }
        Ok(())
    }
}

/// A figure with its caption: a chart or a picture, known by a name. `content` is HTML.
pub(super) fn figure(name: &str, wide: bool, title: &str, about: &str, content: &str) -> String {
    let class = if wide { " class=\"wide\"" } else { "" };
    let (title, about) = (Text(title), Text(about));
    format!(
        "<figure id=\"{name}\"{class}><figcaption><b>{title}</b><small>{about}</small></figcaption>{content}</figure>\n"
    )
}

/// A table; the cells are HTML. The first of a row is its head.
pub(super) fn table(head: &[String], rows: &[Vec<String>]) -> String {
    let mut text = String::from("<div class=\"card\"><table>");
    if !head.is_empty() {
        let cells: String = head.iter().map(|cell| format!("<th>{cell}</th>")).collect();
        write!(text, "<thead><tr>{cells}</tr></thead>").expect("a string takes any text");
    }
    text.push_str("<tbody>");
    for row in rows {
        let (first, rest) = row.split_first().expect("a row has a head");
        let cells: String = rest.iter().map(|cell| format!("<td>{cell}</td>")).collect();
        writeln!(text, "<tr><th>{first}</th>{cells}</tr>").expect("a string takes any text");
    }
    text + "</tbody></table></div>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_becomes_markup() {
        let text = Text("<script>alert(\"&'\")</script>\u{0}\u{202e}\u{1b}").to_string();
        assert_eq!(text, "&lt;script&gt;alert(&quot;&amp;&#39;&quot;)&lt;/script&gt;\u{fffd}\u{fffd}\u{fffd}");
        assert!(figure("a", true, "<b>", "\"", "").contains("<b>&lt;b&gt;</b><small>&quot;</small>"));
    }

    #[test]
    fn numbers_are_short() {
        let short = |value: f64| Short(value).to_string();
        for (value, expected) in [
            (0.0, "0"),
            (12345.0, "12.3k"),
            (1000.0, "1k"),
            (999.0, "999"),
            (-0.00452, "\u{2212}0.00452"),
            (0.0711349, "0.0711"),
            (0.1, "0.1"),
            (1e-6, "1.00e\u{2212}6"),
            (2.5e12, "2.5T"),
            (1e30, "1.00e30"),
        ] {
            assert_eq!(short(value), expected);
        }
        assert_eq!(Unit(0.0167, "s").to_string(), "16.7\u{a0}ms");
        assert_eq!(Whole(1_234_567).to_string() + &Whole(12).to_string(), "1,234,56712");
    }
}
