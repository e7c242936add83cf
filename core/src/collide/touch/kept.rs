//! What is kept of a contact of the last step: whose bodies press and hardly move is held as it is, and who rolls as he rolls on.

use super::{Approach, ROLLING, Side, TOUCHING};
use crate::collide::broad_phase::Pair;
use crate::collide::manifold::{Manifold, ManifoldPoint};
use crate::model::contact::{Contact, ContactPoint};
use crate::model::math::{dot, max, min};
use crate::model::params::Exchange;
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;

/// A contact's geometry may be kept only while each of the two turned by less than the first cosine (11 degrees), and what never moves but
/// by its path by less than the second (0.005 rad): it stays as it is, and would lag behind a table that is tilted, or a drum. What sways
/// in a stack finds its rest by what it has.
const RECYCLE_COSINE: f32 = 0.98;
const RECYCLE_COSINE_OF_STATICS: f32 = 0.999_987_5;

/// And while the two have moved by less than this part of the lesser half extent, and turned by less than that part of the way between their
/// points: arms that lag further behind hold up what tips.
const KEPT_BY_SIZE: f32 = 0.2;
const KEPT_BY_PATCH: f32 = 0.025;

/// Whether another tile has a copy of the two's contact and does not say how that pressed, as with exchange "step": then both take it
/// that it did.
#[inline(always)]
pub(super) fn is_shared(tile: &Tile, pair: Pair, setup: &Setup) -> bool {
    let ghosts = tile.owned..tile.owned + tile.ghosts();
    setup.params.exchange == Exchange::Step && pair.iter().any(|&body| ghosts.contains(&(body as usize)))
}

/// Whether the two pressed at each other in the last step, in the contact that they had then.
#[inline(always)]
pub(in crate::collide) fn pressed(tile: &Tile, pair: Pair, known: Option<&Contact>, setup: &Setup) -> bool {
    known.is_some_and(|known| known.presses() || is_shared(tile, pair, setup))
}

impl Approach<'_> {
    /// Whether the two pressed at each other, as far as both tiles know that have a copy of their contact.
    #[inline(always)]
    pub(super) fn pressed(&self, known: &Contact) -> bool {
        self.shared || known.presses()
    }

    /// The separations of a contact whose manifold still serves: they touch, press, and have hardly moved against each other.
    ///
    /// Source: contact recycling in Box2D v3.2 (E. Catto). Without it manifolds jump between features and piles jitter for ever. Bodies
    /// rock and roll on one point: an arm that lags behind them would drive them on.
    #[inline(always)]
    pub(super) fn recycle(&self, known: &Contact, setup: &Setup) -> Option<[f32; 2]> {
        let Approach { a, b, offset, .. } = self;
        if a.is_round() || b.is_round() || !self.pressed(known) {
            return None;
        }
        let touching = self.scale() * TOUCHING;
        let (turned_a, turned_b) = (known.rotation_a.to(a.rotation), known.rotation_b.to(b.rotation));
        let least = |side: &Side<'_>| if side.kind.inv_mass > 0.0 { RECYCLE_COSINE } else { RECYCLE_COSINE_OF_STATICS };
        if !(turned_a.c > least(a) && turned_b.c > least(b)) {
            return None;
        }
        let moved = turned_a.unrotate(*offset) - known.offset;
        let turns = |side: &Side<'_>| side.kind.inv_mass > 0.0 || side.angular_velocity != 0.0;
        let extent = |side: &Side<'_>| if turns(side) { side.kind.bounding_radius } else { 0.0 };
        let twist = turned_a.to(turned_b).s.abs() * max(extent(a), extent(b));
        let [twist_most, most] = if let [one, two] = known.points() {
            let [a, b] = [a, b].map(|side| min(side.kind.extent.x, side.kind.extent.y));
            let most = min(setup.params.recycle_distance, KEPT_BY_SIZE * min(a, b));
            [KEPT_BY_PATCH * (two.anchor - one.anchor).length(), most]
        } else {
            [f32::INFINITY, min(setup.params.recycle_distance, touching)]
        };
        if twist >= twist_most || dot(moved, moved).sqrt() + twist >= most {
            return None;
        }
        let shift = *offset - known.offset;
        let separation = known.points.map(|point| {
            let (arm_a, arm_b) = (point.anchor, point.anchor - known.offset);
            let swing = (turned_b.rotate(arm_b) - arm_b) - (turned_a.rotate(arm_a) - arm_a);
            point.separation + dot(shift + swing, known.normal)
        });
        let touches = |(point, now): (&ContactPoint, f32)| point.separation < touching && now < touching;
        known.points().iter().zip(separation).any(touches).then_some(separation)
    }

    /// The contact of a round body with what it has touched and still touches, slowly: that of the middle of the step, as in
    /// `wide/pairs.rs`, which tells why.
    pub(super) fn roll(&self, known: &Contact, setup: &Setup) -> Option<(Contact, [f32; 2])> {
        if !self.pressed(known) {
            return None;
        }
        let (mut then, scale) = (self.at(0.5 * setup.params.dt, f32::INFINITY), self.scale());
        let point = *then.manifold.nearest()?;
        let normal = then.manifold.normal;
        let on_a = self.a.swing(then.turning_a, point.anchor, normal);
        let on_b = self.b.swing(then.turning_b, point.anchor - then.offset, normal);
        let nearer = dot(self.between, normal) * then.time + (on_b - on_a);
        let now = point.separation - nearer;
        if nearer.abs() >= scale * ROLLING
            || now >= min(scale * TOUCHING, setup.params.speculative_distance)
            || then.manifold.is_distance()
        {
            return None;
        }
        // As if they had come so near at once, along the normal.
        let mut manifold = Manifold { normal, ..Manifold::EMPTY };
        manifold.push(ManifoldPoint { anchor: point.anchor - normal * (0.5 * nearer), separation: now, ..point });
        (then.manifold, then.offset, then.time) = (manifold, then.offset - normal * nearer, 0.0);
        self.contact(&then, Some(known), setup)
    }
}

/// The separations of a contact of boxes whose manifold still serves.
#[inline(always)]
pub(in crate::collide) fn recycle(tile: &Tile, pair: Pair, known: &Contact, setup: &Setup) -> Option<[f32; 2]> {
    Approach::new(tile, pair, setup).recycle(known, setup)
}
