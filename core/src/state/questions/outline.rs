//! What is asked of a single body: does a ray meet it, does it hold a point, does it meet a rectangle. In double precision.

use super::RayHit;
use super::pieces;
use crate::model::body::Body;
use crate::model::id::GlobalId;
use crate::model::kind::{Form, KindRow};
use crate::model::math::Rot;
use crate::model::piece::Piece;
use glam::{DVec2, Vec2};

/// A shape at its place.
pub(super) struct Outline<'a> {
    pub(super) id: GlobalId,
    center: DVec2,
    rotation: Rot,
    figure: Figure<'a>,
}

/// What a shape is made of.
enum Figure<'a> {
    Circle { radius: f32 },
    Box { half: Vec2 },
    Pieces(&'a [Piece]),
}

impl<'a> Outline<'a> {
    pub(super) fn new(body: &Body, kind: &'a KindRow) -> Self {
        let figure = match kind.form {
            Form::Round => Figure::Circle { radius: kind.radius },
            Form::Box => Figure::Box { half: kind.extent },
            Form::Polygon | Form::Segment | Form::Pieces => Figure::Pieces(&kind.pieces),
        };
        Self { id: body.id, center: body.position, rotation: body.rotation, figure }
    }

    /// Cosine and sine.
    fn turned(&self) -> DVec2 {
        DVec2::new(f64::from(self.rotation.c), f64::from(self.rotation.s))
    }

    /// A vector as it is seen from the body.
    fn unrotate(&self, v: DVec2) -> DVec2 {
        let DVec2 { x: c, y: s } = self.turned();
        DVec2::new(c * v.x + s * v.y, c * v.y - s * v.x)
    }

    fn rotate(&self, v: DVec2) -> DVec2 {
        let DVec2 { x: c, y: s } = self.turned();
        DVec2::new(c * v.x - s * v.y, s * v.x + c * v.y)
    }

    /// Whether a point is in it or on it.
    pub(super) fn holds(&self, point: DVec2) -> bool {
        let offset = point - self.center;
        match self.figure {
            Figure::Circle { radius } => offset.length_squared() <= f64::from(radius) * f64::from(radius),
            Figure::Box { half } => self.unrotate(offset).abs().cmple(half.as_dvec2()).all(),
            Figure::Pieces(all) => {
                let point = self.unrotate(offset);
                all.iter().any(|piece| pieces::holds(piece, point))
            }
        }
    }

    /// Whether it has a point in common with a rectangle. By separating axes: those of the rectangle and its own.
    pub(super) fn meets_rectangle(&self, low: DVec2, high: DVec2) -> bool {
        match self.figure {
            Figure::Circle { radius } => {
                let nearest = self.center.max(low).min(high);
                (nearest - self.center).length_squared() <= f64::from(radius) * f64::from(radius)
            }
            Figure::Box { half } => {
                let half = half.as_dvec2();
                let (middle, other) = ((low + high) * 0.5, (high - low) * 0.5);
                let offset = middle - self.center;
                let DVec2 { x: c, y: s } = self.turned().abs();
                let reach = DVec2::new(c * half.x + s * half.y, s * half.x + c * half.y) + other;
                let own = half + DVec2::new(c * other.x + s * other.y, s * other.x + c * other.y);
                offset.abs().cmple(reach).all() && self.unrotate(offset).abs().cmple(own).all()
            }
            Figure::Pieces(all) => {
                let corners = [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)];
                let corners = corners.map(|corner| self.unrotate(corner - self.center));
                all.iter().any(|piece| pieces::meets(piece, &corners))
            }
        }
    }

    /// Where a ray meets it first.
    pub(super) fn cast_ray(&self, from: DVec2, to: DVec2) -> Option<RayHit> {
        let way = to - from;
        if self.holds(from) {
            return Some(RayHit { id: self.id, fraction: 0.0, point: from, normal: DVec2::ZERO });
        }
        let (fraction, normal) = match self.figure {
            Figure::Circle { radius } => {
                let (radius, offset) = (f64::from(radius), from - self.center);
                let (a, b) = (way.length_squared(), offset.dot(way));
                // As the distance of the center from the line, so that little is lost far away.
                let nearest = offset - way * (b / a);
                let rest = radius * radius - nearest.length_squared();
                if b >= 0.0 || rest < 0.0 {
                    return None;
                }
                let fraction = -b / a - (rest / a).sqrt();
                (fraction, (offset + way * fraction) / radius)
            }
            Figure::Box { half } => {
                let (start, along) = (self.unrotate(from - self.center), self.unrotate(way));
                let (fraction, normal) = enter(start, along, half.as_dvec2())?;
                (fraction, self.rotate(normal))
            }
            Figure::Pieces(all) => {
                let (start, along) = (self.unrotate(from - self.center), self.unrotate(way));
                let hits = all.iter().filter_map(|piece| pieces::enter(piece, start, along));
                let (fraction, normal) = hits.min_by(|a, b| a.0.total_cmp(&b.0))?;
                (fraction, self.rotate(normal))
            }
        };
        let within = (0.0..=1.0).contains(&fraction);
        within.then(|| RayHit { id: self.id, fraction, point: from + way * fraction, normal })
    }
}

/// Where a line from outside enters the rectangle of these half extents around the origin: by slabs (T. Kay, J. Kajiya, "Ray tracing
/// complex scenes", 1986).
fn enter(start: DVec2, along: DVec2, half: DVec2) -> Option<(f64, DVec2)> {
    let (mut enters, mut leaves, mut normal) = (f64::NEG_INFINITY, f64::INFINITY, DVec2::ZERO);
    for axis in 0..2 {
        let (at, step, half) = (start[axis], along[axis], half[axis]);
        if step == 0.0 {
            if at.abs() > half {
                return None;
            }
            continue;
        }
        let side = if step > 0.0 { -1.0 } else { 1.0 };
        let (first, last) = ((side * half - at) / step, (-side * half - at) / step);
        if first > enters {
            (enters, normal) = (first, DVec2::ZERO);
            normal[axis] = side;
        }
        leaves = if last < leaves { last } else { leaves };
    }
    (enters <= leaves && enters >= 0.0).then_some((enters, normal))
}
