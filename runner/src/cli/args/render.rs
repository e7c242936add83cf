//! Options of `atoll render`.

use super::values::{ValueArgs, times};
use crate::look::picture::{ColorBy, View};
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use std::path::PathBuf;

/// What colors may tell.
const COLORS: [(&str, ColorBy); 7] = [
    ("kind", ColorBy::Kind),
    ("speed", ColorBy::Speed),
    ("spin", ColorBy::Spin),
    ("tile", ColorBy::Tile),
    ("rank", ColorBy::Rank),
    ("contacts", ColorBy::Contacts),
    ("asleep", ColorBy::Asleep),
];

/// Pixels along an edge.
const EDGES: std::ops::RangeInclusive<u32> = 16..=16_384;
/// Pixels in all.
const MOST_PIXELS: u64 = 1 << 26;

/// Options of `atoll render`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct RenderArgs {
    /// The folder of a run that was recorded, or a configuration, which is run only to be looked at.
    pub source: PathBuf,
    /// What to make, by its ending: a picture (.png), a film (.gif, .mp4, .webm), or a folder of pictures (no ending).
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Show what is there after so many steps; for a picture [default: the last].
    #[arg(long, value_name = "N", conflicts_with_all = ["every", "fps", "speed"])]
    pub step: Option<u64>,
    /// Width and height of a picture, in pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size, allow_hyphen_values = true)]
    pub(crate) size: [u32; 2],
    /// The part of the world to show: its low and its high corner, in m [default: all of it].
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = view, allow_hyphen_values = true, conflicts_with = "follow")]
    pub(crate) view: Option<View>,
    /// Keep the body of that name in the middle.
    #[arg(long, value_name = "ID")]
    pub follow: Option<u64>,
    /// How much of the world is shown around it from left to right, in m [default: 20 times its size].
    #[arg(long, value_name = "M", value_parser = width, requires = "follow")]
    pub width: Option<f64>,
    /// What colors tell; contacts and asleep only of a configuration.
    #[arg(long, value_name = "WHAT", default_value = "kind", value_parser = color())]
    pub(crate) color: ColorBy,
    /// Show the tiles, and which are of one rank; how many there are is for --set tiles=CxR to say.
    #[arg(long)]
    pub tiles: bool,
    /// Show the copies that tiles hold of their neighbours' bodies; of a configuration.
    #[arg(long)]
    pub ghosts: bool,
    /// Show where bodies touch, and how hard; of a configuration.
    #[arg(long)]
    pub contacts: bool,
    /// Draw nothing but the world: no legend, no time, no scale.
    #[arg(long)]
    pub bare: bool,
    /// A picture every so many steps of a film [default: each that was recorded; of a configuration as many as let it play in
    /// real time].
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u64).range(1..))]
    pub every: Option<u64>,
    /// Pictures in a second of a film: some are left out, or shown several times, so that it lasts as long [default: as many
    /// as there are, or 30 of a configuration].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=60))]
    pub fps: Option<u32>,
    /// Seconds of the world in a second of a film [default: 1, real time].
    #[arg(long, value_name = "X", value_parser = times)]
    pub speed: Option<f64>,
    /// What wins over the values of a configuration.
    #[command(flatten)]
    pub values: ValueArgs,
    /// Show no progress.
    #[arg(long)]
    pub quiet: bool,
}

fn color() -> impl TypedValueParser<Value = ColorBy> {
    let known = |name: String| COLORS.into_iter().find(|(known, _)| *known == name).expect("it is one of them").1;
    PossibleValuesParser::new(COLORS.map(|(name, _)| name)).map(known)
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let size = text.split_once('x').and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    let pixels = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
    let fits = |size: &[u32; 2]| size.iter().all(|edge| EDGES.contains(edge)) && pixels(*size) <= MOST_PIXELS;
    size.filter(fits).ok_or_else(|| {
        let (least, most) = EDGES.into_inner();
        format!("write WxH, such as 1920x1080, each from {least} to {most}, and at most {MOST_PIXELS} pixels in all")
    })
}

fn view(text: &str) -> Result<View, &'static str> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    let view = numbers.and_then(|numbers| <[f64; 4]>::try_from(numbers).ok()).map(View::from);
    // Wide enough that numbers tell its pixels apart.
    let is_told_apart = |view: &View| {
        let (size, far) = (view.high - view.low, view.low.abs().max(view.high.abs()));
        size.cmpgt(far * 1e-9).all()
    };
    view.filter(View::is_sound)
        .filter(is_told_apart)
        .ok_or("must be X0,Y0,X1,Y1 in m, X0 less than X1 and Y0 less than Y1, each side from 1e-6 to 1e13 m")
}

fn width(text: &str) -> Result<f64, &'static str> {
    let width = text.parse().ok().filter(|width: &f64| (1e-3..=1e9).contains(width));
    width.ok_or("must be a width in m, from 0.001 to 1e9")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::args::{Cli, Command, one_line};
    use clap::Parser;

    fn parse(line: &str) -> Result<RenderArgs, String> {
        match Cli::try_parse_from(["atoll", "render"].into_iter().chain(line.split_whitespace())) {
            Ok(Cli { command: Command::Render(args) }) => Ok(*args),
            Ok(_) => unreachable!("the verb is render"),
            Err(error) => Err(one_line(&error, ["render"])),
        }
    }

    #[test]
    fn what_is_shown_and_how_large() {
        let args = parse("runs/a --out a.png").unwrap();
        assert_eq!((args.size, args.color, args.step, args.fps), ([1280, 720], ColorBy::Kind, None, None));
        let args = parse("c.toml --out a --size 16x16384 --view -5,-1e3,5,2 --color asleep --tiles --ranks 2").unwrap();
        assert_eq!((args.size, args.color, args.tiles), ([16, 16384], ColorBy::Asleep, true));
        assert_eq!(args.view, Some(View::from([-5.0, -1000.0, 5.0, 2.0])));
        assert_eq!((args.values.first(), args.values.overrides().unwrap().len()), (Some("--ranks"), 1));
        let args = parse("c.toml --out a --follow 7 --width 0.5 --every 3 --fps 60").unwrap();
        assert_eq!((args.follow, args.width, args.every, args.fps), (Some(7), Some(0.5), Some(3), Some(60)));
    }

    #[test]
    fn what_cannot_be_shown_is_refused_in_one_line() {
        let size = "write WxH, such as 1920x1080, each from 16 to 16384, and at most 67108864 pixels in all; see";
        let view = "must be X0,Y0,X1,Y1 in m, X0 less than X1 and Y0 less than Y1, each side from 1e-6 to 1e13 m; see";
        for (options, expected) in [
            ("--size 0x720", size),
            ("--size 1280", size),
            ("--size 16384x16384", size),
            ("--size -16x16", size),
            ("--view 0,0,0,1", view),
            ("--view 1,0,0,1", view),
            ("--view 0,0,1", view),
            ("--view 0,0,1e-320,1e-320", view),
            ("--view 0,0,inf,1", view),
            ("--view nan,0,1,1", view),
            ("--view 1e9,0,1000000000.001,1", view),
            ("--view -1e308,-1e308,1e308,1e308", view),
            ("--view 0,0,1,1 --follow 3", "'--view <X0,Y0,X1,Y1>' cannot be used with '--follow <ID>'; see"),
            ("--width 3", "the following required arguments were not provided: --follow <ID>; see"),
            ("--follow 3 --width 0", "must be a width in m, from 0.001 to 1e9; see"),
            ("--follow -3", "invalid digit found in string; see"),
            ("--every 0", "0 is not in 1..18446744073709551615; see"),
            ("--fps 0", "0 is not in 1..=60; see"),
            ("--speed 0", "must be seconds of the world in one, from 0.001 to 1e6; see"),
            ("--step 3 --every 3", "'--step <N>' cannot be used with '--every <K>'; see"),
            (
                "--color pink",
                "[possible values: kind, speed, spin, tile, rank, contacts, asleep]; a similar value exists: 'spin'; see",
            ),
        ] {
            let error = parse(&format!("runs/a --out a.png {options}")).unwrap_err();
            assert!(error.contains(expected) && !error.contains('\n'), "{options}: {error}");
        }
        assert!(parse("runs/a").unwrap_err().contains("--out <FILE>"));
    }
}
