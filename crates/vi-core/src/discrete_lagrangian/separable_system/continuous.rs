//! The potentials and forces at a node, and on the polynomial of a Galerkin step.

use super::SeparableSystem;
use crate::configuration::{Configuration, Motion};
use crate::discrete_lagrangian::slot_derivatives::DiscreteLagrangian;
use crate::galerkin::{GaussLobatto, GaussPoint};
use crate::interpolation::{StepPolynomial, StrainInterpolation};
use crate::interval::Interval;
use crate::mechanical_system::MechanicalSystem;
use crate::sparse::{Block, Entries, Product, SparseMatrix};

impl MechanicalSystem for SeparableSystem {
    fn mass(&self) -> &SparseMatrix {
        &self.mass
    }

    fn emit_mass_of_step(&self, at: Configuration<'_>, h: f64, out: &mut dyn Entries) {
        self.inertia.emit(1.0, out);
        self.add_mass_of_step(at, h, out);
    }

    fn add_momentum_of_step(&self, at: Configuration<'_>, h: f64, v: &[f64], out: &mut [f64]) {
        self.inertia.mul_add(1.0, v, out);
        self.add_mass_of_step(at, h, &mut Product { v, out });
    }

    fn kinetic_energy(&self, v: &[f64]) -> f64 {
        0.5 * self.inertia.quadratic_form(v)
    }

    fn adds_mass(&self) -> bool {
        self.potentials().any(|potential| potential.adds_mass())
    }

    fn add_mass_of_step(&self, at: Configuration<'_>, h: f64, out: &mut dyn Entries) {
        self.potentials().for_each(|potential| potential.add_mass(at, h, out));
    }

    fn added_mass_slope(&self, at: Configuration<'_>, h: f64, v: &[f64], out: &mut dyn Entries) {
        self.potentials().for_each(|potential| potential.add_mass_slope(at, h, v, out));
    }

    fn added_mass_by_internal(
        &self,
        at: Configuration<'_>,
        h: f64,
        v: &[f64],
        out: &mut dyn Entries,
    ) {
        if let Some(own) = self.potential_with_memory() {
            let column = self.variables_before_potentials();
            let mut block = Block { into: out, row: 0, column, scale: 1.0, transposed: false };
            own.add_mass_by_internal(at, h, v, &mut block);
        }
    }

    fn potential_energy(&self, at: Configuration<'_>) -> f64 {
        self.potentials().map(|u| u.potential(at)).sum()
    }

    fn add_potential_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        for potential in self.potentials() {
            potential.add_gradient(at, scale, out);
        }
    }

    fn add_force(&self, at: Motion<'_>, out: &mut [f64]) {
        for force in &self.forces {
            force.add_continuous(at, out);
        }
    }

    fn has_constant_force(&self) -> bool {
        !self.has_variable_forces()
    }

    fn is_dissipative(&self) -> bool {
        self.forces.iter().any(|force| force.is_dissipative())
    }

    fn has_memory(&self) -> bool {
        self.internal_variables() > self.places_of_signals().len() + self.works.len()
    }

    fn is_sampled(&self) -> bool {
        self.signals.as_ref().is_some_and(|signals| signals.is_sampled())
    }

    fn collocate(
        &self,
        s: &Interval,
        constants: &GaussLobatto,
        gauss: &mut [GaussPoint],
        end: &mut Vec<f64>,
    ) {
        let signals = self.signals.as_ref().filter(|own| own.has_states());
        if signals.is_none() && self.works.is_empty() {
            return;
        }
        for internal in gauss.iter_mut().map(|node| &mut node.internal).chain([&mut *end]) {
            internal.clone_from(&s.internal);
        }
        let (places, works) = (self.places_of_signals(), self.places_of_works());
        if works.end > end.len() {
            return;
        }
        if let Some(signals) = signals {
            signals.collocate(s, constants, gauss, &mut end[places]);
        }
        self.collocate_works(s, constants, gauss, &mut end[works]);
    }

    fn interpolation(&self) -> Option<&dyn StrainInterpolation> {
        self.interpolations().next().map(|_| self as &dyn StrainInterpolation)
    }

    fn gauss_energy(&self, at: Configuration<'_>) -> f64 {
        self.gauss_potentials().map(|u| u.potential(at)).sum()
    }

    fn add_gauss_force(&self, at: Motion<'_>, out: &mut [f64]) {
        self.gauss_potentials()
            .for_each(|potential| potential.add_gradient(at.configuration(), -1.0, out));
        for force in self.gauss_forces() {
            force.add_continuous(at, out);
        }
    }

    fn potential_stiffness(&self, at: Configuration<'_>, out: &mut dyn Entries) {
        self.potential_hessian(at, 1.0, out);
    }

    fn force_damping(&self, at: Motion<'_>, out: &mut dyn Entries) {
        self.damping(at, out);
    }
}

impl StrainInterpolation for SeparableSystem {
    fn energy(&self, step: &StepPolynomial<'_>) -> f64 {
        self.interpolations().map(|own| own.energy(step)).sum()
    }

    fn work(&self, step: &StepPolynomial<'_>) -> f64 {
        self.interpolations().map(|own| own.work(step)).sum()
    }

    fn add_step_slope(&self, step: &StepPolynomial<'_>, i: usize, dh: f64, out: &mut [f64]) {
        self.interpolations().for_each(|own| own.add_step_slope(step, i, dh, out));
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
