//! A cost: a sum of terms, each with its derivatives at nodes and in steps.
//!
//! ```text
//! J = Σ_n ℓ_n(q_n, q_{n+1}, w_n, h) + Σ_n (h/2) (φ(q_n, p̄_n) + φ(q_{n+1}, p̄_{n+1})) + Φ(q_N, p̄_N)
//! effort     ½ Σ h |w|²                    time      Σ h
//! running    Σ (h/2) (c(y_n) + c(y_{n+1}))  terminal  c(y_N)           c(y) = ½ (y − target)², or y itself
//! ```
//! `φ` are terms of the end that count along the path, at the nodes of whole steps.

use crate::reads::NodeReads;
use vi_constraints::linearization::Costate;
use vi_core::interval::{Interval, Slot};
use vi_core::sparse::Product;
use vi_core::{Configuration, Motion, State};
use vi_multibody::form::{BilinearRow, Form};
use vi_multibody::joint_coordinate::JointCoordinate;

/// Derivatives of the cost of a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepGradient {
    /// By `q_n`, shape `n`.
    pub start: Vec<f64>,
    /// By `q_{n+1}`, shape `n`.
    pub end: Vec<f64>,
    /// By the controls.
    pub controls: Vec<f64>,
    /// By `h`.
    pub step: f64,
}

impl StepGradient {
    /// Zero.
    #[must_use]
    pub fn zero(n: usize, controls: usize) -> Self {
        let (start, end) = (vec![0.0; n], vec![0.0; n]);
        Self { start, end, controls: vec![0.0; controls], step: 0.0 }
    }

    /// Zero again.
    pub fn clear(&mut self) {
        self.start.fill(0.0);
        self.end.fill(0.0);
        self.controls.fill(0.0);
        self.step = 0.0;
    }
}

/// A term of a cost.
pub trait CostTerm: Send + Sync {
    /// What a (sub-)step with these controls costs.
    fn of_step(&self, _s: &Interval, _controls: &[f64]) -> f64 {
        0.0
    }
    /// Adds `scale` times its derivatives.
    fn add_of_step(&self, _s: &Interval, _controls: &[f64], _scale: f64, _out: &mut StepGradient) {}
    /// What the last node costs.
    fn of_end(&self, _end: &State) -> f64 {
        0.0
    }
    /// Adds `scale` times its derivatives by `q_N`, `p̄_N` and the internal variables there.
    fn add_of_end(&self, _end: &State, _scale: f64, _out: &mut Costate) {}
    /// Adds `scale` times its derivatives by forces on the coordinates at the last node, shape `n`,
    /// with the state held: those of the acceleration level.
    fn add_forces_of_end(&self, _end: &State, _scale: f64, _out: &mut [f64]) {}
    /// Adds `scale` times its explicit derivatives by parameters, of a (sub-)step.
    fn add_parameters_of_step(
        &self,
        _s: &Interval,
        _controls: &[f64],
        _scale: f64,
        _out: &mut [f64],
    ) {
    }
    /// The same of the last node.
    fn add_parameters_of_end(&self, _end: &State, _scale: f64, _out: &mut [f64]) {}
    /// Takes note of a node, one after the other, before it counts.
    fn follow(&self, _node: Configuration<'_>, _seen: NotedNode) {}
}

/// What of a node is known beside its state by the steps of order 2 there; what is not is that of
/// the acceleration level.
#[derive(Clone, Copy, Debug, Default)]
pub struct Known<'a> {
    /// `λ` of the step from there, shape `m`.
    pub lambda: Option<&'a [f64]>,
    /// `a` of the steps on both sides, shape `n`.
    pub a: Option<&'a [f64]>,
}

impl Known<'_> {
    /// Nothing.
    pub const STATE: Self = Self { lambda: None, a: None };
}

/// Where derivatives by what is known of a node are added.
#[derive(Debug, Default)]
pub struct ByKnown<'a> {
    /// By `λ`, shape `m`, where it is known.
    pub lambda: &'a mut [f64],
    /// By `a`, shape `n`, where it is known.
    pub a: &'a mut [f64],
    /// By forces on the coordinates, in the place of what is not known; shape `n`, or empty where
    /// that is not wanted.
    pub force: &'a mut [f64],
}

impl ByKnown<'_> {
    /// The same for a while.
    pub fn again(&mut self) -> ByKnown<'_> {
        let Self { lambda, a, force } = self;
        ByKnown { lambda, a, force }
    }
}

/// A term of a node and of what the steps beside it give. As a term of the end it is that of the
/// acceleration level.
pub trait StepTerm: CostTerm {
    /// What a node costs.
    fn of_node(&self, node: &State, known: Known<'_>) -> f64;
    /// Adds `scale` times its derivatives by the state and by what is known, and the explicit ones
    /// by parameters. Returns what the node costs.
    fn add_of_node(
        &self,
        node: (&State, Known<'_>),
        scale: f64,
        slopes: (&mut Costate, ByKnown<'_>),
        parameters: &mut [f64],
    ) -> f64;
    /// What it reads.
    fn reads(&self) -> NodeReads;
}

/// Which terms of steps count at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// All.
    All,
    /// Those that read multipliers.
    OfForces,
    /// Those that read accelerations alone.
    OfAccelerations,
}

/// Terms of nodes of a run of order 2 and of what the steps beside them give, weighted.
#[derive(Default)]
pub struct StepTerms(Vec<(f64, Counted, Box<dyn StepTerm>)>);

impl std::fmt::Debug for StepTerms {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.0.iter().map(|own| own.0)).finish()
    }
}

impl StepTerms {
    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// What any of them reads.
    fn reads(&self) -> NodeReads {
        self.0.iter().fold(NodeReads::default(), |all, (.., term)| all.or(term.reads()))
    }

    /// The terms that count at a node: weight, that of the trapezoidal rule, term.
    fn at(&self, at: NodePlace, which: Which) -> impl Iterator<Item = ([f64; 2], &dyn StepTerm)> {
        let path = NodePlace { is_last: false, ..at };
        let counts = move |term: &dyn StepTerm| match which {
            Which::All => true,
            Which::OfForces => term.reads().forces,
            Which::OfAccelerations => !term.reads().forces,
        };
        let all = self.0.iter().filter(move |(.., term)| counts(&**term));
        let all = all.map(move |(weight, counted, term)| {
            ([at, path].map(|at| weight * counted.weight(at)), &**term)
        });
        all.filter(|(weights, _)| weights[0] != 0.0)
    }

    /// What a node costs by some of them.
    #[must_use]
    pub fn of(&self, which: Which, node: &State, known: Known<'_>, at: NodePlace) -> f64 {
        self.at(at, which).map(|([weight, _], term)| weight * term.of_node(node, known)).sum()
    }

    /// Adds its derivatives as [`StepTerm::add_of_node`] does; returns what it costs, and how much
    /// of that counts along the path.
    pub fn add_of(
        &self,
        node: (&State, Known<'_>),
        (at, which): (NodePlace, Which),
        (of_state, mut of_known): (&mut Costate, ByKnown<'_>),
        parameters: &mut [f64],
    ) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (weights, term) in self.at(at, which) {
            let slopes = (&mut *of_state, of_known.again());
            let cost = term.add_of_node(node, weights[0], slopes, parameters);
            sums.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight * cost);
        }
        sums
    }
}

/// The place of a node in a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodePlace {
    /// What the trapezoidal rule weighs it with, s.
    pub weight: f64,
    /// Whether it is the last one.
    pub is_last: bool,
}

/// Where a term counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counted {
    /// At the last node.
    AtEnd,
    /// At every node, by the trapezoidal rule.
    Along,
}

impl Counted {
    /// The factor at a node.
    fn weight(self, at: NodePlace) -> f64 {
        match self {
            Self::AtEnd => f64::from(u8::from(at.is_last)),
            Self::Along => at.weight,
        }
    }
}

/// Which node of a run is taken note of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotedNode {
    /// The one where the run begins.
    First,
    /// The end of the next step.
    Next,
}

/// A number that a configuration has.
pub trait Quantity: Send + Sync {
    /// The number.
    fn value(&self, at: Configuration<'_>) -> f64;
    /// `out ← out + scale` times its derivative by `q`, shape `n`.
    fn add_slope(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]);
    /// `out ← out + scale D²y v`, shape `n`.
    fn add_bend(&self, at: Motion<'_>, scale: f64, out: &mut [f64]);
    /// `out ← out + scale D³y[v, w]`, shape `n`.
    fn add_third(&self, at: Configuration<'_>, along: [&[f64]; 2], scale: f64, out: &mut [f64]);
    /// `y_θ` of a parameter on which it depends beside `q`.
    fn by_parameter(&self, _parameter: usize, _at: Configuration<'_>) -> f64 {
        0.0
    }
    /// `(∇y)_θ v` of such a parameter.
    fn rate_by_parameter(&self, _parameter: usize, _at: Motion<'_>) -> f64 {
        0.0
    }
    /// Takes note of a node, one after the other, where the number is continued along the motion.
    fn follow(&self, _node: Configuration<'_>, _seen: NotedNode) {}
    /// Whether it is continued: it has a value at the nodes of whole steps alone.
    fn is_continued(&self) -> bool {
        false
    }
}

impl Quantity for JointCoordinate {
    fn value(&self, at: Configuration<'_>) -> f64 {
        self.at(at)
    }
    fn add_slope(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        self.add_gradient(at.q, scale, out);
    }
    fn add_bend(&self, at: Motion<'_>, scale: f64, out: &mut [f64]) {
        JointCoordinate::add_bend(self, at.q, at.v, scale, out);
    }
    fn add_third(&self, at: Configuration<'_>, [v, w]: [&[f64]; 2], scale: f64, out: &mut [f64]) {
        self.emit_third(at.q, v, scale, &mut Product { v: w, out });
    }
}

/// A component of a point, m.
#[derive(Clone, Debug)]
pub struct PointComponent {
    /// The point.
    pub point: Form,
    /// 0, 1 or 2.
    pub axis: usize,
}

impl Quantity for PointComponent {
    fn value(&self, at: Configuration<'_>) -> f64 {
        self.point.at(at.q)[self.axis]
    }
    fn add_slope(&self, _at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        let along = nalgebra::Vector3::ith(self.axis, scale);
        self.point.add_transposed(&along, out);
    }
    fn add_bend(&self, _at: Motion<'_>, _scale: f64, _out: &mut [f64]) {}
    fn add_third(&self, _: Configuration<'_>, _: [&[f64]; 2], _: f64, _: &mut [f64]) {}
}

/// A product of linear forms: a component of a point along an axis of a frame.
impl Quantity for BilinearRow {
    fn value(&self, at: Configuration<'_>) -> f64 {
        BilinearRow::value(self, at.q)
    }
    fn add_slope(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        self.for_each_slope(at.q, |i, slope| out[i] += scale * slope);
    }
    fn add_bend(&self, Motion { v, .. }: Motion<'_>, scale: f64, out: &mut [f64]) {
        self.for_each_bend(v, |i, bend| out[i] += scale * bend);
    }
    fn add_third(&self, _: Configuration<'_>, _: [&[f64]; 2], _: f64, _: &mut [f64]) {}
}

/// `½ Σ h |w|²` of some controls.
#[derive(Clone, Debug, PartialEq)]
pub struct Effort {
    /// Their places; all where there are none.
    pub of: Vec<usize>,
}

impl Effort {
    fn places(&self, count: usize) -> impl Iterator<Item = usize> + '_ {
        (0..count).filter(|k| self.of.is_empty() || self.of.contains(k))
    }
}

impl CostTerm for Effort {
    fn of_step(&self, s: &Interval, w: &[f64]) -> f64 {
        0.5 * s.h * self.places(w.len()).map(|k| w[k] * w[k]).sum::<f64>()
    }
    fn add_of_step(&self, s: &Interval, w: &[f64], scale: f64, out: &mut StepGradient) {
        for k in self.places(w.len()) {
            out.controls[k] += scale * s.h * w[k];
            out.step += 0.5 * scale * w[k] * w[k];
        }
    }
}

/// `Σ h`, s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Time;

impl CostTerm for Time {
    fn of_step(&self, s: &Interval, _: &[f64]) -> f64 {
        s.h
    }
    fn add_of_step(&self, _: &Interval, _: &[f64], scale: f64, out: &mut StepGradient) {
        out.step += scale;
    }
}

/// What a number costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NumberCost {
    /// `½ (y − target)²`.
    Deviation(f64),
    /// `y` itself.
    Itself,
}

impl NumberCost {
    /// What `y` costs.
    #[must_use]
    pub fn cost(self, y: f64) -> f64 {
        match self {
            Self::Deviation(target) => 0.5 * (y - target) * (y - target),
            Self::Itself => y,
        }
    }

    /// Its derivative by `y`.
    #[must_use]
    pub fn slope(self, y: f64) -> f64 {
        match self {
            Self::Deviation(target) => y - target,
            Self::Itself => 1.0,
        }
    }

    /// Its second derivative.
    #[must_use]
    pub fn bend(self) -> f64 {
        match self {
            Self::Deviation(_) => 1.0,
            Self::Itself => 0.0,
        }
    }

    /// Whether it is a number.
    #[must_use]
    pub fn is_finite(self) -> bool {
        match self {
            Self::Deviation(target) => target.is_finite(),
            Self::Itself => true,
        }
    }
}

/// `Σ (h/2) (c(y_n) + c(y_{n+1}))`, the trapezoidal rule.
#[derive(Clone, Debug)]
pub struct Running<Q> {
    /// `y`.
    pub quantity: Q,
    /// `c`.
    pub judged: NumberCost,
}

/// The configuration at an end of a step.
fn at(s: &Interval, end: Slot) -> Configuration<'_> {
    match end {
        Slot::First => s.start(),
        Slot::Second => s.end(),
    }
}

/// Adds `scale y_θ` of all parameters.
fn add_by_parameters(own: &impl Quantity, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
    for (k, sum) in out.iter_mut().enumerate() {
        *sum += scale * own.by_parameter(k, at);
    }
}

impl<Q: Quantity> CostTerm for Running<Q> {
    fn of_step(&self, s: &Interval, _: &[f64]) -> f64 {
        let costs = Slot::BOTH.map(|end| self.judged.cost(self.quantity.value(at(s, end))));
        0.5 * s.h * (costs[0] + costs[1])
    }
    fn add_of_step(&self, s: &Interval, _: &[f64], scale: f64, out: &mut StepGradient) {
        for end in Slot::BOTH {
            let y = self.quantity.value(at(s, end));
            let by = match end {
                Slot::First => &mut out.start,
                Slot::Second => &mut out.end,
            };
            self.quantity.add_slope(at(s, end), 0.5 * scale * s.h * self.judged.slope(y), by);
            out.step += 0.5 * scale * self.judged.cost(y);
        }
    }
    fn add_parameters_of_step(&self, s: &Interval, _: &[f64], scale: f64, out: &mut [f64]) {
        for end in Slot::BOTH {
            let slope = self.judged.slope(self.quantity.value(at(s, end)));
            add_by_parameters(&self.quantity, at(s, end), 0.5 * scale * s.h * slope, out);
        }
    }
}

/// `c(y_N)`.
#[derive(Clone, Debug)]
pub struct Terminal<Q> {
    /// `y`.
    pub quantity: Q,
    /// `c`.
    pub judged: NumberCost,
}

impl<Q: Quantity> CostTerm for Terminal<Q> {
    fn of_end(&self, end: &State) -> f64 {
        self.judged.cost(self.quantity.value(end.configuration()))
    }
    fn add_of_end(&self, end: &State, scale: f64, out: &mut Costate) {
        let slope = self.judged.slope(self.quantity.value(end.configuration()));
        self.quantity.add_slope(end.configuration(), scale * slope, &mut out.q);
    }
    fn add_parameters_of_end(&self, end: &State, scale: f64, out: &mut [f64]) {
        let slope = self.judged.slope(self.quantity.value(end.configuration()));
        add_by_parameters(&self.quantity, end.configuration(), scale * slope, out);
    }
    fn follow(&self, node: Configuration<'_>, seen: NotedNode) {
        self.quantity.follow(node, seen);
    }
}

/// A quantity of the last node itself.
#[derive(Clone, Debug)]
pub struct Last<Q>(
    /// What.
    pub Q,
);

impl<Q: Quantity> CostTerm for Last<Q> {
    fn of_end(&self, end: &State) -> f64 {
        self.0.value(end.configuration())
    }
    fn add_of_end(&self, end: &State, scale: f64, out: &mut Costate) {
        self.0.add_slope(end.configuration(), scale, &mut out.q);
    }
    fn add_parameters_of_end(&self, end: &State, scale: f64, out: &mut [f64]) {
        add_by_parameters(&self.0, end.configuration(), scale, out);
    }
    fn follow(&self, node: Configuration<'_>, seen: NotedNode) {
        self.0.follow(node, seen);
    }
}

/// A weighted sum of terms.
#[derive(Default)]
pub struct Objective {
    terms: Vec<(f64, Box<dyn CostTerm>)>,
    along: Vec<(f64, Box<dyn CostTerm>)>, // φ
    steps: StepTerms,
}

impl std::fmt::Debug for Objective {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let weights: Vec<f64> = self.terms.iter().map(|(weight, _)| *weight).collect();
        f.debug_struct("Objective").field("weights", &weights).finish()
    }
}

impl Objective {
    /// Without terms.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// With one more.
    #[must_use]
    pub fn with(mut self, weight: f64, term: impl CostTerm + 'static) -> Self {
        self.add(weight, Box::new(term));
        self
    }

    /// Adds one.
    pub fn add(&mut self, weight: f64, term: Box<dyn CostTerm>) {
        self.terms.push((weight, term));
    }

    /// Adds the end cost of a term as `φ`: at every node, by the trapezoidal rule.
    pub fn add_along(&mut self, weight: f64, term: Box<dyn CostTerm>) {
        self.along.push((weight, term));
    }

    /// Adds a term of nodes and of the multipliers of the steps from there, those of order 2, and
    /// of their accelerations: those of the steps on both sides, at the last node those of the
    /// acceleration level; at the first node both are of that level.
    pub fn add_step_term(&mut self, weight: f64, counted: Counted, term: Box<dyn StepTerm>) {
        self.steps.0.push((weight, counted, term));
    }

    /// Terms of multipliers and accelerations.
    #[must_use]
    pub fn steps(&self) -> &StepTerms {
        &self.steps
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.terms.is_empty() && self.along.is_empty() && !self.counts_steps()
    }

    /// Whether nodes cost, beside the last one.
    #[must_use]
    pub fn counts_nodes(&self) -> bool {
        !self.along.is_empty() || self.counts_steps()
    }

    /// Whether multipliers or accelerations of steps cost.
    #[must_use]
    pub fn counts_steps(&self) -> bool {
        !self.steps.is_empty()
    }

    /// Whether multipliers of steps cost.
    #[must_use]
    pub fn counts_forces(&self) -> bool {
        self.steps.reads().forces
    }

    /// Whether accelerations by steps cost.
    #[must_use]
    pub fn counts_accelerations(&self) -> bool {
        self.steps.reads().accelerations
    }

    /// Takes note of a node of a run, one after the other, before it counts.
    pub fn follow(&self, node: &State, seen: NotedNode) {
        let all = self.terms.iter().chain(&self.along);
        all.for_each(|(_, term)| term.follow(node.configuration(), seen));
        let steps = self.steps.0.iter();
        steps.for_each(|(.., term)| term.follow(node.configuration(), seen));
    }

    /// `φ` of a node.
    #[must_use]
    pub fn of_node(&self, node: &State) -> f64 {
        self.along.iter().map(|(weight, term)| weight * term.of_end(node)).sum()
    }

    /// Adds `scale` times its derivatives by `q`, by `p̄`, or another momentum of the same
    /// velocity, and by the internal variables.
    pub fn add_of_node(&self, node: &State, scale: f64, out: &mut Costate) {
        self.along.iter().for_each(|(weight, term)| term.add_of_end(node, scale * weight, out));
    }

    /// Adds `scale` times its explicit derivatives by parameters.
    pub fn add_parameters_of_node(&self, node: &State, scale: f64, out: &mut [f64]) {
        let all = self.along.iter();
        all.for_each(|(weight, term)| term.add_parameters_of_end(node, scale * weight, out));
    }

    /// The same by forces on the coordinates of a node, shape `n`, with its state held.
    pub fn add_forces_of_node(&self, node: &State, scale: f64, out: &mut [f64]) {
        let add = |(weight, term): &(f64, Box<dyn CostTerm>)| {
            term.add_forces_of_end(node, scale * weight, out);
        };
        self.along.iter().for_each(add);
    }

    /// The same of the last node.
    pub fn add_forces_of_end(&self, end: &State, out: &mut [f64]) {
        self.terms.iter().for_each(|(weight, term)| term.add_forces_of_end(end, *weight, out));
    }

    /// What a (sub-)step costs.
    #[must_use]
    pub fn of_step(&self, s: &Interval, controls: &[f64]) -> f64 {
        self.terms.iter().map(|(weight, term)| weight * term.of_step(s, controls)).sum()
    }

    /// Adds its derivatives.
    pub fn add_of_step(&self, s: &Interval, controls: &[f64], out: &mut StepGradient) {
        self.terms.iter().for_each(|(weight, term)| term.add_of_step(s, controls, *weight, out));
    }

    /// Adds its explicit derivatives by parameters, of a (sub-)step.
    pub fn add_parameters_of_step(&self, s: &Interval, controls: &[f64], out: &mut [f64]) {
        let add = |(weight, term): &(f64, Box<dyn CostTerm>)| {
            term.add_parameters_of_step(s, controls, *weight, out);
        };
        self.terms.iter().for_each(add);
    }

    /// The same of the last node.
    pub fn add_parameters_of_end(&self, end: &State, out: &mut [f64]) {
        self.terms.iter().for_each(|(weight, term)| term.add_parameters_of_end(end, *weight, out));
    }

    /// What the last node costs.
    #[must_use]
    pub fn of_end(&self, end: &State) -> f64 {
        self.terms.iter().map(|(weight, term)| weight * term.of_end(end)).sum()
    }

    /// Adds its derivatives by `q_N`, `p̄_N` and the internal variables there.
    pub fn add_of_end(&self, end: &State, out: &mut Costate) {
        self.terms.iter().for_each(|(weight, term)| term.add_of_end(end, *weight, out));
    }
}

/// What the nodes of a run cost, one after the other.
#[derive(Clone, Copy, Debug)]
pub struct NodeCost {
    last: f64,
    t: f64,
}

impl NodeCost {
    /// At the node where a run begins.
    #[must_use]
    pub fn of(objective: &Objective, node: &State) -> Self {
        Self { last: objective.of_node(node), t: node.t }
    }

    /// What both nodes of the step to the next one cost, by the trapezoidal rule.
    pub fn step_to(&mut self, objective: &Objective, node: &State) -> f64 {
        let (from, own) = (*self, Self::of(objective, node));
        *self = own;
        0.5 * (own.t - from.t) * (from.last + own.last)
    }
}
