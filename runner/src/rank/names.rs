//! Whether all bodies of all ranks have names of their own, found out without anybody who knows all names.

use atoll_core::{GlobalId, World};
use atoll_transport::{Collective, Incoming, Transport, TransportError};

/// Each rank tells the names of so many bodies in a round.
const IN_A_ROUND: usize = 1 << 16;

/// A name that several bodies of different ranks have; none where all have names of their own. Each rank hears of those names
/// that fall to it, and tells what it finds: another may find another, or nothing.
///
/// # Errors
/// If ranks cannot talk.
pub(super) fn doubled(transport: &mut impl Transport, world: &World) -> Result<Option<GlobalId>, TransportError> {
    let ranks = transport.size();
    if ranks == 1 {
        return Ok(None);
    }
    let rounds = transport.all_max_u64(world.bodies().count().div_ceil(IN_A_ROUND) as u64)?;
    let mut bodies = world.bodies();
    let mut heard: Vec<u64> = Vec::new();
    let mut told: Vec<Vec<u8>> = vec![Vec::new(); ranks];
    let mut incoming = Incoming::default();
    for _ in 0..rounds {
        told.iter_mut().for_each(Vec::clear);
        for body in bodies.by_ref().take(IN_A_ROUND) {
            told[keeper(body.id, ranks)].extend(body.id.0.to_le_bytes());
        }
        let lengths: Vec<usize> = told.iter().map(Vec::len).collect();
        for (rank, frame) in transport.prepare(&lengths)?.iter_mut() {
            frame.copy_from_slice(&told[rank.index()]);
        }
        transport.exchange(&mut incoming)?;
        for (_, frame) in incoming.iter() {
            heard.extend(frame.as_chunks::<8>().0.iter().map(|name| u64::from_le_bytes(*name)));
        }
    }
    heard.sort_unstable();
    Ok(heard.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| GlobalId(pair[0])))
}

/// The rank to which a name falls: spread evenly, whatever names there are.
fn keeper(name: GlobalId, ranks: usize) -> usize {
    let mixed = name.0.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((u128::from(mixed) * ranks as u128) >> 64) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::plan::Plan;
    use crate::rank::part_of_scene;
    use atoll_core::Body;
    use atoll_transport::channel::{self, ChannelOptions};

    #[test]
    fn a_name_on_two_ranks_is_found_and_no_other() {
        let text = "[scene]\nkind = \"rooms\"\nbodies = 900\n";
        let config = Config::from_toml_str("test", text, &[("ranks", "3"), ("tiles", "6x6")]).unwrap();
        let plan = Plan::new(&config).unwrap();
        for doubles in [false, true] {
            let found = channel::run(3, ChannelOptions::default(), |mut endpoint| {
                let rank = endpoint.rank();
                let mut world = part_of_scene(&plan, rank).unwrap();
                let place = world.bodies().next().unwrap();
                if doubles && rank.index() > 0 {
                    assert!(world.add(Body { id: GlobalId(u64::MAX), ..place }).unwrap());
                }
                doubled(&mut endpoint, &world).unwrap()
            });
            let found: Vec<GlobalId> = found.into_iter().filter_map(Result::unwrap).collect();
            assert_eq!(found, if doubles { vec![GlobalId(u64::MAX)] } else { vec![] });
        }
    }

    #[test]
    fn names_that_follow_each_other_fall_to_all_ranks() {
        let mut counts = [0; 7];
        (0..7000).for_each(|name| counts[keeper(GlobalId(name), 7)] += 1);
        assert!(counts.iter().all(|count| (900..1100).contains(count)), "{counts:?}");
    }
}
