//! Runs that are acted upon while they go on: one result, whoever says what, and wherever the run is.

use atoll::Config;
use atoll::internals::{Plan, part_of_scene};
use atoll_core::{Body, Command as Act, GlobalId, KindId, Loopback, World, step};
use atoll_tests::processes;
use atoll_tests::program::{self, Ended};
use atoll_tests::ways::Way;
use atoll_tests::world::noise;
use atoll_transport::Rank;
use glam::{DVec2, Vec2};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use tempfile::tempdir;

const CONFIG: &str = "configs/quickstart.toml";

/// `ATOLL_FULL_LENGTH` acts on more, over more steps.
fn length() -> u64 {
    if std::env::var_os("ATOLL_FULL_LENGTH").is_some() { 300 } else { 60 }
}

/// What is done, step by step: bodies come and go, are struck and pushed, and gravity turns.
fn acts() -> Vec<(u64, Act)> {
    let mut acts = Vec::new();
    let (steps, random) = (length(), |k: u64| noise(7, k));
    for k in 0..1000 {
        let place = DVec2::new(2.0 + 56.0 * random(4 * k), 2.0 + 56.0 * random(4 * k + 1));
        let velocity = Vec2::new(3.0 * random(4 * k + 2) as f32, -2.0);
        let body = Body { velocity, ..Body::at_rest(GlobalId(1_000_000 + k), KindId((k % 2) as u32), place) };
        acts.push((k * (steps - 5) / 1000, Act::Add(body)));
    }
    // Of those that were there, and of those that came.
    let gone: BTreeSet<u64> = (0..500).map(|k| 20 + (random(9000 + k) * 15_000.0) as u64).collect();
    acts.extend(gone.iter().zip(0..).map(|(&id, k)| (3 + k * (steps - 5) / 500, Act::Remove(GlobalId(id)))));
    acts.extend((0..50).map(|k| (steps - 2, Act::Remove(GlobalId(1_000_000 + k)))));
    for k in 0..40 {
        let id = GlobalId(16_000 + k);
        let at = Some(DVec2::new(60.0 * random(k), 60.0 * random(k + 50)));
        acts.push((k % (steps - 1), Act::Impulse { id, impulse: Vec2::new(0.05, -0.1), at, angular: 0.001 }));
        acts.push((k % 9, Act::Force { id, force: Vec2::new(0.5, 0.1), torque: 0.01, steps: 11 + k }));
        acts.push((k % 13, Act::SetVelocity { id: GlobalId(17_000 + k), velocity: Vec2::Y, angular_velocity: 3.0 }));
        acts.push((k % 17, Act::SetKind { id: GlobalId(18_000 + k), kind: KindId((k % 2) as u32) }));
    }
    for k in 0..4 {
        let angle = k as f32;
        acts.push((5 + k * steps / 5, Act::SetGravity(Vec2::new(4.0 * angle.sin(), -4.0 * angle.cos()))));
    }
    acts.sort_by_key(|(step, _)| *step);
    acts
}

/// As a line of a file says it.
fn line(step: u64, act: &Act) -> Value {
    match *act {
        Act::Add(Body { id, position, velocity, kind, .. }) => json!({"step": step, "add": {
            "id": id.0, "kind": kind.0, "x": position.x, "y": position.y, "vx": velocity.x, "vy": velocity.y}}),
        Act::Remove(id) => json!({"step": step, "remove": id.0}),
        Act::SetVelocity { id, velocity: v, angular_velocity } => {
            json!({"step": step, "velocity": {"id": id.0, "vx": v.x, "vy": v.y, "omega": angular_velocity}})
        }
        Act::Impulse { id, impulse, at, angular } => json!({"step": step, "impulse": {
            "id": id.0, "x": impulse.x, "y": impulse.y, "at": at.map(|at| at.to_array()), "angular": angular}}),
        Act::Force { id, force, torque, steps } => json!({"step": step, "force": {
            "id": id.0, "x": force.x, "y": force.y, "torque": torque, "steps": steps}}),
        Act::SetKind { id, kind } => json!({"step": step, "kind": {"id": id.0, "kind": kind.0}}),
        Act::SetGravity(gravity) => json!({"step": step, "gravity": gravity.to_array()}),
        Act::AddKind(_) | Act::Wake(_) => unreachable!("nobody does that here"),
    }
}

/// As a file, with questions in between.
fn script() -> String {
    let mut text = String::from("{\"step\": 0, \"contacts\": true}\n");
    for (step, act) in acts() {
        text += &format!("{}\n", line(step, &act));
    }
    for k in 0..20 {
        let (x, y) = (60.0 * noise(3, k), 60.0 * noise(4, k));
        let step = k * length() / 20;
        text += &format!(
            "{{\"step\": {step}, \"name\": \"ray {k}\", \"ray\": {{\"from\": [{x}, {y}], \"to\": [{y}, {x}]}}}}\n"
        );
        let (right, top) = (x + 3.0, y + 3.0);
        text += &format!(
            "{{\"step\": {step}, \"rectangle\": {{\"low\": [{x}, {y}], \"high\": [{right}, {top}]}}}}\n\
             {{\"step\": {step}, \"touching\": {}}}\n{{\"step\": {step}, \"point\": [{x}, {y}]}}\n\
             {{\"step\": {step}, \"body\": [{}, 99999999]}}\n",
            16_000 + k,
            17_000 + k
        );
    }
    // Where bodies were removed in the same step.
    text + &format!("{{\"step\": {}, \"contacts\": true}}\n", length() - 2)
}

const ADAPTIVE: [&str; 6] = ["--tiles=5x5", "--set", "max_bodies=700", "--set", "retile_every=7", "--quiet"];

fn run(command: &mut Command) -> Ended {
    let ended = program::run(command);
    assert_eq!(ended.code, Some(0), "{command:?}: {ended}");
    ended
}

/// State and contact hashes, and how many bodies there are and are lost.
fn end(summary: &Value) -> [Value; 4] {
    ["state_hash", "contact_hash", "bodies", "bodies_lost"].map(|key| summary[key].clone())
}

#[test]
fn one_hash_and_the_same_answers_from_a_file_and_from_standard_input_on_any_ranks() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("commands.jsonl");
    fs::write(&file, script()).unwrap();
    let steps = length().to_string();
    let mut expected: Option<([Value; 4], String)> = None;
    for way in Way::all() {
        for ranks in [1, 2, 4].into_iter().filter(|&ranks| way.supports(ranks)) {
            for from in ["file", "stdin"] {
                let (json, answers) = (folder.path().join("a.json"), folder.path().join("answers.jsonl"));
                let start = || {
                    let mut command = way.command(ranks, CONFIG);
                    let balance = if ranks == 4 { "balance=shuffled" } else { "balance=measured" };
                    command.args(ADAPTIVE).args(["--steps", &steps, "--set", balance, "--json"]).arg(&json);
                    command.arg("--answers").arg(&answers);
                    if from == "file" {
                        command.arg("--commands").arg(&file);
                    } else {
                        // As from a program that speaks: launchers of MPI have been seen to crash where it is a file.
                        let (heard, mut said) = std::io::pipe().unwrap();
                        command.args(["--commands", "-"]).stdin(heard);
                        std::thread::spawn(move || said.write_all(script().as_bytes()));
                    }
                    program::run(&mut command)
                };
                let mut ended = start();
                // And, once in dozens of runs, where it is a pipe: what Open MPI's own process reads it with outlives what it reads for.
                for _ in 0..3 {
                    if ended.code.is_none() && ended.stderr.contains("orte_iof_hnp_read_local_handler") {
                        ended = start();
                    }
                }
                assert_eq!(ended.code, Some(0), "{way}, {ranks} ranks, from {from}: {ended}");
                let what = format!("{way}, {ranks} ranks, from {from}");
                let told = fs::read_to_string(&answers).unwrap();
                // Whoever drives hears that he is waited for.
                let told: String = told.split_inclusive('\n').filter(|line| !line.contains("waits")).collect();
                let found = (end(&program::summary(&json)), told);
                let expected = expected.get_or_insert_with(|| found.clone());
                assert_eq!(found.0, expected.0, "{what}");
                assert!(found.1 == expected.1, "{what}: answers are others");
            }
        }
    }
    let (end, answers) = expected.unwrap();
    let gone = acts().iter().filter(|(_, act)| matches!(act, Act::Remove(_))).count();
    assert_eq!(end[2..], [json!(20_000 + 1000 - gone), json!(0)]);
    let answers: Vec<Value> = answers.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let of = |key: &str| answers.iter().filter(|answer| answer.get(key).is_some()).count();
    assert_eq!(["ray", "rectangle", "point", "touching", "body"].map(of), [20; 5]);
    assert!(of("began") as u64 > length() / 2, "{} steps in which contacts began or ended", of("began"));
    assert!(answers.iter().any(|answer| answer["ray"]["id"].is_u64() && answer["name"] == "ray 3"));
    assert!(answers.iter().any(|answer| answer["touching"].as_array().is_some_and(|all| !all.is_empty())));
}

#[test]
fn a_world_of_the_library_comes_to_the_same() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("commands.jsonl");
    fs::write(&file, script()).unwrap();
    let json = folder.path().join("a.json");
    let mut command = Way::Channel.command(3, CONFIG);
    command.args(["--quiet", "--tiles=5x5", "--steps", &length().to_string(), "--json"]).arg(&json);
    run(command.arg("--commands").arg(&file));

    let config = Config::load(&program::root().join(CONFIG), &[]).unwrap();
    let config = Config::from_toml_str("same", &config.to_toml([5, 5]), &[("ranks", "1")]).unwrap();
    let mut world: World = part_of_scene(&Plan::new(&config).unwrap(), Rank(0)).unwrap();
    let acts = acts();
    let mut rest = &acts[..];
    for number in 0..length() {
        while let [(at, act), later @ ..] = rest
            && *at == number
        {
            assert!(world.command(act).unwrap(), "{act:?}");
            rest = later;
        }
        step(&mut world, &mut Loopback).unwrap();
    }
    let hashes = world.hashes();
    let expected = [hashes.state, hashes.contact].map(|hash| json!(format!("{hash:032x}")));
    assert_eq!(end(&program::summary(&json))[..2], expected);
}

#[test]
fn a_run_that_was_killed_goes_on_and_repeats_from_its_folder() {
    let folder = tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    // One more kind on the way, so that records change.
    let kind = "{\"step\": 21, \"add_kind\": {\"shape\": \"circle\", \"radius\": 0.9}}\n\
                {\"step\": 22, \"add\": [{\"id\": 7000000, \"kind\": 2, \"x\": 30, \"y\": 30}, {\"kind\": 2, \"x\": 10.5, \"y\": 40}]}\n";
    fs::write(path("commands.jsonl"), script() + kind).unwrap();
    let steps = length().to_string();
    let mut whole = Way::Channel.command(2, CONFIG);
    whole.args(ADAPTIVE).args(["--steps", &steps, "--record-every", "5", "--out"]).arg(path("whole"));
    run(whole.arg("--commands").arg(path("commands.jsonl")).arg("--answers").arg(path("whole.answers")));
    let expected = program::summary(&path("whole").join("summary.json"));
    for (number, way) in Way::all().into_iter().filter(|way| way.supports(3)).enumerate() {
        let (out, answers) = (path(&number.to_string()), path("answers"));
        let mut first = way.command(3, CONFIG);
        first
            .args(ADAPTIVE)
            .args(["--steps", &steps, "--record-every", "5", "--checkpoint-every", "9", "--out"])
            .arg(&out);
        first.arg("--commands").arg(path("commands.jsonl")).arg("--answers").arg(&answers);
        let lost = program::run(first.args(["--panic-at", &format!("1@{}", 30 + number)]));
        assert_ne!(lost.code, Some(0), "{lost}");
        // The folder knows what is to come.
        let mut second = Way::Channel.resume(1 + number, &out);
        run(second.arg("--quiet").arg("--answers").arg(&answers));
        let found = program::summary(&out.join("summary.json"));
        assert_eq!(end(&found), end(&expected), "{way}");
        assert!(found["resumed_at"].as_u64().unwrap() >= 18, "{way}");
        assert!(fs::read(&answers).unwrap() == fs::read(path("whole.answers")).unwrap(), "{way}");
        let compared = program::diff(&path("whole"), &out, &[]);
        assert!(compared.code == Some(0) && compared.stdout.starts_with("identical"), "{compared}");
    }
    let mut again = program::command();
    again
        .arg("run")
        .arg(path("whole").join("run.toml"))
        .args(["--ranks", "1", "--quiet", "--json"])
        .arg(path("again.json"));
    run(again.arg("--commands").arg(path("whole").join("commands.jsonl")));
    assert_eq!(end(&program::summary(&path("again.json"))), end(&expected));
    // What was recorded can be drawn, also bodies of the kind that came later.
    let mut render = program::command();
    render.args(["render", "--quiet", "--step", &steps, "--out"]).arg(path("end.png")).arg(path("whole"));
    run(&mut render);
}

#[test]
fn what_cannot_be_done_is_told_in_one_line_and_ends_the_run_or_not() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("c.jsonl");
    let start = |text: &str, more: &[&str]| {
        fs::write(&file, text).unwrap();
        let mut command = Way::Channel.command(2, CONFIG);
        command.args(["--quiet", "--steps", "6", "--bodies", "500", "--commands"]).arg(&file).args(more);
        program::run(&mut command)
    };
    let fine = "{\"step\": 1, \"remove\": 40}\n";
    let crowd = vec![json!({"x": 5, "y": 5}); 1001];
    let crowd = format!("{}\n", json!({"step": 3, "add": crowd}));
    for (text, expected) in [
        ("{\"step\": 3, \"remove\": 40}\n", "line 2: step 3: there is no body 40; mend it, or leave out"),
        ("{\"step\": 3, \"remove\": [50, 50]}\n", "line 2: step 3: 50 is removed already, by the same line"),
        ("{\"step\": 3, \"remove\": 2}\n", "line 2: step 3: 2 is a static, and stays as it is; name a body; mend it"),
        ("{\"step\": 3, \"add\": {\"id\": 41, \"x\": 1, \"y\": 1}}\n", "line 2: step 3: there is a body 41 already"),
        (
            "{\"step\": 3, \"add\": {\"id\": 0, \"x\": 1, \"y\": 1}}\n",
            "line 2: step 3: body 0: a static has this name; give each its own; mend it",
        ),
        (
            "{\"step\": 3, \"add\": [{\"x\": 1, \"y\": 1}, {\"kind\": 9, \"x\": 0, \"y\": 1}]}\n",
            "line 2: step 3: the body at 0.0, 1.0: there is no kind 9; use a row of the table of kinds; mend it",
        ),
        (
            "{\"step\": 3, \"add\": {\"id\": 9000, \"x\": 1, \"y\": 1, \"cos\": 2, \"sin\": 0}}\n",
            "line 2: step 3: body 9000: its rotation must be of length one: a cosine and a sine whose squares add up to 1",
        ),
        ("{\"step\": 3, \"kind\": {\"id\": 60, \"kind\": 9}}\n", "line 2: step 3: body 60: there is no kind 9"),
        (crowd.as_str(), "line 2: step 3: more than 1000 bodies would come to 5.0, 5.0 at once, where every two"),
        ("{\"step\": 3, \"gravity\": [0, 1e39]}\n", "line 2"),
        (
            "{\"step\": 3, \"velocity\": {\"id\": 60, \"vx\": 1e39, \"vy\": 0}}\n",
            "c.jsonl: line 2: number out of range, at",
        ),
        (
            "{\"step\": 3, \"impulse\": {\"id\": 60, \"x\": 3e38, \"y\": 0}}\n",
            "line 2: step 3: body 60: velocities, impulses and forces must be finite numbers, and lead to no more",
        ),
        ("{\"step\": 3, \"remve\": 40}\n", "c.jsonl: line 2: unknown field `remve`, expected one of"),
        ("{\"step\": 3, \"remove\": 41\n", "c.jsonl: line 2: EOF while parsing an object"),
    ] {
        let ended = start(&format!("{fine}{text}"), &[]);
        assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{text}: {ended}");
        assert!(ended.stderr.contains(expected), "{text}: {ended}");
        let is_read = !expected.starts_with("c.jsonl") && !text.contains("1e39");
        if is_read {
            let ended = start(&format!("{fine}{text}"), &["--skip-refused"]);
            assert_eq!((ended.code, ended.complaints().len()), (Some(0), 1), "{text}: {ended}");
            assert!(ended.stderr.contains("left out") && ended.stdout.contains("499, 0 lost"), "{text}: {ended}");
        }
    }
    // Whoever drives need not say when, and is told what else is wrong.
    for (line, expected) in [
        (
            "{\"add\": {\"x\": 1e10, \"y\": 3}}\n",
            "what was said: line 1: step 0: add, x = 1e10: must be within -1e9 to 1e9 m",
        ),
        ("{\"remve\": 40}\n", "what was said: line 1: step 0: unknown field `remve`, expected one of"),
        ("{\"remove\": 2}\n", "what was said: line 1: step 0: 2 is a static, and stays as it is; name a body"),
        ("{\"until\": 3, \"remove\": 40}\n", "what was said: line 1: step 0: until stands by itself"),
    ] {
        let (heard, mut said) = std::io::pipe().unwrap();
        said.write_all(line.as_bytes()).unwrap();
        drop(said);
        let mut command = Way::Channel.command(2, CONFIG);
        command.args(["--quiet", "--steps", "6", "--bodies", "500", "--commands", "-"]).stdin(heard);
        let ended = program::run(&mut command);
        assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{line}: {ended}");
        assert!(ended.stderr.contains(expected), "{line}: {ended}");
    }
    // What would be asked after the last step as if something had been done is not answered.
    let answers = folder.path().join("answers.jsonl");
    let late = "{\"step\": 6, \"body\": 41}\n{\"step\": 6, \"remove\": 40}\n{\"step\": 6, \"body\": 40}\n";
    let ended = start(late, &["--answers", answers.to_str().unwrap()]);
    assert!(ended.stderr.contains("2 lines are for steps from 6 on, which were not made"), "{ended}");
    let told = fs::read_to_string(&answers).unwrap();
    assert!(told.lines().count() == 1 && told.contains("\"body\":{\"id\":41,"), "{told}");
    let ended = start("{\"step\": 6, \"remove\": 40}\n{\"step\": 9, \"remove\": 41}\n", &[]);
    assert!(ended.stderr.contains("2 lines are for steps from 6 on, which were not made"), "{ended}");
    assert_eq!(ended.code, Some(0), "{ended}");
    let ended = program::run(Way::Local.command(1, CONFIG).args(["--quiet", "--commands", "/nowhere/c.jsonl"]));
    assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{ended}");
    for (line, expected) in [
        (vec!["--commands", "-", "--view"], "a page has a hand of its own"),
        (vec!["--commands", "-", "--restarts", "2", "--resume", "/tmp/x"], "cannot be heard twice"),
    ] {
        let ended = program::run(Way::Local.command(1, CONFIG).args(&line));
        assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{line:?}: {ended}");
        assert!(ended.stderr.contains(expected), "{ended}");
    }
}

/// All files of a folder but the lock, with what they hold.
fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let of = |path: PathBuf| if path.is_dir() { files(&path) } else { vec![(path.clone(), fs::read(&path).unwrap())] };
    let mut all: Vec<_> = paths.filter(|path| !path.ends_with("lock")).flat_map(of).collect();
    all.sort();
    all
}

#[test]
fn what_is_refused_is_not_kept_and_a_run_goes_on_from_there() {
    let folder = tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let start = |out: &str, more: &[&str]| {
        let mut command = Way::Channel.command(2, CONFIG);
        command.args(["--quiet", "--steps", "6", "--bodies", "500", "--out"]).arg(path(out)).args(more);
        command
    };
    let kept = |out: &str| fs::read_to_string(path(out).join("commands.jsonl")).unwrap();
    let lines = [
        "{\"step\":1,\"remove\":40}",
        "{\"step\":3,\"impulse\":{\"id\":41,\"x\":1,\"y\":0}}",
        "{\"step\":3,\"name\":\"again\",\"remove\":40}",
        "{\"step\":3,\"remove\":42}",
        "{\"step\":4,\"remove\":43}",
    ];
    let of = |places: &[usize]| places.iter().map(|&place| format!("{}\n", lines[place])).collect::<String>();
    // Some editors begin files with a mark.
    fs::write(path("good.jsonl"), "\u{feff}".to_owned() + &of(&[0, 1, 3, 4])).unwrap();
    fs::write(path("bad.jsonl"), of(&[0, 1, 2, 3, 4])).unwrap();
    let [good, bad] = ["good.jsonl", "bad.jsonl"].map(|name| path(name).display().to_string());
    run(&mut start("whole", &["--commands", &good]));
    let expected = end(&program::summary(&path("whole").join("summary.json")));
    // Left out, it is not there for whoever repeats the run.
    run(&mut start("skipped", &["--skip-refused", "--commands", &bad]));
    assert_eq!((kept("skipped"), kept("whole")), (of(&[0, 1, 3, 4]), of(&[0, 1, 3, 4])));
    // A run that it ends goes on with the lines after it, and so does one that is driven.
    let refused = "line 3 (\"again\"): step 3: there is no body 40; mend it, or leave out what cannot be done by \
                   --skip-refused; to go on without it, or with --commands and what was mended: `atoll run --resume ";
    let ended = program::run(&mut start("filed", &["--commands", &bad]));
    assert!(ended.code == Some(2) && ended.complaints().len() == 1 && ended.stderr.contains(refused), "{ended}");
    assert_eq!(kept("filed"), of(&[0, 1, 3, 4]));
    let ended = run(Way::Channel.resume(1, &path("filed")).arg("--quiet"));
    assert!(ended.stderr.contains("after step 3"), "{ended}");
    assert_eq!(end(&program::summary(&path("filed").join("summary.json"))), expected);
    let drive = |command: &mut Command, text: String| {
        let (heard, mut said) = std::io::pipe().unwrap();
        said.write_all(text.as_bytes()).unwrap();
        drop(said);
        program::run(command.args(["--commands", "-", "--answers", "-"]).stdin(heard))
    };
    let ended = drive(&mut start("driven", &[]), of(&[0, 1, 2, 3, 4]));
    assert!(ended.code == Some(2) && ended.stderr.contains(refused), "{ended}");
    assert!(ended.stdout.contains("{\"step\":3,\"name\":\"again\",\"line\":3,\"refused\":"), "{ended}");
    assert_eq!(kept("driven"), of(&[0, 1]));
    let mut resumed = Way::Channel.resume(3, &path("driven"));
    resumed.args(["--quiet", "--commands", "-", "--answers", "-"]).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = resumed.spawn().unwrap();
    let mut told = String::new();
    std::io::BufRead::read_line(&mut std::io::BufReader::new(child.stdout.take().unwrap()), &mut told).unwrap();
    assert_eq!(told, "{\"step\":3,\"waits\":true,\"done\":1}\n");
    child.stdin.take().unwrap().write_all(of(&[3, 4]).as_bytes()).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert_eq!(end(&program::summary(&path("driven").join("summary.json"))), expected);
    assert_eq!(kept("driven"), kept("whole"));
    // What comes too late for a run that goes on is told.
    fs::write(path("late.jsonl"), of(&[0, 3]) + "{\"step\":2,\"wake\":44}\n{\"step\":7,\"wake\":44}\n").unwrap();
    let mut later = Way::Channel.resume(1, &path("filed"));
    let ended = run(later.args(["--quiet", "--steps", "8", "--commands"]).arg(path("late.jsonl")));
    assert!(ended.stderr.contains("late.jsonl: 1 line is for steps before 3, which are made; left out"), "{ended}");
    // No run gives way to one that cannot begin, or go on; of step 3 the first line was done before.
    let text = "{\"step\":0,\"remove\":[40,40]}\n".to_owned() + &of(&[1]) + "{\"step\":3,\"name\":\"b\",\"wake\":40}\n";
    fs::write(path("bad.jsonl"), text).unwrap();
    let leaves = |mut command: Command, out: &str, expected: &str| {
        let before = files(&path(out));
        assert!(before.iter().any(|(path, _)| path.ends_with("timings.csv")));
        let ended = program::run(command.args(["--commands", &bad]));
        let told = ended.stderr.contains(&format!("bad.jsonl: {expected}; mend it"));
        assert!(ended.code == Some(2) && told, "{ended}");
        assert!(files(&path(out)) == before, "{ended}");
    };
    leaves(start("whole", &["--overwrite"]), "whole", "line 1: step 0: 40 is removed already, by the same line");
    for way in Way::all() {
        let mut on = way.resume(if way.supports(2) { 2 } else { 1 }, &path("filed"));
        on.args(["--quiet", "--steps", "9"]);
        leaves(on, "filed", "line 3 (\"b\"): step 3: there is no body 40");
    }
}

#[test]
fn who_is_asked_about_and_is_not_there_is_null() {
    let folder = tempdir().unwrap();
    let [file, answers] = ["c.jsonl", "answers.jsonl"].map(|name| folder.path().join(name));
    let asked = [
        (json!({"body": 99_999_999}), json!({"body": null})),
        (json!({"body": [99_999_999]}), json!({"body": [null]})),
        (json!({"body": []}), json!({"body": []})),
        (json!({"touching": 99_999_999}), json!({"touching": null})),
        (json!({"inside": 99_999_999}), json!({"inside": null})),
        // Somebody is there, and touches nobody before the first step; nobody is inside what is no sensor.
        (json!({"touching": 60}), json!({"touching": []})),
        (json!({"inside": 60}), json!({"inside": []})),
        (json!({"inside": 0}), json!({"inside": []})),
    ];
    let line = |mut said: Value| {
        said["step"] = json!(0);
        format!("{said}\n")
    };
    fs::write(&file, asked.clone().map(|(question, _)| line(question)).concat()).unwrap();
    for ranks in [1, 3] {
        let mut command = Way::Channel.command(ranks, CONFIG);
        command.args(["--quiet", "--steps", "1", "--bodies", "500", "--tiles", "3x3", "--commands"]).arg(&file);
        run(command.arg("--answers").arg(&answers));
        let told = fs::read_to_string(&answers).unwrap();
        let told: Vec<Value> = told.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        let expected: Vec<Value> =
            asked.iter().map(|(_, answer)| serde_json::from_str(&line(answer.clone())).unwrap()).collect();
        assert_eq!(told, expected, "{ranks} ranks");
    }
}

#[test]
fn a_driver_is_waited_for_and_may_go_on_after_the_run_was_lost() {
    let folder = tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let drive = |command: &mut Command, from: u64| {
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let (mut say, hear) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let mut answers = std::io::BufRead::lines(std::io::BufReader::new(hear));
        let mut next = move || answers.next().map(|line| serde_json::from_str::<Value>(&line.unwrap()).unwrap());
        let mut at = from;
        while let Some(told) = next() {
            assert_eq!(told, json!({"step": at, "waits": true}));
            if at == 40 {
                break;
            }
            // What is asked is answered before the run goes on, and decides what is done.
            writeln!(say, "{{\"body\": 300}}").unwrap();
            let Some(body) = next() else { break };
            assert_eq!((&body["step"], &body["body"]["id"]), (&json!(at), &json!(300)));
            let pushed = -0.01 * body["body"]["vx"].as_f64().unwrap();
            at += 4;
            writeln!(say, "{{\"impulse\": {{\"id\": 300, \"x\": {pushed}, \"y\": 0.01}}}}\n{{\"until\": {at}}}")
                .unwrap();
        }
        drop(say);
        child.wait().unwrap().code()
    };
    let options = ["--quiet", "--steps", "40", "--commands", "-", "--answers", "-"];
    let mut whole = Way::Channel.command(2, CONFIG);
    assert_eq!(drive(whole.args(options).arg("--out").arg(path("whole")), 0), Some(0));
    let expected = end(&program::summary(&path("whole").join("summary.json")));
    let mut lost = Way::Channel.command(2, CONFIG);
    lost.args(options).args(["--checkpoint-every", "6", "--panic-at", "1@27", "--out"]).arg(path("lost"));
    assert_eq!(drive(lost.stderr(Stdio::null()), 0), Some(3));
    let mut second = Way::Channel.resume(3, &path("lost"));
    assert_eq!(drive(second.args(&options[3..]).arg("--quiet"), 24), Some(0));
    assert_eq!(end(&program::summary(&path("lost").join("summary.json"))), expected);
    let kept = |run: &str| fs::read_to_string(path(run).join("commands.jsonl")).unwrap();
    assert_eq!(kept("lost"), kept("whole"));
    let mut again = program::command();
    again.arg("run").arg(path("lost").join("run.toml")).args(["--quiet", "--json"]).arg(path("again.json"));
    run(again.arg("--commands").arg(path("lost").join("commands.jsonl")));
    assert_eq!(end(&program::summary(&path("again.json"))), expected);
}

/// Defect: it made a step more, which nobody had allowed, and on which nobody could act.
#[test]
fn who_waits_for_a_word_and_is_interrupted_makes_no_step() {
    let folder = tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let options = ["--quiet", "--steps", "20", "--commands", "-", "--log-every", "5"];
    run(Way::Channel.command(2, CONFIG).args(&options[..3]).args(&options[5..]).arg("--out").arg(path("whole")));
    let column = |run: &str, name: &str| -> Vec<u64> {
        let rows = program::log(&path(run).join("log.csv"));
        let place = rows[0].iter().position(|column| column == name).unwrap();
        rows[1..].iter().map(|row| row[place].parse().unwrap()).collect()
    };
    for until in [0, 7] {
        let name = format!("until-{until}");
        let mut command = Way::Channel.command(2, CONFIG);
        command.args(options).args(["--answers", "-", "--out"]).arg(path(&name));
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let (mut say, hear) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        writeln!(say, "{{\"until\": {until}}}").unwrap();
        let waits = format!("{{\"step\":{until},\"waits\":true}}");
        let mut told = std::io::BufRead::lines(std::io::BufReader::new(hear));
        assert!(told.any(|line| line.unwrap() == waits), "it does not wait after step {until}");
        processes::send_signal(child.id(), "INT");
        assert_eq!(child.wait().unwrap().code(), Some(130));
        assert_eq!(program::summary(&path(&name).join("summary.json"))["steps"], json!(until));
        let mut resumed = Way::Channel.resume(3, &path(&name));
        run(resumed.args(["--quiet", "--commands", "-"]).stdin(Stdio::null()));
        let of = |run: &str| end(&program::summary(&path(run).join("summary.json")));
        assert_eq!(of(&name), of("whole"), "after step {until}");
        // Where it ended there is a row more, from which it went on.
        let steps: Vec<u64> = if until == 0 { vec![0, 5, 10, 15, 20] } else { vec![0, 5, 7, 10, 15, 20] };
        assert_eq!(column(&name, "step"), steps);
        let migrations = |run: &str| column(run, "migrations").iter().sum::<u64>();
        assert_eq!(migrations(&name), migrations("whole"), "after step {until}");
    }
}

/// The file of docs/worlds.md, and what it answers.
#[test]
fn the_commands_of_the_docs_are_done() {
    let folder = tempdir().unwrap();
    let answers = folder.path().join("answers.jsonl");
    let mut command = Way::Local.command(1, "configs/worlds/hopper.toml");
    command.args(["--quiet", "--steps", "300", "--commands", "configs/worlds/hopper.jsonl", "--answers"]).arg(&answers);
    let ended = run(&mut command);
    assert!(ended.stdout.contains("bodies        50, 0 lost, 0 escaped"), "{ended}");
    let told = fs::read_to_string(&answers).unwrap();
    let told: Vec<Value> = told.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let [added, falling, ray] = &told[..] else { panic!("{told:?}") };
    // The floors and walls of the hopper have the names above those of its 48 bodies.
    assert_eq!((&added["step"], &added["added"][1]), (&json!(60), &json!(7000)));
    assert!(added["added"][0].as_u64().unwrap() >= 48, "{added}");
    assert_eq!((&falling["name"], &falling["body"]["kind"]), (&json!("falling"), &json!(1)));
    assert!(ray["ray"]["point"][1].as_f64().unwrap() < 9.0, "{ray}");
}

/// The script of docs/worlds.md.
#[test]
fn a_script_drives_a_run() {
    let script = program::root().join("docs/drive.py");
    let Ok(found) = Command::new("python3").arg("--version").output() else { return };
    assert!(found.status.success());
    let mut command = Command::new("python3");
    program::at_home(&mut command).arg(script).arg(program::atoll(program::Profile::CURRENT));
    let ended = program::run(&mut command);
    assert_eq!(ended.code, Some(0), "{ended}");
    assert!(ended.stdout.contains("held for 3 s at a height of"), "{ended}");
    assert!(Path::new(&program::root().join("docs/worlds.md")).exists());
}
