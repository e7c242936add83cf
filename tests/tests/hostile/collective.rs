//! Messages within a collective call.

use crate::random::{below, noise, one_of, rounds};
use crate::tally::Tally;
use atoll::scene::SplitMix64;
use atoll_tests::fuzz;
use atoll_transport::TransportError;

/// Whoever sends what nobody expected is still there: nobody is lost, and nobody waited for.
fn kind(error: &TransportError) -> &'static str {
    match error {
        TransportError::Usage { .. } => "usage",
        TransportError::PeerLost { .. } => "peer lost",
        TransportError::Timeout { .. } => "timeout",
    }
}

#[test]
fn random_messages_within_a_collective_call() {
    let mut random = SplitMix64::after(3, 0);
    let mut tally = Tally::default();
    for _ in 0..rounds(5000) {
        // Who, into which call, and cut where; what is sent has the length that is expected, or one value more, or any.
        let mut bytes = noise(&mut random, 3);
        let reduction = bytes[1] % 5 == 4;
        let expected = if reduction { usize::from(bytes[0]) / 3 * 8 } else { 8 };
        bytes[2] *= random.coin() as u8;
        let any = below(&mut random, 100);
        let length = one_of(&mut random, &[0, expected, expected, expected + 8, any]);
        bytes.extend(noise(&mut random, length));
        fuzz::transport(&bytes).iter().for_each(|outcome| tally.count(outcome, kind));
    }
    tally.check(5, &["usage"]);
}
