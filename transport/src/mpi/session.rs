//! The state of one rank between initializing the library and finalizing it.

use std::time::Duration;

use super::control::Watch;
use super::raw::{Communicator, Least, Library, Place, Transfers};
use crate::{Rank, TransportError};

/// What a rank needs of the library. Dropped without [`leave`](Session::leave), it leaves the library as it is, and the
/// memory to it on which it is still at work.
pub(super) struct Session {
    library: Library,
    /// For the messages of rounds; notices have a communicator of their own.
    pub(super) data: Communicator,
    pub(super) watch: Watch,
    pub(super) least: Least,
    pub(super) transfers: Transfers,
    /// What ranks announce to each other, sent and received. Like the two below, this is memory kept between rounds.
    pub(super) records: [Vec<u64>; 2],
    /// The lengths that were announced to this rank.
    pub(super) lengths: Vec<usize>,
    /// Where messages are that nobody had announced.
    pub(super) places: Vec<(Rank, Place)>,
}

impl Session {
    /// Every rank makes this call, with its library just initialized.
    pub(super) fn new(library: Library, peer_timeout: Duration) -> Session {
        let data = Communicator::of_all_ranks(&library);
        let watch = Watch::new(Communicator::of_all_ranks(&library), peer_timeout);
        let least = Least::new(&library);
        Session {
            library,
            data,
            watch,
            least,
            transfers: Transfers::default(),
            records: Default::default(),
            lengths: Vec::new(),
            places: Vec::new(),
        }
    }

    /// Waits until every rank leaves, and finalizes the library.
    ///
    /// # Errors
    /// If another rank has given up or does not leave within the peer timeout. Then the library stays as it is.
    pub(super) fn leave(mut self) -> Result<(), TransportError> {
        if let Err(error) = self.watch.leave() {
            self.watch.give_up(&error);
            return Err(error);
        }
        self.watch.free();
        self.data.free();
        self.least.free();
        self.library.finalize();
        Ok(())
    }
}
