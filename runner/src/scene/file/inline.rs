//! Bodies that stand in the scene's own file.

use super::super::SceneError;
use super::entries::{Entries, keep};
use super::row::{Column, Scenery, Values};
use atoll_core::Body;
use std::path::Path;
use toml::{Table, Value};

/// Reads all that can be; others are faults.
pub(super) fn read(file: &Path, tables: &[Table], scenery: &Scenery<'_>, faults: &mut Vec<SceneError>) -> Vec<Body> {
    let are_named = tables.first().is_some_and(|first| first.contains_key(Column::Id.name()));
    let body = |(row, table): (u64, &Table)| {
        let mut entries = Entries::new(file, format!("[[body]] {row}"), table);
        let id = entries.whole("id")?;
        if id.is_some() != are_named {
            let reason = "either every body has an id or none; give all of them one, or leave all out";
            return Err(entries.refuse("id", reason));
        }
        let kind = match entries.value("kind") {
            None => Some(0),
            Some(Value::String(name)) => scenery.kind(name),
            Some(value) => value.as_integer().and_then(|number| number.try_into().ok()),
        };
        let kind = kind.ok_or_else(|| entries.refuse("kind", format!("must be {}", Column::Kind.must())))?;
        let mut place = |column: Column| {
            let value = entries.number(column.name(), column.must())?;
            value.ok_or_else(|| entries.missing(column.name(), column.must()))
        };
        let (x, y) = (place(Column::X)?, place(Column::Y)?);
        let [angle, cos, sin] =
            [Column::Angle, Column::Cos, Column::Sin].map(|column| table.contains_key(column.name()));
        if cos != sin || angle && cos {
            return Err(entries.refuse("angle", "a body has either angle, or cos and sin; mend this"));
        }
        let mut float = |column: Column| Ok(entries.float(column.name(), column.must())?.unwrap_or(0.0));
        let values = Values {
            id: id.unwrap_or(row),
            kind,
            x,
            y,
            angle: float(Column::Angle)?,
            cos: float(Column::Cos)?,
            sin: float(Column::Sin)?,
            vx: float(Column::Vx)?,
            vy: float(Column::Vy)?,
            omega: float(Column::Omega)?,
        };
        entries.finish()?;
        scenery.body(row, None, cos, &values).map_err(SceneError::of_table)
    };
    (0..).zip(tables).filter_map(|one| keep(faults, body(one))).collect()
}
