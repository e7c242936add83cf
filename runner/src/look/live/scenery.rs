//! What stays as it is while a page looks, and what colors mean, in the words of the page.

use super::protocol::{Fixed, Hello, Outline, PickedBody, Source, Tiles};
use super::question::Found;
use crate::folder::recording::distinct_kinds;
use crate::look::frame::Setting;
use crate::look::live::figures::digits;
use crate::look::picture::{ColorBy, Layers, Legend, Range, STATIC, Sign, Tint};
use crate::scene::record::PathText;
use crate::wording;
use atoll_core::{Kind, Rot, Shape, StaticBody};
use glam::Vec2;
use serde_json::{Value, json};

/// How many colors of ranks there are before they repeat.
const RANK_COLORS: u32 = 30;

/// What a page is told first of all.
pub(super) fn hello(sources: Vec<Source>, recorded: bool, steps: Vec<u64>, last_step: u64) -> Hello {
    let colors = ColorBy::ALL.into_iter().filter(|color| !(recorded && color.needs_run())).collect();
    let rank_colors = (0..RANK_COLORS).map(|rank| Tint::numbered(rank).0).collect();
    Hello { sources, recorded, steps, last_step, colors, rank_colors, static_color: STATIC.0 }
}

/// A world.
pub(super) fn source(name: String, setting: &Setting, rank_of_tile: Vec<u32>) -> Source {
    let (low, high) = (setting.partition.min(), setting.partition.max());
    let (kinds, numbers) = distinct_kinds(&setting.statics);
    let fixed = |(body, shape): (&StaticBody, u32)| {
        let (c, s) = (f64::from(body.rotation.c), f64::from(body.rotation.s));
        let at = [body.position.x, body.position.y, c, s];
        Fixed { at, shape, path: body.path.as_ref().map(PathText::new) }
    };
    Source {
        name,
        records: 0,
        hertz: setting.hertz,
        domain: [low.x, low.y, high.x, high.y],
        tiles: setting.partition.roots(),
        held: Tiles::new(&setting.partition, rank_of_tile),
        shapes: shapes(setting),
        static_shapes: outlines(&kinds),
        statics: setting.statics.iter().zip(numbers).map(fixed).collect(),
    }
}

/// The outline of each kind of bodies.
pub(super) fn shapes(setting: &Setting) -> Vec<Outline> {
    let mut outlines = outlines(&setting.kinds);
    outlines.iter_mut().enumerate().for_each(|(kind, outline)| outline.name = setting.name_of(kind));
    outlines
}

fn outlines(kinds: &[Kind]) -> Vec<Outline> {
    kinds.iter().map(outline).collect()
}

fn outline(kind: &Kind) -> Outline {
    let shape = &kind.shape;
    let (size, parts) = match shape {
        Shape::Circle { radius } => ([0.0, 0.0, *radius], Vec::new()),
        Shape::Box { half } => ([half.x, half.y, 0.0], Vec::new()),
        other => {
            let half = other.half_extents(Rot::IDENTITY);
            ([half.x, half.y, 0.5 * other.width()], other.outlines())
        }
    };
    let part =
        |(corners, radius): (Vec<Vec2>, f32)| (corners.into_iter().map(|corner| corner.to_array()).collect(), radius);
    Outline { name: wording::shape(shape), size, sensor: kind.sensor, parts: parts.into_iter().map(part).collect() }
}

/// What colors mean, as JSON: a title, a scale with its marks, and signs with what they stand for.
pub(super) fn legend(by: ColorBy, setting: &Setting, ranks: u32, range: Range) -> String {
    let legend = Legend::new(by, &Layers::default(), setting, ranks, range.most).shortened(12);
    let scale = legend.scale.map(|(scale, marks)| {
        let colors: Vec<_> = (0..=16_u8).map(|i| scale.at(f32::from(i) / 16.0).0).collect();
        json!({ "marks": marks, "colors": colors })
    });
    let sign = |(sign, text): &(Sign, String)| -> Value {
        let (color, is_round) = match sign {
            Sign::Square(color) => (Some(color.0), false),
            Sign::Disc(color) | Sign::Ring(color) => (Some(color.0), true),
            Sign::None => (None, false),
        };
        json!([text, color, is_round])
    };
    let rows: Vec<_> = legend.rows.iter().map(sign).collect();
    json!({ "title": legend.title, "scale": scale, "rows": rows }).to_string()
}

/// What a page is told of a body.
pub(super) fn picked(found: &Found, source: u32, setting: &Setting, rank: u32, is_live: bool) -> PickedBody {
    let shape = setting.kinds.get(found.kind as usize).map(|kind| wording::shape(&kind.shape));
    let [x, y] = found.place;
    let [vx, vy] = found.velocity.map(f64::from);
    let mut figures = vec![
        ("kind", setting.names.get(found.kind as usize).cloned().flatten().unwrap_or(found.kind.to_string())),
        ("shape", shape.unwrap_or_default()),
        ("x", format!("{x:.3} m")),
        ("y", format!("{y:.3} m")),
        ("angle", format!("{:.1}°", found.angle.to_degrees())),
        ("speed", format!("{} m/s", digits(vx.hypot(vy)))),
        ("velocity", format!("{}, {}", digits(vx), digits(vy))),
        ("spin", format!("{} rad/s", digits(found.spin.into()))),
    ];
    if is_live {
        figures.push(("contacts", found.contacts.to_string()));
        let state = ["awake", "asleep"].get(found.asleep as usize);
        figures.extend(state.map(|state| ("state", (*state).to_owned())));
    }
    figures.extend([("tile", found.tile.to_string()), ("rank", rank.to_string())]);
    PickedBody { source, at: found.place, id: found.id.to_string(), figures }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::shape_tests::{every_kind, every_static};
    use atoll_core::Partition;
    use glam::DVec2;

    #[test]
    fn a_page_gets_all_that_it_draws() {
        let box_and_ball = [Shape::rectangle(2.0, 1.0), Shape::circle(0.5)];
        let kinds = box_and_ball.map(|shape| Kind::new(shape, atoll_core::Material::default()));
        let setting = Setting {
            partition: Partition::uniform(DVec2::ZERO, DVec2::splat(10.0), 1, 1).unwrap(),
            kinds: [kinds.to_vec(), every_kind()].concat(),
            names: vec![None, Some("ball".to_owned())],
            statics: every_static(),
            hertz: 60.0,
        };
        let source = source("a world".to_owned(), &setting, vec![0]);
        let text = serde_json::to_value(&source).unwrap();
        assert_eq!(text["shapes"][0], json!({ "name": "box, 2 × 1 m", "size": [1.0, 0.5, 0.0] }));
        assert_eq!(text["shapes"][1], json!({ "name": "ball", "size": [0.0, 0.0, 0.5] }));
        for (shape, kind) in source.shapes.iter().zip(&setting.kinds).skip(2) {
            // No part reaches further than the square that the page draws in.
            let reach = shape.parts.iter().flat_map(|(corners, radius)| {
                corners
                    .iter()
                    .flat_map(move |[x, y]| [x.abs() + radius - shape.size[0], y.abs() + radius - shape.size[1]])
            });
            assert!(reach.fold(f32::MIN, f32::max).abs() < 1e-6, "{shape:?}");
            assert_eq!(shape.parts.len(), kind.shape.outlines().len());
        }
        for (fixed, given) in setting.statics.iter().zip(&source.statics) {
            assert_eq!(outline(&fixed.kind), source.static_shapes[given.shape as usize]);
            assert_eq!((fixed.position.x, fixed.path.is_some()), (given.at[0], given.path.is_some()));
        }
        assert_eq!(text["statics"][2]["path"]["line"][1], json!(-2.0));
    }
}
