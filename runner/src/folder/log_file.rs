//! Figures over time as a file: a header, then a row for each of some steps, ascending, as CSV. Rows are only ever added, each
//! with one write, so whoever is killed leaves whole rows, or but the last torn.

use super::durable::sync_folder_of;
use crate::wording::OneLine;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A file that is no log, or not one to go on with.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
pub enum LogError {
    /// The system refused to read.
    #[error("cannot read {}: {reason}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// Its columns are others.
    #[error("{} is no log, or one of another version: it begins with {}", .path.display(), OneLine(.found))]
    Header {
        /// The file.
        path: PathBuf,
        /// The beginning of its first line.
        found: String,
    },
    /// A row cannot be understood.
    #[error("{} is damaged: line {line} is no row of this log", .path.display())]
    Row {
        /// The file.
        path: PathBuf,
        /// Counted from 1.
        line: u64,
    },
}

/// The whole rows of a log up to some step.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(crate) struct Rows {
    /// How many.
    pub(crate) count: u64,
    /// The steps of the first and the last.
    pub(crate) steps: Option<(u64, u64)>,
    /// Where they end in the file.
    end: u64,
}

impl Rows {
    /// Finds those up to the step `until` in a file that has these columns, or any if none are given. What comes after is not
    /// looked at, nor a last line that is torn. None if there is no such file, or not even a header in it.
    ///
    /// # Errors
    /// If it cannot be read, has other columns, or another line is no row.
    pub(crate) fn find(path: &Path, columns: Option<&str>, until: Option<u64>) -> Result<Option<Self>, LogError> {
        let failed = |error: io::Error| LogError::Read { path: path.to_owned(), reason: error.to_string() };
        let file = match File::open(path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            file => file.map_err(failed)?,
        };
        let mut lines = Lines { from: BufReader::new(file), line: Vec::new(), number: 0 };
        let header = lines.next(columns.map_or(LONGEST, |columns| columns.len() as u64 + 1)).map_err(failed)?;
        let header = header.map(|line| String::from_utf8_lossy(line).into_owned());
        let found = header.as_deref().unwrap_or_default();
        let torn = |columns: &str| !found.ends_with('\n') && columns.starts_with(found);
        if found.is_empty() || columns.is_some_and(torn) {
            return Ok(None);
        }
        let columns = columns.unwrap_or(found.trim_end_matches('\n'));
        if found.strip_suffix('\n') != Some(columns) || !columns.starts_with("step,") {
            let found = found.chars().take(60).collect();
            return Err(LogError::Header { path: path.to_owned(), found });
        }
        let mut rows = Self { end: found.len() as u64, ..Self::default() };
        let fields = columns.split(',').count();
        while let Some(line) = lines.next(LONGEST).map_err(failed)? {
            let Some(text) = line.strip_suffix(b"\n") else { break };
            let end = rows.end + line.len() as u64;
            let after = rows.steps.map(|(_, last)| last);
            let Some(step) = step_of(text, fields).filter(|&step| after.is_none_or(|after| step > after)) else {
                return Err(LogError::Row { path: path.to_owned(), line: lines.number });
            };
            if until.is_some_and(|until| step > until) {
                break;
            }
            let first = rows.steps.map_or(step, |(first, _)| first);
            rows = Self { count: rows.count + 1, steps: Some((first, step)), end };
            // What follows is made anew, whatever it is.
            if until == Some(step) {
                break;
            }
        }
        Ok(Some(rows))
    }
}

/// No line of a log comes near to it.
const LONGEST: u64 = 1 << 16;

/// The lines of a file, each with its end.
struct Lines {
    from: BufReader<File>,
    line: Vec<u8>,
    number: u64,
}

impl Lines {
    /// The next one, or so much of it; none at the end.
    fn next(&mut self, most: u64) -> io::Result<Option<&[u8]>> {
        self.line.clear();
        self.number += 1;
        let length = self.from.by_ref().take(most).read_until(b'\n', &mut self.line)?;
        Ok((length > 0).then_some(&self.line))
    }
}

/// The step of a row, if it is one of so many fields.
fn step_of(row: &[u8], fields: usize) -> Option<u64> {
    let mut found = str::from_utf8(row).ok()?.split(',');
    let step = found.next()?.parse().ok()?;
    let mut numbers = 1;
    for field in found {
        field.parse::<f64>().ok()?;
        numbers += 1;
    }
    (numbers == fields).then_some(step)
}

/// A log that is written to.
#[derive(Debug)]
pub(crate) struct LogFile {
    path: PathBuf,
    file: File,
    /// Where the last whole row ends; nothing for a device or a pipe.
    end: Option<u64>,
}

impl LogFile {
    /// Whether there is a device or a pipe of that name: written to as it is, never read, cut or replaced.
    pub(crate) fn is_special(path: &Path) -> bool {
        fs::metadata(path).is_ok_and(|data| !data.is_file())
    }

    /// Begins a log of these columns, whatever was there.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn begin(path: &Path, columns: &str) -> io::Result<Self> {
        let file = File::create(path)?;
        let end = (!Self::is_special(path)).then_some(0);
        let mut log = Self { path: path.to_owned(), file, end };
        log.add(columns)?;
        if log.end.is_some() {
            sync_folder_of(path)?;
        }
        Ok(log)
    }

    /// Goes on with a log after these of its rows; all others are cut off.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn go_on(path: &Path, after: &Rows) -> io::Result<Self> {
        let mut file = File::options().write(true).open(path)?;
        file.set_len(after.end)?;
        file.seek(SeekFrom::End(0))?;
        Ok(Self { path: path.to_owned(), file, end: Some(after.end) })
    }

    /// Adds a line. What cannot be written whole is taken out again.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn add(&mut self, line: &str) -> io::Result<()> {
        let line = format!("{line}\n");
        let written = self.file.write_all(line.as_bytes());
        match (&mut self.end, &written) {
            (Some(end), Ok(())) => *end += line.len() as u64,
            // It may well be that this fails too; a torn line is known by its end.
            (Some(end), Err(_)) => drop(self.file.set_len(*end)),
            (None, _) => {}
        }
        written
    }

    /// Where it lies.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// What to make durable, by whoever does that; nothing for a device or a pipe.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn to_sync(&self) -> io::Result<Option<File>> {
        self.end.map(|_| self.file.try_clone()).transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tempfile::tempdir;

    const COLUMNS: &str = "step,time,energy";

    /// What a log that holds this has up to a step, and what of it is left when it goes on.
    fn found(text: &[u8], until: Option<u64>) -> Result<Option<(u64, String)>, String> {
        let folder = tempdir().unwrap();
        let path = folder.path().join("log.csv");
        fs::write(&path, text).unwrap();
        let rows = Rows::find(&path, Some(COLUMNS), until).map_err(|error| error.to_string())?;
        let Some(rows) = rows else { return Ok(None) };
        LogFile::go_on(&path, &rows).unwrap().add("77,0,0").unwrap();
        let text = fs::read_to_string(&path).unwrap();
        Ok(Some((rows.count, text.strip_suffix("77,0,0\n").unwrap().to_owned())))
    }

    #[test]
    fn rows_after_a_step_are_cut_off_and_so_is_what_is_torn() {
        let whole = "step,time,energy\n0,0.0,1.5\n10,0.5,-2e300\n20,1.0,NaN\n";
        let until = |count: usize| whole.split_inclusive('\n').take(count).collect::<String>();
        let ok = |rows: u64| Ok(Some((rows, until(rows as usize + 1))));
        assert_eq!(found(whole.as_bytes(), None), ok(3));
        for (step, rows) in [(0, 1), (9, 1), (10, 2), (19, 2), (20, 3), (99, 3)] {
            assert_eq!(found(whole.as_bytes(), Some(step)), ok(rows), "{step}");
        }
        // Killed at any moment, it is left whole up to some row; or there is nothing to go on with.
        for length in 0..whole.len() {
            let rows = whole[..length].matches('\n').count().checked_sub(1);
            let expected = rows.map_or(Ok(None), |rows| ok(rows as u64));
            assert_eq!(found(&whole.as_bytes()[..length], Some(99)), expected, "{length}");
        }
        // What comes after the step is nobody's business any more.
        let harmed = [until(3).as_bytes(), b"\0\0\0\n20,\xff\n"].concat();
        assert_eq!(found(&harmed, Some(10)), ok(2));
        assert_eq!(found(&harmed, Some(11)).unwrap_err().split(": ").last(), Some("line 4 is no row of this log"));
    }

    #[test]
    fn what_is_no_log_is_refused() {
        for (text, expected) in [
            ("thesis\n", "it begins with thesis"),
            ("step,time\n0,0\n", "it begins with step,time"),
            ("step,time,energy,more\n", "it begins with step,time,energy,"),
            ("step,time,energy\r\n0,0,0\r\n", "it begins with step,time,energy"),
            ("step,time,energy\n0,0\n", "line 2 is no row"),
            ("step,time,energy\n0,0,0\n5,0,0\n5,0,0\n", "line 4 is no row"),
            ("step,time,energy\n-1,0,0\n", "line 2 is no row"),
            ("step,time,energy\n0,0,zero\n", "line 2 is no row"),
            ("step,time,energy\n\n", "line 2 is no row"),
        ] {
            let error = found(text.as_bytes(), Some(9)).unwrap_err();
            assert!(error.contains(expected) && !error.contains('\n'), "{text:?}: {error}");
        }
        let folder = tempdir().unwrap();
        assert_eq!(Rows::find(&folder.path().join("none"), Some(COLUMNS), None), Ok(None));
        assert!(matches!(Rows::find(folder.path(), Some(COLUMNS), None), Err(LogError::Read { .. })));
    }

    #[test]
    fn a_log_begins_over_whatever_was_there() {
        let folder = tempdir().unwrap();
        let path = folder.path().join("log.csv");
        fs::write(&path, "what was there before, and is longer").unwrap();
        let mut log = LogFile::begin(&path, COLUMNS).unwrap();
        log.add("0,0.0,1.5").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "step,time,energy\n0,0.0,1.5\n");
        let rows = Rows::find(&path, None, None).unwrap().unwrap();
        assert_eq!((rows.count, rows.steps), (1, Some((0, 0))));
    }
}
