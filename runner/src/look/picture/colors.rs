//! The colors of pictures: dark upon light, and told apart by people who see colors differently.

use super::canvas::Rgb;

/// Where nothing is.
pub(super) const PAPER: Rgb = Rgb::hex(0xFFFFFF);
/// Beside what is looked at.
pub(super) const MARGIN: Rgb = Rgb::hex(0xEEF0F3);
/// What never moves.
pub(crate) const STATIC: Rgb = Rgb::hex(0x59636E);
/// Letters and lines.
pub(super) const INK: Rgb = Rgb::hex(0x1F2933);
/// Letters that matter less.
pub(super) const FAINT: Rgb = Rgb::hex(0x5B6772);
/// Around what ghosts copy.
pub(super) const GHOST: Rgb = Rgb::hex(0x8E24AA);
/// Awake, and asleep.
pub(super) const AWAKE: Rgb = Rgb::hex(0xE0702F);
/// See [`AWAKE`].
pub(super) const ASLEEP: Rgb = Rgb::hex(0x5D7FA8);
/// What cannot be told.
pub(super) const UNKNOWN: Rgb = Rgb::hex(0x9AA3AD);

/// For things with numbers, of which one must not be taken for another: kinds, ranks.
const DISTINCT: [Rgb; 10] = [
    Rgb::hex(0x2F74B5),
    Rgb::hex(0xD94B36),
    Rgb::hex(0x1B9E77),
    Rgb::hex(0xE6A117),
    Rgb::hex(0x7D56A8),
    Rgb::hex(0x35B1D6),
    Rgb::hex(0xC2478D),
    Rgb::hex(0x7A8B21),
    Rgb::hex(0x8C564B),
    Rgb::hex(0x3D4C7A),
];

/// The color of the thing with that number. After ten they begin anew, paler, and after twenty darker.
pub(super) fn distinct(number: u32) -> Rgb {
    let color = DISTINCT[number as usize % DISTINCT.len()];
    match number as usize / DISTINCT.len() % 3 {
        0 => color,
        1 => color.mix(PAPER, 0.45),
        _ => color.darker(),
    }
}

/// The color of a tile: another than those of its eight neighbours.
pub(super) fn tile(column: usize, row: usize) -> Rgb {
    DISTINCT[(column + 2 * row) % 5]
}

/// A scale of colors, from its first to its last.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Scale {
    /// From nothing to much: the map plasma of matplotlib, without its brightest part, which paper outshines.
    Amount,
    /// From one way through nothing to the other way.
    Ways,
}

impl Scale {
    /// The color so far along the scale, from 0 to 1.
    pub(crate) fn at(self, part: f32) -> Rgb {
        let stops: &[u32] = match self {
            Self::Amount => &[0x2A0F91, 0x4C02A1, 0x7E03A8, 0xAA2395, 0xCC4778, 0xE66C5C, 0xF89540, 0xFDB830],
            Self::Ways => &[0x0B3C8C, 0x2F7BC0, 0x86AFCB, 0xABB0B5, 0xD9A08A, 0xCF4F3E, 0x8E1024],
        };
        let last = stops.len() - 1;
        let along = part.clamp(0.0, 1.0) * last as f32;
        let stop = (along as usize).min(last - 1);
        Rgb::hex(stops[stop]).mix(Rgb::hex(stops[stop + 1]), along - stop as f32)
    }

    /// So many colors along the scale, to be looked up.
    pub(super) fn table(self) -> Vec<Rgb> {
        (0..=255_u8).map(|i| self.at(f32::from(i) / 255.0)).collect()
    }
}
