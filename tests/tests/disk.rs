//! A disk that is full, or read-only: a clear error, nothing half-written under a final name, and once there is room the run
//! goes on to where it would have come to.

#![cfg(target_os = "linux")]

use atoll_tests::program::{self, Ended};
use atoll_tests::ways::Way;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;
use tempfile::tempdir;

/// Runs a script of the shell in a mount namespace of its own, with the program as `$ATOLL`, a folder for a small file
/// system as `$DISK` and one that stays as `$KEPT`. None where the system allows no such thing.
fn with_disk(folder: &Path, script: &str) -> Option<Ended> {
    let (disk, kept) = (folder.join("disk"), folder.join("kept"));
    fs::create_dir_all(&disk).unwrap();
    fs::create_dir_all(&kept).unwrap();
    // Root may mount; others in a namespace where they are root, if the system lets them have one.
    let can_mount = |namespace: &&str| {
        let mut probe = Command::new("unshare");
        probe.args([namespace, "mount", "-t", "tmpfs", "none"]).arg(&disk);
        probe.output().is_ok_and(|output| output.status.success())
    };
    let Some(namespace) = ["-m", "-rm"].into_iter().find(can_mount) else {
        eprintln!("not checked: no file system can be mounted here");
        return None;
    };
    let mut command = Command::new("unshare");
    command.args([namespace, "sh", "-c", script]).env("DISK", &disk).env("KEPT", &kept);
    command.env("ATOLL", program::atoll(program::Profile::CURRENT));
    Some(program::run(program::at_home(&mut command)))
}

fn files(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        if entry.file_type().unwrap().is_dir() {
            names.extend(files(&entry.path()));
        } else {
            names.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    names
}

#[test]
fn a_full_disk_ends_the_run_cleanly() {
    let folder = tempdir().unwrap();
    // 20,000 bodies: about half a megabyte a record, two and a half a snapshot.
    let run = "run configs/quickstart.toml --quiet --steps 200 --ranks 3";
    for (name, options) in [
        ("recording", "--record-every 5 --checkpoint-every 20"),
        ("snapshots", "--checkpoint-every 10"),
        ("a snapshot each step", "--checkpoint-every 1"),
    ] {
        let whole = folder.path().join("whole.json");
        let expected = program::run_to_summary(
            Way::Channel.command(3, "configs/quickstart.toml").args(["--quiet", "--steps", "200"]),
            &whole,
        );
        let script = format!(
            "mount -t tmpfs -o size=6m none $DISK || exit 99
             $ATOLL {run} {options} --out $DISK/run
             echo \"first: $?\"
             cp -r $DISK/run $KEPT/full
             mount -o remount,size=64m $DISK
             $ATOLL run --resume $DISK/run --ranks 2 --quiet
             echo \"second: $?\"
             cp -r $DISK/run $KEPT/done"
        );
        let Some(ended) = with_disk(folder.path(), &script) else { return };
        assert!(ended.stdout.contains("first: 5") && ended.stdout.contains("second: 0"), "{name}: {ended}");
        let complaint = ended.complaints()[0];
        let is_clear = complaint.contains("cannot write") && complaint.contains("No space left on device");
        assert!(is_clear && complaint.contains("atoll run --resume"), "{name}: {ended}");

        // What has its final name is whole, and nothing else is left.
        let (full, done) = (folder.path().join("kept/full"), folder.path().join("kept/done"));
        assert!(files(&full).iter().all(|name| !name.ends_with(".tmp")), "{name}: {:?}", files(&full));
        // Two snapshots fit, so one of them is whole, and was gone on from.
        assert!(ended.stderr.contains("going on with"), "{name}: {ended}");
        if name == "recording" {
            // Which rank's records were the last to fit is chance: what some ranks have not is left out, and said.
            let ended = program::diff(&full, &full, &[]);
            let left_out = ended.stdout.contains("are held by some ranks only, and left out");
            assert_eq!(ended.code, Some(i32::from(left_out)), "{ended}");
        }
        let text = fs::read_to_string(done.join("summary.json")).unwrap();
        let end: Value = serde_json::from_str(&text).unwrap();
        for key in ["state_hash", "contact_hash", "steps"] {
            assert_eq!(end[key], expected[key], "{name}: {key}");
        }
        fs::remove_dir_all(folder.path().join("kept")).unwrap();
    }
}

/// Rows are whole or not there, and a run that nobody could see to the end of stops.
#[test]
fn a_full_disk_ends_a_run_that_is_only_logged() {
    let folder = tempdir().unwrap();
    let script = "mount -t tmpfs -o size=12k none $DISK || exit 99
                  $ATOLL run configs/quickstart.toml --quiet --bodies 500 --steps 4000 --ranks 2 --log $DISK/log.csv --log-every 1
                  echo \"ended: $?\"
                  cp $DISK/log.csv $KEPT/log.csv";
    let Some(ended) = with_disk(folder.path(), script) else { return };
    assert!(ended.stdout.contains("ended: 5") && ended.complaints().len() == 1, "{ended}");
    let complaint = ended.complaints()[0];
    assert!(complaint.contains("log.csv: No space left on device") && complaint.contains("of 4000 steps"), "{ended}");
    let text = fs::read_to_string(folder.path().join("kept/log.csv")).unwrap();
    let fields = |line: &str| line.split(',').count();
    let whole = text.ends_with('\n') && text.lines().all(|line| fields(line) == fields(text.lines().next().unwrap()));
    assert!(whole && text.lines().count() > 5, "{text}");
}

#[test]
fn a_folder_that_cannot_be_written_is_refused_at_once() {
    let folder = tempdir().unwrap();
    for (options, code, expected) in
        [("-o ro", 2, "Read-only file system"), ("-o size=4k,nr_inodes=2", 5, "No space left on device")]
    {
        let script = format!(
            "mount -t tmpfs {options} none $DISK || exit 99
             $ATOLL run configs/quickstart.toml --record-every 5 --out $DISK/run"
        );
        let Some(ended) = with_disk(folder.path(), &script) else { return };
        assert_eq!((ended.code, ended.complaints().len()), (Some(code), 1), "{ended}");
        assert!(ended.stderr.contains(expected) && ended.stderr.contains("--out "), "{ended}");
        assert!(!ended.stdout.contains("state hash"), "{ended}");
    }
}

#[test]
fn an_export_that_does_not_fit_leaves_nothing() {
    let folder = tempdir().unwrap();
    let script = "mount -t tmpfs -o size=2m none $DISK || exit 99
         $ATOLL run configs/quickstart.toml --quiet --steps 4 --bodies 4000 --ranks 2 --record-every 2 --out $KEPT/run || exit 98
         $ATOLL export $KEPT/run --vtk $DISK/out
         echo \"export: $?\"
         find $DISK -mindepth 1";
    let Some(ended) = with_disk(folder.path(), script) else { return };
    assert_eq!((ended.code, ended.complaints().len()), (Some(0), 1), "{ended}");
    assert!(ended.stdout.ends_with("export: 5\n"), "something is left: {ended}");
    let complaint = ended.complaints()[0];
    assert!(complaint.contains("cannot write ") && complaint.contains(".vtu: No space left on device"), "{ended}");
}
