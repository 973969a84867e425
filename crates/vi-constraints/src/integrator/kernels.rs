//! The parts of a step, one by one: what a step costs is measured with them.

use super::Integrator;
use crate::constraints::Constraints;
use crate::discretization::Discretization;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::newton::Fault;
use vi_core::sparse::Entries;

/// The parts of the last step of an integrator, evaluated again at its solution; the state stays as
/// it is.
pub struct Kernels<'a, S: Discretization<C>, C> {
    run: &'a mut Integrator<S, C>,
    u: Vec<f64>,        // unknowns of the last step
    residual: Vec<f64>, // of its equations
    correction: Vec<f64>,
}

impl<S: Discretization<C>, C> std::fmt::Debug for Kernels<'_, S, C> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Kernels").field("unknowns", &self.u.len()).finish_non_exhaustive()
    }
}

/// Adds up what is emitted.
struct Sum(f64);

impl Entries for Sum {
    fn add(&mut self, _row: usize, _column: usize, value: f64) {
        self.0 += value;
    }
}

impl<S: Discretization<C>, C: Constraints> Integrator<S, C> {
    /// The parts of the last step; at least one must have been taken.
    pub fn kernels(&mut self) -> Kernels<'_, S, C> {
        let u = self.solver.solution().to_vec();
        let zeros = vec![0.0; u.len()];
        Kernels { run: self, u, residual: zeros.clone(), correction: zeros }
    }
}

impl<S: Discretization<C>, C: Constraints> Kernels<'_, S, C> {
    /// The residual of Newton's method.
    ///
    /// # Errors
    /// [`Fault`] as in a step.
    pub fn residual(&mut self) -> Result<(), Fault> {
        let Integrator { scheme, system, constraints, .. } = &mut *self.run;
        scheme.residual(system, constraints, &self.u, &mut self.residual)
    }

    /// A correction of Newton's method: matrix, factorization, solution. After
    /// [`Kernels::residual`].
    ///
    /// # Errors
    /// [`Fault`] as in a step.
    pub fn correction(&mut self) -> Result<(), Fault> {
        self.correction.copy_from_slice(&self.residual);
        let Integrator { scheme, system, constraints, .. } = &mut *self.run;
        scheme.correction(system, constraints, &self.u, &mut self.correction)
    }
}

impl<S: Discretization<C> + DiscreteLagrangian, C: Constraints> Kernels<'_, S, C> {
    /// The sum of the entries of `D_2(D_1 L_d + f_d^-)` in the last sub-step: what the system has
    /// of the Newton matrix.
    #[must_use]
    pub fn entries(&self) -> f64 {
        let mut sum = Sum(0.0);
        self.run.system.forced_d2_d1(self.run.scheme.interval(), &mut sum);
        sum.0
    }
}
