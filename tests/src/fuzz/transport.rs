//! What a rank makes of the bytes that another one sent where it expected something else.

use super::Outcome;
use atoll_transport::channel::{self, Channel, ChannelOptions};
use atoll_transport::{Collective, Incoming, Rank, Transport, TransportError};

/// Ranks of a run: one that intrudes, and honest ones.
const RANKS: usize = 3;

/// A collective call, and its result as bytes.
fn call(endpoint: &mut Channel, which: u8, values: &[f64]) -> Result<Vec<u8>, TransportError> {
    let flat = |parts: Vec<Vec<u8>>| parts.concat();
    Ok(match which % 5 {
        0 => endpoint.all_sum_u64(7)?.to_le_bytes().to_vec(),
        1 => endpoint.all_max_u64(7)?.to_le_bytes().to_vec(),
        2 => endpoint.all_min_u64(7)?.to_le_bytes().to_vec(),
        3 => flat(endpoint.all_gather(b"seven")?),
        _ => {
            let sums = endpoint.all_reduce_f64_in_rank_order(values, |sum, next| sum + next)?;
            sums.into_iter().flat_map(|sum| sum.to_bits().to_le_bytes()).collect()
        }
    })
}

/// The round of a rank that does not take part in the call of the others but sends bytes of its own: the same to all,
/// or a part to those below it and the rest to those above.
fn intrude(endpoint: &mut Channel, bytes: &[u8], cut: Option<usize>) -> Result<(), TransportError> {
    let own = endpoint.rank();
    let part = |to: Rank| match cut {
        None => bytes,
        Some(cut) if to < own => &bytes[..cut],
        Some(cut) => &bytes[cut..],
    };
    let lengths: Vec<usize> = Rank::all(RANKS).map(|to| part(to).len()).collect();
    for (to, buffer) in endpoint.prepare(&lengths)?.iter_mut() {
        buffer.copy_from_slice(part(to));
    }
    endpoint.exchange(&mut Incoming::default())
}

/// The first three bytes say who sends the others, into which call, and how they are shared out. The honest ranks get
/// a result or an error of one line, the same on all of them where all were sent the same, and can go on afterwards. Says
/// what became of it on each of them.
pub fn transport(bytes: &[u8]) -> Vec<Outcome<TransportError>> {
    let [who, which, cut, sent @ ..] = bytes else { return Vec::new() };
    let intruder = Rank(u32::from(*who) % RANKS as u32);
    let cut = (*cut != 0).then(|| usize::from(*cut) % (sent.len() + 1));
    let values = vec![0.5; usize::from(*who) / RANKS];
    let results = channel::run(RANKS, ChannelOptions::default(), |mut endpoint| {
        let result = if endpoint.rank() == intruder {
            intrude(&mut endpoint, sent, cut).map(|()| Vec::new())
        } else {
            call(&mut endpoint, *which, &values)
        };
        endpoint.barrier().expect("a call that was refused leaves the endpoint usable");
        result
    });
    let mut results: Vec<_> = results.into_iter().map(|result| result.expect("no rank panics")).collect();
    assert_eq!(results.remove(intruder.index()), Ok(Vec::new()), "whoever sends anything has sent it");
    if cut.is_none() {
        assert!(results.windows(2).all(|pair| pair[0] == pair[1]), "honest ranks disagree: {results:?}");
    }
    results.into_iter().map(Outcome::of).collect()
}
