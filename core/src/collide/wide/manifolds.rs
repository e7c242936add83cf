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
        // Of what is not there at all there is no second one either.
        let (zero, two) = (V::splat(0.0), self.two.mul(self.some));
        let left = Self {
            two: gone[0].max(gone[1]).if_positive(zero, two),
            some: gone[0].if_positive(gone[1].if_positive(zero, two), self.some),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collide::manifold::{Manifold, ManifoldPoint};
    use crate::model::params::Instructions;
    use crate::parallel::lanes::{Kernel, LaneSet, Lanes, WIDE, WideRow};
    use glam::Vec2;

    /// All manifolds of up to two points without all of these.
    struct WithoutSome;

    impl Kernel for WithoutSome {
        type Output = [WideRow; 3];

        #[inline(always)]
        fn run<V: Lanes>(self) -> [WideRow; 3] {
            without_some::<V::Wide>()
        }
    }

    #[inline(always)]
    fn without_some<V: Wide>() -> [WideRow; 3] {
        let bit = |bit: usize| -> WideRow { std::array::from_fn(|lane| (lane >> bit & 1) as f32) };
        let [some, two, first, second] = [0, 1, 2, 3].map(|number| V::load(&bit(number)));
        let (none, points) = (V::splat(0.0), [V::splat(1.0), V::splat(2.0)]);
        let single = Manifolds::single(some, Vectors::new(none, none), Vectors::new(none, none), none, none);
        let left = Manifolds { two, separation: points, ..single }.without([first, second]);
        let mut rows = [[0.0; WIDE]; 3];
        [left.some, left.two, left.separation[0]].into_iter().zip(&mut rows).for_each(|(row, to)| row.store(to));
        rows
    }

    #[test]
    fn what_is_left_of_two_points_is_that_of_one_pair() {
        for instructions in [Instructions::Auto, Instructions::Portable] {
            let [some, two, first] = LaneSet::of(instructions).unwrap().run(WithoutSome);
            for lane in 0..WIDE {
                let [is_some, is_two, first_goes, second_goes] = [0, 1, 2, 3].map(|bit| lane >> bit & 1 == 1);
                let point = |number: f32| ManifoldPoint { anchor: Vec2::splat(number), separation: number, feature: 0 };
                let mut one = Manifold::EMPTY;
                (0..usize::from(is_some) + usize::from(is_some && is_two))
                    .for_each(|i| one.push(point(i as f32 + 1.0)));
                let is_gone = |anchor: Vec2| if anchor.x == 1.0 { first_goes } else { second_goes };
                let left = one.without(is_gone).unwrap_or(Manifold::EMPTY);
                assert_eq!([some[lane], two[lane]].map(|is| is > 0.0), [left.count > 0, left.count > 1], "{lane}");
                assert!(left.count == 0 || left.points[0].separation == first[lane], "{lane}");
            }
        }
    }
}
