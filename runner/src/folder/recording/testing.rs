//! Small recordings for tests.

use super::{Record, RecordingWriter, RunFacts, StageText, rank_folder};
use atoll_core::{Body, GlobalId, Kind, KindId, Material, Rot, Shape, StaticBody};
use glam::{DVec2, Vec2};
use std::path::Path;

/// The facts of a run on 4 x 2 tiles of 10 m.
pub(crate) fn facts(record_every: u64) -> RunFacts {
    RunFacts {
        version: "1.2.3".to_owned(),
        scene: "rooms".to_owned(),
        seed: 7,
        record_every,
        domain: [DVec2::new(-20.0, 0.0), DVec2::new(20.0, 20.0)],
        tiles: [4, 2],
        config: "[scene]\nkind = \"rooms\"\n".to_owned(),
        canonical: "scene.kind = \"rooms\"\nscene.seed = 7\nrun.steps = 100\nphysics.hertz = 50.0\n".to_owned(),
    }
}

/// A box of 2 m x 1 m, a disc of 1 m, and two walls, one of them turned.
pub(crate) fn stage() -> (Vec<Kind>, Vec<StaticBody>) {
    let kind = |shape| Kind::new(shape, Material::default());
    let wall = |id, x| StaticBody::new(GlobalId(id), kind(Shape::rectangle(1.0, 20.0)), DVec2::new(x, 10.0));
    let turned = StaticBody { rotation: Rot::from_angle(0.1), ..wall(1, 20.0) };
    (vec![kind(Shape::rectangle(2.0, 1.0)), kind(Shape::circle(1.0))], vec![wall(0, -20.0), turned])
}

/// The same as it is written.
pub(crate) fn stage_text() -> StageText {
    let (kinds, statics) = stage();
    StageText::new(&kinds, &statics)
}

/// A body whose state looks like no other's.
pub(crate) fn body(id: u64, step: u64) -> Body {
    let part = |i: u64| ((id * 31 + step * 7 + i * 3) as f64 * 0.618_033_988_749_894_9).fract();
    Body {
        id: GlobalId(id),
        position: DVec2::new(40.0 * part(0) - 20.0, 20.0 * part(1)),
        rotation: Rot::from_angle(6.0 * part(2) as f32 - 3.0),
        velocity: Vec2::new(part(3) as f32, -part(4) as f32),
        angular_velocity: part(5) as f32,
        kind: KindId((id % 2) as u32),
    }
}

/// Twenty bodies, none of them in the order of their names.
pub(crate) fn bodies(step: u64) -> Vec<Body> {
    (0..20).map(|i| body(100 + (i * 7 + step) % 20, step)).collect()
}

/// Records these steps of a run of so many ranks: `bodies` gives the bodies after a step, which are dealt out to the ranks.
pub(crate) fn record(
    folder: &Path,
    facts: &RunFacts,
    ranks: u32,
    steps: impl Iterator<Item = u64> + Clone,
    bodies: impl Fn(u64) -> Vec<Body>,
) {
    for rank in 0..ranks {
        let mut writer = RecordingWriter::new(rank_folder(folder, rank), rank, ranks, facts, &stage_text()).unwrap();
        let mut record = Record::default();
        for step in steps.clone() {
            let all = bodies(step);
            record.fill(step, all.into_iter().skip(rank as usize).step_by(ranks as usize));
            writer.write(&record).unwrap();
        }
        writer.close_segment().unwrap();
    }
}
