//! Bodies of a Parquet file, a few thousand at a time, of those groups of rows that are wanted.

use super::super::SceneError;
use super::parquet_file::{ParquetFile, is_unsigned};
use super::row::{Column, Scenery, Values};
use crate::quiet;
use atoll_core::{Body, GlobalId, KindId};
use glam::DVec2;
use parquet::column::page::PageReader;
use parquet::column::reader::ColumnReaderImpl;
use parquet::data_type::{DataType, DoubleType, FloatType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::serialized_reader::SerializedPageReader;
use std::fs::File;
use std::sync::Arc;
use std::vec;

/// Rows decoded at a time.
const CHUNK: usize = 4096;

/// The rows of some groups. They can be read on after a row that cannot be.
pub(super) struct ParquetRows<'a> {
    parquet: &'a ParquetFile,
    wanted: Wanted<'a>,
    file: Arc<File>,
    /// Groups that are wanted and not begun, and the first row of each.
    groups: vec::IntoIter<(usize, u64)>,
    open: Option<OpenGroup>,
    ready: vec::IntoIter<Result<Body, SceneError>>,
    failed: bool,
}

/// What of its rows.
pub(super) enum Wanted<'a> {
    /// All, and what bodies are checked against.
    Bodies(Scenery<'a>),
    /// These columns, of bodies at rest.
    Columns(&'static [Column]),
}

/// A group of which some rows are read.
struct OpenGroup {
    columns: Vec<(Column, Values64)>,
    /// The next row, and how many are left.
    next: u64,
    left: u64,
}

impl<'a> ParquetRows<'a> {
    /// The rows of those groups whose bodies may be in a rectangle that `meets` says yes to.
    ///
    /// # Errors
    /// If the file cannot be opened any more.
    pub(super) fn open(
        parquet: &'a ParquetFile,
        wanted: Wanted<'a>,
        meets: impl Fn(DVec2, DVec2) -> bool,
    ) -> Result<Self, SceneError> {
        // Its own, as those who share an open file share a place in it.
        let file = File::open(&parquet.path).map_err(|error| SceneError::read(&parquet.path, "these bodies", error))?;
        let groups =
            parquet.groups().filter(|(.., group)| parquet.extent(group).is_none_or(|(low, high)| meets(low, high)));
        let groups: Vec<(usize, u64)> = groups.map(|(place, first, _)| (place, first)).collect();
        let (groups, ready) = (groups.into_iter(), Vec::new().into_iter());
        Ok(Self { parquet, wanted, file: Arc::new(file), groups, open: None, ready, failed: false })
    }

    /// Makes the next rows ready; says whether there are any.
    fn advance(&mut self) -> Result<bool, SceneError> {
        while self.open.as_ref().is_none_or(|open| open.left == 0) {
            let Some((group, first)) = self.groups.next() else { return Ok(false) };
            self.open = Some(self.begin(group, first)?);
        }
        let open = self.open.as_mut().expect("one was begun");
        let count = open.left.min(CHUNK as u64) as usize;
        let mut numbers: [Option<Vec<f64>>; Column::ALL.len()] = Default::default();
        let mut wholes: [Option<Vec<u64>>; 2] = Default::default();
        for (column, values) in &mut open.columns {
            let decoded = quiet::catch(|| values.read(count));
            let decoded = decoded
                .unwrap_or_else(|_| Err(ParquetError::General("a page is not as any writer makes it".to_owned())));
            let decoded = decoded.map_err(|error| self.parquet.broken(open.next, *column, &error))?;
            match decoded {
                Decoded::Missing(at) => {
                    let (row, reason) = (open.next + at as u64, format!("must be {}", column.must()));
                    return Err(refuse(self.parquet, row, *column, "nothing", &reason));
                }
                Decoded::Negative(at, value) => {
                    let (row, reason) = (open.next + at as u64, format!("must be {}", column.must()));
                    return Err(refuse(self.parquet, row, *column, &value.to_string(), &reason));
                }
                Decoded::Numbers(read) => numbers[*column as usize] = Some(read),
                Decoded::Wholes(read) => wholes[*column as usize] = Some(read),
            }
        }
        let turned = self.parquet.header.has(Column::Cos);
        let mut bodies = Vec::with_capacity(count);
        for i in 0..count {
            let row = open.next + i as u64;
            let number = |column: Column| numbers[column as usize].as_ref().map_or(0.0, |values| values[i]);
            let whole = |column: Column, usual| wholes[column as usize].as_ref().map_or(usual, |values| values[i]);
            let values = Values {
                id: whole(Column::Id, row),
                kind: whole(Column::Kind, 0),
                x: number(Column::X),
                y: number(Column::Y),
                angle: number(Column::Angle) as f32,
                cos: number(Column::Cos) as f32,
                sin: number(Column::Sin) as f32,
                vx: number(Column::Vx) as f32,
                vy: number(Column::Vy) as f32,
                omega: number(Column::Omega) as f32,
            };
            bodies.push(match &self.wanted {
                Wanted::Bodies(scenery) => scenery.body(row, None, turned, &values),
                Wanted::Columns(_) => {
                    let kind = KindId(u32::try_from(values.kind).unwrap_or(u32::MAX));
                    Ok(Body::at_rest(GlobalId(row), kind, DVec2::new(values.x, values.y)))
                }
            });
        }
        open.next += count as u64;
        open.left -= count as u64;
        self.ready = bodies.into_iter();
        Ok(true)
    }

    fn begin(&self, group: usize, first: u64) -> Result<OpenGroup, SceneError> {
        let metadata = self.parquet.metadata.row_group(group);
        let rows = metadata.num_rows().cast_unsigned();
        let wanted = |column: &Column| match self.wanted {
            Wanted::Bodies(_) => true,
            Wanted::Columns(columns) => columns.contains(column),
        };
        let mut columns = Vec::new();
        for column in Column::ALL.into_iter().filter(wanted) {
            let Some(place) = self.parquet.header.places[column as usize] else { continue };
            let chunk = metadata.column(place);
            let made = quiet::catch(|| SerializedPageReader::new(self.file.clone(), chunk, rows as usize, None));
            let made =
                made.unwrap_or_else(|_| Err(ParquetError::General("its pages do not lie as written".to_owned())));
            let pages = made.map_err(|error| self.parquet.broken(first, column, &error))?;
            columns.push((column, Values64::new(chunk.column_descr_ptr(), Box::new(pages))));
        }
        Ok(OpenGroup { columns, next: first, left: rows })
    }
}

fn refuse(parquet: &ParquetFile, row: u64, column: Column, value: &str, reason: &str) -> SceneError {
    let scenery = Scenery { file: &parquet.path, kinds: &[], names: &[], static_ids: &[] };
    scenery.refuse(row, None, column, value, reason)
}

impl Iterator for ParquetRows<'_> {
    type Item = Result<Body, SceneError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(body) = self.ready.next() {
                return Some(body);
            }
            if self.failed {
                return None;
            }
            match self.advance() {
                Ok(true) => {}
                Ok(false) => return None,
                Err(error) => {
                    self.failed = true;
                    return Some(Err(error));
                }
            }
        }
    }
}

/// Values of a column, whatever their type was.
enum Decoded {
    Numbers(Vec<f64>),
    Wholes(Vec<u64>),
    /// There is none at this place.
    Missing(usize),
    /// At this place there is one below zero.
    Negative(usize, i64),
}

/// A column that gives numbers of 64 bits.
enum Values64 {
    Int32(ColumnReaderImpl<Int32Type>, bool, Levels),
    Int64(ColumnReaderImpl<Int64Type>, bool, Levels),
    Float(ColumnReaderImpl<FloatType>, Levels),
    Double(ColumnReaderImpl<DoubleType>, Levels),
}

/// Whether values may be missing.
type Levels = bool;

impl Values64 {
    fn new(column: parquet::schema::types::ColumnDescPtr, pages: Box<dyn PageReader>) -> Self {
        let (levels, unsigned) = (column.max_def_level() > 0, is_unsigned(&column));
        match column.physical_type() {
            parquet::basic::Type::INT32 => Self::Int32(ColumnReaderImpl::new(column, pages), unsigned, levels),
            parquet::basic::Type::INT64 => Self::Int64(ColumnReaderImpl::new(column, pages), unsigned, levels),
            parquet::basic::Type::FLOAT => Self::Float(ColumnReaderImpl::new(column, pages), levels),
            _ => Self::Double(ColumnReaderImpl::new(column, pages), levels),
        }
    }

    /// The next values, exactly as many.
    fn read(&mut self, count: usize) -> Result<Decoded, ParquetError> {
        let wholes = |values: Vec<i64>| match values.iter().position(|value| *value < 0) {
            Some(at) => Decoded::Negative(at, values[at]),
            None => Decoded::Wholes(values.into_iter().map(i64::cast_unsigned).collect()),
        };
        Ok(match self {
            Self::Int32(reader, unsigned, levels) => match read_exactly(reader, *levels, count)? {
                Ok(values) if *unsigned => {
                    Decoded::Wholes(values.into_iter().map(|value| value.cast_unsigned().into()).collect())
                }
                Ok(values) => wholes(values.into_iter().map(i64::from).collect()),
                Err(at) => Decoded::Missing(at),
            },
            Self::Int64(reader, unsigned, levels) => match read_exactly(reader, *levels, count)? {
                Ok(values) if *unsigned => Decoded::Wholes(values.into_iter().map(i64::cast_unsigned).collect()),
                Ok(values) => wholes(values),
                Err(at) => Decoded::Missing(at),
            },
            Self::Float(reader, levels) => match read_exactly(reader, *levels, count)? {
                Ok(values) => Decoded::Numbers(values.into_iter().map(f64::from).collect()),
                Err(at) => Decoded::Missing(at),
            },
            Self::Double(reader, levels) => match read_exactly(reader, *levels, count)? {
                Ok(values) => Decoded::Numbers(values),
                Err(at) => Decoded::Missing(at),
            },
        })
    }
}

/// The next values of a column, or the place of the first that is missing.
fn read_exactly<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    levels: Levels,
    count: usize,
) -> Result<Result<Vec<T::T>, usize>, ParquetError> {
    let mut values = Vec::with_capacity(count);
    let mut definitions = Vec::new();
    let mut done = 0;
    while done < count {
        let told = levels.then_some(&mut definitions);
        let (records, ..) = reader.read_records(count - done, told, None, &mut values)?;
        if records == 0 {
            return Err(ParquetError::General(format!("it ends {} rows too soon", count - done)));
        }
        done += records;
    }
    match definitions.iter().position(|level| *level == 0) {
        Some(at) => Ok(Err(at)),
        None if values.len() == count => Ok(Ok(values)),
        None => Err(ParquetError::General("it has other values than rows".to_owned())),
    }
}
