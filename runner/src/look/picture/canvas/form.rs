//! Shapes in pixels, and how much of each pixel they cover.

use crate::look::convex::to_convex;
use atoll_core::MOST_CORNERS;
use glam::DVec2;

/// Of turned rectangles whose shorter side is less than twice this, in pixels, each pixel is looked at in nine pieces: few pixels
/// make their area.
const SMALL: f64 = 5.0;

/// A shape on an image: coordinates in pixels, from the upper left corner, y downwards.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Form {
    /// A disc.
    Disc {
        /// Its center.
        center: [f64; 2],
        /// Its radius.
        radius: f64,
    },
    /// A rectangle, perhaps turned.
    Box {
        /// Its center.
        center: [f64; 2],
        /// The direction of its first axis, of length 1.
        axis: [f64; 2],
        /// Half its lengths along its axes.
        half: [f64; 2],
    },
    /// A rectangle whose corners are rounded.
    Plate {
        /// Its upper left corner.
        low: [f64; 2],
        /// Its lower right corner.
        high: [f64; 2],
        /// Of its corners.
        radius: f64,
    },
    /// What is within a distance of a convex polygon.
    Hull {
        /// Its corners, counter-clockwise where y is downwards: clockwise as one sees them.
        corners: [DVec2; MOST_CORNERS],
        /// How many there are.
        count: usize,
        /// The distance; negative: what is within the polygon and further from its outline.
        radius: f64,
    },
}

impl Form {
    /// A rectangle that is not turned.
    pub(crate) fn rectangle(low: [f64; 2], high: [f64; 2]) -> Self {
        let middle = |axis: usize| 0.5 * (low[axis] + high[axis]);
        let half = |axis: usize| 0.5 * (high[axis] - low[axis]);
        Self::Box { center: [middle(0), middle(1)], axis: [1.0, 0.0], half: [half(0), half(1)] }
    }

    /// A straight line of some width.
    pub(crate) fn line(from: [f64; 2], axis: [f64; 2], length: f64, width: f64) -> Self {
        let center = [from[0] + 0.5 * length * axis[0], from[1] + 0.5 * length * axis[1]];
        Self::Box { center, axis, half: [0.5 * length, 0.5 * width] }
    }

    /// The form whose outline lies so far outside of this one's, or inside, if negative.
    pub(crate) fn grown(&self, by: f64) -> Self {
        match *self {
            Self::Disc { center, radius } => Self::Disc { center, radius: (radius + by).max(0.0) },
            Self::Box { center, axis, half } => Self::Box { center, axis, half: half.map(|half| (half + by).max(0.0)) },
            Self::Plate { low, high, radius } => Self::Plate {
                low: low.map(|low| low - by),
                high: high.map(|high| high + by),
                radius: (radius + by).max(0.0),
            },
            Self::Hull { corners, count, radius } => Self::Hull { corners, count, radius: radius + by },
        }
    }

    /// Corners of a rectangle outside of which nothing is covered.
    pub(crate) fn bounds(&self) -> [[f64; 2]; 2] {
        let around = |[x, y]: [f64; 2], [half_x, half_y]: [f64; 2]| {
            [[x - half_x - 1.0, y - half_y - 1.0], [x + half_x + 1.0, y + half_y + 1.0]]
        };
        match *self {
            Self::Disc { center, radius } => around(center, [radius; 2]),
            Self::Box { center, axis: [c, s], half: [x, y] } => {
                around(center, [(c * x).abs() + (s * y).abs(), (s * x).abs() + (c * y).abs()])
            }
            Self::Plate { low, high, .. } => [low, high],
            Self::Hull { ref corners, count, radius } => {
                let [low, high] = [DVec2::min, DVec2::max].map(|pick| corners[..count].iter().copied().reduce(pick));
                let (low, high) = (low.unwrap_or_default(), high.unwrap_or_default());
                around((0.5 * (low + high)).to_array(), (0.5 * (high - low) + radius.max(0.0)).to_array())
            }
        }
    }

    /// How much of the pixel around a point is covered, from 0 to 1.
    pub(crate) fn coverage(&self, x: f64, y: f64) -> f64 {
        match *self {
            Self::Disc { center, radius } => {
                let (dx, dy) = (x - center[0], y - center[1]);
                // A ramp one pixel wide around the radius r has the area pi (r^2 + 1/12): too much for small discs.
                let squared = radius * radius - 1.0 / 12.0;
                if squared <= 0.0 {
                    return 0.0;
                }
                (0.5 + squared.sqrt() - (dx * dx + dy * dy).sqrt()).clamp(0.0, 1.0)
            }
            Self::Box { center, axis: [c, s], half } => {
                let part = |dx: f64, dy: f64, width: f64| {
                    overlap(c * dx + s * dy, half[0], width) * overlap(c * dy - s * dx, half[1], width)
                };
                let (dx, dy) = (x - center[0], y - center[1]);
                // As if the pixel were turned with the box: nearly exact over all pixels, and exact if it is not turned.
                if half[0].min(half[1]) > SMALL || c * s == 0.0 {
                    return part(dx, dy, 1.0);
                }
                let thirds = [-1.0 / 3.0, 0.0, 1.0 / 3.0];
                let row = |y: f64| thirds.iter().map(|x| part(dx + x, dy + y, 1.0 / 3.0)).sum::<f64>();
                thirds.iter().map(|y| row(*y)).sum::<f64>() / 9.0
            }
            Self::Plate { low, high, radius } => {
                let outside = |at: f64, low: f64, high: f64| (low + radius - at).max(at - high + radius);
                let (dx, dy) = (outside(x, low[0], high[0]), outside(y, low[1], high[1]));
                let corner = (dx.max(0.0) * dx.max(0.0) + dy.max(0.0) * dy.max(0.0)).sqrt();
                (0.5 + radius - corner - dx.max(dy).min(0.0)).clamp(0.0, 1.0)
            }
            Self::Hull { ref corners, count, radius } => {
                let point = DVec2::new(x, y);
                let within = radius - to_convex(&corners[..count], point);
                // Only near the outline is there something to look at closely.
                if within.abs() > 1.0 {
                    return if within > 0.0 { 1.0 } else { 0.0 };
                }
                let thirds = [-1.0 / 3.0, 0.0, 1.0 / 3.0];
                let part = |x: f64, y: f64| {
                    let within = radius - to_convex(&corners[..count], point + DVec2::new(x, y));
                    (0.5 + 3.0 * within).clamp(0.0, 1.0)
                };
                thirds.iter().map(|&y| thirds.iter().map(|&x| part(x, y)).sum::<f64>()).sum::<f64>() / 9.0
            }
        }
    }
}

/// The part of a length around a point that lies within `half` of zero.
#[inline]
fn overlap(at: f64, half: f64, length: f64) -> f64 {
    (((at + 0.5 * length).min(half) - (at - 0.5 * length).max(-half)) / length).clamp(0.0, 1.0)
}
