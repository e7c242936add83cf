//! x

mod body;
mod border;
mod broad_phase;
mod codec;
mod contact;
mod error;
mod facts;
mod halo;
mod hash;
mod id;
pub mod island;
mod manifold;
mod math;
mod migrate;
mod narrow_phase;
mod params;
mod partition;
mod phase;
mod setup;
mod shape;
mod solver;
mod step;
mod tile;
mod world;

pub use body::{Bodies, Body, StaticBody};
pub use codec::FORMAT;
pub use contact::{Contact, ContactPoint};
pub use error::{CodecError, SetupError, StepError};
pub use facts::{Facts, TileFacts};
pub use halo::{
    BorderImpulse, BorderPoint, ContactRecord, GhostRecord, GhostRefresh, Halo, Inbox, Message, Outbox, Unseen, Verdict,
};
pub use hash::Hashes;
pub use id::{GlobalId, KindId, TileId};
pub use math::Rot;
pub use params::{BroadPhase, Exchange, Params, Solver};
pub use partition::{Region, TileGrid};
pub use phase::{Phase, Timings};
pub use setup::Blueprint;
pub use shape::{Kind, Material, Shape};
pub use step::{StepReport, finish, step};
pub use world::World;
