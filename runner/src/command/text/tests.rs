use super::*;
use atoll_core::{Kind, Material, Shape};

#[test]
fn every_action_is_read() {
    let did = |text: &str| match parse(3, text).unwrap_or_else(|error| panic!("{text}: {error}")).action {
        Action::Do(commands) => commands,
        other => panic!("{text}: {other:?}"),
    };
    let id = GlobalId(7);
    assert_eq!(did(r#"{"step": 1, "remove": 7}"#), [Command::Remove(id)]);
    assert_eq!(did(r#"{"step": 1, "wake": [7, 8]}"#), [Command::Wake(id), Command::Wake(GlobalId(8))]);
    assert_eq!(did(r#"{"step": 1, "gravity": [0, -1.6]}"#), [Command::SetGravity(Vec2::new(0.0, -1.6))]);
    assert_eq!(did(r#"{"step": 1, "kind": {"id": 7, "kind": 2}}"#), [Command::SetKind { id, kind: KindId(2) }]);
    let force = Command::Force { id, force: Vec2::new(1.0, 2.0), torque: 0.0, steps: 60 };
    assert_eq!(did(r#"{"step": 1, "force": {"id": 7, "x": 1, "y": 2, "steps": 60}}"#), [force]);
    let impulse = Command::Impulse { id, impulse: Vec2::X, at: Some(DVec2::new(3.0, 4.0)), angular: 0.5 };
    let text = r#"{"step": 1, "impulse": {"id": 7, "x": 1, "y": 0, "at": [3, 4], "angular": 0.5}}"#;
    assert_eq!(did(text), [impulse]);
    let set = Command::SetVelocity { id, velocity: Vec2::Y, angular_velocity: 0.0 };
    assert_eq!(did(r#"{"step": 1, "velocity": [{"id": 7, "vx": 0, "vy": 1}]}"#), [set]);
    let kind = Kind::new(Shape::circle(0.5), Material { density: 3.0, ..Material::default() });
    let text = r#"{"step": 1, "add_kind": {"shape": "circle", "radius": 0.5, "density": 3}}"#;
    assert_eq!(did(text), [Command::AddKind(kind)]);
    let capsule = Kind { sensor: true, ..Kind::new(Shape::capsule(1.0, 0.25).unwrap(), Material::default()) };
    assert_eq!(did(r#"{"step": 1, "add_kind": {"capsule": [1, 0.25], "sensor": true}}"#), [Command::AddKind(capsule)]);
    let parts = r#"{"step": 1, "add_kind": {"parts": [{"circle": 0.5}, {"box": [1, 1], "at": [2, 0]}], "group": -1}}"#;
    let [Command::AddKind(Kind { shape: Shape::Compound(pair), filter, .. })] = &did(parts)[..] else {
        panic!("a compound")
    };
    assert_eq!((pair.parts().len(), filter.group), (2, -1));
    let line = parse(9, r#"{"step": 4, "name": "up", "ray": {"from": [0, 1], "to": [2, 3]}}"#).unwrap();
    let question = Question::Ray { from: DVec2::new(0.0, 1.0), to: DVec2::new(2.0, 3.0) };
    assert_eq!((line.step, line.number, line.name.as_deref()), (4, 9, Some("up")));
    assert_eq!(line.action, Action::Ask(question));
    let asked = |text: &str| parse(1, text).unwrap().action;
    assert_eq!(asked(r#"{"step": 1, "body": 7}"#), Action::Ask(Question::Body(id)));
    for ids in [vec![], vec![7], vec![7, 8]] {
        let question = Question::Bodies(ids.iter().copied().map(GlobalId).collect());
        assert_eq!(asked(&format!("{{\"step\": 1, \"body\": {ids:?}}}")), Action::Ask(question));
    }
}

#[test]
fn places_that_are_asked_about_can_be_reckoned_with() {
    for text in [
        r#"{"step": 1, "ray": {"from": [0, 1e308], "to": [0, -1e308]}}"#,
        r#"{"step": 1, "rectangle": {"low": [-1e101, 0], "high": [1, 1]}}"#,
    ] {
        assert_eq!(parse(3, text).unwrap_err(), "places must be within 1e100 m of the origin", "{text}");
    }
    assert!(parse(3, r#"{"step": 1, "rectangle": {"low": [-1e100, -1e100], "high": [1e100, 1e100]}}"#).is_ok());
}

#[test]
fn bodies_are_named_or_not_and_turned_in_two_ways() {
    let text = r#"{"step": 0, "add": [{"id": 3, "x": 0.1, "y": -2e8, "angle": 0.5, "vx": 0.1},
                   {"kind": 1, "x": 1, "y": 2, "cos": 0.6, "sin": 0.8}]}"#;
    let Action::Add(bodies) = parse(1, text).unwrap().action else { panic!("bodies") };
    assert_eq!(bodies.iter().map(|new| new.is_named).collect::<Vec<_>>(), [true, false]);
    let [first, second] = [bodies[0].body, bodies[1].body];
    assert_eq!((first.id, first.position, first.velocity), (GlobalId(3), DVec2::new(0.1, -2e8), Vec2::new(0.1, 0.0)));
    assert_eq!((first.rotation, second.rotation), (Rot::from_angle(0.5), Rot { c: 0.6, s: 0.8 }));
    assert_eq!((first.kind, second.kind), (KindId(0), KindId(1)));
}

#[test]
fn what_cannot_be_read_is_told_in_one_line() {
    for (text, expected) in [
        ("", "EOF while parsing a value, at column 0"),
        ("{", "EOF while parsing an object"),
        ("[1]", "a list stands where an object, {...} must"),
        (r#"[{"step": 1, "remove": 3}]"#, "a list stands where an object, {...} must: each"),
        ("3", "3 stands where an object, {...} must"),
        (r#"{"step": 1, "impulse": 3}"#, "3 stands where an object, {...} must"),
        (r#"{"step": 1, "contacts": 3}"#, "3 stands where true or false must"),
        (r#"{"step": 1, "gravity": {}}"#, "an object stands where two numbers in a list must"),
        (r#"{"step": 1, "point": [3]}"#, "a list stands where two numbers in a list must"),
        (r#"{"remove": 3}"#, "it has no step"),
        (r#"{"step": 1}"#, "it asks for nothing; give one of add, remove,"),
        (r#"{"step": -1, "remove": 3}"#, "-1 stands where a whole number that is not negative must, at column 11"),
        (r#"{"step": 1, "remove": 3, "wake": 3}"#, "it asks for several things"),
        (r#"{"step": 1, "remov": 3}"#, "unknown field `remov`, expected one of `step`"),
        (r#"{"step": 1, "remove": [3, "x"]}"#, "string \"x\" stands where a whole number that is not negative must"),
        (r#"{"step": 1, "add": {"x": 1}}"#, "missing field `y`"),
        (r#"{"step": 1, "add": {"x": 1, "y": 2, "z": 3}}"#, "unknown field `z`"),
        (r#"{"step": 1, "add": [{"x": 1, "y": 2, "x": 3}]}"#, "duplicate field `x`"),
        (r#"{"step": 1, "velocity": {"id": 1, "id": 2}}"#, "duplicate field `id`"),
        (r#"{"step": 1, "add": {"x": 1, "y": 2, "cos": 1}}"#, "a body is turned by an angle, or by cos and sin"),
        (r#"{"step": 1, "add": [{"x": 1e9, "y": 0}, {"x": 0, "y": -1e12}]}"#, "add, y = -1e12: must be within -1e9 to"),
        (
            r#"{"step": 1, "add_kind": {"shape": "star", "radius": 1}}"#,
            "add_kind, shape = \"star\": must be \"box\" or \"circle\"; or give",
        ),
        (
            r#"{"step": 1, "add_kind": {"shape": "box", "radius": 1}}"#,
            "add_kind, width: is missing: must be a positive number, in meters",
        ),
        (
            r#"{"step": 1, "add_kind": {"shape": "circle", "radius": -1}}"#,
            "add_kind, radius = -1: must be a positive number",
        ),
        (r#"{"step": 1, "add_kind": {"circle": 1, "box": [1, 1]}}"#, "add_kind, circle = 1: there is box already"),
        (r#"{"step": 1, "add_kind": {"segment": {}}}"#, "add_kind, segment = {...}: is for [[statics]] alone"),
        (r#"{"step": 1, "add_kind": {"parts": [{"circle": null}]}}"#, "null stands where any valid TOML value must"),
        (
            r#"{"step": 1, "add_kind": {"circle": 1, "sensors": true}}"#,
            "add_kind, sensors = true: unknown key; did you",
        ),
        (r#"{"step": 1, "force": {"id": 1, "x": 1, "y": 2, "steps": 0}}"#, "a force must push for one step"),
        (r#"{"step": 1, "rectangle": {"low": [0, 0], "high": [1, -1]}}"#, "the high corner of a rectangle"),
        (r#"{"step": 1, "until": 3}"#, "until is for whoever drives a run"),
    ] {
        let error = parse(1, text).unwrap_err();
        assert!(error.starts_with(expected) && !error.contains('\n'), "{text}: {error}");
    }
}

#[test]
fn whoever_drives_need_not_say_when() {
    assert_eq!(word(1, r#"{"until": 9}"#, 4), Ok(Word::Until(9)));
    let Ok(Word::Line(line, text)) = word(2, r#"{"remove": 3}"#, 4) else { panic!("a line") };
    assert_eq!((line.step, text.as_str()), (4, r#"{"step":4,"remove":3}"#));
    assert_eq!(parse(2, &text), Ok(line));
    assert!(word(1, r#"{"until": 9, "remove": 3}"#, 4).is_err());
}
