//! Discrete mechanics and optimal control: the steps of a motion as equations of a nonlinear
//! program.
//!
//! ```text
//! minimise  f(q_1 … q_N, w_0 … w_{N−1}, T)      over  q_n = F(ξ_n, q̂_n) on the tree,  w_n,  hλ_n,  T = N h
//! n = 0      P(q_0)ᵀ [ p(0) + D_1L_d(q_0, q_1) + f_0^- − G_c(q_0)ᵀ hλ_0 ] = 0                         momentum of the start
//! 0 < n < N  P(q_n)ᵀ [ D_2L_d(q_{n−1}, q_n) + f_{n−1}^+ + D_1L_d(q_n, q_{n+1}) + f_n^- − G_c(q_n)ᵀ hλ_n ] = 0      (28)
//! n = N      P(q_N)ᵀ [ D_2L_d(q_{N−1}, q_N) + f_{N−1}^+ − G_c(q_N)ᵀ hλ_N ] = 0        rest, where it is asked for, (42)
//! g_c(q_n) = 0 of closed loops;    bounds of coordinates, numbers of nodes and controls
//! ```
//! Joints of the tree hold in every iterate, closed loops at the optimum. A step has `d` unknown
//! coordinates, `d` equations and the controls. Letters: `ξ` coordinates of a chart about a
//! reference `q̂` ([`chart`]), `g_c` independent closures, `hλ` their impulses, `w` controls.
//!
//! Above order 2 nodes and steps of these equations are those of the sub-steps `γ_i h` of a
//! composition [2.20], or nodes the control points of Galerkin steps, with `w_i` of [2.26];
//! controls are constant over whole steps, conditions are those of the nodes where these meet.
//!
//! Source: S. Leyendecker, S. Ober-Blöbaum, J. E. Marsden, M. Ortiz, Optim. Control Appl. Meth. 31
//! (2010) 505–528; S. Ober-Blöbaum, O. Junge, J. E. Marsden, ESAIM COCV 17 (2011) 322–352.

pub mod chart;
mod closure;
mod derivatives;
mod division;
mod guess;
mod layout;
mod numbers;
mod piece;
mod point;
mod prices;
pub mod problem;
mod reach;

use crate::program::{Bounds, MethodStart, Multipliers, Program, Undefined};
use chart::{Chart, ReferenceConfiguration};
use closure::TreeClosure;
use division::Division;
use guess::references;
pub use guess::{Guess, GuessPath};
use layout::{Layout, MechanismCounts, is_bound};
use nalgebra::DMatrix;
use numbers::NumberVelocities;
use point::EvaluatedPoint;
pub use prices::{Met, PriceOfRest, PriceSize, Resting, TurnPrice};
use problem::{
    Acts, Control, ControlProblem, FinalTime, NodeNumber, ProblemError, RestAtEnd, Uncovered, When,
};
use std::sync::Arc;
use vi_constraints::null_space::NullSpaceQr;
use vi_constraints::setup::SetupError;
use vi_constraints::{Constraints as _, InitialValues, OrderMethod};
use vi_core::sparse::SparseMatrix;
use vi_core::{Configuration, MechanicalSystem, SeparableSystem};
use vi_multibody::Mechanism;
use vi_multibody::joint_coordinate::JointCoordinate;

/// Bound of the second of three rotations of a chart about its reference, rad: at `π/2` the chart
/// ends.
const CHART: f64 = 1.2;

/// A start this near to a bound is at it, in parts of its value, 1 at least.
const ROUNDED: f64 = 1e-9;

/// A problem of optimal control of a mechanism as a nonlinear program.
#[derive(Debug)]
pub struct Transcription {
    chart: Chart,
    mechanism: Mechanism,
    system: Arc<SeparableSystem>,
    mass: SparseMatrix,
    weight: Vec<f64>, // n  the sum of constant forces
    has_other: bool,
    acts: bool, // whether anything does but constant forces
    n: usize,
    problem: ControlProblem,
    division: Division,
    layout: Layout,
    start_time: f64,
    start_angles: Vec<f64>,
    velocities: Option<NumberVelocities>,
    coordinates: Vec<Option<JointCoordinate>>, // of controls along unknowns
    start_momentum: Vec<f64>,                  // n
    along_starts: Vec<f64>,                    // coordinates of efforts along unknowns at the start
    references: Vec<ReferenceConfiguration>,   // of nodes 0 … N s
    travel: Vec<Vec<f64>>, // of references: what coordinates that add up have changed by
    closures: Vec<TreeClosure>, // independent
    turning: Vec<usize>,   // angles whose turns are bounded
    middle: Vec<usize>,    // second rotations of charts
    resting: Vec<usize>,   // unknowns without momentum at the end
    start: Vec<f64>,       // of the program
    jacobian_places: Vec<(usize, usize)>,
    hessian_places: Vec<(usize, usize)>,
    point: Option<EvaluatedPoint>,
}

/// A point of a program with its multipliers, from which a method goes on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HeldPoint {
    /// `N`.
    pub steps: usize,
    /// All nodes, those within steps as well, each of shape `n`.
    pub nodes: Vec<Vec<f64>>,
    /// What coordinates that add up have changed by at each of these, shape `d`.
    pub travel: Vec<Vec<f64>>,
    /// The variables, with the nodes as references: `ξ` is zero.
    pub x: Vec<f64>,
    /// Its multipliers.
    pub multipliers: Multipliers,
}

/// A motion that a program was solved for.
#[derive(Clone, Debug, PartialEq)]
pub struct SolvedMotion {
    /// `h`, s.
    pub step: f64,
    /// How the order of the steps is reached.
    pub method: OrderMethod,
    /// `q_0 … q_N`, each of shape `n`.
    pub nodes: Vec<Vec<f64>>,
    /// Of each step, the nodes between its sub-steps, or its inner control points, each of shape
    /// `n`.
    pub within: Vec<Vec<Vec<f64>>>,
    /// Of each step, the value of each control, N or N·m.
    pub controls: Vec<Vec<f64>>,
    /// Of each term, weighted.
    pub costs: Vec<f64>,
    /// What the coordinates of the tree that add up have changed by since the start, at each node,
    /// shape `d`; of rotation vectors without meaning.
    pub travel: Vec<Vec<f64>>,
}

impl SolvedMotion {
    /// All nodes, in their order.
    pub fn all_nodes(&self) -> impl Iterator<Item = &[f64]> {
        let within = self.within.iter().map(Vec::as_slice).chain(std::iter::once(&[][..]));
        let step = |(node, within)| std::iter::once(node).chain(within);
        self.nodes.iter().zip(within).flat_map(step).map(Vec::as_slice)
    }
}

impl Transcription {
    /// The program of a problem from a start of the motion, with the forces of `system` beside the
    /// controls.
    ///
    /// # Errors
    /// [`ProblemError`].
    pub fn new(
        mechanism: &Mechanism,
        system: Arc<SeparableSystem>,
        at: InitialValues<'_>,
        problem: ControlProblem,
        guess: &Guess,
    ) -> Result<Self, ProblemError> {
        problem.check()?;
        check_mechanism(mechanism, &system, at, &problem)?;
        let n = at.q.len();
        let chart = Chart::new(mechanism, n);
        let closures = independent(mechanism, &chart, at)?;
        if problem.time.is_free() && closures.iter().any(TreeClosure::is_of_time) {
            return Err(ProblemError::NotCovered(Uncovered::MotionInTime));
        }
        let division = Division::new(problem.method, problem.steps);
        let (references, travel) =
            references(&chart, mechanism, at.q, &closures, &division, guess)?;
        if !closures.is_empty() && matches!(problem.rest, RestAtEnd::Unknowns(_)) {
            return Err(ProblemError::NotCovered(Uncovered::RestInLoop));
        }
        let (turning, middle) = angles(mechanism);
        let bounded = problem.max_increment.is_finite();
        let turning = if bounded { turning } else { Vec::new() };
        let d = chart.dof();
        let counts = MechanismCounts { tree: d, closures: closures.len(), turning: turning.len() };
        let layout = Layout::new(&problem, &division, counts);
        let along_starts = along_starts(&system, at, &problem)?;
        let coordinate = |unknown| numbers::coordinate(mechanism, unknown);
        let coordinates = problem.controls.iter().map(|control| match control.acts {
            Acts::Along(unknown) => coordinate(unknown),
            Acts::Wrench(_) => None,
        });
        let coordinates: Vec<_> = coordinates.collect();
        let is_effort = |control: &Control| matches!(control.acts, Acts::Along(_));
        let mut efforts = problem.controls.iter().zip(&coordinates);
        if efforts.any(|(own, coordinate)| is_effort(own) && coordinate.is_none()) {
            // charts turn these about themselves: no torque belongs to one of their coordinates
            return Err(ProblemError::NotCovered(Uncovered::NoCoordinate));
        }
        let velocities = NumberVelocities::of(mechanism, &system, at, &problem)?;
        let mut start_momentum = vec![0.0; n];
        system.mass().mul_add(1.0, at.v, &mut start_momentum);
        let resting = match &problem.rest {
            RestAtEnd::Free => Vec::new(),
            RestAtEnd::All => (0..d).collect(),
            RestAtEnd::Unknowns(some) => some.clone(),
        };
        let mut transcription = Self {
            mass: system.mass().clone(),
            weight: system.constant_force(),
            has_other: system.has_other_forces(&[]),
            acts: system.has_variable_forces(),
            n,
            layout,
            start_time: at.t,
            start_angles: mechanism.principal_angles(at.q),
            velocities,
            coordinates,
            mechanism: mechanism.clone(),
            start_momentum,
            along_starts,
            references,
            travel,
            closures,
            turning,
            middle,
            resting,
            start: Vec::new(),
            jacobian_places: Vec::new(),
            hessian_places: Vec::new(),
            point: None,
            chart,
            system,
            problem,
            division,
        };
        transcription.start = transcription.begin(guess);
        transcription.find_places();
        transcription.begins_within()?;
        Ok(transcription)
    }

    /// Whether conditions along the path hold at the start, which no variable changes.
    fn begins_within(&self) -> Result<(), ProblemError> {
        let Ok(point) = self.followed_at(&self.start) else { return Ok(()) };
        let paths = self.problem.conditions.iter().enumerate();
        for (condition, own) in paths.filter(|(_, own)| own.when == When::Path) {
            let (value, [min, max]) = (self.quantity(&point, &own.quantity, 0), own.bounds);
            let beyond = (min - value).max(value - max);
            if beyond > ROUNDED * f64::max(1.0, value.abs()) {
                return Err(ProblemError::Start { condition, name: own.name.clone(), value });
            }
        }
        Ok(())
    }

    /// The point of a program that a guess is.
    fn begin(&self, guess: &Guess) -> Vec<f64> {
        let mut x = vec![0.0; self.layout.variables];
        if let (Some(at), time) = (self.layout.time, self.problem.time.guess()) {
            x[at] = time;
        }
        for (n, values) in guess.controls.iter().enumerate() {
            for (k, value) in values.iter().enumerate() {
                x[self.layout.control(k, n)] = *value;
            }
        }
        for (k, own) in self.problem.controls.iter().enumerate() {
            let Some(knots) = self.layout.knots[k] else { continue };
            for n in 0..self.problem.steps {
                let value = x[self.layout.control(k, n)];
                own.knots(n).into_iter().for_each(|(knot, _)| x[knots.variable + knot] = value);
            }
        }
        x
    }

    fn find_places(&mut self) {
        let Ok(point) = self.followed_at(&self.start) else { return };
        let (mut jacobian, mut hessian) = (Vec::new(), Vec::new());
        self.emit_jacobian(&point, &mut |row, column, _| jacobian.push((row, column)));
        let lambda = vec![0.0; self.layout.rows];
        self.emit_hessian(&point, 1.0, &lambda, &mut |row, column, _| hessian.push((row, column)));
        (self.jacobian_places, self.hessian_places) = (jacobian, hessian);
    }

    /// Where a method starts.
    #[must_use]
    pub fn start(&self) -> MethodStart {
        MethodStart { x: self.start.clone(), ..MethodStart::default() }
    }

    /// The problem.
    #[must_use]
    pub fn problem(&self) -> &ControlProblem {
        &self.problem
    }

    /// Whether a closure acts at the end.
    fn acts_at_end(&self) -> bool {
        self.problem.rest == RestAtEnd::All
    }

    /// The motion at a point.
    ///
    /// # Errors
    /// [`Undefined`].
    pub fn motion(&self, x: &[f64]) -> Result<SolvedMotion, Undefined> {
        let point = self.followed_at(x)?;
        let controls = (0..self.problem.steps)
            .map(|n| {
                (0..self.problem.controls.len()).map(|k| x[self.layout.control(k, n)]).collect()
            })
            .collect();
        let travel = (0..=self.problem.steps).map(|n| self.traveled_at(x, self.division.node(n)));
        let travel = travel.collect();
        let (costs, step, method) = (self.costs(&point), point.h, self.problem.method);
        let (mut nodes, mut within) = (Vec::new(), vec![Vec::new(); self.problem.steps]);
        for (k, node) in point.nodes.into_iter().enumerate() {
            match self.division.starting(k) {
                Some(_) => nodes.push(node.placed.q),
                None => within[self.division.step(k)].push(node.placed.q),
            }
        }
        Ok(SolvedMotion { step, method, nodes, within, controls, costs, travel })
    }

    /// What the coordinates that add up have changed by at a node, shape `d`.
    fn traveled_at(&self, x: &[f64], n: usize) -> Vec<f64> {
        (0..self.chart.dof()).map(|j| self.traveled(x, n, j)).collect()
    }

    /// Whether the chart of a node is near its end at a point: [`Transcription::move_references`]
    /// and solve again.
    #[must_use]
    pub fn leaves_chart(&self, x: &[f64]) -> bool {
        let turned =
            |n: usize, j: usize| self.layout.coordinate(n).map_or(0.0, |at| x[at + j].abs());
        (1..=self.division.last()).any(|n| self.middle.iter().any(|&j| turned(n, j) > 0.9 * CHART))
    }

    /// Puts the references of the charts on the nodes at a point, which becomes the start; the
    /// other variables keep their values.
    ///
    /// # Errors
    /// [`Undefined`].
    pub fn move_references(&mut self, x: &[f64]) -> Result<(), Undefined> {
        let held = self.held(x, &Multipliers::default())?;
        self.refer_to(&held);
        Ok(())
    }

    /// A point, to go on from.
    ///
    /// # Errors
    /// [`Undefined`].
    pub fn held(&self, x: &[f64], multipliers: &Multipliers) -> Result<HeldPoint, Undefined> {
        let motion = self.motion(x)?;
        let last = self.division.last();
        let mut held = HeldPoint {
            steps: self.problem.steps,
            nodes: motion.all_nodes().map(<[f64]>::to_vec).collect(),
            travel: (0..=last).map(|n| self.traveled_at(x, n)).collect(),
            x: x.to_vec(),
            multipliers: multipliers.clone(),
        };
        for at in (1..=last).filter_map(|n| self.layout.coordinate(n)) {
            held.x[at..at + self.chart.dof()].fill(0.0);
        }
        Ok(held)
    }

    /// Puts references and start onto a point that was held, of the same problem; false where it is
    /// of another one.
    #[must_use]
    pub fn goes_on(&mut self, held: &HeldPoint) -> bool {
        let (count, d) = (self.division.last() + 1, self.chart.dof());
        let of = |rows: &[Vec<f64>], size: usize| {
            rows.len() == count && rows.iter().all(|row| row.len() == size)
        };
        let Multipliers { rows, lower, upper } = &held.multipliers;
        let shapes = [held.x.len(), lower.len(), upper.len(), rows.len()];
        let n = self.layout.variables;
        let fits = held.steps == self.problem.steps
            && of(&held.nodes, self.n)
            && of(&held.travel, d)
            && shapes == [n, n, n, self.layout.rows];
        if fits {
            self.refer_to(held);
        }
        fits
    }

    fn refer_to(&mut self, held: &HeldPoint) {
        self.references = held.nodes.iter().map(|q| self.chart.reference(q)).collect();
        self.travel.clone_from(&held.travel);
        self.start.clone_from(&held.x);
        self.point = None;
    }

    /// `out ← g`.
    fn row_values_at(&self, point: &EvaluatedPoint, out: &mut [f64]) {
        let d = self.chart.dof();
        let mut residual = vec![0.0; d];
        for n in 0..=self.division.last() {
            self.residual(point, n, &mut residual);
            for (row, j) in self.balances_at(n) {
                out[row] = residual[j];
            }
            if n > 0 {
                for (k, own) in self.closures.iter().enumerate() {
                    out[self.layout.closure(n) + k] = self.closure_value(point, n, own);
                }
            }
        }
        for n in 0..self.division.last() {
            for (k, &j) in self.turning.iter().enumerate() {
                let own = |n: usize| self.layout.coordinate(n).map_or(0.0, |at| point.x[at + j]);
                out[self.layout.turn(n) + k] = own(n + 1) - own(n);
            }
        }
        for placed in &self.layout.conditions {
            let quantity = &self.problem.conditions[placed.condition].quantity;
            out[placed.row] = self.quantity(point, quantity, placed.node);
        }
        self.layout.knots.iter().flatten().for_each(|own| {
            out[own.row..own.row + self.problem.steps].fill(0.0);
        });
        self.for_each_knot(|row, at, weight| out[row] += weight * point.x[at]);
    }

    fn at(&self) -> &EvaluatedPoint {
        let point = self.point.as_ref().expect("the program was moved to a point");
        self.follow(point);
        point
    }
}

/// What the transcription does not cover.
fn check_mechanism(
    mechanism: &Mechanism,
    system: &SeparableSystem,
    at: InitialValues<'_>,
    problem: &ControlProblem,
) -> Result<(), ProblemError> {
    let description = mechanism.description();
    if !description.particles.is_empty() {
        return Err(ProblemError::NotCovered(Uncovered::Particles));
    }
    if mechanism.has_nodes() {
        return Err(ProblemError::NotCovered(Uncovered::Beams));
    }
    if system.places_of_signals().len() + system.variables_of_forces() > 0
        || !system.variables_of_potentials(&[]).is_empty()
        || system.has_memory()
    {
        return Err(ProblemError::NotCovered(Uncovered::Memory));
    }
    let gammas = problem.method.composition().gammas();
    if system.is_dissipative() && gammas.iter().any(|gamma| *gamma < 0.0) {
        return Err(ProblemError::Method(SetupError::DissipativeComposition));
    }
    if problem.time.is_free() {
        let divided = matches!(problem.method, OrderMethod::Composition(_));
        let times = sampled(at, problem);
        let places = [1.0, 2.0, 3.0].map(|seed| near(at, seed));
        if let Some(source) = system.first_of_time(&places, &times, divided) {
            return Err(ProblemError::NotCovered(Uncovered::ForceInTime(source.clone())));
        }
    }
    let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
    let numbers = description.bodies.iter().all(|body| finite(body.center.as_slice()));
    if numbers { Ok(()) } else { Err(ProblemError::NotANumber("start".to_owned())) }
}

/// The closures that do not follow from others at a configuration.
fn independent(
    mechanism: &Mechanism,
    chart: &Chart,
    at: InitialValues<'_>,
) -> Result<Vec<TreeClosure>, ProblemError> {
    let rows = mechanism.loop_constraints().into_iter();
    let rows =
        rows.map(|row| TreeClosure::of(row, mechanism, at.t)).collect::<Result<Vec<_>, _>>()?;
    if rows.is_empty() {
        return Ok(rows);
    }
    let reference = chart.reference(at.q);
    let columns = chart.columns(&chart.place(&reference, &vec![0.0; chart.dof()]));
    let mut slopes = DMatrix::zeros(rows.len(), chart.dof()); // G_c P
    for (k, own) in rows.iter().enumerate() {
        match own {
            TreeClosure::Product(row) => row.for_each_slope(reference.q(), |i, slope| {
                for j in 0..chart.dof() {
                    slopes[(k, j)] += slope * columns[(i, j)];
                }
            }),
            TreeClosure::Along(own) => {
                own.slope(chart.dof())
                    .into_iter()
                    .enumerate()
                    .for_each(|(j, f)| slopes[(k, j)] += f);
            }
        }
    }
    // rows that vanish but for rounding say nothing by their own length
    let mut qr = NullSpaceQr::new(chart.dof(), rows.len());
    let rank = qr.factorize_scaled(&slopes, |_| 1.0);
    let mut chosen = qr.pivots()[..rank].to_vec();
    chosen.sort_unstable();
    let of = rows.into_iter().enumerate();
    Ok(of.filter(|(k, _)| chosen.binary_search(k).is_ok()).map(|(_, own)| own).collect())
}

/// The angles of the tree that add up, and the second rotations of rotation vectors.
fn angles(mechanism: &Mechanism) -> (Vec<usize>, Vec<usize>) {
    let (mut turning, mut middle) = (Vec::new(), Vec::new());
    for link in mechanism.tree().links() {
        let kind = link.joint.kind;
        let vector = kind.rotation_vector();
        middle.extend(vector.map(|k| link.offset + k + 1));
        let adds_up = |k: &usize| kind.is_angle(*k) && vector.is_none();
        turning.extend((0..link.dof()).filter(adds_up).map(|k| link.offset + k));
    }
    (turning, middle)
}

/// Times at which what changes with the time itself shows.
fn sampled(at: InitialValues<'_>, problem: &ControlProblem) -> Vec<f64> {
    const COUNT: u32 = 64;
    let last = match problem.time {
        FinalTime::Free { max, .. } => max,
        FinalTime::Fixed(time) => time,
    };
    let part = |k: u32| at.t + f64::from(k) / f64::from(COUNT) * last;
    (0..=COUNT).map(part).collect()
}

/// A place near the start with any velocity.
fn near(at: InitialValues<'_>, seed: f64) -> [Vec<f64>; 2] {
    let any = |i: usize, seed: f64| libm::sin(seed * (1 + i * i) as f64);
    let q = at.q.iter().enumerate().map(|(i, q)| q + 0.1 * any(i, seed)).collect();
    [q, (0..at.q.len()).map(|i| any(i, seed + 0.5)).collect()]
}

/// The coordinates of efforts along unknowns at the start.
fn along_starts(
    system: &SeparableSystem,
    at: InitialValues<'_>,
    problem: &ControlProblem,
) -> Result<Vec<f64>, ProblemError> {
    let start = Configuration::new(at.t, at.q);
    let mut starts = Vec::new();
    for own in system.along_unknowns() {
        let theta = own.force.coordinate(start);
        let at_time = |t: f64| own.force.effort(t, theta, 0.0).to_bits();
        let times = sampled(at, problem);
        if problem.time.is_free() && times.iter().any(|t| at_time(*t) != at_time(at.t)) {
            return Err(ProblemError::NotCovered(Uncovered::EffortInTime));
        }
        starts.push(theta);
    }
    Ok(starts)
}

impl Program for Transcription {
    fn variables(&self) -> usize {
        self.layout.variables
    }
    fn rows(&self) -> usize {
        self.layout.rows
    }

    fn bounds(&self) -> Bounds {
        let none = [f64::NEG_INFINITY, f64::INFINITY];
        let (mut variables, mut rows) = (vec![none; self.variables()], vec![[0.0; 2]; self.rows()]);
        for (k, control) in self.problem.controls.iter().enumerate() {
            self.layout.values(k).iter().for_each(|&at| variables[at] = control.bounds);
        }
        if let (Some(at), FinalTime::Free { min, max, .. }) = (self.layout.time, self.problem.time)
        {
            variables[at] = [min, max];
        }
        for n in 1..=self.division.last() {
            let at = self.layout.coordinate(n).unwrap_or(0);
            self.middle.iter().for_each(|j| variables[at + j] = [-CHART, CHART]);
            if self.division.starting(n).is_none() {
                continue;
            }
            let path = self.problem.conditions.iter();
            for condition in path.filter(|own| is_bound(&own.quantity, own.when)) {
                let NodeNumber::Joint { unknown, start } = condition.quantity else { continue };
                let j = unknown.index;
                let of_bound = |bound: f64| unknown.sign * (bound - start) - self.travel[n][j];
                let [a, b] = condition.bounds.map(of_bound);
                let own = &mut variables[at + j];
                *own = [own[0].max(a.min(b)), own[1].min(a.max(b))];
            }
        }
        for n in 0..self.division.last() {
            for k in 0..self.turning.len() {
                let by = self.travel[n + 1][self.turning[k]] - self.travel[n][self.turning[k]];
                let most = self.problem.max_increment;
                rows[self.layout.turn(n) + k] = [-most - by, most - by];
            }
        }
        for placed in &self.layout.conditions {
            rows[placed.row] = self.problem.conditions[placed.condition].bounds;
        }
        Bounds { variables, rows }
    }

    fn jacobian_places(&self) -> &[(usize, usize)] {
        &self.jacobian_places
    }
    fn hessian_places(&self) -> &[(usize, usize)] {
        &self.hessian_places
    }

    fn move_to(&mut self, x: &[f64]) -> Result<(), Undefined> {
        self.point = None;
        let point = self.followed_at(x)?;
        if !self.exists(&point) {
            return Err(Undefined);
        }
        self.point = Some(point);
        Ok(())
    }

    fn cost(&self) -> f64 {
        self.costs(self.at()).iter().sum()
    }

    fn cost_gradient(&self, out: &mut [f64]) {
        self.cost_slope(self.at(), out);
    }

    fn row_values(&self, out: &mut [f64]) {
        self.row_values_at(self.at(), out);
    }

    fn jacobian(&self, out: &mut [f64]) {
        let mut entries = out.iter_mut();
        self.emit_jacobian(self.at(), &mut |_, _, value| {
            if let Some(entry) = entries.next() {
                *entry = value;
            }
        });
    }

    fn hessian(&self, factor: f64, lambda: &[f64], out: &mut [f64]) {
        let mut entries = out.iter_mut();
        self.emit_hessian(self.at(), factor, lambda, &mut |_, _, value| {
            if let Some(entry) = entries.next() {
                *entry = value;
            }
        });
    }

    fn row_name(&self, row: usize) -> String {
        let count = self.division.last();
        let named = self.layout.conditions.iter().find(|placed| placed.row == row);
        if let Some(placed) = named {
            let name = &self.problem.conditions[placed.condition].name;
            return format!("`{name}` at node {}", self.division.step(placed.node));
        }
        if self.layout.rest.contains(&row) {
            return "rest at the end".to_owned();
        }
        if let Some((k, n)) = self.layout.knots_at(row, self.problem.steps) {
            return format!("`{}` between its knots in step {n}", self.problem.controls[k].name);
        }
        let of_step = |n: &usize| row >= self.layout.balance(*n);
        let n = (0..count).rev().find(of_step).unwrap_or(0);
        if row >= self.layout.turn(n) && !self.turning.is_empty() {
            self.division.name("turn of step", n)
        } else if row >= self.layout.closure(n + 1) && !self.closures.is_empty() {
            self.division.name("closed loops at node", n + 1)
        } else {
            self.division.name("balance at node", n)
        }
    }
}
