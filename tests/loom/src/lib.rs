//! Model checks of what threads and processes share, by [loom](https://docs.rs/loom): the very files that core and transport are
//! made of, alone, as loom puts its own words in the place of those of the standard library.
//!
//! ```sh
//! RUSTFLAGS="--cfg loom" CARGO_TARGET_DIR=target/loom cargo test --release -p atoll-loom
//! ```

#![cfg(loom)]
// What only others use of them.
#![allow(dead_code, unreachable_pub)]

#[path = "../../../core/src/parallel/crew/mod.rs"]
mod crew;
#[path = "../../../transport/src/seat/mod.rs"]
mod seat;
