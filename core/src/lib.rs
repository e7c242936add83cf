//! The physics of Atoll: 2-D rigid bodies on tiles, stepped to the same bits however the tiles are spread.
//!
//! The domain is cut into tiles ([`Partition`]). A [`World`] holds the tiles of one rank; [`step`] makes one step of them
//! and reaches the other tiles through a [`Halo`]. One step of a tile is a pure function of its state and of the
//! messages it received, so the result depends on the tile grid, and not on ranks, threads or transports.
//!
//! No input or output here, no transport, and no clock in any result. All quantities are in SI units.
//!
//! # A box falls on a floor
//!
//! The same as `examples/hello.rs`:
//!
//! ```
//! use atoll_core::*;
//! use atoll_core::glam::{DVec2, Vec2};
//!
//! let solid = |width, height| Kind::new(Shape::rectangle(width, height), Material::default());
//! let blueprint = Blueprint {
//!     params: Params { gravity: Vec2::new(0.0, -10.0), ..Params::default() },
//!     partition: Partition::uniform(DVec2::ZERO, DVec2::splat(10.0), 1, 1)?,
//!     kinds: vec![solid(1.0, 1.0)],
//!     statics: vec![StaticBody::new(GlobalId(0), solid(20.0, 2.0), DVec2::new(5.0, -1.0))],
//! };
//! let mut world = World::whole(&blueprint)?;
//! world.add(Body::at_rest(GlobalId(1), KindId(0), DVec2::new(5.0, 4.5)))?;
//! for _ in 0..120 {
//!     step(&mut world, &mut Loopback)?;
//! }
//! let facts = Facts::total(measure(&world, &mut Loopback)?);
//! assert_eq!(facts.contacts, 1);
//! assert!((world.bodies().next().unwrap().position.y - 0.5).abs() < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Bodies that come and go
//!
//! Between two steps [`World::insert`], [`World::get`], [`World::remove`] take bodies by their names, in a time that does not depend on
//! how many there are; [`World::command`] strikes and pushes them, or turns gravity; [`World::cast_ray`], [`World::in_rectangle`],
//! [`World::at_point`] and [`World::touching`] ask what is where. `examples/drive.rs` does all of it.
//!
//! # Threads
//!
//! [`step`], [`measure`], [`World::save`] and [`World::hashes`] work on the threads of the rayon pool they are called in:
//! outside of any pool, the global one, which has a thread for each core unless `RAYON_NUM_THREADS` says otherwise. A pool
//! of one's own sets their number: `ThreadPoolBuilder::new().num_threads(4).build()?.install(|| step(…))`. How many there
//! are changes no bit of a result. Outside of a pool a world of some hundred bodies is stepped by the calling thread alone, as
//! others would have to be woken in each stage of a step; within one they help.
//!
//! # Several ranks
//!
//! Give each rank's [`World`] its own tiles, and write a [`Halo`] that turns what is for tiles of other ranks into bytes
//! ([`Frames`], [`Inbox::decode`]), delivers the rest ([`Outbox::deliver`]), and brings the [`Verdict`] of each to all;
//! `examples/two_tiles.rs` has a halo of its own, if for one rank. At the end of a run [`finish`] makes the closing
//! exchange.
//!
//! # Debug builds of your own
//!
//! What is compiled without any optimization needs megabytes of stack for a step, more than a thread has if nobody asks for more, and is many
//! times as slow. Your program may be debugged all the same with this in the `Cargo.toml` of its workspace:
//!
//! ```toml
//! [profile.dev.package.atoll-core]
//! opt-level = 1
//! ```
//!
//! # What there is not
//!
//! Joints; statics that come, go or are moved by hand (what moves them is a [`Path`], known from the beginning); a body put elsewhere but by
//! [`World::remove`] and [`World::add`]; shapes cast along a way, and rays that go on behind what they hit first; other steps than those of
//! [`Params::dt`] while a world lasts.
//!
//! # Saving
//!
//! [`World::save`] turns each tile into a block of bytes; [`World::restore`] turns it back, in any world that holds the
//! tile and has the same [`Blueprint`]; [`World::resume_at`] sets the number of the next step. What follows is the same,
//! bit for bit, as if the run had never stopped, whichever rank holds which tile. Where the bytes are kept is for the
//! caller to see to; and so is what a [`Command`] did to the world beside its bodies: kinds that were added (add them before tiles are
//! restored), gravity, forces that push yet (begin them after `resume_at`), and that [`World::insert`] gives no name again.
//!
//! # What determinism promises
//!
//! For one tile grid and one set of parameters: the same bits in debug and release builds, on every x86-64 and aarch64
//! processor, at any vector width, on any ranks and threads. Other tile grids agree physically, not bitwise.

#![deny(unsafe_code)]

mod collide;
mod exchange;
pub mod islands;
mod model;
mod parallel;
mod solver;
mod state;
mod step;
#[cfg(test)]
mod testing;
mod tiling;
mod world;

/// The vectors that are spoken of here, in the version that is meant.
pub use glam;

pub use exchange::codec::{FORMAT, Frames};
pub use exchange::halo::{Halo, Loopback, NotHere};
pub use exchange::mail::{Inbox, Message, Outbox};
pub use exchange::record::{
    BorderImpulse, BorderPoint, ContactRecord, GhostRecord, GhostRefresh, MigrantRecord, Unseen,
};
pub use exchange::verdict::Verdict;
pub use model::body::{Bodies, Body, StaticBody};
pub use model::contact::{Contact, ContactPoint};
pub use model::error::{BodyFault, CodecError, SetupError, StepError};
pub use model::id::{GlobalId, KindId, TileId};
pub use model::kind::{Dynamics, Filter, Kind, Material};
pub use model::math::Rot;
pub use model::params::{BroadPhase, Exchange, Ghosts, Instructions, IslandSearch, Parallel, Params, Solver};
pub use model::path::{Path, Travel};
pub use model::shape::{Compound, MOST_CORNERS, MOST_PARTS, Part, Polygon, Segment, Shape, ShapeError};
pub use state::facts::{Facts, TileFacts};
pub use state::figures::Figures;
pub use state::hash::Hashes;
pub use state::questions::{RayHit, pairs_not_in};
pub use state::snapshot::{RestoreError, SNAPSHOT_FORMAT, SavedTile};
pub use state::view::{ContactView, TileView};
pub use step::phase::{Phase, Timings};
pub use step::{StepReport, finish, measure, step};
pub use tiling::blueprint::{Blueprint, halo_width};
pub use tiling::partition::{Adaptive, Bisecting, Bisector, Census, Change, Decision, Load, Partition, Region, Tally};
pub use world::{Clock, Command, World};
