//! The record of the first failure of a run, a file that all its processes see.

use std::fs;
use std::path::{Path, PathBuf};

use crate::origin::Origin;
use crate::{Rank, TransportError};

/// Where a run records how its end began.
#[derive(Debug)]
pub(super) struct Record {
    path: PathBuf,
    /// A name of this process's own, to write under before the record is seen.
    draft: PathBuf,
}

impl Record {
    /// The record in `folder`, for the process that is called `writer` there.
    pub(super) fn new(folder: &Path, writer: &str) -> Record {
        Record { path: folder.join("origin"), draft: folder.join(format!("origin.{writer}")) }
    }

    /// Records `origin` unless there is a record, and returns what is on record.
    pub(super) fn settle(&self, origin: Origin) -> Origin {
        // A link to a complete file: it appears whole, and only where there is none.
        let recorded = fs::write(&self.draft, to_text(&origin)).and_then(|()| fs::hard_link(&self.draft, &self.path));
        let _ = fs::remove_file(&self.draft);
        match recorded {
            Ok(()) => origin,
            // Another was first. Where the folder itself is gone, so are the others who could tell.
            Err(_) => self.read().unwrap_or(origin),
        }
    }

    /// What is on record.
    pub(super) fn read(&self) -> Option<Origin> {
        from_text(&fs::read_to_string(&self.path).ok()?)
    }
}

fn to_text(Origin { error, reporter }: &Origin) -> String {
    format!("{reporter} {}", error.to_text())
}

fn from_text(text: &str) -> Option<Origin> {
    let (reporter, error) = text.split_once(' ')?;
    Some(Origin { error: TransportError::from_text(error)?, reporter: Rank(reporter.parse().ok()?) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn lost(rank: u32, reason: &str, reporter: u32) -> Origin {
        let error = TransportError::PeerLost { rank: Rank(rank), reason: reason.to_owned() };
        Origin { error, reporter: Rank(reporter) }
    }

    #[test]
    fn origins_survive_as_text() {
        let timeout = TransportError::Timeout { rank: Rank(7), waited: Duration::from_millis(250) };
        let origins = [lost(3, "it aborted: two\nlines\n", 3), Origin { error: timeout, reporter: Rank(1) }];
        for origin in origins {
            assert_eq!(from_text(&to_text(&origin)), Some(origin));
        }
        for text in ["", "1", "1 ", "x lost 1 it left", "1 found 1 it left"] {
            assert_eq!(from_text(text), None, "{text:?}");
        }
    }

    #[test]
    fn the_first_of_many_stays() {
        let folder = tempfile::tempdir().unwrap();
        let first = std::sync::OnceLock::new();
        let folder = folder.path();
        std::thread::scope(|scope| {
            for writer in 0..8 {
                let first = &first;
                scope.spawn(move || {
                    let record = Record::new(folder, &writer.to_string());
                    let settled = record.settle(lost(writer, "it left", writer));
                    assert_eq!(&settled, first.get_or_init(|| settled.clone()), "two origins");
                });
            }
        });
        assert_eq!(Record::new(folder, "late").read().as_ref(), first.get());
        assert_eq!(fs::read_dir(folder).unwrap().count(), 1, "drafts are left");
    }

    #[test]
    fn without_a_folder_the_own_error_is_reported() {
        let record = Record::new(Path::new("/nonexistent"), "0");
        assert_eq!(record.settle(lost(1, "it left", 0)), lost(1, "it left", 0));
    }
}
