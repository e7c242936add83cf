//! What every record refers to and none holds: the table of kinds, and what never moves. As JSON in the metadata of every
//! file, so that a recording can be drawn by itself.
//!
//! Numbers are the shortest decimals that lead back to the same bits, as `scene/record.rs` tells.

use crate::scene::record::{KindText, PathText};
use atoll_core::{GlobalId, Kind, Rot, StaticBody};
use glam::DVec2;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// What every record refers to and none holds.
#[derive(Clone, PartialEq, Default, Debug)]
pub struct Stage {
    /// Shapes and materials, which bodies refer to by number.
    pub kinds: Vec<Kind>,
    /// What the scene calls each of them, where it does.
    pub names: Vec<Option<String>>,
    /// What never moves.
    pub statics: Vec<StaticBody>,
}

/// The same as texts, which are made once for all files of a run.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct StageText {
    pub(super) kinds: String,
    pub(super) statics: String,
}

/// All statics, a column for each field.
#[derive(Default, Serialize, Deserialize)]
struct StaticsText {
    /// Those that statics are of, each once.
    kinds: Vec<KindText>,
    /// The first of some names that follow each other, and how many those are.
    ids: Vec<[u64; 2]>,
    /// Rows of the table.
    kind: Vec<u32>,
    x: Vec<f64>,
    y: Vec<f64>,
    /// Cosines and sines; none if all stand upright.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    cos: Vec<f32>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    sin: Vec<f32>,
    /// Places in the columns, and the paths of those that have one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    paths: Vec<(usize, PathText)>,
}

impl StageText {
    /// That of a run with these.
    pub fn new(kinds: &[Kind], statics: &[StaticBody]) -> Self {
        Self::named(kinds, &[], statics)
    }

    /// The same where the first kinds may have names.
    pub(crate) fn named(kinds: &[Kind], names: &[Option<String>], statics: &[StaticBody]) -> Self {
        let mut kinds: Vec<KindText> = kinds.iter().map(KindText::new).collect();
        kinds.iter_mut().zip(names).for_each(|(kind, name)| kind.name.clone_from(name));
        Self { kinds: to_json(&kinds), statics: to_json(&StaticsText::new(statics)) }
    }

    /// Whether it tells all that another does, and perhaps of more kinds, which came while a run went on.
    pub(super) fn includes(&self, other: &Self) -> bool {
        // Kinds are a list in brackets.
        let begins_alike = || {
            let told = other.kinds.strip_suffix(']').and_then(|told| self.kinds.strip_prefix(told));
            told.is_some_and(|rest| rest.starts_with(',') || other.kinds == "[]")
        };
        self.statics == other.statics && (self.kinds == other.kinds || begins_alike())
    }

    /// From what a file says, and none from one of format 1, by name. The error is what is wrong with it.
    pub(super) fn from_texts<'a>(text: impl Fn(&str) -> Option<&'a str>) -> Result<Self, String> {
        Ok(Self { kinds: super::facts::parse(&text, "kinds")?, statics: super::facts::parse(&text, "statics")? })
    }

    /// Reads both, and trusts nothing in them. The error is what is wrong.
    pub(super) fn read(&self) -> Result<Stage, String> {
        let kinds: Vec<KindText> = from_json("atoll.kinds", &self.kinds)?;
        let names = kinds.iter().map(|kind| kind.name.clone()).collect();
        let kinds = read_kinds("atoll.kinds", &kinds)?;
        let statics: StaticsText = from_json("atoll.statics", &self.statics)?;
        Ok(Stage { kinds, names, statics: statics.read()? })
    }
}

fn to_json<T: Serialize>(value: &T) -> String {
    serde_json::to_string(value).expect("numbers, under names")
}

fn from_json<'a, T: Deserialize<'a>>(name: &str, text: &'a str) -> Result<T, String> {
    serde_json::from_str(text).map_err(|error| format!("{name} is unreadable: {error}"))
}

fn read_kinds(name: &str, texts: &[KindText]) -> Result<Vec<Kind>, String> {
    let read = |(number, text): (usize, &KindText)| {
        let kind = text.read().ok_or_else(|| format!("kind {number} of {name} has no shape that is known"))?;
        let valid = Some(kind).filter(Kind::is_valid);
        valid.ok_or_else(|| format!("kind {number} of {name} has a number that cannot be"))
    };
    texts.iter().enumerate().map(read).collect()
}

impl StaticsText {
    fn new(statics: &[StaticBody]) -> Self {
        let (kinds, kind) = distinct_kinds(statics);
        let mut text = Self { kinds: kinds.iter().map(KindText::new).collect(), kind, ..Self::default() };
        for StaticBody { id, position, .. } in statics {
            text.x.push(position.x);
            text.y.push(position.y);
            match text.ids.last_mut() {
                Some([first, count]) if first.checked_add(*count) == Some(id.0) => *count += 1,
                _ => text.ids.push([id.0, 1]),
            }
        }
        let is_upright = |fixed: &StaticBody| bytemuck::bytes_of(&fixed.rotation) == bytemuck::bytes_of(&Rot::IDENTITY);
        if !statics.iter().all(is_upright) {
            text.cos = statics.iter().map(|fixed| fixed.rotation.c).collect();
            text.sin = statics.iter().map(|fixed| fixed.rotation.s).collect();
        }
        let path = |(i, fixed): (usize, &StaticBody)| Some((i, PathText::new(fixed.path.as_ref()?)));
        text.paths = statics.iter().enumerate().filter_map(path).collect();
        text
    }

    fn read(&self) -> Result<Vec<StaticBody>, String> {
        let bad = |what: &str| format!("atoll.statics {what}");
        let kinds = read_kinds("atoll.statics", &self.kinds)?;
        let (count, turned) = (self.kind.len(), !(self.cos.is_empty() && self.sin.is_empty()));
        let columns = [self.x.len(), self.y.len()];
        let turns = [self.cos.len(), self.sin.len()];
        if columns != [count; 2] || turned && turns != [count; 2] {
            return Err(bad("has columns of different lengths"));
        }
        let named = self.ids.iter().try_fold(0_u64, |sum, [first, count]| {
            // The last name of each is one as well.
            first.checked_add(count.checked_sub(1)?)?;
            sum.checked_add(*count)
        });
        if named != Some(count as u64) {
            return Err(bad("names others than it has"));
        }
        let ids = self.ids.iter().flat_map(|&[first, count]| (0..count).map(move |i| GlobalId(first + i)));
        let body = |(i, id): (usize, GlobalId)| {
            let position = DVec2::new(self.x[i], self.y[i]);
            let rotation = if turned { Rot { c: self.cos[i], s: self.sin[i] } } else { Rot::IDENTITY };
            let kind = kinds.get(self.kind[i] as usize).ok_or_else(|| bad("has a body of a kind that is not there"))?;
            if !(position.is_finite() && rotation.c.is_finite() && rotation.s.is_finite()) {
                return Err(bad("has a body that is nowhere"));
            }
            Ok(StaticBody { rotation, ..StaticBody::new(id, kind.clone(), position) })
        };
        let mut statics = ids.enumerate().map(body).collect::<Result<Vec<_>, _>>()?;
        for (at, path) in &self.paths {
            let fixed = statics.get_mut(*at).ok_or_else(|| bad("has a path of a body that is not there"))?;
            fixed.path = Some(path.read().ok_or_else(|| bad("has a path that cannot be"))?);
        }
        Ok(statics)
    }
}

/// The kinds that statics are of, each once, and for each static the number of its own.
pub(crate) fn distinct_kinds(statics: &[StaticBody]) -> (Vec<Kind>, Vec<u32>) {
    let (mut kinds, mut rows) = (Vec::new(), HashMap::new());
    let row = |fixed: &StaticBody| {
        *rows.entry(bits(&fixed.kind)).or_insert_with(|| {
            kinds.push(fixed.kind.clone());
            kinds.len() as u32 - 1
        })
    };
    let numbers = statics.iter().map(row).collect();
    (kinds, numbers)
}

/// What tells one kind from another, to the bit.
fn bits(kind: &Kind) -> String {
    to_json(&KindText::new(kind))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::shape_tests::{every_kind, every_static};
    use crate::scene::{Scene, SceneKind, SceneSpec, SplitMix64};
    use atoll_core::{Material, Shape};
    use glam::Vec2;

    fn kind(shape: Shape) -> Kind {
        Kind::new(shape, Material::default())
    }

    /// By its bits, which tells zeros of either sign apart.
    fn assert_comes_back(kinds: &[Kind], statics: &[StaticBody]) {
        let read = StageText::new(kinds, statics).read().unwrap();
        let place = |fixed: &StaticBody| {
            let (position, rotation) = (fixed.position, fixed.rotation);
            let at = [position.x.to_bits(), position.y.to_bits()];
            (fixed.id, at, [rotation.c.to_bits(), rotation.s.to_bits()], bits(&fixed.kind), fixed.path)
        };
        assert!(read.kinds.iter().map(bits).eq(kinds.iter().map(bits)), "{kinds:?} and {:?}", read.kinds);
        assert!(read.statics.iter().map(place).eq(statics.iter().map(place)), "{statics:?} and {:?}", read.statics);
    }

    #[test]
    fn every_scene_comes_back_bit_for_bit() {
        for kind in SceneKind::USUAL {
            let bodies = 500.max(kind.least_bodies());
            let scene = Scene::open(&SceneSpec { bodies, ..SceneSpec::usual(kind) }).unwrap();
            assert_comes_back(&scene.kinds(), scene.statics());
        }
        assert_comes_back(&[], &[]);
    }

    #[test]
    fn every_shape_and_path_comes_back_bit_for_bit() {
        let (kinds, statics) = (every_kind(), every_static());
        assert_comes_back(&kinds, &statics);
        let read = StageText::new(&kinds, &statics).read().unwrap();
        assert_eq!(
            (format!("{:?}", read.kinds), format!("{:?}", read.statics)),
            (format!("{kinds:?}"), format!("{statics:?}"))
        );
        let names = [None, Some("crate".to_owned())];
        let named = StageText::named(&kinds, &names, &statics).read().unwrap();
        assert_eq!((&named.names[..2], named.names.len()), (&names[..], kinds.len()));
        let text = StageText::new(&kinds, &statics);
        for (from, to, expected) in [
            ("\"period\":-4.0", "\"period\":0.0", "atoll.statics has a path that cannot be"),
            ("\"period\":-4.0,", "", "atoll.statics has a path that cannot be"),
            ("\"line\":[", "\"circle\":1.0,\"line\":[", "atoll.statics has a path that cannot be"),
            ("\"paths\":[[1,", "\"paths\":[[7,", "atoll.statics has a path of a body that is not there"),
        ] {
            let statics = text.statics.replace(from, to);
            assert_ne!(statics, text.statics, "{from}");
            let error = StageText { statics, ..text.clone() }.read().unwrap_err();
            assert!(error.contains(expected), "{to}: {error}");
        }
    }

    #[test]
    fn any_numbers_come_back_bit_for_bit() {
        let mut random = SplitMix64::after(11, 0);
        let mut size = || f32::from_bits((random.bits() as u32 & 0x7fff_ffff).clamp(1, 0x7f7f_ffff));
        let material =
            |a: f32, b: f32| Material { density: a, friction: b, restitution: -0.0, surface_speed: -a.min(1e9) };
        let any = |i: u64| {
            let half = Vec2::new(size(), size());
            let shape = if i.is_multiple_of(2) { Shape::Box { half } } else { Shape::circle(size()) };
            Kind::new(shape, material(size(), size()))
        };
        let kinds: Vec<Kind> = (0..2000).map(any).collect();
        let fixed = |(i, kind): (usize, &Kind)| {
            let mut finite = || f64::from_bits(random.bits() & !(1 << 62));
            let position = DVec2::new(finite(), finite());
            let rotation = Rot::from_angle(i as f32);
            // Some of the names follow each other.
            let id = GlobalId(i as u64 * (1 + i as u64 / 1000));
            StaticBody { rotation, ..StaticBody::new(id, kind.clone(), position) }
        };
        let statics: Vec<StaticBody> = kinds.iter().enumerate().map(fixed).collect();
        assert_comes_back(&kinds, &statics);
        let last = StaticBody { id: GlobalId(u64::MAX), position: DVec2::new(-0.0, 5e-324), ..statics[0].clone() };
        assert_comes_back(&kinds, &[statics[0].clone(), last]);
    }

    #[test]
    fn the_text_is_short_and_fit_to_be_read() {
        let wall = |id, x| StaticBody::new(GlobalId(id), kind(Shape::rectangle(0.2, 1.0)), DVec2::new(x, 0.5));
        let text = StageText::new(&[kind(Shape::circle(0.2))], &[wall(0, 1.0), wall(1, -0.1), wall(7, 1e9)]);
        assert_eq!(text.kinds, r#"[{"circle":0.2,"density":1.0,"friction":0.6,"restitution":0.0}]"#);
        let expected = r#"{"kinds":[{"box":[0.1,0.5],"density":1.0,"friction":0.6,"restitution":0.0}],"ids":[[0,2],[7,1]],"kind":[0,0,0],"x":[1.0,-0.1,1000000000.0],"y":[0.5,0.5,0.5]}"#;
        assert_eq!(text.statics, expected);
        // Tens of thousands of statics are no burden to every file.
        let many: Vec<_> = (0..30_000).map(|id| wall(id, id as f64 * 0.25)).collect();
        assert!(StageText::new(&[], &many).statics.len() < 20 * many.len());
    }

    #[test]
    fn kinds_may_become_more() {
        let text = |radii: &[f32]| {
            let kinds: Vec<Kind> = radii.iter().map(|&radius| kind(Shape::circle(radius))).collect();
            StageText::new(&kinds, &[])
        };
        let (none, one, two, other) = (text(&[]), text(&[1.0]), text(&[1.0, 2.0]), text(&[3.0]));
        assert!(two.includes(&one) && two.includes(&none) && one.includes(&none) && one.includes(&one));
        assert!(!one.includes(&two) && !two.includes(&other) && !other.includes(&one) && !none.includes(&one));
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let good = StageText::new(
            &[kind(Shape::circle(0.2)), kind(Shape::rectangle(1.0, 1.0))],
            &[0, 1].map(|id| StaticBody { rotation: Rot { c: 0.6, s: 0.8 }, ..wall(id) }),
        );
        fn wall(id: u64) -> StaticBody {
            StaticBody::new(GlobalId(id), kind(Shape::rectangle(0.5, 4.0)), DVec2::new(3.0, 7.0))
        }
        // A newer program may say more.
        let more =
            |text: &str| text.replace("\"density\"", "\"color\":[1,{}],\"density\"").replace("\"x\"", "\"z\":0,\"x\"");
        let newer = StageText { kinds: more(&good.kinds), statics: more(&good.statics) };
        assert_eq!(newer.read(), good.read());

        for (from, to, expected) in [
            ("0.2", "0.0", "kind 0 of atoll.kinds has a number that cannot be"),
            ("0.2", "-0.2", "kind 0 of atoll.kinds has a number that cannot be"),
            ("0.2", "1e39", "atoll.kinds is unreadable: number out of range"),
            ("0.2", "NaN", "atoll.kinds is unreadable: expected value at line 1"),
            ("0.2", "null", "kind 0 of atoll.kinds has no shape that is known"),
            ("[0.5,0.5]", "[0.5,0.0]", "kind 1 of atoll.kinds has a number that cannot be"),
            ("[0.5,0.5]", "[0.5]", "atoll.kinds is unreadable: invalid length 1"),
            ("\"box\"", "\"capsule\"", "kind 1 of atoll.kinds has no shape that is known"),
            ("\"box\"", "\"circle\":1.0,\"box\"", "kind 1 of atoll.kinds has no shape that is known"),
            ("\"restitution\":0.0", "\"restitution\":1.5", "has a number that cannot be"),
            ("\"density\":1.0,", "", "atoll.kinds is unreadable: missing field `density`"),
        ] {
            let (kinds, statics) = (good.kinds.replace(from, to), good.statics.clone());
            assert_ne!(kinds, good.kinds, "{from}");
            let error = StageText { kinds, statics }.read().unwrap_err();
            assert!(error.contains(expected) && !error.contains('\n'), "{to}: {error}");
        }
        for (from, to, expected) in [
            ("\"x\":[3.0,3.0]", "\"x\":[3.0]", "atoll.statics has columns of different lengths"),
            ("\"cos\":[0.6,0.6]", "\"cos\":[]", "atoll.statics has columns of different lengths"),
            ("\"cos\":[0.6,0.6]", "\"cos\":[0.6,1e40]", "atoll.statics"),
            ("[[0,2]]", "[[0,3]]", "atoll.statics names others than it has"),
            ("[[0,2]]", "[[0,0],[0,2]]", "atoll.statics names others than it has"),
            ("[[0,2]]", "[[18446744073709551615,2]]", "atoll.statics names others than it has"),
            ("[[0,2]]", "[[0,18446744073709551615],[0,3]]", "atoll.statics names others than it has"),
            ("\"kind\":[0,0]", "\"kind\":[0,1]", "atoll.statics has a body of a kind that is not there"),
            ("\"kind\":[0,0]", "\"kind\":[0,-1]", "atoll.statics is unreadable"),
            ("0.25", "0.0", "kind 0 of atoll.statics has a number that cannot be"),
            ("7.0,7.0", "7.0,1e999", "atoll.statics is unreadable: number out of range"),
        ] {
            let (kinds, statics) = (good.kinds.clone(), good.statics.replace(from, to));
            assert_ne!(statics, good.statics, "{from}");
            let error = StageText { kinds, statics }.read().unwrap_err();
            assert!(error.contains(expected) && !error.contains('\n'), "{to}: {error}");
        }
    }
}
