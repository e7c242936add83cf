//! Convex polygons in columns, so that all faces, or all corners, are looked at at once.

use crate::model::math::{Rot, dot, max, min};
use crate::model::shape::MOST_CORNERS;
use glam::Vec2;
use std::array::from_fn;

/// Corners, counter-clockwise, and the normal out of the face from each to the next. Two corners make a line, one a point. Places that
/// are left over repeat the last.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Convex {
    x: [f32; MOST_CORNERS],
    y: [f32; MOST_CORNERS],
    normal_x: [f32; MOST_CORNERS],
    normal_y: [f32; MOST_CORNERS],
    count: usize,
}

impl Convex {
    /// As many normals as corners, one to eight.
    pub(crate) fn new(corners: &[Vec2], normals: &[Vec2]) -> Self {
        let last = corners.len() - 1;
        let column = |of: &[Vec2], axis: usize| from_fn(|i| of[i.min(last)][axis]);
        Self {
            x: column(corners, 0),
            y: column(corners, 1),
            normal_x: column(normals, 0),
            normal_y: column(normals, 1),
            count: corners.len(),
        }
    }

    /// The same, turned and then moved.
    #[inline(always)]
    pub(crate) fn seen(&self, Rot { c, s }: Rot, offset: Vec2) -> Self {
        Self {
            x: from_fn(|i| offset.x + (c * self.x[i] - s * self.y[i])),
            y: from_fn(|i| offset.y + (s * self.x[i] + c * self.y[i])),
            normal_x: from_fn(|i| c * self.normal_x[i] - s * self.normal_y[i]),
            normal_y: from_fn(|i| s * self.normal_x[i] + c * self.normal_y[i]),
            count: self.count,
        }
    }

    /// Columns by four: x and y of the corners, x and y of the normals, each of the first four and of the others.
    #[inline(always)]
    pub(crate) fn quads(&self) -> [[f32; 4]; MOST_CORNERS] {
        let halves = |column: &[f32; MOST_CORNERS]| -> [[f32; 4]; 2] { bytemuck::cast(*column) };
        let ([a, b], [c, d]) = (halves(&self.x), halves(&self.y));
        let ([e, f], [g, h]) = (halves(&self.normal_x), halves(&self.normal_y));
        [a, b, c, d, e, f, g, h]
    }

    #[inline(always)]
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    #[inline(always)]
    pub(crate) fn corner(&self, number: usize) -> Vec2 {
        Vec2::new(self.x[number], self.y[number])
    }

    #[inline(always)]
    pub(crate) fn normal(&self, face: usize) -> Vec2 {
        Vec2::new(self.normal_x[face], self.normal_y[face])
    }

    pub(crate) fn corners(&self) -> impl ExactSizeIterator<Item = Vec2> + Clone + '_ {
        (0..self.count).map(|number| self.corner(number))
    }

    pub(crate) fn normals(&self) -> impl ExactSizeIterator<Item = Vec2> + Clone + '_ {
        (0..self.count).map(|face| self.normal(face))
    }

    /// Low and high corner of an upright rectangle around it, when it is turned so.
    #[inline(always)]
    pub(crate) fn bounds(&self, Rot { c, s }: Rot) -> [Vec2; 2] {
        let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for i in 0..MOST_CORNERS {
            let (x, y) = (c * self.x[i] - s * self.y[i], s * self.x[i] + c * self.y[i]);
            (low.x, low.y) = (min(x, low.x), min(y, low.y));
            (high.x, high.y) = (max(x, high.x), max(y, high.y));
        }
        [low, high]
    }

    /// The number of the corner that a face leads to.
    #[inline(always)]
    fn next(&self, face: usize) -> usize {
        if face + 1 == self.count { 0 } else { face + 1 }
    }

    /// The ends of a face.
    #[inline(always)]
    pub(crate) fn edge(&self, face: usize) -> [Vec2; 2] {
        [self.corner(face), self.corner(self.next(face))]
    }

    /// The first face, or corner, of which a figure is greatest.
    #[inline(always)]
    pub(crate) fn most(of_faces: &[f32; MOST_CORNERS]) -> (usize, f32) {
        // By halves, as one after the other would have to wait for each.
        let fours: [f32; MOST_CORNERS / 2] = from_fn(|i| max(of_faces[i], of_faces[i + MOST_CORNERS / 2]));
        let most = max(max(fours[0], fours[2]), max(fours[1], fours[3]));
        let are_most = of_faces.iter().rev().fold(0, |bits, &figure| bits << 1 | u32::from(figure == most));
        // Where nothing is a number it is the first.
        let face = are_most.trailing_zeros() as usize % MOST_CORNERS;
        (face, of_faces[face])
    }

    /// The first corner of which a figure is least.
    #[inline(always)]
    pub(crate) fn least(of_corners: &[f32; MOST_CORNERS]) -> (usize, f32) {
        let (corner, least) = Self::most(&of_corners.map(|figure| -figure));
        (corner, -least)
    }

    /// How far each corner is from a point along a direction.
    #[inline(always)]
    pub(crate) fn along(&self, from: Vec2, direction: Vec2) -> [f32; MOST_CORNERS] {
        from_fn(|i| (self.x[i] - from.x) * direction.x + (self.y[i] - from.y) * direction.y)
    }

    /// The face along which another lies furthest out, and how far.
    #[inline(always)]
    pub(crate) fn separate(&self, other: &Self) -> (usize, f32) {
        let mut least = [f32::INFINITY; MOST_CORNERS];
        for corner in 0..other.count {
            let at = other.corner(corner);
            for (face, least) in least.iter_mut().enumerate() {
                let height = (at.x - self.x[face]) * self.normal_x[face] + (at.y - self.y[face]) * self.normal_y[face];
                *least = min(height, *least);
            }
        }
        Self::most(&least)
    }

    /// The face that looks most against a normal.
    #[inline(always)]
    pub(crate) fn against(&self, normal: Vec2) -> usize {
        let against = from_fn(|face| -(self.normal_x[face] * normal.x + self.normal_y[face] * normal.y));
        Self::most(&against).0
    }

    /// Its point nearest to another, or if that is inside the nearest way out: direction from here to there, distance, and where on
    /// the outline: twice the number of a face or corner, one more for a corner.
    pub(crate) fn nearest(&self, point: Vec2) -> (Vec2, f32, u32) {
        if self.count == 1 {
            let away = point - self.corner(0);
            let distance = dot(away, away).sqrt();
            // Discs upon one another part along an axis: any direction will do, if it is always the same.
            let normal = if distance > 0.0 { away / distance } else { Vec2::Y };
            return (normal, distance, 1);
        }
        let heights = from_fn(|face| dot(point - self.corner(face), self.normal(face)));
        let (face, height) = Self::most(&heights);
        let (normal, [from, to]) = (self.normal(face), self.edge(face));
        if height <= 0.0 {
            return (normal, height, 2 * face as u32);
        }
        let corner = if dot(point - from, to - from) <= 0.0 {
            face
        } else if dot(point - to, to - from) >= 0.0 {
            self.next(face)
        } else {
            return (normal, height, 2 * face as u32);
        };
        let away = point - self.corner(corner);
        let distance = dot(away, away).sqrt();
        (if distance > 0.0 { away / distance } else { normal }, distance, 2 * corner as u32 + 1)
    }
}
