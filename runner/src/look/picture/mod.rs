//! Pictures: what there is after a step as an image. Bodies wider than two pixels are drawn as what they are; of smaller ones
//! how much they cover and in which mean color, so that no body is lost and a million are one pass over them. The same frame
//! gives the same pixels on every machine: nothing here depends on the mathematics of the host.

mod bodies;
mod canvas;
mod colors;
mod labels;
mod legend;
mod paint;
#[cfg(test)]
mod tests;
mod tiles;
mod view;

pub(crate) use bodies::{DRAWN, SHEER, least_area};
pub(crate) use canvas::{Field, Image, Rgb, Tone};
pub(crate) use colors::STATIC;
pub(crate) use legend::{Legend, Sign, grouped};
pub(crate) use paint::{ColorBy, Range, Tint};
pub(crate) use view::{View, whole_view};

use crate::look::frame::{Frame, Setting};
use bodies::Bodies;
use canvas::{Canvas, Letters};
use labels::{Labels, Room};
use paint::Paint;
use std::mem::take;
use tiles::Edges;
use view::Fit;

/// What is drawn beside bodies and what never moves.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(crate) struct Layers {
    /// The grid of tiles, and which rank has which.
    pub tiles: bool,
    /// Copies that tiles hold of their neighbours' bodies; of a run only.
    pub ghosts: bool,
    /// Points where bodies touch; of a run only.
    pub contacts: bool,
}

/// What a picture is to look like.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Look {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// What the colors of bodies tell.
    pub color: ColorBy,
    /// What else is drawn.
    pub layers: Layers,
    /// Whether nothing is written beside it.
    pub bare: bool,
}

/// Draws one picture after another. Used again, it allocates little.
#[derive(Debug)]
pub(crate) struct Painter {
    setting: Setting,
    look: Look,
    canvas: Canvas,
    field: Field,
    letters: Letters,
    range: Range,
    ranks: Vec<Option<u32>>,
    /// Names and places of the bodies that are drawn.
    order: Vec<(u64, usize)>,
    /// Where what is written has room: as at first, so that a film stands still.
    room: Option<Room>,
}

impl Painter {
    /// Of a world, with a look.
    pub(crate) fn new(setting: &Setting, look: Look) -> Self {
        Self {
            setting: setting.clone(),
            look,
            canvas: Canvas::new(look.size),
            field: Field::default(),
            letters: Letters::new(),
            range: Range::default(),
            ranks: Vec::new(),
            order: Vec::new(),
            room: None,
        }
    }

    /// Draws a frame, as much of it as is in view.
    pub(crate) fn draw(&mut self, frame: &Frame, view: &View) -> &Image {
        self.range.grow(self.look.color, frame);
        let ranks = frame.ranks.last().map_or(1, |(rank, _)| rank + 1);
        let legend = Legend::new(self.look.color, &self.look.layers, &self.setting, ranks, self.range.most);
        let size = self.canvas.size();
        let room = match self.room {
            Some(room) => room,
            None if self.look.bare => Room { beneath: false, world: [[0.0; 2], size] },
            None => Labels::new(&self.letters, legend.clone(), frame, self.setting.hertz).fit(size).room(view, size),
        };
        self.room = Some(room);
        let fit = Fit::within(view, room.world, size[1]);
        self.canvas.image.step = frame.step;
        self.canvas.unclip();
        self.canvas.fill(colors::MARGIN);
        let ([left, bottom], [right, top]) = (fit.place(view.low), fit.place(view.high));
        self.canvas.clip([left, top], [right, bottom]);
        self.canvas.fill(colors::PAPER);
        self.draw_statics(frame.step, &fit);
        self.draw_bodies(frame, fit);
        if self.look.layers.tiles {
            self.draw_tiles(frame, &fit);
        }
        self.canvas.unclip();
        if !self.look.bare {
            let labels = Labels::new(&self.letters, legend, frame, self.setting.hertz);
            labels.draw(&mut self.canvas, room, fit.scale);
        }
        &self.canvas.image
    }

    fn draw_statics(&mut self, step: u64, fit: &Fit) {
        let Self { setting, canvas, field, .. } = self;
        for (is_sensor, part) in [(false, 1.0), (true, SHEER)] {
            field.reset(canvas.image.size);
            let some = setting.statics_at(step).filter(|fixed| fixed.kind.sensor == is_sensor);
            some.for_each(|fixed| bodies::draw_static(canvas, field, fit, &fixed));
            field.draw(canvas, &Tone::new(1.0).times(part));
        }
    }

    /// Draws bodies, then ghosts, then contacts.
    fn draw_bodies(&mut self, frame: &Frame, fit: Fit) {
        let Self { setting, look, canvas, field, order, .. } = self;
        let bodies = Bodies::new(fit, &setting.kinds, canvas.size().iter().product(), frame.bodies.len());
        let [has_small, has_large] = bodies.has();
        let tone = bodies.tone();
        if has_small {
            let paint = Paint::new(look.color, setting, frame, self.range);
            field.reset(look.size);
            frame.bodies.iter().enumerate().for_each(|(i, row)| bodies.splat(field, row, || paint.color(i, row)));
            field.draw(canvas, &tone);
        }
        if has_large {
            let paint = Paint::new(look.color, setting, frame, self.range);
            // Where two meet in a pixel, the one with the higher name is upon the other, on whatever ranks they are.
            let seen = frame.bodies.iter().enumerate().filter(|(_, row)| bodies.is_seen(canvas, row));
            order.clear();
            order.extend(seen.map(|(i, row)| (row.id, i)));
            order.sort_unstable();
            order.iter().map(|&(_, i)| (i, &frame.bodies[i])).for_each(|(i, row)| {
                bodies.draw(canvas, row, || paint.color(i, row));
            });
        }
        let Some(live) = &frame.live else { return };
        if look.layers.ghosts {
            field.reset(look.size);
            live.ghosts.iter().for_each(|(row, _)| bodies.draw_ghost(canvas, field, row));
            field.draw(canvas, &tone);
        }
        if look.layers.contacts {
            field.reset(look.size);
            bodies::draw_contacts(canvas, field, &fit, bodies.widest(), live);
            field.draw(canvas, &Tone::new(0.5));
        }
    }

    fn draw_tiles(&mut self, frame: &Frame, fit: &Fit) {
        let unit = self.canvas.size()[1] / 1080.0;
        let edges = Edges::new(frame.partition(&self.setting), fit);
        edges.draw_grid(&mut self.canvas, unit);
        let mut ranks = take(&mut self.ranks);
        tiles::ranks_of_tiles(&self.setting, frame, &mut ranks);
        if ranks.iter().flatten().any(|rank| Some(*rank) != ranks[0]) {
            edges.outline_ranks(&mut self.canvas, &ranks, unit);
            edges.name_ranks(&mut self.canvas, &self.letters, &ranks, (22.0 * unit).max(10.0));
        }
        self.ranks = ranks;
    }
}
