//! `rooms`, the reported experiment: a square cut 2 x 2 into walled rooms, full of boxes and circles on a lattice, each
//! with a velocity of its own, and no gravity.
//!
//! Bodies take four draws each, in this order: kind, velocity along x, velocity along y, angular velocity.

use super::lattice::Lattice;
use super::random::SplitMix64;
use super::{Layout, mixture, random_kind, statics};
use atoll_core::{Body, GlobalId, Kind, Rot, StaticBody};
use glam::{DVec2, Vec2};

/// Side of the square in meters, with this many bodies in it; any other number keeps the density.
const REPORTED: (f64, u64) = (1210.0, 700_000);
/// Low corner of the square, in meters.
const LOW: DVec2 = DVec2::splat(-10.0);
/// Rooms along each axis.
const ROOMS: usize = 2;
/// Thickness of the walls, in meters. They stand inside the border of their room.
const WALL: f64 = 2.0;
/// Between the border of a room and the outermost centers, in meters.
const INSET: f64 = 2.5;
/// Components of the velocities lie in [0, this), in m/s.
const SPEED: f32 = 20.0;
/// Angular velocities lie in [0, this), in rad/s.
const SPIN: f32 = 5.0;
/// Draws of one body.
const DRAWS: u64 = 4;

/// With fewer bodies, at the reported density, the walls would leave them no space.
pub(crate) const LEAST_BODIES: u64 = 100;

/// The layout of `rooms`.
#[derive(Debug)]
pub(super) struct Rooms {
    bodies: u64,
    lattice: Lattice,
    /// Side of the square, in meters.
    side: f64,
    power: f64,
}

impl Rooms {
    pub(super) fn new(bodies: u64, power: f64) -> Self {
        let side = REPORTED.0 * (bodies as f64 / REPORTED.1 as f64).sqrt();
        Self { bodies, lattice: Lattice::of(bodies), side, power }
    }

    fn room_side(&self) -> f64 {
        self.side / ROOMS as f64
    }

    /// Low and high edge of the k-th room along x or y.
    fn span(&self, axis: usize, k: usize) -> (f64, f64) {
        let edge = |k: usize| LOW[axis] + self.room_side() * k as f64;
        (edge(k), edge(k + 1))
    }

    /// Low and high corner of a room, walls included.
    fn room(&self, k: [usize; 2]) -> (DVec2, DVec2) {
        let ((left, right), (bottom, top)) = (self.span(0, k[0]), self.span(1, k[1]));
        (DVec2::new(left, bottom), DVec2::new(right, top))
    }

    /// The room of a relative coordinate, and how far along that room it lies, in [0, 1).
    fn split(r: f64) -> (usize, f64) {
        let scaled = r * ROOMS as f64;
        let k = (scaled as usize).min(ROOMS - 1);
        (k, scaled - k as f64)
    }

    /// Relative coordinates of a body, in (0, 1).
    fn coordinates(&self, body: u64) -> [f64; 2] {
        let relative = self.lattice.relative(body);
        if self.power == 1.0 { relative } else { relative.map(|r| libm::pow(r, self.power)) }
    }

    /// Where a body starts, in meters.
    fn position(&self, body: u64) -> DVec2 {
        let r = self.coordinates(body);
        let place = |axis: usize| {
            let (k, along) = Self::split(r[axis]);
            self.span(axis, k).0 + INSET + along * (self.room_side() - 2.0 * INSET)
        };
        DVec2::new(place(0), place(1))
    }
}

impl Layout for Rooms {
    fn bodies(&self) -> u64 {
        self.bodies
    }

    fn kinds(&self) -> Vec<Kind> {
        mixture()
    }

    fn domain(&self) -> (DVec2, DVec2) {
        (LOW, LOW + DVec2::splat(self.side))
    }

    fn statics(&self) -> Vec<StaticBody> {
        let rooms = (0..ROOMS * ROOMS).zip((0..).step_by(4));
        let walls = rooms.flat_map(|(room, first)| {
            let (low, high) = self.room([room % ROOMS, room / ROOMS]);
            statics::room(first, low, high, WALL)
        });
        walls.collect()
    }

    fn body(&self, index: u64, id: GlobalId, seed: u64) -> Body {
        let mut random = SplitMix64::after(seed, DRAWS * index);
        let kind = random_kind(&mut random);
        let velocity = Vec2::new(random.below(SPEED), random.below(SPEED));
        let angular_velocity = random.below(SPIN);
        let position = self.position(index);
        Body { id, position, rotation: Rot::IDENTITY, velocity, angular_velocity, kind }
    }

    fn extent(&self, first: u64, last: u64) -> (DVec2, DVec2) {
        self.lattice.corners(first, last).map(|body| self.position(body)).into()
    }

    fn home(&self, index: u64) -> (DVec2, DVec2) {
        self.room(self.coordinates(index).map(|r| Self::split(r).0))
    }
}

#[cfg(test)]
mod tests {
    use super::super::statics::rectangle;
    use super::*;

    #[test]
    fn the_reported_size_has_the_reported_domain_and_sixteen_walls() {
        let rooms = Rooms::new(700_000, 1.0);
        assert_eq!(rooms.domain(), (DVec2::splat(-10.0), DVec2::splat(1200.0)));
        assert_eq!(rooms.lattice.side, 837);
        let walls = rooms.statics();
        assert_eq!(walls.len(), 16);
        assert_eq!(rectangle(&walls[0]), (DVec2::new(-10.0, -10.0), DVec2::new(-8.0, 595.0)));
        assert_eq!(rectangle(&walls[15]), (DVec2::new(595.0, 1198.0), DVec2::new(1200.0, 1200.0)));
        assert!(walls.iter().enumerate().all(|(i, wall)| wall.id == GlobalId(i as u64)));
    }

    #[test]
    fn every_body_starts_in_the_free_part_of_its_own_room() {
        for (bodies, power) in [(LEAST_BODIES, 1.0), (1000, 1.0), (5000, 1.2), (4999, 0.5)] {
            let rooms = Rooms::new(bodies, power);
            for index in 0..bodies {
                let (low, high) = rooms.home(index);
                let body = rooms.body(index, GlobalId(16 + index), 1);
                let free = DVec2::splat(INSET - 1e-9);
                assert!(body.position.cmpge(low + free).all() && body.position.cmple(high - free).all(), "{body:?}");
                assert!(body.velocity.cmpge(Vec2::ZERO).all() && body.velocity.cmplt(Vec2::splat(SPEED)).all());
                assert!((0.0..SPIN).contains(&body.angular_velocity));
            }
        }
    }

    #[test]
    fn the_fewest_bodies_do_not_touch_at_the_start() {
        let rooms = Rooms::new(LEAST_BODIES, 1.0);
        let place = |index| rooms.body(index, GlobalId(index), 1).position;
        let nearest = (1..LEAST_BODIES).map(|index| place(index).distance(place(0))).fold(f64::MAX, f64::min);
        assert!(nearest > 0.4, "{nearest}");
    }

    #[test]
    fn the_lattice_runs_along_y_first() {
        let rooms = Rooms::new(400, 1.0);
        let place = |index| rooms.body(index, GlobalId(index), 1).position;
        assert!(place(1).y > place(0).y && place(1).x == place(0).x);
        assert!(place(20).x > place(0).x && place(20).y == place(0).y);
    }

    #[test]
    fn the_power_skews_as_reported() {
        let rooms = Rooms::new(100_000, 1.2);
        let center = (rooms.domain().0 + rooms.domain().1) * 0.5;
        let share = |low: bool| {
            let there = |p: DVec2| if low { p.cmplt(center).all() } else { p.cmpge(center).all() };
            (0..100_000).filter(|&i| there(rooms.body(i, GlobalId(i), 1).position)).count() as f64 / 1e5
        };
        assert!((share(true) - 0.31).abs() < 0.01, "{}", share(true));
        assert!((share(false) - 0.19).abs() < 0.01, "{}", share(false));
    }
}
