//! What colors and signs mean.

use super::canvas::Rgb;
use super::colors::{self, Scale};
use super::paint::{self, ColorBy, MOST_CONTACTS};
use super::{Layers, bodies};
use crate::look::frame::Setting;
use crate::wording::short;
use atoll_core::Shape;

/// The meaning of one color or sign.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Sign {
    /// A square.
    Square(Rgb),
    /// A disc.
    Disc(Rgb),
    /// A ring.
    Ring(Rgb),
    /// Nothing.
    None,
}

/// What is written beside a picture about its colors.
#[derive(Clone, Default, Debug)]
pub(crate) struct Legend {
    /// What the colors tell.
    pub title: String,
    /// A scale, and what its beginning, middle and end stand for.
    pub scale: Option<(Scale, [String; 3])>,
    /// Signs, and what they stand for.
    pub rows: Vec<(Sign, String)>,
}

impl Legend {
    /// Of a way to color, and what else is drawn; `most` is what has the last color of a scale.
    pub(crate) fn new(by: ColorBy, layers: &Layers, setting: &Setting, ranks: u32, most: f32) -> Self {
        let square = |color, text: &str| (Sign::Square(color), text.to_owned());
        let (title, scale, mut rows) = match by {
            ColorBy::Kind => ("kind", None, (0..setting.kinds.len()).map(|kind| shape(kind, setting)).collect()),
            ColorBy::Speed => {
                let labels = ["0".to_owned(), short(0.5 * f64::from(most)), format!("{}+", short(f64::from(most)))];
                ("speed, m/s", Some((Scale::Amount, labels)), Vec::new())
            }
            ColorBy::Spin => {
                let end = short(f64::from(most));
                ("spin, rad/s", Some((Scale::Ways, [format!("−{end}"), "0".to_owned(), format!("+{end}")])), Vec::new())
            }
            ColorBy::Tile => ("tile", None, Vec::new()),
            ColorBy::Rank => {
                ("rank", None, (0..ranks).map(|rank| square(colors::distinct(rank), &rank.to_string())).collect())
            }
            ColorBy::Contacts => {
                let text =
                    |count: u16| if count == MOST_CONTACTS { format!("{count} and more") } else { count.to_string() };
                let row = |count| square(paint::contacts(count), &text(count));
                ("contacts of a body", None, (0..=MOST_CONTACTS).map(row).collect())
            }
            ColorBy::Asleep => ("state", None, vec![square(colors::AWAKE, "awake"), square(colors::ASLEEP, "asleep")]),
        };
        if by == ColorBy::Tile {
            let [columns, lines] = setting.partition.roots();
            let count = if setting.partition.is_uniform() {
                format!("{columns} × {lines}, told apart by color")
            } else {
                "that follow the bodies, told apart by color".to_owned()
            };
            rows.push((Sign::Square(colors::tile(0, 0)), count));
        }
        if !setting.statics.is_empty() {
            let any_moves = setting.statics.iter().any(|fixed| fixed.path.is_some());
            rows.push(square(colors::STATIC, if any_moves { "no body moves it" } else { "never moves" }));
        }
        if layers.ghosts {
            rows.push((Sign::Ring(colors::GHOST), "ghost".to_owned()));
        }
        if layers.contacts {
            rows.push((Sign::Disc(bodies::contact_color(1.0)), "contact; larger: pressed harder".to_owned()));
        }
        Self { title: title.to_owned(), scale, rows }
    }

    /// With no more rows than so many; if there are more, the last says how many are not there.
    pub(crate) fn shortened(mut self, most: usize) -> Self {
        if self.rows.len() > most {
            let kept = most.saturating_sub(1);
            let text = format!("and {} more", self.rows.len() - kept);
            self.rows.truncate(kept);
            self.rows.push((Sign::None, text));
        }
        self
    }
}

/// A kind, told by its name or its shape.
fn shape(kind: usize, setting: &Setting) -> (Sign, String) {
    let (color, name) = (colors::distinct(kind as u32), setting.name_of(kind));
    let is_named = setting.names.get(kind).is_some_and(Option::is_some);
    match setting.kinds[kind].shape {
        Shape::Circle { .. } if is_named => (Sign::Disc(color), name),
        Shape::Circle { .. } => (Sign::Disc(color), format!("{name} wide")),
        _ => (Sign::Square(color), name),
    }
}

/// A length in the unit that suits it.
pub(super) fn length(meters: f64) -> String {
    match meters {
        _ if meters >= 1000.0 => format!("{} km", short(meters / 1000.0)),
        _ if meters >= 0.1 => format!("{} m", short(meters)),
        _ => format!("{} mm", short(meters * 1000.0)),
    }
}

/// A whole number, its digits in groups of three.
pub(crate) fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}
