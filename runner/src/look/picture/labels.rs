//! What is written upon a picture: the legend in the upper left corner; time, number of bodies and a scale bar in the lower
//! left one. The world is drawn beside them, or above both; only where that would leave little of it, it lies beneath. They are on
//! plates through which a little shines.

use super::canvas::{Canvas, Form, Letters};
use super::colors;
use super::legend::{Legend, Sign, grouped, length};
use super::paint::round_up;
use super::view::{Fit, View};
use crate::look::frame::Frame;
use crate::wording::form_for;

/// Letters are this part of the image's height.
const PART: f64 = 1.0 / 50.0;
/// And never smaller, in pixels, unless an image is smaller than its text.
const SMALLEST: f64 = 10.0;
/// Lengths in ems: from line to line, around the text, and from the edge of the image.
const LINE: f64 = 1.5;
const PAD: f64 = 0.75;
const EDGE: f64 = 0.7;
/// The scale bar is no longer than this, and the bar of a scale of colors as long.
const BAR: f64 = 9.0;
/// A scale of colors, with its numbers, is as high as so many lines.
const SCALE_LINES: f64 = 1.9;
/// The world is never drawn smaller than this part of what the image has room for, so that nothing lies upon it.
const LEAST: f64 = 0.6;

/// Where both plates lie: upper left and lower right corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    /// Height of an em, in pixels.
    pub size: f64,
    /// The legend.
    pub legend: [[f64; 2]; 2],
    /// Time, number, scale.
    pub facts: [[f64; 2]; 2],
}

/// Where the world and what is written have their room.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    /// Whether both plates lie side by side beneath the world.
    pub beneath: bool,
    /// Where the world is: an upper left and a lower right corner.
    pub world: [[f64; 2]; 2],
}

impl Layout {
    /// Where a view is drawn largest of the places that the plates leave free.
    pub(super) fn room(&self, view: &View, [width, height]: [f64; 2]) -> Room {
        let whole = Room { beneath: false, world: [[0.0; 2], [width, height]] };
        let scale = |room: &Room| Fit::within(view, room.world, height).scale;
        let fit = Fit::within(view, whole.world, height);
        let ([left, bottom], [right, top]) = (fit.place(view.low), fit.place(view.high));
        let hides = |[low, high]: [[f64; 2]; 2]| low[0] < right && high[0] > left && low[1] < bottom && high[1] > top;
        if !hides(self.legend) && !hides(self.facts) {
            return whole;
        }
        let edge = EDGE * self.size;
        let beside = self.legend[1][0].max(self.facts[1][0]) + edge;
        let high = |[low, high]: [[f64; 2]; 2]| high[1] - low[1];
        let above = height - high(self.legend).max(high(self.facts)) - 2.0 * edge;
        let mut rooms = vec![whole];
        if beside < width {
            rooms.push(Room { beneath: false, world: [[beside, 0.0], [width, height]] });
        }
        if above > 0.0 && self.legend[1][0] + self.facts[1][0] + edge < width {
            rooms.push(Room { beneath: true, world: [[0.0; 2], [width, above]] });
        }
        let best = rooms[1..].iter().max_by(|a, b| scale(a).total_cmp(&scale(b)));
        *best.filter(|room| scale(room) >= LEAST * scale(&whole)).unwrap_or(&whole)
    }

    /// With the legend right of the facts, at the bottom.
    fn side_by_side(self) -> Self {
        let (edge, [low, high]) = (EDGE * self.size, self.legend);
        let [x, y] = [self.facts[1][0] + edge, self.facts[1][1]];
        Self { legend: [[x, y - (high[1] - low[1])], [x + high[0] - low[0], y]], ..self }
    }
}

/// Leaves of a long text its beginning and its end, so that it leaves room for the world.
fn clip(text: &mut String) {
    const MOST: usize = 32;
    let letters: Vec<char> = text.chars().collect();
    if letters.len() > MOST {
        let (head, tail) = (&letters[..MOST / 2], &letters[letters.len() + 1 - MOST / 2..]);
        *text = head.iter().chain(&['…']).chain(tail).collect();
    }
}

/// What is written upon a picture.
#[derive(Debug)]
pub(super) struct Labels<'a> {
    letters: &'a Letters,
    legend: Legend,
    time: String,
    step: String,
    bodies: String,
}

impl<'a> Labels<'a> {
    pub(super) fn new(letters: &'a Letters, mut legend: Legend, frame: &Frame, hertz: f64) -> Self {
        legend.rows.iter_mut().for_each(|(_, text)| clip(text));
        let bodies = frame.bodies.len();
        Self {
            letters,
            legend,
            time: format!("{:.*} s", if hertz > 100.0 { 3 } else { 2 }, frame.step as f64 / hertz),
            step: format!("step {}", frame.step),
            bodies: format!("{} {}", grouped(bodies), form_for(bodies as u64, "body")),
        }
    }

    /// Finds room for all: smaller letters where the image is narrow, fewer rows where it is low.
    pub(super) fn fit(&mut self, [width, height]: [f64; 2]) -> Layout {
        let mut size = (PART * height).max(SMALLEST);
        let room =
            (width - 2.0 * EDGE * size) / self.extents(size).map(|[width, _]| width).into_iter().fold(0.0, f64::max);
        size *= room.clamp(0.1, 1.0);
        let rows = self.legend.rows.len();
        let fixed = self.extents(size).map(|[_, height]| height).iter().sum::<f64>() + 3.0 * EDGE * size;
        let excess = ((fixed - height) / (LINE * size)).ceil().max(0.0) as usize;
        self.legend = std::mem::take(&mut self.legend).shortened(rows.saturating_sub(excess).max(1));
        let [legend, facts] = self.extents(size);
        let edge = EDGE * size;
        Layout {
            size,
            legend: [[edge; 2], [edge + legend[0], edge + legend[1]]],
            facts: [[edge, height - edge - facts[1]], [edge + facts[0], height - edge]],
        }
    }

    /// Width and height of the legend and of the facts.
    fn extents(&self, size: f64) -> [[f64; 2]; 2] {
        let width = |text: &str| self.letters.width(text, size);
        let rows = self.legend.rows.iter().map(|(_, text)| 1.5 * size + width(text));
        let bar = if self.legend.scale.is_some() { (BAR + 1.0) * size } else { 0.0 };
        let legend = rows.fold(width(&self.legend.title).max(bar), f64::max);
        let lines = 1.0 + self.legend.rows.len() as f64 + if bar > 0.0 { SCALE_LINES } else { 0.0 };
        let first = width(&self.time) + 0.8 * size + width(&self.step);
        let facts = first.max(width(&self.bodies)).max(BAR * size);
        let around = |width: f64, lines: f64| [width + 2.0 * PAD * size, (LINE * lines - 0.35 + 2.0 * 0.6) * size];
        [around(legend, lines), around(facts, 3.6)]
    }

    /// Writes all, upon a world of which a meter is so many pixels.
    pub(super) fn draw(mut self, canvas: &mut Canvas, room: Room, scale: f64) {
        let layout = self.fit(canvas.size());
        let layout = if room.beneath { layout.side_by_side() } else { layout };
        for [low, high] in [layout.legend, layout.facts] {
            let plate = Form::Plate { low, high, radius: 0.45 * layout.size };
            canvas.draw(&plate, colors::PAPER, 0.86);
            canvas.draw_ring(&plate, (0.06 * layout.size).max(1.0), colors::INK, 0.16);
        }
        self.draw_legend(canvas, &layout);
        self.draw_facts(canvas, &layout, scale);
    }

    fn draw_legend(&self, canvas: &mut Canvas, layout: &Layout) {
        let size = layout.size;
        let x = layout.legend[0][0] + PAD * size;
        let mut y = layout.legend[0][1] + 1.5 * size;
        let write = |canvas: &mut Canvas, text: &str, at, color| self.letters.write(canvas, text, at, size, color);
        write(canvas, &self.legend.title, [x, y], colors::FAINT);
        if let Some((scale, labels)) = &self.legend.scale {
            let (top, bottom) = (y + 0.6 * size, y + 1.5 * size);
            let bar = canvas.span(0, x, x + BAR * size);
            for column in bar.clone() {
                let part = (column - bar.start) as f32 / bar.len() as f32;
                let strip = Form::rectangle([column as f64, top], [column as f64 + 1.0, bottom]);
                canvas.draw(&strip, scale.at(part), 1.0);
            }
            let widths = labels.each_ref().map(|label| self.letters.width(label, size));
            // Where numbers are long, that in the middle is left out.
            let has_room = 0.5 * widths[1] + widths[0].max(widths[2]) + 0.5 * size < 0.5 * BAR * size;
            for (i, place) in [0.0, 0.5, 1.0].into_iter().enumerate().filter(|(i, _)| *i != 1 || has_room) {
                let from = x + (BAR * size - widths[i]) * place;
                write(canvas, &labels[i], [from, y + 2.7 * size], colors::INK);
            }
            y += SCALE_LINES * LINE * size;
        }
        for (sign, text) in &self.legend.rows {
            y += LINE * size;
            let center = [x + 0.5 * size, y - 0.36 * size];
            let around = |half: f64| ([center[0] - half, center[1] - half], [center[0] + half, center[1] + half]);
            match *sign {
                Sign::Square(color) => {
                    let (low, high) = around(0.42 * size);
                    canvas.draw(&Form::Plate { low, high, radius: 0.12 * size }, color, 1.0);
                }
                Sign::Disc(color) => canvas.draw(&Form::Disc { center, radius: 0.44 * size }, color, 1.0),
                Sign::Ring(color) => {
                    canvas.draw_ring(&Form::Disc { center, radius: 0.44 * size }, 0.16 * size, color, 1.0);
                }
                Sign::None => {}
            }
            write(canvas, text, [x + 1.5 * size, y], colors::INK);
        }
    }

    fn draw_facts(&self, canvas: &mut Canvas, layout: &Layout, scale: f64) {
        let size = layout.size;
        let x = layout.facts[0][0] + PAD * size;
        let mut y = layout.facts[0][1] + 1.5 * size;
        let write = |canvas: &mut Canvas, text: &str, at, color| self.letters.write(canvas, text, at, size, color);
        write(canvas, &self.time, [x, y], colors::INK);
        write(canvas, &self.step, [x + self.letters.width(&self.time, size) + 0.8 * size, y], colors::FAINT);
        y += LINE * size;
        write(canvas, &self.bodies, [x, y], colors::INK);
        y += LINE * size;
        let (meters, pixels) = scale_bar(scale, BAR * size);
        write(canvas, &length(meters), [x, y], colors::INK);
        let (half, end) = ((0.06 * size).round().max(1.0) * 0.5, (x + pixels).round());
        let (x, y) = (x.round(), (y + 0.75 * size).round());
        let mut line = |low, high| canvas.draw(&Form::rectangle(low, high), colors::INK, 1.0);
        line([x, y - half], [end, y + half]);
        line([x, y - 0.3 * size], [x + 2.0 * half, y]);
        line([end - 2.0 * half, y - 0.3 * size], [end, y]);
    }
}

/// The longest length of 1, 2 or 5 times a power of ten, in meters, that is no longer than so many pixels, and how many it is.
pub(super) fn scale_bar(scale: f64, most: f64) -> (f64, f64) {
    // What is not less than the inverse is not more than the length.
    let inverse = round_up(scale / most);
    let meters = 1.0 / inverse;
    (meters, meters * scale)
}
