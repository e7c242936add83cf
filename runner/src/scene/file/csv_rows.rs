//! Bodies of a CSV file, read one after the other.

use super::super::{Place, SceneError};
use super::row::{Column, Header, Scenery, Values};
use atoll_core::Body;
use csv::{ByteRecord, ErrorKind, Reader, ReaderBuilder, Trim};
use std::fs::File;
use std::path::Path;
use std::str;

/// A file, as far as it is read. It can be read on after a row that cannot be.
pub(super) struct CsvRows<'a> {
    scenery: Scenery<'a>,
    header: Header,
    reader: Reader<File>,
    record: ByteRecord,
    row: u64,
    failed: bool,
}

/// Opens a file and reads its header.
fn open(path: &Path) -> Result<(Reader<File>, Header), SceneError> {
    let file = File::open(path).map_err(|error| SceneError::read(path, "these bodies", error))?;
    let mut reader = ReaderBuilder::new().trim(Trim::All).buffer_capacity(1 << 18).from_reader(file);
    let first = || Place { line: Some(1), ..Place::default() };
    let names = match reader.byte_headers() {
        Ok(names) => names,
        Err(error) => return Err(failure(path, None, &error)),
    };
    if names.iter().all(<[u8]>::is_empty) {
        let reason = "the file is empty: its first line must name the columns, such as x,y";
        return Err(SceneError::bad(path, first(), reason));
    }
    let mut texts = Vec::with_capacity(names.len());
    for name in names {
        let text = str::from_utf8(name);
        texts.push(text.map_err(|_| {
            SceneError::bad(path, first(), "the names of columns are not UTF-8; save the file as that")
        })?);
    }
    let header = Header::new(texts.into_iter()).map_err(|(name, reason)| {
        SceneError::bad(path, Place { name: name.map(|name| format!("column {name}")), ..first() }, reason)
    })?;
    Ok((reader, header))
}

impl<'a> CsvRows<'a> {
    /// From the first row on.
    ///
    /// # Errors
    /// If it cannot be read, or its header cannot be.
    pub(super) fn open(scenery: Scenery<'a>) -> Result<Self, SceneError> {
        let (reader, header) = open(scenery.file)?;
        Ok(Self { scenery, header, reader, record: ByteRecord::new(), row: 0, failed: false })
    }

    /// Whether a file has that column.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub(super) fn has(path: &Path, column: Column) -> Result<bool, SceneError> {
        Ok(open(path)?.1.has(column))
    }

    /// The body of the record that was read.
    fn body(&self) -> Result<Body, SceneError> {
        let position = |text: &str| text.parse().ok().filter(|at: &f64| at.is_finite());
        let values = Values {
            id: self.value(Column::Id, self.row, |text| text.parse().ok())?,
            kind: self.value(Column::Kind, 0, |text| self.scenery.kind(text))?,
            x: self.value(Column::X, 0.0, position)?,
            y: self.value(Column::Y, 0.0, position)?,
            angle: self.float(Column::Angle)?,
            cos: self.float(Column::Cos)?,
            sin: self.float(Column::Sin)?,
            vx: self.float(Column::Vx)?,
            vy: self.float(Column::Vy)?,
            omega: self.float(Column::Omega)?,
        };
        self.scenery.body(self.row, self.line(), self.header.has(Column::Cos), &values)
    }

    fn float(&self, column: Column) -> Result<f32, SceneError> {
        self.value(column, 0.0, |text| text.parse().ok().filter(|number: &f32| number.is_finite()))
    }

    /// What stands in a column of this row; `usual` if there is no such column.
    fn value<T>(&self, column: Column, usual: T, read: impl FnOnce(&str) -> Option<T>) -> Result<T, SceneError> {
        let Some(bytes) = self.header.places[column as usize].and_then(|place| self.record.get(place)) else {
            return Ok(usual);
        };
        str::from_utf8(bytes).ok().and_then(read).ok_or_else(|| {
            let (text, must) = (String::from_utf8_lossy(bytes), format!("must be {}", column.must()));
            self.scenery.refuse(self.row, self.line(), column, &text, &must)
        })
    }

    fn line(&self) -> Option<u64> {
        self.record.position().map(csv::Position::line)
    }
}

impl Iterator for CsvRows<'_> {
    type Item = Result<Body, SceneError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
            return None;
        }
        let read = match self.reader.read_byte_record(&mut self.record) {
            Ok(true) => self.body(),
            Ok(false) => return None,
            Err(error) => {
                self.failed = error.is_io_error();
                Err(failure(self.scenery.file, Some(self.row + 1), &error))
            }
        };
        self.row += 1;
        Some(read)
    }
}

/// What the reader of CSV says.
fn failure(path: &Path, row: Option<u64>, error: &csv::Error) -> SceneError {
    let line = error.position().map(csv::Position::line);
    let place = Place { line, row, name: None };
    match error.kind() {
        ErrorKind::UnequalLengths { expected_len, len, .. } => {
            let reason = format!(
                "{len} values where the first line names {expected_len} columns; mend the row, or a quotation mark before it \
                 that nothing closes"
            );
            SceneError::bad(path, place, reason)
        }
        ErrorKind::Io(error) => SceneError::read(path, "these bodies", error),
        _ => SceneError::bad(path, place, error.to_string()),
    }
}
