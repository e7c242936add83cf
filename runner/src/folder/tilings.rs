//! The tiles of a run in which these follow the bodies: `DIR/tilings.jsonl`, a line for those that it begins with and one for
//! each change.
//!
//! ```text
//! {"after":64,"levels":"aabbbbab"}
//! ```
//!
//! `after` so many steps, before the next, the tiles became these: for each how often it was cut from its square, `a` for a
//! square that is whole, in the order of [`Partition::forest`]; or, where borders move, for each cut the axis that it is made across
//! and its place, as in `X80000000`, in the order of [`Partition::bisection`].

use atoll_core::{Bisector, Partition};
use glam::DVec2;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The letters of a cut across either axis, before its place.
const AXES: [char; 2] = ['X', 'Y'];

/// A cut as text has so many letters: the axis, and its place in hexadecimal digits.
const CUT: usize = 9;

/// What tells tiles that are not all equal from others over the same squares, as text: for each tile of a forest its level, `a` for
/// none; for each cut of a bisection the axis and the place.
pub(crate) fn in_letters(partition: &Partition) -> Option<String> {
    let levels = |levels: &[u8]| levels.iter().map(|level| char::from(b'a' + level)).collect();
    let cuts =
        |cuts: &[Bisector]| cuts.iter().map(|cut| format!("{}{:08x}", AXES[cut.axis as usize], cut.at)).collect();
    partition.levels().map(levels).or_else(|| partition.cuts().map(cuts))
}

/// How many tiles a text tells of that [`in_letters`] wrote.
pub(crate) fn tiles_in_letters(text: &str) -> usize {
    if text.is_empty() || text.starts_with(AXES) { text.len() / CUT + 1 } else { text.len() }
}

/// The tiles over columns x rows of squares that were written as letters, if there are such.
pub(crate) fn of_letters(text: &str, [low, high]: [DVec2; 2], [columns, rows]: [u32; 2]) -> Option<Partition> {
    if text.is_empty() || text.starts_with(AXES) {
        let cut = |cut: &[u8]| {
            let text = std::str::from_utf8(cut).ok().filter(|text| text.len() == CUT)?;
            let axis = AXES.iter().position(|axis| text.starts_with(*axis))? as u32;
            Some(Bisector { axis, at: u32::from_str_radix(&text[1..], 16).ok()? })
        };
        let cuts: Option<Vec<Bisector>> = text.as_bytes().chunks(CUT).map(cut).collect();
        return Partition::bisection(low, high, &cuts?).ok().filter(|tiles| tiles.roots() == [columns, rows]);
    }
    let levels: Option<Vec<u8>> =
        text.bytes().map(|letter| letter.is_ascii_lowercase().then(|| letter - b'a')).collect();
    Partition::forest(low, high, columns, rows, &levels?).ok()
}

#[derive(Serialize, Deserialize)]
struct Line<'a> {
    after: u64,
    levels: Cow<'a, str>,
}

/// Writes the tilings of a run.
#[derive(Debug)]
pub(crate) struct TilingsFile {
    path: PathBuf,
    file: File,
}

impl TilingsFile {
    /// Begins with the tiles that a run begins with; one that goes on after a step keeps what was written until then.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn start(path: PathBuf, first: &Partition, resumed: Option<u64>) -> io::Result<Self> {
        let known = resumed.map(|_| fs::read(&path)).transpose();
        let known = known.or_else(|error| if error.kind() == ErrorKind::NotFound { Ok(None) } else { Err(error) })?;
        let mut file = Self { file: File::create(&path)?, path };
        // What is damaged stays so, for who reads it to tell; half of a line goes.
        let is_before = |line: &[u8]| {
            let after = serde_json::from_slice(line).map(|Line { after, .. }| after);
            line.ends_with(b"\n") && after.map_or(true, |after| resumed.is_some_and(|resumed| after < resumed))
        };
        match known.filter(|known| known.contains(&b'\n')) {
            Some(known) => {
                let lines = known.split_inclusive(|&byte| byte == b'\n').enumerate();
                for (_, line) in lines.take_while(|&(number, line)| number == 0 || is_before(line)) {
                    file.file.write_all(line)?;
                }
            }
            None => file.append(resumed.unwrap_or(0), first)?,
        }
        Ok(file)
    }

    /// Where it lies, and the file itself, for who makes it durable.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn shared(&self) -> io::Result<(PathBuf, File)> {
        Ok((self.path.clone(), self.file.try_clone()?))
    }

    /// Tiles that are those of all steps from here on.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn append(&mut self, after: u64, partition: &Partition) -> io::Result<()> {
        let Some(levels) = in_letters(partition) else { return Ok(()) };
        self.write(&Line { after, levels: levels.into() })
    }

    fn write(&mut self, line: &Line<'_>) -> io::Result<()> {
        let mut text = serde_json::to_string(line).expect("a number and letters");
        text.push('\n');
        // In one piece: who is killed leaves no half of a line behind.
        self.file.write_all(text.as_bytes())
    }
}

/// The tilings that a run wrote down, ascending.
#[derive(Clone, Default, Debug)]
pub(crate) struct Tilings {
    all: Vec<(u64, Arc<Partition>)>,
    /// What is wrong with their file.
    damage: Option<String>,
}

impl Tilings {
    /// Those of a file, over columns x rows of squares. None if there is no such file, which is as it should be unless tiles
    /// `follow` the bodies. What comes after a line that cannot be read is left out.
    pub(crate) fn read(path: &Path, domain: [DVec2; 2], squares: [u32; 2], follow: bool) -> Self {
        let read = fs::read(path);
        let missing = read.as_ref().err().filter(|_| follow).map(ToString::to_string);
        let text = String::from_utf8_lossy(&read.unwrap_or_default()).into_owned();
        let tiling = |line: &str| {
            let Line { after, levels } = serde_json::from_str(line).ok()?;
            Some((after, Arc::new(of_letters(&levels, domain, squares)?)))
        };
        let all: Vec<_> = text.lines().map_while(tiling).collect();
        let is_empty = follow && all.is_empty();
        // A run that was killed may leave half of a line.
        let bad = text.split_inclusive('\n').nth(all.len()).filter(|line| line.ends_with('\n') || is_empty);
        let bad = bad.map(|_| format!("line {} cannot be read", all.len() + 1));
        // As where it was lost, and the run went on.
        let late =
            all.first().filter(|(after, _)| *after > 0).map(|(after, _)| format!("it begins after step {after}"));
        let damage = missing.or(bad).or_else(|| is_empty.then(|| "it is empty".to_owned())).or(late);
        Self { all, damage: damage.map(|reason| told(path, &reason)) }
    }

    /// That the last of them are so many tiles, as the run is known to have ended with.
    pub(crate) fn check_last(&mut self, path: &Path, count: u64) {
        let found = self.all.last().map_or(0, |(_, partition)| partition.tiles() as u64);
        if found != count {
            let reason = || format!("it ends with {found} tiles, and the run ended with {count}");
            self.damage.get_or_insert_with(|| told(path, &reason()));
        }
    }

    /// What is wrong with their file, if anything is, and how to mend it.
    pub(crate) fn damage(&self) -> Option<&str> {
        self.damage.as_deref()
    }

    /// The tiles with which a step was made, counted from one; of step 0 those that the run began with.
    pub(crate) fn at(&self, step: u64) -> Option<&Arc<Partition>> {
        let before = self.all.partition_point(|(after, _)| *after < step).max(1);
        self.all.get(before - 1).map(|(_, partition)| partition)
    }
}

fn told(path: &Path, reason: &str) -> String {
    format!("{}: {reason}, so tiles are not shown as they were; bring back a good copy of it", path.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_are_letters_and_digits() {
        let (low, high) = (DVec2::ZERO, DVec2::new(2.0, 1.0));
        let cuts = [(0, 0x8000_0000), (1, 0x0000_1000), (1, 0xffff_ffff)].map(|(axis, at)| Bisector { axis, at });
        for (count, text) in [(0, ""), (1, "X80000000"), (3, "X80000000Y00001000Yffffffff")] {
            let partition = Partition::bisection(low, high, &cuts[..count]).unwrap();
            assert_eq!(in_letters(&partition).as_deref(), Some(text));
            assert_eq!(tiles_in_letters(text), count + 1);
            assert_eq!(of_letters(text, [low, high], [count as u32 + 1, 1]), Some(partition));
            assert_eq!(of_letters(text, [low, high], [count as u32 + 2, 1]), None);
        }
        for damaged in ["X8000000", "X8000000\u{e9}", "X8000000g", "X80000000X", "X80000000Z00001000", "X00000000"] {
            assert_eq!(of_letters(damaged, [low, high], [2, 1]), None, "{damaged}");
        }
        let forest = Partition::forest(low, high, 2, 1, &[0, 1, 1, 1, 1]).unwrap();
        assert_eq!(in_letters(&forest).map(|text| tiles_in_letters(&text)), Some(5));
        assert_eq!(in_letters(&Partition::uniform(low, high, 2, 1).unwrap()), None);
    }

    #[test]
    fn what_was_written_is_read_and_cut_off_where_a_run_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tilings.jsonl");
        let domain = [DVec2::ZERO, DVec2::new(2.0, 1.0)];
        let of = |levels: &[u8]| Partition::forest(domain[0], domain[1], 2, 1, levels).unwrap();
        let all = [of(&[0, 0]), of(&[1, 1, 1, 1, 0]), of(&[0, 1, 1, 1, 1]), of(&[1; 8])];
        let read = || Tilings::read(&path, domain, [2, 1], true);
        let at = |step| read().at(step).map(|partition| (**partition).clone());
        let damage = || read().damage().map(str::to_owned);
        assert_eq!(at(3), None);
        assert!(damage().unwrap().contains("tilings.jsonl: No such file"));
        assert_eq!(Tilings::read(&path, domain, [2, 1], false).damage(), None);
        let mut file = TilingsFile::start(path.clone(), &all[0], None).unwrap();
        for (after, partition) in [(0, &all[1]), (64, &all[2]), (128, &all[3])] {
            file.append(after, partition).unwrap();
        }
        let found = |steps: [u64; 6]| steps.map(|step| all.iter().position(|one| Some(one) == at(step).as_ref()));
        assert_eq!(found([0, 1, 64, 65, 128, 129]), [0, 1, 1, 2, 2, 3].map(Some));
        // Who goes on after step 64 has the tiles looked at anew before the next one.
        let mut file = TilingsFile::start(path.clone(), &all[3], Some(64)).unwrap();
        assert_eq!(found([0, 1, 64, 65, 128, 129]), [0, 1, 1, 1, 1, 1].map(Some));
        file.append(64, &all[2]).unwrap();
        fs::write(&path, fs::read_to_string(&path).unwrap() + "{\"after\":9").unwrap();
        assert_eq!(found([0, 1, 64, 65, 128, 129]), [0, 1, 1, 2, 2, 2].map(Some));
        assert_eq!(damage(), None);
        let ended = |count| {
            let mut tilings = read();
            tilings.check_last(&path, count);
            tilings.damage().map(str::to_owned)
        };
        assert_eq!(ended(5), None);
        assert!(ended(8).unwrap().contains("it ends with 5 tiles, and the run ended with 8, so"));
        // What cannot be read is told of still once the run has gone on.
        fs::write(&path, b"{\"after\":0,\"levels\":\"aa\"}\n\xff\n{\"after\":64,\"levels\":\"aa\"}\n{").unwrap();
        TilingsFile::start(path.clone(), &all[3], Some(64)).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"{\"after\":0,\"levels\":\"aa\"}\n\xff\n");
        assert!(damage().unwrap().contains("line 2 cannot be read"));
        fs::remove_file(&path).unwrap();
        TilingsFile::start(path.clone(), &all[3], Some(64)).unwrap();
        assert!(damage().unwrap().contains("tilings.jsonl: it begins after step 64, so tiles"));
        fs::write(&path, "{\"after\":0,\"levels\":\"q\"}\n").unwrap();
        assert!(damage().unwrap().contains("line 1 cannot be read, so tiles are not shown as they were"));
    }
}
