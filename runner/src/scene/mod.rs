//! Scenes: which bodies there are at the start, and what stands around them.
//!
//! A scene is a function of its [`SceneSpec`]. Random numbers come from [`SplitMix64`]; each body takes
//! a fixed number of draws, in the order of the ids, so any body can be made without making the ones before it, and
//! nothing depends on tiles, ranks or threads. To add a scene, implement `Layout` in a file of its own and name it in
//! [`SceneKind`] and [`Scene::new`].

mod kind;
mod lattice;
mod pile;
mod pyramids;
mod random;
mod rooms;
mod single_island;
mod slope;
mod smash;
mod sparse;
mod stack;
mod statics;

pub use kind::{SceneKind, SceneSpec};
pub use random::SplitMix64;

use atoll_core::{Body, GlobalId, Kind, KindId, Material, Shape, StaticBody};
use glam::DVec2;
use std::iter;

/// What makes one scene different from another.
trait Layout: Send + Sync + std::fmt::Debug {
    /// How many dynamic bodies.
    fn bodies(&self) -> u64;
    /// The table of shapes and materials that bodies refer to.
    fn kinds(&self) -> Vec<Kind>;
    /// Low and high corner of the domain, in meters.
    fn domain(&self) -> (DVec2, DVec2);
    /// What never moves, with ids from 0.
    fn statics(&self) -> Vec<StaticBody>;
    /// The body of the given index, from 0, which is to be called `id`.
    fn body(&self, index: u64, id: GlobalId, seed: u64) -> Body;
    /// Low and high corner of a rectangle that the centers of the bodies from the index `first` to `last` start in, to within
    /// [`ROUNDING`]. The tighter it is, the sooner a rank finds the bodies near its tiles.
    fn extent(&self, first: u64, last: u64) -> (DVec2, DVec2);
    /// Low and high corner of the rectangle this body must not leave: the domain, unless the scene says otherwise.
    fn home(&self, _index: u64) -> (DVec2, DVec2) {
        self.domain()
    }
}

/// How far extents may be off, in meters.
const ROUNDING: f64 = 1e-3;

/// So few bodies are looked at one by one.
const FEW: u64 = 16;

/// Of worlds with more bodies than this, samples of about as many are looked at.
const SAMPLES: u64 = 1 << 19;

/// The start of a run.
#[derive(Debug)]
pub struct Scene {
    layout: Box<dyn Layout>,
    statics: Vec<StaticBody>,
    seed: u64,
}

impl Scene {
    /// The scene that is asked for.
    pub fn new(spec: &SceneSpec) -> Self {
        let SceneSpec { kind, bodies, seed } = *spec;
        let layout: Box<dyn Layout> = match kind {
            SceneKind::Rooms { power } => Box::new(rooms::Rooms::new(bodies, power)),
            SceneKind::Pile { jitter } => Box::new(pile::Pile::new(bodies, jitter)),
            SceneKind::Pyramids { base } => Box::new(pyramids::Pyramids::new(bodies, base)),
            SceneKind::Sparse => Box::new(sparse::Sparse::new(bodies)),
            SceneKind::SingleIsland => Box::new(single_island::SingleIsland::new(bodies)),
            SceneKind::Stack => Box::new(stack::Stack::new(bodies)),
            SceneKind::Smash => Box::new(smash::Smash::new(bodies)),
            SceneKind::Slope { angle, friction } => Box::new(slope::Slope::new(bodies, angle, friction)),
        };
        Self { statics: layout.statics(), layout, seed }
    }

    /// How many dynamic bodies there are.
    pub fn bodies(&self) -> u64 {
        self.layout.bodies()
    }

    /// The table of shapes and materials that bodies refer to.
    pub fn kinds(&self) -> Vec<Kind> {
        self.layout.kinds()
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

    /// The bodies that start in any rectangle for which `meets` says yes, and perhaps some more, in ascending order; `meets` is asked
    /// of rectangles that hold many. Takes time for the bodies found, and for the boundaries of where they are.
    pub fn near(&self, meets: impl Fn(DVec2, DVec2) -> bool) -> impl Iterator<Item = Body> {
        let mut parts = vec![(0, self.bodies())];
        let mut few = 0..0;
        iter::from_fn(move || {
            loop {
                if let Some(index) = few.next() {
                    return Some(self.body(index));
                }
                let (first, end) = parts.pop()?;
                if first == end {
                    continue;
                }
                let (low, high) = self.layout.extent(first, end - 1);
                if !meets(low - ROUNDING, high + ROUNDING) {
                    continue;
                }
                if end - first <= FEW {
                    few = first..end;
                } else {
                    let middle = first + (end - first) / 2;
                    parts.extend([(middle, end), (first, middle)]);
                }
            }
        })
    }

    /// All bodies, each with a one; of many bodies a sample, each with the number of those that it stands for.
    pub fn sample(&self) -> impl Iterator<Item = (u64, Body)> {
        let (bodies, samples) = (self.bodies(), self.bodies().min(SAMPLES));
        let begin = move |sample: u64| (u128::from(bodies) * u128::from(sample) / u128::from(samples)) as u64;
        (0..samples).map(move |sample| {
            let (first, end) = (begin(sample), begin(sample + 1));
            // Anywhere among them, so that none of them keeps time with the rows of a lattice.
            let index = first + SplitMix64::after(0, sample).bits() % (end - first);
            (end - first, self.body(index))
        })
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

/// The table of the reported mixture: a box and a circle.
fn mixture() -> Vec<Kind> {
    table([Shape::rectangle(0.2, 0.2), Shape::circle(0.2)])
}

/// A table of shapes of the usual material.
fn table<const N: usize>(shapes: [Shape; N]) -> Vec<Kind> {
    shapes.map(|shape| Kind { shape, material: Material::default() }).to_vec()
}

/// The first or the second row of a table, each with probability 1/2. One draw.
fn random_kind(random: &mut SplitMix64) -> KindId {
    KindId(u32::from(random.coin()))
}

#[cfg(test)]
mod tests;
