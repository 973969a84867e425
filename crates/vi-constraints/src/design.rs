//! Derivatives of the equations of a step by parameters.
//!
//! ```text
//! b = p̄_n + D_1 L_d + f_d^- − h G(q_n)ᵀ λ_n = 0,   g(q_{n+1}) = 0,   p̄_{n+1} = D_2 L_d + f_d^+
//! b_θ = (D_1 L_d + f_d^-)_θ − (Gᵀ h λ_n)_θ          g_θ(q_{n+1})      (D_2 L_d + f_d^+)_θ
//! ```
//! Subscripts `θ` are partial derivatives with `(q_n, p̄_n, q_{n+1}, λ_n)` held. `μ`, `b'`, `σ`:
//! costates of a step. A Galerkin step has such equations at each of its Gauss nodes and between
//! neighbouring control points ([`Place`]).

use vi_core::Interval;
use vi_core::interpolation::StepPolynomial;

/// Where equations of a step are evaluated, and which.
#[derive(Clone, Copy, Debug)]
pub enum Place<'a> {
    /// A step `(q_n, q_{n+1})`: all of them.
    Step(&'a Interval),
    /// A Gauss node of a Galerkin step: `D_1 L_d + f_d^-` and `D_2 L_d + f_d^+` of a step whose
    /// ends have come together, `∓M V + (h/2)(f − ∇V)(t, Q, V)`. Both ends of the interval and its
    /// middle are `Q`, its velocity is `V`, its middle in time is `t`. With the weight `b_k` of the
    /// node, by which these equations are still to be multiplied.
    Gauss(&'a Interval, f64),
    /// Neighbouring control points `(q_i, q_{i+1})` of a Galerkin step: constraints alone.
    Points(&'a Interval),
    /// A control point of a Galerkin step, by its number: the impulse of interpolated strains on it
    /// alone, which belongs to `D_2 L_d + f_d^+`.
    Strains(StepPolynomial<'a>, usize),
}

impl<'a> Place<'a> {
    /// The interval.
    #[must_use]
    pub fn interval(self) -> &'a Interval {
        match self {
            Self::Step(s) | Self::Gauss(s, _) | Self::Points(s) => s,
            Self::Strains(step, _) => step.step(),
        }
    }

    /// Whether inertia, potentials and forces count, interpolated strains aside.
    #[must_use]
    pub fn has_forces(self) -> bool {
        matches!(self, Self::Step(_) | Self::Gauss(..))
    }

    /// Whether constraints count.
    #[must_use]
    pub fn has_rows(self) -> bool {
        matches!(self, Self::Step(_) | Self::Points(_))
    }
}

/// Explicit derivatives of the equations of a step by parameters, at fixed
/// `(q_n, p̄_n, q_{n+1}, λ_n)`.
pub trait Design {
    /// Number of parameters.
    fn len(&self) -> usize;

    /// Whether there is none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Along parameter `k`: `minus += b_θ` and `plus += (D_2 L_d + f_d^+)_θ`, shape `n`;
    /// `rows += g_θ(q_{n+1})`, shape `m`. `impulse`: `h λ_n`, shape `m`, where constraints count.
    fn add_tangent(
        &self,
        k: usize,
        at: Place<'_>,
        impulse: &[f64],
        minus: &mut [f64],
        plus: &mut [f64],
        rows: &mut [f64],
    );

    /// The same at a node where all forces count, interpolated strains among them, with the
    /// velocity and the length of an interval whose ends have come together ([`Place::Gauss`]).
    fn add_at_node(&self, k: usize, at: &Interval, [minus, plus]: [&mut [f64]; 2]) {
        self.add_tangent(k, Place::Gauss(at, 1.0), &[], minus, plus, &mut []);
    }

    /// Along parameter `k`: `out += ζ_θ` of the internal variables `z' = ζ(q, q', z)`, shape of all
    /// of them; of a Galerkin step the sum over its Gauss nodes.
    fn add_internal(&self, _k: usize, _at: Place<'_>, _out: &mut [f64]) {}

    /// Along parameter `k`: `out += φ_θ` of the rates of continuous states of signals at a Gauss
    /// node of a Galerkin step, shape of all internal variables.
    fn add_rates(&self, _k: usize, _at: Place<'_>, _out: &mut [f64]) {}

    /// Number of sums over the steps that the derivatives by all parameters are made of: what
    /// several parameters share is summed once.
    fn sums(&self) -> usize;

    /// Adds those of a step. Where each parameter has its own, `sums_k += plus·b' − minus·μ −
    /// rows·σ` with what [`Design::add_tangent`] adds.
    fn add_adjoint(&self, at: Place<'_>, impulse: &[f64], costates: Costates<'_>, sums: &mut [f64]);

    /// Adds what internal variables add to those of a step: where each parameter has its own,
    /// `sums_k += ζ_θ·y'`; `y'`: their costates at its end.
    fn add_internal_adjoint(&self, _at: Place<'_>, _y: &[f64], _sums: &mut [f64]) {}

    /// Of all parameters at once: adds the derivatives that the sums over all steps make; `out`:
    /// shape [`Design::len`].
    fn add_gradient(&self, sums: &[f64], out: &mut [f64]);

    /// Whether a parameter enters `g`.
    fn moves_constraints(&self) -> bool;

    /// Whether [`Design::add_adjoint`] reads [`Costates::moved`] where it is given.
    fn reads_moved(&self) -> bool {
        false
    }
}

/// The costates of a step.
#[derive(Clone, Copy, Debug)]
pub struct Costates<'a> {
    /// `μ`, of the equation of the step, shape `n`.
    pub step: &'a [f64],
    /// `b' = dJ/dp̄_{n+1}`, shape `n`.
    pub momentum: &'a [f64],
    /// `σ`, of `g(q_{n+1}) = 0`, shape `m`.
    pub rows: &'a [f64],
    /// At `q_n` and at `q_{n+1}`, of constraints that a null space `P(q; θ)` meets and that then
    /// have no multipliers: what `−w·P_θ m` and `(c − Aᵀ μ)·δq'` are made of, with any `δq'` for
    /// which they hold, in numbers that the mechanism and its design agree on. Empty where all have
    /// multipliers.
    pub moved: [&'a [f64]; 2],
    /// Whether at `q_n`, and at `q_{n+1}`, efforts along unknowns are counted along these alone: a
    /// parameter then changes what they are, and not their gradients.
    pub apart: [bool; 2],
    /// Of the rates of continuous states of signals at a Gauss node, shape of all internal
    /// variables; empty elsewhere.
    pub rates: &'a [f64],
}

impl<'a> Costates<'a> {
    /// Of a step in which all constraints have multipliers: `μ` and `b'`, shape `n`, and `σ`, shape
    /// `m`.
    #[must_use]
    pub const fn of_rows(step: &'a [f64], momentum: &'a [f64], rows: &'a [f64]) -> Self {
        Self { step, momentum, rows, moved: [&[]; 2], apart: [false; 2], rates: &[] }
    }
}
