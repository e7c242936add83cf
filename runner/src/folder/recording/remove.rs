//! Removing what a run recorded after the step from which it goes on.

use super::{is_open_segment, rank_of_folder, steps_of_segment};
use std::path::Path;
use std::{fs, io};

/// Removes from the folder of a run the segments that begin after `step`, all of them if there is none, and those that
/// were under way. Where a segment was closed at `step`, what stays ends there.
///
/// # Errors
/// What the system says.
pub(crate) fn remove_after(run: &Path, step: Option<u64>) -> io::Result<()> {
    for folder in fs::read_dir(run)? {
        let folder = folder?;
        if folder.file_name().to_str().and_then(rank_of_folder).is_none() {
            continue;
        }
        for file in fs::read_dir(folder.path())? {
            let file = file?;
            let name = file.file_name();
            let Some(name) = name.to_str() else { continue };
            let begins_after = |first: u64| step.is_none_or(|step| first > step);
            if is_open_segment(name) || steps_of_segment(name).is_some_and(|(first, _)| begins_after(first)) {
                fs::remove_file(file.path())?;
            }
        }
        // Unless something is left in it.
        let _ = fs::remove_dir(folder.path());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use tempfile::tempdir;

    #[test]
    fn what_was_recorded_until_the_step_stays() {
        let run = tempdir().unwrap();
        let left = |step| {
            for (folder, names) in [
                ("rank-00000", &["steps-0000000000-0000000090.parquet", "steps-0000000100-0000000120.parquet"][..]),
                ("rank-00001", &["steps-0000000100-0000000120.parquet", ".steps-0000000130.parquet.tmp"]),
                ("elsewhere", &["steps-0000000100-0000000120.parquet"]),
            ] {
                fs::create_dir_all(run.path().join(folder)).unwrap();
                names.iter().for_each(|name| fs::write(run.path().join(folder).join(name), "").unwrap());
            }
            fs::write(run.path().join("rank-00000/notes.txt"), "").unwrap();
            remove_after(run.path(), step).unwrap();
            let there = |path: &str| run.path().join(path).exists();
            assert!(there("rank-00000/notes.txt") && there("elsewhere/steps-0000000100-0000000120.parquet"));
            assert!(!there("rank-00001/.steps-0000000130.parquet.tmp"));
            [
                "rank-00000/steps-0000000000-0000000090.parquet",
                "rank-00000/steps-0000000100-0000000120.parquet",
                "rank-00001",
            ]
            .map(there)
        };
        assert_eq!(left(Some(120)), [true, true, true]);
        assert_eq!(left(Some(99)), [true, false, false]);
        assert_eq!(left(None), [false, false, false]);
    }
}
