use super::*;
use crate::testing::cases;
use proptest::prelude::*;

fn sum(values: &[f64]) -> f64 {
    exact(values).value()
}

fn exact(values: &[f64]) -> ExactSum {
    let mut sum = ExactSum::default();
    values.iter().for_each(|&value| sum.add(value));
    sum
}

/// Any finite number; each exponent as often as any other.
fn finite() -> impl Strategy<Value = f64> {
    any::<u64>().prop_map(f64::from_bits).prop_filter("finite", |value| value.is_finite())
}

proptest! {
    #![proptest_config(cases(300))]

    #[test]
    fn one_number_is_its_own_sum(value in finite()) {
        // But for the sign of nothing.
        prop_assert_eq!(sum(&[value]).to_bits(), (value + 0.0).to_bits());
    }

    /// IEEE addition of two rounds once as well.
    #[test]
    fn two_numbers_are_added_as_the_processor_does(a in finite(), b in finite(), near in -60_i32..60) {
        prop_assert_eq!(sum(&[a, b]).to_bits(), (a + b + 0.0).to_bits());
        // Of two that are far apart one has no say.
        let close = b / 2.0_f64.powi(b.abs().log2() as i32) * 2.0_f64.powi((a.abs().log2() as i32 + near).clamp(-1000, 1000));
        if close.is_finite() {
            prop_assert_eq!(sum(&[a, close]).to_bits(), (a + close + 0.0).to_bits());
        }
    }

    /// Whole numbers of 2^-20 can be added exactly in 128 bits, and are rounded once by the conversion.
    #[test]
    fn sums_are_those_of_exact_arithmetic(parts in prop::collection::vec(-1_i64 << 53..1 << 53, 0..60)) {
        let unit = 2.0_f64.powi(-20);
        let values: Vec<f64> = parts.iter().map(|&part| part as f64 * unit).collect();
        let expected = parts.iter().map(|&part| i128::from(part)).sum::<i128>() as f64 * unit;
        prop_assert_eq!(sum(&values), expected);
    }

    #[test]
    fn neither_order_nor_grouping_shows(values in prop::collection::vec(finite(), 0..40), cut in any::<prop::sample::Index>()) {
        let all = exact(&values);
        let (first, second) = values.split_at(cut.index(values.len() + 1));
        let mut parts = exact(second);
        parts.merge(&exact(first));
        prop_assert_eq!(parts, all);
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        prop_assert_eq!(exact(&sorted), all);
        // What is taken away again leaves nothing behind.
        let mut none = all;
        values.iter().for_each(|value| none.add(-value));
        prop_assert_eq!(none, ExactSum::default());
    }
}

#[test]
fn sums_round_once_to_the_nearest_and_among_equals_to_the_even() {
    let (two_53, tiny) = (2.0_f64.powi(53), f64::from_bits(1));
    for (values, expected) in [
        (&[][..], 0.0),
        (&[1e16, 1.0, -1e16], 1.0),
        (&[two_53, 1.0], two_53),
        (&[two_53, 1.0, tiny], two_53 + 2.0),
        (&[two_53 + 2.0, 1.0], two_53 + 4.0),
        (&[two_53 + 2.0, 1.0, -tiny], two_53 + 2.0),
        (&[-two_53, -1.0, -tiny], -two_53 - 2.0),
        (&[two_53 * 2.0 - 1.0, 0.5], two_53 * 2.0),
        (&[f64::MAX, f64::MAX, -f64::MAX], f64::MAX),
        (&[f64::MAX, f64::MAX], f64::INFINITY),
        (&[-f64::MAX, -f64::MAX], f64::NEG_INFINITY),
        (&[f64::MIN_POSITIVE, -tiny], f64::MIN_POSITIVE - tiny),
        (&[tiny; 3], 3.0 * tiny),
        (&[f64::INFINITY, f64::MAX], f64::INFINITY),
        (&[1.0, f64::NEG_INFINITY], f64::NEG_INFINITY),
    ] {
        assert_eq!(sum(values), expected, "{values:?}");
    }
    assert!(sum(&[f64::INFINITY, f64::NEG_INFINITY]).is_nan() && sum(&[f64::NAN, 1.0]).is_nan());
    assert_eq!(sum(&[-0.0]).to_bits(), 0);
}

#[test]
fn what_comes_from_elsewhere_counts_as_well() {
    let mut infinite = exact(&[f64::INFINITY]);
    infinite.merge(&exact(&[-3.0]));
    assert_eq!(infinite.value(), f64::INFINITY);
    infinite.merge(&exact(&[f64::NEG_INFINITY]));
    assert!(infinite.value().is_nan());
    let largest = exact(&[f64::MAX; 1000]);
    let mut sum = exact(&[-f64::MAX; 999]);
    sum.merge(&largest);
    assert_eq!(sum.value(), f64::MAX);
}
