//! Pictures as files: one, a film, or a folder of them. Whatever gets its final name is whole: all is written beside it, under
//! another name, and what is not finished is removed.

mod gif;
mod palette;
mod png;
#[cfg(test)]
mod tests;
mod unfinished;
mod video;

pub(crate) use unfinished::remove_unfinished;

use crate::error::RunError;
use crate::look::picture::Image;
use std::path::{Path, PathBuf};

/// What may be written, by the ending of a name.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum FilmKind {
    /// One picture; of several the last.
    Png,
    /// A film that needs no other program.
    Gif,
    /// A film by ffmpeg, H.264.
    Mp4,
    /// A film by ffmpeg, VP9.
    Webm,
    /// A folder of pictures, each named by its step.
    Folder,
}

impl FilmKind {
    /// What a path asks for: a name without an ending is a folder.
    ///
    /// # Errors
    /// If the ending is none of these.
    pub(crate) fn of(path: &Path) -> Result<Self, RunError> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("gif") => Ok(Self::Gif),
            Some("mp4") => Ok(Self::Mp4),
            Some("webm") => Ok(Self::Webm),
            None => Ok(Self::Folder),
            Some(other) => Err(refusal(
                path,
                format!(
                    "nothing is known of .{other}; end the name in .png, .gif, .mp4 or .webm, or give one without an \
                     ending for a folder of pictures"
                ),
            )),
        }
    }

    /// Pictures in a second, at most, of what shows them one after the other.
    pub(crate) fn most_per_second(self) -> Option<f64> {
        match self {
            Self::Png | Self::Folder => None,
            // Programs show what lasts shorter much longer.
            Self::Gif => Some(50.0),
            Self::Mp4 | Self::Webm => Some(60.0),
        }
    }

    /// Whether it is of several pictures.
    pub(crate) fn is_film(self) -> bool {
        self != Self::Png
    }
}

/// How many pictures make a second of a film.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Rate {
    /// Of those that are added.
    pub added: f64,
    /// Of those that a program shows, which repeats some where there are more.
    pub shown: f64,
}

/// A file, or a folder, of pictures that is being written.
#[derive(Debug)]
pub(crate) struct Film {
    path: PathBuf,
    size: [u32; 2],
    sink: Sink,
}

/// Where pictures go.
#[derive(Debug)]
enum Sink {
    Png(png::Single),
    Folder(png::Folder),
    Gif(Box<gif::Gif>),
    Video(video::Video),
}

/// A picture as the bytes of a PNG.
pub(crate) fn to_png(image: &Image) -> Vec<u8> {
    let mut bytes = Vec::new();
    png::encode(&mut bytes, image, ::png::Compression::Balanced).expect("memory takes any picture");
    bytes
}

impl Film {
    /// Begins what the path's ending asks for: pictures of that size, at that rate. Nothing is at the path before
    /// [`finish`](Self::finish).
    ///
    /// # Errors
    /// If the ending is unknown, there is no ffmpeg, or the path cannot be written to.
    pub(crate) fn create(path: &Path, size: [u32; 2], rate: Rate) -> Result<Self, RunError> {
        let kind = FilmKind::of(path)?;
        let sink = match kind {
            FilmKind::Png => png::Single::create(path).map(Sink::Png),
            FilmKind::Folder => png::Folder::create(path).map(Sink::Folder),
            FilmKind::Gif => gif::Gif::create(path, size, rate.added).map(|gif| Sink::Gif(Box::new(gif))),
            FilmKind::Mp4 | FilmKind::Webm => {
                return Ok(Self {
                    path: path.to_owned(),
                    size,
                    sink: Sink::Video(video::Video::create(path, kind, size, rate)?),
                });
            }
        };
        let unusable = |error: std::io::Error| RunError::BadOutput {
            option: "--out",
            path: path.to_owned(),
            reason: error.to_string(),
        };
        Ok(Self { path: path.to_owned(), size, sink: sink.map_err(unusable)? })
    }

    /// Adds a picture.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(crate) fn add(&mut self, image: &Image) -> Result<(), RunError> {
        debug_assert_eq!(image.size, self.size);
        let added = match &mut self.sink {
            Sink::Png(png) => png.add(image),
            Sink::Folder(folder) => folder.add(image),
            Sink::Gif(gif) => gif.add(image),
            Sink::Video(video) => video.add(image),
        };
        added.map_err(|error| failure(&self.path, &error))
    }

    /// Completes what was begun and gives it its name.
    ///
    /// # Errors
    /// If it cannot be written, or not a single picture was added.
    pub(crate) fn finish(self) -> Result<(), RunError> {
        let finished = match self.sink {
            Sink::Png(png) => png.finish(),
            Sink::Folder(folder) => folder.finish(),
            Sink::Gif(gif) => gif.finish(),
            Sink::Video(video) => video.finish(),
        };
        finished.map_err(|error| failure(&self.path, &error))
    }
}

/// That a path cannot be used, and what would help.
fn refusal(path: &Path, reason: impl Into<String>) -> RunError {
    RunError::BadFilm { path: path.to_owned(), reason: reason.into() }
}

/// That something could not be written.
fn failure(path: &Path, error: &std::io::Error) -> RunError {
    RunError::Output { path: path.to_owned(), reason: error.to_string() }
}
