//! What all scenes have in common.

use super::*;
use atoll_core::Rot;

/// Every kind of scene, and how many statics it has with 500 bodies.
const KINDS: [(SceneKind, u64); 8] = [
    (SceneKind::Rooms { power: 1.2 }, 16),
    (SceneKind::Pile { jitter: 0.01 }, 3),
    (SceneKind::Pyramids { base: 10 }, 4),
    (SceneKind::Pyramids { base: 3 }, 10),
    (SceneKind::Sparse, 4),
    (SceneKind::SingleIsland, 3),
    (SceneKind::Stack, 1),
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
