//! Snapshots against whatever may become of their files.

use super::*;
use crate::Config;
use crate::plan::Plan;
use atoll_core::{Hashes, TileId, World};
use std::fs;
use tempfile::{TempDir, tempdir};

/// Four tiles with few bodies.
fn plan(overrides: &[(&str, &str)]) -> Plan {
    let text = "[scene]\nkind = \"pile\"\nbodies = 12\n[run]\ntiles = [2, 2]\nsteps = 9\n";
    Plan::new(&Config::from_toml_str("test", text, overrides).unwrap()).unwrap()
}

/// A world of some of the tiles, with its bodies.
fn world(plan: &Plan, tiles: &[u32]) -> World {
    let tiles: Vec<TileId> = tiles.iter().map(|&tile| TileId(tile)).collect();
    let mut world = World::new(&plan.blueprint, &tiles).unwrap();
    for body in plan.scene.iter().map(Result::unwrap) {
        world.add(body).unwrap();
    }
    world
}

fn identity(plan: &Plan) -> String {
    plan.config.identity(plan.tiles)
}

/// Writes what two ranks have to save after a step.
fn write(plan: &Plan, snapshots: &Path, step: u64) -> Hashes {
    let mut hashes = Hashes::default();
    for (rank, tiles) in [(0, [0, 3]), (1, [1, 2])] {
        let (world, mut blocks) = (world(plan, &tiles), Vec::new());
        let saved = world.save(&mut blocks);
        SnapshotWriter::new(rank, 2, plan.tiles, identity(plan))
            .write(snapshots, step, (None, None), &saved, &blocks)
            .unwrap();
        hashes = hashes.merge(world.hashes());
    }
    hashes
}

/// A folder with the snapshots of two steps.
fn two(plan: &Plan) -> (TempDir, Hashes) {
    let folder = tempdir().unwrap();
    write(plan, folder.path(), 4);
    let hashes = write(plan, folder.path(), 8);
    (folder, hashes)
}

fn file(folder: &TempDir, step: u64, rank: u32) -> PathBuf {
    folder.path().join(store::folder_name(step)).join(store::file_name(rank, 2))
}

/// Goes on from the newest snapshot that can be restored, on one rank, and says from which step; or what is wrong.
fn go_on(plan: &Plan, folder: &TempDir, expected: Hashes) -> Result<(u64, Vec<String>), SnapshotError> {
    let found = find(folder.path(), &identity(plan), plan.tiles)?;
    let mut passed_over: Vec<String> = found.unusable.iter().map(ToString::to_string).collect();
    for snapshot in &found.snapshots {
        let mut world = World::new(&plan.blueprint, &[0, 1, 2, 3].map(TileId)).unwrap();
        match snapshot.restore(&mut world) {
            Ok(()) => {
                assert_eq!((world.hashes(), world.step_count()), (expected, snapshot.step()));
                assert_eq!(snapshot.hashes(), expected);
                return Ok((snapshot.step(), passed_over));
            }
            Err(error) => passed_over.push(error.to_string()),
        }
    }
    panic!("the older one is whole: {passed_over:?}")
}

#[test]
fn the_newest_is_used() {
    let plan = plan(&[]);
    let (folder, hashes) = two(&plan);
    assert_eq!(go_on(&plan, &folder, hashes).unwrap(), (8, vec![]));
    let found = find(folder.path(), &identity(&plan), plan.tiles).unwrap();
    assert_eq!(found.snapshots[0].weights().iter().sum::<u64>(), 12);
    found.snapshots[0].check().unwrap();
}

#[test]
fn no_changed_byte_goes_unnoticed() {
    let plan = plan(&[]);
    let (folder, hashes) = two(&plan);
    let path = file(&folder, 8, 1);
    let bytes = fs::read(&path).unwrap();
    let name = path.display().to_string();
    let check = |bytes: &[u8], what: String| {
        fs::write(&path, bytes).unwrap();
        let (step, passed_over) = go_on(&plan, &folder, hashes).unwrap();
        assert_eq!((step, passed_over.len()), (4, 1), "{what}: {passed_over:?}");
        assert!(passed_over[0].starts_with(&name), "{what}: {passed_over:?}");
        let found = find(folder.path(), &identity(&plan), plan.tiles).unwrap();
        assert!(found.unusable.len() == 1 || found.snapshots[0].check().is_err(), "{what}");
    };
    for place in 0..bytes.len() {
        let mut changed = bytes.clone();
        changed[place] ^= 1 << (place % 8);
        check(&changed, format!("byte {place}"));
    }
    for length in 0..bytes.len() {
        check(&bytes[..length], format!("cut off at {length}"));
    }
    check(&[&bytes[..], &[0]].concat(), "a byte too many".to_owned());
    fs::write(&path, &bytes).unwrap();
    assert_eq!(go_on(&plan, &folder, hashes).unwrap(), (8, vec![]));
}

#[test]
fn files_of_two_snapshots_are_none() {
    let plan = plan(&[]);
    let (folder, hashes) = two(&plan);
    fs::copy(file(&folder, 4, 1), file(&folder, 8, 1)).unwrap();
    let (step, passed_over) = go_on(&plan, &folder, hashes).unwrap();
    assert!(step == 4 && passed_over[0].ends_with("it belongs to another snapshot"), "{passed_over:?}");
    fs::copy(file(&folder, 8, 0), file(&folder, 8, 1)).unwrap();
    let (step, passed_over) = go_on(&plan, &folder, hashes).unwrap();
    assert!(step == 4 && passed_over[0].ends_with("it belongs to another snapshot"), "{passed_over:?}");
}

#[test]
fn what_was_not_complete_is_passed_over_and_what_is_all_damaged_is_told() {
    let plan = plan(&[]);
    let (folder, hashes) = two(&plan);
    fs::remove_file(file(&folder, 8, 0)).unwrap();
    assert_eq!(go_on(&plan, &folder, hashes).unwrap(), (4, vec![]));
    fs::write(file(&folder, 4, 0), "not what was written").unwrap();
    let error = go_on(&plan, &folder, hashes).unwrap_err().to_string();
    assert!(
        error.contains(&file(&folder, 4, 0).display().to_string()) && error.contains("no other snapshot"),
        "{error}"
    );
    fs::remove_file(file(&folder, 4, 0)).unwrap();
    assert!(find(folder.path(), &identity(&plan), plan.tiles).unwrap().snapshots.is_empty());
    assert!(find(&folder.path().join("none"), &identity(&plan), plan.tiles).unwrap().snapshots.is_empty());
}

#[test]
fn another_configuration_is_refused_by_the_key_that_differs() {
    let (folder, hashes) = two(&plan(&[]));
    for (key, full, values) in [
        ("seed", "scene.seed", ["1", "2"]),
        ("contact_hertz", "physics.contact_hertz", ["30.0", "25.0"]),
        ("bodies", "scene.bodies", ["12", "13"]),
        ("record_every", "output.record_every", ["nothing", "2"]),
    ] {
        let error = go_on(&plan(&[(key, values[1])]), &folder, hashes).unwrap_err().to_string();
        let expected = format!("{full} = {} in this snapshot, and {} in the configuration", values[0], values[1]);
        assert!(error.contains(&expected), "{error}");
    }
    // How it is spread is no part of that, nor how long it is to last.
    for other in [("ranks", "3"), ("steps", "20"), ("islands", "dfs"), ("checkpoint_every", "2")] {
        assert_eq!(go_on(&plan(&[other]), &folder, hashes).unwrap().0, 8, "{other:?}");
    }
}

#[test]
fn another_version_is_refused_and_no_damage() {
    let plan = plan(&[]);
    let (folder, hashes) = two(&plan);
    let path = file(&folder, 8, 0);
    let bytes = fs::read(&path).unwrap();
    // As another version would have written it, with the right checksum.
    for (from, to, expected) in [
        (env!("CARGO_PKG_VERSION"), "9.9.9", "program version = 9.9.9 in this snapshot"),
        ("\"format\":2", "\"format\":7", "snapshot format = 7 in this snapshot, and 2 in this program"),
    ] {
        file::tests::rewrite_facts(&path, &bytes, |facts| facts.replacen(from, to, 1));
        let error = go_on(&plan, &folder, hashes).unwrap_err();
        assert!(!error.is_damage() && error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn an_index_that_was_forged_with_its_checksum_is_no_use() {
    let plan = plan(&[]);
    let (folder, hashes) = two(&plan);
    let forge = |from: &str, to: &str| {
        for rank in [0, 1] {
            let path = file(&folder, 8, rank);
            let bytes = fs::read(&path).unwrap();
            file::tests::rewrite_facts(&path, &bytes, |facts| facts.replace(from, to));
        }
    };
    forge("[2,2]", "[4294967295,4294967295]");
    let (step, passed_over) = go_on(&plan, &folder, hashes).unwrap();
    assert!(step == 4 && passed_over[0].ends_with("not those of its grid"), "{passed_over:?}");
    // As many tiles, and not those of the run.
    forge("[4294967295,4294967295]", "[4,1]");
    let (step, passed_over) = go_on(&plan, &folder, hashes).unwrap();
    assert!(step == 4 && passed_over[0].ends_with("it is of 4 x 1 tiles"), "{passed_over:?}");
    // Wherever it lies, it is a snapshot; but not that of another step.
    let elsewhere = folder.path().join("copy");
    fs::rename(folder.path().join(store::folder_name(4)), &elsewhere).unwrap();
    Snapshot::open(&elsewhere).unwrap().unwrap().check().unwrap();
    fs::rename(elsewhere, folder.path().join(store::folder_name(6))).unwrap();
    let error = find(folder.path(), &identity(&plan), plan.tiles).unwrap_err().to_string();
    assert!(error.contains("no other snapshot is whole"), "{error}");
}

#[test]
fn nobody_wants_what_is_older_than_a_whole_one() {
    let plan = plan(&[]);
    let (folder, hashes) = two(&plan);
    let old = folder.path().join(store::folder_name(4));
    fs::remove_dir_all(&old).unwrap();
    fs::write(&old, "no folder, which is no damage").unwrap();
    let (step, passed_over) = go_on(&plan, &folder, hashes).unwrap();
    assert!(step == 8 && passed_over[0].starts_with(&old.display().to_string()), "{passed_over:?}");
    fs::remove_dir_all(folder.path().join(store::folder_name(8))).unwrap();
    assert!(!go_on(&plan, &folder, hashes).unwrap_err().is_damage());
}

#[test]
fn snapshots_are_removed_by_step() {
    let plan = plan(&[]);
    let folder = tempdir().unwrap();
    for step in [2, 4, 6, 8] {
        write(&plan, folder.path(), step);
    }
    fs::create_dir(folder.path().join("mine")).unwrap();
    let steps = || {
        let found = find(folder.path(), &identity(&plan), plan.tiles).unwrap();
        found.snapshots.iter().map(Snapshot::step).collect::<Vec<_>>()
    };
    remove_before(folder.path(), 4).unwrap();
    assert_eq!(steps(), [8, 6, 4]);
    remove_after(folder.path(), Some(6)).unwrap();
    assert_eq!(steps(), [6, 4]);
    remove_after(folder.path(), None).unwrap();
    assert!(steps().is_empty());
    assert!(folder.path().join("mine").exists());
}
