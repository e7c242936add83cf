//! A page about one run, or two side by side: one file that needs no other, with no script in it.

mod apart;
mod chart;
mod columns;
mod head;
mod html;
mod over_time;
mod pictures;
mod source;
mod times;

use super::compare::{self, Comparison};
use crate::error::RunError;
use crate::folder::recording::Recording;
use html::Text;
use pictures::Pictures;
use source::Source;
use std::path::Path;

/// Nothing is fetched from anywhere, whatever the page holds: browsers are told so.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data:";

/// What a page is made of.
#[derive(Debug)]
pub(crate) struct Report {
    sources: Vec<Source>,
    pictures: Vec<Option<Pictures>>,
    /// How two runs part, if both have recorded.
    comparison: Option<Comparison>,
}

impl Report {
    /// Reads the folders of one run or two. `done` is told of how many records are compared, and of how many.
    ///
    /// # Errors
    /// If one is no run, or what is there cannot be read.
    pub(crate) fn read(folders: &[impl AsRef<Path>], done: impl FnMut(usize, usize)) -> Result<Self, RunError> {
        let sources = folders.iter().map(|folder| Source::read(folder.as_ref())).collect::<Result<Vec<_>, _>>()?;
        let comparison = match &sources[..] {
            [a, b] if a.recording.is_some() && b.recording.is_some() => {
                Some(compare::compare(&a.folder, &b.folder, None, done)?)
            }
            _ => {
                sources.iter().filter_map(|source| source.recording.as_ref()).try_for_each(Recording::check)?;
                None
            }
        };
        let pictures = sources.iter().map(pictures::draw).collect::<Result<_, _>>()?;
        Ok(Self { sources, pictures, comparison })
    }

    /// What is wrong with files that the page does without.
    pub(crate) fn notes(&self) -> impl Iterator<Item = &str> {
        self.sources.iter().flat_map(|source| {
            let tiles = source.recording.as_ref().and_then(|recording| recording.damage());
            source.damaged.as_deref().into_iter().chain(tiles)
        })
    }

    /// The page.
    pub(crate) fn to_html(&self) -> String {
        let title = head::title(&self.sources);
        let body = [
            head::of(&self.sources),
            apart::of(&self.sources, self.comparison.as_ref()),
            pictures::of(&self.sources, &self.pictures),
            over_time::of(&self.sources),
            times::of(&self.sources),
            head::configuration(&self.sources),
        ];
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<link rel=\"icon\" href=\"data:,\">\n\
             <title>{}</title>\n<style>\n{}</style>\n</head>\n<body>\n<main>\n{}\
             <footer>Written by atoll {}. Everything on this page is in this file.</footer>\n</main>\n</body>\n</html>\n",
            Text(&title),
            include_str!("style.css"),
            body.concat(),
            env!("CARGO_PKG_VERSION"),
        )
    }
}

/// The runs by letter, where there are two.
fn letter(run: usize) -> &'static str {
    ["A", "B"][run]
}
