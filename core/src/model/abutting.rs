//! Pieces of a body that lie side by side, with a whole face in common, are one where they are convex together: what slides over them, or
//! rolls, meets no seam.

use super::piece::Piece;
use super::shape::MOST_CORNERS;
use glam::Vec2;

/// Corners are one, and on a line, that are not further from it than this part of how far the pieces reach.
const SAME: f64 = 1e-5;

/// Joins two of the pieces as long as there are such.
pub(super) fn join_abutting(pieces: &mut Vec<Piece>) {
    let mut joined = true;
    while joined {
        joined = false;
        let mut first = 0;
        while first < pieces.len() {
            let mut other = first + 1;
            while other < pieces.len() {
                if let Some(both) = together(&pieces[first], &pieces[other]) {
                    pieces[first] = both;
                    pieces.remove(other);
                    (joined, other) = (true, first + 1);
                } else {
                    other += 1;
                }
            }
            first += 1;
        }
    }
}

/// Two pieces as one, if they have a face in common and are convex together.
fn together(one: &Piece, other: &Piece) -> Option<Piece> {
    let is_sharp = |piece: &Piece| piece.radius == 0.0 && piece.has_faces();
    if !(is_sharp(one) && is_sharp(other)) {
        return None;
    }
    let near = SAME * f64::from(one.half_extents().max(other.half_extents()).max_element());
    let are_one = |a: Vec2, b: Vec2| a.as_dvec2().distance(b.as_dvec2()) <= near;
    let are_one_face = |&(i, j): &(usize, usize)| {
        let ([from, to], [other_from, other_to]) = (one.outline.edge(i), other.outline.edge(j));
        are_one(from, other_to) && are_one(to, other_from)
    };
    let mut faces = (0..one.outline.count()).flat_map(|i| (0..other.outline.count()).map(move |j| (i, j)));
    let (i, j) = faces.find(are_one_face)?;
    let [one, other] = [one, other].map(|piece| piece.outline.corners().collect::<Vec<Vec2>>());
    // Around the first from behind the face that they have in common to its beginning, and around the other, but for that face.
    let around = (1..=one.len()).map(|k| one[(i + k) % one.len()]);
    let around: Vec<Vec2> = around.chain((2..other.len()).map(|k| other[(j + k) % other.len()])).collect();
    // How far a corner juts out of the line from the one before to the one behind it.
    let juts = |k: usize| {
        let [before, corner, behind] = [around.len() - 1, 0, 1].map(|by| around[(k + by) % around.len()].as_dvec2());
        (corner - before).perp_dot(behind - before) / behind.distance(before)
    };
    let ends = [0, one.len() - 1];
    if ends.iter().any(|&end| juts(end) < -near) {
        return None;
    }
    let is_corner = |k: usize| !ends.contains(&k) || juts(k) > near;
    let corners: Vec<Vec2> = (0..around.len()).filter(|&k| is_corner(k)).map(|k| around[k]).collect();
    (3..=MOST_CORNERS).contains(&corners.len()).then(|| Piece::new(&corners, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rot;
    use crate::model::piece::pieces;
    use crate::model::shape::{Compound, Part, Polygon, Shape};
    use glam::DVec2;

    fn boxes(places: &[[f32; 4]], turned: f32) -> Vec<Piece> {
        let rotation = Rot::from_angle(turned);
        let part = |&[x, y, width, height]: &[f32; 4]| Part {
            shape: Shape::rectangle(width, height),
            position: rotation.rotate(Vec2::new(x, y)),
            rotation,
        };
        let (compound, _) = Compound::new(places.iter().map(part).collect()).unwrap();
        pieces(&Shape::Compound(compound)).to_vec()
    }

    #[test]
    fn boxes_side_by_side_are_one_where_they_are_convex_together() {
        for turned in [0.0, 0.3, 2.0] {
            let count = |places: &[[f32; 4]]| boxes(places, turned).len();
            let row: Vec<[f32; 4]> = (0..101).map(|i| [0.1 * i as f32, 0.3, 0.1, 0.2]).collect();
            let [only] = &boxes(&row, turned)[..] else { panic!("{} pieces of a row", count(&row)) };
            assert_eq!(only.outline.count(), 4);
            let [low, high] = only.outline.bounds(Rot::from_angle(-turned));
            assert!((high - low - Vec2::new(10.1, 0.2)).abs().max_element() < 1e-4, "{low} to {high}");
            let grid: Vec<[f32; 4]> = (0..9).map(|i| [(i % 3) as f32, (i / 3) as f32, 1.0, 1.0]).collect();
            assert_eq!(count(&grid), 1);
            // An L, a T, two that overlap, and two with a gap between them.
            assert_eq!(count(&[[0.0, 0.0, 2.0, 1.0], [-0.5, 1.0, 1.0, 1.0]]), 2);
            assert_eq!(count(&[[0.0, 0.0, 3.0, 1.0], [0.0, -1.0, 1.0, 1.0]]), 2);
            assert_eq!(count(&[[0.0, 0.0, 1.0, 1.0], [0.9, 0.0, 1.0, 1.0]]), 2);
            assert_eq!(count(&[[0.0, 0.0, 1.0, 1.0], [1.001, 0.0, 1.0, 1.0]]), 2);
        }
    }

    #[test]
    fn polygons_keep_the_corners_that_jut_out() {
        let half = |sign: f32| {
            let corners = [(0.0, -1.0), (1.0, -0.5), (1.0, 0.5), (0.0, 1.0)].map(|(x, y)| Vec2::new(sign * x, y));
            let (polygon, center) = Polygon::hull(&corners, 0.0).unwrap();
            Part { shape: Shape::Polygon(polygon), position: center, rotation: Rot::IDENTITY }
        };
        let (compound, _) = Compound::new(vec![half(1.0), half(-1.0)]).unwrap();
        let hexagon = pieces(&Shape::Compound(compound));
        assert_eq!((hexagon.len(), hexagon[0].outline.count()), (1, 6));
        let corners: Vec<DVec2> = hexagon[0].outline.corners().map(Vec2::as_dvec2).collect();
        let area: f64 = (0..6).map(|k| 0.5 * corners[k].perp_dot(corners[(k + 1) % 6])).sum();
        assert!((area - 3.0).abs() < 1e-5, "{area} m^2");
        let normals = hexagon[0].outline.normals().map(|normal| normal.length());
        assert!(normals.into_iter().all(|length| (length - 1.0).abs() < 1e-6));
    }
}
