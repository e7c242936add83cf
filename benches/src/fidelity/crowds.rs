//! Many bodies that meet and part.

use super::hard_discs::HardDiscs;
use super::laws::{Law, world};
use super::{Course, PHASES, Start};
use crate::peers::case::{Case, SceneName, Wishes};
use crate::peers::given::Given as _;
use atoll_core::{Body, GlobalId, Kind, Material, Rot, Shape, StaticBody};
use glam::{DVec2, Vec2};

/// Cases of crowds.
pub(super) fn laws() -> Vec<Law> {
    let mut laws = vec![planks(), elastic(), haff(), spins(), fill_height(), opening()];
    laws.extend([0.1, 0.0].map(cradle));
    laws
}

const RADIUS: f32 = 0.1;

/// Planks that meet a floor thinner than they are with one end, and come down with the other.
fn planks() -> Law {
    let start = |hertz: f64, phase: f64| {
        let floor = Kind::new(Shape::rectangle(60.0, 0.02), Material::default());
        let plank = |k: u32| {
            let turned = Rot::from_angle((2.399_963_2 * (f64::from(k) + phase) % std::f64::consts::TAU) as f32);
            let place = DVec2::new(2.0 * f64::from(k) - 27.0, 1.5 + 0.03 * f64::from(k));
            (Shape::rectangle(1.0, 0.05), Material::default(), place, turned, Vec2::new(0.0, -20.0), 0.0)
        };
        let bodies: Vec<_> = (0..28).map(plank).collect();
        world(hertz, -10.0, vec![StaticBody::new(GlobalId(0), floor, DVec2::ZERO)], &bodies)
    };
    Law {
        name: "28 planks of 1 m x 5 cm fall at 20 m/s on a floor of 2 cm: part that stays above".to_owned(),
        theory: Box::new(move || 1.0),
        phases: PHASES,
        start: Box::new(start),
        read: |course| {
            let bodies = course.after(0.5)?;
            let above = bodies.iter().filter(|body| body.position.y > 0.0).count();
            Ok(above as f64 / bodies.len() as f64)
        },
    }
}

/// Smooth discs in rows in a closed room without gravity, each as fast as all others in a direction of its own.
fn gas(hertz: f64, side: u32, apart: f64, radius: f32, speed: f32, restitution: f32) -> Start {
    let material = Material { friction: 0.0, restitution, ..Material::default() };
    let half = 0.5 * f64::from(side) * apart + 1.0;
    let long = 2.0 * half as f32 + 4.0;
    let walls =
        [(DVec2::X, (2.0, long)), (DVec2::NEG_X, (2.0, long)), (DVec2::Y, (long, 2.0)), (DVec2::NEG_Y, (long, 2.0))];
    let wall = |(k, (way, (width, height)))| {
        let kind = Kind::new(Shape::rectangle(width, height), Material { restitution: 1.0, ..material });
        StaticBody::new(GlobalId(k), kind, way * (half + 1.0))
    };
    let disc = |k: u32| {
        let place =
            (DVec2::new((k % side).into(), (k / side).into()) - DVec2::splat(0.5 * f64::from(side - 1))) * apart;
        // Of all directions, in no order: by the golden angle.
        let velocity =
            Rot::from_angle((2.399_963_2 * f64::from(k) % std::f64::consts::TAU) as f32).rotate(Vec2::X) * speed;
        (Shape::circle(radius), material, place, Rot::IDENTITY, velocity, 0.0)
    };
    let bodies: Vec<_> = (0..side * side).map(disc).collect();
    let mut start = world(hertz, 0.0, (0..).zip(walls).map(wall).collect(), &bodies);
    start.blueprint.params.restitution_threshold = 0.0;
    start
}

/// Mean of v^2 / 2 per direction: the temperature of discs of mass 1.
fn temperature(bodies: &[Body]) -> f64 {
    bodies.iter().map(|body| 0.5 * f64::from(body.velocity.length_squared())).sum::<f64>() / bodies.len() as f64
}

fn elastic() -> Law {
    Law {
        name: "196 elastic discs at 5 m/s: energy left after 50 s".to_owned(),
        theory: Box::new(move || 1.0),
        phases: 1,
        start: Box::new(|hertz, _| gas(hertz, 14, 1.0, 0.2, 5.0, 1.0)),
        read: |course| {
            let before = temperature(&course.simulation.bodies());
            Ok(temperature(&course.after(50.0)?) / before)
        },
    }
}

/// 1 / sqrt(T) grows as straight as P. Haff says (1983), and as fast as in the mean of three gases of hard discs. The theory of gases
/// that are nowhere denser than elsewhere has them cool by a twelfth faster: (1 - e^2) / 4 of the rate 2 d n g sqrt(pi) of
/// collisions at T = 1 (I. Goldhirsch, 2003; g: D. Henderson, 1975), 0.0422.
fn haff() -> Law {
    const SIDE: u32 = 70;
    const APART: f64 = 1.25;
    const SPEED: f32 = 2.0;
    const RESTITUTION: f32 = 0.8;
    // First each speed must come to what a gas has.
    const TIMES: [f64; 2] = [2.0, 12.0];
    fn slope(temperatures: [f64; 2]) -> f64 {
        let [first, last] = temperatures.map(|temperature| temperature.sqrt().recip());
        (last - first) / (TIMES[1] - TIMES[0])
    }
    let discs = HardDiscs {
        side: SIDE,
        apart: APART,
        radius: RADIUS.into(),
        speed: SPEED.into(),
        restitution: RESTITUTION.into(),
    };
    Law {
        name: "4,900 discs of restitution 0.8 cool: slope of 1 / sqrt(T)".to_owned(),
        theory: Box::new(move || (0..3).map(|gas| slope(discs.temperatures(gas, TIMES))).sum::<f64>() / 3.0),
        phases: 1,
        start: Box::new(move |hertz, _| gas(hertz, SIDE, APART, RADIUS, SPEED, RESTITUTION)),
        read: |course| {
            let first = temperature(&course.after(TIMES[0])?);
            Ok(slope([first, temperature(&course.after(TIMES[1] - TIMES[0])?)]))
        },
    }
}

/// What all engines come to as steps get shorter.
fn spins() -> Law {
    let case = || Case::new(SceneName::Normal, Wishes { bodies: Some(30_000), ..Wishes::default() });
    Law {
        name: "30,000 bodies of NORMAL after 3.33 s: mean square spin; theory: the limit of short steps".to_owned(),
        theory: Box::new(move || 83.0),
        phases: 1,
        start: Box::new(move |hertz, _| {
            let case = case().expect("a configuration of this project");
            let mut blueprint = case.blueprint().clone();
            blueprint.params.dt = (1.0 / hertz) as f32;
            Start { blueprint, bodies: case.bodies().collect() }
        }),
        read: |course| {
            let bodies = course.after(10.0 / 3.0)?;
            let sum: f64 = bodies.iter().map(|body| f64::from(body.angular_velocity).powi(2)).sum();
            Ok(sum / bodies.len() as f64)
        },
    }
}

/// Two silos beside each other, 3 m wide with a flat bottom: the opening of each, in m, and its rows of grains of about 0.1 m.
fn silos(hertz: f64, each: [(f64, u32); 2]) -> Start {
    const COLUMNS: u32 = 26;
    const PITCH: f64 = 0.112;
    let material = Material { friction: 0.5, ..Material::default() };
    let half = 0.5 * PITCH * f64::from(COLUMNS) + 0.02;
    let (mut walls, mut grains) = (Vec::new(), Vec::new());
    for (middle, (opening, rows)) in [-SILO, SILO].into_iter().zip(each) {
        for side in [-1.0, 1.0] {
            let width = half + 0.5 - 0.5 * opening;
            for (place, size) in [
                (DVec2::new(side * (half + 0.25), 8.0), (0.5, 17.0)),
                (DVec2::new(side * 0.5 * (opening + width), -0.25), (width as f32, 0.5)),
            ] {
                let kind = Kind::new(Shape::rectangle(size.0, size.1), material);
                let id = GlobalId(walls.len() as u64);
                walls.push(StaticBody::new(id, kind, place + DVec2::new(middle, 0.0)));
            }
        }
        for k in 0..COLUMNS * rows {
            // Of two sizes in no order, by the golden section, and a little beside each other: else they would stand as columns.
            let any = (0.618_034 * f64::from(k)).fract();
            let across = f64::from(k % COLUMNS) - 0.5 * f64::from(COLUMNS - 1) + 0.016 * (any - 0.5);
            let place = DVec2::new(across, f64::from(k / COLUMNS) + 0.54) * PITCH + DVec2::new(middle, 0.0);
            let radius = if any < 0.5 { 0.045 } else { 0.055 };
            grains.push((Shape::circle(radius), material, place, Rot::IDENTITY, Vec2::ZERO, 0.0));
        }
    }
    world(hertz, -10.0, walls, &grains)
}

/// From the middle of the world to that of a silo, in m.
const SILO: f64 = 6.0;

/// Grains that leave each of two silos in two seconds, once they lie on each other.
fn leave(course: &mut Course<'_>) -> Result<[f64; 2], String> {
    let below = |bodies: Vec<Body>| {
        let of =
            |side: f64| bodies.iter().filter(|body| body.position.y < -0.5 && side * body.position.x > 0.0).count();
        [of(-1.0) as f64, of(1.0) as f64]
    };
    let first = below(course.after(1.5)?);
    let then = below(course.after(2.0)?);
    Ok([then[0] - first[0], then[1] - first[1]])
}

fn fill_height() -> Law {
    Law {
        name: "a silo of 60 rows of grains empties: by the rate of one of 120".to_owned(),
        theory: Box::new(move || 1.0),
        phases: 1,
        start: Box::new(|hertz, _| silos(hertz, [(1.0, 60), (1.0, 120)])),
        read: |course| {
            let [low, high] = leave(course)?;
            Ok(low / high)
        },
    }
}

/// The rate grows with the power 3/2 of the opening less somewhat more than a grain (W. Beverloo, H. Leniger, J. van de Velde,
/// "The flow of granular solids through orifices", 1961).
fn opening() -> Law {
    const OPENINGS: [f64; 2] = [0.8, 1.4];
    Law {
        name: "silos empty: power of the opening".to_owned(),
        theory: Box::new(move || 1.5),
        phases: 1,
        start: Box::new(|hertz, _| silos(hertz, OPENINGS.map(|opening| (opening, 80)))),
        read: |course| {
            let [narrow, wide] = leave(course)?;
            let [small, large] = OPENINGS.map(|opening| opening - 0.14);
            Ok((wide / narrow).ln() / (large / small).ln())
        },
    }
}

/// Newton's: the last of five elastic discs in a row leaves as fast as the first came.
fn cradle(gap: f64) -> Law {
    let material = Material { friction: 0.0, restitution: 1.0, ..Material::default() };
    let start = move |hertz: f64, phase: f64| {
        let pitch = 2.0 * f64::from(RADIUS) + gap;
        let disc = |k: u32| {
            let far =
                if k == 0 { -2.0 / hertz * (2.0 + phase) - 2.0 * f64::from(RADIUS) } else { f64::from(k - 1) * pitch };
            let velocity = if k == 0 { Vec2::new(2.0, 0.0) } else { Vec2::ZERO };
            (Shape::circle(RADIUS), material, DVec2::new(far, 0.0), Rot::IDENTITY, velocity, 0.0)
        };
        let bodies: Vec<_> = (0..5).map(disc).collect();
        world(hertz, 0.0, Vec::new(), &bodies)
    };
    Law {
        name: format!("Newton's cradle of five, {gap} m apart: speed of the last"),
        theory: Box::new(move || 2.0),
        phases: super::PHASES,
        start: Box::new(start),
        read: |course: &mut Course<'_>| Ok(course.after(2.0)?[4].velocity.x.into()),
    }
}
