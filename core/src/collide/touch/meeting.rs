//! Bodies made of pieces: which of these may touch, two by two, and what comes of each two.

use super::Approach;
use crate::collide::broad_phase::Pair;
use crate::collide::manifold::chain::Lies;
use crate::collide::piece_boxes::PieceBoxes;
use crate::collide::wide::moments::{Points, WidePieces};
use crate::model::contact::Contact;
use crate::model::piece::Piece;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// Two pieces of a pair of bodies that may touch, and what came of it.
pub(in crate::collide) struct Meeting<'a> {
    bodies: Pair,
    pieces: [&'a Piece; 2],
    features: u32,
    /// The contact that they had in the last step.
    known: Option<&'a Contact>,
    /// Where one of them is a segment.
    lies: Lies,
    pub(in crate::collide) outcome: Met,
}

/// What comes of two pieces.
pub(in crate::collide) enum Met {
    Nothing,
    /// The contact that is known, whose points have these separations now.
    Known([f32; 2]),
    Found(Contact, [f32; 2]),
    /// It is not known yet.
    Open,
}

impl<'a> Meeting<'a> {
    /// Whether a piece meets a segment of a chain.
    pub(in crate::collide) fn is_on_segment(&self) -> bool {
        self.pieces.iter().any(|piece| piece.side.is_some())
    }

    /// Looks again, which only those need that are open.
    pub(in crate::collide) fn touch(&mut self, tile: &Tile, setup: &Setup) {
        let mut pair = Approach::new(tile, self.bodies, setup);
        (pair.pieces, pair.features, pair.lies) = (Some(self.pieces), self.features, self.lies);
        self.outcome = Met::from(pair.touch_unless_passing(self.known, setup));
    }

    /// Puts it into a lane.
    #[inline(always)]
    pub(in crate::collide) fn set<S: WidePieces>(&self, lane: usize, to: &mut S, tile: &Tile, setup: &Setup) {
        to.pairs().set(lane, tile, self.bodies, self.known, setup);
        to.set_pieces(lane, self.pieces, self.lies);
    }

    /// Takes what was seen of it in a lane.
    #[inline(always)]
    pub(in crate::collide) fn see(&mut self, lane: usize, points: &Points) {
        let found = points.meets(lane).then(|| points.contact(lane, self.features, self.known));
        self.outcome = Met::from(found);
    }

    /// The contact, if there is one, and the separations of its points now.
    pub(in crate::collide) fn contact(&self) -> Option<(&Contact, [f32; 2])> {
        match &self.outcome {
            Met::Nothing => None,
            Met::Known(separation) => self.known.map(|known| (known, *separation)),
            Met::Found(contact, separation) => Some((contact, *separation)),
            Met::Open => unreachable!("all are looked at"),
        }
    }
}

impl From<Option<(Contact, [f32; 2])>> for Met {
    fn from(found: Option<(Contact, [f32; 2])>) -> Self {
        found.map_or(Self::Nothing, |(contact, separation)| Self::Found(contact, separation))
    }
}

/// Tells which pieces of two bodies may touch: in their order, and what comes of
/// those that had a contact that still serves, or of which one is a disc and none a segment. `known` are the contacts of the
/// last step.
pub(in crate::collide) fn meet<'a>(
    tile: &Tile,
    bodies: Pair,
    boxes: &PieceBoxes,
    known: &[&'a Contact],
    setup: &'a Setup,
    mut met: impl FnMut(Meeting<'a>),
) {
    let mut pair = Approach::new(tile, bodies, setup);
    // Who touched will hardly have gone so far.
    if known.is_empty() && pair.pass_by(setup) {
        return;
    }
    let far = pair.far(setup.params.dt);
    let is_slow = far < setup.params.speculative_distance;
    let rolls = pair.a.is_round() || pair.b.is_round();
    let [pieces_a, pieces_b] = [&pair.a.kind, &pair.b.kind].map(|kind| &kind.pieces[..]);
    let offset = pair.offset;
    let mut meet = |number_a: usize, number_b: usize| {
        let (pieces, features) =
            ([&pieces_a[number_a], &pieces_b[number_b]], Contact::features_of(number_a as u32, number_b as u32));
        (pair.pieces, pair.features) = (Some(pieces), features);
        let known = known.iter().copied().find(|known| known.pieces() == features);
        let mut lies = None;
        let kept = known.filter(|_| is_slow && !rolls).and_then(|known| pair.recycle(known, setup));
        let outcome = match kept {
            Some(separation) => Met::Known(separation),
            None if pieces.iter().all(|piece| piece.has_faces()) => Met::Open,
            None if !pair.is_solid() => {
                lies = super::lies(pieces, known, setup);
                Met::Open
            }
            None => Met::from(pair.roll_or_touch(known, far, setup)),
        };
        met(Meeting { bodies, pieces, features, known, lies, outcome });
    };
    if pieces_a.len() * pieces_b.len() == 1 {
        meet(0, 0);
    } else {
        let far = setup.params.speculative_distance + far;
        boxes.each_near(bodies, tile, setup, (offset, far), meet);
    }
}
