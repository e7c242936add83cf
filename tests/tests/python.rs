//! The examples in Python of `docs/recordings.md`, run as they stand on a recording of three ranks: what they print is what
//! the program itself tells of that run; and the files of `atoll export`, read by VTK itself.
//!
//! Needs an interpreter with polars, pandas, pyarrow, DuckDB and VTK: the one that `ATOLL_PYTHON` names, else `python3`.

use atoll::recording::{Recording, Row};
use atoll_tests::program::{self, root};
use serde_json::Value;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::Path;
use std::process::Command;
use tempfile::tempdir;

/// Fails where one of the packages is missing.
const PROBE: &str = "
from importlib.util import find_spec
assert all(map(find_spec, ['tomllib', 'polars', 'pandas', 'pyarrow', 'duckdb', 'vtk']))";

const BODIES: usize = 2000;

/// A Python that has what the examples need. One that was named must have it.
fn python() -> Option<OsString> {
    let named = std::env::var_os("ATOLL_PYTHON").filter(|name| !name.is_empty());
    let python = named.clone().unwrap_or_else(|| "python3".into());
    match Command::new(&python).args(["-c", PROBE]).output() {
        Ok(output) if output.status.success() => Some(python),
        failed if named.is_some() => panic!("ATOLL_PYTHON, {python:?}, lacks what the examples need: {failed:?}"),
        _ => None,
    }
}

/// What the one example with this line prints, started in the folder `place`.
fn printed(page: &str, line: &str, python: &OsStr, place: &Path) -> String {
    let examples = page.split("\n```python\n").skip(1).filter_map(|rest| rest.split("\n```").next());
    let [example] = examples.filter(|example| example.lines().any(|is| is == line)).collect::<Vec<_>>()[..] else {
        panic!("not one example with the line {line:?}");
    };
    let mut command = Command::new(python);
    // Tables have lines that are not ASCII.
    let ended = program::run(command.args(["-c", example]).current_dir(place).env("PYTHONUTF8", "1"));
    assert_eq!((ended.code, ended.complaints().len()), (Some(0), 0), "{example}\n{ended}");
    ended.stdout
}

/// The rows of a printed table with so many columns of numbers.
fn rows<const COLUMNS: usize>(table: &str) -> Vec<[f64; COLUMNS]> {
    let numbers = |line: &str| line.split_whitespace().filter_map(|cell| cell.parse().ok()).collect::<Vec<f64>>();
    table.lines().filter_map(|line| numbers(line).try_into().ok()).collect()
}

fn assert_close(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() <= 1e-6 * expected.abs().max(1.0), "{what}: {found}, and not {expected}");
}

fn speed(row: &Row) -> f64 {
    f64::from(row.vx).hypot(row.vy.into())
}

/// Mean energy per mass of each step; the first rows and the last ones are shown.
fn check_polars(text: &str, records: &[(u64, Vec<Row>)], summary: &Value) {
    assert!(text.contains(&format!("shape: ({}, 3)", records.len())), "{text}");
    let rows = rows::<3>(text);
    assert!(rows.len() >= 4 && rows.iter().all(|row| row[1] == BODIES as f64), "{text}");
    let [step, _, half_v2] = rows[rows.len() - 1];
    assert_eq!(Some(step), summary["steps"].as_f64(), "{text}");
    assert_close(half_v2, summary["mean_half_v2"].as_f64().unwrap(), "mean v^2/2");
}

/// All records of one body.
fn check_pandas(text: &str, records: &[(u64, Vec<Row>)]) {
    let rows = rows::<9>(text);
    assert_eq!(rows.len(), records.len(), "{text}");
    for ([step, id, state @ ..], (expected_step, record)) in rows.into_iter().zip(records) {
        assert_eq!((step, id), (*expected_step as f64, 1000.0), "{text}");
        let body = record.iter().find(|row| row.id == 1000).unwrap();
        let rest = [body.angle, body.vx, body.vy, body.omega, body.kind as f32].map(f64::from);
        for (found, expected) in state.into_iter().zip([body.x, body.y].into_iter().chain(rest)) {
            assert_close(found, expected, text);
        }
    }
}

/// The fastest body of each step.
fn check_duckdb(text: &str, records: &[(u64, Vec<Row>)]) {
    let rows = rows::<4>(text);
    assert_eq!(rows.len(), records.len(), "{text}");
    for ([step, bodies, most, fastest], (expected_step, record)) in rows.into_iter().zip(records) {
        assert_eq!((step, bodies), (*expected_step as f64, BODIES as f64), "{text}");
        assert_close(most, record.iter().map(speed).fold(0.0, f64::max), text);
        // Of several that are, any.
        assert_close(speed(record.iter().find(|row| row.id as f64 == fastest).unwrap()), most, text);
    }
}

/// What run it is.
fn check_metadata(text: &str, records: &[(u64, Vec<Row>)]) {
    let [scene, domain, every] = text.lines().collect::<Vec<_>>()[..] else { panic!("{text}") };
    assert_eq!(scene, format!("scene rooms with {BODIES} bodies"));
    assert_eq!(every, format!("a record every {:?} s", 5.0 / 60.0));
    let corners: Vec<f64> = domain.split(' ').filter_map(|number| number.parse().ok()).collect();
    let [x0, y0, x1, y1] = corners[..] else { panic!("{text}") };
    let mut bodies = records.iter().flat_map(|(_, record)| record);
    assert!(bodies.all(|row| (x0..x1).contains(&row.x) && (y0..y1).contains(&row.y)), "{text}");
}

#[test]
fn examples_print_what_the_program_tells() {
    let Some(python) = python() else {
        eprintln!("not checked: python3 lacks polars, pandas, pyarrow, duckdb or vtk, and ATOLL_PYTHON names no other");
        return;
    };
    let folder = tempdir().unwrap();
    let run = folder.path().join("runs/quickstart");
    let mut command = program::command();
    command.args(["run", "configs/quickstart.toml", "--quiet", "--steps", "60", "--bodies", &BODIES.to_string()]);
    command.args(["--ranks", "3", "--record-every", "5", "--checkpoint-every", "40", "--out"]).arg(&run);
    let summary = program::run_to_summary(&mut command, &folder.path().join("summary.json"));

    let trajectory = Recording::open(&run).unwrap();
    let mut records = Vec::new();
    for &step in trajectory.steps() {
        let mut rows = Vec::new();
        trajectory.read(step, &mut rows).unwrap();
        records.push((step, rows));
    }
    assert_eq!(records.len(), 13);

    let page = fs::read_to_string(root().join("docs/recordings.md")).unwrap();
    let printed = |line| printed(&page, line, &python, folder.path());
    check_polars(&printed("import polars as pl"), &records, &summary);
    check_pandas(&printed("import pandas as pd"), &records);
    check_duckdb(&printed("import duckdb"), &records);
    check_metadata(&printed("import pyarrow.parquet"), &records);
    assert_eq!(page.matches("```python").count(), 4, "another example is not checked");
}

#[test]
fn vtk_reads_what_was_recorded() {
    let Some(python) = python() else { return };
    let folder = tempdir().unwrap();
    let (run, out) = (folder.path().join("run"), folder.path().join("out"));
    let mut command = program::command();
    command.args(["run", "configs/quickstart.toml", "--quiet", "--steps", "20", "--bodies", "1000"]);
    command.args(["--ranks", "3", "--record-every", "5", "--out"]).arg(&run);
    assert_eq!(program::run(&mut command).code, Some(0));
    let mut command = program::command();
    let ended = program::run(command.arg("export").arg(&run).args(["--every", "10", "--vtk"]).arg(&out));
    assert_eq!((ended.code, ended.complaints().len()), (Some(0), 0), "{ended}");
    assert!(ended.stdout.starts_with("3 records of 1000 bodies, steps 0 to 20, and 16 statics, "), "{ended}");

    let mut command = Command::new(&python);
    command.arg(root().join("tests/read_vtk.py")).args([&run, &out]).args(["0", "10", "20"]);
    let ended = program::run(&mut command);
    let step = |step| format!("step {step} bodies 1000 ranks 3\n");
    let expected = [0, 10, 20].map(step).concat() + "statics 16\n";
    assert_eq!((ended.code, ended.stdout.as_str()), (Some(0), expected.as_str()), "{ended}");
}
