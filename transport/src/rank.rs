//! The number of a rank, as a type of its own.

use std::fmt;

/// One participant of a run: a thread or a process, numbered `0 .. size`.
///
/// A newtype, so that a rank is not mistaken for a tile or for a length.
///
/// ```
/// use atoll_transport::Rank;
///
/// assert_eq!(Rank::from(3).index(), 3);
/// assert_eq!(format!("rank {}", Rank(3)), "rank 3");
/// assert_eq!(Rank::all(3).collect::<Vec<_>>(), [Rank(0), Rank(1), Rank(2)]);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Rank(pub u32);

impl Rank {
    /// The rank as an index into a table with one entry per rank.
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    /// The rank whose [`index`](Rank::index) this is.
    ///
    /// # Panics
    /// If `index` does not fit 32 bits.
    pub fn from_index(index: usize) -> Rank {
        Rank(u32::try_from(index).expect("a rank fits 32 bits"))
    }

    /// Every rank of a run of `size` ranks, ascending.
    ///
    /// # Panics
    /// If `size` does not fit 32 bits.
    pub fn all(size: usize) -> impl DoubleEndedIterator<Item = Rank> {
        (0..Rank::from_index(size).0).map(Rank)
    }
}

impl From<u32> for Rank {
    fn from(number: u32) -> Rank {
        Rank(number)
    }
}

impl fmt::Display for Rank {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
