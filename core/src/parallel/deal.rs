//! Jobs of different lengths, dealt to several hands.

/// Jobs in another order: cut into as many equal parts as there are hands, each begins with a part's longest jobs and ends with its
/// shortest, and all parts are about as long. So hands that take what others have left over, in the end, all end together.
pub(crate) fn dealt<T>(jobs: Vec<T>, length: impl Fn(&T) -> u64, hands: usize) -> Vec<T> {
    let mut order: Vec<(u64, usize)> = jobs.iter().map(length).zip(0..).collect();
    order.sort_unstable_by_key(|&(length, place)| (std::cmp::Reverse(length), place));
    let mut jobs: Vec<Option<T>> = jobs.into_iter().map(Some).collect();
    let mut dealt = Vec::with_capacity(jobs.len());
    for hand in 0..hands {
        for (round, hands) in order.chunks(hands).enumerate() {
            // There and back again: who gets the longer job in one round gets the shorter one in the next.
            let turn = if round % 2 == 0 { hand } else { hands.len().wrapping_sub(hand + 1) };
            dealt.extend(hands.get(turn).and_then(|&(_, place)| jobs[place].take()));
        }
    }
    dealt
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::cases;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(cases(256))]

        #[test]
        fn every_hand_is_dealt_as_much_and_the_longest_first(
            jobs in prop::collection::vec(0_u64..1000, 0..60), hands in 1_usize..9,
        ) {
            let numbered: Vec<(usize, u64)> = jobs.iter().copied().enumerate().collect();
            let dealt = dealt(numbered.clone(), |&(_, length)| length, hands);
            let mut again = dealt.clone();
            again.sort_unstable();
            prop_assert_eq!(again, numbered);
            // Parts end where jobs grow longer; no more of them than hands.
            let parts: Vec<u64> =
                dealt.chunk_by(|a, b| a.1 >= b.1).map(|part| part.iter().map(|job| job.1).sum()).collect();
            prop_assert!(parts.len() <= hands, "{} parts for {hands} hands", parts.len());
            if jobs.len().is_multiple_of(hands) {
                let sums: Vec<u64> =
                    dealt.chunks((jobs.len() / hands).max(1)).map(|part| part.iter().map(|job| job.1).sum()).collect();
                let (least, most) = (sums.iter().min().unwrap_or(&0), sums.iter().max().unwrap_or(&0));
                prop_assert!(most - least <= jobs.iter().copied().max().unwrap_or(0), "{sums:?}");
            }
        }
    }
}
