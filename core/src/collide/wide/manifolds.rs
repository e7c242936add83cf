//! The manifolds of sixteen pairs.

use crate::parallel::lanes::Wide;
use crate::parallel::vectors::{Vectors, less};

/// Manifolds of up to two points. What is asked of them is one, or else zero.
#[derive(Clone, Copy)]
pub(super) struct Manifolds<V> {
    /// Whether there is a point, and whether there is a second.
    pub(super) some: V,
    pub(super) two: V,
    /// Whether the point only tells [how far they are](crate::collide::manifold::Manifold::is_distance) from each other.
    pub(super) tells: V,
    pub(super) normal: Vectors<V>,
    pub(super) anchor: [Vectors<V>; 2],
    pub(super) separation: [V; 2],
    pub(super) feature: [V; 2],
}

/// Each of two numbers: where another is positive the first, else the second.
#[inline(always)]
fn numbers<V: Wide>(positive: V, yes: &[V; 2], no: &[V; 2]) -> [V; 2] {
    [positive.if_positive(yes[0], no[0]), positive.if_positive(yes[1], no[1])]
}

impl<V: Wide> Manifolds<V> {
    /// Of one point each, where there is any.
    #[inline(always)]
    pub(super) fn single(some: V, normal: Vectors<V>, anchor: Vectors<V>, separation: V, feature: V) -> Self {
        let zero = V::splat(0.0);
        let (anchor, separation, feature) = ([anchor; 2], [separation; 2], [feature; 2]);
        Self { some, two: zero, tells: zero, normal, anchor, separation, feature }
    }

    /// `yes` where a number is positive, else `no`.
    #[inline(always)]
    pub(super) fn pick(positive: V, yes: &Self, no: &Self) -> Self {
        Self {
            some: positive.if_positive(yes.some, no.some),
            two: positive.if_positive(yes.two, no.two),
            tells: positive.if_positive(yes.tells, no.tells),
            normal: Vectors::pick(positive, yes.normal, no.normal),
            anchor: Vectors::pick_both(positive, &yes.anchor, &no.anchor),
            separation: numbers(positive, &yes.separation, &no.separation),
            feature: numbers(positive, &yes.feature, &no.feature),
        }
    }

    /// The same without the points that are gone, where these are positive.
    #[inline(always)]
    pub(super) fn without(&self, gone: [V; 2]) -> Self {
        let zero = V::splat(0.0);
        let left = Self {
            two: gone[0].max(gone[1]).if_positive(zero, self.two),
            some: gone[0].if_positive(gone[1].if_positive(zero, self.two), self.some),
            ..*self
        };
        let second = Self::single(left.some, self.normal, self.anchor[1], self.separation[1], self.feature[1]);
        Self::pick(gone[0], &second, &left)
    }

    /// Anchor and separation of the point with the least.
    #[inline(always)]
    pub(super) fn nearest(&self) -> (Vectors<V>, V) {
        let (second, least) = self.least();
        (Vectors::pick(second, self.anchor[1], self.anchor[0]), least)
    }

    /// Whether the second point has the least separation, and that.
    #[inline(always)]
    pub(super) fn least(&self) -> (V, V) {
        let second = self.two.mul(less(self.separation[1], self.separation[0]));
        (second, second.if_positive(self.separation[1], self.separation[0]))
    }
}
