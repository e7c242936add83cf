//! The reported experiment at its full size, in the program as it is meant to be used.

use atoll_tests::program::{self, Profile};

/// Few contacts of NORMAL are between tiles: below 3 % on the grid of 12 x 12 tiles that the report has. After 20
/// steps bodies have long left the lattice they start on.
#[test]
fn few_contacts_of_the_reported_experiment_cross_borders() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = program::command_of(Profile::Release);
    command.args(["run", "configs/normal.toml", "--quiet", "--tiles", "12x12", "--steps", "20"]);
    let json = program::run_to_summary(&mut command, &folder.path().join("summary.json"));
    assert_eq!((&json["bodies"], &json["bodies_lost"], &json["escaped"]), (&700_000.into(), &0.into(), &0.into()));
    let share = json["border_contact_fraction"].as_f64().unwrap();
    println!("{} contacts, {:.2} % of them across tiles", json["contacts"], 100.0 * share);
    assert!(json["contacts"].as_u64().unwrap() > 50_000, "too few contacts to tell: {json:#}");
    assert!(share > 0.0 && share < 0.03, "{share} of all contacts are between tiles");
}
