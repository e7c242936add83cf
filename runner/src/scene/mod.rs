//! Scenes: which bodies there are at the start, and what stands around them.
//!
//! A scene is a function of its [`SceneSpec`]. Random numbers come from [`SplitMix64`]; each body takes
//! a fixed number of draws, in the order of the ids, so any body can be made without making the ones before it, and
//! nothing depends on tiles, ranks or threads. To add a scene, implement `Layout` in a file of its own and name it in
//! [`SceneKind`] and [`Scene::open`]. Or its bodies are read from files that a user wrote: `file/`.

mod compounds;
mod error;
pub(crate) mod file;
pub(crate) mod import;
mod junkyard;
mod kind;
mod large;
mod lattice;
mod pile;
mod pyramids;
mod random;
pub(crate) mod record;
mod rooms;
mod single_island;
mod slope;
mod smash;
mod sparse;
mod stack;
mod statics;
mod tumbler;
mod washer;
mod yards;
mod zoo;

pub use error::{Place, SceneError};
pub use file::SceneFile;
pub use kind::{FileSpec, SceneKind, SceneSpec};
pub use random::SplitMix64;

use atoll_core::{Body, GlobalId, Kind, KindId, Material, Shape, StaticBody};
use file::BodyIter;
#[cfg(test)]
pub(crate) use file::shape_tests;
pub(crate) use file::{FARTHEST, MOST_AT_A_PLACE, kind_of_command, place_of};
use glam::DVec2;
use std::iter;
use std::sync::Arc;

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
    source: Source,
}

/// Where bodies come from.
#[derive(Debug)]
enum Source {
    /// They are made.
    Made { layout: Box<dyn Layout>, statics: Vec<StaticBody>, seed: u64 },
    /// They are read.
    Read(Arc<SceneFile>),
}

impl Scene {
    /// The scene that is asked for.
    ///
    /// # Errors
    /// If it is in files that cannot be read.
    pub fn open(spec: &SceneSpec) -> Result<Self, SceneError> {
        let SceneSpec { ref kind, bodies, seed } = *spec;
        let layout: Box<dyn Layout> = match *kind {
            SceneKind::Rooms { power } => Box::new(rooms::Rooms::new(bodies, power)),
            SceneKind::Pile { jitter } => Box::new(pile::Pile::new(bodies, jitter)),
            SceneKind::Pyramids { base } => Box::new(pyramids::Pyramids::new(bodies, base)),
            SceneKind::Sparse => Box::new(sparse::Sparse::new(bodies)),
            SceneKind::SingleIsland => Box::new(single_island::SingleIsland::new(bodies)),
            SceneKind::Stack => Box::new(stack::Stack::new(bodies)),
            SceneKind::Smash => Box::new(smash::Smash::new(bodies)),
            SceneKind::Compounds => Box::new(yards::Yards::<compounds::Compounds>::new(bodies)),
            SceneKind::Junkyard => Box::new(yards::Yards::<junkyard::Junkyard>::new(bodies)),
            SceneKind::Washer => Box::new(yards::Yards::<washer::Washer>::new(bodies)),
            SceneKind::Tumbler => Box::new(yards::Yards::<tumbler::Tumbler>::new(bodies)),
            SceneKind::Zoo => Box::new(zoo::Zoo::new(bodies)),
            SceneKind::Slope { angle, friction } => Box::new(slope::Slope::new(bodies, angle, friction)),
            SceneKind::File(ref spec) => return Ok(Self { source: Source::Read(spec.file()?) }),
        };
        Ok(Self { source: Source::Made { statics: layout.statics(), layout, seed } })
    }

    /// The files that it is read from, if it is.
    pub fn file(&self) -> Option<&SceneFile> {
        match &self.source {
            Source::Made { .. } => None,
            Source::Read(file) => Some(file),
        }
    }

    /// How many dynamic bodies there are.
    pub fn bodies(&self) -> u64 {
        match &self.source {
            Source::Made { layout, .. } => layout.bodies(),
            Source::Read(file) => file.count(),
        }
    }

    /// The table of shapes and materials that bodies refer to.
    pub fn kinds(&self) -> Vec<Kind> {
        match &self.source {
            Source::Made { layout, .. } => layout.kinds(),
            Source::Read(file) => file.kinds().to_vec(),
        }
    }

    /// The bounding radius in meters beyond which bodies of this scene are few, and better not reckoned with in halos, with such a
    /// greatest margin.
    pub(crate) fn large_radius(&self, margin_cap: f32) -> f32 {
        large::radius(&self.kinds(), self.file().and_then(SceneFile::by_kind), margin_cap)
    }

    /// What never moves. Of scenes that are made, these have the lowest ids.
    pub fn statics(&self) -> &[StaticBody] {
        match &self.source {
            Source::Made { statics, .. } => statics,
            Source::Read(file) => file.statics(),
        }
    }

    /// Low and high corner of the domain, in meters.
    pub fn domain(&self) -> (DVec2, DVec2) {
        match &self.source {
            Source::Made { layout, .. } => layout.domain(),
            Source::Read(file) => file.domain(),
        }
    }

    /// All bodies as they start: in the order of their ids where they are made, in that of the file where they are read.
    pub fn iter(&self) -> impl Iterator<Item = Result<Body, SceneError>> + '_ {
        match &self.source {
            Source::Made { layout, statics, seed } => {
                let make = made(layout.as_ref(), statics.len(), *seed);
                Box::new((0..layout.bodies()).map(move |index| Ok(make(index)))) as BodyIter<'_>
            }
            Source::Read(file) => file.iter(),
        }
    }

    /// The bodies that start in any rectangle for which `meets` says yes, and perhaps some more, in the order of
    /// [`iter`](Self::iter); `meets` is asked of rectangles that hold many. Takes time for the bodies found, and for the boundaries
    /// of where they are; in files, for each group of rows, and for all that are not in groups which say where they are.
    pub fn near<'a>(
        &'a self,
        meets: impl Fn(DVec2, DVec2) -> bool + 'a,
    ) -> impl Iterator<Item = Result<Body, SceneError>> + 'a {
        let (layout, statics, seed) = match &self.source {
            Source::Made { layout, statics, seed } => (layout.as_ref(), statics.len(), *seed),
            Source::Read(file) => return file.near(meets),
        };
        let make = made(layout, statics, seed);
        let mut parts = vec![(0, layout.bodies())];
        let mut few = 0..0;
        let near = iter::from_fn(move || {
            loop {
                if let Some(index) = few.next() {
                    return Some(Ok(make(index)));
                }
                let (first, end) = parts.pop()?;
                if first == end {
                    continue;
                }
                let (low, high) = layout.extent(first, end - 1);
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
        });
        Box::new(near) as BodyIter<'a>
    }

    /// Where all bodies are, each with a one; of many that are made a sample, each with the number of those that it stands for.
    /// Files are read through, as the order of their rows is to make no difference.
    pub fn sample(&self) -> impl Iterator<Item = Result<(u64, DVec2), SceneError>> {
        let (layout, statics, seed) = match &self.source {
            Source::Made { layout, statics, seed } => (layout.as_ref(), statics.len(), *seed),
            Source::Read(file) => {
                let places = file.places().map(|place| Ok((1_u64, place?)));
                return Box::new(places) as Box<dyn Iterator<Item = _>>;
            }
        };
        let make = made(layout, statics, seed);
        let (bodies, samples) = (layout.bodies(), layout.bodies().min(SAMPLES));
        let begin = move |sample: u64| (u128::from(bodies) * u128::from(sample) / u128::from(samples)) as u64;
        Box::new((0..samples).map(move |sample| {
            let (first, end) = (begin(sample), begin(sample + 1));
            // Anywhere among them, so that none of them keeps time with the rows of a lattice.
            let index = first + SplitMix64::after(0, sample).bits() % (end - first);
            Ok((end - first, make(index).position))
        }))
    }

    /// Low and high corner of the rectangle that the center of a body of this scene must not leave: its room, or the whole
    /// domain. None if it is not one of this scene; of files, that is not asked.
    pub fn home(&self, id: GlobalId) -> Option<(DVec2, DVec2)> {
        match &self.source {
            Source::Made { layout, .. } => self.index(id).map(|index| layout.home(index)),
            Source::Read(file) => Some(file.domain()),
        }
    }

    /// Whether a body is outside its [`home`](Self::home).
    pub fn has_escaped(&self, body: &Body) -> bool {
        // What was added while it ran has no room of its own.
        let (low, high) = self.home(body.id).unwrap_or(self.domain());
        !(body.position.cmpge(low).all() && body.position.cmple(high).all())
    }

    /// The body of that name, as it starts. Files are looked through.
    ///
    /// # Errors
    /// If they cannot be read.
    pub fn find(&self, id: GlobalId) -> Result<Option<Body>, SceneError> {
        match &self.source {
            Source::Made { layout, statics, seed } => {
                Ok(self.index(id).map(made(layout.as_ref(), statics.len(), *seed)))
            }
            Source::Read(file) => file.iter().find(|body| body.as_ref().map_or(true, |body| body.id == id)).transpose(),
        }
    }

    /// That several bodies have this name, if files can be blamed for it.
    pub(crate) fn doubled(&self, id: GlobalId) -> Option<SceneError> {
        self.file().map(|file| file.doubled(id))
    }

    /// That far too many of some bodies are at one place, if files can be blamed for it.
    pub(crate) fn crowd(&self, bodies: &[Body]) -> Option<SceneError> {
        self.file().and_then(|file| file.crowd(&mut bodies.iter().map(place_of).collect::<Vec<_>>()))
    }

    /// That only so many bodies were found, if files can be blamed for it.
    pub(crate) fn lost(&self, found: u64) -> Option<SceneError> {
        self.file().filter(|file| file.count() != found).map(|file| file.lost(found))
    }

    /// The index of a body that is made.
    fn index(&self, id: GlobalId) -> Option<u64> {
        let Source::Made { layout, statics, .. } = &self.source else { return None };
        id.0.checked_sub(statics.len() as u64).filter(|index| *index < layout.bodies())
    }
}

/// What makes the body of an index. Ids follow those of the statics.
fn made(layout: &dyn Layout, statics: usize, seed: u64) -> impl Fn(u64) -> Body + '_ {
    move |index| layout.body(index, GlobalId(statics as u64 + index), seed)
}

/// The table of the reported mixture: a box and a circle.
fn mixture() -> Vec<Kind> {
    table([Shape::rectangle(0.2, 0.2), Shape::circle(0.2)])
}

/// A table of shapes of the usual material.
fn table<const N: usize>(shapes: [Shape; N]) -> Vec<Kind> {
    shapes.map(|shape| Kind::new(shape, Material::default())).to_vec()
}

/// The first or the second row of a table, each with probability 1/2. One draw.
fn random_kind(random: &mut SplitMix64) -> KindId {
    KindId(u32::from(random.coin()))
}

#[cfg(test)]
mod tests;
