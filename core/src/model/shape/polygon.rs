//! Convex polygons with a rounding: also capsules, and boxes with round corners.

use super::ShapeError;
use super::mass::Mass;
use glam::{DVec2, Vec2};

/// A polygon has no more corners than this.
pub const MOST_CORNERS: usize = 8;

/// Corners nearer to the line through their neighbours than this part of the polygon's size are none.
const FLAT: f64 = 1e-4;

/// The middle of what lies around its center of mass, as part of its size, at most.
const CENTERED: f64 = 1e-5;

/// A convex polygon around its center of mass and all that is within its radius: two corners make a capsule.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Polygon {
    corners: [Vec2; MOST_CORNERS],
    count: usize,
    radius: f32,
}

impl Polygon {
    /// The convex hull of some points, with a rounding around it, both in meters: moved so that its center of mass lies at the
    /// origin, and where that was. Two points make a capsule. What lies around its center of mass already stays where it is.
    ///
    /// Source of the hull: A. Andrew, "Another efficient algorithm for convex hulls in two dimensions", 1979.
    ///
    /// # Errors
    /// If the points are not finite, make no area with the rounding, or more than [`MOST_CORNERS`] corners.
    pub fn hull(points: &[Vec2], radius: f32) -> Result<(Self, Vec2), ShapeError> {
        if !(points.iter().all(|point| point.is_finite()) && radius >= 0.0 && radius.is_finite()) {
            return Err(ShapeError::NotFinite);
        }
        let corners = hull(points);
        if corners.len() > MOST_CORNERS {
            return Err(ShapeError::Corners { count: corners.len() });
        }
        let size = size(&corners);
        match corners.len() {
            2 if f64::from(radius) > FLAT * size => {}
            2 if radius > 0.0 => return Err(ShapeError::Thin),
            0..=2 => return Err(ShapeError::Flat),
            _ => {}
        }
        let center = Mass::of_rounded(&corners, radius.into()).center;
        let center = if center.length() <= CENTERED * size { DVec2::ZERO } else { center };
        let mut polygon = Self { corners: [Vec2::ZERO; MOST_CORNERS], count: corners.len(), radius };
        for (corner, from) in polygon.corners.iter_mut().zip(&corners) {
            *corner = (*from - center).as_vec2();
        }
        Ok((polygon, center.as_vec2()))
    }

    /// The corners, counter-clockwise, around the center of mass, in meters.
    pub fn corners(&self) -> &[Vec2] {
        &self.corners[..self.count]
    }

    /// How far around them it reaches, in meters.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    pub(crate) fn mass(&self) -> Mass {
        let mut corners = [DVec2::ZERO; MOST_CORNERS];
        corners.iter_mut().zip(self.corners()).for_each(|(to, from)| *to = from.as_dvec2());
        Mass::of_rounded(&corners[..self.count], self.radius.into())
    }
}

/// The greatest distance along an axis.
fn size(points: &[DVec2]) -> f64 {
    let (low, high) = points
        .iter()
        .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), &point| (low.min(point), high.max(point)));
    (high - low).max_element().max(0.0)
}

/// The corners of the hull, counter-clockwise, from the leftmost on; without those that are hardly corners.
fn hull(points: &[Vec2]) -> Vec<DVec2> {
    let mut points: Vec<DVec2> = points.iter().map(|point| point.as_dvec2()).collect();
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let least = FLAT * size(&points);
    let chain = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut side: Vec<DVec2> = Vec::new();
        for point in points {
            while let [.., before, last] = side[..]
                && (last - before).perp_dot(point - before) <= 0.0
            {
                side.pop();
            }
            side.push(point);
        }
        side.pop();
        side
    };
    let mut corners = chain(&mut points.iter().copied());
    corners.extend(chain(&mut points.iter().rev().copied()));
    if corners.is_empty() {
        return points;
    }
    // The least of corners goes, as long as it is hardly one.
    while corners.len() > 2 {
        let count = corners.len();
        let height = |i: usize| {
            let (before, after) = (corners[(i + count - 1) % count], corners[(i + 1) % count]);
            let base = after - before;
            let offset = corners[i] - before;
            if base == DVec2::ZERO { offset.length() } else { base.perp_dot(offset).abs() / base.length() }
        };
        let (flattest, height) =
            (0..count).map(|i| (i, height(i))).min_by(|a, b| a.1.total_cmp(&b.1)).expect("there are corners");
        if height > least {
            break;
        }
        corners.remove(flattest);
    }
    // That may have been the leftmost.
    let place = |i: &usize| (corners[*i].x, corners[*i].y);
    let leftmost = (0..corners.len()).min_by(|a, b| place(a).partial_cmp(&place(b)).expect("numbers"));
    corners.rotate_left(leftmost.unwrap_or(0));
    corners
}
