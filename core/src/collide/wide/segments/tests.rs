use super::*;
use crate::collide::piece_boxes::PieceBoxes;
use crate::collide::touch::{Meeting, Met, meet};
use crate::model::body::Body;
use crate::model::contact::{Contact, ContactPoint};
use crate::model::id::{GlobalId, KindId, TileId};
use crate::model::kind::{Kind, KindRow, Material};
use crate::model::math::Rot;
use crate::model::params::{Instructions, Params};
use crate::model::shape::{Segment, Shape};
use crate::parallel::lanes::{Kernel, LaneSet, Lanes};
use crate::testing::{any_convex, any_gap, any_rotation, at_gap, cases};
use crate::tiling::blueprint::Blueprint;
use crate::tiling::partition::Partition;
use crate::tiling::tile::Tile;
use bytemuck::Zeroable;
use glam::{DVec2, Vec2};
use proptest::prelude::*;

/// The lane that is looked at.
const LANE: usize = 5;

/// Looks at a meeting in each of sixteen lanes.
struct Look<'a, 'm>(&'a mut Meeting<'m>, &'a Tile, &'a Setup);

impl Kernel for Look<'_, '_> {
    type Output = ();
    fn run<V: Lanes>(self) {
        let Self(meeting, tile, setup) = self;
        let (mut pairs, mut points) = (WideSegments::default(), Points::default());
        (0..WIDE).for_each(|lane| meeting.set(lane, &mut pairs, tile, setup));
        pairs.look::<V::Wide>(&mut points, Search::WhereManyNeedIt, setup);
        assert!(!points.is_postponed(LANE), "all sixteen need it, or none");
        if points.is_unsure(LANE) {
            meeting.touch(tile, setup);
        } else {
            meeting.see(LANE, &points);
        }
    }
}

/// A tile with a body, at a place seen from a segment, and that.
fn over_segment(
    kind: Kind,
    segment: Segment,
    (place, rotation, velocity, angular_velocity): (DVec2, Rot, Vec2, f32),
    (turned, turns): (Rot, f32),
) -> (Tile, Setup) {
    let partition = Partition::uniform(DVec2::ZERO, DVec2::splat(20.0), 1, 1).unwrap();
    let blueprint = Blueprint { params: Params::default(), partition, kinds: vec![kind], statics: Vec::new() };
    let mut setup = Setup::new(&blueprint).unwrap();
    setup.kinds.push(KindRow::fixed(&Kind::new(Shape::Segment(segment), Material::default())).unwrap());
    let mut tile = Tile::new(TileId(0), &setup);
    let bodies = [(place, rotation, velocity, angular_velocity), (DVec2::ZERO, turned, Vec2::ZERO, turns)];
    for (k, (place, rotation, velocity, angular_velocity)) in bodies.into_iter().enumerate() {
        let (id, kind, position) = (GlobalId(k as u64), KindId(k as u32), DVec2::splat(10.0) + place);
        tile.bodies.push(Body { id, kind, position, rotation, velocity, angular_velocity });
    }
    (tile, setup)
}

/// Fails unless every bit of a contact is the same, whoever looks for it.
fn same_contacts(tile: &Tile, bodies: Pair, known: &[&Contact], setup: &Setup) -> Result<(), TestCaseError> {
    let meeting = || {
        let mut found = None;
        meet(tile, bodies, &PieceBoxes::default(), known, setup, |meeting| found = Some(meeting));
        found.filter(|meeting| matches!(meeting.outcome, Met::Open))
    };
    let Some(mut expected) = meeting() else { return Ok(()) };
    expected.touch(tile, setup);
    for instructions in [Instructions::Auto, Instructions::Portable] {
        let mut found = meeting().unwrap();
        LaneSet::of(instructions).unwrap().run(Look(&mut found, tile, setup));
        prop_assert_eq!(found.contact().is_some(), expected.contact().is_some());
        if let (Some((contact, separation)), Some((expected, now))) = (found.contact(), expected.contact()) {
            prop_assert_eq!(bytemuck::bytes_of(contact), bytemuck::bytes_of(expected));
            for point in 0..expected.points().len() {
                prop_assert_eq!(separation[point].to_bits(), now[point].to_bits());
            }
        }
    }
    Ok(())
}

/// One of a few directions, so that neighbours often go straight on.
fn any_turn() -> impl Strategy<Value = Option<f32>> {
    prop_oneof![Just(None), Just(Some(0.0)), (-3.0_f32..3.0).prop_map(Some)]
}

/// A capsule that glides over a segment of a centimeter, and comes away from its end while it comes down on it.
#[test]
fn sixteen_glide_off_as_one_does() {
    let ends = [Vec2::new(-0.005, 0.0), Vec2::new(0.005, 0.0)];
    let beside = [Some(Vec2::new(-0.015, 0.0)), Some(Vec2::new(0.07, 0.0))];
    let (segment, _) = Segment::new(beside[0], ends[0], ends[1], beside[1]).unwrap();
    let capsule = Kind::new(Shape::capsule(0.547_431_2, 0.196_753_7).unwrap(), Material::default());
    let near = DVec2::new(-0.261_244_277_2, 0.199_505_401_2);
    for step in 0..400 {
        let velocity = Vec2::new(-0.956_281_36 - 0.002 * step as f32, 0.009_192_503);
        let body = (near, Rot::from_angle(-0.010_130_988), velocity, -0.033_585_604);
        let (tile, setup) = over_segment(capsule.clone(), segment, body, (Rot::IDENTITY, 0.0));
        same_contacts(&tile, [0, 1], &[], &setup).unwrap();
    }
}

proptest! {
    #![proptest_config(cases(16384))]

    /// Every bit of one contact, whoever looks for it.
    #[test]
    fn sixteen_meet_segments_as_one_does(
        kind in any_convex(0.05, 2.0), length in prop_oneof![0.02_f32..4.0, 0.0005_f32..0.02], joints in [any_turn(), any_turn()],
        (along, height) in (-3.0_f64..3.0, -0.6_f64..2.0), closeness in 0_u32..3,
        (vx, vy) in (-200.0_f32..200.0, -200.0_f32..200.0), slowness in 0_u32..4,
        (spin, turns) in (prop_oneof![Just(0.0_f32), -40.0_f32..40.0], prop_oneof![Just(0.0_f32), -2.0_f32..2.0]),
        rotations in [any_rotation(), any_rotation()], gap in any_gap(), lay: bool, is_first: bool,
    ) {
        let ends = [Vec2::new(-0.5 * length, 0.0), Vec2::new(0.5 * length, 0.0)];
        let beside = |end: Vec2, way: f32, turn: f32| end + Rot::from_angle(turn).rotate(Vec2::new(way, 0.0));
        let (before, after) = (joints[0].map(|turn| beside(ends[0], -1.0, turn)), joints[1].map(|turn| beside(ends[1], 1.0, turn)));
        let (segment, _) = Segment::new(before, ends[0], ends[1], after).unwrap();
        let setup_of = |kind: &Kind| KindRow::fixed(kind).unwrap();
        let rows = [setup_of(&kind), setup_of(&Kind::new(Shape::Segment(segment), Material::default()))];
        let round = rows[0].bounding_radius;
        // Most often as near as what lies on it.
        let near = DVec2::new(along, height * 0.3_f64.powi(closeness as i32)) + DVec2::Y * f64::from(round) * f64::from(closeness.min(1));
        let (c, s) = (f64::from(rotations[1].c), f64::from(rotations[1].s));
        let away = DVec2::new(c * near.x - s * near.y, s * near.x + c * near.y);
        let offset = -at_gap(gap, [&rows[0], &rows[1]], rotations, -away);
        let velocity = Vec2::new(vx, vy) * 0.1_f32.powi(slowness as i32);
        let (tile, setup) = over_segment(kind, segment, (offset, rotations[0], velocity, spin), (rotations[1], turns));
        // Who lay on its face pressed there at another point.
        let point = ContactPoint { normal_impulse: 1.0, feature: ContactPoint::ABSENT - 1, ..ContactPoint::NONE };
        let (normal, points) = (rotations[1].rotate(Vec2::Y), [point, ContactPoint::NONE]);
        let [rotation_a, rotation_b] = if is_first { [rotations[1], rotations[0]] } else { rotations };
        let known = Contact { normal, rotation_a, rotation_b, points, ..Contact::zeroed() };
        let known: Vec<&Contact> = Some(&known).filter(|_| lay).into_iter().collect();
        same_contacts(&tile, if is_first { [1, 0] } else { [0, 1] }, &known, &setup)?;
    }
}
