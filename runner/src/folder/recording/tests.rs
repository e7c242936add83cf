use super::facts::Format;
use super::testing::{bodies, body, facts, record, stage, stage_text};
use super::*;
use atoll_core::Body;
use parquet::column::writer::ColumnWriter;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::ColumnPath;
use std::collections::BTreeMap;
use std::fs;
use std::sync::Arc;
use tempfile::TempDir;

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

/// A run of two ranks that recorded steps 0, 5, ..., 60.
fn recorded() -> TempDir {
    let folder = folder();
    record(folder.path(), &facts(5), 2, (0..=60).step_by(5), bodies);
    folder
}

fn row(body: Body) -> Row {
    let Body { id, position, rotation, velocity, angular_velocity: omega, kind } = body;
    let (angle, vx, vy) = (rotation.angle(), velocity.x, velocity.y);
    Row { id: id.0, x: position.x, y: position.y, angle, vx, vy, omega, kind: kind.0, padding: 0 }
}

fn sorted(mut rows: Vec<Row>) -> Vec<Row> {
    rows.sort_by_key(|row| row.id);
    rows
}

fn read(recording: &Recording, step: u64) -> Vec<Row> {
    let mut rows = Vec::new();
    recording.read(step, &mut rows).unwrap();
    rows
}

/// What is wrong with a recording, of which something is wrong.
fn complaint(folder: &Path) -> String {
    let error = match Recording::open(folder) {
        Err(error) => error,
        Ok(recording) => {
            let mut rows = Vec::new();
            let read = recording.steps().iter().map(|step| recording.read(*step, &mut rows));
            read.collect::<Result<Vec<_>, _>>().unwrap_err()
        }
    };
    let text = error.to_string();
    assert!(text.contains(folder.to_str().unwrap()) && !text.contains('\n'), "{text}");
    text.replace(folder.to_str().unwrap(), "DIR")
}

/// All that can be read, by step.
fn everything(folder: &Path) -> Result<BTreeMap<u64, Vec<Row>>, RecordingError> {
    let recording = Recording::open(folder)?;
    let mut rows = Vec::new();
    recording.steps().iter().map(|&step| recording.read(step, &mut rows).map(|()| (step, rows.clone()))).collect()
}

#[test]
fn states_come_back_bit_for_bit_in_their_order() {
    let folder = folder();
    let odd = |step| {
        let mut bodies = bodies(step);
        bodies[0].position.x = -0.0;
        bodies[1].position.x = 1e9 + 1e-7;
        bodies[2].position.y = f64::from_bits(1);
        bodies[3].velocity.x = f32::from_bits(0x8000_0001);
        bodies[4].velocity.y = f32::MAX;
        bodies[5].angular_velocity = -0.0;
        bodies[6].id.0 = u64::MAX;
        bodies
    };
    record(folder.path(), &facts(1), 1, 0..3, odd);
    let recording = Recording::open(folder.path()).unwrap();
    for step in 0..3 {
        let expected: Vec<Row> = odd(step).into_iter().map(row).collect();
        let read = read(&recording, step);
        assert_eq!(bytemuck::cast_slice::<_, u8>(&read), bytemuck::cast_slice::<_, u8>(&expected));
    }
    assert_eq!(recording.facts(), &facts(1));
    let (kinds, statics) = stage();
    assert_eq!(recording.stage(), Some(&Stage { names: vec![None; kinds.len()], kinds, statics }));
}

#[test]
fn many_rows_take_several_pages() {
    let folder = folder();
    let many = |step| (0..150_000).map(|id| body(id, step)).collect();
    record(folder.path(), &facts(1), 1, 0..1, many);
    let recording = Recording::open(folder.path()).unwrap();
    assert_eq!(read(&recording, 0), many(0).into_iter().map(row).collect::<Vec<_>>());
}

#[test]
fn a_segment_holds_ten_records_and_the_last_the_rest() {
    let folder = recorded();
    for rank in 0..2 {
        let mut names: Vec<_> = fs::read_dir(rank_folder(folder.path(), rank)).unwrap().collect();
        names.sort_by_key(|entry| entry.as_ref().unwrap().file_name());
        let names: Vec<_> = names.into_iter().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(names, ["steps-0000000000-0000000045.parquet", "steps-0000000050-0000000060.parquet"]);
    }
    let recording = Recording::open(folder.path()).unwrap();
    assert_eq!((recording.steps().len(), recording.incomplete()), (13, 0));
    for &step in recording.steps() {
        let expected: Vec<Row> = bodies(step).into_iter().map(row).collect();
        assert_eq!(sorted(read(&recording, step)), sorted(expected));
    }
    let error = recording.read(7, &mut Vec::new()).unwrap_err();
    assert!(error.to_string().ends_with("has no record of step 7; the nearest is of step 5"), "{error}");
}

#[test]
fn idle_ranks_record_as_well() {
    let folder = folder();
    record(folder.path(), &facts(1), 3, 0..12, |step| vec![body(9, step)]);
    let recording = Recording::open(folder.path()).unwrap();
    assert_eq!(recording.steps().len(), 12);
    assert_eq!(read(&recording, 11), [row(body(9, 11))]);
}

#[test]
fn only_closed_segments_have_a_name_and_can_be_synced() {
    let folder = folder();
    let rank = rank_folder(folder.path(), 0);
    let names = || {
        let names = fs::read_dir(&rank).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.collect::<Vec<_>>()
    };
    let mut writer = RecordingWriter::new(rank.clone(), 0, 1, &facts(10), &stage_text()).unwrap();
    let mut record = Record::default();
    writer.sync().unwrap();
    writer.close_segment().unwrap();
    record.fill(0, bodies(0).into_iter());
    writer.write(&record).unwrap();
    assert_eq!(names(), [".steps-0000000000.parquet.tmp"]);
    assert!(complaint(folder.path()).starts_with("DIR holds no recording"), "{}", complaint(folder.path()));
    writer.close_segment().unwrap();
    assert_eq!(names(), ["steps-0000000000-0000000000.parquet"]);
    writer.sync().unwrap();
    record.fill(10, bodies(10).into_iter());
    writer.write(&record).unwrap();
    drop(writer);
    assert_eq!(Recording::open(folder.path()).unwrap().steps(), [0]);
}

#[test]
fn a_segment_that_cannot_be_closed_leaves_nothing() {
    let folder = folder();
    let rank = rank_folder(folder.path(), 0);
    // In the way of the name it would have.
    fs::create_dir_all(rank.join("steps-0000000000-0000000003.parquet/in-the-way")).unwrap();
    let mut writer = RecordingWriter::new(rank.clone(), 0, 1, &facts(1), &stage_text()).unwrap();
    let mut record = Record::default();
    for step in 0..4 {
        record.fill(step, bodies(step).into_iter());
        writer.write(&record).unwrap();
    }
    let error = writer.close_segment().unwrap_err().to_string();
    assert!(error.starts_with("cannot write") && error.contains("rank-00000/.steps-0000000000"), "{error}");
    assert_eq!(fs::read_dir(&rank).unwrap().count(), 1);
    // The writer is as good as new.
    writer.close_segment().unwrap();
    writer.write(&record).unwrap();
    writer.close_segment().unwrap();
    assert!(rank.join("steps-0000000003-0000000003.parquet").is_file());

    fs::write(folder.path().join("file"), "").unwrap();
    let error =
        RecordingWriter::new(folder.path().join("file/rank-00000"), 0, 1, &facts(1), &stage_text()).unwrap_err();
    assert!(error.to_string().contains("file/rank-00000: Not a directory"), "{error}");
}

#[test]
fn a_full_disk_is_an_error_and_no_segment() {
    // Writes to this device fail as on a full disk; a segment under way is a link to it.
    if !Path::new("/dev/full").exists() {
        return;
    }
    let folder = folder();
    let mut writer = RecordingWriter::new(folder.path().join("r"), 0, 1, &facts(1), &stage_text()).unwrap();
    let open = folder.path().join("r").join(open_segment_name(0));
    std::os::unix::fs::symlink("/dev/full", &open).unwrap();
    let mut record = Record::default();
    record.fill(0, bodies(0).into_iter());
    let error = writer.write(&record).unwrap_err().to_string();
    assert!(error.contains(".steps-0000000000.parquet.tmp: No space left on device"), "{error}");
    assert_eq!(fs::read_dir(folder.path().join("r")).unwrap().count(), 0);
}

#[test]
fn a_run_may_go_on_with_other_ranks_and_more_steps() {
    let folder = folder();
    record(folder.path(), &facts(2), 2, (0..=8).step_by(2), bodies);
    let more = RunFacts { canonical: facts(2).canonical.replace("steps = 100", "steps = 200"), ..facts(2) };
    record(folder.path(), &more, 3, (10..=14).step_by(2), bodies);
    record(folder.path(), &facts(2), 1, (16..=18).step_by(2), bodies);
    let recording = Recording::open(folder.path()).unwrap();
    assert_eq!(recording.steps(), [0, 2, 4, 6, 8, 10, 12, 14, 16, 18]);
    for step in [8, 10, 18] {
        let expected: Vec<Row> = bodies(step).into_iter().map(row).collect();
        assert_eq!(sorted(read(&recording, step)), sorted(expected));
    }
}

#[test]
fn a_step_belongs_to_one_segment_of_each_rank_of_one_run() {
    let twice = recorded();
    record(twice.path(), &facts(5), 2, (55..=65).step_by(5), bodies);
    let told = complaint(twice.path());
    assert!(
        told.contains("rank-00000/steps-0000000050-0000000060.parquet and DIR/rank-00000/steps-0000000055"),
        "{told}"
    );
    assert!(told.contains("both hold step 55"), "{told}");

    let ranks = recorded();
    record(ranks.path(), &facts(5), 3, (60..=65).step_by(5), bodies);
    let told = complaint(ranks.path());
    assert!(told.starts_with("step 60 was recorded by 2 ranks in DIR/rank-00000/steps-0000000050"), "{told}");
    assert!(told.contains("and by 3 in DIR/rank-00000/steps-0000000060"), "{told}");

    let runs = recorded();
    let other = RunFacts { canonical: facts(5).canonical.replace("seed = 7", "seed = 8"), ..facts(5) };
    record(runs.path(), &other, 2, (65..=70).step_by(5), bodies);
    let told = complaint(runs.path());
    assert!(told.contains("are of different runs: scene.seed is 7 in the one and 8 in the other"), "{told}");

    let versions = recorded();
    let other = RunFacts { version: "1.2.4\u{1b}[2J".to_owned(), ..facts(5) };
    record(versions.path(), &other, 2, (65..=70).step_by(5), bodies);
    let told = complaint(versions.path());
    assert!(told.contains("version is 1.2.3 in the one and 1.2.4 [2J in the other"), "{told}");
}

#[test]
fn what_is_missing_is_named() {
    let remove =
        |folder: &TempDir, rank, name: &str| fs::remove_file(rank_folder(folder.path(), rank).join(name)).unwrap();
    let (first, second) = ("steps-0000000000-0000000045.parquet", "steps-0000000050-0000000060.parquet");

    let folder = recorded();
    remove(&folder, 1, first);
    assert!(complaint(folder.path()).starts_with("DIR/rank-00001: the segment that holds step 0 is missing"));
    remove(&folder, 0, first);
    assert!(complaint(folder.path()).starts_with("DIR: the segment that holds step 0 is missing"));

    // The tail of a run that was killed.
    let folder = recorded();
    remove(&folder, 0, second);
    let recording = Recording::open(folder.path()).unwrap();
    assert_eq!((recording.steps().last(), recording.incomplete()), (Some(&45), 3));
    // Of one that ended there.
    let told = |text: &str| fs::write(folder.path().join("summary.json"), text).unwrap();
    told(r#"{"steps": 49, "interrupted": true}"#);
    assert_eq!(Recording::open(folder.path()).unwrap().steps().len(), 10);
    told(r#"{"steps": 50, "interrupted": true}"#);
    assert!(complaint(folder.path()).starts_with("DIR/rank-00000: the segment that holds step 50 is missing"));
    remove(&folder, 1, second);
    assert!(complaint(folder.path()).starts_with("DIR: the segment that holds step 50 is missing"));
    // One that tells nothing.
    for torn in [r#"{"steps": "many\nand"}"#, "{"] {
        told(torn);
        let recording = Recording::open(folder.path()).unwrap();
        assert_eq!((recording.steps().last(), recording.ended()), (Some(&45), None));
    }
}

#[test]
fn what_a_run_goes_on_from_must_be_all_there() {
    let told = |folder: &TempDir, step| {
        let run = OfRun { path: folder.path().join("run.toml"), facts: facts(5), stage: Some(stage_text()) };
        Recording::check_until(folder.path(), run, step).map_err(|error| error.to_string())
    };
    let folder = recorded();
    let path = |rank, name: &str| rank_folder(folder.path(), rank).join(name);
    // Whatever comes after the step is about to be removed.
    fs::write(path(0, "steps-0000000050-0000000060.parquet"), "").unwrap();
    assert_eq!((told(&folder, 45), told(&folder, 49)), (Ok(()), Ok(())));
    assert!(told(&folder, 50).unwrap_err().contains("is damaged, or no segment of a recording"));
    fs::remove_file(path(0, "steps-0000000050-0000000060.parquet")).unwrap();
    assert!(told(&folder, 50).unwrap_err().contains("rank-00000: the segment that holds step 50 is missing"));
    let against = |facts, stage| {
        let run = OfRun { path: folder.path().join("run.toml"), facts, stage };
        Recording::check_until(folder.path(), run, 45).unwrap_err().to_string()
    };
    let error = against(RunFacts { record_every: 3, ..facts(5) }, Some(stage_text()));
    assert!(error.contains("run.toml and ") && error.contains("of different runs"), "{error}");
    let error = against(facts(5), None);
    assert!(error.contains("of different runs: format is 1 in the one and 2 in the other"), "{error}");
    let error = against(facts(5), Some(StageText::new(&stage().0, &[])));
    assert!(error.contains("of different runs: their kinds or statics are not the same"), "{error}");
    let nothing = tempfile::tempdir().unwrap();
    assert!(told(&nothing, 0).unwrap_err().contains("the segment that holds step 0 is missing"));
}

#[test]
fn a_folder_without_a_recording_is_refused() {
    let folder = folder();
    assert!(complaint(&folder.path().join("nowhere")).starts_with("cannot read DIR: No such file"));
    assert!(complaint(folder.path()).starts_with("DIR holds no recording"));
    // Nobody's business.
    for name in ["snapshots", "rank-x", "rank-1", "rank-00000"] {
        fs::create_dir(folder.path().join(name)).unwrap();
        fs::write(folder.path().join(name).join("notes.parquet"), "").unwrap();
        fs::write(folder.path().join(name).join(".steps-0000000000.parquet.tmp"), "").unwrap();
    }
    assert!(complaint(folder.path()).starts_with("DIR holds no recording"));
}

#[test]
fn strange_files_are_refused() {
    let original = folder();
    record(original.path(), &facts(1), 1, 0..2, bodies);
    let name = "rank-00000/steps-0000000000-0000000001.parquet";
    let bytes = fs::read(original.path().join(name)).unwrap();
    let told = |name: &str, bytes: &[u8]| {
        let folder = folder();
        fs::create_dir(folder.path().join(name).parent().unwrap()).unwrap();
        fs::write(folder.path().join(name), bytes).unwrap();
        complaint(folder.path())
    };
    assert!(told(name, b"").starts_with(&format!("DIR/{name} is damaged")));
    assert!(told(name, b"a text about Parquet").starts_with(&format!("DIR/{name} is damaged")));
    let renamed = "rank-00000/steps-0000000000-0000000002.parquet";
    assert!(told(renamed, &bytes).contains("it holds other steps than its name says"));
    assert!(told(&name.replace("00000/", "00001/"), &bytes).contains("it is of rank 0"));
    let swap = |from: &[u8], to: &[u8]| {
        let mut bytes = bytes.clone();
        let places: Vec<_> = (0..bytes.len() - from.len()).filter(|&i| bytes[i..].starts_with(from)).collect();
        places.iter().for_each(|&i| bytes[i..i + from.len()].copy_from_slice(to));
        assert!(!places.is_empty());
        bytes
    };
    assert!(told(name, &swap(b"atoll.ranks", b"other.ranks")).contains("it has no atoll.ranks"));
    assert!(told(name, &swap(b"atoll.format\x18\x012", b"atoll.format\x18\x019")).contains("its format is 9"));
    let told_one = told(name, &swap(b"atoll.format\x18\x012", b"atoll.format\x18\x011"));
    assert!(told_one.contains("it has other columns than its format"), "{told_one}");
    assert!(told(name, &swap(b"\"circle\":1.0", b"\"circle\":0.0")).contains("kind 1 of atoll.kinds has a number"));
    assert!(told(name, &swap(b"[[0,2]]", b"[[0,3]]")).contains("atoll.statics names others than it has"));
    assert!(told(name, &swap(b"0:20:", b"0:21:")).contains("it holds other row groups than it says"));
}

#[test]
fn every_truncation_is_an_error_that_names_the_file() {
    let folder = folder();
    record(folder.path(), &facts(1), 1, 0..3, |step| vec![body(1, step), body(2, step)]);
    let path = rank_folder(folder.path(), 0).join("steps-0000000000-0000000002.parquet");
    let bytes = fs::read(&path).unwrap();
    for length in 0..bytes.len() {
        fs::write(&path, &bytes[..length]).unwrap();
        let error = everything(folder.path()).unwrap_err().to_string();
        assert!(error.contains("steps-0000000000-0000000002.parquet is damaged"), "{length}: {error}");
    }
}

/// A flipped bit of the data is always found. One of the footer may stand where nobody looks, but changes no row.
#[test]
fn flipped_bits_never_change_what_is_read() {
    let folder = folder();
    record(folder.path(), &facts(1), 1, 0..3, |step| vec![body(1, step), body(2, step)]);
    let path = rank_folder(folder.path(), 0).join("steps-0000000000-0000000002.parquet");
    let bytes = fs::read(&path).unwrap();
    let whole = everything(folder.path()).unwrap();
    let footer = bytes.len() - 8 - u32::from_le_bytes(bytes[bytes.len() - 8..][..4].try_into().unwrap()) as usize;
    assert!((500..bytes.len() - 500).contains(&footer));
    for at in 0..bytes.len() {
        let mut flipped = bytes.clone();
        flipped[at] ^= 1 << (at % 8);
        fs::write(&path, &flipped).unwrap();
        match everything(folder.path()) {
            Err(error) => assert!(error.to_string().contains(folder.path().to_str().unwrap()), "{error}"),
            Ok(read) => {
                assert!(at >= footer || at < 4, "a flipped bit of byte {at} went unnoticed");
                assert_eq!(read, whole, "byte {at}");
            }
        }
    }
}

/// A file whose rows say another step than everything else does, checksum and all.
#[test]
fn rows_of_another_step_are_refused() {
    let folder = folder();
    let step: u64 = 0x0102_0304;
    record(folder.path(), &facts(1), 1, step..step + 1, bodies);
    let path = rank_folder(folder.path(), 0).join(segment_name(step, step));
    let mut rows = Vec::new();
    Segment::open(&path).unwrap().read(step, 2, &mut rows).unwrap();
    assert_eq!(rows.len(), 20);

    let mut bytes = fs::read(&path).unwrap();
    let footer = bytes.len() - 8 - u32::from_le_bytes(bytes[bytes.len() - 8..][..4].try_into().unwrap()) as usize;
    let entry = |bytes: &[u8]| format!("{step}:20:{:016x}", xxhash_rust::xxh3::xxh3_64(&bytes[4..footer]));
    let find = |bytes: &[u8], what: &[u8]| bytes.windows(what.len()).position(|part| part == what).unwrap();
    let place = find(&bytes, entry(&bytes).as_bytes());
    let value = find(&bytes, &(step as u32).to_le_bytes());
    assert!(value < footer);
    bytes[value] ^= 1;
    let forged = entry(&bytes);
    bytes[place..place + forged.len()].copy_from_slice(forged.as_bytes());
    fs::write(&path, bytes).unwrap();
    let error = Segment::open(&path).unwrap().read(step, 2, &mut rows).unwrap_err().to_string();
    assert!(error.contains("step 16909060: its rows are of another step"), "{error}");
}

#[test]
fn no_body_takes_less_than_a_byte() {
    // As alike as bodies can be.
    let alike = folder();
    let count = 100_000;
    record(alike.path(), &facts(1), 1, 0..1, |_| vec![body(1, 0); count]);
    assert_eq!(read(&Recording::open(alike.path()).unwrap(), 0).len(), count);

    // In an encoding for which a row is next to nothing.
    let forged = folder();
    let path = rank_folder(forged.path(), 0).join(segment_name(0, 0));
    fs::create_dir(path.parent().unwrap()).unwrap();
    let mut facts = facts(1).to_pairs();
    let more = [("atoll.rank", "0"), ("atoll.ranks", "1"), ("atoll.steps", "0:100000:0123456789abcdef")];
    facts.extend(more.map(|(key, text)| (key.to_owned(), text.to_owned())));
    facts.extend(
        [("atoll.kinds", "[]"), ("atoll.statics", r#"{"kinds":[],"ids":[],"kind":[],"x":[],"y":[]}"#)]
            .map(|(key, text)| (key.to_owned(), text.to_owned())),
    );
    let facts = facts.into_iter().map(|(key, text)| KeyValue::new(key, text)).collect();
    let mut properties = WriterProperties::builder().set_key_value_metadata(Some(facts));
    for column in layout::schema(Format::WithStage).get_fields() {
        let column = ColumnPath::from(column.name());
        properties = properties.set_column_compression(column.clone(), layout::compression(&column));
    }
    let properties = Arc::new(properties.build());
    let mut file =
        SerializedFileWriter::new(fs::File::create(&path).unwrap(), layout::schema(Format::WithStage), properties)
            .unwrap();
    let mut group = file.next_row_group().unwrap();
    while let Some(mut column) = group.next_column().unwrap() {
        match column.untyped() {
            ColumnWriter::Int32ColumnWriter(column) => column.write_batch(&vec![0; count], None, None),
            ColumnWriter::Int64ColumnWriter(column) => column.write_batch(&vec![0; count], None, None),
            ColumnWriter::FloatColumnWriter(column) => column.write_batch(&vec![0.0; count], None, None),
            ColumnWriter::DoubleColumnWriter(column) => column.write_batch(&vec![0.0; count], None, None),
            _ => unreachable!("no other types are in the schema"),
        }
        .unwrap();
        column.close().unwrap();
    }
    group.close().unwrap();
    file.close().unwrap();
    let told = complaint(forged.path());
    assert!(told.contains("it has more rows than they have bytes"), "{told}");
}

#[test]
fn bodies_of_kinds_that_are_not_there_are_refused() {
    let folder = folder();
    record(folder.path(), &facts(1), 1, 0..1, |step| {
        let mut bodies = bodies(step);
        bodies[7].kind.0 = 2;
        bodies
    });
    let id = bodies(0)[7].id;
    let told = complaint(folder.path());
    assert!(told.contains(&format!("step 0: body {id} is of kind 2, and there are 2")), "{told}");
}

#[test]
fn kinds_take_next_to_nothing() {
    let size = |kind: fn(u64) -> u32| {
        let folder = folder();
        let of_kinds = |step| (0..100_000).map(move |id| Body { kind: atoll_core::KindId(kind(id)), ..body(id, step) });
        record(folder.path(), &facts(1), 1, 0..1, |step| of_kinds(step).collect());
        fs::metadata(rank_folder(folder.path(), 0).join(segment_name(0, 0))).unwrap().len()
    };
    let alike = size(|_| 1);
    // A bit each, in no order that helps.
    let mixed = size(|id| (id.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 63) as u32);
    assert!((12_000..13_500).contains(&(mixed - alike)), "{mixed} and {alike} bytes");
}

/// What the program wrote before it wrote kinds and statics.
#[test]
fn recordings_of_the_first_format_are_still_read() {
    let run = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/recording-format-1");
    let recording = Recording::open(&run).unwrap();
    assert_eq!((recording.steps(), recording.stage()), (&[0, 10, 20][..], None));
    let rows = sorted(read(&recording, 20));
    assert_eq!((rows.len(), rows[0].id, rows[11].id), (12, 3, 14));
    assert!(rows.iter().all(|row| row.kind == 0 && row.y > 0.0 && row.vy.is_finite()));
}
