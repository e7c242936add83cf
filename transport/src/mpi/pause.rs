//! What a rank does between two looks at whether something has arrived.

use std::thread;
use std::time::Duration;

/// Waits shorter than this never sleep, so that a round of ranks that are even takes no longer than the library needs.
/// They yield, so that a rank which shares a core with this one can get on.
const AWAKE: Duration = Duration::from_millis(1);

/// The longest sleep.
const LONGEST_NAP: Duration = Duration::from_millis(1);

/// A sleep is at most this part of the time waited so far, and lengthens the wait by no more than that.
const SHARE: u32 = 16;

/// The slowest that bytes are expected to move, per second. While they move the library has to be asked without a pause:
/// it moves them only then, in pieces.
const SLOWEST: f64 = 500e6;

/// How long a wait is, beyond its usual beginning, that has so many bytes to move.
pub(super) fn awake(bytes: usize) -> Duration {
    Duration::from_secs_f64(bytes as f64 / SLOWEST)
}

/// How long to sleep after having waited so long; none at first.
fn nap(waited: Duration) -> Option<Duration> {
    (waited >= AWAKE).then(|| LONGEST_NAP.min(waited / SHARE))
}

/// Gives others the core for a while.
pub(super) fn pause(waited: Duration) {
    match nap(waited) {
        None => thread::yield_now(),
        Some(nap) => thread::sleep(nap),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wait_stays_awake_in_proportion_to_what_it_moves() {
        assert_eq!(awake(0), Duration::ZERO);
        assert_eq!(awake(500), Duration::from_micros(1));
    }

    #[test]
    fn sleep_is_a_small_part_of_a_wait_and_bounded() {
        assert_eq!(nap(Duration::ZERO), None);
        assert_eq!(nap(AWAKE - Duration::from_nanos(1)), None);
        assert_eq!(nap(AWAKE), Some(AWAKE / SHARE));
        assert_eq!(nap(Duration::from_secs(60)), Some(LONGEST_NAP));
        let waits = (1..1000).map(|step| Duration::from_micros(step * 100));
        assert!(waits.filter_map(|waited| Some((waited, nap(waited)?))).all(|(waited, nap)| nap * SHARE <= waited));
    }
}
