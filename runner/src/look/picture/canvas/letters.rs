//! Text on an image.

use super::{Canvas, Rgb};
use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};

/// The Latin, Greek and Cyrillic letters of Inter 3.19 in a medium weight, its digits of one width, and some signs; whatever else is an empty
/// box, also accents that are characters of their own. Its license is beside it.
const INTER: &[u8] = include_bytes!("font/Inter-Medium.otf");

/// A typeface.
#[derive(Debug)]
pub(crate) struct Letters {
    font: FontRef<'static>,
}

impl Letters {
    /// The one there is.
    pub(crate) fn new() -> Self {
        Self { font: FontRef::try_from_slice(INTER).expect("the font is part of the program") }
    }

    /// How long a text is, in pixels, with letters of a size: the height of an em.
    pub(crate) fn width(&self, text: &str, size: f64) -> f64 {
        let font = self.font.as_scaled(self.scale(size));
        text.chars().map(|letter| f64::from(font.h_advance(font.glyph_id(letter)))).sum()
    }

    /// Writes a text that begins at `x` and stands upon `y`.
    pub(crate) fn write(&self, canvas: &mut Canvas, text: &str, [x, y]: [f64; 2], size: f64, color: Rgb) {
        let scale = self.scale(size);
        let font = self.font.as_scaled(scale);
        let mut x = x as f32;
        for letter in text.chars() {
            let id = font.glyph_id(letter);
            let glyph = Glyph { id, scale, position: point(x, y.round() as f32) };
            x += font.h_advance(id);
            let Some(outline) = self.font.outline_glyph(glyph) else { continue };
            let corner = outline.px_bounds().min;
            outline.draw(|column, row, part| {
                let (column, row) = (corner.x as i64 + i64::from(column), corner.y as i64 + i64::from(row));
                let inside = |at: i64, length: u32| (0..i64::from(length)).contains(&at);
                if inside(column, canvas.image.size[0]) && inside(row, canvas.image.size[1]) {
                    canvas.blend(column as usize, row as usize, color, part.min(1.0));
                }
            });
        }
    }

    /// The library measures from the top of the highest letter to the bottom of the lowest.
    fn scale(&self, size: f64) -> PxScale {
        let em = self.font.units_per_em().expect("the font has a size");
        PxScale::from(size as f32 * self.font.height_unscaled() / em)
    }
}
