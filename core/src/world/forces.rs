//! Forces that push at bodies for some steps.

use super::World;
use super::locator::Place;
use crate::model::id::GlobalId;
use crate::step::phase::Phase;
pub(crate) use crate::tiling::pushes::Load;
use rustc_hash::FxHashMap;

/// What pushes at a body for some steps.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Force {
    id: GlobalId,
    load: Load,
    /// Steps to come.
    left: u64,
}

impl Force {
    pub(super) fn new(id: GlobalId, load: Load, steps: u64) -> Self {
        Self { id, load, left: steps }
    }
}

impl World {
    /// Before a step: adds up the forces upon each body, which wakes, and strikes with what of them comes as a blow.
    pub(crate) fn push(&mut self) {
        if !self.loads.is_empty() {
            self.loads.clear();
            self.tiles.iter_mut().for_each(|tile| tile.pushes.clear());
        }
        let mut loads: FxHashMap<GlobalId, Load> = std::mem::take(&mut self.loads);
        for Force { id, load, left } in &mut self.forces {
            loads.entry(*id).or_default().add(*load);
            *left -= 1;
        }
        self.forces.retain(|force| force.left > 0);
        for (&id, load) in &loads {
            // The step says who is no longer finite.
            self.change(id, |world, body| Ok(load.strike(body, &world.setup))).expect("nothing is refused");
            if let Some(Place { tile, at }) = self.look_up(id) {
                self.tiles[tile as usize].push_at(at, load, &self.setup);
            }
        }
        self.loads = loads;
    }

    /// Forgets the forces upon a body that goes: another may come by its name.
    pub(super) fn stop_pushing(&mut self, id: GlobalId) {
        self.forces.retain(|force| force.id != id);
    }

    /// Once bodies are with their tiles, and their ghosts: lets each tile know who of them is pushed.
    pub(crate) fn aim(&mut self) {
        if !self.loads.is_empty() {
            let (loads, has_changed) = (std::mem::take(&mut self.loads), self.borders_moved);
            self.each_tile(|bench| bench.stage(Phase::Migrate, |b| b.tile.aim(&loads, has_changed, b.setup)));
            self.loads = loads;
        }
    }
}
