//! What an integration is set up with, and why it may be refused.

use crate::null_space::EmLinearization;
use crate::scheme::EmForm;
use vi_constraints::Options;
use vi_constraints::integrator::SetupError;
use vi_core::Composition;
use vi_core::newton::NewtonSettings;
use vi_multibody::run::Solver;

/// What to integrate with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmOptions {
    /// One of the three forms.
    pub form: EmForm,
    /// Macro time step `h`, s; negative to run backwards in time.
    pub step: f64,
    /// The symmetric composition; [`EmOptions::sub_steps`] says how it is made of steps.
    pub composition: Composition,
    /// Newton's method.
    pub newton: NewtonSettings,
    /// The derivative of `P̄` in the nodal form.
    pub linearization: EmLinearization,
    /// The algebra of the nodal form on trees: [`Solver::Dense`], or sparse where [`Solver::is_sparse`].
    pub solver: Solver,
}

impl EmOptions {
    /// Order 2 with step `h` (s) and Newton's method to the round-off floor.
    #[must_use]
    pub fn new(form: EmForm, step: f64) -> Self {
        let (composition, newton) = (Composition::Identity, NewtonSettings::default());
        let (linearization, solver) = (EmLinearization::default(), Solver::default());
        Self { form, step, composition, newton, linearization, solver }
    }

    /// With a symmetric composition of order 4, 6 or 8.
    #[must_use]
    pub fn composition(mut self, composition: Composition) -> Self {
        self.composition = composition;
        self
    }

    pub(crate) fn of_integrator(self) -> Options<EmForm> {
        let (gammas, newton) = (self.sub_steps(), self.newton);
        Options { scheme: self.form, step: self.step, gammas, newton }
    }

    /// The sub-steps of a macro step, in parts of `h`: each `γ_j` of the composition as two steps of
    /// `γ_j/2`; `[1]` without composition.
    ///
    /// A single step turns the sign of the part of `v` that is not tangential, so it is no small change
    /// of `(q, v)` and the conditions of order do not apply to it. Two equal steps turn it back: their
    /// map is self-adjoint and close to the identity on all `(q, v)`, and its compositions have the full
    /// order in `q` and `v`.
    #[must_use]
    pub fn sub_steps(&self) -> Vec<f64> {
        let gammas = self.composition.gammas();
        if gammas.len() == 1 {
            return gammas;
        }
        gammas.iter().flat_map(|gamma| [0.5 * gamma; 2]).collect()
    }
}

/// Why an integrator could not be set up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EmSetupError {
    /// A reason that every family of schemes has.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The derivative of `P̄` was asked for where it is not known.
    #[error(
        "the derivative of the discrete null space is known for trees of bodies without screws and \
         closed loops: take the linearization by multipliers"
    )]
    Linearization,
    /// The form needs `F_d`.
    #[error(
        "the scheme `{}` needs a map F_d(u, q_n): give a reparametrization, or use the scheme \
         `em-constrained` or `em-dalembert`",
        .0.name()
    )]
    NeedsReparametrization(EmForm),
}
