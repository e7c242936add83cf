use super::*;
use crate::folder::recording::testing::{bodies, facts, record, stage};
use crate::look::frame::Setting;
use crate::look::source::records;
use atoll_core::{GlobalId, Kind, Material, Part, Partition, Rot, Segment, Shape, StaticBody, Travel};
use glam::{DVec2, Vec2};
use std::fs;
use tempfile::TempDir;

/// Three records of two ranks.
fn recorded() -> (TempDir, Recorded) {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path(), &facts(5), 2, (0..=10).step_by(5), bodies);
    let recorded = Recorded::open(folder.path()).unwrap();
    (folder, recorded)
}

/// A `.vtu`, taken apart.
struct Piece {
    text: String,
    data: Vec<u8>,
}

impl Piece {
    fn read(path: &Path) -> Self {
        let bytes = fs::read(path).unwrap();
        let mark = b"encoding=\"raw\">\n_";
        let start = bytes.windows(mark.len()).position(|part| part == mark).unwrap() + mark.len();
        Self { text: String::from_utf8(bytes[..start].to_vec()).unwrap(), data: bytes[start..].to_vec() }
    }

    /// The bytes of a column.
    fn column(&self, name: &str) -> &[u8] {
        let line = self.text.lines().find(|line| line.contains(&format!("Name=\"{name}\""))).unwrap();
        let offset: usize = line.split("offset=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
        let length = u64::from_le_bytes(self.data[offset..offset + 8].try_into().unwrap()) as usize;
        &self.data[offset + 8..offset + 8 + length]
    }

    fn numbers<const N: usize, T>(&self, name: &str, from: fn([u8; N]) -> T) -> Vec<T> {
        self.column(name).chunks(N).map(|chunk| from(chunk.try_into().unwrap())).collect()
    }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<_> = entries.collect();
    names.sort();
    names
}

#[test]
fn each_rank_and_step_has_a_file_with_what_was_recorded() {
    let (folder, recorded) = recorded();
    let out = folder.path().join("new/out");
    let mut told = Vec::new();
    let tell = |done, of| {
        told.push((done, of));
        true
    };
    let written = export(&recorded, &out, records(&recorded, Some(10)).unwrap(), tell).unwrap().unwrap();
    assert_eq!((written.steps.as_slice(), written.bodies, told), (&[0, 10][..], [20, 20], vec![(1, 2), (2, 2)]));
    assert_eq!(written.collection, out.join("run.pvd"));
    let steps = ["bodies-0000000000", "bodies-0000000000.pvtu", "bodies-0000000010", "bodies-0000000010.pvtu"];
    assert_eq!(names(&out), [&steps[..], &["run.pvd", "statics.vtu"]].concat());
    assert_eq!(names(&out.join("bodies-0000000010")), ["rank-00000.vtu", "rank-00001.vtu"]);
    let collection = fs::read_to_string(out.join("run.pvd")).unwrap();
    // Ten steps of a fiftieth of a second.
    let last = "<DataSet timestep=\"0.2\" group=\"\" part=\"0\" name=\"bodies\" file=\"bodies-0000000010.pvtu\"/>";
    assert!(collection.contains(last) && collection.matches("statics.vtu").count() == 2, "{collection}");

    let all = bodies(10);
    for rank in 0..2 {
        let piece = Piece::read(&out.join(format!("bodies-0000000010/rank-{rank:05}.vtu")));
        let of_rank: Vec<_> = all.iter().skip(rank).step_by(2).collect();
        assert_eq!(piece.numbers("id", u64::from_le_bytes), of_rank.iter().map(|body| body.id.0).collect::<Vec<_>>());
        let kinds: Vec<u32> = of_rank.iter().map(|body| body.kind.0).collect();
        assert_eq!(piece.numbers("kind", u32::from_le_bytes), kinds);
        assert_eq!(piece.numbers("rank", u32::from_le_bytes), [rank as u32; 10]);
        let tiles: Vec<u32> = of_rank.iter().map(|body| recorded.setting().partition.locate(body.position).0).collect();
        assert_eq!(piece.numbers("tile", u32::from_le_bytes), tiles);
        let velocities = of_rank.iter().flat_map(|body| [body.velocity.x, body.velocity.y, 0.0]);
        assert!(piece.numbers("velocity", f32::from_le_bytes).into_iter().eq(velocities));
        let spins = of_rank.iter().map(|body| body.angular_velocity);
        assert!(piece.numbers("spin", f32::from_le_bytes).into_iter().eq(spins));

        let points = piece.numbers("Points", f64::from_le_bytes);
        let ends = piece.numbers("offsets", i64::from_le_bytes);
        assert_eq!(piece.numbers("connectivity", i64::from_le_bytes), (0..points.len() as i64 / 3).collect::<Vec<_>>());
        let mut start = 0;
        for (body, end) in of_rank.iter().zip(ends) {
            let corners: Vec<_> =
                points[3 * start..3 * end as usize].chunks(3).map(|p| DVec2::new(p[0], p[1])).collect();
            start = end as usize;
            let mean = corners.iter().sum::<DVec2>() / corners.len() as f64;
            assert!((mean - body.position).length() < 1e-6, "{mean} and {}", body.position);
            let next = corners.iter().cycle().skip(1);
            let area: f64 = corners.iter().zip(next).map(|(a, b)| 0.5 * (*a - mean).perp_dot(*b - mean)).sum();
            let shape = stage().0[body.kind.0 as usize].shape.clone();
            // A polygon within a circle is a little smaller, and all go round counter-clockwise.
            let least = if matches!(shape, Shape::Box { .. }) { 1.0 } else { 0.988 };
            let part = area / f64::from(shape.area());
            assert!((least - 1e-6..1.0 + 1e-6).contains(&part), "{part} of {shape:?}");
        }
        let types = piece.column("types");
        assert!(types.iter().zip(kinds).all(|(of, kind)| *of == if kind == 0 { 9 } else { 7 }), "{types:?}");
    }
    let statics = Piece::read(&out.join("statics.vtu"));
    assert_eq!(statics.numbers("id", u64::from_le_bytes), [0, 1]);
    // After those of bodies.
    assert_eq!(statics.numbers("kind", u32::from_le_bytes), [2, 2]);
    let bytes = |folder: &Path| {
        names(folder)
            .iter()
            .map(|name| fs::metadata(folder.join(name)).unwrap())
            .filter(|data| data.is_file())
            .map(|data| data.len())
            .sum::<u64>()
    };
    let folders = ["bodies-0000000000", "bodies-0000000010"].map(|name| bytes(&out.join(name)));
    assert_eq!(written.bytes, bytes(&out) + folders.iter().sum::<u64>());
}

#[test]
fn a_record_without_bodies_has_a_file_without_any() {
    let folder = tempfile::tempdir().unwrap();
    let some = |step| if step == 5 { bodies(step) } else { Vec::new() };
    record(folder.path(), &facts(5), 2, (0..=10).step_by(5), some);
    let (recorded, out) = (Recorded::open(folder.path()).unwrap(), folder.path().join("out"));
    let written = export(&recorded, &out, records(&recorded, None).unwrap(), |_, _| true).unwrap().unwrap();
    assert_eq!(written.bodies, [0, 20]);
    let nobody = Piece::read(&out.join("bodies-0000000010/rank-00000.vtu"));
    assert!(nobody.text.contains("NumberOfCells=\"0\"") && nobody.column("id").is_empty());
    let step = fs::read_to_string(out.join("bodies-0000000010.pvtu")).unwrap();
    assert_eq!(step.matches("<Piece Source=").count(), 1, "{step}");
}

#[test]
fn what_fails_leaves_nothing() {
    let (folder, recorded) = recorded();
    let full = folder.path().join("full");
    fs::create_dir(&full).unwrap();
    fs::write(full.join("thesis.tex"), "").unwrap();
    let told = |out: &Path| export(&recorded, out, records(&recorded, None).unwrap(), |_, _| true).unwrap_err();
    let error = told(&full);
    assert!(error.to_string().ends_with("full: it is not empty; name a new folder"), "{error}");
    let error = told(&full.join("thesis.tex"));
    assert!(error.to_string().contains("thesis.tex: Not a directory"), "{error}");
    assert_eq!(names(&full), ["thesis.tex"]);
    let stopped = folder.path().join("stopped");
    assert_eq!(export(&recorded, &stopped, records(&recorded, None).unwrap(), |done, _| done < 2).unwrap(), None);
    assert!(!stopped.exists());

    // Torn after it was opened, and in a later record.
    let torn = folder.path().join("rank-00001/steps-0000000000-0000000010.parquet");
    let bytes = fs::read(&torn).unwrap();
    let mut harmed = bytes.clone();
    let footer = harmed.len() - 8 - u32::from_le_bytes(harmed[harmed.len() - 8..][..4].try_into().unwrap()) as usize;
    harmed[footer - 5] ^= 1;
    fs::write(&torn, harmed).unwrap();
    let (new, empty) = (folder.path().join("new"), folder.path().join("empty"));
    fs::create_dir(&empty).unwrap();
    for out in [&new, &empty] {
        let error = told(out);
        assert!(error.to_string().contains("the bytes of step 10 are not those that were written"), "{error}");
    }
    assert!(!new.exists() && names(&empty).is_empty());
}

#[test]
fn every_shape_is_polygons_and_what_moves_is_where_it_is() {
    let at = |shape, x: f32| Part { shape, position: Vec2::new(x, 0.0), rotation: Rot::IDENTITY };
    let capsule = Shape::capsule(2.0, 0.5).unwrap();
    let pair = Shape::compound(vec![at(Shape::circle(1.0), -2.0), at(capsule.clone(), 3.0)]).unwrap();
    let triangle = [(0.0, 0.0), (3.0, 0.0), (0.0, 3.0)].map(|(x, y)| Vec2::new(x, y));
    let segment = Segment::new(None, Vec2::ZERO, Vec2::new(4.0, 0.0), None).unwrap().0;
    let shapes = [capsule, Shape::polygon(&triangle, 0.0).unwrap(), Shape::Segment(segment), pair];
    let fixed = |(id, shape): (u64, &Shape)| StaticBody {
        rotation: Rot::from_angle(0.4),
        ..StaticBody::new(GlobalId(id), Kind::new(shape.clone(), Material::default()), DVec2::new(5.0, 6.0))
    };
    let mut setting = Setting {
        partition: Partition::uniform(DVec2::ZERO, DVec2::splat(10.0), 1, 1).unwrap(),
        kinds: Vec::new(),
        names: Vec::new(),
        statics: (0..).zip(&shapes).map(fixed).collect(),
        hertz: 50.0,
    };
    let folder = tempfile::tempdir().unwrap();
    let written = |setting: &Setting, step| {
        let path = folder.path().join("statics.vtu");
        write_statics(setting, step, &mut fs::File::create(&path).unwrap()).unwrap();
        Piece::read(&path)
    };
    let piece = written(&setting, 50);
    // A compound is a polygon for each part.
    assert_eq!(piece.numbers("id", u64::from_le_bytes), [0, 1, 2, 3, 3]);
    assert_eq!(piece.column("types"), [7, 7, 3, 7, 7]);
    let (points, ends) = (piece.numbers("Points", f64::from_le_bytes), piece.numbers("offsets", i64::from_le_bytes));
    let mut start = 0;
    let outlines = ends.iter().map(|&end| {
        let of = &points[3 * start..3 * end as usize];
        start = end as usize;
        let corners: Vec<DVec2> = of.chunks(3).map(|p| DVec2::new(p[0], p[1])).collect();
        let next = corners.iter().cycle().skip(1);
        corners.iter().zip(next).map(|(a, b)| 0.5 * a.perp_dot(*b)).sum::<f64>()
    });
    let found: Vec<f64> = outlines.collect();
    let (round, pill) = (std::f64::consts::PI, 2.0 + 0.25 * std::f64::consts::PI);
    for (found, expected) in found.iter().zip([pill, 4.5, 0.0, round, pill]) {
        assert!((found - expected).abs() <= 0.012 * expected + 1e-5, "{found} for {expected}");
    }
    setting.statics[1].path =
        Some(atoll_core::Path { travel: Travel::Line { velocity: DVec2::new(0.0, 2.0) }, turning: 0.0 });
    let moved = written(&setting, 50).numbers("Points", f64::from_le_bytes);
    let first = 3 * ends[0] as usize;
    // A second at 50 steps in it.
    assert!((moved[first + 1] - points[first + 1] - 2.0).abs() < 1e-6 && moved[..first] == points[..first]);
    let text = collection(&setting, &[0, 50]);
    assert!(text.contains("\"statics-0000000000.vtu\"") && text.contains("\"statics-0000000050.vtu\""), "{text}");
}
