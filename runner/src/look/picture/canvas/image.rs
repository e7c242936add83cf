//! What comes of drawing.

/// A picture: three bytes a pixel, red, green and blue, rows from the top.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Image {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Steps made when what it shows was there.
    pub step: u64,
    /// Its pixels.
    pub pixels: Vec<u8>,
}

/// A color: red, green and blue.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Rgb(pub [u8; 3]);

impl Rgb {
    /// The color that is written `#rrggbb`.
    pub(crate) const fn hex(value: u32) -> Self {
        Self([(value >> 16) as u8, (value >> 8) as u8, value as u8])
    }

    /// Between this color, at 0, and another, at 1.
    pub(crate) fn mix(self, other: Self, part: f32) -> Self {
        let mix = |a: u8, b: u8| (f32::from(a) + (f32::from(b) - f32::from(a)) * part + 0.5) as u8;
        let ([r, g, b], [to_r, to_g, to_b]) = (self.0, other.0);
        Self([mix(r, to_r), mix(g, to_g), mix(b, to_b)])
    }

    /// As it is in a shadow: what outlines a shape of this color.
    pub(crate) fn darker(self) -> Self {
        self.mix(Self([0; 3]), 0.35)
    }
}
