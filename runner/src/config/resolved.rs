//! What a configuration comes to once every default is filled in: as a file that repeats the run, and as the text and
//! the hash of what its result depends on.

use super::keys::{Concern, KEYS};
use super::sections::Config;
use atoll_core::Params;
use std::fmt::Write as _;
use toml::Value;

/// Stands at the beginning of the file.
const HEADING: &str = "# The configuration of this run, every key with the value that was used. `atoll run` this file \
                       to repeat it.\n";

/// Stands below it.
const MORE: &str =
    "# What was done in the run, if anything was, is in commands.jsonl: give that with `--commands` as well.\n";

impl Config {
    /// Every key with the value that is used, in the order of the documentation; keys that nobody chose and that have
    /// no default are left out. `tiles` is the grid that is really used.
    ///
    /// A file of these entries gives the same configuration, bit for bit, as long as `dt` is the inverse of some
    /// `hertz`, as it is after reading.
    pub fn entries(&self, tiles: [u32; 2]) -> Vec<(&'static str, Value)> {
        let mut config = self.clone();
        config.run.tiles = Some(tiles);
        KEYS.iter().filter_map(|key| Some((key.name, key.write(&mut config)?))).collect()
    }

    /// [`entries`](Self::entries) as a file that repeats the run.
    pub fn to_toml(&self, tiles: [u32; 2]) -> String {
        let mut text = format!("{HEADING}{MORE}");
        let mut begun = "";
        for (path, value) in self.entries(tiles) {
            let (section, key) = path.split_once('.').expect("every key is in a section");
            if section != begun {
                write!(text, "\n[{section}]\n").expect("a string takes any text");
                begun = section;
            }
            writeln!(text, "{key} = {value}").expect("a string takes any text");
        }
        text
    }

    /// Everything that the result depends on, a line `key = value` each: not ranks, threads or transport, nor the ways
    /// of computing that change no bit. `tiles` is the grid that is really used.
    pub fn canonical(&self, tiles: [u32; 2]) -> String {
        let mut config = self.clone();
        config.run.tiles = Some(tiles);
        let what = KEYS.iter().filter(|key| key.concern == Concern::What);
        let entries = what.filter_map(|key| Some((key.name, key.write(&mut config)?)));
        entries.map(|(key, value)| format!("{key} = {value}\n")).collect()
    }

    /// What [`physics`] says that is not usual where nobody says anything: what a scene in a file must say for the same.
    ///
    /// [`physics`]: Self::params
    pub(crate) fn unusual_physics(&self) -> Vec<(&'static str, Value)> {
        let (mut config, mut usual) = (self.clone(), Self { params: Params::default(), ..self.clone() });
        let keys = KEYS.iter().filter_map(|key| Some((key, key.name.strip_prefix("physics.")?)));
        let values = keys.filter_map(|(key, name)| Some((name, key.write(&mut config)?, key.write(&mut usual)?)));
        values.filter(|(_, value, usual)| value != usual).map(|(name, value, _)| (name, value)).collect()
    }

    /// What all parts of one run have in common, a `key = value` line each: [`canonical`](Self::canonical), and how often it
    /// is recorded. [`other_run`](super::other_run) compares two.
    pub(crate) fn identity(&self, tiles: [u32; 2]) -> String {
        identity(self.output.record_every, &self.canonical(tiles))
    }

    /// A fingerprint of [`canonical`](Self::canonical): 32 hexadecimal digits, the same for runs that must agree.
    pub fn hash(&self, tiles: [u32; 2]) -> String {
        format!("{:032x}", xxhash_rust::xxh3::xxh3_128(self.canonical(tiles).as_bytes()))
    }
}

/// Whether a text is a configuration that a run wrote, and not one that a person did.
pub(crate) fn is_resolved(text: &str) -> bool {
    text.starts_with(HEADING)
}

/// As [`Config::identity`].
pub(crate) fn identity(record_every: Option<u64>, canonical: &str) -> String {
    let every = record_every.map_or("nothing".to_owned(), |every| every.to_string());
    format!("output.record_every = {every}\n{canonical}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneKind;
    use crate::scene::SplitMix64;
    use std::collections::BTreeSet;
    use std::fs;
    use std::path::PathBuf;
    use std::time::Duration;

    const TILES: [u32; 2] = [3, 2];

    fn scene(kind: &str, overrides: &[(&str, &str)]) -> Config {
        Config::from_toml_str("test", &format!("[scene]\nkind = \"{kind}\"\n"), overrides).unwrap()
    }

    /// What it comes to, written and read again, is the same but for what the file cannot tell: that nobody chose the
    /// tiles, and that somebody asked for the ranks.
    fn assert_comes_back(config: &Config) {
        let text = config.to_toml(TILES);
        let again = Config::from_toml_str("again", &text, &[]).unwrap_or_else(|error| panic!("{error} in\n{text}"));
        let mut expected = config.clone();
        (expected.run.tiles, expected.run.ranks_asked_for) = (Some(TILES), false);
        assert_eq!(again, expected, "{text}");
        // This tells zeros of either sign apart.
        assert_eq!(again.entries(TILES), config.entries(TILES));
        assert_eq!(format!("{:?}", again.params), format!("{:?}", config.params));
        assert_eq!(again.to_toml(TILES), text);
    }

    #[test]
    fn every_file_comes_back_under_any_overrides() {
        let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../configs"));
        let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let mut read = 0;
        for file in files.filter(|path| path.extension().is_some_and(|extension| extension == "toml")) {
            let text = fs::read_to_string(&file).unwrap();
            for overrides in [
                &[][..],
                &[
                    ("ranks", "3"),
                    ("threads", "2"),
                    ("transport", "channel"),
                    ("tiles", "7x1"),
                    ("max_bodies", "700"),
                    ("retile_every", "9"),
                    ("peer_timeout", "0.1"),
                ],
                &[("hertz", "144"), ("gravity", "[-0.0, 1e-30]"), ("linear_damping", "-0.0"), ("sleep", "true")],
                &[("max_linear_speed", "inf"), ("max_angular_speed", "inf"), ("push_out_speed", "3.4028235e38")],
                &[("exchange", "step"), ("ghosts", "frozen"), ("solver", "pgs"), ("islands", "dfs")],
                &[("parallel", "coloring"), ("mpi_exchange", "sparse"), ("broad_phase", "quadtree")],
                &[("record_every", "10"), ("checkpoint_every", "4294967295"), ("seed", "9223372036854775807")],
                &[
                    ("baumgarte", "7.038530691851209e-26"),
                    ("sleep_time", "1e-45"),
                    ("peer_timeout", "123456.789012345"),
                ],
            ] {
                match Config::from_toml_str("test", &text, overrides) {
                    Ok(config) => assert_comes_back(&config),
                    Err(error) => panic!("{}: {error}", file.display()),
                }
            }
            read += 1;
        }
        assert!(read >= 10, "only {read} files");
        for (kind, key, value) in [
            ("rooms", "power", "1.2"),
            ("pile", "jitter", "0.1"),
            ("pyramids", "base", "7"),
            ("slope", "angle", "22.7"),
            ("slope", "friction", "0.3"),
        ] {
            assert_comes_back(&scene(kind, &[(key, value)]));
        }
        for kind in SceneKind::USUAL.iter().map(SceneKind::name) {
            assert_comes_back(&scene(kind, &[]));
        }
    }

    #[test]
    fn any_number_comes_back() {
        let mut random = SplitMix64::after(1, 0);
        let mut config = scene("rooms", &[]);
        let mut tried = 0;
        while tried < 1000 {
            let mut any = || f32::from_bits(random.bits() as u32 & 0x7fff_ffff);
            (config.params.dt, config.params.push_out_speed, config.params.margin_cap) = (1.0 / any(), any(), any());
            config.run.peer_timeout = Duration::from_nanos(1_000_000 + random.bits() % 999_999_000_000_000);
            // Longer steps than of a thousand seconds are refused.
            if config.params.check().is_ok() && config.params.dt < 999.0 {
                assert_comes_back(&config);
                tried += 1;
            }
        }
        assert_comes_back(&scene("rooms", &[("hertz", "0.001")]));
        // The greatest there is: the inverse of its inverse is infinity.
        assert_comes_back(&scene("rooms", &[("hertz", "3.4028235e38")]));
    }

    #[test]
    fn numbers_are_written_as_a_person_would() {
        let text = scene("pile", &[("hertz", "60")]).to_toml(TILES);
        for line in
            ["hertz = 60.0", "gravity = [0.0, -10.0]", "max_linear_speed = inf", "baumgarte = 0.1", "tiles = [3, 2]"]
        {
            assert!(text.lines().any(|written| written == line), "{line} is not in\n{text}");
        }
        for hertz in ["30.0", "90.0", "144.0", "59.94", "1000.0", "0.1"] {
            let text = scene("rooms", &[("hertz", hertz)]).to_toml(TILES);
            assert!(text.contains(&format!("\nhertz = {hertz}\n")), "{hertz} became another in\n{text}");
        }
    }

    #[test]
    fn every_key_is_given_in_its_order() {
        let position = |key: &str| KEYS.iter().position(|known| known.name == key).unwrap();
        let overrides =
            [("transport", "channel"), ("record_every", "1"), ("checkpoint_every", "1"), ("max_bodies", "9")];
        let mut seen = BTreeSet::new();
        for kind in SceneKind::USUAL.iter().map(SceneKind::name) {
            let keys: Vec<usize> =
                scene(kind, &overrides).entries(TILES).iter().map(|(key, _)| position(key)).collect();
            assert!(keys.is_sorted_by(|a, b| a < b), "{kind}: {keys:?}");
            seen.extend(keys);
        }
        // Those of scenes in files have a test of their own, and a number of tiles does not go with what they have at most.
        let bisected = scene("stack", &[("tile_count", "3")]).entries(TILES);
        seen.extend(bisected.iter().map(|(key, _)| position(key)));
        assert_eq!(seen.len(), KEYS.len() - 2, "a key is never given");
    }

    #[test]
    fn the_canonical_text_leaves_out_how() {
        let text = scene("stack", &[("transport", "channel"), ("record_every", "1"), ("checkpoint_every", "1")]);
        let text = text.canonical(TILES);
        let expected = "scene.kind = \"stack\"\nscene.bodies = 10\nscene.seed = 1\nrun.steps = 600\nrun.tiles = [3, 2]\n\
                        physics.hertz = 60.0\n";
        assert!(text.starts_with(expected), "{text}");
        // Six are of other scenes, and three of tiles that are not all equal.
        let what = KEYS.iter().filter(|key| key.concern == Concern::What).count();
        assert_eq!(text.lines().count(), what - 9, "{text}");
    }
}
