//! A run that ends early, however that happens, goes on to the same hashes and the same recording on other ranks and
//! another transport.

use atoll_tests::processes;
use atoll_tests::program::{self, Ended, Running};
use atoll_tests::ways::Way;
use atoll_tests::world::noise;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::tempdir;

const CONFIG: &str = "configs/quickstart.toml";

/// With shapes of all kinds, and statics whose places follow from time.
const ZOO: &str = "configs/zoo.toml";

/// What every run here has in common.
const OPTIONS: [&str; 10] = [
    "--quiet",
    "--record-every",
    "20",
    "--checkpoint-every",
    "50",
    "--tiles=5x5",
    "--set",
    "max_bodies=700",
    "--set",
    "retile_every=6",
];

/// How often each kind of death is tried, and over how many steps: `ATOLL_KILLS=20x3000` for one.
fn kills() -> (u64, String) {
    let text = std::env::var("ATOLL_KILLS").unwrap_or("2x240".to_owned());
    let (times, steps) = text.split_once('x').expect("ATOLL_KILLS is TIMESxSTEPS");
    (times.parse().expect("ATOLL_KILLS is TIMESxSTEPS"), steps.to_owned())
}

fn run(command: &mut Command) -> Ended {
    let ended = program::run(command);
    assert_eq!(ended.code, Some(0), "{command:?}: {ended}");
    ended
}

fn summary(folder: &Path) -> Value {
    program::summary(&folder.join("summary.json"))
}

fn assert_same_end(found: &Path, expected: &Path, what: &str) {
    let (found_end, expected_end) = (summary(found), summary(expected));
    for key in ["state_hash", "contact_hash", "config_hash", "steps", "interrupted", "bodies_lost"] {
        assert_eq!(found_end[key], expected_end[key], "{key}: {what}");
    }
    let ended = program::diff(expected, found, &[]);
    assert!(ended.code == Some(0) && ended.stdout.starts_with("identical"), "{what}: {ended}");
}

/// Without a gap, and nothing told twice.
fn assert_same_log(found: &Path, expected: &Path, what: &str) {
    let log = |folder: &Path| program::log(&folder.join("log.csv"));
    assert_eq!(log(found), log(expected), "{what}");
}

fn wait_until(what: &str, holds: impl Fn() -> bool) {
    let deadline = Instant::now() + program::LIMIT;
    while !holds() {
        assert!(Instant::now() < deadline, "{what}");
        sleep(Duration::from_millis(2));
    }
}

/// Snapshots that are there, by step.
fn snapshots(folder: &Path) -> Vec<u64> {
    let entries = fs::read_dir(folder.join("snapshots")).into_iter().flatten().flatten();
    let step = |name: &str| name.strip_prefix("step-").and_then(|step| step.parse().ok());
    let mut steps: Vec<u64> = entries.filter_map(|entry| step(&entry.file_name().to_string_lossy())).collect();
    steps.sort_unstable();
    steps
}

#[test]
fn killed_runs_go_on_elsewhere() {
    let (times, steps) = kills();
    let folder = tempdir().unwrap();
    let options = |command: &mut Command| {
        command.args(OPTIONS).args(["--steps", &steps]);
    };
    let wholes = [CONFIG, ZOO].map(|config| {
        let whole = folder.path().join(Path::new(config).file_stem().expect("a name"));
        let start = Instant::now();
        let mut command = Way::Channel.command(2, config);
        options(&mut command);
        run(command.arg("--out").arg(&whole));
        (config, whole, start.elapsed().as_secs_f64())
    });

    let ways: Vec<Way> = Way::all().into_iter().filter(|way| *way != Way::Local).collect();
    for (w, &way) in (0..).zip(&ways) {
        for time in 0..times {
            let number = |k: u64, below: usize| (noise(100 * w + time, k) * below as f64) as usize;
            let (config, whole, duration) = &wholes[(w + time) as usize % 2];
            let killed = folder.path().join(format!("killed-{w}-{time}"));
            let mut command = way.command(1 + number(0, 4), config);
            options(&mut command);
            // Half of the tiles are on their way between any two steps.
            command.args(["--set", "balance=shuffled"]);
            // Nobody removes what MPI has for a job that is killed with its launcher, so that lies here as well.
            for variable in ["TMPDIR", "OMPI_MCA_btl_vader_backing_directory"] {
                command.env(variable, folder.path());
            }
            // Where nothing is there yet, this begins; so the very same command may be given again.
            let running = Running::start(command.arg("--resume").arg(&killed));
            let late = duration * noise(100 * w + time, 1);
            if time % 2 == 0 {
                sleep(Duration::from_secs_f64(late));
                processes::kill_all(&running);
            } else {
                // The first snapshot is complete by the time at which the second begins.
                wait_until("no second snapshot", || snapshots(&killed).last() >= Some(&100));
                sleep(Duration::from_secs_f64(0.5 * late));
                // Its ranks, if they are processes, find out by themselves, and the next run waits for that.
                running.signal("KILL");
            }
            drop(running);

            let (ranks, other) = (1 + number(2, 4), ways[number(3, ways.len())]);
            let what = format!("{way}, time {time}: killed with snapshots {:?}, on {ranks} ranks", snapshots(&killed));
            let mut command = if killed.join("run.toml").exists() {
                let mut command = other.resume(ranks, &killed);
                command.arg("--quiet");
                command
            } else {
                let mut command = other.command(ranks, config);
                options(&mut command);
                command.arg("--resume").arg(&killed);
                command
            };
            let ended = run(&mut command);
            assert_same_end(&killed, whole, &what);
            assert_same_log(&killed, whole, &what);
            let went_on = summary(&killed)["resumed_at"].as_u64() > Some(0);
            let was_over = ended.stderr.contains("are made already");
            assert!(time % 2 == 0 || went_on || was_over, "{what}: {ended}");
            fs::remove_dir_all(&killed).unwrap();
        }
    }
}

/// A recorded run over 120 steps with snapshots, uninterrupted.
fn whole(folder: &Path) -> PathBuf {
    let whole = folder.join("whole");
    run(Way::Channel.command(2, CONFIG).args(OPTIONS).args(["--steps", "120", "--out"]).arg(&whole));
    assert_eq!(snapshots(&whole), [100, 120]);
    whole
}

/// Where a run was stopped there is one more row, which has its part of the migrations that the next would have told.
fn assert_same_log_but_for(stopped: u64, found: &Path, expected: &Path) {
    let [mut found, expected] = [found, expected].map(|folder| program::log(&folder.join("log.csv")));
    let migrations = found[0].iter().position(|name| name == "migrations").unwrap();
    let count = |row: &[String]| row[migrations].parse::<u64>().unwrap();
    if found.len() > expected.len() {
        let at = found.iter().position(|row| row[0] == stopped.to_string()).unwrap();
        let more = found.remove(at);
        found[at][migrations] = (count(&more) + count(&found[at])).to_string();
    }
    assert_eq!(found, expected, "stopped after {stopped} steps");
}

#[test]
fn an_interrupt_leaves_a_snapshot_to_go_on_from() {
    let folder = tempdir().unwrap();
    for way in Way::all() {
        let ranks = if way.supports(3) { 3 } else { 1 };
        let run_folder = folder.path().join("run");
        let mut command = way.command(ranks, CONFIG);
        // So many steps that it does not come to its end by itself.
        command.args(OPTIONS).args(["--steps", "4000000000", "--out"]).arg(&run_folder);
        let running = Running::start(&mut command);
        wait_until("no snapshot", || !snapshots(&run_folder).is_empty());
        if let Way::Mpi(_) = way {
            // What mpirun does about an interrupt of its own is its business.
            processes::ranks_of(&running, ranks)[1].signal("TERM");
        } else {
            running.signal("INT");
        }
        let ended = running.end();
        // Launchers of MPI jobs hand on the exit code, which is not 0, or complain of it.
        assert!(ended.code == Some(130) || matches!(way, Way::Mpi(_)) && ended.code != Some(0), "{way}: {ended}");
        let stopped = summary(&run_folder);
        assert_eq!(stopped["interrupted"], true);
        let steps = stopped["steps"].as_u64().unwrap();
        assert_eq!(snapshots(&run_folder).last(), Some(&steps), "{way}");
        assert!(snapshots(&run_folder).len() <= 2, "{way}: {:?}", snapshots(&run_folder));

        // Fewer steps than are made already are refused; a few more lead to where a run of so many leads.
        let refused = program::run(Way::Channel.resume(2, &run_folder).args(["--steps", &(steps - 1).to_string()]));
        assert_eq!((refused.code, refused.complaints().len()), (Some(2), 1), "{refused}");
        let more = (steps + 30).to_string();
        run(Way::Channel.resume(2, &run_folder).args(["--quiet", "--steps", &more]));
        let expected = folder.path().join("expected");
        run(Way::Channel.command(1, CONFIG).args(OPTIONS).args(["--steps", &more, "--out"]).arg(&expected));
        assert_same_end(&run_folder, &expected, &format!("{way} stopped after {steps} steps"));
        assert_same_log_but_for(steps, &run_folder, &expected);
        fs::remove_dir_all(&run_folder).unwrap();
        fs::remove_dir_all(&expected).unwrap();
    }
}

#[test]
fn what_is_complete_is_not_made_once_more() {
    let folder = tempdir().unwrap();
    let whole = whole(folder.path());
    let (summary, json) = (whole.join("summary.json"), folder.path().join("summary.json"));
    let before = fs::metadata(&summary).unwrap().modified().unwrap();
    for way in Way::all() {
        let [timings, log] = ["timings.csv", "log.csv"].map(|name| folder.path().join(name));
        let mut command = way.resume(1, &whole);
        command.arg("--json").arg(&json).arg("--timings").arg(&timings).arg("--log").arg(&log);
        let ended = run(&mut command);
        assert!(ended.stderr.contains("all 120 steps of this run are made already"), "{way}: {ended}");
        assert!(ended.stderr.contains("--log: not written, as no step is made") && !log.exists(), "{way}: {ended}");
        assert_eq!(fs::read(whole.join("timings.csv")).unwrap(), fs::read(&timings).unwrap(), "{way}");
        assert_eq!(fs::metadata(&summary).unwrap().modified().unwrap(), before, "{way}");
        assert_eq!(fs::read(&summary).unwrap(), fs::read(&json).unwrap(), "{way}");
        [&json, &timings].into_iter().for_each(|file| fs::remove_file(file).unwrap());
    }
}

#[test]
fn a_lost_rank_is_made_good_by_restarts() {
    let folder = tempdir().unwrap();
    let whole = whole(folder.path());
    for way in Way::all().into_iter().filter(|way| matches!(way, Way::Channel | Way::Iceoryx2)) {
        for panic_at in ["1@30", "2@117"] {
            let run_folder = folder.path().join("run");
            let mut command = way.command(3, CONFIG);
            command.args(OPTIONS).args(["--steps", "120", "--out"]).arg(&run_folder).args(["--panic-at", panic_at]);
            let ended = run(command.args(["--restarts", "1"]));
            assert!(ended.stderr.contains("starting again (1 of 1 times)"), "{way}: {ended}");
            assert_same_end(&run_folder, &whole, &format!("{way}, a panic at {panic_at}"));
            assert_same_log(&run_folder, &whole, &format!("{way}, a panic at {panic_at}"));
            fs::remove_dir_all(&run_folder).unwrap();
        }
    }
}

#[cfg(feature = "iceoryx2")]
#[test]
fn a_killed_rank_is_made_good_by_restarts() {
    let folder = tempdir().unwrap();
    let (whole, run_folder) = (folder.path().join("whole"), folder.path().join("run"));
    run(Way::Channel.command(2, CONFIG).args(OPTIONS).args(["--steps", "400", "--out"]).arg(&whole));
    let mut command = Way::Iceoryx2.command(3, CONFIG);
    command.args(OPTIONS).args(["--steps", "400", "--restarts", "5", "--out"]).arg(&run_folder);
    let running = Running::start(&mut command);
    for rank in [1, 0] {
        let newest = || snapshots(&run_folder).last().copied();
        let (ranks, before) = (processes::ranks_of(&running, 3), newest());
        // Each time with something new to go on from, and long before the end.
        wait_until("no new snapshot", || newest() > before);
        ranks[rank].signal("KILL");
        wait_until("ranks live on", || !ranks.iter().any(processes::RankProcess::lives));
    }
    let ended = running.end();
    assert_eq!(ended.code, Some(0), "{ended}");
    assert!(ended.stderr.contains("starting again (2 of 5 times)"), "{ended}");
    assert_same_end(&run_folder, &whole, "two ranks killed");
    assert_same_log(&run_folder, &whole, "two ranks killed");
}

#[test]
fn a_damaged_snapshot_is_named_and_the_one_before_is_used() {
    let folder = tempdir().unwrap();
    let whole = whole(folder.path());
    let longer = folder.path().join("longer");
    run(Way::Channel.command(2, CONFIG).args(OPTIONS).args(["--steps", "130", "--out"]).arg(&longer));
    // As if it had been killed just before its end.
    fs::remove_file(whole.join("summary.json")).unwrap();
    let newest = "snapshots/step-0000000120/rank-00001-of-00002.atoll";
    let length = fs::metadata(whole.join(newest)).unwrap().len() as usize;
    for (k, place) in [9, 40, length - 1].into_iter().enumerate() {
        let damaged = folder.path().join(format!("damaged-{k}"));
        assert!(Command::new("cp").arg("-r").args([&whole, &damaged]).status().unwrap().success());
        let mut bytes = fs::read(damaged.join(newest)).unwrap();
        bytes[place] ^= 1;
        fs::write(damaged.join(newest), bytes).unwrap();
        let ended = run(Way::Channel.resume(3, &damaged).args(["--quiet", "--steps", "130"]));
        let named = ended.stderr.contains(&format!("{newest}: this snapshot is damaged"));
        assert!(named && ended.stderr.contains("after step 100"), "byte {place}: {ended}");
        assert_eq!(summary(&damaged)["state_hash"], summary(&longer)["state_hash"], "byte {place}");
        assert_eq!(summary(&damaged)["resumed_at"], 100, "byte {place}");
        assert!(ended.stdout.contains(" migrations since step 100\n"), "byte {place}: {ended}");
    }
    // Where none is whole, that is an error and nothing is lost, whether that is found at once or by ranks that read their parts.
    fs::remove_dir_all(whole.join("snapshots/step-0000000120")).unwrap();
    let configuration = fs::read_to_string(whole.join("run.toml")).unwrap();
    let part = whole.join("snapshots/step-0000000100/rank-00000-of-00002.atoll");
    let mut bytes = fs::read(&part).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    for damaged in [&bytes[..], &bytes[..bytes.len() / 2]] {
        fs::write(&part, damaged).unwrap();
        for way in Way::all() {
            let ended = program::run(way.resume(1, &whole).args(["--steps", "130"]));
            assert!(ended.code == Some(2) && ended.stderr.contains("no other snapshot is whole"), "{way}: {ended}");
            assert!(whole.join("rank-00000").exists());
            assert_eq!(fs::read_to_string(whole.join("run.toml")).unwrap(), configuration, "{way}");
        }
    }
    let ended = program::run(&mut Way::Channel.resume(3, &whole));
    assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{ended}");
}

#[test]
fn a_run_that_was_killed_at_its_very_end_tells_all_there_is_to_tell() {
    let folder = tempdir().unwrap();
    let whole = whole(folder.path());
    let (expected, figures) = (summary(&whole), program::log(&whole.join("log.csv")));
    fs::remove_file(whole.join("summary.json")).unwrap();
    run(Way::Channel.resume(3, &whole).arg("--quiet"));
    assert_eq!(program::log(&whole.join("log.csv")), figures);
    let found = summary(&whole);
    for key in ["state_hash", "contact_hash", "ghosts", "islands", "colors", "constraint_violation", "contacts"] {
        assert_eq!(found[key], expected[key], "{key}");
    }
    // From the last snapshot, if it has to be.
    fs::remove_file(whole.join("summary.json")).unwrap();
    let older = "snapshots/step-0000000100/rank-00000-of-00002.atoll";
    let mut bytes = fs::read(whole.join(older)).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(whole.join(older), bytes).unwrap();
    let ended = run(Way::Channel.resume(2, &whole).arg("--quiet"));
    assert!(ended.stderr.contains(older) && ended.stderr.contains("going on after step 120 instead"), "{ended}");
    assert_eq!(summary(&whole)["state_hash"], expected["state_hash"]);
    // Without any snapshot a finished run is left as it is.
    fs::remove_dir_all(whole.join("snapshots")).unwrap();
    let ended = program::run(Way::Channel.resume(3, &whole).args(["--steps", "200"]));
    assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{ended}");
    assert!(ended.stderr.contains("no snapshot to go on from"), "{ended}");
    assert_eq!(summary(&whole)["steps"], 120);
}

#[test]
fn another_run_is_refused_by_the_key_that_differs() {
    let folder = tempdir().unwrap();
    let whole = whole(folder.path());
    fs::remove_file(whole.join("summary.json")).unwrap();
    for (options, expected) in [
        (&["--seed", "2"][..], "scene.seed = 1 there, and 2 here"),
        (&["--set", "restitution_threshold=2"], "physics.restitution_threshold = 1.0 there, and 2.0 here"),
        (&["--record-every", "30"], "output.record_every = 20 there, and 30 here"),
    ] {
        let ended = program::run(Way::Channel.resume(2, &whole).args(options));
        assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{options:?}: {ended}");
        assert!(ended.stderr.contains(expected), "{options:?}: {ended}");
    }
    let begins = |option: &str| {
        let mut command = Way::Channel.command(2, CONFIG);
        command.args(["--quiet", "--steps", "2", option]).arg(&whole);
        program::run(&mut command)
    };
    let ended = begins("--out");
    assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{ended}");
    assert!(ended.stderr.contains("it holds a run; name another folder, or have `atoll run` go on"), "{ended}");
    // A run is not lost to a world that turns out to be none.
    let world = folder.path().join("world.toml");
    let text = "format = \"atoll-scene/1\"\ndomain = [[-9, -9], [9, 9]]\n[[kinds]]\nbox = [1, 1]\n[bodies]\npath = \"w.csv\"\n";
    fs::write(&world, text).unwrap();
    fs::write(folder.path().join("w.csv"), "id,x,y\n1,0,0\n1,3,3\n").unwrap();
    let mut command = Way::Channel.command(2, world.to_str().unwrap());
    let ended = program::run(command.args(["--steps", "2", "--tiles", "2x1", "--overwrite", "--out"]).arg(&whole));
    assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{ended}");
    assert!(ended.stderr.contains("has this id as well") && whole.join("snapshots").exists(), "{ended}");
    // What is no run is never overwritten.
    let other = folder.path().join("other");
    fs::create_dir(&other).unwrap();
    fs::write(other.join("thesis.tex"), "precious").unwrap();
    let mut command = Way::Channel.command(2, CONFIG);
    let ended = program::run(command.args(["--overwrite", "--out"]).arg(&other));
    assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{ended}");
    assert_eq!(fs::read_to_string(other.join("thesis.tex")).unwrap(), "precious");
    assert_eq!(fs::read_dir(&other).unwrap().count(), 1, "something was left there");
}

#[test]
fn the_folder_of_a_running_run_is_left_alone() {
    let folder = tempdir().unwrap();
    let run_folder = folder.path().join("run");
    let mut command = Way::Channel.command(2, CONFIG);
    let mut running = Running::start(command.args(["--steps", "4000000000", "--out"]).arg(&run_folder));
    running.wait_for_line("step ");
    let ended = program::run(Way::Channel.command(2, CONFIG).args(["--overwrite", "--out"]).arg(&run_folder));
    assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{ended}");
    assert!(ended.stderr.contains("another run is writing there"), "{ended}");
    running.signal("INT");
    assert_eq!(running.end().code, Some(130));
}

/// Defect: where a run stopped amid what was to be done before a step, contacts that had ended by it were never told of once it went on, and others
/// began twice. And a run that went on to make no step told zeros of a step that it had not made.
#[test]
fn what_is_told_is_told_once_where_a_run_goes_on_amid_a_step() {
    let scratch = tempdir().unwrap();
    let path = |name: &str| scratch.path().join(name);
    let scene = "format = \"atoll-scene/1\"\ndomain = [[-10.0, -2.0], [10.0, 10.0]]\n[physics]\ngravity = [0.0, -10.0]\n\
                 [[kinds]]\ncircle = 0.5\n\
                 [[statics]]\nbox = [20.0, 1.0]\nx = 0.0\ny = -0.5\n\
                 [[statics]]\nbox = [4.0, 4.0]\nx = 0.0\ny = 1.0\nsensor = true\n\
                 [[body]]\nx = 0.0\ny = 0.5\n[[body]]\nx = 3.0\ny = 0.5\n";
    fs::write(path("world.toml"), scene).unwrap();
    let begins = "{\"step\":0,\"contacts\":true}\n{\"step\":0,\"sensors\":true}\n";
    let acts = [
        "{\"step\":30,\"remove\":0}\n",
        "{\"step\":30,\"kind\":{\"id\":0,\"kind\":0}}\n{\"step\":30,\"velocity\":{\"id\":1,\"vx\":0,\"vy\":40}}\n\
         {\"step\":30,\"add\":{\"x\":0.9,\"y\":0.5}}\n",
    ];
    for (case, act) in acts.into_iter().enumerate() {
        let name = |what: &str| path(&format!("{what}-{case}"));
        fs::write(name("acts"), format!("{begins}{act}{{\"step\":30,\"remove\":999}}\n")).unwrap();
        let run = |out: &str, options: &[&str]| {
            let mut command = program::command();
            command.arg("run").arg(path("world.toml")).args(["--steps", "40", "--quiet", "--commands"]);
            command.arg(name("acts")).arg("--out").arg(name(out)).arg("--answers").arg(name(&format!("{out}-answers")));
            program::run(command.args(options))
        };
        assert_eq!(run("whole", &["--skip-refused"]).code, Some(0));
        assert_eq!(run("parted", &[]).code, Some(2));
        let answers = |out: &str| fs::read_to_string(name(&format!("{out}-answers"))).unwrap();
        let mut on = Way::Channel.resume(2, &name("parted"));
        let ended = program::run(on.arg("--answers").arg(name("parted-answers")).arg("--quiet"));
        assert_eq!(ended.code, Some(0), "{ended}");
        assert_eq!(answers("parted"), answers("whole"));
        let told = answers("whole");
        let [contacts, insides] =
            if case == 0 { ["\"ended\":[[", "\"left\":[["] } else { ["\"began\":[[", "\"entered\":[["] };
        assert!(told.contains(contacts) && told.contains(insides), "{told}");
    }
    // To where it is already, of which only a snapshot is left.
    let out = path("interrupted");
    let mut command = program::command();
    command.args(["run", "configs/quickstart.toml", "--steps", "6", "--quiet", "--checkpoint-every", "4", "--out"]);
    assert_eq!(program::run(command.arg(&out)).code, Some(0));
    fs::remove_file(out.join("summary.json")).unwrap();
    for earlier in fs::read_dir(out.join("snapshots")).unwrap().map(|entry| entry.unwrap().path()) {
        if !earlier.to_string_lossy().ends_with("06") {
            fs::remove_dir_all(earlier).unwrap();
        }
    }
    let ended = program::run(Way::Channel.resume(2, &out).args(["--steps", "6"]));
    assert_eq!(ended.code, Some(0), "{ended}");
    let found = program::summary(&out.join("summary.json"));
    assert!(found["ghosts"].is_null() && found["contacts"].as_u64().unwrap() > 0, "{found}");
}
