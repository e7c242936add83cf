//! What a page and the server tell each other over their socket.
//!
//! The page sends [`Wish`]es, as JSON. The server sends what it has to [`Say`], as JSON, and frames, as bytes, which
//! `page/frame.js` reads. A frame is, little-endian:
//!
//! | bytes | |
//! |---|---|
//! | u32 x 4 | [`MAGIC`]; source; number of the frame, which the page acknowledges; step |
//! | f64 | time, s |
//! | f64 x 4 | rectangle that the positions below are fractions of: low x, low y, high x, high y, m |
//! | u32 x 2 | width and height of the density image, 0 if there is none |
//! | f64 x 4 | rectangle of the density image |
//! | f64 x 2 | position of the body that was picked, m; not a number if there is none |
//! | u32 x 2 | bodies; bytes of the legend |
//! | | the legend, as JSON, with spaces up to a multiple of 4 bytes |
//! | u8 x 4 each | the density image, rows from the top: red, green, blue, multiplied by what they cover, and that |
//! | 12 bytes each | bodies: [`Dot`] |

use super::super::picture::{ColorBy, View};
use crate::folder::in_letters;
use crate::scene::record::PathText;
use atoll_core::{Partition, Region, TileId};
use bytemuck::{Pod, Zeroable};
use glam::DVec2;
use serde::{Deserialize, Serialize};

/// The first word of a frame: `ATOL`.
const MAGIC: u32 = u32::from_le_bytes(*b"ATOL");

/// The most pixels that a page may ask for on one side.
const MOST_SIDE: u32 = 8192;
/// The most pixels that a page may ask for. `page/view.js` asks for no more.
const MOST_PIXELS: u32 = 1 << 24;

/// What a page wants.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(tag = "do", rename_all = "lowercase", deny_unknown_fields)]
pub(crate) enum Wish {
    /// To see this from now on.
    Look {
        /// Low x, low y, high x, high y, in m.
        view: View,
        /// Width and height in pixels.
        size: [u32; 2],
        /// What the colors tell.
        color: ColorBy,
    },
    /// The next frame: this one was drawn.
    Ack {
        /// Its number.
        frame: u32,
    },
    /// That time goes on.
    Play,
    /// That it stands still.
    Pause,
    /// That it stands still after so many steps, or records, more or less.
    Step {
        /// How many.
        by: i32,
    },
    /// The last record that is not after a step.
    Seek {
        /// The step.
        step: u64,
    },
    /// So many seconds in a second; 0: as many as can be.
    Speed {
        /// How many.
        times: f64,
    },
    /// To know about the body that is there.
    Pick {
        /// Which of the worlds that are shown.
        source: u32,
        /// Where, in m.
        at: [f64; 2],
    },
    /// To know no more about it.
    Drop,
    /// That something is done to the world before its next step.
    Command {
        /// As a line of a file of commands, which need not say when.
        line: String,
    },
}

impl Wish {
    /// Reads a message. None if it makes no sense.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let wish = serde_json::from_str(text).ok()?;
        let sound = match &wish {
            Self::Look { view, size, .. } => {
                let pixels = |side: &u32| (1..=MOST_SIDE).contains(side);
                view.is_sound() && size.iter().all(pixels) && size[0] * size[1] <= MOST_PIXELS
            }
            Self::Speed { times } => (0.0..=1e6).contains(times),
            Self::Pick { at, .. } => at.iter().all(|x| x.is_finite()),
            _ => true,
        };
        sound.then_some(wish)
    }
}

/// What a page looks at.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) struct Gaze {
    /// The rectangle.
    pub view: View,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// What the colors tell.
    pub color: ColorBy,
    /// What is too small to be drawn as what it is, is drawn in pixels so many times as wide and high.
    pub coarseness: u32,
}

/// What the server has to say.
#[derive(Clone, PartialEq, Debug, Serialize)]
#[serde(tag = "type", rename_all = "lowercase")]
pub(crate) enum Say {
    /// What is shown, first of all.
    Hello(Hello),
    /// How time goes on from now on.
    Pace {
        /// Whether it does.
        playing: bool,
        /// Seconds in a second; 0: as many as can be.
        times: f64,
    },
    /// How it goes.
    Figures {
        /// Names and values.
        figures: Vec<(&'static str, String)>,
        /// Milliseconds of a step in each phase.
        phases: Vec<(&'static str, f64)>,
        /// For each rank the part of its time in which it did not wait, 0 to 1.
        busy: Vec<f64>,
    },
    /// The body that was picked, or that there is none.
    Body {
        /// It.
        body: Option<PickedBody>,
    },
    /// Tiles of the worlds are others than before, or held by other ranks.
    Tiles {
        /// Of each world.
        worlds: Vec<Tiles>,
    },
    /// There are more kinds than before, in all of these shapes.
    Shapes {
        /// As [`Source::shapes`].
        shapes: Vec<Outline>,
    },
    /// What whoever looks may want to know: that a command is refused, and why.
    Note {
        /// A sentence.
        text: String,
    },
    /// The run has failed, or a record cannot be shown.
    Failed {
        /// Why.
        why: String,
    },
    /// Nothing more will be shown.
    Over,
    /// The first record in which two worlds differ, or that there is none.
    Difference {
        /// Its step.
        step: Option<u64>,
    },
}

/// What stays as it is while a page looks.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct Hello {
    /// The worlds, one or two.
    pub sources: Vec<Source>,
    /// Whether they are recorded, and not run just now.
    pub recorded: bool,
    /// The steps of the records, those that all worlds have.
    pub steps: Vec<u64>,
    /// The last step of the run.
    pub last_step: u64,
    /// What colors can tell.
    pub colors: Vec<ColorBy>,
    /// Colors of ranks, which repeat.
    pub rank_colors: Vec<[u8; 3]>,
    /// The color of what never moves.
    pub static_color: [u8; 3],
}

/// A world.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct Source {
    /// What it is called.
    pub name: String,
    /// How many records there are of it, also those of steps that the other world has none of.
    pub records: usize,
    /// Steps a second.
    pub hertz: f64,
    /// Low x, low y, high x, high y, in m.
    pub domain: [f64; 4],
    /// Columns and rows of tiles, or of the squares that they are cut from.
    pub tiles: [u32; 2],
    /// Those that it has when the page comes.
    #[serde(flatten)]
    pub held: Tiles,
    /// Of each kind.
    pub shapes: Vec<Outline>,
    /// Those that statics have, each once.
    pub static_shapes: Vec<Outline>,
    /// What never moves, or as its path has it.
    pub statics: Vec<Fixed>,
}

/// The outline of a kind, in m.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct Outline {
    /// What the scene calls it, or else what it is, and how large.
    pub name: String,
    /// Half width, half height and radius: of a circle the last, of a box the first two; of any other how far it reaches along its axes,
    /// and half of how wide it is where it is narrowest.
    pub size: [f32; 3],
    /// Whether what is inside shows through.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub sensor: bool,
    /// Of any other its convex parts: x and y of each corner, counter-clockwise, and how far it reaches around them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<(Vec<[f32; 2]>, f32)>,
}

/// A static.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct Fixed {
    /// x, y in m, cosine and sine of how it is turned: of one that moves, where it begins.
    pub at: [f64; 4],
    /// Row of [`Source::static_shapes`].
    pub shape: u32,
    /// How it moves, if it does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub path: Option<PathText>,
}

/// The tiles of a world.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct Tiles {
    /// How often each was cut from its square, a letter for each, if squares were cut.
    pub levels: Option<String>,
    /// The low and the high corner of each, as parts of the domain, if their borders move.
    pub corners: Option<Vec<[f32; 4]>>,
    /// For each tile its rank.
    pub rank_of_tile: Vec<u32>,
}

impl Tiles {
    pub(crate) fn new(partition: &Partition, rank_of_tile: Vec<u32>) -> Self {
        let corners = |tile| {
            let (Region { min, max }, size) = (partition.rectangle(TileId(tile)), partition.max() - partition.min());
            let [low, high] = [min, max].map(|corner| ((corner - partition.min()) / size).as_vec2());
            [low.x, low.y, high.x, high.y]
        };
        let corners = partition.cuts().map(|_| (0..partition.tiles() as u32).map(corners).collect());
        Self { levels: partition.levels().and_then(|_| in_letters(partition)), corners, rank_of_tile }
    }
}

/// What there is to know about a body.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct PickedBody {
    /// In which of the worlds it is.
    pub source: u32,
    /// Where it is, in m.
    pub at: [f64; 2],
    /// Its name, as text: not every number of 64 bits is one in a page.
    pub id: String,
    /// Names and values.
    pub figures: Vec<(&'static str, String)>,
}

/// A body as a page gets it.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Dot {
    /// Position: 0 is the low and 65,535 the high side of the frame's rectangle.
    pub place: [u16; 2],
    /// 65,536 is a whole turn.
    pub angle: u16,
    /// Row of [`Source::shapes`].
    pub shape: u16,
    /// Red, green, blue.
    pub color: [u8; 3],
    /// The same row, divided by 65,536.
    pub shape_high: u8,
}

/// A frame before it becomes bytes.
#[derive(Clone, Debug)]
pub(crate) struct Picture<'a> {
    /// Of which of the worlds.
    pub source: u32,
    /// Number of the frame.
    pub number: u32,
    /// Steps made.
    pub step: u64,
    /// Time, in s.
    pub time: f64,
    /// What positions are fractions of.
    pub rectangle: View,
    /// Width and height of the density image, and the rectangle it covers.
    pub density: ([u32; 2], View),
    /// Position of the body that was picked.
    pub picked: Option<DVec2>,
    /// As JSON.
    pub legend: &'a str,
    /// Of the density image, four bytes each.
    pub pixels: &'a [u8],
    /// The bodies, [`Dot`]s as bytes, perhaps in several parts.
    pub dots: &'a [&'a [u8]],
}

impl Picture<'_> {
    /// As the page reads it.
    pub(crate) fn encode(&self) -> Vec<u8> {
        let padding = self.legend.len().next_multiple_of(4) - self.legend.len();
        let bodies = self.dots.iter().map(|part| part.len()).sum::<usize>() / size_of::<Dot>();
        let mut bytes = Vec::with_capacity(120 + self.legend.len() + padding + self.pixels.len() + 12 * bodies);
        let words = |bytes: &mut Vec<u8>, words: &[u32]| words.iter().for_each(|word| bytes.extend(word.to_le_bytes()));
        let doubles = |bytes: &mut Vec<u8>, of: &[f64]| of.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        words(&mut bytes, &[MAGIC, self.source, self.number, self.step as u32]);
        doubles(&mut bytes, &[self.time]);
        doubles(&mut bytes, &<[f64; 4]>::from(self.rectangle));
        words(&mut bytes, &self.density.0);
        doubles(&mut bytes, &<[f64; 4]>::from(self.density.1));
        doubles(&mut bytes, &self.picked.unwrap_or(DVec2::NAN).to_array());
        words(&mut bytes, &[bodies as u32, (self.legend.len() + padding) as u32]);
        bytes.extend_from_slice(self.legend.as_bytes());
        bytes.extend(std::iter::repeat_n(b' ', padding));
        bytes.extend_from_slice(self.pixels);
        self.dots.iter().for_each(|part| bytes.extend_from_slice(part));
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wishes_that_make_no_sense_are_none() {
        let look = |view: &str, size: &str| format!(r#"{{"do":"look","view":{view},"size":{size},"color":"speed"}}"#);
        let wish = Wish::parse(&look("[0,-1,2.5,1]", "[640,480]")).unwrap();
        assert_eq!(wish, Wish::Look { view: [0.0, -1.0, 2.5, 1.0].into(), size: [640, 480], color: ColorBy::Speed });
        assert_eq!(Wish::parse(r#"{"do":"step","by":-1}"#), Some(Wish::Step { by: -1 }));
        for text in [
            &look("[0,0,0,1]", "[640,480]"),
            &look("[0,0,1e300,1e300]", "[640,480]"),
            &look("[2,0,1,1]", "[640,480]"),
            &look("[0,0,1,1]", "[0,480]"),
            &look("[0,0,1,1]", "[640,100000]"),
            &look("[0,0,1,1]", "[8192,8192]"),
            &look("[0,0,1]", "[640,480]"),
            r#"{"do":"speed","times":-1}"#,
            r#"{"do":"pick","source":0,"at":[1e999,0]}"#,
            r#"{"do":"ack","frame":-1}"#,
            r#"{"do":"ack","frame":1,"more":2}"#,
            r#"{"do":"fly"}"#,
            r#"["do"]"#,
            "",
        ] {
            assert_eq!(Wish::parse(text), None, "{text}");
        }
    }

    #[test]
    fn a_frame_lies_as_the_page_reads_it() {
        let view = |x: f64| View { low: DVec2::splat(x), high: DVec2::splat(x + 1.0) };
        let dot = Dot { place: [0x0201, 0x0403], angle: 0x0605, shape: 0x0807, color: [9, 10, 11], shape_high: 12 };
        let frame = Picture {
            source: 1,
            number: 7,
            step: 60,
            time: 1.0,
            rectangle: view(2.0),
            density: ([1, 2], view(4.0)),
            picked: None,
            legend: "{}\n",
            pixels: &[1, 2, 3, 4, 5, 6, 7, 8],
            dots: &[bytemuck::bytes_of(&dot), &[], bytemuck::bytes_of(&dot)],
        };
        let bytes = frame.encode();
        assert_eq!(bytes.len(), 120 + 4 + 8 + 24);
        let double = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        assert_eq!(&bytes[..16], b"ATOL\x01\0\0\0\x07\0\0\0\x3c\0\0\0");
        assert_eq!([16, 24, 48, 64, 88].map(double), [1.0, 2.0, 3.0, 4.0, 5.0]);
        assert!(double(96).is_nan() && double(104).is_nan());
        assert_eq!(&bytes[112..132], b"\x02\0\0\0\x04\0\0\0{}\n \x01\x02\x03\x04\x05\x06\x07\x08");
        assert_eq!(&bytes[132..144], &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]);
    }
}
