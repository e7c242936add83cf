//! The scene in rapier2d.

use super::Simulation;
use super::given::Given;
use ::atoll_core::{Body, Dynamics, Kind, Params, Rot, Shape, StaticBody};
use glam::Vec2;
use rapier2d::dynamics::SpringCoefficients;
use rapier2d::prelude::{
    CoefficientCombineRule, ColliderBuilder, Group, IntegrationParameters, InteractionGroups, InteractionTestMode,
    PhysicsWorld, Pose, RigidBodyBuilder, RigidBodyHandle, SharedShape, Vector,
};

/// The version of rapier2d.
pub fn version() -> String {
    rapier2d::VERSION.to_owned()
}

/// A scene in one world of rapier2d.
pub struct Simulated<'a, W> {
    world: PhysicsWorld,
    given: &'a W,
    /// In the order of the ids.
    handles: Vec<RigidBodyHandle>,
    /// What moves on a path.
    driven: Vec<(RigidBodyHandle, &'a StaticBody)>,
    /// Steps made.
    step: u64,
}

impl<'a, W: Given> Simulated<'a, W> {
    /// Builds it; steps use the rayon pool they are called in.
    pub fn new(given: &'a W) -> Self {
        let blueprint = given.blueprint();
        let params = &blueprint.params;
        let gravity = Vector::new(params.gravity.x, params.gravity.y);
        let integration_parameters = integration_parameters(params);
        let mut world = PhysicsWorld { gravity, integration_parameters, ..PhysicsWorld::default() };
        let mut driven = Vec::new();
        for fixed in &blueprint.statics {
            let body =
                fixed.path.map_or_else(RigidBodyBuilder::fixed, |_| RigidBodyBuilder::kinematic_position_based());
            let body = body
                .translation(Vector::new(fixed.position.x as f32, fixed.position.y as f32))
                .rotation(fixed.rotation.angle());
            let (handle, _) = world.insert(body, collider(&fixed.kind));
            driven.extend(fixed.path.map(|_| (handle, fixed)));
        }
        let place = |body: Body| {
            let kind = &blueprint.kinds[body.kind.0 as usize];
            let Dynamics { gravity_scale, linear_damping, angular_damping, fixed_rotation } = kind.dynamics;
            let dynamic = RigidBodyBuilder::dynamic()
                .translation(Vector::new(body.position.x as f32, body.position.y as f32))
                .rotation(body.rotation.angle())
                .linvel(Vector::new(body.velocity.x, body.velocity.y))
                .angvel(body.angular_velocity)
                .linear_damping(params.linear_damping + linear_damping)
                .angular_damping(params.angular_damping + angular_damping)
                .gravity_scale(gravity_scale)
                .can_sleep(false)
                .ccd_enabled(false);
            let dynamic = if fixed_rotation { dynamic.lock_rotations() } else { dynamic };
            world.insert(dynamic, collider(kind)).0
        };
        let handles = given.bodies().map(place).collect();
        Self { world, given, handles, driven, step: 0 }
    }
}

fn integration_parameters(params: &Params) -> IntegrationParameters {
    let softness = |hertz| SpringCoefficients { natural_frequency: hertz, damping_ratio: params.contact_damping_ratio };
    let usual = IntegrationParameters::default();
    IntegrationParameters {
        dt: params.dt,
        num_solver_iterations: params.substeps as usize,
        contact_softness: softness(params.contact_hertz),
        static_contact_softness: softness(2.0 * params.contact_hertz),
        normalized_max_corrective_velocity: params.push_out_speed,
        normalized_max_linear_velocity: usual.normalized_max_linear_velocity.min(params.max_linear_speed),
        ..usual
    }
}

fn collider(kind: &Kind) -> ColliderBuilder {
    let shape = match kind.shape {
        Shape::Circle { radius } => ColliderBuilder::ball(radius),
        Shape::Box { half } => ColliderBuilder::cuboid(half.x, half.y),
        ref shape => {
            let mut parts: Vec<(Pose, SharedShape)> = shape.outlines().iter().map(part).collect();
            match parts.pop() {
                Some((pose, only)) if parts.is_empty() => ColliderBuilder::new(only).position(pose),
                last => ColliderBuilder::compound(parts.into_iter().chain(last).collect()),
            }
        }
    };
    let group = |bits: u32| Group::from_bits_retain(bits);
    let groups =
        InteractionGroups::new(group(kind.filter.categories), group(kind.filter.mask), InteractionTestMode::And);
    shape
        .collision_groups(groups)
        .density(kind.material.density)
        .friction(kind.material.friction)
        .friction_combine_rule(CoefficientCombineRule::GeometricMean)
        .restitution(kind.material.restitution)
        .restitution_combine_rule(CoefficientCombineRule::Max)
}

/// One of the outlines of a shape, at its place.
fn part((corners, radius): &(Vec<Vec2>, f32)) -> (Pose, SharedShape) {
    let corners: Vec<Vector> = corners.iter().map(|corner| Vector::new(corner.x, corner.y)).collect();
    match corners[..] {
        [center] => (Pose::from_translation(center), SharedShape::ball(*radius)),
        [from, to] if *radius == 0.0 => (Pose::IDENTITY, SharedShape::segment(from, to)),
        [from, to] => (Pose::IDENTITY, SharedShape::capsule(from, to, *radius)),
        _ => {
            let hull = SharedShape::round_convex_hull(&corners, *radius);
            let hull = if *radius > 0.0 { hull } else { SharedShape::convex_hull(&corners) };
            (Pose::IDENTITY, hull.expect("corners of a polygon"))
        }
    }
}

impl<W: Given> Simulation for Simulated<'_, W> {
    fn step(&mut self) -> Result<(), String> {
        self.step += 1;
        for &(handle, fixed) in &self.driven {
            let (place, turned) = fixed.pose(self.step, self.world.integration_parameters.dt);
            let pose = Pose::new(Vector::new(place.x as f32, place.y as f32), turned.angle());
            self.world.bodies[handle].set_next_kinematic_position(pose);
        }
        self.world.step();
        Ok(())
    }

    fn mass(&self) -> f64 {
        self.handles.iter().map(|&handle| f64::from(self.world.bodies[handle].mass())).sum()
    }

    fn bodies(&self) -> Vec<Body> {
        let state = |(start, &handle): (Body, &RigidBodyHandle)| {
            let body = &self.world.bodies[handle];
            let (place, turned, velocity) = (body.translation(), body.rotation(), body.linvel());
            Body {
                position: [f64::from(place.x), f64::from(place.y)].into(),
                rotation: Rot { c: turned.cos(), s: turned.sin() },
                velocity: [velocity.x, velocity.y].into(),
                angular_velocity: body.angvel(),
                ..start
            }
        };
        self.given.bodies().zip(&self.handles).map(state).collect()
    }
}
