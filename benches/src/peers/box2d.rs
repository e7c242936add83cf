//! The scene in Box2D v3, through its C interface.

use super::given::{Corners, Given};
use super::{Failure, Simulation};
use ::atoll_core::{Body, Kind, Material, Params, Rot, Shape, StaticBody};
use boxdd_sys::ffi;
use glam::Vec2;
use std::ffi::{CStr, c_char, c_int};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Bodies of one world, at most. A solver block counts in 16 bits and a thread gets at most four blocks, so that one
/// thread takes less than 4 x 65,536 of anything.
pub const MOST_BODIES: usize = 250_000;
/// Threads of one world, at most (`B2_MAX_WORKERS`).
const MOST_THREADS: usize = 32;

/// The version of Box2D, and of its sources.
pub fn version() -> String {
    // SAFETY: reads constants.
    let version = unsafe { ffi::b2GetVersion() };
    let commit = &boxdd_sys::UPSTREAM_SHA[..8];
    format!("{}.{}.{} ({commit})", version.major, version.minor, version.revision)
}

/// Whether Box2D was compiled with its assertions, which a comparison cannot have.
pub fn has_assertions() -> bool {
    static FOUND: OnceLock<bool> = OnceLock::new();
    static HEARD: AtomicBool = AtomicBool::new(false);

    unsafe extern "C" fn listen(_: *const c_char, _: *const c_char, _: c_int) -> c_int {
        HEARD.store(true, Ordering::Relaxed);
        0
    }
    unsafe extern "C" fn tell(condition: *const c_char, file: *const c_char, line: c_int) -> c_int {
        // SAFETY: Box2D hands over string literals.
        let [condition, file] = [condition, file].map(|text| unsafe { CStr::from_ptr(text) }.to_string_lossy());
        eprintln!("Box2D's assertion failed: {condition}, {file}:{line}");
        1
    }
    *FOUND.get_or_init(|| {
        // SAFETY: these set a global, which nothing reads as long as no world exists, and worlds are made after this. No
        // handler at all is what an assertion forbids: it calls the one before.
        unsafe {
            ffi::b2SetAssertFcn(Some(listen));
            ffi::b2SetAssertFcn(None);
            ffi::b2SetAssertFcn(Some(tell));
        }
        HEARD.load(Ordering::Relaxed)
    })
}

/// A scene in Box2D, a world for each room.
#[derive(Debug)]
pub struct Worlds<'a, W> {
    worlds: Vec<ffi::b2WorldId>,
    given: &'a W,
    /// In the order of the ids, whatever the world.
    bodies: Vec<ffi::b2BodyId>,
    /// What moves on a path.
    driven: Vec<(ffi::b2BodyId, &'a StaticBody)>,
    dt: f32,
    substeps: c_int,
    /// Steps made.
    step: u64,
}

/// The rooms, with the number of their bodies.
fn rooms(given: &impl Given) -> Vec<(Corners, usize)> {
    let mut rooms: Vec<(Corners, usize)> = Vec::new();
    for (index, _) in (0..).zip(given.bodies()) {
        let corners = given.home(index);
        match rooms.iter_mut().find(|(room, _)| *room == corners) {
            Some((_, bodies)) => *bodies += 1,
            None => rooms.push((corners, 1)),
        }
    }
    rooms
}

/// Whether a room that is not the only one has this wall: walls stand inside their room.
fn stands_in(room: &Corners, fixed: &StaticBody) -> bool {
    let place = fixed.position.to_array();
    (0..2).all(|axis| (room[0][axis]..=room[1][axis]).contains(&place[axis]))
}

impl<'a, W: Given> Worlds<'a, W> {
    /// Builds them.
    ///
    /// # Errors
    /// If Box2D can hold no such world, or was not built for speed.
    pub fn new(given: &'a W) -> Result<Self, Failure> {
        let (blueprint, threads) = (given.blueprint(), given.threads());
        let params = &blueprint.params;
        if has_assertions() && !cfg!(debug_assertions) {
            return Err(Failure::refused("Box2D was built with its assertions: add -DNDEBUG to your CFLAGS"));
        }
        let rooms = rooms(given);
        if let Some((_, bodies)) = rooms.iter().find(|(_, bodies)| *bodies > MOST_BODIES) {
            return Err(Failure::refused(format!(
                "{bodies} bodies in one world: Box2D {} goes wrong above {MOST_BODIES}; ask for fewer --bodies",
                version()
            )));
        }
        if threads > MOST_THREADS {
            let message = format!("{threads} threads: Box2D uses at most {MOST_THREADS}; ask for fewer --threads");
            return Err(Failure::refused(message));
        }
        let mut worlds = Self {
            worlds: Vec::new(),
            given,
            bodies: Vec::with_capacity(rooms.iter().map(|(_, bodies)| bodies).sum()),
            driven: Vec::new(),
            dt: params.dt,
            substeps: params.substeps as c_int,
            step: 0,
        };
        for (room, _) in &rooms {
            let world = create_world(params, threads)?;
            worlds.worlds.push(world);
            for fixed in blueprint.statics.iter().filter(|fixed| rooms.len() == 1 || stands_in(room, fixed)) {
                let body = create_static(world, fixed);
                worlds.driven.extend(fixed.path.map(|_| (body, fixed)));
            }
        }
        for (index, body) in (0..).zip(given.bodies()) {
            let corners = given.home(index);
            let room = rooms.iter().position(|(room, _)| *room == corners).expect("every home is a room");
            let kind = &blueprint.kinds[body.kind.0 as usize];
            worlds.bodies.push(create_dynamic(worlds.worlds[room], &body, kind, params));
        }
        Ok(worlds)
    }
}

fn create_world(params: &Params, threads: usize) -> Result<ffi::b2WorldId, Failure> {
    // SAFETY: a definition begins as the default one and stays one; Box2D copies it. Worlds are created and destroyed
    // one at a time: `CREATION` guards Box2D's global table of worlds.
    unsafe {
        let _one_at_a_time = CREATION.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let mut def = ffi::b2DefaultWorldDef();
        def.gravity = ffi::b2Vec2 { x: params.gravity.x, y: params.gravity.y };
        def.restitutionThreshold = params.restitution_threshold;
        def.contactHertz = params.contact_hertz;
        def.contactDampingRatio = params.contact_damping_ratio;
        def.contactSpeed = params.push_out_speed;
        def.maximumLinearSpeed = def.maximumLinearSpeed.min(params.max_linear_speed);
        def.enableSleep = false;
        def.enableContinuous = false;
        def.workerCount = threads as c_int;
        let world = ffi::b2CreateWorld(&def);
        if !ffi::b2World_IsValid(world) {
            return Err(Failure::broken("Box2D makes no more worlds"));
        }
        ffi::b2World_SetContactRecycleDistance(world, params.recycle_distance);
        Ok(world)
    }
}

static CREATION: std::sync::Mutex<()> = std::sync::Mutex::new(());

fn create_static(world: ffi::b2WorldId, fixed: &StaticBody) -> ffi::b2BodyId {
    let place = fixed.position.as_vec2();
    // SAFETY: as in `create_world`, and the world exists.
    unsafe {
        let mut def = ffi::b2DefaultBodyDef();
        def.position = ffi::b2Vec2 { x: place.x, y: place.y };
        def.rotation = ffi::b2Rot { c: fixed.rotation.c, s: fixed.rotation.s };
        if fixed.path.is_some() {
            def.type_ = ffi::b2BodyType_b2_kinematicBody;
        }
        let id = ffi::b2CreateBody(world, &def);
        create_shapes(id, &fixed.kind);
        id
    }
}

fn create_dynamic(world: ffi::b2WorldId, body: &Body, kind: &Kind, params: &Params) -> ffi::b2BodyId {
    let place = body.position.as_vec2();
    // SAFETY: as in `create_static`.
    unsafe {
        let mut def = ffi::b2DefaultBodyDef();
        def.type_ = ffi::b2BodyType_b2_dynamicBody;
        def.position = ffi::b2Vec2 { x: place.x, y: place.y };
        def.rotation = ffi::b2Rot { c: body.rotation.c, s: body.rotation.s };
        def.linearVelocity = ffi::b2Vec2 { x: body.velocity.x, y: body.velocity.y };
        def.angularVelocity = body.angular_velocity;
        def.linearDamping = params.linear_damping + kind.dynamics.linear_damping;
        def.angularDamping = params.angular_damping + kind.dynamics.angular_damping;
        def.gravityScale = kind.dynamics.gravity_scale;
        def.motionLocks.angularZ = kind.dynamics.fixed_rotation;
        def.enableSleep = false;
        let id = ffi::b2CreateBody(world, &def);
        create_shapes(id, kind);
        id
    }
}

/// Gives a body that exists its shapes.
fn create_shapes(body: ffi::b2BodyId, kind: &Kind) {
    let Material { density, friction, restitution, .. } = kind.material;
    // SAFETY: the callers just created the body; definition and outline are copied.
    unsafe {
        let mut def = ffi::b2DefaultShapeDef();
        def.density = density;
        def.material.friction = friction;
        def.material.restitution = restitution;
        def.filter.categoryBits = kind.filter.categories.into();
        def.filter.maskBits = kind.filter.mask.into();
        match kind.shape {
            Shape::Circle { radius } => {
                let circle = ffi::b2Circle { center: ffi::b2Vec2 { x: 0.0, y: 0.0 }, radius };
                ffi::b2CreateCircleShape(body, &def, &circle);
            }
            Shape::Box { half } => {
                ffi::b2CreatePolygonShape(body, &def, &ffi::b2MakeBox(half.x, half.y));
            }
            ref shape => {
                for (corners, radius) in shape.outlines() {
                    let corners: Vec<ffi::b2Vec2> = corners.iter().map(|&Vec2 { x, y }| ffi::b2Vec2 { x, y }).collect();
                    match corners[..] {
                        [center] => {
                            ffi::b2CreateCircleShape(body, &def, &ffi::b2Circle { center, radius });
                        }
                        [point1, point2] if radius == 0.0 => {
                            ffi::b2CreateSegmentShape(body, &def, &ffi::b2Segment { point1, point2 });
                        }
                        [center1, center2] => {
                            ffi::b2CreateCapsuleShape(body, &def, &ffi::b2Capsule { center1, center2, radius });
                        }
                        _ => {
                            let hull = ffi::b2ComputeHull(corners.as_ptr(), corners.len() as c_int);
                            ffi::b2CreatePolygonShape(body, &def, &ffi::b2MakePolygon(&hull, radius));
                        }
                    }
                }
            }
        }
    }
}

impl<W: Given> Simulation for Worlds<'_, W> {
    fn step(&mut self) -> Result<(), String> {
        self.step += 1;
        for &(body, fixed) in &self.driven {
            let (place, turned) = fixed.pose(self.step, self.dt);
            let place = place.as_vec2();
            let target = ffi::b2WorldTransform {
                p: ffi::b2Vec2 { x: place.x, y: place.y },
                q: ffi::b2Rot { c: turned.c, s: turned.s },
            };
            // SAFETY: as in `mass`.
            unsafe { ffi::b2Body_SetTargetTransform(body, target, self.dt, true) };
        }
        for &world in &self.worlds {
            // SAFETY: the world is ours and lives until the drop; nothing else touches it meanwhile.
            unsafe { ffi::b2World_Step(world, self.dt, self.substeps) };
        }
        Ok(())
    }

    fn mass(&self) -> f64 {
        // SAFETY: no body is ever destroyed before its world, and that is ours.
        self.bodies.iter().map(|&body| f64::from(unsafe { ffi::b2Body_GetMass(body) })).sum()
    }

    fn bodies(&self) -> Vec<Body> {
        let state = |(start, &body): (Body, &ffi::b2BodyId)| {
            // SAFETY: as in `mass`.
            let (place, turned, velocity, angular_velocity) = unsafe {
                (
                    ffi::b2Body_GetPosition(body),
                    ffi::b2Body_GetRotation(body),
                    ffi::b2Body_GetLinearVelocity(body),
                    ffi::b2Body_GetAngularVelocity(body),
                )
            };
            Body {
                position: [f64::from(place.x), f64::from(place.y)].into(),
                rotation: Rot { c: turned.c, s: turned.s },
                velocity: [velocity.x, velocity.y].into(),
                angular_velocity,
                ..start
            }
        };
        self.given.bodies().zip(&self.bodies).map(state).collect()
    }
}

impl<W> Drop for Worlds<'_, W> {
    fn drop(&mut self) {
        let _one_at_a_time = CREATION.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        for &world in &self.worlds {
            // SAFETY: each was created once and is destroyed once, here.
            unsafe { ffi::b2DestroyWorld(world) };
        }
    }
}
