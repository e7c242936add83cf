//! `zoo`: every shape there is, falling into yards with everything that moves them: a ground that is a chain, a belt, a lift, a
//! paddle, a cart on a circle, and a sensor.
//!
//! Yards stand side by side, each with as many bodies. Bodies take three draws each, in this order: kind, shift along x, angle.

use super::random::SplitMix64;
use super::yards::corners;
use super::{Layout, statics};
use atoll_core::{
    Body, Dynamics, Filter, GlobalId, Kind, KindId, Material, Part, Path, Rot, Segment, Shape, StaticBody, Travel,
};
use glam::{DVec2, Vec2};
use std::f64::consts::TAU;

/// Bodies in a yard: columns and rows.
const COLUMNS: u64 = 11;
const ROWS: u64 = 15;
/// Between bodies at the start, in meters.
const SPACING: DVec2 = DVec2::new(2.0, 1.8);
/// The first of a yard, in meters from its low corner.
const FIRST: DVec2 = DVec2::new(2.0, 9.5);
/// A yard, in meters.
const YARD: DVec2 = DVec2::new(24.0, 40.0);
/// Thickness of the walls between yards, and their height, in meters.
const WALL: DVec2 = DVec2::new(0.5, 7.0);
/// Segments of the ground of a yard.
const SEGMENTS: u64 = 24;
/// Bodies begin turned by as much at most, in rad.
const TURNED: f64 = 0.5;
/// Bodies begin beside their place by as much at most, in meters.
const SHIFT: f64 = 0.1;
/// Draws of one body.
const DRAWS: u64 = 3;
/// How many kinds there are.
const KINDS: usize = 12;

/// The layout of `zoo`.
#[derive(Debug)]
pub(super) struct Zoo {
    bodies: u64,
}

impl Zoo {
    pub(super) fn new(bodies: u64) -> Self {
        Self { bodies }
    }

    fn yards(&self) -> u64 {
        self.bodies.div_ceil(COLUMNS * ROWS)
    }

    fn place(index: u64) -> DVec2 {
        let (yard, within) = (index / (COLUMNS * ROWS), index % (COLUMNS * ROWS));
        let (row, column) = (within / COLUMNS, within % COLUMNS);
        DVec2::new(YARD.x * yard as f64, 0.0) + FIRST + SPACING * DVec2::new(column as f64, row as f64)
    }
}

fn solid(shape: Shape) -> Kind {
    Kind::new(shape, Material::default())
}

/// A polygon whose corners lie on a circle.
fn regular(corners: u32, radius: f32) -> Shape {
    let corner = |number| {
        let Rot { c, s } = Rot::from_angle(number as f32 / corners as f32 * std::f32::consts::TAU);
        Vec2::new(c, s) * radius
    };
    Shape::polygon(&(0..corners).map(corner).collect::<Vec<_>>(), 0.0).expect("corners on a circle")
}

fn part(shape: Shape, x: f32, y: f32, angle: f32) -> Part {
    Part { shape, position: Vec2::new(x, y), rotation: Rot::from_angle(angle) }
}

/// The kinds, in the order of the table.
fn kinds() -> [Kind; KINDS] {
    let rounded = [(-0.25, -0.15), (0.25, -0.15), (0.25, 0.15), (-0.25, 0.15)].map(|(x, y)| Vec2::new(x, y));
    let wedge = [(0.0, 0.0), (0.9, 0.0), (0.0, 0.5)].map(|(x, y)| Vec2::new(x, y));
    let dumbbell = vec![
        part(Shape::rectangle(0.7, 0.12), 0.0, 0.0, 0.0),
        part(Shape::circle(0.22), -0.45, 0.0, 0.0),
        part(Shape::circle(0.22), 0.45, 0.0, 0.0),
    ];
    let hook = vec![
        part(Shape::rectangle(0.9, 0.2), 0.0, 0.0, 0.0),
        part(Shape::rectangle(0.2, 0.6), 0.35, 0.4, 0.0),
        part(regular(3, 0.25), -0.45, 0.25, 0.3),
    ];
    let compound = |parts| solid(Shape::compound(parts).expect("a few convex parts"));
    let polygon = |points: &[Vec2], radius| solid(Shape::polygon(points, radius).expect("corners of a polygon"));
    let bouncy = Material { restitution: 0.6, ..Material::default() };
    let icy = Material { friction: 0.05, ..Material::default() };
    let upright = Dynamics { fixed_rotation: true, gravity_scale: 0.5, ..Dynamics::default() };
    let syrupy = Dynamics { linear_damping: 0.5, angular_damping: 2.0, ..Dynamics::default() };
    [
        Kind::new(Shape::circle(0.3), bouncy),
        solid(Shape::rectangle(0.6, 0.6)),
        polygon(&wedge, 0.0),
        solid(regular(5, 0.4)),
        Kind::new(regular(8, 0.4), icy),
        solid(Shape::capsule(0.6, 0.2).expect("a capsule")),
        polygon(&rounded, 0.1),
        compound(dumbbell),
        compound(hook),
        Kind { dynamics: upright, ..solid(regular(6, 0.35)) },
        Kind { dynamics: syrupy, ..solid(Shape::capsule(0.3, 0.15).expect("a capsule")) },
        // They go through each other, and through no one else.
        Kind { filter: Filter { group: -1, ..Filter::default() }, ..solid(Shape::rectangle(0.8, 0.3)) },
    ]
}

/// How high the ground is, seen from a yard's low corner.
fn ground(x: f64) -> f64 {
    1.5 + 0.5 * libm::cos(TAU * x / YARD.x) + 0.2 * libm::cos(TAU * 5.0 * x / YARD.x)
}

impl Layout for Zoo {
    fn bodies(&self) -> u64 {
        self.bodies
    }

    fn kinds(&self) -> Vec<Kind> {
        kinds().to_vec()
    }

    fn domain(&self) -> (DVec2, DVec2) {
        (DVec2::ZERO, YARD * DVec2::new(self.yards() as f64, 1.0))
    }

    fn statics(&self) -> Vec<StaticBody> {
        let mut all = Vec::new();
        let (_, high) = self.domain();
        for yard in 0..self.yards() {
            let corner = DVec2::new(YARD.x * yard as f64, 0.0);
            let at = |number: u64| {
                let x = YARD.x * number as f64 / SEGMENTS as f64;
                DVec2::new(x, ground(x)).as_vec2()
            };
            for number in 0..SEGMENTS {
                // The ground goes on from yard to yard, and back to the left at its ends.
                let before = if number == 0 { at(SEGMENTS - 1) - Vec2::X * YARD.x as f32 } else { at(number - 1) };
                let after = if number + 1 == SEGMENTS { at(1) + Vec2::X * YARD.x as f32 } else { at(number + 2) };
                let (segment, middle) = Segment::new(Some(before), at(number), at(number + 1), Some(after))
                    .expect("points of a chain, all apart");
                let place = corner + middle.as_dvec2();
                all.push(StaticBody::new(GlobalId(all.len() as u64), solid(Shape::Segment(segment)), place));
            }
            let mut put = |kind: Kind, x: f64, y: f64, path: Option<Path>| {
                let id = GlobalId(all.len() as u64);
                all.push(StaticBody { path, ..StaticBody::new(id, kind, corner + DVec2::new(x, y)) });
            };
            let phase = (0.1 * yard as f64).fract();
            let still = |travel| Some(Path { travel, turning: 0.0 });
            let mut belt = solid(Shape::capsule(5.0, 0.2).expect("a capsule"));
            belt.material.surface_speed = 1.5;
            put(belt, 5.0, 4.5, None);
            // Nothing comes so near to the ground that a body would have no room between them.
            let lift = Travel::Sine { amplitude: DVec2::new(0.0, 1.2), period: 6.0, phase };
            put(solid(Shape::rectangle(3.0, 0.4)), 11.0, 5.6, still(lift));
            put(solid(Shape::rectangle(4.0, 0.3)), 16.0, 6.2, Some(Path { travel: Travel::Rest, turning: 1.0 }));
            let cart = Travel::Circle { radius: 1.0, period: 5.0, phase };
            put(solid(regular(6, 0.6)), 21.0, 5.6, still(cart));
            put(Kind { sensor: true, ..solid(Shape::rectangle(6.0, 1.5)) }, 12.0, 7.5, None);
            let wall = statics::wall(GlobalId(0), DVec2::ZERO, WALL);
            put(wall.kind, 0.0, 0.5 * WALL.y, None);
        }
        // What would fall off at the ends of it all is kept by higher walls.
        for (low, high) in [
            (DVec2::new(-2.0, -2.0), DVec2::new(0.0, 2.0 * YARD.y)),
            (DVec2::new(high.x, -2.0), DVec2::new(high.x + 2.0, 2.0 * YARD.y)),
        ] {
            all.push(statics::wall(GlobalId(all.len() as u64), low, high));
        }
        all
    }

    fn body(&self, index: u64, id: GlobalId, seed: u64) -> Body {
        let mut random = SplitMix64::after(seed, DRAWS * index);
        let kind = KindId(random.below(KINDS as f32) as u32);
        let shift = random.within(SHIFT);
        let rotation = Rot::from_angle(random.within(TURNED) as f32);
        let position = Self::place(index) + DVec2::X * shift;
        Body { id, position, rotation, velocity: Vec2::ZERO, angular_velocity: 0.0, kind }
    }

    fn extent(&self, first: u64, last: u64) -> (DVec2, DVec2) {
        let [low, high] = corners(first, last, COLUMNS * ROWS, COLUMNS).map(Self::place);
        (low - DVec2::X * SHIFT, high + DVec2::X * SHIFT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn there_is_one_of_everything() {
        let zoo = Zoo::new(1000);
        let kinds: BTreeSet<u32> = (0..1000).map(|index| zoo.body(index, GlobalId(index), 1).kind.0).collect();
        assert_eq!(kinds.len(), zoo.kinds().len());
        let statics = zoo.statics();
        assert_eq!(statics.len() as u64, 7 * (SEGMENTS + 6) + 2);
        let count = |is: fn(&StaticBody) -> bool| statics.iter().filter(|fixed| is(fixed)).count();
        assert_eq!(count(|fixed| fixed.path.is_some()), 21);
        assert_eq!(count(|fixed| fixed.kind.sensor), 7);
        assert_eq!(count(|fixed| fixed.kind.material.surface_speed != 0.0), 7);
    }
}
