//! Pictures and films of runs: what `atoll render` makes, refuses, and leaves as it was.

use atoll_tests::program::{self, Ended};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::{TempDir, tempdir};

/// A small world on six tiles.
const WORLD: [&str; 7] = ["configs/quickstart.toml", "--bodies", "1000", "--set", "tiles=3x2", "--steps", "12"];

fn render(source: &[&str], out: &Path, options: &[&str]) -> Ended {
    let small = ["--size", "320x200", "--quiet"];
    program::run(program::command().arg("render").args(source).args(small).args(options).arg("--out").arg(out))
}

/// Records every fourth step.
fn record(folder: &TempDir, ranks: &str) -> PathBuf {
    let path = folder.path().join(format!("of-{ranks}"));
    let options = ["--quiet", "--record-every", "4", "--ranks", ranks];
    let ended = program::run(program::command().arg("run").args(WORLD).args(options).arg("--out").arg(&path));
    assert_eq!(ended.code, Some(0), "{ended}");
    path
}

/// What the picture of a source is, byte for byte.
fn picture(source: &[&str], folder: &TempDir, options: &[&str]) -> Vec<u8> {
    let out = folder.path().join("a.png");
    let ended = render(source, &out, options);
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{ended}");
    let picture = fs::read(&out).unwrap();
    fs::remove_file(out).unwrap();
    picture
}

/// All that lies in a folder and in those within it.
fn everything_in(folder: &Path) -> Vec<PathBuf> {
    let mut all: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    let within: Vec<PathBuf> = all.iter().filter(|path| path.is_dir()).flat_map(|path| everything_in(path)).collect();
    all.extend(within);
    all.sort();
    all
}

#[test]
fn a_picture_is_the_same_of_a_recording_and_of_a_run_on_any_ranks() {
    let folder = tempdir().unwrap();
    let [one, three] = ["1", "3"].map(|ranks| record(&folder, ranks));
    let live = |ranks| [&WORLD[..], &["--ranks", ranks]].concat();
    for options in [&["--color", "kind"][..], &["--color", "speed", "--step", "8"], &["--follow", "99", "--step", "4"]]
    {
        let expected = picture(&[one.to_str().unwrap()], &folder, options);
        assert!(expected.starts_with(b"\x89PNG") && expected.len() > 2000);
        for source in [vec![three.to_str().unwrap()], live("1"), live("3")] {
            assert!(picture(&source, &folder, options) == expected, "{source:?} {options:?}");
        }
    }
    // What only a run can tell is the same on any ranks as well.
    let options = ["--color", "contacts", "--contacts", "--ghosts", "--step", "11"];
    let expected = picture(&live("1"), &folder, &options);
    assert!(picture(&live("3"), &folder, &options) == expected);
    assert!(picture(&live("1"), &folder, &["--step", "11"]) != expected);
    // Who has what is told where it is asked for.
    let by_rank = picture(&live("3"), &folder, &["--color", "rank", "--tiles"]);
    assert!(picture(&[three.to_str().unwrap()], &folder, &["--color", "rank", "--tiles"]) == by_rank);
    assert!(picture(&live("1"), &folder, &["--color", "rank", "--tiles"]) != by_rank);
}

/// How many pictures a GIF holds, by its blocks.
fn pictures_of_gif(bytes: &[u8]) -> usize {
    assert!(bytes.starts_with(b"GIF89a"));
    let table = |flags: u8| if flags & 0x80 == 0 { 0 } else { 3 << ((flags & 7) + 1) };
    let after_data = |mut at: usize| {
        while bytes[at] != 0 {
            at += 1 + usize::from(bytes[at]);
        }
        at + 1
    };
    let (mut at, mut count) = (13 + table(bytes[10]), 0);
    loop {
        match bytes[at] {
            // An extension; a picture, with its colors and its data; the end.
            0x21 => at = after_data(at + 2),
            0x2c => {
                count += 1;
                at = after_data(at + 10 + table(bytes[at + 9]) + 1);
            }
            0x3b => return count,
            other => panic!("block {other:#x} at {at}"),
        }
    }
}

#[test]
fn a_film_has_as_many_pictures_as_asked_for() {
    let folder = tempdir().unwrap();
    let recorded = record(&folder, "2");
    let recorded = [recorded.to_str().unwrap()];
    let out = folder.path().join("film.gif");
    for (source, options, expected) in [
        (&recorded[..], &[][..], (4, "4 pictures of 320 x 200, steps 0 to 12, every 4; 15 a second, real time")),
        (&recorded, &["--every", "8"], (2, "2 pictures of 320 x 200, steps 0 to 8, every 8; 7.5 a second, real time")),
        (
            &recorded,
            &["--speed", "4"],
            (2, "2 pictures of 320 x 200, steps 0 to 8, every 8; 30 a second, 4 x real time"),
        ),
        (&WORLD, &["--every", "5"], (3, "3 pictures of 320 x 200, steps 0 to 10, every 5; 12 a second, real time")),
        (&WORLD, &["--fps", "15"], (4, "4 pictures of 320 x 200, steps 0 to 12, every 4; 15 a second, real time")),
        (&WORLD, &["--every", "99"], (1, "1 picture of 320 x 200, step 0")),
    ] {
        let ended = render(source, &out, options);
        assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{ended}");
        assert_eq!(ended.stdout, format!("{}: {}\n", out.display(), expected.1));
        assert_eq!(pictures_of_gif(&fs::read(&out).unwrap()), expected.0, "{ended}");
    }
    let [one, other] = [&recorded[..], &WORLD].map(|source| {
        let pictures = folder.path().join(format!("pictures-{}", source.len()));
        let ended = render(source, &pictures, &["--every", "12"]);
        assert_eq!(ended.code, Some(0), "{ended}");
        everything_in(&pictures).iter().map(|path| fs::read(path).unwrap()).collect::<Vec<_>>()
    });
    assert!(one.len() == 2 && one == other);
}

#[test]
fn who_came_and_went_by_commands_is_followed_where_it_is() {
    let folder = tempdir().unwrap();
    let (commands, run) = (folder.path().join("acts.jsonl"), folder.path().join("run"));
    fs::write(
        &commands,
        "{\"step\": 4, \"add\": [{\"id\": 70000, \"x\": 5, \"y\": 5}]}\n{\"step\": 11, \"remove\": 70000}\n",
    )
    .unwrap();
    let options = ["--quiet", "--record-every", "4", "--commands"];
    let mut command = program::command();
    command.arg("run").args(WORLD).args(options).arg(&commands).arg("--out").arg(&run);
    let ended = program::run(&mut command);
    assert_eq!(ended.code, Some(0), "{ended}");
    let recorded = [run.to_str().unwrap()];
    picture(&recorded, &folder, &["--follow", "70000", "--step", "8"]);
    for step in ["0", "12"] {
        let ended = render(&recorded, &folder.path().join("a.png"), &["--follow", "70000", "--step", step]);
        let expected = format!("--follow 70000: there is no body of that name at step {step}; give the id of another");
        assert!(ended.code == Some(2) && ended.stderr.contains(&expected), "{ended}");
    }
    let ended = render(&recorded, &folder.path().join("film.gif"), &["--follow", "70000"]);
    assert_eq!(ended.code, Some(0), "{ended}");
    assert_eq!(pictures_of_gif(&fs::read(folder.path().join("film.gif")).unwrap()), 4);
}

#[test]
fn what_cannot_be_shown_is_told_in_one_line_and_leaves_nothing() {
    let folder = tempdir().unwrap();
    let run = record(&folder, "1");
    let (recorded, at) = ([run.to_str().unwrap()], |name: &str| folder.path().join(name));
    fs::create_dir(at("bare")).unwrap();
    let before = everything_in(folder.path());
    let refused = |source: &[&str], out: &str, options: &[&str], expected: &str| {
        let ended = render(source, &at(out), options);
        let complaints = ended.complaints();
        assert!(
            ended.code == Some(2) && complaints.len() == 1 && complaints[0].contains(expected),
            "{expected}: {options:?}: {ended}"
        );
        assert_eq!(everything_in(folder.path()), before, "{options:?}");
    };
    let bare = at("bare");
    refused(
        &["/nowhere/at/all"],
        "a.png",
        &[],
        "/nowhere/at/all: cannot read this configuration: No such file or directory",
    );
    refused(&[bare.to_str().unwrap()], "a.png", &[], "bare holds no recording");
    refused(&recorded, "a.pdf", &[], "nothing is known of .pdf; end the name in .png, .gif, .mp4 or .webm");
    refused(&recorded, "none/a.png", &[], "none/a.png: No such file or directory");
    refused(&recorded, "of-1/rank-00000/a.png", &[], "must not be written over; give another path");
    refused(&recorded, "of-1", &[], "of-1: it is a folder that is not empty");
    refused(&recorded, "a.png", &["--step", "5"], "--step 5: what is recorded is every 4 steps, up to 12; give one");
    refused(&recorded, "a.png", &["--step", "16"], "--step 16: what is recorded is every 4 steps, up to 12");
    refused(
        &recorded,
        "a.gif",
        &["--every", "6"],
        "--every 6: what is recorded is every 4 steps, up to 12; give a mul",
    );
    refused(&recorded, "a.png", &["--every", "4"], "--every 4: a .png is one picture; leave it out, or name a film");
    refused(&recorded, "a.gif", &["--step", "4"], "--step 4: a film shows many steps; leave it out, or name a .png");
    refused(&recorded, "a.png", &["--steps", "4"], "--steps: what is recorded stays as it is; name a configuration");
    refused(&recorded, "a.png", &["--follow", "0"], "--follow 0: that is a static; name a dynamic body");
    refused(&recorded, "a.png", &["--follow", "99999"], "--follow 99999: there is no body of that name");
    for option in ["--ghosts", "--contacts", "--color=asleep", "--color=contacts"] {
        let named = option.replace('=', " ");
        refused(&recorded, "a.png", &[option], &format!("{named}: a recording does not tell"));
    }
    refused(&WORLD, "a.png", &["--step", "13"], "--step 13: the run makes 12 steps; give --steps 13 as well");
    refused(&WORLD, "a.png", &["--follow", "99999"], "--follow 99999: there is no body of that name");
    refused(&WORLD, "a.png", &["--view", "0,0,0,5"], "must be X0,Y0,X1,Y1 in m, X0 less than X1");
    refused(&WORLD, "a.png", &["--ranks", "0"], "--ranks");

    let segment = everything_in(&run).into_iter().find(|path| path.extension().is_some_and(|end| end == "parquet"));
    let segment = segment.unwrap();
    let mut bytes = fs::read(&segment).unwrap();
    bytes.truncate(bytes.len() / 2);
    fs::write(&segment, bytes).unwrap();
    refused(&recorded, "a.png", &[], segment.to_str().unwrap());
}

#[test]
fn a_run_that_fails_ends_the_film_with_what_it_has_to_say() {
    let folder = tempdir().unwrap();
    let wild =
        [&WORLD[..], &["--set", "hertz=1", "--set", "gravity=[0.0, -3e38]", "--ranks", "2", "--every", "1"]].concat();
    let ended = render(&wild, &folder.path().join("a.gif"), &[]);
    assert_eq!((ended.code, ended.complaints().len()), (Some(4), 1), "{ended}");
    assert!(ended.stderr.contains("is no longer finite"), "{ended}");
    assert!(everything_in(folder.path()).is_empty());
}

#[cfg(unix)]
#[test]
fn who_interrupts_gets_nothing_half_written() {
    let folder = tempdir().unwrap();
    let mut command = program::command();
    command.args(["render", "configs/quickstart.toml", "--steps", "100000", "--every", "50", "--size", "320x200"]);
    let mut running = program::Running::start(command.arg("--out").arg(folder.path().join("a.gif")));
    running.wait_for_line("step ");
    running.signal("INT");
    let ended = running.end();
    assert_eq!(ended.code, Some(130), "{ended}");
    assert!(ended.stderr.contains("interrupted: "), "{ended}");
    assert!(everything_in(folder.path()).is_empty());
}
