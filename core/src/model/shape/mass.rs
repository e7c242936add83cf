//! How much there is of a shape, where its middle is, and how hard it is to turn: in double precision, exactly but for rounding.

use glam::DVec2;
use std::f64::consts::PI;

/// Of a plane figure of density one.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Mass {
    /// In square meters.
    pub(crate) area: f64,
    /// Its center of mass.
    pub(crate) center: DVec2,
    /// Second moment of area about the center of mass, in m^4.
    pub(crate) moment: f64,
}

impl Mass {
    const NONE: Self = Self { area: 0.0, center: DVec2::ZERO, moment: 0.0 };

    pub(crate) fn of_disc(center: DVec2, radius: f64) -> Self {
        let area = PI * radius * radius;
        Self { area, center, moment: 0.5 * area * radius * radius }
    }

    /// Of a convex polygon of two corners or more, counter-clockwise, and all that is within a radius of it: the polygon itself, a
    /// strip along each edge, a sector around each corner.
    pub(crate) fn of_rounded(corners: &[DVec2], radius: f64) -> Self {
        let count = corners.len();
        let edges = || (0..count).map(|i| (corners[i], corners[(i + 1) % count]));
        // About a point within: little is lost far from the origin.
        let inside = corners.iter().sum::<DVec2>() / count as f64;
        let triangles = edges().map(|(from, to)| {
            let (u, v) = (from - inside, to - inside);
            let area = 0.5 * u.perp_dot(v);
            let center = (u + v) / 3.0;
            let about_inside = area / 6.0 * (u.dot(u) + u.dot(v) + v.dot(v));
            Self { area, center: inside + center, moment: about_inside - area * center.dot(center) }
        });
        let mut sum = Self::sum(triangles);
        if radius > 0.0 {
            let strips = edges().map(|(from, to)| {
                let (length, middle) = ((to - from).length(), (from + to) * 0.5);
                let (area, out) = (length * radius, (to - from).normalize_or_zero());
                let center = middle - out.perp() * (0.5 * radius);
                Self { area, center, moment: area * (length * length + radius * radius) / 12.0 }
            });
            let sectors = (0..count).map(|i| {
                let (before, at, after) = (corners[(i + count - 1) % count], corners[i], corners[(i + 1) % count]);
                let (comes, goes) = ((at - before).normalize_or_zero(), (after - at).normalize_or_zero());
                let angle = libm::atan2(comes.perp_dot(goes), comes.dot(goes)).abs();
                if angle == 0.0 {
                    return Self { center: at, ..Self::NONE };
                }
                // Between the normals of both edges; where these are opposite, the way the first one goes.
                let (normals, out) = (-comes.perp() - goes.perp(), comes - goes);
                let middle = if normals.length_squared() > out.length_squared() { normals } else { out };
                let (area, half) = (0.5 * angle * radius * radius, 0.5 * angle);
                let far = 2.0 * radius * libm::sin(half) / (3.0 * half);
                let about_corner = 0.25 * angle * radius.powi(4);
                let center = at + middle.normalize_or_zero() * far;
                Self { area, center, moment: about_corner - area * far * far }
            });
            sum = Self::sum([sum].into_iter().chain(strips).chain(sectors));
        }
        sum
    }

    /// Of several together. Where they lie upon each other there is twice as much.
    pub(crate) fn sum(parts: impl Iterator<Item = Self> + Clone) -> Self {
        let area: f64 = parts.clone().map(|part| part.area).sum();
        if area <= 0.0 {
            return parts.last().map_or(Self::NONE, |last| Self { area: 0.0, moment: 0.0, ..last });
        }
        let center = parts.clone().map(|part| part.center * part.area).sum::<DVec2>() / area;
        let moment = parts.map(|part| part.moment + part.area * part.center.distance_squared(center)).sum();
        Self { area, center, moment }
    }

    /// The same, turned and moved.
    pub(crate) fn placed(self, place: impl Fn(DVec2) -> DVec2) -> Self {
        Self { center: place(self.center), ..self }
    }
}
