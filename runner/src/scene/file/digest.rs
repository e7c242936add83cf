//! What tells the content of one scene file from another's: XXH3 of 128 bits, wherever the files lie.

use super::super::SceneError;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::Xxh3Default;

/// Files up to this many bytes are read whole for it.
const WHOLE: u64 = 256 << 20;

/// Of larger ones, so many bytes at either end, and how many there are.
const END: u64 = 64 << 20;

/// That of a scene: of its text, of the files with places of statics, and of the one that holds its bodies, if there is one. `told` is what the text says of that
/// file, which is then read whole and compared.
///
/// # Errors
/// If the file cannot be read, or is another than the text says.
pub(super) fn of_scene(
    text: &str,
    places: &[PathBuf],
    bodies: Option<(&Path, Option<&str>)>,
) -> Result<String, SceneError> {
    let mut hash = Xxh3Default::new();
    hash.update(text.as_bytes());
    for path in places {
        let own = of_bodies(path, WHOLE, END).map_err(|error| SceneError::read(path, "these places", error))?;
        hash.update(own.as_bytes());
    }
    if let Some((path, told)) = bodies {
        let failed = |error: io::Error| SceneError::read(path, "these bodies", error);
        let whole = if told.is_some() { u64::MAX } else { WHOLE };
        let own = of_bodies(path, whole, END).map_err(failed)?;
        if let Some(told) = told.filter(|told| **told != own) {
            let reason = format!(
                "its xxh3 is {own}, and the scene says {told}; bring back the file that was meant, or mend bodies.xxh3"
            );
            return Err(SceneError::whole(path, reason));
        }
        hash.update(own.as_bytes());
    }
    Ok(hex(hash.digest128()))
}

/// That of a file: of all of it up to so many bytes, of longer ones of their length and of so many at either end.
fn of_bodies(path: &Path, whole: u64, end: u64) -> io::Result<String> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    if length <= whole {
        return of_file(path);
    }
    let mut hash = Xxh3Default::new();
    hash.update(&length.to_le_bytes());
    update(&mut hash, &mut file, end)?;
    file.seek(SeekFrom::Start(length.saturating_sub(end)))?;
    update(&mut hash, &mut file, end)?;
    Ok(hex(hash.digest128()))
}

/// That of a whole file, as `bodies.xxh3` has it.
///
/// # Errors
/// If it cannot be read.
pub(crate) fn of_file(path: &Path) -> io::Result<String> {
    let mut hash = Xxh3Default::new();
    update(&mut hash, &mut File::open(path)?, u64::MAX)?;
    Ok(hex(hash.digest128()))
}

fn hex(digest: u128) -> String {
    format!("{digest:032x}")
}

/// Takes the next bytes of a file in, up to so many.
fn update(hash: &mut Xxh3Default, file: &mut File, most: u64) -> io::Result<()> {
    let mut bytes = file.take(most);
    let mut buffer = vec![0; 1 << 18];
    loop {
        match bytes.read(&mut buffer)? {
            0 => return Ok(()),
            read => hash.update(&buffer[..read]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn of_long_files_the_ends_and_the_length_count() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bodies");
        let bytes: Vec<u8> = (0..2000_u32).map(|k| (k % 251) as u8).collect();
        let digest = |bytes: &[u8], whole| {
            fs::write(&path, bytes).unwrap();
            of_bodies(&path, whole, 300).unwrap()
        };
        let changed =
            |at: usize| bytes.iter().enumerate().map(|(i, byte)| byte ^ u8::from(i == at)).collect::<Vec<u8>>();
        for at in [0, 299, 1700, 1999] {
            assert_ne!(digest(&changed(at), 1000), digest(&bytes, 1000), "{at}");
        }
        assert_eq!(digest(&changed(1000), 1000), digest(&bytes, 1000));
        assert_ne!(digest(&changed(1000), 2000), digest(&bytes, 2000));
        assert_ne!(digest(&[&bytes[..1000], &bytes[999..]].concat(), 1000), digest(&bytes, 1000));
        assert_eq!(digest(&bytes, 2000), of_file(&path).unwrap());
    }
}
