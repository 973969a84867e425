//! Numbers of nodes as functions of the variables.
//!
//! ```text
//! y(q_n)          ∂y/∂ξ_n = Kᵀ ∇y
//! y(q_n, v̂_n)     [M Gᵀ; G 0](v̂_n, μ) = (p̄_n, −g_t),   y_p̄ = ∂y/∂p̄_n, a tangent
//! p̄_n = D_2L_d(q_{n−1}, q_n) + f_{n−1}^+ + (h/2) Σ w_{n−1} ∇θ(q_n)        at the start p(0), which no variable changes
//! ∂y/∂ξ_n     = Kᵀ (y_q + Dᵀ y_p̄ + (h/2) Σ w_{n−1} D²θ y_p̄),      ∂y/∂ξ_{n−1} = Kᵀ Cᵀ y_p̄
//! ∂y/∂w_{n−1} = (h/2) ∇θ·y_p̄,  or y_p̄·f_w^+ of a wrench,          ∂y/∂h = y_p̄·∂p̄_n/∂h
//! ```
//! In Galerkin steps `p̄_n = w_s` [2.29], with the derivatives of `w_s`. Second derivatives, with
//! the changes `(δq_n, δp̄_n)` along each variable, `ŷ(q_n, p̄_n)`, and what `y` is by each node
//! `j` of the piece at fixed `y_p̄`, `v_j = y_q δ_jn + (∂p̄_n/∂q_j)ᵀ y_p̄`:
//! ```text
//! ∇²y (a, b)   = D²ŷ[(δ_aq, δ_ap̄), (δ_bq, δ_bp̄)]                                                  [2.54]
//! ∇²y (ξ_i, ξ_j) ∋ K_iᵀ (∂²(y_p̄·p̄_n)/∂q_i∂q_j) K_j + δ_ij v_j·K_kl
//! ∇²y (w, ξ_j)   ∋ K_jᵀ ∂/∂q_j (y_p̄·∂p̄_n/∂w),      of h likewise
//! ```
//! Multipliers and accelerations are those of the step from the node, which the last one has none
//! of.
#![allow(non_snake_case)] // K, X, Y

use super::Transcription;
use super::derivatives::EntrySink;
use super::piece::{ControlEffect, Piece, PieceKind, add_product, products};
use super::point::EvaluatedPoint;
use super::problem::{ControlProblem, CostKind, NodeNumber, ProblemError, Uncovered};
use crate::node::{NodeQuantity, NodeReads};
use crate::objective::{self, ByKnown, Known, NotedNode};
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
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::{MechanicalSystem as _, SeparableSystem, Slot, State};
use vi_multibody::Mechanism;
use vi_multibody::joint_coordinate::JointCoordinate;

/// What numbers of nodes with their velocities are read by.
#[derive(Debug)]
pub(super) struct NumberVelocities {
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

impl NumberVelocities {
    /// Of a problem; `None` where no number reads a velocity.
    ///
    /// # Errors
    /// [`ProblemError`] of numbers that a node and the step to it do not give.
    pub(super) fn of(
        mechanism: &Mechanism,
        system: &SeparableSystem,
        at: InitialValues<'_>,
        problem: &ControlProblem,
    ) -> Result<Option<Self>, ProblemError> {
        let (mut any, free) = (false, problem.time.is_free());
        for (name, quantity) in problem.numbers() {
            let NodeNumber::Node(own) = quantity else { continue };
            any = true;
            let what = match own.reads() {
                NodeReads { accelerations: true, .. } => {
                    "accelerations, which controls change as well"
                }
                NodeReads { forces: true, .. } => "multipliers of the step from the node",
                NodeReads { internal: true, .. } => "what all steps before it have done",
                _ if free && own.reads_time() => "the time, and the final time is free",
                _ if own.curved().is_none() => "what has no second derivatives",
                _ => continue,
            };
            return Err(ProblemError::Reads(name.to_owned(), what));
        }
        if !any {
            return Ok(None);
        }
        let rows = IndependentRows::find_generic(mechanism, at.t, at.q);
        let rows = rows.map_err(|_| ProblemError::NotCovered(Uncovered::SingularStart))?;
        let mut state = State::new(at.t, at.q.to_vec(), vec![0.0; at.q.len()]);
        system.mass().mul_add(1.0, at.v, &mut state.p);
        let reader = NodeReader::at(mechanism, system, &rows, &state)?;
        Ok(Some(Self { reader }))
    }
}

impl Transcription {
    /// The motion at `x`, along which numbers are continued.
    pub(super) fn followed_at(&self, x: &[f64]) -> Result<EvaluatedPoint, Undefined> {
        let point = self.point_at(x)?;
        self.follow(&point);
        Ok(point)
    }

    /// Takes note of the nodes where steps meet, as a run does: numbers are continued along these.
    pub(super) fn follow(&self, point: &EvaluatedPoint) {
        for (_, quantity) in self.problem.numbers() {
            for n in (0..=self.problem.steps).map(|n| self.division.node(n)) {
                let seen = if n == 0 { NotedNode::First } else { NotedNode::Next };
                let at = point.configuration(n);
                match quantity {
                    NodeNumber::Joint { .. } => {}
                    NodeNumber::Configuration(own) => own.follow(at, seen),
                    NodeNumber::Node(own) => own.follow(at, seen),
                }
            }
        }
    }

    /// A number at a node.
    pub(super) fn quantity(&self, point: &EvaluatedPoint, quantity: &NodeNumber, n: usize) -> f64 {
        match quantity {
            NodeNumber::Joint { unknown, start } => {
                start + unknown.sign * self.traveled(&point.x, n, unknown.index)
            }
            NodeNumber::Configuration(own) => own.value(point.configuration(n)),
            NodeNumber::Node(own) => {
                let read = |all: &NumberVelocities| {
                    all.reader.value(&**own, &self.state(point, n), Known::STATE)
                };
                self.velocities.as_ref().map_or(f64::NAN, read)
            }
        }
    }

    /// Whether the numbers of conditions and costs have values and slopes at a point: a distance
    /// has none where the points meet.
    pub(super) fn exists(&self, point: &EvaluatedPoint) -> bool {
        let exists = |quantity: &NodeNumber, n: usize| {
            let slopes = match quantity {
                NodeNumber::Configuration(_) => self.quantity_slope(point, quantity, n),
                _ => Vec::new(),
            };
            let value = self.quantity(point, quantity, n);
            value.is_finite() && slopes.iter().all(|(_, slope)| slope.is_finite())
        };
        let mut conditions = self.layout.conditions.iter();
        let of_costs = self.problem.costs.iter().all(|cost| match &cost.kind {
            CostKind::Number { quantity, when, .. } => {
                let mut counted = self.counted(quantity, *when, point.h).into_iter();
                counted.all(|(n, ..)| exists(quantity, n))
            }
            _ => true,
        });
        let of = |condition: usize| &self.problem.conditions[condition].quantity;
        of_costs && conditions.all(|own| exists(of(own.condition), own.node))
    }

    /// A node with `p̄_n`.
    fn state(&self, point: &EvaluatedPoint, n: usize) -> State {
        let at = point.configuration(n);
        let mut p = self.start_momentum.clone();
        if let Some(number) = self.before(n) {
            let piece = &point.pieces[number];
            let s = &piece.s;
            if let PieceKind::Galerkin(_) = piece.kind {
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
        point: &'a EvaluatedPoint,
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
        point: &EvaluatedPoint,
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
        point: &EvaluatedPoint,
        quantity: &NodeNumber,
        n: usize,
    ) -> Vec<(usize, f64)> {
        let Some(at) = self.layout.coordinate(n) else { return Vec::new() };
        let place = |slope: Vec<f64>| (at..).zip(slope).collect();
        match quantity {
            NodeNumber::Joint { unknown, .. } => vec![(at + unknown.index, unknown.sign)],
            NodeNumber::Configuration(own) => place(self.number_along(point, n, &**own)),
            NodeNumber::Node(own) => self.node_slope(point, &**own, n),
        }
    }

    fn node_slope(
        &self,
        point: &EvaluatedPoint,
        own: &dyn NodeQuantity,
        n: usize,
    ) -> Vec<(usize, f64)> {
        let (Some(all), Some(number)) = (&self.velocities, self.before(n)) else {
            return Vec::new();
        };
        let (piece, state) = (&point.pieces[number], self.state(point, n));
        let mut by = Costate::zero(self.n, 0);
        let slopes = (&mut by, ByKnown::default());
        all.reader.add_slopes((own, &|_| 1.0), (&state, Known::STATE), slopes, &mut []);
        let Costate { q: of_q, p: of_p, .. } = by;
        let (span, mut slopes) = (self.division.span(), Vec::new());
        let of_p = DMatrix::from_vec(self.n, 1, of_p);
        for j in (0..=span).rev() {
            let node = piece.first + j;
            let Some(at) = self.layout.coordinate(node) else { continue };
            let mut slope = self.momentum_slope(point, (number, &state), j, (&of_p, true));
            if j == span {
                slope.iter_mut().zip(&of_q).for_each(|(slope, y)| *slope += y);
            }
            slopes.extend((at..).zip(point.along_columns(node, slope.as_slice())));
        }
        let along = |change: Vec<f64>| dot(&change, of_p.as_slice());
        for k in 0..self.problem.controls.len() {
            let by_control = along(self.momentum_by_control(piece, &state, k));
            slopes.push((self.acting(k, number), by_control));
        }
        let by_time = |time| (time, along(self.momentum_by_time(point, number, &state)));
        slopes.extend(self.layout.time.map(by_time));
        slopes
    }

    /// `∂p̄_n/∂q_j X`, or its transpose times `X`, of the momentum with which a piece ends, `q_j`
    /// its node of this number.
    fn momentum_slope(
        &self,
        point: &EvaluatedPoint,
        (number, state): (usize, &State),
        j: usize,
        (X, transposed): (&DMatrix<f64>, bool),
    ) -> DMatrix<f64> {
        let (piece, span) = (&point.pieces[number], self.division.span());
        if let PieceKind::Galerkin(_) = piece.kind {
            return piece.times(self, span, j, X, transposed).sum();
        }
        let (s, by) = (&piece.s, Slot::BOTH[j]);
        let matrix = SparseMatrix::assemble(self.n, self.n, |out| {
            match by {
                Slot::First => self.system.forced_d1_d2(s, out),
                Slot::Second => self.system.forced_d2_d2(s, out),
            }
            piece.wrenches.iter().for_each(|load| load.add_slope(s, Slot::Second, by, out));
            for (_, value, own) in self.efforts_of(point, number).filter(|_| by == Slot::Second) {
                own.emit_second(&state.q, 0.5 * s.h * value, out);
            }
        });
        let mut product = DMatrix::zeros(self.n, X.ncols());
        add_product(1.0, &matrix, X, transposed, &mut product);
        product
    }

    /// `∂p̄_n/∂w` of a control, shape `n`.
    fn momentum_by_control(&self, piece: &Piece, state: &State, control: usize) -> Vec<f64> {
        match (piece.effect(self, control, self.division.span()), &self.coordinates[control]) {
            (ControlEffect::Force(force), _) => force,
            (ControlEffect::Unknown(..), own) => {
                let mut force = vec![0.0; self.n];
                if let Some(own) = own {
                    own.add_gradient(&state.q, 0.5 * piece.s.h, &mut force);
                }
                force
            }
        }
    }

    /// `∂p̄_n/∂T`, shape `n`.
    fn momentum_by_time(&self, point: &EvaluatedPoint, number: usize, state: &State) -> Vec<f64> {
        let (piece, span) = (&point.pieces[number], self.division.span());
        let part = self.division.gamma(number) / self.problem.steps as f64;
        let mut change = vec![0.0; self.n];
        if let PieceKind::Galerkin(_) = piece.kind {
            let [inertial, _] = piece.momentum(self, span);
            change = piece.by_length(self, span);
            let both = change.iter_mut().zip(&inertial);
            both.for_each(|(change, w)| *change = part * (*change - w / piece.s.h));
            return change;
        }
        let by = StepChange { length: part, middle: 0.0 }; // nothing depends on the time itself
        if self.system.add_step_slope(&piece.s, Slot::Second, by, &mut change).is_err() {
            change.fill(f64::NAN);
        }
        for k in 0..self.problem.controls.len() {
            let scale = point.x[self.acting(k, number)] * part / piece.s.h;
            let force = self.momentum_by_control(piece, state, k);
            change.iter_mut().zip(&force).for_each(|(change, f)| *change += scale * f);
        }
        change
    }

    /// Emits `∂²(y·p̄_n)/∂q_i∂q_j` of the momentum with which a piece ends, `Y`: zero but for `y`
    /// at its last node.
    fn emit_momentum_bend(
        &self,
        point: &EvaluatedPoint,
        (number, state): (usize, &State),
        Y: &[&[f64]],
        (i, j): (usize, usize),
        out: &mut dyn Entries,
    ) {
        let piece = &point.pieces[number];
        if let PieceKind::Galerkin(_) = piece.kind {
            return piece.emit_bend(self, Y, i, j, out);
        }
        let (s, Y, slots) = (&piece.s, [Y[0], Y[1]], [i, j].map(|end| Slot::BOTH[end]));
        self.system.forced_bend(s, Y, slots, out);
        piece.wrenches.iter().for_each(|load| load.add_bend(s, Y, slots, out));
        for (_, value, own) in self.efforts_of(point, number).filter(|_| i == 1 && j == 1) {
            own.emit_third(&state.q, Y[1], 0.5 * s.h * value, out);
        }
    }

    /// `∂²(y·p̄_n)/∂h∂q_j` of the momentum with which a piece ends, `h` its length, `Y` as above.
    fn momentum_slope_by_length(
        &self,
        point: &EvaluatedPoint,
        (number, state): (usize, &State),
        j: usize,
        Y: &[&[f64]],
    ) -> Vec<f64> {
        let piece = &point.pieces[number];
        let mut slope = piece.slope_by_length(self, j, Y);
        let PieceKind::SubStep(along) = &piece.kind else { return slope };
        let (s, by, y) = (&piece.s, Slot::BOTH[j], Y[1]);
        let at_end = by == Slot::Second;
        for (_, value, own) in self.efforts_of(point, number).filter(|_| at_end) {
            own.add_bend(&state.q, y, 0.5 * value, &mut slope);
        }
        for (own, effort) in self.system.along_unknowns().zip(along) {
            effort.effort.add_slope_by_length(own.force, s, [Y[0], y], by, &mut slope);
        }
        slope
    }

    /// `∂²(y·p̄_n)/∂h²` of the same.
    fn momentum_second_by_length(&self, piece: &Piece, state: &State, Y: &[&[f64]]) -> f64 {
        let (h, span) = (piece.s.h, self.division.span());
        let [inertial, _] = piece.momentum(self, span);
        let mut second = 2.0 * dot(&inertial, Y[span]) / (h * h) + piece.second_by_length(self, Y);
        if let PieceKind::SubStep(along) = &piece.kind {
            for (own, effort) in self.system.along_unknowns().zip(along) {
                second += own.force.rate(&state.q, Y[1]) * effort.effort.second_by_length(h);
            }
        }
        second
    }

    /// The numbers of nodes with their velocities that count, with their nodes and their factors in
    /// the Lagrangian `factor f + λᵀ g`.
    fn factors<'a>(
        &'a self,
        point: &EvaluatedPoint,
        factor: f64,
        lambda: &[f64],
    ) -> Vec<(usize, &'a NodeNumber, f64)> {
        let mut all = Vec::new();
        for placed in &self.layout.conditions {
            let own = &self.problem.conditions[placed.condition].quantity;
            all.push((placed.node, own, lambda[placed.row]));
        }
        for cost in &self.problem.costs {
            let CostKind::Number { quantity, judged, when } = &cost.kind else { continue };
            for (n, part, _) in self.counted(quantity, *when, point.h) {
                let slope = judged.slope(self.quantity(point, quantity, n));
                all.push((n, quantity, factor * cost.weight * part * slope));
            }
        }
        all.retain(|(_, own, _)| matches!(own, NodeNumber::Node(_)));
        all
    }

    /// Emits `Σ c ∇²y` of numbers with velocities, `c`: their factors.
    pub(super) fn emit_curvature(
        &self,
        point: &EvaluatedPoint,
        t: f64,
        q: &[f64],
        out: &mut EntrySink<'_>,
    ) {
        for (n, own, factor) in self.factors(point, t, q) {
            let NodeNumber::Node(own) = own else { continue };
            let Some(number) = self.before(n) else { continue };
            let (variables, second) = self.node_second(point, &**own, number, n);
            for (i, a) in variables.iter().enumerate() {
                for (j, b) in variables[..=i].iter().enumerate() {
                    out(*a, *b, factor * second[(i, j)]);
                }
            }
        }
    }

    /// The variables that a number at a node reads with its second derivatives by these; not a
    /// number where it has none.
    fn node_second(
        &self,
        point: &EvaluatedPoint,
        own: &dyn NodeQuantity,
        number: usize,
        n: usize,
    ) -> (Vec<usize>, DMatrix<f64>) {
        let (piece, state) = (&point.pieces[number], self.state(point, n));
        let (span, d, of) = (self.division.span(), self.chart.dof(), (number, &state));
        let (mut variables, mut changes) = (Vec::new(), Vec::new());
        let still = || vec![0.0; self.n];
        let nodes: Vec<(usize, usize)> = (0..=span)
            .filter_map(|j| Some((j, self.layout.coordinate(piece.first + j)?)))
            .collect();
        for &(j, at) in &nodes {
            let K = &point.nodes[piece.first + j].columns;
            let moved = self.momentum_slope(point, of, j, (K, false));
            for (k, (own, dp)) in K.column_iter().zip(moved.column_iter()).enumerate() {
                let dq = if j == span { own.as_slice().to_vec() } else { still() };
                variables.push(at + k);
                changes.push([dq, dp.as_slice().to_vec()]);
            }
        }
        let first_control = variables.len();
        for k in 0..self.problem.controls.len() {
            variables.push(self.acting(k, number));
            changes.push([still(), self.momentum_by_control(piece, &state, k)]);
        }
        if let Some(time) = self.layout.time {
            variables.push(time);
            changes.push([still(), self.momentum_by_time(point, number, &state)]);
        }
        let count = variables.len();
        let found =
            self.velocities.as_ref().and_then(|all| all.reader.second(own, &state, &changes));
        let Some(([of_q, of_p], mut second)) = found else {
            return (variables, DMatrix::from_element(count, count, f64::NAN));
        };
        // y_p̄ times the second derivatives of p̄_n, and of the nodes by the coordinates
        let zero = still();
        let mut Y = vec![&zero[..]; span + 1];
        Y[span] = &of_p;
        let K: Vec<&DMatrix<f64>> =
            (0..=span).map(|j| &point.nodes[piece.first + j].columns).collect();
        let bent = products(&K, |i, j, out| self.emit_momentum_bend(point, of, &Y, (i, j), out));
        let of_p = DMatrix::from_column_slice(self.n, 1, &of_p);
        for (a, &(i, _)) in nodes.iter().enumerate() {
            for (b, &(j, _)) in nodes.iter().enumerate().skip(a) {
                let mut block = second.view_mut((b * d, a * d), (d, d));
                block += bent[i][j].transpose();
            }
            let mut slope = self.momentum_slope(point, of, i, (&of_p, true));
            if i == span {
                slope.iter_mut().zip(&of_q).for_each(|(slope, y)| *slope += y);
            }
            let placed = &point.nodes[piece.first + i].placed;
            let mut own = second.view_mut((a * d, a * d), (d, d));
            own += self.chart.curvature(placed, slope.as_slice());
        }
        let mut add = |row: usize, node: usize, slope: &[f64], scale: f64| {
            let along = point.along_columns(piece.first + nodes[node].0, slope);
            for (k, along) in along.into_iter().enumerate() {
                second[(row, node * d + k)] += scale * along;
            }
        };
        for k in 0..self.problem.controls.len() {
            let mut slopes = piece.effect_slopes(self, k, &Y);
            if let (PieceKind::SubStep(_), Some(own)) = (&piece.kind, &self.coordinates[k]) {
                own.add_bend(&state.q, Y[span], 0.5 * piece.s.h, &mut slopes[span]);
            }
            for (a, &(j, _)) in nodes.iter().enumerate() {
                add(first_control + k, a, &slopes[j], 1.0);
            }
        }
        if self.layout.time.is_some() {
            let (row, part) = (count - 1, self.division.gamma(number) / self.problem.steps as f64);
            for (a, &(j, _)) in nodes.iter().enumerate() {
                add(row, a, &self.momentum_slope_by_length(point, of, j, &Y), part);
            }
            for k in 0..self.problem.controls.len() {
                let along = dot(&self.momentum_by_control(piece, &state, k), Y[span]);
                second[(row, first_control + k)] += part / piece.s.h * along;
            }
            second[(row, row)] += part * part * self.momentum_second_by_length(piece, &state, &Y);
        }
        (variables, second)
    }
}
