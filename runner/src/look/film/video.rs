//! Films by ffmpeg: it is given pictures as they are, and writes the file.

use super::unfinished::{Unfinished, nothing_added};
use super::{FilmKind, Rate, refusal};
use crate::error::RunError;
use crate::look::picture::Image;
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::thread::{self, JoinHandle};

/// Of both: H.264 and VP9 hold one color for four pixels, so that sides must be even; a last odd row or column is left out.
/// Colors as television has them, as that is what browsers take them for.
const FILTER: &str = "crop=trunc(iw/2)*2:trunc(ih/2)*2:0:0,\
                      scale=out_color_matrix=bt709:out_range=tv:flags=bicubic+accurate_rnd+full_chroma_int+bitexact,\
                      format=yuv420p";
const BOTH: &str = "-an -colorspace bt709 -color_primaries bt709 -color_trc bt709 -color_range tv -threads 4 \
                    -fflags +bitexact -flags:v +bitexact -map_metadata -1";
const MP4: &str = "-c:v libx264 -preset veryfast -crf 18 -movflags +faststart -f mp4";
const WEBM: &str = "-c:v libvpx-vp9 -crf 24 -b:v 0 -deadline realtime -cpu-used 7 -row-mt 1 -f webm";

/// A film that ffmpeg is writing.
#[derive(Debug)]
pub(super) struct Video {
    // Dropped in this order: the program is ended before what it writes is removed.
    process: Process,
    unfinished: Unfinished,
    is_empty: bool,
}

/// ffmpeg, which ends with this.
#[derive(Debug)]
struct Process {
    child: Child,
    input: Option<ChildStdin>,
    complaints: Option<JoinHandle<String>>,
}

impl Video {
    pub(super) fn create(path: &Path, kind: FilmKind, size: [u32; 2], rate: Rate) -> Result<Self, RunError> {
        Self::create_by("ffmpeg", path, kind, size, rate)
    }

    /// As [`create`](Self::create), by the program of that name.
    pub(super) fn create_by(
        program: &str,
        path: &Path,
        kind: FilmKind,
        size: [u32; 2],
        rate: Rate,
    ) -> Result<Self, RunError> {
        if size.iter().any(|length| *length < 2) {
            return Err(refusal(path, "a film by ffmpeg is at least two pixels wide and high; give a larger --size"));
        }
        let unusable = |error: io::Error| RunError::BadOutput {
            option: "--out",
            path: path.to_owned(),
            reason: error.to_string(),
        };
        let (unfinished, _) = Unfinished::file(path).map_err(unusable)?;
        let mut output = OsString::from("file:");
        output.push(unfinished.at());
        let child = Command::new(program)
            .args("-hide_banner -loglevel error -nostdin -y -f rawvideo -pixel_format rgb24".split_ascii_whitespace())
            .args(["-video_size", &format!("{}x{}", size[0], size[1])])
            .args(["-framerate", &rate.added.to_string(), "-i", "pipe:0"])
            .args(["-vf", &format!("fps={},{FILTER}", rate.shown)])
            .args(BOTH.split_ascii_whitespace())
            .args(if kind == FilmKind::Webm { WEBM } else { MP4 }.split_ascii_whitespace())
            .arg(output)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn();
        let mut child = child.map_err(|error| match error.kind() {
            ErrorKind::NotFound => refusal(
                path,
                "that needs the program ffmpeg, which is not on the PATH; install it, or give a name in .gif, or one \
                 without an ending for a folder of pictures",
            ),
            _ => refusal(path, format!("ffmpeg cannot be started: {error}; give a name in .gif")),
        })?;
        let input = child.stdin.take();
        let complaints = child.stderr.take().map(|stderr| thread::spawn(move || hear(stderr)));
        Ok(Self { process: Process { child, input, complaints }, unfinished, is_empty: true })
    }

    pub(super) fn add(&mut self, image: &Image) -> io::Result<()> {
        self.is_empty = false;
        let given = match &mut self.process.input {
            Some(input) => input.write_all(&image.pixels),
            None => Err(ErrorKind::BrokenPipe.into()),
        };
        // If it reads no more it has ended, and said why.
        given.or_else(|error| self.process.end().and(Err(error)))
    }

    pub(super) fn finish(mut self) -> io::Result<()> {
        if self.is_empty {
            return Err(nothing_added());
        }
        self.process.end()?;
        File::open(self.unfinished.at())?.sync_all()?;
        self.unfinished.complete()
    }
}

impl Process {
    /// Lets it complete its work.
    ///
    /// # Errors
    /// If it failed: the last that it said.
    fn end(&mut self) -> io::Result<()> {
        drop(self.input.take());
        let status = self.child.wait()?;
        let said = self.complaints.take().and_then(|complaints| complaints.join().ok()).unwrap_or_default();
        if status.success() {
            return Ok(());
        }
        let reason = said.lines().map(str::trim).rfind(|line| !line.is_empty()).unwrap_or("it did not say why");
        Err(io::Error::other(format!("ffmpeg failed ({status}): {reason}")))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended, and been waited for, already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Hears to its end what a program says, and keeps what is said last.
fn hear(mut from: impl Read) -> String {
    let (mut kept, mut buffer) = (Vec::new(), [0; 4096]);
    while let Ok(length @ 1..) = from.read(&mut buffer) {
        kept.extend_from_slice(&buffer[..length]);
        let surplus = kept.len().saturating_sub(2 * buffer.len());
        kept.drain(..surplus);
    }
    String::from_utf8_lossy(&kept).into_owned()
}
