//! The life of an instance.
//!
//! ```text
//! instantiated ──► initialization ──► steps ──► terminated        reset: back to instantiated
//!  set              set, get           set inputs, get, step        get
//! ```
//! Parameters are fixed when the initialization ends. Inputs are held over a communication step.
//! The first communication step decides the time step: if it is no multiple of that of the model,
//! the motion begins anew with the longest step of which it is one.

use crate::VERSION;
use crate::interface::{Causality, Interface, VariableRole};
use crate::resources::{Resources, words};
use crate::run::{Run, SavedRun, StepsEnded, said};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Where an instance is in its life.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Phase {
    /// Made, not initialized.
    Instantiated,
    /// Between entering and leaving the initialization.
    Initialization,
    /// Steps.
    Steps,
    /// Ended.
    Terminated,
}

impl Phase {
    fn name(self) -> &'static str {
        match self {
            Self::Instantiated => "instantiated",
            Self::Initialization => "in initialization mode",
            Self::Steps => "in step mode",
            Self::Terminated => "terminated",
        }
    }
}

/// What a refused call means for the instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// A step was not found; the state is that of the time reached, and can be used.
    Discard,
    /// The call had no effect, or the motion cannot go on.
    Error,
}

/// Why a call was refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnitRefusal {
    /// What it means for the instance.
    pub severity: Severity,
    /// What is wrong, and what helps.
    pub message: String,
}

impl UnitRefusal {
    fn error(message: impl Into<String>) -> Self {
        Self { severity: Severity::Error, message: message.into() }
    }
}

/// What a communication step came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stepped {
    /// An event of the model ended the motion.
    pub is_ended: bool,
    /// What is worth knowing.
    pub warning: Option<String>,
}

/// The state of an instance: values, and the motion if there is one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SavedState {
    phase: Phase,
    start: f64,       // s
    values: Vec<f64>, // of all variables that can be set
    run: Option<SavedRun>,
}

/// An instance of a unit.
#[derive(Debug)]
pub struct Instance {
    resources: Resources,
    interface: Interface,
    token: String,
    phase: Phase,
    start: f64,       // s
    values: Vec<f64>, // of all variables that can be set; others are NaN
    run: Option<Run>,
    outdated: bool, // a value was set that the run does not know
}

impl Instance {
    /// An instance of the unit with these resources.
    ///
    /// # Errors
    /// Where resources cannot be read, are those of another unit, or hold no valid model.
    pub fn new(resources: &Path, token: &str) -> Result<Self, String> {
        let resources = Resources::read(resources)
            .map_err(|error| format!("the resources of the unit cannot be read: {error}"))?;
        let (_, interface) = resources.interface().map_err(|error| words(&error))?;
        let own = resources.token(&interface);
        if own != token {
            return Err(format!(
                "the unit has the token {token}, its model by holonom {VERSION} the token {own}: export it anew"
            ));
        }
        let values = starts(&interface);
        let phase = Phase::Instantiated;
        let (token, start) = (own, 0.0);
        Ok(Self { resources, interface, token, phase, start, values, run: None, outdated: false })
    }

    /// Its variables.
    #[must_use]
    pub fn interface(&self) -> &Interface {
        &self.interface
    }

    /// Where it is in its life.
    #[must_use]
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// The time reached, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.run.as_ref().map_or(self.start, |run| run.place().1)
    }

    fn expect(&self, call: &str, phases: &[Phase]) -> Result<(), UnitRefusal> {
        if phases.contains(&self.phase) {
            return Ok(());
        }
        let wanted = phases.iter().map(|own| own.name()).collect::<Vec<_>>().join(" or ");
        let own = self.phase.name();
        Err(UnitRefusal::error(format!("{call}: the instance is {own}, and has to be {wanted}")))
    }

    /// Sets parameters and inputs: all or none.
    ///
    /// # Errors
    /// [`UnitRefusal`] for a variable that cannot be set now, and for a value that is not finite.
    pub fn set(&mut self, references: &[u32], values: &[f64]) -> Result<(), UnitRefusal> {
        for (reference, value) in references.iter().zip(values) {
            let variable = self.variable(*reference)?;
            let call = format!("set `{}`", variable.name);
            match variable.causality {
                Causality::Input => {
                    self.expect(&call, &[Phase::Instantiated, Phase::Initialization, Phase::Steps])?
                }
                Causality::Parameter => {
                    self.expect(&call, &[Phase::Instantiated, Phase::Initialization])?;
                }
                Causality::Independent | Causality::Output => {
                    let what =
                        format!("{call}: it is computed, only parameters and inputs are set");
                    return Err(UnitRefusal::error(what));
                }
            }
            if !value.is_finite() {
                return Err(UnitRefusal::error(format!("{call}: {value} is not finite")));
            }
        }
        for (reference, value) in references.iter().zip(values) {
            let own = &mut self.values[*reference as usize];
            self.outdated |= own.to_bits() != value.to_bits();
            *own = *value;
        }
        Ok(())
    }

    /// Reads values; what is computed only from the initialization on.
    ///
    /// # Errors
    /// [`UnitRefusal`] for a variable that is not there, before the initialization, and where the
    /// node cannot be computed.
    pub fn get(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), UnitRefusal> {
        for (reference, value) in references.iter().zip(values) {
            let variable = self.variable(*reference)?;
            *value = match variable.causality {
                Causality::Parameter | Causality::Input => self.values[*reference as usize],
                Causality::Independent | Causality::Output => {
                    let call = format!("get `{}`", variable.name);
                    let quantity = variable.quantity.clone();
                    self.expect(&call, &[Phase::Initialization, Phase::Steps, Phase::Terminated])?;
                    self.take_up()?;
                    let run = self.run.as_mut().ok_or_else(|| UnitRefusal::error(call))?;
                    run.output(&quantity).map_err(UnitRefusal::error)?
                }
            };
        }
        Ok(())
    }

    fn variable(&self, reference: u32) -> Result<&crate::Variable, UnitRefusal> {
        self.interface.variables.get(reference as usize).ok_or_else(|| {
            let count = self.interface.variables.len();
            let message =
                format!("there is no variable with the reference {reference}: there are {count}");
            UnitRefusal::error(message)
        })
    }

    /// The run takes up what was set.
    fn take_up(&mut self) -> Result<(), UnitRefusal> {
        if !self.outdated {
            return Ok(());
        }
        match &mut self.run {
            Some(run) if self.phase != Phase::Initialization => {
                run.hold(&self.interface, &self.values).map_err(UnitRefusal::error)?;
            }
            _ => self.run = Some(self.begun(None)?),
        }
        self.outdated = false;
        Ok(())
    }

    fn begun(&self, step: Option<f64>) -> Result<Run, UnitRefusal> {
        let run = Run::new(&self.resources, &self.interface, &self.values, self.start, step);
        run.map_err(UnitRefusal::error)
    }

    /// Begins the initialization of a motion from the time `start`, s: the model with its
    /// parameters is assembled.
    ///
    /// # Errors
    /// [`UnitRefusal`] with the words of the checks of the model.
    pub fn enter_initialization(&mut self, start: f64) -> Result<(), UnitRefusal> {
        self.expect("enter initialization mode", &[Phase::Instantiated])?;
        if !start.is_finite() {
            return Err(UnitRefusal::error(format!(
                "the start time is {start}: it has to be finite"
            )));
        }
        self.start = start;
        self.run = Some(self.begun(None)?);
        self.outdated = false;
        self.phase = Phase::Initialization;
        Ok(())
    }

    /// Ends the initialization; what is worth knowing of the model.
    ///
    /// # Errors
    /// [`UnitRefusal`].
    pub fn exit_initialization(&mut self) -> Result<Vec<String>, UnitRefusal> {
        self.expect("exit initialization mode", &[Phase::Initialization])?;
        self.take_up()?;
        self.phase = Phase::Steps;
        Ok(self.run.as_ref().map(Run::warnings).unwrap_or_default())
    }

    /// Goes on by the communication step `length` from the time `t`, s.
    ///
    /// # Errors
    /// [`UnitRefusal`]: [`Severity::Discard`] where a step was not found and the state can be used.
    pub fn step(&mut self, t: f64, length: f64) -> Result<Stepped, UnitRefusal> {
        self.expect("do step", &[Phase::Steps])?;
        let mut stepped = Stepped::default();
        let Some(run) = &self.run else { return Err(UnitRefusal::error("there is no motion")) };
        if !run.is_at(t) {
            let (own, step) = (run.place().1, run.step_size());
            return Err(UnitRefusal::error(format!(
                "do step: the communication point is {t} s, the instance is at {own} s (its step is {step} s)"
            )));
        }
        let positive = length > 0.0 && length.is_finite();
        if !positive {
            return Err(UnitRefusal::error(format!(
                "do step: the communication step is {length} s: it has to be positive"
            )));
        }
        if run.count(length).is_none() {
            stepped.warning = Some(self.begin_anew(length)?);
        }
        self.take_up()?;
        let Some(run) = &mut self.run else { return Err(UnitRefusal::error("there is no motion")) };
        let Some(count) = run.count(length) else {
            return Err(UnitRefusal::error("do step: the step cannot be divided so"));
        };
        match run.advance(count) {
            StepsEnded::Done => Ok(stepped),
            StepsEnded::ByEvent => Ok(Stepped { is_ended: true, ..stepped }),
            StepsEnded::Refused(failure) => {
                Err(UnitRefusal { severity: Severity::Discard, message: said(&failure) })
            }
            StepsEnded::Lost(failure) => Err(UnitRefusal::error(said(&failure))),
        }
    }

    /// Begins anew with the longest step of which the first communication step is a multiple.
    fn begin_anew(&mut self, length: f64) -> Result<String, UnitRefusal> {
        let Some(run) = &self.run else { return Err(UnitRefusal::error("there is no motion")) };
        let step = run.step_size();
        if run.place().0 > 0 {
            return Err(UnitRefusal::error(format!(
                "do step: the communication step of {length} s is no multiple of the step of {step} s; the first one \
                 has decided the step: let later ones be multiples of it"
            )));
        }
        let divided = length / (length / step).ceil();
        self.run = Some(self.begun(Some(divided))?);
        self.outdated = false;
        Ok(format!(
            "the first communication step of {length} s is no multiple of the step of {step} s: the step is {divided} s"
        ))
    }

    /// Ends the motion; its last node can be read.
    ///
    /// # Errors
    /// [`UnitRefusal`].
    pub fn terminate(&mut self) -> Result<(), UnitRefusal> {
        self.expect("terminate", &[Phase::Steps])?;
        self.take_up()?;
        self.phase = Phase::Terminated;
        Ok(())
    }

    /// Goes back to where it was made.
    pub fn reset(&mut self) {
        self.values = starts(&self.interface);
        (self.phase, self.start, self.run, self.outdated) = (Phase::Instantiated, 0.0, None, false);
    }

    /// Its state.
    ///
    /// # Errors
    /// [`UnitRefusal`].
    pub fn state(&mut self) -> Result<SavedState, UnitRefusal> {
        if self.run.is_some() {
            self.take_up()?;
        }
        let run = self.run.as_ref().map(Run::saved);
        let values = self.values.clone();
        Ok(SavedState { phase: self.phase, start: self.start, values, run })
    }

    /// Goes on from a state of an instance of the same unit, bit for bit.
    ///
    /// # Errors
    /// [`UnitRefusal`]; the instance is then what it was.
    pub fn resume(&mut self, saved: &SavedState) -> Result<(), UnitRefusal> {
        if saved.values.len() != self.values.len() {
            return Err(UnitRefusal::error("this is the state of another unit"));
        }
        let Some(from) = &saved.run else {
            self.reset();
            self.values.clone_from(&saved.values);
            return Ok(());
        };
        let same = |(k, variable): (usize, &crate::Variable)| {
            !matches!(variable.quantity, VariableRole::Key(_))
                || self.values[k].to_bits() == saved.values[k].to_bits()
        };
        let fits = self.start.to_bits() == saved.start.to_bits()
            && self
                .run
                .as_ref()
                .is_some_and(|run| run.step_size().to_bits() == from.step_size().to_bits())
            && self.interface.variables.iter().enumerate().all(same)
            && !self.outdated;
        let step = Some(from.step_size());
        let begun = |start| {
            Run::new(&self.resources, &self.interface, &saved.values, start, step)
                .map_err(UnitRefusal::error)
        };
        let mut other = if fits { None } else { Some(begun(saved.start)?) };
        let Some(run) = other.as_mut().or(self.run.as_mut()) else {
            return Err(UnitRefusal::error("there is no motion"));
        };
        run.resume(from).map_err(UnitRefusal::error)?;
        if other.is_some() {
            self.run = other;
        }
        self.values.clone_from(&saved.values);
        (self.phase, self.start, self.outdated) = (saved.phase, saved.start, false);
        Ok(())
    }

    /// A state as bytes.
    ///
    /// # Errors
    /// [`UnitRefusal`].
    pub fn bytes_of(&self, state: &SavedState) -> Result<Vec<u8>, UnitRefusal> {
        let stored = (VERSION, self.token.as_str(), state);
        postcard::to_stdvec(&stored).map_err(|error| UnitRefusal::error(error.to_string()))
    }

    /// The state in bytes.
    ///
    /// # Errors
    /// [`UnitRefusal`] for bytes of another version, of another unit, or that are none.
    pub fn state_of(&self, bytes: &[u8]) -> Result<SavedState, UnitRefusal> {
        let none = |_| UnitRefusal::error("these bytes are no state of this unit");
        let (version, rest): (String, &[u8]) = postcard::take_from_bytes(bytes).map_err(none)?;
        if version != VERSION {
            let what = format!("the state is of holonom {version}, this is holonom {VERSION}");
            return Err(UnitRefusal::error(what));
        }
        let (token, rest): (String, &[u8]) = postcard::take_from_bytes(rest).map_err(none)?;
        if token != self.token {
            return Err(UnitRefusal::error("this is the state of another unit"));
        }
        let state: SavedState = postcard::from_bytes(rest).map_err(none)?;
        if state.values.len() != self.values.len() {
            return Err(UnitRefusal::error("this is the state of another unit"));
        }
        Ok(state)
    }
}

/// The values of variables until they are set.
fn starts(interface: &Interface) -> Vec<f64> {
    interface.variables.iter().map(|own| own.start.unwrap_or(f64::NAN)).collect()
}
