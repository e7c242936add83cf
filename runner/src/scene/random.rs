//! SplitMix64 (Steele, Lea and Flood 2014): the k-th number is a function of the seed and k, so a body's numbers can
//! be reached without drawing those of the bodies before it.

/// The state advances by this much per draw: 2^64 divided by the golden ratio, made odd.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// A stream of random numbers, the same on every machine.
#[derive(Clone, Debug)]
pub struct SplitMix64 {
    state: u64,
}

impl SplitMix64 {
    /// The stream of a seed, after `draws` numbers of it.
    pub fn after(seed: u64, draws: u64) -> Self {
        Self { state: seed.wrapping_add(GOLDEN.wrapping_mul(draws)) }
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(GOLDEN);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// True with probability 1/2. One draw.
    pub fn coin(&mut self) -> bool {
        self.bits() >> 63 == 1
    }

    /// Uniform in [0, `end`), for a positive `end`. One draw.
    ///
    /// 24 bits, as many as an `f32` holds: then the product never rounds up to `end` itself.
    pub fn below(&mut self, end: f32) -> f32 {
        const UNIT: f32 = 1.0 / (1 << 24) as f32;
        (self.bits() >> 40) as f32 * UNIT * end
    }

    /// Uniform in [-`reach`, `reach`). One draw.
    pub fn within(&mut self, reach: f64) -> f64 {
        const UNIT: f64 = 1.0 / (1_u64 << 53) as f64;
        ((self.bits() >> 11) as f64 * UNIT * 2.0 - 1.0) * reach
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_the_published_sequence() {
        let mut random = SplitMix64::after(1_234_567, 0);
        let drawn: [u64; 3] = std::array::from_fn(|_| random.bits());
        assert_eq!(drawn, [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]);
    }

    #[test]
    fn skipping_equals_drawing() {
        for seed in [0, 1, u64::MAX] {
            let mut drawn = SplitMix64::after(seed, 0);
            for draws in 0..1000 {
                assert_eq!(SplitMix64::after(seed, draws).bits(), drawn.bits(), "seed {seed}, draw {draws}");
            }
        }
    }

    #[test]
    fn numbers_stay_within_their_bounds() {
        let mut random = SplitMix64::after(7, 0);
        let mut heads = 0;
        for _ in 0..100_000 {
            heads += u32::from(random.coin());
            assert!((0.0..20.0).contains(&random.below(20.0)));
            assert!((-0.01..0.01).contains(&random.within(0.01)));
        }
        assert!((49_000..51_000).contains(&heads), "{heads}");
        for end in [5.0_f32, 16.0, 20.0] {
            let largest = ((1_u32 << 24) - 1) as f32 / (1 << 24) as f32 * end;
            assert!(largest < end);
        }
    }
}
