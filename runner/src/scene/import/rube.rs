//! Box2D worlds as R.U.B.E. saves them: JSON with bodies that have fixtures.
//!
//! What is not there is zero, a vector may be the number 0, and a number may be a text: the bits of 32 in hexadecimal digits.

use super::super::{Place, SceneError};
use super::Imported;
use atoll_core::{Body, GlobalId, Kind, KindId, Material, Rot, Shape, StaticBody};
use glam::{DVec2, Vec2};
use serde_json::{Map, Value};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::path::Path;

/// How far corners and centers may be off, as a part of the size.
const SLACK: f64 = 1e-4;

/// How far a mass may be off from that of shape and density, as a part of it.
const MASS_SLACK: f64 = 1e-3;

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
    for body in objects(world, "body") {
        add(&mut imported, body);
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

/// A fixture, or what it is that there is no counterpart for.
fn fixture(of: &Map<String, Value>) -> Result<Placed, &'static str> {
    if is_true(of, "sensor") {
        return Err("sensors");
    }
    let [density, friction, restitution] = ["density", "friction", "restitution"].map(|name| number(of, name) as f32);
    let material = Material { density, friction, restitution };
    if let Some(circle) = of.get("circle").and_then(Value::as_object) {
        let shape = Shape::circle(number(circle, "radius") as f32);
        return Ok(Placed { kind: Kind { shape, material }, center: vector(circle, "center"), angle: 0.0 });
    }
    let Some(polygon) = of.get("polygon").and_then(Value::as_object) else {
        return Err(if of.contains_key("chain") || of.contains_key("edge") {
            "chains and edges"
        } else {
            "fixtures without a shape"
        });
    };
    let (shape, center, angle) = rectangle(polygon).ok_or("polygons that are no rectangles")?;
    Ok(Placed { kind: Kind { shape, material }, center, angle })
}

/// The rectangle that a polygon is, if it is one.
fn rectangle(polygon: &Map<String, Value>) -> Option<(Shape, DVec2, f64)> {
    let vertices = polygon.get("vertices")?.as_object()?;
    let along = |name: &str| Some(vertices.get(name)?.as_array()?.iter().map(as_number).collect::<Vec<f64>>());
    let (x, y) = (along("x")?, along("y")?);
    if x.len() != 4 || y.len() != 4 {
        return None;
    }
    let corner = |k: usize| DVec2::new(x[k], y[k]);
    let (first, second) = (corner(1) - corner(0), corner(2) - corner(1));
    let (width, height) = (first.length(), second.length());
    let slack = SLACK * (width + height);
    let closes = (corner(0) + second - corner(3)).length() <= slack;
    if !(closes && first.dot(second).abs() <= SLACK * width * height && width > 0.0 && height > 0.0) {
        return None;
    }
    let center = (corner(0) + corner(1) + corner(2) + corner(3)) / 4.0;
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
    let fixtures: Vec<&Map<String, Value>> = objects(body, "fixture").collect();
    for fixture in &fixtures {
        let filtered = number(fixture, "filter-groupIndex") != 0.0
            || ["filter-categoryBits", "filter-maskBits"].iter().any(|name| fixture.contains_key(*name));
        imported.leave_out("filters of collisions", filtered.into());
    }
    match number(body, "type") {
        0.0 => add_static(imported, body, &fixtures),
        2.0 => add_dynamic(imported, body, &fixtures),
        _ => imported.leave_out("kinematic bodies", 1),
    }
}

/// Each of its fixtures is a static of its own.
fn add_static(imported: &mut Imported, body: &Map<String, Value>, fixtures: &[&Map<String, Value>]) {
    let (place, angle) = (vector(body, "position"), number(body, "angle"));
    for of in fixtures {
        match fixture(of) {
            Ok(Placed { mut kind, center, angle: turned }) => {
                // Of no account: it never moves.
                kind.material.density = 1.0;
                let position = place + DVec2::from_angle(angle).rotate(center);
                let rotation = turn(angle + turned);
                imported.statics.push(StaticBody { id: GlobalId(0), position, rotation, kind });
            }
            Err(what) => imported.leave_out(what, 1),
        }
    }
}

fn add_dynamic(imported: &mut Imported, body: &Map<String, Value>, fixtures: &[&Map<String, Value>]) {
    let [only] = fixtures else {
        let what = if fixtures.is_empty() { "bodies without a fixture" } else { "bodies of several fixtures" };
        return imported.leave_out(what, 1);
    };
    let Placed { kind, center, angle } = match fixture(only) {
        Ok(placed) => placed,
        Err(what) => return imported.leave_out(what, 1),
    };
    let size = f64::from(kind.shape.bounding_radius()).abs();
    if center.length() > SLACK * size {
        return imported.leave_out("fixtures off the center of their body", 1);
    }
    if kind.material.density <= 0.0 {
        return imported.leave_out("bodies without a density", 1);
    }
    let mass = f64::from(kind.material.density * kind.shape.area());
    let told = number(body, "massData-mass");
    imported.leave_out("masses of their own", u64::from(told != 0.0 && (told / mass - 1.0).abs() > MASS_SLACK));
    let damped = number(body, "linearDamping") != 0.0 || number(body, "angularDamping") != 0.0;
    imported.leave_out("dampings of one body", damped.into());
    imported.leave_out("bodies that must not turn", is_true(body, "fixedRotation").into());
    let scaled = body.contains_key("gravityScale") && number(body, "gravityScale") != 1.0;
    imported.leave_out("gravities of one body", scaled.into());
    let name =
        || body.get("name").and_then(Value::as_str).map(str::trim).filter(|name| is_name(name)).map(str::to_owned);
    let row = imported.row(kind, 0, name);
    imported.bodies.push(Body {
        id: GlobalId(0),
        position: vector(body, "position"),
        rotation: turn(number(body, "angle") + angle),
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
    let half = |shape: &Shape, rotation: Rot| {
        let (c, s) = (rotation.c.abs(), rotation.s.abs());
        match *shape {
            Shape::Box { half } => Vec2::new(c * half.x + s * half.y, s * half.x + c * half.y),
            Shape::Circle { radius } => Vec2::splat(radius),
        }
        .as_dvec2()
    };
    let statics = imported.statics.iter().map(|fixed| (fixed.position, half(&fixed.kind.shape, fixed.rotation)));
    let shape = |body: &Body| half(&imported.kinds[body.kind.0 as usize].shape, body.rotation);
    let bodies = imported.bodies.iter().map(|body| (body.position, shape(body)));
    let all = statics.chain(bodies).map(|(place, half)| (place - half, place + half));
    let (low, high) = all.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or((DVec2::ZERO, DVec2::ZERO));
    let around = (high - low).max_element().max(1.0) * AROUND;
    (low - around, high + around)
}
