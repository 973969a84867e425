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
//! Exact where potentials and forces beside gravity act along unknowns; of the others the third
//! derivatives are left out of `∇²𝓛`, which slows the method and moves no optimum.
#![allow(non_snake_case)] // K, Y, W, A, B, C, D

use super::Transcription;
use super::point::{Along, Point};
use super::problem::{CostKind, Quantity};
use crate::objective;
use nalgebra::DMatrix;
use vi_core::Slot;
use vi_core::force::DiscreteForce as _;
use vi_core::interval::Interval;
use vi_core::linear::dot;
use vi_core::sparse::{Block, Product, SparseMatrix};
use vi_multibody::form::Row;
use vi_rigid::load::Load;

/// Takes entries `(row, column, value)`, always in the same order.
pub(super) type Sink<'a> = dyn FnMut(usize, usize, f64) + 'a;

/// The derivatives of the discrete momenta of a step, times a matrix of columns: of inertia and of
/// the rest.
struct Slopes<'a> {
    of: &'a Transcription,
    s: &'a Interval,
    wrenches: &'a [Load],
}

/// `X ↦ (inertial part, other part)`.
struct Parts {
    inertial: DMatrix<f64>,
    other: Option<DMatrix<f64>>,
}

impl Parts {
    fn sum(self) -> DMatrix<f64> {
        match self.other {
            Some(other) => self.inertial + other,
            None => self.inertial,
        }
    }

    /// The derivative by `h`, that of a whole step: inertia goes with `1/h`, the rest with `h`.
    fn by_step(self, h: f64) -> DMatrix<f64> {
        let inertial = self.inertial * (-1.0 / h);
        match self.other {
            Some(other) => inertial + other * (1.0 / h),
            None => inertial,
        }
    }
}

impl Slopes<'_> {
    /// `D_by (D_of L_d + f_d^of) X`, or its transpose times `X`.
    fn times(&self, of: Slot, by: Slot, X: &DMatrix<f64>, transposed: bool) -> Parts {
        let (n, h) = (self.of.n, self.s.h);
        let mut inertial = DMatrix::zeros(n, X.ncols());
        self.of.mass.mul_dense_add(of.sign() * by.sign() / h, X, &mut inertial);
        let other = (self.of.has_other || !self.wrenches.is_empty()).then(|| {
            let matrix = SparseMatrix::assemble(n, n, |out| {
                if self.of.has_other {
                    self.of.system.beside_unknowns_slope(self.s, of, by, out);
                }
                self.wrenches.iter().for_each(|load| load.add_slope(self.s, of, by, out));
            });
            let mut out = DMatrix::zeros(n, X.ncols());
            for (x, o) in X.column_iter().zip(out.as_mut_slice().chunks_exact_mut(n)) {
                let x: Vec<f64> = x.iter().copied().collect();
                if transposed {
                    matrix.tr_mul_add(1.0, &x, o);
                } else {
                    matrix.mul_add(1.0, &x, o);
                }
            }
            out
        });
        Parts { inertial, other }
    }
}

fn add_products(rows: &[(&Row, f64)], n: usize, X: &DMatrix<f64>) -> Option<DMatrix<f64>> {
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
    fn slopes<'a>(&'a self, point: &'a Point, step: usize) -> Slopes<'a> {
        Slopes { of: self, s: &point.intervals[step], wrenches: &point.wrenches[step] }
    }

    /// The impulses of closures at a node with their negative sizes: what they add to `W`.
    fn closing<'a>(&'a self, point: &Point, n: usize) -> Vec<(&'a Row, f64)> {
        let at = self.layout.impulse(n);
        self.impulses_at(n).enumerate().map(|(k, row)| (row, -point.x[at + k])).collect()
    }

    /// `W_n X`, or `W_nᵀ X`, of momenta alone.
    fn own_slope(&self, point: &Point, n: usize, X: &DMatrix<f64>, transposed: bool) -> Parts {
        let mut sum = Parts { inertial: DMatrix::zeros(self.n, X.ncols()), other: None };
        for step in self.steps_at(n) {
            let slot = if step == n { Slot::First } else { Slot::Second };
            let part = self.slopes(point, step).times(slot, slot, X, transposed);
            sum.inertial += part.inertial;
            sum.other = match (sum.other, part.other) {
                (Some(a), Some(b)) => Some(a + b),
                (a, b) => a.or(b),
            };
        }
        sum
    }

    /// The rows of the balance at a node: row of the program, unknown.
    pub(super) fn balances_at(&self, n: usize) -> Vec<(usize, usize)> {
        if n < self.parts.count() {
            return (0..self.chart.dof()).map(|j| (self.layout.balance(n) + j, j)).collect();
        }
        self.layout.rest.clone().zip(self.resting.iter().copied()).collect()
    }

    /// `∇g·K_k` of a product at a node.
    pub(super) fn slope_along(&self, point: &Point, n: usize, row: &Row) -> Vec<f64> {
        let node = &point.nodes[n];
        let mut slope = vec![0.0; self.chart.dof()];
        row.for_each_slope(&node.placed.q, |i, g| {
            slope.iter_mut().enumerate().for_each(|(k, s)| *s += g * node.columns[(i, k)]);
        });
        slope
    }

    /// Emits `J`.
    pub(super) fn emit_jacobian(&self, point: &Point, out: &mut Sink<'_>) {
        for n in 0..=self.parts.count() {
            let rows = self.balances_at(n);
            self.emit_balance(point, n, &rows, out);
            if n > 0 {
                let at = self.layout.coordinate(n).unwrap_or(0);
                for (k, row) in self.closures.iter().enumerate() {
                    let slope = self.slope_along(point, n, row);
                    for (j, slope) in slope.into_iter().enumerate() {
                        out(self.layout.closure(n) + k, at + j, slope);
                    }
                }
            }
        }
        for n in 0..self.parts.count() {
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
    }

    fn emit_balance(&self, point: &Point, n: usize, rows: &[(usize, usize)], out: &mut Sink<'_>) {
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
            let mut W = self.own_slope(point, n, K, false).sum();
            if let Some(of_closures) = add_products(&self.closing(point, n), self.n, K) {
                W += of_closures;
            }
            K.tr_mul(&W) + self.chart.curvature(&node.placed, &node.balance)
        });
        if n < self.parts.count() {
            block(self.layout.coordinate(n + 1), &|| {
                let next = &point.nodes[n + 1].columns;
                let A = self.slopes(point, n).times(Slot::First, Slot::Second, next, false);
                K.tr_mul(&A.sum())
            });
        }
        if n > 0 {
            block(self.layout.coordinate(n - 1), &|| {
                let last = &point.nodes[n - 1].columns;
                let C = self.slopes(point, n - 1).times(Slot::Second, Slot::First, last, false);
                K.tr_mul(&C.sum())
            });
        }
        for (k, row) in self.impulses_at(n).enumerate() {
            let slope = self.slope_along(point, n, row);
            rows.iter().for_each(|&(r, j)| out(r, self.layout.impulse(n) + k, -slope[j]));
        }
        let row_of = |j: usize| rows.iter().find(|(_, own)| *own == j).map(|(row, _)| *row);
        for step in self.steps_at(n) {
            let h = point.intervals[step].h;
            for (k, along) in self.efforts() {
                if let Some(row) = row_of(along.index) {
                    out(row, self.acting(k, step), 0.5 * h * along.sign);
                }
            }
            for (k, load) in self.wrenches() {
                let impulse = load.half_impulse(&point.intervals[step], &node.placed.q);
                for &(row, j) in rows {
                    let value = dot(&impulse, load.of_frame(K.column(j).as_slice()));
                    out(row, self.acting(k, step), value);
                }
            }
            for own in &point.along[step] {
                let Some(row) = row_of(own.index) else { continue };
                for (slot, node) in [(Slot::First, step), (Slot::Second, step + 1)] {
                    if let Some(at) = self.layout.coordinate(node) {
                        out(row, at + own.index, own.slopes.by_node(h, slot));
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

    /// `∂w/∂h` at a node, `h` that of a whole step.
    fn balance_by_step(point: &Point, n: usize) -> Vec<f64> {
        let node = &point.nodes[n];
        node.inertial.iter().zip(&node.other).map(|(i, o)| (o - i) / point.h).collect()
    }

    /// `∂r_n/∂h`.
    fn residual_by_step(&self, point: &Point, n: usize) -> Vec<f64> {
        let (K, w_h) = (&point.nodes[n].columns, Self::balance_by_step(point, n));
        let mut slope: Vec<f64> =
            K.column_iter().map(|k| k.iter().zip(&w_h).map(|(k, w)| k * w).sum()).collect();
        for step in self.steps_at(n) {
            let (gamma, h) = (self.parts.gamma(step), point.intervals[step].h);
            for (k, along) in self.efforts() {
                let value = point.x[self.acting(k, step)];
                slope[along.index] += 0.5 * gamma * along.sign * value;
            }
            for own in &point.along[step] {
                slope[own.index] += gamma * own.sign * own.by_step(h);
            }
        }
        slope
    }

    /// `out ← ∇f`.
    pub(super) fn cost_slope(&self, point: &Point, out: &mut [f64]) {
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
                        let ends = [n, n + 1].map(|n| self.parts.node(n));
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
                CostKind::Deviation { quantity, target, when } => {
                    for (n, factor, by_h) in self.counted(*when, h) {
                        let e = self.quantity(point, quantity, n) - target;
                        by_step += 0.5 * weight * by_h * e * e;
                        for (at, slope) in self.quantity_slope(point, quantity, n) {
                            out[at] += weight * factor * e * slope;
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
        point: &Point,
        factor: f64,
        lambda: &[f64],
        out: &mut Sink<'_>,
    ) {
        let mut lower = |a: usize, b: usize, value: f64| {
            if a >= b { out(a, b, value) } else { out(b, a, value) }
        };
        let multipliers: Vec<Vec<f64>> = (0..=self.parts.count())
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
        for n in 1..=self.parts.count() {
            self.emit_node_hessian(point, n, (factor, lambda), &multipliers[n], &bent, &mut lower);
        }
        for n in 0..self.parts.count() {
            self.emit_step_hessian(point, n, &multipliers, &bent, &mut lower);
        }
        self.emit_cost_hessian(point, factor, &mut lower);
        self.emit_curvature(point, (factor, lambda), &mut lower);
    }

    fn emit_node_hessian(
        &self,
        point: &Point,
        n: usize,
        (factor, lambda): (f64, &[f64]),
        y: &[f64],
        bent: &[[DMatrix<f64>; 2]],
        out: &mut Sink<'_>,
    ) {
        let (node, d, last_node) = (&point.nodes[n], self.chart.dof(), self.parts.count());
        let (K, [Y, Y_k]) = (&node.columns, &bent[n]);
        let closing = self.closing(point, n);
        // W_nᵀ Y and W_n K
        let mut v = self.own_slope(point, n, Y, true).sum();
        let mut WK = self.own_slope(point, n, K, false).sum();
        for (sum, X) in [(&mut v, Y), (&mut WK, K)] {
            if let Some(of_closures) = add_products(&closing, self.n, X) {
                *sum += of_closures;
            }
        }
        let last = self.slopes(point, n - 1);
        v += last.times(Slot::First, Slot::Second, &bent[n - 1][0], true).sum();
        if n < last_node {
            let next = self.slopes(point, n);
            v += next.times(Slot::Second, Slot::First, &bent[n + 1][0], true).sum();
        }
        // products with their weights: closures, conditions, deviations
        let mut products: Vec<(&Row, f64)> = Vec::new();
        for (k, row) in self.closures.iter().enumerate() {
            products.push((row, lambda[self.layout.closure(n) + k]));
        }
        let mut numbers: Vec<(&dyn objective::Quantity, f64)> = Vec::new();
        for placed in self.layout.conditions.iter().filter(|placed| placed.node == n) {
            let quantity = &self.problem.conditions[placed.condition].quantity;
            if let Quantity::Configuration(own) = quantity {
                numbers.push((&**own, lambda[placed.row]));
            }
        }
        let mut square = DMatrix::zeros(d, d);
        for cost in &self.problem.costs {
            let CostKind::Deviation { quantity, target, when } = &cost.kind else { continue };
            for (_, part, _) in self.counted(*when, point.h).into_iter().filter(|c| c.0 == n) {
                let weight = factor * cost.weight * part;
                let mut slope = vec![0.0; d];
                match quantity {
                    Quantity::Joint { unknown, .. } => slope[unknown.index] = unknown.sign,
                    Quantity::Configuration(own) => {
                        slope = self.number_along(point, n, &**own);
                        let e = self.quantity(point, quantity, n) - target;
                        numbers.push((&**own, weight * e));
                    }
                    Quantity::Node(_) => continue, // of a step
                }
                let slope = DMatrix::from_vec(d, 1, slope);
                square += weight * &slope * slope.transpose();
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
            let second =
                |k: usize, l: usize| own.second(at, K.column(k).as_slice(), K.column(l).as_slice());
            square += weight * DMatrix::from_fn(d, d, second);
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
        for (k, row) in self.impulses_at(n).enumerate() {
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
            let w_h = Self::balance_by_step(point, n);
            let mut v_h = self.own_slope(point, n, Y, true).by_step(point.h);
            v_h += last.times(Slot::First, Slot::Second, &bent[n - 1][0], true).by_step(point.h);
            if n < last_node {
                let next = self.slopes(point, n);
                let part = next.times(Slot::Second, Slot::First, &bent[n + 1][0], true);
                v_h += part.by_step(point.h);
            }
            for j in 0..d {
                let bent: f64 = Y_k.column(j).iter().zip(&w_h).map(|(y, w)| y * w).sum();
                let value = bent + K.column(j).dot(&v_h.column(0));
                out(time, at + j, value / self.problem.steps as f64);
            }
        }
    }

    /// What couples both nodes of a sub-step, and its efforts.
    fn emit_step_hessian(
        &self,
        point: &Point,
        n: usize,
        multipliers: &[Vec<f64>],
        bent: &[[DMatrix<f64>; 2]],
        out: &mut Sink<'_>,
    ) {
        let (d, steps, h) = (self.chart.dof(), self.problem.steps as f64, point.h);
        let (from, to) = (&point.nodes[n], &point.nodes[n + 1]);
        let step = self.slopes(point, n);
        if let (Some(at), Some(next)) = (self.layout.coordinate(n), self.layout.coordinate(n + 1)) {
            let A = step.times(Slot::First, Slot::Second, &to.columns, false).sum();
            let C = step.times(Slot::Second, Slot::First, &from.columns, false).sum();
            let mixed = bent[n][1].tr_mul(&A) + C.tr_mul(&bent[n + 1][1]);
            for k in 0..d {
                (0..d).for_each(|l| out(next + l, at + k, mixed[(k, l)]));
            }
        }
        for (k, load) in self.wrenches() {
            self.emit_wrench_hessian(point, n, (k, load), bent, out);
        }
        let Some(time) = self.layout.time else { return };
        let gamma = self.parts.gamma(n);
        let y_sum = |j: usize| multipliers[n][j] + multipliers[n + 1][j];
        // of inertia: w_hh = ±2 M Δq/(γ h³)
        let (mut change, s) = (vec![0.0; self.n], &point.intervals[n]);
        self.system.inertia().mul_add(2.0 / (s.h * h * h), &s.dq, &mut change);
        let along = |Y: &DMatrix<f64>| -> f64 { Y.iter().zip(&change).map(|(y, c)| y * c).sum() };
        out(time, time, (along(&bent[n + 1][0]) - along(&bent[n][0])) / (steps * steps));
        for (k, along) in self.efforts() {
            let value = 0.5 * gamma * along.sign * y_sum(along.index);
            out(time, self.acting(k, n), value / steps);
        }
        for own in &point.along[n] {
            for node in [n, n + 1] {
                if let Some(at) = self.layout.coordinate(node) {
                    let value = 0.25 * gamma * own.slopes.by_coordinate * y_sum(own.index);
                    out(time, at + own.index, value / steps);
                }
            }
        }
    }

    /// What couples the value of a wrench in a sub-step with both nodes and with the time:
    /// `∂_ξ Σ Y·f^±` and `∂_h` of it.
    fn emit_wrench_hessian(
        &self,
        point: &Point,
        n: usize,
        (k, load): (usize, &Load),
        bent: &[[DMatrix<f64>; 2]],
        out: &mut Sink<'_>,
    ) {
        let (s, control) = (&point.intervals[n], self.acting(k, n));
        let impulses = Slot::BOTH.map(|of| load.half_impulse(s, s.node(of)));
        for (by, node) in Slot::BOTH.into_iter().zip([n, n + 1]) {
            let Some(at) = self.layout.coordinate(node) else { continue };
            let mut slope = vec![0.0; self.n]; // Σ (D_by f^of)ᵀ Y_of
            for (of, from) in Slot::BOTH.into_iter().zip([n, n + 1]) {
                let (row, column, scale, transposed) = (0, 0, 1.0, true);
                let mut product = Product { v: bent[from][0].as_slice(), out: &mut slope };
                let into = &mut product;
                load.add_slope(s, of, by, &mut Block { into, row, column, scale, transposed });
            }
            let (own, impulse) = (&point.nodes[node], &impulses[node - n]);
            for j in 0..self.chart.dof() {
                let turned = dot(impulse, load.of_frame(bent[node][1].column(j).as_slice()));
                let value = turned + dot(&slope, own.columns.column(j).as_slice());
                out(control, at + j, value);
            }
        }
        if let Some(time) = self.layout.time {
            let along = |i: usize| dot(&impulses[i], load.of_frame(bent[n + i][0].as_slice()));
            let sum: f64 = [0, 1].map(along).iter().sum();
            out(time, control, sum / (point.h * self.problem.steps as f64));
        }
    }

    fn emit_cost_hessian(&self, point: &Point, factor: f64, out: &mut Sink<'_>) {
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
                            if let Some(at) = self.layout.coordinate(self.parts.node(n_end)) {
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
                CostKind::Deviation { quantity, target, when } => {
                    let of_step = matches!(quantity, Quantity::Node(_));
                    if !(of_step || time.is_some()) {
                        continue;
                    }
                    for (n, part, by_h) in self.counted(*when, h) {
                        let slopes = self.quantity_slope(point, quantity, n);
                        if of_step {
                            emit_square(&slopes, weight * part, out);
                        }
                        let Some(time) = time else { continue };
                        let e = self.quantity(point, quantity, n) - target;
                        let scale = weight * by_h * e * by_time;
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
fn emit_square(slopes: &[(usize, f64)], weight: f64, out: &mut Sink<'_>) {
    for (i, &(a, of_a)) in slopes.iter().enumerate() {
        slopes[..=i].iter().for_each(|&(b, of_b)| out(a, b, weight * of_a * of_b));
    }
}

impl Along {
    /// `∂/∂h` of `(h/2) τ(θ̄, Δθ/h)`.
    fn by_step(&self, h: f64) -> f64 {
        0.5 * self.effort - 0.5 * self.slopes.by_rate * self.change / h
    }
}
