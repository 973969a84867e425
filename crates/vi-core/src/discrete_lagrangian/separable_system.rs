//! Systems whose kinetic energy has a constant mass matrix.

mod beside_unknowns;
mod continuous;
mod discrete;
mod works;

use super::slot_derivatives::DiscreteLagrangian;
use crate::configuration::Motion;
use crate::coordinate_force::AlongUnknown;
use crate::force::{DiscreteForce, Source};
use crate::interpolation::{StepPolynomial, StrainInterpolation};
use crate::interval::Interval;
use crate::isotropic::IsotropicBlocks;
use crate::mechanical_system::MechanicalSystem;
use crate::potential::{DiscretePotential, LinearPotential, Potential, Quadrature};
use crate::quantity_effort::QuantityEffort;
use crate::signals::Signals;
use crate::sparse::{Entries, SparseMatrix};
use crate::strain_energy::StrainEnergy;
use std::ops::Range;

pub use works::Working;

/// A system with constant mass matrix, gravity, any number of discrete potentials and discrete
/// forces.
pub struct SeparableSystem {
    mass: SparseMatrix,
    inertia: IsotropicBlocks, // the same matrix
    quadrature: Quadrature,
    gravity: Option<Box<dyn DiscretePotential>>,
    potentials: Vec<Box<dyn DiscretePotential>>, // the others
    forces: Vec<Box<dyn DiscreteForce>>,
    sources: Vec<Source>, // of each force
    signals: Option<Box<dyn Signals>>,
    works: Vec<Working>,
}

impl std::fmt::Debug for SeparableSystem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (potentials, forces) = (self.potentials().count(), self.forces.len());
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
        let (potentials, forces, sources) = (Vec::new(), Vec::new(), Vec::new());
        let (gravity, signals, works) = (None, None, Vec::new());
        Self { mass, inertia, quadrature, gravity, potentials, forces, sources, signals, works }
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

    /// With gravity, `V = −w·q` with the weight `w`, by the system's quadrature.
    #[must_use]
    pub fn gravity(mut self, weight: LinearPotential) -> Self {
        self.gravity = Some(self.quadrature.discretize(weight));
        self
    }

    /// Adds a potential, discretized by the system's quadrature.
    #[must_use]
    pub fn potential(self, potential: impl Potential + 'static) -> Self {
        let discrete = self.quadrature.discretize(potential);
        self.discrete_potential(discrete)
    }

    /// Adds a discrete potential of its own kind.
    ///
    /// # Panics
    /// When it is the second potential with internal variables, or with derived values.
    #[must_use]
    pub fn discrete_potential(mut self, potential: Box<dyn DiscretePotential>) -> Self {
        let known = self.potential_with_memory().is_some();
        assert!(!known || potential.internal_variables() == 0, "one potential has memory");
        let derives = |own: &dyn DiscretePotential| own.derived_values() + own.end_values() > 0;
        let known = self.potentials().any(derives);
        assert!(!known || !derives(&*potential), "one potential derives values");
        self.potentials.push(potential);
        self
    }

    /// Adds a discrete force without a name.
    ///
    /// # Panics
    /// When it is the second force with internal variables.
    #[must_use]
    pub fn force(self, force: Box<dyn DiscreteForce>) -> Self {
        self.force_of(Source::default(), force)
    }

    /// Adds a discrete force with what exerts it.
    ///
    /// # Panics
    /// When it is the second force with internal variables.
    #[must_use]
    pub fn force_of(mut self, source: Source, force: Box<dyn DiscreteForce>) -> Self {
        let known = self.variables_of_forces();
        assert!(known == 0 || force.internal_variables() == 0, "one force has internal variables");
        self.forces.push(force);
        self.sources.push(source);
        self
    }

    /// With signals beside the motion, whose internal variables follow those of the forces: these
    /// are added before.
    #[must_use]
    pub fn signals(mut self, signals: Box<dyn Signals>) -> Self {
        self.signals = Some(signals);
        self
    }

    fn variable_count_of_signals(&self) -> usize {
        self.signals.as_ref().map_or(0, |signals| signals.count())
    }

    fn variables_before_potentials(&self) -> usize {
        self.variables_of_forces() + self.variable_count_of_signals() + self.works.len()
    }

    /// Where the signals stand among all internal variables.
    #[must_use]
    pub fn places_of_signals(&self) -> Range<usize> {
        let first = self.variables_of_forces();
        first..first + self.variable_count_of_signals()
    }

    /// Puts the states of signals where they rest at an equilibrium, among all internal variables.
    pub fn rest_signals(&self, at: Motion<'_>, internal: &mut [f64]) {
        if let Some(signals) = &self.signals {
            signals.rest(at, &mut internal[self.places_of_signals()]);
        }
    }

    /// How all internal variables change at the start of a motion whose configuration and velocity
    /// change by `dq` and `dv`: `δz_0`. Those of forces start at zero.
    #[must_use]
    pub fn internal_change_at_start(&self, at: Motion<'_>, change: [&[f64]; 2]) -> Vec<f64> {
        let mut out = vec![0.0; self.internal_variables()];
        if let Some(signals) = &self.signals {
            signals.begin_change(at, change, &mut out[self.places_of_signals()]);
        }
        self.begin_works_change(at.configuration(), change[0], &mut out[self.places_of_works()]);
        if let Some(potential) = self.potential_with_memory() {
            let first = self.variables_before_potentials();
            potential.begin_change(at.q, change[0], &mut out[first..]);
        }
        out
    }

    /// Internal variables of the forces; those of signals, works and of a potential follow.
    #[must_use]
    pub fn variables_of_forces(&self) -> usize {
        self.forces.iter().map(|force| force.internal_variables()).sum()
    }

    /// Those of all internal variables that are of a potential.
    #[must_use]
    pub fn variables_of_potentials<'a>(&self, internal: &'a [f64]) -> &'a [f64] {
        internal.get(self.variables_before_potentials()..).unwrap_or_default()
    }

    fn potential_with_memory(&self) -> Option<&dyn DiscretePotential> {
        self.potentials().find(|own| own.internal_variables() > 0)
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
        for force in self.potentials().filter_map(|potential| potential.constant_force()) {
            sum.iter_mut().zip(force).for_each(|(sum, w)| *sum += w);
        }
        sum
    }

    /// Whether anything acts beside constant forces.
    #[must_use]
    pub fn has_variable_forces(&self) -> bool {
        !self.forces.is_empty() || self.signals.is_some() || self.variable().next().is_some()
    }

    /// Gravity and the other potentials, in the order in which they were added.
    fn potentials(&self) -> impl Iterator<Item = &dyn DiscretePotential> {
        self.gravity.iter().chain(&self.potentials).map(|potential| &**potential)
    }

    /// The potentials that are not linear.
    fn variable(&self) -> impl Iterator<Item = &dyn DiscretePotential> {
        self.potentials().filter(|potential| potential.constant_force().is_none())
    }

    /// What acts along unknowns of a step, always in the same order.
    pub fn along_unknowns(&self) -> impl Iterator<Item = AlongUnknown<'_>> {
        let potentials = self.potentials().filter_map(|own| own.along_unknown());
        potentials.chain(self.forces.iter().filter_map(|own| own.along_unknown()))
    }

    /// The potentials that are not linear, and the forces, but for what acts along unknowns and
    /// those whose indices are `apart`.
    fn other<'a>(
        &'a self,
        apart: &'a [usize],
    ) -> (
        impl Iterator<Item = &'a dyn DiscretePotential>,
        impl Iterator<Item = &'a dyn DiscreteForce>,
    ) {
        let forces = self.forces.iter().enumerate().filter(|(k, _)| !apart.contains(k));
        let forces = forces.map(|(_, force)| &**force);
        (
            self.variable().filter(|potential| potential.along_unknown().is_none()),
            forces.filter(|force| force.along_unknown().is_none()),
        )
    }

    /// The discrete forces that act along an unknown by quantities of the whole system, with their
    /// indices.
    pub fn quantity_efforts(&self) -> impl Iterator<Item = (usize, &dyn QuantityEffort)> {
        let forces = self.forces.iter().enumerate();
        forces.filter_map(|(k, force)| force.of_quantities().map(|own| (k, own)))
    }

    /// The one of this index.
    #[must_use]
    pub fn quantity_effort(&self, force: usize) -> Option<&dyn QuantityEffort> {
        self.forces.get(force).and_then(|force| force.of_quantities())
    }

    /// Emits `D_2 f_d^-` of one discrete force.
    pub fn force_d2(&self, force: usize, s: &Interval, out: &mut dyn Entries) {
        self.forces[force].add_minus_d2(s, out);
    }

    /// Whether anything acts beside constant forces, [`SeparableSystem::along_unknowns`] and the
    /// forces `apart`; or signals go on beside the motion that no force `apart` reads.
    #[must_use]
    pub fn has_other_forces(&self, apart: &[usize]) -> bool {
        let (mut potentials, mut forces) = self.other(apart);
        let signals = self.signals.is_some() && apart.is_empty();
        signals || potentials.next().is_some() || forces.next().is_some()
    }

    /// `out ←` what [`DiscreteLagrangian::forced_d1`] has beside inertia, constant forces,
    /// [`SeparableSystem::along_unknowns`] and the forces `apart`.
    pub fn other_d1(&self, s: &Interval, apart: &[usize], out: &mut [f64]) {
        out.fill(0.0);
        let (potentials, forces) = self.other(apart);
        potentials.for_each(|potential| potential.add_d1(s, -s.h, out));
        forces.for_each(|force| force.add_minus(s, out));
    }

    /// Emits what [`DiscreteLagrangian::forced_d2_d1`] has beside inertia,
    /// [`SeparableSystem::along_unknowns`] and the forces `apart`.
    pub fn other_d2_d1(&self, s: &Interval, apart: &[usize], out: &mut dyn Entries) {
        let (potentials, forces) = self.other(apart);
        potentials.for_each(|potential| potential.add_d2_d1(s, -s.h, out));
        forces.for_each(|force| force.add_minus_d2(s, out));
    }

    /// What exerts each discrete force.
    #[must_use]
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }

    /// Adds the work of each discrete force in a step, J, in the order of
    /// [`SeparableSystem::sources`]; `scratch`: shape `n`.
    pub fn add_work(&self, s: &Interval, scratch: &mut [f64], out: &mut [f64]) {
        for (force, work) in self.forces.iter().zip(out) {
            *work += force.work(s, scratch);
        }
    }

    /// Adds `scale f·v` of each discrete force at a Gauss node to `out`, in the order of
    /// [`SeparableSystem::sources`], but for those of strain rates; `scratch`: shape `n`.
    pub fn add_power(&self, at: Motion<'_>, scale: f64, scratch: &mut [f64], out: &mut [f64]) {
        let all = self.forces.iter().zip(out);
        for (force, work) in all.filter(|(force, _)| force.interpolation().is_none()) {
            scratch.fill(0.0);
            force.add_continuous(at, scratch);
            *work += scale * scratch.iter().zip(at.v).map(|(f, v)| f * v).sum::<f64>();
        }
    }

    /// `out ← ∇V(q) − f(t, q, v)`, N: what constraints and inertia have to balance.
    pub fn net_force(&self, at: Motion<'_>, out: &mut [f64]) {
        out.fill(0.0);
        self.add_force(at, out);
        out.iter_mut().for_each(|f| *f = -*f);
        self.add_potential_gradient(at.configuration(), 1.0, out);
    }

    /// Emits `∂/∂q` of [`SeparableSystem::net_force`] at rest or in a steady rotation `v`
    /// ([`DiscreteForce::add_stiffness`]), shape `n × n`; always the same places in the same order.
    /// Not symmetric where a force has no potential.
    pub fn stiffness(&self, at: Motion<'_>, out: &mut dyn Entries) {
        self.potential_hessian(at.configuration(), 1.0, out);
        self.forces.iter().for_each(|force| force.add_stiffness(at, -1.0, out));
    }

    /// The elastic energies of strains among the potentials, in the order in which they were added.
    pub fn strain_energies(&self) -> impl Iterator<Item = &dyn StrainEnergy> {
        self.potentials().filter_map(|potential| potential.strain_energy())
    }

    /// [`SeparableSystem::stiffness`] with these stresses of all
    /// [`SeparableSystem::strain_energies`], one after the other, in the place of `C ε(q)`; the
    /// same places in the same order.
    pub fn stressed_stiffness(&self, at: Motion<'_>, mut sigma: &[f64], out: &mut dyn Entries) {
        for potential in self.potentials() {
            match potential.strain_energy() {
                Some(energy) => {
                    let (own, rest) = sigma.split_at(energy.stress_count());
                    energy.add_stressed_hessian(at.q, own, 1.0, out);
                    sigma = rest;
                }
                None => potential.add_hessian(at.configuration(), 1.0, out),
            }
        }
        self.forces.iter().for_each(|force| force.add_stiffness(at, -1.0, out));
    }

    /// [`SeparableSystem::net_force`] without [`SeparableSystem::strain_energies`].
    pub fn net_force_beside_strains(&self, at: Motion<'_>, out: &mut [f64]) {
        out.fill(0.0);
        self.add_force(at, out);
        out.iter_mut().for_each(|f| *f = -*f);
        self.beside_strains()
            .for_each(|potential| potential.add_gradient(at.configuration(), 1.0, out));
    }

    /// Emits its derivative, [`SeparableSystem::stiffness`] without
    /// [`SeparableSystem::strain_energies`].
    pub fn stiffness_beside_strains(&self, at: Motion<'_>, out: &mut dyn Entries) {
        self.beside_strains()
            .for_each(|potential| potential.add_hessian(at.configuration(), 1.0, out));
        self.forces.iter().for_each(|force| force.add_stiffness(at, -1.0, out));
    }

    fn beside_strains(&self) -> impl Iterator<Item = &dyn DiscretePotential> {
        self.potentials().filter(|potential| potential.strain_energy().is_none())
    }

    /// Emits `−∂f/∂q` of one force at `v`, in the order of [`SeparableSystem::sources`].
    pub fn stiffness_of(&self, force: usize, at: Motion<'_>, out: &mut dyn Entries) {
        self.forces[force].add_stiffness(at, -1.0, out);
    }

    /// Emits `−∂f/∂v` of one force, in the order of [`SeparableSystem::sources`].
    pub fn damping_of(&self, force: usize, at: Motion<'_>, out: &mut dyn Entries) {
        self.forces[force].add_damping(at, -1.0, out);
    }

    /// Emits `−∂f/∂v`, shape `n × n`, N·s/m; always the same places in the same order.
    pub fn damping(&self, at: Motion<'_>, out: &mut dyn Entries) {
        self.forces.iter().for_each(|force| force.add_damping(at, -1.0, out));
    }

    /// The same of the forces that act from the ground: [`DiscreteForce::acts_from_ground`].
    pub fn damping_to_ground(&self, at: Motion<'_>, out: &mut dyn Entries) {
        let from_ground = self.forces.iter().filter(|force| force.acts_from_ground());
        from_ground.for_each(|force| force.add_damping(at, -1.0, out));
    }

    /// Adds the work of each force of strain rates in a Galerkin step to `out`, in the order of
    /// [`SeparableSystem::sources`].
    pub fn add_interpolated_work(&self, step: &StepPolynomial<'_>, out: &mut [f64]) {
        for (force, work) in self.forces.iter().zip(out) {
            *work += force.interpolation().map_or(0.0, |own| own.work(step));
        }
    }

    /// The potentials that a Galerkin step evaluates at Gauss nodes.
    fn gauss_potentials(&self) -> impl Iterator<Item = &dyn DiscretePotential> {
        self.potentials().filter(|potential| potential.interpolation().is_none())
    }

    /// The forces that a Galerkin step evaluates there.
    fn gauss_forces(&self) -> impl Iterator<Item = &dyn DiscreteForce> {
        let forces = self.forces.iter().map(|force| &**force);
        forces.filter(|force| force.interpolation().is_none())
    }

    /// What of a Galerkin step depends on interpolated strains.
    fn interpolations(&self) -> impl Iterator<Item = &dyn StrainInterpolation> {
        let potentials = self.potentials().filter_map(|potential| potential.interpolation());
        potentials.chain(self.forces.iter().filter_map(|force| force.interpolation()))
    }
}
