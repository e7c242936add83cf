//! What the text of a scene says, and where its bodies are.

use super::super::{Place, SceneError};
use super::entries::{Entries, keep, place};
use super::kinds::kinds;
use super::row::FARTHEST;
use super::statics::{Statics, statics};
use crate::wording::toml_fault;
use atoll_core::Kind;
use glam::DVec2;
use std::path::Path;
use toml::{Table, Value};

/// The format, as its files say it.
pub(crate) const FORMAT: &str = "atoll-scene/1";

/// How the format's name begins, whatever its version.
const FORMATS: &str = "atoll-scene/";

/// What every scene with bodies says, and no configuration.
const OF_SCENES: [&str; 2] = ["domain", "kinds"];

/// No domain is narrower, in meters.
const NARROWEST: f64 = 1e-3;

/// What the text of a scene says.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Description {
    pub(super) name: Option<String>,
    pub(super) domain: (DVec2, DVec2),
    pub(super) physics: Table,
    pub(super) kinds: Vec<Kind>,
    pub(super) names: Vec<Option<String>>,
    pub(super) statics: Statics,
    pub(super) bodies: Bodies,
}

/// Where the bodies are.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Bodies {
    /// In tables of the same file.
    Inline(Vec<Table>),
    /// In a file of their own.
    File { path: String, xxh3: Option<String>, count: Option<u64> },
}

/// Whether a text is that of a scene, of any version, or of one that does not say so.
pub(crate) fn is_scene(text: &str) -> bool {
    // Cheap, and never wrong about what is one: the rest is for whoever reads it.
    if !text.contains(FORMATS) && !OF_SCENES.iter().any(|key| text.contains(key)) {
        return false;
    }
    let Ok(table) = text.parse::<Table>() else { return false };
    let is_said = table.get("format").and_then(Value::as_str).is_some_and(|format| format.starts_with(FORMATS));
    is_said || !table.contains_key("scene") && OF_SCENES.iter().any(|key| table.contains_key(*key))
}

impl Description {
    /// Reads the text of a file, as far as it can be; whatever cannot is a fault.
    ///
    /// # Errors
    /// If it is not the text of a scene.
    pub(super) fn read(file: &Path, text: &str, faults: &mut Vec<SceneError>) -> Result<Self, SceneError> {
        let table: Table = text.parse().map_err(|error| syntax_error(file, text, &error))?;
        let mut entries = Entries::new(file, String::new(), &table);
        let must = format!("\"{FORMAT}\"");
        match entries.text("format", &must)? {
            Some(FORMAT) => {}
            Some(_) => return Err(entries.refuse("format", format!("must be {must}, which this program reads"))),
            None => return Err(entries.missing("format", &format!("{must}, which says that this is a scene"))),
        }
        let name = keep(faults, entries.text("name", "a text")).flatten().map(str::to_owned);
        let domain = keep(faults, domain(&mut entries)).unwrap_or((DVec2::ZERO, DVec2::ONE));
        let physics = keep(faults, entries.table("physics")).flatten().cloned().unwrap_or_default();
        let of_kinds = keep(faults, entries.tables("kinds")).unwrap_or_default();
        let (kinds, names) = kinds(file, &of_kinds, faults);
        let of_statics = keep(faults, entries.tables("statics")).unwrap_or_default();
        let statics = statics(file, &of_statics, faults);
        let in_file = keep(faults, entries.table("bodies")).flatten();
        let inline = keep(faults, entries.tables("body")).unwrap_or_default();
        keep(faults, entries.finish());
        let bodies = match in_file {
            Some(_) if !inline.is_empty() => {
                const BOTH: &str = "bodies stand either in [[body]] or in the file of [bodies]; leave one out";
                faults.push(entries.refuse("body", BOTH));
                None
            }
            Some(table) => keep(faults, self::in_file(file, table)),
            None => None,
        };
        let bodies = bodies.unwrap_or_else(|| Bodies::Inline(inline.into_iter().cloned().collect()));
        Ok(Self { name, domain, physics, kinds, names, statics, bodies })
    }
}

fn in_file(file: &Path, table: &Table) -> Result<Bodies, SceneError> {
    let mut entries = Entries::new(file, "[bodies]".to_owned(), table);
    let must = "the path of a file, .csv or .parquet, from the folder of this one";
    let path = entries.text("path", must)?.ok_or_else(|| entries.missing("path", must))?.to_owned();
    let must = "32 hexadecimal digits, such as `xxh128sum` tells";
    let xxh3 = entries.text("xxh3", must)?.map(str::to_ascii_lowercase);
    if xxh3.as_ref().is_some_and(|text| text.len() != 32 || !text.bytes().all(|byte| byte.is_ascii_hexdigit())) {
        return Err(entries.refuse("xxh3", format!("must be {must}")));
    }
    let count = entries.whole("count")?;
    entries.finish()?;
    Ok(Bodies::File { path, xxh3, count })
}

fn domain(entries: &mut Entries<'_>) -> Result<(DVec2, DVec2), SceneError> {
    let must = "low and high corner in meters, such as [[0.0, 0.0], [100.0, 50.0]]";
    let value = entries.value("domain").ok_or_else(|| entries.missing("domain", must))?;
    let corners = value.as_array().and_then(|corners| match corners.as_slice() {
        [low, high] => Some((place(low)?, place(high)?)),
        _ => None,
    });
    let (low, high) = corners.ok_or_else(|| entries.refuse("domain", format!("must be {must}")))?;
    let within = |point: DVec2| point.abs().cmple(DVec2::splat(FARTHEST)).all();
    if !(within(low) && within(high)) {
        return Err(entries.refuse("domain", "both corners must be within -1e9 to 1e9 m"));
    }
    if !(high - low).cmpge(DVec2::splat(NARROWEST)).all() {
        return Err(
            entries.refuse("domain", "the high corner must lie above and right of the low one, by 1 mm at least")
        );
    }
    Ok((low, high))
}

fn syntax_error(file: &Path, text: &str, error: &toml::de::Error) -> SceneError {
    let (line, message) = toml_fault(text, error);
    SceneError::bad(file, Place { line: Some(line as u64), ..Place::default() }, message)
}
