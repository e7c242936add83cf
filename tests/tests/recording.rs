//! What runs record: the same whatever carries the bytes, and nothing that is missing, torn or changed goes unnoticed.

use atoll::recording::{Recording, Row};
use atoll_tests::program::{self, diff, log};
use atoll_tests::ways::Way;
use parquet::file::metadata::{ParquetMetaDataReader, RowGroupMetaData};
use serde_json::Value;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::tempdir;
use xxhash_rust::xxh3::xxh3_64;

const CONFIG: &str = "configs/quickstart.toml";

/// Records every fifth of sixty steps.
fn record(way: Way, ranks: usize, folder: &Path, options: &[&str]) {
    let mut command = way.command(ranks, CONFIG);
    command.args(["--quiet", "--steps", "60", "--bodies", "4000", "--tiles", "4x3", "--record-every", "5"]);
    let ended = program::run(command.args(options).arg("--out").arg(folder));
    assert_eq!(ended.code, Some(0), "{way}: {ended}");
}

/// Copies a run, which then can be harmed.
fn copy(run: &Path, name: &str) -> PathBuf {
    let copy = run.with_file_name(name);
    assert!(Command::new("cp").arg("-r").args([run, &copy]).status().unwrap().success());
    copy
}

#[test]
fn every_transport_records_the_same_and_another_seed_does_not() {
    let folder = tempdir().unwrap();
    let local = folder.path().join("local");
    record(Way::Local, 1, &local, &[]);
    let figures = log(&local.join("log.csv"));
    assert!(figures[7][..2] == ["60", "1.0"] && figures[7][2] == "4000" && figures.len() == 8, "{figures:?}");
    let expected = "identical: 13 records of 4000 bodies, steps 0 to 60\n";
    for (k, way) in Way::all().into_iter().enumerate() {
        for ranks in [2, 3, 4, 13].into_iter().filter(|&ranks| way.supports(ranks)) {
            // One rank of thirteen has no tile.
            let other = folder.path().join(format!("{k}-{ranks}"));
            record(way, ranks, &other, if ranks == 3 { &["--threads", "2"] } else { &[] });
            assert_eq!(log(&other.join("log.csv")), figures, "{way}, {ranks} ranks");
            let ended = diff(&local, &other, &[]);
            assert_eq!((ended.code, ended.stdout.as_str()), (Some(0), expected), "{way}, {ranks} ranks: {ended}");
        }
    }

    let other = folder.path().join("other");
    record(Way::Channel, 2, &other, &["--seed", "2"]);
    let json = folder.path().join("diff.json");
    let ended = diff(&local, &other, &["--json", json.to_str().unwrap()]);
    assert_eq!(ended.code, Some(1), "{ended}");
    let lines: Vec<&str> = ended.stdout.lines().collect();
    assert!(lines[0].starts_with("the configurations differ: scene.seed is 1 in "), "{ended}");
    // Where bodies are boxes, and where circles, is for the seed to say.
    assert!(lines[2].contains(" has of other kinds ") && lines[2].contains(" bodies at step 0, "), "{ended}");
    assert!(lines[3].starts_with("first difference: step 0, body "), "{ended}");
    let told: Value = program::summary(&json);
    assert_eq!((&told["identical"], &told["first_difference"]["step"]), (&Value::Bool(false), &Value::from(0)));
    // Nothing is so far apart, but a box is no circle.
    assert_eq!(diff(&local, &other, &["--tolerance", "1e6"]).code, Some(1));
}

#[test]
fn a_run_repeats_itself_from_its_folder() {
    let folder = tempdir().unwrap();
    let (first, again) = (folder.path().join("first"), folder.path().join("again"));
    record(Way::Channel, 3, &first, &["--set", "hertz=57", "--set", "linear_damping=0.1", "--seed", "9"]);
    let mut command = program::command();
    let ended = program::run(command.arg("run").arg(first.join("run.toml")).args(["--quiet", "--out"]).arg(&again));
    assert_eq!(ended.code, Some(0), "{ended}");
    assert_eq!(diff(&first, &again, &[]).code, Some(0));
    let file = |run: &Path, name: &str| fs::read_to_string(run.join(name)).unwrap();
    assert_eq!(file(&first, "run.toml"), file(&again, "run.toml"));
    let hash = |run: &Path| program::summary(&run.join("summary.json"))["state_hash"].clone();
    assert_eq!(hash(&first), hash(&again));
}

#[test]
fn missing_and_torn_files_are_named() {
    let folder = tempdir().unwrap();
    let whole = folder.path().join("whole");
    record(Way::Channel, 3, &whole, &[]);
    let name = "rank-00001/steps-0000000000-0000000045.parquet";
    let length = fs::metadata(whole.join(name)).unwrap().len();
    type Harm = fn(&Path, u64);
    let remove: Harm = |path, _| fs::remove_file(path).unwrap();
    let tear: Harm = |path, length| File::options().write(true).open(path).unwrap().set_len(length / 2).unwrap();
    let empty: Harm = |path, _| drop(File::create(path).unwrap());
    let change: Harm = |path, length| {
        let mut bytes = fs::read(path).unwrap();
        bytes[length as usize / 2] ^= 1;
        fs::write(path, bytes).unwrap();
    };
    let missing = "rank-00001: the segment that holds step 0 is missing";
    for (what, harm, expected) in
        [("missing", remove, missing), ("torn", tear, name), ("empty", empty, name), ("changed", change, name)]
    {
        let harmed = copy(&whole, what);
        harm(&harmed.join(name), length);
        let out = folder.path().join("out");
        let export = program::run(program::command().arg("export").arg(&harmed).arg("--vtk").arg(&out));
        assert!(!out.exists(), "{what}: {export}");
        for ended in [diff(&whole, &harmed, &[]), diff(&harmed, &whole, &["--tolerance", "1e6"]), export] {
            assert_eq!((ended.code, ended.complaints().len()), (Some(2), 1), "{what}: {ended}");
            let complaint = ended.complaints()[0];
            assert!(complaint.contains(expected) && complaint.contains(&*harmed.to_string_lossy()), "{what}: {ended}");
        }
    }
    let nothing = diff(&whole, folder.path(), &[]);
    assert_eq!((nothing.code, nothing.complaints().len()), (Some(2), 1), "{nothing}");
}

/// Where in a file the rows of a record lie.
fn bytes_of(group: &RowGroupMetaData) -> std::ops::Range<usize> {
    let ranges = || group.columns().iter().map(|column| column.byte_range());
    let start = ranges().map(|(start, _)| start).min().unwrap();
    let end = ranges().map(|(start, length)| start + length).max().unwrap();
    start as usize..end as usize
}

#[test]
fn the_last_bit_of_one_number_in_a_file_is_found() {
    let folder = tempdir().unwrap();
    let whole = folder.path().join("whole");
    record(Way::Local, 1, &whole, &[]);
    let edited = copy(&whole, "edited");
    let path = edited.join("rank-00000/steps-0000000000-0000000045.parquet");
    let bytes = fs::read(&path).unwrap();
    let metadata = ParquetMetaDataReader::new().parse_and_finish(&File::open(&path).unwrap()).unwrap();
    let group = metadata.row_group(6);
    let range = bytes_of(group);
    // As the file says of itself, so that the change looks as if it had been written.
    let entry = |bytes: &[u8]| format!("30:4000:{:016x}", xxh3_64(&bytes[range.clone()]));
    let old_entry = entry(&bytes);
    let place = bytes.windows(old_entry.len()).position(|bytes| bytes == old_entry.as_bytes()).unwrap();

    let rows = |run: &Path| {
        let mut rows = Vec::new();
        Recording::open(run).and_then(|trajectory| trajectory.read(30, &mut rows)).map(|()| rows)
    };
    let before: Vec<Row> = rows(&whole).unwrap();
    // The lowest bytes of the positions come first, behind a header whose length nobody tells.
    let start = group.column(2).data_page_offset() as usize;
    let changed = (start..start + 200).find_map(|at| {
        let mut edited_bytes = bytes.clone();
        edited_bytes[at] ^= 1;
        let new_entry = entry(&edited_bytes);
        edited_bytes[place..place + new_entry.len()].copy_from_slice(new_entry.as_bytes());
        fs::write(&path, edited_bytes).unwrap();
        let after = rows(&edited).ok()?;
        let mut differing = before.iter().zip(&after).filter(|(a, b)| a != b);
        let (a, b) = differing.next()?;
        let by_one_bit = Row { x: b.x, ..*a } == *b && (a.x.next_up() == b.x || a.x.next_down() == b.x);
        (by_one_bit && differing.next().is_none()).then_some((a.id, a.x, b.x))
    });
    let (id, was, is) = changed.expect("one of them is the lowest byte of a position");
    let ended = diff(&whole, &edited, &[]);
    assert_eq!(ended.code, Some(1), "{ended}");
    assert!(ended.stdout.contains(&format!("first difference: step 30, body {id}, in x\n")), "{ended}");
    assert!(ended.stdout.contains(&format!(": x {was},")) && ended.stdout.contains(&format!(": x {is},")), "{ended}");
    assert_eq!(diff(&whole, &edited, &["--tolerance", "1e-9"]).code, Some(0));
}

/// The files in `tests/data` were written by the same configuration, those of format 1 before recordings had kinds and statics. A run
/// of today collides otherwise, but goes about the same way.
#[test]
fn a_recording_of_format_1_is_read_compared_and_exported() {
    let folder = tempdir().unwrap();
    let [old, new] = ["1", "2"].map(|format| program::root().join("tests/data/recording-format-".to_owned() + format));
    for [a, b] in [[&old, &new], [&new, &old], [&old, &old]] {
        let ended = diff(a, b, &[]);
        let expected = "identical: 3 records of 12 bodies, steps 0 to 20\n";
        assert_eq!((ended.code, ended.stdout.as_str()), (Some(0), expected), "{ended}");
    }
    let today = folder.path().join("today");
    let mut command = program::command();
    let ended = program::run(command.arg("run").arg(old.join("run.toml")).args(["--quiet", "--out"]).arg(&today));
    assert_eq!(ended.code, Some(0), "{ended}");
    for [a, b] in [[&old, &today], [&today, &old]] {
        let ended = diff(a, b, &["--tolerance", "1"]);
        let expected = "the same within 1: 3 records of 12 bodies, steps 0 to 20,";
        assert!(ended.code == Some(0) && ended.stdout.starts_with(expected), "{ended}");
    }
    // What the one leaves to its configuration, and the other says, is the same.
    let files = [&old, &new].map(|run| {
        let out = folder.path().join(if *run == old { "old-out" } else { "new-out" });
        let ended = program::run(program::command().arg("export").arg(run).arg("--vtk").arg(&out));
        assert_eq!(ended.code, Some(0), "{ended}");
        let names = ["statics.vtu", "run.pvd", "bodies-0000000020/rank-00000.vtu", "bodies-0000000020/rank-00001.vtu"];
        names.map(|name| fs::read(out.join(name)).unwrap())
    });
    assert!(files[0] == files[1], "the files are not the same");
}
