//! Limits that the system sets a process: each ends a run in order, with a line that names it.

#![cfg(target_os = "linux")]

use atoll_tests::program::{self, Ended};
use std::path::Path;
use std::process::Command;
use tempfile::tempdir;

/// `atoll` with some arguments, under a limit that the shell sets.
fn limited(limit: &str, arguments: &str, folder: &Path) -> Ended {
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit {limit} && exec \"$ATOLL\" {arguments}")]).env("DIR", folder);
    command.env("ATOLL", program::atoll(program::Profile::CURRENT));
    program::run(program::at_home(&mut command))
}

#[test]
fn a_file_that_grows_beyond_its_limit_cannot_be_written() {
    let folder = tempdir().unwrap();
    let run =
        "run configs/quickstart.toml --quiet --bodies 1000 --steps 30 --tiles=2x2 --checkpoint-every 10 --out $DIR";
    for ranks in [1, 3] {
        let out = folder.path().join(format!("run-{ranks}"));
        // In blocks of 512 bytes.
        let ended = limited("-f 40", &format!("{run} --record-every 5 --ranks {ranks}"), &out);
        assert_eq!((ended.code, ended.complaints().len()), (Some(5), 1), "{ended}");
        assert!(ended.stderr.contains("cannot write ") && ended.stderr.contains("File too large"), "{ended}");
        // Nothing is lost, and what could not be written is made up for.
        let mut command = program::command();
        let ended = program::run(command.args(["run", "--quiet", "--resume"]).arg(&out));
        assert_eq!(ended.code, Some(0), "{ended}");
        assert_eq!(program::diff(&out, &out, &[]).code, Some(0));
    }
}

#[test]
fn the_limit_on_processor_time_asks_a_run_to_stop() {
    let folder = tempdir().unwrap();
    let run = "run configs/quickstart.toml --quiet --bodies 400 --steps 4000000000 --out $DIR --ranks";
    for ranks in [1, 2] {
        let out = folder.path().join(format!("run-{ranks}"));
        let ended = limited("-St 1", &format!("{run} {ranks}"), &out);
        assert_eq!((ended.code, ended.complaints().len()), (Some(130), 1), "{ended}");
        let line = "atoll: the limit on processor time is reached: stopping after this step";
        assert!(ended.stderr.starts_with(line) && ended.stdout.contains("interrupted"), "{ended}");
        let steps = program::summary(&out.join("summary.json"))["steps"].as_u64().unwrap();
        assert!(out.join(format!("snapshots/step-{steps:010}")).is_dir(), "{steps}: {ended}");
    }
}

#[test]
fn a_world_beyond_the_limit_on_memory_is_refused() {
    let folder = tempdir().unwrap();
    let [quick, pile, normal] = ["quickstart", "pile", "normal"].map(|name| format!("configs/{name}.toml --steps 3"));
    for (limit, what, fits) in [
        (32_000, &*quick, false),
        (36_000, &pile, false),
        (72_000, &quick, true),
        (60_000, &normal, false),
        (400_000, &pile, true),
        // Threads of one process take addresses from each other.
        (400_000, &format!("{quick} --ranks 4 --threads 4"), false),
        (2_000_000, &format!("{quick} --ranks 4 --threads 4"), true),
        (4_000_000, &format!("{quick} --tiles 3000x3000"), false),
    ] {
        // The program itself is larger with assertions.
        if cfg!(debug_assertions) && limit < 400_000 {
            continue;
        }
        let ended = limited(&format!("-v {limit}"), &format!("run {what} --quiet"), folder.path());
        if fits {
            assert_eq!(ended.code, Some(0), "{what}, {limit} kB: {ended}");
        } else {
            let told = ended.stderr.starts_with("atoll: too large for the limit on a process (ulimit -v): ");
            assert!(ended.code == Some(2) && told, "{what}, {limit} kB: {ended}");
            assert_eq!(ended.complaints().len(), 1, "{ended}");
        }
    }
    let export = format!("scene export {quick} --bodies 20000000 --out $DIR/exported");
    let ended = limited("-v 1000000", &export.replace(" --steps 3", ""), folder.path());
    let told = "atoll: too large for the limit on a process (ulimit -v): 20000000 bodies need about ";
    assert!(ended.code == Some(2) && ended.stderr.starts_with(told), "{ended}");
    assert!(ended.complaints().len() == 1 && !folder.path().join("exported").exists(), "{ended}");
    std::fs::write(folder.path().join("world.json"), format!("{{{}", " ".repeat(60 << 20))).unwrap();
    let ended = limited("-v 1000000", "scene import $DIR/world.json --out $DIR/imported", folder.path());
    let told = "atoll: too large for the limit on a process (ulimit -v): the bodies of ";
    assert!(ended.code == Some(2) && ended.stderr.starts_with(told), "{ended}");
}

/// Four thousand boxes within half a meter: each would touch all others.
#[test]
fn a_world_that_is_too_crowded_is_refused() {
    let folder = tempdir().unwrap();
    let scene = folder.path().join("world.toml");
    let text = "format = \"atoll-scene/1\"\ndomain = [[0, 0], [10, 10]]\n[[kinds]]\nbox = [0.5, 0.5]\n[bodies]\npath = \"b.csv\"\n";
    std::fs::write(&scene, "\u{feff}".to_owned() + text).unwrap();
    let place = |k: u32| format!("{},{}\n", 4.6 + 0.003 * f64::from(k % 64), 4.6 + 0.003 * f64::from(k / 64));
    std::fs::write(folder.path().join("b.csv"), "\u{feff}x,y\n".to_owned() + &(0..4000).map(place).collect::<String>())
        .unwrap();
    for ranks in ["1", "2"] {
        let mut command = program::command();
        let ended = program::run(command.arg("run").arg(&scene).args(["--quiet", "--tiles=2x1", "--ranks", ranks]));
        assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{ended}");
        assert!(ended.stderr.contains("too crowded: at least 7998000 pairs of the 4000 bodies are nearer"), "{ended}");
    }
}
