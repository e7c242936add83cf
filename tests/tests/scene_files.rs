//! Worlds that users write: whatever order their rows are in, and however many ranks read them, they are the same.

use atoll::{Config, Exit, Override, RunError, Summary};
use atoll_tests::program;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::{TempDir, tempdir};

/// Two rows of columns of boxes and circles that drop on a floor, whose statics have these ids.
fn world(statics: [&str; 2], physics: &str) -> String {
    let [floor, wall] = statics;
    format!(
        "format = \"atoll-scene/1\"\ndomain = [[0, -1], [24, 12]]\n[physics]\ngravity = [0, -10]\nexchange = \"substep\"\n\
         {physics}\n[[kinds]]\nname = \"crate\"\nshape = \"box\"\nwidth = 0.5\nheight = 0.5\n[[kinds]]\nshape = \"circle\"\n\
         radius = 0.25\n[[statics]]\n{floor}\nshape = \"box\"\nwidth = 40\nheight = 2\nx = 12\ny = -1\n[[statics]]\n{wall}\n\
         shape = \"box\"\nwidth = 2\nheight = 20\nx = 0\ny = 8\nangle = 0.1\n[bodies]\npath = \"bodies.csv\"\n"
    )
}

/// Its bodies, a row each.
fn rows() -> Vec<String> {
    let row = |k: u64| {
        let (x, y) = (2.5 + 0.55 * (k % 36) as f64, 0.3 + 0.56 * (k / 36) as f64);
        let (kind, vx) = (if k.is_multiple_of(3) { "crate" } else { "1" }, 0.3 * (k % 5) as f64 - 0.6);
        format!("{},{kind},{x},{y},{vx}", 10 + 7 * k)
    };
    (0..360).map(row).collect()
}

fn write(folder: &Path, world: &str, rows: &[String]) -> PathBuf {
    let mut text = "id,kind,x,y,vx\n".to_owned();
    rows.iter().for_each(|row| writeln!(text, "{row}").unwrap());
    fs::write(folder.join("bodies.csv"), text).unwrap();
    fs::write(folder.join("world.toml"), world).unwrap();
    folder.join("world.toml")
}

fn files(world: &str, rows: &[String]) -> (TempDir, PathBuf) {
    let folder = tempdir().unwrap();
    let path = write(folder.path(), world, rows);
    (folder, path)
}

fn run(path: &Path, overrides: &[(&str, &str)]) -> Result<Summary, RunError> {
    let overrides: Vec<Override> = overrides.iter().map(|(key, value)| Override::set(key, value)).collect();
    atoll::run(&Config::load(path, &overrides)?)
}

fn hashes(path: &Path, overrides: &[(&str, &str)]) -> (String, String) {
    let summary = run(path, overrides).unwrap();
    assert_eq!((summary.bodies, summary.bodies_lost, summary.escaped), (360, 0, 0));
    assert!(summary.contacts > 300, "{} contacts", summary.contacts);
    (summary.state_hash, summary.contact_hash)
}

#[test]
fn rows_in_any_order_and_any_ranks_make_the_same_world() {
    let world = world(["", ""], "");
    let mut rows = rows();
    let (_folder, path) = files(&world, &rows);
    let options = [("steps", "40"), ("tiles", "4x2")];
    let with = |ranks: &'static str| [&options[..], &[("ranks", ranks), ("threads", "1")]].concat();
    let expected = hashes(&path, &with("1"));
    for ranks in ["2", "3", "8"] {
        assert_eq!(hashes(&path, &with(ranks)), expected, "{ranks} ranks");
    }
    // 7 is of no order that 360 rows have.
    rows.sort_by_key(|row| {
        row.bytes().fold(7_u64, |sum, byte| sum.wrapping_mul(0x9e37_79b9).wrapping_add(byte.into()))
    });
    let (_other, shuffled) = files(&world, &rows);
    for ranks in ["1", "3"] {
        assert_eq!(hashes(&shuffled, &with(ranks)), expected, "shuffled, {ranks} ranks");
    }
    let adaptive = [("steps", "40"), ("tiles", "adaptive"), ("max_bodies", "200"), ("retile_every", "8")];
    assert_eq!(hashes(&path, &adaptive), hashes(&shuffled, &[&adaptive[..], &[("ranks", "3")]].concat()));
}

/// One body is fifty times as large as 1000 others: tiles are no larger for it, and any ranks still make the same world.
#[test]
fn a_large_body_among_small_ones_makes_no_wide_halo() {
    let world = world(["", ""], "").replace("radius = 0.25", "radius = 0.05");
    let moon = "[[kinds]]\nname = \"moon\"\nshape = \"circle\"\nradius = 2.5\n[[statics]]\n";
    let world = world.replacen("[[statics]]\n", moon, 1);
    let small = |k: u64| format!("{k},1,{},{},0.5", 3.0 + 0.2 * (k % 100) as f64, 0.1 + 0.15 * (k / 100) as f64);
    let rows: Vec<String> = (0..1000).map(small).chain(["5000,moon,12,4.2,0".to_owned()]).collect();
    let (_folder, path) = files(&world, &rows);
    let options = [("steps", "60"), ("tiles", "8x4"), ("threads", "1")];
    let with = |more: &[(&str, &str)]| run(&path, &[&options[..], more].concat()).unwrap();
    let alone = with(&[("ranks", "1")]);
    assert!(alone.contacts > 300 && alone.border_contact_fraction > 0.0, "{alone:?}");
    // With a halo of three meters each tile of three would have most of the others' bodies.
    assert!(alone.ghosts < Some(1000), "{:?} ghosts", alone.ghosts);
    for more in [&[("ranks", "3"), ("balance", "shuffled")], &[("ranks", "2"), ("broad_phase", "quadtree")]] {
        let shared = with(more);
        let hashes = |summary: &Summary| (summary.state_hash.clone(), summary.contact_hash.clone());
        assert_eq!(hashes(&shared), hashes(&alone), "{more:?}");
    }
}

/// A static's id says which body of a pair comes first, which is a matter of rounding, and nothing else.
#[test]
fn boxes_rest_on_statics_of_the_highest_ids_as_on_those_of_the_lowest() {
    let rows: Vec<String> = (0..5).map(|k| format!("{},crate,{},{},0", 100 + k, 4 + 3 * k, 0.26)).collect();
    let height = |statics: [&str; 2], steps: &str| {
        let (_folder, path) = files(&world(statics, ""), &rows);
        let summary = run(&path, &[("steps", steps), ("tiles", "1x1")]).unwrap();
        (summary.kinetic_energy, summary.mean_penetration, summary.contacts)
    };
    let low = height(["id = 0", "id = 1"], "180");
    let high = height(["id = 900", "id = 901"], "180");
    let above = height(["", ""], "180");
    for (energy, penetration, contacts) in [low, high, above] {
        assert!(energy < 1e-9 && contacts == 5, "{energy} J, {contacts} contacts");
        assert!(penetration < 1e-3 && (penetration / low.1 - 1.0).abs() < 1e-3, "{penetration} m, and {} m", low.1);
    }
    assert_eq!(high, above);
}

#[test]
fn ids_that_are_there_twice_are_found_on_any_ranks() {
    let mut rows = rows();
    // Far from each other, so that different ranks read them.
    let last = rows.last().unwrap().replacen("2523", "10", 1);
    *rows.last_mut().unwrap() = last;
    let (_folder, path) = files(&world(["", ""], ""), &rows);
    for ranks in ["1", "2", "4"] {
        let error = run(&path, &[("steps", "3"), ("tiles", "4x2"), ("ranks", ranks)]).unwrap_err();
        assert_eq!(error.exit(), Exit::Usage, "{error}");
        let told = error.to_string();
        assert!(
            told.contains("bodies.csv, row 360, id = 10: the body of row 1 has this id as well"),
            "{ranks}: {told}"
        );
    }
}

/// Runs the program, which must end well.
fn atoll(arguments: &[&str]) -> String {
    let ended = program::run(program::command().args(arguments));
    assert_eq!((ended.code, ended.complaints().len()), (Some(0), 0), "{ended}");
    ended.stdout
}

/// Runs the program, which must refuse something in one line.
fn refused(arguments: &[&str], expected: &str) {
    let ended = program::run(program::command().args(arguments));
    assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{ended}");
    assert!(ended.complaints()[0].contains(expected), "{ended}");
}

#[test]
fn what_is_exported_runs_as_the_scene_it_was() {
    let folder = tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    for (kind, keys, physics) in [
        ("rooms", "bodies = 600\npower = 1.2", ""),
        ("pile", "bodies = 400", "hertz = 90"),
        ("pyramids", "bodies = 220", "exchange = \"step\""),
        ("sparse", "bodies = 300\nseed = 5", "linear_damping = 0.1\nmax_linear_speed = 9.7"),
        ("single-island", "bodies = 300", "restitution_threshold = 0.3"),
        ("stack", "bodies = 7", "solver = \"pgs\""),
        ("smash", "bodies = 200", "gravity = [0.1, -0.3]"),
        ("slope", "bodies = 9\nangle = 22.7", "substeps = 7"),
    ] {
        let config = path(&format!("{kind}.toml"));
        fs::write(&config, format!("[scene]\nkind = \"{kind}\"\n{keys}\n[physics]\n{physics}\n")).unwrap();
        let both = |path: &str| {
            let options = [("steps", "12"), ("ranks", "2")];
            let summary = run(Path::new(path), &options).unwrap();
            (summary.state_hash, summary.contact_hash, summary.tiles, summary.bodies)
        };
        let expected = both(&config);
        let out = path(kind);
        for (format, more) in [("parquet", None), ("csv", Some("--overwrite"))] {
            let arguments = ["scene", "export", &config, "--out", &out, "--bodies-as", format];
            let told = atoll(&arguments.into_iter().chain(more).collect::<Vec<_>>());
            assert!(told.contains("scene.toml` runs it"), "{told}");
            assert_eq!(both(&format!("{out}/scene.toml")), expected, "{kind} as {format}");
        }
        // What was exported, exported again.
        let again = path(&format!("{kind}-again"));
        atoll(&["scene", "export", &format!("{out}/scene.toml"), "--out", &again]);
        assert_eq!(both(&format!("{again}/scene.toml")), expected, "{kind}");
        assert!(atoll(&["scene", "check", &format!("{again}/scene.toml")]).contains(" bodies, "));
    }
}

/// Lifts, and what turns, stand where they are in that step, and gravity is as it is then.
#[test]
fn a_recorded_step_has_what_moves_where_it_is() {
    let lift = "path = { sine = [0.0, -1.0], period = 1.6 }";
    let mill = "id = 9000000\npath = { circle = 0.5, period = 3.0, turning = 2.0 }";
    let text = world(["id = 8000000", mill], "").replace("x = 12\ny = -1\n", &format!("x = 12\ny = -1\n{lift}\n"));
    let (folder, path) = files(&text, &rows());
    let of = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    fs::write(of("acts.jsonl"), "{\"step\": 30, \"gravity\": [0, -5]}\n{\"step\": 41, \"gravity\": [0, -1]}\n")
        .unwrap();
    let (path, out, exported) = (path.to_str().unwrap(), of("run"), of("step"));
    // Some fall off the end, which is told.
    let arguments = ["run", path, "--steps=60", "--record-every=20", "--quiet", "--out", &out];
    let made = program::run(program::command().args(arguments).args(["--commands", &of("acts.jsonl")]));
    assert_eq!(made.code, Some(0), "{made}");
    atoll(&["scene", "export", &out, "--step=40", "--out", &exported]);
    let scene = format!("{exported}/scene.toml");
    let text = fs::read_to_string(&scene).unwrap();
    assert!(text.contains("gravity = [0.0, -5.0]"), "{text}");
    let (whole, rest) = (run(Path::new(path), &[("steps", "40")]).unwrap(), atoll(&["scene", "check", &scene]));
    let deepest = |told: &str| -> f64 {
        let line = told.lines().find(|line| line.starts_with("overlaps")).unwrap();
        line.split("the deepest ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap()
    };
    assert!(deepest(&rest) < 1.5 * whole.max_penetration + 0.01, "{rest} and {}", whole.max_penetration);
}

#[test]
fn ids_of_statics_that_no_text_can_say_are_left_out_or_refused() {
    let rows = [i64::MAX.to_string() + ",crate,3,0.3,0"];
    let (folder, path) = files(&world(["", ""], ""), &rows);
    let (path, out) = (path.to_str().unwrap(), folder.path().join("out"));
    atoll(&["scene", "export", path, "--out", out.to_str().unwrap()]);
    let exported = out.join("scene.toml");
    let hash = |path: &Path| run(path, &[("steps", "20")]).unwrap().state_hash;
    assert_eq!(hash(&exported), hash(Path::new(path)));
    let made = folder.path().join("run");
    let made = made.to_str().unwrap();
    let acts = folder.path().join("acts.jsonl");
    fs::write(&acts, format!("{{\"step\": 5, \"remove\": {}}}\n", i64::MAX)).unwrap();
    let acts = acts.to_str().unwrap();
    atoll(&["run", path, "--steps=10", "--record-every=10", "--out", made, "--commands", acts, "--quiet"]);
    let none = folder.path().join("none");
    refused(
        &["scene", "export", made, "--step=10", "--out", none.to_str().unwrap()],
        "a static's id is above 2^63 - 1, which the text of a scene cannot say",
    );
}

#[test]
fn a_recorded_step_is_the_start_of_another_run() {
    let (folder, path) = files(&world(["", ""], ""), &rows());
    let (out, exported) = (folder.path().join("run"), folder.path().join("step"));
    let (path, out, exported) = (path.to_str().unwrap(), out.to_str().unwrap(), exported.to_str().unwrap());
    let steps =
        ["--steps", "20", "--quiet", "--record-every", "10", "--checkpoint-every", "20", "--tiles=2x1", "--ranks=2"];
    atoll(&[&["run", path, "--out", out][..], &steps].concat());
    atoll(&["scene", "export", out, "--step", "10", "--out", exported]);
    let scene = format!("{exported}/scene.toml");
    let told = atoll(&["scene", "check", &scene]);
    assert!(
        told.starts_with("world.toml, step 10: 360 bodies, 2 statics\n") && told.contains("ids          10 to 2523"),
        "{told}"
    );
    let (a, b) =
        (run(Path::new(path), &[("steps", "11")]).unwrap(), run(Path::new(&scene), &[("steps", "1")]).unwrap());
    // Contacts start anew, and with them their impulses.
    assert!(
        (a.kinetic_energy / b.kinetic_energy - 1.0).abs() < 0.1,
        "{} J and {} J",
        a.kinetic_energy,
        b.kinetic_energy
    );
    // The folder repeats the run, and knows its scene.
    let again = run(&PathBuf::from(format!("{out}/run.toml")), &[]).unwrap();
    assert_eq!(again.state_hash, run(Path::new(path), &[("steps", "20"), ("tiles", "2x1")]).unwrap().state_hash);
    assert!(atoll(&["info", out]).starts_with("world.toml: 360 bodies"));

    refused(&["scene", "export", out, "--step", "10", "--out", exported], "scene.toml is there already; name another");
    refused(&["scene", "export", out, "--step", "11", "--out", "/tmp/none"], "step 11");
    refused(&["scene", "export", out, "--out", "/tmp/none"], "--step: say which recorded step of this run to write");
    refused(
        &["scene", "export", path, "--step", "1", "--out", "/tmp/none"],
        "--step 1: only the folder of a run has steps",
    );
    refused(
        &["scene", "export", out, "--step", "10", "--seed", "1", "--out", "/tmp/none"],
        "--seed: a run that was made",
    );
    refused(&["scene", "export", path, "--out", path], "there is something that is no folder");
    let bodies = folder.path().join("bodies.csv");
    let bodies = bodies.to_str().unwrap();
    refused(&["run", path, "--json", bodies], "bodies.csv: that is a file of the scene of this run and must not be");
    refused(
        &["project", path, "--json", bodies],
        "bodies.csv: that is a file of the scene of this run and must not be",
    );
    // It goes on wherever the same scene lies.
    let moved = tempdir().unwrap();
    let there = write(moved.path(), &world(["", ""], ""), &rows());
    let set = format!("scene.path={}", there.display());
    let ended =
        program::run(program::command().args(["run", "--resume", out, "--steps", "25", "--quiet", "--set", &set]));
    assert!(ended.code == Some(0) && ended.complaints()[0].contains("after step 20"), "{ended}");
    // A run does not go on in another world.
    fs::write(there, world(["", ""], "hertz = 59")).unwrap();
    refused(&["run", "--resume", out, "--steps", "30"], "run.toml: scene.digest = ");
}

#[test]
fn every_fault_is_told_in_a_line_of_its_own() {
    let mut rows = rows();
    rows[3] = "9,crate,nan,1,0".to_owned();
    rows[5] = "1,2,3".to_owned();
    rows[8] = rows[7].clone();
    rows[9] = "700000,3,1,1,0".to_owned();
    rows[11] = rows[12].clone();
    let (_folder, path) = files(&world(["", ""], ""), &rows);
    // The text is wrong in several places as well.
    let text =
        fs::read_to_string(&path).unwrap().replace("[24, 12]", "[-24, 12]").replace("radius = 0.25", "radius = -1");
    fs::write(&path, text.replace("angle = 0.1", "angel = 0.1")).unwrap();
    let ended = program::run(program::command().args(["scene", "check"]).arg(&path));
    let told = ended.complaints();
    assert_eq!((ended.code, told.len()), (Some(2), 7), "{ended}");
    let expected = [
        "domain = [...]: the high corner must lie above and right of the low one",
        "[[kinds]] 1, radius = -1",
        "[[statics]] 1, angel = 0.1: unknown key; did you mean angle?",
        "row 4 (line 5), x = nan: must be a finite number",
        "row 6 (line 7): 3 values where the first line names 5 columns",
        "row 10 (line 11), kind = 3: there are kinds 0 to 1",
        "row 9, id = 59: the body of row 8 has this id as well; give each its own, or leave the column id out; there are 1 more",
    ];
    for (line, expected) in told.iter().zip(expected) {
        assert!(line.contains(expected), "{ended}");
    }
}

/// What a file says of where its bodies are is believed only as long as all are found.
#[test]
fn bodies_that_are_not_where_their_file_says_are_missed() {
    let (folder, path) = files(&world(["", ""], ""), &rows());
    let out = folder.path().join("exported");
    atoll(&["scene", "export", path.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    let (text, bodies) = (out.join("scene.toml"), out.join("bodies.parquet"));
    let said = fs::read_to_string(&text).unwrap();
    let lines: Vec<&str> = said.lines().filter(|line| !line.starts_with("xxh3")).collect();
    fs::write(&text, lines.join("\n")).unwrap();
    let options = [("steps", "2"), ("tiles", "4x2"), ("ranks", "2")];
    run(&text, &options).unwrap();
    // The rightmost, as the footer has it.
    let (mut bytes, greatest) = (fs::read(&bodies).unwrap(), 2.5 + 0.55 * 35.0);
    let footer = bytes.len() - 8 - u32::from_le_bytes(bytes[bytes.len() - 8..][..4].try_into().unwrap()) as usize;
    let mut changed = 0;
    for at in footer..bytes.len() - 8 {
        if bytes[at..at + 8] == f64::to_le_bytes(greatest) {
            bytes[at..at + 8].copy_from_slice(&2.6_f64.to_le_bytes());
            changed += 1;
        }
    }
    assert!(changed > 0);
    fs::write(&bodies, bytes).unwrap();
    let error = run(&text, &options).unwrap_err();
    assert_eq!(error.exit(), Exit::Usage, "{error}");
    assert!(
        error.to_string().contains("bodies.parquet: ")
            && error.to_string().contains(" of its 360 bodies were found: what it"),
        "{error}"
    );
}

#[test]
fn what_another_program_has_saved_is_taken_over_or_refused() {
    let folder = tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (from, out) = (path("world.json"), path("out"));
    let wall = r#"{"polygon": {"vertices": {"x": [-9, 9, 9, -9], "y": [-1, -1, 0, 0]}}}"#;
    let ball = r#"{"density": 1, "friction": 0.2, "circle": {"center": 0, "radius": 0.5}}"#;
    let bodies = [
        format!(r#"{{"type": 0, "position": 0, "fixture": [{wall}]}}"#),
        format!(r#"{{"type": 2, "position": {{"x": 1, "y": 0.5}}, "fixture": [{ball}]}}"#),
        format!(r#"{{"type": 1, "position": {{"x": 3, "y": 5}}, "fixture": [{ball}]}}"#),
    ];
    fs::write(
        &from,
        format!(r#"{{"gravity": {{"x": 0, "y": -10}}, "body": [{}], "joint": [{{}}]}}"#, bodies.join(",")),
    )
    .unwrap();
    refused(&["scene", "import", &from, "--out", &out], "world.json: there is no counterpart for 1 joints; leave");
    assert!(!Path::new(&out).exists());
    let ended = program::run(program::command().args(["scene", "import", &from, "--out", &out, "--lossy"]));
    assert_eq!((ended.code, ended.complaints()), (Some(0), vec!["atoll: left out: 1 joints"]), "{ended}");
    let summary = run(&Path::new(&out).join("scene.toml"), &[("steps", "120")]).unwrap();
    assert_eq!((summary.bodies, summary.escaped, summary.contacts), (1, 0, 1));
    assert!(summary.kinetic_energy < 1e-9, "{} J", summary.kinetic_energy);
    refused(&["scene", "import", &from, "--out", &out, "--lossy"], "scene.toml is there already");
    refused(&["scene", "import", &path("none"), "--out", &path("new")], "none: cannot read this world: ");
    refused(&["scene", "check", &from], "world.json, line 1: ");
}
