//! Scenes do what their configurations say of them, at sizes that suit a test.

use atoll::{Config, Summary};

/// Runs a scene with some keys.
#[track_caller]
fn run(kind: &str, keys: &[(&str, &str)]) -> Summary {
    let config = Config::from_toml_str(kind, &format!("[scene]\nkind = \"{kind}\"\n"), keys).unwrap();
    let summary = atoll::run(&config).unwrap();
    assert_eq!((summary.bodies_lost, summary.escaped), (0, 0), "{kind} {keys:?}");
    summary
}

/// Boxes at rest have no speed; sliding ones have that of a body under gravity less friction (Coulomb).
#[test]
fn boxes_slide_where_the_slope_is_steeper_than_friction_holds() {
    for tiles in ["1x1", "2x2"] {
        for (angle, friction) in [("30", "0.6"), ("32", "0.6"), ("15", "0.2"), ("5", "0.2"), ("60", "1.6"), ("45", "0")]
        {
            let keys = [("tiles", tiles), ("angle", angle), ("friction", friction), ("bodies", "3"), ("steps", "120")];
            let found = run("slope", &keys).mean_half_v2;
            let (angle, friction): (f64, f64) = (angle.parse().unwrap(), friction.parse().unwrap());
            let (sin, cos) = angle.to_radians().sin_cos();
            let (found, expected) = ((2.0 * found).sqrt(), 2.0 * 10.0 * (sin - friction * cos).max(0.0));
            // As the contact begins, half of what friction does in a substep may be missing, if it slides.
            let begins = if expected > 0.0 { 0.5 * friction * cos * 10.0 / 240.0 } else { 0.0 };
            assert!(
                (found - expected).abs() < 0.002 * expected + begins + 1e-4,
                "{keys:?}: {found}, not {expected} m/s"
            );
        }
    }
}

#[test]
fn a_stack_stands_wherever_tiles_have_their_borders() {
    for tiles in ["1x1", "2x1", "1x2", "2x2"] {
        let summary = run("stack", &[("tiles", tiles), ("steps", "300")]);
        assert_eq!(summary.contacts, 10, "{tiles}: {summary}");
        assert!(summary.mean_half_v2 < 1e-6 && summary.max_penetration < 0.02, "{tiles}: {summary}");
    }
}

#[test]
fn pyramids_stand_and_each_is_an_island() {
    let summary = run("pyramids", &[("bodies", "330"), ("tiles", "1x1"), ("steps", "120")]);
    assert_eq!((summary.islands, summary.largest_island), (Some(6), Some(55)), "{summary}");
    assert!(summary.mean_half_v2 < 1e-6 && summary.max_penetration < 0.02, "{summary}");
}

#[test]
fn a_heap_is_one_island_from_the_first_step_on() {
    for steps in ["1", "20", "60"] {
        let summary = run("single-island", &[("bodies", "4000"), ("tiles", "1x1"), ("steps", steps)]);
        assert!(summary.largest_island.unwrap() * 100 > 95 * summary.bodies, "{summary}");
    }
}

#[test]
fn few_bodies_of_a_sparse_world_touch_and_many_islands_are_small() {
    for steps in ["30", "100"] {
        let summary = run("sparse", &[("bodies", "20000"), ("tiles", "1x1"), ("steps", steps)]);
        // An island has at least two bodies.
        assert!((200..2000).contains(&summary.islands.unwrap()) && summary.largest_island < Some(40), "{summary}");
        assert!((200..2000).contains(&summary.contacts), "{summary}");
    }
}
