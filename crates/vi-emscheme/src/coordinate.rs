//! The discrete derivative of a joint coordinate.
//!
//! ```text
//! length   D̄u = Du(q_{n+1/2})                                      u = a·r is quadratic
//! angle    θ = atan2(s, c):    ψ = Δθ = atan2(c_n Δs − s_n Δc, c_n c_{n+1} + s_n s_{n+1})
//!          D̄θ = κ [c̄ Ds(q_{n+1/2}) − s̄ Dc(q_{n+1/2})],    κ = (ψ/sin ψ)/(r_n r_{n+1}),   r² = s² + c²
//! ```
//! Bars: means of both ends. `Ds(q_{n+1/2})·Δq = Δs` exactly, and `c̄ Δs − s̄ Δc = r_n r_{n+1} sin ψ`, so
//! `D̄θ·Δq = Δθ` for steps of any length below half a turn. `s`, `c`, `u` are products of vectors fixed
//! in bodies, so `D̄` has no resultant force or moment at the averaged vectors: what acts along a joint
//! coordinate changes no momentum. Derivatives by `q_{n+1}` are exact off the constraint manifold too.
//!
//! Letters: `s, c` sine and cosine rows, `ψ` the turn of the step. Source: the construction of G96 with
//! the invariants `s`, `c`; the formula is ours.

use vi_core::interval::Interval;
use vi_core::sparse::Entries;
use vi_multibody::form::Row;
use vi_multibody::joint_coordinate::{JointCoordinate, Value};

/// `Dg(q_{n+1/2})·Δq = Δg` of a product of forms, to its own relative precision.
fn change(row: &Row, s: &Interval) -> f64 {
    let mut sum = 0.0;
    row.for_each_slope(&s.q_mid, |i, slope| sum += slope * s.dq[i]);
    sum
}

/// `ψ/sin ψ` and its derivative.
fn turn_factor(psi: f64) -> (f64, f64) {
    let square = psi * psi;
    if square < 1e-4 {
        // ψ/sin ψ = 1 + ψ²/6 + 7ψ⁴/360 + 31ψ⁶/15120 + …
        let value = 1.0 + square * (1.0 / 6.0 + square * (7.0 / 360.0 + square * 31.0 / 15120.0));
        let slope = psi * (1.0 / 3.0 + square * (7.0 / 90.0 + square * 31.0 / 2520.0));
        return (value, slope);
    }
    let (sin, cos) = libm::sincos(psi);
    (psi / sin, (sin - psi * cos) / (sin * sin))
}

/// An angle over an interval.
struct Turn<'a> {
    rows: [&'a Row; 2],  // s, c
    factors: [f64; 2],   // D̄θ = factors[0] Ds + factors[1] Dc at q_{n+1/2}
    kappa: f64,          // κ
    kappa_end: [f64; 2], // ∂κ/∂(s, c) at q_{n+1}
}

impl<'a> Turn<'a> {
    fn over((sine, cosine): (&'a Row, &'a Row), s: &Interval) -> Self {
        let (s0, c0) = (sine.value(&s.q0), cosine.value(&s.q0));
        let (ds, dc) = (change(sine, s), change(cosine, s));
        let (s1, c1) = (s0 + ds, c0 + dc);
        let psi = libm::atan2(c0 * ds - s0 * dc, c0 * c1 + s0 * s1);
        let (r0, square) = (libm::hypot(s0, c0), s1 * s1 + c1 * c1);
        let (factor, slope) = turn_factor(psi);
        let length = r0 * square.sqrt();
        let kappa = factor / length;
        let by_psi = slope / (length * square);
        Self {
            rows: [sine, cosine],
            factors: [kappa * (c0 + 0.5 * dc), -kappa * (s0 + 0.5 * ds)],
            kappa,
            kappa_end: [by_psi * c1 - kappa * s1 / square, -by_psi * s1 - kappa * c1 / square],
        }
    }

    fn for_each_slope(&self, s: &Interval, mut visit: impl FnMut(usize, f64)) {
        for (row, factor) in self.rows.iter().zip(self.factors) {
            row.for_each_slope(&s.q_mid, |i, slope| visit(i, factor * slope));
        }
    }

    fn emit_derivative(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        let half = 0.5 * scale * self.kappa;
        let along = self.factors.map(|factor| scale * factor / self.kappa); // c̄, −s̄
        let weights = [
            [along[0] * self.kappa_end[0], along[0] * self.kappa_end[1] + half],
            [along[1] * self.kappa_end[0] - half, along[1] * self.kappa_end[1]],
        ];
        for (left, weights) in self.rows.iter().zip(weights) {
            for (right, weight) in self.rows.iter().zip(weights) {
                left.for_each_slope(&s.q_mid, |i, a| {
                    right.for_each_slope(&s.q1, |j, b| out.add(i, j, weight * a * b));
                });
            }
        }
        for (row, factor) in self.rows.iter().zip(self.factors) {
            row.emit_second(0.5 * scale * factor, out);
        }
    }
}

/// The entries of `D̄θ(q_n, q_{n+1})`, always in the same order; a coordinate may come several times.
pub(crate) fn for_each_slope(theta: &JointCoordinate, s: &Interval, visit: impl FnMut(usize, f64)) {
    match theta.value() {
        Value::Length(row) => row.for_each_slope(&s.q_mid, visit),
        Value::Angle { sine, cosine } => Turn::over((sine, cosine), s).for_each_slope(s, visit),
    }
}

/// `out ← out + scale D̄θ`.
pub(crate) fn add_slope(theta: &JointCoordinate, s: &Interval, scale: f64, out: &mut [f64]) {
    for_each_slope(theta, s, |i, slope| out[i] += scale * slope);
}

/// Emits `scale ∂D̄θ/∂q_{n+1}`; always the same places in the same order.
pub(crate) fn emit_derivative(
    theta: &JointCoordinate,
    s: &Interval,
    scale: f64,
    out: &mut dyn Entries,
) {
    match theta.value() {
        Value::Length(row) => row.emit_second(0.5 * scale, out),
        Value::Angle { sine, cosine } => {
            Turn::over((sine, cosine), s).emit_derivative(s, scale, out);
        }
    }
}

/// Emits `scale D̄θ Dθ(q_{n+1})ᵀ`, the derivative of a function of `Δθ` times `D̄θ`.
pub(crate) fn emit_product(
    theta: &JointCoordinate,
    s: &Interval,
    scale: f64,
    out: &mut dyn Entries,
) {
    for_each_slope(theta, s, |i, left| {
        theta.for_each_slope(&s.q1, |j, right| out.add(i, j, scale * left * right));
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::pair;
    use nalgebra::{DMatrix, Vector3};
    use vi_multibody::PairKind;

    /// A coordinate, and two configurations that are nowhere near the constraint manifold.
    fn coordinates() -> Vec<(&'static str, JointCoordinate, Interval)> {
        let number = |i: usize, k: f64| ((i as f64 + 0.3) * k).sin();
        let of = |kind, freedom| {
            let model = pair(kind, false);
            let joint = model.mechanism.description().joints[0].clone();
            let q = model.mechanism.initial_configuration();
            let mut s = Interval::new(q.len());
            s.open(0.0, 0.1, &q);
            s.dq.iter_mut().enumerate().for_each(|(i, dq)| *dq = 0.3 * number(i, 1.9));
            s.close_from_increment();
            (JointCoordinate::principal(&joint, freedom).unwrap(), s)
        };
        let turn = of(PairKind::Revolute, 0);
        let advance = of(PairKind::Cylindrical, 0);
        let second = of(PairKind::Universal, 1);
        [("turn", turn), ("advance", advance), ("second turn", second)]
            .map(|(name, (theta, s))| (name, theta, s))
            .into()
    }

    fn slope(theta: &JointCoordinate, s: &Interval) -> Vec<f64> {
        let mut out = vec![0.0; s.dim()];
        add_slope(theta, s, 1.0, &mut out);
        out
    }

    #[test]
    fn it_is_directional_and_equivariant_for_steps_of_any_length() {
        for (name, theta, long) in coordinates() {
            for k in 0..16 {
                let mut s = long.clone();
                s.dq.iter_mut().for_each(|dq| *dq *= 10.0_f64.powi(-k));
                s.close_from_increment();
                let found = slope(&theta, &s);
                let work: f64 = found.iter().zip(&s.dq).map(|(d, dq)| d * dq).sum();
                let change = theta.change(&s).difference;
                let part = |x: &[f64], k: usize| Vector3::from_column_slice(&x[3 * k..3 * k + 3]);
                let moment: Vector3<f64> =
                    (0..8).map(|k| part(&s.q_mid, k).cross(&part(&found, k))).sum();
                let force = part(&found, 0) + part(&found, 4);
                let off = [(work - change).abs(), moment.norm(), force.norm()];
                println!(
                    "{name:<12} 1e-{k:<2} directionality {:.1e}, moment {:.1e}",
                    off[0], off[1]
                );
                assert!(off.iter().all(|off| *off < 3e-15), "{name}: {off:?}");
            }
        }
    }

    #[test]
    fn the_derivative_against_central_differences() {
        for (name, theta, long) in coordinates() {
            for scale in [1.0, 1e-1, 1e-3] {
                let mut s = long.clone();
                s.dq.iter_mut().for_each(|dq| *dq *= scale);
                s.close_from_increment();
                let n = s.dim();
                let (mut exact, mut product) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
                emit_derivative(&theta, &s, 1.0, &mut exact);
                emit_product(&theta, &s, 1.0, &mut product);
                let (e, mut worst) = (1e-5, [0.0_f64; 2]);
                for j in 0..n {
                    let at = |by: f64| {
                        let mut s = s.clone();
                        s.dq[j] += by;
                        s.close_from_increment();
                        (slope(&theta, &s), theta.change(&s).difference)
                    };
                    let ((plus, up), (minus, down)) = (at(e), at(-e));
                    let rate = (up - down) / (2.0 * e);
                    for (i, left) in slope(&theta, &s).into_iter().enumerate() {
                        let bend = (plus[i] - minus[i]) / (2.0 * e);
                        worst[0] = worst[0].max((bend - exact[(i, j)]).abs());
                        worst[1] = worst[1].max((left * rate - product[(i, j)]).abs());
                    }
                }
                println!("{name:<12} {scale:.0e}: derivatives off by {worst:?}");
                assert!(worst.iter().all(|w| *w < 1e-8), "{name}: {worst:?}");
            }
        }
    }

    #[test]
    fn the_series_meets_the_quotient() {
        for sign in [-1.0, 1.0] {
            let (inside, outside) = (turn_factor(sign * 0.999_999e-2), turn_factor(sign * 1e-2));
            assert!((inside.0 - outside.0).abs() < 1e-10 && (inside.1 - outside.1).abs() < 1e-8);
        }
    }
}
