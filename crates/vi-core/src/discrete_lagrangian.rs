//! The discrete Lagrangian and its slot derivatives.
//!
//! ```text
//! L_d(q_n, q_{n+1}) = (1/2h) Δqᵀ M Δq − h Σ U_d(q_n, q_{n+1})            LMO08 (18) for U_d = V(q_{n+1/2})
//! D_1 L_d           = −(1/h) M Δq − h D_1 U_d
//! D_2 L_d           = +(1/h) M Δq − h D_2 U_d
//! D_2 D_1 L_d       = −(1/h) M    − h D_2 D_1 U_d
//! D_1 D_1 L_d       = +(1/h) M    − h D_1 D_1 U_d,    D_2 D_2 L_d likewise
//! E_d               = ½ (Δq/h)ᵀ M (Δq/h) + U_d                            LMO08 (52)
//! ```
//! A discrete potential with an added mass contributes `h K_d − h U_d` to `L_d` and `K_d + U_d` to `E_d`.
//!
//! Forces enter in the sense of the discrete Lagrange–d'Alembert principle (Marsden & West 2001,
//! part 3): `f_d^-(q_n, q_{n+1})` stands beside `D_1 L_d`, `f_d^+(q_n, q_{n+1})` beside `D_2 L_d`.
//!
//! Letters: `M` mass matrix (constant, symmetric, positive semi-definite), `U_d` discrete
//! potential, `f_d^∓` discrete forces (N·s).
#![allow(non_snake_case)] // M, L_d

use crate::configuration::Configuration;
use crate::force::DiscreteForce;
use crate::interpolation::{StepPolynomial, StrainInterpolation};
use crate::interval::Interval;
use crate::isotropic::IsotropicBlocks;
use crate::mechanical_system::MechanicalSystem;
use crate::potential::{DiscretePotential, Potential, Quadrature};
use crate::sparse::{Entries, SparseMatrix};

/// The discrete Lagrangian of a system with its discrete forces, and their slot derivatives.
///
/// Implementors provide the discrete functions of one [`Interval`]; the forced terms default to
/// none. Open for extension: anything with these slot derivatives can be integrated.
pub trait DiscreteLagrangian: MechanicalSystem {
    /// `L_d(q_n, q_{n+1})`, J·s.
    fn discrete_lagrangian(&self, s: &Interval) -> f64;
    /// `out ← D_1 L_d(q_n, q_{n+1})`, shape `n`, unit of momentum.
    fn d1(&self, s: &Interval, out: &mut [f64]);
    /// `out ← D_2 L_d(q_n, q_{n+1})`, shape `n`, unit of momentum.
    fn d2(&self, s: &Interval, out: &mut [f64]);
    /// Emits `D_2 D_1 L_d`, shape `n × n`; always the same places in the same order.
    fn d2_d1(&self, s: &Interval, out: &mut dyn Entries);
    /// Emits `D_1 D_1 L_d`, shape `n × n`; always the same places in the same order. No step needs it:
    /// it is part of the tangent of a step.
    fn d1_d1(&self, s: &Interval, out: &mut dyn Entries);
    /// Emits `D_2 D_2 L_d`, as [`DiscreteLagrangian::d1_d1`].
    fn d2_d2(&self, s: &Interval, out: &mut dyn Entries);
    /// Emits `scale ∇²V(q)` of the continuous potential, shape `n × n`; always the same places in the same order. No
    /// step needs it: it is part of the tangent of a step.
    fn potential_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries);
    /// The same at a Gauss node, without [`MechanicalSystem::interpolation`].
    fn gauss_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries) {
        self.potential_hessian(at, scale, out);
    }
    /// `out ← out + f_d^-(q_n, q_{n+1})`, N·s.
    fn add_force_minus(&self, _s: &Interval, _out: &mut [f64]) {}
    /// `out ← out + f_d^+(q_n, q_{n+1})`, N·s.
    fn add_force_plus(&self, _s: &Interval, _out: &mut [f64]) {}
    /// Emits `D_2 f_d^-`, shape `n × n`; always the same places in the same order.
    fn force_minus_d2(&self, _s: &Interval, _out: &mut dyn Entries) {}
    /// Number of internal variables of the forces.
    fn internal_variables(&self) -> usize {
        0
    }
    /// `out ← z_{n+1}`, the internal variables at the end of a step; shape [`Self::internal_variables`].
    fn advance_internal(&self, _s: &Interval, _out: &mut [f64]) {}
    /// `Σ U_d(q_n, q_{n+1})`, J: the potential part of `E_d`, LMO08 (52).
    fn discrete_potential_energy(&self, s: &Interval) -> f64;
    /// `Σ K_d(q_n, q_{n+1})`, J: what added masses contribute to the kinetic part of `E_d`.
    fn added_kinetic_energy(&self, _s: &Interval) -> f64 {
        0.0
    }

    /// `out ← D_1 L_d + f_d^-`: what balances `p̄_n`.
    fn forced_d1(&self, s: &Interval, out: &mut [f64]) {
        self.d1(s, out);
        self.add_force_minus(s, out);
    }
    /// `out ← D_2 L_d + f_d^+`: the momentum `p̄_{n+1}` of the next step.
    fn forced_d2(&self, s: &Interval, out: &mut [f64]) {
        self.d2(s, out);
        self.add_force_plus(s, out);
    }
    /// Emits `D_2 (D_1 L_d + f_d^-)`.
    fn forced_d2_d1(&self, s: &Interval, out: &mut dyn Entries) {
        self.d2_d1(s, out);
        self.force_minus_d2(s, out);
    }
}

/// A system with constant mass matrix, any number of discrete potentials and discrete forces.
pub struct SeparableSystem {
    mass: SparseMatrix,
    inertia: IsotropicBlocks, // the same matrix
    quadrature: Quadrature,
    potentials: Vec<Box<dyn DiscretePotential>>,
    forces: Vec<Box<dyn DiscreteForce>>,
}

impl std::fmt::Debug for SeparableSystem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (potentials, forces) = (self.potentials.len(), self.forces.len());
        f.debug_struct("SeparableSystem")
            .field("mass", &self.mass)
            .field("quadrature", &self.quadrature)
            .field("potentials", &potentials)
            .field("forces", &forces)
            .finish()
    }
}

impl SeparableSystem {
    /// A free system with mass matrix `M` (kg, kg·m²; symmetric), shape `n × n`.
    ///
    /// # Panics
    /// When `M` is not square.
    #[must_use]
    pub fn new(mass: SparseMatrix) -> Self {
        assert_eq!(mass.shape().0, mass.shape().1, "the mass matrix must be square");
        let (inertia, quadrature) = (IsotropicBlocks::of(&mass), Quadrature::Midpoint);
        Self { mass, inertia, quadrature, potentials: Vec::new(), forces: Vec::new() }
    }

    /// A free system with a diagonal mass matrix.
    #[must_use]
    pub fn with_diagonal_mass(mass: &[f64]) -> Self {
        let n = mass.len();
        Self::new(SparseMatrix::assemble(n, n, |out| {
            for (i, m) in mass.iter().enumerate() {
                out.add(i, i, *m);
            }
        }))
    }

    /// The quadrature of the potentials added from here on (midpoint unless said otherwise).
    #[must_use]
    pub fn quadrature(mut self, quadrature: Quadrature) -> Self {
        self.quadrature = quadrature;
        self
    }

    /// Adds a potential, discretized by the system's quadrature.
    #[must_use]
    pub fn potential(self, potential: impl Potential + 'static) -> Self {
        let discrete = self.quadrature.discretize(potential);
        self.discrete_potential(discrete)
    }

    /// Adds a discrete potential of its own kind.
    #[must_use]
    pub fn discrete_potential(mut self, potential: Box<dyn DiscretePotential>) -> Self {
        self.potentials.push(potential);
        self
    }

    /// Adds a discrete force.
    ///
    /// # Panics
    /// When it is the second force with internal variables.
    #[must_use]
    pub fn force(mut self, force: Box<dyn DiscreteForce>) -> Self {
        let known = self.internal_variables();
        assert!(known == 0 || force.internal_variables() == 0, "one force has internal variables");
        self.forces.push(force);
        self
    }

    /// The mass matrix as multiples of `I_3` and single entries.
    #[must_use]
    pub fn inertia(&self) -> &IsotropicBlocks {
        &self.inertia
    }

    /// The sum `w` of the constant forces of linear potentials, shape `n`.
    #[must_use]
    pub fn constant_force(&self) -> Vec<f64> {
        let mut sum = vec![0.0; self.dim()];
        for force in self.potentials.iter().filter_map(|potential| potential.constant_force()) {
            sum.iter_mut().zip(force).for_each(|(sum, w)| *sum += w);
        }
        sum
    }

    /// Whether anything acts beside constant forces.
    #[must_use]
    pub fn has_variable_forces(&self) -> bool {
        !self.forces.is_empty() || self.variable().next().is_some()
    }

    /// The potentials that are not linear.
    fn variable(&self) -> impl Iterator<Item = &dyn DiscretePotential> {
        let all = self.potentials.iter().map(|potential| &**potential);
        all.filter(|potential| potential.constant_force().is_none())
    }

    /// `out ←` what [`DiscreteLagrangian::forced_d1`] has beside inertia and constant forces.
    pub fn variable_d1(&self, s: &Interval, out: &mut [f64]) {
        out.fill(0.0);
        self.variable().for_each(|potential| potential.add_d1(s, -s.h, out));
        self.add_force_minus(s, out);
    }

    /// Emits what [`DiscreteLagrangian::forced_d2_d1`] has beside inertia.
    pub fn variable_d2_d1(&self, s: &Interval, out: &mut dyn Entries) {
        self.variable().for_each(|potential| potential.add_d2_d1(s, -s.h, out));
        self.force_minus_d2(s, out);
    }

    /// How many discrete forces there are.
    #[must_use]
    pub fn force_count(&self) -> usize {
        self.forces.len()
    }

    /// Adds the work of each discrete force in a step, J, in the order in which they were added; `scratch`: shape
    /// `n`.
    pub fn add_work(&self, s: &Interval, scratch: &mut [f64], out: &mut [f64]) {
        for (force, work) in self.forces.iter().zip(out) {
            *work += force.work(s, scratch);
        }
    }

    /// Adds `scale f·v` of each discrete force at a Gauss node to `out`, in the order in which they were added, but for
    /// those of strain rates; `scratch`: shape `n`.
    pub fn add_power(
        &self,
        at: Configuration<'_>,
        v: &[f64],
        scale: f64,
        scratch: &mut [f64],
        out: &mut [f64],
    ) {
        let all = self.forces.iter().zip(out);
        for (force, work) in all.filter(|(force, _)| force.interpolation().is_none()) {
            scratch.fill(0.0);
            force.add_continuous(at, v, scratch);
            *work += scale * scratch.iter().zip(v).map(|(f, v)| f * v).sum::<f64>();
        }
    }

    /// `out ← ∇V(q) − f(t, q, v)`, N: what constraints and inertia have to balance.
    pub fn net_force(&self, at: Configuration<'_>, v: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        self.add_force(at, v, out);
        out.iter_mut().for_each(|f| *f = -*f);
        self.add_potential_gradient(at, 1.0, out);
    }

    /// Emits `∂/∂q` of [`SeparableSystem::net_force`] at rest or in a steady rotation `v`
    /// ([`DiscreteForce::add_stiffness`]), shape `n × n`; always the same places in the same order. Not symmetric where
    /// a force has no potential.
    pub fn stiffness(&self, at: Configuration<'_>, v: &[f64], out: &mut dyn Entries) {
        self.potential_hessian(at, 1.0, out);
        self.forces.iter().for_each(|force| force.add_stiffness(at, v, -1.0, out));
    }

    /// Emits `−∂f/∂v`, shape `n × n`, N·s/m; always the same places in the same order.
    pub fn damping(&self, at: Configuration<'_>, v: &[f64], out: &mut dyn Entries) {
        self.forces.iter().for_each(|force| force.add_damping(at, v, -1.0, out));
    }

    /// Adds the work of each force of strain rates in a Galerkin step to `out`, in the order in which forces were added.
    pub fn add_interpolated_work(&self, step: &StepPolynomial<'_>, out: &mut [f64]) {
        for (force, work) in self.forces.iter().zip(out) {
            *work += force.interpolation().map_or(0.0, |own| own.work(step));
        }
    }

    /// The potentials that a Galerkin step evaluates at Gauss nodes.
    fn gauss_potentials(&self) -> impl Iterator<Item = &dyn DiscretePotential> {
        let all = self.potentials.iter().map(|potential| &**potential);
        all.filter(|potential| potential.interpolation().is_none())
    }

    /// What of a Galerkin step depends on interpolated strains.
    fn interpolations(&self) -> impl Iterator<Item = &dyn StrainInterpolation> {
        let potentials = self.potentials.iter().filter_map(|potential| potential.interpolation());
        potentials.chain(self.forces.iter().filter_map(|force| force.interpolation()))
    }
}

impl MechanicalSystem for SeparableSystem {
    fn mass(&self) -> &SparseMatrix {
        &self.mass
    }

    fn emit_mass_of_step(&self, at: Configuration<'_>, h: f64, out: &mut dyn Entries) {
        self.inertia.emit(1.0, out);
        self.add_mass_of_step(at, h, out);
    }

    fn adds_mass(&self) -> bool {
        self.potentials.iter().any(|potential| potential.adds_mass())
    }

    fn add_mass_of_step(&self, at: Configuration<'_>, h: f64, out: &mut dyn Entries) {
        self.potentials.iter().for_each(|potential| potential.add_mass(at, h, out));
    }

    fn potential_energy(&self, at: Configuration<'_>) -> f64 {
        self.potentials.iter().map(|u| u.potential(at)).sum()
    }

    fn add_potential_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        for potential in &self.potentials {
            potential.add_gradient(at, scale, out);
        }
    }

    fn add_force(&self, at: Configuration<'_>, v: &[f64], out: &mut [f64]) {
        for force in &self.forces {
            force.add_continuous(at, v, out);
        }
    }

    fn has_constant_force(&self) -> bool {
        !self.has_variable_forces()
    }

    fn is_dissipative(&self) -> bool {
        self.forces.iter().any(|force| force.is_dissipative())
    }

    fn has_memory(&self) -> bool {
        self.internal_variables() > 0
    }

    fn interpolation(&self) -> Option<&dyn StrainInterpolation> {
        self.interpolations().next().map(|_| self as &dyn StrainInterpolation)
    }

    fn gauss_energy(&self, at: Configuration<'_>) -> f64 {
        self.gauss_potentials().map(|u| u.potential(at)).sum()
    }

    fn add_gauss_force(&self, at: Configuration<'_>, v: &[f64], out: &mut [f64]) {
        self.gauss_potentials().for_each(|potential| potential.add_gradient(at, -1.0, out));
        for force in self.forces.iter().filter(|own| own.interpolation().is_none()) {
            force.add_continuous(at, v, out);
        }
    }

    fn potential_stiffness(&self, at: Configuration<'_>, out: &mut dyn Entries) {
        self.potential_hessian(at, 1.0, out);
    }

    fn force_damping(&self, at: Configuration<'_>, v: &[f64], out: &mut dyn Entries) {
        self.damping(at, v, out);
    }
}

impl StrainInterpolation for SeparableSystem {
    fn energy(&self, step: &StepPolynomial<'_>) -> f64 {
        self.interpolations().map(|own| own.energy(step)).sum()
    }

    fn work(&self, step: &StepPolynomial<'_>) -> f64 {
        self.interpolations().map(|own| own.work(step)).sum()
    }

    fn add_impulses(&self, step: &StepPolynomial<'_>, out: &mut [Vec<f64>]) {
        self.interpolations().for_each(|own| own.add_impulses(step, out));
    }

    fn add_derivative(
        &self,
        step: &StepPolynomial<'_>,
        at: (usize, usize),
        scale: f64,
        out: &mut dyn Entries,
    ) {
        self.interpolations().for_each(|own| own.add_derivative(step, at, scale, out));
    }
}

impl DiscreteLagrangian for SeparableSystem {
    fn discrete_lagrangian(&self, s: &Interval) -> f64 {
        let added = self.added_kinetic_energy(s);
        self.kinetic_energy(&s.dq) / s.h + s.h * (added - self.discrete_potential_energy(s)) // (18)
    }

    fn d1(&self, s: &Interval, out: &mut [f64]) {
        out.fill(0.0);
        for potential in &self.potentials {
            potential.add_d1(s, -s.h, out);
        }
        self.inertia.mul_add(-1.0 / s.h, &s.dq, out);
    }

    fn d2(&self, s: &Interval, out: &mut [f64]) {
        out.fill(0.0);
        for potential in &self.potentials {
            potential.add_d2(s, -s.h, out);
        }
        self.inertia.mul_add(1.0 / s.h, &s.dq, out);
    }

    fn d2_d1(&self, s: &Interval, out: &mut dyn Entries) {
        for potential in &self.potentials {
            potential.add_d2_d1(s, -s.h, out);
        }
        self.inertia.emit(-1.0 / s.h, out);
    }

    fn d1_d1(&self, s: &Interval, out: &mut dyn Entries) {
        for potential in &self.potentials {
            potential.add_d1_d1(s, -s.h, out);
        }
        self.inertia.emit(1.0 / s.h, out);
    }

    fn d2_d2(&self, s: &Interval, out: &mut dyn Entries) {
        for potential in &self.potentials {
            potential.add_d2_d2(s, -s.h, out);
        }
        self.inertia.emit(1.0 / s.h, out);
    }

    fn potential_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries) {
        self.potentials.iter().for_each(|potential| potential.add_hessian(at, scale, out));
    }

    fn gauss_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries) {
        self.gauss_potentials().for_each(|potential| potential.add_hessian(at, scale, out));
    }

    fn add_force_minus(&self, s: &Interval, out: &mut [f64]) {
        for force in &self.forces {
            force.add_minus(s, out);
        }
    }

    fn add_force_plus(&self, s: &Interval, out: &mut [f64]) {
        for force in &self.forces {
            force.add_plus(s, out);
        }
    }

    fn force_minus_d2(&self, s: &Interval, out: &mut dyn Entries) {
        for force in &self.forces {
            force.add_minus_d2(s, out);
        }
    }

    fn internal_variables(&self) -> usize {
        self.forces.iter().map(|force| force.internal_variables()).sum()
    }

    fn advance_internal(&self, s: &Interval, out: &mut [f64]) {
        if let Some(force) = self.forces.iter().find(|force| force.internal_variables() > 0) {
            force.advance(s, out);
        }
    }

    fn discrete_potential_energy(&self, s: &Interval) -> f64 {
        self.potentials.iter().map(|u| u.value(s)).sum()
    }

    fn added_kinetic_energy(&self, s: &Interval) -> f64 {
        self.potentials.iter().map(|u| u.added_kinetic_energy(s)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::potential::{DualPotential, ScalarField};
    use num_dual::DualNum;

    /// A nonlinear coupling of three coordinates.
    struct Quartic;
    impl ScalarField<3> for Quartic {
        fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D; 3]) -> D {
            (q[0] * q[1] - q[2]).powi(2) + (q[2] * q[2] + q[0]).sin() * q[1]
        }
    }

    fn system(quadrature: Quadrature) -> SeparableSystem {
        SeparableSystem::with_diagonal_mass(&[2.0, 3.0, 0.5])
            .quadrature(quadrature)
            .potential(DualPotential(Quartic))
    }

    fn interval(q0: [f64; 3], q1: [f64; 3]) -> Interval {
        Interval::between(0.0, 0.3, &q0, &q1)
    }

    #[test]
    fn slot_derivatives_are_those_of_the_discrete_lagrangian() {
        let (q0, q1) = ([0.3, -0.4, 0.9], [0.5, -0.1, 0.7]);
        for quadrature in [Quadrature::Midpoint, Quadrature::Trapezoidal] {
            let system = system(quadrature);
            let (mut d1, mut d2) = ([0.0; 3], [0.0; 3]);
            let s = interval(q0, q1);
            system.d1(&s, &mut d1);
            system.d2(&s, &mut d2);
            let mixed = SparseMatrix::assemble(3, 3, |out| system.d2_d1(&s, out)).to_dense();
            let first = SparseMatrix::assemble(3, 3, |out| system.d1_d1(&s, out)).to_dense();
            let second = SparseMatrix::assemble(3, 3, |out| system.d2_d2(&s, out)).to_dense();
            let e = 1e-5;
            for i in 0..3 {
                // by reference: a closure that changes an argument it takes by value may change the
                // caller's copy (rust-lang/rust#155241)
                let shifted = |q: &[f64; 3], by: f64| -> [f64; 3] {
                    std::array::from_fn(|k| if k == i { q[k] + by } else { q[k] })
                };
                let L = |a, b| system.discrete_lagrangian(&interval(a, b));
                let fd1 = (L(shifted(&q0, e), q1) - L(shifted(&q0, -e), q1)) / (2.0 * e);
                let fd2 = (L(q0, shifted(&q1, e)) - L(q0, shifted(&q1, -e))) / (2.0 * e);
                assert!((fd1 - d1[i]).abs() < 1e-8, "D1 [{i}]: {} vs {fd1}", d1[i]);
                assert!((fd2 - d2[i]).abs() < 1e-8, "D2 [{i}]: {} vs {fd2}", d2[i]);
                let (mut plus, mut minus) = ([0.0; 3], [0.0; 3]);
                system.d1(&interval(q0, shifted(&q1, e)), &mut plus);
                system.d1(&interval(q0, shifted(&q1, -e)), &mut minus);
                for k in 0..3 {
                    let fd = (plus[k] - minus[k]) / (2.0 * e);
                    let exact = mixed[(k, i)];
                    assert!((fd - exact).abs() < 1e-8, "D2D1 [{k},{i}]: {exact} vs {fd}");
                }
                system.d1(&interval(shifted(&q0, e), q1), &mut plus);
                system.d1(&interval(shifted(&q0, -e), q1), &mut minus);
                for k in 0..3 {
                    let (fd, exact) = ((plus[k] - minus[k]) / (2.0 * e), first[(k, i)]);
                    assert!((fd - exact).abs() < 1e-8, "D1D1 [{k},{i}]: {exact} vs {fd}");
                }
                system.d2(&interval(q0, shifted(&q1, e)), &mut plus);
                system.d2(&interval(q0, shifted(&q1, -e)), &mut minus);
                for k in 0..3 {
                    let (fd, exact) = ((plus[k] - minus[k]) / (2.0 * e), second[(k, i)]);
                    assert!((fd - exact).abs() < 1e-8, "D2D2 [{k},{i}]: {exact} vs {fd}");
                }
            }
        }
    }

    #[test]
    fn the_discrete_lagrangian_is_self_adjoint() {
        // L_d(q0, q1, h) = −L_d(q1, q0, −h)
        let system = system(Quadrature::Midpoint);
        let s = interval([0.3, -0.4, 0.9], [0.5, -0.1, 0.7]);
        let mut back = interval([0.5, -0.1, 0.7], [0.3, -0.4, 0.9]);
        back.h = -back.h;
        let sum = system.discrete_lagrangian(&s) + system.discrete_lagrangian(&back);
        assert!(sum.abs() < 1e-15, "L_d(q0,q1,h) + L_d(q1,q0,−h) = {sum:e}");
    }
}
