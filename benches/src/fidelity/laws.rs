//! The cases, each with what theory says of it.
//!
//! Single collisions of rigid bodies without restitution, with Coulomb's friction: E. Routh, "Dynamics of a System of Rigid
//! Bodies" (1860). With the effective masses `m_n` along and `m_t` across the normal, the impulses are `m_n v_n` and `m_t v_t`, the
//! latter no more than the coefficient of friction times the former.

use super::{Course, PHASES, Start};
use atoll_core::{Blueprint, Body, GlobalId, Kind, KindId, Material, Params, Partition, Rot, Shape, StaticBody};
use glam::{DVec2, Vec2};

/// A case.
pub(super) struct Law {
    pub(super) name: String,
    /// What theory says, which may take a while to reckon.
    pub(super) theory: Box<dyn Fn() -> f64>,
    /// For how many moments within a step it is measured.
    pub(super) phases: u32,
    /// The world at a number of steps per second; surfaces meet after that part of a step.
    pub(super) start: Box<dyn Fn(f64, f64) -> Start>,
    /// Lets time go on and takes the figure.
    pub(super) read: fn(&mut Course<'_>) -> Result<f64, String>,
}

const FRICTION: f32 = 0.6;
const RADIUS: f32 = 0.25;

/// All cases.
pub(super) fn laws() -> Vec<Law> {
    let mut laws = Vec::new();
    for (velocity, spin) in [((5.0, -3.0), 0.0), ((10.0, -3.0), 0.0), ((0.0, -3.0), 5.0)] {
        laws.push(wall(Vec2::from(velocity), spin, 0.0));
    }
    laws.push(wall(Vec2::new(10.0, -3.0), 0.0, 0.5));
    laws.extend([0.1, 0.2, 0.3, 0.4].map(discs));
    laws.push(pair());
    laws.extend([20.0, 35.0].map(|degrees| corner((1.0, 1.0), degrees, Vec2::new(0.0, -3.0))));
    laws.push(corner((1.0, 0.6), -34.0, Vec2::new(10.0, -3.0)));
    laws.extend([4.0, 16.0].map(heavy));
    laws.push(seam());
    laws.push(incline("a box slides down", 30.0, 0.3, Shape::rectangle(1.0, 1.0)));
    laws.push(incline("a disc rolls down", 20.0, FRICTION, Shape::circle(0.5)));
    for (name, shape) in [("disc", Shape::circle(RADIUS)), ("flat box", Shape::rectangle(0.5, 0.5))] {
        laws.extend([0.5, 0.8, 1.0].map(|restitution| bounce(name, &shape, restitution)));
    }
    laws
}

/// A world of some bodies: shape, material, place, turned by how much, velocity, spin.
pub(super) fn world(
    hertz: f64,
    gravity: f32,
    statics: Vec<StaticBody>,
    bodies: &[(Shape, Material, DVec2, Rot, Vec2, f32)],
) -> Start {
    let first = statics.len() as u64;
    let kinds = bodies.iter().map(|(shape, material, ..)| Kind::new(shape.clone(), *material)).collect();
    let made = (0..).zip(bodies).map(|(k, &(_, _, position, rotation, velocity, angular_velocity))| {
        let (id, kind) = (GlobalId(first + u64::from(k)), KindId(k));
        Body { id, position, rotation, velocity, angular_velocity, kind }
    });
    let bodies = made.collect();
    let params = Params { dt: (1.0 / hertz) as f32, gravity: Vec2::new(0.0, gravity), ..Params::default() };
    let partition = Partition::uniform(DVec2::splat(-40.0), DVec2::splat(40.0), 1, 1).expect("a domain with a size");
    Start { blueprint: Blueprint { params, partition, kinds, statics }, bodies }
}

fn floor(material: Material) -> StaticBody {
    StaticBody::new(GlobalId(0), Kind::new(Shape::rectangle(60.0, 2.0), material), DVec2::new(0.0, -1.0))
}

fn rough(friction: f32) -> Material {
    Material { friction, ..Material::default() }
}

fn wall(velocity: Vec2, spin: f32, restitution: f32) -> Law {
    let slip = velocity.x + spin * RADIUS;
    let pull = (slip / 3.0).min(-FRICTION * (1.0 + restitution) * velocity.y);
    let material = Material { restitution, ..rough(FRICTION) };
    let start = move |hertz: f64, phase: f64| {
        let high = f64::from(RADIUS) - f64::from(velocity.y) / hertz * (2.0 + phase);
        let disc = (Shape::circle(RADIUS), material, DVec2::new(0.0, high), Rot::IDENTITY, velocity, spin);
        world(hertz, 0.0, vec![floor(rough(FRICTION))], &[disc])
    };
    let of = if restitution > 0.0 { format!(" of restitution {restitution}") } else { String::new() };
    Law {
        name: format!("a disc{of} meets a wall at {velocity} m/s, turning at {spin} rad/s: spin after"),
        theory: Box::new(move || f64::from(spin - 2.0 * pull / RADIUS)),
        phases: PHASES,
        start: Box::new(start),
        read: |course| Ok(course.after(0.1)?[0].angular_velocity.into()),
    }
}

fn discs(apart: f32) -> Law {
    let sine = apart / (2.0 * RADIUS);
    let cosine = (1.0 - sine * sine).sqrt();
    let pull = (10.0 * sine / 6.0).min(FRICTION * 5.0 * cosine);
    let start = move |hertz: f64, phase: f64| {
        let x = f64::from(cosine * RADIUS) + 5.0 / hertz * (2.0 + phase);
        let place = DVec2::new(x, 0.5 * f64::from(apart));
        let disc = |side: f64| {
            let velocity = Vec2::new(-5.0 * side as f32, 0.0);
            (Shape::circle(RADIUS), rough(FRICTION), place * side, Rot::IDENTITY, velocity, 0.0)
        };
        world(hertz, 0.0, Vec::new(), &[disc(1.0), disc(-1.0)])
    };
    Law {
        name: format!("two discs meet at 10 m/s, {apart} m beside each other: spin after"),
        theory: Box::new(move || f64::from(2.0 * pull / RADIUS)),
        phases: PHASES,
        start: Box::new(start),
        read: |course| Ok(course.after(0.1)?[0].angular_velocity.abs().into()),
    }
}

/// Nothing acts upon two discs that meet: they keep what angular momentum they have.
fn pair() -> Law {
    let Law { start, .. } = discs(0.2);
    Law {
        name: "the same, 0.2 m: angular momentum, by what it was".to_owned(),
        theory: Box::new(move || 1.0),
        phases: PHASES,
        start,
        read: |course| {
            let momentum = |bodies: Vec<Body>| -> f64 {
                let of = |body: &Body| {
                    let turning = 0.5 * f64::from(RADIUS * RADIUS) * f64::from(body.angular_velocity);
                    body.position.perp_dot(body.velocity.as_dvec2()) + turning
                };
                bodies.iter().map(of).sum()
            };
            let before = momentum(course.simulation.bodies());
            Ok(momentum(course.after(0.1)?) / before)
        },
    }
}

/// The lowest corner of a box is stopped: where friction can hold it altogether, else it slides on.
fn corner((width, height): (f32, f32), degrees: f32, velocity: Vec2) -> Law {
    let rotation = Rot::from_angle(degrees.to_radians());
    let half = 0.5 * Vec2::new(width, height);
    let corners = [-half, Vec2::new(half.x, -half.y)].map(|corner| rotation.rotate(corner));
    let arm = if corners[0].y < corners[1].y { corners[0] } else { corners[1] };
    // By the mass of the box.
    let inertia = half.length_squared() / 3.0;
    let (xx, xy, yy) = (1.0 + arm.y * arm.y / inertia, -arm.x * arm.y / inertia, 1.0 + arm.x * arm.x / inertia);
    let held = Vec2::new(velocity.y * xy - velocity.x * yy, velocity.x * xy - velocity.y * xx) / (xx * yy - xy * xy);
    let pull = FRICTION.copysign(held.x);
    let slides = held.x.abs() > FRICTION * held.y;
    let impulse = if slides { Vec2::new(pull, 1.0) * (-velocity.y / (yy + xy * pull)) } else { held };
    let start = move |hertz: f64, phase: f64| {
        let high = f64::from(-velocity.y) / hertz * (2.0 + phase) - f64::from(arm.y);
        let square = (Shape::rectangle(width, height), rough(FRICTION), DVec2::new(0.0, high), rotation, velocity, 0.0);
        world(hertz, 0.0, vec![floor(rough(FRICTION))], &[square])
    };
    let how = if slides { ", and slides on" } else { "" };
    Law {
        name: format!("a box lands on a corner, turned by {degrees} degrees{how}: spin after"),
        theory: Box::new(move || f64::from(arm.perp_dot(impulse) / inertia)),
        phases: PHASES,
        start: Box::new(start),
        read: |course| Ok(course.after(3.0 / course.hertz)?[0].angular_velocity.into()),
    }
}

/// What lies between a heavy body and the floor is stopped with it, and throws nothing back.
fn heavy(ratio: f32) -> Law {
    let start = move |hertz: f64, phase: f64| {
        let high = 1.5 + 10.0 / hertz * (2.0 + phase);
        let square = |density: f32, high: f64, speed: f32| {
            let material = Material { density, ..rough(FRICTION) };
            (Shape::rectangle(1.0, 1.0), material, DVec2::new(0.0, high), Rot::IDENTITY, Vec2::new(0.0, -speed), 0.0)
        };
        world(hertz, -10.0, vec![floor(rough(FRICTION))], &[square(1.0, 0.5, 0.0), square(ratio, high, 10.0)])
    };
    Law {
        name: format!(
            "a box falls at 10 m/s on one of 1/{ratio} of its mass on the floor: part of its speed that is gone"
        ),
        theory: Box::new(|| 1.0),
        phases: PHASES,
        start: Box::new(start),
        read: |course| {
            let mut fastest = f64::NEG_INFINITY;
            for _ in 0..30 {
                fastest = fastest.max(course.after(1.0 / 60.0)?[1].velocity.y.into());
            }
            Ok(1.0 - fastest / 10.0)
        },
    }
}

/// Where one box of a floor ends and the next begins, nothing is felt.
fn seam() -> Law {
    let material = Material { friction: 0.0, restitution: 1.0, ..Material::default() };
    let start = move |hertz: f64, phase: f64| {
        let tile = |k: u64| {
            let kind = Kind::new(Shape::rectangle(10.0, 2.0), material);
            StaticBody::new(GlobalId(k), kind, DVec2::new(10.0 * k as f64 - 5.0, -1.0))
        };
        let direction = DVec2::new(0.5, -0.75_f64.sqrt());
        let place = DVec2::new(-0.1, f64::from(RADIUS)) - direction * (10.0 / hertz * (2.0 + phase));
        let disc = (Shape::circle(RADIUS), material, place, Rot::IDENTITY, (direction * 10.0).as_vec2(), 0.0);
        world(hertz, 0.0, vec![tile(0), tile(1)], &[disc])
    };
    Law {
        name: "an elastic disc lands at 10 m/s and 60 degrees, 0.1 m before a seam of the floor: speed along it"
            .to_owned(),
        theory: Box::new(|| 5.0),
        phases: PHASES,
        start: Box::new(start),
        read: |course| Ok(course.after(0.2)?[0].velocity.x.into()),
    }
}

/// g (sin a - mu cos a) of what slides, 2/3 g sin a of a disc that rolls.
fn incline(name: &str, degrees: f32, friction: f32, shape: Shape) -> Law {
    let turned = Rot::from_angle(-degrees.to_radians());
    let (down, up) = (turned.rotate(Vec2::X), turned.rotate(Vec2::Y));
    let (rolls, half) = match shape {
        Shape::Circle { radius } => (true, radius),
        Shape::Box { half } => (false, half.y),
        _ => unreachable!("no law is about other shapes"),
    };
    let (sine, cosine) = (f64::from(degrees).to_radians().sin(), f64::from(degrees).to_radians().cos());
    let start = move |hertz: f64, _: f64| {
        let slope = StaticBody { rotation: turned, position: (up * -1.0).as_dvec2(), ..floor(rough(friction)) };
        let place = (up * half - down * 15.0).as_dvec2();
        world(hertz, -10.0, vec![slope], &[(shape.clone(), rough(friction), place, turned, Vec2::ZERO, 0.0)])
    };
    Law {
        name: format!("{name} {degrees} degrees, friction {friction}: acceleration"),
        theory: Box::new(move || if rolls { 10.0 * sine / 1.5 } else { 10.0 * (sine - f64::from(friction) * cosine) }),
        phases: PHASES,
        start: Box::new(start),
        read: |course| {
            let speed = |bodies: Vec<Body>| f64::from(bodies[0].velocity.length());
            let first = speed(course.after(0.5)?);
            Ok(speed(course.after(1.5)?) / 1.5 - first / 1.5)
        },
    }
}

/// Down from 5 m and up to the first peak: the square of the restitution.
fn bounce(name: &str, shape: &Shape, restitution: f32) -> Law {
    let shape = shape.clone();
    let half = match shape {
        Shape::Circle { radius } => radius,
        Shape::Box { half } => half.y,
        _ => unreachable!("no law is about other shapes"),
    };
    let material = Material { friction: 0.0, restitution, ..Material::default() };
    let start = move |hertz: f64, phase: f64| {
        // Falling from 5 m takes a second: a step more or less is 0.17 m at 60 Hz.
        let high = f64::from(half) + 5.0 + 10.0 / hertz * phase;
        let body = (shape.clone(), material, DVec2::new(0.0, high), Rot::IDENTITY, Vec2::ZERO, 0.0);
        world(hertz, -10.0, vec![floor(Material { restitution: 0.0, ..material })], &[body])
    };
    Law {
        name: format!("a {name} of restitution {restitution} bounces: height by that of its fall"),
        theory: Box::new(move || f64::from(restitution * restitution)),
        phases: PHASES,
        start: Box::new(start),
        read: |course| {
            let (mut rises, mut peak, mut first) = (false, f64::MIN, None);
            for _ in 0..(4.0 * course.hertz) as u64 {
                let body = course.after(1.0 / course.hertz)?[0];
                let (high, speed) = (body.position.y, body.velocity.y);
                first.get_or_insert(high - 0.5 * f64::from(speed) / course.hertz);
                if rises && speed < 0.0 {
                    break;
                }
                rises |= speed > 0.0;
                if rises {
                    peak = peak.max(high);
                }
            }
            let ground = 0.25;
            Ok((peak - ground) / (first.unwrap_or(f64::NAN) - ground))
        },
    }
}
