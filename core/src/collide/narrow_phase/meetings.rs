//! The pieces that may touch of a block's pairs.

use super::names::Named;
use super::{BLOCK, FindAmong};
use crate::collide::touch::{Meeting, Met, meet};
use crate::collide::wide::moments::{Points, Search, WidePieces};
use crate::collide::wide::polygons::WidePolygons;
use crate::collide::wide::segments::WideSegments;
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
    /// Those of which nothing is known yet: of pieces with faces, and of segments with any.
    polygons: Open<WidePolygons>,
    segments: Open<WideSegments>,
    /// The contacts of the last step of a pair.
    known: Vec<&'a Contact>,
}

/// Some of all meetings, which are looked at sixteen at a time.
#[derive(Default)]
struct Open<S> {
    numbers: Vec<u32>,
    pairs: S,
    points: Points,
}

impl<'a> Meetings<'a> {
    /// Finds those of the pairs at some places of a block, and what comes of them.
    #[inline(never)]
    pub(super) fn find(&mut self, places: &[u8], named: &[Named<'a>; BLOCK], among: &FindAmong<'a>) {
        let &FindAmong { by_name, boxes, tile, setup, .. } = among;
        let Self { all, polygons, segments, known: several } = self;
        all.clear();
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
                    let open = if meeting.is_on_segment() { &mut segments.numbers } else { &mut polygons.numbers };
                    open.push(all.len() as u32);
                }
                all.push((place, meeting));
            });
        }
        setup.lanes.run(Look { all, open: polygons, tile, setup });
        setup.lanes.run(Look { all, open: segments, tile, setup });
    }

    /// All contacts that are found, each with the place of its pair, and the separations of its points now.
    pub(super) fn found(&self) -> Peekable<impl Iterator<Item = (usize, &Contact, [f32; 2])>> {
        let found = self.all.iter().filter_map(|(place, meeting)| Some((place, meeting.contact()?)));
        found.map(|(place, (contact, now))| (usize::from(*place), contact, now)).peekable()
    }
}

/// Looks at all that are open, until none is.
struct Look<'m, 'a, S> {
    all: &'m mut [(u8, Meeting<'a>)],
    open: &'m mut Open<S>,
    tile: &'a Tile,
    setup: &'a Setup,
}

impl<S: WidePieces> Kernel for Look<'_, '_, S> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let Self { all, open: Open { numbers: open, pairs, points }, tile, setup } = self;
        for search in [Search::WhereManyNeedIt, Search::Always] {
            let (mut count, mut postponed) = (open.len(), 0);
            // Those that are too few for lanes.
            let few = if count % WIDE > FEW { 0 } else { count % WIDE };
            let single = if V::HAS_REGISTERS { few } else { count };
            for &number in &open[count - single..] {
                all[number as usize].1.touch(tile, setup);
            }
            count -= single;
            for first in (0..count).step_by(WIDE) {
                let lanes = WIDE.min(count - first);
                // In lanes that are left over, the first of them again.
                let mut numbers = [open[first]; WIDE];
                numbers[..lanes].copy_from_slice(&open[first..][..lanes]);
                for (lane, &number) in numbers.iter().enumerate() {
                    all[number as usize].1.set(lane, pairs, tile, setup);
                }
                pairs.look::<V::Wide>(points, search, setup);
                for (lane, &number) in numbers[..lanes].iter().enumerate() {
                    let meeting = &mut all[number as usize].1;
                    if points.is_postponed(lane) {
                        open[postponed] = number;
                        postponed += 1;
                    } else if points.is_unsure(lane) {
                        meeting.touch(tile, setup);
                    } else {
                        meeting.see(lane, points);
                    }
                }
            }
            open.truncate(postponed);
        }
    }
}
