//! What is decided between two steps, inputs of a controller and forces of bodies, and what is read
//! of a node.
//!
//! ```text
//! q_{n+1/2} ≈ q_n + (h/2) v_n,     v_{n+1/2} ≈ v_n + (h/2) a_n
//! ```
//! of second order where `a_n` follows from the state and the inputs held before: what is decided
//! at the predicted midpoint and held over the step has order 2.

use super::{RunFailure, Simulation};
use crate::sample::{ResidualsAtLevels, Sample};
use crate::stepper::NodeOf;
use vi_constraints::integrator::NodeInStep;
use vi_core::momentum_map::Momentum;

/// Decides before each step what inputs hold over it.
pub trait Controller: Send {
    /// Sets inputs for the step from the present node, which may be read.
    ///
    /// # Errors
    /// [`RunFailure`]: the step is then not taken.
    fn decide(&mut self, run: &mut Simulation) -> Result<(), RunFailure>;
}

/// The middle of the next step, before it is known.
#[derive(Clone, Debug, Default)]
pub struct NextMidpoint {
    /// Its time, s.
    pub t: f64,
    /// `q_{n+1/2}`, shape `n`.
    pub q: Vec<f64>,
    /// `v_{n+1/2}`, shape `n`.
    pub v: Vec<f64>,
}

/// What is read of a recorded node beside its configuration. What is not read is not a number in a
/// [`Sample`], and nothing is judged by it: the run has no warnings of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading {
    /// What sensors measure.
    pub sensors: bool,
    /// Energies, momentum maps, residuals, momenta.
    pub quantities: bool,
}

impl Default for Reading {
    /// Everything.
    fn default() -> Self {
        Self { sensors: true, quantities: true }
    }
}

impl Simulation {
    /// Asks `controller` before each step from now on.
    pub fn control_by(&mut self, controller: Box<dyn Controller>) {
        self.controller = Some(controller);
    }

    /// Asks the controller.
    pub(super) fn decide(&mut self) -> Result<(), RunFailure> {
        let Some(mut controller) = self.controller.take() else { return Ok(()) };
        let decided = controller.decide(self);
        self.controller = Some(controller);
        decided
    }

    /// Reads of recorded nodes nothing but their configurations and what is wanted.
    pub fn read_only(&mut self, reading: Reading) {
        let nan = f64::NAN;
        let momentum = Momentum { linear: [nan; 3], angular: [nan; 3] };
        let residuals = ResidualsAtLevels { position: nan, velocity: nan, momentum: nan };
        let (energy, hamiltonian, work) = (nan, nan, nan);
        self.sample =
            Sample { energy, hamiltonian, work, momentum, residuals, ..Sample::default() };
        self.reading = reading;
    }

    /// Velocities at the present node, members one after the other, shape `n`.
    ///
    /// # Errors
    /// [`RunFailure`].
    pub fn velocity(&mut self) -> Result<&[f64], RunFailure> {
        if let Err(error) = self.stepper.velocity(&mut self.velocity) {
            return Err(self.lost(NodeOf::State, &error.to_string()));
        }
        Ok(&self.velocity)
    }

    /// Predicts the middle of the step from the present node.
    ///
    /// # Errors
    /// [`RunFailure`] where accelerations are not unique.
    pub fn predict(&mut self, out: &mut NextMidpoint) -> Result<(), RunFailure> {
        let half = 0.5 * self.settings.step;
        if let Err(error) = self.stepper.predict(half, &mut out.q, &mut out.v) {
            return Err(self.lost(NodeOf::State, &error.to_string()));
        }
        out.t = self.stepper.at(NodeInStep::After).t + half;
        Ok(())
    }
}
