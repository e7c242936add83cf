//! Reads one segment, and trusts nothing in it.
//!
//! The Parquet library takes a footer's word for how many columns there are, a page's for its length, and panics on some pages
//! that no writer makes. So the columns are those of [`layout`], whatever the footer says of them; what else it says is
//! checked against itself and the file, and the bytes of a record against their checksum, before any page is looked at; and
//! should a page be forged together with its checksum, the panic is caught.

use super::error::reason;
use super::facts::{Format, RunFacts, parse};
use super::record::Row;
use super::stage::{Stage, StageText};
use super::{RecordingError, layout, steps_of_segment};
use crate::quiet;
use parquet::column::reader::ColumnReaderImpl;
use parquet::data_type::{DataType, DoubleType, FloatType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::{ParquetMetaData, ParquetMetaDataOptions, ParquetMetaDataReader, RowGroupMetaData};
use parquet::file::serialized_reader::SerializedPageReader;
use parquet::schema::types::SchemaDescriptor;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use xxhash_rust::xxh3::Xxh3Default;

/// Values decoded at a time.
const CHUNK: usize = 4096;

/// Where the first record starts: behind the letters that every Parquet file starts with.
const START: u64 = 4;

/// A complete segment.
#[derive(Debug)]
pub(crate) struct Segment {
    path: PathBuf,
    /// The run it is of.
    pub facts: RunFacts,
    /// The kinds and statics of that run, unless the segment is of the first format.
    pub stage: Option<StageText>,
    /// Who wrote it.
    pub rank: u32,
    /// Of so many.
    pub ranks: u32,
    /// Its records, ascending.
    pub records: Vec<RecordEntry>,
    file: Arc<File>,
    metadata: ParquetMetaData,
}

/// A record, as the metadata tells of it.
#[derive(Debug)]
pub(crate) struct RecordEntry {
    /// The step.
    pub step: u64,
    /// Bodies of the rank.
    pub rows: u64,
    /// Its row group, if it has any rows.
    group: usize,
    /// Where that lies in the file.
    bytes: Range<u64>,
    /// Of those bytes.
    checksum: u64,
}

impl Segment {
    /// Reads what a file says about itself, and none of its rows.
    ///
    /// # Errors
    /// If it cannot be read, or is no segment, or a damaged one.
    pub(crate) fn open(path: &Path) -> Result<Self, RecordingError> {
        let bad = |reason| RecordingError::BadSegment { path: path.to_owned(), reason };
        let failed = |error: io::Error| RecordingError::Read { path: path.to_owned(), reason: error.to_string() };
        let file = File::open(path).map_err(failed)?;
        let length = file.metadata().map_err(failed)?.len();
        let metadata = read_metadata(&file).map_err(|error| bad(reason(&error)))?;
        let pairs = metadata.file_metadata().key_value_metadata().map_or(&[][..], Vec::as_slice);
        let text = |name: &str| {
            let pair = pairs.iter().find(|pair| pair.key.strip_prefix("atoll.") == Some(name));
            pair.and_then(|pair| pair.value.as_deref())
        };
        let format = Format::from_texts(text).map_err(bad)?;
        let facts = RunFacts::from_texts(text).map_err(bad)?;
        let stage = match format {
            Format::StatesAlone => None,
            Format::WithStage => Some(StageText::from_texts(text).map_err(bad)?),
        };
        let (rank, ranks) = (parse(text, "rank").map_err(bad)?, parse(text, "ranks").map_err(bad)?);
        let steps: String = parse(text, "steps").map_err(bad)?;
        let records = entries(&steps).ok_or("atoll.steps is unreadable").map_err(|text| bad(text.to_owned()))?;
        let (path, file) = (path.to_owned(), Arc::new(file));
        let mut segment = Self { path, facts, stage, rank, ranks, records, file, metadata };
        segment.check(format, length).map_err(|reason| bad(reason.to_owned()))?;
        Ok(segment)
    }

    /// The kinds and statics, if it has any.
    ///
    /// # Errors
    /// If what it says of them cannot be.
    pub(crate) fn stage(&self) -> Result<Option<Stage>, RecordingError> {
        let bad = |reason| RecordingError::BadSegment { path: self.path.clone(), reason };
        self.stage.as_ref().map(StageText::read).transpose().map_err(bad)
    }

    /// Reads all records, as nothing but that shows whether they are whole.
    ///
    /// # Errors
    /// If one is damaged.
    pub(crate) fn check_records(&self, kinds: usize) -> Result<(), RecordingError> {
        self.records.iter().try_for_each(|record| self.read(record.step, kinds, &mut Vec::new()))
    }

    /// Whether all that the metadata says can be. Finds where the records lie.
    fn check(&mut self, format: Format, length: u64) -> Result<(), &'static str> {
        let (first, last) = self.records.first().zip(self.records.last()).ok_or("it holds no record")?;
        let name = self.path.file_name().and_then(|name| name.to_str());
        if name.and_then(steps_of_segment) != Some((first.step, last.step)) {
            return Err("it holds other steps than its name says");
        }
        if self.rank >= self.ranks {
            return Err("its rank is none of the run's");
        }
        if !self.records.is_sorted_by(|a, b| a.step < b.step) {
            return Err("its steps do not ascend");
        }
        if self.records.iter().any(|record| record.step % self.facts.record_every != 0) {
            return Err("it holds a step that was not to be recorded");
        }
        let groups = self.metadata.row_groups();
        let rows = self.records.iter().map(|record| record.rows).filter(|rows| *rows > 0);
        if !rows.eq(groups.iter().map(|group| group.num_rows().cast_unsigned())) {
            return Err("it holds other row groups than it says");
        }
        let columns = layout::schema(format).get_fields().len();
        if groups.iter().any(|group| group.num_columns() != columns) {
            return Err("it has other columns than its format");
        }
        let mut at = START;
        for (group, record) in groups.iter().zip(self.records.iter_mut().filter(|record| record.rows > 0)) {
            let range = range(group, at).filter(|range| range.end <= length);
            let range = range.ok_or("its columns do not lie as written")?;
            // However alike its bodies are, a row takes at least 1.5 bytes: no small file can ask for much memory.
            if record.rows > range.end - range.start {
                return Err("it has more rows than they have bytes");
            }
            at = range.end;
            record.bytes = range;
        }
        Ok(())
    }

    /// Appends the rows of a record to `rows`. Bodies are of one of so many kinds, unless the first format leaves that open.
    pub(super) fn read(&self, step: u64, kinds: usize, rows: &mut Vec<Row>) -> Result<(), RecordingError> {
        let bad = |reason| RecordingError::BadSegment { path: self.path.clone(), reason };
        let record = self.records.iter().find(|record| record.step == step);
        let record = record.ok_or_else(|| bad(format!("it no longer holds step {step}")))?;
        if record.rows == 0 {
            return Ok(());
        }
        let checksum = self.checksum(record);
        let checksum =
            checksum.map_err(|error| RecordingError::Read { path: self.path.clone(), reason: error.to_string() })?;
        if checksum != record.checksum {
            return Err(bad(format!("the bytes of step {step} are not those that were written")));
        }
        // Rows that are half filled are of no use to anybody, nor are they looked at.
        match quiet::catch(|| self.decode(record, kinds, rows)) {
            Ok(decoded) => decoded.map_err(|error| bad(format!("step {step}: {}", reason(&error)))),
            Err(_) => Err(bad(format!("step {step} cannot be decoded"))),
        }
    }

    /// Of the bytes of a record.
    fn checksum(&self, record: &RecordEntry) -> io::Result<u64> {
        let Range { start, end } = record.bytes;
        let mut file = self.file.as_ref();
        file.seek(SeekFrom::Start(start))?;
        let mut bytes = file.take(end - start);
        let mut hash = Xxh3Default::new();
        let mut buffer = vec![0; 1 << 16];
        loop {
            match bytes.read(&mut buffer)? {
                0 => return Ok(hash.digest()),
                read => hash.update(&buffer[..read]),
            }
        }
    }

    fn decode(&self, record: &RecordEntry, kinds: usize, rows: &mut Vec<Row>) -> Result<(), ParquetError> {
        let mut alike = true;
        self.column::<Int32Type>(record, 0, |_, steps| {
            alike &= steps.iter().all(|step| u64::from(step.cast_unsigned()) == record.step);
        })?;
        if !alike {
            return Err(ParquetError::General("its rows are of another step".to_owned()));
        }
        let first = rows.len();
        // Made one by one as ids are read, so that no count is trusted further than there are ids.
        self.column::<Int64Type>(record, 1, |_, ids| {
            rows.extend(ids.iter().map(|&id| Row { id: id.cast_unsigned(), ..Row::default() }));
        })?;
        let rows = &mut rows[first..];
        self.fill::<DoubleType>(record, 2, rows, |row, x| row.x = x)?;
        self.fill::<DoubleType>(record, 3, rows, |row, y| row.y = y)?;
        self.fill::<FloatType>(record, 4, rows, |row, angle| row.angle = angle)?;
        self.fill::<FloatType>(record, 5, rows, |row, vx| row.vx = vx)?;
        self.fill::<FloatType>(record, 6, rows, |row, vy| row.vy = vy)?;
        self.fill::<FloatType>(record, 7, rows, |row, omega| row.omega = omega)?;
        if self.stage.is_none() {
            return Ok(());
        }
        self.fill::<Int32Type>(record, 8, rows, |row, kind| row.kind = kind.cast_unsigned())?;
        match rows.iter().find(|row| row.kind as usize >= kinds) {
            Some(Row { id, kind, .. }) => {
                Err(ParquetError::General(format!("body {id} is of kind {kind}, and there are {kinds}")))
            }
            None => Ok(()),
        }
    }

    /// Gives each row its value of a column.
    fn fill<T: DataType<T: Copy>>(
        &self,
        record: &RecordEntry,
        column: usize,
        rows: &mut [Row],
        set: impl Fn(&mut Row, T::T),
    ) -> Result<(), ParquetError> {
        self.column::<T>(record, column, |first, values| {
            rows[first..].iter_mut().zip(values).for_each(|(row, &value)| set(row, value));
        })
    }

    /// Hands out all values of a column, a part at a time, with the number of the first.
    fn column<T: DataType>(
        &self,
        record: &RecordEntry,
        column: usize,
        mut take: impl FnMut(usize, &[T::T]),
    ) -> Result<(), ParquetError> {
        let (column, rows) = (self.metadata.row_group(record.group).column(column), record.rows as usize);
        let pages = SerializedPageReader::new(self.file.clone(), column, rows, None)?;
        let mut reader = ColumnReaderImpl::<T>::new(column.column_descr_ptr(), Box::new(pages));
        let mut values = Vec::with_capacity(CHUNK);
        let mut first = 0;
        while first < rows {
            values.clear();
            reader.read_records(CHUNK.min(rows - first), None, None, &mut values)?;
            if values.is_empty() {
                let name = column.column_path();
                return Err(ParquetError::General(format!("column {name} ends after {first} of {rows} rows")));
            }
            take(first, &values);
            first += values.len();
        }
        Ok(())
    }
}

/// What the footer of a file says, whose columns are those of one format or the other: which one, only the footer tells.
fn read_metadata(file: &File) -> Result<ParquetMetaData, ParquetError> {
    let read = |format| {
        let columns = Arc::new(SchemaDescriptor::new(layout::schema(format)));
        let options = ParquetMetaDataOptions::new().with_schema(columns);
        ParquetMetaDataReader::new().with_metadata_options(Some(options)).parse_and_finish(file)
    };
    read(Format::WithStage).or_else(|error| read(Format::StatesAlone).map_err(|_| error))
}

/// The records, as a text: step, rows and checksum of each.
fn entries(text: &str) -> Option<Vec<RecordEntry>> {
    let mut group = 0;
    let entries = text.split(' ').map(|entry| {
        let mut parts = entry.split(':');
        let step: u32 = parts.next()?.parse().ok()?;
        let rows = parts.next()?.parse().ok()?;
        let checksum = u64::from_str_radix(parts.next()?, 16).ok()?;
        let entry = RecordEntry { step: step.into(), rows, group, bytes: START..START, checksum };
        group += usize::from(rows > 0);
        parts.next().is_none().then_some(entry)
    });
    entries.collect()
}

/// The bytes of a row group that starts at `start`, if its columns lie there as the writer puts them.
fn range(group: &RowGroupMetaData, start: u64) -> Option<Range<u64>> {
    let mut at = start;
    for column in group.columns() {
        let first = column.dictionary_page_offset().unwrap_or(column.data_page_offset());
        let alike = column.num_values() == group.num_rows()
            && column.compression() == layout::compression(column.column_path());
        if u64::try_from(first).ok()? != at || !alike {
            return None;
        }
        at = at.checked_add(u64::try_from(column.compressed_size()).ok()?)?;
    }
    Some(start..at)
}
