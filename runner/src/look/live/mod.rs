//! See it live: a page in the browser that shows a run while it goes on, or what runs have recorded.
//!
//! The page says what it looks at; each rank draws its part of that, and rank 0 puts the parts together and hands them to the
//! server. A page has one frame at a time, and who looks at nothing costs nothing.

mod desk;
mod figures;
mod host;
mod player;
mod protocol;
mod question;
mod scenery;
mod server;
mod sketch;

pub(crate) use desk::Desk;
pub(crate) use host::Viewer;
pub(crate) use player::Player;
pub(crate) use server::Server;
