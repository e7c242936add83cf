//! What `atoll diff` writes and refuses. What it finds in recordings is in `recording.rs`.

use atoll_tests::program::{self, diff};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::{TempDir, tempdir};

/// Records a small run to a folder of that name.
fn record(folder: &TempDir, name: &str, options: &[&str]) -> PathBuf {
    let path = folder.path().join(name);
    let mut command = program::command();
    command.args(["run", "configs/quickstart.toml", "--quiet", "--bodies", "1000", "--steps", "60", "--tiles", "3x2"]);
    let ended = program::run(command.args(["--record-every", "4"]).args(options).arg("--out").arg(&path));
    assert_eq!(ended.code, Some(0), "{ended}");
    path
}

#[test]
fn what_differs_is_told_and_written() {
    let folder = tempdir().unwrap();
    let (fine, coarse) = (record(&folder, "fine", &[]), record(&folder, "coarse", &["--set", "substeps=3"]));
    let (json, plot) = (folder.path().join("d.json"), folder.path().join("d.svg"));
    let files = ["--json", json.to_str().unwrap(), "--plot", plot.to_str().unwrap()];
    let ended = diff(&fine, &coarse, &files);
    assert_eq!(ended.code, Some(1), "{ended}");
    let lines: Vec<&str> = ended.stdout.lines().collect();
    assert!(lines[0].starts_with("the configurations differ: physics.substeps is 4 in"), "{ended}");
    assert!(lines[1].starts_with("differ: 16 records of 1000 bodies, steps 0 to 60, 15 of them not"), "{ended}");
    assert!(lines[2].starts_with("first difference: step 4, body "), "{ended}");
    let told: Value = serde_json::from_slice(&fs::read(json).unwrap()).unwrap();
    assert_eq!(
        (&told["same"], &told["steps"][1]["step"], &told["first_difference"]["step"]),
        (&false.into(), &4.into(), &4.into())
    );
    assert!(told["steps"][15]["position"]["max"].as_f64().unwrap() > 0.0);
    assert!(fs::read_to_string(plot).unwrap().starts_with("<svg"));
    let ended = diff(&fine, &coarse, &["--tolerance", "1e9"]);
    assert_eq!(ended.code, Some(0), "{ended}");
}

#[test]
fn what_keeps_it_from_an_answer_is_told_in_one_line() {
    let folder = tempdir().unwrap();
    let run = record(&folder, "run", &[]);
    let refused = |a: &Path, options: &[&str], expected: &str| {
        let ended = diff(a, &run, options);
        let complaints = ended.complaints();
        assert!(
            ended.code == Some(2) && complaints.len() == 1 && complaints[0].contains(expected),
            "{expected}: {ended}"
        );
    };
    refused(&folder.path().join("nowhere"), &[], "nowhere: No such file or directory");
    refused(folder.path(), &[], "holds no recording");
    refused(&run, &["--tolerance", "-1"], "must be a finite number, at least 0");
    refused(&run, &["--json", "/nowhere/d.json"], "--json /nowhere/d.json: No such file or directory");
    refused(&run, &["--json", "same", "--plot", "same"], "--plot same: --json writes to the same file");
}
