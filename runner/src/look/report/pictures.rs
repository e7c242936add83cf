//! The first and the last record of each run as pictures.

use super::html::{Text, Whole, figure};
use super::letter;
use super::source::Source;
use crate::error::RunError;
use std::fmt::Write as _;

/// Pictures of one run, as PNG.
#[derive(Debug)]
pub(super) struct Pictures {
    /// The first, and the last if it is another: the step and the file.
    all: Vec<(u64, Vec<u8>)>,
}

/// Draws those of a run, if it has recorded.
///
/// # Errors
/// If a record cannot be read.
pub(super) fn draw(source: &Source) -> Result<Option<Pictures>, RunError> {
    let Some(recording) = &source.recording else { return Ok(None) };
    let mut steps = vec![recording.steps()[0]];
    steps.extend(recording.steps().last().filter(|last| **last != steps[0]));
    let mut all = Vec::new();
    for step in steps {
        all.extend(png(recording, step)?.map(|png| (step, png)));
    }
    Ok((!all.is_empty()).then_some(Pictures { all }))
}

/// All of the world at a step.
fn png(_recording: &crate::folder::recording::Recording, _step: u64) -> Result<Option<Vec<u8>>, RunError> {
    Ok(None)
}

/// The figures: beside each other those of a run.
pub(super) fn of(sources: &[Source], pictures: &[Option<Pictures>]) -> String {
    if pictures.iter().all(Option::is_none) {
        return String::new();
    }
    let mut text = String::from("<h2>First and last picture</h2>\n<div class=\"grid\">\n");
    for (run, (source, pictures)) in sources.iter().zip(pictures).enumerate() {
        for (i, (step, png)) in pictures.iter().flat_map(|pictures| &pictures.all).enumerate() {
            let (of, name) = if sources.len() > 1 {
                (format!(", {}", letter(run)), format!("_{}", letter(run).to_lowercase()))
            } else {
                Default::default()
            };
            let which = if i == 0 { "first" } else { "last" };
            let title = format!("{}{of}", if i == 0 { "First record" } else { "Last record" });
            let about = format!("After step {}, {:.2} s.", Whole(*step), source.time(*step as f64));
            let mut image = String::new();
            write!(image, "<img alt=\"{}, {}\" src=\"data:image/png;base64,{}\">", Text(&title), Text(&about), base64(png))
                .expect("a string takes any text");
            text += &figure(&format!("{which}_picture{name}"), false, &title, &about, &image);
        }
    }
    text + "</div>\n"
}

fn base64(bytes: &[u8]) -> String {
    use base64::Engine;
    base64::engine::general_purpose::STANDARD.encode(bytes)
}
