//! Answers and events as a file, a line of JSON for each, by ascending steps.

use serde::Deserialize;
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, ErrorKind, Seek, SeekFrom, Stdout, Write};
use std::path::{Path, PathBuf};

/// A file of answers, or standard output.
pub(crate) struct AnswersFile {
    path: PathBuf,
    to: To,
}

enum To {
    File(File),
    Stdout(Stdout),
}

/// As much of a line as tells whether it stays.
#[derive(Deserialize)]
struct Head {
    step: u64,
    /// Of contacts that began, and of bodies that entered sensors: told at the end of a step, and not at the beginning of the next.
    began: Option<serde::de::IgnoredAny>,
    entered: Option<serde::de::IgnoredAny>,
}

impl AnswersFile {
    /// Opens it for a run that begins, with step 0, or goes on `from` a step, of whose lines some may be done (`is_begun`): what was
    /// said until then stays, and what comes after is said again. A path of `-` is standard output.
    ///
    /// # Errors
    /// What the system says; [`InvalidData`](ErrorKind::InvalidData) of a file to be continued that has other lines than answers.
    pub(crate) fn open(path: &Path, from: u64, is_begun: bool) -> io::Result<Self> {
        if path == Path::new("-") {
            return Ok(Self { path: PathBuf::from("standard output"), to: To::Stdout(io::stdout()) });
        }
        let kept = if from > 0 { Self::kept(path, from, is_begun)? } else { 0 };
        // Cut and not written anew, so that nothing is lost whenever that ends.
        let mut file = OpenOptions::new().write(true).create(true).truncate(false).open(path)?;
        if file.metadata()?.is_file() {
            file.set_len(kept)?;
            file.seek(SeekFrom::End(0))?;
        }
        Ok(Self { path: path.to_owned(), to: To::File(file) })
    }

    /// How many bytes stay.
    fn kept(path: &Path, from: u64, is_begun: bool) -> io::Result<u64> {
        if !path.metadata().is_ok_and(|metadata| metadata.is_file()) {
            return Ok(0);
        }
        let mut lines = BufReader::new(File::open(path)?);
        let (mut kept, mut line) = (0, String::new());
        for number in 1.. {
            line.clear();
            let length = lines.read_line(&mut line)?;
            // A run that was killed may have been writing the last one.
            let head = match serde_json::from_str::<Head>(&line) {
                Ok(head) => head,
                Err(error) if error.is_eof() && !line.ends_with('\n') => break,
                Err(_) => return Err(io::Error::new(ErrorKind::InvalidData, format!("line {number} is no answer"))),
            };
            let is_event = head.began.is_some() || head.entered.is_some();
            let stays = head.step < from || head.step == from && (is_begun || is_event);
            if !(stays && line.ends_with('\n')) {
                break;
            }
            kept += length as u64;
        }
        Ok(kept)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a line, at once.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn add(&mut self, line: &str) -> io::Result<()> {
        match &mut self.to {
            To::File(file) => file.write_all(line.as_bytes()),
            To::Stdout(stdout) => stdout.write_all(line.as_bytes()).and_then(|()| stdout.flush()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_that_goes_on_says_nothing_twice() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("answers.jsonl");
        let began = "{\"step\":5,\"began\":[[1,2]],\"ended\":[]}\n";
        let said = ["{\"step\":3,\"ray\":null}\n", began, "{\"step\":5,\"entered\":[],\"left\":[[7,2]]}\n"];
        let later = ["{\"step\":5,\"ray\":null}\n", "{\"step\":6,\"began\":[],\"ended\":[[1,2]]}\n", "{\"st"];
        let mut file = AnswersFile::open(&path, 0, false).unwrap();
        said.iter().chain(&later).for_each(|line| file.add(line).unwrap());
        let mut file = AnswersFile::open(&path, 5, false).unwrap();
        file.add("{\"step\":5}\n").unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), [said.concat(), "{\"step\":5}\n".to_owned()].concat());
        for foreign in ["What to buy\n- bread", "What to buy"] {
            std::fs::write(&path, foreign).unwrap();
            assert_eq!(AnswersFile::open(&path, 5, false).err().unwrap().to_string(), "line 1 is no answer");
        }
        drop(AnswersFile::open(&path, 0, false).unwrap());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "");
    }
}
