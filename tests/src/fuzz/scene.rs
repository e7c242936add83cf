//! Files of scenes: text, CSV, Parquet, and those of other programs.

use super::Outcome;
use atoll::internals::{check_import, parquet_of_bodies};
use atoll::scene::{FileSpec, Scene, SceneError, SceneKind, SceneSpec};
use atoll_core::{Body, GlobalId, KindId, Rot};
use glam::{DVec2, Vec2};
use std::fs;
use tempfile::TempDir;

/// Which file of a scene bytes are put in the place of.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ScenePart {
    /// Its text, with bodies in it.
    Text,
    /// Its bodies as CSV.
    Csv,
    /// Its bodies as Parquet.
    Parquet,
    /// A file of another program.
    Import,
}

impl ScenePart {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Text, Self::Csv, Self::Parquet, Self::Import];

    /// A good file.
    pub fn genuine(self) -> Vec<u8> {
        let text = match self {
            Self::Text => {
                format!("{}[[body]]\nx = 1\ny = 2.5\nkind = \"crate\"\n[[body]]\nx = 3\ny = 4\nvx = -1e-3\n", head())
            }
            Self::Csv => {
                "id,kind,x,y,angle,vx,vy,omega\n5,crate,1.5,2.25,0.5,1,-2,1e-3\n6,1,3,4,0,0,0,-0.0\n".to_owned()
            }
            Self::Parquet => {
                let body = |k: u64| Body {
                    id: GlobalId(100 + k),
                    position: DVec2::new(0.01 * k as f64, 0.02 * k as f64),
                    rotation: Rot::from_angle(0.1 * k as f32),
                    velocity: Vec2::new(1.0, -0.5),
                    angular_velocity: k as f32,
                    kind: KindId((k % 2) as u32),
                };
                return parquet_of_bodies(&(0..300).map(body).collect::<Vec<_>>()).expect("room in memory");
            }
            Self::Import => {
                "title\n\n2 atoms\n\n0 4 xlo xhi\n0 5 ylo yhi\n\nAtoms # sphere\n\n1 1 0.5 1 2 3 0\n2 1 0.5 1 3 1 0\n\n\
                             Velocities\n\n1 1 2 0 0 0 3\n"
                    .to_owned()
            }
        };
        text.into_bytes()
    }
}

/// The beginning of a scene, without bodies.
fn head() -> String {
    let kinds = "[[kinds]]\nname = \"crate\"\nshape = \"box\"\nwidth = 0.5\nheight = 0.25\n[[kinds]]\nshape = \"circle\"\nradius = 0.3\n";
    let fixed = "[[statics]]\nshape = \"box\"\nwidth = 20.0\nheight = 1.0\nx = 4\ny = -0.5\nangle = 0.1\n";
    format!("format = \"atoll-scene/1\"\ndomain = [[0, 0], [8, 8]]\n[physics]\ngravity = [0, -10]\n{kinds}{fixed}")
}

thread_local! {
    static FOLDER: TempDir = tempfile::tempdir().expect("a place for temporary files");
}

/// The first byte says which part; the rest is refused in one line, or it is a scene whose rows are all of the scene's kinds and
/// finite, and are found again where they are.
pub fn scene(bytes: &[u8]) -> Outcome<SceneError> {
    let Some((first, bytes)) = bytes.split_first() else { return Outcome { accepted: false, refusals: Vec::new() } };
    scene_part(ScenePart::ALL[usize::from(*first) % ScenePart::ALL.len()], bytes)
}

/// As [`scene`], with the part told apart.
pub fn scene_part(part: ScenePart, bytes: &[u8]) -> Outcome<SceneError> {
    FOLDER.with(|folder| {
        let (text, name) = (folder.path().join("world.toml"), ["", "b.csv", "b.parquet", "other"][part as usize]);
        let write = |path, bytes: &[u8]| {
            // A file that is written over goes to the disk at once on some systems.
            let _ = fs::remove_file(&path);
            fs::write(path, bytes).expect("room for a small file");
        };
        match part {
            ScenePart::Text => write(text.clone(), bytes),
            ScenePart::Import => {
                write(folder.path().join(name), bytes);
                return Outcome::of(check_import(&folder.path().join(name)));
            }
            ScenePart::Csv | ScenePart::Parquet => {
                write(text.clone(), format!("{}[bodies]\npath = \"{name}\"\n", head()).as_bytes());
                write(folder.path().join(name), bytes);
            }
        }
        let read = FileSpec::open(&text).and_then(|spec| {
            let scene = Scene::open(&SceneSpec::usual(SceneKind::File(spec)))?;
            let bodies = scene.iter().collect::<Result<Vec<Body>, _>>()?;
            Ok((scene, bodies))
        });
        if let Ok((scene, bodies)) = &read {
            assert_eq!(bodies.len() as u64, scene.bodies());
            let kinds = scene.kinds().len();
            for body in bodies {
                assert!(
                    body.position.is_finite() && body.velocity.is_finite() && (body.kind.0 as usize) < kinds,
                    "{body:?}"
                );
            }
            assert!(scene.statics().iter().all(|fixed| bodies.iter().all(|body| body.id != fixed.id)));
        }
        Outcome::of(read)
    })
}
