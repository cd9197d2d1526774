//! Random numbers by counting: the number of a seed, a stream and an index, in any order; and steps
//! that spread points more evenly than chance does.
//!
//! Nothing is remembered between two numbers, so they don't depend on who asks first, nor on the
//! number of threads.
//!
//! Source: Philox4x32-10 of Salmon et al. 2011, doi:10.1145/2063384.2063405.

/// Steps of an additive recurrence that spreads points evenly over the unit cube, however many: point
/// i has the fractional parts of 1/2 + i times these. They are g^-1, g^-2 and g^-3, where g is the root of
/// g^4 = g + 1.
///
/// Source: Roberts 2018, *The unreasonable effectiveness of quasirandom sequences*.
pub const EVEN_STEPS: [f64; 3] = {
    const G: f64 = 1.220_744_084_605_759_5;
    [1.0 / G, 1.0 / (G * G), 1.0 / (G * G * G)]
};

/// Random numbers of one seed and stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Random {
    seed: u64,
    stream: u32,
}

impl Random {
    /// The numbers of `seed`; those of different streams have nothing to do with one another.
    #[must_use]
    pub const fn new(seed: u64, stream: u32) -> Self {
        Self { seed, stream }
    }

    /// Two numbers, uniform from 0 up to but not including 1, in steps of 2^-53.
    #[must_use]
    pub fn uniform(&self, index: u64) -> [f64; 2] {
        let counter = [index as u32, (index >> 32) as u32, self.stream, 0];
        let [a, b, c, d] = philox(counter, [self.seed as u32, (self.seed >> 32) as u32]);
        [[a, b], [c, d]].map(|[low, high]| {
            let bits = u64::from(high) << 32 | u64::from(low);
            (bits >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
        })
    }
}

/// Ten rounds of Philox.
fn philox(mut counter: [u32; 4], mut key: [u32; 2]) -> [u32; 4] {
    for _ in 0..10 {
        let [low, high] = [(0xD251_1F53, counter[0]), (0xCD9E_8D57, counter[2])]
            .map(|(factor, word): (u32, u32)| u64::from(factor) * u64::from(word));
        counter = [
            (high >> 32) as u32 ^ counter[1] ^ key[0],
            high as u32,
            (low >> 32) as u32 ^ counter[3] ^ key[1],
            low as u32,
        ];
        key = [key[0].wrapping_add(0x9E37_79B9), key[1].wrapping_add(0xBB67_AE85)];
    }
    counter
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_answers() {
        // From the authors' library, Random123, file kat_vectors.
        assert_eq!(philox([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
        assert_eq!(
            philox([u32::MAX; 4], [u32::MAX; 2]),
            [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]
        );
        assert_eq!(
            philox(
                [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344],
                [0xa409_3822, 0x299f_31d0]
            ),
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
        );
    }

    #[test]
    fn even_steps_are_powers_of_the_root() {
        for (step, power) in EVEN_STEPS.into_iter().zip(1..) {
            let root = step.powf(-1.0 / f64::from(power));
            assert!((root.powi(4) - root - 1.0).abs() < 1e-12, "{root}");
        }
    }

    #[test]
    fn numbers_are_spread_evenly() {
        let random = Random::new(7, 1);
        let mut counts = [0_u32; 16];
        let mut product = 0.0;
        for index in 0..16_000 {
            let [a, b] = random.uniform(index);
            counts[(a * 16.0) as usize] += 1;
            product += (a - 0.5) * (b - 0.5);
        }
        // Each count has a standard deviation of 31, the mean product one of 6.6e-4.
        assert!(counts.iter().all(|count| count.abs_diff(1000) < 150), "{counts:?}");
        assert!((product / 16_000.0_f64).abs() < 3e-3);
        assert_ne!(random.uniform(3), Random::new(7, 2).uniform(3));
        assert_ne!(random.uniform(3), Random::new(8, 1).uniform(3));
    }
}
