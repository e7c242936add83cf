//! Bodies in Parquet: ours, those of other writers, and those that cannot be.

use super::*;
use atoll_core::{KindId, Rot};
use glam::Vec2;
use parquet::basic::Compression;
use parquet::data_type::{BoolType, DoubleType, FloatType, Int32Type, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use std::sync::Arc;
use tempfile::{TempDir, tempdir};

const HEAD: &str = "format = \"atoll-scene/1\"\ndomain = [[0, 0], [1000, 1000]]\n[[kinds]]\nshape = \"circle\"\nradius = 0.2\n\
                    [[kinds]]\nname = \"b\"\nshape = \"circle\"\nradius = 0.3\n[bodies]\npath = \"b.parquet\"\n";

fn folder(bytes: &[u8]) -> TempDir {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("world.toml"), HEAD).unwrap();
    fs::write(folder.path().join("b.parquet"), bytes).unwrap();
    folder
}

fn read(bytes: &[u8]) -> Result<Vec<Body>, String> {
    let folder = folder(bytes);
    let all = SceneFile::open(&folder.path().join("world.toml")).and_then(|scene| scene.iter().collect());
    all.map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

/// A hundred thousand bodies, in two groups of rows.
fn many() -> Vec<Body> {
    let body = |k: u64| Body {
        id: GlobalId(u64::MAX - 3 * k),
        position: DVec2::new((k % 317) as f64 * 3.0, (k / 317) as f64 * 3.0 + 1e-9),
        rotation: Rot::from_angle(0.001 * k as f32),
        velocity: Vec2::new(0.1 * k as f32, -1e-30),
        angular_velocity: -0.0,
        kind: KindId((k % 2) as u32),
    };
    (0..100_000).map(body).collect()
}

fn written(bodies: &[Body]) -> Vec<u8> {
    let mut bytes = Vec::new();
    write::parquet(&mut bytes, &write::columns(bodies), bodies).unwrap();
    bytes
}

/// The bits of bodies, which tell zeros of either sign apart.
fn bits(bodies: &[Body]) -> Vec<u8> {
    bytemuck::cast_slice(bodies).to_vec()
}

#[test]
fn what_is_written_is_read_bit_for_bit() {
    let mut bodies = many();
    write::sort_in_space(&mut bodies, (DVec2::ZERO, DVec2::splat(1000.0)));
    assert!(bits(&read(&written(&bodies)).unwrap()) == bits(&bodies));
    // No angle leads to this one.
    bodies[70_000].rotation = Rot { c: 0.6, s: 0.800_000_1 };
    assert!(bits(&read(&written(&bodies)).unwrap()) == bits(&bodies));
    let mut csv = Vec::new();
    let some = &bodies[69_990..70_010];
    write::csv(&mut csv, &write::columns(some), some).unwrap();
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("world.toml"), HEAD.replace("parquet", "csv")).unwrap();
    fs::write(folder.path().join("b.csv"), csv).unwrap();
    let scene = SceneFile::open(&folder.path().join("world.toml")).unwrap();
    let read: Vec<Body> = scene.iter().map(Result::unwrap).collect();
    assert!(bits(&read) == bits(&bodies[69_990..70_010]));
    assert!(self::read(&written(&[])).unwrap().is_empty());
}

#[test]
fn bodies_of_each_kind_are_counted_where_kinds_differ_in_size() {
    let mut bodies = many();
    bodies.iter_mut().for_each(|body| body.kind = KindId(u32::from(body.id.0.is_multiple_of(3000))));
    let larger = bodies.iter().filter(|body| body.kind == KindId(1)).count() as u64;
    let folder = folder(&written(&bodies));
    let path = folder.path().join("world.toml");
    assert_eq!(SceneFile::open(&path).unwrap().by_kind(), None);
    fs::write(&path, HEAD.replace("radius = 0.3", "radius = 3")).unwrap();
    assert_eq!(SceneFile::open(&path).unwrap().by_kind(), Some(&[100_000 - larger, larger][..]));
}

#[test]
fn groups_of_rows_that_are_elsewhere_are_passed_over() {
    let mut bodies = many();
    write::sort_in_space(&mut bodies, (DVec2::ZERO, DVec2::splat(1000.0)));
    let folder = folder(&written(&bodies));
    let scene = SceneFile::open(&folder.path().join("world.toml")).unwrap();
    assert_eq!((scene.count(), scene.places().count()), (100_000, 100_000));
    let (low, high) = (DVec2::new(10.0, 10.0), DVec2::new(40.0, 30.0));
    let is_near = |body: &Body| body.position.cmpge(low).all() && body.position.cmple(high).all();
    let near = scene.near(|a, b| a.cmple(high).all() && b.cmpge(low).all());
    let near: Vec<Body> = near.map(Result::unwrap).collect();
    let expected: Vec<Body> = bodies.iter().copied().filter(is_near).collect();
    assert!(!near.is_empty() && near == expected);
    // Damage to what is elsewhere is not seen.
    let path = folder.path().join("b.parquet");
    let mut bytes = fs::read(&path).unwrap();
    let end = bytes.len() / 2;
    let untouched = bytes.len() - 20_000;
    bytes[end + 400_000..untouched].fill(0xa5);
    fs::write(&path, bytes).unwrap();
    assert!(scene.near(|a, b| a.cmple(high).all() && b.cmpge(low).all()).eq(near.into_iter().map(Ok)));
    let error = scene.iter().find_map(Result::err).unwrap().to_string();
    assert!(
        error.contains("b.parquet, row ") && error.contains(": from here on the file cannot be decoded: "),
        "{error}"
    );
}

/// A column as some writer makes it.
enum Values<'a> {
    Double(&'a [f64]),
    Float(&'a [f32]),
    Int32(&'a [i32]),
    Int64(&'a [i64]),
    Bool(&'a [bool]),
}

/// A file with these columns, whose values may be missing where a list of levels says so.
fn foreign(schema: &str, compression: Compression, columns: &[(Values<'_>, Option<&[i16]>)]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let schema = Arc::new(parse_message_type(&format!("message m {{ {schema} }}")).unwrap());
    let properties = Arc::new(WriterProperties::builder().set_compression(compression).build());
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, properties).unwrap();
    let mut group = writer.next_row_group().unwrap();
    for (values, levels) in columns {
        let mut column = group.next_column().unwrap().unwrap();
        match values {
            Values::Double(values) => column.typed::<DoubleType>().write_batch(values, *levels, None),
            Values::Float(values) => column.typed::<FloatType>().write_batch(values, *levels, None),
            Values::Int32(values) => column.typed::<Int32Type>().write_batch(values, *levels, None),
            Values::Int64(values) => column.typed::<Int64Type>().write_batch(values, *levels, None),
            Values::Bool(values) => column.typed::<BoolType>().write_batch(values, *levels, None),
        }
        .unwrap();
        column.close().unwrap();
    }
    group.close().unwrap();
    writer.close().unwrap();
    bytes
}

const NONE: Compression = Compression::UNCOMPRESSED;

#[test]
fn other_writers_have_other_types() {
    let schema = "optional double y; optional int64 kind; optional double vx; required float x; optional int64 id;";
    let levels: Option<&[i16]> = Some(&[1, 1]);
    let columns = [
        (Values::Double(&[1.5, 2.5]), levels),
        (Values::Int64(&[1, 0]), levels),
        (Values::Double(&[0.1, -3.0]), levels),
        (Values::Float(&[0.25, 4.0]), None),
        (Values::Int64(&[7, 5]), levels),
    ];
    for compression in [NONE, Compression::SNAPPY] {
        let bodies = read(&foreign(schema, compression, &columns)).unwrap();
        assert_eq!((bodies[0].position, bodies[0].velocity.x), (DVec2::new(0.25, 1.5), 0.1));
        assert_eq!((bodies[1].id, bodies[1].kind, bodies[0].kind), (GlobalId(5), KindId(0), KindId(1)));
    }
}

#[test]
fn files_that_cannot_be_are_refused_in_one_line() {
    let places = || (Values::Double(&[1.0, 2.0]), None::<&[i16]>);
    let xy = "required double x; required double y;";
    let with = |more: &str, values: Values<'_>, levels: Option<&[i16]>| {
        foreign(&format!("{xy} {more}"), NONE, &[places(), places(), (values, levels)])
    };
    let good = written(&many()[..100]);
    let mut many_columns = good.clone();
    let footer = good.len() - 8;
    many_columns[footer] = 0xff;
    for (bytes, expected) in [
        (foreign("required double x;", NONE, &[places()]), "b.parquet: the column y is missing"),
        (with("required double z;", Values::Double(&[0.0; 2]), None), "b.parquet: column z: unknown column; "),
        (
            with("required boolean id;", Values::Bool(&[true; 2]), None),
            "column id: its values are of type BOOLEAN; write INT64",
        ),
        (
            with("required int32 vx;", Values::Int32(&[1; 2]), None),
            "column vx: its values are of type INT32; write DOUBLE or FLOAT",
        ),
        (
            with("required double kind;", Values::Double(&[0.0; 2]), None),
            "column kind: its values are of type DOUBLE; write INT64",
        ),
        (
            with("required int32 kind;", Values::Int32(&[0, 2]), None),
            "b.parquet, row 2, kind = 2: there are kinds 0 to 1",
        ),
        (with("required int32 kind;", Values::Int32(&[0, -2]), None), "row 2, kind = -2: must be the number of a kind"),
        (with("required double vx;", Values::Double(&[0.0, 1e39]), None), "row 2, vx = inf: must be a finite number"),
        (
            with("required float angle;", Values::Float(&[f32::NAN, 0.0]), None),
            "row 1, angle = NaN: must be a finite number",
        ),
        (with("required float cos;", Values::Float(&[1.0; 2]), None), "b.parquet: cos and sin go together"),
        (
            with("optional float vy;", Values::Float(&[1.0]), Some(&[1, 0])),
            "row 2, vy = nothing: must be a finite number",
        ),
        (
            with("optional group a { required float vy; }", Values::Float(&[1.0; 2]), Some(&[1, 1])),
            "column a.vy: unknown column",
        ),
        (good[..good.len() - 1].to_vec(), "b.parquet: it is no Parquet file, or a damaged one: it does not end as one"),
        (good[..good.len() / 2].to_vec(), "it is no Parquet file, or a damaged one: it does not end as one"),
        (good[good.len() / 2..].to_vec(), "b.parquet"),
        (many_columns, "it is no Parquet file, or a damaged one: "),
        (Vec::new(), "b.parquet: it is no Parquet file, or a damaged one: the file is empty; write it again"),
        (b"PAR1PAR1".to_vec(), "a damaged one: it is too short"),
        (b"x,y\n1,2\n3,4\n5,6\n".to_vec(), "a damaged one: it does not end as one"),
        (b"PAR1\xff\xff\xff\x7fPAR1".to_vec(), "a damaged one: its footer is longer than the file"),
        (b"PAR1\x19\xfc\xff\xff\xff\x0f\x06\0\0\0PAR1".to_vec(), "its footer is not as any writer makes it"),
    ] {
        let told = read(&bytes).expect_err(expected);
        assert!(told.contains(expected) && !told.contains('\n'), "{expected}: {told}");
    }
}
