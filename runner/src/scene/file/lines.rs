//! Kinds and statics as lines of a scene: each number as the shortest decimal that leads back to its bits.

use crate::wording::shortest;
use atoll_core::{Dynamics, Filter, Kind, Material, Path, Polygon, Rot, Segment, Shape, StaticBody, Travel};
use glam::{DVec2, Vec2};
use toml::Value;

/// The lines of a kind.
pub(super) fn kind_lines(kind: &Kind) -> Vec<String> {
    let &Kind { ref shape, material, dynamics, filter, sensor } = kind;
    let mut lines = shape_lines(shape);
    let mut line = |key: &str, value: Value| lines.push(format!("{key} = {value}"));
    let Material { density, friction, restitution, surface_speed } = material;
    for (key, number) in [("density", density), ("friction", friction), ("restitution", restitution)] {
        line(key, float(number));
    }
    let (usual, Dynamics { gravity_scale, linear_damping, angular_damping, .. }) = (Dynamics::default(), dynamics);
    // What is as usual is not said.
    for (key, number, usual) in [
        ("surface_speed", surface_speed, 0.0),
        ("gravity_scale", gravity_scale, usual.gravity_scale),
        ("linear_damping", linear_damping, usual.linear_damping),
        ("angular_damping", angular_damping, usual.angular_damping),
    ] {
        if number.to_bits() != usual.to_bits() {
            line(key, float(number));
        }
    }
    let (usual, Filter { categories, mask, group }) = (Filter::default(), filter);
    for (key, number, usual) in [
        ("categories", i64::from(categories), i64::from(usual.categories)),
        ("mask", i64::from(mask), i64::from(usual.mask)),
        ("group", group.into(), usual.group.into()),
    ] {
        if number != usual {
            line(key, number.into());
        }
    }
    for (key, holds) in [("fixed_rotation", dynamics.fixed_rotation), ("sensor", sensor)] {
        if holds {
            line(key, true.into());
        }
    }
    lines
}

/// The lines of a static, but for its id; or of many, with the line that says where these are.
pub(super) fn static_lines(fixed: &StaticBody, places: Option<String>) -> Vec<String> {
    let StaticBody { position, rotation, kind, path, .. } = fixed;
    let mut lines = kind_lines(kind);
    match places {
        Some(places) => lines.push(places),
        None => {
            lines.extend([format!("x = {}", Value::from(position.x)), format!("y = {}", Value::from(position.y))]);
            lines.extend(turn(*rotation));
        }
    }
    lines.extend(path.as_ref().map(path_line));
    lines
}

fn shape_lines(shape: &Shape) -> Vec<String> {
    let line = |key: &str, value: Value| format!("{key} = {value}");
    match shape {
        // Twice a half is exact, and so is half of that.
        Shape::Box { half } => {
            let [width, height] = [half.x, half.y].map(|half| float(2.0 * half));
            vec![line("shape", "box".into()), line("width", width), line("height", height)]
        }
        Shape::Circle { radius } => vec![line("shape", "circle".into()), line("radius", float(*radius))],
        Shape::Polygon(polygon) => polygon_entries(polygon),
        Shape::Segment(segment) => vec![segment_line(segment)],
        Shape::Compound(compound) => {
            let parts = compound.parts().iter().map(|part| {
                let mut entries = match &part.shape {
                    Shape::Box { half } => vec![line("box", point(*half * 2.0))],
                    Shape::Circle { radius } => vec![line("circle", float(*radius))],
                    Shape::Polygon(polygon) => polygon_entries(polygon),
                    Shape::Segment(_) | Shape::Compound(_) => unreachable!("no part of a compound is one of these"),
                };
                entries.push(line("at", point(part.position)));
                entries.extend(turn(part.rotation));
                format!("  {{ {} }},\n", entries.join(", "))
            });
            vec![format!("parts = [\n{}]", parts.collect::<String>())]
        }
    }
}

fn polygon_entries(polygon: &Polygon) -> Vec<String> {
    let corners: Vec<Value> = polygon.corners().iter().map(|corner| point(*corner)).collect();
    let mut entries = vec![format!("polygon = {}", Value::from(corners))];
    if polygon.radius().to_bits() != 0 {
        entries.push(format!("radius = {}", float(polygon.radius())));
    }
    entries
}

/// Its middle is where the static is, so that nothing need be added to that.
fn segment_line(segment: &Segment) -> String {
    let [from, to] = segment.ends();
    let ends = [("from", Some(from)), ("to", Some(to)), ("before", segment.before()), ("after", segment.after())];
    let given = ends.into_iter().filter_map(|(key, end)| Some(format!("{key} = {}", point(end?))));
    format!("segment = {{ {} }}", given.collect::<Vec<_>>().join(", "))
}

fn path_line(&Path { travel, turning }: &Path) -> String {
    let place = |at: DVec2| Value::from(at.to_array().to_vec());
    let turns = |period: f64, phase: f64| [("period", Value::from(period)), ("phase", Value::from(phase))];
    let mut entries = match travel {
        Travel::Rest => Vec::new(),
        Travel::Line { velocity } => vec![("line", place(velocity))],
        Travel::Sine { amplitude, period, phase } => {
            [vec![("sine", place(amplitude))], turns(period, phase).to_vec()].concat()
        }
        Travel::Circle { radius, period, phase } => {
            [vec![("circle", Value::from(radius))], turns(period, phase).to_vec()].concat()
        }
    };
    if turning.to_bits() != 0 {
        entries.push(("turning", Value::from(turning)));
    }
    let entries: Vec<String> = entries.into_iter().map(|(key, value)| format!("{key} = {value}")).collect();
    format!("path = {{ {} }}", entries.join(", "))
}

/// How something is turned; nothing if it is not.
fn turn(rotation: Rot) -> Vec<String> {
    match angle(rotation) {
        _ if is_same(rotation, Rot::IDENTITY) => Vec::new(),
        Some(angle) => vec![format!("angle = {}", float(angle))],
        None => vec![format!("cos = {}", float(rotation.c)), format!("sin = {}", float(rotation.s))],
    }
}

fn point(at: Vec2) -> Value {
    Value::from(at.to_array().map(shortest).to_vec())
}

fn float(number: f32) -> Value {
    Value::Float(shortest(number))
}

/// The angle that leads back to the same rotation, bit for bit, if there is one.
pub(super) fn angle(rotation: Rot) -> Option<f32> {
    let angle = rotation.angle();
    is_same(Rot::from_angle(angle), rotation).then_some(angle)
}

fn is_same(a: Rot, b: Rot) -> bool {
    bytemuck::bytes_of(&a) == bytemuck::bytes_of(&b)
}
