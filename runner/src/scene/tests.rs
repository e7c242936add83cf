//! What all scenes have in common.

use super::*;
use atoll_core::{Part, Rot};

/// Every kind of scene, and how many statics it has with 500 bodies.
const KINDS: [(SceneKind, u64); 14] = [
    (SceneKind::Rooms { power: 1.2 }, 16),
    (SceneKind::Pile { jitter: 0.01 }, 3),
    (SceneKind::Pyramids { base: 10 }, 4),
    (SceneKind::Pyramids { base: 3 }, 10),
    (SceneKind::Sparse, 4),
    (SceneKind::SingleIsland, 3),
    (SceneKind::Stack, 1),
    (SceneKind::Smash, 0),
    (SceneKind::Compounds, 281),
    (SceneKind::Junkyard, 262),
    (SceneKind::Washer, 1),
    (SceneKind::Tumbler, 1),
    (SceneKind::Zoo, 122),
    (SceneKind::Slope { angle: 35.0, friction: 0.5 }, 2),
];

fn scene(kind: &SceneKind) -> Scene {
    with_bodies(kind, 500)
}

fn with_bodies(kind: &SceneKind, bodies: u64) -> Scene {
    Scene::open(&SceneSpec { kind: kind.clone(), bodies, seed: 3 }).unwrap()
}

impl Scene {
    fn first_id(&self) -> GlobalId {
        GlobalId(self.statics().len() as u64)
    }

    fn body(&self, index: u64) -> Body {
        self.find(GlobalId(self.first_id().0 + index)).unwrap().unwrap()
    }

    fn all(&self) -> impl Iterator<Item = Body> + '_ {
        self.iter().map(Result::unwrap)
    }
}

#[test]
fn ids_follow_the_statics_and_any_body_can_be_made_alone() {
    for (kind, statics) in &KINDS {
        let (statics, scene) = (*statics, scene(kind));
        assert_eq!((scene.first_id(), scene.bodies()), (GlobalId(statics), 500), "{kind:?}");
        assert!((0..).zip(scene.statics()).all(|(id, fixed)| fixed.id == GlobalId(id)), "{kind:?}");
        for (index, body) in (0..).zip(scene.all()) {
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
    fn new(position: DVec2, rotation: Rot, shape: &Shape) -> Self {
        let (c, s) = (f64::from(rotation.c), f64::from(rotation.s));
        let center = DVec2::new(c * position.x + s * position.y, c * position.y - s * position.x);
        match shape {
            Shape::Circle { radius } => Self { center, half: DVec2::ZERO, radius: (*radius).into() },
            Shape::Box { half } => Self { center, half: half.as_dvec2(), radius: 0.0 },
            _ => panic!("no scene whose bodies are turned alike has others"),
        }
    }

    /// An upright rectangle around it: where everything is turned in a way of its own.
    fn around(position: DVec2, rotation: Rot, shape: &Shape) -> Self {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for (corners, radius) in shape.outlines() {
            for corner in corners {
                let corner = position + rotation.rotate(corner).as_dvec2();
                (low, high) = (low.min(corner - f64::from(radius)), high.max(corner + f64::from(radius)));
            }
        }
        Self { center: 0.5 * (low + high), half: 0.5 * (high - low), radius: 0.0 }
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
    for (kind, _) in &KINDS {
        let scene = scene(kind);
        let kinds = scene.kinds();
        let others = [SceneKind::Zoo, SceneKind::Compounds, SceneKind::Junkyard, SceneKind::Washer, SceneKind::Tumbler];
        let placed = if others.contains(kind) { Placed::around } else { Placed::new };
        let fixed = scene.statics().iter().flat_map(|one| match &one.kind.shape {
            Shape::Compound(compound) => {
                let part = |part: &Part| placed(one.position + part.position.as_dvec2(), part.rotation, &part.shape);
                compound.parts().iter().map(part).collect()
            }
            shape => vec![placed(one.position, one.rotation, shape)],
        });
        let fixed: Vec<Placed> = fixed.collect();
        let shape = |body: &Body| &kinds[body.kind.0 as usize].shape;
        let bodies: Vec<Placed> = scene.all().map(|body| placed(body.position, body.rotation, shape(&body))).collect();
        for (i, body) in bodies.iter().enumerate() {
            let deepest = fixed.iter().chain(&bodies[..i]).map(|other| body.overlap(other)).fold(f64::MIN, f64::max);
            assert!(deepest < 1e-4, "{kind:?}: body {i} starts {deepest} m inside another");
        }
    }
}

#[test]
fn the_seed_matters_and_the_same_seed_repeats() {
    for kind in [SceneKind::Rooms { power: 1.0 }, SceneKind::Sparse, SceneKind::SingleIsland] {
        let make = |seed| Scene::open(&SceneSpec { kind: kind.clone(), bodies: 100, seed }).unwrap();
        assert!(make(1).all().eq(make(1).all()));
        assert!(!make(1).all().eq(make(2).all()), "{kind:?}");
    }
}

#[test]
fn a_body_in_another_room_has_escaped() {
    let scene = scene(&SceneKind::Rooms { power: 1.0 });
    let mut body = scene.body(0);
    body.position = scene.body(499).position;
    assert!(scene.has_escaped(&body));
    body.position = DVec2::NAN;
    assert!(scene.has_escaped(&body));
}

#[test]
fn bodies_start_within_the_extent_of_any_that_they_are_among() {
    for (kind, _) in &KINDS {
        let scene = scene(kind);
        for (first, last) in [(0, 0), (0, 499), (1, 1), (499, 499), (17, 18), (22, 23), (100, 140), (3, 480), (0, 7)] {
            let Source::Made { layout, .. } = &scene.source else { unreachable!("all of these are made") };
            let (low, high) = layout.extent(first, last);
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
    for (kind, _) in &KINDS {
        let scene = with_bodies(kind, 50_000);
        let center = scene.body(31_000).position;
        let (low, high) = (center - 3.0, center + 3.0);
        let is_near = |body: &Body| body.position.cmpge(low).all() && body.position.cmple(high).all();
        let mut looked = 0;
        let near = scene.near(|a, b| a.cmple(high).all() && b.cmpge(low).all()).inspect(|_| looked += 1);
        let found: Vec<Body> = near.map(Result::unwrap).filter(is_near).collect();
        assert!(scene.all().filter(is_near).eq(found.iter().copied()), "{kind:?}");
        assert!(!found.is_empty() && looked < 50_000 / 8, "{kind:?}: {looked} looked at");
    }
}

#[test]
fn a_sample_stands_for_all() {
    let scene = |bodies| with_bodies(&SceneKind::Rooms { power: 1.2 }, bodies);
    let few = scene(1000);
    assert!(few.sample().map(Result::unwrap).eq(few.all().map(|body| (1, body.position))));
    let many = scene(SAMPLES * 3 + 7);
    let (low, high) = many.domain();
    let is_lower = |place: DVec2| place.cmplt(0.5 * (low + high)).all();
    let samples = || many.sample().map(Result::unwrap);
    let told = samples().filter(|(_, place)| is_lower(*place)).map(|(weight, _)| weight).sum::<u64>() as f64;
    let true_count = many.all().filter(|body| is_lower(body.position)).count() as f64;
    assert!((told / true_count - 1.0).abs() < 0.01, "{told} for {true_count}");
    assert_eq!(samples().map(|(weight, _)| weight).sum::<u64>(), many.bodies());
}
