//! What a motion is asked for: controls, costs, conditions, the time it takes.

use crate::node::NodeQuantity;
use crate::objective::{self, NumberCost};
use crate::terminal_rate::TerminalRateError;
use std::sync::Arc;
use vi_constraints::OrderMethod;
use vi_constraints::setup::SetupError;
use vi_core::coordinate_force::SignedUnknown;
use vi_core::force::Source;
use vi_multibody::Mechanism;
use vi_rigid::load::Load;

/// What the values of a control act by.
#[derive(Clone, Debug, PartialEq)]
pub enum Acts {
    /// Efforts along a joint coordinate of the spanning tree, N or N·m.
    Along(SignedUnknown),
    /// Factors of a wrench on a body: the load of the value 1, constant in time.
    Wrench(Load),
}

/// An effort or a wrench, constant in each step.
#[derive(Clone, Debug, PartialEq)]
pub struct Control {
    /// Its name.
    pub name: String,
    /// What it acts by.
    pub acts: Acts,
    /// Its bounds; infinite where there are none.
    pub bounds: [f64; 2],
    /// Steps for which one value lasts, 1 at least.
    pub hold: usize,
    /// Whether values lie on lines between knots, in the middle of each step; knots are `hold`
    /// steps apart, and bounds are those of the values.
    pub linear: bool,
}

impl Control {
    /// Whether it has knots; on those of single steps every value lies.
    pub(super) fn has_knots(&self) -> bool {
        self.linear && self.hold > 1
    }

    /// The knots before and after step `n`, with their weights in its middle.
    pub(super) fn knots(&self, n: usize) -> [(usize, f64); 2] {
        let (first, part) = (n / self.hold, ((n % self.hold) as f64 + 0.5) / self.hold as f64);
        [(first, 1.0 - part), (first + 1, part)]
    }
}

/// A number of a node.
#[derive(Clone)]
pub enum NodeNumber {
    /// A joint coordinate of the spanning tree: the unknown it is, and its value at the start, with
    /// its revolutions.
    Joint {
        /// The unknown.
        unknown: SignedUnknown,
        /// At the start of the motion, m or rad.
        start: f64,
    },
    /// A number of the configuration.
    Configuration(Arc<dyn objective::Quantity>),
    /// A number of a node with its velocity: one of the step that ends there.
    Node(Arc<dyn NodeQuantity>),
}

impl std::fmt::Debug for NodeNumber {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Joint { unknown, start } => {
                let mut shown = f.debug_struct("Joint");
                shown.field("unknown", unknown).field("start", start).finish()
            }
            Self::Configuration(_) => f.write_str("Configuration"),
            Self::Node(_) => f.write_str("Node"),
        }
    }
}

impl NodeNumber {
    /// A number of the configuration.
    pub fn of(quantity: impl objective::Quantity + 'static) -> Self {
        Self::Configuration(Arc::new(quantity))
    }

    /// A number of a node with its velocity.
    pub fn of_node(quantity: impl NodeQuantity + 'static) -> Self {
        Self::Node(Arc::new(quantity))
    }

    /// Coordinate `freedom` of a joint of the spanning tree, in a start `q`; `None` where it is no
    /// unknown of the tree. An angle is its principal value there, plus whole `revolutions`.
    #[must_use]
    pub fn joint(
        mechanism: &Mechanism,
        joint: usize,
        freedom: usize,
        q: &[f64],
        revolutions: i32,
    ) -> Option<Self> {
        let joint = mechanism.description().joints.get(joint)?;
        let unknown = mechanism.tree().unknown_of(joint, freedom)?;
        let coordinate =
            vi_multibody::joint_coordinate::JointCoordinate::principal(joint, freedom)?;
        let principal = coordinate.at(vi_core::Configuration::new(0.0, q));
        let start = principal + std::f64::consts::TAU * f64::from(revolutions);
        Some(Self::Joint { unknown, start })
    }
}

/// Where a condition holds, or a deviation counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// At the last node.
    End,
    /// At every node; the first one is given.
    Path,
    /// At the node of this number, from 1 to the number of steps.
    Node(usize),
}

/// Bounds on a quantity; equal for an equation.
#[derive(Clone, Debug)]
pub struct Condition {
    /// Its name.
    pub name: String,
    /// Of what.
    pub quantity: NodeNumber,
    /// Where.
    pub when: When,
    /// `[min, max]`, infinite where there is none.
    pub bounds: [f64; 2],
}

/// What is at rest at the end: momentum zero along these unknowns.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RestAtEnd {
    /// Nothing is asked for.
    Free,
    /// Everything: `P(q_N)ᵀ p̄_N` is a force of the closures alone.
    All,
    /// Some unknowns of a tree.
    Unknowns(Vec<usize>),
}

/// A term of the cost.
#[derive(Clone, Debug)]
pub struct Cost {
    /// Its factor.
    pub weight: f64,
    /// Which.
    pub kind: CostKind,
}

/// Terms of costs; all have derivatives everywhere.
#[derive(Clone, Debug)]
pub enum CostKind {
    /// `½ Σ_n h Σ w²` of these controls.
    Effort(Vec<usize>),
    /// `Σ_n τ_n Δθ_n` of these controls, all along joint coordinates.
    Work(Vec<usize>),
    /// `½ Σ_n Σ (w_n − w_{n−1})²/h` of these controls, over all pairs of steps.
    Rate(Vec<usize>),
    /// `T = N h`.
    Time,
    /// `c(y)`: at the end or at a node once, along the path `Σ (h/2)` of both ends of each step, of
    /// numbers of the configuration that are not continued of each sub-step: with these a sum has
    /// the order of a composition, all others have order 2.
    Number {
        /// `y`.
        quantity: NodeNumber,
        /// `c`.
        judged: NumberCost,
        /// Where it counts.
        when: When,
    },
}

/// The time that the motion takes, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FinalTime {
    /// Given.
    Fixed(f64),
    /// An unknown.
    Free {
        /// Least, positive.
        min: f64,
        /// Largest.
        max: f64,
        /// Where the method starts.
        guess: f64,
    },
}

impl FinalTime {
    /// Given, or where the method starts.
    #[must_use]
    pub fn guess(&self) -> f64 {
        match *self {
            Self::Fixed(time) => time,
            Self::Free { guess, .. } => guess,
        }
    }

    /// Whether it is an unknown.
    #[must_use]
    pub fn is_free(&self) -> bool {
        matches!(self, Self::Free { .. })
    }
}

/// A problem of optimal control.
#[derive(Clone, Debug)]
pub struct ControlProblem {
    /// `N`.
    pub steps: usize,
    /// `T`.
    pub time: FinalTime,
    /// How the order of the steps is reached.
    pub method: OrderMethod,
    /// What acts beside the forces of the model.
    pub controls: Vec<Control>,
    /// What is minimised, the sum of these.
    pub costs: Vec<Cost>,
    /// What has to hold.
    pub conditions: Vec<Condition>,
    /// What has no momentum at the end.
    pub rest: RestAtEnd,
    /// Largest turn about a joint from a node to the next, rad: beyond about 1 rad two turns have
    /// one momentum.
    pub max_increment: f64,
}

/// A pair of directors that turns by `Δ` in a step carries `(J/h) sin Δ`: beyond `π/2` a momentum
/// belongs to two turns.
pub const MAX_INCREMENT: f64 = 1.0;

/// What has no program, each with a remedy of its own.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Uncovered {
    /// Point masses.
    #[error("point masses")]
    Particles,
    /// Nodes of beams.
    #[error("beams")]
    Beams,
    /// Forces with internal variables, or that read signals with states.
    #[error("forces with a memory")]
    Memory,
    /// A force that changes with the time itself, or whose second derivatives by the length of a
    /// step are not known, beside a free final time.
    #[error("a free final time beside {}", named(.0))]
    ForceInTime(Source),
    /// An effort along an unknown that changes with the time itself, beside a free final time.
    #[error("a free final time beside efforts of joints that change with the time")]
    EffortInTime,
    /// Velocities where the constraints are singular.
    #[error("velocities at a singular start")]
    SingularStart,
    /// Rest of single unknowns where closures act.
    #[error("rest of single joints of a closed loop")]
    RestInLoop,
    /// An effort along an unknown that is no joint coordinate.
    #[error("efforts along ball joints and free bodies")]
    NoCoordinate,
    /// Constraints of velocities, and gears and prescribed motions of joints that are no unknowns
    /// of the tree.
    #[error("rolling, and gears and prescribed motions of joints that close loops,")]
    Constraints,
    /// Prescribed motions beside a free final time.
    #[error("a free final time beside prescribed motions")]
    MotionInTime,
}

fn named(source: &Source) -> String {
    match source {
        Source::Element(name) if name.is_empty() => "a force without a name".to_owned(),
        Source::Element(name) => format!("`{name}`, which changes with the time"),
        Source::System(words) => (*words).to_owned(),
    }
}

/// Why there is no program of a problem.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProblemError {
    /// Not covered.
    #[error("{0} cannot be optimised yet")]
    NotCovered(Uncovered),
    /// What the method does not integrate.
    #[error(transparent)]
    Method(SetupError),
    /// No steps.
    #[error("a motion needs at least one step")]
    NoSteps,
    /// A final time that is not positive, or not between its bounds.
    #[error("the final time has to be positive, and the guess between its bounds")]
    Time,
    /// Bounds that leave nothing.
    #[error("`{name}`: the least value {min} is above the largest {max}")]
    Bounds {
        /// Of a control or a condition.
        name: String,
        /// `min`.
        min: f64,
        /// `max`.
        max: f64,
    },
    /// The work of a wrench, which has no coordinate of its own.
    #[error("the work of `{0}`, a wrench on a body, cannot be a cost")]
    Work(String),
    /// Not finite.
    #[error("`{0}` holds a number that is not one")]
    NotANumber(String),
    /// Of a cost.
    #[error("a cost names control {control}, of {count}")]
    Control {
        /// As named.
        control: usize,
        /// How many there are.
        count: usize,
    },
    /// Nothing to minimise.
    #[error("the cost has no term: every motion that meets the conditions is as good as any other")]
    NoCost,
    /// A value lasts no step.
    #[error("`{0}`: a value has to last a step at least")]
    Hold(String),
    /// At no node.
    #[error("`{name}`: there is no node {node} of a motion of {steps} steps")]
    Node {
        /// Of a condition.
        name: String,
        /// As named.
        node: usize,
        /// `N`.
        steps: usize,
    },
    /// A condition along the path that the start does not meet.
    #[error("`{name}`: the motion starts outside of the bounds, with {value}")]
    Start {
        /// Among those of the problem.
        condition: usize,
        /// Its name.
        name: String,
        /// Of its quantity at the start.
        value: f64,
    },
    /// Another shape than the motion.
    #[error(
        "the guess has {found} nodes of {unknowns} coordinates, the motion {wanted} of {degrees}"
    )]
    Guess {
        /// Nodes.
        found: usize,
        /// Nodes.
        wanted: usize,
        /// Of the first node.
        unknowns: usize,
        /// Of the tree.
        degrees: usize,
    },
    /// A number that no node of a motion has by itself.
    #[error("`{0}` reads {1}")]
    Reads(String, &'static str),
    /// A number of a node that has no derivative.
    #[error("{0}")]
    Rate(#[from] TerminalRateError),
    /// It leads where a joint has no coordinates.
    #[error("the guess turns a joint by more than half a turn in a step, at node {0}")]
    GuessTurns(usize),
}

/// `min ≤ max`, and both are numbers.
fn check_bounds(name: &str, [min, max]: [f64; 2]) -> Result<(), ProblemError> {
    if min.is_nan() || max.is_nan() || min == f64::INFINITY || max == f64::NEG_INFINITY {
        return Err(ProblemError::NotANumber(name.to_owned()));
    }
    if min > max {
        return Err(ProblemError::Bounds { name: name.to_owned(), min, max });
    }
    Ok(())
}

impl ControlProblem {
    /// What is wrong with it by itself.
    ///
    /// # Errors
    /// [`ProblemError`].
    pub fn check(&self) -> Result<(), ProblemError> {
        if self.steps == 0 {
            return Err(ProblemError::NoSteps);
        }
        let in_order = match self.time {
            FinalTime::Fixed(time) => time > 0.0 && time.is_finite(),
            FinalTime::Free { min, max, guess } => {
                min > 0.0 && min <= guess && guess <= max && max.is_finite()
            }
        };
        if !in_order {
            return Err(ProblemError::Time);
        }
        for control in &self.controls {
            check_bounds(&control.name, control.bounds)?;
            if control.hold == 0 {
                return Err(ProblemError::Hold(control.name.clone()));
            }
        }
        for condition in &self.conditions {
            check_bounds(&condition.name, condition.bounds)?;
            self.check_node(&condition.name, condition.when)?;
        }
        if self.costs.is_empty() {
            return Err(ProblemError::NoCost);
        }
        self.costs.iter().try_for_each(|cost| self.check_cost(cost))
    }

    /// The numbers of conditions and costs, with the names of conditions.
    pub(super) fn numbers(&self) -> impl Iterator<Item = (&str, &NodeNumber)> {
        let conditions = self.conditions.iter().map(|own| (own.name.as_str(), &own.quantity));
        let costs = self.costs.iter().filter_map(|cost| match &cost.kind {
            CostKind::Number { quantity, .. } => Some(("objective", quantity)),
            _ => None,
        });
        conditions.chain(costs)
    }

    fn check_node(&self, name: &str, when: When) -> Result<(), ProblemError> {
        match when {
            When::Node(node) if node == 0 || node > self.steps => {
                Err(ProblemError::Node { name: name.to_owned(), node, steps: self.steps })
            }
            _ => Ok(()),
        }
    }

    fn check_cost(&self, cost: &Cost) -> Result<(), ProblemError> {
        let count = self.controls.len();
        if !cost.weight.is_finite() {
            return Err(ProblemError::NotANumber("weight".to_owned()));
        }
        match &cost.kind {
            CostKind::Effort(of) | CostKind::Work(of) | CostKind::Rate(of) => {
                if let Some(&control) = of.iter().find(|&&k| k >= count) {
                    return Err(ProblemError::Control { control, count });
                }
                let is_wrench = |k: &&usize| matches!(self.controls[**k].acts, Acts::Wrench(_));
                let of_work = matches!(cost.kind, CostKind::Work(_));
                match of.iter().find(is_wrench).filter(|_| of_work) {
                    Some(&k) => Err(ProblemError::Work(self.controls[k].name.clone())),
                    None => Ok(()),
                }
            }
            CostKind::Time => Ok(()),
            CostKind::Number { judged, when, .. } => {
                if !judged.is_finite() {
                    return Err(ProblemError::NotANumber("target".to_owned()));
                }
                self.check_node("objective", *when)
            }
        }
    }
}
