//! The physics of Atoll: 2-D rigid bodies on tiles, stepped to the same bits however the tiles are spread.
//!
//! The domain is cut into tiles ([`TileGrid`]). A [`World`] holds the tiles of one rank; [`step`] makes one step of them
//! and reaches the other tiles through a [`Halo`]. One step of a tile is a pure function of its state and of the
//! messages it received, so the result depends on the tile grid, and not on ranks, threads or transports.
//!
//! No input or output here, no transport, and no clock in any result. All quantities are in SI units.
//!
//! # A world of two tiles
//!
//! The same as `examples/two_tiles.rs`: a halo of one's own, and a disc that flies from one tile into the other.
//!
//! ```
//! use atoll_core::*;
//! use glam::{DVec2, Vec2};
//!
//! struct Loopback; // both tiles live here: every message is delivered on the spot
//!
//! impl Halo for Loopback {
//!     type Error = std::convert::Infallible;
//!     fn exchange(&mut self, outbox: &mut Outbox, inbox: &mut Inbox) -> Result<(), Self::Error> {
//!         outbox.deliver(inbox);
//!         Ok(())
//!     }
//! }
//!
//! let grid = TileGrid::new(DVec2::ZERO, DVec2::new(20.0, 10.0), 2, 1)?;
//! let disc = Kind { shape: Shape::circle(0.2), material: Material::default() };
//! let blueprint = Blueprint { params: Params::default(), grid, kinds: vec![disc], statics: vec![] };
//! let mut world = World::new(&blueprint, &[TileId(0), TileId(1)])?;
//! world.add(Body {
//!     id: GlobalId(0),
//!     position: DVec2::new(9.0, 5.0),
//!     rotation: Rot::IDENTITY,
//!     velocity: Vec2::new(3.0, 0.0),
//!     angular_velocity: 0.0,
//!     kind: KindId(0),
//! })?;
//! let mut migrations = 0;
//! for _ in 0..60 {
//!     migrations += step(&mut world, &mut Loopback)?.migrations;
//! }
//! assert_eq!(migrations, 1);
//! assert!((world.bodies().next().unwrap().position.x - 12.0).abs() < 1e-5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Several ranks
//!
//! Give each rank's [`World`] its own tiles, and write a halo that hands what [`Outbox::deliver`] leaves to the other
//! ranks as bytes ([`Frames`], [`Inbox::decode`]) and the [`Verdict`] of each to all. At the end of a run [`finish`]
//! makes the closing exchange.
//!
//! # Saving
//!
//! [`World::save`] turns each tile into a block of bytes; [`World::restore`] turns it back, in any world that holds the
//! tile and has the same [`Blueprint`]; [`World::resume_at`] sets the number of the next step. What follows is the same,
//! bit for bit, as if the run had never stopped, whichever rank holds which tile. Where the bytes are kept is for the
//! caller to see to.
//!
//! # What determinism promises
//!
//! For one tile grid and one set of parameters: the same bits in debug and release builds, on every x86-64 processor,
//! at any vector width, on any ranks and threads. Other tile grids agree physically, not bitwise.

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

pub use exchange::codec::{FORMAT, Frames};
pub use exchange::halo::{Halo, Loopback, NotHere, Verdict};
pub use exchange::mail::{Inbox, Message, Outbox};
pub use exchange::record::{BorderImpulse, BorderPoint, ContactRecord, GhostRecord, GhostRefresh, Unseen};
pub use model::body::{Bodies, Body, StaticBody};
pub use model::contact::{Contact, ContactPoint};
pub use model::error::{CodecError, SetupError, StepError};
pub use model::id::{GlobalId, KindId, TileId};
pub use model::math::Rot;
pub use model::params::{BroadPhase, Exchange, Ghosts, IslandSearch, Parallel, Params, Solver};
pub use model::shape::{Kind, Material, Shape};
pub use state::facts::{Facts, TileFacts};
pub use state::hash::Hashes;
pub use state::snapshot::{RestoreError, SNAPSHOT_FORMAT, SavedTile};
pub use step::phase::{Phase, Timings};
pub use step::{StepReport, finish, measure, step};
pub use tiling::blueprint::{Blueprint, halo_width};
pub use tiling::partition::{Region, TileGrid};
pub use world::World;
