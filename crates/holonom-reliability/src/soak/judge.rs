//! A mechanism assembled, stepped and judged.

use super::defects::SoakDefect;
use super::fault::{self, FaultKind, Violation};
use super::generate::is_locked;
use super::invariants::{self, InvariantErrors};
use super::repeat;
use super::restated;
use super::trace::{Trace, assembled, trace};
use crate::guard::guarded;
use crate::shape::shape;
use holonom::run::prepare;
use holonom::simulation::RunOutcome;
use holonom::{Model, RunState, Sample, Simulation};
use std::convert::Infallible;

/// What is judged beside the run itself: more runs of the same mechanism.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Checks {
    /// The run continued from a stored state; the text of the model.
    pub restart: bool,
    /// The same motion by another scheme of the family.
    pub agreement: bool,
    /// The same motion and reactions of the mechanism turned, moved, reordered and in other units.
    pub restated: bool,
    /// Its certificate.
    pub certified: bool,
}

impl Checks {
    /// Of the mechanism with this index: continued and compared is one of eight each, in every
    /// shard; stated otherwise, which takes seven runs, one of 32, or each if all are to be
    /// `restated`; certified are those in which nothing is free to move.
    #[must_use]
    pub fn of(index: u64, restated: bool) -> Self {
        let part = index.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 59; // of 32
        let eighth = part >> 2;
        Self {
            restart: eighth == 3,
            agreement: eighth == 5,
            restated: restated || part == 24,
            certified: is_locked(index),
        }
    }

    /// Of bodies that touch: continued is one of four.
    #[must_use]
    pub fn of_touching(index: u64) -> Self {
        Self { restart: index.is_multiple_of(4), ..Self::default() }
    }
}

/// How a mechanism ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ending {
    /// After its last step.
    Done,
    /// The model was refused: the shape of the message.
    Refused(String),
    /// A step was refused: the shape of the message.
    Failed(String),
}

/// What was found of a mechanism.
#[derive(Clone, Debug, PartialEq)]
pub struct JudgedMechanism {
    /// How it ended.
    pub ending: Ending,
    /// The numbers found.
    pub measured: InvariantErrors,
    /// What is wrong, if anything is.
    pub fault: Option<Violation>,
}

/// Judges a model; `defect`: what is made wrong on purpose.
#[must_use]
pub fn judge(model: &Model, checks: Checks, defect: Option<SoakDefect>) -> JudgedMechanism {
    guarded(|| run(model, checks, defect)).unwrap_or_else(|said| JudgedMechanism {
        ending: Ending::Done,
        measured: InvariantErrors::default(),
        fault: Some(Violation::new(FaultKind::Panic, said)),
    })
}

fn run(model: &Model, checks: Checks, defect: Option<SoakDefect>) -> JudgedMechanism {
    let text = model.to_toml();
    let mut measured = InvariantErrors::default();
    let (model, mut simulation) = match assembled(&text, model.meshes.clone()) {
        Ok(assembled) => assembled,
        Err(mut error) => {
            SoakDefect::refuse(defect, &mut error);
            let fault = fault::refusal(&error, &text).err();
            return JudgedMechanism {
                ending: Ending::Refused(shape(&error.to_string())),
                measured,
                fault,
            };
        }
    };
    let mut found = trace(&mut simulation);
    SoakDefect::disturb(defect, &mut found);
    let ending = match &found.failure {
        None => Ending::Done,
        Some(failure) => Ending::Failed(shape(&failure.message)),
    };
    let fault = invariants::hold(&model, &simulation, &found, &mut measured)
        .and_then(|()| match &found.failure {
            Some(failure) => {
                fault::failure(failure)?;
                repeat::refused_step(&model, failure, defect)
            }
            None => Ok(()),
        })
        .and_then(|()| match checks.restart && found.failure.is_none() {
            true => {
                measured.restarted = true;
                repeat::round_trip(&model, defect)?;
                repeat::restart(&model, &found, defect)
            }
            false => Ok(()),
        })
        .and_then(|()| match checks.agreement && found.failure.is_none() {
            true => repeat::agreement(&model, &mut measured, defect),
            false => Ok(()),
        })
        .and_then(|()| match checks.certified && found.failure.is_none() {
            true => {
                measured.certified = true;
                repeat::certificate(&model, defect)
            }
            false => Ok(()),
        })
        .and_then(|()| match checks.restated && found.failure.is_none() {
            true => restated::restated(&model, &mut measured, defect),
            false => Ok(()),
        });
    JudgedMechanism { ending, measured, fault: fault.err() }
}

/// How a model of any kind ends: with finite numbers, or with words and a remedy. Statics, too.
///
/// # Errors
/// [`Violation`]. `disturbed`: a number is made infinite on purpose.
pub fn outcome(model: &Model, disturbed: bool) -> Result<Ending, Violation> {
    let mut experiment = match prepare(model) {
        Ok(experiment) => experiment,
        Err(error) => {
            fault::refusal(&error, &model.to_toml())?;
            return Ok(Ending::Refused(shape(&error.to_string())));
        }
    };
    let mut samples = Vec::new();
    let mut observe = |sample: &Sample| {
        samples.push(sample.clone());
        Ok(())
    };
    let ended = experiment.run_while(&mut observe, &mut |_, _| true);
    let failure = match ended {
        Ok(Some(RunOutcome::Failed(failure))) => Some(failure),
        _ => None,
    };
    let mut found = Trace { samples, failure, ..Trace::default() };
    SoakDefect::disturb(disturbed.then_some(SoakDefect::NotFinite), &mut found);
    invariants::finite(&found)?;
    match &found.failure {
        None => Ok(Ending::Done),
        Some(failure) => {
            fault::failure(failure)?;
            Ok(Ending::Failed(shape(&failure.message)))
        }
    }
}

/// A run of `steps` steps continued from a state to its end: why it is refused or fails, if it
/// does.
///
/// # Errors
/// [`Violation`].
pub fn continued(
    simulation: &mut Simulation,
    state: RunState,
    steps: u64,
) -> Result<Result<(), String>, Violation> {
    if let Err(error) = simulation.resume(state) {
        return Ok(Err(error.to_string()));
    }
    let mut samples = Vec::new();
    let mut observe = |sample: &Sample| -> Result<(), Infallible> {
        samples.push(sample.clone());
        Ok(())
    };
    let mut left = steps + 2;
    let mut proceed = |_, _| {
        left = left.saturating_sub(1);
        left > 0
    };
    let Ok(outcome) = simulation.run_while(&mut observe, &mut proceed);
    invariants::finite(&Trace { samples, ..Trace::default() })?;
    match outcome {
        None => Err(Violation::new(FaultKind::Restart, "a continued run does not end")),
        Some(RunOutcome::Failed(failure)) => {
            fault::failure(&failure)?;
            Ok(Err(failure.message))
        }
        _ => Ok(Ok(())),
    }
}
