//! Yards side by side: each with as many bodies at rest, all of one kind, in rows, and the same around them. One of them is a scene of
//! Box2D's benchmarks; with more bodies there are more of them.

use super::Layout;
use super::lattice::block;
use atoll_core::{Body, GlobalId, Kind, KindId, Path, StaticBody};
use glam::DVec2;
use std::fmt::Debug;
use std::marker::PhantomData;

/// What a yard is like. Places are seen from its low corner, in meters.
pub(super) trait Yard: Send + Sync + Debug {
    /// Bodies in it.
    const BODIES: u64;
    /// How many of them make a row, or a column.
    const ROW: u64;
    /// Its width and height, in meters.
    const SIZE: DVec2;
    /// A body starts this far beside its place in the lattice at most, in meters.
    const BESIDE: f64 = 0.0;
    /// What its bodies are.
    fn kind() -> Kind;
    /// What stands or moves around them.
    fn around() -> Vec<Fixture>;
    /// Where a body starts: at this place of this row, both counted from zero.
    fn place(row: u64, at: u64) -> DVec2;
}

/// Something that no body moves.
#[derive(Debug)]
pub(super) struct Fixture {
    pub(super) kind: Kind,
    pub(super) place: DVec2,
    pub(super) path: Option<Path>,
}

impl Fixture {
    pub(super) fn still(kind: Kind, place: DVec2) -> Self {
        Self { kind, place, path: None }
    }
}

/// The layout of such a scene.
#[derive(Debug)]
pub(super) struct Yards<Y> {
    bodies: u64,
    yard: PhantomData<Y>,
}

impl<Y: Yard> Yards<Y> {
    pub(super) fn new(bodies: u64) -> Self {
        Self { bodies, yard: PhantomData }
    }

    fn count(&self) -> u64 {
        self.bodies.div_ceil(Y::BODIES)
    }

    fn corner(yard: u64) -> DVec2 {
        DVec2::new(Y::SIZE.x * yard as f64, 0.0)
    }

    fn place(index: u64) -> DVec2 {
        let within = index % Y::BODIES;
        Self::corner(index / Y::BODIES) + Y::place(within / Y::ROW, within % Y::ROW)
    }
}

/// The bodies in two corners of a block that holds some others, where they fill yards of so many bodies in rows of some `length`. There
/// need not be any such bodies.
pub(super) fn corners(first: u64, last: u64, each: u64, length: u64) -> [u64; 2] {
    let [yard, other] = [first, last].map(|index| index / each * each);
    if yard != other {
        return [yard, other + each - 1];
    }
    let [rows, columns] = block(first - yard, last - yard, length);
    [0, 1].map(|end| yard + rows[end] * length + columns[end])
}

impl<Y: Yard> Layout for Yards<Y> {
    fn bodies(&self) -> u64 {
        self.bodies
    }

    fn kinds(&self) -> Vec<Kind> {
        vec![Y::kind()]
    }

    fn domain(&self) -> (DVec2, DVec2) {
        (DVec2::ZERO, Self::corner(self.count()) + DVec2::new(0.0, Y::SIZE.y))
    }

    fn statics(&self) -> Vec<StaticBody> {
        let all = (0..self.count()).flat_map(|yard| {
            let place = move |fixture: Fixture| Fixture { place: Self::corner(yard) + fixture.place, ..fixture };
            Y::around().into_iter().map(place)
        });
        (0..)
            .zip(all)
            .map(|(id, Fixture { kind, place, path })| StaticBody {
                path,
                ..StaticBody::new(GlobalId(id), kind, place)
            })
            .collect()
    }

    fn body(&self, index: u64, id: GlobalId, _seed: u64) -> Body {
        Body::at_rest(id, KindId(0), Self::place(index))
    }

    fn extent(&self, first: u64, last: u64) -> (DVec2, DVec2) {
        let [low, high] = corners(first, last, Y::BODIES, Y::ROW).map(Self::place);
        (low - 2.0 * Y::BESIDE, high + 2.0 * Y::BESIDE)
    }

    fn home(&self, index: u64) -> (DVec2, DVec2) {
        let corner = Self::corner(index / Y::BODIES);
        (corner, corner + Y::SIZE)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{compounds, junkyard, tumbler, washer};
    use super::*;

    /// The first body and the last, from the first, in mm; and how many there are.
    fn ends<Y: Yard>() -> ([i64; 2], u64) {
        let yards = Yards::<Y>::new(Y::BODIES);
        let place = |index| yards.body(index, GlobalId(index), 1).position;
        let way = ((place(Y::BODIES - 1) - place(0)) * 1e3).round();
        ([way.x as i64, way.y as i64], Y::BODIES)
    }

    #[test]
    fn one_yard_is_the_scene_of_box2d() {
        assert_eq!(ends::<tumbler::Tumbler>(), ([17_600, 17_600], 2025));
        assert_eq!(ends::<washer::Washer>(), ([18_690, 18_690], 8100));
        assert_eq!(ends::<junkyard::Junkyard>(), ([149_450, 39_000], 8000));
        assert_eq!(ends::<compounds::Compounds>(), ([37_500, 335_250], 3000));
    }

    #[test]
    fn yards_are_alike_and_stand_beside_each_other() {
        let yards = Yards::<tumbler::Tumbler>::new(5000);
        assert_eq!((yards.count(), yards.statics().len()), (3, 3));
        for index in [0, 700, 2024, 4999 - 4050] {
            let place = |yard: u64| yards.body(index + 2025 * yard, GlobalId(0), 1).position;
            assert!((place(2) - place(0) - DVec2::X * 64.0).length() < 1e-9);
            let (low, high) = yards.home(index + 4050);
            assert!(place(2).cmpgt(low).all() && place(2).cmplt(high).all());
        }
    }
}
