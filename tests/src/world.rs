//! Small worlds, and ways to cut them into tiles.
//!
//! A [`Scene`] is a world before it is cut. [`Scene::start`] cuts it by a [`Way`] and gives a [`Sim`], which steps it
//! alone in its process; [`crate::ranks::run`] spreads the same tiles over several ranks.

use atoll_core::{
    Blueprint, Body, Exchange, Facts, GlobalId, Hashes, Kind, KindId, Loopback, Material, Params, Partition, Rot,
    Segment, Shape, StaticBody, StepReport, TileId, World, finish, step,
};
use glam::{DVec2, Vec2};

/// Where the tile borders run, seen from the middle of the action.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Cut {
    /// Nowhere: one tile.
    Whole,
    /// One from below to above, through the middle.
    Columns,
    /// One from left to right, through the middle.
    Rows,
    /// Both: four tiles meet in the middle.
    Corner,
}

impl Cut {
    /// All of them, the uncut world first.
    pub const ALL: [Self; 4] = [Self::Whole, Self::Columns, Self::Rows, Self::Corner];

    /// Columns and rows of tiles.
    pub const fn tiles(self) -> (u32, u32) {
        match self {
            Self::Whole => (1, 1),
            Self::Columns => (2, 1),
            Self::Rows => (1, 2),
            Self::Corner => (2, 2),
        }
    }
}

/// How a scene is cut and how its tiles speak to each other.
pub type Way = (Cut, Exchange);

/// Every cut with an exchange after every substep: what must not differ from an uncut world.
pub const EXACT_WAYS: [Way; 4] = [
    (Cut::Whole, Exchange::Substep),
    (Cut::Columns, Exchange::Substep),
    (Cut::Rows, Exchange::Substep),
    (Cut::Corner, Exchange::Substep),
];

/// Every cut with either exchange.
pub const ALL_WAYS: [Way; 8] = [
    (Cut::Whole, Exchange::Substep),
    (Cut::Columns, Exchange::Substep),
    (Cut::Rows, Exchange::Substep),
    (Cut::Corner, Exchange::Substep),
    (Cut::Whole, Exchange::Step),
    (Cut::Columns, Exchange::Step),
    (Cut::Rows, Exchange::Step),
    (Cut::Corner, Exchange::Step),
];

/// A world before it is cut into tiles. Statics must be added before bodies, so that they have the lowest names.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The numbers of a step.
    pub params: Params,
    /// Where tile borders cross, in meters; [`Scene::start`] builds its tiles around this point.
    pub middle: DVec2,
    /// Half the width and height of the domain, in meters.
    pub half: DVec2,
    /// The table of dynamic kinds.
    pub kinds: Vec<Kind>,
    /// Bodies that never move.
    pub statics: Vec<StaticBody>,
    /// Bodies that do.
    pub bodies: Vec<Body>,
}

impl Scene {
    /// An empty world around `middle`, with gravity along y in m/s^2.
    pub fn new(middle: DVec2, gravity: f32) -> Self {
        Self {
            params: Params { gravity: Vec2::new(0.0, gravity), ..Params::default() },
            middle,
            half: DVec2::splat(20.0),
            kinds: Vec::new(),
            statics: Vec::new(),
            bodies: Vec::new(),
        }
    }

    /// Adds a shape and a material to the table.
    pub fn kind(&mut self, shape: Shape, material: Material) -> KindId {
        self.kinds.push(Kind::new(shape, material));
        KindId(self.kinds.len() as u32 - 1)
    }

    /// Adds a static box of the given whole sides, turned by `angle` radians.
    pub fn wall(&mut self, position: DVec2, (width, height): (f32, f32), angle: f32, material: Material) -> GlobalId {
        let id = self.fixed(Shape::rectangle(width, height), position, material);
        self.statics.last_mut().expect("it was added").rotation = Rot::from_angle(angle);
        id
    }

    /// Adds a static of any shape.
    ///
    /// # Panics
    /// If there are bodies.
    pub fn fixed(&mut self, shape: Shape, position: DVec2, material: Material) -> GlobalId {
        assert!(self.bodies.is_empty(), "statics come before bodies");
        let id = GlobalId(self.statics.len() as u64);
        self.statics.push(StaticBody::new(id, Kind::new(shape, material), position));
        id
    }

    /// Adds a segment, solid on its right, between two corners seen from a place, and those before and after.
    ///
    /// # Panics
    /// If that is none.
    pub fn segment(&mut self, place: DVec2, [from, to]: [Vec2; 2], [before, after]: [Option<Vec2>; 2]) {
        let (segment, middle) = Segment::new(before, from, to, after).expect("a segment");
        let kind = Kind::new(Shape::Segment(segment), Material::default());
        let id = GlobalId(self.statics.len() as u64);
        self.statics.push(StaticBody::new(id, kind, place + middle.as_dvec2()));
    }

    /// Adds a body with the next free name.
    pub fn body(&mut self, kind: KindId, position: DVec2, velocity: Vec2) -> GlobalId {
        let id = GlobalId((self.statics.len() + self.bodies.len()) as u64);
        let (rotation, angular_velocity) = (Rot::IDENTITY, 0.0);
        self.bodies.push(Body { id, position, rotation, velocity, angular_velocity, kind });
        id
    }

    /// The body added last.
    pub fn last(&mut self) -> &mut Body {
        self.bodies.last_mut().expect("a body was added")
    }

    /// All but the bodies, on any number of tiles.
    pub fn blueprint(&self, (columns, rows): (u32, u32), exchange: Exchange) -> Blueprint {
        let partition = Partition::uniform(self.middle - self.half, self.middle + self.half, columns, rows);
        Blueprint {
            params: Params { exchange, ..self.params.clone() },
            partition: partition.expect("a domain with a size"),
            kinds: self.kinds.clone(),
            statics: self.statics.clone(),
        }
    }

    /// Cuts the world one way.
    pub fn start(&self, (cut, exchange): Way) -> Sim {
        self.start_on(cut.tiles(), exchange)
    }

    /// Cuts the world into any number of tiles.
    pub fn start_on(&self, tiles: (u32, u32), exchange: Exchange) -> Sim {
        let blueprint = self.blueprint(tiles, exchange);
        let all: Vec<_> = (0..blueprint.partition.tiles() as u32).map(TileId).collect();
        let mut world = World::new(&blueprint, &all).expect("a world that can be built");
        for &body in &self.bodies {
            assert!(world.add(body).expect("a body that can be added"), "body {} has no owner", body.id);
        }
        Sim { world, kinds: self.kinds.clone(), report: StepReport::default() }
    }
}

/// A world in one process, and what can be measured of it.
#[derive(Debug)]
pub struct Sim {
    /// The world.
    pub world: World,
    /// What the last step reported.
    pub report: StepReport,
    kinds: Vec<Kind>,
}

impl Sim {
    /// Makes some steps.
    pub fn run(&mut self, steps: u32) {
        for _ in 0..steps {
            self.report = step(&mut self.world, &mut Loopback).expect("a step that succeeds");
        }
    }

    /// All bodies by ascending name.
    pub fn bodies(&self) -> Vec<Body> {
        let mut bodies: Vec<_> = self.world.bodies().collect();
        bodies.sort_by_key(|body| body.id);
        bodies
    }

    /// One body.
    pub fn body(&self, id: GlobalId) -> Body {
        self.world.bodies().find(|body| body.id == id).expect("a body of that name")
    }

    /// Mass of a body, in kg.
    pub fn mass(&self, body: &Body) -> f64 {
        let Kind { shape, material, .. } = &self.kinds[body.kind.0 as usize];
        f64::from(material.density * shape.area())
    }

    /// Momentum of all bodies, in kg m/s.
    pub fn momentum(&self) -> DVec2 {
        self.bodies().iter().map(|body| body.velocity.as_dvec2() * self.mass(body)).sum()
    }

    /// Sum of the lengths of all bodies' momenta, in kg m/s: what a drift of momentum is measured by.
    pub fn sum_of_momenta(&self) -> f64 {
        self.bodies().iter().map(|body| body.velocity.as_dvec2().length() * self.mass(body)).sum()
    }

    /// Energy of motion of all bodies, rotation included, in J.
    pub fn kinetic_energy(&self) -> f64 {
        let energy = |body: &Body| {
            let inertia = f64::from(self.kinds[body.kind.0 as usize].shape.inertia_per_mass());
            let spin = f64::from(body.angular_velocity);
            0.5 * self.mass(body) * (body.velocity.as_dvec2().length_squared() + inertia * spin * spin)
        };
        self.bodies().iter().map(energy).sum()
    }

    /// Root mean square distance of the bodies from their mean, in m.
    pub fn extent(&self) -> f64 {
        let bodies = self.bodies();
        let count = bodies.len() as f64;
        let mean = bodies.iter().map(|body| body.position).sum::<DVec2>() / count;
        (bodies.iter().map(|body| (body.position - mean).length_squared()).sum::<f64>() / count).sqrt()
    }

    /// The greatest speed of a body, in m/s.
    pub fn greatest_speed(&self) -> f32 {
        self.world.bodies().map(|body| body.velocity.length()).fold(0.0, f32::max)
    }

    /// Fingerprints of bodies and contacts.
    pub fn hashes(&self) -> Hashes {
        self.world.hashes()
    }

    /// Ends the run and measures where everything came to rest.
    pub fn finish(self) -> Facts {
        Facts::total(finish(self.world, &mut Loopback).expect("a run that ends well"))
    }
}

/// The `k`-th of the numbers that belong to a seed, evenly within 0 to 1: SplitMix64, whose numbers can be had in any
/// order.
pub fn noise(seed: u64, k: u64) -> f64 {
    let mut z = seed.wrapping_add((k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    (z >> 11) as f64 / (1_u64 << 53) as f64
}
