//! Band and trend of a quantity that should stay where it is: the energy of a conservative system.
//!
//! ```text
//! band     [min x, max x]          bound    max |x_n − x_0|
//! change   slope of the block means by least squares, times the length of the run
//! widening distance (root mean square, from the median of the first half) in the second half of the run
//!          over that in the first: of all samples, or the median of short blocks, whichever is smaller
//! ```
//! A symplectic scheme makes the energy oscillate in a band without a trend. Block means take the
//! oscillation out; what is left scatters, and a change that is not larger than this scatter, or a
//! small part of the band, is none. The error is a function of the state: in a chaotic motion there are
//! phases in which it is several times as large, and it comes back. What accumulates does not come back, so
//! that the second half as a whole is farther away, and so are most blocks of it; a few phases, which come when
//! they come, are not most, and blocks shorter than an oscillation are not the whole.

use super::fit::line;
use serde::{Deserialize, Serialize};

/// Blocks whose means are fitted.
const BLOCKS: usize = 16;
/// Blocks whose distances are compared: short beside the phases of a chaotic motion.
const SHORT_BLOCKS: usize = 4 * BLOCKS;
/// A change below this part of the band is none.
pub const NEGLIGIBLE: f64 = 0.05;

/// A bounded quantity over a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trend {
    /// Smallest and largest value.
    pub band: (f64, f64),
    /// `max |x_n − x_0|`.
    pub bound: f64,
    /// Change over the run by the fitted line.
    pub change: f64,
    /// Twice its standard error, from the scatter of the block means.
    pub scatter: f64,
    /// Root mean square distance from the median of the first half in the second half over that in the
    /// first; or the same of the median block, if that is smaller.
    pub widening: f64,
}

/// Why there is no trend to speak of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum NoTrend {
    /// Fewer samples than needed.
    #[error("{samples} samples are too few: {needed} are needed")]
    TooFew {
        /// How many there are.
        samples: usize,
        /// How many are needed.
        needed: usize,
    },
    /// A sample is not finite.
    #[error("a sample is not a number")]
    NotNumbers,
}

impl Trend {
    /// Width of the band.
    #[must_use]
    pub fn width(&self) -> f64 {
        self.band.1 - self.band.0
    }

    /// `|change|` over the width of the band; 0 for a constant.
    #[must_use]
    pub fn relative(&self) -> f64 {
        if self.width() > 0.0 { self.change.abs() / self.width() } else { 0.0 }
    }

    /// Whether the quantity stays: its change is within its scatter or negligible, and most
    /// of the second half is not farther away by more than a half than most of the first.
    #[must_use]
    pub fn is_bounded(&self) -> bool {
        let still = self.relative() <= NEGLIGIBLE || self.change.abs() <= self.scatter;
        still && self.widening <= 1.5
    }
}

/// Band and trend of samples at equal distances.
///
/// # Errors
/// [`NoTrend`].
pub fn trend(samples: &[f64]) -> Result<Trend, NoTrend> {
    let needed = SHORT_BLOCKS;
    if samples.len() < needed {
        return Err(NoTrend::TooFew { samples: samples.len(), needed });
    }
    if samples.iter().any(|x| !x.is_finite()) {
        return Err(NoTrend::NotNumbers);
    }
    let band = |part: &[f64]| {
        part.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |b, x| (b.0.min(*x), b.1.max(*x)))
    };
    let first = samples[0];
    let size = samples.len() / BLOCKS;
    let means: Vec<(f64, f64)> = samples
        .chunks_exact(size)
        .enumerate()
        // deviations from the start: a mean of large numbers would lose their difference
        .map(|(k, block)| (k as f64, block.iter().map(|x| x - first).sum::<f64>() / size as f64))
        .collect();
    let blocks = means.len() as f64;
    let fitted = line(&means).ok_or(NoTrend::NotNumbers)?;
    let (early, late) = samples.split_at(samples.len() / 2);
    let center = median(early.iter().map(|x| x - first));
    let square = |x: &f64| (x - first - center).powi(2);
    let rms = |part: &[f64]| (part.iter().map(square).sum::<f64>() / part.len() as f64).sqrt();
    let short = samples.len() / SHORT_BLOCKS;
    let most = |part: &[f64]| median(part.chunks_exact(short).map(rms));
    let widening = ratio(rms(late), rms(early)).min(ratio(most(late), most(early)));
    Ok(Trend {
        band: band(samples),
        bound: samples.iter().map(|x| (x - first).abs()).fold(0.0, f64::max),
        change: fitted.slope * blocks,
        scatter: 2.0 * fitted.error * blocks,
        widening,
    })
}

/// `a/b`; 1 for zero over zero.
fn ratio(a: f64, b: f64) -> f64 {
    if a > 0.0 || b > 0.0 { a / b } else { 1.0 }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(count: u32, x: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..count).map(|k| x(f64::from(k) / f64::from(count))).collect()
    }

    #[test]
    fn an_oscillation_is_bounded() {
        let x = samples(4000, |t| 5.0 + 1e-3 * (400.0 * t).sin() + 2e-4 * (71.3 * t).cos());
        let found = trend(&x).unwrap();
        println!("{found:?}");
        assert!(found.is_bounded() && (found.width() - 2.4e-3).abs() < 1e-5, "{found:?}");
        assert!(found.bound < 1.5e-3 && found.relative() < 0.02, "{found:?}");
    }

    #[test]
    fn a_drift_is_found_below_a_larger_oscillation() {
        let x = samples(4000, |t| 5.0 + 1e-3 * (400.0 * t).sin() + 4e-4 * t);
        let found = trend(&x).unwrap();
        assert!(!found.is_bounded() && (found.change - 4e-4).abs() < 1e-5, "{found:?}");
    }

    #[test]
    fn a_band_that_widens_is_not_bounded() {
        let found = trend(&samples(4000, |t| (1.0 + 3.0 * t) * (400.0 * t).sin())).unwrap();
        assert!(!found.is_bounded() && found.widening > 1.5, "{found:?}");
    }

    /// Three phases of fivefold error, all in the second half.
    #[test]
    fn phases_that_come_back_are_bounded() {
        let phase = |t: f64| [0.55, 0.7, 0.92].iter().any(|s| (t - s).abs() < 0.03);
        let x = samples(4000, |t| if phase(t) { 5.0 } else { 1.0 } * (400.0 * t).sin());
        let found = trend(&x).unwrap();
        println!("{found:?}");
        assert!(found.is_bounded() && found.widening < 1.1, "{found:?}");
    }

    /// Of forty walks of ±1 most are found, by their change or their widening.
    #[test]
    fn walks_are_not_bounded() {
        let mut seed = 1_u64;
        let mut coin = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            if seed >> 63 == 0 { 1.0 } else { -1.0 }
        };
        let mut found = 0;
        for _ in 0..40 {
            let mut x = 0.0;
            let walk: Vec<f64> = (0..4000)
                .map(|_| {
                    x += coin();
                    x
                })
                .collect();
            found += u32::from(!trend(&walk).unwrap().is_bounded());
        }
        println!("{found} of 40 walks found");
        assert!(found >= 31, "{found}");
    }

    #[test]
    fn a_constant_is_bounded() {
        let found = trend(&samples(100, |_| 2.5)).unwrap();
        let still = found.width() == 0.0 && (found.widening - 1.0).abs() < 1e-15;
        assert!(found.is_bounded() && still, "{found:?}");
    }

    #[test]
    fn too_few_samples_and_nan_are_refused() {
        assert_eq!(trend(&[1.0; 63]), Err(NoTrend::TooFew { samples: 63, needed: 64 }));
        let with_nan = samples(100, |t| if t > 0.5 { f64::NAN } else { t });
        assert_eq!(trend(&with_nan), Err(NoTrend::NotNumbers));
    }
}
