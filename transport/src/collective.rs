//! What all ranks do together, built on [`Transport::exchange`].

use crate::{Incoming, Rank, Transport, TransportError};

/// Barrier, gathers and ordered reductions, for every [`Transport`].
///
/// Each call is one exchange: every rank makes the same call at the same place. Results are combined in rank order, so
/// they have the same bits on every rank, on every backend and in every run. (An MPI library chooses the order of its
/// own reductions, and a floating-point sum depends on it.)
///
/// A round that was prepared and not exchanged is discarded. The results are allocated, so inner loops put what they
/// have to say into their own messages instead. The cost grows with the square of the number of ranks: right for
/// hundreds of them, at the start and the end of a run and now and then in between.
///
/// ```
/// use atoll_transport::{Collective, Transport, channel};
///
/// let sums = channel::run(4, channel::ChannelOptions::default(), |mut endpoint| {
///     let share = 0.1 * f64::from(endpoint.rank().0);
///     endpoint.all_reduce_f64_in_rank_order(&[share], |sum, next| sum + next)
/// });
/// for sum in sums {
///     assert_eq!(sum.unwrap()?, [0.0 + 0.1 * 1.0 + 0.1 * 2.0 + 0.1 * 3.0]);
/// }
/// # Ok::<(), atoll_transport::TransportError>(())
/// ```
pub trait Collective: Transport {
    /// Returns when every rank has called it.
    fn barrier(&mut self) -> Result<(), TransportError> {
        spread(self, None, &[]).map(drop)
    }

    /// Brings the bytes of every rank to `root`, which gets them in rank order; the other ranks get `None`.
    ///
    /// # Errors
    /// [`Usage`](TransportError::Usage), and nothing is sent, if there is no rank `root`.
    fn gather(&mut self, root: Rank, bytes: &[u8]) -> Result<Option<Vec<Vec<u8>>>, TransportError> {
        if root.index() >= self.size() {
            return Err(TransportError::usage(format!(
                "rank {}: gather to rank {root}, but the run has ranks 0 to {}; pass one of these, the same everywhere",
                self.rank(),
                self.size() - 1
            )));
        }
        let incoming = spread(self, Some(root), bytes)?;
        Ok((self.rank() == root).then(|| to_vectors(&incoming)))
    }

    /// Brings the bytes of every rank to every rank, in rank order.
    fn all_gather(&mut self, bytes: &[u8]) -> Result<Vec<Vec<u8>>, TransportError> {
        spread(self, None, bytes).map(|incoming| to_vectors(&incoming))
    }

    /// Folds the values of all ranks, element by element, from rank 0 upward:
    /// `combine(combine(rank 0, rank 1), rank 2)` and so on.
    ///
    /// # Errors
    /// [`Usage`](TransportError::Usage), on every rank, if the ranks gave different numbers of values.
    fn all_reduce_f64_in_rank_order(
        &mut self,
        values: &[f64],
        combine: impl Fn(f64, f64) -> f64,
    ) -> Result<Vec<f64>, TransportError> {
        let own: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        reduce(self, &own, f64::from_le_bytes, combine)
    }

    /// The sum of `value` over all ranks, modulo 2^64.
    fn all_sum_u64(&mut self, value: u64) -> Result<u64, TransportError> {
        reduce_u64(self, value, u64::wrapping_add)
    }

    /// The greatest `value` of all ranks.
    fn all_max_u64(&mut self, value: u64) -> Result<u64, TransportError> {
        reduce_u64(self, value, u64::max)
    }

    /// The least `value` of all ranks.
    fn all_min_u64(&mut self, value: u64) -> Result<u64, TransportError> {
        reduce_u64(self, value, u64::min)
    }
}

impl<T: Transport + ?Sized> Collective for T {}

/// Sends `bytes` to `root`, or to every rank where there is none.
fn spread<T: Transport + ?Sized>(
    transport: &mut T,
    root: Option<Rank>,
    bytes: &[u8],
) -> Result<Incoming, TransportError> {
    let receives = |rank: Rank| root.is_none_or(|root| root == rank);
    let lengths: Vec<usize> =
        Rank::all(transport.size()).map(|rank| if receives(rank) { bytes.len() } else { 0 }).collect();
    for (rank, frame) in transport.prepare(&lengths)?.iter_mut() {
        if receives(rank) {
            frame.copy_from_slice(bytes);
        }
    }
    let mut incoming = Incoming::default();
    transport.exchange(&mut incoming)?;
    Ok(incoming)
}

fn to_vectors(incoming: &Incoming) -> Vec<Vec<u8>> {
    incoming.iter().map(|(_, frame)| frame.to_vec()).collect()
}

/// All-gathers values of eight bytes and folds them in rank order.
fn reduce<T: Transport + ?Sized, V: Copy>(
    transport: &mut T,
    own: &[u8],
    decode: impl Fn([u8; 8]) -> V,
    combine: impl Fn(V, V) -> V,
) -> Result<Vec<V>, TransportError> {
    let incoming = spread(transport, None, own)?;
    // Compared with rank 0, not with the own count: then either every rank finds a difference or none does.
    let expected = incoming.from(Rank(0)).len();
    if let Some((rank, frame)) = incoming.iter().find(|(_, frame)| frame.len() != expected) {
        return Err(TransportError::usage(format!(
            "reduction of {} values on rank 0 and {} on rank {rank}; give as many values on every rank",
            expected / 8,
            frame.len() / 8,
        )));
    }
    let values = |frame: &[u8]| -> Vec<V> { frame.as_chunks::<8>().0.iter().map(|&chunk| decode(chunk)).collect() };
    let mut folded = values(incoming.from(Rank(0)));
    for (_, frame) in incoming.iter().skip(1) {
        for (total, value) in folded.iter_mut().zip(values(frame)) {
            *total = combine(*total, value);
        }
    }
    Ok(folded)
}

fn reduce_u64<T: Transport + ?Sized>(
    transport: &mut T,
    value: u64,
    combine: impl Fn(u64, u64) -> u64,
) -> Result<u64, TransportError> {
    let folded = reduce(transport, &value.to_le_bytes(), u64::from_le_bytes, combine)?;
    folded.first().copied().ok_or_else(|| {
        TransportError::usage(
            "reduction of one value that rank 0 did not take part in; make the same call on every rank",
        )
    })
}
