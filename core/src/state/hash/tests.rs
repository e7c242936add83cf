//! What a fingerprint sees, and what it must not see.

use super::Hashes;
use crate::model::body::Body;
use crate::model::contact::{Contact, ContactPoint};
use crate::model::id::{GlobalId, KindId, TileId};
use crate::model::math::Rot;
use glam::{DVec2, Vec2};
use std::collections::BTreeSet;

fn body(id: u64) -> Body {
    Body {
        id: GlobalId(id),
        position: DVec2::new(1.5, -2.25),
        rotation: Rot::from_angle(0.3),
        velocity: Vec2::new(0.1, -7.0),
        angular_velocity: 3.0,
        kind: KindId(0),
    }
}

fn contact() -> Contact {
    let point = |feature| ContactPoint {
        anchor: Vec2::new(0.1, 0.2),
        separation: -0.01,
        normal_impulse: 0.5,
        tangent_impulse: -0.25,
        feature,
    };
    Contact {
        normal: Vec2::new(0.6, 0.8),
        offset: Vec2::new(0.3, 0.4),
        rotation_a: Rot::from_angle(1.0),
        rotation_b: Rot::from_angle(2.0),
        points: [point(4), point(5)],
    }
}

fn of_body(body: &Body) -> u128 {
    let mut hashes = Hashes::default();
    hashes.add_body(body);
    assert_eq!(hashes.contact, 0);
    hashes.state
}

fn of_contact(tile: u32, pair: (u64, u64), contact: &Contact) -> u128 {
    let mut hashes = Hashes::default();
    hashes.add_contact(TileId(tile), (GlobalId(pair.0), GlobalId(pair.1)), contact);
    assert_eq!(hashes.state, 0);
    hashes.contact
}

fn next32(value: &mut f32) {
    *value = f32::from_bits(value.to_bits() ^ 1);
}

fn next64(value: &mut f64) {
    *value = f64::from_bits(value.to_bits() ^ 1);
}

#[test]
fn one_bit_of_any_field_of_a_body_shows() {
    let changes: [fn(&mut Body); 8] = [
        |body| body.id.0 ^= 1,
        |body| next64(&mut body.position.x),
        |body| next64(&mut body.position.y),
        |body| next32(&mut body.rotation.c),
        |body| next32(&mut body.rotation.s),
        |body| next32(&mut body.velocity.x),
        |body| next32(&mut body.velocity.y),
        |body| next32(&mut body.angular_velocity),
    ];
    let mut seen = BTreeSet::from([of_body(&body(1))]);
    for (field, change) in changes.iter().enumerate() {
        let mut changed = body(1);
        change(&mut changed);
        assert!(seen.insert(of_body(&changed)), "field {field} does not show");
    }
    let mut negative_zero = body(1);
    negative_zero.velocity.x = -0.0;
    let zero = Body { velocity: Vec2::new(0.0, negative_zero.velocity.y), ..negative_zero };
    assert_ne!(of_body(&zero), of_body(&negative_zero), "zeros of two signs are two states");
}

#[test]
fn one_bit_of_any_field_of_a_contact_shows() {
    let original = contact();
    let mut seen = BTreeSet::from([of_contact(3, (1, 2), &original)]);
    for byte in 0..size_of::<Contact>() {
        let mut changed = original;
        bytemuck::bytes_of_mut(&mut changed)[byte] ^= 1;
        assert!(seen.insert(of_contact(3, (1, 2), &changed)), "byte {byte} does not show");
    }
    for (tile, pair) in [(4, (1, 2)), (3, (0, 2)), (3, (1, 3)), (3, (2, 1))] {
        assert!(seen.insert(of_contact(tile, pair, &original)), "tile {tile} or pair {pair:?} does not show");
    }
}

#[test]
fn order_and_parts_do_not_show() {
    let bodies: Vec<Body> = (0..50).map(|id| Body { velocity: Vec2::splat(id as f32), ..body(id) }).collect();
    let sum = |bodies: &mut dyn Iterator<Item = &Body>| {
        let mut hashes = Hashes::default();
        for body in bodies {
            hashes.add_body(body);
            hashes.add_contact(TileId(7), (body.id, GlobalId(1_000)), &contact());
        }
        hashes
    };
    let forward = sum(&mut bodies.iter());
    assert_eq!(sum(&mut bodies.iter().rev()), forward);
    let (odd, even): (Vec<_>, Vec<_>) = bodies.iter().partition(|body| body.id.0 % 2 == 1);
    let (odd, even) = (sum(&mut odd.into_iter()), sum(&mut even.into_iter()));
    assert_eq!(odd.merge(even), forward);
    assert_eq!(even.merge(odd), forward);
    assert_eq!(forward.merge(Hashes::default()), forward);
    // A body counted twice, or left out, is noticed; sums do not cancel as exclusive-or would.
    assert_ne!(forward.merge(odd), forward);
    assert_ne!(odd.merge(odd), Hashes::default());
}

#[test]
fn hashes_print_as_32_digits_each() {
    let text = Hashes { state: 0xabc, contact: u128::MAX }.to_string();
    assert_eq!(text, format!("{}abc {}", "0".repeat(29), "f".repeat(32)));
}
