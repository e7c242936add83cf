//! Scenes that users write: a file of TOML, `format = "atoll-scene/1"`, and perhaps one with the bodies, as CSV or Parquet.
//!
//! Bodies are read again by whoever needs them, never all kept, unless they stand in the TOML itself. Nothing in any file is
//! trusted. `docs/worlds.md` shows the format.

mod check;
mod csv_rows;
mod description;
mod digest;
mod entries;
mod footer;
mod inline;
mod kinds;
mod lines;
mod parquet_file;
mod parquet_rows;
#[cfg(test)]
mod parquet_tests;
mod row;
#[cfg(test)]
pub(crate) mod shape_tests;
mod statics;
mod table;
#[cfg(test)]
mod tests;
pub(crate) mod write;

pub(crate) use check::Found;
pub(crate) use description::is_scene;
pub(crate) use digest::of_file as digest_of_file;
pub(crate) use kinds::of_command as kind_of_command;
pub(super) use row::is_turn;
pub(crate) use row::{Column, FARTHEST};
pub(super) use statics::chain_of;

use super::{Place, SceneError, large};
use crate::wording::unmarked;
use atoll_core::{Body, GlobalId, Kind, StaticBody};
use csv_rows::CsvRows;
use description::{Bodies, Description};
use glam::DVec2;
use parquet_rows::{ParquetRows, Wanted};
use row::Scenery;
use statics::Statics;
use std::fs::{self, File};
use std::io::Read;
use std::iter;
use std::path::{Path, PathBuf};
use table::TableFile;
use toml::Table;

/// More bodies than this at one and the same place are no scene that can be computed.
pub(crate) const MOST_AT_A_PLACE: usize = 1000;

/// Where a body is, as something to sort by; 0 and -0 are one place.
pub(crate) fn place_of(body: &Body) -> [u64; 2] {
    body.position.to_array().map(|at| (at + 0.0).to_bits())
}

/// The text of a scene may have so many bytes: more bodies belong into a file of their own.
const LONGEST_TEXT: u64 = 64 << 20;

/// The files of a scene, opened and checked but for the rows of a Parquet file, which are checked as they are read.
#[derive(Debug)]
pub struct SceneFile {
    path: PathBuf,
    digest: String,
    description: Description,
    /// With the ids they go by.
    statics: Vec<StaticBody>,
    static_ids: Vec<GlobalId>,
    rows: Rows,
    count: u64,
    /// How many there are of each kind, if they were counted.
    by_kind: Option<Vec<u64>>,
}

/// Where bodies come from.
#[derive(Debug)]
enum Rows {
    Inline(Vec<Body>),
    File(TableFile),
}

/// Bodies as they are read.
pub(crate) type BodyIter<'a> = Box<dyn Iterator<Item = Result<Body, SceneError>> + 'a>;

impl SceneFile {
    /// Opens a scene. Rows of CSV are all looked at, those of Parquet where something must be known of all of them.
    ///
    /// # Errors
    /// If a file cannot be read, or holds what cannot be.
    pub fn open(path: &Path) -> Result<Self, SceneError> {
        let mut faults = Vec::new();
        let begun = Self::begin(path, &mut faults);
        let (mut scene, told) = match faults.into_iter().next() {
            Some(first) => return Err(first),
            None => begun?,
        };
        let last = scene.look_through()?;
        scene.check_count(told)?;
        scene.name_statics(last)?;
        Ok(scene)
    }

    /// Opens a scene without a look at its rows. Gives also how many there are to be, if its text says so. What is wrong with that
    /// are `faults`, after which the rest can be looked at, and nothing more.
    fn begin(path: &Path, faults: &mut Vec<SceneError>) -> Result<(Self, Option<u64>), SceneError> {
        let text = read_text(path)?;
        let mut description = Description::read(path, &text, faults)?;
        let mut told = None;
        let mut static_ids: Vec<GlobalId> = Vec::new();
        let Statics { all: statics, are_named, tables: places } = &description.statics;
        if *are_named {
            static_ids = statics.iter().map(|fixed| fixed.id).collect();
            static_ids.sort_unstable();
        }
        let scenery =
            Scenery { file: path, kinds: &description.kinds, names: &description.names, static_ids: &static_ids };
        let (rows, digest) = match &description.bodies {
            Bodies::Inline(tables) => {
                let bodies = inline::read(path, tables, &scenery, faults);
                (Rows::Inline(bodies), digest::of_scene(&text, places, None)?)
            }
            Bodies::File { path: bodies, xxh3, count } => {
                let file = path.parent().unwrap_or(Path::new("")).join(bodies);
                told = *count;
                check_regular(&file, "these bodies")?;
                let digest = digest::of_scene(&text, places, Some((&file, xxh3.as_deref())))?;
                let table = TableFile::open(&file, "these bodies")?.ok_or_else(|| {
                    let place = Place { name: Some(format!("[bodies], path = {bodies:?}")), ..Place::default() };
                    SceneError::bad(path, place, TableFile::MUST_END)
                })?;
                (Rows::File(table), digest)
            }
        };
        // Those that all are asked of from now on; of their names there is more to come.
        let statics = std::mem::take(&mut description.statics.all);
        Ok((
            Self { path: path.to_owned(), digest, description, statics, static_ids, rows, count: 0, by_kind: None },
            told,
        ))
    }

    /// Compares the rows there are with what the text says.
    fn check_count(&self, told: Option<u64>) -> Result<(), SceneError> {
        let Some(told) = told.filter(|told| *told != self.count) else { return Ok(()) };
        let place = Place { name: Some(format!("[bodies], count = {told}")), ..Place::default() };
        let reason = format!("the file has {} rows; bring back the one that was meant, or mend the count", self.count);
        Err(SceneError::bad(&self.path, place, reason))
    }

    /// Counts the bodies, and where kinds differ much in size how many there are of each. Gives the greatest of their ids, if there are
    /// any and statics are to be called by it.
    fn look_through(&mut self) -> Result<Option<u64>, SceneError> {
        let wants_last = !self.statics.is_empty() && !self.description.statics.are_named;
        let (count, last) = match &self.rows {
            Rows::File(TableFile::Parquet(parquet)) if !wants_last => (parquet.rows, None),
            Rows::File(TableFile::Parquet(parquet)) if !parquet.header.has(Column::Id) => {
                (parquet.rows, parquet.rows.checked_sub(1))
            }
            _ => {
                let (mut count, mut last, mut by_kind) = (0, None, vec![0; self.kinds().len()]);
                for body in self.iter() {
                    let body = body?;
                    count += 1;
                    by_kind[body.kind.0 as usize] += 1;
                    last = last.max(Some(body.id.0));
                }
                self.by_kind = Some(by_kind);
                (count, last)
            }
        };
        self.count = count;
        if self.by_kind.is_none()
            && large::may_be(self.kinds())
            && let Rows::File(TableFile::Parquet(parquet)) = &self.rows
        {
            let mut by_kind = vec![0; self.kinds().len()];
            for body in ParquetRows::open(parquet, Wanted::Columns(&[Column::Kind]), |_, _| true)? {
                // What is of no kind is told of when its row is read.
                by_kind.get_mut(body?.kind.0 as usize).into_iter().for_each(|count| *count += 1);
            }
            self.by_kind = Some(by_kind);
        }
        Ok(last)
    }

    /// How many of its bodies there are of each kind, if that was counted.
    pub(super) fn by_kind(&self) -> Option<&[u64]> {
        self.by_kind.as_deref()
    }

    /// Statics without ids of their own get those above all bodies.
    fn name_statics(&mut self, last: Option<u64>) -> Result<(), SceneError> {
        if self.description.statics.are_named || self.statics.is_empty() {
            return Ok(());
        }
        let first = last.map_or(Some(0), |last| last.checked_add(1));
        let end = first.and_then(|first| first.checked_add(self.statics.len() as u64));
        let Some((first, _)) = first.zip(end) else {
            let reason = "there are no ids left above those of the bodies; give statics ids of their own";
            return Err(SceneError::bad(
                &self.path,
                Place { name: Some("[[statics]]".to_owned()), ..Place::default() },
                reason,
            ));
        };
        for (id, fixed) in (first..).zip(&mut self.statics) {
            fixed.id = GlobalId(id);
        }
        self.static_ids = self.statics.iter().map(|fixed| fixed.id).collect();
        Ok(())
    }

    /// Where its text is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file with the bodies, if they have one of their own.
    pub fn bodies_path(&self) -> Option<&Path> {
        match &self.rows {
            Rows::Inline(_) => None,
            Rows::File(TableFile::Csv(path)) => Some(path),
            Rows::File(TableFile::Parquet(parquet)) => Some(&parquet.path),
        }
    }

    /// The files that it is read from: its text, and the tables that this names.
    pub(crate) fn paths(&self) -> impl Iterator<Item = &Path> {
        let tables = self.description.statics.tables.iter().map(PathBuf::as_path);
        iter::once(self.path()).chain(self.bodies_path()).chain(tables)
    }

    /// What it is called.
    pub fn name(&self) -> Option<&str> {
        self.description.name.as_deref()
    }

    /// What tells its content from that of others, as 32 hexadecimal digits: the same wherever it lies.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// How many dynamic bodies there are.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// What it says of the physics, as a configuration would.
    pub(crate) fn physics(&self) -> &Table {
        &self.description.physics
    }

    pub(crate) fn kinds(&self) -> &[Kind] {
        &self.description.kinds
    }

    /// What its kinds are called.
    pub(crate) fn kind_names(&self) -> &[Option<String>] {
        &self.description.names
    }

    pub(crate) fn statics(&self) -> &[StaticBody] {
        &self.statics
    }

    pub(crate) fn domain(&self) -> (DVec2, DVec2) {
        self.description.domain
    }

    fn scenery<'a>(&'a self, file: &'a Path) -> Scenery<'a> {
        let Description { kinds, names, .. } = &self.description;
        Scenery { file, kinds, names, static_ids: &self.static_ids }
    }

    /// All bodies, in the order of the file.
    pub(super) fn iter(&self) -> BodyIter<'_> {
        self.near(|_, _| true)
    }

    /// The bodies in any place that `meets` says yes to, in the order of the file.
    pub(super) fn near<'a>(&'a self, meets: impl Fn(DVec2, DVec2) -> bool + 'a) -> BodyIter<'a> {
        let all: BodyIter<'a> = match &self.rows {
            Rows::Inline(bodies) => Box::new(bodies.iter().copied().map(Ok)),
            Rows::File(TableFile::Csv(path)) => or_error(CsvRows::open(self.scenery(path))),
            Rows::File(TableFile::Parquet(parquet)) => {
                or_error(ParquetRows::open(parquet, Wanted::Bodies(self.scenery(&parquet.path)), &meets))
            }
        };
        let is_near = move |body: &Result<Body, SceneError>| {
            body.as_ref().map_or(true, |body| meets(body.position, body.position))
        };
        Box::new(all.filter(is_near))
    }

    /// Where all bodies are.
    pub(super) fn places(&self) -> Box<dyn Iterator<Item = Result<DVec2, SceneError>> + '_> {
        let all = match &self.rows {
            Rows::File(TableFile::Parquet(parquet)) => {
                or_error(ParquetRows::open(parquet, Wanted::Columns(&[Column::X, Column::Y]), |_, _| true))
            }
            _ => self.iter(),
        };
        Box::new(all.map(|body| body.map(|body| body.position)))
    }

    /// That two bodies have this id, with the rows they stand in.
    pub(super) fn doubled(&self, id: GlobalId) -> SceneError {
        let rows =
            (1_u64..).zip(self.iter()).filter_map(|(row, body)| body.is_ok_and(|body| body.id == id).then_some(row));
        let rows: Vec<u64> = rows.take(2).collect();
        let place = Place { row: rows.get(1).copied(), name: Some(format!("id = {id}")), ..Place::default() };
        let told = |first: Option<String>, all: &str| {
            let first = first.unwrap_or("another body".to_owned());
            format!("{first} has this id as well; give each its own, or leave {all} out")
        };
        let first = rows.first();
        match self.bodies_path() {
            Some(path) => {
                let first = first.map(|row| format!("the body of row {row}"));
                SceneError::bad(path, place, told(first, "the column id"))
            }
            None => {
                let first = first.map(|row| format!("[[body]] {}", row - 1));
                SceneError::bad(&self.path, place, told(first, "all ids")).of_table()
            }
        }
    }

    /// That far too many of some bodies are at one place, if they are. The places are sorted.
    pub(super) fn crowd(&self, places: &mut [[u64; 2]]) -> Option<SceneError> {
        places.sort_unstable();
        let crowds = places.chunk_by(|a, b| a == b).filter(|crowd| crowd.len() > MOST_AT_A_PLACE);
        let others = crowds.clone().count().saturating_sub(1);
        let crowd = crowds.max_by_key(|crowd| crowd.len())?;
        let ([x, y], count) = (crowd[0].map(f64::from_bits), crowd.len());
        let reason = format!(
            "{count} bodies have their center at {x:?}, {y:?}, where every two of them would be a contact, and at most {MOST_AT_A_PLACE} \
             may: give each a place of its own, with all digits that tell it from the others"
        );
        Some(SceneError::whole(self.bodies_path().unwrap_or(&self.path), reason).and_more(others))
    }

    /// That not all of its bodies came into the world.
    pub(super) fn lost(&self, found: u64) -> SceneError {
        let reason = format!(
            "{found} of its {} bodies were found: what it says of where they are is not so, or it was changed meanwhile; write \
             it again",
            self.count
        );
        SceneError::whole(self.bodies_path().unwrap_or(&self.path), reason)
    }
}

/// What there is to read, or why there is nothing.
fn or_error<'a>(rows: Result<impl Iterator<Item = Result<Body, SceneError>> + 'a, SceneError>) -> BodyIter<'a> {
    match rows {
        Ok(rows) => Box::new(rows),
        Err(error) => Box::new(iter::once(Err(error))),
    }
}

/// The text of a scene's file.
fn read_text(path: &Path) -> Result<String, SceneError> {
    const WHAT: &str = "this scene";
    let length = check_regular(path, WHAT)?;
    if length > LONGEST_TEXT {
        let reason =
            format!("it has {length} bytes, and at most {LONGEST_TEXT} are read; put bodies into a file of their own");
        return Err(SceneError::whole(path, reason));
    }
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|file| file.take(LONGEST_TEXT).read_to_end(&mut bytes));
    read.map_err(|error| SceneError::read(path, WHAT, error))?;
    String::from_utf8(bytes).map(unmarked).map_err(|error| {
        let line = error.as_bytes()[..error.utf8_error().valid_up_to()].iter().filter(|&&byte| byte == b'\n').count();
        let place = Place { line: Some(line as u64 + 1), ..Place::default() };
        SceneError::bad(path, place, "it is not UTF-8; save the file as that")
    })
}

/// How long a file is that is none of the system's.
fn check_regular(path: &Path, what: &'static str) -> Result<u64, SceneError> {
    let data = fs::metadata(path).map_err(|error| SceneError::read(path, what, error))?;
    if data.is_file() { Ok(data.len()) } else { Err(SceneError::read(path, what, "it is no regular file; name one")) }
}
