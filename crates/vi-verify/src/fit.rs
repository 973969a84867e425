//! Power laws `y = c x^a` by least squares of `log₂ y` against `log₂ x`, alone or with the next
//! term of an even expansion; lines; medians.

use std::f64::consts::LN_2;

use nalgebra::{DMatrix, DVector};

/// A fitted power law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerLaw {
    /// `a`.
    pub exponent: f64,
    /// Largest distance of a point from the law, in binary digits: `max |log₂ y − log₂ c x^a|`.
    pub spread: f64,
}

/// Fits `y = c x^a`; `None` with fewer than two different `x`, or where a number is not positive
/// and finite.
#[must_use]
pub fn power_law(points: impl IntoIterator<Item = [f64; 2]>) -> Option<PowerLaw> {
    let log = |v: f64| (v.is_finite() && v > 0.0).then(|| v.log2());
    let points: Option<Vec<[f64; 2]>> =
        points.into_iter().map(|[x, y]| Some([log(x)?, log(y)?])).collect();
    let points = points?;
    let line = line(&points)?;
    let spread = points.iter().map(|[x, y]| (y - line.at(*x)).abs()).fold(0.0, f64::max);
    Some(PowerLaw { exponent: line.slope, spread })
}

/// How well a point of an expansion is known apart from rounding, in binary digits.
const KNOWN: f64 = 0.05;

/// A power law with the next term of an even expansion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expansion {
    /// `a`.
    pub exponent: f64,
    /// `b`: what the next term adds at the largest `x`, in binary digits.
    pub correction: f64,
    /// Largest distance of a point, in binary digits.
    pub spread: f64,
}

/// Fits `log₂ y = log₂ c + a log₂ x + b (x/x_max)²`, the logarithm of `c x^a (1 + c' x² + …)` while
/// the second term is small. `None` with fewer than five points, or where a number is not positive
/// and finite.
///
/// Every `y` is known up to `± floor`: its weight is the inverse square of what the floor and the
/// expansion itself (`KNOWN`) leave open. The smallest `y` have the longest lever on `a`.
#[must_use]
pub fn expansion(points: &[[f64; 2]], floor: f64) -> Option<Expansion> {
    let usable = |v: f64| v.is_finite() && v > 0.0;
    if points.len() < 5 || !points.iter().flatten().all(|v| usable(*v)) {
        return None;
    }
    let largest = points.iter().map(|p| p[0]).fold(0.0, f64::max);
    let columns = DMatrix::from_fn(points.len(), 3, |i, j| {
        let x = points[i][0] / largest;
        [1.0, x.log2(), x * x][j]
    });
    let y = DVector::from_iterator(points.len(), points.iter().map(|p| p[1].log2()));
    let root = |p: &[f64; 2]| 1.0 / KNOWN.hypot((floor / p[1]).ln_1p() / LN_2);
    let weights =
        DMatrix::from_diagonal(&DVector::from_iterator(points.len(), points.iter().map(root)));
    let found = (&weights * &columns).svd(true, true).solve(&(weights * &y), 1e-12).ok()?;
    let spread = (columns * &found - y).amax();
    Some(Expansion { exponent: found[1], correction: found[2], spread })
}

/// A straight line by least squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineFit {
    /// Its slope.
    pub slope: f64,
    /// Mean of the points, which it passes through.
    pub middle: [f64; 2],
}

impl LineFit {
    /// Its height at `x`.
    #[must_use]
    pub fn at(&self, x: f64) -> f64 {
        self.middle[1] + self.slope * (x - self.middle[0])
    }
}

/// The line of least squares; `None` with fewer than two different `x`.
#[must_use]
pub fn line(points: &[[f64; 2]]) -> Option<LineFit> {
    let n = points.len() as f64;
    let sum = |f: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(f).sum::<f64>();
    let (mx, my) = (sum(&|p| p[0]) / n, sum(&|p| p[1]) / n);
    let width = sum(&|p| (p[0] - mx).powi(2));
    let usable = width > 0.0 && width.is_finite() && my.is_finite();
    if !usable {
        return None;
    }
    let slope = sum(&|p| (p[0] - mx) * (p[1] - my)) / width;
    Some(LineFit { slope, middle: [mx, my] })
}

/// The middle of some numbers; the lower one of two; `None` of none.
#[must_use]
pub fn median(numbers: Vec<f64>) -> Option<f64> {
    of_tenths(numbers, 5)
}

/// The least of some numbers that so many `tenths` of them do not exceed; `None` of none.
#[must_use]
pub fn of_tenths(mut numbers: Vec<f64>, tenths: usize) -> Option<f64> {
    numbers.sort_by(f64::total_cmp);
    numbers.get((tenths * numbers.len()).div_ceil(10).checked_sub(1)?).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(of_tenths((1..=20).map(f64::from).collect(), 9), Some(18.0));
        assert_eq!(median(Vec::new()), None);
    }

    #[test]
    fn a_power_law_is_found_exactly() {
        let fit = power_law((1..9).map(|k| [f64::from(k), 3.0 * f64::from(k).powf(-2.5)])).unwrap();
        assert!((fit.exponent + 2.5).abs() < 1e-12 && fit.spread < 1e-12, "{fit:?}");
    }

    #[test]
    fn the_spread_is_in_binary_digits() {
        let fit = power_law([[1.0, 1.0], [2.0, 4.0], [4.0, 4.0], [8.0, 16.0]]).unwrap();
        assert!((fit.exponent - 1.2).abs() < 1e-12, "{fit:?}"); // of (0,0), (1,2), (2,2), (3,4)
        assert!((fit.spread - 0.6).abs() < 1e-12, "{fit:?}");
    }

    #[test]
    fn the_next_term_is_told_apart() {
        let at = |k: i32| 0.5_f64.powi(k) * 0.3;
        let points: Vec<[f64; 2]> =
            (0..7).map(|k| [at(k), 5.0 * at(k).powi(6) * (1.0 + 4.0 * at(k).powi(2))]).collect();
        let (plain, found) =
            (power_law(points.iter().copied()).unwrap(), expansion(&points, 0.0).unwrap());
        println!("{plain:?}, {found:?}");
        assert!((found.exponent - 6.0).abs() < 0.01 && found.spread < 0.01, "{found:?}");
        assert!((plain.exponent - 6.0).abs() > 0.02 && found.correction > 0.2, "{plain:?}");
        assert_eq!(expansion(&points[..4], 0.0), None);
        assert_eq!(expansion(&[[1.0, 0.0]; 5], 0.0), None);
    }

    #[test]
    fn rounding_of_the_smallest_points_does_not_bend_the_exponent() {
        let floor = 1e-14;
        let at = |k: i32| 0.8_f64.powi(k);
        let law = |x: f64| 1e-6 * x.powi(8) * (1.0 - 0.5 * x * x);
        let points: Vec<[f64; 2]> = (0..)
            .map(at)
            .map(|x| [x, law(x) + 2.0 * floor])
            .take_while(|p| p[1] > 10.0 * floor)
            .collect();
        let off = |floor| (expansion(&points, floor).unwrap().exponent - 8.0).abs();
        println!("{} points: off by {:.3}, unweighted {:.3}", points.len(), off(floor), off(0.0));
        assert!(off(floor) < 0.1 && off(floor) < 0.7 * off(0.0));
    }

    #[test]
    fn nothing_is_fitted_to_one_point_to_zero_or_to_nan() {
        assert_eq!(power_law([[1.0, 1.0]]), None);
        assert_eq!(power_law([[1.0, 1.0], [1.0, 2.0]]), None);
        assert_eq!(power_law([[1.0, 0.0], [2.0, 1.0]]), None);
        assert_eq!(power_law([[1.0, f64::NAN], [2.0, 1.0]]), None);
    }
}
