//! What is too small to be drawn: how much of each pixel it covers, and in which color on the average.

use super::{Canvas, Form, Rgb};

/// Parts of a pixel that are told apart. Sums of whole numbers of them are the same in whatever order bodies come, as they do
/// on other ranks.
const PARTS: f64 = 65_536.0;

/// For each pixel the area that is covered, in parts of a pixel, and the colors of it, each times its area.
#[derive(Default, Debug)]
pub(crate) struct Field {
    size: [usize; 2],
    cells: Vec<[u32; 4]>,
    /// Rows that may hold anything.
    rows: std::ops::Range<usize>,
}

impl Field {
    /// Makes it empty, and of that size.
    pub(crate) fn reset(&mut self, size: [u32; 2]) {
        let size = size.map(|length| length as usize);
        if self.size != size {
            let mut cells = std::mem::take(&mut self.cells);
            cells.clear();
            cells.resize(size[0] * size[1], [0; 4]);
            *self = Self { size, cells, rows: size[1]..0 };
        } else if self.rows.start < self.rows.end {
            self.cells[self.rows.start * size[0]..self.rows.end * size[0]].fill([0; 4]);
            self.rows = size[1]..0;
        }
    }

    /// Adds a body: its area, in pixels, spread over a square of that area around its center, or one of a pixel if it is
    /// smaller. So it covers no pixel more than once, and all of it is somewhere.
    #[inline]
    pub(crate) fn splat(&mut self, [x, y]: [f64; 2], area: f64, color: Rgb) {
        let half = 0.5 * area.sqrt().max(1.0);
        let (left, right, top, bottom) = (x - half, x + half, y - half, y + half);
        if !(right > 0.0 && bottom > 0.0 && left < self.size[0] as f64 && top < self.size[1] as f64) {
            return;
        }
        let density = PARTS * area / (4.0 * half * half);
        let columns = left.max(0.0) as usize..(right as usize + 1).min(self.size[0]);
        let rows = top.max(0.0) as usize..(bottom as usize + 1).min(self.size[1]);
        self.rows = self.rows.start.min(rows.start)..self.rows.end.max(rows.end);
        for row in rows {
            let high = (bottom.min(row as f64 + 1.0) - top.max(row as f64)) * density;
            let from = row * self.size[0];
            let cells = &mut self.cells[from + columns.start..from + columns.end];
            for (column, cell) in columns.clone().zip(cells) {
                add(cell, (right.min(column as f64 + 1.0) - left.max(column as f64)) * high, color);
            }
        }
    }

    /// As [`splat`](Self::splat), quicker where a body covers a pixel at most; the color is asked for only where it is seen. Where
    /// a pixel is covered more than two hundred times over, its color is any.
    #[inline]
    pub(crate) fn dab(&mut self, [x, y]: [f64; 2], area: f64, color: impl FnOnce() -> Rgb) {
        let (left, top) = (x - 0.5, y - 0.5);
        let inside = left >= 0.0 && top >= 0.0 && left + 2.0 <= self.size[0] as f64 && top + 2.0 <= self.size[1] as f64;
        if !inside || area > 1.0 {
            let reach = 0.5 * area.sqrt().max(1.0);
            let (columns, rows) = (self.size[0] as f64, self.size[1] as f64);
            if x + reach > 0.0 && y + reach > 0.0 && x - reach < columns && y - reach < rows {
                self.splat([x, y], area, color());
            }
            return;
        }
        let (column, row) = (left as usize, top as usize);
        let color = color();
        let (right, low) = ((left - column as f64) as f32, (top - row as f64) as f32);
        let whole = (PARTS * area) as f32;
        self.rows = self.rows.start.min(row)..self.rows.end.max(row + 2);
        for (at, high) in [(row, 1.0 - low), (row + 1, low)] {
            let from = at * self.size[0] + column;
            let cells = &mut self.cells[from..from + 2];
            for (cell, wide) in cells.iter_mut().zip([1.0 - right, right]) {
                // Rounded up: nothing is too small to be there.
                pour(cell, (wide * high * whole + 0.999) as u32, color);
            }
        }
    }

    /// As [`dab`](Self::dab), quicker still: all of a body is where its center is.
    #[inline]
    pub(crate) fn dot(&mut self, [x, y]: [f64; 2], area: f64, color: impl FnOnce() -> Rgb) {
        if x >= 0.0 && y >= 0.0 && x < self.size[0] as f64 && y < self.size[1] as f64 {
            let (column, row) = (x as u32 as usize, y as u32 as usize);
            self.rows = self.rows.start.min(row)..self.rows.end.max(row + 1);
            pour(&mut self.cells[row * self.size[0] + column], (PARTS * area + 0.999) as u32, color());
        }
    }

    /// Whether nothing was added.
    pub(crate) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Adds a form, as far as it is in what a canvas draws on.
    pub(in crate::look::picture) fn cover(&mut self, canvas: &Canvas, form: &Form, color: Rgb) {
        let [low, high] = form.bounds();
        let rows = canvas.span(1, low[1], high[1]);
        self.rows = self.rows.start.min(rows.start)..self.rows.end.max(rows.end);
        for row in rows {
            for column in canvas.span(0, low[0], high[0]) {
                let covered = form.coverage(column as f64 + 0.5, row as f64 + 0.5) * PARTS;
                add(&mut self.cells[row * self.size[0] + column], covered, color);
            }
        }
    }

    /// The area that is covered, in pixels.
    #[cfg(test)]
    pub(crate) fn area(&self) -> f64 {
        self.cells.iter().map(|cell| f64::from(cell[3]) / PARTS).sum()
    }

    /// How much of a pixel is covered, at most.
    #[cfg(test)]
    pub(crate) fn most(&self) -> f32 {
        self.cells.iter().map(|cell| (f64::from(cell[3]) / PARTS) as f32).fold(0.0, f32::max)
    }

    /// What there is as bytes, four for each pixel, rows from the top: red, green and blue, multiplied by how strongly they are drawn,
    /// and that.
    pub(crate) fn toned(&self, tone: &Tone) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.cells.len() * 4);
        for &[r, g, b, area] in &self.cells {
            let mut pixel = [0; 4];
            if area > 0 {
                let strength = tone.of(area as f32 / PARTS as f32);
                let part = strength / area as f32;
                pixel = [r as f32 * part, g as f32 * part, b as f32 * part, 255.0 * strength].map(|x| (x + 0.5) as u8);
            }
            bytes.extend_from_slice(&pixel);
        }
        bytes
    }

    /// Draws what there is, each pixel in the mean of its colors.
    pub(in crate::look::picture) fn draw(&self, canvas: &mut Canvas, tone: &Tone) {
        for row in canvas.span(1, self.rows.start as f64, self.rows.end as f64) {
            for column in canvas.span(0, 0.0, self.size[0] as f64) {
                let [r, g, b, area] = self.cells[row * self.size[0] + column];
                if area > 0 {
                    let mean = [r, g, b].map(|sum| (f64::from(sum) / f64::from(area) + 0.5) as u8);
                    canvas.blend(column, row, Rgb(mean), tone.of((f64::from(area) / PARTS) as f32));
                }
            }
        }
    }
}

/// Adds so many parts of a color to a pixel, quickly: sums that are too great are any.
#[inline(always)]
fn pour(cell: &mut [u32; 4], parts: u32, color: Rgb) {
    let [r, g, b] = color.0.map(u32::from);
    for (sum, value) in cell.iter_mut().zip([r, g, b, 1]) {
        *sum = sum.wrapping_add(value * parts);
    }
}

/// Adds so much of a color to a pixel: a part at least, so that nothing is too small to be there.
#[inline]
fn add(cell: &mut [u32; 4], covered: f64, color: Rgb) {
    if covered > 0.0 {
        let parts = ((covered + 0.5) as u32).max(1);
        let [r, g, b] = color.0.map(u32::from);
        // More than is covered a hundred times over is no more.
        cell.iter_mut().zip([r, g, b, 1]).for_each(|(sum, value)| *sum = sum.saturating_add(value * parts));
    }
}

/// How strongly a covered part of a pixel is drawn: a power of it, so that a few small bodies are seen, and a pixel that is
/// covered has the full color.
#[derive(Debug)]
pub(crate) struct Tone {
    table: Vec<f32>,
}

impl Tone {
    const STEPS: usize = 4096;

    /// The given power: 1 for what is covered and no more.
    pub(crate) fn new(power: f64) -> Self {
        let of = |i| libm::pow(i as f64 / Self::STEPS as f64, power) as f32;
        Self { table: (0..=Self::STEPS).map(of).collect() }
    }

    /// The same, with a part of the strength.
    pub(crate) fn times(mut self, part: f64) -> Self {
        self.table.iter_mut().for_each(|strength| *strength *= part as f32);
        self
    }

    /// For so much of a pixel.
    #[inline]
    pub(crate) fn of(&self, area: f32) -> f32 {
        let at = (area * Self::STEPS as f32).clamp(1.0, Self::STEPS as f32);
        self.table[at as usize]
    }
}
