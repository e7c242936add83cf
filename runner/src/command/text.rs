//! A line of a file of commands, and what it may say.

use crate::scene::{FARTHEST, kind_of_command};
use atoll_core::{Body, Command, GlobalId, KindId, Rot};
use glam::{DVec2, Vec2};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Error, IntoDeserializer, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::Value;
use std::fmt::{self, Formatter};
use std::marker::PhantomData;

/// A line: what, when, and where it was read.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Line {
    /// How many steps are made when it is its turn.
    pub(crate) step: u64,
    /// Its number in the file, from 1.
    pub(crate) number: u64,
    /// Repeated in the answer.
    pub(crate) name: Option<String>,
    pub(crate) action: Action,
}

/// What a line asks for.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Action {
    /// Bodies come, some of them with a name of the run's choosing.
    Add(Vec<NewBody>),
    /// All of these are done, or none.
    Do(Vec<Command>),
    Ask(Question),
    /// From here on such events are told, or not.
    Tell(Event, bool),
}

/// What may be told after each step.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Event {
    /// Contacts begin and end.
    Contacts,
    /// Bodies enter and leave sensors.
    Sensors,
}

impl Event {
    pub(crate) const ALL: [Self; 2] = [Self::Contacts, Self::Sensors];
}

/// A body to be added.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct NewBody {
    /// Whether it has a name of its own, and not one that is to be chosen.
    pub(crate) is_named: bool,
    pub(crate) body: Body,
}

/// What may be asked.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Question {
    Ray {
        from: DVec2,
        to: DVec2,
    },
    Rectangle {
        low: DVec2,
        high: DVec2,
    },
    Point(DVec2),
    Touching(GlobalId),
    /// Who is inside a sensor.
    Inside(GlobalId),
    Body(GlobalId),
    Bodies(Vec<GlobalId>),
}

/// What whoever drives a run says.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Word {
    /// Do this; the text is how it is written down.
    Line(Line, String),
    /// Until so many steps are made nothing more will be said.
    Until(u64),
}

/// What a line may hold: one of all but the first two.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    step: Option<u64>,
    name: Option<String>,
    add: Option<Several<BodyText>>,
    remove: Option<Several<u64>>,
    velocity: Option<Several<VelocityText>>,
    impulse: Option<Several<ImpulseText>>,
    force: Option<Several<ForceText>>,
    kind: Option<Several<KindOfText>>,
    /// As in a scene, whose values those of JSON are.
    add_kind: Option<toml::Table>,
    gravity: Option<[f32; 2]>,
    wake: Option<Several<u64>>,
    ray: Option<RayText>,
    rectangle: Option<RectangleText>,
    point: Option<[f64; 2]>,
    touching: Option<u64>,
    inside: Option<u64>,
    body: Option<Several<u64>>,
    contacts: Option<bool>,
    sensors: Option<bool>,
    until: Option<u64>,
}

/// One, or a list of some.
struct Several<T> {
    all: Vec<T>,
    is_list: bool,
}

impl<T> Several<T> {
    fn one<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error>
    where
        T: Deserialize<'de>,
    {
        Ok(Self { all: vec![T::deserialize(deserializer)?], is_list: false })
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Several<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(OneOrList(PhantomData))
    }
}

/// Reads what is there as it comes: by way of a [`Value`], a key that is given twice would not be noticed.
struct OneOrList<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for OneOrList<T> {
    type Value = Several<T>;

    fn expecting(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        formatter.write_str("one or a list of some")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Self::Value, A::Error> {
        Ok(Several { all: Vec::deserialize(SeqAccessDeserializer::new(list))?, is_list: true })
    }

    fn visit_map<A: MapAccess<'de>>(self, object: A) -> Result<Self::Value, A::Error> {
        Several::one(MapAccessDeserializer::new(object))
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<Self::Value, E> {
        Several::one(number.into_deserializer())
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<Self::Value, E> {
        Several::one(number.into_deserializer())
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Self::Value, E> {
        Several::one(number.into_deserializer())
    }

    fn visit_bool<E: Error>(self, is_so: bool) -> Result<Self::Value, E> {
        Several::one(is_so.into_deserializer())
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
        Several::one(text.into_deserializer())
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BodyText {
    id: Option<u64>,
    #[serde(default)]
    kind: u32,
    x: f64,
    y: f64,
    angle: Option<f32>,
    cos: Option<f32>,
    sin: Option<f32>,
    #[serde(default)]
    vx: f32,
    #[serde(default)]
    vy: f32,
    #[serde(default)]
    omega: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct VelocityText {
    id: u64,
    vx: f32,
    vy: f32,
    #[serde(default)]
    omega: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ImpulseText {
    id: u64,
    x: f32,
    y: f32,
    at: Option<[f64; 2]>,
    #[serde(default)]
    angular: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ForceText {
    id: u64,
    x: f32,
    y: f32,
    #[serde(default)]
    torque: f32,
    steps: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct KindOfText {
    id: u64,
    kind: u32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RayText {
    from: [f64; 2],
    to: [f64; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RectangleText {
    low: [f64; 2],
    high: [f64; 2],
}

/// What may stand in a line beside step and name.
const ACTIONS: &str = "add, remove, velocity, impulse, force, kind, add_kind, gravity, wake, ray, rectangle, point, \
                       touching, inside, body, contacts or sensors";

/// Why nobody else may say until when nothing more will be said.
pub(crate) const NO_UNTIL: &str = "until is for whoever drives a run by --commands -; leave it out";

/// Reads a line of a file. The error is what is wrong with it.
pub(crate) fn parse(number: u64, text: &str) -> Result<Line, String> {
    let raw = read(text)?;
    let step = raw.step.ok_or("it has no step: give the number of steps that are made when it is its turn")?;
    if raw.until.is_some() {
        return Err(NO_UNTIL.to_owned());
    }
    Ok(Line { step, number, name: raw.name.clone(), action: action(raw)? })
}

/// Reads what whoever drives a run says after `step` steps.
pub(crate) fn word(number: u64, text: &str, step: u64) -> Result<Word, String> {
    let raw = read(text)?;
    if let Some(until) = raw.until {
        let alone = raw.step.is_none() && raw.name.is_none() && action(raw).is_err();
        return if alone { Ok(Word::Until(until)) } else { Err("until stands by itself".to_owned()) };
    }
    let (step, name) = (raw.step.unwrap_or(step), raw.name.clone());
    let mut value: Value = serde_json::from_str(text).map_err(|error| error.to_string())?;
    if let Value::Object(fields) = &mut value {
        fields.shift_insert(0, "step".to_owned(), step.into());
    }
    Ok(Word::Line(Line { step, number, name, action: action(raw)? }, value.to_string()))
}

/// The name in a line that may be wrong otherwise.
pub(crate) fn named(text: &str) -> Option<String> {
    let line: Value = serde_json::from_str(text).ok()?;
    Some(line.get("name")?.as_str()?.to_owned())
}

fn read(text: &str) -> Result<Raw, String> {
    // A list would be taken for all that a line may hold, in order.
    if text.trim_start().starts_with('[') {
        return Err("a list stands where an object, {...} must: each command is a line of its own".to_owned());
    }
    // On one line, lines are of no use.
    let short = |error: serde_json::Error| {
        let text = error.to_string();
        let place = |words: &str| format!("{}, at column {}", plain(words), error.column());
        text.strip_suffix(&format!(" at line {} column {}", error.line(), error.column()))
            .map_or_else(|| plain(&text), place)
    };
    serde_json::from_str(text).map_err(short)
}

/// What does not fit, in words of JSON and not of this program.
fn plain(words: &str) -> String {
    let Some((what, must)) = words.strip_prefix("invalid ").and_then(|rest| rest.rsplit_once(", expected ")) else {
        return words.to_owned();
    };
    let found = what.split_once(": ").map_or("sequence", |(_, found)| found).replace('`', "");
    let found = match found.as_str() {
        "map" => "an object",
        "sequence" => "a list",
        other => {
            ["integer ", "floating point ", "boolean "].iter().find_map(|of| other.strip_prefix(of)).unwrap_or(other)
        }
    };
    let must = match must {
        "u64" | "u32" => "a whole number that is not negative",
        "f64" | "f32" => "a number",
        "a boolean" => "true or false",
        "an array of length 2" => "two numbers in a list",
        must if must == "a map" || must.starts_with("struct ") => "an object, {...}",
        must => must,
    };
    format!("{found} stands where {must} must")
}

fn action(raw: Raw) -> Result<Action, String> {
    let mut actions = Vec::new();
    if let Some(Several { all: bodies, .. }) = raw.add {
        actions.push(Action::Add(bodies.iter().map(new_body).collect::<Result<_, _>>()?));
    }
    let mut each = |commands: Vec<Command>| actions.push(Action::Do(commands));
    if let Some(Several { all: ids, .. }) = raw.remove {
        each(ids.into_iter().map(|id| Command::Remove(GlobalId(id))).collect());
    }
    if let Some(Several { all, .. }) = raw.velocity {
        let set = |VelocityText { id, vx, vy, omega }| Command::SetVelocity {
            id: GlobalId(id),
            velocity: Vec2::new(vx, vy),
            angular_velocity: omega,
        };
        each(all.into_iter().map(set).collect());
    }
    if let Some(Several { all, .. }) = raw.impulse {
        let strike = |ImpulseText { id, x, y, at, angular }| {
            let (impulse, at) = (Vec2::new(x, y), at.map(DVec2::from));
            Command::Impulse { id: GlobalId(id), impulse, at, angular }
        };
        each(all.into_iter().map(strike).collect());
    }
    if let Some(Several { all, .. }) = raw.force {
        if all.iter().any(|force| force.steps == 0) {
            return Err("a force must push for one step at least".to_owned());
        }
        let push = |ForceText { id, x, y, torque, steps }| Command::Force {
            id: GlobalId(id),
            force: Vec2::new(x, y),
            torque,
            steps,
        };
        each(all.into_iter().map(push).collect());
    }
    if let Some(Several { all, .. }) = raw.kind {
        let set = |KindOfText { id, kind }| Command::SetKind { id: GlobalId(id), kind: KindId(kind) };
        each(all.into_iter().map(set).collect());
    }
    if let Some(kind) = raw.add_kind {
        each(vec![Command::AddKind(kind_of_command(&kind)?)]);
    }
    if let Some(gravity) = raw.gravity {
        each(vec![Command::SetGravity(gravity.into())]);
    }
    if let Some(Several { all: ids, .. }) = raw.wake {
        each(ids.into_iter().map(|id| Command::Wake(GlobalId(id))).collect());
    }
    if let Some(RayText { from, to }) = raw.ray {
        actions.push(Action::Ask(Question::Ray { from: place(from)?, to: place(to)? }));
    }
    if let Some(RectangleText { low, high }) = raw.rectangle {
        let (low, high) = (place(low)?, place(high)?);
        if !low.cmple(high).all() {
            return Err("the high corner of a rectangle lies above and right of the low one".to_owned());
        }
        actions.push(Action::Ask(Question::Rectangle { low, high }));
    }
    if let Some(point) = raw.point {
        actions.push(Action::Ask(Question::Point(point.into())));
    }
    if let Some(id) = raw.touching {
        actions.push(Action::Ask(Question::Touching(GlobalId(id))));
    }
    if let Some(Several { all: ids, is_list }) = raw.body {
        let ids: Vec<GlobalId> = ids.into_iter().map(GlobalId).collect();
        actions.push(Action::Ask(match ids[..] {
            [id] if !is_list => Question::Body(id),
            _ => Question::Bodies(ids),
        }));
    }
    actions.extend(raw.inside.map(|id| Action::Ask(Question::Inside(GlobalId(id)))));
    actions.extend(raw.contacts.map(|is_told| Action::Tell(Event::Contacts, is_told)));
    actions.extend(raw.sensors.map(|is_told| Action::Tell(Event::Sensors, is_told)));
    match (actions.pop(), actions.len()) {
        (Some(action), 0) => Ok(action),
        (Some(_), _) => Err(format!("it asks for several things; give each a line: {ACTIONS}")),
        (None, _) => Err(format!("it asks for nothing; give one of {ACTIONS}")),
    }
}

/// A place that is asked about.
fn place(point: [f64; 2]) -> Result<DVec2, String> {
    const MOST_ASKED: f64 = 1e100;
    let is_near = point.iter().all(|part| part.abs() <= MOST_ASKED);
    is_near.then(|| point.into()).ok_or_else(|| format!("places must be within {MOST_ASKED:e} m of the origin"))
}

fn new_body(text: &BodyText) -> Result<NewBody, String> {
    let rotation = match (text.angle, text.cos, text.sin) {
        (None, None, None) => Rot::IDENTITY,
        (Some(angle), None, None) => Rot::from_angle(angle),
        (None, Some(c), Some(s)) => Rot { c, s },
        _ => return Err("a body is turned by an angle, or by cos and sin together".to_owned()),
    };
    // As in the file of a scene.
    if let Some((key, value)) = [("x", text.x), ("y", text.y)].into_iter().find(|(_, value)| value.abs() > FARTHEST) {
        return Err(format!("add, {key} = {value:e}: must be within -1e9 to 1e9 m"));
    }
    let body = Body {
        id: GlobalId(text.id.unwrap_or_default()),
        position: DVec2::new(text.x, text.y),
        rotation,
        velocity: Vec2::new(text.vx, text.vy),
        angular_velocity: text.omega,
        kind: KindId(text.kind),
    };
    Ok(NewBody { is_named: text.id.is_some(), body })
}

#[cfg(test)]
mod tests;
