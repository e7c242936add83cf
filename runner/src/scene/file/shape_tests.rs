//! Shapes, paths and all that kinds may say: what is read, what is written, and what is refused.

use super::write::{Alike, BodiesFile, StaticIds, World, text};
use super::*;
use atoll_core::{Dynamics, Filter, Material, Part, Path as Course, Rot, Segment, Shape, Travel};
use glam::Vec2;
use std::fs;
use tempfile::tempdir;

const HEAD: &str = "format = \"atoll-scene/1\"\ndomain = [[0.0, 0.0], [10.0, 10.0]]\n";

fn read(text: &str) -> Result<SceneFile, String> {
    let folder = tempdir().unwrap();
    let path = folder.path().join("world.toml");
    fs::write(&path, text).unwrap();
    let shorten = |error: SceneError| error.to_string().replace(&format!("{}/", folder.path().display()), "");
    SceneFile::open(&path).map_err(shorten)
}

fn kind(text: &str) -> Result<Kind, String> {
    read(&format!("{HEAD}[[kinds]]\n{text}\n")).map(|scene| scene.kinds()[0].clone())
}

fn statics(text: &str) -> Result<Vec<StaticBody>, String> {
    read(&format!("{HEAD}[[statics]]\n{text}\n")).map(|scene| scene.statics().to_vec())
}

/// How a scene says statics of which not many are alike.
fn few(statics: &[StaticBody]) -> Vec<Alike<'_>> {
    Alike::runs(statics, StaticIds::Said, |_| unreachable!("no table"))
}

fn points(points: &[(f32, f32)]) -> Vec<Vec2> {
    points.iter().map(|&(x, y)| Vec2::new(x, y)).collect()
}

/// A kind of every shape that moves, with numbers that no short decimals are, and of every key.
pub(crate) fn every_kind() -> Vec<Kind> {
    let third = 1.0_f32 / 3.0;
    let house = Shape::polygon(&points(&[(-third, 0.0), (1.1, 0.0), (1.0, 1.5), (0.1, 2.5), (-1.0, 1.7)]), 0.0);
    let round = Shape::polygon(&points(&[(0.0, 0.0), (1.7, third), (0.3, 1.1)]), 0.1).unwrap();
    let capsule = Shape::capsule(third, 0.07).unwrap();
    let part = |shape: &Shape, x, rotation| Part { shape: shape.clone(), position: Vec2::new(x, third), rotation };
    let parts = vec![
        part(&Shape::rectangle(third, 0.7), -2.0, Rot::from_angle(0.1)),
        part(&Shape::circle(third), 0.3, Rot::IDENTITY),
        // Not what any angle leads to.
        part(&round, 1.1, Rot { c: 0.6, s: 0.800_000_1 }),
        part(&capsule, 3.0, Rot::from_angle(-2.0)),
    ];
    let usual = Kind::new(Shape::compound(parts).unwrap(), Material::default());
    vec![
        Kind {
            filter: Filter { categories: 0x8000_0001, mask: 0, group: -7 },
            ..Kind::new(house.unwrap(), usual.material)
        },
        Kind { sensor: true, ..Kind::new(round, Material { density: third, friction: 0.0, ..usual.material }) },
        Kind {
            dynamics: Dynamics {
                gravity_scale: -third,
                linear_damping: third,
                angular_damping: 0.1,
                fixed_rotation: true,
            },
            ..Kind::new(capsule, usual.material)
        },
        Kind { filter: Filter { group: i32::MAX, ..usual.filter }, ..usual },
    ]
}

/// A static of every shape and every path.
pub(crate) fn every_static() -> Vec<StaticBody> {
    let seventh = 1.0_f64 / 7.0;
    let segment = |before, after| {
        let (segment, _) = Segment::new(before, Vec2::new(0.1, 0.2), Vec2::new(0.7, 0.8), after).unwrap();
        Kind::new(Shape::Segment(segment), Material { surface_speed: -0.3, ..Material::default() })
    };
    let ghosts = [Some(Vec2::new(-1.0, 0.3)), Some(Vec2::new(2.0, 0.1))];
    let segments = [segment(None, None), segment(ghosts[0], None), segment(ghosts[0], ghosts[1])];
    let kinds = every_kind().into_iter().chain(segments);
    let travels = [
        None,
        Some(Travel::Rest),
        Some(Travel::Line { velocity: DVec2::new(seventh, -2.0) }),
        Some(Travel::Sine { amplitude: DVec2::new(0.0, seventh), period: 1.0 / 3.0, phase: -seventh }),
        Some(Travel::Circle { radius: seventh, period: -4.0, phase: 0.0 }),
    ];
    let fixed = |(i, kind): (usize, Kind)| StaticBody {
        rotation: Rot::from_angle(i as f32),
        path: travels[i % 5].map(|travel| Course { travel, turning: if i > 4 { seventh } else { 0.0 } }),
        ..StaticBody::new(GlobalId(3 + 2 * i as u64), kind, DVec2::new(seventh * i as f64, -0.0))
    };
    kinds.enumerate().map(fixed).collect()
}

#[test]
fn what_is_written_is_read_again_bit_for_bit() {
    let (kinds, statics) = (every_kind(), every_static());
    let world = World {
        name: None,
        domain: (DVec2::ZERO, DVec2::splat(10.0)),
        physics: Vec::new(),
        kinds: &kinds,
        names: &[],
        statics: &statics,
    };
    let written = text(&world, &few(world.statics), &BodiesFile { name: "bodies.csv", xxh3: "", count: 0 });
    let alone = written.split("\n[bodies]").next().unwrap();
    let scene = read(alone).unwrap_or_else(|error| panic!("{error}\n{alone}"));
    // What tells all bits: zeros of either sign are not the same text.
    assert_eq!(format!("{:?}", scene.kinds()), format!("{kinds:?}"));
    assert_eq!(format!("{:?}", scene.statics()), format!("{statics:?}"));
    assert_eq!(
        text(
            &World { kinds: scene.kinds(), statics: scene.statics(), ..world },
            &few(scene.statics()),
            &BodiesFile { name: "bodies.csv", xxh3: "", count: 0 }
        ),
        written
    );
}

#[test]
fn shapes_are_read_as_they_are_said() {
    let shape = |text: &str| kind(text).unwrap().shape;
    assert_eq!(shape("box = [2, 1.0]"), Shape::rectangle(2.0, 1.0));
    assert_eq!(shape("circle = 0.5"), Shape::circle(0.5));
    assert_eq!(shape("capsule = [2.0, 0.25]"), Shape::capsule(2.0, 0.25).unwrap());
    // Wherever its points are, it is around its center of mass.
    let triangle = Shape::polygon(&points(&[(-1.0, -1.0), (2.0, -1.0), (-1.0, 2.0)]), 0.0).unwrap();
    assert_eq!(shape("polygon = [[5, 5], [8, 5], [5, 8], [5.5, 5.5]]"), triangle);
    assert_eq!(shape("polygon = [[3e8, 5e8], [300000003, 5e8], [3e8, 500000003]]"), triangle);
    assert_eq!(shape("polygon = [[4, 0], [6, 0]]\nradius = 0.25"), Shape::capsule(2.0, 0.25).unwrap());
    let Shape::Compound(pair) = shape("parts = [{ circle = 1 }, { box = [1, 1], at = [4, 0], angle = 0.5 }]") else {
        panic!("a compound")
    };
    let far = "parts = [{ circle = 1, at = [3e8, 0] }, { box = [1, 1], at = [300000004, 0], angle = 0.5 }]";
    assert_eq!(shape(far), Shape::Compound(pair.clone()));
    let apart = pair.parts()[1].position - pair.parts()[0].position;
    assert!((apart - Vec2::new(4.0, 0.0)).length() < 1e-6 && pair.parts()[1].rotation == Rot::from_angle(0.5));
    let of =
        kind("circle = 1\ngravity_scale = 0\nlinear_damping = 1\nfixed_rotation = true\nmask = 0xff00\nsensor = true");
    let Kind { dynamics, filter, sensor, .. } = of.unwrap();
    assert_eq!((dynamics.gravity_scale, dynamics.linear_damping, dynamics.angular_damping), (0.0, 1.0, 0.0));
    assert_eq!((dynamics.fixed_rotation, filter.mask, filter.categories, sensor), (true, 0xff00, 1, true));
}

#[test]
fn chains_become_segments_that_know_their_neighbours() {
    let chain = statics("chain = [[0, 1], [2, 1], [4, 2], [6, 2]]\nfriction = 0.1\nsurface_speed = 2").unwrap();
    let ids: Vec<u64> = chain.iter().map(|fixed| fixed.id.0).collect();
    assert_eq!(ids, [0, 1, 2]);
    let seen = |fixed: &StaticBody| match &fixed.kind.shape {
        Shape::Segment(segment) => {
            let there = |point: Vec2| fixed.position + point.as_dvec2();
            (segment.ends().map(there), segment.before().map(there), segment.after().map(there))
        }
        other => panic!("{other:?}"),
    };
    let at = |x: f64, y: f64| DVec2::new(x, y);
    assert_eq!(seen(&chain[0]), ([at(0.0, 1.0), at(2.0, 1.0)], None, Some(at(4.0, 2.0))));
    assert_eq!(seen(&chain[1]), ([at(2.0, 1.0), at(4.0, 2.0)], Some(at(0.0, 1.0)), Some(at(6.0, 2.0))));
    assert_eq!(seen(&chain[2]), ([at(4.0, 2.0), at(6.0, 2.0)], Some(at(2.0, 1.0)), None));
    assert!(chain.iter().all(|one| (one.kind.material.friction, one.kind.material.surface_speed) == (0.1, 2.0)));
    let ring = statics("chain = [[0, 0], [4, 0], [0, 4]]\nloop = true\npath = { line = [1, 0] }").unwrap();
    assert_eq!(seen(&ring[2]), ([at(0.0, 4.0), at(0.0, 0.0)], Some(at(4.0, 0.0)), Some(at(4.0, 0.0))));
    assert!(ring.len() == 3 && ring.iter().all(|one| one.path.is_some()));
    // A name of its own is that of the first segment.
    let more = "id = 40\nchain = [[0, 1], [2, 1], [4, 2]]\n[[statics]]\nid = 42\ncircle = 1\nx = 0\ny = 0";
    let ids: Vec<u64> = statics(more).unwrap().iter().map(|fixed| fixed.id.0).collect();
    assert_eq!(ids, [40, 41, 42]);
    let told = statics(&more.replace("42", "41")).unwrap_err();
    assert!(told.contains("[[statics]] 1, id = 41: another static has that id"), "{told}");
    // One that is said by its ends is turned around where it is put.
    let ramp = statics("segment = { from = [0, 0], to = [2, 0] }\nx = 1\ny = 1\nangle = 1.5707964").unwrap();
    assert!((ramp[0].position - at(1.0, 2.0)).length() < 1e-6, "{}", ramp[0].position);
}

#[test]
fn paths_are_read_as_they_are_said() {
    let path = |text: &str| statics(&format!("circle = 1\nx = 0\ny = 0\npath = {text}")).unwrap()[0].path;
    let course = |travel, turning| Some(Course { travel, turning });
    assert_eq!(path("{ line = [1, -2] }"), course(Travel::Line { velocity: DVec2::new(1.0, -2.0) }, 0.0));
    let sine = Travel::Sine { amplitude: DVec2::new(0.0, 2.0), period: 4.0, phase: 0.25 };
    assert_eq!(path("{ sine = [0, 2], period = 4, phase = 0.25, turning = 1 }"), course(sine, 1.0));
    let circle = Travel::Circle { radius: 2.0, period: -4.0, phase: 0.0 };
    assert_eq!(path("{ circle = 2, period = -4 }"), course(circle, 0.0));
    assert_eq!(path("{ turning = 3 }"), course(Travel::Rest, 3.0));
}

#[test]
fn what_cannot_be_is_refused_in_one_line() {
    const AT: &str = "\nx = 0\ny = 0";
    let in_kind = [
        ("", "[[kinds]] 0, shape: is missing: must be \"box\" or \"circle\"; or give polygon, capsule or parts"),
        ("name = \"crate\"\nbax = [1, 1]\ndensity = 2", "[[kinds]] 0, bax = [...]: unknown key; did you mean box?"),
        ("prats = [{ circle = 1 }]", "[[kinds]] 0, prats = [...]: unknown key; did you mean parts?"),
        ("shape = \"box\"\nwidth = 1\nhieght = 1", "[[kinds]] 0, hieght = 1: unknown key; did you mean height?"),
        ("shape = \"box\"\nwidth = 1\nradius = 1", "[[kinds]] 0, height: is missing: must be a positive number"),
        ("shape = \"circle\"\nradios = 1\ndensity = 2", "[[kinds]] 0, radios = 1: unknown key; did you mean radius?"),
        ("width = 1\nheight = 1", "[[kinds]] 0, shape: is missing"),
        ("circle = 1\nbox = [1, 1]", "circle = 1: there is box already; leave one out"),
        ("circle = 0", "circle = 0: must be its radius, a positive number, in meters"),
        (
            "circle = 1e30",
            "[[kinds]] 0, circle = 1e30: mass and moment of inertia would be out of the range of 32 bits",
        ),
        ("shape = \"box\"\nwidth = 1e20\nheight = 1e20", "[[kinds]] 0, width = 1e20: mass and moment of inertia would"),
        ("shape = \"box\"\nwidth = 1\nheight = 1e20", "[[kinds]] 0, height = 1e20: mass and moment of inertia would"),
        ("shape = \"box\"\nwidth = 1e-39\nheight = 2", "[[kinds]] 0, width = 1e-39: mass and moment of inertia would"),
        ("shape = \"circle\"\nradius = 1e20", "[[kinds]] 0, radius = 1e20: mass and moment of inertia would"),
        (
            "polygon = [[0, 0], [2, 0], [0, 1]]\nradius = 1e20",
            "[[kinds]] 0, radius = 1e20: mass and moment of inertia would",
        ),
        (
            "polygon = [[0, 0], [1e20, 0], [0, 1e20]]\nradius = 0",
            "[[kinds]] 0, polygon = [...]: mass and moment of inertia would",
        ),
        ("circle = 1e20\nwidth = 1e30", "[[kinds]] 0, width = 1e30: unknown key"),
        ("parts = [{ circle = 1e20 }, { circle = 1 }]", "[[kinds]] 0, parts = [...]: mass and moment of inertia would"),
        ("circle = 0.1\ndensity = 1e-38", "[[kinds]] 0, density = 1e-38: mass and moment of inertia would"),
        ("circle = 0.1\ndensity = 1e-50", "[[kinds]] 0, density = 1e-50: must be a positive number, in kg/m^2"),
        ("box = [1]", "box = [...]: must be [width, height], both positive"),
        ("capsule = [1, -1]", "capsule = [...]: must be [length, radius], both positive"),
        ("capsule = [1, 1e-5]", "capsule = [...]: its radius is less than a ten thousandth of its length; give a"),
        ("capsule = [1, 1]\nradius = 1", "radius = 1: unknown key"),
        ("polygon = 3", "polygon = 3: must be points in meters"),
        ("polygon = [[0, 0], [1, 0], [0, nan]]", "polygon = [...]: must be points in meters"),
        ("polygon = [[0, 0], [1, 0], [2, 0]]", "polygon = [...]: its points lie on one line; give three"),
        ("polygon = [[0, 0], [1, 0], [0, 1]]\nradius = -1", "radius = -1: must be a number, at least 0"),
        (
            "polygon = [[0, 0], [2, 0], [3, 1], [3, 2], [2, 3], [1, 3.5], [0, 3], [-1, 2], [-1, 1]]",
            "has 9 corners; use at most 8",
        ),
        ("parts = []", "parts = [...]: a compound of 0 parts; use 1 to 256"),
        ("parts = [3]", "parts = [...]: must be a list such as [{ circle = 0.5"),
        ("parts = [{ at = [0, 0] }]", "parts = [...]: part 0 must have one of box, circle, polygon and capsule"),
        ("parts = [{ circle = 1, box = [1, 1] }]", "part 0 must have one of"),
        ("parts = [{ crcle = 1 }]", "[[kinds]] 0, parts 0, crcle = 1: unknown key; did you mean circle?"),
        ("parts = [{ radius = 0.1, polgon = [] }]", "parts 0, polgon = [...]: unknown key; did you mean polygon?"),
        ("parts = [{ circle = 1 }, { circle = -1 }]", "[[kinds]] 0, parts 1, circle = -1: must be its radius"),
        (
            "parts = [{ circle = 1, ta = [0, 0] }]",
            "[[kinds]] 0, parts 0, ta = [...]: unknown key; there are box, circle, at",
        ),
        ("parts = [{ circle = 1, at = [0] }]", "parts 0, at = [...]: must be [x, y], in meters"),
        ("chain = [[0, 0], [1, 0]]", "chain = [...]: is for [[statics]] alone"),
        ("segment = { from = [0, 0], to = [1, 0] }", "segment = {...}: is for [[statics]] alone"),
        ("circle = 1\nsurface_speed = 1", "surface_speed = 1: is for [[statics]] alone"),
        ("circle = 1\ngravity_scale = inf", "gravity_scale = inf: must be a number"),
        ("circle = 1\nlinear_damping = -1", "linear_damping = -1: must be a number, at least 0, in 1/s"),
        ("circle = 1\nangular_damping = \"a\"", "angular_damping = \"a\": must be a number, at least 0, in 1/s"),
        ("circle = 1\nfixed_rotation = 1", "fixed_rotation = 1: must be true or false"),
        ("circle = 1\nsensor = 1", "sensor = 1: must be true or false"),
        ("circle = 1\nmask = -1", "mask = -1: must be a whole number from 0 to 4294967295"),
        ("circle = 1\ncategories = 4294967296", "categories = 4294967296: must be a whole number from 0"),
        ("circle = 1\ngroup = 3000000000", "group = 3000000000: must be a whole number within 32 bits"),
        ("circle = 1\npath = { line = [1, 0] }", "path = {...}: unknown key"),
    ];
    let of_static = [
        ("chain = [[0, 0]]", "chain = [...]: it has 1 points, and needs 2 at least"),
        ("chain = [[0, 0], [1, 0]]\nloop = true", "it has 2 points, and needs 3 at least"),
        ("chain = [[0, 0], [1, 0], [1, 0]]", "two points of a chain, one after the other, lie upon each other"),
        ("chain = [[0, 0], [1e10, 0]]", "chain = [...]: must be two points or more within 1e9 m"),
        ("chain = [[0, 0], [1, 0]]\nx = 1", "x = 1: unknown key"),
        ("chain = [[0, 0], [1, 0]]\ncircle = 1", "chain = [...]: there is circle already"),
        ("chain = [[0, 0], [1, 0]]\npath = { turning = 1 }", "path = {...}: a chain cannot turn"),
    ];
    let at_a_place = [
        ("segment = { from = [0, 0] }", "segment, to: is missing: must be [x, y] in meters"),
        ("segment = { from = [0, 0], to = [0, 0] }", "segment = {...}: two points of a chain"),
        ("segment = { from = [0, 0], to = [1, 0], next = [2, 0] }", "segment, next = [...]: unknown key"),
        ("cirle = 1\nangle = 1", "[[statics]] 0, cirle = 1: unknown key; did you mean circle?"),
        ("shape = \"box\"\nwidht = 1\nheight = 1", "[[statics]] 0, widht = 1: unknown key; did you mean width?"),
        ("angle = 1", "[[statics]] 0, shape: is missing"),
        ("places = 1", "[[statics]] 0, places = 1: must be the path of a file"),
        ("wdth = 1\nzzzzzzzz = 1", "[[statics]] 0, wdth = 1: unknown key; did you mean width?"),
        ("zzzzzzzz = 1", "[[statics]] 0, zzzzzzzz = 1: unknown key; there are id, places, segment, box, circle"),
        ("circle = 1\npath = 3", "path = 3: must be a table such as { line = [1.0, 0.0] }"),
        ("circle = 1\npath = { line = [1, 0], circle = 1 }", "path, circle = 1: there is line already"),
        ("circle = 1\npath = { line = [1, inf] }", "path, line = [...]: must be a velocity"),
        ("circle = 1\npath = { line = [1, 0], period = 1 }", "path, period = 1: unknown key"),
        ("circle = 1\npath = { sine = [1, 0] }", "path, period: is missing: must be a number of seconds other than 0"),
        ("circle = 1\npath = { line = [1e30, 0] }", "path, line = [...]: nothing here goes faster than 1e9 m/s"),
        ("circle = 1\nsurface_speed = -1e10", ": must be a number within -1e9 to 1e9, in m/s"),
        ("circle = 1\npath = { circle = 1, period = 0 }", "path, period = 0: must be a number of seconds other than 0"),
        ("circle = 1\npath = { spin = 1 }", "path, spin = 1: unknown key"),
    ];
    let told = in_kind.iter().map(|(text, expected)| (*text, *expected, kind(text).map(drop)));
    let told = told.chain(of_static.iter().map(|(text, expected)| (*text, *expected, statics(text).map(drop))));
    let placed =
        at_a_place.iter().map(|(text, expected)| (*text, *expected, statics(&format!("{text}{AT}")).map(drop)));
    for (text, expected, told) in told.chain(placed) {
        let told = told.expect_err(text);
        if let Some((_, keys)) = told.split_once("; there are ") {
            let mut keys: Vec<&str> = keys.split(", ").collect();
            keys.sort_unstable();
            assert!(keys.windows(2).all(|pair| pair[0] != pair[1]), "{text}: {told}");
        }
        assert!(told.contains(expected) && !told.contains('\n') && told.len() < 400, "{text}: {told}");
    }
}
