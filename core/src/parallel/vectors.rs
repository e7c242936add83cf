//! Vectors of the plane, one in each lane.

use super::lanes::Arithmetic;
use crate::model::math::TANGENT;

/// A vector in every lane; or a rotation, by its cosine and its sine.
#[derive(Clone, Copy)]
pub(crate) struct Vectors<V> {
    pub(crate) x: V,
    pub(crate) y: V,
}

/// With the sign that it has not.
#[inline(always)]
pub(crate) fn negated<V: Arithmetic>(x: V) -> V {
    V::splat(-0.0).sub(x)
}

impl<V: Arithmetic> Vectors<V> {
    #[inline(always)]
    pub(crate) fn new(x: V, y: V) -> Self {
        Self { x, y }
    }

    #[inline(always)]
    pub(crate) fn scaled(self, by: V) -> Self {
        Self { x: self.x.mul(by), y: self.y.mul(by) }
    }

    #[inline(always)]
    pub(crate) fn plus(self, other: Self) -> Self {
        Self { x: self.x.add(other.x), y: self.y.add(other.y) }
    }

    #[inline(always)]
    pub(crate) fn minus(self, other: Self) -> Self {
        Self { x: self.x.sub(other.x), y: self.y.sub(other.y) }
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> V {
        self.x.mul(other.x).add(self.y.mul(other.y))
    }

    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> V {
        self.x.mul(other.y).sub(self.y.mul(other.x))
    }

    /// `v`, turned by this rotation.
    #[inline(always)]
    pub(crate) fn rotate(self, v: Self) -> Self {
        Self { x: self.x.mul(v.x).sub(self.y.mul(v.y)), y: self.y.mul(v.x).add(self.x.mul(v.y)) }
    }

    /// `v`, as it is seen from a frame turned so.
    #[inline(always)]
    pub(crate) fn unrotate(self, v: Self) -> Self {
        Self { x: self.x.mul(v.x).add(self.y.mul(v.y)), y: self.x.mul(v.y).sub(self.y.mul(v.x)) }
    }

    /// The rotation that leads from this one to the other.
    #[inline(always)]
    pub(crate) fn to(self, other: Self) -> Self {
        self.unrotate(other)
    }

    /// The rotation that undoes this one.
    #[inline(always)]
    pub(crate) fn back(self) -> Self {
        Self { x: self.x, y: V::splat(0.0).sub(self.y) }
    }

    /// The vector of this box nearest to `v`: half extents within which each part is held.
    #[inline(always)]
    pub(crate) fn hold(self, v: Self) -> Self {
        let zero = V::splat(0.0);
        Self { x: v.x.min(self.x).max(zero.sub(self.x)), y: v.y.min(self.y).max(zero.sub(self.y)) }
    }

    /// [`pick`](Self::pick) for each of two.
    #[inline(always)]
    pub(crate) fn pick_both(positive: V, yes: &[Self; 2], no: &[Self; 2]) -> [Self; 2] {
        [Self::pick(positive, yes[0], no[0]), Self::pick(positive, yes[1], no[1])]
    }

    /// With both signs that they have not.
    #[inline(always)]
    pub(crate) fn opposite(self) -> Self {
        Self { x: negated(self.x), y: negated(self.y) }
    }

    /// `yes` where a number is positive, else `no`.
    #[inline(always)]
    pub(crate) fn pick(positive: V, yes: Self, no: Self) -> Self {
        Self { x: positive.if_positive(yes.x, no.x), y: positive.if_positive(yes.y, no.y) }
    }
}

/// Without its sign.
#[inline(always)]
pub(crate) fn absolute<V: Arithmetic>(x: V) -> V {
    x.max(V::splat(0.0).sub(x))
}

/// As [`math::tangent`](crate::model::math::tangent), bit for bit.
#[inline(always)]
pub(crate) fn tangent<V: Arithmetic>(angle: V) -> V {
    let [second, third] = TANGENT.map(V::splat);
    let square = angle.mul(angle);
    angle.add(angle.mul(square.mul(second.add(third.mul(square)))))
}

/// One where `a < b`, else zero.
#[inline(always)]
pub(crate) fn less<V: Arithmetic>(a: V, b: V) -> V {
    b.sub(a).if_positive(V::splat(1.0), V::splat(0.0))
}
