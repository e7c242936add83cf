//! Films as GIF: each picture has its own 255 colors, and only what changed since the last one.

use super::palette::Palette;
use super::unfinished::{Unfinished, nothing_added};
use crate::look::picture::Image;
use gif::{DisposalMethod, Encoder, EncodingError, Frame, Repeat};
use std::borrow::Cow;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

/// Programs show what lasts shorter, in hundredths of a second, much longer.
const SHORTEST: u64 = 2;

/// A GIF that is being written.
pub(super) struct Gif {
    unfinished: Unfinished,
    file: File,
    /// What it writes is taken to the file picture by picture: where it is dropped it would panic at a file that takes no more.
    encoder: Encoder<Vec<u8>>,
    /// Pictures in a second.
    rate: f64,
    added: u64,
    /// What the film shows so far.
    shown: Vec<u8>,
    palette: Palette,
    indices: Vec<u8>,
}

impl std::fmt::Debug for Gif {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Gif").field("unfinished", &self.unfinished).field("added", &self.added).finish_non_exhaustive()
    }
}

impl Gif {
    pub(super) fn create(path: &Path, size: [u32; 2], rate: f64) -> io::Result<Self> {
        let [Ok(width), Ok(height)] = size.map(u16::try_from) else {
            return Err(io::Error::other("a GIF is at most 65,535 pixels wide and high"));
        };
        let (unfinished, file) = Unfinished::file(path)?;
        let mut encoder = Encoder::new(Vec::new(), width, height, &[]).map_err(plain)?;
        encoder.set_repeat(Repeat::Infinite).map_err(plain)?;
        let shown = Vec::new();
        Ok(Self { unfinished, file, encoder, rate, added: 0, shown, palette: Palette::default(), indices: Vec::new() })
    }

    pub(super) fn add(&mut self, image: &Image) -> io::Result<()> {
        let [left, top, width, height] = self.changed(image);
        let stride = 3 * image.size[0] as usize;
        let row = |row: usize| row * stride + 3 * left..row * stride + 3 * (left + width);
        let rows: Vec<std::ops::Range<usize>> = (top..top + height).map(row).collect();
        self.palette.choose(rows.iter().map(|row| &image.pixels[row.clone()]));
        self.indices.clear();
        for row in rows {
            let new = image.pixels[row.clone()].as_chunks::<3>().0;
            match self.shown.get(row) {
                None => self.indices.extend(new.iter().map(|pixel| self.palette.index(*pixel))),
                Some(old) => self.indices.extend(
                    new.iter()
                        .zip(old.as_chunks::<3>().0)
                        .map(|(new, old)| if new == old { Palette::UNCHANGED } else { self.palette.index(*new) }),
                ),
            }
        }
        let moment = |picture: u64| (100.0 * picture as f64 / self.rate).round() as u64;
        let delay = (moment(self.added + 1) - moment(self.added)).max(SHORTEST);
        self.encoder
            .write_frame(&Frame {
                delay: u16::try_from(delay).unwrap_or(u16::MAX),
                dispose: DisposalMethod::Keep,
                transparent: Some(Palette::UNCHANGED),
                left: left as u16,
                top: top as u16,
                width: width as u16,
                height: height as u16,
                palette: Some(self.palette.colors()),
                buffer: Cow::Borrowed(&self.indices),
                ..Frame::default()
            })
            .map_err(plain)?;
        self.file.write_all(self.encoder.get_ref())?;
        self.encoder.get_mut().clear();
        self.shown.clone_from(&image.pixels);
        self.added += 1;
        Ok(())
    }

    /// Left, top, width and height of what is not as it was; never nothing.
    fn changed(&self, image: &Image) -> [usize; 4] {
        let [width, height] = image.size.map(|length| length as usize);
        if self.shown.is_empty() {
            return [0, 0, width, height];
        }
        let differs = |row: &usize| {
            let range = row * width * 3..(row + 1) * width * 3;
            image.pixels[range.clone()] != self.shown[range]
        };
        let Some(top) = (0..height).find(differs) else { return [0, 0, 1, 1] };
        let bottom = (top..height).rfind(differs).unwrap_or(top);
        let (mut left, mut right) = (width - 1, 0);
        for row in (top..=bottom).filter(differs) {
            let pixels = |pixels| -> &[[u8; 3]] { <[u8]>::as_chunks(pixels).0 };
            let range = row * width * 3..(row + 1) * width * 3;
            let (new, old) = (pixels(&image.pixels[range.clone()]), pixels(&self.shown[range]));
            let differs = |column: &usize| new[*column] != old[*column];
            left = (0..left).find(differs).unwrap_or(left);
            right = (right..width).rfind(differs).unwrap_or(right);
        }
        [left, top, right + 1 - left, bottom + 1 - top]
    }

    pub(super) fn finish(self) -> io::Result<()> {
        if self.added == 0 {
            return Err(nothing_added());
        }
        let (mut file, end) = (self.file, self.encoder.into_inner().map_err(plain)?);
        file.write_all(&end)?;
        file.sync_all()?;
        drop(file);
        self.unfinished.complete()
    }
}

/// What the system said, where it said anything.
fn plain(error: EncodingError) -> io::Error {
    match error {
        EncodingError::Io(error) => error,
        other => io::Error::other(other.to_string()),
    }
}
