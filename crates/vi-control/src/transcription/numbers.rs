//! Numbers of nodes as functions of the variables.
//!
//! ```text
//! y(q_n)          ∂y/∂ξ_n = Kᵀ ∇y
//! y(q_n, v̂_n)     [M Gᵀ; G 0](v̂_n, μ) = (p̄_n, −g_t),   y_p̄ = ∂y/∂p̄_n, a tangent
//! p̄_n = D_2L_d(q_{n−1}, q_n) + f_{n−1}^+ + (h/2) Σ w_{n−1} ∇θ(q_n)        at the start p(0), which no variable changes
//! ∂y/∂ξ_n     = Kᵀ (y_q + Dᵀ y_p̄ + (h/2) Σ w_{n−1} D²θ y_p̄),      ∂y/∂ξ_{n−1} = Kᵀ Cᵀ y_p̄
//! ∂y/∂w_{n−1} = (h/2) ∇θ·y_p̄,  or y_p̄·f_w^+ of a wrench,          ∂y/∂h = y_p̄·∂p̄_n/∂h
//! ```
//! Multipliers and accelerations are those of the step from the node, which the last one has none
//! of. Second derivatives of numbers with velocities are differences of these slopes, by one
//! coordinate of every other node at once, since each reads two nodes: they steer the method and
//! move no optimum.

use super::Transcription;
use super::derivatives::Sink;
use super::point::Point;
use super::problem::{Acts, CostKind, Problem, ProblemError, Quantity};
use crate::node::{NodeQuantity, Reads};
use crate::objective::{self, Known, Seen};
use crate::program::Undefined;
use crate::terminal_rate::NodeReader;
use vi_constraints::InitialValues;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::coordinate_force::SignedUnknown;
use vi_core::discrete_lagrangian::DiscreteLagrangian as _;
use vi_core::force::DiscreteForce as _;
use vi_core::interval::StepChange;
use vi_core::linear::dot;
use vi_core::sparse::{Block, Entries, Product};
use vi_core::{MechanicalSystem as _, SeparableSystem, Slot, State};
use vi_multibody::Mechanism;
use vi_multibody::joint_coordinate::JointCoordinate;

/// Changes of variables for second derivatives, in parts of their size or of 1.
const CHANGE: f64 = 1e-7;

/// What numbers of nodes with their velocities are read by.
#[derive(Debug)]
pub(super) struct Velocities {
    reader: NodeReader,
    /// Of controls along unknowns, those.
    coordinates: Vec<Option<JointCoordinate>>,
}

/// The coordinate that an unknown of the tree is; `None` of rotation vectors and free places.
fn coordinate(mechanism: &Mechanism, unknown: SignedUnknown) -> Option<JointCoordinate> {
    let own = |k: usize| unknown.index.checked_sub(k);
    let mut links = mechanism.tree().links().iter();
    let link = links.find(|link| own(link.offset).is_some_and(|k| k < link.dof()))?;
    JointCoordinate::principal(&link.joint, own(link.offset)?)
}

impl Velocities {
    /// Of a problem; `None` where no number reads a velocity.
    ///
    /// # Errors
    /// [`ProblemError`] of numbers that a node and the step to it do not give.
    pub(super) fn of(
        mechanism: &Mechanism,
        system: &SeparableSystem,
        at: InitialValues<'_>,
        problem: &Problem,
    ) -> Result<Option<Self>, ProblemError> {
        let (mut any, free) = (false, problem.time.is_free());
        for (name, quantity) in problem.numbers() {
            let Quantity::Node(own) = quantity else { continue };
            any = true;
            let what = match own.reads() {
                Reads { accelerations: true, .. } => "accelerations, which controls change as well",
                Reads { forces: true, .. } => "multipliers of the step from the node",
                _ if free && own.reads_time() => "the time, and the final time is free",
                _ => continue,
            };
            return Err(ProblemError::Reads(name.to_owned(), what));
        }
        if !any {
            return Ok(None);
        }
        let rows = IndependentRows::find_generic(mechanism, at.t, at.q);
        let rows = rows.map_err(|_| ProblemError::NotCovered("velocities at a singular start"))?;
        let mut state = State::new(at.t, at.q.to_vec(), vec![0.0; at.q.len()]);
        system.mass().mul_add(1.0, at.v, &mut state.p);
        let coordinates = problem.controls.iter().map(|control| match control.acts {
            Acts::Along(unknown) => match coordinate(mechanism, unknown) {
                None => Err(ProblemError::NotCovered("velocities beside efforts of ball joints")),
                found => Ok(found),
            },
            Acts::Wrench(_) => Ok(None),
        });
        let coordinates = coordinates.collect::<Result<_, _>>()?;
        let reader = NodeReader::at(mechanism, system, (&rows, &state), &[], None)?;
        Ok(Some(Self { reader, coordinates }))
    }
}

impl Transcription {
    /// The motion at `x`, along which numbers are continued.
    pub(super) fn followed_at(&self, x: &[f64]) -> Result<Point, Undefined> {
        let point = self.point_at(x)?;
        self.follow(&point);
        Ok(point)
    }

    /// Takes note of the nodes, where numbers are continued along the motion.
    pub(super) fn follow(&self, point: &Point) {
        for (_, quantity) in self.problem.numbers() {
            for n in 0..=self.parts.count() {
                let seen = if n == 0 { Seen::First } else { Seen::Next };
                let at = point.configuration(n);
                match quantity {
                    Quantity::Joint { .. } => {}
                    Quantity::Configuration(own) => own.follow(at, seen),
                    Quantity::Node(own) => own.follow(at, seen),
                }
            }
        }
    }

    /// A number at a node.
    pub(super) fn quantity(&self, point: &Point, quantity: &Quantity, n: usize) -> f64 {
        match quantity {
            Quantity::Joint { unknown, start } => {
                start + unknown.sign * self.traveled(&point.x, n, unknown.index)
            }
            Quantity::Configuration(own) => own.value(point.configuration(n)),
            Quantity::Node(own) => {
                let read = |all: &Velocities| {
                    all.reader.value(&**own, &self.state(point, n), Known::State)
                };
                self.velocities.as_ref().map_or(f64::NAN, read)
            }
        }
    }

    /// Whether the numbers of conditions and costs have values and slopes at a point: a distance
    /// has none where the points meet.
    pub(super) fn exists(&self, point: &Point) -> bool {
        let exists = |quantity: &Quantity, n: usize| {
            let slopes = match quantity {
                Quantity::Configuration(_) => self.quantity_slope(point, quantity, n),
                _ => Vec::new(),
            };
            let value = self.quantity(point, quantity, n);
            value.is_finite() && slopes.iter().all(|(_, slope)| slope.is_finite())
        };
        let mut conditions = self.layout.conditions.iter();
        let of_costs = self.problem.costs.iter().all(|cost| match &cost.kind {
            CostKind::Deviation { quantity, when, .. } => {
                let mut counted = self.counted(*when, point.h).into_iter();
                counted.all(|(n, ..)| exists(quantity, n))
            }
            _ => true,
        });
        let of = |condition: usize| &self.problem.conditions[condition].quantity;
        of_costs && conditions.all(|own| exists(of(own.condition), own.node))
    }

    /// A node with `p̄_n`.
    fn state(&self, point: &Point, n: usize) -> State {
        let at = point.configuration(n);
        let mut p = self.start_momentum.clone();
        if let Some(step) = n.checked_sub(1) {
            let s = &point.intervals[step];
            self.system.forced_d2(s, &mut p);
            point.wrenches[step].iter().for_each(|load| load.add_plus(s, &mut p));
            for (value, own) in self.efforts_of(point, step) {
                own.add_gradient(at.q, 0.5 * s.h * value, &mut p); // [5.11]
            }
        }
        let state = State::new(at.t, at.q.to_vec(), p);
        State { angles: at.angles.to_vec(), ..state }
    }

    /// Controls along unknowns in a step: their efforts along coordinates that grow with these.
    fn efforts_of<'a>(
        &'a self,
        point: &'a Point,
        step: usize,
    ) -> impl Iterator<Item = (f64, &'a JointCoordinate)> {
        let all = self.velocities.iter().flat_map(|own| &own.coordinates);
        self.efforts().filter_map(move |(k, along)| {
            let own = all.clone().nth(k)?.as_ref()?;
            Some((along.sign * point.x[self.acting(k, step)], own))
        })
    }

    /// `∇y·K_j` of a number of the configuration at a node.
    pub(super) fn number_along(
        &self,
        point: &Point,
        n: usize,
        own: &dyn objective::Quantity,
    ) -> Vec<f64> {
        let mut slope = vec![0.0; self.n];
        own.add_slope(point.configuration(n), 1.0, &mut slope);
        point.along_columns(n, &slope)
    }

    /// The derivatives of a number at a node by the variables, always by the same ones.
    pub(super) fn quantity_slope(
        &self,
        point: &Point,
        quantity: &Quantity,
        n: usize,
    ) -> Vec<(usize, f64)> {
        let Some(at) = self.layout.coordinate(n) else { return Vec::new() };
        let place = |slope: Vec<f64>| (at..).zip(slope).collect();
        match quantity {
            Quantity::Joint { unknown, .. } => vec![(at + unknown.index, unknown.sign)],
            Quantity::Configuration(own) => place(self.number_along(point, n, &**own)),
            Quantity::Node(own) => self.node_slope(point, &**own, n),
        }
    }

    fn node_slope(&self, point: &Point, own: &dyn NodeQuantity, n: usize) -> Vec<(usize, f64)> {
        let (Some(all), Some(step)) = (&self.velocities, n.checked_sub(1)) else {
            return Vec::new();
        };
        let (s, state) = (&point.intervals[step], self.state(point, n));
        let [mut of_q, mut of_p, mut of_last] = [(); 3].map(|()| vec![0.0; self.n]);
        let slopes = [&mut of_q[..], &mut of_p, &mut []];
        all.reader.add_slopes((own, &|_| 1.0), (&state, Known::State), slopes, &mut []);
        let pull = |emit: &dyn Fn(&mut dyn Entries), out: &mut [f64]| {
            let into = &mut Product { v: &of_p, out };
            emit(&mut Block { into, row: 0, column: 0, scale: 1.0, transposed: true });
        };
        let wrenches = &point.wrenches[step];
        pull(&|out| self.system.forced_d2_d2(s, out), &mut of_q);
        pull(&|out| self.system.forced_d1_d2(s, out), &mut of_last);
        for load in wrenches {
            pull(&|out| load.add_slope(s, Slot::Second, Slot::Second, out), &mut of_q);
            pull(&|out| load.add_slope(s, Slot::Second, Slot::First, out), &mut of_last);
        }
        for (value, own) in self.efforts_of(point, step) {
            own.add_bend(&state.q, &of_p, 0.5 * s.h * value, &mut of_q);
        }
        let mut slopes = Vec::new();
        for (node, slope) in [(n, of_q), (step, of_last)] {
            if let Some(at) = self.layout.coordinate(node) {
                slopes.extend((at..).zip(point.along_columns(node, &slope)));
            }
        }
        let mut by_step = self.momentum_by_step(point, step, &of_p);
        for ((k, along), (value, own)) in self.efforts().zip(self.efforts_of(point, step)) {
            let rate = 0.5 * own.rate(&state.q, &of_p);
            slopes.push((self.acting(k, step), along.sign * s.h * rate));
            by_step += self.parts.gamma(step) * value * rate;
        }
        for (k, load) in self.wrenches() {
            let impulse = dot(&load.half_impulse(s, &state.q), load.of_frame(&of_p));
            slopes.push((self.acting(k, step), impulse));
        }
        for load in wrenches {
            by_step += dot(&load.half_impulse(s, &state.q), load.of_frame(&of_p)) / point.h;
        }
        slopes.extend(self.layout.time.map(|time| (time, by_step / self.problem.steps as f64)));
        slopes
    }

    /// The numbers of nodes with their velocities that count, with their nodes and their factors in
    /// the Lagrangian `factor f + λᵀ g`.
    fn factors<'a>(
        &'a self,
        point: &Point,
        (factor, lambda): (f64, &[f64]),
    ) -> Vec<(usize, &'a Quantity, f64)> {
        let mut all = Vec::new();
        for placed in &self.layout.conditions {
            let own = &self.problem.conditions[placed.condition].quantity;
            all.push((placed.node, own, lambda[placed.row]));
        }
        for cost in &self.problem.costs {
            let CostKind::Deviation { quantity, target, when } = &cost.kind else { continue };
            for (n, part, _) in self.counted(*when, point.h) {
                let e = self.quantity(point, quantity, n) - target;
                all.push((n, quantity, factor * cost.weight * part * e));
            }
        }
        all.retain(|(_, own, _)| matches!(own, Quantity::Node(_)));
        all
    }

    /// Variables of which each number of a node reads one at most, each with its change.
    fn apart(&self, x: &[f64]) -> Vec<Vec<(usize, f64)>> {
        let change = |at: usize| (at, CHANGE * (1.0 + x[at].abs()));
        let coordinates = |first: usize, j: usize| {
            let nodes = (first..=self.parts.count()).step_by(2);
            nodes.filter_map(|n| Some(change(self.layout.coordinate(n)? + j))).collect()
        };
        let d = self.chart.dof();
        let mut sets: Vec<Vec<_>> = (0..2 * d).map(|k| coordinates(1 + k / d, k % d)).collect();
        let controls = 0..self.problem.controls.len();
        let values = |k: usize| self.layout.values(k).iter().map(|at| change(*at)).collect();
        sets.extend(controls.map(values));
        sets.extend(self.layout.time.map(|time| vec![change(time)]));
        sets
    }

    /// Emits `Σ c ∇²y` of numbers with velocities, `c`: their factors.
    pub(super) fn emit_curvature(&self, point: &Point, factors: (f64, &[f64]), out: &mut Sink<'_>) {
        let numbers = self.factors(point, factors);
        if numbers.is_empty() {
            return;
        }
        let slopes = |at: &Point| -> Vec<Vec<(usize, f64)>> {
            numbers.iter().map(|(n, own, _)| self.quantity_slope(at, own, *n)).collect()
        };
        let here = slopes(point);
        for set in self.apart(&point.x) {
            let mut x = point.x.clone();
            set.iter().for_each(|(at, change)| x[*at] += change);
            let there = self.point_at(&x).map_or_else(|_| here.clone(), |moved| slopes(&moved));
            for ((from, to), (_, _, factor)) in here.iter().zip(&there).zip(&numbers) {
                let Some((of, change)) =
                    set.iter().find(|(of, _)| from.iter().any(|own| own.0 == *of))
                else {
                    continue;
                };
                for ((at, slope), (_, moved)) in from.iter().zip(to) {
                    let both = if at == of { 1.0 } else { 0.5 }; // each of two entries
                    out(*at, *of, both * factor * (moved - slope) / change);
                }
            }
        }
    }

    /// `y_p̄·∂(D_2L_d + f^+)/∂h` without controls; zero where the time is given.
    fn momentum_by_step(&self, point: &Point, step: usize, of_p: &[f64]) -> f64 {
        if self.layout.time.is_none() {
            return 0.0;
        }
        let (s, mut change) = (&point.intervals[step], vec![0.0; self.n]);
        // nothing depends on the time itself
        let by = StepChange { length: self.parts.gamma(step), middle: 0.0 };
        match self.system.add_step_slope(s, Slot::Second, by, &mut change) {
            Ok(()) => dot(&change, of_p),
            Err(_) => f64::NAN,
        }
    }
}
