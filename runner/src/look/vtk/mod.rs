//! Files for ParaView, and whatever else reads VTK's XML: bodies as polygons, so that no filter is needed to see them.
//!
//! ```text
//! OUT/run.pvd                              what to open: every step with its time, and the statics with each
//! OUT/bodies-0000000010.pvtu               a step, of all ranks
//! OUT/bodies-0000000010/rank-00000.vtu     what one rank recorded of it
//! OUT/statics.vtu                          or, where some move, one for each step: statics-0000000010.vtu
//! ```
//!
//! Numbers are raw bytes behind the XML, with lengths of 64 bits, so that a file may be of any size; names of files have no
//! dot but the one before their ending, as readers take what follows the first for the ending.

mod cells;
mod outline;
mod piece;
mod target;
#[cfg(test)]
mod tests;

use super::frame::{Frame, Setting};
use super::recorded::Recorded;
use super::source::Shown;
use crate::error::RunError;
use cells::{write_bodies, write_statics};
use std::fmt::Write as _;
use std::io::Write;
use std::path::{Path, PathBuf};
use target::Target;

/// What ParaView is to open.
const COLLECTION: &str = "run.pvd";

/// The file of the statics at a step: one for all, if none of them moves.
fn statics_of(setting: &Setting, step: u64) -> String {
    if setting.statics.iter().any(|fixed| fixed.path.is_some()) {
        format!("statics-{step:010}.vtu")
    } else {
        "statics.vtu".to_owned()
    }
}

/// What was written.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Written {
    /// What ParaView is to open.
    pub collection: PathBuf,
    /// The steps.
    pub steps: Vec<u64>,
    /// Bodies in the one with the fewest, and with the most.
    pub bodies: [usize; 2],
    /// Bytes of all files.
    pub bytes: u64,
}

/// Writes these records, all of which must be there, to a folder, which must be new or empty. Of records there is never more
/// than one in memory. `goes_on` is told how many are done, and of how many, and says whether to go on.
///
/// # Errors
/// If the folder cannot be had, a record cannot be read, or a file cannot be written. What was written is removed then, and so it is where it
/// does not go on, and nothing is returned.
pub(crate) fn export(
    recorded: &Recorded,
    out: &Path,
    shown: Shown,
    mut goes_on: impl FnMut(usize, usize) -> bool,
) -> Result<Option<Written>, RunError> {
    let mut target = Target::new(out)?;
    let setting = recorded.setting();
    let steps: Vec<u64> = shown.steps().collect();
    let mut fixed = None;
    let mut frame = Frame::default();
    let [mut fewest, mut most] = [usize::MAX, 0];
    for (done, &step) in (1..).zip(&steps) {
        recorded.read(step, &mut frame)?;
        write_frame(setting, &frame, &mut target)?;
        (fewest, most) = (fewest.min(frame.bodies.len()), most.max(frame.bodies.len()));
        let name = statics_of(setting, step);
        if fixed.as_ref() != Some(&name) {
            target.write(&name, |file| write_statics(setting, step, file))?;
            fixed = Some(name);
        }
        if !goes_on(done, steps.len()) {
            return Ok(None);
        }
    }
    let text = collection(setting, &steps);
    target.write(COLLECTION, |file| file.write_all(text.as_bytes()))?;
    let bodies = [fewest.min(most), most];
    Ok(Some(Written { collection: out.join(COLLECTION), steps, bodies, bytes: target.finish() }))
}

/// The name of a step, without an ending.
fn name_of(step: u64) -> String {
    format!("bodies-{step:010}")
}

/// A step: a file for each rank that has bodies, or one without any where there are none, and one that names those.
fn write_frame(setting: &Setting, frame: &Frame, target: &mut Target) -> Result<(), RunError> {
    let name = name_of(frame.step);
    target.folder(&name)?;
    let (mut pieces, mut start) = (Vec::new(), 0);
    for &(rank, end) in &frame.ranks {
        let rows = &frame.bodies[start..end];
        start = end;
        if !rows.is_empty() || frame.bodies.is_empty() && pieces.is_empty() {
            let piece = format!("{name}/rank-{rank:05}.vtu");
            target.write(&piece, |file| write_bodies(setting, frame.partition(setting), rows, rank, file))?;
            pieces.push(piece);
        }
    }
    target.write(&format!("{name}.pvtu"), |file| file.write_all(parallel(&pieces).as_bytes()))
}

/// What names the pieces of a step, and what there is in each.
fn parallel(pieces: &[String]) -> String {
    let mut text = piece::heading("PUnstructuredGrid");
    text += " <PUnstructuredGrid GhostLevel=\"0\">\n  <PPoints>\n";
    text += "   <PDataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"/>\n  </PPoints>\n";
    writeln!(text, "  <PCellData {}>", cells::ATTRIBUTES).expect("a string takes any text");
    for (name, form, components) in cells::COLUMNS {
        let form = form.name();
        writeln!(text, "   <PDataArray type=\"{form}\" Name=\"{name}\" NumberOfComponents=\"{components}\"/>")
            .expect("a string takes any text");
    }
    text += "  </PCellData>\n";
    pieces.iter().for_each(|piece| text += &format!("  <Piece Source=\"{piece}\"/>\n"));
    text + " </PUnstructuredGrid>\n</VTKFile>\n"
}

/// What names all steps, with their times in s. The statics are a second part of each.
fn collection(setting: &Setting, steps: &[u64]) -> String {
    let mut text = piece::heading("Collection");
    text += " <Collection>\n";
    for &step in steps {
        let (time, name) = (step as f64 / setting.hertz, name_of(step));
        for (part, of, file) in [(0, "bodies", format!("{name}.pvtu")), (1, "statics", statics_of(setting, step))] {
            writeln!(text, "  <DataSet timestep=\"{time}\" group=\"\" part=\"{part}\" name=\"{of}\" file=\"{file}\"/>")
                .expect("a string takes any text");
        }
    }
    text + " </Collection>\n</VTKFile>\n"
}
