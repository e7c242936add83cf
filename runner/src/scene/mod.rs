//! Scenes: which bodies there are at the start, and what stands around them.
//!
//! A scene is a function of its section of the configuration. Random numbers come from [`SplitMix64`]; each body takes
//! a fixed number of draws, in the order of the ids, so any body can be made without making the ones before it, and
//! nothing depends on tiles, ranks or threads. To add a scene, implement `Layout` in a file of its own and name it in
//! [`SceneKind`] and [`Scene::new`].

mod pile;
mod random;
pub(crate) mod rooms;

pub use random::SplitMix64;

use crate::config::{SceneConfig, SceneKind};
use atoll_core::{Body, GlobalId, Kind, KindId, Material, Rot, Shape, StaticBody};
use glam::{DVec2, Vec2};

/// What makes one scene different from another.
trait Layout: Send + Sync + std::fmt::Debug {
    /// How many dynamic bodies.
    fn bodies(&self) -> u64;
    /// Low and high corner of the domain, in meters.
    fn domain(&self) -> (DVec2, DVec2);
    /// What never moves, with ids from 0.
    fn statics(&self) -> Vec<StaticBody>;
    /// The body of the given index, from 0, which is to be called `id`.
    fn body(&self, index: u64, id: GlobalId, seed: u64) -> Body;
    /// Low and high corner of the rectangle this body must not leave.
    fn home(&self, index: u64) -> (DVec2, DVec2);
}

/// The start of a run.
#[derive(Debug)]
pub struct Scene {
    layout: Box<dyn Layout>,
    statics: Vec<StaticBody>,
    seed: u64,
}

impl Scene {
    /// The scene a configuration describes.
    pub fn new(config: &SceneConfig) -> Self {
        let layout: Box<dyn Layout> = match config.kind {
            SceneKind::Rooms { power } => Box::new(rooms::Rooms::new(config.bodies, power)),
            SceneKind::Pile { jitter } => Box::new(pile::Pile::new(config.bodies, jitter)),
        };
        Self { statics: layout.statics(), layout, seed: config.seed }
    }

    /// How many dynamic bodies there are.
    pub fn bodies(&self) -> u64 {
        self.layout.bodies()
    }

    /// The table of shapes and materials that bodies refer to: a box and a circle.
    pub fn kinds(&self) -> Vec<Kind> {
        [Shape::rectangle(0.2, 0.2), Shape::circle(0.2)]
            .map(|shape| Kind { shape, material: Material::default() })
            .to_vec()
    }

    /// What never moves. These have the lowest ids.
    pub fn statics(&self) -> &[StaticBody] {
        &self.statics
    }

    /// Low and high corner of the domain, in meters.
    pub fn domain(&self) -> (DVec2, DVec2) {
        self.layout.domain()
    }

    /// The id of the body with index 0; the others follow.
    pub fn first_id(&self) -> GlobalId {
        GlobalId(self.statics.len() as u64)
    }

    /// The body with this index, below [`bodies`](Self::bodies), as it starts.
    pub fn body(&self, index: u64) -> Body {
        self.layout.body(index, GlobalId(self.first_id().0 + index), self.seed)
    }

    /// All bodies as they start, in the order of their ids.
    pub fn iter(&self) -> impl Iterator<Item = Body> + '_ {
        (0..self.bodies()).map(|index| self.body(index))
    }

    /// Low and high corner of the rectangle that the center of the body with this index must not leave: its room, or
    /// the whole domain.
    pub fn home(&self, index: u64) -> (DVec2, DVec2) {
        self.layout.home(index)
    }

    /// Whether a body is outside its [`home`](Self::home), or not one of this scene at all.
    pub fn has_escaped(&self, body: &Body) -> bool {
        let index = body.id.0.wrapping_sub(self.first_id().0);
        if index >= self.bodies() {
            return true;
        }
        let (low, high) = self.home(index);
        !(body.position.cmpge(low).all() && body.position.cmple(high).all())
    }
}

/// A box or a circle, each with probability 1/2. One draw.
fn random_kind(random: &mut SplitMix64) -> KindId {
    KindId(u32::from(random.coin()))
}

/// A static rectangle between two corners.
fn wall(id: GlobalId, low: DVec2, high: DVec2) -> StaticBody {
    let half: Vec2 = ((high - low) * 0.5).as_vec2();
    let kind = Kind { shape: Shape::Box { half }, material: Material::default() };
    StaticBody { id, position: (low + high) * 0.5, rotation: Rot::IDENTITY, kind }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(kind: SceneKind) -> Scene {
        Scene::new(&SceneConfig { kind, bodies: 500, seed: 3 })
    }

    #[test]
    fn ids_follow_the_statics_and_any_body_can_be_made_alone() {
        for (kind, statics) in [(SceneKind::Rooms { power: 1.2 }, 16), (SceneKind::Pile { jitter: 0.01 }, 3)] {
            let scene = scene(kind);
            assert_eq!(scene.first_id(), GlobalId(statics));
            for (index, body) in (0..).zip(scene.iter()) {
                assert_eq!(body.id, GlobalId(statics + index));
                assert_eq!(body, scene.body(index));
                assert!(!scene.has_escaped(&body));
            }
        }
    }

    #[test]
    fn the_seed_matters_and_the_same_seed_repeats() {
        let make = |seed| Scene::new(&SceneConfig { kind: SceneKind::Rooms { power: 1.0 }, bodies: 100, seed });
        assert!(make(1).iter().eq(make(1).iter()));
        assert!(!make(1).iter().eq(make(2).iter()));
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
}
