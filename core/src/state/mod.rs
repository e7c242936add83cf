//! What is made of a state between steps: figures, fingerprints, and blocks of bytes to go on from.

pub(crate) mod facts;
pub(crate) mod figures;
pub(crate) mod hash;
mod layout;
pub(crate) mod questions;
pub(crate) mod snapshot;
mod sum;
pub(crate) mod view;
pub(crate) mod violation;
