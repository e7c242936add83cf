//! Contacts that outlive a step: their manifolds and impulses, and the cache that keeps them.

use crate::model::math::{Rot, cross, max, right_perp};
use crate::model::shape::MOST_PARTS;
use bytemuck::{Pod, Zeroable};
use glam::Vec2;

/// One point of a contact.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct ContactPoint {
    /// Where it lies, from the center of body A when the manifold was made, in meters.
    pub anchor: Vec2,
    /// Distance of the two surfaces when the manifold was made; negative: overlap. In meters.
    pub separation: f32,
    /// Impulse along the normal in the last substep, in N s.
    pub normal_impulse: f32,
    /// Impulse along the tangent in the last substep, in N s.
    pub tangent_impulse: f32,
    /// Which corners, edges or faces touch; [`ContactPoint::ABSENT`] where there is no point.
    pub feature: u32,
}

impl ContactPoint {
    /// The feature of a point that is not there.
    pub const ABSENT: u32 = u32::MAX;

    /// A point that is not there.
    pub(crate) const NONE: Self =
        Self { anchor: Vec2::ZERO, separation: 0.0, normal_impulse: 0.0, tangent_impulse: 0.0, feature: Self::ABSENT };
}

/// Bits of a feature that tell apart those of two convex pieces, and then bits for each of the pieces' numbers.
const FEATURE_BITS: u32 = 10;
const PIECE_BITS: u32 = 8;
const PIECES: u32 = 1 << PIECE_BITS;
const _: () = assert!(MOST_PARTS <= PIECES as usize);

/// A contact of body A, the one with the lower GlobalId, and body B. Its manifold is kept for as long as the two hardly
/// move against each other ([`Params::recycle_distance`](crate::Params::recycle_distance)).
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Contact {
    /// Unit vector from A to B when the manifold was made.
    pub normal: Vec2,
    /// Center of B minus center of A when it was made, in meters.
    pub offset: Vec2,
    /// Rotation of A when it was made.
    pub rotation_a: Rot,
    /// Rotation of B when it was made.
    pub rotation_b: Rot,
    /// One or two points; the first is always there.
    pub points: [ContactPoint; 2],
}

impl Contact {
    /// The points that are there.
    #[inline]
    pub fn points(&self) -> &[ContactPoint] {
        &self.points[..self.point_count()]
    }

    /// One or two.
    #[inline(always)]
    pub fn point_count(&self) -> usize {
        1 + usize::from(self.points[1].feature != ContactPoint::ABSENT)
    }

    /// Whether its bodies pressed at each other in the end of the last step, and did not give all of that back.
    #[inline(always)]
    pub(crate) fn presses(&self) -> bool {
        self.points.iter().any(|point| point.normal_impulse > 0.0)
    }

    /// Which of their convex pieces touch, as their features say: those of the first body, then those of the second, above what tells
    /// apart the features of two pieces. Zero for circles and boxes.
    pub(crate) fn pieces(&self) -> u32 {
        self.points[0].feature & Self::features_of(PIECES - 1, PIECES - 1)
    }

    /// The numbers of those pieces.
    pub(crate) fn piece_numbers(&self) -> [usize; 2] {
        let numbers = self.points[0].feature >> FEATURE_BITS;
        [numbers >> PIECE_BITS, numbers].map(|number| (number & (PIECES - 1)) as usize)
    }

    /// The part of a feature that names two pieces.
    pub(crate) fn features_of(piece_a: u32, piece_b: u32) -> u32 {
        (piece_a << PIECE_BITS | piece_b) << FEATURE_BITS
    }

    pub(crate) fn is_finite(&self) -> bool {
        let point = |point: &ContactPoint| {
            point.anchor.is_finite()
                && point.separation.is_finite()
                && point.normal_impulse.is_finite()
                && point.tangent_impulse.is_finite()
        };
        self.normal.is_finite()
            && self.offset.is_finite()
            && self.rotation_a.is_finite()
            && self.rotation_b.is_finite()
            && self.points.iter().all(point)
    }

    /// The stored impulses' sum upon body B, and its moments about the centers of A (upon A) and of B (upon B). Body A
    /// feels the opposite impulse.
    pub(crate) fn impulse(&self) -> (Vec2, f32, f32) {
        let tangent = right_perp(self.normal);
        let (mut sum, mut on_a, mut on_b) = (Vec2::ZERO, 0.0, 0.0);
        for point in self.points() {
            let p = self.normal * point.normal_impulse + tangent * point.tangent_impulse;
            // Friction acts at the surfaces, as in the rows of the solver.
            let gap = 0.5 * max(point.separation, 0.0) * point.tangent_impulse;
            sum += p;
            on_a -= cross(point.anchor, p) + gap;
            on_b += cross(point.anchor - self.offset, p) - gap;
        }
        (sum, on_a, on_b)
    }
}

/// Which body of a tile: an owned one, a ghost, or a static, each counted from zero. Sorted in that order.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct Slot(u32);

/// A [`Slot`] taken apart.
pub(crate) enum SlotKind {
    Owned(usize),
    Ghost(usize),
    Static(usize),
}

impl Slot {
    const GHOST: u32 = 1 << 30;
    const STATIC: u32 = 1 << 31;

    /// From an index into owned, ghosts and statics, one after the other.
    #[inline(always)]
    pub(crate) fn from_index(index: usize, owned: usize, ghosts: usize) -> Self {
        if index < owned {
            Self(index as u32)
        } else if index < owned + ghosts {
            Self((index - owned) as u32 | Self::GHOST)
        } else {
            Self((index - owned - ghosts) as u32 | Self::STATIC)
        }
    }

    #[inline(always)]
    pub(crate) fn kind(self) -> SlotKind {
        if self.0 < Self::GHOST {
            SlotKind::Owned(self.0 as usize)
        } else if self.0 < Self::STATIC {
            SlotKind::Ghost((self.0 & !Self::GHOST) as usize)
        } else {
            SlotKind::Static((self.0 & !Self::STATIC) as usize)
        }
    }

    #[inline(always)]
    pub(crate) fn is_ghost(self) -> bool {
        self.0 & Self::GHOST != 0
    }

    /// Back to an index into owned, ghosts and statics, one after the other.
    #[inline(always)]
    pub(crate) fn index(self, owned: usize, ghosts: usize) -> usize {
        match self.kind() {
            SlotKind::Owned(i) => i,
            SlotKind::Ghost(g) => owned + g,
            SlotKind::Static(s) => owned + ghosts + s,
        }
    }
}

/// Two slots, the lower first. Contacts of owned bodies come first, therefore, and those that a tile solves for others after them.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Debug, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct PairKey(u64);

impl PairKey {
    #[inline(always)]
    pub(crate) fn new(low: Slot, high: Slot) -> Self {
        debug_assert!(low < high);
        Self(u64::from(low.0) << 32 | u64::from(high.0))
    }

    #[inline(always)]
    pub(crate) fn low(self) -> Slot {
        Slot((self.0 >> 32) as u32)
    }

    #[inline(always)]
    pub(crate) fn high(self) -> Slot {
        Slot(self.0 as u32)
    }

    /// Whether one of the bodies is owned, or else the contact is one of others, and solved here for their sake.
    #[inline(always)]
    pub(crate) fn is_own(self) -> bool {
        matches!(self.low().kind(), SlotKind::Owned(_))
    }

    /// Whether the higher one is a static.
    #[inline(always)]
    pub(crate) fn is_with_static(self) -> bool {
        matches!(self.high().kind(), SlotKind::Static(_))
    }

    /// Whether the bodies belong to two tiles, of which this is one: then both remember the contact.
    #[inline(always)]
    pub(crate) fn is_border(self) -> bool {
        self.is_own() && matches!(self.high().kind(), SlotKind::Ghost(_))
    }
}

/// The contacts a tile solved, in canonical order: ascending by the slots of their bodies.
#[derive(Clone, Default, Debug)]
pub(crate) struct ContactCache {
    pub(crate) keys: Vec<PairKey>,
    pub(crate) contacts: Vec<Contact>,
}

impl ContactCache {
    pub(crate) fn len(&self) -> usize {
        self.keys.len()
    }

    /// How many are of owned bodies: these come first.
    pub(crate) fn own(&self) -> usize {
        self.keys.partition_point(|key| key.is_own())
    }

    pub(crate) fn clear(&mut self) {
        self.keys.clear();
        self.contacts.clear();
    }

    /// Becomes a copy of others.
    pub(crate) fn copy_from(&mut self, keys: &[PairKey], contacts: &[Contact]) {
        self.clear();
        self.reserve(keys.len());
        self.keys.extend_from_slice(keys);
        self.contacts.extend_from_slice(contacts);
    }

    /// Whether another has the same, bit for bit.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let bytes = bytemuck::cast_slice::<Contact, u8>;
        self.keys == other.keys && bytes(&self.contacts) == bytes(&other.contacts)
    }

    /// Has so many contacts, which are yet to be written.
    pub(crate) fn resize(&mut self, count: usize) {
        self.reserve(count);
        self.keys.resize(count, PairKey::default());
        self.contacts.resize(count, Contact::zeroed());
    }

    /// Makes room for little more than is needed: there is one cache per tile.
    fn reserve(&mut self, count: usize) {
        if self.keys.capacity() < count {
            self.keys.reserve_exact(count + count / 8 - self.keys.len());
            self.contacts.reserve_exact(count + count / 8 - self.contacts.len());
        }
    }

    /// Those of the pair whose first contact is at this place.
    pub(crate) fn all_from(&self, first: usize) -> &[Contact] {
        let count = self.keys[first..].iter().take_while(|&&other| other == self.keys[first]).count();
        &self.contacts[first..][..count]
    }

    #[cfg(test)]
    pub(crate) fn push(&mut self, key: PairKey, contact: Contact) {
        self.keys.push(key);
        self.contacts.push(contact);
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (PairKey, &Contact)> {
        self.keys.iter().copied().zip(&self.contacts)
    }

    /// Keeps those whose key is to stay.
    pub(crate) fn retain(&mut self, stays: impl Fn(PairKey) -> bool) {
        let mut keys = self.keys.iter();
        self.contacts.retain(|_| keys.next().is_some_and(|&key| stays(key)));
        self.keys.retain(|&key| stays(key));
    }

    /// Gives every slot a new number; those of one kind stay in their order.
    pub(crate) fn renumber(&mut self, new_slot: impl Fn(Slot) -> Slot) {
        for key in &mut self.keys {
            *key = PairKey::new(new_slot(key.low()), new_slot(key.high()));
        }
    }

    /// Renames every slot and restores the order.
    pub(crate) fn rename(&mut self, new_slot: impl Fn(Slot) -> Slot) {
        let mut order: Vec<(PairKey, u32)> = self
            .keys
            .iter()
            .zip(0..)
            .map(|(key, i)| {
                let (a, b) = (new_slot(key.low()), new_slot(key.high()));
                (if a < b { PairKey::new(a, b) } else { PairKey::new(b, a) }, i)
            })
            .collect();
        order.sort_unstable();
        self.contacts = order.iter().map(|&(_, i)| self.contacts[i as usize]).collect();
        self.keys.clear();
        self.keys.extend(order.iter().map(|&(key, _)| key));
    }
}
