//! The two families of schemes behind one interface: what a run asks of a method.
//!
//! | file | concept |
//! |---|---|
//! | [`running`] | an integrator of either family in motion |
//! | [`family`] | what differs between the families |
//! | [`work`] | the work of loads, motors, dampers and prescribed motions |

mod family;
mod running;
mod work;

pub(crate) use running::Running;

use crate::run_state::MotionState;
use crate::sample::{Momenta, Residuals};
use vi_constraints::initialization::StartReport;
use vi_constraints::integrator::{ResumeError, StepReport};
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::{Condition, StepError};
use vi_core::linear::Singular;
use vi_core::momentum_map::Momentum;
use vi_emscheme::EmIntegrator;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::MechanismIntegrator;

/// A node as a method reads it.
#[derive(Clone, Debug)]
pub(crate) struct Reading {
    /// Step index.
    pub(crate) step: u64,
    /// `t_n`, s.
    pub(crate) t: f64,
    /// `q_n`.
    pub(crate) q: Vec<f64>,
    /// Unwrapped angles.
    pub(crate) angles: Vec<f64>,
    /// Velocity: `v̂` of the projected momentum, `v_n` of energy–momentum schemes.
    pub(crate) v: Vec<f64>,
    /// `λ_n`; empty unless it was asked for.
    pub(crate) lambda: Vec<f64>,
    /// `E_d` of the step that starts here, where there is one; else as `hamiltonian`.
    pub(crate) energy: f64,
    /// Energy of the node.
    pub(crate) hamiltonian: f64,
    /// Shadow energy; `None` at the start of composed steps.
    pub(crate) shadow: Option<f64>,
    /// Kinetic part of it.
    pub(crate) kinetic: f64,
    /// Work since the start: of each force, then of all prescribed motions.
    pub(crate) work: Vec<f64>,
    /// Momentum maps.
    pub(crate) momentum: Momentum,
    /// Constraint residuals.
    pub(crate) residuals: Residuals,
    /// Multipliers and momenta, where the settings ask for them.
    pub(crate) momenta: Option<Box<Momenta>>,
}

/// A running integration by a scheme of either family.
pub(crate) trait Method {
    /// Takes a step as so many equal parts; where it is refused, the state stays what it was.
    fn step(&mut self, parts: u32) -> Result<StepReport, StepError>;
    /// Step index, time and configuration of the present node.
    fn place(&self) -> (u64, f64, &[f64]);
    /// Whether a node is read before the step from it is taken: with composed steps no quantity of a
    /// node belongs to that step.
    fn reads_first(&self) -> bool;
    /// The present node by itself, its multipliers from the acceleration level.
    fn here(&mut self, multipliers: bool) -> Result<Reading, Singular>;
    /// The node that the last step has left, with the quantities of that step.
    fn left(&mut self) -> Result<Reading, Singular>;
    /// The present node, with the quantities of the step from there if that can be taken.
    fn last(&mut self, multipliers: bool) -> Result<Reading, Singular>;
    /// The state of the motion, with the sums along its steps.
    fn state(&self) -> MotionState;
    /// Continues from the state of a motion of the same model.
    fn resume(&mut self, state: MotionState) -> Result<(), ResumeError>;
    /// Constraints.
    fn mechanism(&self) -> &Mechanism;
    /// Independent constraints.
    fn rows(&self) -> &IndependentRows;
    /// Consistency of the initial values.
    fn start_report(&self) -> &StartReport;
    /// Condition numbers of the last Newton matrix.
    fn condition(&mut self) -> Option<Condition>;
    /// The integrator, of a variational scheme.
    fn variational(&mut self) -> Option<&mut MechanismIntegrator> {
        None
    }
    /// The integrator, of an energy–momentum scheme.
    fn energy_momentum(&mut self) -> Option<&mut EmIntegrator<Mechanism>> {
        None
    }
}
