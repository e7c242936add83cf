//! What a Parquet file of bodies says about itself: its columns, its groups of rows, and where their bodies are.
//!
//! Whoever wrote it chose its columns' order, their types and whether values may be missing, so all of that is looked at first.

use super::super::{Place, SceneError};
use super::footer;
use super::row::{Column, Header};
use crate::quiet;
use glam::DVec2;
use parquet::basic::{Compression, ConvertedType, LogicalType, Repetition, Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::{ParquetMetaData, ParquetMetaDataReader, RowGroupMetaData};
use parquet::file::statistics::Statistics;
use parquet::schema::types::ColumnDescriptor;
use std::fs::File;
use std::path::{Path, PathBuf};

/// A file of bodies, of which no row is read yet.
#[derive(Debug)]
pub(super) struct ParquetFile {
    pub(super) path: PathBuf,
    pub(super) metadata: ParquetMetaData,
    pub(super) header: Header,
    pub(super) rows: u64,
}

impl ParquetFile {
    /// Reads what the file says about itself.
    ///
    /// # Errors
    /// If it cannot be read, or has columns that no bodies are made of.
    pub(super) fn open(path: &Path) -> Result<Self, SceneError> {
        let file = File::open(path).map_err(|error| SceneError::read(path, "these bodies", error))?;
        let broken = |reason: String| {
            SceneError::whole(path, format!("it is no Parquet file, or a damaged one: {reason}; write it again"))
        };
        footer::check(&file).map_err(|error| broken(error.to_string()))?;
        let metadata = match quiet::catch(|| ParquetMetaDataReader::new().parse_and_finish(&file)) {
            Ok(read) => read.map_err(|error| broken(error.to_string()))?,
            Err(_) => return Err(broken("its footer cannot be decoded".to_owned())),
        };
        let schema = metadata.file_metadata().schema_descr();
        let names = schema.columns().iter().map(|column| column.path().string()).collect::<Vec<_>>();
        let header = Header::new(names.iter().map(String::as_str)).map_err(|(name, reason)| {
            let name = name.map(|name| format!("column {name}"));
            SceneError::bad(path, Place { name, ..Place::default() }, reason)
        })?;
        for column in Column::ALL {
            if let Some(place) = header.places[column as usize] {
                let checked = check_column(column, &schema.column(place));
                checked.map_err(|reason| {
                    let name = Some(format!("column {}", column.name()));
                    SceneError::bad(path, Place { name, ..Place::default() }, reason)
                })?;
            }
        }
        let rows = metadata.row_groups().iter().try_fold(0_u64, |sum, group| {
            if group.num_columns() != header.count {
                return None;
            }
            sum.checked_add(u64::try_from(group.num_rows()).ok()?)
        });
        let rows = rows.ok_or_else(|| broken("its groups of rows are not those of its columns".to_owned()))?;
        for group in metadata.row_groups() {
            for column in group.columns() {
                if !matches!(column.compression(), Compression::UNCOMPRESSED | Compression::SNAPPY) {
                    let name = Some(format!("column {}", column.column_path().string()));
                    let method = column.compression().to_string();
                    // Without its level.
                    let method = method.split('(').next().unwrap_or_default();
                    let reason = format!(
                        "its pages are compressed with {method}, which this program does not read; write it with snappy or none"
                    );
                    return Err(SceneError::bad(path, Place { name, ..Place::default() }, reason));
                }
                if column.num_values() != group.num_rows() {
                    return Err(broken("its columns have other lengths than its groups of rows".to_owned()));
                }
            }
        }
        Ok(Self { path: path.to_owned(), metadata, header, rows })
    }

    /// The groups of rows, each with the number of its first row.
    pub(super) fn groups(&self) -> impl Iterator<Item = (usize, u64, &RowGroupMetaData)> {
        self.metadata.row_groups().iter().enumerate().scan(0, |first, (place, group)| {
            let begin = *first;
            *first += group.num_rows().cast_unsigned();
            Some((place, begin, group))
        })
    }

    /// Low and high corner of where the bodies of a group are, if the file says so.
    pub(super) fn extent(&self, group: &RowGroupMetaData) -> Option<(DVec2, DVec2)> {
        let range = |column: Column| {
            let place = self.header.places[column as usize]?;
            let (low, high) = match group.column(place).statistics()? {
                Statistics::Double(values) => (*values.min_opt()?, *values.max_opt()?),
                Statistics::Float(values) => (f64::from(*values.min_opt()?), f64::from(*values.max_opt()?)),
                _ => return None,
            };
            (low <= high).then_some((low, high))
        };
        let (x, y) = (range(Column::X)?, range(Column::Y)?);
        Some((DVec2::new(x.0, y.0), DVec2::new(x.1, y.1)))
    }

    /// What the library says of a group of rows.
    pub(super) fn broken(&self, first: u64, column: Column, error: &ParquetError) -> SceneError {
        let place = Place { row: Some(first + 1), name: Some(format!("column {}", column.name())), ..Place::default() };
        SceneError::bad(&self.path, place, format!("from here on the file cannot be decoded: {error}; write it again"))
    }
}

/// Whether the numbers of a column go without a sign.
pub(super) fn is_unsigned(column: &ColumnDescriptor) -> bool {
    let told = column
        .logical_type_ref()
        .is_some_and(|logical| matches!(logical, LogicalType::Integer(whole) if !whole.is_signed));
    told || matches!(
        column.converted_type(),
        ConvertedType::UINT_8 | ConvertedType::UINT_16 | ConvertedType::UINT_32 | ConvertedType::UINT_64
    )
}

fn check_column(column: Column, descriptor: &ColumnDescriptor) -> Result<(), String> {
    let given = descriptor.physical_type();
    let whole = matches!(column, Column::Id | Column::Kind);
    let suits = if whole { [Type::INT32, Type::INT64] } else { [Type::FLOAT, Type::DOUBLE] };
    if !suits.contains(&given) {
        return Err(format!("its values are of type {given}; write {} or {}", suits[1], suits[0]));
    }
    let flat =
        descriptor.max_rep_level() == 0 && descriptor.max_def_level() <= 1 && descriptor.path().parts().len() == 1;
    if !flat || descriptor.self_type().get_basic_info().repetition() == Repetition::REPEATED {
        return Err("it is a list or part of another column; write one number for each row".to_owned());
    }
    Ok(())
}
