//! Worlds of other programs.

use super::*;
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
    read(&path).map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

#[test]
fn a_world_of_box2d_is_understood() {
    let world = read_text(RUBE).unwrap();
    assert_eq!((world.left_out(), world.kinds.len(), world.statics.len(), world.bodies.len()), (None, 2, 2, 3));
    assert_eq!(world.names, [Some("crate".to_owned()), Some("ball".to_owned())]);
    assert_eq!(world.kinds[0].shape, Shape::rectangle(2.0, 1.0));
    assert_eq!(world.kinds[1].material, Material { density: 3.0, friction: 0.0, restitution: 0.0 });
    assert_eq!(
        (world.statics[0].kind.shape, world.statics[0].position),
        (Shape::rectangle(10.0, 2.0), DVec2::new(1.0, -1.0))
    );
    assert_eq!((world.statics[1].kind.shape, world.statics[1].position), (Shape::circle(0.5), DVec2::new(1.0, 0.0)));
    let body = world.bodies[0];
    assert_eq!((body.id, body.rotation, body.angular_velocity), (GlobalId(2), Rot::from_angle(0.25), 0.5));
    assert_eq!((body.velocity.to_array(), world.bodies[2].position), ([1.0, -2.0], DVec2::ZERO));
    let (low, high) = world.domain;
    assert!(low.x < -4.0 && low.y < -2.0 && high.x > 6.0 && high.y > 6.5, "{low} to {high}");
}

#[test]
fn what_box2d_has_and_nobody_here_is_counted() {
    for (from, to, expected) in [
        (" \"body\": [", " \"joint\": [{}, {}], \"image\": [{}], \"body\": [", "1 images, 2 joints"),
        ("\"type\": 2, \"name\": \"ball\"", "\"type\": 1, \"name\": \"ball\"", "1 kinematic bodies"),
        ("\"density\": 3, ", "\"density\": 3, \"sensor\": true, ", "1 sensors"),
        ("\"density\": 3, ", "", "1 bodies without a density"),
        ("\"density\": 3, ", "\"density\": 3, \"filter-maskBits\": 3, ", "1 filters of collisions"),
        (
            "\"center\": 0, \"radius\": 0.75",
            "\"center\": {\"x\": 1}, \"radius\": 0.75",
            "1 fixtures off the center of their body",
        ),
        ("\"circle\": {\"center\": 0, \"radius\": 0.75}", "\"chain\": {}", "1 chains and edges"),
        ("\"x\": [1, 1, -1, -1]", "\"x\": [1, 2, -1, -1]", "1 polygons that are no rectangles"),
        ("\"x\": [1, 1, -1, -1]", "\"x\": [1, 1, -1]", "1 polygons that are no rectangles"),
        ("\"massData-mass\": 2", "\"massData-mass\": 3", "1 masses of their own"),
        ("\"massData-mass\": 2", "\"linearDamping\": 3", "1 dampings of one body"),
        ("\"massData-mass\": 2", "\"fixedRotation\": true", "1 bodies that must not turn"),
        ("\"massData-mass\": 2", "\"active\": false", "1 bodies that are not active"),
        ("\"massData-mass\": 2", "\"gravityScale\": 0", "1 gravities of one body"),
        (
            "\"fixture\": [\n   {\"density\": 3",
            "\"fixture\": [{}, \n   {\"density\": 3",
            "1 bodies of several fixtures",
        ),
    ] {
        assert!(RUBE.contains(from), "{from}");
        assert_eq!(read_text(&RUBE.replacen(from, to, 1)).unwrap().left_out().as_deref(), Some(expected));
    }
}

#[test]
fn discs_of_lammps_are_understood() {
    let world = read_text(LAMMPS).unwrap();
    assert_eq!((world.left_out(), world.domain), (None, (DVec2::new(-1.0, 0.0), DVec2::new(3.5, 2.0))));
    let ids: Vec<u64> = world.bodies.iter().map(|body| body.id.0).collect();
    assert_eq!((ids, world.kinds.len(), world.kinds[0].shape), (vec![7, 2, 5], 2, Shape::circle(0.25)));
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
        (RUBE, "\"y\": 6}", "\"y\": 1e12}", "body 3 has a number that cannot be; positions must be within 1e9 m"),
        (RUBE, "\"y\": 6}", "\"y\": []}", "body 3 has a number that cannot be"),
        (RUBE, "\"radius\": 0.75", "\"radius\": -1", "it has a shape or a material that cannot be: "),
        (RUBE, "\"radius\": 0.5", "\"radius\": 0", "static 1 has a number that cannot be"),
        (LAMMPS, LAMMPS, "", "it is no data file of LAMMPS with discs: it has no section Atoms"),
        (LAMMPS, "3 atoms\n", "4 atoms\n", "it says 4 atoms, and has 3; write it again"),
        (LAMMPS, "# sphere", "# full", "line 10: atoms of style full: only sphere and granular are discs"),
        (LAMMPS, "0 2 ylo yhi", "", "its bounds are missing: lines such as 0 10 xlo xhi"),
        (LAMMPS, "0 2 ylo yhi", "2 0 ylo yhi", "its bounds are none of a domain"),
        (LAMMPS, "7 1 0.5 2.5", "7 1 0.5", "line 12: 9 numbers: must be id type diameter density x y z, and perhaps"),
        (LAMMPS, "7 1 0.5 2.5", "7.5 1 0.5 2.5", "line 12: 7.5: must be the id of an atom, a whole number"),
        (LAMMPS, "7 1 0.5 2.5", "2 1 0.5 2.5", "id 2 is there twice; give each its own"),
        (LAMMPS, "7 1 0.5 2.5", "7 1 0.5 nan", "it has a shape or a material that cannot be"),
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
