//! The simulation of an instance: inputs held over a step, steps of a fixed length, nodes.

use crate::interface::{Interface, VariableRole};
use crate::resources::{Resources, override_by, words};
use holonom::experiment::RunnableModel;
use holonom::{ExternalActions, Input, RunFailure, RunState, Simulation};
use serde::{Deserialize, Serialize};

/// Part of a step by which times may differ.
const SAME_TIME: f64 = 1e-6;

/// A simulation with its inputs.
#[derive(Debug)]
pub(crate) struct Run {
    simulation: Simulation,
    inputs: Vec<Input>,
    step: f64,              // s
    read: Option<ReadNode>, // the present node, if it was read
    numbers: Vec<usize>,    // references of signals that are set
}

/// What is read of a node.
#[derive(Debug, Default)]
struct ReadNode {
    sensors: Vec<f64>,
    hamiltonian: f64,
    residual: f64,
}

/// The state of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SavedRun {
    step: f64,
    state: RunState,
}

/// How steps ended.
#[derive(Debug)]
pub(crate) enum StepsEnded {
    /// As asked for.
    Done,
    /// An event of the model ended the motion.
    ByEvent,
    /// A step was not found. The state is that of the node before it.
    Refused(RunFailure),
    /// The motion cannot go on: the state is of no use.
    Lost(RunFailure),
}

impl Run {
    /// The model with these values of all variables, from the time `t`, with this step where it is
    /// not that of the values.
    pub(crate) fn new(
        resources: &Resources,
        interface: &Interface,
        values: &[f64],
        t: f64,
        step: Option<f64>,
    ) -> Result<Self, String> {
        let mut overrides = Vec::new();
        let mut numbers = Vec::new();
        for (k, (variable, value)) in interface.variables.iter().zip(values).enumerate() {
            let is_set = variable.start.is_some_and(|start| start.to_bits() != value.to_bits());
            match &variable.quantity {
                VariableRole::Key(key) if is_set => overrides.push(override_by(key, *value)),
                VariableRole::Number(name) => {
                    numbers.push(k);
                    if is_set {
                        overrides.push(override_by(&format!("signal.{name}.start"), *value));
                    }
                }
                _ => {}
            }
        }
        overrides.extend(step.map(|step| override_by("simulation.step", step)));
        let model = resources.model(&overrides).map_err(|error| words(&error))?;
        if !overrides.is_empty() {
            let all: Vec<_> = resources.overrides.iter().chain(&overrides).cloned().collect();
            let own = Interface::of(&resources.text, &all, &model, &resources.request);
            let own = own.map_err(|error| words(&error))?;
            let named = |of: &Interface| of.variables.iter().map(|own| own.name.clone()).collect();
            let (found, expected): (Vec<String>, Vec<String>) = (named(&own), named(interface));
            if found != expected {
                return Err("these parameters change the variables of the unit: set them where it is exported, by --set".into());
            }
        }
        let inputs: Vec<Input> = interface.places.iter().cloned().map(Input::new).collect();
        let simulation = Simulation::beginning_at(&model, &ExternalActions::of_inputs(&inputs), t)
            .map_err(|error| words(&error))?;
        let step = model.settings.step;
        let mut own = Self { simulation, inputs, step, read: None, numbers };
        own.hold_efforts(interface, values);
        Ok(own)
    }

    /// What is worth knowing of the model.
    pub(crate) fn warnings(&self) -> Vec<String> {
        self.simulation.warnings()
    }

    /// Steps taken, and the time, s.
    pub(crate) fn place(&self) -> (u64, f64) {
        RunnableModel::place(&self.simulation)
    }

    /// The time step, s.
    pub(crate) fn step_size(&self) -> f64 {
        self.step
    }

    /// Holds the inputs from the present node on.
    pub(crate) fn hold(&mut self, interface: &Interface, values: &[f64]) -> Result<(), String> {
        self.read = None;
        self.hold_efforts(interface, values);
        for k in &self.numbers {
            if let VariableRole::Number(name) = &interface.variables[*k].quantity {
                let set = self.simulation.set_number(name, values[*k]);
                set.map_err(|error| error.to_string())?;
            }
        }
        Ok(())
    }

    fn hold_efforts(&mut self, interface: &Interface, values: &[f64]) {
        let mut all: Vec<[f64; 3]> = self.inputs.iter().map(Input::values).collect();
        for (variable, value) in interface.variables.iter().zip(values) {
            if let VariableRole::Held { input, component } = variable.quantity {
                all[input][component] = *value;
            }
        }
        self.inputs.iter().zip(&all).for_each(|(input, values)| input.set(values));
    }

    /// How many steps a communication step of this length takes; `None` where it is no multiple of
    /// the step.
    pub(crate) fn count(&self, length: f64) -> Option<u64> {
        let ratio = length / self.step;
        let whole = ratio.round();
        let fits = whole >= 1.0 && (ratio - whole).abs() <= SAME_TIME && whole < 1e15;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 1 to 1e15
        fits.then_some(whole as u64)
    }

    /// Whether a time is that of the present node.
    pub(crate) fn is_at(&self, t: f64) -> bool {
        (t - self.place().1).abs() <= SAME_TIME * self.step
    }

    /// Takes steps.
    pub(crate) fn advance(&mut self, count: u64) -> StepsEnded {
        self.read = None;
        for _ in 0..count {
            let before = self.place();
            match self.simulation.step_on() {
                Ok(()) if self.place().0 == before.0 => return StepsEnded::ByEvent,
                Ok(()) => {}
                Err(failure) if self.place() == before => return StepsEnded::Refused(failure),
                Err(failure) => return StepsEnded::Lost(failure),
            }
        }
        StepsEnded::Done
    }

    /// The value of an output at the present node.
    pub(crate) fn output(&mut self, quantity: &VariableRole) -> Result<f64, String> {
        if matches!(quantity, VariableRole::Time) {
            return Ok(self.place().1);
        }
        if self.read.is_none() {
            let sample = self.simulation.observe().map_err(|failure| said(&failure))?;
            self.read = Some(ReadNode {
                sensors: sample.sensors.clone(),
                hamiltonian: sample.hamiltonian,
                residual: sample.residuals.position,
            });
        }
        let Some(node) = &self.read else { return Ok(f64::NAN) };
        Ok(match quantity {
            VariableRole::Column(k) => node.sensors[*k],
            VariableRole::Hamiltonian => node.hamiltonian,
            _ => node.residual,
        })
    }

    /// All that later steps depend on.
    pub(crate) fn saved(&self) -> SavedRun {
        SavedRun { step: self.step, state: self.simulation.state() }
    }

    /// Goes on from a state.
    pub(crate) fn resume(&mut self, saved: &SavedRun) -> Result<(), String> {
        self.read = None;
        self.simulation.resume(saved.state.clone()).map_err(|error| error.to_string())
    }
}

impl SavedRun {
    /// The time step, s.
    pub(crate) fn step_size(&self) -> f64 {
        self.step
    }
}

/// The words of a run that failed.
pub(crate) fn said(failure: &RunFailure) -> String {
    let RunFailure { step, t, message, remedy } = failure;
    format!("step {step}, t = {t} s: {message}; {remedy}")
}
