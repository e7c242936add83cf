//! Draws what a page looks at, or a part of it: bodies of more than two pixels as what they are, for the page to draw, smaller
//! ones as how much of each pixel they cover. One pass over bodies, and a few operations for each that is small.

use super::protocol::{Dot, Gaze};
use crate::look::frame::Setting;
use crate::look::picture::{DRAWN, Field, Rgb, SHEER, Tone, View, least_area};
use atoll_core::{Kind, Region, Rot};
use glam::DVec2;

/// Columns and rows of an image: from, and up to but without.
pub(super) type Pixels = [[u32; 2]; 2];

/// How a kind is drawn.
#[derive(Clone, Copy, Debug)]
enum Size {
    /// As so many pixels.
    Small(f64),
    /// As what it is.
    Large,
}

/// What is kept from one sketch to the next: memory.
#[derive(Default, Debug)]
pub(super) struct Paper {
    field: Field,
}

/// A sketch under way.
#[derive(Debug)]
pub(super) struct Sketch<'a> {
    paper: &'a mut Paper,
    /// That of the paper, while it is drawn on: papers of ranks may lie beside each other, and who writes there has his neighbours wait.
    field: Field,
    /// Whether its densities are to be there soon rather than smooth.
    coarse: bool,
    /// Of each kind.
    sizes: Vec<Size>,
    tone: Tone,
    /// Pixels of a meter in the image of densities.
    scale: f64,
    /// What is drawn of the whole image.
    pixels: Pixels,
    /// Where that begins: left and top, in the world.
    origin: DVec2,
    /// What the places of dots are fractions of: a little more than what is looked at, so that who is half in it is there.
    rectangle: View,
    /// Fractions of it in a meter.
    per_meter: DVec2,
    dots: Vec<Dot>,
}

/// A part of what a page looks at, drawn.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Portion {
    /// What part of the image it has.
    pub pixels: Pixels,
    /// Its densities: four bytes for each pixel, or nothing if there are none.
    pub density: Vec<u8>,
    /// Its bodies.
    pub dots: Vec<Dot>,
}

/// What the places of dots in a frame are fractions of.
pub(super) fn rectangle(setting: &Setting, gaze: &Gaze) -> View {
    let radius = setting.kinds.iter().map(|kind| f64::from(kind.shape.bounding_radius())).fold(0.0, f64::max);
    let grown = DVec2::splat(radius + 1.0 / scale(gaze));
    View { low: gaze.view.low - grown, high: gaze.view.high + grown }
}

/// Pixels of a meter.
fn scale(gaze: &Gaze) -> f64 {
    f64::from(gaze.size[0]) / (gaze.view.high.x - gaze.view.low.x)
}

impl Gaze {
    /// The size of some pixels of an image of densities, and the rectangle that they cover.
    pub(super) fn part(&self, [columns, rows]: Pixels) -> ([u32; 2], View) {
        let size = DVec2::from(self.size.map(f64::from));
        let pixel = (self.view.high - self.view.low) / size * f64::from(self.coarseness);
        let from_left = |column: u32| self.view.low.x + pixel.x * f64::from(column);
        let from_top = |row: u32| self.view.high.y - pixel.y * f64::from(row);
        let low = DVec2::new(from_left(columns[0]), from_top(rows[1]));
        let high = DVec2::new(from_left(columns[1]), from_top(rows[0]));
        ([columns[1] - columns[0], rows[1] - rows[0]], View { low, high })
    }
}

impl<'a> Sketch<'a> {
    /// Of what lies in some regions, or anywhere, of so many bodies in all.
    pub(super) fn new(
        paper: &'a mut Paper,
        setting: &Setting,
        gaze: &Gaze,
        bodies: usize,
        regions: Option<impl Iterator<Item = Region>>,
    ) -> Self {
        let scale = scale(gaze) / f64::from(gaze.coarseness);
        let drawn = DRAWN / f64::from(gaze.coarseness);
        let width = |radius: f32| f64::from(radius) * 2.0 * scale;
        let mut widest = 0.0_f64;
        let image = gaze.size.map(|length| f64::from(length) / f64::from(gaze.coarseness)).iter().product();
        let least = least_area(image, bodies);
        let size = |kind: &Kind| {
            let shape = &kind.shape;
            let longest = width(shape.half_extents(Rot::IDENTITY).max_element());
            if longest > drawn {
                return Size::Large;
            }
            widest = widest.max(longest);
            Size::Small((f64::from(shape.area()) * scale * scale).max(least) * if kind.sensor { SHEER } else { 1.0 })
        };
        let sizes: Vec<_> = setting.kinds.iter().map(size).collect();
        let rectangle = rectangle(setting, gaze);
        let has_small = sizes.iter().any(|size| matches!(size, Size::Small(_)));
        let pixels = if has_small { pixels(gaze, scale, regions) } else { [[0; 2]; 2] };
        let [columns, rows] = pixels;
        let mut field = std::mem::take(&mut paper.field);
        field.reset([columns[1] - columns[0], rows[1] - rows[0]]);
        let corner = DVec2::new(f64::from(columns[0]), -f64::from(rows[0])) / scale;
        Self {
            paper,
            field,
            coarse: gaze.coarseness > 1,
            sizes,
            // As pictures of runs are drawn.
            tone: Tone::new(0.5 + 0.25 * widest),
            scale,
            pixels,
            origin: DVec2::new(gaze.view.low.x, gaze.view.high.y) + corner,
            rectangle,
            per_meter: 65_535.0 / (rectangle.high - rectangle.low),
            dots: Vec::new(),
        }
    }

    /// Whether something in this region can be seen.
    pub(super) fn sees(&self, region: &Region) -> bool {
        region.min.cmplt(self.rectangle.high).all() && region.max.cmpgt(self.rectangle.low).all()
    }

    /// Draws a body.
    #[inline]
    pub(super) fn add(&mut self, position: DVec2, kind: u32, turn: impl FnOnce() -> u16, color: impl FnOnce() -> Rgb) {
        match self.sizes.get(kind as usize) {
            Some(&Size::Small(area)) => {
                let from = (position - self.origin) * self.scale;
                let place = [from.x, -from.y];
                if self.coarse {
                    self.field.dot(place, area, color);
                } else {
                    self.field.dab(place, area, color);
                }
            }
            Some(Size::Large) => {
                let place = (position - self.rectangle.low) * self.per_meter;
                if place.cmpge(DVec2::ZERO).all() && place.cmple(DVec2::splat(65_535.0)).all() {
                    let place = [place.x, place.y].map(|along| (along + 0.5) as u16);
                    let [shape, high] = [kind as u16, (kind >> 16) as u16];
                    self.dots.push(Dot { place, angle: turn(), shape, color: color().0, shape_high: high as u8 });
                }
            }
            None => {}
        }
    }

    /// What was drawn.
    pub(super) fn finish(self) -> Portion {
        let density = if self.field.is_empty() { Vec::new() } else { self.field.toned(&self.tone) };
        self.paper.field = self.field;
        Portion { pixels: self.pixels, density, dots: self.dots }
    }
}

/// The pixels that may have something of what lies in some regions.
fn pixels(gaze: &Gaze, scale: f64, regions: Option<impl Iterator<Item = Region>>) -> Pixels {
    let size = gaze.size.map(|length| length.div_ceil(gaze.coarseness));
    let all = [[0, size[0]], [0, size[1]]];
    let Some(regions) = regions else { return all };
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for region in regions {
        (low, high) = (low.min(region.min), high.max(region.max));
    }
    // What is small covers at most two pixels more; bodies may have left their tiles by a little.
    let near = 3.0 + 0.02 * f64::from(size[0].max(size[1]));
    let span = |from: f64, to: f64, most: u32| {
        let [from, to] = [from - near, to + near].map(|edge| edge.clamp(0.0, f64::from(most)) as u32);
        [from, (to + 1).clamp(from, most)]
    };
    let View { low: least, high: most } = gaze.view;
    [
        span((low.x - least.x) * scale, (high.x - least.x) * scale, size[0]),
        span((most.y - high.y) * scale, (most.y - low.y) * scale, size[1]),
    ]
}

/// A rotation in parts of a turn, of which there are 65,536: to two of them, and quicker than an exact arc tangent.
#[inline]
pub(super) fn turn(Rot { c, s }: Rot) -> u16 {
    let (x, y) = (c.abs(), s.abs());
    let (least, most) = if x < y { (x, y) } else { (y, x) };
    let z = least / if most > 0.0 { most } else { 1.0 };
    // A fit of the arc tangent from 0 to 1.
    let z2 = z * z;
    let fit = ((((-0.011_721_2 * z2 + 0.052_653_32) * z2 - 0.116_432_87) * z2 + 0.193_543_46) * z2 - 0.332_623_47) * z2;
    let eighth = z * (fit + 0.999_977_26) * (0.5 / std::f32::consts::PI);
    let quarter = if x < y { 0.25 - eighth } else { eighth };
    let half = if c < 0.0 { 0.5 - quarter } else { quarter };
    let whole = if s < 0.0 { 1.0 - half } else { half };
    (whole * 65_536.0 + 0.5) as u32 as u16
}

/// An angle in rad in the same parts.
#[inline]
pub(super) fn turn_of_angle(angle: f32) -> u16 {
    let turns = angle * (0.5 / std::f32::consts::PI);
    ((turns - turns.floor()) * 65_536.0 + 0.5) as u32 as u16
}

/// Puts parts of an image together: its own part of the whole, and its pixels.
pub(super) fn compose<'p>(parts: impl Iterator<Item = (Pixels, &'p [u8])> + Clone) -> (Pixels, Vec<u8>) {
    let parts = parts.filter(|(_, density)| !density.is_empty());
    let all = parts.clone().map(|(pixels, _)| pixels).reduce(|[x, y], [columns, rows]| {
        let join = |a: [u32; 2], b: [u32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        [join(x, columns), join(y, rows)]
    });
    let Some(all @ [columns, rows]) = all else { return ([[0; 2]; 2], Vec::new()) };
    let width = (columns[1] - columns[0]) as usize;
    let mut image = vec![0; width * (rows[1] - rows[0]) as usize * 4];
    for ([part_columns, part_rows], density) in parts {
        let part_width = (part_columns[1] - part_columns[0]) as usize * 4;
        let left = (part_columns[0] - columns[0]) as usize * 4;
        for (row, from) in (part_rows[0] - rows[0]..).zip(density.chunks_exact(part_width.max(4))) {
            let start = row as usize * width * 4 + left;
            lay_over(&mut image[start..start + part_width], from);
        }
    }
    (all, image)
}

/// Lays pixels over others.
fn lay_over(under: &mut [u8], over: &[u8]) {
    for (under, over) in under.as_chunks_mut::<4>().0.iter_mut().zip(over.as_chunks::<4>().0) {
        if *under == [0; 4] {
            *under = *over;
        } else if *over != [0; 4] {
            let through = 255 - u32::from(over[3]);
            for (under, over) in under.iter_mut().zip(over) {
                *under = (u32::from(*over) + (u32::from(*under) * through + 127) / 255).min(255) as u8;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_those_of_angles() {
        for i in 0..100_000_u32 {
            let angle = (i as f32 / 100_000.0 - 0.5) * 2.0 * std::f32::consts::PI;
            let [fast, exact] = [turn(Rot::from_angle(angle)), turn_of_angle(angle)];
            let apart = fast.wrapping_sub(exact);
            assert!(apart.min(apart.wrapping_neg()) <= 2, "{angle}: {fast} {exact}");
        }
        assert_eq!([0.0, -0.0, 1e9].map(turn_of_angle)[..2], [0, 0]);
    }

    #[test]
    fn coarse_densities_lie_where_fine_ones_do() {
        let setting = Setting {
            partition: atoll_core::Partition::uniform(DVec2::ZERO, DVec2::splat(100.0), 1, 1).unwrap(),
            kinds: vec![atoll_core::Kind::new(atoll_core::Shape::circle(0.05), atoll_core::Material::default())],
            names: Vec::new(),
            statics: Vec::new(),
            hertz: 60.0,
        };
        let view = View { low: DVec2::new(10.0, 20.0), high: DVec2::new(81.0, 67.0) };
        let place = DVec2::new(33.3, 44.4);
        for coarseness in [1, 2, 4] {
            // Not to be divided by four.
            let gaze = Gaze { view, size: [71, 47], color: crate::look::picture::ColorBy::Kind, coarseness };
            let mut paper = Paper::default();
            let mut sketch = Sketch::new(&mut paper, &setting, &gaze, 1, None::<std::iter::Empty<Region>>);
            sketch.add(place, 0, || 0, || Rgb([255, 0, 0]));
            let portion = sketch.finish();
            let ([columns, rows], covered) = gaze.part(portion.pixels);
            assert_eq!(portion.density.len(), 4 * (columns * rows) as usize);
            let pixel = (covered.high - covered.low) / DVec2::new(columns.into(), rows.into());
            assert!((pixel - f64::from(coarseness)).abs().max_element() < 1e-9);
            let (mut mean, mut sum) = (DVec2::ZERO, 0.0);
            for (i, density) in portion.density.as_chunks::<4>().0.iter().enumerate() {
                let (column, row) = (i % columns as usize, i / columns as usize);
                let center = DVec2::new(column as f64 + 0.5, rows as f64 - row as f64 - 0.5) * pixel + covered.low;
                mean += center * f64::from(density[3]);
                sum += f64::from(density[3]);
            }
            assert!((mean / sum - place).abs().max_element() <= 0.5 * pixel.x, "{} {place}", mean / sum);
        }
    }

    #[test]
    fn parts_of_an_image_lie_where_they_are_and_over_each_other() {
        let red = [200, 0, 0, 255].repeat(4);
        let half = [0, 64, 0, 128].repeat(4);
        let parts = [([[2, 4], [1, 3]], &red[..]), ([[3, 5], [2, 4]], &half[..]), ([[0, 9], [0, 9]], &[][..])];
        let (pixels, image) = compose(parts.into_iter());
        assert_eq!((pixels, image.len()), ([[2, 5], [1, 4]], 36));
        let at = |x: usize, y: usize| &image[(y * 3 + x) * 4..][..4];
        assert_eq!((at(0, 0), at(2, 0), at(1, 1)), (&[200, 0, 0, 255][..], &[0; 4][..], &[100, 64, 0, 255][..]));
        assert_eq!((at(2, 2), at(0, 2)), (&[0, 64, 0, 128][..], &[0; 4][..]));
        assert_eq!(compose(std::iter::empty()), ([[0; 2]; 2], Vec::new()));
    }
}
