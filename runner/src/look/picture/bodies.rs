//! Bodies, ghosts, contacts and what never moves.

use super::canvas::{Canvas, Field, Form, Rgb, Tone};
use super::colors;
use super::view::Fit;
use crate::folder::recording::Row;
use crate::look::frame::Live;
use atoll_core::{Rot, Shape, StaticBody};
use glam::DVec2;

/// What is wider than this, in pixels, is drawn as what it is.
pub(crate) const DRAWN: f64 = 2.0;
/// From this width on, in pixels, outlines and marks begin to show, and from twice as much they show fully.
const DETAILED: f64 = 5.0;
/// A static is never drawn thinner, in pixels.
const THINNEST: f64 = 1.0;

/// How bodies come upon an image at some scale.
#[derive(Debug)]
pub(super) struct Bodies {
    fit: Fit,
    /// For each kind.
    shapes: Vec<Shape>,
}

impl Bodies {
    pub(super) fn new(fit: Fit, shapes: impl Iterator<Item = Shape>) -> Self {
        Self { fit, shapes: shapes.collect() }
    }

    /// How wide the widest kind is, in pixels.
    pub(super) fn widest(&self) -> f64 {
        self.shapes.iter().map(|shape| self.width(shape)).fold(0.0, f64::max)
    }

    /// Whether some kinds are too small to be drawn, and whether some are not.
    pub(super) fn has(&self) -> [bool; 2] {
        let is_small = |shape: &Shape| self.width(shape) <= DRAWN;
        [self.shapes.iter().any(is_small), !self.shapes.iter().all(is_small)]
    }

    /// How strongly densities are drawn: the smaller the bodies, the more a few of them would else be lost. Where they are
    /// nearly large enough to be drawn, as they are.
    pub(super) fn tone(&self) -> Tone {
        let small = self.shapes.iter().map(|shape| self.width(shape)).filter(|width| *width <= DRAWN);
        Tone::new(0.5 + 0.25 * small.fold(0.0, f64::max))
    }

    /// The longest side of a shape, or its diameter, in pixels.
    fn width(&self, shape: &Shape) -> f64 {
        let width = match shape {
            Shape::Circle { radius } => 2.0 * radius,
            Shape::Box { half } => 2.0 * half.max_element(),
        };
        f64::from(width) * self.fit.scale
    }

    /// The shape of a body, unless it has a kind that is not in the table.
    fn shape(&self, row: &Row) -> Option<&Shape> {
        self.shapes.get(row.kind as usize)
    }

    /// Adds a body to the densities, if it is too small to be drawn.
    #[inline]
    pub(super) fn splat(&self, field: &mut Field, row: &Row, color: impl FnOnce() -> Rgb) {
        let Some(shape) = self.shape(row).filter(|shape| self.width(shape) <= DRAWN) else { return };
        let area = f64::from(shape.area()) * self.fit.scale * self.fit.scale;
        field.splat(self.fit.place(DVec2::new(row.x, row.y)), area, color());
    }

    /// Draws a body, if it is not too small.
    pub(super) fn draw(&self, canvas: &mut Canvas, row: &Row, color: impl FnOnce() -> Rgb) {
        let Some((form, axis)) = self.form(canvas, row) else { return };
        let width = narrowest(&form);
        let detail = ((width - DETAILED) / DETAILED).clamp(0.0, 1.0);
        let color = color();
        let edge = color.mix(color.darker(), detail as f32);
        if detail == 0.0 {
            return canvas.draw(&form, color, 1.0);
        }
        canvas.draw_edged(&form, color, edge, (0.05 * width).clamp(0.8, 3.0));
        let (center, length) = match form {
            Form::Box { center, half, .. } => (center, half[0]),
            Form::Disc { center, radius } => (center, radius),
            Form::Plate { .. } => return,
        };
        let mark = Form::line(center, axis, length, (0.07 * width).clamp(1.0, 6.0));
        canvas.draw(&mark, color.darker(), 0.9 * detail);
    }

    /// Draws the outline of a copy around the body that it copies, or adds it to the densities if it is too small.
    pub(super) fn draw_ghost(&self, canvas: &mut Canvas, field: &mut Field, row: &Row) {
        self.splat(field, row, || colors::GHOST);
        if let Some((form, _)) = self.form(canvas, row) {
            let width = (0.14 * narrowest(&form)).clamp(1.0, 4.0);
            canvas.draw_ring(&form.grown(0.5 * width), width, colors::GHOST, 0.75);
        }
    }

    /// Whether a body is drawn, and not too small or elsewhere.
    pub(super) fn is_seen(&self, canvas: &Canvas, row: &Row) -> bool {
        self.seen(canvas, row).is_some()
    }

    /// A body's shape on the image and the direction of its first axis, unless it is too small or elsewhere.
    fn form(&self, canvas: &Canvas, row: &Row) -> Option<(Form, [f64; 2])> {
        let (shape, center) = self.seen(canvas, row)?;
        Some(form(shape, center, Rot::from_angle(row.angle), self.fit.scale))
    }

    /// A body's shape and where it is on the image, unless it is too small or elsewhere.
    fn seen(&self, canvas: &Canvas, row: &Row) -> Option<(&Shape, [f64; 2])> {
        let shape = self.shape(row).filter(|shape| self.width(shape) > DRAWN)?;
        let center = self.fit.place(DVec2::new(row.x, row.y));
        let reach = f64::from(shape.bounding_radius()) * self.fit.scale + 4.0;
        let is_seen = |axis: usize| !canvas.span(axis, center[axis] - reach, center[axis] + reach).is_empty();
        (is_seen(0) && is_seen(1)).then_some((shape, center))
    }
}

/// A shape on the image, and the direction of its first axis.
fn form(shape: &Shape, center: [f64; 2], rotation: Rot, scale: f64) -> (Form, [f64; 2]) {
    let axis = [f64::from(rotation.c), -f64::from(rotation.s)];
    let form = match *shape {
        Shape::Circle { radius } => Form::Disc { center, radius: f64::from(radius) * scale },
        Shape::Box { half } => Form::Box { center, axis, half: half.to_array().map(|half| f64::from(half) * scale) },
    };
    (form, axis)
}

/// The shortest side, or the diameter.
fn narrowest(form: &Form) -> f64 {
    match form {
        Form::Disc { radius, .. } => 2.0 * radius,
        Form::Box { half, .. } => 2.0 * half[0].min(half[1]),
        Form::Plate { .. } => 0.0,
    }
}

/// Adds what never moves to the densities, wide enough to be seen: so there is no seam between what adjoins.
pub(super) fn draw_static(canvas: &Canvas, field: &mut Field, fit: &Fit, fixed: &StaticBody) {
    let form = match form(&fixed.kind.shape, fit.place(fixed.position), fixed.rotation, fit.scale).0 {
        Form::Disc { center, radius } => Form::Disc { center, radius: radius.max(THINNEST) },
        Form::Box { center, axis, half } => Form::Box { center, axis, half: half.map(|half| half.max(0.5 * THINNEST)) },
        plate @ Form::Plate { .. } => plate,
    };
    field.cover(canvas, &form, colors::STATIC);
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
            canvas.draw_edged(&Form::Disc { center, radius: radius + 0.8 }, color, colors::PAPER, 0.8);
        }
    }
}

/// From the color of a weak contact to that of a strong one, of which the mean has 1.
pub(super) fn contact_color(strength: f64) -> Rgb {
    Rgb::hex(0xFFC928).mix(Rgb::hex(0xA8071A), (0.4 * strength).min(1.0) as f32)
}
