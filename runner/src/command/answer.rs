//! Answers: the part of each rank, and all of them joined, as a line of JSON.

use super::text::{Event, Question};
use atoll_core::{Body, GlobalId, RayHit, World};
use glam::DVec2;
use serde::{Deserialize, Deserializer, Serialize};

/// What one rank answers to a question, or all together.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) enum Part {
    Ray(Option<Hit>),
    /// Names, ascending.
    Names(Vec<u64>),
    /// Of somebody who is there.
    Touching(Option<Vec<Touching>>),
    /// Names, ascending, where the sensor is there.
    Inside(Option<Vec<u64>>),
    Bodies(Vec<Option<State>>),
}

/// A number. What is not finite is `null` in JSON, and must not keep anybody from reading the rest.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Serialize)]
pub(crate) struct Number<T>(T);

impl<'de, T: Deserialize<'de> + From<f32>> Deserialize<'de> for Number<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self(Option::deserialize(deserializer)?.unwrap_or(f32::NAN.into())))
    }
}

fn point(point: DVec2) -> [Number<f64>; 2] {
    point.to_array().map(Number)
}

/// What a ray meets.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) struct Hit {
    id: u64,
    fraction: Number<f64>,
    point: [Number<f64>; 2],
    normal: [Number<f64>; 2],
}

/// A contact, as seen from one of its bodies.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) struct Touching {
    /// The other.
    id: u64,
    /// One or two.
    points: Vec<[Number<f64>; 2]>,
    impulse: Number<f32>,
}

/// A body, as it is.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) struct State {
    id: u64,
    kind: u32,
    x: Number<f64>,
    y: Number<f64>,
    angle: Number<f32>,
    vx: Number<f32>,
    vy: Number<f32>,
    omega: Number<f32>,
}

impl State {
    fn new(body: &Body) -> Self {
        Self {
            id: body.id.0,
            kind: body.kind.0,
            x: Number(body.position.x),
            y: Number(body.position.y),
            angle: Number(body.rotation.angle()),
            vx: Number(body.velocity.x),
            vy: Number(body.velocity.y),
            omega: Number(body.angular_velocity),
        }
    }
}

/// Both together, or the one that there is.
fn either<T>(a: Option<T>, b: Option<T>, both: impl FnOnce(T, T) -> T) -> Option<T> {
    match (a, b) {
        (Some(a), Some(b)) => Some(both(a, b)),
        (a, b) => a.or(b),
    }
}

/// Names of two ranks, of which both know the statics.
fn joined(mut a: Vec<u64>, b: Vec<u64>) -> Vec<u64> {
    a.extend(b);
    a.sort_unstable();
    a.dedup();
    a
}

fn names(ids: Vec<GlobalId>) -> Vec<u64> {
    ids.into_iter().map(|id| id.0).collect()
}

impl Part {
    /// What a rank has to say. `sensors` are those among the bodies of all ranks, where somebody asks who is inside.
    pub(crate) fn of(question: &Question, world: &World, sensors: &[Body]) -> Self {
        match question {
            Question::Ray { from, to } => Self::Ray(world.cast_ray(*from, *to).map(Hit::new)),
            Question::Rectangle { low, high } => Self::Names(names(world.in_rectangle(*low, *high))),
            Question::Point(point) => Self::Names(names(world.at_point(*point))),
            Question::Inside(sensor) => {
                let is_there = world.is_static(*sensor) || world.get(*sensor).is_some();
                let inside = names(world.inside_sensor(*sensor, sensors));
                // A rank that does not hold the sensor may hold who is inside.
                Self::Inside((is_there || !inside.is_empty()).then_some(inside))
            }
            Question::Touching(id) => {
                let contact = |contact: atoll_core::ContactView| {
                    let [a, b] = contact.bodies;
                    let other = if a == *id { b } else { a };
                    let mut points = contact.points.map(point).to_vec();
                    points.dedup();
                    Touching { id: other.0, points, impulse: Number(contact.normal_impulse) }
                };
                let is_there = world.is_static(*id) || world.get(*id).is_some();
                Self::Touching(is_there.then(|| world.touching(*id).into_iter().map(contact).collect()))
            }
            Question::Body(id) => Self::Bodies(vec![world.get(*id).as_ref().map(State::new)]),
            Question::Bodies(ids) => {
                Self::Bodies(ids.iter().map(|id| world.get(*id).as_ref().map(State::new)).collect())
            }
        }
    }

    /// What two ranks say together, whichever of them is asked first.
    #[must_use]
    pub(crate) fn join(self, other: Self) -> Self {
        match (self, other) {
            (Self::Ray(a), Self::Ray(b)) => {
                let nearer = |a: Hit, b: Hit| if (b.fraction, b.id) < (a.fraction, a.id) { b } else { a };
                Self::Ray(either(a, b, nearer))
            }
            (Self::Names(a), Self::Names(b)) => Self::Names(joined(a, b)),
            (Self::Inside(a), Self::Inside(b)) => Self::Inside(either(a, b, joined)),
            (Self::Touching(a), Self::Touching(b)) => {
                let all = |mut a: Vec<Touching>, b: Vec<Touching>| {
                    a.extend(b);
                    a.sort_by_key(|contact| contact.id);
                    a
                };
                Self::Touching(either(a, b, all))
            }
            (Self::Bodies(a), Self::Bodies(b)) => Self::Bodies(a.into_iter().zip(b).map(|(a, b)| a.or(b)).collect()),
            (a, _) => a,
        }
    }
}

impl Hit {
    fn new(hit: RayHit) -> Self {
        let RayHit { id, fraction, point: at, normal } = hit;
        Self { id: id.0, fraction: Number(fraction), point: point(at), normal: point(normal) }
    }
}

/// What is written for whoever asked.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Answer<'a> {
    /// To a question, with the names that the first kinds may have.
    To(&'a Question, &'a Part, &'a [Option<String>]),
    /// Names that were given to bodies which had none.
    Added(&'a [u64]),
    /// What began and ended in the last step: contacts, or that a body is inside a sensor.
    Events { event: Event, began: &'a [[u64; 2]], ended: &'a [[u64; 2]] },
    /// Why a command was not done, and which line that was.
    Refused { line: u64, reason: &'a str },
    /// The run waits to be told more than so many lines of this step, which were done before it went on.
    Waits { done: u64 },
}

impl Answer<'_> {
    /// As a line of JSON, its end included. `name` is that of the line that asked.
    pub(crate) fn to_line(self, step: u64, name: Option<&str>) -> String {
        let name = name.map_or(String::new(), |name| format!("\"name\":{},", json(&name)));
        let rest = match self {
            Self::To(question, part, names) => format!("\"{}\":{}", key(question), value(question, part, names)),
            Self::Added(ids) => format!("\"added\":{}", json(&ids)),
            Self::Events { event, began, ended } => {
                let [first, last] = match event {
                    Event::Contacts => ["began", "ended"],
                    Event::Sensors => ["entered", "left"],
                };
                format!("\"{first}\":{},\"{last}\":{}", json(&began), json(&ended))
            }
            Self::Refused { line, reason } => format!("\"line\":{line},\"refused\":{}", json(&reason)),
            Self::Waits { done: 0 } => "\"waits\":true".to_owned(),
            Self::Waits { done } => format!("\"waits\":true,\"done\":{done}"),
        };
        format!("{{\"step\":{step},{name}{rest}}}\n")
    }
}

/// Numbers are the shortest decimals that lead back to the same bits.
fn json<T: Serialize>(value: &T) -> String {
    serde_json::to_string(value).expect("numbers and texts, under names")
}

fn key(question: &Question) -> &'static str {
    match question {
        Question::Ray { .. } => "ray",
        Question::Rectangle { .. } => "rectangle",
        Question::Point(_) => "point",
        Question::Touching(_) => "touching",
        Question::Inside(_) => "inside",
        Question::Body(_) | Question::Bodies(_) => "body",
    }
}

/// A body as whoever asked is told of it.
#[derive(Serialize)]
struct Told<'a> {
    #[serde(flatten)]
    state: &'a State,
    /// What the scene calls its kind.
    #[serde(skip_serializing_if = "Option::is_none")]
    kind_name: Option<&'a str>,
}

fn value(question: &Question, part: &Part, names: &[Option<String>]) -> String {
    let name = |state: &State| names.get(state.kind as usize)?.as_deref();
    let told = |body: &'_ Option<State>| {
        body.as_ref().map(|state| json(&Told { state, kind_name: name(state) })).unwrap_or("null".to_owned())
    };
    match part {
        Part::Ray(hit) => json(hit),
        Part::Names(ids) => json(ids),
        Part::Inside(ids) => json(ids),
        Part::Touching(contacts) => json(contacts),
        // Who asked for one is given one, and who asked by a list a list.
        Part::Bodies(bodies) if matches!(question, Question::Body(_)) => told(&bodies[0]),
        Part::Bodies(bodies) => format!("[{}]", bodies.iter().map(told).collect::<Vec<_>>().join(",")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use atoll_core::KindId;

    #[test]
    fn parts_join_in_any_order_and_are_told_in_one_line() {
        let hit = |id, fraction| {
            let (at, normal) = (point(DVec2::new(0.5, 1.0)), point(DVec2::Y));
            Part::Ray(Some(Hit { id, fraction: Number(fraction), point: at, normal }))
        };
        let parts = [Part::Ray(None), hit(4, 0.5), hit(3, 0.5), hit(1, 0.75)];
        for turn in 0..4 {
            let all = (0..4).map(|k| parts[(k + turn) % 4].clone()).reduce(Part::join).unwrap();
            assert_eq!(all, parts[2]);
        }
        let names = Part::Names(vec![0, 5, 9]).join(Part::Names(vec![0, 2]));
        assert_eq!(names, Part::Names(vec![0, 2, 5, 9]));
        // Who holds a sensor need not hold who is inside.
        let inside = Part::Inside(Some(vec![])).join(Part::Inside(None)).join(Part::Inside(Some(vec![4])));
        assert_eq!(inside, Part::Inside(Some(vec![4])));
        let question = Question::Ray { from: DVec2::ZERO, to: DVec2::ONE };
        let expected = "{\"step\":7,\"name\":\"up\",\"ray\":{\"id\":3,\"fraction\":0.5,\"point\":[0.5,1.0],\"normal\":[0.0,1.0]}}\n";
        assert_eq!(Answer::To(&question, &parts[2], &[]).to_line(7, Some("up")), expected);
        let nobody = |question| Answer::To(&question, &Part::Bodies(vec![None]), &[]).to_line(0, None);
        assert_eq!(nobody(Question::Body(GlobalId(3))), "{\"step\":0,\"body\":null}\n");
        assert_eq!(nobody(Question::Bodies(vec![GlobalId(3)])), "{\"step\":0,\"body\":[null]}\n");
        // What the scene calls its kind is told as well.
        let one = Part::Bodies(vec![Some(State::new(&Body::at_rest(GlobalId(3), KindId(1), DVec2::ZERO)))]);
        let told = |names| Answer::To(&Question::Body(GlobalId(3)), &one, names).to_line(0, None);
        let rest = "\"kind\":1,\"x\":0.0,\"y\":0.0,\"angle\":0.0,\"vx\":0.0,\"vy\":0.0,\"omega\":0.0";
        assert_eq!(told(&[None, None]), format!("{{\"step\":0,\"body\":{{\"id\":3,{rest}}}}}\n"));
        let expected = format!("{{\"step\":0,\"body\":{{\"id\":3,{rest},\"kind_name\":\"crate\"}}}}\n");
        assert_eq!(told(&[None, Some("crate".to_owned())]), expected);
    }

    #[test]
    fn what_is_not_finite_is_null_and_can_be_read() {
        let body = Body::at_rest(GlobalId(3), KindId(0), DVec2::new(f64::INFINITY, 1.5));
        let text = json(&Part::Bodies(vec![Some(State::new(&body))]));
        assert!(text.contains("\"x\":null,\"y\":1.5"), "{text}");
        assert_eq!(json(&serde_json::from_str::<Part>(&text).unwrap()), text);
    }
}
