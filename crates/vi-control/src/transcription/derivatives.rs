//! First and second derivatives of the program, stage by stage.
//!
//! ```text
//! A = D_2D_1L_d + D_2f^-,   B = D_1D_1L_d + D_1f^-,   C = D_1D_2L_d + D_1f^+,   D = D_2D_2L_d + D_2f^+
//! W_n = D_{n−1} + B_n − Σ hλ_i D²g_i
//! ∂r_n/∂ξ_n = Kᵀ W_n K + w_n·K_kl,   ∂r_n/∂ξ_{n+1} = Kᵀ A_n K',   ∂r_n/∂ξ_{n−1} = Kᵀ C_{n−1} K
//! ```
//! With the multipliers `y_n` of the balances, `Y_n = Σ y_j K_j`, and what the Lagrangian is by
//! `q_n` at fixed `Y`,
//! ```text
//! v_n = A_{n−1}ᵀ Y_{n−1} + W_nᵀ Y_n + C_nᵀ Y_{n+1} + Σ σ ∇g,      Y_k = Σ_j y_j K_jk
//! ∇²𝓛 (ξ_n, ξ_n)     = v_n·K_kl + Σ_j y_j w_n·K_jkl + Y_kᵀ W_n K_l + K_kᵀ W_nᵀ Y_l + K_kᵀ (Σ σ D²g) K_l
//! ∇²𝓛 (ξ_n, ξ_{n+1}) = Y_kᵀ A_n K'_l + K_kᵀ C_nᵀ Y'_l
//! ```
//! The slopes of `w` are those of [`super::piece`]: of Galerkin steps every node of the step has a
//! block with every other one, and efforts add [2.52].
//!
//! Exact beside all forces that have their second derivatives, as all of model files do.
#![allow(non_snake_case)] // K, Y, W, A, B, C, D

use super::Transcription;
use super::closure::TreeClosure;
use super::piece::{ControlEffect, ModelEffort, Piece, PieceKind, SplitResidual};
use super::point::{EvaluatedPoint, PointNode};
use super::problem::{CostKind, NodeNumber};
use crate::objective;
use nalgebra::DMatrix;
use vi_core::Slot;
use vi_core::linear::dot;
use vi_core::sparse::SparseMatrix;
use vi_multibody::form::BilinearRow;

/// Takes entries `(row, column, value)`, always in the same order.
pub(super) type EntrySink<'a> = dyn FnMut(usize, usize, f64) + 'a;

fn add_products(rows: &[(&BilinearRow, f64)], n: usize, X: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    if rows.is_empty() {
        return None;
    }
    let matrix = SparseMatrix::assemble(n, n, |out| {
        rows.iter().for_each(|(row, weight)| row.emit_second(*weight, out));
    });
    let mut out = DMatrix::zeros(n, X.ncols());
    matrix.mul_dense_add(1.0, X, &mut out);
    Some(out)
}

impl Transcription {
    /// The impulses of closures at a node with their negative sizes: what they add to `W`.
    fn closing<'a>(&'a self, point: &EvaluatedPoint, n: usize) -> Vec<(&'a BilinearRow, f64)> {
        let at = self.layout.impulse(n);
        let all = self.impulses_at(n).enumerate();
        all.filter_map(|(k, own)| Some((own.product()?, -point.x[at + k]))).collect()
    }

    /// `W_n X`, or `W_nᵀ X`, of momenta alone.
    fn own_slope(
        &self,
        point: &EvaluatedPoint,
        n: usize,
        X: &DMatrix<f64>,
        transposed: bool,
    ) -> DMatrix<f64> {
        let mut sum = SplitResidual::zero(self.n, X.ncols());
        for (p, i) in self.division.pieces_at(n) {
            sum.add(point.pieces[p].times(self, i, i, X, transposed));
        }
        sum.sum()
    }

    /// The other nodes of the pieces at a node: piece, the numbers in it of the node and of the
    /// other one.
    fn neighbours(&self, n: usize) -> impl Iterator<Item = (usize, usize, usize)> {
        let span = self.division.span();
        let others = move |(p, i)| (0..=span).filter(move |j| *j != i).map(move |j| (p, i, j));
        self.division.pieces_at(n).flat_map(others)
    }

    /// The rows of the balance at a node: row of the program, unknown.
    pub(super) fn balances_at(&self, n: usize) -> Vec<(usize, usize)> {
        if n < self.division.last() {
            return (0..self.chart.dof()).map(|j| (self.layout.balance(n) + j, j)).collect();
        }
        self.layout.rest.clone().zip(self.resting.iter().copied()).collect()
    }

    /// `∇g·K_k` of a product at a node.
    pub(super) fn slope_along(
        &self,
        point: &EvaluatedPoint,
        n: usize,
        row: &BilinearRow,
    ) -> Vec<f64> {
        let node = &point.nodes[n];
        let mut slope = vec![0.0; self.chart.dof()];
        row.for_each_slope(&node.placed.q, |i, g| {
            slope.iter_mut().enumerate().for_each(|(k, s)| *s += g * node.columns[(i, k)]);
        });
        slope
    }

    /// The derivatives of a closure by `ξ_n`, shape `d`.
    fn closure_slope(&self, point: &EvaluatedPoint, n: usize, own: &TreeClosure) -> Vec<f64> {
        match own {
            TreeClosure::Product(row) => self.slope_along(point, n, row),
            TreeClosure::Along(own) => own.slope(self.chart.dof()),
        }
    }

    /// Emits `J`.
    pub(super) fn emit_jacobian(&self, point: &EvaluatedPoint, out: &mut EntrySink<'_>) {
        for n in 0..=self.division.last() {
            let rows = self.balances_at(n);
            self.emit_balance(point, n, &rows, out);
            if n > 0 {
                let at = self.layout.coordinate(n).unwrap_or(0);
                for (k, own) in self.closures.iter().enumerate() {
                    let slope = self.closure_slope(point, n, own);
                    for (j, slope) in slope.into_iter().enumerate() {
                        out(self.layout.closure(n) + k, at + j, slope);
                    }
                }
            }
        }
        for n in 0..self.division.last() {
            for (k, &j) in self.turning.iter().enumerate() {
                for (node, sign) in [(n, -1.0), (n + 1, 1.0)] {
                    if let Some(at) = self.layout.coordinate(node) {
                        out(self.layout.turn(n) + k, at + j, sign);
                    }
                }
            }
        }
        for placed in &self.layout.conditions {
            let quantity = &self.problem.conditions[placed.condition].quantity;
            for (at, slope) in self.quantity_slope(point, quantity, placed.node) {
                out(placed.row, at, slope);
            }
        }
        self.for_each_knot(out);
    }

    /// The rows of knots: row, variable and its factor.
    pub(super) fn for_each_knot(&self, mut visit: impl FnMut(usize, usize, f64)) {
        for (k, own) in self.problem.controls.iter().enumerate() {
            let Some(knots) = self.layout.knots[k] else { continue };
            for n in 0..self.problem.steps {
                visit(knots.row + n, self.layout.control(k, n), 1.0);
                for (knot, weight) in own.knots(n) {
                    visit(knots.row + n, knots.variable + knot, -weight);
                }
            }
        }
    }

    fn emit_balance(
        &self,
        point: &EvaluatedPoint,
        n: usize,
        rows: &[(usize, usize)],
        out: &mut EntrySink<'_>,
    ) {
        let (node, d) = (&point.nodes[n], self.chart.dof());
        let K = &node.columns;
        let mut block = |at: Option<usize>, matrix: &dyn Fn() -> DMatrix<f64>| {
            let Some(at) = at else { return };
            let matrix = matrix();
            for &(row, j) in rows {
                (0..d).for_each(|k| out(row, at + k, matrix[(j, k)]));
            }
        };
        block(self.layout.coordinate(n), &|| {
            let mut W = self.own_slope(point, n, K, false);
            if let Some(of_closures) = add_products(&self.closing(point, n), self.n, K) {
                W += of_closures;
            }
            K.tr_mul(&W) + self.chart.curvature(&node.placed, &node.balance)
        });
        for (p, i, j) in self.neighbours(n) {
            let piece = &point.pieces[p];
            block(self.layout.coordinate(piece.first + j), &|| {
                let next = &point.nodes[piece.first + j].columns;
                K.tr_mul(&piece.times(self, i, j, next, false).sum())
            });
        }
        for (k, own) in self.impulses_at(n).enumerate() {
            let slope = self.closure_slope(point, n, own);
            rows.iter().for_each(|&(r, j)| out(r, self.layout.impulse(n) + k, -slope[j]));
        }
        let row_of = |j: usize| rows.iter().find(|(_, own)| *own == j).map(|(row, _)| *row);
        for (p, i) in self.division.pieces_at(n) {
            let piece = &point.pieces[p];
            for k in 0..self.problem.controls.len() {
                let control = self.acting(k, p);
                match piece.effect(self, k, i) {
                    ControlEffect::Unknown(j, value) => {
                        row_of(j).into_iter().for_each(|row| out(row, control, value));
                    }
                    ControlEffect::Force(force) => {
                        for &(row, j) in rows {
                            out(row, control, dot(&force, K.column(j).as_slice()));
                        }
                    }
                }
            }
            let PieceKind::SubStep(along) = &piece.kind else { continue };
            for own in along {
                let Some(row) = row_of(own.index) else { continue };
                for (end, slot) in Slot::BOTH.into_iter().enumerate() {
                    if let Some(at) = self.layout.coordinate(piece.first + end) {
                        out(row, at + own.index, own.effort.slopes.by_node(piece.s.h, slot));
                    }
                }
            }
        }
        if let Some(time) = self.layout.time {
            let slope = self.residual_by_step(point, n);
            let steps = self.problem.steps as f64;
            rows.iter().for_each(|&(row, j)| out(row, time, slope[j] / steps));
        }
    }

    /// `∂r_n/∂h`, `h` that of a whole step.
    fn residual_by_step(&self, point: &EvaluatedPoint, n: usize) -> Vec<f64> {
        let mut slope = point.along_columns(n, &point.nodes[n].by_step);
        for (p, _) in self.division.pieces_at(n) {
            let (gamma, piece) = (self.division.gamma(p), &point.pieces[p]);
            let PieceKind::SubStep(along) = &piece.kind else { continue };
            for (k, along) in self.efforts() {
                let value = point.x[self.acting(k, p)];
                slope[along.index] += 0.5 * gamma * along.sign * value;
            }
            for own in along {
                slope[own.index] += gamma * own.sign * own.effort.by_length();
            }
        }
        slope
    }

    /// `out ← ∇f`.
    pub(super) fn cost_slope(&self, point: &EvaluatedPoint, out: &mut [f64]) {
        out.fill(0.0);
        let (h, steps) = (point.h, self.problem.steps);
        let value = |k: usize, n: usize| point.x[self.layout.control(k, n)];
        let mut by_step = 0.0; // ∂f/∂h
        for cost in &self.problem.costs {
            let weight = cost.weight;
            match &cost.kind {
                CostKind::Effort(of) => {
                    for (n, &k) in (0..steps).flat_map(|n| of.iter().map(move |k| (n, k))) {
                        out[self.layout.control(k, n)] += weight * h * value(k, n);
                        by_step += 0.5 * weight * value(k, n) * value(k, n);
                    }
                }
                CostKind::Work(of) => {
                    for (n, &k) in (0..steps).flat_map(|n| of.iter().map(move |k| (n, k))) {
                        let along = self.unknown(k);
                        let ends = [n, n + 1].map(|n| self.division.node(n));
                        let [from, to] = ends.map(|n| self.traveled(&point.x, n, along.index));
                        out[self.layout.control(k, n)] += weight * along.sign * (to - from);
                        for (node, sign) in ends.into_iter().zip([-1.0, 1.0]) {
                            if let Some(at) = self.layout.coordinate(node) {
                                out[at + along.index] += weight * sign * along.sign * value(k, n);
                            }
                        }
                    }
                }
                CostKind::Rate(of) => {
                    for (n, &k) in (1..steps).flat_map(|n| of.iter().map(move |k| (n, k))) {
                        let change = value(k, n) - value(k, n - 1);
                        out[self.layout.control(k, n)] += weight * change / h;
                        out[self.layout.control(k, n - 1)] -= weight * change / h;
                        by_step -= 0.5 * weight * change * change / (h * h);
                    }
                }
                CostKind::Time => by_step += weight * steps as f64,
                CostKind::Number { quantity, judged, when } => {
                    for (n, factor, by_h) in self.counted(quantity, *when, h) {
                        let y = self.quantity(point, quantity, n);
                        by_step += weight * by_h * judged.cost(y);
                        for (at, slope) in self.quantity_slope(point, quantity, n) {
                            out[at] += weight * factor * judged.slope(y) * slope;
                        }
                    }
                }
            }
        }
        if let Some(time) = self.layout.time {
            out[time] += by_step / steps as f64;
        }
    }

    /// Emits `factor ∇²f + Σ λ_i ∇²g_i`, lower triangle.
    pub(super) fn emit_hessian(
        &self,
        point: &EvaluatedPoint,
        factor: f64,
        lambda: &[f64],
        out: &mut EntrySink<'_>,
    ) {
        let mut lower = |a: usize, b: usize, value: f64| {
            if a >= b { out(a, b, value) } else { out(b, a, value) }
        };
        let multipliers: Vec<Vec<f64>> = (0..=self.division.last())
            .map(|n| {
                let mut y = vec![0.0; self.chart.dof()];
                self.balances_at(n).iter().for_each(|&(row, j)| y[j] = lambda[row]);
                y
            })
            .collect();
        // Y_n and Σ_j y_j K_jk of each node
        let bent: Vec<[DMatrix<f64>; 2]> = (point.nodes.iter().zip(&multipliers))
            .map(|(node, y)| {
                let Y = &node.columns * DMatrix::from_column_slice(y.len(), 1, y);
                [Y, self.chart.bent_columns(&node.placed, y)]
            })
            .collect();
        for n in 1..=self.division.last() {
            self.emit_node_hessian(point, n, (factor, lambda), &multipliers[n], &bent, &mut lower);
        }
        for piece in 0..self.division.pieces() {
            self.emit_piece_hessian(point, piece, &multipliers, &bent, &mut lower);
        }
        if let Some(time) = self.layout.time {
            // of inertia: w_hh = 2 w/h²
            let along = |(node, [Y, _]): (&PointNode, &[DMatrix<f64>; 2])| {
                dot(Y.as_slice(), &node.inertial)
            };
            let sum: f64 = point.nodes.iter().zip(&bent).map(along).sum();
            let mut second = 2.0 * sum / (point.h * point.h);
            for (p, piece) in point.pieces.iter().enumerate() {
                let gamma = self.division.gamma(p);
                let own = piece.second_by_length(self, &self.at_nodes(piece, &bent));
                second += gamma * gamma * (own + self.along_by_step(piece, &multipliers));
            }
            lower(time, time, second / (self.problem.steps * self.problem.steps) as f64);
        }
        self.emit_cost_hessian(point, factor, &mut lower);
        self.emit_curvature(point, factor, lambda, &mut lower);
    }

    fn emit_node_hessian(
        &self,
        point: &EvaluatedPoint,
        n: usize,
        (factor, lambda): (f64, &[f64]),
        y: &[f64],
        bent: &[[DMatrix<f64>; 2]],
        out: &mut EntrySink<'_>,
    ) {
        let (node, d) = (&point.nodes[n], self.chart.dof());
        let (K, [Y, Y_k]) = (&node.columns, &bent[n]);
        let closing = self.closing(point, n);
        // W_nᵀ Y and W_n K
        let mut v = self.own_slope(point, n, Y, true);
        let mut WK = self.own_slope(point, n, K, false);
        for (sum, X) in [(&mut v, Y), (&mut WK, K)] {
            if let Some(of_closures) = add_products(&closing, self.n, X) {
                *sum += of_closures;
            }
        }
        for (p, i, j) in self.neighbours(n) {
            let piece = &point.pieces[p];
            v += piece.times(self, j, i, &bent[piece.first + j][0], true).sum();
        }
        // products with their weights: closures, conditions, deviations
        let mut products: Vec<(&BilinearRow, f64)> = Vec::new();
        for (k, own) in self.closures.iter().enumerate() {
            let row = own.product().into_iter();
            products.extend(row.map(|row| (row, lambda[self.layout.closure(n) + k])));
        }
        let mut numbers: Vec<(&dyn objective::Quantity, f64)> = Vec::new();
        for placed in self.layout.conditions.iter().filter(|placed| placed.node == n) {
            let quantity = &self.problem.conditions[placed.condition].quantity;
            if let NodeNumber::Configuration(own) = quantity {
                numbers.push((&**own, lambda[placed.row]));
            }
        }
        let mut square = DMatrix::zeros(d, d);
        for cost in &self.problem.costs {
            let CostKind::Number { quantity, judged, when } = &cost.kind else { continue };
            for (_, part, _) in
                self.counted(quantity, *when, point.h).into_iter().filter(|c| c.0 == n)
            {
                let weight = factor * cost.weight * part;
                let mut slope = vec![0.0; d];
                match quantity {
                    NodeNumber::Joint { unknown, .. } => slope[unknown.index] = unknown.sign,
                    NodeNumber::Configuration(own) => {
                        slope = self.number_along(point, n, &**own);
                        let y = self.quantity(point, quantity, n);
                        numbers.push((&**own, weight * judged.slope(y)));
                    }
                    NodeNumber::Node(_) => continue, // of a step
                }
                let slope = DMatrix::from_vec(d, 1, slope);
                square += weight * judged.bend() * &slope * slope.transpose();
            }
        }
        for (row, weight) in &products {
            row.for_each_slope(&node.placed.q, |i, slope| v[i] += weight * slope);
        }
        if let Some(bend) = add_products(&products, self.n, K) {
            square += K.tr_mul(&bend);
        }
        let at = point.configuration(n);
        for (own, weight) in numbers {
            own.add_slope(at, weight, v.as_mut_slice());
            for k in 0..d {
                let mut bend = vec![0.0; self.n];
                own.add_bend(at.moving(K.column(k).as_slice()), weight, &mut bend);
                let mut row = square.row_mut(k);
                row.iter_mut().zip(point.along_columns(n, &bend)).for_each(|(o, x)| *o += x);
            }
        }
        let mixed = Y_k.tr_mul(&WK);
        square += &mixed + mixed.transpose();
        square += self.chart.curvature(&node.placed, v.as_slice());
        square += self.chart.third_derivative(&node.placed, &node.balance, y); // [2.43]
        let at = self.layout.coordinate(n).unwrap_or(0);
        for l in 0..d {
            (l..d).for_each(|k| out(at + k, at + l, square[(k, l)]));
        }
        // (hλ_n, ξ_n)
        for (k, own) in self.impulses_at(n).enumerate() {
            let Some(row) = own.product() else { continue };
            let mut slope = vec![0.0; d];
            row.for_each_slope(&node.placed.q, |i, g| {
                slope.iter_mut().enumerate().for_each(|(j, s)| *s -= g * Y_k[(i, j)]);
            });
            for (j, slope) in slope.into_iter().enumerate() {
                let column = &K.as_slice()[j * self.n..(j + 1) * self.n];
                let bend = row.second(Y.as_slice(), column);
                out(self.layout.impulse(n) + k, at + j, slope - bend);
            }
        }
        if let Some(time) = self.layout.time {
            let mut v_h = vec![0.0; self.n];
            for (p, i) in self.division.pieces_at(n) {
                let (piece, gamma) = (&point.pieces[p], self.division.gamma(p));
                let slope = piece.slope_by_length(self, i, &self.at_nodes(piece, bent));
                v_h.iter_mut().zip(&slope).for_each(|(v, slope)| *v += gamma * slope);
            }
            for j in 0..d {
                let bent = dot(Y_k.column(j).as_slice(), &node.by_step);
                let value = bent + dot(K.column(j).as_slice(), &v_h);
                out(time, at + j, value / self.problem.steps as f64);
            }
        }
    }

    /// What couples the nodes of a piece, and what acts in it.
    fn emit_piece_hessian(
        &self,
        point: &EvaluatedPoint,
        p: usize,
        multipliers: &[Vec<f64>],
        bent: &[[DMatrix<f64>; 2]],
        out: &mut EntrySink<'_>,
    ) {
        let (d, piece) = (self.chart.dof(), &point.pieces[p]);
        let (first, last) = (piece.first, piece.first + self.division.span());
        let K: Vec<&DMatrix<f64>> =
            point.nodes[first..=last].iter().map(|node| &node.columns).collect();
        let of_forces = piece.curvature(self, &K, &self.at_nodes(piece, bent));
        for (i, j) in (0..K.len()).flat_map(|j| (0..=j).map(move |i| (i, j))) {
            let [at, next] = [i, j].map(|i| self.layout.coordinate(first + i));
            let (Some(at), Some(next)) = (at, next) else { continue };
            if i == j {
                let Some(own) = &of_forces else { continue };
                for l in 0..d {
                    (l..d).for_each(|k| out(at + k, at + l, own[i][i][(k, l)]));
                }
                continue;
            }
            let A = piece.times(self, i, j, K[j], false).sum();
            let C = piece.times(self, j, i, K[i], false).sum();
            let mut mixed = bent[first + i][1].tr_mul(&A) + C.tr_mul(&bent[first + j][1]);
            if let Some(own) = &of_forces {
                mixed += &own[i][j];
            }
            for k in 0..d {
                (0..d).for_each(|l| out(next + l, at + k, mixed[(k, l)]));
            }
        }
        for k in 0..self.problem.controls.len() {
            self.emit_effect_hessian(point, p, k, multipliers, bent, out);
        }
        let PieceKind::SubStep(along) = &piece.kind else { return };
        let ends = [(first, Slot::First), (last, Slot::Second)];
        for own in along {
            let y_sum: f64 = [first, last].iter().map(|n| multipliers[*n][own.index]).sum();
            for (i, (n, node)) in ends.iter().enumerate() {
                let Some(at) = self.layout.coordinate(*n) else { continue };
                for (m, other) in &ends[..=i] {
                    let Some(before) = self.layout.coordinate(*m) else { continue };
                    let second = own.effort.bends.by_nodes(piece.s.h, [*node, *other]);
                    out(at + own.index, before + own.index, own.sign * y_sum * second);
                }
                let Some(time) = self.layout.time else { continue };
                let by_node = own.effort.by_length_and_node(piece.s.h, *node);
                let value = self.division.gamma(p) * y_sum * by_node;
                out(time, at + own.index, value / self.problem.steps as f64);
            }
        }
    }

    /// `Y` at the nodes of a piece.
    fn at_nodes<'a>(&self, piece: &Piece, bent: &'a [[DMatrix<f64>; 2]]) -> Vec<&'a [f64]> {
        let nodes = piece.first..=piece.first + self.division.span();
        bent[nodes].iter().map(|own| own[0].as_slice()).collect()
    }

    /// The second derivative of `Σ y σ (h/2) τ` of efforts along unknowns by the length of a
    /// sub-step.
    fn along_by_step(&self, piece: &Piece, multipliers: &[Vec<f64>]) -> f64 {
        let PieceKind::SubStep(along) = &piece.kind else { return 0.0 };
        let ends = [piece.first, piece.first + self.division.span()];
        let y = |j: usize| ends.iter().map(|n| multipliers[*n][j]).sum::<f64>();
        let second = |own: &ModelEffort| own.effort.second_by_length(piece.s.h);
        along.iter().map(|own| own.sign * y(own.index) * second(own)).sum()
    }

    /// What couples the value of a control in a piece with the nodes of the piece and with the
    /// time: `∂_ξ Σ Y·∂w/∂w_k` and `∂_h` of it.
    fn emit_effect_hessian(
        &self,
        point: &EvaluatedPoint,
        p: usize,
        k: usize,
        multipliers: &[Vec<f64>],
        bent: &[[DMatrix<f64>; 2]],
        out: &mut EntrySink<'_>,
    ) {
        let (piece, control) = (&point.pieces[p], self.acting(k, p));
        let first = piece.first;
        let effects: Vec<ControlEffect> =
            (0..=self.division.span()).map(|i| piece.effect(self, k, i)).collect();
        let Y: Vec<&[f64]> = (0..effects.len()).map(|i| bent[first + i][0].as_slice()).collect();
        let slopes = piece.effect_slopes(self, k, &Y);
        let mut sum = 0.0; // Σ Y·∂w/∂w_k
        for (i, (effect, slope)) in effects.iter().zip(&slopes).enumerate() {
            let node = first + i;
            let force = match effect {
                ControlEffect::Unknown(j, value) => {
                    sum += value * multipliers[node][*j];
                    continue;
                }
                ControlEffect::Force(force) => force,
            };
            sum += dot(force, Y[i]);
            let Some(at) = self.layout.coordinate(node) else { continue };
            for j in 0..self.chart.dof() {
                let turned = dot(force, bent[node][1].column(j).as_slice());
                let value = turned + dot(slope, point.nodes[node].columns.column(j).as_slice());
                out(control, at + j, value);
            }
        }
        if let Some(time) = self.layout.time {
            out(time, control, sum / (point.h * self.problem.steps as f64));
        }
    }

    fn emit_cost_hessian(&self, point: &EvaluatedPoint, factor: f64, out: &mut EntrySink<'_>) {
        let (h, steps, time) = (point.h, self.problem.steps, self.layout.time);
        let by_time = 1.0 / steps as f64;
        let value = |k: usize, n: usize| point.x[self.layout.control(k, n)];
        for cost in &self.problem.costs {
            let weight = factor * cost.weight;
            match &cost.kind {
                CostKind::Effort(of) => {
                    for (n, &k) in (0..steps).flat_map(|n| of.iter().map(move |k| (n, k))) {
                        let at = self.layout.control(k, n);
                        out(at, at, weight * h);
                        if let Some(time) = time {
                            out(time, at, weight * value(k, n) * by_time);
                        }
                    }
                }
                CostKind::Work(of) => {
                    for (n, &k) in (0..steps).flat_map(|n| of.iter().map(move |k| (n, k))) {
                        let along = self.unknown(k);
                        for (n_end, sign) in [(n, -1.0), (n + 1, 1.0)] {
                            if let Some(at) = self.layout.coordinate(self.division.node(n_end)) {
                                let value = weight * sign * along.sign;
                                out(self.layout.control(k, n), at + along.index, value);
                            }
                        }
                    }
                }
                CostKind::Rate(of) => {
                    for (n, &k) in (1..steps).flat_map(|n| of.iter().map(move |k| (n, k))) {
                        let (now, last) =
                            (self.layout.control(k, n), self.layout.control(k, n - 1));
                        let change = value(k, n) - value(k, n - 1);
                        // one variable twice: the parts cancel
                        let mixed = if now == last { -2.0 } else { -1.0 };
                        out(now, now, weight / h);
                        out(last, last, weight / h);
                        out(now, last, mixed * weight / h);
                        if let Some(time) = time {
                            out(time, now, -weight * change / (h * h) * by_time);
                            out(time, last, weight * change / (h * h) * by_time);
                            let second = weight * change * change / (h * h * h);
                            out(time, time, second * by_time * by_time);
                        }
                    }
                }
                CostKind::Time => {}
                CostKind::Number { quantity, judged, when } => {
                    let of_step = matches!(quantity, NodeNumber::Node(_));
                    if !(of_step || time.is_some()) {
                        continue;
                    }
                    for (n, part, by_h) in self.counted(quantity, *when, h) {
                        let slopes = self.quantity_slope(point, quantity, n);
                        if of_step {
                            emit_square(&slopes, weight * part * judged.bend(), out);
                        }
                        let Some(time) = time else { continue };
                        let y = self.quantity(point, quantity, n);
                        let scale = weight * by_h * judged.slope(y) * by_time;
                        for &(at, slope) in &slopes {
                            let both = if at == time { 2.0 } else { 1.0 };
                            out(time, at, both * scale * slope);
                        }
                    }
                }
            }
        }
    }
}

/// Emits `weight ∇y ∇yᵀ`.
fn emit_square(slopes: &[(usize, f64)], weight: f64, out: &mut EntrySink<'_>) {
    for (i, &(a, of_a)) in slopes.iter().enumerate() {
        slopes[..=i].iter().for_each(|&(b, of_b)| out(a, b, weight * of_a * of_b));
    }
}
