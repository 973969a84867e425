//! The motion at a point of the program: nodes, discrete momenta, residuals.
//!
//! ```text
//! w_n = Σ w_i of the pieces at the node − G_c(q_n)ᵀ (hλ_n)      of sub-steps D_2L_d + f_{n−1}^+ + D_1L_d + f_n^-
//! r_n = Kᵀ w_n − hλ_n f + σ (h/2)(τ_{n−1} + τ_n) e_j                     τ: controls, and efforts of the model along unknowns
//! wrenches of controls are part of f^± [4.6]; of Galerkin steps all efforts of w_i
//! ```

use super::Transcription;
use super::chart::PlacedNode;
use super::closure::TreeClosure;
use super::piece::{ModelEffort, Piece, PieceKind};
use super::problem::{Acts, CostKind, NodeNumber, When};
use crate::program::Undefined;
use nalgebra::DMatrix;
use vi_constraints::Constraints as _;
use vi_core::Configuration;
use vi_core::coordinate_force::{SignedUnknown, StepEffort};
use vi_core::interval::Interval;
use vi_rigid::load::Load;

/// A node.
#[derive(Debug)]
pub(super) struct PointNode {
    pub(super) placed: PlacedNode,
    /// `K`, shape `n × d`.
    pub(super) columns: DMatrix<f64>,
    /// What inertia contributes to `w`, of the order `1/h`.
    pub(super) inertial: Vec<f64>,
    /// `w`.
    pub(super) balance: Vec<f64>,
    /// `∂w/∂h`, `h` that of a whole step; empty where the time is given.
    pub(super) by_step: Vec<f64>,
}

/// Everything at a point but derivatives.
#[derive(Debug)]
pub(super) struct EvaluatedPoint {
    pub(super) x: Vec<f64>,
    /// That of a whole step.
    pub(super) h: f64,
    pub(super) nodes: Vec<PointNode>,
    pub(super) pieces: Vec<Piece>,
    /// Unwrapped angles of joints at each node, rad.
    angles: Vec<Vec<f64>>,
    /// Of each node, s.
    times: Vec<f64>,
}

impl EvaluatedPoint {
    /// Node `n`.
    pub(super) fn configuration(&self, n: usize) -> Configuration<'_> {
        let t = self.times[n];
        Configuration { t, q: &self.nodes[n].placed.q, angles: &self.angles[n], internal: &[] }
    }

    /// `Kᵀ x` at a node.
    pub(super) fn along_columns(&self, n: usize, x: &[f64]) -> Vec<f64> {
        let columns = self.nodes[n].columns.column_iter();
        columns.map(|column| column.iter().zip(x).map(|(k, x)| k * x).sum()).collect()
    }
}

fn add(scale: f64, x: &[f64], out: &mut [f64]) {
    out.iter_mut().zip(x).for_each(|(out, x)| *out += scale * x);
}

impl Transcription {
    /// `h` at a point.
    pub(super) fn step_of(&self, x: &[f64]) -> f64 {
        let time = self.layout.time.map_or(self.problem.time.guess(), |at| x[at]);
        time / self.problem.steps as f64
    }

    /// The coordinates of the chart at a node, zero at the start.
    pub(super) fn chart_coordinates(&self, x: &[f64], n: usize) -> Vec<f64> {
        let d = self.chart.dof();
        self.layout.coordinate(n).map_or_else(|| vec![0.0; d], |at| x[at..at + d].to_vec())
    }

    /// A coordinate that adds up, less its value at the start.
    pub(super) fn traveled(&self, x: &[f64], n: usize, j: usize) -> f64 {
        self.travel[n][j] + self.layout.coordinate(n).map_or(0.0, |at| x[at + j])
    }

    /// The motion at `x`.
    pub(super) fn point_at(&self, x: &[f64]) -> Result<EvaluatedPoint, Undefined> {
        let (count, h) = (self.division.last(), self.step_of(x));
        if x.iter().any(|x| !x.is_finite()) || h <= 0.0 {
            return Err(Undefined);
        }
        let mut nodes: Vec<PointNode> = Vec::with_capacity(count + 1);
        for n in 0..=count {
            let placed = self.chart.place(&self.references[n], &self.chart_coordinates(x, n));
            let columns = self.chart.columns(&placed);
            let zero = || vec![0.0; self.n];
            let by_step = if self.layout.time.is_some() { zero() } else { Vec::new() };
            nodes.push(PointNode { placed, columns, inertial: zero(), balance: zero(), by_step });
        }
        let mut angles: Vec<Vec<f64>> = Vec::with_capacity(count + 1);
        for node in &nodes {
            // the turns of a step are bounded: those next to the node before
            let last = angles.last().map_or(&self.start_angles, |last| last);
            let mut own = last.clone();
            self.mechanism.unwrap_angles(&node.placed.q, &mut own);
            angles.push(own);
        }
        let time = |n: usize| self.start_time + self.division.time(n) * h;
        let times: Vec<f64> = (0..=count).map(time).collect();
        let mut pieces = Vec::with_capacity(self.division.pieces());
        for p in 0..self.division.pieces() {
            let (span, length) = (self.division.span(), self.division.gamma(p));
            let first = p * span;
            let between: Vec<&[f64]> =
                nodes[first..=first + span].iter().map(|node| &node.placed.q[..]).collect();
            let value = |k: usize| x[self.acting(k, p)];
            let start = (&angles[first][..], times[first], length * h);
            let mut piece = Piece::new(self, (first, &between), start, &value);
            if let PieceKind::SubStep(along) = &mut piece.kind {
                *along = self.along_at(x, first, &piece.s);
            }
            for i in 0..=span {
                let [inertial, other] = piece.momentum(self, i);
                let node = &mut nodes[first + i];
                add(1.0, &inertial, &mut node.inertial);
                add(1.0, &other, &mut node.balance);
                if !node.by_step.is_empty() {
                    add(-1.0 / h, &inertial, &mut node.by_step);
                    add(length, &piece.by_length(self, i), &mut node.by_step);
                }
            }
            pieces.push(piece);
        }
        for (n, node) in nodes.iter_mut().enumerate() {
            let PointNode { inertial, balance, placed, .. } = node;
            add(1.0, inertial, balance);
            if n == 0 {
                add(1.0, &self.start_momentum, balance);
            }
            for (k, own) in self.impulses_at(n).enumerate() {
                let (Some(row), impulse) = (own.product(), x[self.layout.impulse(n) + k]) else {
                    continue;
                };
                row.for_each_slope(&placed.q, |i, slope| balance[i] -= impulse * slope); // [2.41]
            }
        }
        let x = x.to_vec();
        Ok(EvaluatedPoint { x, h, nodes, pieces, angles, times })
    }

    /// The closures whose impulses act at node `n`.
    pub(super) fn impulses_at(&self, n: usize) -> impl Iterator<Item = &TreeClosure> {
        let acts = n < self.division.last() || self.acts_at_end();
        self.closures.iter().filter(move |_| acts)
    }

    /// The value of a closure at a node.
    pub(super) fn closure_value(&self, point: &EvaluatedPoint, n: usize, own: &TreeClosure) -> f64 {
        match own {
            TreeClosure::Product(row) => row.value(&point.nodes[n].placed.q),
            TreeClosure::Along(own) => {
                own.value(point.configuration(n).t, |j| self.traveled(&point.x, n, j))
            }
        }
    }

    /// The wrench that a control is, of the value 1.
    pub(super) fn wrench(&self, control: usize) -> Option<&Load> {
        match &self.problem.controls[control].acts {
            Acts::Wrench(load) => Some(load),
            Acts::Along(_) => None,
        }
    }

    /// The unknown along which a control acts.
    pub(super) fn along(&self, control: usize) -> Option<SignedUnknown> {
        match self.problem.controls[control].acts {
            Acts::Along(unknown) => Some(unknown),
            Acts::Wrench(_) => None,
        }
    }

    /// The controls that are wrenches, each with its load of the value 1.
    pub(super) fn wrenches(&self) -> impl Iterator<Item = (usize, &Load)> {
        (0..self.problem.controls.len()).filter_map(|k| Some((k, self.wrench(k)?)))
    }

    /// The controls along unknowns.
    pub(super) fn efforts(&self) -> impl Iterator<Item = (usize, SignedUnknown)> {
        (0..self.problem.controls.len()).filter_map(|k| Some((k, self.along(k)?)))
    }

    /// The variable of a control in a piece.
    pub(super) fn acting(&self, control: usize, piece: usize) -> usize {
        self.layout.control(control, self.division.step_of(piece))
    }

    /// The unknown along which a control acts whose work counts.
    pub(super) fn unknown(&self, control: usize) -> SignedUnknown {
        self.along(control).expect("the problem was checked")
    }

    fn along_at(&self, x: &[f64], n: usize, s: &Interval) -> Vec<ModelEffort> {
        let all = self.system.along_unknowns().zip(&self.along_starts);
        let at = |(own, start): (vi_core::coordinate_force::AlongUnknown<'_>, &f64)| {
            let (index, sign) = (own.unknown.index, own.unknown.sign);
            let [from, to] = [n, n + 1].map(|k| start + sign * self.traveled(x, k, index));
            let (t, mean, rate) = (s.t_mid(), 0.5 * (from + to), (to - from) / s.h);
            let effort = StepEffort {
                effort: own.force.effort(t, mean, rate),
                slopes: own.force.slopes(t, mean, rate),
                bends: own.force.bends(t, mean, rate),
                rate,
            };
            ModelEffort { index, sign, effort }
        };
        all.map(at).collect()
    }

    /// The nodes at which a deviation counts, with its factor there and the derivative of this by
    /// `h`.
    pub(super) fn counted(
        &self,
        quantity: &NodeNumber,
        when: When,
        h: f64,
    ) -> Vec<(usize, f64, f64)> {
        let (steps, node) = (self.problem.steps, |n: usize| self.division.node(n));
        match when {
            When::End => vec![(node(steps), 1.0, 0.0)],
            When::Node(n) => vec![(node(n), 1.0, 0.0)],
            When::Path => {
                let within = match quantity {
                    NodeNumber::Joint { .. } => true,
                    NodeNumber::Configuration(own) => !own.is_continued(),
                    NodeNumber::Node(_) => false,
                };
                let parts = self.division.trapezoids(within);
                parts.into_iter().map(|(node, part)| (node, h * part, part)).collect()
            }
        }
    }

    /// The momenta `Kᵀ w` with the efforts along unknowns, at a node.
    pub(super) fn residual(&self, point: &EvaluatedPoint, n: usize, out: &mut [f64]) {
        let node = &point.nodes[n];
        for (o, column) in out.iter_mut().zip(node.columns.column_iter()) {
            *o = column.iter().zip(&node.balance).map(|(k, w)| k * w).sum();
        }
        for (k, own) in self.impulses_at(n).enumerate() {
            let TreeClosure::Along(own) = own else { continue };
            add(-point.x[self.layout.impulse(n) + k], &own.slope(self.chart.dof()), out);
        }
        for (p, _) in self.division.pieces_at(n) {
            let piece = &point.pieces[p];
            let PieceKind::SubStep(along) = &piece.kind else { continue };
            let h = piece.s.h;
            for own in along {
                out[own.index] += 0.5 * h * own.sign * own.effort.effort;
            }
            for (k, along) in self.efforts() {
                let value = point.x[self.acting(k, p)];
                out[along.index] += 0.5 * h * along.sign * value;
            }
        }
    }

    /// The value of each term of the cost.
    pub(super) fn costs(&self, point: &EvaluatedPoint) -> Vec<f64> {
        let (h, x, steps) = (point.h, &point.x, self.problem.steps);
        let value = |k: usize, n: usize| x[self.layout.control(k, n)];
        let of_steps = |of: &[usize], term: &dyn Fn(usize, usize) -> f64| -> f64 {
            (0..steps).map(|n| of.iter().map(|&k| term(k, n)).sum::<f64>()).sum()
        };
        let term = |kind: &CostKind| match kind {
            CostKind::Effort(of) => 0.5 * h * of_steps(of, &|k, n| value(k, n) * value(k, n)),
            CostKind::Work(of) => of_steps(of, &|k, n| {
                let along = self.unknown(k);
                let at = |n: usize| self.traveled(x, self.division.node(n), along.index);
                let [from, to] = [n, n + 1].map(at);
                value(k, n) * along.sign * (to - from)
            }),
            CostKind::Rate(of) => {
                let change = |k: usize, n: usize| {
                    if n == 0 { 0.0 } else { value(k, n) - value(k, n - 1) }
                };
                0.5 / h * of_steps(of, &|k, n| change(k, n) * change(k, n))
            }
            CostKind::Time => steps as f64 * h,
            CostKind::Number { quantity, judged, when } => {
                let at = |(n, factor, _): (usize, f64, f64)| {
                    factor * judged.cost(self.quantity(point, quantity, n))
                };
                self.counted(quantity, *when, h).into_iter().map(at).sum()
            }
        };
        self.problem.costs.iter().map(|cost| cost.weight * term(&cost.kind)).collect()
    }
}
