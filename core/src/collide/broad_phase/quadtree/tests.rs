//! What a tree that lives from step to step may get wrong. That it finds the right pairs at all is tested beside the
//! grid.

use super::roster::Roster;
use super::tree::NONE;
use super::{FAT, Quadtree};
use crate::collide::broad_phase::tests::{Stuffed, any_body, body};
use crate::model::body::{Body, StaticBody};
use crate::model::id::GlobalId;
use crate::model::math::Rot;
use crate::testing::{cases, circle, rectangle};
use glam::{DVec2, Vec2};
use prop::sample::Index;
use proptest::prelude::*;
use std::collections::BTreeMap;

/// Width and height of the tile in these tests, in meters.
const SIZE: f64 = 20.0;

fn stuffed(bodies: &[Body], owned: usize) -> Stuffed {
    let wall = StaticBody {
        id: GlobalId(0),
        position: DVec2::splat(1.5 * SIZE),
        rotation: Rot::IDENTITY,
        kind: rectangle(0.5 * SIZE as f32, 0.3),
        path: None,
    };
    let kinds = vec![circle(0.2), rectangle(0.3, 0.5), circle(4.0)];
    Stuffed::named(Vec2::splat(SIZE as f32), kinds, bodies, owned, vec![wall])
}

/// What may happen to the bodies of a tile between two steps.
#[derive(Clone, Debug)]
struct Change {
    gone: Vec<Index>,
    /// A whole stretch of bodies that leaves at once.
    gone_in_a_row: (Index, usize),
    come: Vec<Body>,
    swapped: Vec<(Index, Index)>,
    reversed: bool,
    leaps: Vec<(Index, DVec2)>,
    /// The part of the bodies that is owned; the others are ghosts.
    owned: f64,
}

fn any_new_body() -> impl Strategy<Value = Body> {
    any_body().prop_map(|(kind, place, rotation, velocity, angular_velocity)| Body {
        rotation,
        velocity,
        angular_velocity,
        // Few large ones.
        ..body([0, 0, 0, 0, 1, 1, 1, 1, 2][kind.index(9)], place * SIZE)
    })
}

fn any_change() -> impl Strategy<Value = Change> {
    let some = |most| prop::collection::vec(any::<Index>(), 0..most);
    let row = (any::<Index>(), prop_oneof![8 => Just(0_usize), 1 => 0_usize..60]);
    let come = prop::collection::vec(any_new_body(), 0..12);
    let swapped = prop::collection::vec(any::<(Index, Index)>(), 0..4);
    let leaps = prop::collection::vec((any::<Index>(), (-0.2..1.2, -0.2..1.2)), 0..4);
    (some(5), row, come, swapped, prop::bool::weighted(0.1), leaps, 0.0..=1.0).prop_map(
        |(gone, gone_in_a_row, come, swapped, reversed, leaps, owned)| Change {
            gone,
            gone_in_a_row,
            come,
            swapped,
            reversed,
            leaps: leaps.into_iter().map(|(index, (x, y))| (index, DVec2::new(x, y) * SIZE)).collect(),
            owned,
        },
    )
}

impl Change {
    fn apply(&self, bodies: &mut Vec<Body>, next_name: &mut u64) {
        for gone in &self.gone {
            if !bodies.is_empty() {
                bodies.remove(gone.index(bodies.len()));
            }
        }
        if !bodies.is_empty() {
            let (first, length) = (self.gone_in_a_row.0.index(bodies.len()), self.gone_in_a_row.1);
            bodies.drain(first..bodies.len().min(first + length));
        }
        for new in &self.come {
            bodies.push(Body { id: GlobalId(*next_name), ..*new });
            *next_name += 1;
        }
        if !bodies.is_empty() {
            for (a, b) in &self.swapped {
                let (a, b) = (a.index(bodies.len()), b.index(bodies.len()));
                bodies.swap(a, b);
            }
            for &(body, place) in &self.leaps {
                let body = body.index(bodies.len());
                bodies[body].position = place;
            }
        }
        if self.reversed {
            bodies.reverse();
        }
        for body in bodies {
            body.position += body.velocity.as_dvec2() / 60.0;
        }
    }
}

proptest! {
    #![proptest_config(cases(32))]

    #[test]
    fn a_tree_that_lives_on_finds_what_brute_force_finds(
        start in prop::collection::vec(any_new_body(), 0..150),
        changes in prop::collection::vec(any_change(), 1..30),
    ) {
        let mut next_name = 1_000 + start.len() as u64;
        let mut bodies = start;
        (1_000..).zip(&mut bodies).for_each(|(name, body)| body.id = GlobalId(name));
        let mut quadtree = Quadtree::new([SIZE as f32; 2]);
        for change in changes {
            change.apply(&mut bodies, &mut next_name);
            let tile = stuffed(&bodies, (change.owned * bodies.len() as f64) as usize);
            prop_assert_eq!(tile.by_quadtree(&mut quadtree), tile.brute_force());
        }
    }

    /// Everybody who was here before is found again, everybody who is not is gone.
    #[test]
    fn the_roster_follows_everybody(
        names in prop::collection::btree_set(0_u64..400, 0..200),
        others in prop::collection::btree_set(0_u64..400, 0..200),
        [cut, cut_others] in any::<[Index; 2]>(),
        swapped in prop::collection::vec(any::<(Index, Index)>(), 0..4),
    ) {
        let before: Vec<_> = names.into_iter().map(GlobalId).collect();
        let mut now: Vec<_> = others.into_iter().map(GlobalId).collect();
        let any = !now.is_empty();
        for (a, b) in swapped.iter().filter(|_| any) {
            let (a, b) = (a.index(now.len()), b.index(now.len()));
            now.swap(a, b);
        }
        let ends = |names: &[GlobalId], cut: Index| [cut.index(names.len() + 1), names.len(), names.len()];
        let mut roster = Roster::default();
        roster.follow(&before, ends(&before, cut));
        if !roster.follow(&now, ends(&now, cut_others)) {
            prop_assert_eq!(before, now);
            return Ok(());
        }
        let place = |name| before.iter().position(|&old| old == name).map_or(NONE, |place| place as u32);
        prop_assert_eq!(&roster.from, &now.iter().map(|&name| place(name)).collect::<Vec<_>>());
        let mut gone = roster.gone.clone();
        gone.sort_unstable();
        let missing = (0..).zip(&before).filter(|(_, name)| !now.contains(name)).map(|(place, _)| place);
        prop_assert_eq!(gone, missing.collect::<Vec<u32>>());
    }
}

/// Bodies that fly about for ever, now spread over the tile, now all in one corner.
#[test]
fn memory_stays_bounded() {
    const BODIES: usize = 300;
    let noise = |k: usize| (k as f64 * 0.618_033_988_749_894_9).fract();
    let mut quadtree = Quadtree::new([SIZE as f32; 2]);
    let mut most = [[0; 2]; 2];
    for step in 0..600 {
        let spread = if step % 50 < 25 { 1.0 } else { 0.05 };
        let bodies: Vec<_> = (0..BODIES)
            .map(|k| {
                let place = DVec2::new(noise(k * 7 + step), noise(k * 13 + 3 * step)) * spread;
                Body { id: GlobalId(k as u64 + 1), ..body(0, place * SIZE) }
            })
            .collect();
        let tile = stuffed(&bodies, BODIES);
        quadtree.flush(&tile.proxies, &tile.tile.bodies.id);
        quadtree.check();
        for (most, room) in most[step / 300].iter_mut().zip(quadtree.tree.room()) {
            *most = room.max(*most);
        }
    }
    let [early, late] = most;
    assert_eq!(early, late, "nodes and blocks of memory, in the first half and in the second");
    assert!(late[0] < 2 * BODIES && late[1] < 2 * BODIES, "{late:?} nodes and blocks for {BODIES} bodies");
    let nobody = stuffed(&[], 0);
    assert!(nobody.by_quadtree(&mut quadtree).is_empty());
    assert_eq!(quadtree.tree.used(), [1, 1], "the wall is left");
}

/// Such a state ends the run, but not here.
#[test]
fn what_is_not_finite_does_no_harm() {
    let mut bodies: Vec<_> = (0..100)
        .map(|k| Body { id: GlobalId(k + 1), ..body(0, DVec2::new((k % 10) as f64, (k / 10) as f64) * 0.5) })
        .collect();
    let mut quadtree = Quadtree::new([SIZE as f32; 2]);
    let strange = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e30, -1e38];
    for step in 0..20 {
        for (k, body) in bodies.iter_mut().enumerate().skip(step * 3).step_by(4) {
            body.position.x = strange[(k + step) % strange.len()];
            if k % 3 == 0 {
                body.position.y = strange[k % strange.len()];
            }
            if k % 7 == 0 {
                body.velocity.x = f32::NAN;
            }
        }
        let tile = stuffed(&bodies, 90);
        assert_eq!(tile.by_quadtree(&mut quadtree), tile.brute_force(), "step {step}");
    }
}

/// A body that stays within its fat AABB is left alone, wherever in the list it stands.
#[test]
fn only_who_left_their_fat_aabb_are_put_in_anew() {
    let mut bodies: Vec<_> = (0..100)
        .map(|k| Body { id: GlobalId(k + 1), ..body(0, DVec2::new((k % 10) as f64, (k / 10) as f64)) })
        .collect();
    let mut quadtree = Quadtree::new([SIZE as f32; 2]);
    let mut flush = |bodies: &[Body]| {
        let tile = stuffed(bodies, 60);
        quadtree.flush(&tile.proxies, &tile.tile.bodies.id);
        bodies.iter().zip(0..).map(|(body, k)| (body.id, quadtree.tree.get(k).unwrap())).collect::<BTreeMap<_, _>>()
    };
    let first = flush(&bodies);
    for body in &mut bodies {
        body.position.x += 0.9 * f64::from(FAT);
    }
    bodies.reverse();
    assert_eq!(flush(&bodies), first);
    bodies[40].position.x += 0.2 * f64::from(FAT);
    let third = flush(&bodies);
    let changed: Vec<_> = first.iter().filter(|&(id, fat)| third[id] != *fat).map(|(&id, _)| id).collect();
    assert_eq!(changed, [bodies[40].id]);
}
