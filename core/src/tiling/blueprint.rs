//! What every rank knows alike, checked once and made ready for the step.

use crate::exchange::overlap;
use crate::model::body::{Body, StaticBody};
use crate::model::error::{BodyFault, SetupError};
use crate::model::id::{GlobalId, KindId, TileId};
use crate::model::kind::{Dynamics, Filter, Kind, KindRow};
use crate::model::math::{self, Rot};
use crate::model::params::Params;
use crate::model::path::{Course, Path};
use crate::model::softness::Softness;
use crate::parallel::lanes::LaneSet;
use crate::tiling::chains::Chains;
use crate::tiling::partition::Partition;
use crate::tiling::terrain::{Terrain, ascend};
use glam::{DVec2, Vec2};
use std::sync::Arc;

/// Everything about a world but its dynamic bodies. Every rank must be given the same.
#[derive(Clone, PartialEq, Debug)]
pub struct Blueprint {
    /// The numbers of a step.
    pub params: Params,
    /// How the domain is cut.
    pub partition: Partition,
    /// Shapes and materials of dynamic bodies; a body names its row. The largest that is not beyond
    /// [`Params::large_radius`] sets the width of the halo.
    pub kinds: Vec<Kind>,
    /// Bodies that never move, or move whatever they meet.
    pub statics: Vec<StaticBody>,
}

impl Blueprint {
    /// Whether worlds can be made of it; takes memory for its kinds and statics alone, however many tiles there are.
    ///
    /// # Errors
    /// If a parameter, a kind or a static is out of range.
    pub fn check(&self) -> Result<(), SetupError> {
        Setup::new(self).map(drop)
    }
}

/// The largest bounding radius of a dynamic body that is no greater than this, in meters.
pub(crate) fn largest_radius(kinds: &[Kind], up_to: f32) -> f32 {
    let radii = kinds.iter().map(|kind| kind.shape.bounding_radius());
    radii.filter(|&radius| radius <= up_to).fold(0.0, |most, radius| math::max(radius, most))
}

/// The width of the halo in meters, a little more than what the ghost rule asks for: bodies this near a tile's region may
/// matter to it. The largest bounding radius of a dynamic body that is not [large](Params::large_radius) and the greatest margin.
pub fn halo_width(kinds: &[Kind], params: &Params) -> f64 {
    width_for(largest_radius(kinds, params.large_radius), params)
}

/// The same for the largest bounding radius.
fn width_for(radius: f32, params: &Params) -> f64 {
    // A thousandth more, so that the rounding of a sum never decides who sees a contact.
    f64::from(radius + params.margin_cap) * 1.001
}

/// The low and the high corner of all that a static ever comes to.
fn box_of_static(body: &Body, kind: &KindRow, path: Option<&Path>) -> [DVec2; 2] {
    let (half, [least, most]) = match path {
        None => (kind.half_extents(body.rotation), [DVec2::ZERO; 2]),
        Some(path) => (Vec2::splat(kind.bounding_radius), path.extent()),
    };
    [body.position + least - half.as_dvec2(), body.position + most + half.as_dvec2()]
}

/// Whether bodies of a kind do not touch all others.
fn is_choosy(kind: &KindRow) -> bool {
    kind.sensor || kind.filter != Filter::default()
}

/// How thin and how long anything is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slimness {
    /// The least inner radius of a dynamic body that is no sensor, in meters.
    pub(crate) of_bodies: f32,
    /// The least inner radius of a static that is no sensor, in meters; infinite where there is none.
    pub(crate) of_statics: f32,
    /// The least sum of that of such a static and of a dynamic body, in meters.
    pub(crate) of_both: f32,
    /// How far from its center anything lies of a dynamic body that is not round, at most, in meters.
    pub(crate) longest_arm: f32,
}

impl Slimness {
    /// Of dynamic kinds, and those of statics behind them.
    fn of(kinds: &[KindRow], dynamic_kinds: usize) -> Self {
        let (own, fixed) = kinds.split_at(dynamic_kinds);
        let nothing = f32::INFINITY;
        let of_statics = fixed.iter().map(breadth).fold(nothing, math::min);
        let of_nobody = Self { of_bodies: nothing, of_statics, of_both: nothing, longest_arm: 0.0 };
        own.iter().fold(of_nobody, Self::with)
    }

    /// With one dynamic kind more.
    fn with(self, kind: &KindRow) -> Self {
        let of_bodies = math::min(self.of_bodies, breadth(kind));
        let longest_arm = math::max(self.longest_arm, kind.not_round * kind.bounding_radius);
        Self { of_bodies, of_both: of_bodies + self.of_statics, longest_arm, ..self }
    }
}

/// Whether it is of length one.
fn is_turn(rotation: Rot) -> bool {
    (rotation.c * rotation.c + rotation.s * rotation.s - 1.0).abs() < 1e-3
}

/// Inner radius; a sensor is never too thin.
fn breadth(kind: &KindRow) -> f32 {
    if kind.sensor { f32::INFINITY } else { kind.inner_radius }
}

/// How the bodies of each kind move by themselves; empty if all do alike.
fn factors(kinds: &[KindRow], params: &Params) -> Vec<[f32; 4]> {
    let all_alike = kinds.iter().all(|kind| kind.dynamics == Dynamics::default());
    if all_alike { Vec::new() } else { kinds.iter().map(|kind| kind.dynamics.factors(params)).collect() }
}

/// The blueprint, made ready.
#[derive(Clone, Debug)]
pub(crate) struct Setup {
    pub(crate) params: Params,
    pub(crate) partition: Partition,
    /// The dynamic kinds, then one for each static.
    pub(crate) kinds: Vec<KindRow>,
    pub(crate) dynamic_kinds: usize,
    pub(crate) statics: Vec<Body>,
    /// How each of them moves; empty where none does.
    paths: Vec<Option<Path>>,
    /// The rows of those that do.
    going: Vec<u32>,
    /// For each of them whether its surface moves; empty where none does.
    driving: Vec<bool>,
    /// Where they stand.
    pub(crate) terrain: Arc<Terrain>,
    /// Their names, sorted, and the row of each.
    static_names: Vec<(GlobalId, u32)>,
    /// Bodies this near a tile's region may matter to it, in meters.
    pub(crate) halo_width: f64,
    /// Large bodies this near may; as wide where there are none.
    pub(crate) wide_halo: f64,
    /// A contact of bodies that both come this near a tile's region is solved there as well (see `exchange/overlap.rs`), in
    /// meters. None where each contact is solved by the owners of its bodies alone.
    pub(crate) overlap: Option<f64>,
    /// Length of a substep, in seconds.
    pub(crate) h: f32,
    pub(crate) lanes: LaneSet,
    pub(crate) softness: Softness,
    pub(crate) static_softness: Softness,
    /// Whether anything bounces.
    pub(crate) bouncy: bool,
    pub(crate) slimness: Slimness,
    /// Whether there are bodies that do not touch all others.
    pub(crate) filters: bool,
    /// Whether there are sensors.
    pub(crate) sensors: bool,
    /// Whether there are shapes of several pieces.
    pub(crate) compounds: bool,
    pub(crate) chains: Chains,
    /// For each dynamic kind how its bodies move by themselves ([`Dynamics::factors`]); empty where all do alike.
    pub(crate) factors: Vec<[f32; 4]>,
}

impl Setup {
    pub(crate) fn new(blueprint: &Blueprint) -> Result<Self, SetupError> {
        let params = blueprint.params.clone();
        params.check()?;
        let mut kinds = Vec::with_capacity(blueprint.kinds.len() + blueprint.statics.len());
        for (row, kind) in (0..).zip(&blueprint.kinds) {
            kinds.push(KindRow::dynamic(kind, KindId(row))?);
        }
        let dynamic_kinds = kinds.len();
        let mut statics = Vec::with_capacity(blueprint.statics.len());
        for fixed in &blueprint.statics {
            let refuse = SetupError::BadStatic { id: fixed.id };
            let row = KindRow::fixed(&fixed.kind).ok_or(refuse.clone())?;
            let body = Body {
                id: fixed.id,
                position: fixed.position,
                rotation: fixed.rotation,
                velocity: Vec2::ZERO,
                angular_velocity: 0.0,
                kind: KindId(kinds.len() as u32),
            };
            let is_somewhere = body.is_finite() && !body.is_too_far();
            if !is_somewhere || !is_turn(body.rotation) || fixed.path.is_some_and(|path| !path.is_valid()) {
                return Err(refuse);
            }
            kinds.push(row);
            statics.push(body);
        }
        let any_moves = blueprint.statics.iter().any(|fixed| fixed.path.is_some());
        let paths = if any_moves { blueprint.statics.iter().map(|fixed| fixed.path).collect() } else { Vec::new() };
        let going =
            (0..).zip(&blueprint.statics).filter(|(_, fixed)| fixed.path.is_some()).map(|(row, _)| row).collect();
        let drives = |fixed: &StaticBody| fixed.path.is_some() || fixed.kind.material.surface_speed != 0.0;
        let any_drives = blueprint.statics.iter().any(drives);
        let driving = if any_drives { blueprint.statics.iter().map(drives).collect() } else { Vec::new() };
        let mut static_names: Vec<_> = statics.iter().map(|body| body.id).zip(0..).collect();
        static_names.sort_unstable();
        if let Some(pair) = static_names.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            return Err(SetupError::BadStatic { id: pair[0].0 });
        }
        let halo_width = halo_width(&blueprint.kinds, &params);
        let boxes = blueprint.statics.iter().zip(&statics);
        let boxes = boxes.map(|(fixed, body)| box_of_static(body, &kinds[body.kind.0 as usize], fixed.path.as_ref()));
        let goes = |row: u32| blueprint.statics[row as usize].path.is_some();
        let terrain = Arc::new(Terrain::new(boxes.collect(), goes, halo_width));
        let wide_halo = width_for(largest_radius(&blueprint.kinds, f32::INFINITY), &params);
        let bouncy = kinds.iter().any(|kind| kind.material.restitution > 0.0);
        let filters = kinds.iter().any(is_choosy);
        let sensors = kinds.iter().any(|kind| kind.sensor);
        let compounds = kinds.iter().any(KindRow::is_compound);
        let factors = factors(&kinds[..dynamic_kinds], &params);
        let chains = Chains::new(&kinds[dynamic_kinds..], &statics);
        Ok(Self {
            partition: blueprint.partition.clone(),
            halo_width,
            wide_halo,
            overlap: overlap::depth(&params).map(|part| part * halo_width),
            h: params.substep(),
            lanes: LaneSet::of(params.instructions)
                .ok_or(SetupError::NoInstructions { wanted: params.instructions.name() })?,
            softness: Softness::contact(&params),
            static_softness: Softness::static_contact(&params),
            bouncy,
            slimness: Slimness::of(&kinds, dynamic_kinds),
            filters,
            sensors,
            compounds,
            chains,
            factors,
            kinds,
            dynamic_kinds,
            statics,
            paths,
            going,
            driving,
            terrain,
            static_names,
            params,
        })
    }

    /// The same for another partition of the same domain.
    pub(crate) fn with_partition(&self, partition: &Partition) -> Self {
        Self { partition: partition.clone(), ..self.clone() }
    }

    /// One more dynamic kind, after those there are: the rows of statics' kinds move on by one. Says whether more may matter to a tile
    /// from now on.
    pub(crate) fn add_kind(&mut self, kind: &Kind) -> Result<bool, SetupError> {
        let row = KindRow::dynamic(kind, KindId(self.dynamic_kinds as u32))?;
        let widths = |setup: &Self| (setup.halo_width, setup.wide_halo, setup.overlap);
        let before = widths(self);
        let width = width_for(row.bounding_radius, &self.params);
        self.wide_halo = self.wide_halo.max(width);
        if row.bounding_radius <= self.params.large_radius {
            self.halo_width = self.halo_width.max(width);
            self.overlap = overlap::depth(&self.params).map(|part| part * self.halo_width);
        }
        self.bouncy |= kind.material.restitution > 0.0;
        self.filters |= is_choosy(&row);
        self.sensors |= kind.sensor;
        self.compounds |= row.is_compound();
        self.slimness = self.slimness.with(&row);
        let moves_alike = row.dynamics == Dynamics::default();
        self.kinds.insert(self.dynamic_kinds, row);
        self.dynamic_kinds += 1;
        if !(self.factors.is_empty() && moves_alike) {
            let known = self.factors.len();
            let rest = self.kinds[known..self.dynamic_kinds].iter();
            self.factors.extend(rest.map(|kind| kind.dynamics.factors(&self.params)));
        }
        self.statics.iter_mut().for_each(|fixed| fixed.kind.0 += 1);
        Ok(widths(self) != before)
    }

    /// Whether there can be dynamic bodies of it.
    pub(crate) fn check_kind(&self, kind: &Kind) -> Result<(), SetupError> {
        KindRow::dynamic(kind, KindId(self.dynamic_kinds as u32)).map(drop)
    }

    /// Whether a dynamic body may be one of this world.
    pub(crate) fn check_body(&self, body: &Body) -> Result<(), SetupError> {
        let fault = match body {
            _ if !body.is_finite() => BodyFault::NotFinite,
            _ if body.is_too_far() => BodyFault::TooFar,
            _ if !is_turn(body.rotation) => BodyFault::NoRotation,
            _ if !self.has_kind(body.kind) => BodyFault::NoKind(body.kind),
            _ if self.is_static(body.id) => BodyFault::NameOfStatic,
            _ => return Ok(()),
        };
        Err(SetupError::BadBody { id: body.id, fault })
    }

    /// Whether a static has this name.
    pub(crate) fn is_static(&self, id: GlobalId) -> bool {
        self.row_named(id).is_some()
    }

    /// The row of the static of this name.
    pub(crate) fn row_named(&self, id: GlobalId) -> Option<u32> {
        let found = self.static_names.binary_search_by_key(&id, |&(name, _)| name).ok()?;
        Some(self.static_names[found].1)
    }

    /// Whether a dynamic body may be one of this world: its kind is in the table, its name no static's.
    pub(crate) fn knows(&self, body: &Body) -> bool {
        self.has_kind(body.kind) && !self.is_static(body.id)
    }

    /// Whether a dynamic body may be of this kind.
    pub(crate) fn has_kind(&self, kind: KindId) -> bool {
        (kind.0 as usize) < self.dynamic_kinds
    }

    #[inline(always)]
    pub(crate) fn kind(&self, kind: KindId) -> &KindRow {
        &self.kinds[kind.0 as usize]
    }

    /// The row of the static of this kind, if it is one's.
    pub(crate) fn row_of_static(&self, kind: KindId) -> Option<u32> {
        kind.0.checked_sub(self.dynamic_kinds as u32)
    }

    /// How much a body's AABB is grown on each side: as far as it may come within a step. That is limited, but for where it goes
    /// further by itself. In meters.
    #[inline(always)]
    pub(crate) fn margin(&self, velocity: Vec2) -> Vec2 {
        let speed = math::dot(velocity, velocity).sqrt();
        let any_way = math::clamp(speed * self.params.dt, self.params.margin_floor, self.params.margin_cap);
        let own_way = velocity.abs() * self.params.dt;
        Vec2::new(math::max(own_way.x, any_way), math::max(own_way.y, any_way))
    }

    /// Whether there may be large bodies.
    pub(crate) fn has_large(&self) -> bool {
        self.wide_halo > self.halo_width
    }

    /// Whether a body is so large that the halo does not reckon with it.
    #[inline(always)]
    pub(crate) fn is_large(&self, kind: KindId) -> bool {
        self.kind(kind).bounding_radius > self.params.large_radius
    }

    /// How near a tile's region a body may matter to it, in meters. Who goes so far that it may come to large ones that are nobody's
    /// ghost where it is reckons with those as well.
    #[inline(always)]
    pub(crate) fn halo_of(&self, kind: KindId, velocity: Vec2) -> f64 {
        let way = f64::from(velocity.abs().max_element() * self.params.dt);
        let is_wide = self.is_large(kind) | (self.goes_far(velocity) & (way > self.wide_halo - self.halo_width));
        if is_wide { self.wide_halo } else { self.halo_width }
    }

    /// A body of a tile further inside than this neither leaves nor is anybody's ghost, in meters. `large` says whether any of them is.
    pub(crate) fn inset(&self, large: bool) -> f64 {
        2.0 * if large { self.wide_halo } else { self.halo_width }
    }

    /// Below which speed a body of a kind rests, in m/s: so low that who falls, or turns back as it is thrown up, is slower for half of
    /// `sleep_time` at most, however weak gravity is. Nobody is to fall asleep in the air.
    pub(crate) fn sleep_speed(&self, kind: KindId) -> f32 {
        let (params, dynamics) = (&self.params, &self.kind(kind).dynamics);
        let gravity = math::dot(params.gravity, params.gravity).sqrt() * dynamics.gravity_scale.abs();
        if gravity == 0.0 {
            return params.sleep_speed;
        }
        let (time, damping) =
            (math::max(params.sleep_time, params.dt), params.linear_damping + dynamics.linear_damping);
        math::min(params.sleep_speed, 0.25 * gravity * time / (1.0 + damping * time))
    }

    /// Whether a body goes further in a step than the halo has room for.
    #[inline(always)]
    pub(crate) fn goes_far(&self, velocity: Vec2) -> bool {
        let most = self.params.margin_cap;
        (velocity.x.abs() * self.params.dt > most) | (velocity.y.abs() * self.params.dt > most)
    }

    /// Half extents of a dynamic body's AABB, grown by how its turning may change it within a step and by its margin. In meters.
    #[inline(always)]
    pub(crate) fn grown_half_extents(&self, body: &Body) -> Vec2 {
        self.kind(body.kind).swept_half_extents(body.rotation, self.sweep_of(body)) + self.margin(body.velocity)
    }

    /// How far turning brings its surface in a step, at most, in meters.
    #[inline(always)]
    fn sweep_of(&self, body: &Body) -> f32 {
        let kind = self.kind(body.kind);
        kind.not_round * (kind.bounding_radius * body.angular_velocity.abs()) * self.params.dt
    }

    /// The statics that a tile may have to know: those that reach its region grown by the halo of the largest; where it solves contacts of
    /// ghosts, by three times as much: a ghost is in the halo with one end, and touches statics with the other.
    pub(crate) fn statics_of(&self, tile: TileId) -> Vec<u32> {
        let (region, mut rows) = (self.partition.region(tile), self.terrain.at_large().to_vec());
        // Rounding decides nothing here.
        let reach = DVec2::splat(1.001 * self.reach_of_statics());
        let (still, going) = self.terrain.meeting(&[(region.min - reach, region.max + reach)]);
        rows.extend(still.into_iter().map(|(_, row)| row).chain(going));
        ascend(&mut rows);
        rows.retain(|&row| self.static_reaches(row, tile));
        rows
    }

    /// Whether a static is one of [these](Self::statics_of).
    pub(crate) fn static_reaches(&self, row: u32, tile: TileId) -> bool {
        let (body, reach) = (&self.statics[row as usize], DVec2::splat(self.reach_of_statics()));
        let [low, high] = box_of_static(body, self.kind(body.kind), self.path(row));
        self.partition.region(tile).meets(low - reach, high + reach)
    }

    /// How near a tile's region it must know statics, in meters.
    pub(crate) fn reach_of_statics(&self) -> f64 {
        if self.overlap.is_some() { 3.0 * self.wide_halo } else { self.wide_halo }
    }

    /// How a static moves, if it does.
    pub(crate) fn path(&self, row: u32) -> Option<&Path> {
        self.paths.get(row as usize)?.as_ref()
    }

    /// A static as a step begins.
    pub(crate) fn static_at(&self, row: u32, step: u64) -> Body {
        let body = self.statics[row as usize];
        let Some(path) = self.path(row) else { return body };
        let Course { position, rotation, velocity, angular_velocity } =
            path.course(body.position, body.rotation, step, self.params.dt);
        Body { position, rotation, velocity, angular_velocity, ..body }
    }

    /// How a static's velocity changes in a step, in m/s^2.
    pub(crate) fn acceleration_at(&self, row: u32, step: u64) -> Vec2 {
        self.path(row).map_or(Vec2::ZERO, |path| path.acceleration(step, self.params.dt))
    }

    /// The row of a static on a path.
    pub(crate) fn row_of_going(&self, id: GlobalId) -> Option<u32> {
        self.row_named(id).filter(|&row| self.path(row).is_some())
    }

    /// The low and the high corner of all that a static sweeps in a step.
    pub(crate) fn static_box(&self, row: u32, step: u64) -> [DVec2; 2] {
        let fixed = self.static_at(row, step);
        let swept = self.swept(fixed.kind, fixed.velocity, fixed.angular_velocity);
        let half = (self.kind(fixed.kind).half_extents(fixed.rotation) + swept).as_dvec2();
        [fixed.position - half, fixed.position + half]
    }

    /// How much wider a static's AABB is, on each side, for the way that it goes in a step. In meters.
    pub(crate) fn swept(&self, kind: KindId, velocity: Vec2, angular_velocity: f32) -> f32 {
        let turns = self.kind(kind).bounding_radius * angular_velocity.abs();
        self.params.dt * (velocity.abs().max_element() + turns)
    }

    /// All statics as a step begins, by their rows.
    pub(crate) fn statics_at(&self, step: u64) -> impl Iterator<Item = Body> + '_ {
        (0..self.statics.len() as u32).map(move |row| self.static_at(row, step))
    }

    /// The rows of those that move.
    pub(crate) fn rows_that_go(&self) -> impl Iterator<Item = u32> + '_ {
        self.going.iter().copied()
    }

    /// The rows of those that never do.
    pub(crate) fn rows_that_stay(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.statics.len() as u32).filter(|&row| self.path(row).is_none())
    }

    /// Whether the surface of any static moves.
    pub(crate) fn any_drives(&self) -> bool {
        !self.driving.is_empty()
    }

    /// Whether the surface of a static moves, on a path or as a belt.
    pub(crate) fn drives(&self, fixed: KindId) -> bool {
        self.any_drives() && self.driving[fixed.0 as usize - self.dynamic_kinds]
    }
}
