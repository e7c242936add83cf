//! The folder that the files of a scene are written to.

use super::super::args::BodiesAs;
use super::super::output::{self, Kept};
use crate::error::RunError;
use crate::folder::durable::{create_folder_durably, write_durably};
use crate::scene::file::Column;
use crate::scene::file::digest_of_file;
use crate::scene::file::write::{self, Alike, BodiesFile, World};
use crate::wording::{Typed, plural};
use atoll_core::Body;
use std::fs;
use std::path::{Path, PathBuf};

/// What the text of a scene is called that is written here.
const TEXT: &str = "scene.toml";

/// Where to, and how.
pub(super) struct Target<'a> {
    folder: &'a Path,
    bodies_as: BodiesAs,
    overwrite: bool,
}

impl<'a> Target<'a> {
    /// Refuses a folder with files that would be lost, before anything heavy starts. `from` is what is read.
    ///
    /// # Errors
    /// If there are some, and they are not to be replaced; or if they must stay.
    pub(super) fn check(folder: &'a Path, bodies_as: BodiesAs, overwrite: bool, from: &Path) -> Result<Self, RunError> {
        let target = Self { folder, bodies_as, overwrite };
        let files = [target.text(), target.bodies()];
        if folder.exists() && !folder.is_dir() {
            return Err(target.unsuitable("there is something that is no folder; name another".to_owned()));
        }
        target.check_new(files.iter())?;
        let kept = Kept { configuration: Some(from), ..Kept::default() };
        kept.check(files.iter().map(|path| ("--out", Some(path.as_path()))))?;
        Ok(target)
    }

    fn unsuitable(&self, reason: String) -> RunError {
        RunError::Unsuitable { option: format!("--out {}", self.folder.display()), reason }
    }

    /// That none of these files is there, unless they are to be replaced.
    fn check_new<'p>(&self, mut files: impl Iterator<Item = &'p PathBuf>) -> Result<(), RunError> {
        let there = files.find(|path| !self.overwrite && fs::symlink_metadata(path).is_ok());
        there.map_or(Ok(()), |there| {
            let name = there.file_name().unwrap_or_default().to_string_lossy().into_owned();
            Err(self
                .unsuitable(format!("{name} is there already; name another folder, or replace it with --overwrite")))
        })
    }

    fn text(&self) -> PathBuf {
        self.folder.join(TEXT)
    }

    fn bodies(&self) -> PathBuf {
        self.folder.join(format!("bodies.{}", self.extension()))
    }

    fn extension(&self) -> &'static str {
        match self.bodies_as {
            BodiesAs::Csv => "csv",
            BodiesAs::Parquet => "parquet",
        }
    }

    /// Writes all files, each whole or not at all, the text last, and tells what there is in them.
    ///
    /// # Errors
    /// If they cannot be written.
    pub(super) fn write(&self, world: &World<'_>, mut bodies: Vec<Body>) -> Result<(), RunError> {
        let failed = |path: &Path| {
            let path = path.to_owned();
            move |error: std::io::Error| RunError::Output { path, reason: error.to_string() }
        };
        write::sort_in_space(&mut bodies, world.domain);
        let last = bodies.iter().map(|body| body.id).max();
        let ids = write::static_ids(world.statics, last).ok_or_else(|| {
            let reason =
                "a static's id is above 2^63 - 1, which the text of a scene cannot say; give statics ids of their own";
            self.unsuitable(reason.to_owned())
        })?;
        let statics = Alike::runs(world.statics, ids, |number| format!("statics-{number}.{}", self.extension()));
        let tables: Vec<(PathBuf, &Alike<'_>)> =
            statics.iter().filter_map(|alike| Some((self.folder.join(alike.table.as_ref()?), alike))).collect();
        self.check_new(tables.iter().map(|(path, _)| path))?;
        create_folder_durably(self.folder).map_err(failed(self.folder))?;
        let (text, file) = (self.text(), self.bodies());
        let write_rows = |path: &Path, columns: &[Column], rows: &[Body]| {
            let written = write_durably(path, |out| match self.bodies_as {
                BodiesAs::Csv => write::csv(out, columns, rows),
                BodiesAs::Parquet => write::parquet(out, columns, rows),
            });
            written.map_err(failed(path))
        };
        for (path, alike) in &tables {
            let (columns, rows) = alike.rows();
            write_rows(path, &columns, &rows)?;
        }
        write_rows(&file, &write::columns(&bodies), &bodies)?;
        let xxh3 = digest_of_file(&file).map_err(failed(&file))?;
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let told = BodiesFile { name: &name, xxh3: &xxh3, count: bodies.len() as u64 };
        let said = write::text(world, &statics, &told);
        write_durably(&text, |out| std::io::Write::write_all(out, said.as_bytes())).map_err(failed(&text))?;
        let files = [&text, &file].into_iter().chain(tables.iter().map(|(path, _)| path));
        let bytes = files.filter_map(|path| fs::metadata(path).ok()).map(|data| data.len()).sum::<u64>();
        let World { kinds, statics, .. } = world;
        output::show(&format!(
            "{} of {} and {}, {:.2} MB: `atoll run {}` runs it\n",
            plural(bodies.len() as u64, "body"),
            plural(kinds.len() as u64, "kind"),
            plural(statics.len() as u64, "static"),
            bytes as f64 * 1e-6,
            Typed(&text)
        ))
    }
}
