//! What rank 0 asks all ranks in a meeting, and what each answers of its world.

use super::figures::Part;
use super::protocol::{Dot, Gaze};
use super::sketch::{Paper, Pixels, Sketch, turn};
use crate::look::convex::to_convex;
use crate::look::frame::Setting;
use crate::look::picture::{ColorBy, Range, Rgb, Tint};
use crate::rank::Held;
use atoll_core::{Body, GlobalId, Shape, TileView, World};
use bytemuck::{Pod, Zeroable};
use glam::{DVec2, Vec2};
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};

/// The scale of speeds and spins is made from so many bodies of a rank, at most.
const SAMPLE: usize = 512;

/// A question.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub(super) enum Question {
    /// What some bodies have of what these colors measure.
    Measure(ColorBy),
    /// What a page sees.
    Look {
        /// What it looks at.
        gaze: Gaze,
        /// What has the last color of the scale.
        most: f32,
        /// How many bodies there are, about.
        bodies: u64,
    },
    /// The body of that name, or else the nearest to a place, at most so far from it, in m.
    Find(Option<u64>, [f64; 2], f64),
    /// How it goes.
    Figures,
}

/// A body that was looked for, as one rank knows it.
#[derive(Clone, Copy, PartialEq, Default, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Found {
    pub id: u64,
    pub place: [f64; 2],
    /// From the place that was asked for to its outline, in m; negative within.
    pub distance: f64,
    /// In m/s.
    pub velocity: [f32; 2],
    /// In rad, and in rad/s.
    pub angle: f32,
    pub spin: f32,
    pub kind: u32,
    pub tile: u32,
    pub contacts: u32,
    /// 0: no; 1: yes; 2: nobody may.
    pub asleep: u32,
}

/// The head of an answer to [`Question::Look`]; densities follow, then dots.
#[derive(Clone, Copy, PartialEq, Default, Debug, Pod, Zeroable)]
#[repr(C)]
struct Head {
    /// How long drawing took, in ns.
    took: u64,
    pixels: Pixels,
    density: u64,
    dots: u64,
}

/// What a rank answers.
pub(super) fn answer(question: &Question, setting: &Setting, held: &Held<'_>, paper: &mut Paper) -> Vec<u8> {
    match *question {
        Question::Measure(by) => bytemuck::cast_slice(&measure(by, held.world)).to_vec(),
        Question::Look { gaze, most, bodies } => look(&gaze, (most, bodies), setting, held, paper),
        Question::Find(id, place, reach) => {
            let found = find(id, DVec2::from(place), reach, setting, held.world);
            found.map_or(Vec::new(), |found| bytemuck::bytes_of(&found).to_vec())
        }
        Question::Figures => bytemuck::bytes_of(&Part::new(held)).to_vec(),
    }
}

/// Speeds or spins of some bodies.
fn measure(by: ColorBy, world: &World) -> Vec<f32> {
    let bodies: usize = world.views().map(|tile| tile.bodies().len()).sum();
    let every = bodies / SAMPLE + 1;
    let sample = world.views().flat_map(|tile| tile.bodies().step_by(every));
    sample.map(|body| by.measure(body.velocity.x, body.velocity.y, body.angular_velocity)).collect()
}

fn look(gaze: &Gaze, (most, bodies): (f32, u64), setting: &Setting, held: &Held<'_>, paper: &mut Paper) -> Vec<u8> {
    let begun = Instant::now();
    let regions = held.world.views().map(|tile| held.world.partition().region(tile.id()));
    let mut sketch = Sketch::new(paper, setting, gaze, bodies as usize, Some(regions));
    let tint = Tint::new(gaze.color, Range { most });
    let kinds: Vec<Rgb> = (0..setting.kinds.len() as u32).map(Tint::numbered).collect();
    let rank = Tint::numbered(held.rank.0);
    for tile in held.world.views() {
        if !sketch.sees(&held.world.partition().region(tile.id())) {
            continue;
        }
        let of_tile = Tint::tile(tile.id(), held.world.partition());
        let counts = if gaze.color == ColorBy::Contacts { contacts(&tile) } else { Vec::new() };
        let asleep = tile.asleep();
        // One loop for each, that each is quick.
        match gaze.color {
            ColorBy::Kind => draw(&mut sketch, &tile, |_, body| kinds[body.kind.0 as usize]),
            ColorBy::Speed | ColorBy::Spin => {
                draw(&mut sketch, &tile, |_, body| tint.moving(body.velocity.x, body.velocity.y, body.angular_velocity))
            }
            ColorBy::Tile => draw(&mut sketch, &tile, |_, _| of_tile),
            ColorBy::Rank => draw(&mut sketch, &tile, |_, _| rank),
            ColorBy::Contacts => draw(&mut sketch, &tile, |i, _| Tint::contacts(counts[i])),
            ColorBy::Asleep => {
                draw(&mut sketch, &tile, |i, _| Tint::asleep(Some(asleep.get(i).copied().unwrap_or(false))))
            }
        }
    }
    let portion = sketch.finish();
    let dots: &[u8] = bytemuck::cast_slice(&portion.dots);
    let [density, bodies] = [portion.density.len(), portion.dots.len()].map(|count| count as u64);
    let head = Head { took: begun.elapsed().as_nanos() as u64, pixels: portion.pixels, density, dots: bodies };
    [bytemuck::bytes_of(&head), &portion.density, dots].concat()
}

/// Draws the bodies of a tile, each in the color that it has.
fn draw(sketch: &mut Sketch<'_>, tile: &TileView<'_>, color: impl Fn(usize, &Body) -> Rgb) {
    for (i, body) in tile.bodies().enumerate() {
        sketch.add(body.position, body.kind.0, || turn(body.rotation), || color(i, &body));
    }
}

/// For each body of a tile how many press upon it.
fn contacts(tile: &TileView<'_>) -> Vec<u16> {
    let mut counts = vec![0_u16; tile.bodies().len()];
    for contact in tile.contacts().filter(|contact| contact.normal_impulse > 0.0) {
        for body in contact.owned.into_iter().flatten() {
            counts[body] = counts[body].saturating_add(1);
        }
    }
    counts
}

/// A part of a frame, as a rank has answered it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Answered<'a> {
    /// How long drawing it took.
    pub took: Duration,
    /// What part of the image of densities it has.
    pub pixels: Pixels,
    /// That, four bytes for each pixel, or nothing if there are none.
    pub density: &'a [u8],
    /// Its bodies, as [`Dot`]s.
    pub dots: &'a [u8],
}

/// Reads an answer to [`Question::Look`]. None if it is none.
pub(super) fn portion(answer: &[u8]) -> Option<Answered<'_>> {
    let (head, rest) = answer.split_at_checked(size_of::<Head>())?;
    let head: Head = bytemuck::pod_read_unaligned(head);
    let (density, dots) = rest.split_at_checked(usize::try_from(head.density).ok()?)?;
    let part = Answered { took: Duration::from_nanos(head.took), pixels: head.pixels, density, dots };
    (dots.len() as u64 == head.dots * size_of::<Dot>() as u64).then_some(part)
}

fn find(id: Option<u64>, place: DVec2, reach: f64, setting: &Setting, world: &World) -> Option<Found> {
    let near = |tile: &TileView<'_>| {
        let radius = setting.kinds.iter().map(|kind| f64::from(kind.shape.bounding_radius())).fold(0.0, f64::max);
        let (region, far) = (world.partition().region(tile.id()), DVec2::splat(reach + 2.0 * radius));
        id.is_some() || ((region.min - far).cmple(place).all() && (region.max + far).cmpge(place).all())
    };
    let mut best: Option<(f64, TileView<'_>, usize, Body)> = None;
    for tile in world.views().filter(near) {
        for (i, body) in tile.bodies().enumerate() {
            let distance = match id {
                Some(id) if body.id == GlobalId(id) => f64::NEG_INFINITY,
                Some(_) => continue,
                None => distance(&setting.kinds[body.kind.0 as usize].shape, &body, place),
            };
            if distance <= reach && best.as_ref().is_none_or(|best| distance < best.0) {
                best = Some((distance, tile, i, body));
            }
        }
    }
    let (distance, tile, i, body) = best?;
    Some(Found {
        distance,
        tile: tile.id().0,
        contacts: contacts(&tile)[i].into(),
        asleep: tile.asleep().get(i).map_or(2, |&asleep| asleep.into()),
        ..Found::of(&body)
    })
}

impl Found {
    /// What a body itself tells.
    pub(super) fn of(body: &Body) -> Self {
        Self {
            id: body.id.0,
            place: body.position.to_array(),
            velocity: body.velocity.to_array(),
            angle: body.rotation.angle(),
            spin: body.angular_velocity,
            kind: body.kind.0,
            ..Self::default()
        }
    }
}

/// From a place to the outline of a body, in m; negative within.
pub(super) fn distance(shape: &Shape, body: &Body, place: DVec2) -> f64 {
    let from = place - body.position;
    let (c, s) = (f64::from(body.rotation.c), f64::from(body.rotation.s));
    let own = DVec2::new(c * from.x + s * from.y, c * from.y - s * from.x);
    match shape {
        Shape::Circle { radius } => from.length() - f64::from(*radius),
        Shape::Box { half } => {
            let beyond = own.abs() - half.as_dvec2();
            beyond.max(DVec2::ZERO).length() + beyond.max_element().min(0.0)
        }
        other => {
            let to_part = |(corners, radius): (Vec<Vec2>, f32)| {
                let corners: Vec<DVec2> = corners.into_iter().map(Vec2::as_dvec2).collect();
                to_convex(&corners, own) - f64::from(radius)
            };
            other.outlines().into_iter().map(to_part).fold(f64::INFINITY, f64::min)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use atoll_core::{KindId, Part, Rot};

    #[test]
    fn distances_are_to_the_outline() {
        let body = Body {
            rotation: Rot::from_angle(std::f32::consts::FRAC_PI_2),
            ..Body::at_rest(GlobalId(1), KindId(0), DVec2::new(10.0, 10.0))
        };
        let part = |x| Part { shape: Shape::circle(1.0), position: Vec2::new(x, 0.0), rotation: Rot::IDENTITY };
        let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec2::new(x, y));
        let capsule = Shape::capsule(4.0, 0.5).unwrap();
        // All of them stand upright now.
        for (shape, x, y, expected) in [
            (Shape::rectangle(4.0, 1.0), 10.0, 13.0, 1.0),
            (Shape::polygon(&square, 0.0).unwrap(), 10.0, 10.25, -0.75),
            (Shape::polygon(&square, 0.5).unwrap(), 12.0, 10.0, 0.5),
            (capsule.clone(), 10.0, 13.0, 0.5),
            (capsule, 10.0, 11.0, -0.5),
            (Shape::compound(vec![part(-3.0), part(3.0)]).unwrap(), 10.0, 10.0, 2.0),
            (Shape::compound(vec![part(-3.0), part(3.0)]).unwrap(), 10.0, 13.5, -0.5),
        ] {
            let found = distance(&shape, &body, DVec2::new(x, y));
            assert!((found - expected).abs() < 1e-5, "{shape:?} from {x}, {y}: {found}");
        }
    }
}
