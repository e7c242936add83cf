use super::*;
use crate::folder::recording::RunFacts;
use crate::folder::recording::testing::{bodies, body, facts, record};
use atoll_core::Partition;
use atoll_core::{Body, GlobalId, Rot};
use std::f64::consts::PI;
use std::fs;
use tempfile::TempDir;

/// A run of two ranks that recorded steps 0, 5, ..., with one body or another changed.
fn run(steps: u64, change: impl Fn(u64, &mut Vec<Body>)) -> TempDir {
    run_of(2, &facts(5), (0..=steps).step_by(5), change)
}

fn run_of(
    ranks: u32,
    facts: &RunFacts,
    steps: impl Iterator<Item = u64> + Clone,
    change: impl Fn(u64, &mut Vec<Body>),
) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path(), facts, ranks, steps.clone(), |step| {
        let mut bodies = bodies(step);
        change(step, &mut bodies);
        bodies
    });
    end(&folder, steps.last().unwrap(), ["00", "00"]);
    folder
}

/// Writes the summary of a run.
fn end(folder: &TempDir, steps: u64, [state, contact]: [&str; 2]) {
    let hashes = format!(r#""state_hash": "{state}", "contact_hash": "{contact}""#);
    let summary = format!(r#"{{"steps": {steps}, "interrupted": false, {hashes}}}"#);
    fs::write(folder.path().join("summary.json"), summary).unwrap();
}

/// Removes it, as if the run had been killed.
fn kill(folder: &TempDir) {
    fs::remove_file(folder.path().join("summary.json")).unwrap();
}

fn unchanged(_: u64, _: &mut Vec<Body>) {}

fn with_id(bodies: &mut [Body], id: u64) -> &mut Body {
    bodies.iter_mut().find(|body| body.id.0 == id).unwrap()
}

fn compared(a: &TempDir, b: &TempDir, tolerance: Option<f64>) -> Comparison {
    compare(a.path(), b.path(), tolerance, |_, _| {}).unwrap()
}

/// As people read it, with short names for the folders.
fn told(a: &TempDir, b: &TempDir, comparison: &Comparison) -> String {
    let name = |folder: &TempDir| folder.path().to_str().unwrap().to_owned();
    comparison.to_string().replace(&name(a), "A").replace(&name(b), "B")
}

#[test]
fn the_same_bits_are_identical_on_whatever_ranks() {
    let (a, b) = (run(60, unchanged), run_of(3, &facts(5), (0..=60).step_by(5), unchanged));
    let mut progress = Vec::new();
    let comparison = compare(a.path(), b.path(), None, |done, of| progress.push((done, of))).unwrap();
    assert!(comparison.identical && comparison.same);
    assert_eq!(told(&a, &b, &comparison), "identical: 13 records of 20 bodies, steps 0 to 60\n");
    assert_eq!(progress, (1..=13).map(|done| (done, 13)).collect::<Vec<_>>());
    let one = run(0, unchanged);
    assert_eq!(told(&one, &one, &compared(&one, &one, None)), "identical: 1 record of 20 bodies, steps 0 to 0\n");
}

#[test]
fn the_last_bit_of_one_body_at_one_step_is_found() {
    let a = run(60, unchanged);
    let b = run(60, |step, bodies| {
        if step == 35 {
            let body = with_id(bodies, 111);
            body.velocity.x = body.velocity.x.next_up();
        }
    });
    let comparison = compared(&a, &b, None);
    assert!(!comparison.same && !comparison.identical);
    let first = comparison.first_difference.as_ref().unwrap();
    assert_eq!((first.step, first.id, first.columns.as_slice(), first.times), (35, 111, &["vx"][..], [1, 1]));
    let (was, state) = (body(111, 35), first.a.unwrap());
    assert_eq!((state.x, state.vx, first.b.unwrap().vx), (was.position.x, was.velocity.x, was.velocity.x.next_up()));
    let partition = Partition::uniform(DVec2::new(-20.0, 0.0), DVec2::new(20.0, 20.0), 4, 2).unwrap();
    assert_eq!(state.tile, Some(partition.locate(was.position).0));
    for step in &comparison.steps {
        let change = f64::from(was.velocity.x.next_up()) - f64::from(was.velocity.x);
        let expected = if step.step == 35 { (1, change, Some(111)) } else { (0, 0.0, None) };
        assert_eq!((step.differing, step.velocity.max, step.velocity.id), expected);
        assert_eq!((step.bodies, step.position.max, step.angle.max), (20, 0.0, 0.0));
    }
    let text = told(&a, &b, &comparison);
    let verdict = "differ: 13 records of 20 bodies, steps 0 to 60, 1 of them not alike in every bit\n\
                   first difference: step 35, body 111, in vx\n";
    assert!(text.starts_with(verdict), "{text}");
    let full = format!("  A  in tile {}: x {}, y {}, angle", state.tile.unwrap(), was.position.x, was.position.y);
    assert!(text.contains(&full) && text.contains(&format!("vx {}", was.velocity.x.next_up())), "{text}");
    assert!(text.lines().last().unwrap().trim_start().starts_with("60          0"), "{text}");
}

#[test]
fn negative_zero_is_another_bit_but_no_deviation() {
    let set = |zero: f32| run(5, move |_, bodies| with_id(bodies, 104).angular_velocity = zero);
    let (a, b) = (set(0.0), set(-0.0));
    let comparison = compared(&a, &b, None);
    assert_eq!(comparison.first_difference.as_ref().unwrap().columns, ["omega"]);
    assert!(!comparison.same);
    assert!(compared(&a, &b, Some(0.0)).same);
}

#[test]
fn deviations_are_measured_as_they_are_meant() {
    let a = run(0, |_, bodies| {
        with_id(bodies, 103).rotation = Rot::from_angle(3.1);
        with_id(bodies, 105).position = DVec2::ZERO;
        with_id(bodies, 105).angular_velocity = 1.0;
        with_id(bodies, 106).position = DVec2::ONE;
    });
    let b = run(0, |_, bodies| {
        with_id(bodies, 103).rotation = Rot::from_angle(-3.1);
        with_id(bodies, 105).position = DVec2::new(3.0, -4.0);
        with_id(bodies, 105).angular_velocity = -1.5;
        with_id(bodies, 106).position = DVec2::new(1.0, 2.0);
    });
    let comparison = compared(&a, &b, None);
    let step = &comparison.steps[0];
    assert_eq!((step.position.max, step.position.id, step.differing), (5.0, Some(105), 3));
    assert_eq!(step.position.rms, (26.0_f64 / 20.0).sqrt());
    assert!((step.angle.max - (2.0 * PI - 6.2)).abs() < 1e-6, "{}", step.angle.max);
    assert_eq!((step.angular_velocity.max, step.velocity.max), (2.5, 0.0));
    assert_eq!(comparison.first_difference.as_ref().unwrap().id, 103);
}

#[test]
fn a_tolerance_is_for_all_four_quantities() {
    let a = run(10, unchanged);
    let changes: [fn(&mut Body); 4] = [
        |body| body.position.x += 0.25,
        |body| body.rotation = Rot::from_angle(body.rotation.angle() + 0.25),
        |body| body.velocity.y += 0.25,
        |body| body.angular_velocity += 0.25,
    ];
    for change in changes {
        let b = run(10, |_, bodies| change(with_id(bodies, 108)));
        let within = compared(&a, &b, Some(0.26));
        assert!(within.same && !within.identical);
        assert_eq!(within.first_difference, None);
        assert!(told(&a, &b, &within).starts_with("the same within 0.26: 3 records of 20 bodies, steps 0 to 10, none"));
        let beyond = compared(&a, &b, Some(0.24));
        assert!(!beyond.same);
        assert!(told(&a, &b, &beyond).starts_with("differ by more than 0.24: 3 records"));
    }
    // What is no number is far from everything.
    let b = run(10, |_, bodies| with_id(bodies, 108).position.x = f64::NAN);
    let nowhere = compared(&a, &b, Some(1e300));
    assert!(!nowhere.same);
    let first = nowhere.first_difference.unwrap();
    assert!(first.id == 108 && first.a.unwrap().tile.is_some() && first.b.unwrap().tile.is_none());
}

#[test]
fn the_first_difference_is_what_made_them_differ() {
    let a = run(10, unchanged);
    let b = run(10, |step, bodies| {
        with_id(bodies, 102).position.x += 1e-9;
        if step > 0 {
            // By less than is asked for along x.
            with_id(bodies, 115).position.x += 1e-9;
            with_id(bodies, 115).velocity.y += 0.5;
        }
    });
    let bits = compared(&a, &b, None).first_difference.unwrap();
    assert_eq!((bits.step, bits.id, bits.columns), (0, 102, vec!["x"]));
    let beyond = compared(&a, &b, Some(0.1));
    let first = beyond.first_difference.as_ref().unwrap();
    assert_eq!((first.step, first.id, first.columns.as_slice()), (5, 115, &["vy"][..]));
    let text = told(&a, &b, &beyond);
    assert!(text.contains("\nfirst difference beyond 0.1: step 5, body 115, in vy\n"), "{text}");
    assert!(text.contains(", none of them alike in every bit, 2 not within 0.1\n"), "{text}");
    let counts = beyond.steps.iter().map(|step| (step.differing, step.beyond)).collect::<Vec<_>>();
    assert_eq!(counts, [(1, Some(0)), (2, Some(1)), (2, Some(1))]);
}

#[test]
fn bodies_that_are_missing_or_doubled_are_counted_and_named() {
    let a = run(10, |step, bodies| {
        if step == 10 {
            bodies.push(body(110, 3));
            bodies.push(body(110, 4));
        }
    });
    let b = run(10, |step, bodies| bodies.retain(|body| step == 0 || ![107, 119].contains(&body.id.0)));
    let comparison = compared(&a, &b, Some(1e9));
    assert!(!comparison.same);
    let step = &comparison.steps[2];
    assert_eq!((step.bodies, step.differing), (17, 0));
    assert_eq!(step.missing_in_b, Bodies { count: 2, first: Some(107) });
    assert_eq!(step.doubled_in_a, Bodies { count: 1, first: Some(110) });
    assert_eq!((step.missing_in_a, step.doubled_in_b), (Bodies::default(), Bodies::default()));
    let first = comparison.first_difference.as_ref().unwrap();
    assert_eq!((first.step, first.id, first.times), (5, 107, [1, 0]));
    assert!(first.a.is_some() && first.b.is_none());
    let text = told(&a, &b, &comparison);
    assert!(text.contains("\nB lacks 2 bodies at step 5, the lowest is 107, and some at 1 later step\n"), "{text}");
    assert!(text.contains("\nA has more than once 1 body at step 10, the lowest is 110\n"), "{text}");
    assert!(text.contains("\n  B  lacks it\n"), "{text}");
    let doubled = compared(&a, &run(10, unchanged), Some(1.0));
    let first = doubled.first_difference.as_ref().unwrap();
    assert_eq!((first.step, first.id, first.times, first.columns.len()), (10, 110, [3, 1], 0));
    let text = doubled.to_string();
    assert!(text.contains("\nfirst difference: step 10, body 110\n") && text.contains("  has it 3 times\n"), "{text}");
    assert!(svg(&doubled).contains("some are missing or doubled"));
    let other = compared(&b, &a, None);
    assert_eq!(other.steps[2].missing_in_a, Bodies { count: 2, first: Some(107) });
    // A recording that has a body twice is not even like itself.
    assert!(!compared(&a, &a, None).same);
}

#[test]
fn one_run_may_have_recorded_longer_or_more_often() {
    let (short, long) = (run(30, unchanged), run(60, unchanged));
    let comparison = compared(&short, &long, Some(1.0));
    assert!(!comparison.same && !comparison.identical);
    assert_eq!((comparison.only_in_a.len(), comparison.only_in_b.as_slice()), (0, &[35, 40, 45, 50, 55, 60][..]));
    let text = told(&short, &long, &comparison);
    let expected = "the same within 1 as far as both recorded: 7 records of 20 bodies, steps 0 to 30\n\
                    only B has 6 records of steps 35 to 60\n\
                    the ends differ: steps is 30 in A and 60 in B\n";
    assert_eq!(text, expected);

    let often = run_of(1, &facts(3), (0..=30).step_by(3), unchanged);
    let comparison = compared(&short, &often, None);
    assert_eq!(comparison.steps.iter().map(|step| step.step).collect::<Vec<_>>(), [0, 15, 30]);
    assert_eq!((comparison.only_in_a.len(), comparison.only_in_b.len()), (4, 8));
}

#[test]
fn configurations_are_compared_before_all_else() {
    let a = run(10, unchanged);
    let other = facts(5).canonical.replace("run.steps = 100", "run.steps = 10").replace("seed = 7", "seed = 8");
    let b = run_of(1, &RunFacts { canonical: other, ..facts(5) }, (0..=10).step_by(5), unchanged);
    let comparison = compared(&a, &b, None);
    assert!(comparison.identical, "what was recorded decides");
    let expected = "the configurations differ: scene.seed is 7 in A and 8 in B\n\
                    the configurations differ: run.steps is 100 in A and 10 in B\n\
                    identical: 3 records of 20 bodies, steps 0 to 10\n";
    assert_eq!(told(&a, &b, &comparison), expected);
    let strange = facts(5).canonical + "physics.\x1b[31mnew = \x1b[2J1\n";
    let b = run_of(1, &RunFacts { canonical: strange, ..facts(5) }, (0..=10).step_by(5), unchanged);
    let text = told(&a, &b, &compared(&a, &b, None));
    assert!(text.starts_with("the configurations differ: physics. [31mnew is nothing in A and [2J1 in B\n"), "{text}");
}

#[test]
fn how_runs_end_is_compared_beyond_what_was_recorded() {
    let ended = |steps, hashes| {
        let folder = run(10, unchanged);
        end(&folder, steps, hashes);
        folder
    };
    let a = ended(12, ["aa", "c0"]);
    assert!(compared(&a, &ended(12, ["aa", "c0"]), None).identical);

    let b = ended(12, ["aa", "c1"]);
    let comparison = compared(&a, &b, None);
    assert!(!comparison.same && !comparison.identical);
    let expected = "the same as far as all ranks recorded: 3 records of 20 bodies, steps 0 to 10\n\
                    the ends differ: contact_hash is c0 in A and c1 in B\n";
    assert_eq!(told(&a, &b, &comparison), expected);
    let within = compared(&a, &b, Some(0.5));
    assert!(within.same && !within.identical);
    assert!(told(&a, &b, &within).starts_with("the same within 0.5: 3 records"));

    // One made more steps, whatever the tolerance.
    let b = ended(14, ["bb", "c2"]);
    for tolerance in [None, Some(0.5)] {
        let comparison = compared(&a, &b, tolerance);
        assert!(!comparison.same && !comparison.identical);
        let text = told(&a, &b, &comparison);
        assert!(text.ends_with("steps 0 to 10\nthe ends differ: steps is 12 in A and 14 in B\n"), "{text}");
    }

    // What nobody knows is said to be unknown.
    kill(&b);
    let comparison = compared(&a, &b, None);
    assert!(comparison.identical);
    let expected = "B: the run is under way or was killed, so how it ends is not compared\n\
                    identical: 3 records of 20 bodies, steps 0 to 10\n";
    assert_eq!(told(&a, &b, &comparison), expected);
}

#[test]
fn what_a_killed_run_lost_is_said() {
    let (a, b) = (run(60, unchanged), run(60, unchanged));
    kill(&b);
    fs::remove_file(b.path().join("rank-00001/steps-0000000050-0000000060.parquet")).unwrap();
    let comparison = compared(&a, &b, None);
    assert_eq!((comparison.only_in_a.len(), comparison.b.incomplete, comparison.b.records), (3, 3, 10));
    let text = told(&a, &b, &comparison);
    assert!(text.starts_with("B: the last 3 steps are held by some ranks only, and left out\n"), "{text}");
    // What was left out could be anything.
    kill(&a);
    fs::remove_file(a.path().join("rank-00000/steps-0000000050-0000000060.parquet")).unwrap();
    for tolerance in [None, Some(0.5)] {
        let comparison = compared(&a, &b, tolerance);
        assert!(!comparison.same && !comparison.identical && comparison.first_difference.is_none());
        let within = if tolerance.is_some() { "within 0.5 " } else { "" };
        let expected = format!(
            "A: the last 3 steps are held by some ranks only, and left out\n\
             A: the run is under way or was killed, so how it ends is not compared\n\
             B: the last 3 steps are held by some ranks only, and left out\n\
             B: the run is under way or was killed, so how it ends is not compared\n\
             the same {within}as far as all ranks recorded: 10 records of 20 bodies, steps 0 to 45\n"
        );
        assert_eq!(told(&a, &b, &comparison), expected);
    }
    fs::remove_dir_all(b.path().join("rank-00000")).unwrap();
    let error = compare(a.path(), b.path(), None, |_, _| {}).unwrap_err().to_string();
    assert!(error.ends_with("give the folder of a run that recorded"), "{error}");
}

#[test]
fn a_table_has_twelve_rows_and_ends_with_the_last_step() {
    let a = run(300, unchanged);
    let steps = |change: fn(u64, &mut Vec<Body>)| {
        let text = compared(&a, &run(300, change), None).to_string();
        let (_, table) = text.split_once("\n\n").unwrap();
        let steps: Vec<_> = table.lines().map(|line| line.split_whitespace().next().unwrap().to_owned()).collect();
        assert_eq!(steps[0], "step");
        steps[1..].iter().map(|step| step.parse::<u64>().unwrap()).collect::<Vec<_>>()
    };
    let far = |step, bodies: &mut Vec<Body>| bodies[0].angular_velocity += if step == 20 { 0.5 } else { 0.0 };
    assert_eq!(steps(far), [20, 45, 70, 95, 120, 145, 170, 195, 220, 245, 270, 300]);
    // What counts most is never left out.
    let between = |step, bodies: &mut Vec<Body>| match step {
        5 => bodies[0].velocity.x += 0.25,
        110 => bodies[0].position.y += 0.5,
        115 => bodies[0].position.y += 0.25,
        _ => {}
    };
    let steps = steps(between);
    assert!(steps.len() <= 12 && [5, 110, 300].iter().all(|step| steps.contains(step)), "{steps:?}");
}

#[test]
fn json_holds_every_step() {
    let (a, b) = (run(60, unchanged), run(60, |_, bodies| bodies[0].position.y += 0.5));
    let comparison = compared(&a, &b, Some(0.1));
    let json: serde_json::Value = serde_json::from_slice(&comparison.to_json()).unwrap();
    assert_eq!((&json["same"], &json["identical"], &json["tolerance"]), (&false.into(), &false.into(), &0.1.into()));
    assert_eq!(json["steps"].as_array().unwrap().len(), 13);
    assert_eq!(json["steps"][12]["position"]["max"], 0.5);
    assert_eq!(json["first_difference"]["columns"], serde_json::json!(["y"]));
    assert_eq!(json["first_difference"]["a"]["x"], comparison.first_difference.unwrap().a.unwrap().x);
}

#[test]
fn pictures_show_growth_and_its_absence() {
    let a = run(60, unchanged);
    let grown = run(60, |step, bodies| {
        bodies[3].position.x += 1e-9 * (step as f64).exp();
        bodies[3].velocity.x += step as f32;
    });
    let picture = svg(&compared(&a, &grown, None));
    assert!(picture.starts_with("<svg") && picture.trim_end().ends_with("</svg>"));
    for text in ["position, m", "velocity, m/s", "angle, rad", "angular velocity, rad/s", "step", "greatest deviation"]
    {
        assert!(picture.contains(text), "{text}");
    }
    assert!(svg(&compared(&a, &a, None)).contains("identical"));
    let one = run(0, |_, bodies| bodies[0].id = GlobalId(5));
    assert!(svg(&compared(&a, &one, None)).ends_with("</svg>\n"));
    let nowhere = run(0, |_, bodies| bodies[0].position.x = f64::NAN);
    assert!(!svg(&compared(&one, &nowhere, None)).contains("NaN"));
    let tiny = |step: u64, x: f64| {
        run(5, move |at, bodies| {
            bodies[0].position = DVec2::ZERO;
            bodies[0].position.x = if at == step { x } else { 0.0 };
        })
    };
    let (zero, least, most) = (tiny(0, 0.0), tiny(0, f64::from_bits(1)), tiny(5, f64::MAX));
    for (a, b) in [(&zero, &least), (&zero, &most), (&least, &most)] {
        let comparison = compared(a, b, None);
        assert!(!comparison.identical);
        let picture = svg(&comparison);
        assert!(picture.len() < 100_000 && !picture.contains("NaN"), "{}", picture.len());
    }
}

#[test]
fn a_body_of_another_kind_is_another_body_at_any_tolerance() {
    let a = run(10, unchanged);
    let b = run(10, |step, bodies| {
        if step > 0 {
            with_id(bodies, 104).kind.0 = 1;
        }
    });
    for tolerance in [None, Some(1e9)] {
        let comparison = compared(&a, &b, tolerance);
        assert!(!comparison.same && !comparison.identical);
        let first = comparison.first_difference.as_ref().unwrap();
        assert_eq!((first.step, first.id, first.columns.as_slice()), (5, 104, &["kind"][..]));
        let other = comparison.steps[2].other_kind;
        assert_eq!((other.count, other.first, comparison.steps[0].other_kind.count), (1, Some(104), 0));
        let text = told(&a, &b, &comparison);
        let line = "B has of other kinds 1 body at step 5, the lowest is 104, and some at 1 later step\n";
        assert!(text.contains(line) && text.contains(", kind 0\n") && text.contains(", kind 1\n"), "{text}");
    }
}
