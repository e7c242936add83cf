//! An image, and how shapes, letters and densities come upon it.

mod density;
mod form;
mod image;
mod letters;

pub(crate) use density::{Field, Tone};
pub(super) use form::Form;
pub(crate) use image::{Image, Rgb};
pub(super) use letters::Letters;

/// An image that is drawn on, within a rectangle of it.
#[derive(Debug)]
pub(super) struct Canvas {
    /// What was drawn.
    pub image: Image,
    /// Columns and rows that are drawn on: from, and up to but without.
    clip: [[usize; 2]; 2],
}

impl Canvas {
    /// A black one.
    pub(super) fn new(size: [u32; 2]) -> Self {
        let pixels = vec![0; size[0] as usize * size[1] as usize * 3];
        let mut canvas = Self { image: Image { size, step: 0, pixels }, clip: [[0; 2]; 2] };
        canvas.unclip();
        canvas
    }

    /// Width and height in pixels.
    pub(super) fn size(&self) -> [f64; 2] {
        self.image.size.map(f64::from)
    }

    /// From here on only this rectangle is drawn on.
    pub(super) fn clip(&mut self, low: [f64; 2], high: [f64; 2]) {
        self.clip = [0, 1].map(|axis| {
            let pixel = |edge: f64| (edge.round().max(0.0) as usize).min(self.image.size[axis] as usize);
            [pixel(low[axis]), pixel(high[axis])]
        });
    }

    /// From here on all of it is drawn on.
    pub(super) fn unclip(&mut self) {
        self.clip = self.image.size.map(|length| [0, length as usize]);
    }

    /// Columns, or rows, that are drawn on and may have a part of what lies between two coordinates. Never beyond the image.
    pub(super) fn span(&self, axis: usize, low: f64, high: f64) -> std::ops::Range<usize> {
        let [from, to] = self.clip[axis];
        let first = (low.floor().max(0.0) as usize).max(from).min(to);
        first..(high.ceil().max(0.0) as usize).min(to).max(first)
    }

    /// Gives a pixel so much of a color, from 0 to 1.
    #[inline]
    pub(super) fn blend(&mut self, x: usize, y: usize, color: Rgb, part: f32) {
        let part = (part * 256.0 + 0.5) as i32;
        let at = 3 * (y * self.image.size[0] as usize + x);
        for (channel, new) in self.image.pixels[at..at + 3].iter_mut().zip(color.0) {
            let old = i32::from(*channel);
            *channel = (old + (((i32::from(new) - old) * part + 128) >> 8)) as u8;
        }
    }

    /// Gives all that is drawn on one color.
    pub(super) fn fill(&mut self, color: Rgb) {
        let [[left, right], [top, bottom]] = self.clip;
        for y in top..bottom {
            let row = 3 * y * self.image.size[0] as usize;
            self.image.pixels[row + 3 * left..row + 3 * right].as_chunks_mut().0.fill(color.0);
        }
    }

    /// Draws a form, as much of its color as given.
    pub(super) fn draw(&mut self, form: &Form, color: Rgb, part: f64) {
        self.draw_each(form, |coverage, _, _| (color, coverage * part));
    }

    /// Draws a form, as much of its color as given, with an edge of its own color, within the form and so wide.
    pub(super) fn draw_edged(&mut self, form: &Form, color: Rgb, part: f64, edge: Rgb, width: f64) {
        let inner = form.grown(-width);
        self.draw_each(form, |coverage, x, y| {
            let within = inner.coverage(x, y).min(coverage) / coverage;
            (edge.mix(color, within as f32), coverage * (1.0 - within * (1.0 - part)))
        });
    }

    /// Draws what a form has more than one within it.
    pub(super) fn draw_ring(&mut self, form: &Form, width: f64, color: Rgb, part: f64) {
        let inner = form.grown(-width);
        self.draw_each(form, |coverage, x, y| (color, part * (coverage - inner.coverage(x, y)).max(0.0)));
    }

    /// Asks for the color and how much of it there is of each pixel that a form covers.
    fn draw_each(&mut self, form: &Form, paint: impl Fn(f64, f64, f64) -> (Rgb, f64)) {
        let [low, high] = form.bounds();
        for y in self.span(1, low[1], high[1]) {
            for x in self.span(0, low[0], high[0]) {
                let (center_x, center_y) = (x as f64 + 0.5, y as f64 + 0.5);
                let coverage = form.coverage(center_x, center_y);
                if coverage > 0.0 {
                    let (color, part) = paint(coverage, center_x, center_y);
                    self.blend(x, y, color, part as f32);
                }
            }
        }
    }
}
