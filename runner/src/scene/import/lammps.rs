//! Data files of LAMMPS with discs: `atom_style sphere` or `granular`, in one plane across z.

use super::super::{Place, SceneError};
use super::Imported;
use atoll_core::{Body, GlobalId, Kind, KindId, Material, Rot, Shape};
use glam::{DVec2, Vec2};
use std::collections::HashMap;
use std::path::Path;
use std::str::SplitWhitespace;

/// The columns of atoms, as errors tell.
const COLUMNS: &str = "id type diameter density x y z";

/// A row of atoms.
struct Atom {
    id: u64,
    group: u32,
    diameter: f32,
    density: f32,
    place: [f64; 3],
}

/// What is being read.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Section {
    Header,
    Atoms,
    Velocities,
    Other,
}

/// Where in a file something is.
struct At<'a> {
    path: &'a Path,
    line: u64,
}

impl At<'_> {
    fn refuse(&self, reason: impl Into<String>) -> SceneError {
        SceneError::bad(self.path, Place { line: Some(self.line), ..Place::default() }, reason)
    }

    /// The next word of a line, as a number.
    fn next<T: std::str::FromStr>(&self, words: &mut SplitWhitespace<'_>, what: &str) -> Result<T, SceneError> {
        let word = words.next();
        word.and_then(|word| word.parse().ok()).ok_or_else(|| {
            let found = word.map_or("the line ends".to_owned(), |word| word.chars().take(40).collect());
            self.refuse(format!("{found}: must be {what}"))
        })
    }
}

/// Reads a file.
///
/// # Errors
/// If it is none, or of another style.
pub(super) fn read(path: &Path, text: &str) -> Result<Imported, SceneError> {
    let mut imported = Imported::default();
    let mut section = Section::Header;
    let mut bounds: [Option<[f64; 2]>; 2] = [None; 2];
    let (mut told, mut atoms) = (None, Vec::new());
    let mut velocities: HashMap<u64, [f64; 6]> = HashMap::new();
    // The first line is a title, whatever it says.
    for (line, full) in (1..).zip(text.lines()).skip(1) {
        let at = At { path, line };
        let (content, comment) = full.split_once('#').unwrap_or((full, ""));
        let mut words = content.split_whitespace();
        let Some(first) = words.clone().next() else { continue };
        if first.starts_with(|letter: char| letter.is_ascii_alphabetic()) {
            section = match first {
                "Atoms" => {
                    check_style(&at, comment.trim())?;
                    Section::Atoms
                }
                "Velocities" => Section::Velocities,
                _ => Section::Other,
            };
            if section == Section::Other && !matches!(first, "Masses" | "Pair" | "PairIJ" | "Atom") {
                imported.leave_out("sections of other things than atoms and velocities", 1);
            }
            continue;
        }
        match section {
            Section::Header => header(&at, content, &mut imported, &mut told, &mut bounds)?,
            Section::Atoms => atoms.push(atom(&at, &mut words)?),
            Section::Velocities => {
                let id = at.next(&mut words, "the id of an atom")?;
                let mut velocity = [0.0; 6];
                for number in &mut velocity {
                    *number = at.next(&mut words, "a velocity: id vx vy vz wx wy wz")?;
                }
                velocities.insert(id, velocity);
            }
            Section::Other => {}
        }
    }
    if atoms.is_empty() {
        let reason =
            "it is no data file of LAMMPS with discs: it has no section Atoms with rows; write it with write_data";
        return Err(SceneError::whole(path, reason));
    }
    if let Some(told) = told.filter(|told| *told != atoms.len() as u64) {
        return Err(SceneError::whole(path, format!("it says {told} atoms, and has {}; write it again", atoms.len())));
    }
    let [Some(x), Some(y)] = bounds else {
        return Err(SceneError::whole(path, "its bounds are missing: lines such as 0 10 xlo xhi and 0 5 ylo yhi"));
    };
    imported.domain = (DVec2::new(x[0], y[0]), DVec2::new(x[1], y[1]));
    add(&mut imported, atoms, &velocities);
    imported.check(path)?;
    Ok(imported)
}

fn check_style(at: &At<'_>, style: &str) -> Result<(), SceneError> {
    match style {
        "" | "sphere" | "granular" => Ok(()),
        _ => Err(at
            .refuse(format!("atoms of style {style}: only sphere and granular are discs; write it with one of these"))),
    }
}

fn header(
    at: &At<'_>,
    content: &str,
    imported: &mut Imported,
    told: &mut Option<u64>,
    bounds: &mut [Option<[f64; 2]>; 2],
) -> Result<(), SceneError> {
    let words: Vec<&str> = content.split_whitespace().collect();
    let number = |word: &str| word.parse::<f64>().map_err(|_| at.refuse(format!("{word}: must be a number")));
    match words[..] {
        [count, "atoms"] => {
            let count = count.parse().map_err(|_| at.refuse(format!("{count}: must be a number of atoms")))?;
            *told = Some(count);
        }
        [low, high, "xlo", "xhi"] => bounds[0] = Some([number(low)?, number(high)?]),
        [low, high, "ylo", "yhi"] => bounds[1] = Some([number(low)?, number(high)?]),
        [xy, xz, yz, "xy", "xz", "yz"] => {
            let tilted = [xy, xz, yz].iter().any(|word| word.parse() != Ok(0.0));
            imported.leave_out("tilts of the box", tilted.into());
        }
        // Kinds and numbers of bonds and the like.
        _ => {}
    }
    Ok(())
}

fn atom(at: &At<'_>, words: &mut SplitWhitespace<'_>) -> Result<Atom, SceneError> {
    let columns = words.clone().count();
    if columns != 7 && columns != 10 {
        return Err(
            at.refuse(format!("{columns} numbers: must be {COLUMNS}, and perhaps three more for periodic images"))
        );
    }
    Ok(Atom {
        id: at.next(words, "the id of an atom, a whole number")?,
        group: at.next(words, "the type of an atom, a whole number")?,
        diameter: at.next(words, "a diameter")?,
        density: at.next(words, "a density")?,
        place: [at.next(words, "a position")?, at.next(words, "a position")?, at.next(words, "a position")?],
    })
}

/// Makes discs of atoms.
fn add(imported: &mut Imported, atoms: Vec<Atom>, velocities: &HashMap<u64, [f64; 6]>) {
    // The plane in which most are.
    let mut planes: HashMap<u64, u64> = HashMap::new();
    atoms.iter().for_each(|atom| *planes.entry((atom.place[2] + 0.0).to_bits()).or_default() += 1);
    let plane = planes.into_iter().max_by_key(|(z, count)| (*count, *z)).map_or(0, |(z, _)| z);
    for Atom { id, group, diameter, density, place: [x, y, z] } in atoms {
        if (z + 0.0).to_bits() != plane {
            imported.leave_out("atoms off the plane of the others", 1);
            continue;
        }
        if diameter <= 0.0 {
            imported.leave_out("atoms without a diameter", 1);
            continue;
        }
        let kind = Kind::new(Shape::circle(0.5 * diameter), Material { density, ..Material::default() });
        let row = imported.row(kind, group, || Some(format!("type-{group}")));
        let [vx, vy, vz, wx, wy, wz] = velocities.get(&id).copied().unwrap_or_default();
        imported.leave_out("motions out of the plane", u64::from([vz, wx, wy].iter().any(|number| *number != 0.0)));
        imported.bodies.push(Body {
            id: GlobalId(id),
            position: DVec2::new(x, y),
            rotation: Rot::IDENTITY,
            velocity: Vec2::new(vx as f32, vy as f32),
            angular_velocity: wz as f32,
            kind: KindId(row),
        });
    }
}
