//! The discrete derivative of a joint coordinate.
//!
//! ```text
//! length   D̄u = Du(q_{n+1/2})                                      u = a·r is quadratic
//! angle    θ = atan2(s, c):    ψ = Δθ = atan2(c_n Δs − s_n Δc, c_n c_{n+1} + s_n s_{n+1})
//!          D̄θ = κ [c̄ Ds(q_{n+1/2}) − s̄ Dc(q_{n+1/2})],    κ = (ψ/sin ψ)/(r_n r_{n+1}),   r² = s² + c²
//! ```
//! Where both frames have the axis in common, an angle has two such derivatives, `D̄θ_1` by `m_1'`
//! and `D̄θ_2` by `m_2'` ([`SharedAxis`]). Each has a moment across the axis, of order `h²`, that
//! depends on the choice of `m_1`; their mean has none. What the mean lacks in the limit to be `Dθ`
//! are forces within rigid bodies, which do no work:
//! ```text
//! D̄θ = ½ (D̄θ_1 + D̄θ_2) + ½ D(m_1'·m_2') + ½ cos(θ_n + θ_{n+1}) D(m_1·m_2) + ¼ sin(θ_n + θ_{n+1}) D(m_2² − m_1²)   at q_{n+1/2}
//! ```
//!
//! Bars: means of both ends. `Ds(q_{n+1/2})·Δq = Δs` exactly, and
//! `c̄ Δs − s̄ Δc = r_n r_{n+1} sin ψ`, so `D̄θ·Δq = Δθ` where bodies are rigid, for steps of any
//! length below half a turn. `s`, `c`, `u` are products of vectors fixed in bodies, so `D̄` has no
//! resultant force or moment at the averaged vectors: what acts along a joint coordinate changes no
//! momentum. Derivatives by `q_{n+1}` are exact off the constraint manifold too.
//!
//! Letters: `s, c` sine and cosine rows, `ψ` the turn of the step. Source: the construction of G96
//! with the invariants `s`, `c`; the formula is ours.

use vi_core::interval::Interval;
use vi_core::sparse::Entries;
use vi_multibody::form::BilinearRow;
use vi_multibody::joint_coordinate::{JointCoordinate, SharedAxis, Value};

/// `Dg(q_{n+1/2})·Δq = Δg` of a product of forms, to its own relative precision.
fn change(row: &BilinearRow, s: &Interval) -> f64 {
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

/// An angle by one vector of the child over an interval.
struct IntervalAngle<'a> {
    rows: [&'a BilinearRow; 2], // s, c
    start: [f64; 2],            // s, c at q_n
    end: [f64; 2],              // and at q_{n+1}
    factors: [f64; 2],          // D̄θ = factors[0] Ds + factors[1] Dc at q_{n+1/2}
    kappa: f64,                 // κ
    kappa_end: [f64; 2],        // ∂κ/∂(s, c) at q_{n+1}
}

impl<'a> IntervalAngle<'a> {
    fn over([sine, cosine]: [&'a BilinearRow; 2], s: &Interval) -> Self {
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
            start: [s0, c0],
            end: [s1, c1],
            factors: [kappa * (c0 + 0.5 * dc), -kappa * (s0 + 0.5 * ds)],
            kappa,
            kappa_end: [by_psi * c1 - kappa * s1 / square, -by_psi * s1 - kappa * c1 / square],
        }
    }

    fn for_each_slope(&self, s: &Interval, scale: f64, mut visit: impl FnMut(usize, f64)) {
        for (row, factor) in self.rows.iter().zip(self.factors) {
            row.for_each_slope(&s.q_mid, |i, slope| visit(i, scale * factor * slope));
        }
    }

    /// Emits `left(q_{n+1/2})` times a function of `s` and `c` at `q_{n+1}` with the slopes `by`.
    fn emit_end(&self, left: &BilinearRow, by: [f64; 2], s: &Interval, out: &mut dyn Entries) {
        for (right, weight) in self.rows.iter().zip(by) {
            left.for_each_slope(&s.q_mid, |i, a| {
                right.for_each_slope(&s.q1, |j, b| out.add(i, j, weight * a * b));
            });
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
            self.emit_end(left, weights, s, out);
        }
        for (row, factor) in self.rows.iter().zip(self.factors) {
            row.emit_second(0.5 * scale * factor, out);
        }
    }
}

/// An angle by both vectors of the child, with the forces within the bodies.
struct MeanTurn<'a> {
    turns: [IntervalAngle<'a>; 2], // D̄θ_1, D̄θ_2
    zero: &'a [BilinearRow; 3],
    weights: [f64; 3], // of the gradients of `zero`
}

impl<'a> MeanTurn<'a> {
    fn over(rows: [&'a BilinearRow; 2], axis: &'a SharedAxis, s: &Interval) -> Self {
        let turns = [rows, [&axis.sine, &axis.cosine]].map(|rows| IntervalAngle::over(rows, s));
        let ([s0, c0], [s1, c1]) = (turns[0].start, turns[0].end);
        let weights = [0.5, 0.5 * (c0 * c1 - s0 * s1), 0.5 * (s0 * c1 + c0 * s1)];
        Self { turns, zero: &axis.zero, weights }
    }

    fn for_each_slope(&self, s: &Interval, mut visit: impl FnMut(usize, f64)) {
        self.turns.iter().for_each(|turn| turn.for_each_slope(s, 0.5, &mut visit));
        for (row, weight) in self.zero.iter().zip(self.weights) {
            row.for_each_slope(&s.q_mid, |i, slope| visit(i, weight * slope));
        }
    }

    fn emit_derivative(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        self.turns.iter().for_each(|turn| turn.emit_derivative(s, 0.5 * scale, out));
        let half = 0.5 * scale;
        for (row, weight) in self.zero.iter().zip(self.weights) {
            row.emit_second(half * weight, out);
        }
        let [s0, c0] = self.turns[0].start;
        let by_end = [[-half * s0, half * c0], [half * c0, half * s0]]; // of the weights that vary
        for (row, by) in self.zero[1..].iter().zip(by_end) {
            self.turns[0].emit_end(row, by, s, out);
        }
    }
}

/// The entries of `D̄θ(q_n, q_{n+1})`, always in the same order; a coordinate may come several
/// times.
pub(crate) fn for_each_slope(theta: &JointCoordinate, s: &Interval, visit: impl FnMut(usize, f64)) {
    match (theta.value(), theta.shared_axis()) {
        (Value::Length(row), _) => row.for_each_slope(&s.q_mid, visit),
        (Value::Angle { sine, cosine }, None) => {
            IntervalAngle::over([sine, cosine], s).for_each_slope(s, 1.0, visit);
        }
        (Value::Angle { sine, cosine }, Some(axis)) => {
            MeanTurn::over([sine, cosine], axis, s).for_each_slope(s, visit);
        }
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
    match (theta.value(), theta.shared_axis()) {
        (Value::Length(row), _) => row.emit_second(0.5 * scale, out),
        (Value::Angle { sine, cosine }, None) => {
            IntervalAngle::over([sine, cosine], s).emit_derivative(s, scale, out);
        }
        (Value::Angle { sine, cosine }, Some(axis)) => {
            MeanTurn::over([sine, cosine], axis, s).emit_derivative(s, scale, out);
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
    use vi_multibody::joint::Joint;
    use vi_rigid::rotation;

    fn number(i: usize, k: f64) -> f64 {
        ((i as f64 + 0.3) * k).sin()
    }

    /// A pair of two bodies that both move, its axes turned by `angle` about the axis.
    fn joint_of(kind: PairKind, angle: f64) -> (Joint, Vec<f64>) {
        let model = pair(kind, false);
        let mut joint = model.mechanism.description().joints[0].clone();
        let turn = rotation::exp(&Vector3::new(0.0, 0.0, angle));
        joint.parent.axes *= turn;
        joint.child.axes *= turn;
        (joint, model.mechanism.initial_configuration())
    }

    const COORDINATES: [(&str, PairKind, usize); 4] = [
        ("turn", PairKind::Revolute, 0),
        ("advance", PairKind::Cylindrical, 0),
        ("turn beside an advance", PairKind::Cylindrical, 1),
        ("second turn", PairKind::Universal, 1),
    ];

    /// A coordinate, and two configurations that are nowhere near the constraint manifold.
    fn coordinates() -> Vec<(&'static str, JointCoordinate, Interval)> {
        let of = |(name, kind, freedom)| {
            let (joint, q) = joint_of(kind, 0.0);
            let mut s = Interval::new(q.len());
            s.open(0.0, 0.1, &q);
            s.dq.iter_mut().enumerate().for_each(|(i, dq)| *dq = 0.3 * number(i, 1.9));
            s.close_from_increment();
            (name, JointCoordinate::principal(&joint, freedom).unwrap(), s)
        };
        COORDINATES.map(of).into()
    }

    /// The pair with all rotations and displacements times `by`, about a configuration that is not
    /// the first one.
    fn moved(joint: &Joint, q: &[f64], by: f64) -> Vec<f64> {
        let at = joint.configuration(q);
        let angles = [0.7 + 0.9 * by, 0.4 - 0.6 * by];
        let second = if joint.kind == PairKind::Universal { angles[1] } else { 0.0 };
        let own = rotation::exp(&(angles[0] * at.axis(2))) * rotation::exp(&(second * at.axis(0)));
        let whole = rotation::exp(&(by * Vector3::new(0.8, -0.5, 1.1)));
        let mut new = q.to_vec();
        for (k, vector) in new.chunks_exact_mut(3).enumerate() {
            let turned = if k < 4 { whole } else { whole * own };
            let old = Vector3::from_column_slice(vector);
            let value = if k % 4 == 0 {
                old + by * Vector3::new(0.1, k as f64, -0.3)
            } else {
                turned * old
            };
            vector.copy_from_slice(value.as_slice());
        }
        new
    }

    fn between(joint: &Joint, q: &[f64], ends: [f64; 2]) -> Interval {
        let [start, end] = ends.map(|by| moved(joint, q, by));
        let mut s = Interval::new(q.len());
        s.open(0.0, 0.1, &start);
        s.dq.iter_mut().zip(end.iter().zip(&start)).for_each(|(dq, (a, b))| *dq = a - b);
        s.close_from_increment();
        s
    }

    fn slope(theta: &JointCoordinate, s: &Interval) -> Vec<f64> {
        let mut out = vec![0.0; s.dim()];
        add_slope(theta, s, 1.0, &mut out);
        out
    }

    fn part(x: &[f64], k: usize) -> Vector3<f64> {
        Vector3::from_column_slice(&x[3 * k..3 * k + 3])
    }

    /// The moment of a force at the averaged vectors.
    fn moment(s: &Interval, force: &[f64], vectors: std::ops::Range<usize>) -> Vector3<f64> {
        vectors.map(|k| part(&s.q_mid, k).cross(&part(force, k))).sum()
    }

    #[test]
    fn it_has_no_resultant_anywhere() {
        for (name, theta, long) in coordinates() {
            for k in 0..16 {
                let mut s = long.clone();
                s.dq.iter_mut().for_each(|dq| *dq *= 10.0_f64.powi(-k));
                s.close_from_increment();
                let found = slope(&theta, &s);
                let force = part(&found, 0) + part(&found, 4);
                let off = [moment(&s, &found, 0..8).norm(), force.norm()];
                println!("{name:<12} 1e-{k:<2} moment {:.1e}, force {:.1e}", off[0], off[1]);
                assert!(off.iter().all(|off| *off < 3e-15), "{name}: {off:?}");
            }
        }
    }

    /// Where bodies are rigid and their axes coincide.
    #[test]
    fn it_is_directional_for_steps_of_any_length() {
        for (name, kind, freedom) in COORDINATES {
            let (joint, q) = joint_of(kind, 0.0);
            let theta = JointCoordinate::principal(&joint, freedom).unwrap();
            for k in 0..16 {
                let s = between(&joint, &q, [-0.3, -0.3 + 1.9 * 10.0_f64.powi(-k)]);
                let found = slope(&theta, &s);
                let work: f64 = found.iter().zip(&s.dq).map(|(d, dq)| d * dq).sum();
                let off = (work - theta.change(&s).difference).abs();
                println!("{name:<12} 1e-{k:<2} directionality {off:.1e}");
                assert!(off < 5e-15, "{name}: {off:e}");
            }
        }
    }

    /// The moment between the bodies is the same for each choice of `m_1` and `m_1'`.
    #[test]
    fn its_moment_does_not_depend_on_the_first_axis() {
        for kind in [PairKind::Revolute, PairKind::Cylindrical, PairKind::Planar] {
            let (joint, q) = joint_of(kind, 0.0);
            let s = between(&joint, &q, [-0.4, 0.7]);
            let moments = [[0.0, 0.0], [1.1, 1.1], [-0.6, 0.5]].map(|[parent, child]| {
                let mut other = joint.clone();
                other.parent.axes *= rotation::exp(&Vector3::new(0.0, 0.0, parent));
                other.child.axes *= rotation::exp(&Vector3::new(0.0, 0.0, child));
                let freedom = kind.dof() - 1;
                let theta = JointCoordinate::principal(&other, freedom).unwrap();
                moment(&s, &slope(&theta, &s), 5..8)
            });
            let off = (moments[0] - moments[1]).norm().max((moments[0] - moments[2]).norm());
            println!("{}: {off:.1e} of {:.3}", kind.name(), moments[0].norm());
            assert!(off < 3e-15, "{off:e}");
        }
    }

    /// All of it, the forces within the bodies too.
    #[test]
    fn it_tends_to_the_gradient_with_order_two() {
        for (name, kind, freedom) in COORDINATES {
            let (joint, q) = joint_of(kind, 0.9);
            let theta = JointCoordinate::principal(&joint, freedom).unwrap();
            let mut gradient = vec![0.0; q.len()];
            theta.add_gradient(&moved(&joint, &q, 0.0), 1.0, &mut gradient);
            let off = [1e-1, 1e-2].map(|by| {
                let found = slope(&theta, &between(&joint, &q, [-by, by]));
                found.iter().zip(&gradient).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            });
            let order = (off[0] / off[1]).log10();
            println!("{name:<12} {off:?}, order {order:.3}");
            assert!((order - 2.0).abs() < 0.05, "{name}: {off:?}");
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
