//! How long a rank has waited for others, as far as they could have come.

use std::time::{Duration, Instant};

/// The most that counts between two looks, which are far closer together. Where more has passed, this rank was stopped,
/// perhaps with its whole machine, and others had no more time than this one to do what it waits for.
const MOST_AT_ONCE: Duration = Duration::from_millis(100);

/// A clock that a rank looks at again and again while it waits. It stands still while the rank is stopped, so that no
/// rank gives others up when it goes on before they do.
#[derive(Debug)]
pub(crate) struct Patience {
    waited: Duration,
    looked: Instant,
}

impl Patience {
    /// The wait begins.
    pub(crate) fn new() -> Patience {
        Patience { waited: Duration::ZERO, looked: Instant::now() }
    }

    /// How long it has lasted.
    pub(crate) fn waited(&mut self) -> Duration {
        let now = Instant::now();
        self.waited += (now - self.looked).min(MOST_AT_ONCE);
        self.looked = now;
        self.waited
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread::sleep;

    #[test]
    fn time_counts_but_a_stop_counts_little() {
        let mut patience = Patience::new();
        sleep(2 * MOST_AT_ONCE);
        assert_eq!(patience.waited(), MOST_AT_ONCE);
        sleep(MOST_AT_ONCE / 10);
        assert!(patience.waited() >= MOST_AT_ONCE + MOST_AT_ONCE / 10);
    }
}
