//! What an optimum is, as `optimum.json` and `iterations.csv` have it.

use super::kept::SearchEnd;
use crate::gradient::TermValue;
use holonom_model::{Condition, ConditionKind, Model, ModelError};
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::rc::Rc;
use vi_control::program::Iterate;

/// Seed of disturbed beginnings.
pub(super) const SEED: u64 = 20_101_127;

/// How a search ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SearchStatus {
    /// A local optimum.
    Optimal,
    /// A local optimum among motions that turn no joint by more than 1 rad in a step, which does so
    /// in some: with more steps there is a better one.
    TurnsBounded,
    /// The conditions are not met, and no direction brings the motion nearer to them.
    Infeasible,
    /// It was told to stop.
    Stopped,
    /// It made as many iterations as it may, or found no further step.
    #[default]
    Unfinished,
    /// The method takes its point for an optimum, and derivatives do not.
    NotOptimal,
    /// The run of its controls is another motion.
    OtherMotion,
    /// A body turns by more than 1 rad in a step.
    TurnsTooFar,
}

impl SearchStatus {
    /// Whether its motion meets the conditions, and no other motion of these steps that is near is
    /// better.
    #[must_use]
    pub fn is_found(self) -> bool {
        matches!(self, Self::Optimal | Self::TurnsBounded)
    }

    /// In words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Optimal => "a local optimum",
            Self::TurnsBounded => "an optimum among turns of at most 1 rad in a step",
            Self::Infeasible => "infeasible: no direction brings it nearer to the conditions",
            Self::Stopped => "stopped before the end",
            Self::Unfinished => "not finished: no optimum was reached",
            Self::NotOptimal => "not optimal by its own derivatives",
            Self::OtherMotion => "not the motion of its controls",
            Self::TurnsTooFar => "a body turns by more than 1 rad in a step",
        }
    }
}

/// The size of a search.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ProblemSize {
    /// What is looked for: all variables, of a design its parameters.
    pub unknowns: usize,
    /// Values of controls among them.
    pub values: usize,
    /// Equations of the steps and conditions.
    pub equations: usize,
    /// Conditions with bounds at each of their nodes, and turns of joints in steps.
    pub inequalities: usize,
    /// The joints of the coordinates of the tree, in the order of `costates.csv`, with the number
    /// of the freedom where there are several; of controls.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub coordinates: Vec<String>,
}

/// A parameter that was free.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterFound {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Where the search began.
    pub start: f64,
    /// The least value.
    pub min: f64,
    /// The largest.
    pub max: f64,
    /// Whether it is at one of them.
    pub at_bound: bool,
}

/// A condition.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConditionMet {
    /// Its name.
    pub name: String,
    /// Of rest: the joint whose momentum it is, with the number of its freedom where there are
    /// several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub of: Option<String>,
    /// What its sensor shows; along the path where it is nearest to a bound, or farthest beyond. Of
    /// rest the momentum, N·s or N·m·s.
    pub value: f64,
    /// The least value, or what it is to equal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// The largest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// How far the value is beyond.
    pub violation: f64,
    /// How far a run of the same controls at half the step misses it, along the path between nodes
    /// as well; of sensors beside controls.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub halved: Option<f64>,
    /// The derivative of the cost by the bound: what one unit more costs.
    pub price: f64,
}

impl ConditionMet {
    /// Its name, of rest with its joint.
    #[must_use]
    pub fn label(&self) -> String {
        match &self.of {
            Some(joint) => format!("{} of {joint}", self.name),
            None => self.name.clone(),
        }
    }

    /// Of rest: the momentum along a joint, with its multiplier.
    pub(super) fn of_rest(own: &Condition, joint: String, momentum: (f64, f64)) -> Self {
        Self { of: Some(joint), ..Self::of(own, std::iter::once(momentum)) }
    }

    /// By values and multipliers at its nodes.
    pub(super) fn of(own: &Condition, at: impl Iterator<Item = (f64, f64)>) -> Self {
        let [min, max] = match own.kind {
            ConditionKind::Rest => [0.0; 2],
            ConditionKind::Sensor => own.bounds(),
        };
        let beyond = |value: f64| (min - value).max(value - max);
        let (mut nearest, mut price) = (f64::NAN, 0.0);
        for (value, multiplier) in at {
            if nearest.is_nan() || beyond(value) > beyond(nearest) {
                nearest = value;
            }
            price -= multiplier;
        }
        let finite = |bound: f64| bound.is_finite().then_some(bound);
        Self {
            name: own.name.clone(),
            of: None,
            value: nearest,
            min: finite(min),
            max: finite(max),
            violation: beyond(nearest).max(0.0),
            halved: None,
            price: price + 0.0, // no negative zero
        }
    }
}

/// A control.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ControlFound {
    /// Its name.
    pub name: String,
    /// The least effort, N or N·m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// The largest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// Its largest modulus.
    pub largest: f64,
    /// Steps in which it is at a bound.
    pub at_bounds: usize,
}

/// An optimum with other steps on the way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Refinement {
    /// Number of steps.
    pub steps: usize,
    /// Its cost.
    pub cost: f64,
    /// Whether it counts for the order of the cost: an optimum without bounded turns, whose
    /// conditions and values of controls are at the same times as with all steps, or last a step.
    pub comparable: bool,
}

/// Conditions of an optimum by the derivatives of the program.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Judged {
    /// `|∇𝓛|`, in parts of the largest multiplier.
    pub stationarity: f64,
    /// Largest violation of an equation or a bound.
    pub violation: f64,
    /// Largest product of a multiplier and the distance from its bound.
    pub complementarity: f64,
}

/// The run of the controls.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Replayed {
    /// Largest deviation of its nodes from those of the optimum, m or 1.
    pub deviation: f64,
    /// The node of it.
    pub node: usize,
    /// Largest deviation of single steps from these nodes, where the run deviates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub by_steps: Option<f64>,
}

/// Where some searches of several ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StartFound {
    /// The number of the first of them, from 1.
    pub start: usize,
    /// How many ended there: in the same way, with the same cost to 1e-6 of it.
    pub count: usize,
    /// How they ended.
    pub status: SearchStatus,
    /// Their cost.
    pub cost: f64,
    /// Why they have none.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub message: String,
}

/// Costs of one optimum, in parts of them.
const SAME_COST: f64 = 1e-6;

impl StartFound {
    /// Adds a search to those that ended elsewhere, or in the same place.
    pub(super) fn add(all: &mut Vec<Self>, status: SearchStatus, cost: f64, message: String) {
        let start = all.iter().map(|own| own.count).sum::<usize>() + 1;
        let same = |own: &&mut Self| {
            let near = (own.cost - cost).abs() <= SAME_COST * cost.abs().max(own.cost.abs());
            own.status == status && own.message == message && (near || !cost.is_finite())
        };
        match all.iter_mut().find(same) {
            Some(own) => own.count += 1,
            None => all.push(Self { start, count: 1, status, cost, message }),
        }
    }

    /// Those of several searches; of one none.
    pub(super) fn several(all: Vec<Self>) -> Vec<Self> {
        if all.iter().map(|own| own.count).sum::<usize>() > 1 { all } else { Vec::new() }
    }
}

/// An optimum.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct OptimumReport {
    /// The model.
    pub model: String,
    /// How the search ended.
    pub status: SearchStatus,
    /// Why it is no optimum: what misses most.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub missed: Vec<String>,
    /// Its size.
    pub problem: ProblemSize,
    /// Steps of the motion.
    pub steps: usize,
    /// Their length, s.
    pub step: f64,
    /// The time that the motion takes, s.
    pub time: f64,
    /// `J`.
    pub cost: f64,
    /// Its terms, with their weights.
    pub terms: Vec<TermValue>,
    /// Parameters that were free.
    pub parameters: Vec<ParameterFound>,
    /// Controls.
    pub controls: Vec<ControlFound>,
    /// Conditions.
    pub conditions: Vec<ConditionMet>,
    /// Iterations of all numbers of steps.
    pub iterations: usize,
    /// Whether no motion nearby is as good; of controls.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sufficient: Option<bool>,
    /// Steps in which a joint turns by 1 rad, as much as it may; of controls.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turns_at_bound: Option<usize>,
    /// Optima with fewer steps on the way, this one last.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub refinements: Vec<Refinement>,
    /// The conditions of an optimum; of controls.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub judged: Option<Judged>,
    /// The run of the controls.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replay: Option<Replayed>,
    /// Where searches ended, where there were several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub starts: Vec<StartFound>,
}

impl OptimumReport {
    /// The observed order of the cost in the step and its limit, of three refinements.
    #[must_use]
    pub fn convergence(&self) -> Option<[f64; 2]> {
        let [.., a, b, c] = self.refinements[..] else { return None };
        let halved = 2 * a.steps == b.steps && 2 * b.steps == c.steps;
        let ratio = (b.cost - a.cost) / (c.cost - b.cost);
        let order = libm::log2(ratio);
        let comparable = [a, b, c].iter().all(|own| own.comparable);
        (comparable && halved && order.is_finite() && ratio > 1.0)
            .then(|| [order, c.cost + (c.cost - b.cost) / (ratio - 1.0)])
    }
}

/// An iteration, a row of `iterations.csv`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SearchStep {
    /// Number of the search, from 1.
    pub start: usize,
    /// Steps of the motion.
    pub steps: usize,
    /// What the method says of it; of a design its number, `J` and the violation alone.
    pub iterate: Iterate,
    /// Parameters; of a design.
    pub parameters: Vec<f64>,
}

/// What is said while a search lasts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchProgress {
    /// Number of the search, from 1.
    pub start: usize,
    /// Iterations so far.
    pub iteration: usize,
    /// `J`.
    pub cost: f64,
    /// Largest violation.
    pub infeasibility: f64,
}

/// Sees each iteration; false stops.
pub type SearchWatch = Rc<RefCell<dyn FnMut(&SearchProgress) -> bool>>;

/// An optimum with what its files hold.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundOptimum {
    /// In numbers.
    pub report: OptimumReport,
    /// The iterations.
    pub steps: Vec<SearchStep>,
    /// The model of the optimum, for an ordinary run.
    pub model: Model,
    /// The multipliers of the balances at the nodes 0 to N − 1, one for each coordinate of the
    /// tree.
    pub costates: Vec<Vec<f64>>,
    /// What bounds cost, of each control that has one and of each condition along the path: the
    /// derivatives of the cost by the bounds at the nodes 0 to N, of a control by those of the
    /// value that begins there; NaN where there is none.
    pub prices: Vec<(String, Vec<f64>)>,
    /// Of each step the value of each control, N or N·m.
    pub controls: Vec<Vec<f64>>,
    /// Where the search ended.
    pub kept: SearchEnd,
}

/// Why there is no optimum at all.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OptimizeFailure {
    /// The model asks for what cannot be.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The point to go on from is of another problem.
    #[error("the point to go on from is of another problem")]
    Another,
    /// There is no motion to begin with.
    #[error("{0}")]
    Run(String),
}

/// Leaves out of a model what an ordinary run does without.
pub(super) fn plain(model: &mut Model) {
    model.controls.clear();
    model.objectives.clear();
    model.conditions.clear();
    model.optimize = None;
}
