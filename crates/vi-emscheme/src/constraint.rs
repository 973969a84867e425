//! Discrete derivatives of constraints.
//!
//! ```text
//! Ḡ(q_n, q_{n+1}) Δq = g(q_{n+1}) − g(q_n)                the constraint forces Ḡᵀλ do no work
//! at most quadratic rows       Ḡ = G(q_{n+1/2})            every row of the pairs but the thread of a screw
//! couplings θ_a + ρ θ_b − c    Ḡ = D̄θ_a + ρ D̄θ_b          gears, racks, threads
//! prescribed motion θ − θ(t)   Ḡ = D̄θ                      the work done is λ Δθ
//! ```
//! Rows are functions of products of vectors fixed in bodies, so `Ḡᵀλ` changes no momentum but that
//! of the ground.

use crate::coordinate;
use vi_constraints::Constraints;
use vi_constraints::constraints::{ConstraintFn, Unconstrained};
use vi_core::interval::Interval;
use vi_core::sparse::Entries;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::scalar_constraint::ScalarRow;
use vi_rigid::directors;
use vi_rigid::single_body::SingleBody;

/// Constraints with a discrete derivative.
///
/// The defaults are those of constraints that are at most quadratic in `q`. Others get the same,
/// and then energy is kept to the order of the scheme only.
pub trait DiscreteConstraints: Constraints {
    /// Emits `Ḡ(q_n, q_{n+1})`, shape `m × n`; always the same places in the same order.
    fn discrete_jacobian(&self, s: &Interval, out: &mut dyn Entries) {
        self.jacobian(s.t_mid(), &s.q_mid, out);
    }

    /// Emits `Σ_i w_i ∂Ḡ_iᵀ/∂q_{n+1}`, shape `n × n`; always the same places in the same order.
    fn discrete_hessian(&self, s: &Interval, weights: &[f64], out: &mut dyn Entries) {
        self.weighted_hessian(s.t_mid(), &s.q_mid, weights, 0.5, out);
    }

    /// The first body that makes about half a turn over the interval. Its averaged directors all
    /// but vanish, and directions of the discrete null space with them.
    fn half_turn(&self, _s: &Interval) -> Option<HalfTurn> {
        None
    }
}

/// A body that makes about half a turn in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfTurn {
    /// Its first coordinate.
    pub coordinate: usize,
    /// Its rotation, rad.
    pub angle: f64,
}

/// `cos(θ/2)` below which a rotation by `θ` counts as about half a turn.
const SHRUNK: f64 = 0.05;

impl HalfTurn {
    /// Of the first `bodies` frames. The averaged directors `D̄` have the singular values `1, c, c`
    /// with `c = cos(θ/2)`, so `|D̄|² = 1 + 2 c²`.
    fn find(bodies: usize, s: &Interval) -> Option<Self> {
        let cosines = s.q_mid[..12 * bodies].chunks_exact(12).map(|frame| {
            let size: f64 = frame[3..].iter().map(|x| x * x).sum();
            (0.5 * (size - 1.0)).max(0.0).sqrt()
        });
        let (body, cosine) = cosines.enumerate().find(|(_, cosine)| *cosine < SHRUNK)?;
        Some(Self { coordinate: 12 * body, angle: 2.0 * libm::acos(cosine) })
    }
}

impl DiscreteConstraints for Unconstrained {}
impl DiscreteConstraints for SingleBody {
    fn half_turn(&self, s: &Interval) -> Option<HalfTurn> {
        HalfTurn::find(1, s)
    }
}
impl<F, J> DiscreteConstraints for ConstraintFn<F, J>
where
    F: Fn(&[f64], &mut [f64]) + Send + Sync,
    J: Fn(&[f64], &mut nalgebra::DMatrix<f64>) + Send + Sync,
{
}

impl DiscreteConstraints for Mechanism {
    fn half_turn(&self, s: &Interval) -> Option<HalfTurn> {
        HalfTurn::find(self.description().bodies.len(), s)
    }

    fn discrete_jacobian(&self, s: &Interval, out: &mut dyn Entries) {
        let bodies = self.description().bodies.len();
        for k in 0..bodies {
            let frame = &s.q_mid[12 * k..12 * k + 12];
            directors::internal_jacobian(frame, 6 * k, 12 * k, out);
        }
        for (i, row) in self.rows().iter().enumerate() {
            let at = 6 * bodies + i;
            match row {
                ScalarRow::Product(product) => product.emit(&s.q_mid, at, out),
                ScalarRow::Gear { a, b, ratio, .. } => {
                    coordinate::for_each_slope(a, s, |j, slope| out.add(at, j, slope));
                    coordinate::for_each_slope(b, s, |j, slope| out.add(at, j, ratio * slope));
                }
                ScalarRow::Motion { coordinate, .. } => {
                    coordinate::for_each_slope(coordinate, s, |j, slope| out.add(at, j, slope));
                }
                // refused when the integrator is made
                ScalarRow::Height(_) | ScalarRow::Velocity(_) => {}
            }
        }
    }

    fn discrete_hessian(&self, s: &Interval, weights: &[f64], out: &mut dyn Entries) {
        let bodies = self.description().bodies.len();
        for k in 0..bodies {
            let weights = &weights[6 * k..6 * k + 6];
            directors::internal_weighted_hessian(weights, 0.5, 12 * k, out);
        }
        for (row, weight) in self.rows().iter().zip(&weights[6 * bodies..]) {
            match row {
                ScalarRow::Product(product) => product.emit_second(0.5 * weight, out),
                ScalarRow::Gear { a, b, ratio, .. } => {
                    coordinate::emit_derivative(a, s, *weight, out);
                    coordinate::emit_derivative(b, s, ratio * weight, out);
                }
                ScalarRow::Motion { coordinate, .. } => {
                    coordinate::emit_derivative(coordinate, s, *weight, out);
                }
                ScalarRow::Height(_) | ScalarRow::Velocity(_) => {}
            }
        }
    }
}
