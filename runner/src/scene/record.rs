//! Kinds and paths as recordings and snapshots hold them, in JSON: every number as the shortest decimal that leads back to its bits.
//!
//! A shape is known by its key, and whatever other keys a newer program may write are passed over.

use atoll_core::{Dynamics, Filter, Kind, MOST_CORNERS, Material, Part, Path, Polygon, Rot, Segment, Shape, Travel};
use glam::Vec2;
use serde::{Deserialize, Serialize};

/// A [`Kind`]. It has one shape.
#[derive(Clone, PartialEq, Default, Debug, Serialize, Deserialize)]
pub(crate) struct KindText {
    /// Half the width and half the height.
    #[serde(rename = "box", skip_serializing_if = "Option::is_none")]
    half: Option<[f32; 2]>,
    /// Radius.
    #[serde(skip_serializing_if = "Option::is_none")]
    circle: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    polygon: Option<PolygonText>,
    #[serde(skip_serializing_if = "Option::is_none")]
    segment: Option<SegmentText>,
    /// Of a compound.
    #[serde(skip_serializing_if = "Option::is_none")]
    parts: Option<Vec<PartText>>,
    density: f32,
    friction: f32,
    restitution: f32,
    #[serde(default, skip_serializing_if = "is_zero")]
    surface_speed: f32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    dynamics: Option<DynamicsText>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    filter: Option<FilterText>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    sensor: bool,
    /// What a scene calls it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) name: Option<String>,
}

#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
struct PolygonText {
    corners: Vec<[f32; 2]>,
    radius: f32,
}

#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
struct SegmentText {
    ends: [[f32; 2]; 2],
    before: Option<[f32; 2]>,
    after: Option<[f32; 2]>,
}

/// A part of a compound: a box, a circle or a polygon at its place.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
struct PartText {
    #[serde(rename = "box", skip_serializing_if = "Option::is_none")]
    half: Option<[f32; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    circle: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    polygon: Option<PolygonText>,
    position: [f32; 2],
    /// Cosine and sine.
    rotation: [f32; 2],
}

#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
struct DynamicsText {
    gravity_scale: f32,
    linear_damping: f32,
    angular_damping: f32,
    fixed_rotation: bool,
}

#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
struct FilterText {
    categories: u32,
    mask: u32,
    group: i32,
}

/// Whether it is the usual zero, to the bit.
fn is_zero(number: &f32) -> bool {
    number.to_bits() == 0
}

fn pairs(points: &[Vec2]) -> Vec<[f32; 2]> {
    points.iter().map(Vec2::to_array).collect()
}

impl KindText {
    pub(crate) fn new(kind: &Kind) -> Self {
        let &Kind { ref shape, material, dynamics, filter, sensor } = kind;
        let Material { density, friction, restitution, surface_speed } = material;
        let mut text = Self { density, friction, restitution, surface_speed, sensor, ..Self::default() };
        match shape {
            Shape::Box { half } => text.half = Some(half.to_array()),
            Shape::Circle { radius } => text.circle = Some(*radius),
            Shape::Polygon(polygon) => text.polygon = Some(PolygonText::new(polygon)),
            Shape::Segment(segment) => {
                let [before, after] =
                    [segment.before(), segment.after()].map(|point| point.map(|point| point.to_array()));
                text.segment = Some(SegmentText { ends: segment.ends().map(|end| end.to_array()), before, after });
            }
            Shape::Compound(compound) => text.parts = Some(compound.parts().iter().map(PartText::new).collect()),
        }
        if dynamics != Dynamics::default() {
            let Dynamics { gravity_scale, linear_damping, angular_damping, fixed_rotation } = dynamics;
            text.dynamics = Some(DynamicsText { gravity_scale, linear_damping, angular_damping, fixed_rotation });
        }
        if filter != Filter::default() {
            let Filter { categories, mask, group } = filter;
            text.filter = Some(FilterText { categories, mask, group });
        }
        text
    }

    /// None if it has no shape that is known, or several, or one that cannot be.
    pub(crate) fn read(&self) -> Option<Kind> {
        let Self { half, circle, polygon, segment, parts, .. } = self;
        let shape = match (half, circle, polygon, segment, parts) {
            (_, _, _, None, None) => convex(half, circle, polygon)?,
            (None, None, None, Some(segment), None) => segment.read()?,
            (None, None, None, None, Some(parts)) => {
                Shape::compound(parts.iter().map(PartText::read).collect::<Option<_>>()?).ok()?
            }
            _ => return None,
        };
        let &Self { density, friction, restitution, surface_speed, sensor, .. } = self;
        let material = Material { density, friction, restitution, surface_speed };
        let dynamics = self.dynamics.map_or_else(Dynamics::default, |text| {
            let DynamicsText { gravity_scale, linear_damping, angular_damping, fixed_rotation } = text;
            Dynamics { gravity_scale, linear_damping, angular_damping, fixed_rotation }
        });
        let filter = self.filter.map_or_else(Filter::default, |FilterText { categories, mask, group }| Filter {
            categories,
            mask,
            group,
        });
        Some(Kind { shape, material, dynamics, filter, sensor })
    }
}

/// The one of three that is there.
fn convex(half: &Option<[f32; 2]>, circle: &Option<f32>, polygon: &Option<PolygonText>) -> Option<Shape> {
    match (half, circle, polygon) {
        (Some(half), None, None) => Some(Shape::Box { half: Vec2::from_array(*half) }),
        (None, Some(radius), None) => Some(Shape::Circle { radius: *radius }),
        (None, None, Some(polygon)) if polygon.corners.len() <= MOST_CORNERS => {
            let corners: Vec<Vec2> = polygon.corners.iter().copied().map(Vec2::from_array).collect();
            Shape::polygon(&corners, polygon.radius).ok()
        }
        _ => None,
    }
}

impl PolygonText {
    fn new(polygon: &Polygon) -> Self {
        Self { corners: pairs(polygon.corners()), radius: polygon.radius() }
    }
}

impl SegmentText {
    fn read(&self) -> Option<Shape> {
        let [from, to] = self.ends.map(Vec2::from_array);
        let seen = |point: Option<[f32; 2]>| point.map(Vec2::from_array);
        let (segment, _) = Segment::new(seen(self.before), from, to, seen(self.after)).ok()?;
        Some(Shape::Segment(segment))
    }
}

impl PartText {
    fn new(part: &Part) -> Self {
        let (mut half, mut circle, mut polygon) = (None, None, None);
        match &part.shape {
            Shape::Box { half: size } => half = Some(size.to_array()),
            Shape::Circle { radius } => circle = Some(*radius),
            Shape::Polygon(shape) => polygon = Some(PolygonText::new(shape)),
            Shape::Segment(_) | Shape::Compound(_) => unreachable!("no part of a compound is one of these"),
        }
        let Rot { c, s } = part.rotation;
        Self { half, circle, polygon, position: part.position.to_array(), rotation: [c, s] }
    }

    fn read(&self) -> Option<Part> {
        let [c, s] = self.rotation;
        let shape = convex(&self.half, &self.circle, &self.polygon)?;
        Some(Part { shape, position: Vec2::from_array(self.position), rotation: Rot { c, s } })
    }
}

/// A [`Path`]: how its center moves, if it does, by the key of the way, and how fast it turns.
#[derive(Clone, PartialEq, Default, Debug, Serialize, Deserialize)]
pub(crate) struct PathText {
    /// Velocity.
    #[serde(skip_serializing_if = "Option::is_none")]
    line: Option<[f64; 2]>,
    /// Amplitude.
    #[serde(skip_serializing_if = "Option::is_none")]
    sine: Option<[f64; 2]>,
    /// Radius.
    #[serde(skip_serializing_if = "Option::is_none")]
    circle: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    period: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    phase: Option<f64>,
    turning: f64,
}

impl PathText {
    pub(crate) fn new(&Path { travel, turning }: &Path) -> Self {
        let still = Self { turning, ..Self::default() };
        match travel {
            Travel::Rest => still,
            Travel::Line { velocity } => Self { line: Some(velocity.to_array()), ..still },
            Travel::Sine { amplitude, period, phase } => {
                Self { sine: Some(amplitude.to_array()), period: Some(period), phase: Some(phase), ..still }
            }
            Travel::Circle { radius, period, phase } => {
                Self { circle: Some(radius), period: Some(period), phase: Some(phase), ..still }
            }
        }
    }

    /// None if it is none.
    pub(crate) fn read(&self) -> Option<Path> {
        let travel = match (self.line, self.sine, self.circle, self.period, self.phase) {
            (None, None, None, None, None) => Travel::Rest,
            (Some(velocity), None, None, None, None) => Travel::Line { velocity: velocity.into() },
            (None, Some(amplitude), None, Some(period), Some(phase)) => {
                Travel::Sine { amplitude: amplitude.into(), period, phase }
            }
            (None, None, Some(radius), Some(period), Some(phase)) => Travel::Circle { radius, period, phase },
            _ => return None,
        };
        Some(Path { travel, turning: self.turning }).filter(Path::is_valid)
    }
}
