//! Bodies, ghosts, contacts and what never moves.

use super::canvas::{Canvas, Field, Form, Rgb, Tone};
use super::colors;
use super::view::Fit;
use crate::folder::recording::Row;
use crate::look::frame::Live;
use atoll_core::{Kind, MOST_CORNERS, Rot, Shape, StaticBody};
use glam::{DVec2, Vec2};

/// What is wider than this, in pixels, is drawn as what it is.
pub(crate) const DRAWN: f64 = 2.0;
/// From this width on, in pixels, outlines and marks begin to show, and from twice as much they show fully.
const DETAILED: f64 = 5.0;
/// What is drawn as what it is, is never thinner, in pixels.
const THINNEST: f64 = 1.0;
/// How much of its color a sensor has: what is inside shows through.
pub(crate) const SHEER: f64 = 0.35;

/// What a body covers at least that is too small to be drawn, in pixels, so that it is seen: nearly a pixel, or where there are
/// many, as much as leaves nine tenths of the image free.
pub(crate) fn least_area(pixels: f64, bodies: usize) -> f64 {
    (0.1 * pixels / bodies.max(1) as f64).min(0.8)
}

/// How bodies come upon an image at some scale.
#[derive(Debug)]
pub(super) struct Bodies {
    fit: Fit,
    /// For each kind.
    kinds: Vec<Drawn>,
}

/// A kind as it is drawn.
#[derive(Debug)]
struct Drawn {
    shape: Shape,
    /// Its longest side, or its diameter, in pixels.
    width: f64,
    /// How wide it is where it is narrowest, in pixels.
    narrowest: f64,
    /// What it covers where it is too small to be drawn, in pixels.
    area: f64,
    /// How much of its color it has.
    part: f64,
    /// Of a circle around it, in pixels.
    reach: f64,
    /// Its parts, unless it is a circle or a box.
    outlines: Vec<(Vec<Vec2>, f32)>,
}

impl Drawn {
    fn new(kind: &Kind, scale: f64, least_area: f64) -> Self {
        let (shape, part) = (&kind.shape, if kind.sensor { SHEER } else { 1.0 });
        let narrowest = match shape {
            Shape::Circle { radius } => 2.0 * radius,
            Shape::Box { half } => 2.0 * half.min_element(),
            other => other.width(),
        };
        Self {
            shape: shape.clone(),
            width: f64::from(2.0 * shape.half_extents(Rot::IDENTITY).max_element()) * scale,
            narrowest: f64::from(narrowest) * scale,
            area: (f64::from(shape.area()) * scale * scale).max(least_area) * part,
            part,
            reach: f64::from(shape.bounding_radius()) * scale,
            outlines: outlines(shape),
        }
    }
}

impl Bodies {
    /// Of these kinds, on an image of so many pixels on which there are so many bodies.
    pub(super) fn new(fit: Fit, kinds: &[Kind], pixels: f64, bodies: usize) -> Self {
        let least = least_area(pixels, bodies);
        Self { fit, kinds: kinds.iter().map(|kind| Drawn::new(kind, fit.scale, least)).collect() }
    }

    /// How wide the widest kind is, in pixels.
    pub(super) fn widest(&self) -> f64 {
        self.kinds.iter().map(|kind| kind.width).fold(0.0, f64::max)
    }

    /// Whether some kinds are too small to be drawn, and whether some are not.
    pub(super) fn has(&self) -> [bool; 2] {
        let is_small = |kind: &Drawn| kind.width <= DRAWN;
        [self.kinds.iter().any(is_small), !self.kinds.iter().all(is_small)]
    }

    /// How strongly densities are drawn: the smaller the bodies, the more a few of them would else be lost. Where they are
    /// nearly large enough to be drawn, as they are.
    pub(super) fn tone(&self) -> Tone {
        let small = self.kinds.iter().map(|kind| kind.width).filter(|width| *width <= DRAWN);
        Tone::new(0.5 + 0.25 * small.fold(0.0, f64::max))
    }

    /// The kind of a body, unless it is not in the table.
    fn kind(&self, row: &Row) -> Option<&Drawn> {
        self.kinds.get(row.kind as usize)
    }

    /// Adds a body to the densities, if it is too small to be drawn.
    #[inline]
    pub(super) fn splat(&self, field: &mut Field, row: &Row, color: impl FnOnce() -> Rgb) {
        let Some(kind) = self.kind(row).filter(|kind| kind.width <= DRAWN) else { return };
        field.splat(self.fit.place(DVec2::new(row.x, row.y)), kind.area, color());
    }

    /// Draws a body, if it is not too small.
    pub(super) fn draw(&self, canvas: &mut Canvas, row: &Row, color: impl FnOnce() -> Rgb) {
        let Some((kind, center)) = self.seen(canvas, row) else { return };
        let (forms, axis) = self.forms(kind, center, row);
        let width = kind.narrowest;
        let detail = ((width - DETAILED) / DETAILED).clamp(0.0, 1.0);
        let color = color();
        let edge = color.mix(color.darker(), detail as f32);
        let border = (0.05 * width).clamp(0.8, 3.0);
        match &forms[..] {
            forms if detail == 0.0 => return forms.iter().for_each(|form| canvas.draw(form, color, kind.part)),
            [form] => canvas.draw_edged(form, color, kind.part, edge, border),
            forms if kind.part < 1.0 => forms.iter().for_each(|form| canvas.draw(form, color, kind.part)),
            // What is within another part has no edge there.
            forms => {
                forms.iter().for_each(|form| canvas.draw(form, edge, 1.0));
                forms.iter().for_each(|form| canvas.draw(&form.grown(-border), color, 1.0));
            }
        }
        let length = match kind.shape {
            Shape::Box { half } => f64::from(half.x) * self.fit.scale,
            // Where the center of a compound is, there may be nothing of it.
            Shape::Compound(_) => return,
            _ => 0.5 * width,
        };
        let mark = Form::line(center, axis, length, (0.07 * width).clamp(1.0, 6.0));
        canvas.draw(&mark, color.darker(), 0.9 * detail);
    }

    /// Draws the outline of a copy around the body that it copies, or adds it to the densities if it is too small.
    pub(super) fn draw_ghost(&self, canvas: &mut Canvas, field: &mut Field, row: &Row) {
        self.splat(field, row, || colors::GHOST);
        if let Some((kind, center)) = self.seen(canvas, row) {
            let width = (0.14 * kind.narrowest).clamp(1.0, 4.0);
            for form in self.forms(kind, center, row).0 {
                canvas.draw_ring(&form.grown(0.5 * width), width, colors::GHOST, 0.75);
            }
        }
    }

    /// Whether a body is drawn, and not too small or elsewhere.
    pub(super) fn is_seen(&self, canvas: &Canvas, row: &Row) -> bool {
        self.seen(canvas, row).is_some()
    }

    /// A body's parts on the image, and the direction of its first axis.
    fn forms(&self, kind: &Drawn, center: [f64; 2], row: &Row) -> (Vec<Form>, [f64; 2]) {
        forms(&kind.shape, &kind.outlines, center, Rot::from_angle(row.angle), self.fit.scale)
    }

    /// A body's kind and where it is on the image, unless it is too small or elsewhere.
    fn seen(&self, canvas: &Canvas, row: &Row) -> Option<(&Drawn, [f64; 2])> {
        let kind = self.kind(row).filter(|kind| kind.width > DRAWN)?;
        let center = self.fit.place(DVec2::new(row.x, row.y));
        let reach = kind.reach + 4.0;
        let is_seen = |axis: usize| !canvas.span(axis, center[axis] - reach, center[axis] + reach).is_empty();
        (is_seen(0) && is_seen(1)).then_some((kind, center))
    }
}

/// The parts of a shape that is neither a circle nor a box.
fn outlines(shape: &Shape) -> Vec<(Vec<Vec2>, f32)> {
    match shape {
        Shape::Circle { .. } | Shape::Box { .. } => Vec::new(),
        other => other.outlines(),
    }
}

/// The parts of a shape on the image, wide enough to be seen, and the direction of its first axis.
fn forms(
    shape: &Shape,
    outlines: &[(Vec<Vec2>, f32)],
    center: [f64; 2],
    rotation: Rot,
    scale: f64,
) -> (Vec<Form>, [f64; 2]) {
    let axis = [f64::from(rotation.c), -f64::from(rotation.s)];
    let hull = |(outline, radius): &(Vec<Vec2>, f32)| {
        let mut corners = [DVec2::ZERO; MOST_CORNERS];
        // Downwards is up there, and so what goes round one way goes round the other.
        for (to, &from) in corners.iter_mut().zip(outline.iter().rev()) {
            let from = from.as_dvec2() * scale;
            let turned = [axis[0] * from.x + axis[1] * from.y, axis[1] * from.x - axis[0] * from.y];
            *to = DVec2::from(center) + DVec2::from(turned);
        }
        let least = if outline.len() < 3 { 0.5 * THINNEST } else { 0.0 };
        Form::Hull { corners, count: outline.len(), radius: (f64::from(*radius) * scale).max(least) }
    };
    let forms = match *shape {
        Shape::Circle { radius } => vec![Form::Disc { center, radius: (f64::from(radius) * scale).max(THINNEST) }],
        Shape::Box { half } => {
            vec![Form::Box {
                center,
                axis,
                half: half.to_array().map(|half| (f64::from(half) * scale).max(0.5 * THINNEST)),
            }]
        }
        _ => outlines.iter().map(hull).collect(),
    };
    (forms, axis)
}

/// Adds what never moves to the densities: so there is no seam between what adjoins.
pub(super) fn draw_static(canvas: &Canvas, field: &mut Field, fit: &Fit, fixed: &StaticBody) {
    let shape = &fixed.kind.shape;
    for form in forms(shape, &outlines(shape), fit.place(fixed.position), fixed.rotation, fit.scale).0 {
        field.cover(canvas, &form, colors::STATIC);
    }
}

/// Draws where contacts are: dots whose area grows with the impulse; where bodies are too small, how many there are.
pub(super) fn draw_contacts(canvas: &mut Canvas, field: &mut Field, fit: &Fit, body: f64, live: &Live) {
    let mean =
        live.points.iter().map(|(_, impulse)| f64::from(*impulse)).sum::<f64>() / live.points.len().max(1) as f64;
    for &(point, impulse) in &live.points {
        let strength = (f64::from(impulse) / mean.max(f64::MIN_POSITIVE)).clamp(0.1, 6.0).sqrt();
        let radius = 0.075 * body * strength;
        let center = fit.place(point);
        let color = contact_color(strength);
        if radius < 0.8 {
            field.splat(center, std::f64::consts::PI * radius * radius, color);
        } else {
            let radius = radius.min(12.0);
            canvas.draw_edged(&Form::Disc { center, radius: radius + 0.8 }, color, 1.0, colors::PAPER, 0.8);
        }
    }
}

/// From the color of a weak contact to that of a strong one, of which the mean has 1.
pub(super) fn contact_color(strength: f64) -> Rgb {
    Rgb::hex(0xFFC928).mix(Rgb::hex(0xA8071A), (0.4 * strength).min(1.0) as f32)
}
