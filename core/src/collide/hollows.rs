//! Hollows of chains. Who goes further in a step than a hollow's segments are long comes to several of them, one after the other. Its free way
//! leads into the first, and behind all others, so that it has no contact with these, and would be held at each in turn.
//!
//! Whoever is in a hollow is before the planes of all of its segments. So those that it comes to along the first one count beyond their ends
//! as well, as far back as that: there each of them is behind the chain.

use crate::collide::broad_phase::Pair;
use crate::collide::narrow_phase::{Contacts, New};
use crate::collide::touch::{self, Stopped, sooner};
use crate::model::contact::{PairKey, Slot};
use crate::model::kind::Form;
use crate::model::math::{dot, max};
use crate::tiling::blueprint::Setup;
use crate::tiling::chains::Link;
use crate::tiling::tile::{Fastest, Tile};
use std::iter::successors;
use std::ops::Range;

/// Segments after the first one, at most.
const MOST: usize = 64;

/// Segments count as long as their normals and that of the first one have a greater cosine.
const LEAST_COSINE: f32 = 0.2;

/// What rises above the first one by more than this part of its length is none of a hollow; what leans in by less is level with it.
const SLOPE: f32 = 1e-4;

/// Adds the contacts of a tile's bodies with the segments that they come to along others within the step. Time grows with the segments that
/// fast bodies pass.
pub(crate) fn follow(tile: &mut Tile, contacts: &mut Contacts, setup: &Setup) {
    if !any_may_pass(tile, setup) {
        return;
    }
    let (mut found, mut orders, mut first) = (Vec::new(), Vec::<Vec<PairKey>>::new(), 0);
    while first < tile.contacts.len() {
        let key = tile.contacts.keys[first];
        let is_of_one = |other: &PairKey| other.low() == key.low() && other.is_with_static();
        let count = tile.contacts.keys[first..].iter().take_while(|&other| is_of_one(other)).count();
        orders.extend(follow_run(tile, contacts, first..first + count, setup, &mut found));
        first += count.max(1);
    }
    contacts.insert(found, &mut tile.contacts);
    let keys = &tile.contacts.keys;
    let places = |key: &PairKey| {
        keys.partition_point(|other| other < key) as u32..keys.partition_point(|other| other <= key) as u32
    };
    contacts.turns.extend(orders.iter().map(|order| order.iter().flat_map(places).collect()));
}

/// Whether a body may go further than a segment of a hollow is long: looser than what is asked of each.
fn any_may_pass(tile: &Tile, setup: &Setup) -> bool {
    let (Fastest { spin, way }, shortest) = (tile.counts.fastest, setup.chains.shortest_in_hollow);
    let far = 2.0 * way + 1.01 * setup.slimness.longest_arm * spin * setup.params.dt;
    shortest.is_finite() && (setup.any_drives() || far > shortest)
}

/// Looks for those of one body, whose contacts with statics these are. Returns the order in which it comes to them, if it is not that of their
/// names: whoever is turned by the last one first loses more.
fn follow_run(
    tile: &Tile,
    contacts: &Contacts,
    run: Range<usize>,
    setup: &Setup,
    found: &mut Vec<New>,
) -> Option<Vec<PairKey>> {
    let met = run.clone().filter_map(|number| {
        let (key, pair) = (tile.contacts.keys[number], contacts.bodies[number]);
        let row = key.high().index(tile.owned, tile.ghosts());
        let kind = setup.kind(tile.bodies.kind[row]);
        if kind.form != Form::Segment || 2.0 * kind.bounding_radius >= touch::far(tile, pair, setup) {
            return None;
        }
        let ground = Ground::new(tile, row, setup)?;
        let stopped = Stopped::new(tile, (pair, &tile.contacts.contacts[number]), setup)?;
        stopped.by().is_some().then_some((number, ground, stopped))
    });
    let (number, first, stopped) = met.min_by(|(.., one), (.., two)| sooner(one.order(), two.order()))?;
    let (pair, numbers) = (contacts.bodies[number], tile.contacts.contacts[number].piece_numbers());
    if bounces(tile, pair, &stopped, setup) {
        return None;
    }
    let side = usize::from(pair[0] as usize == first.row);
    let (body, piece) = (pair[side], numbers[side]);
    let is_forward = dot(stopped.velocity() - tile.bodies.velocity[first.row], first.link.along) > 0.0;
    let (far, begin) = (touch::far(tile, pair, setup), found.len());
    // A tile knows what its bodies may come to, and maybe more, which is not to show.
    let (place, grown) =
        (tile.bodies.position[body as usize], setup.grown_half_extents(&tile.bodies.get(body as usize)));
    let (low, high) = (place - grown.as_dvec2(), place + grown.as_dvec2());
    let key_of = |ground: &Ground<'_>| {
        let slot = Slot::from_index(ground.row, tile.owned, tile.ghosts());
        PairKey::new(tile.contacts.keys[number].low(), slot)
    };
    let is_known = |key: &PairKey| tile.contacts.keys[run.clone()].binary_search(key).is_ok();
    let turns_by = |ground: &Ground<'_>| dot(ground.link.normal, first.link.normal);
    // First those that it leaves.
    let behind = successors(Some(first), |here| here.next(tile, !is_forward, setup));
    let near = behind.take(MOST).take_while(|ground| turns_by(ground) >= LEAST_COSINE);
    let mut order: Vec<PairKey> = near.map(|ground| key_of(&ground)).take_while(is_known).collect();
    order.reverse();
    // From the far end of the first to the near one of the next.
    let (mut here, mut length) = (first, 0.0);
    for _ in 0..MOST {
        length += here.link.length;
        let next = here.next(tile, is_forward, setup).filter(|next| next.link.meets(low, high));
        let Some(next) = next else { break };
        let lengthened = next.link.piece.lengthened(!is_forward, length);
        let lean = dot(next.link.normal, first.link.along) * if is_forward { -1.0 } else { 1.0 };
        if length - first.link.length > far || turns_by(&next) < LEAST_COSINE || lean < -SLOPE {
            break;
        }
        let key = key_of(&next);
        let is_known = is_known(&key);
        let touches = || setup.kind(tile.bodies.kind[next.row]).touches(setup.kind(tile.bodies.kind[body as usize]));
        // What is level it touches on its free way, or not at all.
        if lean > SLOPE && !is_known && touches() {
            let bodies = next.pair_with(tile, body);
            let numbers = bodies.map(|row| if row == body { piece } else { 0 });
            let new = stopped.touch_segment(tile, (bodies, numbers), &lengthened, setup);
            found.extend(new.map(|found| New { key, bodies, found }));
        }
        if is_known || found.last().is_some_and(|new| new.key == key) {
            order.push(key);
        }
        here = next;
    }
    found[begin..].sort_by_key(|new| new.key);
    (!order.is_sorted()).then_some(order)
}

/// Whether two bodies bounce off each other rather than that one glides on.
fn bounces(tile: &Tile, pair: Pair, stopped: &Stopped, setup: &Setup) -> bool {
    let restitution = pair.map(|body| setup.kind(tile.bodies.kind[body as usize]).material.restitution);
    max(restitution[0], restitution[1]) > 0.0 && stopped.closing() > setup.params.least_bounce()
}

/// A segment among the bodies of a tile.
#[derive(Clone, Copy)]
struct Ground<'a> {
    row: usize,
    link: Link<'a>,
}

impl<'a> Ground<'a> {
    /// The body in a row, if it is one.
    fn new(tile: &Tile, row: usize, setup: &'a Setup) -> Option<Self> {
        let link = Link::new(setup.kind(tile.bodies.kind[row]), &tile.bodies.get(row))?;
        Some(Self { row, link })
    }

    /// What it goes on with, if nothing juts out there.
    fn next(&self, tile: &Tile, is_forward: bool, setup: &'a Setup) -> Option<Self> {
        let neighbour = setup.chains.neighbour_of(setup.row_of_static(tile.bodies.kind[self.row])?, is_forward)?;
        let next = Self::new(tile, tile.index_of_static(neighbour, setup)?, setup)?;
        let (one, two) = if is_forward { (self, &next) } else { (&next, self) };
        one.link.goes_on_with(&two.link).then_some(next)
    }

    /// It and another body, in the order of their names.
    fn pair_with(&self, tile: &Tile, body: u32) -> Pair {
        let own = self.row as u32;
        let [own_id, id] = [own, body].map(|row| tile.bodies.id[row as usize]);
        if own_id < id { [own, body] } else { [body, own] }
    }
}
