//! The discrete Lagrangian of potentials and forces.

use super::SeparableSystem;
use crate::configuration::{Configuration, Motion};
use crate::discrete_lagrangian::slot_derivatives::{DiscreteLagrangian, NoStepSlope};
use crate::force::Source;
use crate::interval::{Interval, Slot, StepChange};
use crate::mechanical_system::MechanicalSystem;
use crate::potential::DiscretePotential;
use crate::signals::StateRates;
use crate::sparse::{Block, Entries, Product};

impl DiscreteLagrangian for SeparableSystem {
    fn prepare(&self, s: &mut Interval) {
        if let Some(own) = self.potentials().find(|own| own.derived_values() > 0) {
            s.derive(own.derived_values(), |q, out| own.derive(q, out));
        }
    }

    fn reach(&self, s: &mut Interval) {
        if let Some(own) = self.potentials().find(|own| own.end_values() > 0) {
            s.derive_end(own.end_values(), |q, out| own.derive_end(q, out));
        }
    }

    fn discrete_lagrangian(&self, s: &Interval) -> f64 {
        let added = self.added_kinetic_energy(s);
        self.kinetic_energy(&s.dq) / s.h + s.h * (added - self.discrete_potential_energy(s)) // (18)
    }

    fn d1(&self, s: &Interval, out: &mut [f64]) {
        out.fill(0.0);
        for potential in self.potentials() {
            potential.add_d1(s, -s.h, out);
        }
        self.inertia.mul_add(-1.0 / s.h, &s.dq, out);
    }

    fn d2(&self, s: &Interval, out: &mut [f64]) {
        out.fill(0.0);
        for potential in self.potentials() {
            potential.add_d2(s, -s.h, out);
        }
        self.inertia.mul_add(1.0 / s.h, &s.dq, out);
    }

    fn d2_d1(&self, s: &Interval, out: &mut dyn Entries) {
        for potential in self.potentials() {
            potential.add_d2_d1(s, -s.h, out);
        }
        self.inertia.emit(-1.0 / s.h, out);
    }

    fn d1_d1(&self, s: &Interval, out: &mut dyn Entries) {
        for potential in self.potentials() {
            potential.add_d1_d1(s, -s.h, out);
        }
        self.inertia.emit(1.0 / s.h, out);
    }

    fn d2_d2(&self, s: &Interval, out: &mut dyn Entries) {
        for potential in self.potentials() {
            potential.add_d2_d2(s, -s.h, out);
        }
        self.inertia.emit(1.0 / s.h, out);
    }

    fn potential_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries) {
        self.potentials().for_each(|potential| potential.add_hessian(at, scale, out));
    }

    fn gauss_slopes(&self, at: Motion<'_>, by: [f64; 2], out: &mut dyn Entries) {
        if by[0] != 0.0 {
            self.gauss_potentials()
                .for_each(|potential| potential.add_hessian(at.configuration(), -by[0], out));
        }
        self.gauss_forces().for_each(|force| force.add_gauss_slopes(at, by, out));
    }

    fn level_slopes(&self, at: Motion<'_>, by: [f64; 2], out: &mut dyn Entries) {
        if by[0] != 0.0 {
            self.potential_hessian(at.configuration(), -by[0], out);
        }
        self.forces.iter().for_each(|force| force.add_gauss_slopes(at, by, out));
    }

    fn state_slopes(&self, at: Motion<'_>, out: &mut dyn Entries) {
        self.forces.iter().for_each(|force| force.add_state_slopes(at, 1.0, out));
    }

    fn state_rates(&self, at: Motion<'_>) -> Option<StateRates> {
        if at.internal.len() != self.internal_variables() {
            return None;
        }
        let signals = self.signals.as_ref().filter(|signals| signals.has_states());
        let rates = signals.map(|signals| signals.rates(at));
        match self.works.is_empty() {
            true => rates,
            false => Some(self.with_works(rates.unwrap_or_default(), at)),
        }
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

    fn force_slope(&self, s: &Interval, of: Slot, by: Slot, out: &mut dyn Entries) {
        for force in &self.forces {
            force.add_slope(s, of, by, out);
        }
    }

    fn internal_slope(&self, s: &Interval, of: Slot, out: &mut dyn Entries) {
        self.forces.iter().for_each(|force| force.add_internal_slope(s, of, out));
        if let Some(own) = self.potential_with_memory() {
            let column = self.variables_before_potentials();
            let mut block = Block { into: out, row: 0, column, scale: 1.0, transposed: false };
            own.add_internal_slope(s, of, -s.h, &mut block);
        }
    }

    fn advance_slope(&self, s: &Interval, by: Slot, out: &mut dyn Entries) {
        self.forces.iter().for_each(|force| force.add_advance_slope(s, by, out));
        if let Some(signals) = &self.signals {
            let (row, into) = (self.variables_of_forces(), &mut *out);
            let mut own = Block { into, row, column: 0, scale: 1.0, transposed: false };
            signals.advance_slope(s, by, &mut own);
        }
        self.emit_work_slopes(s, by, out);
        if let Some(potential) = self.potential_with_memory() {
            let (row, into) = (self.variables_before_potentials(), out);
            let mut own = Block { into, row, column: 0, scale: 1.0, transposed: false };
            potential.add_advance_slope(s, by, &mut own);
        }
    }

    fn advance_internal_slope(&self, s: &Interval, out: &mut dyn Entries) {
        self.forces.iter().for_each(|force| force.add_advance_internal_slope(s, out));
        if let Some(signals) = &self.signals {
            let (row, into) = (self.variables_of_forces(), &mut *out);
            let mut own = Block { into, row, column: row, scale: 1.0, transposed: false };
            signals.advance_internal_slope(s, &mut own);
        }
        self.emit_work_slopes_by_state(s, out);
        if let Some(potential) = self.potential_with_memory() {
            let (row, into) = (self.variables_before_potentials(), out);
            let mut own = Block { into, row, column: row, scale: 1.0, transposed: false };
            potential.add_advance_internal_slope(s, &mut own);
        }
    }

    fn add_step_slope(
        &self,
        s: &Interval,
        of: Slot,
        change: StepChange,
        out: &mut [f64],
    ) -> Result<(), NoStepSlope> {
        self.without_added_mass()?;
        let dh = change.length;
        for potential in self.potentials() {
            match of {
                Slot::First => potential.add_d1(s, -dh, out),
                Slot::Second => potential.add_d2(s, -dh, out),
            }
        }
        self.inertia.mul_add(-of.sign() * dh / (s.h * s.h), &s.dq, out);
        for (force, source) in self.forces.iter().zip(&self.sources) {
            force.add_step_slope(s, of, change, out).map_err(|_| without_time(source))?;
        }
        Ok(())
    }

    fn gauss_step_slope(
        &self,
        at: Motion<'_>,
        h: f64,
        change: StepChange,
        out: &mut [f64],
    ) -> Result<(), NoStepSlope> {
        self.without_added_mass()?;
        let dh = change.length;
        out.fill(0.0);
        self.add_gauss_force(at, out);
        out.iter_mut().for_each(|f| *f *= dh);
        for (force, source) in self.forces.iter().zip(&self.sources) {
            force.add_damping(at, -dh, &mut Product { v: at.v, out });
            let found = force.add_time_slope(at, h * change.middle, out);
            found.map_err(|_| without_time(source))?;
        }
        Ok(())
    }

    fn internal_variables(&self) -> usize {
        let of_potentials = self.potentials().map(DiscretePotential::internal_variables);
        self.variables_before_potentials() + of_potentials.sum::<usize>()
    }

    fn begin_internal(&self, at: Motion<'_>, out: &mut [f64]) {
        let (of_forces, rest) = out.split_at_mut(self.variables_of_forces());
        let (of_signals, rest) = rest.split_at_mut(self.variable_count_of_signals());
        let (of_works, of_potential) = rest.split_at_mut(self.works.len());
        of_forces.fill(0.0);
        if let Some(signals) = &self.signals {
            signals.begin(at, of_signals);
        }
        self.begin_works(at.configuration(), of_works);
        if let Some(own) = self.potential_with_memory() {
            own.begin(at.q, of_potential);
        }
    }

    fn samples(&self, step: u64) -> bool {
        self.signals.as_ref().is_some_and(|signals| signals.samples(step))
    }

    fn sample(&self, step: u64, at: Motion<'_>, internal: &mut [f64]) {
        if let Some(signals) = &self.signals {
            let first = self.variables_of_forces();
            signals.sample(step, at, &mut internal[first..first + signals.count()]);
        }
    }

    fn advance_internal(&self, s: &Interval, out: &mut [f64]) {
        let (of_force, rest) = out.split_at_mut(self.variables_of_forces());
        let (of_signals, rest) = rest.split_at_mut(self.variable_count_of_signals());
        let (of_works, of_potential) = rest.split_at_mut(self.works.len());
        self.advance_works(s, of_works);
        if let Some(force) = self.forces.iter().find(|force| force.internal_variables() > 0) {
            force.advance(s, of_force);
        }
        if let Some(signals) = &self.signals {
            signals.advance(s, of_signals);
        }
        if let Some(own) = self.potential_with_memory() {
            own.advance(s, of_potential);
        }
    }

    fn discrete_potential_energy(&self, s: &Interval) -> f64 {
        self.potentials().map(|u| u.value(s)).sum()
    }

    fn added_kinetic_energy(&self, s: &Interval) -> f64 {
        self.potentials().map(|u| u.added_kinetic_energy(s)).sum()
    }
}

impl SeparableSystem {
    /// Whether the mass matrix is that of the bodies alone.
    fn without_added_mass(&self) -> Result<(), NoStepSlope> {
        let what = "the added mass of strains".into();
        if self.adds_mass() { Err(NoStepSlope { what }) } else { Ok(()) }
    }
}

/// That a force has no derivative by the time.
fn without_time(source: &Source) -> NoStepSlope {
    let what = match source {
        Source::Element(name) if name.is_empty() => "a force without a name".into(),
        Source::Element(name) => format!("`{name}`"),
        Source::System(words) => (*words).into(),
    };
    NoStepSlope { what }
}

#[cfg(test)]
#[allow(non_snake_case)] // L_d
mod tests {
    use super::*;
    use crate::potential::{DualPotential, Quadrature, ScalarField};
    use crate::sparse::SparseMatrix;
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
