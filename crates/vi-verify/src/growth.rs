//! How an error grows with the number of steps.
//!
//! ```text
//! D(k) = sqrt( mean_n (x_{n+k} − x_n)² ) ~ k^a
//! a = 0     bounded: what is seen is the noise of the observation
//! a = 1/2   random walk: unbiased round-off, error ε√N
//! a = 1     drift: biased round-off, a loose tolerance, a scheme that does not conserve
//! ```
//! The mean over all pairs makes the exponent repeatable, which the path of a single random walk is
//! not.

use super::fit::power_law;
use serde::{Deserialize, Serialize};

/// Samples needed.
const SAMPLES: usize = 1024;
/// The largest exponent of unbiased round-off: 1/2, and what a single run scatters.
pub const UNBIASED: f64 = 0.6;

/// Growth of an error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Growth {
    /// The exponent `a` over the larger distances.
    pub exponent: f64,
    /// `max |x_n − x_0|`.
    pub drift: f64,
    /// Size that a random walk with these displacements has over the run.
    pub walk: f64,
}

impl Growth {
    /// Whether it grows no faster than round-off that adds up without bias: an exponent of at most
    /// 0.6, and no more in the end than four such random walks.
    #[must_use]
    pub fn is_unbiased(&self) -> bool {
        self.exponent <= UNBIASED && self.drift <= 4.0 * self.walk
    }
}

/// Why no growth can be read.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum NoGrowth {
    /// Fewer samples than needed.
    #[error("{samples} samples are too few: {needed} are needed")]
    TooFew {
        /// How many there are.
        samples: usize,
        /// How many are needed.
        needed: usize,
    },
    /// It never changes.
    #[error("conserved to the last bit")]
    Exact,
    /// A sample is not finite.
    #[error("a sample is not a number")]
    NotNumbers,
}

/// Reads the exponent from samples at equal numbers of steps.
///
/// # Errors
/// [`NoGrowth`].
pub fn growth(samples: &[f64]) -> Result<Growth, NoGrowth> {
    let count = samples.len();
    if count < SAMPLES {
        return Err(NoGrowth::TooFew { samples: count, needed: SAMPLES });
    }
    if samples.iter().any(|x| !x.is_finite()) {
        return Err(NoGrowth::NotNumbers);
    }
    let drift = samples.iter().map(|x| (x - samples[0]).abs()).fold(0.0, f64::max);
    if drift == 0.0 {
        return Err(NoGrowth::Exact);
    }
    // distances from 1/1024 to 1/64 of the run: of longer ones there are too few to average over
    let distances = (6..=10).rev().map(|k| count >> k);
    let law = power_law(distances.map(|k| [k as f64, displacement(samples, k)]));
    let exponent = law.ok_or(NoGrowth::Exact)?.exponent;
    let walk = displacement(samples, count >> 6) * 64_f64.sqrt();
    Ok(Growth { exponent, drift, walk })
}

/// `D(k)`.
fn displacement(samples: &[f64], k: usize) -> f64 {
    let pairs = samples.len() - k;
    let sum: f64 = samples.iter().zip(&samples[k..]).map(|(a, b)| (b - a) * (b - a)).sum();
    (sum / pairs as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A reproducible stream of numbers in (−1, 1).
    struct GrowthNoise(u64);
    impl GrowthNoise {
        fn next(&mut self) -> f64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    fn walk(seed: u64, count: usize, drift: f64) -> Vec<f64> {
        let (mut noise, mut x) = (GrowthNoise(seed), 3.0);
        for _ in 0..10 {
            noise.next();
        }
        (0..count)
            .map(|_| {
                x += 1e-15 * (noise.next() + drift);
                x
            })
            .collect()
    }

    #[test]
    fn a_random_walk_has_the_exponent_one_half() {
        let exponents: Vec<f64> =
            (1..=20).map(|seed| growth(&walk(seed * 7919, 4096, 0.0)).unwrap().exponent).collect();
        let mean = exponents.iter().sum::<f64>() / 20.0;
        println!("mean {mean:.3}, of {exponents:.2?}");
        assert!((mean - 0.5).abs() < 0.05, "{mean}");
        assert!(exponents.iter().all(|a| (0.4..UNBIASED).contains(a)), "{exponents:?}");
        let unbiased = |seed: u64| growth(&walk(seed * 7919, 4096, 0.0)).unwrap().is_unbiased();
        assert!((1..=20).all(unbiased));
    }

    #[test]
    fn a_drift_below_the_walk_is_seen_in_the_end() {
        let found = growth(&walk(5, 200_000, 0.02)).unwrap(); // hidden over 1/64 of the run
        assert!(!found.is_unbiased() && found.exponent < 0.9, "{found:?}");
    }

    #[test]
    fn a_drift_has_the_exponent_one() {
        let found = growth(&walk(5, 4096, 1.0)).unwrap();
        assert!((found.exponent - 1.0).abs() < 0.05, "{found:?}");
        let quadratic: Vec<f64> = (0..2000).map(|k| 1e-18 * f64::from(k * k)).collect();
        assert!(growth(&quadratic).unwrap().exponent > 0.95);
    }

    #[test]
    fn noise_about_a_constant_does_not_grow() {
        let mut noise = GrowthNoise(11);
        let x: Vec<f64> = (0..4096).map(|_| 3.0 + 1e-15 * noise.next()).collect();
        assert!(growth(&x).unwrap().exponent.abs() < 0.1);
    }

    #[test]
    fn constants_few_samples_and_nan_are_refused() {
        assert_eq!(growth(&[2.0; 1024]), Err(NoGrowth::Exact));
        assert!(matches!(growth(&[2.0, 3.0]), Err(NoGrowth::TooFew { .. })));
        let mut x = walk(3, 1024, 0.0);
        x[7] = f64::INFINITY;
        assert_eq!(growth(&x), Err(NoGrowth::NotNumbers));
    }
}
