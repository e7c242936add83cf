use super::case::{SceneName, Wishes};
use super::given::Given as _;
use super::*;

const ENGINES: [Engine; 3] = [Engine::Atoll, Engine::Box2d, Engine::Rapier];

fn case(scene: SceneName, bodies: u64, steps: u64, threads: usize) -> Case {
    let wishes = Wishes { bodies: Some(bodies), steps: Some(steps), threads: Some(threads), tiles: None };
    Case::new(scene, wishes).unwrap()
}

/// Differs from `b` by at most this part of it.
fn near(a: f64, b: f64, part: f64) -> bool {
    (a - b).abs() <= part * b.abs()
}

#[test]
fn all_engines_start_from_the_same_scene() {
    for scene in [SceneName::Normal, SceneName::Skewed, SceneName::Pile] {
        let case = case(scene, 500, 0, 1);
        let start: Vec<Body> = case.plan.scene.iter().map(Result::unwrap).collect();
        let expected = quality::measure(&case, &start).unwrap();
        assert!(expected.kinetic_energy_per_kg > 50.0 || scene == SceneName::Pile);
        for engine in ENGINES {
            // That the engine's masses are the scene's is checked inside.
            let found = run(engine, &case).unwrap().quality;
            assert_eq!((found.escaped, found.contacts), (0, expected.contacts), "{scene}, {engine}");
            assert!(near(found.kinetic_energy, expected.kinetic_energy, 1e-4), "{scene}, {engine}: {found:?}");
            assert!(near(found.mean_half_v2, expected.mean_half_v2, 1e-4), "{scene}, {engine}: {found:?}");
        }
    }
}

#[test]
fn bodies_come_back_as_they_went_in() {
    let case = case(SceneName::Skewed, 400, 0, 1);
    let start: Vec<Body> = case.plan.scene.iter().map(Result::unwrap).collect();
    let box2d = box2d::Worlds::new(&case).unwrap();
    let rapier = rapier::Simulated::new(&case);
    assert!(near(box2d.mass(), case.mass(), 1e-5) && near(rapier.mass(), case.mass(), 1e-5));
    for there in [box2d.bodies(), rapier.bodies()] {
        assert_eq!(there.len(), start.len());
        for (a, b) in there.iter().zip(&start) {
            assert!((a.position - b.position).length() < 1e-5 && a.velocity == b.velocity, "{a:?} {b:?}");
            assert_eq!((a.id, a.kind, a.angular_velocity), (b.id, b.kind, b.angular_velocity));
        }
    }
}

#[test]
fn a_few_steps_keep_everybody_inside() {
    for threads in [1, 2] {
        let case = case(SceneName::Normal, 500, 5, threads);
        for engine in ENGINES {
            let run = run(engine, &case).unwrap();
            let Quality { kinetic_energy_per_kg: energy, mean_penetration, max_penetration, escaped, .. } = run.quality;
            assert!(run.ms_per_step > 0.0 && run.peak_rss_bytes > 0, "{engine}: {run:?}");
            assert!(energy.is_finite() && (10.0..200.0).contains(&energy), "{engine}: {run:?}");
            assert!(mean_penetration <= max_penetration && max_penetration < 0.4, "{engine}: {run:?}");
            assert_eq!(escaped, 0, "{engine}: {run:?}");
        }
    }
}

#[test]
fn walls_stop_bodies_in_every_engine() {
    // 20 m/s for two seconds, in a room of 8 m: without walls nearly all would be gone.
    let case = case(SceneName::Normal, 400, 120, 1);
    for engine in ENGINES {
        let quality = run(engine, &case).unwrap().quality;
        assert_eq!(quality.escaped, 0, "{engine}: {quality:?}");
    }
}

#[test]
fn box2d_refuses_what_it_cannot_count() {
    let crowded = case(SceneName::Pile, 250_001, 1, 1);
    let failure = run(Engine::Box2d, &crowded).unwrap_err();
    assert_eq!(failure.exit, 2);
    assert!(failure.message.starts_with("250001 bodies in one world: Box2D 3."), "{failure:?}");
}
