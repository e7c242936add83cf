//! Tiles that stand still: a step that changed nothing changes nothing again.
//!
//! What a step makes of a tile follows from what the tile owns and remembers and from what came in. Where all its bodies sleep,
//! ghosts and statics are those of the step before, and that step left every contact as it found it, bit for bit, this one would
//! too: it is left out, and shows in no bit. Of such a tile a step costs what its ghosts cost. Within a step others hear nothing of bodies
//! that sleep: they stay where they are.

use crate::model::body::Body;
use crate::model::contact::ContactCache;
use crate::model::id::TileId;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::{Tile, TileCounts};
use bytemuck::cast_slice;
use glam::{DVec2, Vec2};

/// A tile in which all rest, as its last step began.
#[derive(Debug)]
pub(crate) struct Standstill {
    /// Ghosts and statics.
    others: Vec<Body>,
    /// The ghosts' owners, and for how long they had rested.
    owners: Vec<TileId>,
    rested: Vec<f32>,
    /// Low and high corner of all that its bodies and ghosts may touch.
    room: (DVec2, DVec2),
    /// What was counted in a step that changed nothing, once there has been one.
    counts: Option<TileCounts>,
}

/// What is known of a step of a tile before it is made.
#[derive(Default, Debug)]
pub(crate) enum Outlook {
    /// Nothing.
    #[default]
    Open,
    /// It begins as the one before began, with these contacts.
    Same(ContactCache),
    /// It changes nothing.
    StandsStill,
}

impl Outlook {
    pub(crate) fn stands_still(&self) -> bool {
        matches!(self, Self::StandsStill)
    }
}

/// More than the rounding of a place in a tile's own coordinates, in meters.
const ROUNDING: f64 = 0.01;

impl Standstill {
    fn of(tile: &Tile, setup: &Setup) -> Box<Self> {
        let dynamic = tile.owned + tile.ghosts();
        let room = (0..dynamic).fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), row| {
            let body = tile.bodies.get(row);
            let half = setup.grown_half_extents(&body).as_dvec2() + DVec2::splat(ROUNDING);
            (low.min(body.position - half), high.max(body.position + half))
        });
        let others = (tile.owned..tile.bodies.len()).map(|row| tile.bodies.get(row)).collect();
        let (owners, rested) = (tile.ghost_owners.clone(), tile.sleep.ghosts().to_vec());
        Box::new(Self { others, owners, rested, room, counts: None })
    }

    /// Whether what is around the tile is what it was, but for statics that move where nobody is.
    fn fits(&self, tile: &Tile, setup: &Setup) -> bool {
        let bytes = cast_slice::<f32, u8>;
        let is_same = |(before, row): (&Body, usize)| {
            let now = tile.bodies.get(row);
            bytemuck::bytes_of(before) == bytemuck::bytes_of(&now)
                || setup.is_static(now.id) && [before, &now].iter().all(|fixed| self.is_far(fixed, setup))
        };
        self.others.len() == tile.bodies.len() - tile.owned
            && self.owners == tile.ghost_owners
            && bytes(&self.rested) == bytes(tile.sleep.ghosts())
            && self.others.iter().zip(tile.owned..).all(is_same)
    }

    /// Whether a static comes to none of the bodies and ghosts in its step.
    fn is_far(&self, fixed: &Body, setup: &Setup) -> bool {
        let Body { position, rotation, velocity, angular_velocity, kind, .. } = *fixed;
        let half = setup.kind(kind).half_extents(rotation) + Vec2::splat(setup.swept(kind, velocity, angular_velocity));
        let (low, high) = self.room;
        let (from, to) = (position - half.as_dvec2(), position + half.as_dvec2());
        from.cmpgt(high).any() || to.cmplt(low).any()
    }

    /// Whether a step of the tile is known to change nothing, as long as nothing else comes in.
    pub(crate) fn is_known(&self) -> bool {
        self.counts.is_some()
    }
}

/// What is known of the step that a tile is about to make, when all has come in. Where it is left out, what it would count is counted.
/// `asked` tells that somebody wants to know more of the step.
pub(crate) fn look(tile: &mut Tile, asked: bool, setup: &Setup) -> Outlook {
    let begins_alike =
        tile.newcomers.is_empty() && tile.standstill.as_deref().is_some_and(|known| known.fits(tile, setup));
    if setup.params.sleep && !begins_alike {
        let dynamic = tile.owned + tile.ghosts();
        tile.sleep.wake_leaning(&tile.bodies.id[..dynamic], &tile.newcomers);
    }
    if !(tile.newcomers.is_empty() && tile.sleep.all_rest(tile.owned, setup)) {
        tile.standstill = None;
        return Outlook::Open;
    }
    match tile.standstill.as_deref().filter(|_| begins_alike) {
        None => {
            tile.standstill = Some(Standstill::of(tile, setup));
            Outlook::Open
        }
        Some(Standstill { counts: None, .. }) => Outlook::Same(tile.contacts.clone()),
        Some(_) if asked => Outlook::Open,
        Some(&Standstill { counts: Some(counts), .. }) => {
            let TileCounts { ghosts, far, fault, .. } = tile.counts;
            tile.counts = TileCounts { ghosts, far, fault, ..counts };
            tile.rim.is_known = true;
            Outlook::StandsStill
        }
    }
}

/// Notes, after a step, whether it changed anything.
pub(crate) fn note(tile: &mut Tile, outlook: &Outlook) {
    if let Outlook::Same(before) = outlook
        && let Some(standstill) = &mut tile.standstill
        && tile.counts.asleep == tile.owned as u64
        && tile.contacts.is_same(before)
    {
        standstill.counts = Some(tile.counts);
    }
}
