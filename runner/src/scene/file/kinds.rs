//! Kinds as scenes and commands say them: a shape, what it is made of, how it moves, and whom it touches.

use super::super::SceneError;
use super::entries::{Entries, float, keep, number, pair, place};
use super::row::is_turn;
use atoll_core::{Dynamics, Filter, Kind, Material, Part, Path as Course, Rot, Shape};
use glam::{DVec2, Vec2};
use std::collections::BTreeSet;
use std::path::Path;
use toml::{Table, Value};

/// Of more points no polygon is made: finding those that are its corners takes long.
const MOST_POINTS: usize = 1000;

/// So much of the size of a shape may be lost where its points are rounded to 32 bits.
const ROUNDED: f64 = 1e-4;

/// What a shape may be.
const SHAPES: &str = "\"box\" or \"circle\"; or give polygon, capsule or parts in its place";

/// What the size of something is.
const SIZE: &str = "a positive number, in meters";

/// What a pair of sizes is.
const POINTS: &str = "points in meters, such as [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]";

/// The shapes of statics alone.
pub(super) const OF_STATICS: [&str; 2] = ["segment", "chain"];

/// Reads all kinds, and what they are called. In the place of one that cannot be, which is a fault, stands any.
pub(super) fn kinds(file: &Path, tables: &[&Table], faults: &mut Vec<SceneError>) -> (Vec<Kind>, Vec<Option<String>>) {
    let mut taken = BTreeSet::new();
    let mut kind = |(number, table): (usize, &&Table)| {
        let mut entries = Entries::new(file, format!("[[kinds]] {number}"), table);
        if let Some(name) = entries.text("name", "a text")? {
            if !taken.insert(name.to_owned()) {
                return Err(entries.refuse("name", "another kind has this name; give each its own"));
            }
            if name.trim() != name || name.is_empty() || name.parse::<u64>().is_ok() {
                return Err(entries.refuse("name", "must be a word that is no number, without spaces around it"));
            }
        }
        of_bodies(&mut entries)
    };
    let any = || Kind::new(Shape::circle(1.0), Material::default());
    let kinds = tables.iter().enumerate().map(|one| keep(faults, kind(one)).unwrap_or_else(any)).collect();
    let name = |table: &&Table| table.get("name").and_then(Value::as_str).map(str::to_owned);
    (kinds, tables.iter().map(name).collect())
}

/// Reads a kind that comes while a run goes on. The error is what is wrong with it.
pub(crate) fn of_command(table: &Table) -> Result<Kind, String> {
    let mut entries = Entries::new(Path::new(""), "add_kind".to_owned(), table);
    of_bodies(&mut entries).map_err(|error| error.without_file())
}

/// A kind of bodies that move: all that is left to be read.
fn of_bodies(entries: &mut Entries<'_>) -> Result<Kind, SceneError> {
    if let Some(key) = OF_STATICS.into_iter().find(|key| entries.has(key)) {
        return Err(entries.refuse(key, "is for [[statics]] alone; here, give a capsule or parts"));
    }
    let shape = shape(entries, &[])?;
    let kind = of_shape(entries, shape)?;
    if kind.material.surface_speed != 0.0 {
        return Err(entries.refuse("surface_speed", "is for [[statics]] alone; leave it out"));
    }
    entries.finish()?;
    // As the physics reckons them.
    let (area, per_mass) = (kind.shape.area(), kind.shape.inertia_per_mass());
    let has_mass = |density: f32| is_normal(density * area) && is_normal(density * area * per_mass);
    if !has_mass(kind.material.density) {
        let key = if has_mass(1.0) { "density" } else { oddest_size(entries) };
        const WRONG: &str = "mass and moment of inertia would be out of the range of 32 bits, 1e-38 to 1e38; choose sizes and \
                             a density nearer to 1";
        return Err(entries.refuse(key, WRONG));
    }
    Ok(kind)
}

/// Whether a number and its inverse can be reckoned with.
fn is_normal(number: f32) -> bool {
    number > 0.0 && number.is_finite() && number.recip() > 0.0 && number.recip().is_finite()
}

/// The key of the size that is furthest from 1.
fn oddest_size(entries: &mut Entries<'_>) -> &'static str {
    let keys = ["width", "height", "radius", "circle", "box", "polygon", "capsule", "parts"];
    let sizes = keys.into_iter().filter_map(|key| Some((key, greatest(entries.value(key)?))));
    let oddness = |(_, size): &(&str, f64)| size.ln().abs();
    // Of equals the first.
    let oddest = sizes.filter(|(_, size)| *size > 0.0).min_by(|a, b| oddness(b).total_cmp(&oddness(a)));
    oddest.map_or("shape", |(key, _)| key)
}

/// Of all numbers in a value the one that is furthest from zero, without its sign.
fn greatest(value: &Value) -> f64 {
    match value {
        Value::Array(all) => all.iter().map(greatest).fold(0.0, f64::max),
        Value::Table(all) => all.values().map(greatest).fold(0.0, f64::max),
        value => number(value).unwrap_or_default().abs(),
    }
}

/// The one shape of a kind, but none of those that only statics have. `others` are keys that there may be beside those of kinds.
///
/// # Errors
/// If there is none, several, or one that cannot be.
pub(super) fn shape(entries: &mut Entries<'_>, others: &[&'static str]) -> Result<Shape, SceneError> {
    check_one(entries)?;
    if entries.has("parts") {
        return parts(entries);
    }
    if let Some(shape) = convex(entries)? {
        return Ok(shape);
    }
    match entries.text("shape", SHAPES)? {
        Some("box") => match (size(entries, "width")?, size(entries, "height")?) {
            (Some(width), Some(height)) => Ok(Shape::rectangle(width, height)),
            (None, _) => Err(missing(entries, "width", SIZE, others)),
            _ => Err(missing(entries, "height", SIZE, others)),
        },
        Some("circle") => {
            size(entries, "radius")?.map(Shape::circle).ok_or_else(|| missing(entries, "radius", SIZE, others))
        }
        Some(_) => Err(entries.refuse("shape", format!("must be {SHAPES}"))),
        None => Err(missing(entries, "shape", SHAPES, others)),
    }
}

/// That a key which must be there is not. It may be there under a name that is none, which then is what is told.
fn missing(entries: &mut Entries<'_>, key: &str, must: &str, others: &[&'static str]) -> SceneError {
    for key in ["parts", "width", "height", "radius"].iter().chain(others) {
        entries.value(key);
    }
    let rest = of_shape(entries, Shape::circle(1.0)).and_then(|_| entries.finish());
    rest.err().unwrap_or_else(|| entries.missing(key, must))
}

/// That there are not two shapes.
///
/// # Errors
/// If there are.
pub(super) fn check_one(entries: &Entries<'_>) -> Result<(), SceneError> {
    let all = ["shape", "box", "circle", "polygon", "capsule", "parts"].into_iter().chain(OF_STATICS);
    let given: Vec<&str> = all.filter(|key| entries.has(key)).collect();
    match given[..] {
        [first, second, ..] => Err(entries.refuse(second, format!("there is {first} already; leave one out"))),
        _ => Ok(()),
    }
}

/// Whether there is a number of meters, and it is positive, and so is half of it, which is what is kept.
fn is_size(size: f32) -> bool {
    size > 0.0 && 0.5 * size > 0.0
}

fn size(entries: &mut Entries<'_>, key: &'static str) -> Result<Option<f32>, SceneError> {
    entries.get(key, SIZE, |value| float(value).filter(|size| is_size(*size)))
}

/// Box, circle, polygon or capsule by that key, as parts have it as well. None if none is there.
fn convex(entries: &mut Entries<'_>) -> Result<Option<Shape>, SceneError> {
    let sizes = |value: &Value| pair(value).filter(|sizes| is_size(sizes.x) && is_size(sizes.y));
    if let Some(Vec2 { x, y }) = entries.get("box", "[width, height], both positive, in meters", sizes)? {
        return Ok(Some(Shape::rectangle(x, y)));
    }
    let is_radius = |value: &Value| float(value).filter(|radius| is_size(*radius));
    if let Some(radius) = entries.get("circle", "its radius, a positive number, in meters", is_radius)? {
        return Ok(Some(Shape::circle(radius)));
    }
    if let Some(Vec2 { x, y }) = entries.get("capsule", "[length, radius], both positive, in meters", sizes)? {
        let capsule = Shape::capsule(x, y);
        return capsule.map(Some).map_err(|error| entries.refuse("capsule", error.to_string()));
    }
    let points = |value: &Value| value.as_array()?.iter().map(point).collect::<Option<Vec<DVec2>>>();
    let Some(points) = entries.get("polygon", POINTS, points)? else { return Ok(None) };
    if points.len() > MOST_POINTS {
        return Err(entries.refuse("polygon", format!("it has {} points; give its corners alone", points.len())));
    }
    let radius = amount(entries, "radius", "a number, at least 0, in meters", 0.0)?;
    Shape::polygon(&in_32_bits(&points, radius), radius)
        .map(Some)
        .map_err(|error| entries.refuse("polygon", error.to_string()))
}

/// A point that 32 bits can hold, in 64.
fn point(value: &Value) -> Option<DVec2> {
    pair(value).and_then(|_| place(value))
}

/// Points of something that reaches so far around each, rounded: as they are where hardly anything is lost by that, else as they are
/// seen from the first.
fn in_32_bits(points: &[DVec2], reach: f32) -> Vec<Vec2> {
    let first = points.first().copied().unwrap_or_default();
    let seen_from = |origin: DVec2| points.iter().map(|&point| (point - origin).as_vec2()).collect::<Vec<_>>();
    let rounded = seen_from(DVec2::ZERO);
    let size = points.iter().map(|point| point.distance(first)).fold(reach.into(), f64::max);
    let lost = points.iter().zip(&rounded).map(|(point, rounded)| point.distance(rounded.as_dvec2()));
    if lost.fold(0.0, f64::max) > ROUNDED * size { seen_from(first) } else { rounded }
}

/// A compound.
fn parts(entries: &mut Entries<'_>) -> Result<Shape, SceneError> {
    const FORM: &str = "a list such as [{ circle = 0.5, at = [1.0, 0.0] }, { box = [2.0, 1.0], angle = 0.5 }]";
    let tables = |value| Value::as_array(value)?.iter().map(Value::as_table).collect::<Option<Vec<_>>>();
    let tables = entries.get("parts", FORM, tables)?.unwrap_or_default();
    let (mut parts, mut places) = (Vec::with_capacity(tables.len()), Vec::with_capacity(tables.len()));
    for (number, table) in tables.into_iter().enumerate() {
        let mut part = entries.within(&format!("parts {number}"), table);
        let none =
            || entries.refuse("parts", format!("part {number} must have one of box, circle, polygon and capsule"));
        if ["box", "circle", "polygon", "capsule"].into_iter().filter(|key| part.has(key)).count() > 1 {
            return Err(none());
        }
        let shape = convex(&mut part)?;
        if shape.is_none() {
            part.value("radius");
        }
        places.push(part.get("at", "[x, y], in meters", point)?.unwrap_or_default());
        let rotation = turn(&mut part)?;
        part.finish()?;
        let shape = shape.ok_or_else(none)?;
        parts.push(Part { shape, position: Vec2::ZERO, rotation });
    }
    let reach = parts.iter().map(|part| part.shape.bounding_radius()).fold(0.0, f32::max);
    for (part, position) in parts.iter_mut().zip(in_32_bits(&places, reach)) {
        part.position = position;
    }
    Shape::compound(parts).map_err(|error| entries.refuse("parts", error.to_string()))
}

/// A number that is at least zero.
fn amount(entries: &mut Entries<'_>, key: &'static str, must: &str, usual: f32) -> Result<f32, SceneError> {
    within(entries, key, must, usual, |number| number >= 0.0)
}

/// A number in a range.
fn within(
    entries: &mut Entries<'_>,
    key: &'static str,
    must: &str,
    usual: f32,
    holds: fn(f32) -> bool,
) -> Result<f32, SceneError> {
    let number = entries.float(key, must)?.unwrap_or(usual);
    if holds(number) { Ok(number) } else { Err(entries.refuse(key, format!("must be {must}"))) }
}

/// All of a kind but its shape.
///
/// # Errors
/// If something of it cannot be.
pub(super) fn of_shape(entries: &mut Entries<'_>, shape: Shape) -> Result<Kind, SceneError> {
    let Kind { material, dynamics, filter, .. } = Kind::new(shape.clone(), Material::default());
    let restitution = |number| (0.0..=1.0).contains(&number);
    const RUNS: &str = "a number within -1e9 to 1e9, in m/s";
    let runs = |speed: f32| f64::from(speed.abs()) <= Course::FASTEST;
    let material = Material {
        density: within(entries, "density", "a positive number, in kg/m^2", material.density, |number| number > 0.0)?,
        friction: amount(entries, "friction", "a number, at least 0", material.friction)?,
        restitution: within(entries, "restitution", "a number within 0 to 1", material.restitution, restitution)?,
        surface_speed: within(entries, "surface_speed", RUNS, material.surface_speed, runs)?,
    };
    const RATE: &str = "a number, at least 0, in 1/s";
    let dynamics = Dynamics {
        gravity_scale: entries.float("gravity_scale", "a number")?.unwrap_or(dynamics.gravity_scale),
        linear_damping: amount(entries, "linear_damping", RATE, dynamics.linear_damping)?,
        angular_damping: amount(entries, "angular_damping", RATE, dynamics.angular_damping)?,
        fixed_rotation: entries.truth("fixed_rotation")?.unwrap_or(dynamics.fixed_rotation),
    };
    const BITS: &str = "a whole number from 0 to 4294967295, a bit for each category";
    let filter = Filter {
        categories: entries.integer("categories", BITS)?.unwrap_or(filter.categories),
        mask: entries.integer("mask", BITS)?.unwrap_or(filter.mask),
        group: entries.integer("group", "a whole number within 32 bits")?.unwrap_or(filter.group),
    };
    let sensor = entries.truth("sensor")?.unwrap_or(false);
    Ok(Kind { shape, material, dynamics, filter, sensor })
}

/// An angle, or cosine and sine, or neither.
///
/// # Errors
/// If it is none.
pub(super) fn turn(entries: &mut Entries<'_>) -> Result<Rot, SceneError> {
    let angle = entries.float("angle", "an angle in radians")?;
    let [cos, sin] = [entries.float("cos", "the cosine of an angle")?, entries.float("sin", "the sine of an angle")?];
    match (angle, cos, sin) {
        (None, None, None) => Ok(Rot::IDENTITY),
        (Some(angle), None, None) => Ok(Rot::from_angle(angle)),
        (None, Some(c), Some(s)) if is_turn(Rot { c, s }) => Ok(Rot { c, s }),
        (None, Some(_), Some(_)) => {
            Err(entries.refuse("cos", "cos and sin must be those of one angle: the sum of their squares is not 1"))
        }
        _ => Err(entries.refuse("angle", "give either angle, or both cos and sin")),
    }
}
