//! What can be run.

use std::io;

use super::divided_steps::DividedSteps;
use super::outcome::{RunOutcome, StaticFacts};
use super::run_state::RunState;
use crate::assembly::AssemblyReport;
use crate::assembly::loops::LoopResiduals;
use crate::resolution::rotation::FastestRotation;
use crate::sample::{Member, MomentaNames, Sample};
use crate::sensor::Sensors;
use crate::system::beams::Beams;
use crate::system::contact_origin::ContactOrigin;
use holonom_model::Columns;
use vi_constraints::integrator::ResumeError;
use vi_core::contact_state::ContactCounts;

/// What can be run: a motion, or a continuation of equilibria.
pub trait RunnableModel: Send {
    /// What the assembly found.
    fn assembly(&self) -> &AssemblyReport;
    /// The members, in the order of their coordinates.
    fn members(&self) -> &[Member];
    /// What is recorded of the members.
    fn columns(&self) -> &[Columns];
    /// The sensors.
    fn sensors(&self) -> &Sensors;
    /// The beams.
    fn beams(&self) -> &Beams;
    /// Names of the momenta of a node; `None` where the model does not ask for them.
    fn momenta_names(&self) -> Option<MomentaNames> {
        None
    }
    /// Names of the parts of the energy and of the work; none in statics.
    fn energy_columns(&self) -> &[String] {
        &[]
    }
    /// What is worth knowing of the assembly and of the run so far.
    fn warnings(&self) -> Vec<String>;
    /// Facts of a continuation of equilibria; `None` for motions.
    fn statics(&self) -> Option<StaticFacts> {
        None
    }
    /// Largest residuals of constraints of loops that nearly follow from others; `None` where there
    /// are none.
    fn loop_residuals(&self) -> Option<LoopResiduals> {
        None
    }
    /// How often a bound of the tension of beams was raised; `None` where none can be.
    fn tension_raised(&self) -> Option<u64> {
        None
    }
    /// Steps of a motion that were taken in smaller parts; `None` where there were none.
    fn divided_steps(&self) -> Option<DividedSteps> {
        None
    }
    /// The events of a motion, and how often each has acted; `None` where the model has none.
    fn events(&self) -> Option<Vec<(String, u64)>> {
        None
    }
    /// The elements with impulses of a motion: contacts, stops, dry friction.
    fn contacts(&self) -> &[ContactOrigin] {
        &[]
    }
    /// How they have acted so far; `None` where there are none.
    fn contact_counts(&self) -> Option<ContactCounts> {
        None
    }
    /// Whether the contacts of each node are recorded.
    fn writes_contacts(&self) -> bool {
        false
    }
    /// The fastest rotation of a motion so far, against the step; `None` where nothing turns.
    fn fastest_rotation(&self) -> Option<FastestRotation> {
        None
    }
    /// Steps taken, and the time that was reached, s.
    fn place(&self) -> (u64, f64);
    /// What reading recorded nodes and handing them out has taken so far, s; `None` for a
    /// continuation of equilibria.
    fn recording_seconds(&self) -> Option<f64> {
        None
    }
    /// The state of a motion, from which it can be resumed; `None` for a continuation of
    /// equilibria.
    fn state(&self) -> Option<RunState> {
        None
    }
    /// Continues a motion from a state; `None` for a continuation of equilibria.
    fn resume(&mut self, state: RunState) -> Option<Result<(), ResumeError>> {
        let _ = state;
        None
    }
    /// Runs to the end; `observe` gets each recorded row and may stop the run by an error;
    /// `proceed(step, of)` is asked before every step, and `false` pauses the run there: `None`. A
    /// motion continues with the next call, a continuation of equilibria begins again.
    ///
    /// # Errors
    /// Whatever `observe` returns.
    fn run_while(
        &mut self,
        observe: &mut dyn FnMut(&Sample) -> io::Result<()>,
        proceed: &mut dyn FnMut(u64, u64) -> bool,
    ) -> io::Result<Option<RunOutcome>>;
    /// Runs to the end without a pause; `progress(step, of)` is called before every step.
    ///
    /// # Errors
    /// Whatever `observe` returns.
    fn run(
        &mut self,
        observe: &mut dyn FnMut(&Sample) -> io::Result<()>,
        progress: &mut dyn FnMut(u64, u64),
    ) -> io::Result<RunOutcome> {
        let mut proceed = |step, of| {
            progress(step, of);
            true
        };
        let outcome = self.run_while(observe, &mut proceed)?;
        Ok(outcome.unwrap_or(RunOutcome::Done)) // nothing pauses it
    }
}
