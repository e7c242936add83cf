//! What all scenes have in common.

use super::*;
use atoll_core::Rot;

/// Every kind of scene, and how many statics it has with 500 bodies.
const KINDS: [(SceneKind, u64); 9] = [
    (SceneKind::Rooms { power: 1.2 }, 16),
    (SceneKind::Pile { jitter: 0.01 }, 3),
    (SceneKind::Pyramids { base: 10 }, 4),
    (SceneKind::Pyramids { base: 3 }, 10),
    (SceneKind::Sparse, 4),
    (SceneKind::SingleIsland, 3),
    (SceneKind::Stack, 1),
    (SceneKind::Smash, 0),
    (SceneKind::Slope { angle: 35.0, friction: 0.5 }, 2),
];

fn scene(kind: SceneKind) -> Scene {
    Scene::new(&SceneSpec { kind, bodies: 500, seed: 3 })
}

#[test]
fn ids_follow_the_statics_and_any_body_can_be_made_alone() {
    for (kind, statics) in KINDS {
        let scene = scene(kind);
        assert_eq!((scene.first_id(), scene.bodies()), (GlobalId(statics), 500), "{kind:?}");
        assert!((0..).zip(scene.statics()).all(|(id, fixed)| fixed.id == GlobalId(id)), "{kind:?}");
        for (index, body) in (0..).zip(scene.iter()) {
            assert_eq!(body.id, GlobalId(statics + index));
            assert_eq!(body, scene.body(index));
            assert!((body.kind.0 as usize) < scene.kinds().len(), "{kind:?}: {body:?}");
            assert!(!scene.has_escaped(&body), "{kind:?}: {body:?}");
        }
    }
}

/// A shape somewhere, in the frame that everything in a scene is turned by at the start.
struct Placed {
    center: DVec2,
    /// Half extents without the radius.
    half: DVec2,
    radius: f64,
}

impl Placed {
    fn new(position: DVec2, rotation: Rot, shape: Shape) -> Self {
        let (c, s) = (f64::from(rotation.c), f64::from(rotation.s));
        let center = DVec2::new(c * position.x + s * position.y, c * position.y - s * position.x);
        match shape {
            Shape::Circle { radius } => Self { center, half: DVec2::ZERO, radius: radius.into() },
            Shape::Box { half } => Self { center, half: half.as_dvec2(), radius: 0.0 },
        }
    }

    /// How deep two of them are inside each other, in meters; negative where they are not.
    fn overlap(&self, other: &Self) -> f64 {
        let gap = (self.center - other.center).abs() - self.half - other.half;
        let distance = if gap.cmplt(DVec2::ZERO).all() { gap.max_element() } else { gap.max(DVec2::ZERO).length() };
        self.radius + other.radius - distance
    }
}

#[test]
fn nothing_starts_inside_anything_else() {
    for (kind, _) in KINDS {
        let scene = scene(kind);
        let kinds = scene.kinds();
        let fixed = scene.statics().iter().map(|one| Placed::new(one.position, one.rotation, one.kind.shape));
        let fixed: Vec<Placed> = fixed.collect();
        let shape = |body: &Body| kinds[body.kind.0 as usize].shape;
        let bodies: Vec<Placed> =
            scene.iter().map(|body| Placed::new(body.position, body.rotation, shape(&body))).collect();
        for (i, body) in bodies.iter().enumerate() {
            let deepest = fixed.iter().chain(&bodies[..i]).map(|other| body.overlap(other)).fold(f64::MIN, f64::max);
            assert!(deepest < 1e-4, "{kind:?}: body {i} starts {deepest} m inside another");
        }
    }
}

#[test]
fn the_seed_matters_and_the_same_seed_repeats() {
    for kind in [SceneKind::Rooms { power: 1.0 }, SceneKind::Sparse, SceneKind::SingleIsland] {
        let make = |seed| Scene::new(&SceneSpec { kind, bodies: 100, seed });
        assert!(make(1).iter().eq(make(1).iter()));
        assert!(!make(1).iter().eq(make(2).iter()), "{kind:?}");
    }
}

#[test]
fn a_body_in_another_room_has_escaped() {
    let scene = scene(SceneKind::Rooms { power: 1.0 });
    let mut body = scene.body(0);
    body.position = scene.body(499).position;
    assert!(scene.has_escaped(&body));
    body.position = DVec2::NAN;
    assert!(scene.has_escaped(&body));
}

#[test]
fn bodies_start_within_the_extent_of_any_that_they_are_among() {
    for (kind, _) in KINDS {
        let scene = scene(kind);
        for (first, last) in [(0, 0), (0, 499), (1, 1), (499, 499), (17, 18), (22, 23), (100, 140), (3, 480), (0, 7)] {
            let (low, high) = scene.layout.extent(first, last);
            for index in first..=last {
                let place = scene.body(index).position;
                let within = place.cmpge(low - ROUNDING).all() && place.cmple(high + ROUNDING).all();
                assert!(within, "{kind:?}: {index} of {first} to {last} at {place}, not within {low} to {high}");
            }
        }
    }
}

#[test]
fn who_is_near_is_found_without_looking_at_all() {
    for (kind, _) in KINDS {
        let scene = Scene::new(&SceneSpec { kind, bodies: 50_000, seed: 3 });
        let center = scene.body(31_000).position;
        let (low, high) = (center - 3.0, center + 3.0);
        let is_near = |body: &Body| body.position.cmpge(low).all() && body.position.cmple(high).all();
        let mut looked = 0;
        let near = scene.near(|a, b| a.cmple(high).all() && b.cmpge(low).all()).inspect(|_| looked += 1);
        let found: Vec<Body> = near.filter(is_near).collect();
        assert!(scene.iter().filter(is_near).eq(found.iter().copied()), "{kind:?}");
        assert!(!found.is_empty() && looked < 50_000 / 8, "{kind:?}: {looked} looked at");
    }
}

#[test]
fn a_sample_stands_for_all() {
    let spec = |bodies| SceneSpec { kind: SceneKind::Rooms { power: 1.2 }, bodies, seed: 3 };
    let few = Scene::new(&spec(1000));
    assert!(few.sample().eq(few.iter().map(|body| (1, body))));
    let many = Scene::new(&spec(SAMPLES * 3 + 7));
    let (low, high) = many.domain();
    let lower = |(_, body): &(u64, Body)| body.position.cmplt(0.5 * (low + high)).all();
    let told = many.sample().filter(lower).map(|(weight, _)| weight).sum::<u64>() as f64;
    let true_count = many.iter().filter(|body| lower(&(1, *body))).count() as f64;
    assert!((told / true_count - 1.0).abs() < 0.01, "{told} for {true_count}");
    assert_eq!(many.sample().map(|(weight, _)| weight).sum::<u64>(), many.bodies());
}
