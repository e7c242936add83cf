//! The first and the last record of each run as pictures.

use super::html::{Text, Whole, figure};
use super::letter;
use super::source::Source;
use crate::error::RunError;
use crate::look::film::to_png;
use crate::look::frame::Frame;
use crate::look::picture::{ColorBy, Layers, Look, Painter, whole_view};
use crate::look::recorded::Recorded;
use glam::DVec2;
use std::fmt::Write as _;

/// Of a picture, in pixels.
const WIDTH: u32 = 1060;

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
    if source.recording.is_none() {
        return Ok(None);
    }
    let recorded = Recorded::open(&source.folder)?;
    let recording = recorded.recording();
    let mut steps = vec![recording.steps()[0]];
    steps.extend(recording.steps().last().filter(|last| **last != steps[0]));
    let (setting, view) = (recorded.setting(), whole_view(recorded.setting()));
    let look = Look { size: size(view.high - view.low), color: ColorBy::Kind, layers: Layers::default(), bare: false };
    let mut painter = Painter::new(setting, look);
    let (mut frame, mut all) = (Frame::default(), Vec::with_capacity(steps.len()));
    for step in steps {
        recorded.read(step, &mut frame)?;
        all.push((step, to_png(painter.draw(&frame, &view))));
    }
    Ok(Some(Pictures { all }))
}

/// Of a picture that shows so much: as wide as a page has room for two, on a screen with fine pixels, and as high as that
/// needs.
fn size(extent: DVec2) -> [u32; 2] {
    let height = (f64::from(WIDTH) * extent.y / extent.x).clamp(240.0, 1.2 * f64::from(WIDTH));
    [WIDTH, height.round() as u32 / 2 * 2]
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
            write!(
                image,
                "<img alt=\"{}, {}\" src=\"data:image/png;base64,{}\">",
                Text(&title),
                Text(&about),
                base64(png)
            )
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
