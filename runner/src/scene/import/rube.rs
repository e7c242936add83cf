//! Box2D worlds as R.U.B.E. saves them: JSON with bodies that have fixtures.
//!
//! What is not there is zero, a vector may be the number 0, and a number may be a text: the bits of 32 in hexadecimal digits.

use super::super::{Place, SceneError};
use super::Imported;
use crate::scene::file::chain_of;
use atoll_core::{
    Body, Compound, Dynamics, Filter, GlobalId, Kind, KindId, Material, Part, Path as Course, Polygon, Rot, Shape,
    StaticBody, Travel,
};
use glam::{DVec2, Vec2};
use serde_json::{Map, Value};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};
use std::path::Path;

/// How far corners and centers may be off, as a part of the size.
const SLACK: f64 = 1e-4;

/// How far a mass may be off from that of shape and density, as a part of it.
const MASS_SLACK: f64 = 1e-3;

/// Of more corners no polygon is looked at.
const MOST_CORNERS: usize = 1000;

/// Every category of Box2D.
const ALL_BITS: u32 = 0xffff;

/// Around everything there is, this part of its size is domain as well.
const AROUND: f64 = 0.25;

/// Reads a world.
///
/// # Errors
/// If it is none.
pub(super) fn read(path: &Path, text: &str) -> Result<Imported, SceneError> {
    let value: Value = serde_json::from_str(text).map_err(|error| {
        let place = Place { line: Some(error.line() as u64), ..Place::default() };
        SceneError::bad(path, place, format!("it is no JSON: {error}"))
    })?;
    let world = value.as_object().filter(|world| world.get("body").is_some_and(Value::is_array));
    let world = world.ok_or_else(|| {
        SceneError::whole(
            path,
            "it is no world that R.U.B.E. has exported: it has no list called body; export it as JSON",
        )
    })?;
    let mut imported = Imported { gravity: Some(vector(world, "gravity").to_array()), ..Imported::default() };
    for (list, what) in [("joint", "joints"), ("image", "images")] {
        imported.leave_out(what, world.get(list).and_then(Value::as_array).map_or(0, Vec::len) as u64);
    }
    let bodies = world["body"].as_array().into_iter().flatten().enumerate();
    for (number, body) in bodies.filter_map(|(number, body)| Some((number, body.as_object()?))) {
        add(&mut imported, body);
        let Imported { statics, bodies, numbers: [of_statics, of_bodies], .. } = &mut imported;
        of_statics.resize(statics.len(), number);
        of_bodies.resize(bodies.len(), number);
    }
    // Statics have the lowest ids, as in scenes that are made.
    let first = imported.statics.len() as u64;
    for (id, fixed) in (0..).zip(&mut imported.statics) {
        fixed.id = GlobalId(id);
    }
    for (id, body) in (first..).zip(&mut imported.bodies) {
        body.id = GlobalId(id);
    }
    imported.domain = domain(&imported);
    imported.check(path)?;
    Ok(imported)
}

/// Everything that is in a list of that name.
fn objects<'a>(of: &'a Map<String, Value>, name: &str) -> impl Iterator<Item = &'a Map<String, Value>> {
    of.get(name).and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_object)
}

/// A number, in digits or as bits.
fn as_number(value: &Value) -> f64 {
    match value {
        Value::String(bits) if bits.len() <= 8 => {
            u32::from_str_radix(bits, 16).map_or(f64::NAN, |bits| f32::from_bits(bits).into())
        }
        Value::Number(number) => number.as_f64().unwrap_or(f64::NAN),
        _ => f64::NAN,
    }
}

/// A number, zero if it is not there.
fn number(of: &Map<String, Value>, name: &str) -> f64 {
    of.get(name).map_or(0.0, as_number)
}

/// A vector, zero if it is not there.
fn vector(of: &Map<String, Value>, name: &str) -> DVec2 {
    match of.get(name) {
        Some(Value::Object(vector)) => DVec2::new(number(vector, "x"), number(vector, "y")),
        Some(other) => DVec2::splat(as_number(other)),
        None => DVec2::ZERO,
    }
}

fn is_true(of: &Map<String, Value>, name: &str) -> bool {
    of.get(name).and_then(Value::as_bool).unwrap_or(false)
}

/// A fixture as it is known here: a shape, where its center is in its body, and how it is turned there, in radians.
struct Placed {
    kind: Kind,
    center: DVec2,
    angle: f64,
}

/// A fixture, of which a chain has many segments, or what it is that there is no counterpart for.
fn fixture(of: &Map<String, Value>) -> Result<Vec<Placed>, &'static str> {
    let [density, friction, restitution] = ["density", "friction", "restitution"].map(|name| number(of, name) as f32);
    let material = Material { density, friction, restitution, ..Material::default() };
    let kind = |shape| Kind { filter: filter(of), sensor: is_true(of, "sensor"), ..Kind::new(shape, material) };
    let object = |name: &str| of.get(name).and_then(Value::as_object);
    if let Some(circle) = object("circle") {
        let shape = Shape::circle(number(circle, "radius") as f32);
        return Ok(vec![Placed { kind: kind(shape), center: vector(circle, "center"), angle: 0.0 }]);
    }
    if let Some(polygon) = object("polygon") {
        const NONE: &str = "polygons that cannot be, or have too many corners";
        let corners = vertices(polygon).filter(|corners| corners.len() <= MOST_CORNERS).ok_or(NONE)?;
        if let Some((shape, center, angle)) = rectangle(&corners) {
            return Ok(vec![Placed { kind: kind(shape), center, angle }]);
        }
        let corners: Vec<Vec2> = corners.iter().map(|corner| corner.as_vec2()).collect();
        let (polygon, center) = Polygon::hull(&corners, 0.0).map_err(|_| NONE)?;
        return Ok(vec![Placed { kind: kind(Shape::Polygon(polygon)), center: center.as_dvec2(), angle: 0.0 }]);
    }
    if let Some(segments) = lines(object("chain"), object("edge")) {
        let segments = segments.map_err(|_| "chains and edges that cannot be")?;
        let placed = |(shape, center)| Placed { kind: kind(shape), center, angle: 0.0 };
        return Ok(segments.into_iter().map(placed).collect());
    }
    Err("fixtures without a shape")
}

/// Whom a fixture touches. A mask of all the bits that there are in Box2D is one of all.
fn filter(of: &Map<String, Value>) -> Filter {
    let usual = Filter::default();
    let bits = |name: &str, usual: u32| of.get(name).map_or(usual, |value| as_number(value) as u32);
    let mask = match bits("filter-maskBits", usual.mask) {
        ALL_BITS => usual.mask,
        mask => mask,
    };
    let group = number(of, "filter-groupIndex") as i32;
    Filter { categories: bits("filter-categoryBits", usual.categories), mask, group }
}

/// The segments of a chain or an edge. Both of their sides are solid there, and here one: so each is there twice, once each way.
fn lines(
    chain: Option<&Map<String, Value>>,
    edge: Option<&Map<String, Value>>,
) -> Option<Result<Vec<(Shape, DVec2)>, String>> {
    let (mut points, is_loop) = match (chain, edge) {
        (Some(chain), _) => {
            let mut points = vertices(chain).unwrap_or_default();
            // A closed one ends where it began.
            let is_loop = points.len() > 3 && points.first() == points.last();
            points.truncate(points.len() - usize::from(is_loop));
            (points, is_loop)
        }
        (None, Some(edge)) => (["vertex1", "vertex2"].map(|name| vector(edge, name)).to_vec(), false),
        (None, None) => return None,
    };
    if points.len() < 2 || !points.iter().all(|point| point.is_finite()) {
        return Some(Err("it has no two points".to_owned()));
    }
    let ways = [false, true].map(|back| {
        if back {
            points.reverse();
        }
        chain_of(&points, is_loop)
    });
    let segments = ways.into_iter().collect::<Result<Vec<_>, _>>();
    Some(segments.map(|ways| ways.into_iter().flatten().map(|(shape, center, _)| (shape, center)).collect()))
}

/// The points of a list.
fn vertices(of: &Map<String, Value>) -> Option<Vec<DVec2>> {
    let vertices = of.get("vertices")?.as_object()?;
    let along = |name: &str| Some(vertices.get(name)?.as_array()?.iter().map(as_number).collect::<Vec<f64>>());
    let (x, y) = (along("x")?, along("y")?);
    (x.len() == y.len()).then(|| x.into_iter().zip(y).map(|(x, y)| DVec2::new(x, y)).collect())
}

/// The rectangle that a polygon is, if it is one.
fn rectangle(corners: &[DVec2]) -> Option<(Shape, DVec2, f64)> {
    let &[a, b, c, d] = corners else { return None };
    let (first, second) = (b - a, c - b);
    let (width, height) = (first.length(), second.length());
    let slack = SLACK * (width + height);
    let closes = (a + second - d).length() <= slack;
    if !(closes && first.dot(second).abs() <= SLACK * width * height && width > 0.0 && height > 0.0) {
        return None;
    }
    let center = (a + b + c + d) / 4.0;
    // The same rectangle, turned as little as can be.
    let turns = (first.to_angle() / FRAC_PI_2).round();
    let angle = first.to_angle() - turns * FRAC_PI_2;
    let (width, height) = if turns.rem_euclid(2.0) == 0.0 { (width, height) } else { (height, width) };
    debug_assert!(angle.abs() <= FRAC_PI_4 + 1e-9);
    let angle = if angle.abs() < SLACK { 0.0 } else { angle };
    Some((Shape::rectangle(width as f32, height as f32), center, angle))
}

/// Takes a body in, or counts it.
fn add(imported: &mut Imported, body: &Map<String, Value>) {
    if body.get("active").and_then(Value::as_bool) == Some(false) {
        return imported.leave_out("bodies that are not active", 1);
    }
    let mut placed = Vec::new();
    for of in objects(body, "fixture") {
        match fixture(of) {
            Ok(of_fixture) => placed.extend(of_fixture),
            Err(what) => imported.leave_out(what, 1),
        }
    }
    match number(body, "type") {
        0.0 => placed.into_iter().for_each(|placed| add_static(imported, body, placed, None)),
        2.0 => add_dynamic(imported, body, placed),
        _ => add_kinematic(imported, body, placed),
    }
}

/// A fixture of a body that no other moves is a static of its own.
fn add_static(imported: &mut Imported, body: &Map<String, Value>, placed: Placed, path: Option<Course>) {
    let (place, angle) = (vector(body, "position"), number(body, "angle"));
    let Placed { mut kind, center, angle: turned } = placed;
    // Of no account: nothing moves it.
    kind.material.density = 1.0;
    let is_on_circle = path.is_some_and(|path| matches!(path.travel, Travel::Circle { .. }));
    let offset = if is_on_circle { DVec2::ZERO } else { DVec2::from_angle(angle).rotate(center) };
    let rotation = turn(angle + turned);
    imported.statics.push(StaticBody { rotation, path, ..StaticBody::new(GlobalId(0), kind, place + offset) });
}

/// What moves whatever it meets goes on as it does at first.
fn add_kinematic(imported: &mut Imported, body: &Map<String, Value>, placed: Vec<Placed>) {
    let (velocity, turning) = (vector(body, "linearVelocity"), number(body, "angularVelocity"));
    let is_centered =
        |placed: &Placed| placed.center.length() <= SLACK * f64::from(placed.kind.shape.bounding_radius());
    let is_line = |placed: &Placed| matches!(placed.kind.shape, Shape::Segment(_));
    if velocity == DVec2::ZERO && turning == 0.0 {
        return placed.into_iter().for_each(|placed| add_static(imported, body, placed, None));
    }
    let along = Course { travel: Travel::Line { velocity }, turning };
    if turning == 0.0 || placed.iter().all(is_centered) {
        return placed.into_iter().for_each(|placed| add_static(imported, body, placed, Some(along)));
    }
    if placed.iter().any(is_line) {
        return imported.leave_out("chains and edges that turn", 1);
    }
    let Some(whole) = whole(imported, placed) else { return };
    let path = if is_centered(&whole) {
        along
    } else if velocity == DVec2::ZERO {
        // Its center goes round that of its body.
        let phase = (number(body, "angle") + whole.center.to_angle()) / TAU;
        Course { travel: Travel::Circle { radius: whole.center.length(), period: TAU / turning, phase }, turning }
    } else {
        return imported.leave_out("kinematic bodies that turn, off their center, as they go", 1);
    };
    add_static(imported, body, whole, Some(path));
}

/// All fixtures of a body as one, if there is any: of one material, whose density leads to the mass that they have together.
fn whole(imported: &mut Imported, mut placed: Vec<Placed>) -> Option<Placed> {
    let count = placed.len();
    if placed.iter().any(|placed| !placed.kind.sensor) {
        placed.retain(|placed| !placed.kind.sensor);
    }
    imported.leave_out("sensors on bodies of other fixtures", (count - placed.len()) as u64);
    if placed.len() < 2 {
        imported.leave_out("bodies without a fixture", placed.is_empty().into());
        return placed.pop();
    }
    let of = |placed: &Placed| (Material { density: 0.0, ..placed.kind.material }, placed.kind.filter);
    let first = &placed[0];
    let are_alike = placed.iter().all(|other| of(other) == of(first));
    imported.leave_out("materials or filters that differ within a body", (!are_alike).into());
    let are_as_dense = placed.iter().all(|other| other.kind.material.density == first.kind.material.density);
    imported.leave_out("densities that differ within a body", (!are_as_dense).into());
    let mut kind = first.kind.clone();
    if !are_as_dense {
        let area: f32 = placed.iter().map(|placed| placed.kind.shape.area()).sum();
        kind.material.density =
            placed.iter().map(|placed| placed.kind.material.density * (placed.kind.shape.area() / area)).sum();
    }
    let part = |Placed { kind, center, angle }: Placed| Part {
        shape: kind.shape,
        position: center.as_vec2(),
        rotation: turn(angle),
    };
    let Ok((compound, center)) = Compound::new(placed.into_iter().map(part).collect()) else {
        imported.leave_out("bodies of too many fixtures, or of some that cannot be", 1);
        return None;
    };
    kind.shape = Shape::Compound(compound);
    Some(Placed { kind, center: center.as_dvec2(), angle: 0.0 })
}

fn add_dynamic(imported: &mut Imported, body: &Map<String, Value>, placed: Vec<Placed>) {
    if placed.iter().any(|placed| matches!(placed.kind.shape, Shape::Segment(_))) {
        return imported.leave_out("chains and edges on bodies that move", 1);
    }
    let Some(Placed { mut kind, center, angle: turned }) = whole(imported, placed) else { return };
    let size = f64::from(kind.shape.bounding_radius());
    let center = if center.length() <= SLACK * size { DVec2::ZERO } else { center };
    if kind.material.density <= 0.0 {
        return imported.leave_out("bodies without a density", 1);
    }
    let mass = f64::from(kind.material.density * kind.shape.area());
    let told = number(body, "massData-mass");
    imported.leave_out("masses of their own", u64::from(told != 0.0 && (told / mass - 1.0).abs() > MASS_SLACK));
    kind.dynamics = Dynamics {
        gravity_scale: body.get("gravityScale").map_or(1.0, |scale| as_number(scale) as f32),
        linear_damping: number(body, "linearDamping") as f32,
        angular_damping: number(body, "angularDamping") as f32,
        fixed_rotation: is_true(body, "fixedRotation"),
    };
    let name =
        || body.get("name").and_then(Value::as_str).map(str::trim).filter(|name| is_name(name)).map(str::to_owned);
    let (angle, row) = (number(body, "angle"), imported.row(kind, 0, name));
    imported.bodies.push(Body {
        id: GlobalId(0),
        position: vector(body, "position") + DVec2::from_angle(angle).rotate(center),
        rotation: turn(angle + turned),
        velocity: vector(body, "linearVelocity").as_vec2(),
        angular_velocity: number(body, "angularVelocity") as f32,
        kind: KindId(row),
    });
}

/// Whether a kind may be called so.
fn is_name(name: &str) -> bool {
    !name.is_empty() && name.parse::<u64>().is_err()
}

fn turn(angle: f64) -> Rot {
    Rot::from_angle(angle as f32)
}

/// Around all there is: a file of R.U.B.E. has no bounds.
fn domain(imported: &Imported) -> (DVec2, DVec2) {
    let half = |shape: &Shape, rotation: Rot| shape.half_extents(rotation).as_dvec2();
    let statics = imported.statics.iter().map(|fixed| (fixed.position, half(&fixed.kind.shape, fixed.rotation)));
    let shape = |body: &Body| half(&imported.kinds[body.kind.0 as usize].shape, body.rotation);
    let bodies = imported.bodies.iter().map(|body| (body.position, shape(body)));
    let all = statics.chain(bodies).map(|(place, half)| (place - half, place + half));
    let (low, high) = all.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or((DVec2::ZERO, DVec2::ZERO));
    let around = (high - low).max_element().max(1.0) * AROUND;
    (low - around, high + around)
}
