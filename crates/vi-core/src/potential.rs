//! Potentials `V(q)` and their discrete versions `U_d(q_n, q_{n+1})`.
//!
//! A discrete Lagrangian of this project is
//! `L_d = (1/2h) Δqᵀ M Δq − h Σ U_d(q_n, q_{n+1})`; the choice of `U_d` is the choice of
//! quadrature:
//! ```text
//! midpoint       U_d = V(q_{n+1/2})                          LMO08 (18)
//! trapezoidal    U_d = ½ V(q_n) + ½ V(q_{n+1})
//! ```
//! Other consistent, symmetric choices (averaged strains of beams) implement [`DiscretePotential`]
//! directly. They may add a mass to stiff motions, `L_d = (1/2h) Δqᵀ M Δq + h K_d − h U_d`
//! (selective mass scaling). All letters: `V` potential, `U_d` discrete potential, `K_d` kinetic
//! energy of the added mass, in J.

use crate::configuration::Configuration;
use crate::coordinate_force::AlongUnknown;
use crate::interpolation::StrainInterpolation;
use crate::interval::{Interval, Slot};
use crate::linear::dot;
use crate::sparse::{Block, Entries};
use crate::strain_energy::StrainEnergy;
use num_dual::{Dual64, DualNum, HyperDual64};

/// A potential energy `V(q)`, J.
pub trait Potential: Send + Sync {
    /// `V(q)`, J.
    fn value(&self, q: &[f64]) -> f64;
    /// `out ← out + scale ∇V(q)`, shape `n`.
    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]);
    /// Emits `scale ∇²V(q)`; always the same places in the same order.
    fn add_hessian(&self, q: &[f64], scale: f64, out: &mut dyn Entries);
    /// See [`DiscretePotential::add_third`].
    fn add_third(&self, _q: &[f64], _z: &[f64], _scale: f64, _out: &mut dyn Entries) {}
    /// `w` where `V(q) = −w·q` is linear, shape `n`.
    fn constant_force(&self) -> Option<&[f64]> {
        None
    }
    /// The same energy with its stresses apart, where it is one of strains.
    fn strain_energy(&self) -> Option<&dyn StrainEnergy> {
        None
    }
}

/// A discrete potential `U_d(q_n, q_{n+1})`, J, symmetric in its arguments and consistent with `V`.
///
/// In the slot derivatives `U_d` stands for `U_d − K_d` where there is an added mass.
pub trait DiscretePotential: Send + Sync {
    /// `U_d(q_n, q_{n+1})`, J.
    fn value(&self, s: &Interval) -> f64;
    /// `K_d(q_n, q_{n+1})`, J: kinetic energy of an added mass that vanishes with `h²`; zero for
    /// most.
    fn added_kinetic_energy(&self, _s: &Interval) -> f64 {
        0.0
    }
    /// Whether there is an added mass.
    fn adds_mass(&self) -> bool {
        false
    }
    /// Emits the added mass of a step `h` in a configuration, symmetric, shape `n × n`: `K_d` is
    /// `½ (Δq/h)ᵀ` times it times `Δq/h` to the order of the step; always the same places in the
    /// same order.
    fn add_mass(&self, _at: Configuration<'_>, _h: f64, _out: &mut dyn Entries) {}
    /// Emits `∂(A v)/∂q` of the added mass `A` of a step `h`, shape `n × n`.
    fn add_mass_slope(&self, _at: Configuration<'_>, _h: f64, _v: &[f64], _: &mut dyn Entries) {}
    /// Emits `∂(A v)/∂z`, columns of its own internal variables.
    fn add_mass_by_internal(
        &self,
        _at: Configuration<'_>,
        _: f64,
        _v: &[f64],
        _: &mut dyn Entries,
    ) {
    }
    /// `out ← out + scale D_1 U_d`, shape `n`.
    fn add_d1(&self, s: &Interval, scale: f64, out: &mut [f64]);
    /// `out ← out + scale D_2 U_d`, shape `n`.
    fn add_d2(&self, s: &Interval, scale: f64, out: &mut [f64]);
    /// Emits `scale D_2 D_1 U_d` (row: component of `D_1 U_d`, column: component of `q_{n+1}`);
    /// always the same places in the same order.
    fn add_d2_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries);
    /// Emits `scale D_1 D_1 U_d`, symmetric; always the same places in the same order. No step
    /// needs it: it is part of the tangent of a step.
    fn add_d1_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries);
    /// Emits `scale D_2 D_2 U_d`; by the symmetry of `U_d` that is `D_1 D_1 U_d(q_{n+1}, q_n)`.
    fn add_d2_d2(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        self.add_d1_d1(&s.exchanged(), scale, out);
    }
    /// Number of internal variables: constants of a step that follow from the steps before it; zero
    /// for most. They are the last ones of [`Interval::internal`] and [`Configuration::internal`].
    fn internal_variables(&self) -> usize {
        0
    }
    /// `out ←` the internal variables at the start of a motion from `q`.
    fn begin(&self, _q: &[f64], _out: &mut [f64]) {}
    /// `out ←` the internal variables at the end of a step, whose own are in `out`.
    fn advance(&self, _s: &Interval, _out: &mut [f64]) {}
    /// `out ← out +` their change where `q` changes by `dq`.
    fn begin_change(&self, _q: &[f64], _dq: &[f64], _out: &mut [f64]) {}
    /// Emits `scale ∂(D_of U_d)/∂z`, columns of its own internal variables.
    fn add_internal_slope(&self, _s: &Interval, _of: Slot, _scale: f64, _out: &mut dyn Entries) {}
    /// Emits `∂z_{n+1}/∂q_n` or `∂z_{n+1}/∂q_{n+1}`, rows of its own internal variables. Whether a
    /// variable changes in the step is held.
    fn add_advance_slope(&self, _s: &Interval, _by: Slot, _out: &mut dyn Entries) {}
    /// Emits `∂z_{n+1}/∂z_n` of its own internal variables.
    fn add_advance_internal_slope(&self, _s: &Interval, _out: &mut dyn Entries) {}
    /// Number of values that a step needs again and again and that follow from `q_n` alone; zero
    /// for most.
    fn derived_values(&self) -> usize {
        0
    }
    /// `out ←` these values, which [`Interval::derived`] has in the steps of all schemes of the
    /// discrete Lagrangian. Without them the results are the same but for rounding.
    fn derive(&self, _q: &[f64], _out: &mut [f64]) {}
    /// Number of values that the derivatives at one end of a step have in common and that follow
    /// from `q_{n+1}` alone; zero for most.
    fn end_values(&self) -> usize {
        0
    }
    /// `out ←` these values, which [`Interval::derived_end`] may have. Without them the results are
    /// the same but for rounding.
    fn derive_end(&self, _q: &[f64], _out: &mut [f64]) {}
    /// The continuous `V(q)` that `U_d` approximates, J.
    fn potential(&self, at: Configuration<'_>) -> f64;
    /// `out ← out + scale ∇V(q)`.
    fn add_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]);
    /// Emits `scale ∇²V(q)`; always the same places in the same order.
    fn add_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries);
    /// Emits `scale ∂²(y_0·D_1U_d + y_1·D_2U_d)/∂q_i∂q_j`, rows of the first of both slots, where
    /// third derivatives are known: nothing else.
    fn add_bend(
        &self,
        _s: &Interval,
        _y: [&[f64]; 2],
        _slots: [Slot; 2],
        _scale: f64,
        _out: &mut dyn Entries,
    ) {
    }
    /// Emits `scale ∂³V/∂q³ z`, symmetric, where it is known: nothing else.
    fn add_third(&self, _at: Configuration<'_>, _z: &[f64], _scale: f64, _out: &mut dyn Entries) {}
    /// `w` where `V(q) = −w·q` is linear, and `D_1 U_d = D_2 U_d = −w/2`; shape `n`.
    fn constant_force(&self) -> Option<&[f64]> {
        None
    }
    /// Its effort where it acts along an unknown of a step.
    fn along_unknown(&self) -> Option<AlongUnknown<'_>> {
        None
    }
    /// The energy `V` with its stresses apart, where it is one of strains.
    fn strain_energy(&self) -> Option<&dyn StrainEnergy> {
        None
    }
    /// The form in Galerkin steps of a potential of strains; `None` where `V` is evaluated at Gauss
    /// nodes.
    fn interpolation(&self) -> Option<&dyn StrainInterpolation> {
        None
    }
}

/// The quadrature rule of a discrete Lagrangian.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quadrature {
    /// `U_d = V(q_{n+1/2})`, LMO08 (18).
    #[default]
    Midpoint,
    /// `U_d = ½ V(q_n) + ½ V(q_{n+1})`.
    Trapezoidal,
}

impl Quadrature {
    /// The discrete potential of `V` by this rule.
    pub fn discretize<V: Potential + 'static>(self, potential: V) -> Box<dyn DiscretePotential> {
        match self {
            Self::Midpoint => Box::new(Midpoint(potential)),
            Self::Trapezoidal => Box::new(Trapezoidal(potential)),
        }
    }
}

/// `U_d = V(q_{n+1/2})`, LMO08 (18).
#[derive(Clone, Debug)]
pub struct Midpoint<V>(pub V);

impl<V: Potential> DiscretePotential for Midpoint<V> {
    fn value(&self, s: &Interval) -> f64 {
        self.0.value(&s.q_mid)
    }
    fn add_d1(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        self.0.add_gradient(&s.q_mid, 0.5 * scale, out);
    }
    fn add_d2(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        self.0.add_gradient(&s.q_mid, 0.5 * scale, out);
    }
    fn add_d2_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        self.0.add_hessian(&s.q_mid, 0.25 * scale, out);
    }
    fn add_d1_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        self.add_d2_d1(s, scale, out);
    }
    fn add_d2_d2(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        self.add_d2_d1(s, scale, out);
    }
    fn potential(&self, at: Configuration<'_>) -> f64 {
        self.0.value(at.q)
    }
    fn add_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        self.0.add_gradient(at.q, scale, out);
    }
    fn add_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries) {
        self.0.add_hessian(at.q, scale, out);
    }
    fn add_bend(
        &self,
        s: &Interval,
        [y_0, y_1]: [&[f64]; 2],
        _slots: [Slot; 2],
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let sum: Vec<f64> = y_0.iter().zip(y_1).map(|(a, b)| a + b).collect();
        self.0.add_third(&s.q_mid, &sum, 0.125 * scale, out);
    }
    fn add_third(&self, at: Configuration<'_>, z: &[f64], scale: f64, out: &mut dyn Entries) {
        self.0.add_third(at.q, z, scale, out);
    }
    fn constant_force(&self) -> Option<&[f64]> {
        self.0.constant_force()
    }
    fn strain_energy(&self) -> Option<&dyn StrainEnergy> {
        self.0.strain_energy()
    }
}

/// `U_d = ½ V(q_n) + ½ V(q_{n+1})`.
#[derive(Clone, Debug)]
pub struct Trapezoidal<V>(pub V);

impl<V: Potential> DiscretePotential for Trapezoidal<V> {
    fn value(&self, s: &Interval) -> f64 {
        0.5 * (self.0.value(&s.q0) + self.0.value(&s.q1))
    }
    fn add_d1(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        self.0.add_gradient(&s.q0, 0.5 * scale, out);
    }
    fn add_d2(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        self.0.add_gradient(&s.q1, 0.5 * scale, out);
    }
    fn add_d2_d1(&self, _s: &Interval, _scale: f64, _out: &mut dyn Entries) {
        // D_1 U_d depends on q_n only
    }
    fn add_d1_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        self.0.add_hessian(&s.q0, 0.5 * scale, out);
    }
    fn add_d2_d2(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        self.0.add_hessian(&s.q1, 0.5 * scale, out);
    }
    fn potential(&self, at: Configuration<'_>) -> f64 {
        self.0.value(at.q)
    }
    fn add_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        self.0.add_gradient(at.q, scale, out);
    }
    fn add_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries) {
        self.0.add_hessian(at.q, scale, out);
    }
    fn add_bend(
        &self,
        s: &Interval,
        y: [&[f64]; 2],
        [i, j]: [Slot; 2],
        scale: f64,
        out: &mut dyn Entries,
    ) {
        if i == j {
            let (q, y) = if i == Slot::First { (&s.q0, y[0]) } else { (&s.q1, y[1]) };
            self.0.add_third(q, y, 0.5 * scale, out);
        }
    }
    fn add_third(&self, at: Configuration<'_>, z: &[f64], scale: f64, out: &mut dyn Entries) {
        self.0.add_third(at.q, z, scale, out);
    }
    fn constant_force(&self) -> Option<&[f64]> {
        self.0.constant_force()
    }
    fn strain_energy(&self) -> Option<&dyn StrainEnergy> {
        self.0.strain_energy()
    }
}

/// `V(q) = −w·q` with a constant generalized force `w` (gravity: `w = M γ`).
#[derive(Clone, Debug)]
pub struct LinearPotential {
    /// `w`, shape `n`, N.
    pub force: Vec<f64>,
}

impl Potential for LinearPotential {
    fn value(&self, q: &[f64]) -> f64 {
        0.0 - dot(&self.force, q) // no force: not −0
    }
    fn add_gradient(&self, _q: &[f64], scale: f64, out: &mut [f64]) {
        for (o, w) in out.iter_mut().zip(&self.force) {
            *o -= scale * w;
        }
    }
    fn add_hessian(&self, _q: &[f64], _scale: f64, _out: &mut dyn Entries) {}
    fn constant_force(&self) -> Option<&[f64]> {
        Some(&self.force)
    }
}

/// A potential of `N` coordinates written once for any number type; gradient and Hessian follow
/// exactly, by dual numbers.
///
/// ```
/// use vi_core::potential::{DualPotential, Potential, ScalarField};
/// struct Spring { stiffness: f64 }
/// impl ScalarField<2> for Spring {
///     fn value<D: vi_core::num_dual::DualNum<Primitive = f64> + Copy>(&self, q: &[D; 2]) -> D {
///         let length = (q[0] * q[0] + q[1] * q[1]).sqrt();
///         (length - 1.0).powi(2) * (0.5 * self.stiffness)
///     }
/// }
/// let v = DualPotential(Spring { stiffness: 8.0 });
/// let mut gradient = [0.0; 2];
/// v.add_gradient(&[3.0, 4.0], 1.0, &mut gradient);
/// assert!((gradient[0] - 8.0 * 4.0 * 0.6).abs() < 1e-13);
/// ```
#[derive(Clone, Debug)]
pub struct DualPotential<F, const N: usize>(pub F);

/// A scalar function of `N` coordinates for any dual number type.
pub trait ScalarField<const N: usize>: Send + Sync {
    /// The function value at `q`.
    fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D; N]) -> D;
}

impl<F: ScalarField<N>, const N: usize> Potential for DualPotential<F, N> {
    fn value(&self, q: &[f64]) -> f64 {
        let mut x = [0.0; N];
        x.copy_from_slice(&q[..N]);
        self.0.value(&x)
    }

    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        for i in 0..N {
            let x: [Dual64; N] =
                std::array::from_fn(|k| Dual64::new(q[k], f64::from(u8::from(k == i))));
            out[i] += scale * self.0.value(&x).eps;
        }
    }

    fn add_hessian(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        for i in 0..N {
            for j in 0..=i {
                let x: [HyperDual64; N] = std::array::from_fn(|k| {
                    let seed = |at: usize| f64::from(u8::from(k == at));
                    HyperDual64::new(q[k], seed(i), seed(j), 0.0)
                });
                let second = scale * self.0.value(&x).eps1eps2;
                out.add(i, j, second);
                if i != j {
                    out.add(j, i, second);
                }
            }
        }
    }
}

/// A potential that acts on the coordinates from `offset` on: one member of a larger system.
#[derive(Clone, Debug)]
pub struct Shifted<V> {
    /// The potential of the member's own coordinates.
    pub potential: V,
    /// First coordinate of the member.
    pub offset: usize,
}

impl<V: Potential> Potential for Shifted<V> {
    fn value(&self, q: &[f64]) -> f64 {
        self.potential.value(&q[self.offset..])
    }
    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        self.potential.add_gradient(&q[self.offset..], scale, &mut out[self.offset..]);
    }
    fn add_hessian(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        let (row, column) = (self.offset, self.offset);
        let mut block = Block { into: out, row, column, scale: 1.0, transposed: false };
        self.potential.add_hessian(&q[self.offset..], scale, &mut block);
    }
}
