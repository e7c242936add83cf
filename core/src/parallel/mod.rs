//! Doing many things at once: threads that work inside one tile, and lanes of a vector register.
//!
//! None of it shows in a result: work is cut by what is to be done, never by who does it.

#[allow(unsafe_code)]
pub(crate) mod ahead;
pub(crate) mod crew;
#[allow(unsafe_code)]
pub(crate) mod lanes;
pub(crate) mod schedule;
#[allow(unsafe_code)]
pub(crate) mod shared;
pub(crate) mod team;
pub(crate) mod vectors;
