//! The folder of a run: who may write there, what is not written over, and what is refused, told or made good where something in
//! there is gone or damaged.

use atoll_tests::program::{self, Ended, Running, diff};
use atoll_tests::ways::Way;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::{TempDir, tempdir};

/// A small world.
const SMALL: [&str; 6] = ["--quiet", "--bodies", "1000", "--tiles=2x2", "--ranks", "2"];

/// What most runs here write: segments until steps 10, 20 and 30, and snapshots after 20 and 30.
const OUTPUT: [&str; 6] = ["--steps", "30", "--record-every", "5", "--checkpoint-every", "10"];

fn begin(option: &str, folder: &Path) -> Command {
    let mut command = program::command();
    command.args(["run", "configs/quickstart.toml"]).args(SMALL).args(OUTPUT).arg(option).arg(folder);
    command
}

fn resume(folder: &Path) -> Command {
    let mut command = program::command();
    command.args(["run", "--quiet", "--resume"]).arg(folder);
    command
}

/// A folder with the folder of a run in it.
fn recorded(name: &str) -> (TempDir, PathBuf) {
    let folder = tempdir().unwrap();
    let run = folder.path().join(name);
    let ended = program::run(&mut begin("--out", &run));
    assert_eq!((ended.code, ended.complaints().len()), (Some(0), 0), "{ended}");
    (folder, run)
}

fn copy(run: &Path, name: &str) -> PathBuf {
    let to = run.with_file_name(name);
    assert!(Command::new("cp").arg("-r").args([run, &to]).status().unwrap().success());
    to
}

/// Every file below a folder but its lock, with what it holds.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            all.extend(contents(&path));
        } else if !path.ends_with("lock") {
            all.push((path.clone(), fs::read(path).unwrap()));
        }
    }
    all.sort();
    all
}

#[track_caller]
fn assert_refused(ended: &Ended, code: i32, expected: &str) {
    // A launcher has lines of its own.
    let complaints: Vec<&str> = ended.stderr.lines().filter(|line| line.starts_with("atoll: ")).collect();
    let told = complaints.len() == 1 && complaints[0].contains(expected);
    assert!(ended.code == Some(code) && told, "expected {expected:?}, {code}: {ended}");
}

fn flip(path: &Path, at: usize) {
    let mut bytes = fs::read(path).unwrap();
    bytes[at] ^= 1;
    fs::write(path, bytes).unwrap();
}

#[test]
fn what_a_run_keeps_is_not_written_over() {
    let (folder, run) = recorded("run");
    let other = copy(&run, "other");
    let before = contents(folder.path());
    let segment = "rank-00001/steps-0000000000-0000000010.parquet";
    let snapshot = "snapshots/step-0000000020/rank-00000-of-00002.atoll";
    let config = folder.path().join("world.toml");
    fs::copy(program::root().join("configs/quickstart.toml"), &config).unwrap();
    for name in [
        "run.toml",
        "summary.json",
        "log.csv",
        "timings.csv",
        "lock",
        segment,
        snapshot,
        "rank-00007/x",
        ".run.toml.7.tmp",
    ] {
        let options = match name {
            name if name == segment => ["--timings", "--json"],
            "timings.csv" | "run.toml" => ["--log", "--json"],
            _ => ["--json", "--json"],
        };
        // Of the run itself, and of any other; however the way there is written.
        for file in [run.join(name), other.join("../other").join(name)] {
            let expected = format!("that is a file of the run in {}/", folder.path().canonicalize().unwrap().display());
            for mut command in [begin("--overwrite", &file), resume(&run)] {
                if command.get_args().any(|word| word == "--overwrite") {
                    command = begin("--out", &run);
                    command.arg("--overwrite");
                }
                let ended = program::run(command.arg(options[0]).arg(&file));
                // In a folder that is not there nothing can be written at all.
                let expected = if name.ends_with('x') { "" } else { &expected };
                assert_refused(&ended, 2, expected);
            }
            assert_refused(&diff(&run, &other, &[options[1], file.to_str().unwrap()]), 2, "");
        }
    }
    let mut command = program::command();
    command.arg("run").arg(&config).args(["--timings", "world.toml"]).current_dir(folder.path());
    assert_refused(
        &program::run(&mut command),
        2,
        "that is the configuration of this run and must not be written over",
    );
    fs::remove_file(config).unwrap();
    assert_eq!(contents(folder.path()), before);
    // What is there beside is the user's own.
    let mine = run.join("mine.json");
    let ended = program::run(begin("--out", &run).arg("--overwrite").arg("--json").arg(&mine));
    assert_eq!(ended.code, Some(0), "{ended}");
    assert_eq!(program::summary(&mine)["steps"], 30);
}

#[test]
fn a_run_goes_on_only_with_the_whole_of_its_recording() {
    let (folder, run) = recorded("run");
    let other = folder.path().join("other");
    let ended = program::run(begin("--out", &other).args(["--seed", "2"]));
    assert_eq!(ended.code, Some(0), "{ended}");
    let name = "rank-00001/steps-0000000000-0000000010.parquet";
    let good = fs::read(run.join(name)).unwrap();
    type Harm<'a> = (&'a str, Box<dyn Fn(&Path) + 'a>);
    let harms: [Harm<'_>; 4] = [
        (
            "is damaged, or no segment of a recording",
            Box::new(|path| fs::write(path, &good[..good.len() - 9]).unwrap()),
        ),
        ("is damaged, or no segment of a recording", Box::new(|path| fs::write(path, "").unwrap())),
        (
            "rank-00001: the segment that holds step 0 is missing; bring it back",
            Box::new(|path| fs::remove_file(path).unwrap()),
        ),
        (
            "are of different runs: scene.seed is 1 in the one and 2 in the other",
            Box::new(|path| assert!(fs::copy(other.join(name), path).unwrap() > 0)),
        ),
    ];
    for (expected, harm) in harms {
        harm(&run.join(name));
        let before = contents(&run);
        for way in Way::all() {
            let ended = program::run(way.resume(1, &run).args(["--quiet", "--steps", "40"]));
            assert_refused(&ended, 2, expected);
            assert!(ended.stderr.contains("or begin anew with --out and --overwrite"), "{way}: {ended}");
        }
        assert_eq!(contents(&run), before, "{expected}");
        fs::write(run.join(name), &good).unwrap();
    }
    fs::remove_dir_all(run.join("rank-00000")).unwrap();
    assert_refused(&program::run(resume(&run).args(["--steps", "40"])), 2, "the segment that holds step 0 is missing");
}

#[test]
fn a_log_is_gone_on_with_and_what_is_no_row_is_refused() {
    let (folder, run) = recorded("run");
    let log = run.join("log.csv");
    let whole = fs::read_to_string(&log).unwrap();
    let lines: Vec<&str> = whole.split_inclusive('\n').collect();
    let mine = folder.path().join("mine.csv");
    let on = |options: &[&str]| program::run(resume(&run).args(["--steps", "40"]).args(options));
    let steps = |file: &Path| -> Vec<String> { program::log(file)[1..].iter().map(|row| row[0].clone()).collect() };
    assert_eq!(steps(&log), ["0", "10", "20", "30"]);
    for (harmed, expected) in [
        (
            whole.replacen("10,0.1", "10,O.1", 1),
            "log.csv is damaged: line 3 is no row of this log; bring back a good copy",
        ),
        (lines[1..].concat(), "log.csv is no log, or one of another version: it begins with 0,0.0,1000"),
        (whole.replacen("step,time,", "step,hours,", 1), "it begins with step,hours,bodies"),
    ] {
        fs::write(&log, harmed).unwrap();
        let before = contents(&run);
        for way in Way::all() {
            assert_refused(&program::run(way.resume(1, &run).args(["--quiet", "--steps", "40"])), 2, expected);
        }
        if !expected.contains("hours") {
            assert_refused(&program::run(program::command().arg("info").arg(&run)), 2, "log.csv is ");
        }
        assert_eq!(contents(&run), before);
    }
    // The user's own as well.
    fs::write(&log, &whole).unwrap();
    fs::write(&mine, "thesis").unwrap();
    assert_refused(&on(&["--log", mine.to_str().unwrap()]), 2, "mine.csv is no log");
    assert_eq!(
        (fs::read_to_string(&mine).unwrap().as_str(), fs::read_to_string(&log).unwrap()),
        ("thesis", whole.clone())
    );
    fs::remove_file(&mine).unwrap();
    // What a killed run left after its last snapshot goes, whatever it is; what is torn, too.
    fs::write(&log, format!("{whole}35,0.5\n\0\0\n")).unwrap();
    let ended = on(&["--log", mine.to_str().unwrap(), "--log-every", "4"]);
    // What it goes on with, and nothing else.
    assert_eq!((ended.code, ended.complaints().len()), (Some(0), 1), "{ended}");
    assert!(ended.stderr.starts_with("atoll: going on with "), "{ended}");
    let text = fs::read_to_string(&log).unwrap();
    assert!(text.starts_with(&whole), "{text}");
    assert_eq!(steps(&log), ["0", "10", "20", "30", "32", "36", "40"]);
    // One that is new begins with the first step that is made.
    assert_eq!(steps(&mine), ["32", "36", "40"]);
    let info = program::run(program::command().arg("info").arg(&run));
    assert!(info.stdout.contains("log           7 rows, steps 0 to 40\n"), "{info}");
    // Where it was not written for a while, it says so and goes on.
    fs::write(&log, lines[..3].concat()).unwrap();
    let ended = program::run(resume(&run).args(["--steps", "50"]));
    assert!(ended.code == Some(0) && ended.stderr.contains("log.csv: no rows from step 10 to 40"), "{ended}");
    assert_eq!(steps(&log), ["0", "10", "44", "48", "50"]);
    // An older version left none.
    fs::remove_file(&log).unwrap();
    let ended = program::run(resume(&run).args(["--steps", "60"]));
    assert!(
        ended.code == Some(0) && ended.stderr.contains("log.csv is not there: its rows begin after step 50"),
        "{ended}"
    );
    assert_eq!(steps(&log), ["52", "56", "60"]);
}

/// Of several that are started at once, one begins the run, and all others wait for its end.
#[test]
fn all_that_resume_wait_for_the_one_that_runs() {
    let folder = tempdir().unwrap();
    let mut waited = 0;
    for time in 0..4 {
        let run = folder.path().join(format!("run-{time}"));
        let all: Vec<Running> = (0..3).map(|_| Running::start(&mut begin("--resume", &run))).collect();
        let ends: Vec<Ended> = all.into_iter().map(Running::end).collect();
        assert!(ends.iter().all(|ended| ended.code == Some(0)), "{ends:#?}");
        let told = |text: &str| ends.iter().filter(|ended| ended.stderr.contains(text)).count();
        waited += told("waiting for the run that still writes there");
        assert_eq!(told("all 30 steps of this run are made already"), 2, "{ends:#?}");
        assert_eq!(ends.iter().filter(|ended| ended.stdout.contains("state hash")).count(), 1, "{ends:#?}");
    }
    assert!(waited > 0, "nobody ever waited");
}

/// A run that goes on says where its folder tells of other commands than were done, and once.
#[test]
fn commands_that_were_lost_or_added_are_told_of() {
    let folder = tempdir().unwrap();
    let (run, script) = (folder.path().join("run"), folder.path().join("c.jsonl"));
    let lines = "{\"step\": 5, \"wake\": 20}\n{\"step\": 8, \"body\": 20}\n{\"step\": 50, \"gravity\": [0, -5]}\n";
    fs::write(&script, lines).unwrap();
    let ended = program::run(begin("--out", &run).arg("--commands").arg(&script));
    assert_eq!(ended.code, Some(0), "{ended}");
    let [lost, added] = ["lost", "added"].map(|name| copy(&run, name));
    fs::remove_file(lost.join("commands.jsonl")).unwrap();
    fs::write(added.join("commands.jsonl"), format!("{{\"step\": 3, \"wake\": 21}}\n{lines}")).unwrap();
    let told = ["has 0 of the 2 lines that were done", "has 3 lines for steps that are made, of which 2 were done"];
    for (run, expected) in [(&run, None), (&lost, Some(told[0])), (&added, Some(told[1]))] {
        for steps in ["40", "45"] {
            let ended = program::run(resume(run).args(["--steps", steps]));
            let is_told = told.map(|text| ended.stderr.contains(text));
            let expected = told.map(|text| expected == Some(text) && steps == "40");
            assert!(ended.code == Some(0) && is_told == expected, "to {steps}: {ended}");
        }
    }
}

/// What a run writes, or removes, lies in its own folder.
#[cfg(unix)]
#[test]
fn links_out_of_the_folder_are_refused() {
    let (folder, run) = recorded("run");
    for name in ["lock", "rank-00001", "snapshots", "log.csv"] {
        let linked = copy(&run, &format!("linked-{name}"));
        let (link, outside) = (linked.join(name), folder.path().join(format!("outside-{name}")));
        fs::rename(&link, &outside).unwrap();
        std::os::unix::fs::symlink(&outside, &link).unwrap();
        let before = contents(folder.path());
        for command in [&mut resume(&linked), begin("--out", &linked).arg("--overwrite")] {
            assert_refused(&program::run(command), 2, &format!("its {name} is a link"));
        }
        assert_eq!(contents(folder.path()), before);
    }
}

#[test]
fn a_summary_that_cannot_be_read_counts_as_missing() {
    let (_folder, run) = recorded("run");
    let torn = copy(&run, "torn");
    let summary = torn.join("summary.json");
    let whole = fs::read(&summary).unwrap();
    fs::write(&summary, &whole[..100]).unwrap();
    let note = "summary.json is no summary of a run: ";
    let info = program::run(program::command().arg("info").arg(&torn));
    assert_refused(&info, 0, note);
    assert!(info.stderr.contains("; remove it, or bring back a good copy of it; until then"), "{info}");
    assert!(info.stdout.contains("its summary cannot be read") && info.stdout.contains("7 records"), "{info}");
    let compared = diff(&run, &torn, &[]);
    assert_refused(&compared, 0, note);
    assert!(compared.stdout.contains("identical: 7 records"), "{compared}");
    let ended = program::run(&mut resume(&torn));
    assert!(ended.code == Some(0) && ended.stderr.contains(note), "{ended}");
    assert_eq!(program::summary(&summary)["state_hash"], program::summary(&run.join("summary.json"))["state_hash"]);
    assert_eq!((diff(&run, &torn, &[]).code, diff(&run, &torn, &[]).stderr), (Some(0), String::new()));
    // Where nothing else tells how far the run came, nothing is removed.
    fs::remove_dir_all(torn.join("snapshots")).unwrap();
    fs::write(&summary, &whole[..100]).unwrap();
    assert_refused(&program::run(&mut resume(&torn)), 2, "there is no snapshot to go on from");
    assert!(torn.join("rank-00001/steps-0000000000-0000000010.parquet").exists());
}

#[test]
fn info_fails_on_a_damaged_snapshot_and_tells_all_the_same() {
    let (_folder, run) = recorded("run");
    for at in [40, 20_000] {
        let damaged = copy(&run, &format!("damaged-{at}"));
        let snapshot = "snapshots/step-0000000020/rank-00001-of-00002.atoll";
        flip(&damaged.join(snapshot), at);
        let info = program::run(program::command().arg("info").arg(&damaged));
        assert_refused(&info, 2, &format!("{snapshot}: this snapshot is damaged: "));
        assert!(info.stderr.contains("bring back a good copy of it"), "{info}");
        assert!(info.stdout.contains("7 records") && info.stdout.contains("after step 30: "), "{info}");
        // Nor does one that is damaged hide another, or what is whole.
        flip(&damaged.join("rank-00001/steps-0000000000-0000000010.parquet"), 200);
        fs::write(damaged.join("commands.jsonl"), "{\"step\": 5}\n").unwrap();
        let info = program::run(program::command().arg("info").arg(&damaged));
        assert_refused(&info, 2, "bring back a good copy of it; the list tells of 2 more");
        assert!(info.stdout.contains("commands.jsonl: line 1: "), "{info}");
        assert!(info.stdout.contains("after step 30: ") && info.stdout.contains(" MB, state hash "), "{info}");
    }
}

#[test]
fn a_comparison_that_cannot_be_written_is_no_bad_input() {
    if !Path::new("/dev/full").exists() {
        return;
    }
    let (_folder, run) = recorded("run");
    let to_full = |text: &str| {
        let mut command = Command::new("sh");
        command.args(["-c", &format!("\"$ATOLL\" {text} > /dev/full")]).env("RUN", &run);
        command.env("ATOLL", program::atoll(program::Profile::CURRENT));
        program::run(program::at_home(&mut command))
    };
    assert_refused(&to_full("diff \"$RUN\" \"$RUN\""), 5, "cannot write standard output: No space left");
    assert_refused(&to_full("info \"$RUN\""), 5, "cannot write standard output: No space left");
    assert_refused(&diff(&run, &run, &["--json", "/dev/full"]), 5, "cannot write /dev/full: No space left");
}

#[test]
fn a_run_whose_folder_was_removed_says_so() {
    let folder = tempdir().unwrap();
    // A launcher that is signalled ends with a code of its own.
    for way in Way::all().into_iter().filter(|way| !matches!(way, Way::Mpi(_))) {
        for (option, first, gone) in [
            ("--record-every", "rank-00000/steps-0000000000-0000000045.parquet", "rank-00000"),
            ("--record-every", "rank-00000/steps-0000000000-0000000045.parquet", ""),
            ("--checkpoint-every", "snapshots", ""),
        ] {
            let (run, away) = (folder.path().join("run"), folder.path().join("away"));
            let mut command = way.command(1, "configs/quickstart.toml");
            command.args(["--quiet", "--bodies", "400", "--steps", "4000000000", option, "5", "--out"]).arg(&run);
            let running = Running::start(&mut command);
            let deadline = Instant::now() + program::LIMIT;
            while !run.join(first).exists() {
                assert!(Instant::now() < deadline, "{way}: no {first}");
                sleep(Duration::from_millis(2));
            }
            // While the run puts something in there this may fail, once or more.
            let kept = if gone.is_empty() { "run.toml" } else { first };
            while run.join(kept).exists() {
                // All at once: of a folder that goes file by file the run names the first that it misses.
                let _ = if gone.is_empty() { fs::rename(&run, &away) } else { fs::remove_dir_all(run.join(gone)) };
            }
            running.signal("TERM");
            let ended = running.end();
            assert_eq!(ended.code, Some(5), "{way}, {option}, {gone:?}: {ended}");
            assert!(ended.stderr.contains(" is gone: somebody removed it"), "{way}: {ended}");
            if gone.is_empty() {
                assert!(ended.stderr.contains("run.toml is gone: somebody removed it while the run wrote"), "{ended}");
            }
            let _ = [&run, &away].map(fs::remove_dir_all);
        }
    }
}

#[test]
fn what_is_lost_of_a_run_is_told_where_it_is_looked_at() {
    let folder = tempdir().unwrap();
    let (run, out) = (folder.path().join("run"), folder.path().join("out"));
    let atoll = |words: &[&str]| {
        let mut command = program::command();
        program::run(command.args(words.iter().map(|word| match *word {
            "RUN" => run.as_os_str(),
            word => std::ffi::OsStr::new(word),
        })))
    };
    let config = ["run", "configs/quickstart.toml", "--bodies", "500", "--steps", "4", "--record-every", "2"];
    let ended = atoll(&[&config[..], &["--set", "tiles=bisected", "--set", "tile_count=6", "--out", "RUN"]].concat());
    assert_eq!(ended.code, Some(0), "{ended}");
    let [page, picture] = ["page.html", "end.png"].map(|name| out.with_file_name(name).display().to_string());
    let look: [&[&str]; 3] =
        [&["report", "RUN", "--out", &page], &["render", "RUN", "--step", "4", "--out", &picture], &["info", "RUN"]];
    for words in look {
        let ended = atoll(words);
        assert!(ended.code == Some(0) && ended.complaints().is_empty(), "{ended}");
    }
    let told = fs::read_to_string(&page).unwrap();
    assert!(told.contains("6 tiles with borders that follow the bodies"), "{told}");
    fs::remove_file(run.join("tilings.jsonl")).unwrap();
    for words in look {
        let ended = atoll(words);
        assert_eq!((ended.code, ended.complaints().len()), (Some(0), 1), "{words:?}: {ended}");
        assert!(ended.stderr.contains("tilings.jsonl: No such file") && ended.stderr.contains("bring back"), "{ended}");
    }
    let begun = fs::read_to_string(run.join("run.toml")).unwrap();
    for damaged in [String::new(), begun.replace("steps = 4", "steps = = 4"), begun.replace("steps = 4", "stops = 4")] {
        fs::write(run.join("run.toml"), &damaged).unwrap();
        for words in [&["run", "--resume", "RUN"][..], look[0], look[2]] {
            let ended = atoll(words);
            assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{words:?}: {ended}");
            assert!(ended.stderr.contains("its run.toml is damaged: "), "{words:?}: {ended}");
            assert!(ended.stderr.contains("bring back a good copy of it"), "{words:?}: {ended}");
        }
    }
}
