//! Gonzalez's discrete derivative of any potential.
//!
//! ```text
//! D̄V = ∇V(q_{n+1/2}) + e Δq/|Δq|²,     e = V(q_{n+1}) − V(q_n) − ∇V(q_{n+1/2})·Δq          G96
//! ∂D̄V/∂q_{n+1} = ½H + Δq/|Δq|² ⊗ [∇V(q_{n+1}) − ∇V(q_{n+1/2}) − ½ H Δq]
//!                   + e [I/|Δq|² − 2 ΔqΔqᵀ/|Δq|⁴],      H = ∇²V(q_{n+1/2})
//! ```
//! `e = O(|Δq|³)` is lost in the round-off `ε|V|` of the difference when the step is short. Then it
//! is integrated along the step instead (Gauss–Legendre, three points: the error is `O(|Δq|⁷)`),
//! which keeps the correction at `ε|∇V|` for any `|Δq|`.
//!
//! Exact energy; linear momentum when `V` is invariant; *not* angular momentum: `q_{n+1/2} × Δq`
//! does not vanish. Potentials of `D·D` have [`crate::invariant`].
//!
//! Source: Gonzalez, J. Nonlinear Sci. 6 (1996) 449–467; the quadrature is ours.

use crate::discrete_gradient::DiscreteGradient;
use std::cell::RefCell;
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_core::potential::Potential;
use vi_core::sparse::{Block, Entries};

/// `½ √(3/5)`: distance of the outer Gauss points from the middle of `[0, 1]`.
const OUTER: f64 = 0.387_298_334_620_741_7;

/// Any potential, on the coordinates it depends on.
#[derive(Debug)]
pub struct Gonzalez<V> {
    potential: V,
    n: usize,
    coordinates: Vec<usize>,
}

thread_local! {
    static SCRATCH: RefCell<GonzalezScratch> = RefCell::default();
}

#[derive(Default, Debug)]
struct GonzalezScratch {
    mid: Vec<f64>,   // n  ∇V(q_{n+1/2})
    other: Vec<f64>, // n  ∇V at another point, then ∂e/∂q_{n+1}
    q: Vec<f64>,     // n
}

impl GonzalezScratch {
    fn fit(&mut self, n: usize) {
        for x in [&mut self.mid, &mut self.other, &mut self.q] {
            x.resize(n, 0.0);
        }
    }
}

/// `y ← y + A x` from the entries of `A`.
struct EntryProduct<'a> {
    x: &'a [f64],
    y: &'a mut [f64],
}

impl Entries for EntryProduct<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        self.y[row] += value * self.x[column];
    }
}

impl<V: Potential> Gonzalez<V> {
    /// A potential of all `n` coordinates.
    #[must_use]
    pub fn new(potential: V, n: usize) -> Self {
        Self::on(potential, n, (0..n).collect())
    }

    /// A potential of the given coordinates out of `n`; `∇V` vanishes in the others.
    #[must_use]
    pub fn on(potential: V, n: usize, coordinates: Vec<usize>) -> Self {
        Self { potential, n, coordinates }
    }

    fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        self.coordinates.iter().map(|&i| a[i] * b[i]).sum()
    }

    /// `e`, and `∇V(q_{n+1/2})` in `work.mid`.
    fn defect(&self, s: &Interval, work: &mut GonzalezScratch) -> f64 {
        work.mid.fill(0.0);
        self.potential.add_gradient(&s.q_mid, 1.0, &mut work.mid);
        work.other.fill(0.0);
        for side in [-OUTER, OUTER] {
            for ((q, mid), dq) in work.q.iter_mut().zip(&s.q_mid).zip(&s.dq) {
                *q = mid + side * dq;
            }
            self.potential.add_gradient(&work.q, 1.0, &mut work.other);
        }
        let (v0, v1) = (self.potential.value(&s.q0), self.potential.value(&s.q1));
        let linear = self.dot(&work.mid, &s.dq);
        let divided = v1 - v0 - linear;
        let integrated = 5.0 / 18.0 * (self.dot(&work.other, &s.dq) - 2.0 * linear);
        let round_off = 16.0 * f64::EPSILON * (v0.abs() + v1.abs() + linear.abs());
        if (divided - integrated).abs() <= round_off { integrated } else { divided }
    }

    /// `work.other ← ∂e/∂q_{n+1}`; zero where it is round-off.
    fn defect_derivative(&self, s: &Interval, work: &mut GonzalezScratch) {
        let end = &mut work.other;
        end.fill(0.0);
        self.potential.add_gradient(&s.q1, 1.0, end);
        let mut product = EntryProduct { x: &s.dq, y: end };
        self.potential.add_hessian(&s.q_mid, -0.5, &mut product);
        for (end, mid) in end.iter_mut().zip(&work.mid) {
            *end -= mid;
            if end.abs() <= 16.0 * f64::EPSILON * mid.abs() {
                *end = 0.0;
            }
        }
    }
}

impl<V: Potential> DiscreteGradient for Gonzalez<V> {
    fn potential(&self, at: Configuration<'_>) -> f64 {
        self.potential.value(at.q)
    }

    fn add_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        self.potential.add_gradient(at.q, scale, out);
    }

    fn add(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        SCRATCH.with_borrow_mut(|work| self.add_with(work, s, scale, out));
    }

    fn add_derivative(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        SCRATCH.with_borrow_mut(|work| self.add_derivative_with(work, s, scale, out));
    }
}

impl<V: Potential> Gonzalez<V> {
    fn add_with(&self, work: &mut GonzalezScratch, s: &Interval, scale: f64, out: &mut [f64]) {
        work.fit(self.n);
        let defect = self.defect(s, work);
        let square = self.dot(&s.dq, &s.dq);
        let along = if square > 0.0 { defect / square } else { 0.0 };
        for &i in &self.coordinates {
            out[i] += scale * (work.mid[i] + along * s.dq[i]);
        }
    }

    fn add_derivative_with(
        &self,
        work: &mut GonzalezScratch,
        s: &Interval,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        work.fit(self.n);
        let (row, column, transposed) = (0, 0, false);
        let mut half = Block { into: out, row, column, scale: 0.5 * scale, transposed };
        self.potential.add_hessian(&s.q_mid, 1.0, &mut half);
        let defect = self.defect(s, work);
        self.defect_derivative(s, work);
        let square = self.dot(&s.dq, &s.dq);
        let inverse = if square > 0.0 { 1.0 / square } else { 0.0 };
        let along = defect * inverse;
        for &i in &self.coordinates {
            for &j in &self.coordinates {
                let bend = work.other[j] - 2.0 * along * s.dq[j];
                let diagonal = if i == j { along } else { 0.0 };
                out.add(i, j, scale * (inverse * s.dq[i] * bend + diagonal));
            }
        }
    }
}
