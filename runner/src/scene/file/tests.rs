//! Scenes in files: what they say, and what is said of those that cannot be.

use super::write::StaticIds;
use super::*;
use crate::scene::{FileSpec, Scene, SceneKind, SceneSpec};
use atoll_core::{KindId, Material, Rot, Shape, Travel};
use glam::Vec2;
use tempfile::{TempDir, tempdir};

/// A small scene of everything, its bodies in CSV.
const WORLD: &str = r#"
format = "atoll-scene/1"
name = "two kinds"
domain = [[0.0, -1], [10, 5.5]]
[physics]
gravity = [0.0, -10.0]
[[kinds]]
name = "crate"
shape = "box"
width = 0.2
height = 0.4
density = 2
[[kinds]]
shape = "circle"
radius = 0.3
friction = 0.1
restitution = 0.5
[[statics]]
id = 7
shape = "box"
width = 20.0
height = 2.0
x = 5.0
y = -1.0
angle = 0.5
[bodies]
path = "bodies.csv"
count = 3
"#;

const BODIES: &str =
    "id,kind,x,y,angle,vx,vy,omega\n3,crate,1.5,0.1,0,0,0,0\n9,1,2,3,1.5,-1,0.5,0.25\n0,0,0.1,1e-3,0,0,0,0\n";

/// A folder with these two files.
fn folder(world: &str, bodies: &[u8]) -> TempDir {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("world.toml"), world).unwrap();
    fs::write(folder.path().join("bodies.csv"), bodies).unwrap();
    folder
}

fn open(folder: &TempDir) -> Result<SceneFile, SceneError> {
    SceneFile::open(&folder.path().join("world.toml"))
}

/// What is said of these files, less the folder they are in.
fn complaint(world: &str, bodies: &[u8]) -> String {
    let folder = folder(world, bodies);
    let error = open(&folder).expect_err("it should be refused").to_string();
    assert!(!error.contains('\n') && error.len() < 400, "{error}");
    error.replace(&format!("{}/", folder.path().display()), "")
}

#[test]
fn everything_that_is_said_is_heard() {
    let scene = open(&folder(WORLD, BODIES.as_bytes()));
    // The folder is gone, and with it what is read again.
    let scene = scene.unwrap();
    assert_eq!((scene.count(), scene.name(), scene.kind_names()[0].as_deref()), (3, Some("two kinds"), Some("crate")));
    assert_eq!(scene.domain(), (DVec2::new(0.0, -1.0), DVec2::new(10.0, 5.5)));
    assert_eq!(scene.kinds()[1].material.restitution, 0.5);
    assert_eq!((scene.kinds()[0].material.density, scene.kinds()[0].material.friction), (2.0, 0.6));
    assert_eq!(scene.kinds()[0].shape, atoll_core::Shape::rectangle(0.2, 0.4));
    assert_eq!((scene.statics()[0].id, scene.statics()[0].rotation), (GlobalId(7), Rot::from_angle(0.5)));
    assert!(scene.iter().next().unwrap().unwrap_err().to_string().contains("cannot read these bodies"));

    let folder = folder(WORLD, BODIES.as_bytes());
    let spec = FileSpec::open(&folder.path().join("world.toml")).unwrap();
    let scene = Scene::open(&SceneSpec::usual(SceneKind::File(spec))).unwrap();
    let bodies: Vec<Body> = scene.iter().map(Result::unwrap).collect();
    let expected = Body {
        id: GlobalId(9),
        position: DVec2::new(2.0, 3.0),
        rotation: Rot::from_angle(1.5),
        velocity: Vec2::new(-1.0, 0.5),
        angular_velocity: 0.25,
        kind: KindId(1),
    };
    assert_eq!((bodies.len(), bodies[1]), (3, expected));
    assert_eq!(bodies[2].position, DVec2::new(0.1, 1e-3));
    let near = scene.near(|low, high| low.x < 1.0 && high.y < 1.0);
    assert_eq!(near.map(|body| body.unwrap().id.0).collect::<Vec<_>>(), [0]);
    assert_eq!(scene.sample().map(|sample| sample.unwrap().0).sum::<u64>(), 3);
    assert_eq!(scene.find(GlobalId(9)).unwrap(), Some(expected));
    assert_eq!(scene.find(GlobalId(5)).unwrap(), None);
    assert!(!scene.has_escaped(&expected));
    assert!(scene.has_escaped(&Body { position: DVec2::new(-0.1, 0.0), ..expected }));
}

#[test]
fn rows_and_statics_without_ids_get_some() {
    let world = WORLD.replace("id = 7\n", "").replace("count = 3", "");
    let ids = |bodies: &str| {
        let folder = folder(&world, bodies.as_bytes());
        let scene = open(&folder).unwrap();
        let bodies = scene.iter().map(|body| body.unwrap().id.0).collect::<Vec<_>>();
        (bodies, scene.statics()[0].id.0)
    };
    assert_eq!(ids("y,x\n1,2\n 3 , 4 \n"), (vec![0, 1], 2));
    assert_eq!(ids("id,y,x\n100,1,2\n5,3,4\n"), (vec![100, 5], 101));
    assert_eq!(ids("x,y\n"), (vec![], 0));
    // As spreadsheets write it.
    assert_eq!(ids("\u{feff}\"x\",\"y\"\r\n1,2\r\n\"3\",4"), (vec![0, 1], 2));
    let last = format!("id,x,y\n{},0,0\n", u64::MAX);
    let told = complaint(&world, last.as_bytes());
    assert!(told.contains("[[statics]]: there are no ids left above those of the bodies"), "{told}");
}

#[test]
fn bodies_may_stand_in_the_scene_itself() {
    let world = WORLD.split("[bodies]").next().unwrap();
    let body = "[[body]]\nid = 1\nkind = \"crate\"\nx = 1\ny = 2.5\ncos = 0.6\nsin = 0.8\n[[body]]\nid = 4\nx = 3\ny = 1\nomega = -2\n";
    let scene = open(&folder(&format!("{world}{body}"), b"")).unwrap();
    let bodies: Vec<Body> = scene.iter().map(Result::unwrap).collect();
    assert_eq!((bodies[0].id, bodies[0].rotation), (GlobalId(1), Rot { c: 0.6, s: 0.8 }));
    assert_eq!((bodies[1].id, bodies[1].kind, bodies[1].angular_velocity), (GlobalId(4), KindId(0), -2.0));
    // An empty world is one.
    assert_eq!(open(&folder(world, b"")).unwrap().count(), 0);
    for (from, to, expected) in [
        ("id = 4\n", "", "[[body]] 1, id: either every body has an id or none"),
        ("id = 4\n", "id = 7\n", "world.toml: [[body]] 1, id = 7: a static has that id"),
        ("x = 3\n", "", "[[body]] 1, x: is missing: must be a finite number"),
        ("x = 3\n", "x = \"3\"\n", "[[body]] 1, x = \"3\": must be a finite number"),
        ("sin = 0.8\n", "", "a body has either angle, or cos and sin"),
        ("sin = 0.8\n", "sin = 0.9\n", "[[body]] 0, cos = 0.6 and sin = 0.9: cos and sin must be those of one angle"),
        ("omega = -2", "omga = -2", "[[body]] 1, omga = -2: unknown key; did you mean omega?"),
        ("omega = -2", "omega = 1e39", "[[body]] 1, omega = 1e39: must be a finite number"),
        ("\"crate\"", "\"crat\"", "[[body]] 0, kind = \"crat\": must be the number of a kind"),
        ("\"crate\"", "2", "[[body]] 0, kind = 2: there are kinds 0 to 1"),
        (
            "[[body]]\nid = 1",
            "[bodies]\npath = \"b.csv\"\n[[body]]\nid = 1",
            "bodies stand either in [[body]] or in the file",
        ),
    ] {
        let told = complaint(&format!("{world}{}", body.replacen(from, to, 1)), b"");
        assert!(told.contains(expected), "{told}");
    }
}

/// The statics of a scene whose `[[statics]]` are these, with `places.csv` beside it, and its digest; or what is said of them.
fn placed(statics: &str, places: &str) -> Result<(Vec<StaticBody>, String), String> {
    let (head, tail) = WORLD.split_once("[[statics]]").unwrap();
    let tail = tail.split_once("[bodies]").unwrap().1;
    let folder = folder(&format!("{head}{statics}\n[bodies]{tail}"), BODIES.as_bytes());
    fs::write(folder.path().join("places.csv"), places).unwrap();
    let scene =
        open(&folder).map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))?;
    assert_eq!(scene.paths().count(), 2 + usize::from(statics.contains("places")));
    Ok((scene.statics().to_vec(), scene.digest().to_owned()))
}

#[test]
fn statics_of_one_form_may_stand_in_a_table() {
    let shelf = "box = [2.0, 0.1]\nfriction = 0.3\npath = { line = [1.0, 0.0] }\n";
    let other = "[[statics]]\ncircle = 0.5\nx = 3\ny = 4\n";
    let each = |x: f64, y: f64, angle: f64| format!("[[statics]]\n{shelf}x = {x:?}\ny = {y:?}\nangle = {angle:?}\n");
    let (expected, _) = placed(&(each(1.5, 2.0, 0.25) + &each(-3.0, 1e6, 0.0) + other), "").unwrap();
    let table = format!("[[statics]]\n{shelf}places = \"places.csv\"\n{other}");
    let (statics, digest) = placed(&table, "y,x,angle\n2,1.5,0.25\n1e6,-3,0\n").unwrap();
    assert_eq!(statics, expected);
    // What stands in the table is a part of what the scene says.
    assert_ne!(placed(&table, "y,x,angle\n2,1.5,0.25\n1e6,-3,0.5\n").unwrap().1, digest);
    // With ids of their own, a segment from its beginning, and none at all.
    let segment = "[[statics]]\nsegment = { from = [0.0, 0.0], to = [2.0, 0.0] }\nplaces = \"places.csv\"\n";
    let (statics, _) =
        placed(&format!("{segment}[[statics]]\nid = 8\ncircle = 1\nx = 0\ny = 0"), "id,x,y,cos,sin\n12,1,1,0,1")
            .unwrap();
    assert_eq!(statics.iter().map(|fixed| fixed.id.0).collect::<Vec<_>>(), [12, 8]);
    assert_eq!(statics[0].position, DVec2::new(1.0, 2.0));
    assert_eq!(placed(segment, "x,y\n").unwrap().0, []);

    let refused = |statics: &str, places: &str, expected: &str| {
        let told = placed(statics, places).expect_err(expected);
        assert!(told.starts_with(expected) && !told.contains('\n'), "{told}");
    };
    refused(&table, "x\n1\n", "places.csv, line 1: the column y is missing");
    refused(&table, "x,y\n1,2\n1,two\n", "places.csv, row 2 (line 3), y = two: must be a finite number");
    refused(&table, "x,y\n1,2e9\n", "places.csv, row 1 (line 2), y = 2000000000: must be within -1e9 to 1e9 m");
    refused(&table, "x,y,vx\n1,2,0\n", "places.csv: a static has no vx; leave the column out");
    refused(&table, "id,x,y\n1,1,2\n", "world.toml: [[statics]] 1, id: either every static has an id or none");
    refused(segment, "id,x,y\n5,1,2\n5,1,3\n", "places.csv: another static has the id 5");
    refused(segment, "id,x,y\n9,1,2\n", "bodies.csv, row 2 (line 3), id = 9: a static has that id");
    refused(
        &table.replace("places =", "x = 1\nplaces ="),
        "x,y\n",
        "world.toml: [[statics]] 0, x = 1: the table of places says that",
    );
    refused(&table.replace("places.csv", "places.txt"), "", "places.txt: cannot read these places");
    refused(
        &table.replace("places.csv", "world.toml"),
        "",
        "world.toml: [[statics]] 0, places = \"world.toml\": must end in .csv",
    );
}

#[test]
fn many_statics_alike_are_written_as_a_table() {
    let shelf = |id: u64| {
        let kind = Kind::new(Shape::rectangle(0.1 + 1.0 / 3.0, 0.1), Material { friction: 0.1, ..Material::default() });
        let turned = Rot::from_angle(0.01 * id as f32);
        StaticBody { rotation: turned, ..StaticBody::new(GlobalId(id), kind, DVec2::new(0.1 * id as f64, 1.0 / 3.0)) }
    };
    let path = Some(atoll_core::Path { travel: Travel::Line { velocity: DVec2::new(0.1, 0.0) }, turning: 0.0 });
    let ball = |id: u64| StaticBody::new(GlobalId(id), Kind::new(Shape::circle(0.3), Material::default()), DVec2::ONE);
    let lifts = (200..350).map(|id| StaticBody { path, ..shelf(id) });
    let statics: Vec<StaticBody> =
        [ball(0)].into_iter().chain((1..130).map(shelf)).chain([ball(199)]).chain(lifts).collect();
    for (statics, ids, tables) in [
        (&statics[..], StaticIds::Said, 2),
        // Which ids these get is known where there are no bodies: from 0 on.
        (&statics[..130], StaticIds::LeftOut, 1),
        (&statics[..50], StaticIds::Said, 0),
    ] {
        let folder = tempdir().unwrap();
        let runs = write::Alike::runs(statics, ids, |number| format!("statics-{number}.csv"));
        for alike in &runs {
            let Some(table) = &alike.table else { continue };
            let (columns, rows) = alike.rows();
            write::csv(File::create(folder.path().join(table)).unwrap(), &columns, &rows).unwrap();
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), tables);
        let (domain, physics) = ((DVec2::ZERO, DVec2::ONE), Vec::new());
        let world = write::World { name: None, domain, physics, kinds: &[], names: &[], statics };
        let text = write::text(&world, &runs, &write::BodiesFile { name: "b.csv", xxh3: "", count: 0 });
        assert!(text.len() < 3000 + 60 * 150, "{text}");
        let text = text.split_once("[bodies]").unwrap().0;
        fs::write(folder.path().join("world.toml"), text).unwrap();
        assert_eq!(open(&folder).unwrap().statics(), statics);
    }
}

#[test]
fn the_digest_is_of_what_is_said_and_not_of_where_it_lies() {
    let digest = |world: &str, bodies: &str| open(&folder(world, bodies.as_bytes())).unwrap().digest().to_owned();
    let usual = digest(WORLD, BODIES);
    assert_eq!((usual.len(), digest(WORLD, BODIES)), (32, usual.clone()));
    assert_ne!(digest(&WORLD.replace("10, 5.5", "10, 5.6"), BODIES), usual);
    assert_ne!(digest(WORLD, &BODIES.replace("0.25", "0.26")), usual);
    let own = folder(WORLD, BODIES.as_bytes());
    let told = digest::of_file(&own.path().join("bodies.csv")).unwrap();
    let world = WORLD.replace("count = 3", &format!("xxh3 = \"{told}\""));
    open(&folder(&world, BODIES.as_bytes())).unwrap();
    let error = complaint(&world, BODIES.replace("0.25", "0.26").as_bytes());
    assert!(error.contains("bodies.csv: its xxh3 is ") && error.contains(&told), "{error}");
}

/// Something of the scene is replaced.
#[test]
fn a_scene_that_cannot_be_is_refused_in_one_line() {
    for (from, to, expected) in [
        ("atoll-scene/1", "atoll-scene/2", "world.toml: format = \"atoll-scene/2\": must be \"atoll-scene/1\", which"),
        ("format = \"atoll-scene/1\"", "", "format: is missing: must be \"atoll-scene/1\""),
        ("format = \"atoll-scene/1\"", "format = 1", "format = 1: must be \"atoll-scene/1\""),
        ("name = \"two kinds\"", "name = 2", "name = 2: must be a text"),
        ("name = \"two kinds\"", "title = \"t\"", "title = \"t\": unknown key; there are format, name, domain"),
        ("domain =", "domian =", "domain: is missing: must be low and high corner"),
        ("domain =", "domains =", "domain: is missing"),
        ("[[0.0, -1], [10, 5.5]]", "[[0.0, -1]]", "domain = [...]: must be low and high corner in meters"),
        ("[[0.0, -1], [10, 5.5]]", "[0.0, -1, 10, 5.5]", "must be low and high corner"),
        ("[[0.0, -1], [10, 5.5]]", "[[0.0, -1], [10, \"5\"]]", "must be low and high corner"),
        ("[[0.0, -1], [10, 5.5]]", "[[0.0, 9], [10, 5.5]]", "the high corner must lie above and right of the low one"),
        ("[[0.0, -1], [10, 5.5]]", "[[0.0, -1], [0, 5.5]]", "the high corner must lie above and right"),
        ("[[0.0, -1], [10, 5.5]]", "[[nan, -1], [10, 5.5]]", "both corners must be within -1e9 to 1e9 m"),
        ("[[0.0, -1], [10, 5.5]]", "[[0.0, -1], [inf, 5.5]]", "both corners must be within"),
        ("[[0.0, -1], [10, 5.5]]", "[[0.0, -1], [1e10, 5.5]]", "both corners must be within"),
        ("[physics]", "[phisics]", "phisics = {...}: unknown key; did you mean physics?"),
        ("[physics]", "[[physics]]", "physics = [...]: must be a table: write [physics]"),
        ("[[kinds]]\nname", "[kinds]\nname", "world.toml, line 13"),
        ("\"crate\"", "\"1\"", "[[kinds]] 0, name = \"1\": must be a word that is no number"),
        ("\"crate\"", "\" a\"", "must be a word that is no number"),
        ("\"crate\"", "\"\"", "must be a word that is no number"),
        ("radius = 0.3", "radius = 0.3\nname = \"crate\"", "[[kinds]] 1, name = \"crate\": another kind has this name"),
        ("shape = \"circle\"", "shape = \"disc\"", "[[kinds]] 1, shape = \"disc\": must be \"box\" or \"circle\""),
        ("shape = \"circle\"", "", "[[kinds]] 1, shape: is missing: must be \"box\" or \"circle\""),
        (
            "shape = \"circle\"",
            "shape = \"box\"",
            "[[kinds]] 1, width: is missing: must be a positive number, in meters",
        ),
        ("radius = 0.3", "radius = 0", "[[kinds]] 1, radius = 0: must be a positive number, in meters"),
        ("radius = 0.3", "radius = -1", "radius = -1: must be a positive number"),
        ("radius = 0.3", "radius = nan", "radius = nan: must be a positive number"),
        ("radius = 0.3", "radius = 1e-50", "radius = 1e-50: must be a positive number"),
        ("radius = 0.3", "radius = 1e50", "radius = 1e50: must be a positive number"),
        ("radius = 0.3", "radius = true", "radius = true: must be a positive number"),
        ("radius = 0.3", "radius = 0.3\nwidth = 1", "[[kinds]] 1, width = 1: unknown key"),
        ("radius = 0.3", "radios = 0.3", "[[kinds]] 1, radios = 0.3: unknown key; did you mean radius?"),
        ("width = 0.2", "widht = 0.2", "[[kinds]] 0, widht = 0.2: unknown key; did you mean width?"),
        ("friction = 0.1", "friction = -0.1", "friction = -0.1: must be a number, at least 0"),
        ("restitution = 0.5", "restitution = 1.5", "restitution = 1.5: must be a number within 0 to 1"),
        ("density = 2", "density = 0", "density = 0: must be a positive number, in kg/m^2"),
        ("density = 2", "densty = 2", "[[kinds]] 0, densty = 2: unknown key; did you mean density?"),
        ("id = 7", "id = -7", "[[statics]] 0, id = -7: must be a whole number, at least 0"),
        ("id = 7", "id = 7.5", "id = 7.5: must be a whole number"),
        ("id = 7", "id = 9", "bodies.csv, row 2 (line 3), id = 9: a static has that id; give each"),
        ("x = 5.0", "", "[[statics]] 0, x: is missing: must be a number within -1e9 to 1e9"),
        ("x = 5.0", "x = 1e10", "[[statics]] 0, x = 1e10: must be a number within -1e9 to 1e9"),
        ("x = 5.0", "x = nan", "[[statics]] 0, x = nan: must be a number"),
        ("angle = 0.5", "angle = inf", "[[statics]] 0, angle = inf: must be an angle in radians"),
        ("angle = 0.5", "cos = 1", "[[statics]] 0, angle: give either angle, or both cos and sin"),
        ("angle = 0.5", "cos = 1\nsin = 1", "[[statics]] 0, cos = 1: cos and sin must be those of one angle"),
        ("angle = 0.5", "angle = 0.5\nvx = 1", "[[statics]] 0, vx = 1: unknown key"),
        (
            "[bodies]",
            "[[statics]]\nshape = \"circle\"\nradius = 1\nx = 0\ny = 0\n[bodies]",
            "[[statics]] 1, id: either every static has an id or none",
        ),
        (
            "[bodies]",
            "[[statics]]\nid = 7\nshape = \"circle\"\nradius = 1\nx = 0\ny = 0\n[bodies]",
            "[[statics]] 1, id = 7: another static has that id",
        ),
        ("path = \"bodies.csv\"", "", "[bodies], path: is missing: must be the path of a file, .csv or .parquet"),
        ("path = \"bodies.csv\"", "path = \"none.csv\"", "none.csv: cannot read these bodies: "),
        ("path = \"bodies.csv\"", "path = \".\"", "cannot read these bodies: it is no regular file"),
        ("path = \"bodies.csv\"", "path = \"world.toml\"", "path = \"world.toml\": must end in .csv or .parquet"),
        ("count = 3", "count = 4", "[bodies], count = 4: the file has 3 rows; bring back"),
        ("count = 3", "count = \"3\"", "[bodies], count = \"3\": must be a whole number"),
        ("count = 3", "cuont = 3", "[bodies], cuont = 3: unknown key; did you mean count?"),
        ("count = 3", "xxh3 = \"0\"", "[bodies], xxh3 = \"0\": must be 32 hexadecimal digits"),
        ("count = 3", "xxh3 = \"0123456789abcdef0123456789abcdef\"", "bodies.csv: its xxh3 is "),
        ("count = 3", "count = 3\ncount = 3", "world.toml, line 29: count is given twice"),
        (
            "count = 3",
            "count = 99999999999999999999",
            "world.toml, line 28: a whole number that 64 bits have room for must",
        ),
        ("count = 3", "count = ", "world.toml, line 28: "),
        (
            "\n[[kinds]]\nname = \"crate\"",
            "\n[[kind]]\nname = \"crate\"",
            "kind = [...]: unknown key; did you mean kinds?",
        ),
    ] {
        assert!(WORLD.contains(from), "{from}");
        let told = complaint(&WORLD.replacen(from, to, 1), BODIES.as_bytes());
        assert!(told.contains(expected), "{to}: {told}");
    }
    assert!(complaint("", b"").contains("world.toml: format: is missing"));
    assert!(complaint("a \u{1b}[2J = \n", b"").starts_with("world.toml, line 1: "));
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("world.toml"), b"a = 1\nb = '\xff'\n").unwrap();
    assert!(
        open(&folder).unwrap_err().to_string().ends_with("world.toml, line 2: it is not UTF-8; save the file as that")
    );
    let error = SceneFile::open(&folder.path().join("none.toml")).unwrap_err().to_string();
    assert!(error.contains("none.toml: cannot read this scene: "), "{error}");
    assert!(SceneFile::open(folder.path()).unwrap_err().to_string().contains("it is no regular file"));
}

/// Something of the bodies is replaced.
#[test]
fn rows_that_cannot_be_are_refused_in_one_line() {
    for (from, to, expected) in [
        ("id,kind", "id,knid", "bodies.csv, line 1, column knid: unknown column; did you mean kind?"),
        (
            "id,kind",
            "id,mass",
            "line 1, column mass: unknown column; there are id, kind, x, y, angle, cos, sin, vx, vy",
        ),
        ("id,kind", "id,id", "line 1, column id: the column is there twice"),
        ("x,y,angle", "x,vz,angle", "column vz: unknown column; "),
        ("kind,x,y", "kind,x,omega", "column omega: the column is there twice"),
        ("x,y,angle", "x,y,cos", "line 1: cos and sin go together"),
        ("angle,vx,vy", "angle,cos,sin", "line 1: a body has either angle, or cos and sin"),
        ("x,y,angle,vx,vy,omega", "x", "line 1: the column y is missing: every body needs x and y"),
        ("3,crate", "-3,crate", "bodies.csv, row 1 (line 2), id = -3: must be a whole number from 0 to"),
        ("3,crate", "3.0,crate", "row 1 (line 2), id = 3.0: must be a whole number"),
        ("3,crate", ",crate", "row 1 (line 2), id = nothing: must be a whole number"),
        ("3,crate", "18446744073709551616,crate", "id = 18446744073709551616: must be a whole number"),
        ("3,crate", "7,crate", "row 1 (line 2), id = 7: a static has that id"),
        ("crate", "crates", "row 1 (line 2), kind = crates: must be the number of a kind, from 0, or the name"),
        ("crate", "2", "row 1 (line 2), kind = 2: there are kinds 0 to 1"),
        ("crate", "-1", "kind = -1: must be the number of a kind"),
        ("1.5,0.1", "one,0.1", "row 1 (line 2), x = one: must be a finite number, in meters"),
        ("1.5,0.1", "NaN,0.1", "row 1 (line 2), x = NaN: must be a finite number, in meters"),
        ("1.5,0.1", "inf,0.1", "x = inf: must be a finite number"),
        ("1.5,0.1", "1e400,0.1", "x = 1e400: must be a finite number"),
        ("1.5,0.1", "1.5,-2e9", "row 1 (line 2), y = -2000000000: must be within -1e9 to 1e9 m"),
        ("1.5,0.1", "\"1,5\",0.1", "x = 1,5: must be a finite number"),
        ("1.5,0.1", "1.5;0.1", "row 1 (line 2): 7 values where the first line names 8 columns"),
        ("1.5,0.1", "1.5,0.1,0", "row 1 (line 2): 9 values where the first line names 8 columns"),
        (
            "1.5,0.1",
            "\"1.5,0.1",
            "row 1 (line 2): 3 values where the first line names 8 columns; mend the row, or a quotation",
        ),
        ("1.5,0.1", "0x10,0.1", "x = 0x10: must be a finite number"),
        ("0.25", "1e39", "row 2 (line 3), omega = 1e39: must be a finite number, in rad/s, within the range"),
        ("0.25", "", "row 2 (line 3), omega = nothing: must be a finite number, in rad/s"),
        ("9,1,2,3", "9,9,2,3", "row 2 (line 3), kind = 9: there are kinds 0 to 1"),
        ("9,1,2,3", "# 9,1,2,3", "row 2 (line 3), id = # 9: must be a whole number"),
        ("9,1", "\u{feff}9,1", "row 2 (line 3), id = \u{feff}9: must be"),
    ] {
        assert!(BODIES.contains(from), "{from}");
        let told = complaint(WORLD, BODIES.replacen(from, to, 1).as_bytes());
        assert!(told.contains(expected), "{to}: {told}");
    }
    for (bodies, expected) in [
        (&b""[..], "bodies.csv, line 1: the file is empty: its first line must name the columns"),
        (b"\n\n", "the file is empty"),
        (b"x,y\n", "[bodies], count = 3: the file has 0 rows"),
        (b"x,y\n1,2\n", "[bodies], count = 3: the file has 1 rows"),
        (b"x,\xff\n1,2\n", "bodies.csv, line 1: the names of columns are not UTF-8"),
        (b"x,y\n1,\xff\n", "bodies.csv, row 1 (line 2), y = \u{fffd}: must be a finite number"),
        (b"x,y\n1,\x1b[2J\n", "row 1 (line 2), y =  [2J: must be"),
        (b"x,y\n\0,0\n", "row 1 (line 2), x ="),
        (b"1,2\n3,4\n", "line 1, column 1: unknown column; there are"),
        (b"X,Y\n3,4\n", "line 1, column X: unknown column; did you mean x?"),
        (b"PAR1", "line 1, column PAR1: unknown column"),
        (b"x;y\n1;2\n", "line 1, column x;y: names and values must be separated by commas"),
        (b"x\ty\n1\t2\n", "line 1, column x y: names and values must be separated by commas"),
    ] {
        let told = complaint(WORLD, bodies);
        assert!(told.contains(expected), "{bodies:?}: {told}");
    }
}

#[test]
fn a_crowd_at_one_place_is_told() {
    let world = WORLD.replace("count = 3\n", "").replace("id = 7\n", "");
    let faults = |crowd: usize| {
        let folder =
            folder(&world, ("x,y\n-0.0,1e-300\n0,1\n".to_owned() + &"0.0,1e-300\n".repeat(crowd - 1)).as_bytes());
        let mut faults = Vec::new();
        let (scene, found) =
            SceneFile::check(&folder.path().join("world.toml"), |fault| faults.push(fault.to_string())).unwrap();
        assert_eq!((scene.count(), found.faults), (crowd as u64 + 1, faults.len() as u64));
        faults
    };
    assert_eq!(faults(MOST_AT_A_PLACE), Vec::<String>::new());
    let told = faults(MOST_AT_A_PLACE + 1);
    assert!(
        matches!(&told[..], [one] if one.contains("bodies.csv: 1001 bodies have their center at 0.0, 1e-300,")),
        "{told:?}"
    );
}

#[test]
fn a_doubled_id_is_told_with_its_rows() {
    let folder = folder(WORLD, BODIES.replace("0,0,0.1", "3,0,0.1").as_bytes());
    let told = open(&folder).unwrap().doubled(GlobalId(3)).to_string();
    assert!(told.ends_with("bodies.csv, row 3, id = 3: the body of row 1 has this id as well; give each its own, or leave the column id out"), "{told}");
}
