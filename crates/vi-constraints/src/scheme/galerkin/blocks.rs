//! The equations of a Galerkin step, differentiated block by block.
//!
//! ```text
//! h H_ij = h ∂w_i/∂q_j − δ_ij h Σ_c Λ_ic D²g_c(q_i)                       w_i = G(q_i)ᵀ Λ_i, i < s
//!        = K_ij M + Σ_k b_k E_ki (h² E_kj F_q + h D_kj F_v)(Q_k, V_k) − …,   F = f − ∇V            [2.31]
//! h ∂w_i/∂z_k = h² b_k E_ki F_z(Q_k, V_k, z_k)
//! collocation [2.36]:   z_k − h Σ_j A_kj φ(Q_j, V_j, z_j) = z_n,   z_{n+1} = z_n + h Σ_k b_k φ(Q_k, V_k, z_k)
//! ```
//! Interpolated strains add to `h H_ij` what they are.
#![allow(non_snake_case)] // A, D, E, F, H, K, M

use super::control_points::ControlPoints;
use super::gauss_slopes::GaussSlopes;
use crate::constraints::Constraints;
use crate::least_norm::LeastNorm;
use crate::saddle_point::{JacobianPlace, SaddlePoint};
use vi_core::Configuration;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::galerkin::Stages;
use vi_core::interval::Interval;
use vi_core::linear::Singular;
use vi_core::signals::StateRates;
use vi_core::sparse::{Block, Entries, SparseMatrix};

/// The derivatives of a step at its solution.
#[derive(Debug)]
pub(super) struct Blocks {
    pub(super) points: ControlPoints,
    pub(super) multiplier: SaddlePoint, // [I Gᵀ; G 0]
    least: LeastNorm,                   // the same where no row is redundant
    jacobian: Option<SparseMatrix>,     // m × n  G
    pub(super) impulses: Vec<Vec<f64>>, // s × m  Λ_i
    pub(super) states: Vec<StateRates>, // s  where there are continuous states; else none
    slopes: GaussSlopes,
    by_state: Vec<Option<SparseMatrix>>, // s  F_z, n × internal variables
    w: Vec<f64>,                         // n
    x: Vec<f64>,                         // n + r
    none: Vec<f64>,                      // m
}

fn placed(row: usize, column: usize, scale: f64, out: &mut dyn Entries) -> Block<'_> {
    Block { into: out, row, column, scale, transposed: false }
}

fn scaled(scale: f64, out: &mut dyn Entries) -> Block<'_> {
    placed(0, 0, scale, out)
}

impl Blocks {
    pub(super) fn new(n: usize, m: usize, stages: Stages, multiplier: SaddlePoint) -> Self {
        let s = stages.count();
        Self {
            points: ControlPoints::new(n, stages),
            impulses: vec![vec![0.0; m]; s],
            states: Vec::new(),
            slopes: GaussSlopes::new(stages),
            by_state: (0..s).map(|_| None).collect(),
            w: vec![0.0; n],
            x: vec![0.0; n + multiplier.rows().len()],
            none: vec![0.0; m],
            multiplier,
            least: LeastNorm::default(),
            jacobian: None,
        }
    }

    /// `(t, q)` of control point `i`.
    pub(super) fn at(&self, i: usize) -> Configuration<'_> {
        Configuration::new(self.points.time(i), self.points.q(i))
    }

    /// Coordinates, control points, independent constraints, continuous states.
    pub(super) fn shape(&self) -> (usize, usize, usize, usize) {
        let states = self.states.first().map_or(0, |own| own.places.len());
        (self.w.len(), self.points.stages(), self.multiplier.rows().len(), states)
    }

    /// Unknowns of a linearized step.
    pub(super) fn size(&self) -> usize {
        let (n, s, r, m) = self.shape();
        s * (n + r + m)
    }

    /// Emits the matrix of a linearized step, in the order `δq_j`, `h δΛ_i`, `δz_k`: momentum rows
    /// times `h`; always the same places in the same order.
    pub(super) fn emit(
        &self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        out: &mut dyn Entries,
    ) {
        let (n, s, r, m) = self.shape();
        let (rows, states) = (self.multiplier.rows(), s * (n + r));
        for i in 0..s {
            let row = i * n;
            for j in 0..s {
                let mut block = placed(row, j * n, 1.0, out);
                self.balance(system, constraints, i, j + 1, &mut block);
                self.by_state(i, j, &mut placed(row, states + j * m, 1.0, out));
            }
            let multiplier = s * n + i * r;
            let place = JacobianPlace { row, column: multiplier, scale: -1.0, transposed: true };
            rows.emit_jacobian(constraints, self.at(i), place, out);
            let place =
                JacobianPlace { row: multiplier, column: row, scale: 1.0, transposed: false };
            rows.emit_jacobian(constraints, self.at(i + 1), place, out);
        }
        for (k, j) in (0..s).flat_map(|k| (0..s).map(move |j| (k, j))).filter(|_| m > 0) {
            let (row, A) = (states + k * m, &self.points.constants().A);
            self.rates_by_point(|l| A[(k, l)], j + 1, &mut placed(row, j * n, -1.0, out));
            self.rates_by_state(j, -A[(k, j)], &mut placed(row, states + j * m, 1.0, out));
            if k == j {
                (row..row + m).for_each(|row| out.add(row, row, 1.0));
            }
        }
    }

    /// At the control points of a step from the momentum `p̄_n`. Returns whether other rows of
    /// redundant constraints were chosen.
    ///
    /// # Errors
    /// [`Singular`].
    pub(super) fn differentiate(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        points: &[Interval],
        p: &[f64],
    ) -> Result<bool, Singular> {
        self.points.take(points, p);
        self.points.evaluate(system);
        let chosen = self.find_impulses(system, constraints)?;
        let Self { points, states, slopes, by_state, .. } = self;
        let (n, s, internal) = (system.dim(), points.step(), system.internal_variables());
        slopes.differentiate(system, points);
        states.clear();
        for (node, by_state) in points.gauss().iter().zip(by_state) {
            let at = node.place(s);
            if let Some(rates) = system.state_rates(at.moving(&node.v)) {
                let emit = |out: &mut dyn Entries| system.state_slopes(at.moving(&node.v), out);
                SparseMatrix::update(by_state, (n, internal), emit);
                states.push(rates);
            }
        }
        Ok(chosen)
    }

    /// `Λ_i` from `w_i = G(q_i)ᵀ Λ_i`, with rows that stay clearly independent.
    fn find_impulses(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
    ) -> Result<bool, Singular> {
        let found = self.solve_impulses(system, constraints);
        if found == Ok(false) {
            return Ok(false);
        }
        let (t, q) = (self.points.time(0), self.points.q(0));
        if self.multiplier.choose(constraints, t, q) {
            return self.solve_impulses(system, constraints).map(|_| true);
        }
        found.map(|_| false)
    }

    /// The same with the present rows; whether they are worn.
    fn solve_impulses(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
    ) -> Result<bool, Singular> {
        let Self { points, multiplier, least, jacobian, impulses, w, x, none, .. } = self;
        let (n, m) = (w.len(), none.len());
        let independent = multiplier.rows().len() == m;
        let identity = |out: &mut dyn Entries| (0..n).for_each(|i| out.add(i, i, 1.0));
        let mut worn = false;
        for (i, impulse) in impulses.iter_mut().enumerate() {
            points.balance(system, i, w);
            let at = Configuration::new(points.time(i), points.q(i));
            let emit = |out: &mut dyn Entries| constraints.jacobian(at.t, at.q, out);
            if independent
                && least.solve(SparseMatrix::update(jacobian, (m, n), emit), w, impulse).is_ok()
            {
                continue;
            }
            let (upper, lower) = x.split_at_mut(n);
            upper.copy_from_slice(w);
            multiplier.rows().gather(none, lower);
            multiplier.solve(constraints, &identity, at, 1.0, at, x)?;
            multiplier.rows().scatter(&x[n..], impulse);
            worn |= multiplier.is_worn();
        }
        Ok(worn)
    }

    /// Emits `h H_ij`; for each always the same places in the same order.
    pub(super) fn balance(
        &self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        i: usize,
        j: usize,
        out: &mut dyn Entries,
    ) {
        let (constants, h) = (self.points.constants(), self.points.h());
        system.mass().emit(&mut scaled(constants.K[(i, j)], out));
        self.slopes.emit(system, &self.points, i, j, out);
        if i == j && i < self.impulses.len() {
            let Configuration { t, q, .. } = self.at(i);
            constraints.weighted_hessian(t, q, &self.impulses[i], -h, out);
        }
    }

    /// Emits `h ∂w_i/∂z_k`, columns of continuous states; always the same places in the same order.
    pub(super) fn by_state(&self, i: usize, k: usize, out: &mut dyn Entries) {
        let (constants, h) = (self.points.constants(), self.points.h());
        let (Some(own), Some(slopes)) = (self.states.get(k), &self.by_state[k]) else { return };
        let weight = h * h * constants.gauss_weights[k] * constants.E[(k, i)];
        for (column, place) in own.places.iter().enumerate() {
            slopes.column(*place).for_each(|(row, slope)| out.add(row, column, weight * slope));
        }
    }

    /// Emits the derivative of `h Σ_j weight_j φ_j` by `q_l`, rows of continuous states.
    pub(super) fn rates_by_point(
        &self,
        weight: impl Fn(usize) -> f64,
        l: usize,
        out: &mut dyn Entries,
    ) {
        let (constants, h) = (self.points.constants(), self.points.h());
        for (j, own) in self.states.iter().enumerate() {
            let parts = [h * constants.E[(j, l)], constants.D[(j, l)]].map(|by| weight(j) * by);
            let (m, n) = own.by_position.shape();
            for (row, column) in (0..m).flat_map(|row| (0..n).map(move |column| (row, column))) {
                let at = (row, column);
                let slope = parts[0] * own.by_position[at] + parts[1] * own.by_velocity[at];
                out.add(row, column, slope);
            }
        }
    }

    /// Emits the derivative of `h φ_k` by `z_k`, scaled.
    pub(super) fn rates_by_state(&self, k: usize, scale: f64, out: &mut dyn Entries) {
        let slopes = &self.states[k].by_state;
        let m = slopes.nrows();
        for (row, column) in (0..m).flat_map(|row| (0..m).map(move |column| (row, column))) {
            out.add(row, column, scale * self.points.h() * slopes[(row, column)]);
        }
    }
}
