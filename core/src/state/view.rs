//! What there is to see of a tile between two steps: nothing here changes anything.

use crate::model::body::Body;
use crate::model::id::{GlobalId, TileId};
use crate::tiling::tile::Tile;
use glam::{DVec2, Vec2};

/// One tile of a [`World`](crate::World) between two steps.
#[derive(Clone, Copy, Debug)]
pub struct TileView<'a> {
    tile: &'a Tile,
}

/// A contact as the last step left it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ContactView {
    /// The names of both bodies, the lower first. One may be a static, or a ghost.
    pub bodies: [GlobalId; 2],
    /// Their places in [`TileView::bodies`]; none for a static or a ghost.
    pub owned: [Option<usize>; 2],
    /// Where its one or two points lie, in meters. Points that are not there repeat the first.
    pub points: [DVec2; 2],
    /// Impulse along the normal in the last substep, over all points, in N s.
    pub normal_impulse: f32,
    /// Whether another tile owns one of the bodies: then both tiles show the contact.
    pub is_border: bool,
}

impl<'a> TileView<'a> {
    pub(crate) fn new(tile: &'a Tile) -> Self {
        Self { tile }
    }

    /// The tile.
    pub fn id(&self) -> TileId {
        self.tile.id
    }

    /// The bodies it owns, in the order of [`World::bodies`](crate::World::bodies).
    pub fn bodies(&self) -> impl ExactSizeIterator<Item = Body> + use<'a> {
        let tile = self.tile;
        (0..tile.owned).map(|i| tile.bodies.get(i))
    }

    /// The copies of other tiles' bodies that the last step was made with, as they were when it began.
    pub fn ghosts(&self) -> impl ExactSizeIterator<Item = Body> + use<'a> {
        let tile = self.tile;
        (tile.owned..tile.owned + tile.ghosts()).map(|i| tile.bodies.get(i))
    }

    /// For each of its bodies whether its island slept in the last step; nothing where none may sleep.
    pub fn asleep(&self) -> &'a [bool] {
        let asleep = self.tile.sleep.asleep();
        &asleep[..asleep.len().min(self.tile.owned)]
    }

    /// The contacts of its bodies that the last step solved. What touches across an edge is solved, and shown, by both tiles.
    pub fn contacts(&self) -> impl Iterator<Item = ContactView> + use<'a> {
        self.contacts_of(|_| true)
    }

    /// Those of bodies at certain places among owned, ghosts and statics.
    pub(crate) fn contacts_of<M>(&self, is_meant: M) -> impl Iterator<Item = ContactView> + use<'a, M>
    where
        M: Fn(usize) -> bool,
    {
        let tile = self.tile;
        let own = tile.contacts.iter().take(tile.contacts.own());
        let placed =
            own.map(move |(key, contact)| (key, contact, [key.low(), key.high()].map(|slot| tile.index(slot))));
        placed.filter(move |(.., places)| places.iter().any(|&place| is_meant(place))).map(
            move |(key, contact, places)| {
                let [low, high] = places;
                // Body A is the one with the lower name, whichever slot it has.
                let [a, b] = if tile.bodies.id[low] < tile.bodies.id[high] { [low, high] } else { [high, low] };
                // Ghosts are where they were when the step began: what is owned here knows better.
                let (from, turned, offset) = if a < tile.owned {
                    (a, contact.rotation_a.to(tile.bodies.rotation[a]), Vec2::ZERO)
                } else {
                    (b, contact.rotation_b.to(tile.bodies.rotation[b]), contact.offset)
                };
                let place = |anchor: Vec2| tile.bodies.position[from] + turned.rotate(anchor - offset).as_dvec2();
                let points = contact.points();
                ContactView {
                    bodies: [tile.bodies.id[a], tile.bodies.id[b]],
                    owned: [a, b].map(|i| (i < tile.owned).then_some(i)),
                    points: [points[0], points[points.len() - 1]].map(|point| place(point.anchor)),
                    normal_impulse: points.iter().map(|point| point.normal_impulse).sum(),
                    is_border: key.is_border(),
                }
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use crate::testing::rectangle;
    use crate::*;
    use glam::{DVec2, Vec2};

    /// A box of a meter that lies on a floor, its center in the right one of two tiles and its left corner in the other.
    #[test]
    fn a_body_its_ghost_and_its_contact_are_seen_where_they_are() {
        let blueprint = Blueprint {
            params: Params { gravity: Vec2::new(0.0, -10.0), ..Params::default() },
            partition: Partition::uniform(DVec2::ZERO, DVec2::splat(10.0), 2, 1).unwrap(),
            kinds: vec![rectangle(1.0, 1.0)],
            statics: vec![StaticBody::new(GlobalId(0), rectangle(20.0, 2.0), DVec2::new(5.0, -1.0))],
        };
        let mut world = World::whole(&blueprint).unwrap();
        world.add(Body::at_rest(GlobalId(7), KindId(0), DVec2::new(5.25, 0.5))).unwrap();
        assert!(world.views().all(|tile| tile.contacts().next().is_none() && tile.asleep().is_empty()));
        for _ in 0..10 {
            step(&mut world, &mut Loopback).unwrap();
        }
        let [left, right] = &world.views().collect::<Vec<_>>()[..] else { panic!("two tiles") };
        assert_eq!((left.id(), left.bodies().len(), right.bodies().len()), (TileId(0), 0, 1));
        assert!(right.bodies().eq(world.bodies()) && right.ghosts().len() == 0);
        let contacts: Vec<_> = right.contacts().collect();
        let [contact] = &contacts[..] else { panic!("{contacts:?}") };
        assert_eq!((contact.bodies, contact.owned), ([GlobalId(0), GlobalId(7)], [None, Some(0)]));
        assert!(!contact.is_border && contact.normal_impulse > 0.0);
        let mut corners = contact.points.map(|point| (point - DVec2::new(5.25, 0.0)).to_array());
        corners.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let [[left, low], [right, same]] = corners;
        assert!((left + 0.5).abs() < 0.01 && (right - 0.5).abs() < 0.01, "{corners:?}");
        assert!(low.abs() < 0.01 && same.abs() < 0.01, "{corners:?}");
    }
}
