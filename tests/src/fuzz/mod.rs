//! Bytes of any kind against everything that reads what others wrote: frames, saved tiles, recordings,
//! configurations, command lines.
//!
//! Each target takes bytes and panics where a promise is broken; whatever else it is given, it returns, and most say
//! whether the bytes were accepted. The same functions are driven by `tests/hostile.rs` on stable Rust and by the fuzzer of `fuzz/`.

mod arguments;
mod codec;
mod config;
mod segment;
mod snapshot;
mod transport;

pub use arguments::arguments;
pub use codec::{TILES, codec, frame, receive};
pub use config::config;
pub use segment::{footer, segment, segment_file};
pub use snapshot::{BLOCK_HEADER, block, fresh, seal, snapshot};
pub use transport::transport;

use std::fmt::Display;

/// Asserts the promise that every error keeps: one line that says something.
#[track_caller]
fn assert_one_line(error: impl Display) {
    let text = error.to_string();
    assert!(!text.trim().is_empty(), "an error without a word");
    assert!(!text.contains(['\n', '\r']), "an error of more than one line: {text:?}");
}
