//! The pieces that may touch of a block's pairs.

use super::names::Named;
use super::{BLOCK, FindAmong};
use crate::collide::touch::{Meeting, Met, meet};
use crate::collide::wide_moments::Points;
use crate::collide::wide_polygons::WidePolygons;
use crate::model::contact::Contact;
use crate::parallel::lanes::{Kernel, Lanes, WIDE};
use crate::tiling::blueprint::Setup;
use crate::tiling::tile::Tile;
use std::iter::Peekable;

/// So few are looked at one by one sooner than in lanes.
const FEW: usize = 3;

/// In the order of pairs, and of the numbers of pieces.
#[derive(Default)]
pub(super) struct Meetings<'a> {
    /// Each with the place in the block of its pair.
    all: Vec<(u8, Meeting<'a>)>,
    /// Those of which nothing is known yet.
    open: Vec<u32>,
    /// The contacts of the last step of a pair.
    known: Vec<&'a Contact>,
}

impl<'a> Meetings<'a> {
    /// Finds those of the pairs at some places of a block, and what comes of them.
    #[inline(never)]
    pub(super) fn find(&mut self, places: &[u8], named: &[Named<'a>; BLOCK], among: &FindAmong<'a>) {
        let &FindAmong { by_name, boxes, tile, setup, .. } = among;
        let Self { all, open, known: several } = self;
        all.clear();
        open.clear();
        for &place in places {
            let Named { key, bodies, known, old } = named[usize::from(place)];
            several.clear();
            if bodies.iter().any(|&body| by_name[body as usize]) {
                let names = (tile.bodies.id[bodies[0] as usize], tile.bodies.id[bodies[1] as usize]);
                several.extend(tile.strays.find_all(names, key.is_own()));
            } else if known.is_some() {
                several.extend(tile.contacts.all_from(old as usize));
            }
            meet(tile, bodies, boxes, several, setup, |meeting| {
                if matches!(meeting.outcome, Met::Open) {
                    open.push(all.len() as u32);
                }
                all.push((place, meeting));
            });
        }
        setup.lanes.run(Look { meetings: self, tile, setup });
    }

    /// All contacts that are found, each with the place of its pair, and the separations of its points now.
    pub(super) fn found(&self) -> Peekable<impl Iterator<Item = (usize, &Contact, [f32; 2])>> {
        let found = self.all.iter().filter_map(|(place, meeting)| Some((place, meeting.contact()?)));
        found.map(|(place, (contact, now))| (usize::from(*place), contact, now)).peekable()
    }
}

/// Looks at all that are open.
struct Look<'m, 'a> {
    meetings: &'m mut Meetings<'a>,
    tile: &'a Tile,
    setup: &'a Setup,
}

impl Kernel for Look<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Self { meetings: Meetings { all, open, .. }, tile, setup } = self;
        let (mut wide, mut points) = (WidePolygons::default(), Points::default());
        for open in open.chunks(WIDE) {
            if open.len() > FEW {
                wide.clear();
                for lane in 0..WIDE {
                    // In lanes that are left over, the first of them again.
                    let number = *open.get(lane).unwrap_or(&open[0]);
                    wide.set(lane, tile, &all[number as usize].1, setup);
                }
                wide.look::<V::Wide>(&mut points, setup);
                for (lane, &number) in open.iter().enumerate() {
                    all[number as usize].1.see(lane, &points);
                }
            }
            for &number in open {
                let meeting = &mut all[number as usize].1;
                if matches!(meeting.outcome, Met::Open) {
                    meeting.touch(tile, setup);
                }
            }
        }
    }
}
