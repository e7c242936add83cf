//! A file of its own with rows of bodies, or of places: CSV or Parquet, by what its name ends in.

use super::super::SceneError;
use super::csv_rows::CsvRows;
use super::parquet_file::ParquetFile;
use super::parquet_rows::{ParquetRows, Wanted};
use super::row::{Column, Scenery};
use super::{BodyIter, check_regular};
use std::path::{Path, PathBuf};

#[derive(Debug)]
pub(super) enum TableFile {
    Csv(PathBuf),
    Parquet(Box<ParquetFile>),
}

impl TableFile {
    /// What the path of one must be like.
    pub(super) const MUST_END: &str = "must end in .csv or .parquet, by what the file is";

    /// Looks at a file, `what` as errors call it; if it is one of these.
    ///
    /// # Errors
    /// If it cannot be read, or is not what its name says.
    pub(super) fn open(path: &Path, what: &'static str) -> Result<Option<Self>, SceneError> {
        check_regular(path, what)?;
        let extension = path.extension().and_then(|extension| extension.to_str()).map(str::to_ascii_lowercase);
        Ok(match extension.as_deref() {
            Some("csv") => Some(Self::Csv(path.to_owned())),
            Some("parquet") => Some(Self::Parquet(Box::new(ParquetFile::open(path)?))),
            _ => None,
        })
    }

    /// Whether it has that column.
    ///
    /// # Errors
    /// If its first line cannot be.
    pub(super) fn has(&self, column: Column) -> Result<bool, SceneError> {
        match self {
            Self::Csv(path) => CsvRows::has(path, column),
            Self::Parquet(parquet) => Ok(parquet.header.has(column)),
        }
    }

    /// All rows, in their order.
    ///
    /// # Errors
    /// If it cannot be opened any more.
    pub(super) fn rows<'a>(&'a self, scenery: Scenery<'a>) -> Result<BodyIter<'a>, SceneError> {
        Ok(match self {
            Self::Csv(_) => Box::new(CsvRows::open(scenery)?),
            Self::Parquet(parquet) => Box::new(ParquetRows::open(parquet, Wanted::Bodies(scenery), |_, _| true)?),
        })
    }
}
