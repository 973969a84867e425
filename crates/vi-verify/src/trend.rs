//! Band and trend of the energy of a conservative system.
//!
//! ```text
//! band      [min H, max H]          bound    max |H_n − H_0|
//! variation max − min of sixteen block medians: of H, or of its shadow, whichever is smaller
//! change    slope of these medians by least squares, times the length of the run
//! widening  distance (root mean square, from the median of the first half) in the second half of the run
//!          over that in the first, as far as the excitation |H − shadow| does not widen, too
//! ```
//! A symplectic scheme makes the energy oscillate in a band. The width of the band depends on the
//! state, and where motion passes to faster vibrations it changes without secular drift. A secular
//! drift is in the energy and in its shadow ([`vi_core::shadow_energy`]), which hardly depends on
//! the state; one of the two without a drift is enough to exclude it. A median leaves out what a
//! short fast motion makes of a few samples; a drift moves it as it moves a mean. Where a step is
//! too coarse for a shadow energy, the energy itself may vary less.

use super::fit::{line, median};
use serde::{Deserialize, Serialize};

/// Blocks whose medians are compared.
const BLOCKS: usize = 16;
/// Samples needed.
const SAMPLES: usize = 4 * BLOCKS;
/// A variation of the block medians below this part of the band is none.
pub const NEGLIGIBLE: f64 = 0.05;

/// The second half may be farther away than the first by this factor.
pub const WIDENING: f64 = 1.5;

/// A bounded quantity over a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trend {
    /// Smallest and largest value.
    pub band: (f64, f64),
    /// `max |x_n − x_0|`.
    pub bound: f64,
    /// Largest less smallest block median.
    pub variation: f64,
    /// Their change over the run by the fitted line.
    pub change: f64,
    /// Distance in the second half over that in the first, beyond the excitation.
    pub widening: f64,
    /// Whether the medians are those of the shadow.
    pub of_shadow: bool,
}

/// Why a trend cannot be computed.
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
    /// There is not one shadow to each sample.
    #[error("{samples} samples and {shadow} of the shadow do not belong together")]
    Unequal {
        /// How many samples there are.
        samples: usize,
        /// How many of the shadow.
        shadow: usize,
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

    /// Whether the quantity is bounded: block medians vary by a negligible part of the band, and
    /// the second half is not farther away than the first by more than a half.
    #[must_use]
    pub fn is_bounded(&self) -> bool {
        self.variation <= NEGLIGIBLE * self.width() && self.widening <= WIDENING
    }
}

/// Band and trend of samples at equal distances, with their shadow: the samples again where there
/// is none.
///
/// # Errors
/// [`NoTrend`].
pub fn trend(samples: &[f64], shadow: &[f64]) -> Result<Trend, NoTrend> {
    if samples.len() != shadow.len() {
        return Err(NoTrend::Unequal { samples: samples.len(), shadow: shadow.len() });
    }
    if samples.len() < SAMPLES {
        return Err(NoTrend::TooFew { samples: samples.len(), needed: SAMPLES });
    }
    if samples.iter().chain(shadow).any(|x| !x.is_finite()) {
        return Err(NoTrend::NotNumbers);
    }
    let first = samples[0];
    // deviations from the start: a mean of large numbers would lose their difference
    let off: Vec<f64> = samples.iter().map(|x| x - first).collect();
    let shadow_off: Vec<f64> = shadow.iter().map(|x| x - first).collect();
    let band = range(&off);
    let (own, other) = (block_medians(&off), block_medians(&shadow_off));
    let variation = |medians: &[f64]| range(medians).1 - range(medians).0;
    let of_shadow = variation(&other) < variation(&own);
    let (still, medians) = if of_shadow { (&shadow_off, other) } else { (&off, own) };
    let points = (0_u32..).zip(&medians).map(|(k, median)| [f64::from(k), *median]);
    let fitted = line(&points.collect::<Vec<_>>());
    let fitted = fitted.ok_or(NoTrend::NotNumbers)?;
    let excitation: Vec<f64> = off.iter().zip(&shadow_off).map(|(x, s)| x - s).collect();
    let floor = NEGLIGIBLE * (band.1 - band.0); // distances below that are negligible
    Ok(Trend {
        band: (first + band.0, first + band.1),
        bound: band.1.max(-band.0),
        variation: variation(&medians),
        change: fitted.slope * medians.len() as f64,
        widening: widening(still, floor) / widening(&excitation, 0.0).max(1.0),
        of_shadow,
    })
}

fn range(x: &[f64]) -> (f64, f64) {
    x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |b, x| (b.0.min(*x), b.1.max(*x)))
}

fn block_medians(x: &[f64]) -> Vec<f64> {
    let size = x.len() / BLOCKS;
    let middle = |block: &[f64]| median(block.to_vec()).unwrap_or(0.0);
    x.chunks_exact(size).take(BLOCKS).map(middle).collect()
}

/// Root mean square distance from the median of the first half in the second half over that in the
/// first, both at least `floor`; 1 for a constant.
fn widening(x: &[f64], floor: f64) -> f64 {
    let (early, late) = x.split_at(x.len() / 2);
    let center = median(early.to_vec()).unwrap_or(0.0);
    let rms = |part: &[f64]| {
        (part.iter().map(|x| (x - center).powi(2)).sum::<f64>() / part.len() as f64).sqrt()
    };
    let [early, late] = [early, late].map(|part| rms(part).max(floor));
    if early > 0.0 || late > 0.0 { late / early } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(count: u32, x: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..count).map(|k| x(f64::from(k) / f64::from(count))).collect()
    }

    fn alone(x: &[f64]) -> Trend {
        trend(x, x).unwrap()
    }

    /// Numbers in ±1 that repeat.
    struct Noise(u64);

    impl Noise {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }

        /// A part `left` of the last value plus noise: a random walk for 1.
        fn correlated(&mut self, left: f64, count: usize) -> Vec<f64> {
            let mut x = 0.0;
            let step = |_| {
                x = left * x + self.next();
                x
            };
            (0..count).map(step).collect()
        }
    }

    #[test]
    fn an_oscillation_is_bounded() {
        let found =
            alone(&samples(4000, |t| 5.0 + 1e-3 * (1400.0 * t).sin() + 2e-4 * (571.3 * t).cos()));
        println!("{found:?}");
        assert!(found.is_bounded() && (found.width() - 2.4e-3).abs() < 1e-5, "{found:?}");
        assert!(found.bound < 1.5e-3 && found.relative() < 0.02, "{found:?}");
    }

    #[test]
    fn a_drift_is_found_below_a_larger_oscillation() {
        for drift in [4e-4, 1.6e-4] {
            let found = alone(&samples(4000, |t| 5.0 + 1e-3 * (400.0 * t).sin() + drift * t));
            assert!(!found.is_bounded() && (found.change - drift).abs() < 1e-5, "{found:?}");
        }
    }

    #[test]
    fn a_band_that_widens_is_not_bounded() {
        let found = alone(&samples(4000, |t| (1.0 + 3.0 * t) * (400.0 * t).sin()));
        assert!(!found.is_bounded() && found.widening > 1.5, "{found:?}");
    }

    /// The error of a scheme is the excitation, which grows fourfold and stays there.
    #[test]
    fn motion_that_passes_to_faster_vibrations_is_bounded() {
        let excitation = |t: f64| (4.0 - 3.0 * (-6.0 * t).exp()) * (1.0 + (900.0 * t).sin());
        let x = samples(4000, |t| 5.0 + 1e-3 * excitation(t));
        let shadow = samples(4000, |t| 5.0 + 2e-5 * excitation(t) * (123.0 * t).cos());
        let (found, unaided) = (trend(&x, &shadow).unwrap(), alone(&x));
        println!("{found:?}, without its shadow {unaided:?}");
        assert!(found.is_bounded() && !unaided.is_bounded());
        let drifting = |x: &[f64]| -> Vec<f64> {
            let drift = |(k, x): (usize, &f64)| x + 6e-4 * k as f64 / 4000.0;
            x.iter().enumerate().map(drift).collect()
        };
        let found = trend(&drifting(&x), &drifting(&shadow)).unwrap();
        assert!(!found.is_bounded(), "a drift of 8 % of the band is in both: {found:?}");
    }

    /// Two hundred stretches of an excitation that decorrelates in half of the run; the same plus a
    /// random walk that is a fifth as wide.
    #[test]
    fn random_walks_are_distinguished_from_excitations_that_come_and_go() {
        let mut noise = Noise(1);
        let [mut excited, mut unaided, mut walks, mut hidden] = [0; 4];
        for _ in 0..200 {
            let excitation = noise.correlated(0.9995, 4000);
            let (low, high) = range(&excitation);
            let quiet: Vec<f64> = (0..4000).map(|_| 0.01 * (high - low) * noise.next()).collect();
            let walk = noise.correlated(1.0, 4000);
            let (from, to) = range(&walk);
            let part = 0.2 * (high - low) / (to - from);
            let sum = |a: &[f64], b: &[f64]| -> Vec<f64> {
                a.iter().zip(b).map(|(a, b)| a + b).collect()
            };
            let step: Vec<f64> = walk.iter().map(|x| part * x).collect();
            let shadow = sum(&quiet, &step);
            let bounded = |x: &[f64], s: &[f64]| u32::from(trend(x, s).unwrap().is_bounded());
            excited += bounded(&sum(&quiet, &excitation), &quiet);
            unaided += bounded(&excitation, &excitation);
            walks += bounded(&walk, &walk);
            hidden += bounded(&sum(&shadow, &excitation), &shadow);
        }
        println!(
            "bounded of 200: excitations {excited}, without a shadow {unaided}, walks {walks}, hidden walks {hidden}"
        );
        assert_eq!((excited, walks), (200, 0));
        assert!(hidden <= 2 && unaided <= 20, "{hidden} {unaided}");
    }

    #[test]
    fn a_constant_is_bounded() {
        let found = alone(&samples(100, |_| 2.5));
        let still = found.width() == 0.0 && (found.widening - 1.0).abs() < 1e-15;
        assert!(found.is_bounded() && still, "{found:?}");
    }

    #[test]
    fn what_is_no_series_is_refused() {
        let refused = |x: &[f64], s: &[f64]| trend(x, s).unwrap_err();
        assert_eq!(refused(&[1.0; 63], &[1.0; 63]), NoTrend::TooFew { samples: 63, needed: 64 });
        assert_eq!(refused(&[1.0; 64], &[1.0; 63]), NoTrend::Unequal { samples: 64, shadow: 63 });
        let with_nan = samples(100, |t| if t > 0.5 { f64::NAN } else { t });
        assert_eq!(refused(&with_nan, &[1.0; 100]), NoTrend::NotNumbers);
        assert_eq!(refused(&[1.0; 100], &with_nan), NoTrend::NotNumbers);
    }
}
