//! Inputs: values that are held over a step.

use holonom_model::{Control, ModelError, Problem, nearest};
use vi_multibody::held_effort::HeldEffort;

/// Where an input acts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum InputPlace {
    /// On a coordinate of a joint, N or N·m.
    Joint {
        /// The joint.
        name: String,
        /// Which of its coordinates.
        freedom: usize,
    },
    /// On a body, a node of a beam (at the centre of mass) or a point mass, N, in space.
    Force(String),
    /// On a body or a node of a beam, N·m, in space.
    Torque(String),
    /// The value of a `[[control]]` on a body, a factor of its wrench.
    Control(String),
    /// What the motor of a joint follows in the place of its path, m or rad.
    Setpoint(String),
}

impl InputPlace {
    /// Where a control of a model acts.
    #[must_use]
    pub fn of(control: &Control) -> Self {
        match &control.joint {
            Some(joint) => Self::Joint { name: joint.clone(), freedom: control.freedom },
            None => Self::Control(control.name.clone()),
        }
    }
}

/// An input: what it holds acts on all steps until it is set again. Clones are the same input.
#[derive(Clone, Debug)]
pub struct Input {
    place: InputPlace,
    values: [HeldEffort; 3],
}

impl Input {
    /// An input that is zero.
    #[must_use]
    pub fn new(place: InputPlace) -> Self {
        Self { place, values: Default::default() }
    }

    /// The input that a control of a model is.
    pub(crate) fn of(control: &Control) -> Self {
        Self::new(InputPlace::of(control))
    }

    /// Where it acts.
    #[must_use]
    pub fn place(&self) -> &InputPlace {
        &self.place
    }

    /// How many values it has: 1 of a joint or a control, 3 of a force or a torque.
    #[must_use]
    pub fn len(&self) -> usize {
        match self.place {
            InputPlace::Joint { .. } | InputPlace::Control(_) | InputPlace::Setpoint(_) => 1,
            InputPlace::Force(_) | InputPlace::Torque(_) => 3,
        }
    }

    /// Never.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Holds these values from now on.
    pub fn set(&self, values: &[f64]) {
        for (own, value) in self.values.iter().zip(values) {
            own.set(*value);
        }
    }

    /// The values held, the first [`Input::len`] of these.
    #[must_use]
    pub fn values(&self) -> [f64; 3] {
        std::array::from_fn(|k| self.values[k].get())
    }

    /// The values held.
    pub(crate) fn held(&self) -> impl Iterator<Item = f64> + '_ {
        self.values.iter().take(self.len()).map(HeldEffort::get)
    }

    /// What acts on its joint, or the factor of its wrench.
    pub(crate) fn effort(&self) -> HeldEffort {
        self.first()
    }

    /// Its first value.
    pub(super) fn first(&self) -> HeldEffort {
        self.values[0].clone()
    }

    pub(crate) fn source(&self) -> String {
        match &self.place {
            InputPlace::Joint { name, freedom: 0 } => format!("{name}.input"),
            InputPlace::Joint { name, freedom } => format!("{name}.{freedom}.input"),
            InputPlace::Force(name) => format!("{name}.force"),
            InputPlace::Torque(name) => format!("{name}.torque"),
            InputPlace::Control(name) => format!("{name}.control"),
            InputPlace::Setpoint(name) => format!("{name}.motor"),
        }
    }
}

/// The error for a name of what acts from outside.
pub(crate) fn nothing<'a>(
    key: &str,
    name: &str,
    what: &str,
    known: impl Iterator<Item = &'a str>,
) -> ModelError {
    let known: Vec<&str> = known.collect();
    let problem = Problem::new(key, format!("there is no {what} named `{name}`"));
    let problem = match nearest(name, known.iter().copied()) {
        Some(best) => problem.help(format!("did you mean `{best}`?")),
        None => problem.help(format!("there are: {}", known.join(", "))),
    };
    ModelError::Assembly(vec![problem])
}
