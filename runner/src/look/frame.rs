//! What there is to see of a run: what stays as it is, and what is there after a step. Wherever it comes from, a recording or
//! a run under way, pictures and files for other programs are made of this.

use crate::folder::recording::Row;
use crate::wording;
use atoll_core::{Kind, Partition, StaticBody};
use glam::DVec2;
use std::borrow::Cow;
use std::sync::Arc;

/// What stays as it is throughout a run.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Setting {
    /// The tiles of the domain; where they change, those of the beginning.
    pub partition: Partition,
    /// Shapes and materials, which bodies refer to by number.
    pub kinds: Vec<Kind>,
    /// What the scene calls the first of them, where it does.
    pub names: Vec<Option<String>>,
    /// What never moves, or as its path has it.
    pub statics: Vec<StaticBody>,
    /// Steps in a second.
    pub hertz: f64,
}

impl Setting {
    /// What the scene calls a kind, or else its shape.
    pub(crate) fn name_of(&self, kind: usize) -> String {
        let name = self.names.get(kind).cloned().flatten();
        name.unwrap_or_else(|| self.kinds.get(kind).map_or(String::new(), |kind| wording::shape(&kind.shape)))
    }

    /// Statics where they are after so many steps, for those that have a path move.
    pub(crate) fn statics_at(&self, step: u64) -> impl Iterator<Item = Cow<'_, StaticBody>> {
        let dt = (1.0 / self.hertz) as f32;
        self.statics.iter().map(move |fixed| {
            if fixed.path.is_none() {
                return Cow::Borrowed(fixed);
            }
            let (position, rotation) = fixed.pose(step, dt);
            Cow::Owned(StaticBody { position, rotation, ..fixed.clone() })
        })
    }
}

/// What is there after a step. Used again, it allocates nothing.
#[derive(Clone, Default, Debug)]
pub(crate) struct Frame {
    /// Steps made.
    pub step: u64,
    /// The dynamic bodies: those of one rank after those of another.
    pub bodies: Vec<Row>,
    /// The tiles, if they may change in the run.
    pub tiling: Option<Arc<Partition>>,
    /// Ranks, ascending, and where the bodies of each end.
    pub ranks: Vec<(u32, usize)>,
    /// What only a run under way knows.
    pub live: Option<Live>,
}

impl Frame {
    /// The tiles of this step.
    pub(crate) fn partition<'a>(&'a self, setting: &'a Setting) -> &'a Partition {
        self.tiling.as_deref().unwrap_or(&setting.partition)
    }
}

/// What is known while a run is under way, and not recorded.
#[derive(Clone, Default, Debug)]
pub(crate) struct Live {
    /// For each body how many contacts it has.
    pub contacts: Vec<u16>,
    /// For each body whether it sleeps.
    pub asleep: Vec<bool>,
    /// Copies of bodies that tiles hold of their neighbours', each with the tile that holds it.
    pub ghosts: Vec<(Row, u32)>,
    /// Where contacts are, each counted once, with the impulse along their normal in N s.
    pub points: Vec<(DVec2, f32)>,
    /// For each tile the rank that holds it.
    pub rank_of_tile: Vec<u32>,
}
