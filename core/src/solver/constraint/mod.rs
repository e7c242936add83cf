//! Constraints between two bodies, laid out for vectors: groups of sixteen, their rows, and what a pass does to a group.
//!
//! | file | what it knows |
//! |---|---|
//! | `group.rs` | sixteen contacts side by side; one of them alone |
//! | `columns.rs` | one column of groups for each kind of constraint |
//! | `layout.rs` | in which group and lane each contact goes |
//! | `rows.rs` | how rows are made of contacts |
//! | `kernels.rs` | what passes do to a group |
//! | `groups.rs` | all of a tile's; how to find that of a contact |
//! | `restitution.rs` | what bounces, and in which order |
//! | `approach.rs` | how fast surfaces are as they meet |
//! | `bounce.rs` | the bounce of one contact |
//! | `energies.rs` | that bounces give no energy that nobody had |
//! | `late.rs` | what bounces lose of the step, made good |

mod approach;
mod bounce;
#[allow(unsafe_code)]
pub(crate) mod columns;
mod energies;
pub(crate) mod group;
pub(crate) mod groups;
pub(crate) mod kernels;
mod late;
pub(crate) mod layout;
mod restitution;
pub(crate) mod rows;
