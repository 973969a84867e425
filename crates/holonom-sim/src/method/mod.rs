//! The two families of schemes behind one interface: what a run asks of a method.
//!
//! | file | concept |
//! |---|---|
//! | [`reading`] | what is read at a node |
//! | [`running`] | an integrator of either family in motion |
//! | [`family`] | what differs between the families |
//! | [`increments`] | accelerations from the steps beside a node |
//! | [`work`] | the work of loads, motors, dampers and prescribed motions |

mod family;
mod increments;
pub(crate) mod reading;
mod running;
mod work;

pub(crate) use increments::Increment;
pub(crate) use reading::{Reading, Wanted};
pub(crate) use running::Running;

use crate::run_state::MotionState;
use vi_constraints::initialization::StartReport;
use vi_constraints::integrator::{ResumeError, StepReport};
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::{Condition, StepError};
use vi_core::force::Source;
use vi_core::linear::Singular;
use vi_emscheme::EmIntegrator;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::MechanismIntegrator;

/// A running integration by a scheme of either family.
pub(crate) trait Method {
    /// Takes a step as so many equal parts; where it is refused, the state stays what it was.
    fn step(&mut self, parts: u32) -> Result<StepReport, StepError>;
    /// Step index, time and configuration of the present node.
    fn place(&self) -> (u64, f64, &[f64]);
    /// Whether a node is read before the step from it is taken: with composed steps no quantity of
    /// a node belongs to that step.
    fn reads_first(&self) -> bool;
    /// The present node by itself; constraint force and acceleration, where they are `wanted`, of
    /// the acceleration level.
    fn here(&mut self, wanted: Wanted, found: &mut Reading) -> Result<(), Singular>;
    /// The node that the last step has left, with the quantities of that step.
    fn left(&mut self, found: &mut Reading) -> Result<(), Singular>;
    /// The present node, with the quantities of the step from there if that can be taken.
    fn last(&mut self, wanted: Wanted, found: &mut Reading) -> Result<(), Singular>;
    /// The state of the motion, with the sums along its steps.
    fn state(&self) -> MotionState;
    /// Continues from the state of a motion of the same model.
    fn resume(&mut self, state: MotionState) -> Result<(), ResumeError>;
    /// What exerts each force of the system.
    fn sources(&self) -> &[Source];
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
