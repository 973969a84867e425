//! Numbers of nodes as functions of the variables.
//!
//! ```text
//! y(q_n)          ∂y/∂ξ_n = Kᵀ ∇y
//! y(q_n, v̂_n)     [M Gᵀ; G 0](v̂_n, μ) = (p̄_n, −g_t),   y_p̄ = ∂y/∂p̄_n, a tangent
//! p̄_n = D_2L_d(q_{n−1}, q_n) + f_{n−1}^+ + (h/2) Σ w_{n−1} ∇θ(q_n)        at the start p(0), which no variable changes
//! ∂y/∂ξ_n     = Kᵀ (y_q + Dᵀ y_p̄ + (h/2) Σ w_{n−1} D²θ y_p̄),      ∂y/∂ξ_{n−1} = Kᵀ Cᵀ y_p̄
//! ∂y/∂w_{n−1} = (h/2) ∇θ·y_p̄,  or y_p̄·f_w^+ of a wrench,          ∂y/∂h = y_p̄·∂p̄_n/∂h
//! ```
//! In Galerkin steps `p̄_n = w_s` [2.29], with the derivatives of `w_s`.
//! Multipliers and accelerations are those of the step from the node, which the last one has none
//! of. Second derivatives of numbers with velocities are differences of these slopes, by one
//! coordinate of every other node at once, since each reads two nodes, of Galerkin steps `s + 1`:
//! they steer the method and move no optimum.

use super::Transcription;
use super::derivatives::Sink;
use super::piece::Kind;
use super::point::Point;
use super::problem::{Acts, Control, CostKind, Problem, ProblemError, Quantity};
use crate::node::{NodeQuantity, Reads};
use crate::objective::{self, Known, Seen};
use crate::program::Undefined;
use crate::terminal_rate::NodeReader;
use nalgebra::DMatrix;
use vi_constraints::InitialValues;
use vi_constraints::linearization::Costate;
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
}

/// The coordinate of a joint that an unknown of the tree is; `None` of rotation vectors and free
/// places.
pub(super) fn coordinate(mechanism: &Mechanism, unknown: SignedUnknown) -> Option<JointCoordinate> {
    let tree = mechanism.tree();
    mechanism.description().joints.iter().find_map(|joint| {
        let mut freedoms = 0..joint.kind.dof();
        let freedom = freedoms.find(|k| tree.unknown_of(joint, *k) == Some(unknown))?;
        JointCoordinate::principal(joint, freedom)
    })
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
                Reads { internal: true, .. } => "what all steps before it have done",
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
        let turns_ball = |control: &Control| match control.acts {
            Acts::Along(unknown) => coordinate(mechanism, unknown).is_none(),
            Acts::Wrench(_) => false,
        };
        if problem.controls.iter().any(turns_ball) {
            return Err(ProblemError::NotCovered("velocities beside efforts of ball joints"));
        }
        let reader = NodeReader::at(mechanism, system, (&rows, &state), &[], None)?;
        Ok(Some(Self { reader }))
    }
}

impl Transcription {
    /// The motion at `x`, along which numbers are continued.
    pub(super) fn followed_at(&self, x: &[f64]) -> Result<Point, Undefined> {
        let point = self.point_at(x)?;
        self.follow(&point);
        Ok(point)
    }

    /// Takes note of the nodes where steps meet, as a run does: numbers are continued along these.
    pub(super) fn follow(&self, point: &Point) {
        for (_, quantity) in self.problem.numbers() {
            for n in (0..=self.problem.steps).map(|n| self.division.node(n)) {
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
                let mut counted = self.counted(quantity, *when, point.h).into_iter();
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
        if let Some(number) = self.before(n) {
            let piece = &point.pieces[number];
            let s = &piece.s;
            if let Kind::Galerkin(_) = piece.kind {
                let [inertial, other] = piece.momentum(self, self.division.span());
                p = inertial.iter().zip(&other).map(|(a, b)| a + b).collect(); // [2.29]
            } else {
                self.system.forced_d2(s, &mut p);
                piece.wrenches.iter().for_each(|load| load.add_plus(s, &mut p));
                for (_, value, own) in self.efforts_of(point, number) {
                    own.add_gradient(at.q, 0.5 * s.h * value, &mut p); // [5.11]
                }
            }
        }
        let state = State::new(at.t, at.q.to_vec(), p);
        State { angles: at.angles.to_vec(), ..state }
    }

    /// The piece that ends at a node.
    fn before(&self, n: usize) -> Option<usize> {
        self.division.pieces_at(n).find(|(_, own)| *own == self.division.span()).map(|own| own.0)
    }

    /// Controls along unknowns in a piece: their variables, efforts and coordinates.
    fn efforts_of<'a>(
        &'a self,
        point: &'a Point,
        piece: usize,
    ) -> impl Iterator<Item = (usize, f64, &'a JointCoordinate)> {
        self.efforts().filter_map(move |(k, _)| {
            let at = self.acting(k, piece);
            Some((at, point.x[at], self.coordinates[k].as_ref()?))
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
        let (Some(all), Some(number)) = (&self.velocities, self.before(n)) else {
            return Vec::new();
        };
        let (piece, state) = (&point.pieces[number], self.state(point, n));
        let mut by = Costate::zero(self.n, 0);
        let slopes = (&mut by, &mut [][..]);
        all.reader.add_slopes((own, &|_| 1.0), (&state, Known::State), slopes, &mut []);
        let Costate { q: of_q, p: of_p, .. } = by;
        let (span, mut slopes) = (self.division.span(), Vec::new());
        for j in (0..=span).rev() {
            let mut slope = self.momentum_slope(point, (number, &state), j, &of_p);
            if j == span {
                slope.iter_mut().zip(&of_q).for_each(|(slope, y)| *slope += y);
            }
            let node = piece.first + j;
            if let Some(at) = self.layout.coordinate(node) {
                slopes.extend((at..).zip(point.along_columns(node, &slope)));
            }
        }
        let mut by_step = self.momentum_by_step(point, number, &of_p);
        let gamma = self.division.gamma(number);
        for k in 0..self.problem.controls.len() {
            let at = self.acting(k, number);
            let along = match (&piece.kind, &self.coordinates[k]) {
                (Kind::SubStep(_), Some(own)) => 0.5 * piece.s.h * own.rate(&state.q, &of_p),
                _ => piece.effect_along(self, k, span, &of_p),
            };
            slopes.push((at, along));
            if let Kind::SubStep(_) = piece.kind {
                by_step += point.x[at] * along * gamma / piece.s.h;
            }
        }
        slopes.extend(self.layout.time.map(|time| (time, by_step / self.problem.steps as f64)));
        slopes
    }

    /// `(∂p̄_n/∂q_j)ᵀ y` of the momentum with which a piece ends, `q_j` its node of this number.
    fn momentum_slope(
        &self,
        point: &Point,
        (number, state): (usize, &State),
        j: usize,
        y: &[f64],
    ) -> Vec<f64> {
        let (piece, span) = (&point.pieces[number], self.division.span());
        if let Kind::Galerkin(_) = piece.kind {
            let y = DMatrix::from_column_slice(self.n, 1, y);
            return piece.times(self, (span, j), &y, true).sum().as_slice().to_vec();
        }
        let (s, mut slope) = (&piece.s, vec![0.0; self.n]);
        let mut pull = |emit: &dyn Fn(&mut dyn Entries)| {
            let into = &mut Product { v: y, out: &mut slope };
            emit(&mut Block { into, row: 0, column: 0, scale: 1.0, transposed: true });
        };
        let by = Slot::BOTH[j];
        match by {
            Slot::First => pull(&|out| self.system.forced_d1_d2(s, out)),
            Slot::Second => pull(&|out| self.system.forced_d2_d2(s, out)),
        }
        for load in &piece.wrenches {
            pull(&|out| load.add_slope(s, Slot::Second, by, out));
        }
        if by == Slot::Second {
            for (_, value, own) in self.efforts_of(point, number) {
                own.add_bend(&state.q, y, 0.5 * s.h * value, &mut slope);
            }
        }
        slope
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
            for (n, part, _) in self.counted(quantity, *when, point.h) {
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
        let read = self.division.span() + 1; // nodes of a number
        let coordinates = |first: usize, j: usize| {
            let nodes = (first..=self.division.last()).step_by(read);
            nodes.filter_map(|n| Some(change(self.layout.coordinate(n)? + j))).collect()
        };
        let d = self.chart.dof();
        let mut sets: Vec<Vec<_>> = (0..read * d).map(|k| coordinates(1 + k / d, k % d)).collect();
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

    /// `y_p̄·∂p̄_n/∂h` of the momentum with which a piece ends, of a sub-step without controls;
    /// zero where the time is given.
    fn momentum_by_step(&self, point: &Point, number: usize, of_p: &[f64]) -> f64 {
        if self.layout.time.is_none() {
            return 0.0;
        }
        let (piece, length) = (&point.pieces[number], self.division.gamma(number));
        let span = self.division.span();
        if let Kind::Galerkin(_) = piece.kind {
            let [inertial, other] = piece.momentum(self, span);
            let rest = dot(&piece.by_length(self, span, &other), of_p);
            return length * (rest - dot(&inertial, of_p) / piece.s.h);
        }
        let mut change = vec![0.0; self.n];
        let by = StepChange { length, middle: 0.0 }; // nothing depends on the time itself
        match self.system.add_step_slope(&piece.s, Slot::Second, by, &mut change) {
            Ok(()) => dot(&change, of_p),
            Err(_) => f64::NAN,
        }
    }
}
