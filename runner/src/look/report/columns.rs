//! Tables that a run has left, as CSV, read by the names of their columns.

use std::collections::HashMap;

/// The columns of a table.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Columns {
    names: Vec<String>,
    /// Where each name stands.
    places: HashMap<String, usize>,
    numbers: Vec<Vec<f64>>,
    words: Vec<Vec<String>>,
}

impl Columns {
    /// Reads a table: a line of names, and lines with as many values. Of a last line that a killed run did not finish, nothing
    /// is taken.
    ///
    /// # Errors
    /// Naming the first line that has more values, or fewer.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let mut lines = text.lines().filter(|line| !line.starts_with('#')).enumerate();
        let Some((_, head)) = lines.next() else { return Err("it is empty".to_owned()) };
        let names: Vec<String> = head.split(',').map(|name| name.trim().to_owned()).collect();
        let places = names.iter().cloned().zip(0..).collect();
        let (mut numbers, mut words) = (vec![Vec::new(); names.len()], vec![Vec::new(); names.len()]);
        let whole = text.ends_with('\n');
        let mut lines = lines.peekable();
        while let Some((number, line)) = lines.next() {
            let values: Vec<&str> = line.split(',').map(str::trim).collect();
            if lines.peek().is_none() && !whole {
                break;
            }
            if values.len() != names.len() {
                return Err(format!("line {} has {} values and not {}", number + 1, values.len(), names.len()));
            }
            for ((numbers, words), value) in numbers.iter_mut().zip(&mut words).zip(values) {
                let number = value.parse();
                // Words are kept where there are any: a table of a million numbers has none.
                if number.is_err() && !value.is_empty() {
                    words.resize(numbers.len(), String::new());
                    words.push(value.to_owned());
                }
                numbers.push(number.unwrap_or(f64::NAN));
            }
        }
        Ok(Self { names, places, numbers, words })
    }

    /// The numbers of a column; what is none is no number.
    pub(super) fn get(&self, name: &str) -> Option<&[f64]> {
        self.places.get(name).map(|&place| self.numbers[place].as_slice())
    }

    /// A word of a column.
    pub(super) fn word(&self, name: &str, row: usize) -> &str {
        let column = self.places.get(name).map(|&place| &self.words[place]);
        column.and_then(|words| words.get(row)).map_or("", String::as_str)
    }

    /// How many lines there are.
    pub(super) fn rows(&self) -> usize {
        self.numbers.first().map_or(0, Vec::len)
    }

    /// The names that begin so, in their order.
    pub(super) fn names_with<'a>(&'a self, start: &'a str) -> impl Iterator<Item = &'a str> {
        self.names.iter().map(String::as_str).filter(move |name| name.starts_with(start))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_by_name() {
        let table = Columns::parse("step, time,phase\n0,0.5,solve\n1,,wait\n2,1.5,7\n3,2").unwrap();
        assert_eq!((table.rows(), table.get("step")), (3, Some(&[0.0, 1.0, 2.0][..])));
        assert!(table.get("time").unwrap()[1].is_nan() && table.get("speed").is_none());
        assert_eq!([0, 1, 2].map(|row| table.word("phase", row)), ["solve", "wait", ""]);
        assert_eq!(table.names_with("t").collect::<Vec<_>>(), ["time"]);
        assert_eq!(Columns::parse("a,b\n1,2\n3\n").unwrap_err(), "line 3 has 1 values and not 2");
        assert!(Columns::parse("").is_err());
    }
}
