//! Piecewise cubic functions by values and rates at knots.
//!
//! ```text
//! x(t) = x_k + h s (r_k + s (c + s d)),   s = (t − t_k)/h,  h = t_{k+1} − t_k,  m = (x_{k+1} − x_k)/h
//! c = 3 m − 2 r_k − r_{k+1},   d = r_k + r_{k+1} − 2 m
//! ```

use vi_core::Number;

/// A piecewise cubic function with continuous rates.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Hermite<T = f64> {
    pub(crate) knots: Vec<[T; 3]>, // argument, value, rate
}

/// The ends of a spline.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SplineEnds<T = f64> {
    /// These rates.
    Clamped([T; 2]),
    /// No second derivative.
    Natural,
}

impl<T: Number> Hermite<T> {
    /// Rates with a continuous second derivative, by elimination; at least two points:
    ///
    /// ```text
    /// r_{k−1}/h_{k−1} + 2 (1/h_{k−1} + 1/h_k) r_k + r_{k+1}/h_k = 3 (Δ_{k−1}/h_{k−1}² + Δ_k/h_k²)
    /// natural ends   2 r_0 + r_1 = 3 Δ_0/h_0
    /// ```
    pub(crate) fn spline(points: impl Iterator<Item = [T; 2]>, ends: SplineEnds<T>) -> Self {
        let [zero, one, two, three] = [0.0, 1.0, 2.0, 3.0].map(T::of);
        let mut knots: Vec<[T; 3]> = points.map(|[t, x]| [t, x, zero]).collect();
        let n = knots.len();
        let slope = |a: [T; 3], b: [T; 3]| (b[1] - a[1]) / (b[0] - a[0]);
        // factor of the next rate, after elimination of the one before
        let mut lead = vec![zero; n];
        match ends {
            SplineEnds::Clamped(rates) => (knots[0][2], knots[n - 1][2]) = (rates[0], rates[1]),
            SplineEnds::Natural => {
                lead[0] = T::of(0.5);
                knots[0][2] = T::of(1.5) * slope(knots[0], knots[1]);
            }
        }
        for k in 1..n - 1 {
            let [before, own, next] = [k - 1, k, k + 1].map(|k| knots[k]);
            let (a, b) = (one / (own[0] - before[0]), one / (next[0] - own[0]));
            let right = three * (a * a * (own[1] - before[1]) + b * b * (next[1] - own[1]));
            let pivot = two * (a + b) - a * lead[k - 1];
            lead[k] = b / pivot;
            knots[k][2] = (right - a * before[2]) / pivot;
        }
        if matches!(ends, SplineEnds::Natural) {
            let [before, last] = [knots[n - 2], knots[n - 1]];
            let right = three * slope(before, last);
            knots[n - 1][2] = (right - before[2]) / (two - lead[n - 2]);
        }
        for k in (0..n - 1).rev().filter(|k| Number::real(lead[*k]) != 0.0) {
            let next = knots[k + 1][2];
            knots[k][2] -= lead[k] * next;
        }
        Self { knots }
    }

    /// Value, rate and second derivative; outside along the tangents at the ends.
    pub(crate) fn at(&self, t: f64) -> [T; 3] {
        let after = self.knots.partition_point(|knot| Number::real(knot[0]) <= t);
        if after == 0 || after == self.knots.len() {
            let [time, value, rate] = self.knots[after.saturating_sub(1)];
            return [value + rate * (T::of(t) - time), rate, T::of(0.0)];
        }
        cubic([self.knots[after - 1], self.knots[after]], T::of(t))
    }
}

impl Hermite {
    /// Rates that keep each interval monotone: weighted harmonic means of the slopes beside a knot,
    /// 0 at an extremum, three-point formulas at the ends (Fritsch & Carlson, SIAM J. Numer. Anal.
    /// 17 (1980) 238, with the means of Fritsch & Butland).
    pub(crate) fn monotone(points: impl Iterator<Item = [f64; 2]>) -> Self {
        let mut knots: Vec<[f64; 3]> = points.map(|[t, x]| [t, x, 0.0]).collect();
        let n = knots.len();
        let widths: Vec<f64> = knots.windows(2).map(|k| k[1][0] - k[0][0]).collect();
        let slopes: Vec<f64> =
            knots.windows(2).zip(&widths).map(|(k, h)| (k[1][1] - k[0][1]) / h).collect();
        if n == 2 {
            (knots[0][2], knots[1][2]) = (slopes[0], slopes[0]);
            return Self { knots };
        }
        for k in 1..n - 1 {
            let ([h0, h1], [m0, m1]) = ([widths[k - 1], widths[k]], [slopes[k - 1], slopes[k]]);
            if m0 * m1 > 0.0 {
                let (w0, w1) = (2.0 * h1 + h0, h1 + 2.0 * h0);
                knots[k][2] = (w0 + w1) / (w0 / m0 + w1 / m1);
            }
        }
        let end = |[h0, h1]: [f64; 2], [m0, m1]: [f64; 2]| {
            let rate = ((2.0 * h0 + h1) * m0 - h0 * m1) / (h0 + h1);
            match () {
                () if rate * m0 <= 0.0 => 0.0,
                () if m0 * m1 <= 0.0 && rate.abs() > 3.0 * m0.abs() => 3.0 * m0,
                () => rate,
            }
        };
        knots[0][2] = end([widths[0], widths[1]], [slopes[0], slopes[1]]);
        knots[n - 1][2] = end([widths[n - 2], widths[n - 3]], [slopes[n - 2], slopes[n - 3]]);
        Self { knots }
    }
}

/// Value, rate and second derivative at `t` of the cubic between two knots.
pub(crate) fn cubic<T: Number>([[t0, x0, r0], [t1, x1, r1]]: [[T; 3]; 2], t: T) -> [T; 3] {
    let [two, three, six] = [2.0, 3.0, 6.0].map(T::of);
    let h = t1 - t0;
    let s = (t - t0) / h;
    let slope = (x1 - x0) / h;
    // x0 + h s (r0 + s (c + s d))
    let (c, d) = (three * slope - two * r0 - r1, r0 + r1 - two * slope);
    [
        x0 + h * s * (r0 + s * (c + s * d)),
        r0 + s * (two * c + three * s * d),
        (two * c + six * s * d) / h,
    ]
}
