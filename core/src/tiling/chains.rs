//! Which segments of chains lie one after the other.

use crate::model::body::Body;
use crate::model::kind::{Form, KindRow};
use crate::model::math::{dot, min};
use crate::model::piece::{Joint, Piece, Side};
use glam::{DVec2, Vec2};

/// Ends nearer than this part of the lesser length are one.
const SAME: f32 = 1e-3;

/// Segments whose rows follow each other, and loops.
#[derive(Clone, Debug)]
pub(crate) struct Chains {
    /// The shortest beside which another leans in, in m; infinite if there is none.
    pub(crate) shortest_in_hollow: f32,
    /// The first and the last row of chains that lead back to where they begin, ascending.
    loops: Vec<[u32; 2]>,
}

/// A segment of a chain, where it is.
#[derive(Clone, Copy)]
pub(crate) struct Link<'a> {
    pub(crate) piece: &'a Piece,
    /// From its start to its end.
    pub(crate) along: Vec2,
    pub(crate) normal: Vec2,
    pub(crate) length: f32,
    side: Side,
    start: DVec2,
    end: DVec2,
}

impl<'a> Link<'a> {
    /// A static, if it is one.
    pub(crate) fn new(kind: &'a KindRow, body: &Body) -> Option<Self> {
        let piece = &kind.pieces[0];
        let side = piece.side.filter(|_| kind.form == Form::Segment)?;
        let [to, from] = piece.outline.edge(0).map(|end| body.rotation.rotate(end));
        let [start, end] = [from, to].map(|end| body.position + end.as_dvec2());
        let length = dot(to - from, to - from).sqrt();
        let normal = body.rotation.rotate(piece.outline.normal(0));
        Some(Self { piece, along: (to - from) / length, normal, length, side, start, end })
    }

    /// Whether it comes into a rectangle, or near that.
    pub(crate) fn meets(&self, low: DVec2, high: DVec2) -> bool {
        self.start.max(self.end).cmpge(low).all() && self.start.min(self.end).cmple(high).all()
    }

    /// Whether it goes on with another.
    fn leads_to(&self, other: &Self) -> bool {
        let gap = (self.end - other.start).as_vec2();
        let near = SAME * min(self.length, other.length);
        dot(gap, gap) <= near * near
    }

    /// The same, and nothing juts out between them.
    pub(crate) fn goes_on_with(&self, next: &Self) -> bool {
        self.side.end == Joint::Concave && next.side.start == Joint::Concave && self.leads_to(next)
    }
}

impl Chains {
    /// Of the kinds of statics, and these.
    pub(crate) fn new(kinds: &[KindRow], statics: &[Body]) -> Self {
        let mut chains = Self { shortest_in_hollow: f32::INFINITY, loops: Vec::new() };
        let (mut first, mut before): (Option<(u32, Link<'_>)>, Option<Link<'_>>) = (None, None);
        let mut end = |first: Option<(u32, Link<'_>)>, last: Option<Link<'_>>, row: u32| {
            if let (Some((begin, first)), Some(last)) = (first, last)
                && begin + 1 < row
                && last.leads_to(&first)
            {
                chains.loops.push([begin, row - 1]);
            }
        };
        for ((row, kind), body) in (0..).zip(kinds).zip(statics) {
            let link = Link::new(kind, body);
            let joined = link.zip(before).filter(|(link, before)| before.leads_to(link));
            if joined.is_none() {
                end(first, before, row);
                first = link.map(|link| (row, link));
            }
            if let Some((link, before)) = joined
                && dot(link.normal, before.along) < 0.0
            {
                chains.shortest_in_hollow = min(chains.shortest_in_hollow, min(link.length, before.length));
            }
            before = link;
        }
        end(first, before, kinds.len() as u32);
        chains
    }

    /// The row of what comes after that in a row, or before it, if they are of one chain: whether they are, where they lie tells.
    pub(crate) fn neighbour_of(&self, row: u32, is_forward: bool) -> Option<u32> {
        let (end, begin) = if is_forward { (1, 0) } else { (0, 1) };
        if let Ok(place) = self.loops.binary_search_by_key(&row, |ends| ends[end]) {
            return Some(self.loops[place][begin]);
        }
        if is_forward { row.checked_add(1) } else { row.checked_sub(1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::id::{GlobalId, KindId};
    use crate::model::kind::{Kind, Material};
    use crate::model::math::Rot;
    use crate::model::shape::{Segment, Shape};

    /// A circle, a triangle that leads back to where it begins, and two segments that do not.
    #[test]
    fn loops_are_found_and_others_go_on_row_by_row() {
        let (mut kinds, mut statics) = (Vec::new(), Vec::new());
        let mut add = |shape, place: Vec2| {
            kinds.push(KindRow::fixed(&Kind::new(shape, Material::default())).unwrap());
            let (id, kind) = (GlobalId(statics.len() as u64), KindId(statics.len() as u32));
            let (position, velocity) = (place.as_dvec2(), Vec2::ZERO);
            statics.push(Body { id, kind, position, rotation: Rot::IDENTITY, velocity, angular_velocity: 0.0 });
        };
        add(Shape::circle(1.0), Vec2::ZERO);
        let of_loop = [Vec2::new(3.0, 0.0), Vec2::new(7.0, 1.0), Vec2::new(2.0, 5.0)];
        let around = |k: usize| of_loop[k % 3];
        for k in 0..3 {
            let beside = [around(k + 2), around(k + 2)].map(Some);
            let (segment, middle) = Segment::new(beside[0], around(k), around(k + 1), beside[1]).unwrap();
            add(Shape::Segment(segment), middle);
        }
        let line = [0.0, 1.0, 1.5].map(|x| Vec2::new(x, 9.0));
        for (from, before, after) in [(0, None, Some(line[2])), (1, Some(line[0]), None)] {
            let (segment, middle) = Segment::new(before, line[from], line[from + 1], after).unwrap();
            add(Shape::Segment(segment), middle);
        }
        let chains = Chains::new(&kinds, &statics);
        assert_eq!(chains.loops, [[1, 3]]);
        assert_eq!((chains.neighbour_of(3, true), chains.neighbour_of(1, false)), (Some(1), Some(3)));
        assert_eq!((chains.neighbour_of(2, true), chains.neighbour_of(4, true)), (Some(3), Some(5)));
        assert_eq!((chains.neighbour_of(0, false), chains.neighbour_of(4, false)), (None, Some(3)));
        // What is level counts for none.
        assert_eq!(chains.shortest_in_hollow, Vec2::new(4.0, 1.0).length());
        let links = [3, 4, 5].map(|row| Link::new(&kinds[row], &statics[row]).unwrap());
        assert_eq!((links[1].goes_on_with(&links[2]), links[0].goes_on_with(&links[1])), (true, false));
    }
}
