//! Writes a world as the files of a scene. What is read again has the same bits.

use super::description::FORMAT;
use super::lines::{angle, kind_lines, static_lines};
use super::row::Column;
use atoll_core::{Body, GlobalId, Kind, KindId, StaticBody};
use glam::DVec2;
use parquet::basic::{Compression, Encoding};
use parquet::data_type::{DoubleType, FloatType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use parquet::schema::types::ColumnPath;
use std::fmt::Write as _;
use std::io::{self, BufWriter, Write};
use std::sync::Arc;
use toml::Value;

/// Rows of a group: the least that is read where only some bodies are wanted.
const IN_A_GROUP: usize = 1 << 16;

/// Cells along an axis by which bodies are brought in an order in which neighbours stand near each other.
const CELLS: f64 = 4096.0;

/// Everything about a world but its bodies.
#[derive(Clone, Debug)]
pub(crate) struct World<'a> {
    pub(crate) name: Option<&'a str>,
    pub(crate) domain: (DVec2, DVec2),
    /// Keys of `[physics]`.
    pub(crate) physics: Vec<(&'static str, Value)>,
    pub(crate) kinds: &'a [Kind],
    /// What kinds are called, or nothing at all.
    pub(crate) names: &'a [Option<String>],
    pub(crate) statics: &'a [StaticBody],
}

/// The file with the bodies.
#[derive(Clone, Debug)]
pub(crate) struct BodiesFile<'a> {
    pub(crate) name: &'a str,
    pub(crate) xxh3: &'a str,
    pub(crate) count: u64,
}

/// How a scene says the ids of its statics.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum StaticIds {
    /// Each has its own.
    Said,
    /// They are those that statics get where none are said.
    LeftOut,
}

/// How ids of statics can be said, beside bodies of which this is the greatest id; if they can. Texts have no numbers above 2^63 - 1.
pub(crate) fn static_ids(statics: &[StaticBody], last: Option<GlobalId>) -> Option<StaticIds> {
    if statics.iter().all(|fixed| fixed.id.0 <= i64::MAX.cast_unsigned()) {
        return Some(StaticIds::Said);
    }
    let first = last.map_or(Some(0), |last| last.0.checked_add(1))?;
    (first..).zip(statics).all(|(id, fixed)| fixed.id.0 == id).then_some(StaticIds::LeftOut)
}

/// So many statics that differ only in where they are have a table of their own.
const MANY: usize = 100;

/// Statics that are alike but for where they are, one after the other.
pub(crate) struct Alike<'a> {
    statics: &'a [StaticBody],
    ids: StaticIds,
    /// The file that says where they are, if there are many.
    pub(crate) table: Option<String>,
}

impl<'a> Alike<'a> {
    /// All statics, in their order; `name` tells what the table of that number is called.
    pub(crate) fn runs(statics: &'a [StaticBody], ids: StaticIds, name: impl Fn(usize) -> String) -> Vec<Self> {
        // Zeros of either sign are equal, and not the same text.
        let said = |fixed: &StaticBody| static_lines(fixed, Some(String::new()));
        let are_alike = |a: &StaticBody, b: &StaticBody| a.path == b.path && a.kind == b.kind && said(a) == said(b);
        let mut tables = 0..;
        let run = |statics: &'a [StaticBody]| {
            let table = (statics.len() >= MANY).then(|| name(tables.next().expect("there are more")));
            Self { statics, ids, table }
        };
        statics.chunk_by(are_alike).map(run).collect()
    }

    /// The rows of its table.
    pub(crate) fn rows(&self) -> (Vec<Column>, Vec<Body>) {
        let row = |fixed: &StaticBody| Body {
            rotation: fixed.rotation,
            ..Body::at_rest(fixed.id, KindId(0), fixed.position)
        };
        let rows: Vec<Body> = self.statics.iter().map(row).collect();
        let mut columns = columns(&rows);
        columns.retain(|column| match column {
            Column::Id => self.ids == StaticIds::Said,
            Column::Kind | Column::Vx | Column::Vy | Column::Omega => false,
            _ => true,
        });
        (columns, rows)
    }

    /// What a scene says of them.
    fn entries(&self) -> Vec<Vec<String>> {
        let entry = |fixed: &StaticBody, lines: Vec<String>| {
            let id = (self.ids == StaticIds::Said && self.table.is_none()).then(|| format!("id = {}", fixed.id));
            id.into_iter().chain(lines).collect()
        };
        match (&self.table, self.statics) {
            (Some(table), [first, ..]) => {
                let places = format!("places = {}", Value::from(table.as_str()));
                vec![entry(first, static_lines(first, Some(places)))]
            }
            _ => self.statics.iter().map(|fixed| entry(fixed, static_lines(fixed, None))).collect(),
        }
    }
}

/// The text of a scene.
pub(crate) fn text(world: &World<'_>, statics: &[Alike<'_>], bodies: &BodiesFile<'_>) -> String {
    let mut text = format!("format = {}\n", Value::from(FORMAT));
    let mut line = |line: &str| writeln!(text, "{line}").expect("a string takes any text");
    if let Some(name) = world.name {
        line(&format!("name = {}", Value::from(name)));
    }
    let (low, high) = world.domain;
    let corner = |point: DVec2| Value::from(point.to_array().to_vec());
    line(&format!("domain = {}", Value::from(vec![corner(low), corner(high)])));
    if !world.physics.is_empty() {
        line("\n[physics]");
        world.physics.iter().for_each(|(key, value)| line(&format!("{key} = {value}")));
    }
    for (number, kind) in world.kinds.iter().enumerate() {
        line("\n[[kinds]]");
        if let Some(Some(name)) = world.names.get(number) {
            line(&format!("name = {}", Value::from(name.as_str())));
        }
        kind_lines(kind).iter().for_each(|of_kind| line(of_kind));
    }
    for entry in statics.iter().flat_map(Alike::entries) {
        line("\n[[statics]]");
        entry.iter().for_each(|of_static| line(of_static));
    }
    let BodiesFile { name, xxh3, count } = *bodies;
    line(&format!("\n[bodies]\npath = {}\nxxh3 = \"{xxh3}\"\ncount = {count}", Value::from(name)));
    text
}

/// Brings bodies in the order of a Hilbert curve over the domain, so that those of a group of rows are near each other.
pub(crate) fn sort_in_space(bodies: &mut [Body], (low, high): (DVec2, DVec2)) {
    let cell = |body: &Body| {
        let [x, y] =
            ((body.position - low) / (high - low) * CELLS).clamp(DVec2::ZERO, DVec2::splat(CELLS - 1.0)).to_array();
        hilbert(x as u32, y as u32)
    };
    bodies.sort_by_cached_key(|body| (cell(body), body.id));
}

/// The place of a cell on the curve.
fn hilbert(mut x: u32, mut y: u32) -> u32 {
    let (mut place, mut side) = (0, CELLS as u32 / 2);
    while side > 0 {
        let (right, upper) = (u32::from(x & side > 0), u32::from(y & side > 0));
        place += side * side * ((3 * right) ^ upper);
        if upper == 0 {
            if right == 1 {
                (x, y) = (CELLS as u32 - 1 - x, CELLS as u32 - 1 - y);
            }
            (x, y) = (y, x);
        }
        side /= 2;
    }
    place
}

/// The columns that these bodies need: angles, unless some rotation is none that an angle leads to.
pub(crate) fn columns(bodies: &[Body]) -> Vec<Column> {
    let turned = bodies.iter().any(|body| angle(body.rotation).is_none());
    let is_needed = |column: &Column| match column {
        Column::Angle => !turned,
        Column::Cos | Column::Sin => turned,
        _ => true,
    };
    Column::ALL.into_iter().filter(is_needed).collect()
}

/// Writes these columns of bodies as CSV: each number as the shortest decimal that leads back to its bits.
///
/// # Errors
/// What the system says.
pub(crate) fn csv(out: impl Write, columns: &[Column], bodies: &[Body]) -> io::Result<()> {
    let mut out = BufWriter::new(out);
    let names: Vec<&str> = columns.iter().map(|column| column.name()).collect();
    writeln!(out, "{}", names.join(","))?;
    for body in bodies {
        for (place, column) in columns.iter().enumerate() {
            if place > 0 {
                write!(out, ",")?;
            }
            match column {
                Column::Id => write!(out, "{}", body.id),
                Column::Kind => write!(out, "{}", body.kind.0),
                Column::X => write!(out, "{:?}", body.position.x),
                Column::Y => write!(out, "{:?}", body.position.y),
                Column::Angle => write!(out, "{:?}", body.rotation.angle()),
                Column::Cos => write!(out, "{:?}", body.rotation.c),
                Column::Sin => write!(out, "{:?}", body.rotation.s),
                Column::Vx => write!(out, "{:?}", body.velocity.x),
                Column::Vy => write!(out, "{:?}", body.velocity.y),
                Column::Omega => write!(out, "{:?}", body.angular_velocity),
            }?;
        }
        writeln!(out)?;
    }
    out.flush()
}

/// Writes these columns of bodies as Parquet, in groups that say where their bodies are.
///
/// # Errors
/// What the library or the system says.
pub(crate) fn parquet(out: impl Write + Send, columns: &[Column], bodies: &[Body]) -> io::Result<()> {
    write_groups(BufWriter::new(out), columns, bodies).map_err(|error| match error {
        ParquetError::External(error) => io::Error::other(error.to_string()),
        error => io::Error::other(error),
    })
}

fn write_groups(out: impl Write + Send, columns: &[Column], bodies: &[Body]) -> Result<(), ParquetError> {
    let field = |column: &Column| {
        let form = match column {
            Column::Id => "int64 id (INTEGER(64, false))",
            Column::Kind => "int32 kind (INTEGER(32, false))",
            Column::X | Column::Y => return format!("required double {};", column.name()),
            _ => return format!("required float {};", column.name()),
        };
        format!("required {form};")
    };
    let schema = format!("message atoll {{ {} }}", columns.iter().map(field).collect::<String>());
    let mut properties = WriterProperties::builder()
        .set_created_by(concat!("atoll version ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_dictionary_enabled(false)
        .set_statistics_enabled(EnabledStatistics::None)
        .set_compression(Compression::SNAPPY);
    for column in columns {
        let path = ColumnPath::from(column.name());
        properties = match column {
            Column::Id => properties.set_column_encoding(path.clone(), Encoding::DELTA_BINARY_PACKED),
            Column::Kind => properties.set_column_dictionary_enabled(path.clone(), true),
            _ => properties.set_column_encoding(path.clone(), Encoding::BYTE_STREAM_SPLIT),
        };
        if matches!(column, Column::Id | Column::X | Column::Y) {
            properties = properties.set_column_statistics_enabled(path, EnabledStatistics::Chunk);
        }
    }
    let schema = Arc::new(parse_message_type(&schema)?);
    let mut writer = SerializedFileWriter::new(out, schema, Arc::new(properties.build()))?;
    for bodies in bodies.chunks(IN_A_GROUP) {
        let mut group = writer.next_row_group()?;
        for column in columns {
            let mut next =
                group.next_column()?.ok_or_else(|| ParquetError::General("a column is missing".to_owned()))?;
            let floats = |read: fn(&Body) -> f32| bodies.iter().map(read).collect::<Vec<f32>>();
            let doubles = |read: fn(&Body) -> f64| bodies.iter().map(read).collect::<Vec<f64>>();
            match column {
                Column::Id => {
                    let ids: Vec<i64> = bodies.iter().map(|body| body.id.0.cast_signed()).collect();
                    next.typed::<Int64Type>().write_batch(&ids, None, None)
                }
                Column::Kind => {
                    let kinds: Vec<i32> = bodies.iter().map(|body| body.kind.0.cast_signed()).collect();
                    next.typed::<Int32Type>().write_batch(&kinds, None, None)
                }
                Column::X => next.typed::<DoubleType>().write_batch(&doubles(|body| body.position.x), None, None),
                Column::Y => next.typed::<DoubleType>().write_batch(&doubles(|body| body.position.y), None, None),
                Column::Angle => {
                    next.typed::<FloatType>().write_batch(&floats(|body| body.rotation.angle()), None, None)
                }
                Column::Cos => next.typed::<FloatType>().write_batch(&floats(|body| body.rotation.c), None, None),
                Column::Sin => next.typed::<FloatType>().write_batch(&floats(|body| body.rotation.s), None, None),
                Column::Vx => next.typed::<FloatType>().write_batch(&floats(|body| body.velocity.x), None, None),
                Column::Vy => next.typed::<FloatType>().write_batch(&floats(|body| body.velocity.y), None, None),
                Column::Omega => {
                    next.typed::<FloatType>().write_batch(&floats(|body| body.angular_velocity), None, None)
                }
            }?;
            next.close()?;
        }
        group.close()?;
    }
    writer.close().map(drop)
}
