//! Worlds that other programs have saved: what of them there is here, and what there is no counterpart for.

mod lammps;
mod rube;

use super::SceneError;
use super::file::write::World;
use super::file::{FARTHEST, is_turn};
use crate::scene::record::KindText;
use crate::wording::unmarked;
use atoll_core::{Body, Dynamics, GlobalId, Kind, Material, Rot, StaticBody};
use glam::DVec2;
use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::path::Path;
use toml::Value;

/// Longer files are not read.
const LONGEST: u64 = 4 << 30;

/// A world as it is made up from another program's.
#[derive(Default, Debug)]
pub(crate) struct Imported {
    domain: (DVec2, DVec2),
    gravity: Option<[f64; 2]>,
    kinds: Vec<Kind>,
    names: Vec<Option<String>>,
    statics: Vec<StaticBody>,
    pub(crate) bodies: Vec<Body>,
    /// Where each static and each body is in the file's own list, from zero; empty where its id tells.
    numbers: [Vec<usize>; 2],
    rows: HashMap<(String, u32), u32>,
    left_out: BTreeMap<&'static str, u64>,
}

/// What reading a file takes at most, as a multiple of its length: measured, with JSON that has no blanks, and with lines of atoms.
const NEEDED: [u64; 2] = [24, 8];

/// Reads a file of another program. `room` is told how many bytes that takes, and says whether there are as many.
///
/// # Errors
/// If there are not, it cannot be read, or is none of those that are known.
pub(crate) fn read<E: From<SceneError>>(path: &Path, room: impl FnOnce(u64) -> Result<(), E>) -> Result<Imported, E> {
    let text = text(path)?;
    let is_json = text.trim_start().starts_with('{');
    room(NEEDED[usize::from(!is_json)] * text.len() as u64)?;
    Ok(if is_json { rube::read(path, &text) } else { lammps::read(path, &text) }?)
}

fn text(path: &Path) -> Result<String, SceneError> {
    const WHAT: &str = "this world";
    let data = fs::metadata(path).map_err(|error| SceneError::read(path, WHAT, error))?;
    if !data.is_file() || data.len() > LONGEST {
        return Err(SceneError::read(path, WHAT, "it is no regular file of at most 4 GiB; name one"));
    }
    let bytes = fs::read(path).map_err(|error| SceneError::read(path, WHAT, error))?;
    String::from_utf8(bytes)
        .map(unmarked)
        .map_err(|_| SceneError::whole(path, "it is not UTF-8; save the file as that"))
}

/// Whether a file of another program can be read; whatever it is, it is refused in one line or makes a world.
///
/// # Errors
/// As with reading it.
pub fn check(path: &Path) -> Result<(), SceneError> {
    read(path, |_| Ok(())).map(drop)
}

impl Imported {
    /// What there was no counterpart for, in words; nothing if all is there.
    pub(crate) fn left_out(&self) -> Option<String> {
        let parts: Vec<String> = self.left_out.iter().map(|(what, count)| format!("{count} {what}")).collect();
        (!parts.is_empty()).then(|| parts.join(", "))
    }

    /// All but the bodies.
    pub(crate) fn world<'a>(&'a self, name: &'a str) -> World<'a> {
        let gravity = self.gravity.map(|gravity| ("gravity", Value::from(gravity.to_vec())));
        World {
            name: Some(name),
            domain: self.domain,
            physics: gravity.into_iter().collect(),
            kinds: &self.kinds,
            names: &self.names,
            statics: &self.statics,
        }
    }

    fn leave_out(&mut self, what: &'static str, count: u64) {
        if count > 0 {
            *self.left_out.entry(what).or_default() += count;
        }
    }

    /// The row of a kind in the table; those of different groups stay apart, so that their materials can be told apart later.
    fn row(&mut self, kind: Kind, group: u32, name: impl FnOnce() -> Option<String>) -> u32 {
        let key = (serde_json::to_string(&KindText::new(&kind)).expect("numbers, under names"), group);
        *self.rows.entry(key).or_insert_with(|| {
            let name = name().filter(|name| !self.names.iter().any(|other| other.as_ref() == Some(name)));
            self.kinds.push(kind);
            self.names.push(name);
            self.kinds.len() as u32 - 1
        })
    }

    /// Refuses numbers that no world can have.
    fn check(&self, path: &Path) -> Result<(), SceneError> {
        let refuse = |what: String| Err(SceneError::whole(path, what));
        let is_place = |place: DVec2| place.is_finite() && place.abs().cmple(DVec2::splat(FARTHEST)).all();
        let named = self.kinds.iter().zip(self.names.iter().map(Option::as_deref));
        let mut kinds = named.chain(self.statics.iter().map(|fixed| (&fixed.kind, None)));
        if let Some((kind, name)) = kinds.find(|(kind, _)| !kind.is_valid()) {
            return refuse(format!(
                "it has a shape or a material that cannot be: {}; sizes and densities must be above 0, a restitution at most 1, \
                 others but the gravity at least 0, all finite",
                told(kind, name)
            ));
        }
        if let Some(gravity) = self.gravity.filter(|gravity| !gravity.iter().all(|along| (*along as f32).is_finite())) {
            return refuse(format!("its gravity cannot be: {gravity:?} m/s^2; give numbers of at most 1e38"));
        }
        let is_good = |place: DVec2, rotation: Rot| is_place(place) && is_turn(rotation);
        let is_static = |fixed: &StaticBody| {
            let moves = fixed.path.is_none_or(|path| path.is_valid());
            is_good(fixed.position, fixed.rotation) && moves
        };
        let cannot_be = |what: &str, numbers: &[usize], at: usize, id: GlobalId| {
            let which =
                numbers.get(at).map_or(format!("{what} {id}"), |number| format!("body {number} of its list, from 0,"));
            refuse(format!("{which} has a number that cannot be; positions must be within 1e9 m, all numbers finite"))
        };
        let [of_statics, of_bodies] = &self.numbers;
        if let Some(at) = self.statics.iter().position(|fixed| !is_static(fixed)) {
            return cannot_be("static", of_statics, at, self.statics[at].id);
        }
        let moves = |body: &Body| body.velocity.is_finite() && body.angular_velocity.is_finite();
        if let Some(at) = self.bodies.iter().position(|body| !is_good(body.position, body.rotation) || !moves(body)) {
            return cannot_be("body", of_bodies, at, self.bodies[at].id);
        }
        let (low, high) = self.domain;
        if !(is_place(low) && is_place(high) && low.cmplt(high).all()) {
            return refuse(
                "its bounds are none of a domain: low ones must be below high ones, all within 1e9 m".to_owned(),
            );
        }
        let mut ids: Vec<GlobalId> = self.bodies.iter().map(|body| body.id).collect();
        ids.sort_unstable();
        match ids.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => refuse(format!("id {} is there twice; give each its own", pair[0])),
            None => Ok(()),
        }
    }
}

/// A kind, in the numbers that a file gave it.
fn told(kind: &Kind, name: Option<&str>) -> String {
    let Material { density, friction, restitution, .. } = kind.material;
    let Dynamics { gravity_scale, linear_damping, angular_damping, .. } = kind.dynamics;
    let (name, radius) = (name.map_or(String::new(), |name| format!("{name}, ")), kind.shape.bounding_radius());
    format!(
        "{name}within {radius} m of its middle, density {density}, friction {friction}, restitution {restitution}, gravity \
         scale {gravity_scale}, damping {linear_damping} and {angular_damping}"
    )
}

#[cfg(test)]
mod tests;
