//! Statics as scenes say them: kinds at a place or at those of a table, pieces of ground, and what moves as its path has it.

use super::super::SceneError;
use super::entries::{Entries, keep, pair, place};
use super::kinds::{check_one, of_shape, shape, turn};
use super::row::{Column, FARTHEST, Scenery};
use super::table::TableFile;
use atoll_core::{GlobalId, Kind, Material, Path as Course, Rot, Segment, Shape, StaticBody, Travel};
use glam::{DVec2, Vec2};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// What a coordinate of a center is.
const PLACE: &str = "a number within -1e9 to 1e9, in meters";

/// All statics of a scene.
#[derive(Clone, PartialEq, Default, Debug)]
pub(super) struct Statics {
    /// With ids from 0 where they have none of their own.
    pub(super) all: Vec<StaticBody>,
    /// Whether those are their own.
    pub(super) are_named: bool,
    /// The files that say where some of them are.
    pub(super) tables: Vec<PathBuf>,
}

/// Reads all statics that can be; others are faults. Those of a chain have ids that follow each other.
pub(super) fn statics(file: &Path, tables: &[&Table], faults: &mut Vec<SceneError>) -> Statics {
    let mut statics = Statics { all: Vec::with_capacity(tables.len()), ..Statics::default() };
    let (mut taken, mut named) = (BTreeSet::new(), None);
    let mut add = |(number, table): (usize, &&Table)| -> Result<(), SceneError> {
        let mut entries = Entries::new(file, format!("[[statics]] {number}"), table);
        let id = entries.whole("id")?;
        check_one(&entries)?;
        let (mut ids, mut path_of_table) = (None, None);
        let placed = if entries.has("chain") {
            chain(&mut entries)?
        } else if let Some(name) =
            entries.text("places", "the path of a file, .csv or .parquet, from the folder of this one")?
        {
            let path = file.parent().unwrap_or(Path::new("")).join(name);
            let placed;
            (placed, ids) = in_table(&mut entries, &path)?;
            path_of_table = Some(path);
            placed
        } else {
            vec![alone(&mut entries)?]
        };
        let is_named = id.is_some() || ids.is_some();
        if *named.get_or_insert(is_named) != is_named {
            return Err(
                entries.refuse("id", "either every static has an id or none; give all of them one, or leave all out")
            );
        }
        statics.are_named = is_named;
        let path = path(&mut entries)?;
        if path.is_some_and(|path| path.turning != 0.0) && entries.has("chain") {
            return Err(entries.refuse("path", "a chain cannot turn; leave turning out, or give parts"));
        }
        // Of a chain, every segment is of the same stuff.
        let like = of_shape(&mut entries, Shape::circle(1.0))?;
        entries.finish()?;
        let first = id.unwrap_or(statics.all.len() as u64);
        for (place, (shape, position, rotation)) in placed.into_iter().enumerate() {
            let id = ids.as_ref().map_or(first + place as u64, |ids: &Vec<u64>| ids[place]);
            if !taken.insert(id) {
                return Err(match &path_of_table {
                    Some(table) => {
                        SceneError::whole(table, format!("another static has the id {id}; give each its own"))
                    }
                    None => entries.refuse("id", "another static has that id; give each its own"),
                });
            }
            let kind = Kind { shape, ..like.clone() };
            statics.all.push(StaticBody { rotation, path, ..StaticBody::new(GlobalId(id), kind, position) });
        }
        statics.tables.extend(path_of_table);
        Ok(())
    };
    for one in tables.iter().enumerate() {
        keep(faults, add(one));
    }
    statics
}

/// A shape, where its center is, and how it is turned.
type Placed = (Shape, DVec2, Rot);

/// A static with a place of its own.
fn alone(entries: &mut Entries<'_>) -> Result<Placed, SceneError> {
    let form = form(entries)?;
    let mut place = |key| match entries.number(key, PLACE)? {
        Some(number) if number.abs() <= FARTHEST => Ok(number),
        Some(_) => Err(entries.refuse(key, format!("must be {PLACE}"))),
        None => Err(entries.missing(key, PLACE)),
    };
    let position = DVec2::new(place("x")?, place("y")?);
    Ok(put(form, position, turn(entries)?))
}

/// Statics of one shape at the places of a table, and their ids, if it says these.
fn in_table(entries: &mut Entries<'_>, path: &Path) -> Result<(Vec<Placed>, Option<Vec<u64>>), SceneError> {
    for key in ["id", "x", "y", "angle", "cos", "sin"] {
        if entries.has(key) {
            return Err(entries.refuse(key, "the table of places says that; leave one out"));
        }
    }
    let form = form(entries)?;
    let table = TableFile::open(path, "these places")?.ok_or_else(|| entries.refuse("places", TableFile::MUST_END))?;
    for column in [Column::Kind, Column::Vx, Column::Vy, Column::Omega] {
        if table.has(column)? {
            let reason = format!("a static has no {}; leave the column out", column.name());
            return Err(SceneError::whole(path, reason));
        }
    }
    // Rows are read as those of bodies are.
    let kinds = [Kind::new(form.0.clone(), Material::default())];
    let scenery = Scenery { file: path, kinds: &kinds, names: &[], static_ids: &[] };
    let (mut placed, mut ids) = (Vec::new(), Vec::new());
    for body in table.rows(scenery)? {
        let body = body?;
        placed.push(put(form.clone(), body.position, body.rotation));
        ids.push(body.id.0);
    }
    Ok((placed, table.has(Column::Id)?.then_some(ids)))
}

/// What a static may say beside what its kind is.
const OTHERS: [&str; 8] = ["chain", "loop", "x", "y", "angle", "cos", "sin", "path"];

/// A shape, and where its center is, seen from what `x` and `y` say.
fn form(entries: &mut Entries<'_>) -> Result<(Shape, Vec2), SceneError> {
    match entries.table("segment")? {
        Some(table) => segment(entries, table),
        None => Ok((shape(entries, &OTHERS)?, Vec2::ZERO)),
    }
}

fn put((shape, middle): (Shape, Vec2), position: DVec2, rotation: Rot) -> Placed {
    // Nothing is added to what must keep its bits.
    let position = if middle == Vec2::ZERO { position } else { position + rotation.rotate(middle).as_dvec2() };
    (shape, position, rotation)
}

/// A segment, and its middle.
fn segment(entries: &Entries<'_>, table: &Table) -> Result<(Shape, Vec2), SceneError> {
    const POINT: &str = "[x, y] in meters, seen from x and y of the static";
    let mut own = entries.within("segment", table);
    let mut point = |key| own.get(key, POINT, pair);
    let [before, from, to, after] = [point("before")?, point("from")?, point("to")?, point("after")?];
    let from = from.ok_or_else(|| own.missing("from", POINT))?;
    let to = to.ok_or_else(|| own.missing("to", POINT))?;
    own.finish()?;
    let segment = Segment::new(before, from, to, after);
    let (segment, middle) = segment.map_err(|error| entries.refuse("segment", error.to_string()))?;
    Ok((Shape::Segment(segment), middle))
}

/// The segments of a chain.
fn chain(entries: &mut Entries<'_>) -> Result<Vec<Placed>, SceneError> {
    const POINTS: &str = "two points or more within 1e9 m, such as [[0.0, 0.0], [10.0, 1.0], [20.0, 0.0]]";
    let point = |value: &Value| place(value).filter(|at| at.abs().cmple(DVec2::splat(FARTHEST)).all());
    let points = |value: &Value| value.as_array()?.iter().map(point).collect::<Option<Vec<DVec2>>>();
    let points = entries.get("chain", POINTS, points)?.unwrap_or_default();
    let is_loop = entries.truth("loop")?.unwrap_or(false);
    let least = if is_loop { 3 } else { 2 };
    if points.len() < least {
        return Err(entries.refuse("chain", format!("it has {} points, and needs {least} at least", points.len())));
    }
    chain_of(&points, is_loop).map_err(|error| entries.refuse("chain", error))
}

/// The segments along some points, each aware of its neighbours. The error is what is wrong with the points.
pub(in crate::scene) fn chain_of(points: &[DVec2], is_loop: bool) -> Result<Vec<Placed>, String> {
    let count = points.len();
    let at = |i: usize| if is_loop { Some(points[i % count]) } else { points.get(i).copied() };
    let segment = |i: usize| {
        let before = if i == 0 && !is_loop { None } else { at((i + count - 1) % count) };
        let (from, to, after) = (points[i], points[(i + 1) % count], at(i + 2));
        let seen = |point: DVec2| (point - from).as_vec2();
        let segment = Segment::new(before.map(seen), Vec2::ZERO, seen(to), after.map(seen));
        let (segment, middle) = segment.map_err(|error| error.to_string())?;
        Ok((Shape::Segment(segment), from + middle.as_dvec2(), Rot::IDENTITY))
    };
    (0..if is_loop { count } else { count - 1 }).map(segment).collect()
}

/// How a static moves, if it does.
fn path(entries: &mut Entries<'_>) -> Result<Option<Course>, SceneError> {
    const FORM: &str = "a table such as { line = [1.0, 0.0] } or { sine = [0.0, 2.0], period = 4.0 }";
    const PERIOD: &str = "a number of seconds other than 0";
    let Some(table) = entries.get("path", FORM, Value::as_table)? else { return Ok(None) };
    let mut own = entries.within("path", table);
    let given: Vec<&str> = ["line", "sine", "circle"].into_iter().filter(|key| own.has(key)).collect();
    if let [first, second, ..] = given[..] {
        return Err(own.refuse(second, format!("there is {first} already; leave one out")));
    }
    let finite = |value: &Value| place(value).filter(|at| at.is_finite());
    let turning = own.number("turning", "a number, in rad/s")?.unwrap_or(0.0);
    let velocity = own.get("line", "a velocity, [x, y] in m/s", finite)?;
    let amplitude = own.get("sine", "how far it goes, [x, y] in meters", finite)?;
    let radius = own.number("circle", "a radius, in meters")?;
    let travel = if let Some(velocity) = velocity {
        Travel::Line { velocity }
    } else if amplitude.is_some() || radius.is_some() {
        let period = own.number("period", PERIOD)?.ok_or_else(|| own.missing("period", PERIOD))?;
        let phase = own.number("phase", "a number, as a part of a whole turn")?.unwrap_or(0.0);
        match (amplitude, radius) {
            (Some(amplitude), _) => Travel::Sine { amplitude, period, phase },
            (_, radius) => Travel::Circle { radius: radius.unwrap_or_default(), period, phase },
        }
    } else {
        Travel::Rest
    };
    own.finish()?;
    let path = Course { travel, turning };
    // All else is finite already.
    let travels = match path.travel {
        Travel::Sine { period, .. } | Travel::Circle { period, .. } => period != 0.0,
        Travel::Rest | Travel::Line { .. } => true,
    };
    match path.is_valid() {
        true => Ok(Some(path)),
        false if travels => {
            let key =
                if turning.abs() > Course::FASTEST { "turning" } else { given.first().copied().unwrap_or("turning") };
            Err(own.refuse(key, format!("nothing here goes faster than {:e} m/s, or rad/s", Course::FASTEST)))
        }
        false => Err(own.refuse("period", format!("must be {PERIOD}"))),
    }
}
