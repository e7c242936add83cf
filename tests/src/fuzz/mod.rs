//! Bytes of any kind against everything that reads what others wrote: frames, saved tiles, recordings,
//! configurations, scenes, command lines.
//!
//! Each target takes bytes and panics where a promise is broken; whatever else it is given, it returns, and says what became
//! of it. The same functions are driven by `tests/hostile/` on stable Rust and by the fuzzer of `fuzz/`.

mod arguments;
mod codec;
mod commands;
mod config;
mod page;
mod scene;
mod segment;
mod snapshot;
mod transport;

pub use arguments::{NoRun, arguments};
pub use codec::{FRAME, FrameLayout, Letter, TILES, codec, codec_by, frame};
pub use commands::commands;
pub use config::config;
pub use page::page;
pub use scene::{ScenePart, scene, scene_part};
pub use segment::{footer, segment, segment_file};
pub use snapshot::{BLOCK, BlockLayout, block, fresh, seal, snapshot};
pub use transport::transport;

use std::fmt::Display;

/// What became of bytes that were given to a target.
#[derive(Debug)]
pub struct Outcome<E> {
    /// Whether they were accepted; where a target mends checksums, with these mended.
    pub accepted: bool,
    /// Why they were refused, and again, where they were mended and refused once more.
    pub refusals: Vec<E>,
}

impl<E: Display> Outcome<E> {
    /// Of a result. Asserts that an error is of one line.
    #[track_caller]
    fn of<T>(result: Result<T, E>) -> Self {
        let refusals: Vec<E> = result.err().into_iter().collect();
        refusals.iter().for_each(assert_one_line);
        Self { accepted: refusals.is_empty(), refusals }
    }
}

/// Asserts the promise that every error keeps: one line that says something.
#[track_caller]
fn assert_one_line(error: impl Display) {
    let text = error.to_string();
    assert!(!text.trim().is_empty(), "an error without a word");
    assert!(!text.contains(['\n', '\r']), "an error of more than one line: {text:?}");
}
