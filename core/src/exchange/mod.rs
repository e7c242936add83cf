//! What tiles tell each other: the messages and their bytes, bodies that change owner, ghosts, and the border impulses.

pub(crate) mod border;
pub(crate) mod codec;
pub(crate) mod far;
pub(crate) mod halo;
pub(crate) mod mail;
pub(crate) mod migrate;
pub(crate) mod overlap;
pub(crate) mod record;
pub(crate) mod rim;
pub(crate) mod unseen;
pub(crate) mod verdict;
