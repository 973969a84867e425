//! What is said of a step or a node that could not be found.

use super::{RunFailure, Simulation};
use crate::assembly::agreement;
use crate::resolution::limits::FoldedElement;
use crate::stepper::NodeOf;
use crate::system::law;
use crate::system::law_fault::{self, LawFault};
use holonom_model::{ModelError, Problem, Scheme};
use vi_constraints::Constraints;
use vi_constraints::agreement::Dependence;
use vi_constraints::scheme::StepError;
use vi_core::{Configuration, State};

/// The error for an element that is bent too far, with its remedy.
pub(super) fn bent_too_far(folded: &FoldedElement<'_>) -> (String, String) {
    let FoldedElement { beam, element, angle, bounds } = folded;
    let consequence = bounds.consequence(*angle).unwrap_or_default();
    let angle = angle.to_degrees();
    let message = format!(
        "element {element} of beam `{beam}` is bent by {angle:.1}° between its nodes; {consequence}"
    );
    (message, "write more elements".into())
}

/// The error for an element that is bent too far at the start.
pub(super) fn bent_at_start(folded: FoldedElement<'_>) -> ModelError {
    let key = format!("beam.{}.elements", folded.beam);
    let (message, help) = bent_too_far(&folded);
    ModelError::Assembly(vec![Problem::new(key, message).help(help)])
}

/// The error for a law that has no value at the start.
pub(super) fn law_at_start(fault: LawFault) -> ModelError {
    ModelError::Assembly(vec![Problem::new("", fault.message).help(law_fault::REMEDY)])
}

/// The error for a condition of an event that has no value at the start.
pub(super) fn event_at_start(failure: RunFailure) -> ModelError {
    ModelError::Assembly(vec![Problem::new("", failure.message).help(failure.remedy)])
}

impl Simulation {
    /// A node that could not be read.
    pub(crate) fn lost(&self, which: NodeOf, message: &str) -> RunFailure {
        let State { step, t, .. } = *self.stepper.at(which.when());
        let remedy =
            "look for a singular configuration near the last rows of the trajectory".into();
        RunFailure { step, t, message: message.into(), remedy }
    }

    /// A step that was not found.
    pub(crate) fn failure(&mut self, error: &StepError) -> RunFailure {
        self.rotation.failed = true;
        let (step, t, _) = self.stepper.place();
        let place = self.culprit(error).map_or_else(String::new, |name| format!(" ({name})"));
        if let Some(fault) = law::fault_within(&self.laws, t, self.settings.step) {
            return fault.failure(step, t);
        }
        if let Some((message, remedy)) = self.rolls_badly() {
            return RunFailure { step, t, message, remedy };
        }
        let resolved = match error {
            StepError::Newton(_) | StepError::RankLost => self.remedy_of_step(),
            _ => None,
        };
        let resolved = resolved.map(|(words, _)| words);
        let remedy = resolved.unwrap_or_else(|| error.remedy().to_owned())
            + &self.taut(error)
            + &self.dead_end(error)
            + &self.jumping(error);
        RunFailure { step, t, message: format!("{error}{place}"), remedy }
    }

    /// What bounds of the tension may have to do with a step that was not found.
    fn taut(&self, error: &StepError) -> String {
        let step = self.stepper.place().0;
        match (&self.taut, self.stepper.tension_raised(), error) {
            (Some(taut), Some(_), StepError::Newton(_)) => taut.remedy(step),
            _ => String::new(),
        }
    }

    /// A wheel that is nearly flat, or that turns too far, where a step could not be taken.
    fn rolls_badly(&self) -> Option<(String, String)> {
        const NEARLY_FLAT: f64 = 0.97;
        let mechanism = self.stepper.mechanism();
        let (step, _, q) = self.stepper.place();
        if let Some(flat) = self.rolling.flat(mechanism, q, NEARLY_FLAT) {
            return Some(flat);
        }
        let before = (step > 0).then(|| self.stepper.interval());
        let v = mechanism.initial_velocity();
        self.rolling.turning(mechanism, before, q, &v, self.settings.step)
    }

    /// What laws that jump may have to do with a step that was not found.
    fn jumping(&self, error: &StepError) -> String {
        const LISTED: usize = 4;
        let jumping = law::jumping(&self.laws).into_iter().take(LISTED);
        let list: Vec<String> =
            jumping.map(|(owner, jumps)| format!("{owner} ({jumps})")).collect();
        match error {
            StepError::Newton(_) if !list.is_empty() => format!(
                "; no step may balance a jump: {}; write smooth(x, a, b) or tanh, an [[event]], or the dry \
                 friction of a joint",
                list.join(", ")
            ),
            _ => String::new(),
        }
    }

    /// What prescribed motions may have to do with a step that was not found.
    fn dead_end(&self, error: &StepError) -> String {
        let mechanism = self.stepper.mechanism();
        let first = mechanism.len() - mechanism.rows().len();
        let rows = mechanism.rows().iter().enumerate().filter(|(_, row)| row.is_rheonomic());
        let mut names: Vec<String> =
            rows.map(|(k, _)| format!("`{}`", mechanism.constraint_name(first + k))).collect();
        names.dedup();
        names.truncate(4);
        match error {
            StepError::Newton(_) | StepError::RankLost if !names.is_empty() => {
                let names = names.join(" and ");
                format!(
                    "; or shorten the path of {names}, if the joints cannot follow it any further"
                )
            }
            _ => String::new(),
        }
    }

    /// The violated constraint and those that it depends on.
    fn disagreeing(&self, row: usize) -> String {
        const LOOKED_AT: usize = 50;
        let (mechanism, (_, t, q)) = (self.stepper.mechanism(), self.stepper.place());
        let angles = mechanism.principal_angles(q); // gradients do not depend on revolutions
        let rows = self.stepper.rows();
        let mut dependence = Dependence::new(
            mechanism,
            rows,
            Configuration { t, q, angles: &angles, internal: &[] },
        );
        let mut with = |row: usize| [vec![row], dependence.partners(row)].concat();
        let all = match rows.rows().contains(&row) {
            false => with(row),
            // one of those that others depend on
            true => {
                let found = rows.redundant().take(LOOKED_AT).map(with);
                found.into_iter().find(|all| all.contains(&row)).unwrap_or_else(|| vec![row])
            }
        };
        match mechanism.len() - mechanism.rows().len() {
            internal if row < internal => format!("`{}`", mechanism.constraint_name(row)),
            _ => agreement::named(mechanism, &all),
        }
    }

    /// The constraint, joint, body or particle that a failed step is about.
    fn culprit(&self, error: &StepError) -> Option<String> {
        let mechanism = self.stepper.mechanism();
        if let Some(row) = error.constraint() {
            return Some(self.disagreeing(row));
        }
        if let Some(coordinate) = error.coordinate() {
            return Some(format!("`{}`", mechanism.coordinate_name(coordinate)));
        }
        let unknown = error.unknown()?;
        match self.settings.scheme {
            Scheme::Nodal | Scheme::Reduced | Scheme::EmNodal => mechanism.increment_name(unknown),
            _ if unknown < mechanism.dim() => {
                Some(format!("`{}`", mechanism.coordinate_name(unknown)))
            }
            _ => None,
        }
    }
}
