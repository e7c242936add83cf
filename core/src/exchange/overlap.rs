//! Which tiles solve a contact.
//!
//! A tile solves the contacts of its bodies. With these alone it would push against ghosts whose own neighbours are missing, but
//! for what these did a substep ago, and border contacts would converge more slowly than others. So it solves contacts between
//! others' bodies as well, where both are near it: an overlapping domain decomposition (H. A. Schwarz, 1870; in the form in
//! which each part solves a little beyond its border and keeps what is its own: X.-C. Cai, M. Sarkis, "A restricted additive
//! Schwarz preconditioner for general sparse linear systems", 1999). Of such a contact only what it does to bodies within the
//! step is used; it is scratch otherwise. An owner tells how each of them pressed, in every step: begun without impulses it would give way,
//! and begun with those of scratch, each tile would come to press in its own way what may be pressed in many ways, as heaps of boxes
//! are, and what the tiles' mean leaves unbalanced would creep for ever.
//!
//! Who is near follows from bit-exact copies, so that who sends knows what who receives solves.

use crate::exchange::rim::RimBody;
use crate::model::id::TileId;
use crate::model::params::{Exchange, Ghosts, Params};
use crate::tiling::blueprint::Setup;
use crate::tiling::partition::Surroundings;
use crate::tiling::tile::Tile;
use glam::{DVec2, Vec2};

/// How far bodies are solved with that are heard of after every substep, as part of the width of the halo. More gains nothing;
/// what lies at the rim of the halo has too few neighbours there to be solved well.
const HEARD_OF: f64 = 0.75;

/// The same where a tile hears of them once a step.
const UNHEARD_OF: f64 = 1.0;

/// How far beyond its border a tile solves contacts, as part of the width of the halo. Frozen ghosts need no neighbours.
pub(crate) fn depth(params: &Params) -> Option<f64> {
    match (params.ghosts, params.exchange) {
        (Ghosts::Frozen, _) => None,
        (_, Exchange::Substep) => Some(HEARD_OF),
        (_, Exchange::Step) => Some(UNHEARD_OF),
    }
}

/// A body's place and the half extents of its grown AABB.
#[derive(Clone, Copy)]
pub(crate) struct Outline {
    place: DVec2,
    half: Vec2,
    /// How near a tile's region it may matter to it, in meters.
    halo: f64,
}

impl Outline {
    /// Of an owned body, or of a ghost as it was last heard of.
    #[inline]
    pub(crate) fn of(tile: &Tile, body: usize, setup: &Setup) -> Self {
        let body = tile.bodies.get(body);
        let half = setup.grown_half_extents(&body);
        Self { place: body.position, half, halo: setup.halo_of(body.kind, body.velocity) }
    }

    /// Of an owned body near the border.
    pub(crate) fn of_rim(body: &RimBody, setup: &Setup) -> Self {
        Self { place: body.body.position, half: body.half, halo: setup.halo_of(body.body.kind, body.body.velocity) }
    }

    /// Whether it is so near a tile that its contacts with others that are, and with statics, are solved there.
    #[inline]
    pub(crate) fn is_near(&self, tile: TileId, setup: &Setup) -> bool {
        setup.overlap.is_some_and(|depth| setup.partition.reaches(tile, self.place, self.half, depth))
    }

    /// Whether a tile that does not own it has it as a ghost.
    pub(crate) fn is_ghost_of(&self, tile: TileId, setup: &Setup) -> bool {
        setup.partition.reaches(tile, self.place, self.half, self.halo)
    }

    /// The tiles that have it as a ghost, or own it.
    #[inline]
    pub(crate) fn reached<'a>(
        &self,
        setup: &'a Setup,
        around: &'a Surroundings,
    ) -> impl Iterator<Item = TileId> + use<'a> {
        let half = self.half.as_dvec2() + DVec2::splat(self.halo);
        around.met(&setup.partition, self.place - half, self.place + half)
    }

    /// Whether all that its box meets is a ghost of that tile, whoever knows it, or lives there.
    pub(crate) fn is_within_halo_of(&self, tile: TileId, setup: &Setup) -> bool {
        let (region, (low, high)) = (setup.partition.region(tile), self.corners());
        let halo = DVec2::splat(setup.halo_width);
        (low.cmpge(region.min - halo) & high.cmple(region.max + halo)).all()
    }

    /// The corners of its box.
    pub(crate) fn corners(&self) -> (DVec2, DVec2) {
        let half = self.half.as_dvec2();
        (self.place - half, self.place + half)
    }

    /// The tiles that it is so near to.
    pub(crate) fn near(&self, setup: &Setup) -> impl Iterator<Item = TileId> {
        let near = |depth| setup.partition.reached(self.place, self.half, depth);
        setup.overlap.into_iter().flat_map(near)
    }
}
