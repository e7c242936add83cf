//! One picture, and a folder of them.

use super::unfinished::{Unfinished, nothing_added};
use crate::folder::durable::sync_folder;
use crate::look::picture::Image;
use png::{BitDepth, ColorType, Compression, Encoder};
use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::Path;

/// A single picture.
#[derive(Debug)]
pub(super) struct Single {
    unfinished: Unfinished,
    file: File,
    is_empty: bool,
}

impl Single {
    pub(super) fn create(path: &Path) -> io::Result<Self> {
        let (unfinished, file) = Unfinished::file(path)?;
        Ok(Self { unfinished, file, is_empty: true })
    }

    /// The picture, in place of one that was added before.
    pub(super) fn add(&mut self, image: &Image) -> io::Result<()> {
        self.file.rewind()?;
        self.file.set_len(0)?;
        self.is_empty = false;
        encode(&self.file, image, Compression::Balanced)
    }

    pub(super) fn finish(self) -> io::Result<()> {
        if self.is_empty {
            return Err(nothing_added());
        }
        self.file.sync_all()?;
        self.unfinished.complete()
    }
}

/// A folder of pictures, each named by its step.
#[derive(Debug)]
pub(super) struct Folder {
    unfinished: Unfinished,
    is_empty: bool,
}

impl Folder {
    pub(super) fn create(path: &Path) -> io::Result<Self> {
        Ok(Self { unfinished: Unfinished::folder(path)?, is_empty: true })
    }

    pub(super) fn add(&mut self, image: &Image) -> io::Result<()> {
        self.is_empty = false;
        let file = File::create(self.unfinished.at().join(format!("frame-{:010}.png", image.step)))?;
        // Of many it takes most of the time.
        encode(&file, image, Compression::Fast)?;
        file.sync_all()
    }

    pub(super) fn finish(self) -> io::Result<()> {
        if self.is_empty {
            return Err(nothing_added());
        }
        sync_folder(self.unfinished.at())?;
        self.unfinished.complete()
    }
}

/// Writes a picture as PNG.
pub(super) fn encode(to: impl Write, image: &Image, compression: Compression) -> io::Result<()> {
    let mut buffer = BufWriter::with_capacity(1 << 16, to);
    let mut encoder = Encoder::new(&mut buffer, image.size[0], image.size[1]);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(compression);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&image.pixels)?;
    writer.finish()?;
    buffer.flush()
}
