//! Parameters of a mechanism from measurements of its motion.
//!
//! ```text
//! ρ_i = (y(t_i; θ) − ŷ_i)/s_i       y: a quantity or its rate, ŷ: measured, s: its standard deviation
//! y(t_n + s h) = H_00(s) y_n + H_10(s) h ẏ_n + H_01(s) y_{n+1} + H_11(s) h ẏ_{n+1}     ẏ_n = ∇y·v̂_n
//! δy_n = ∇y·δq_n + y_θ              δq_n, δp̄_n: the tangent of the motion along θ              [2.37]
//! δẏ_n = D²y[v̂_n, δq_n] + ∇y·δv̂_n + (∇y)_θ v̂_n
//! ```
//! Hermite's cubic polynomials between nodes, and their derivatives for rates, have a higher order
//! than the scheme of order 2; numbers of nodes with their velocities, `y(q, v̂)`, are linear
//! between nodes, of order 2. All derivatives come from tangents beside one run; least squares do
//! the rest ([`crate::least_squares`]). Parameters may change the start, the masses, the geometry,
//! the forces, the quantities: what an [`Experiment`] says.

use crate::controls::Controls;
use crate::gradient::GradientError;
use crate::least_squares::{Refused, Residuals};
use crate::node::{Node, NodeQuantity, NodeReads, NodeSlopes};
use crate::objective::{ByKnown, CostTerm, Known, NotedNode, Objective, Quantity};
use crate::sensitivities::{Beside, Direction, Increment, NodeForces, Sensitivities};
use crate::terminal_rate::{NodeReader, NodeSources};
use nalgebra::DMatrix;
use std::ops::Range;
use vi_constraints::design::Design;
use vi_constraints::linearization::{Costate, Tangent};
use vi_core::linear::dot;
use vi_core::{Configuration, State};
use vi_multibody::design::MechanismTangent;
use vi_multibody::design::velocity::{DifferentiatedVelocity, NodeMass};
use vi_multibody::run::MechanismIntegrator;

/// A run for some parameters, at its start.
pub struct TrialRun {
    /// The run.
    pub run: MechanismIntegrator,
    /// The length of its steps, s.
    pub step: f64,
    /// What acts.
    pub controls: Controls,
    /// The parameters that enter the equations of a step.
    pub design: Option<Box<dyn Design>>,
    /// One direction for each parameter, in their order.
    pub directions: Vec<Direction>,
    /// How the mechanism changes with the parameters of the design, in the order of
    /// [`Direction::parameter`]: velocities follow.
    pub tangents: Vec<MechanismTangent>,
    /// What is measured, in the order of the sensors of [`MeasuredSeries`].
    pub quantities: Vec<Measurable>,
    /// What quantities follow from that read multipliers or accelerations.
    pub sources: NodeSources,
    /// Steps of the run: its last node has the accelerations of that level.
    pub steps: usize,
}

impl std::fmt::Debug for TrialRun {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Trial").field("step", &self.step).finish_non_exhaustive()
    }
}

/// Runs for any parameters.
pub trait Experiment {
    /// The run for some parameters.
    ///
    /// # Errors
    /// [`Refused`], where there is none.
    fn begin(&mut self, theta: &[f64]) -> Result<TrialRun, Refused>;
}

/// A number that can be measured.
pub enum Measurable {
    /// Of a configuration: it has a rate.
    Configuration(Box<dyn Quantity>),
    /// Of a node with its velocity; its reading is [`MeasuredReading::Value`].
    Node(Box<dyn NodeQuantity>),
    /// Of a node with its momentum, the end cost of a term; its reading is
    /// [`MeasuredReading::Value`].
    State(Box<dyn CostTerm>),
}

impl std::fmt::Debug for Measurable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Configuration(_) => "Configuration",
            Self::Node(_) => "Node",
            Self::State(_) => "State",
        })
    }
}

impl Measurable {
    /// What it reads of a node.
    fn reads(&self) -> NodeReads {
        match self {
            Self::Configuration(_) | Self::State(_) => NodeReads::default(),
            Self::Node(own) => own.reads(),
        }
    }

    /// Takes note of a node, one after the other.
    fn follow(&self, node: Configuration<'_>, seen: NotedNode) {
        match self {
            Self::Configuration(own) => own.follow(node, seen),
            Self::Node(own) => own.follow(node, seen),
            Self::State(own) => own.follow(node, seen),
        }
    }

    /// The factors of `(y, ẏ)` or of `(–, y)` where `y` needs a velocity, as
    /// [`MeasuredReading::weights`].
    fn weights(&self, reading: MeasuredReading, s: f64, h: f64) -> [[f64; 2]; 2] {
        match self {
            Self::Configuration(_) => reading.weights(s, h),
            Self::Node(_) | Self::State(_) => [[0.0, 1.0 - s], [0.0, s]],
        }
    }
}

/// What is measured of a quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MeasuredReading {
    /// `y`.
    #[default]
    Value,
    /// `ẏ`.
    Rate,
}

impl MeasuredReading {
    /// The factors of `(y, ẏ)` at the node before a time and at the next; `s`: the part of a step
    /// of length `h` from the first to the time.
    fn weights(self, s: f64, h: f64) -> [[f64; 2]; 2] {
        let r = 1.0 - s;
        match self {
            Self::Value => [
                [(1.0 + 2.0 * s) * r * r, h * s * r * r],
                [s * s * (3.0 - 2.0 * s), -h * s * s * r],
            ],
            Self::Rate => {
                let slope = 6.0 * s * r / h;
                [[-slope, r * (1.0 - 3.0 * s)], [slope, s * (3.0 * s - 2.0)]]
            }
        }
    }
}

/// What a sensor read.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredSeries {
    /// Which quantity of a trial.
    pub sensor: usize,
    /// What of it.
    pub reading: MeasuredReading,
    /// Standard deviation of a value, positive.
    pub sigma: f64,
    /// The times of the values since the start, in steps, ascending.
    pub steps: Vec<f64>,
    /// The values, as many.
    pub values: Vec<f64>,
}

impl MeasuredSeries {
    /// Its values in the steps from these nodes, with times from the first of them.
    #[must_use]
    pub fn part(&self, nodes: Range<usize>) -> Self {
        let all = self.steps.iter().zip(&self.values);
        let own = all.filter_map(|(x, value)| {
            let (node, part) = place(*x);
            nodes.contains(&node).then(|| ((node - nodes.start) as f64 + part, *value))
        });
        let (steps, values) = own.unzip();
        Self { steps, values, ..self.clone() }
    }
}

/// Why series are no measurements.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SeriesError {
    /// A deviation that is not positive.
    #[error("series {0}: the standard deviation has to be positive")]
    Deviation(usize),
    /// Not as many values as times.
    #[error("series {0}: there are not as many values as times")]
    Shape(usize),
    /// Out of order, before the start, or no number.
    #[error("series {0}: the times have to increase from the start on")]
    Order(usize),
    /// Not a number.
    #[error("series {series}: value {value} is no number")]
    NotANumber {
        /// Which.
        series: usize,
        /// Which of its values.
        value: usize,
    },
}

/// The residuals of measurements.
#[derive(Debug)]
pub struct MotionResiduals<E> {
    experiment: E,
    series: Vec<MeasuredSeries>,
}

/// The part that a node has in a residual.
#[derive(Clone, Copy, Debug)]
struct ResidualShare {
    node: usize,
    row: usize,
    series: usize,
    weights: [f64; 2], // of y and ẏ, over the standard deviation
}

/// Times this near to a node, in steps, are those of the node.
const AT_NODE: f64 = 1e-9;

/// The node before a time, and the part of a step from there.
fn place(x: f64) -> (usize, f64) {
    let near = x.round();
    let (node, part) = match (x - near).abs() <= AT_NODE * near.max(1.0) {
        true => (near, 0.0),
        false => (x.floor(), x - x.floor()),
    };
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a step of a run
    (node as usize, part)
}

impl<E: Experiment> MotionResiduals<E> {
    /// Of measurements of an experiment.
    ///
    /// # Errors
    /// [`SeriesError`].
    pub fn new(experiment: E, series: Vec<MeasuredSeries>) -> Result<Self, SeriesError> {
        for (k, own) in series.iter().enumerate() {
            if !(own.sigma > 0.0 && own.sigma.is_finite()) {
                return Err(SeriesError::Deviation(k));
            }
            if own.steps.len() != own.values.len() {
                return Err(SeriesError::Shape(k));
            }
            let begins = own.steps.first().is_none_or(|x| *x >= 0.0);
            let increase = own.steps.windows(2).all(|pair| pair[0] < pair[1]);
            if !(begins && increase && own.steps.iter().all(|x| x.is_finite())) {
                return Err(SeriesError::Order(k));
            }
            if let Some(value) = own.values.iter().position(|value| !value.is_finite()) {
                return Err(SeriesError::NotANumber { series: k, value });
            }
        }
        Ok(Self { experiment, series })
    }

    /// The measurements.
    pub fn series(&self) -> &[MeasuredSeries] {
        &self.series
    }

    /// What runs.
    pub fn experiment(&self) -> &E {
        &self.experiment
    }

    /// The parts of all nodes in all residuals, node after node.
    fn shares(&self, quantities: &[Measurable], h: f64) -> Vec<ResidualShare> {
        let mut shares = Vec::new();
        let mut row = 0;
        for (series, own) in self.series.iter().enumerate() {
            for x in &own.steps {
                let (node, part) = place(*x);
                let of = &quantities[own.sensor];
                for (i, weights) in of.weights(own.reading, part, h).into_iter().enumerate() {
                    if weights.iter().any(|weight| *weight != 0.0) {
                        let weights = weights.map(|weight| weight / own.sigma);
                        shares.push(ResidualShare { node: node + i, row, series, weights });
                    }
                }
                row += 1;
            }
        }
        shares.sort_by_key(|own| own.node);
        shares
    }
}

/// `v̂` and its derivatives, found at nodes where rates are read.
struct Velocities {
    node: DifferentiatedVelocity,
    v: Vec<f64>,
    changes: Vec<Vec<f64>>, // along the directions
}

impl Velocities {
    fn of(trial: &TrialRun) -> Result<Self, Refused> {
        let rows = trial.run.rows();
        let node = DifferentiatedVelocity::new(trial.run.constraints(), rows, &trial.tangents);
        let node = node.map_err(|error| Refused(error.to_string()))?;
        Ok(Self { node, v: Vec::new(), changes: Vec::new() })
    }

    fn find(
        &mut self,
        trial: &TrialRun,
        directions: &[Direction],
        tangents: &Sensitivities,
    ) -> Result<(), Refused> {
        let refused = |error: vi_core::linear::Singular| Refused(error.to_string());
        let (mechanism, state) = (trial.run.constraints(), trial.run.state());
        let h = if trial.run.reads_states() { 0.0 } else { trial.step };
        let found = self.node.find(mechanism, NodeMass::of(trial.run.system(), h), state);
        self.v = found.map_err(refused)?.to_vec();
        self.changes.clear();
        for (direction, own) in directions.iter().zip(tangents.tangents()) {
            let (at, change) = (state.configuration(), [&own.q[..], &own.p[..], &own.z[..]]);
            let found = self.node.change(mechanism, at, direction.parameter, change);
            self.changes.push(found.map_err(refused)?.to_vec());
        }
        Ok(())
    }
}

/// A node that was reached, with what changes there.
#[derive(Clone, Copy)]
struct ReachedNode<'a> {
    at: Configuration<'a>,
    v: &'a [f64],
    tangents: &'a [Tangent],
    directions: &'a [Direction],
    changes: &'a [Vec<f64>], // of v, along the directions; empty where v is not read
    forces: Option<&'a NodeForces>, // where they are read
    acceleration: Option<&'a Increment>, // that of the steps on both sides, where it is read
}

impl ReachedNode<'_> {
    /// The part of a node in `y` or `ẏ`; calls `change` with that of each direction.
    fn of_configuration(
        &self,
        y: &dyn Quantity,
        [of_value, of_rate]: [f64; 2],
        slope: &mut [f64],
        mut change: impl FnMut(usize, f64),
    ) -> f64 {
        let Self { at, v, .. } = *self;
        slope.fill(0.0);
        y.add_slope(at, 1.0, slope);
        let mut bend = vec![0.0; v.len()]; // D²y v
        if of_rate != 0.0 {
            y.add_bend(at.moving(v), 1.0, &mut bend);
        }
        for (j, (own, direction)) in self.tangents.iter().zip(self.directions).enumerate() {
            let value = direction.parameter.map_or(0.0, |k| y.by_parameter(k, at));
            let mut sum = of_value * (dot(slope, &own.q) + value);
            if of_rate != 0.0 {
                let moved = |k: usize| y.rate_by_parameter(k, at.moving(v));
                let rate = direction.parameter.map_or(0.0, moved);
                sum += of_rate * (dot(&bend, &own.q) + dot(slope, &self.changes[j]) + rate);
            }
            change(j, sum);
        }
        let rate = if of_rate == 0.0 { 0.0 } else { of_rate * dot(slope, v) };
        of_value * y.value(at) + rate
    }

    /// The part of a node in `y(q, v̂)`.
    fn of_node(
        &self,
        y: &dyn NodeQuantity,
        weight: f64,
        [of_q, of_v, of_lambda, of_z]: [&mut Vec<f64>; 4],
        mut change: impl FnMut(usize, f64),
    ) -> f64 {
        let Self { at, v, .. } = *self;
        of_q.fill(0.0);
        of_v.fill(0.0);
        let lambda = self.forces.map_or(&[][..], |own| &own.lambda);
        of_lambda.clear();
        of_lambda.resize(lambda.len(), 0.0);
        of_z.clear();
        of_z.resize(at.internal.len(), 0.0);
        let node = Node { lambda, ..Node::moving(at.moving(v)) };
        let out = NodeSlopes { q: of_q, v: of_v, lambda: of_lambda, a: &mut [], z: of_z };
        y.add_slopes(node, weight, out);
        for (j, (own, direction)) in self.tangents.iter().zip(self.directions).enumerate() {
            let moved = direction.parameter.map_or(0.0, |k| y.by_parameter(k, node));
            let by_forces = self.forces.map_or(0.0, |own| dot(of_lambda, &own.changes[j]));
            let by_velocity = self.changes.get(j).map_or(0.0, |change| dot(of_v, change));
            let moving = dot(of_q, &own.q) + by_velocity + dot(of_z, &own.z);
            change(j, moving + by_forces + weight * moved);
        }
        weight * y.value(node)
    }

    /// The part of a node in a number of its state; `parameters`: of the design.
    fn of_state(
        &self,
        y: &dyn CostTerm,
        state: &State,
        weight: f64,
        parameters: usize,
        mut change: impl FnMut(usize, f64),
    ) -> f64 {
        let mut by = Costate::zero(state.q.len(), state.internal.len());
        let mut moved = vec![0.0; parameters];
        y.add_of_end(state, weight, &mut by);
        y.add_parameters_of_end(state, weight, &mut moved);
        for (j, (own, direction)) in self.tangents.iter().zip(self.directions).enumerate() {
            change(j, by.along(own) + direction.parameter.map_or(0.0, |k| moved[k]));
        }
        weight * y.of_end(state)
    }

    /// The same of what reads accelerations, those of the steps on both sides where they are known,
    /// or the acceleration level; also of multipliers where they are not known. `parameters`: of
    /// the design; `of_lambda` takes the derivatives by multipliers that are.
    fn of_level(
        &self,
        (y, reader, state): (&dyn NodeQuantity, &NodeReader, &State),
        weight: f64,
        (parameters, of_lambda): (usize, &mut Vec<f64>),
        mut change: impl FnMut(usize, f64),
    ) -> f64 {
        let mut by = Costate::zero(state.q.len(), state.internal.len());
        let mut by_a = vec![0.0; state.q.len()];
        let mut moved = vec![0.0; parameters];
        let reads = y.reads();
        let forces = self.forces.filter(|_| reads.forces);
        let acceleration = self.acceleration.filter(|_| reads.accelerations);
        of_lambda.clear();
        of_lambda.resize(forces.map_or(0, |own| own.lambda.len()), 0.0);
        let known = Known {
            lambda: forces.map(|own| &own.lambda[..]),
            a: acceleration.map(|own| &own.dq[..]),
        };
        let by_known = ByKnown { lambda: of_lambda, a: &mut by_a, force: &mut [] };
        let slopes = (&mut by, by_known);
        let value = reader.add_slopes((y, &|_| weight), (state, known), slopes, &mut moved);
        for (j, (own, direction)) in self.tangents.iter().zip(self.directions).enumerate() {
            let moved = direction.parameter.map_or(0.0, |k| moved[k]);
            let bent = acceleration.map_or(0.0, |own| dot(&by_a, &own.changes[j]));
            let by_forces = forces.map_or(0.0, |own| dot(of_lambda, &own.changes[j]));
            change(j, by.along(own) + by_forces + bent + moved);
        }
        weight * value
    }
}

impl<E: Experiment> Residuals for MotionResiduals<E> {
    fn len(&self) -> usize {
        self.series.iter().map(|own| own.steps.len()).sum()
    }

    fn evaluate(
        &mut self,
        theta: &[f64],
        out: &mut [f64],
        mut jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), Refused> {
        let mut trial = self.experiment.begin(theta)?;
        let wanted = jacobian.is_some();
        let directions = if wanted { std::mem::take(&mut trial.directions) } else { Vec::new() };
        let refused = |error: GradientError| Refused(error.to_string());
        let mut tangents =
            Sensitivities::new(&trial.run, trial.step, directions.clone()).map_err(refused)?;
        let shares = self.shares(&trial.quantities, trial.step);
        let mut velocities = None;
        let moves = |own: &ResidualShare| match &trial.quantities[self.series[own.series].sensor] {
            Measurable::Configuration(_) => own.weights[1] != 0.0,
            Measurable::Node(of) => own.weights[1] != 0.0 && of.reads_velocity(),
            Measurable::State(_) => false,
        };
        if shares.iter().any(moves) {
            velocities = Some(Velocities::of(&trial)?);
        }
        let measured = self.series.iter().flat_map(|own| own.values.iter().map(|y| -y / own.sigma));
        out.iter_mut().zip(measured).for_each(|(out, y)| *out = y);
        if let Some(jacobian) = jacobian.as_deref_mut() {
            jacobian.fill(0.0);
        }
        let reads =
            trial.quantities.iter().fold(NodeReads::default(), |all, own| all.or(own.reads()));
        let parameters = trial.tangents.len();
        if reads.accelerations {
            tangents.keep_increments();
        }
        let sources = std::mem::take(&mut trial.sources);
        let reader = (reads.any() && sources.level.is_some())
            .then(|| NodeReader::new(&trial.run, &trial.tangents, sources));
        let objective = Objective::default();
        let mut slope = vec![0.0; trial.run.state().q.len()];
        let (mut of_v, mut of_lambda, mut of_z) = (slope.clone(), Vec::new(), Vec::new());
        let mut reached = 0;
        let follow = |trial: &TrialRun, seen| {
            let node = trial.run.state().configuration();
            trial.quantities.iter().for_each(|own| own.follow(node, seen));
        };
        follow(&trial, NotedNode::First);
        for own in shares.chunk_by(|a, b| a.node == b.node) {
            for _ in reached..own[0].node {
                let TrialRun { run, controls, design, .. } = &mut trial;
                let design = design.as_deref();
                let beside = Beside { controls, design, objective: &objective };
                tangents.advance(run, beside).map_err(refused)?;
                follow(&trial, NotedNode::Next);
            }
            reached = own[0].node;
            let of_rates = own.iter().any(|own| own.weights[1] != 0.0);
            if let Some(all) = velocities.as_mut().filter(|_| of_rates) {
                all.find(&trial, &directions, &tangents)?;
            }
            let of_step = |own: &ResidualShare| {
                let reads = trial.quantities[self.series[own.series].sensor].reads();
                let is_known = reads.forces || reads.accelerations && reached < trial.steps;
                is_known && reached > 0 && !trial.run.reads_states()
            };
            let mut forces = None;
            if own.iter().any(of_step) {
                let TrialRun { run, controls, design, .. } = &mut trial;
                let design = design.as_deref();
                let beside = Beside { controls, design, objective: &objective };
                forces = Some(tangents.find_forces(run, beside).map_err(refused)?.clone());
            }
            let next = forces.as_ref().filter(|_| reached < trial.steps);
            let h = trial.step;
            let acceleration = next.map(|own| tangents.before().acceleration(&own.next, h));
            let state = trial.run.state();
            let at = state.configuration();
            let none = Vec::new();
            let v = velocities.as_ref().map_or(&none, |all| &all.v);
            for share in own {
                let found = ReachedNode {
                    at,
                    v,
                    tangents: tangents.tangents(),
                    directions: &directions,
                    changes: velocities.as_ref().map_or(&[], |all| &all.changes),
                    forces: forces.as_ref(),
                    acceleration: acceleration.as_ref(),
                };
                let change = |j: usize, change: f64| {
                    if let Some(jacobian) = jacobian.as_deref_mut() {
                        jacobian[(share.row, j)] += change;
                    }
                };
                let quantity = &trial.quantities[self.series[share.series].sensor];
                out[share.row] += match quantity {
                    Measurable::State(own) => {
                        found.of_state(&**own, state, share.weights[1], parameters, change)
                    }
                    Measurable::Configuration(own) => {
                        found.of_configuration(&**own, share.weights, &mut slope, change)
                    }
                    Measurable::Node(own)
                        if own.reads().accelerations
                            || own.reads().forces && found.forces.is_none() =>
                    {
                        let reader = match &reader {
                            Some(Ok(reader)) => reader,
                            Some(Err(error)) => return Err(Refused(error.to_string())),
                            None => return Err(Refused("its acceleration level".to_owned())),
                        };
                        let (own, with) = ((&**own, reader, state), (parameters, &mut of_lambda));
                        found.of_level(own, share.weights[1], with, change)
                    }
                    Measurable::Node(own) => {
                        let slopes = [&mut slope, &mut of_v, &mut of_lambda, &mut of_z];
                        found.of_node(&**own, share.weights[1], slopes, change)
                    }
                };
                if found.forces.is_some() && quantity.reads().forces {
                    tangents.check_forces(&trial.run, &of_lambda).map_err(refused)?;
                }
                if !out[share.row].is_finite() {
                    return Err(refused(GradientError::NotANumber));
                }
            }
        }
        Ok(())
    }
}
