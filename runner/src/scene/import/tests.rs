//! Worlds of other programs.

use super::*;
use atoll_core::{Filter, Material, Path as Course, Shape, Travel};
use tempfile::tempdir;

const RUBE: &str = r#"{
 "gravity": {"x": 0, "y": -10},
 "body": [
  {"type": 0, "name": "ground", "position": {"x": 1, "y": -1}, "angle": 0, "fixture": [
   {"friction": 0.5, "polygon": {"vertices": {"x": [-5, 5, 5, -5], "y": [-1, -1, 1, 1]}}},
   {"friction": 0.5, "circle": {"center": {"x": 0, "y": 1}, "radius": 0.5}}]},
  {"type": 2, "name": "crate", "position": {"x": 0.5, "y": 3}, "angle": 0.25, "linearVelocity": {"x": 1, "y": -2},
   "angularVelocity": "3f000000", "massData-mass": 2, "fixture": [
   {"density": 1, "friction": 0.2, "restitution": 0.1, "polygon": {"vertices": {"x": [1, 1, -1, -1], "y": [-0.5, 0.5, 0.5, -0.5]}}}]},
  {"type": 2, "name": "crate", "position": {"x": 0.5, "y": 6}, "fixture": [
   {"density": 1, "friction": 0.2, "restitution": 0.1, "polygon": {"vertices": {"x": [1, 1, -1, -1], "y": [-0.5, 0.5, 0.5, -0.5]}}}]},
  {"type": 2, "name": "ball", "position": 0, "linearVelocity": 0, "fixture": [
   {"density": 3, "circle": {"center": 0, "radius": 0.75}}]}
 ]}"#;

const LAMMPS: &str = "a title, 9 atoms\n\n3 atoms\n2 atom types\n\n-1 3.5 xlo xhi # meters\n0 2 ylo yhi\n-0.5 0.5 zlo zhi\n\n\
                      Atoms # sphere\n\n7 1 0.5 2.5 0.25 0.5 0 0 0 0\n2 1 0.5 2.5 1.0 1e-1 0 1 0 0\n5 2 0.5 2.5 2 1.5 0 0 0 0\n\n\
                      Velocities\n\n2 1 -2 0 0 0 0.5\n";

fn read_text(text: &str) -> Result<Imported, String> {
    let folder = tempdir().unwrap();
    let path = folder.path().join("world.data");
    fs::write(&path, text).unwrap();
    read(&path, |_| Ok(()))
        .map_err(|error: SceneError| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

#[test]
fn a_world_of_box2d_is_understood() {
    let world = read_text(RUBE).unwrap();
    assert_eq!((world.left_out(), world.kinds.len(), world.statics.len(), world.bodies.len()), (None, 2, 2, 3));
    assert_eq!(world.names, [Some("crate".to_owned()), Some("ball".to_owned())]);
    assert_eq!(world.kinds[0].shape, Shape::rectangle(2.0, 1.0));
    assert_eq!(world.kinds[1].material, Material { density: 3.0, friction: 0.0, ..Material::default() });
    assert_eq!(
        (world.statics[0].kind.shape.clone(), world.statics[0].position),
        (Shape::rectangle(10.0, 2.0), DVec2::new(1.0, -1.0))
    );
    assert_eq!(
        (world.statics[1].kind.shape.clone(), world.statics[1].position),
        (Shape::circle(0.5), DVec2::new(1.0, 0.0))
    );
    let body = world.bodies[0];
    assert_eq!((body.id, body.rotation, body.angular_velocity), (GlobalId(2), Rot::from_angle(0.25), 0.5));
    assert_eq!((body.velocity.to_array(), world.bodies[2].position), ([1.0, -2.0], DVec2::ZERO));
    let (low, high) = world.domain;
    assert!(low.x < -4.0 && low.y < -2.0 && high.x > 6.0 && high.y > 6.5, "{low} to {high}");
}

#[test]
fn what_box2d_has_and_nobody_here_is_counted() {
    let another = "\"fixture\": [{\"density\": 3, \"circle\": {\"radius\": 0.5}}, \n   {\"density\": 3";
    let with = |from: &str, to: &str| another.replacen(from, to, 1);
    for (from, to, expected) in [
        (" \"body\": [", " \"joint\": [{}, {}], \"image\": [{}], \"body\": [", "1 images, 2 joints"),
        ("\"density\": 3, ", "", "1 bodies without a density"),
        (
            "\"circle\": {\"center\": 0, \"radius\": 0.75}",
            "\"chain\": {\"vertices\": {\"x\": [0, 1], \"y\": [0, 1]}}",
            "1 chains and edges on bodies that move",
        ),
        (
            "\"circle\": {\"center\": 0, \"radius\": 0.75}",
            "\"chain\": {}",
            "1 bodies without a fixture, 1 chains and edges that cannot be",
        ),
        (
            "\"x\": [1, 1, -1, -1]",
            "\"x\": [1, 1, -1]",
            "1 bodies without a fixture, 1 polygons that cannot be, or have too many corners",
        ),
        (
            "\"x\": [1, 1, -1, -1]",
            "\"x\": [1, 1, 1, 1]",
            "1 bodies without a fixture, 1 polygons that cannot be, or have too many corners",
        ),
        ("\"massData-mass\": 2", "\"massData-mass\": 3", "1 masses of their own"),
        ("\"massData-mass\": 2", "\"active\": false", "1 bodies that are not active"),
        ("\"fixture\": [\n   {\"density\": 3", "\"fixture\": [{}, \n   {\"density\": 3", "1 fixtures without a shape"),
        (
            "\"fixture\": [\n   {\"density\": 3",
            &with("\"density\": 3", "\"sensor\": true"),
            "1 sensors on bodies of other fixtures",
        ),
        (
            "\"fixture\": [\n   {\"density\": 3",
            &with("\"density\": 3", "\"density\": 1"),
            "1 densities that differ within a body",
        ),
        (
            "\"fixture\": [\n   {\"density\": 3",
            &with("\"density\": 3", "\"density\": 3, \"friction\": 1"),
            "1 materials or filters that differ within a body",
        ),
        (
            "\"type\": 2, \"name\": \"ball\", \"position\": 0, \"linearVelocity\": 0, \"fixture\": [\n   {\"density\": 3, \"circle\": {\"center\": 0",
            "\"type\": 1, \"linearVelocity\": 1, \"angularVelocity\": 1, \"fixture\": [{\"circle\": {\"center\": 1",
            "1 kinematic bodies that turn, off their center, as they go",
        ),
    ] {
        assert!(RUBE.contains(from), "{from}");
        assert_eq!(read_text(&RUBE.replacen(from, to, 1)).unwrap().left_out().as_deref(), Some(expected), "{to}");
    }
}

/// The ball of the world as something else.
fn instead_of_ball(body: &str) -> Imported {
    let ball = RUBE.rfind("  {\"type\": 2, \"name\": \"ball\"").unwrap();
    let world = read_text(&format!("{}{body}]}}", &RUBE[..ball])).unwrap();
    assert_eq!(world.left_out(), None);
    world
}

#[test]
fn polygons_and_bodies_of_several_fixtures_are_understood() {
    // A triangle is around its center of mass, which is where its body is put.
    let world = instead_of_ball(
        r#"{"type": 2, "position": {"x": 1, "y": 2}, "angle": 0, "fixture": [
            {"density": 2, "polygon": {"vertices": {"x": [0, 3, 0], "y": [0, 0, 3]}}}]}"#,
    );
    assert_eq!(world.bodies[2].position, DVec2::new(2.0, 3.0));
    assert!((world.kinds[1].shape.area() - 4.5).abs() < 1e-5 && matches!(world.kinds[1].shape, Shape::Polygon(_)));
    // Turned by a quarter, what was right of the body is above it. Two discs, of which one has three times the mass.
    let world = instead_of_ball(
        r#"{"type": 2, "position": {"x": 1, "y": 2}, "angle": 1.5707963267948966, "linearVelocity": {"x": 0, "y": 1}, "fixture": [
            {"density": 2, "circle": {"center": {"x": 4, "y": 0}, "radius": 1}},
            {"density": 2, "circle": {"center": 0, "radius": 1.7320508}}]}"#,
    );
    let (body, Shape::Compound(compound)) = (world.bodies[2], &world.kinds[1].shape) else { panic!("a compound") };
    assert!((body.position - DVec2::new(1.0, 3.0)).length() < 1e-5, "{}", body.position);
    assert!((compound.parts()[0].position.x - 3.0).abs() < 1e-5 && (compound.parts()[1].position.x + 1.0).abs() < 1e-5);
    // One disc alone is one, wherever its body says that it is.
    let world = instead_of_ball(
        r#"{"type": 2, "position": {"x": 1, "y": 2}, "fixture": [{"density": 2, "circle": {"center": {"x": 4, "y": 0}, "radius": 1}}]}"#,
    );
    assert_eq!((world.bodies[2].position, world.kinds[1].shape.clone()), (DVec2::new(5.0, 2.0), Shape::circle(1.0)));
}

#[test]
fn how_a_body_moves_and_whom_it_touches_is_understood() {
    let world = instead_of_ball(
        r#"{"type": 2, "position": 0, "gravityScale": 0.5, "linearDamping": 2, "angularDamping": 3, "fixedRotation": true,
            "fixture": [{"density": 2, "sensor": true, "filter-categoryBits": 4, "filter-maskBits": 3, "filter-groupIndex": -2,
            "circle": {"radius": 1}}]}"#,
    );
    let kind = &world.kinds[1];
    assert_eq!((kind.filter, kind.sensor), (Filter { categories: 4, mask: 3, group: -2 }, true));
    let dynamics = kind.dynamics;
    assert_eq!((dynamics.gravity_scale, dynamics.linear_damping), (0.5, 2.0));
    assert_eq!((dynamics.angular_damping, dynamics.fixed_rotation), (3.0, true));
    let all = instead_of_ball(
        r#"{"type": 2, "position": 0, "fixture": [{"density": 2, "filter-maskBits": 65535, "circle": {"radius": 1}}]}"#,
    );
    assert_eq!(all.kinds[1].filter, Filter::default());
}

#[test]
fn chains_edges_and_what_is_kinematic_are_understood() {
    // Three segments, and as many the other way round; a closed one ends where it began.
    let world = instead_of_ball(
        r#"{"type": 0, "position": {"x": 1, "y": 0}, "fixture": [
            {"chain": {"vertices": {"x": [0, 2, 4, 4], "y": [0, 0, 0, 5]}}},
            {"chain": {"vertices": {"x": [0, 2, 4, 0], "y": [0, 0, 3, 0]}}},
            {"edge": {"vertex1": {"x": 0, "y": 0}, "vertex2": {"x": 6, "y": 0}}}]}"#,
    );
    let segments: Vec<_> = world.statics[2..]
        .iter()
        .map(|fixed| match &fixed.kind.shape {
            Shape::Segment(segment) => (fixed.position, segment.ends()[1], segment.before(), segment.after()),
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(segments.len(), 2 * (3 + 3 + 1));
    assert_eq!(segments[0].0, DVec2::new(2.0, 0.0));
    assert!(segments[0].2.is_none() && segments[0].3.is_some(), "a chain that is open begins somewhere");
    assert!(segments[6..12].iter().all(|(.., before, after)| before.is_some() && after.is_some()));
    assert_eq!(segments[12].1, -segments[13].1, "both sides of an edge");

    let path = |body: &str| {
        let world = instead_of_ball(body);
        let fixed = world.statics.last().unwrap().clone();
        (fixed.position, fixed.path.unwrap())
    };
    let lift = path(
        r#"{"type": 1, "position": {"x": 1, "y": 2}, "linearVelocity": {"x": 0, "y": 3}, "fixture": [{"circle": {"center": {"x": 1, "y": 0}, "radius": 1}}]}"#,
    );
    let up = Travel::Line { velocity: DVec2::new(0.0, 3.0) };
    assert_eq!(lift, (DVec2::new(2.0, 2.0), Course { travel: up, turning: 0.0 }));
    let (around, wheel) = path(
        r#"{"type": 1, "position": {"x": 1, "y": 2}, "angularVelocity": -2, "fixture": [{"circle": {"center": {"x": 0, "y": 3}, "radius": 1}}]}"#,
    );
    assert_eq!((around, wheel.turning), (DVec2::new(1.0, 2.0), -2.0));
    // At first it is where its body has it, and then it goes round clockwise.
    let at = |step| wheel.pose(around, Rot::IDENTITY, step, 1.0 / 64.0).0;
    assert!((at(0) - DVec2::new(1.0, 5.0)).length() < 1e-9 && at(1).x > 1.0, "{} {}", at(0), at(1));
}

#[test]
fn discs_of_lammps_are_understood() {
    let world = read_text(LAMMPS).unwrap();
    assert_eq!((world.left_out(), world.domain), (None, (DVec2::new(-1.0, 0.0), DVec2::new(3.5, 2.0))));
    let ids: Vec<u64> = world.bodies.iter().map(|body| body.id.0).collect();
    assert_eq!((ids, world.kinds.len(), world.kinds[0].shape.clone()), (vec![7, 2, 5], 2, Shape::circle(0.25)));
    assert_eq!(world.names[1].as_deref(), Some("type-2"));
    let body = world.bodies[1];
    assert_eq!(
        (body.position, body.velocity.to_array(), body.angular_velocity),
        (DVec2::new(1.0, 0.1), [1.0, -2.0], 0.5)
    );
    for (from, to, expected) in [
        ("zhi\n", "zhi\n0 0 0.1 xy xz yz\n", "1 tilts of the box"),
        ("0.25 0.5 0 0 0 0", "0.25 0.5 0.1 0 0 0", "1 atoms off the plane of the others"),
        ("7 1 0.5", "7 1 0", "1 atoms without a diameter"),
        ("2 1 -2 0 0 0 0.5", "2 1 -2 0.1 0 0 0.5", "1 motions out of the plane"),
        ("Velocities", "Bonds\n\n1 1 7 2\n\nVelocities", "1 sections of other things than atoms and velocities"),
    ] {
        assert!(LAMMPS.contains(from), "{from}");
        assert_eq!(read_text(&LAMMPS.replacen(from, to, 1)).unwrap().left_out().as_deref(), Some(expected));
    }
}

#[test]
fn what_is_no_such_file_is_refused_in_one_line() {
    for (text, from, to, expected) in [
        (RUBE, RUBE, "{\"a\": 1}", "world.data: it is no world that R.U.B.E. has exported: it has no list called body"),
        (RUBE, "\"type\": 0,", "\"type\": 0", "world.data, line 4: it is no JSON: "),
        (
            RUBE,
            "\"y\": 6}",
            "\"y\": 1e12}",
            "body 2 of its list, from 0, has a number that cannot be; positions must be within 1e9 m",
        ),
        (RUBE, "\"y\": 6}", "\"y\": []}", "body 2 of its list, from 0, has a number that cannot be"),
        (RUBE, "\"radius\": 0.75", "\"radius\": -1", "it has a shape or a material that cannot be: "),
        (
            RUBE,
            "\"radius\": 0.5",
            "\"radius\": 0",
            "it has a shape or a material that cannot be: within 0 m of its middle, density 1",
        ),
        (RUBE, "\"y\": -10", "\"y\": \"7fc00000\"", "its gravity cannot be: [0.0, NaN] m/s^2"),
        (RUBE, "\"y\": -10", "\"y\": -1e39", "its gravity cannot be: [0.0, -1e39] m/s^2"),
        (LAMMPS, LAMMPS, "", "it is no data file of LAMMPS with discs: it has no section Atoms"),
        (LAMMPS, "3 atoms\n", "4 atoms\n", "it says 4 atoms, and has 3; write it again"),
        (LAMMPS, "# sphere", "# full", "line 10: atoms of style full: only sphere and granular are discs"),
        (LAMMPS, "0 2 ylo yhi", "", "its bounds are missing: lines such as 0 10 xlo xhi"),
        (LAMMPS, "0 2 ylo yhi", "2 0 ylo yhi", "its bounds are none of a domain"),
        (LAMMPS, "7 1 0.5 2.5", "7 1 0.5", "line 12: 9 numbers: must be id type diameter density x y z, and perhaps"),
        (LAMMPS, "7 1 0.5 2.5", "7.5 1 0.5 2.5", "line 12: 7.5: must be the id of an atom, a whole number"),
        (LAMMPS, "7 1 0.5 2.5", "2 1 0.5 2.5", "id 2 is there twice; give each its own"),
        (LAMMPS, "7 1 0.5 2.5", "7 1 0.5 nan", "type-1, within 0.25 m of its middle, density NaN, friction"),
        (LAMMPS, "0.25 0.5 0 0 0 0", "inf 0.5 0 0 0 0", "body 7 has a number that cannot be"),
        (
            LAMMPS,
            "2 1 -2 0 0 0 0.5",
            "2 1 -2 0 0 0",
            "line 18: the line ends: must be a velocity: id vx vy vz wx wy wz",
        ),
    ] {
        let told = read_text(&text.replacen(from, to, 1)).expect_err(to);
        assert!(told.contains(expected) && !told.contains('\n'), "{to}: {told}");
    }
}
