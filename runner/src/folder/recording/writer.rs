//! Writes the records of one rank.

use super::error::reason;
use super::facts::{Format, RunFacts};
use super::record::Record;
use super::stage::StageText;
use super::{RECORDS_PER_SEGMENT, RecordingError, layout, open_segment_name, segment_name};
use crate::folder::durable::{is_gone, sync_folder, sync_folder_of};
use parquet::column::writer::ColumnWriterImpl;
use parquet::data_type::{DataType, DoubleType, FloatType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterPropertiesPtr;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::TypePtr;
use std::fmt;
use std::fs::{self, File};
use std::io::{self, Write};
use std::mem;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::Xxh3Default;

/// Rows whose steps and angles are made at a time.
const CHUNK: usize = 8192;

/// The folder of one rank, to which records are added in the order of their steps. Whoever drops it without
/// [`close_segment`](Self::close_segment) loses the records of the segment under way, and nothing else.
#[derive(Debug)]
pub struct RecordingWriter {
    folder: PathBuf,
    /// What all of its files say about themselves, but for kinds and statics.
    texts: Vec<(String, String)>,
    schema: TypePtr,
    properties: WriterPropertiesPtr,
    open: Option<OpenSegment>,
    /// First and last steps of the segments that were completed.
    complete: Vec<(u32, u32)>,
    /// Whether there are complete segments whose names are perhaps not on the disk yet.
    named: bool,
}

fn properties(texts: &[(String, String)], stage: &StageText) -> WriterPropertiesPtr {
    let stage = [("atoll.kinds", &stage.kinds), ("atoll.statics", &stage.statics)];
    let all = texts.iter().map(|(key, text)| (key.as_str(), text)).chain(stage);
    layout::properties(all.map(|(key, text)| KeyValue::new(key.to_owned(), text.clone())).collect())
}

impl RecordingWriter {
    /// Creates the folder, or goes on in one that is there.
    ///
    /// # Errors
    /// If the folder cannot be had.
    pub fn new(
        folder: PathBuf,
        rank: u32,
        ranks: u32,
        facts: &RunFacts,
        stage: &StageText,
    ) -> Result<Self, RecordingError> {
        fs::create_dir_all(&folder).map_err(|error| failed(&folder, &error))?;
        let mut texts = facts.to_pairs();
        texts.push(("atoll.rank".to_owned(), rank.to_string()));
        texts.push(("atoll.ranks".to_owned(), ranks.to_string()));
        let (schema, properties) = (layout::schema(Format::WithStage), properties(&texts, stage));
        Ok(Self { folder, texts, schema, properties, open: None, complete: Vec::new(), named: false })
    }

    /// From the next record on there are more kinds: completes the segment under way.
    ///
    /// # Errors
    /// As [`close_segment`](Self::close_segment).
    pub fn set_stage(&mut self, stage: &StageText) -> Result<(), RecordingError> {
        self.close_segment()?;
        self.properties = properties(&self.texts, stage);
        Ok(())
    }

    /// Adds a record, and closes the segment if that is its last.
    ///
    /// # Errors
    /// If it cannot be written. The segment under way is then given up, with all of its records.
    pub fn write(&mut self, record: &Record) -> Result<(), RecordingError> {
        let mut segment = match self.open.take() {
            Some(segment) => segment,
            None => self.begin(record.step)?,
        };
        if let Err(error) = segment.append(record) {
            return Err(segment.give_up(&error));
        }
        let full = segment.records == RECORDS_PER_SEGMENT;
        self.open = Some(segment);
        if full { self.close_segment() } else { Ok(()) }
    }

    /// Completes the segment under way, if there is one, and waits until it is on the disk: some file systems only then
    /// say that it is full.
    ///
    /// # Errors
    /// If it cannot be written. The segment is then given up.
    pub fn close_segment(&mut self) -> Result<(), RecordingError> {
        let Some(mut segment) = self.open.take() else { return Ok(()) };
        let path = self.path(segment.first, segment.last);
        let finished = segment.finish().and_then(|()| Ok(fs::rename(&segment.path, &path)?));
        if let Err(error) = finished {
            return Err(segment.give_up(&error));
        }
        self.complete.push((segment.first, segment.last));
        self.named = true;
        Ok(())
    }

    /// A segment that was completed and is not there any more, if there is one.
    pub(crate) fn gone(&self) -> Option<PathBuf> {
        let paths = self.complete.iter().map(|&(first, last)| self.path(first, last));
        paths.into_iter().find(|path| is_gone(path))
    }

    fn path(&self, first: u32, last: u32) -> PathBuf {
        self.folder.join(segment_name(first.into(), last.into()))
    }

    /// Waits until the names of all complete segments are on the disk as well.
    ///
    /// # Errors
    /// If the system does not say so. They are waited for again the next time.
    pub fn sync(&mut self) -> Result<(), RecordingError> {
        if !self.named {
            return Ok(());
        }
        // Their names are in the folder, and the folder's in the one above.
        sync_folder(&self.folder)
            .and_then(|()| sync_folder_of(&self.folder))
            .map_err(|error| failed(&self.folder, &error))?;
        self.named = false;
        Ok(())
    }

    fn begin(&self, step: u32) -> Result<OpenSegment, RecordingError> {
        let path = self.folder.join(open_segment_name(step.into()));
        let file = File::create(&path).map_err(|error| failed(&path, &error))?;
        let output = Checked { file, hash: Box::default() };
        let segment = |output| SerializedFileWriter::new(output, self.schema.clone(), self.properties.clone());
        match segment(output) {
            Ok(file) => Ok(OpenSegment { file, path, first: step, last: step, records: 0, steps: String::new() }),
            Err(error) => {
                let _ = fs::remove_file(&path);
                Err(RecordingError::Write { path, reason: reason(&error) })
            }
        }
    }
}

/// A segment under way.
struct OpenSegment {
    file: SerializedFileWriter<Checked>,
    path: PathBuf,
    first: u32,
    last: u32,
    records: usize,
    /// Step, rows and checksum of each record.
    steps: String,
}

impl OpenSegment {
    fn append(&mut self, record: &Record) -> Result<(), ParquetError> {
        if !record.is_empty() {
            // What is before the record has its own checksum, or needs none.
            self.checksum()?;
            let mut group = self.file.next_row_group()?;
            write_columns(record, &mut group)?;
            group.close()?;
        }
        let checksum = self.checksum()?;
        let gap = if self.records == 0 { "" } else { " " };
        self.steps += &format!("{gap}{}:{}:{checksum:016x}", record.step, record.len());
        self.last = record.step;
        self.records += 1;
        Ok(())
    }

    /// Of what was written since the last one.
    fn checksum(&mut self) -> Result<u64, ParquetError> {
        self.file.flush()?;
        Ok(mem::take(&mut *self.file.inner_mut().hash).digest())
    }

    fn finish(&mut self) -> Result<(), ParquetError> {
        let steps = mem::take(&mut self.steps);
        self.file.append_key_value_metadata(KeyValue::new("atoll.steps".to_owned(), steps));
        self.file.finish()?;
        Ok(self.file.inner().file.sync_data()?)
    }

    /// Leaves nothing behind.
    fn give_up(self, error: &ParquetError) -> RecordingError {
        let Self { file, path, .. } = self;
        drop(file);
        let _ = fs::remove_file(&path);
        RecordingError::Write { path, reason: reason(error) }
    }
}

impl fmt::Debug for OpenSegment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OpenSegment").field("path", &self.path).field("steps", &self.steps).finish_non_exhaustive()
    }
}

/// A file and the checksum of what went into it.
struct Checked {
    file: File,
    hash: Box<Xxh3Default>,
}

impl Write for Checked {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.hash.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

fn write_columns(record: &Record, group: &mut SerializedRowGroupWriter<'_, Checked>) -> Result<(), ParquetError> {
    // What belongs in 32 or 64 unsigned bits is kept in as many signed ones, as Parquet has it.
    let steps = [record.step.cast_signed(); CHUNK];
    column::<Int32Type>(group, |column| {
        record.rotation.chunks(CHUNK).try_for_each(|rows| write(column, &steps[..rows.len()]))
    })?;
    column::<Int64Type>(group, |column| write(column, bytemuck::cast_slice(&record.id)))?;
    column::<DoubleType>(group, |column| write(column, &record.x))?;
    column::<DoubleType>(group, |column| write(column, &record.y))?;
    let mut angles = Vec::with_capacity(CHUNK);
    column::<FloatType>(group, |column| {
        record.rotation.chunks(CHUNK).try_for_each(|rows| {
            angles.clear();
            angles.extend(rows.iter().map(|rotation| rotation.angle()));
            write(column, &angles)
        })
    })?;
    column::<FloatType>(group, |column| write(column, &record.vx))?;
    column::<FloatType>(group, |column| write(column, &record.vy))?;
    column::<FloatType>(group, |column| write(column, &record.omega))?;
    column::<Int32Type>(group, |column| write(column, bytemuck::cast_slice(&record.kind)))
}

/// Writes the next column.
fn column<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, Checked>,
    write: impl FnOnce(&mut ColumnWriterImpl<'_, T>) -> Result<(), ParquetError>,
) -> Result<(), ParquetError> {
    let mut column = group.next_column()?.expect("as many columns are written as the schema has");
    write(column.typed::<T>())?;
    column.close()
}

fn write<T: DataType>(column: &mut ColumnWriterImpl<'_, T>, values: &[T::T]) -> Result<(), ParquetError> {
    column.write_batch(values, None, None).map(drop)
}

fn failed(path: &Path, error: &io::Error) -> RecordingError {
    RecordingError::Write { path: path.to_owned(), reason: error.to_string() }
}
