//! What there is in a file: bodies of one rank, or statics.

use super::outline::{Figure, Outline, figures};
use super::piece::{self, Column, Form, Output};
use crate::folder::recording::{Row, distinct_kinds};
use crate::look::frame::Setting;
use atoll_core::{Partition, Rot, StaticBody};
use glam::DVec2;
use std::borrow::Cow;
use std::fs::File;
use std::io::{self, Write};

/// What bodies have: names, forms, and numbers in each. Statics have the first two.
pub(super) const COLUMNS: [(&str, Form, usize); 6] = [
    ("id", Form::UInt64, 1),
    ("kind", Form::UInt32, 1),
    ("velocity", Form::Float32, 3),
    ("spin", Form::Float32, 1),
    ("tile", Form::UInt32, 1),
    ("rank", Form::UInt32, 1),
];

/// What is shown first, and which columns are what.
pub(super) const ATTRIBUTES: &str = "Scalars=\"kind\" Vectors=\"velocity\"";

/// Writes the bodies of one rank: a polygon each, but of compounds one for each part.
///
/// # Errors
/// What the system says.
pub(super) fn write_bodies<'a>(
    setting: &Setting,
    partition: &Partition,
    rows: &'a [Row],
    rank: u32,
    file: &mut File,
) -> io::Result<()> {
    let center = |row: &Row| DVec2::new(row.x, row.y);
    let shapes: Vec<Vec<Figure>> = setting.kinds.iter().map(|kind| figures(&kind.shape)).collect();
    // A cell for each part of each body: what is known of a body is known of each.
    let of_row = |row: &'a Row| shapes[row.kind as usize].iter().map(move |figure| (row, figure));
    let cells: Vec<(&Row, &Figure)> = rows.iter().flat_map(of_row).collect();
    let outlines = cells.iter().map(|&(row, figure)| Outline {
        center: center(row),
        rotation: Rot::from_angle(row.angle),
        figure,
    });
    let rows = || cells.iter().map(|&(row, _)| row);
    let columns: [Values<'_>; 6] = [
        Box::new(|out| rows().try_for_each(|row| out.write_all(&row.id.to_le_bytes()))),
        Box::new(|out| rows().try_for_each(|row| out.write_all(&row.kind.to_le_bytes()))),
        Box::new(|out| {
            let velocities = rows().flat_map(|row| [row.vx, row.vy, 0.0]);
            velocities.into_iter().try_for_each(|component| out.write_all(&component.to_le_bytes()))
        }),
        Box::new(|out| rows().try_for_each(|row| out.write_all(&row.omega.to_le_bytes()))),
        Box::new(|out| {
            let mut tiles = rows().map(|row| partition.locate(center(row)).0);
            tiles.try_for_each(|tile| out.write_all(&tile.to_le_bytes()))
        }),
        Box::new(|out| rows().try_for_each(|_| out.write_all(&rank.to_le_bytes()))),
    ];
    piece::write(outlines, &named(columns), ATTRIBUTES, file)
}

/// Writes the statics where they are at a step. Their kinds are numbered after those of bodies.
///
/// # Errors
/// What the system says.
pub(super) fn write_statics(setting: &Setting, step: u64, file: &mut File) -> io::Result<()> {
    let statics: Vec<StaticBody> = setting.statics_at(step).map(Cow::into_owned).collect();
    let (kinds, numbers) = distinct_kinds(&statics);
    let shapes: Vec<Vec<Figure>> = kinds.iter().map(|kind| figures(&kind.shape)).collect();
    let mut cells: Vec<(&StaticBody, u32, &Figure)> = Vec::new();
    for (fixed, &number) in statics.iter().zip(&numbers) {
        cells.extend(shapes[number as usize].iter().map(|figure| (fixed, number, figure)));
    }
    let outlines =
        cells.iter().map(|&(fixed, _, figure)| Outline { center: fixed.position, rotation: fixed.rotation, figure });
    let first = setting.kinds.len() as u32;
    let columns: [Values<'_>; 2] = [
        Box::new(|out| cells.iter().try_for_each(|(fixed, ..)| out.write_all(&fixed.id.0.to_le_bytes()))),
        Box::new(|out| cells.iter().try_for_each(|(_, number, _)| out.write_all(&(first + number).to_le_bytes()))),
    ];
    piece::write(outlines, &named(columns), "Scalars=\"kind\"", file)
}

/// Writes the values of a column.
type Values<'a> = Box<dyn Fn(&mut Output<'_>) -> io::Result<()> + 'a>;

/// The first of [`COLUMNS`], with their values.
fn named<const N: usize>(values: [Values<'_>; N]) -> Vec<Column<'_>> {
    let columns = COLUMNS.into_iter().zip(values);
    columns.map(|((name, form, components), values)| Column { name, form, components, values }).collect()
}
