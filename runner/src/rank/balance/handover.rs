//! Tiles on their way from rank to rank.

use super::super::halo::ExchangeError;
use super::super::{RankError, unreadable};
use atoll_core::{StepError, TileId, World};
use atoll_transport::{Incoming, Rank, Transport, TransportError};
use std::collections::{BTreeMap, VecDeque};

/// A tile, who gives it up, and who takes it over.
pub(super) type Move = (TileId, usize, usize);

/// A rank sends no more bytes in a round than this, but for a tile that takes more by itself: libraries count them in 31 bits, and
/// shared memory is small in many places.
pub(super) const ROUND: usize = 32 << 20;

/// What a rank says while it has more to send.
const MORE: u128 = 0;

/// Lets tiles go to other ranks, which all know of the same moves, by ascending tile, in rounds of so many bytes.
///
/// # Errors
/// If a rank is lost, or sends what cannot be read.
pub(super) fn hand_over(
    moves: &[Move],
    world: &mut World,
    transport: &mut impl Transport,
    round: usize,
) -> Result<(), RankError> {
    let own = transport.rank().index();
    let (names, receivers): (Vec<TileId>, Vec<usize>) =
        moves.iter().filter(|&&(_, from, _)| from == own).map(|&(tile, _, to)| (tile, to)).unzip();
    let mut leaving = receivers.into_iter().zip(world.give_up(&names)).peekable();
    let mut coming: BTreeMap<usize, VecDeque<TileId>> = BTreeMap::new();
    for &(tile, from, _) in moves.iter().filter(|&&(.., to)| to == own) {
        coming.entry(from).or_default().push_back(tile);
    }
    loop {
        let (mut parcels, mut bytes) = (vec![Vec::new(); transport.size()], 0);
        while let Some((to, block)) = leaving.next_if(|(_, block)| bytes == 0 || bytes + block.len() <= round) {
            parcels[to].extend_from_slice(&(block.len() as u64).to_le_bytes());
            parcels[to].extend_from_slice(&block);
            bytes += block.len();
        }
        let incoming = send(&parcels, leaving.peek().is_some(), transport).map_err(RankError::Transport)?;
        for (from, bytes) in incoming.iter().filter(|(_, bytes)| !bytes.is_empty()) {
            let expected = coming.get_mut(&from.index());
            let blocks = expected.and_then(|expected| blocks(bytes, expected));
            let blocks = blocks.ok_or_else(|| RankError::Transport(unreadable(from)))?;
            let taken = world.take_over(&blocks);
            taken.map_err(|error| RankError::Step(StepError::Halo(ExchangeError::Tile { from, error })))?;
        }
        if incoming.flag_word() != MORE {
            break;
        }
    }
    match coming.into_iter().find(|(_, tiles)| !tiles.is_empty()) {
        Some((from, _)) => Err(RankError::Transport(unreadable(Rank::from_index(from)))),
        None => Ok(()),
    }
}

/// The blocks that a rank sent, each of the next tile that is expected of it.
fn blocks<'a>(mut bytes: &'a [u8], expected: &mut VecDeque<TileId>) -> Option<Vec<(TileId, &'a [u8])>> {
    let mut blocks = Vec::new();
    while !bytes.is_empty() {
        let (length, rest) = bytes.split_first_chunk()?;
        let (block, rest) = rest.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
        blocks.push((expected.pop_front()?, block));
        bytes = rest;
    }
    Some(blocks)
}

/// Brings each rank what is for it, and says whether there is more.
pub(super) fn send(
    parcels: &[Vec<u8>],
    more: bool,
    transport: &mut impl Transport,
) -> Result<Incoming, TransportError> {
    let lengths: Vec<usize> = parcels.iter().map(Vec::len).collect();
    let outgoing = transport.prepare(&lengths)?;
    if more {
        outgoing.set_flag_word(MORE);
    }
    for (to, bytes) in outgoing.iter_mut() {
        bytes.copy_from_slice(&parcels[to.index()]);
    }
    let mut incoming = Incoming::default();
    transport.exchange(&mut incoming)?;
    Ok(incoming)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::plan::Plan;
    use crate::rank::part_of_scene;
    use atoll_core::Hashes;
    use atoll_transport::channel::{self, ChannelOptions};

    /// Three ranks hand about half of 16 tiles on, in rounds of so many bytes.
    fn hashes(round: usize, moves: bool) -> Vec<(Hashes, Vec<TileId>)> {
        let text = "[scene]\nkind = \"rooms\"\nbodies = 3000\n[run]\nranks = 3\ntiles = [4, 4]\n";
        let plan = Plan::new(&Config::from_toml_str("test", text, &[]).unwrap()).unwrap();
        let ranks = channel::run(3, ChannelOptions::default(), |mut endpoint| {
            let mut world = part_of_scene(&plan, endpoint.rank()).unwrap();
            let moves: Vec<Move> = plan.assignment.moves(&plan.assignment.shuffled(7)).filter(|_| moves).collect();
            hand_over(&moves, &mut world, &mut endpoint, round).unwrap();
            (world.hashes(), world.tiles().collect::<Vec<_>>())
        });
        ranks.into_iter().collect::<Result<_, _>>().unwrap()
    }

    #[test]
    fn rounds_of_any_size_bring_all_tiles() {
        let whole = |parts: &[(Hashes, Vec<TileId>)]| parts.iter().map(|part| part.0).reduce(Hashes::merge).unwrap();
        let (before, after) = (hashes(ROUND, false), hashes(ROUND, true));
        assert_eq!(whole(&before), whole(&after));
        assert!(before.iter().zip(&after).filter(|(before, after)| before.1 != after.1).count() >= 2);
        for round in [1, 10_000, 50_000] {
            assert_eq!(hashes(round, true), after, "rounds of {round} bytes");
        }
    }

    #[test]
    fn what_is_not_expected_cannot_be_read() {
        let block = [&4_u64.to_le_bytes()[..], &[1, 2, 3, 4]].concat();
        let read = |bytes: &[u8], tiles: &[u32]| {
            let mut expected = tiles.iter().copied().map(TileId).collect();
            blocks(bytes, &mut expected).map(|blocks| blocks.len())
        };
        assert_eq!(read(&[&block[..], &block].concat(), &[5, 6, 7]), Some(2));
        assert_eq!(read(&[&block[..], &block].concat(), &[5]), None);
        assert_eq!(read(&block[..11], &[5]), None);
        assert_eq!(read(&[9, 0, 0], &[5]), None);
        assert_eq!(read(&u64::MAX.to_le_bytes(), &[5]), None);
    }
}
