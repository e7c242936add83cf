//! The rim of a tile: its bodies that other tiles may have to hear of, as the end of a step leaves them. They are written down
//! while they are at hand, so that nothing else of the tile is looked at for them before the next step.

use crate::model::body::Body;
use crate::tiling::blueprint::Setup;
use crate::tiling::partition::Region;
use crate::tiling::tile::Tile;
use glam::{DVec2, Vec2};

/// The bodies of a tile's rim, in the tile's order.
#[derive(Default, Debug)]
pub(crate) struct Rim {
    pub(crate) bodies: Vec<RimBody>,
    /// Whether that is so: not before the first step, nor where bodies have changed since.
    pub(crate) is_known: bool,
}

/// An owned body that may concern other tiles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RimBody {
    pub(crate) body: Body,
    /// Half extents of its grown AABB, in m.
    pub(crate) half: Vec2,
    /// Among the tile's bodies.
    pub(crate) index: u32,
}

impl RimBody {
    /// The body, if its grown AABB comes within the halo of a border of the tile whose region this is, or it has left that.
    #[inline]
    pub(crate) fn of(body: Body, index: u32, region: &Region, setup: &Setup) -> Option<Self> {
        let half = setup.grown_half_extents(&body);
        let reach = half.as_dvec2() + DVec2::splat(setup.halo_of(body.kind, body.velocity));
        let is_within = region.contains(body.position - reach) & region.contains(body.position + reach);
        (!is_within).then_some(Self { body, half, index })
    }
}

impl Rim {
    /// That of a tile, if it is not known yet.
    pub(crate) fn find(tile: &mut Tile, setup: &Setup) {
        let Tile { rim, bodies, region, owned, .. } = tile;
        if rim.is_known {
            return;
        }
        // Most are so far inside that their place alone tells.
        let interior = region.shrunk(setup.inset(false));
        let may_be = |&i: &usize| {
            !interior.contains(bodies.position[i])
                || setup.goes_far(bodies.velocity[i])
                || setup.is_large(bodies.kind[i])
        };
        let of = |i| RimBody::of(bodies.get(i), i as u32, region, setup);
        rim.bodies.clear();
        rim.bodies.extend((0..*owned).filter(may_be).filter_map(of));
    }
}
