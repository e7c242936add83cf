//! Forms of what a configuration says of its scene, which may be in files of its own.

use super::error::{ConfigError, Given, Origin};
use super::forms::{Form, keep, whole};
use super::keys::{self, KEYS, MOST_BODIES};
use super::read;
use super::sections::Config;
use super::settings::{Settings, one_of};
use crate::scene::{FileSpec, SceneError, SceneFile, SceneKind};
use toml::Value;

/// The kind of scene, from which everything else that is usual follows: it stands first.
pub(super) struct SceneWord;

impl Form for SceneWord {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        const BUILT_IN: usize = SceneKind::USUAL.len();
        let words = SceneKind::USUAL.iter().map(SceneKind::name).chain([SceneKind::FILE]);
        let words: Vec<(&str, usize)> = words.zip(0..).collect();
        let chosen = settings.choice(key, &words)?.ok_or_else(|| settings.missing(key, one_of(&words)))?;
        *config = match SceneKind::USUAL.into_iter().nth(chosen) {
            Some(kind) => Config::usual(kind),
            None => {
                debug_assert_eq!(chosen, BUILT_IN);
                in_files(settings)?
            }
        };
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        Some(config.scene.kind.name().into())
    }
}

/// What is usual for a scene in files: what they say of the physics.
fn in_files(settings: &mut Settings) -> Result<Config, ConfigError> {
    const PATH: &str = "scene.path";
    let missing = || "the path of a scene, such as \"world.toml\"".to_owned();
    let path = settings.path(PATH)?.ok_or_else(|| settings.missing(PATH, missing()))?;
    if settings.is_begun {
        let digest = settings.text(DIGEST, MUST)?.unwrap_or_default();
        let spec = FileSpec::of_begun(path.to_string_lossy().into_owned(), digest);
        return Ok(Config::usual(SceneKind::File(spec)));
    }
    let is_here = matches!(settings.given(PATH), Some(Given { origin: Origin::Set, .. }));
    let spec = FileSpec::open(&path).map_err(|error| match error {
        SceneError::Read { file, what, reason } if !is_here && !path.exists() => {
            let reason = format!("{reason}; if it was moved, say where it is: --set scene.path=PATH");
            SceneError::Read { file, what, reason }
        }
        error => error,
    })?;
    let file = spec.file()?;
    let mut config = Config::usual(SceneKind::File(spec));
    read_physics(&file, &mut config)?;
    Ok(config)
}

/// Takes what a scene says of the physics.
fn read_physics(file: &SceneFile, config: &mut Config) -> Result<(), ConfigError> {
    let (name, section) = (file.path().display().to_string(), "physics");
    let physics = || keys::names().filter(|name| name.starts_with("physics."));
    let mut said = Settings::of_section(&name, section, file.physics().clone(), physics())?;
    let keys = KEYS.iter().filter(|key| key.name.starts_with("physics."));
    keys.into_iter().try_for_each(|key| key.read(&mut said, config))?;
    read::check_params(config, &said)
}

/// Where the text of a scene in files is.
pub(super) struct ScenePath;

impl Form for ScenePath {
    /// It was read with the kind of the scene.
    fn read(&self, _: &'static str, _: &mut Settings, _: &mut Config) -> Result<(), ConfigError> {
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        if let SceneKind::File(spec) = &config.scene.kind { Some(spec.path.clone().into()) } else { None }
    }
}

const DIGEST: &str = "scene.digest";
const MUST: &str = "32 hexadecimal digits";

/// What tells the content of a scene in files from that of others.
pub(super) struct SceneDigest;

impl Form for SceneDigest {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        let SceneKind::File(spec) = &config.scene.kind else { return Ok(()) };
        match settings.text(key, MUST)? {
            Some(digest) if digest != spec.digest => {
                let must = format!(
                    "\"{}\", that of {} as it is now: bring back the scene that was meant, or, where no run is to go on, \
                     leave scene.digest out",
                    spec.digest, spec.path
                );
                Err(settings.refusal(key, must))
            }
            _ => Ok(()),
        }
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        if let SceneKind::File(spec) = &config.scene.kind { Some(spec.digest.clone().into()) } else { None }
    }
}

/// How many bodies there are, which files say themselves.
pub(super) struct SceneBodies;

impl Form for SceneBodies {
    fn read(&self, key: &'static str, settings: &mut Settings, config: &mut Config) -> Result<(), ConfigError> {
        let range = config.scene.kind.least_bodies()..=MOST_BODIES;
        if let (SceneKind::File(_), false) = (&config.scene.kind, settings.is_begun) {
            let there = config.scene.bodies;
            return match settings.integer(key, 0..=u64::MAX)? {
                Some(bodies) if bodies != there => {
                    Err(settings.refusal(key, format!("{there}, as many as the file of the scene has; leave it out")))
                }
                _ => Ok(()),
            };
        }
        keep(settings.integer(key, range)?, &mut config.scene.bodies);
        Ok(())
    }

    fn write(&self, config: &mut Config) -> Option<Value> {
        Some(whole(config.scene.bodies))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Override;
    use std::fs;
    use std::path::Path;
    use tempfile::{TempDir, tempdir};

    const WORLD: &str = "format = \"atoll-scene/1\"\ndomain = [[0, 0], [8, 8]]\n[physics]\ngravity = [0, -9]\nhertz = 90\n\
                         [[kinds]]\nshape = \"circle\"\nradius = 0.5\n[[body]]\nx = 1\ny = 2\n[[body]]\nx = 4\ny = 2\n";

    /// A folder with a scene, and with a configuration in another one beside it.
    fn folder(world: &str, config: &str) -> TempDir {
        let folder = tempdir().unwrap();
        fs::create_dir(folder.path().join("configs")).unwrap();
        fs::write(folder.path().join("world.toml"), world).unwrap();
        fs::write(folder.path().join("configs/c.toml"), format!("[scene]\nkind = \"file\"\n{config}")).unwrap();
        folder
    }

    fn load(folder: &Path, overrides: &[(&str, &str)]) -> Result<Config, String> {
        let overrides: Vec<Override> = overrides.iter().map(|(key, value)| Override::set(key, value)).collect();
        Config::load(&folder.join("configs/c.toml"), &overrides).map_err(|error| error.to_string())
    }

    #[test]
    fn a_configuration_wins_over_what_its_scene_says_of_the_physics() {
        let folder = folder(WORLD, "path = \"../world.toml\"\n[physics]\nhertz = 30\n");
        let config = load(folder.path(), &[("substeps", "2")]).unwrap();
        assert_eq!((config.params.gravity.y, config.params.dt, config.params.substeps), (-9.0, 1.0 / 30.0, 2));
        assert_eq!((config.scene.bodies, config.scene.kind.name()), (2, "file"));
        assert_eq!(load(folder.path(), &[("hertz", "40")]).unwrap().hertz(), 40.0);
        // The file of a scene is a configuration of what is usual for it.
        let direct = Config::load(&folder.path().join("world.toml"), &[Override::set("steps", "3")]).unwrap();
        assert_eq!((direct.hertz(), direct.run.steps, direct.scene.bodies), (90.0, 3, 2));
    }

    #[test]
    fn it_is_known_by_what_is_said_and_read_again_wherever_it_is() {
        let tiles = [2, 1];
        let (here, there) = (folder(WORLD, "path = \"../world.toml\"\n"), folder(WORLD, "path = \"../world.toml\"\n"));
        let (config, other) = (load(here.path(), &[]).unwrap(), load(there.path(), &[]).unwrap());
        assert_eq!((config.canonical(tiles), config.hash(tiles)), (other.canonical(tiles), other.hash(tiles)));
        assert!(config.canonical(tiles).starts_with("scene.kind = \"file\"\nscene.digest = \""));
        assert!(!config.canonical(tiles).contains("seed") && !config.canonical(tiles).contains("path"));
        let written = config.to_toml(tiles);
        let again = Config::from_toml_str("elsewhere/run.toml", &written, &[]).unwrap();
        assert_eq!((again.to_toml(tiles), again.canonical(tiles)), (written.clone(), config.canonical(tiles)));
        // A run that was begun is known without its scene; to go on, it needs the same.
        fs::write(here.path().join("world.toml"), WORLD.replace("x = 4", "x = 5")).unwrap();
        let begun = Config::from_begun_str("run.toml", &written).unwrap();
        assert_eq!((begun.to_toml(tiles), begun.scene.bodies), (written.clone(), 2));
        let error = Config::from_toml_str("run.toml", &written, &[]).unwrap_err().to_string();
        assert!(
            error.starts_with("run.toml: scene.digest = \"") && error.contains("bring back the scene that"),
            "{error}"
        );
        let error = crate::scene::Scene::open(&begun.scene).unwrap_err().to_string();
        assert!(error.contains("world.toml: it is another scene than the one of the run, whose digest is "), "{error}");
        assert_ne!(load(here.path(), &[]).unwrap().hash(tiles), config.hash(tiles));
    }

    #[test]
    fn what_does_not_go_with_it_is_refused_in_one_line() {
        let path = "path = \"../world.toml\"\n";
        for (world, config, overrides, expected) in [
            (WORLD, "", &[][..], "c.toml: scene.path is missing: must be the path of a scene, such as \"world.toml\""),
            (WORLD, "path = 3\n", &[], "c.toml: scene.path = 3: must be a path"),
            (WORLD, "path = \"\"\n", &[], "c.toml: scene.path = \"\": must be a path"),
            (WORLD, "path = \"none.toml\"\n", &[], "; if it was moved, say where it is: --set scene.path=PATH"),
            (
                WORLD,
                path,
                &[("bodies", "5")],
                "--set scene.bodies=5: must be 2, as many as the file of the scene has; leave",
            ),
            (WORLD, path, &[("seed", "5")], "--set scene.seed=5: scenes of this kind have no scene.seed; leave it out"),
            (WORLD, path, &[("power", "2")], "--set scene.power=2: scenes of this kind have no scene.power"),
            (WORLD, path, &[("digest", "abc")], "--set scene.digest=abc: must be \""),
            (
                WORLD,
                path,
                &[("kind", "stack")],
                "scene.path = \"../world.toml\": scenes of this kind have no scene.path",
            ),
            (WORLD, path, &[("exchange", "substep"), ("ghosts", "frozen")], "--set physics.ghosts=frozen: must be"),
            ("", path, &[], "/world.toml: format: is missing"),
        ] {
            let folder = folder(world, config);
            let error = load(folder.path(), overrides).unwrap_err();
            assert!(error.contains(expected) && !error.contains('\n'), "{error}");
        }
        for (physics, expected) in [
            ("gravity = 9", "world.toml: physics.gravity = 9: must be two numbers of at most 3.4e38, such as [0, -10]"),
            ("gravty = [0, 9]", "world.toml: physics.gravty = [0, 9]: unknown key; did you mean physics.gravity?"),
            ("substeps = 100", "world.toml: physics.substeps = 100: must be within 1 to 64"),
            ("margin_cap = 0.01", "world.toml: physics.margin_cap = 0.01: must be finite and at least margin_floor"),
            ("tiles = 4", "world.toml: physics.tiles = 4: unknown key"),
        ] {
            let folder = folder(&WORLD.replace("hertz = 90", physics).replace("gravity = [0, -9]\n", ""), path);
            let error = load(folder.path(), &[]).unwrap_err();
            assert!(error.contains(expected) && !error.contains('\n'), "{error}");
        }
        let given = Config::from_toml_str("c.toml", "[scene]\nkind = \"stack\"\n", &[("path", "a")]).unwrap_err();
        assert!(given.to_string().starts_with("--set scene.path=a: scenes of this kind have no scene.path"), "{given}");
    }
}
