//! What the sync points within a step carry, and what border contacts leave behind.

use crate::exchange::halo::Halo;
use crate::exchange::mail::{Inbox, Outbox};
use crate::model::body::Body;
use crate::model::id::{GlobalId, KindId, TileId};
use crate::model::kind::{Kind, Material};
use crate::model::math::Rot;
use crate::model::params::{Exchange, Params};
use crate::model::shape::Shape;
use crate::step;
use crate::tiling::blueprint::Blueprint;
use crate::tiling::partition::Partition;
use crate::world::World;
use glam::{DVec2, Vec2};
use std::convert::Infallible;

/// What one sync point carried, in records.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
struct Carried {
    ghosts: usize,
    refreshes: usize,
    impulses: usize,
}

/// A halo that counts.
#[derive(Default)]
struct Counting(Vec<Carried>);

impl Halo for Counting {
    type Error = Infallible;

    fn exchange(&mut self, outbox: &mut Outbox, inbox: &mut Inbox) -> Result<(), Infallible> {
        let mut carried = Carried::default();
        for message in outbox.messages() {
            carried.ghosts += message.ghosts.len();
            carried.refreshes += message.refreshes.len();
            carried.impulses += message.impulses.len();
        }
        self.0.push(carried);
        let _ = outbox.deliver(inbox);
        Ok(())
    }
}

/// A row of four discs that touch, the border between the second and the third.
fn row(restitution: f32) -> World {
    let partition = Partition::uniform(DVec2::new(-20.0, -20.0), DVec2::new(20.0, 20.0), 2, 1).unwrap();
    let material = Material { restitution, ..Material::default() };
    let kinds = vec![Kind::new(Shape::circle(0.5), material)];
    let params = Params { exchange: Exchange::Substep, ..Params::default() };
    let mut world =
        World::new(&Blueprint { params, partition, kinds, statics: vec![] }, &[TileId(0), TileId(1)]).unwrap();
    for k in 0..4_u32 {
        let body = Body {
            id: GlobalId(u64::from(k)),
            position: DVec2::new(f64::from(k) - 1.5, 0.0),
            rotation: Rot::IDENTITY,
            velocity: Vec2::new(1.5 - k as f32, 0.0),
            angular_velocity: 0.0,
            kind: KindId(0),
        };
        world.add(body).unwrap();
    }
    world
}

/// What the sync points of the first step carry.
fn carried(restitution: f32) -> Vec<Carried> {
    let mut halo = Counting::default();
    step(&mut row(restitution), &mut halo).unwrap();
    halo.0
}

#[test]
fn sync_points_carry_only_what_somebody_needs() {
    // All four are near enough to be ghosts; only the two in the middle are in a contact across the border.
    let first = Carried { ghosts: 4, ..Carried::default() };
    let refresh = Carried { refreshes: 2, ..Carried::default() };
    let impulses = Carried { impulses: 2, ..Carried::default() };
    // After the last substep nobody looks at a ghost any more, unless something bounces; and then twice.
    let substeps = [first, refresh, refresh, refresh, impulses];
    assert_eq!(carried(0.0), substeps);
    assert_eq!(carried(0.5), [&substeps[..], &[refresh, impulses, refresh, impulses]].concat());
}
