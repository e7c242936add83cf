//! How far it is to a convex polygon.

use glam::DVec2;

/// From a point to the outline of a convex polygon, negative within. Its corners go round counter-clockwise; one makes a point, two a
/// line.
pub(crate) fn to_convex(corners: &[DVec2], point: DVec2) -> f64 {
    let count = corners.len();
    let (mut nearest, mut deepest) = (f64::INFINITY, f64::NEG_INFINITY);
    for (i, &from) in corners.iter().enumerate() {
        let (edge, away) = (corners[(i + 1) % count] - from, point - from);
        let length = edge.length_squared();
        let part = if length > 0.0 { (away.dot(edge) / length).clamp(0.0, 1.0) } else { 0.0 };
        nearest = nearest.min((away - edge * part).length_squared());
        deepest = deepest.max(away.perp_dot(edge) / length.sqrt());
    }
    let is_within = count > 2 && deepest < 0.0;
    if is_within { deepest } else { nearest.sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_that_a_ruler_tells() {
        let square = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)].map(|(x, y)| DVec2::new(x, y));
        for (corners, x, y, expected) in [
            (&square[..], 1.0, 0.5, -0.5),
            (&square, 1.0, 1.0, -1.0),
            (&square, 3.0, 1.0, 1.0),
            (&square, 5.0, 6.0, 5.0),
            (&square, 2.0, 1.0, 0.0),
            (&square[..2], 1.0, -3.0, 3.0),
            (&square[..2], 1.0, 3.0, 3.0),
            (&square[..2], -3.0, 4.0, 5.0),
            (&square[..1], 3.0, 4.0, 5.0),
        ] {
            let found = to_convex(corners, DVec2::new(x, y));
            assert!((found - expected).abs() < 1e-12, "{corners:?}, {x}, {y}: {found}");
        }
    }
}
