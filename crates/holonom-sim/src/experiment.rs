//! What can be run.

use std::io;

use crate::assembly::AssemblyReport;
use crate::beams::Beams;
use crate::outcome::RunOutcome;
use crate::outcome::StaticFacts;
use crate::sample::{Member, MomentaNames, Sample};
use crate::sensor::Sensors;

/// What can be run: a motion, or a continuation of equilibria.
pub trait Experiment {
    /// What the assembly found.
    fn assembly(&self) -> &AssemblyReport;
    /// The members, in the order of their coordinates.
    fn members(&self) -> &[Member];
    /// The sensors.
    fn sensors(&self) -> &Sensors;
    /// The beams.
    fn beams(&self) -> &Beams;
    /// Names of the momenta of a node; `None` where the model does not ask for them.
    fn momenta_names(&self) -> Option<MomentaNames> {
        None
    }
    /// What is worth knowing of the assembly and of the run so far.
    fn warnings(&self) -> Vec<String>;
    /// Facts of a continuation of equilibria; `None` for motions.
    fn statics(&self) -> Option<StaticFacts> {
        None
    }
    /// Runs to the end; `observe` gets each recorded row and may stop the run by an error;
    /// `progress(step, of)` is called now and then.
    ///
    /// # Errors
    /// Whatever `observe` returns.
    fn run(
        &mut self,
        observe: &mut dyn FnMut(&Sample) -> io::Result<()>,
        progress: &mut dyn FnMut(u64, u64),
    ) -> io::Result<RunOutcome>;
}
