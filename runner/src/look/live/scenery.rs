//! What stays as it is while a page looks, and what colors mean, in the words of the page.

use super::protocol::{Hello, PickedBody, Source, Tiles};
use super::question::Found;
use crate::look::frame::Setting;
use crate::look::live::figures::digits;
use crate::look::picture::{ColorBy, Layers, Legend, Range, STATIC, Sign, Tint, short};
use atoll_core::Shape;
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
    let fixed = |body: &atoll_core::StaticBody| {
        let [half_x, half_y, radius] = outline(&body.kind.shape).map(f64::from);
        let (c, s) = (f64::from(body.rotation.c), f64::from(body.rotation.s));
        [body.position.x, body.position.y, c, s, half_x, half_y, radius]
    };
    Source {
        name,
        domain: [low.x, low.y, high.x, high.y],
        tiles: setting.partition.roots(),
        held: Tiles::new(&setting.partition, rank_of_tile),
        shapes: shapes(setting),
        statics: setting.statics.iter().map(fixed).collect(),
    }
}

/// Half width, half height and radius of each kind, in m.
pub(super) fn shapes(setting: &Setting) -> Vec<[f32; 3]> {
    setting.kinds.iter().map(|kind| outline(&kind.shape)).collect()
}

/// Half width, half height and radius.
fn outline(shape: &Shape) -> [f32; 3] {
    match *shape {
        Shape::Circle { radius } => [0.0, 0.0, radius],
        Shape::Box { half } => [half.x, half.y, 0.0],
    }
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
            Sign::Square(color) => (color, false),
            Sign::Disc(color) | Sign::Ring(color) => (color, true),
        };
        json!([text, color.0, is_round])
    };
    let rows: Vec<_> = legend.rows.iter().map(sign).collect();
    json!({ "title": legend.title, "scale": scale, "rows": rows }).to_string()
}

/// What a page is told of a body.
pub(super) fn picked(found: &Found, source: u32, setting: &Setting, rank: u32, is_live: bool) -> PickedBody {
    let meters = |half: f32| short(2.0 * f64::from(half));
    let shape = setting.kinds.get(found.kind as usize).map(|kind| match kind.shape {
        Shape::Circle { radius } => format!("circle, {} m", meters(radius)),
        Shape::Box { half } => format!("box, {} × {} m", meters(half.x), meters(half.y)),
    });
    let [x, y] = found.place;
    let [vx, vy] = found.velocity.map(f64::from);
    let mut figures = vec![
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
