//! A row of bodies: its columns, and what a body must be. The same whether it comes from CSV, Parquet or TOML.

use super::super::{Place, SceneError};
use crate::wording::{did_you_mean, nearest};
use atoll_core::{Body, GlobalId, Kind, KindId, Rot};
use glam::{DVec2, Vec2};
use std::path::Path;

/// No center may be further from the origin along an axis, in meters: there, 64 bits tell 0.1 micrometers apart.
pub(crate) const FARTHEST: f64 = 1e9;

/// The columns there are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(usize)]
pub(crate) enum Column {
    Id,
    Kind,
    X,
    Y,
    Angle,
    Cos,
    Sin,
    Vx,
    Vy,
    Omega,
}

impl Column {
    /// In the order in which they are written.
    pub(crate) const ALL: [Self; 10] =
        [Self::Id, Self::Kind, Self::X, Self::Y, Self::Angle, Self::Cos, Self::Sin, Self::Vx, Self::Vy, Self::Omega];

    /// As files call it.
    pub(crate) const fn name(self) -> &'static str {
        ["id", "kind", "x", "y", "angle", "cos", "sin", "vx", "vy", "omega"][self as usize]
    }

    /// What its values are.
    pub(super) const fn must(self) -> &'static str {
        match self {
            Self::Id => "a whole number from 0 to 18446744073709551615",
            Self::Kind => "the number of a kind, from 0, or the name of one",
            Self::X | Self::Y => "a finite number, in meters",
            Self::Angle => "a finite number, in radians, within the range of 32 bits",
            Self::Cos | Self::Sin => "the cosine or sine of an angle",
            Self::Vx | Self::Vy => "a finite number, in m/s, within the range of 32 bits",
            Self::Omega => "a finite number, in rad/s, within the range of 32 bits",
        }
    }
}

/// The names of all columns.
pub(super) fn names() -> String {
    Column::ALL.map(Column::name).join(", ")
}

/// For each column there is, its place among those of a file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Header {
    pub(super) places: [Option<usize>; Column::ALL.len()],
    pub(super) count: usize,
}

impl Header {
    /// Of a file with these columns.
    ///
    /// # Errors
    /// The name of the column in question, if any, and what is wrong with it.
    pub(super) fn new<'a>(given: impl Iterator<Item = &'a str>) -> Result<Self, (Option<String>, String)> {
        let mut header = Self { places: [None; Column::ALL.len()], count: 0 };
        for (place, name) in given.enumerate() {
            let name = name.trim();
            let column = Column::ALL.iter().find(|column| column.name() == name).ok_or_else(|| {
                let suggestion = nearest(Column::ALL.iter().map(|column| column.name()), name);
                let reason = match name.contains([';', '\t', ' ']) {
                    true => "names and values must be separated by commas".to_owned(),
                    false => format!("unknown column{}; there are {}", did_you_mean(&suggestion), names()),
                };
                (Some(name.to_owned()), reason)
            })?;
            if header.places[*column as usize].replace(place).is_some() {
                return Err((Some(name.to_owned()), "the column is there twice; leave one out".to_owned()));
            }
            header.count += 1;
        }
        for column in [Column::X, Column::Y] {
            if !header.has(column) {
                let reason = format!("the column {} is missing: every body needs x and y, in meters", column.name());
                return Err((None, reason));
            }
        }
        header.check_turns()?;
        Ok(header)
    }

    fn check_turns(&self) -> Result<(), (Option<String>, String)> {
        let [angle, cos, sin] = [Column::Angle, Column::Cos, Column::Sin].map(|column| self.has(column));
        if cos != sin {
            return Err((None, "cos and sin go together; give both, or angle instead".to_owned()));
        }
        if angle && cos {
            return Err((None, "a body has either angle, or cos and sin; leave one out".to_owned()));
        }
        Ok(())
    }

    /// Whether the file has that column.
    pub(super) fn has(&self, column: Column) -> bool {
        self.places[column as usize].is_some()
    }
}

/// The values of a row, before anybody has looked whether they can be.
#[derive(Clone, Copy, Debug)]
pub(super) struct Values {
    pub(super) id: u64,
    pub(super) kind: u64,
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) angle: f32,
    pub(super) cos: f32,
    pub(super) sin: f32,
    pub(super) vx: f32,
    pub(super) vy: f32,
    pub(super) omega: f32,
}

/// What is checked against the rest of the scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scenery<'a> {
    /// The file with the rows, for errors.
    pub(super) file: &'a Path,
    pub(super) kinds: &'a [Kind],
    pub(super) names: &'a [Option<String>],
    /// Of statics, ascending.
    pub(super) static_ids: &'a [GlobalId],
}

impl Scenery<'_> {
    /// The kind of that name or number.
    pub(super) fn kind(&self, text: &str) -> Option<u64> {
        let named = self.names.iter().position(|name| name.as_deref() == Some(text));
        named.map_or_else(|| text.parse().ok(), |place| Some(place as u64))
    }

    /// A value that cannot be. `row` counts from 0.
    pub(super) fn refuse(&self, row: u64, line: Option<u64>, column: Column, value: &str, reason: &str) -> SceneError {
        const MOST: usize = 40;
        let (short, is_cut) = (value.chars().take(MOST).collect::<String>(), value.chars().nth(MOST).is_some());
        let shown = if short.is_empty() { "nothing" } else { &short };
        let name = format!("{} = {shown}{}", column.name(), if is_cut { "..." } else { "" });
        SceneError::bad(self.file, Place { line, row: Some(row + 1), name: Some(name) }, reason)
    }

    /// The body of a row, which counts from 0. `turned` says that the row has cos and sin and no angle.
    ///
    /// # Errors
    /// If there can be no such body.
    pub(super) fn body(&self, row: u64, line: Option<u64>, turned: bool, values: &Values) -> Result<Body, SceneError> {
        let Values { id, kind, x, y, angle, cos, sin, vx, vy, omega } = *values;
        let refuse = |column, value: String, reason: &str| self.refuse(row, line, column, &value, reason);
        for (column, value) in [(Column::X, x), (Column::Y, y)] {
            if !value.is_finite() {
                return Err(refuse(column, value.to_string(), &format!("must be {}", column.must())));
            }
            if value.abs() > FARTHEST {
                let reason = "must be within -1e9 to 1e9 m; move the world nearer to the origin";
                return Err(refuse(column, value.to_string(), reason));
            }
        }
        let floats = [(Column::Angle, angle), (Column::Vx, vx), (Column::Vy, vy), (Column::Omega, omega)];
        for (column, value) in floats.into_iter().chain([(Column::Cos, cos), (Column::Sin, sin)]) {
            if !value.is_finite() {
                return Err(refuse(column, value.to_string(), &format!("must be {}", column.must())));
            }
        }
        if kind >= self.kinds.len() as u64 {
            let reason = match self.kinds.len() {
                0 => "the scene has no kinds; add [[kinds]] to it".to_owned(),
                kinds => format!("there are kinds 0 to {}; mend the number, or add [[kinds]]", kinds - 1),
            };
            return Err(refuse(Column::Kind, kind.to_string(), &reason));
        }
        let id = GlobalId(id);
        if self.static_ids.binary_search(&id).is_ok() {
            let reason = "a static has that id; give each body and static an id of its own";
            return Err(refuse(Column::Id, id.0.to_string(), reason));
        }
        let rotation = if turned { Rot { c: cos, s: sin } } else { Rot::from_angle(angle) };
        if !is_turn(rotation) {
            let reason = "cos and sin must be those of one angle: the sum of their squares is not 1";
            return Err(refuse(Column::Cos, format!("{cos} and sin = {sin}"), reason));
        }
        Ok(Body {
            id,
            position: DVec2::new(x, y),
            rotation,
            velocity: Vec2::new(vx, vy),
            angular_velocity: omega,
            kind: KindId(kind as u32),
        })
    }
}

/// Whether it is of length one, as nearly as the physics asks for.
pub(in crate::scene) fn is_turn(rotation: Rot) -> bool {
    (rotation.c * rotation.c + rotation.s * rotation.s - 1.0).abs() < 9e-4
}
