//! Closed loops on the costates of their spanning tree.
//!
//! ```text
//! Kᵀ m + J'ᵀ σ = P(q_{n+1})ᵀ c,   J m = 0      K = P(q_n)ᵀ A P(q_{n+1}),  J = G_c(q_n) P(q_n),  J' at q_{n+1}
//! (J K⁻ᵀ J'ᵀ) σ = J K⁻ᵀ P(q_{n+1})ᵀ c          complement of the rows of closure
//! Jᵀ h λ_c = P(q_n)ᵀ w                          their multipliers: w − G_cᵀ h λ_c balances along the tree
//! ```
//! `K⁻ᵀ` by the sweeps over the links, once for each independent row.
#![allow(non_snake_case)] // J

use super::tree_step::workspace::Workspace;
use crate::constraint::scalar_constraint::ScalarRow;
use crate::geometry::matrix::Spatial;
use crate::geometry::one_tree::Held;
use nalgebra::DMatrix;
use vi_core::dense::PivotedQr;
use vi_core::interval::Interval;
use vi_core::linear::{DenseLu, Singular, dot};

/// Independent rows up to which each is eliminated on its own.
pub(super) const MOST_ROWS: usize = 24;

/// The rows of closure during a step backward.
#[derive(Debug)]
pub(super) struct LoopCostates {
    rows: Vec<ScalarRow>,
    rank: usize,
    start: Vec<Vec<f64>>,  // of all rows, d  Jᵀ
    end: Vec<Vec<f64>>,    // of all rows, d  J'ᵀ
    qr: PivotedQr,         // d × rows  Jᵀ; its first pivots are the chosen rows
    solved: Vec<Vec<f64>>, // of the chosen ones, d  K⁻ᵀ J'ᵀ
    free: Vec<f64>,        // d  K⁻ᵀ P(q_{n+1})ᵀ c
    balance: Vec<f64>,     // d  P(q_n)ᵀ w
    lambda: Vec<f64>,      // of the chosen ones  h λ_c
    sigma: Vec<f64>,       // of the chosen ones
    square: DMatrix<f64>,
    lu: DenseLu,
    gradient: Vec<f64>, // n
    none: Vec<f64>,     // n
    rest: Vec<f64>,     // d
}

impl LoopCostates {
    /// For rows of closure of this rank on `n` coordinates and `d` unknowns of the tree.
    pub(super) fn new(rows: Vec<ScalarRow>, rank: usize, (n, d): (usize, usize)) -> Self {
        let (zeros, count) = (vec![0.0; d], rows.len());
        Self {
            rank,
            start: vec![zeros.clone(); count],
            end: vec![zeros.clone(); count],
            qr: PivotedQr::new(d, count),
            solved: vec![zeros.clone(); rank],
            free: zeros.clone(),
            balance: zeros.clone(),
            lambda: vec![0.0; rank],
            sigma: vec![0.0; rank],
            square: DMatrix::zeros(rank, rank),
            lu: DenseLu::new(rank),
            gradient: vec![0.0; n],
            none: vec![0.0; n],
            rest: zeros,
            rows,
        }
    }

    /// `P(q_n)ᵀ w`, to which what acts along unknowns is added, and `J`.
    pub(super) fn stand(&mut self, at: &mut Workspace, q: &[f64], w: &[f64]) -> &mut [f64] {
        let Self { rows, start, balance, gradient, none, .. } = self;
        at.open([q, none, none]);
        at.pull_back_of(q, w, balance);
        project(at, rows, q, gradient, start);
        balance
    }

    /// `J'` of links that are open at `q_{n+1}`; takes `G_cᵀ h λ_c` off `w`.
    ///
    /// # Errors
    /// [`Singular`] where rows that were independent are no longer.
    pub(super) fn balance(
        &mut self,
        at: &mut Workspace,
        s: &Interval,
        w: &mut [f64],
    ) -> Result<(), Singular> {
        let Self { rows, rank, start, end, qr, lambda, balance, .. } = self;
        project(at, rows, &s.q1, &mut self.gradient, end);
        for (k, start) in start.iter().enumerate() {
            let own = k * start.len()..(k + 1) * start.len();
            qr.matrix_mut().as_mut_slice()[own].copy_from_slice(start);
        }
        qr.factorize();
        qr.apply_q_transposed(balance);
        for i in (0..*rank).rev() {
            let known = (i + 1..*rank).map(|j| qr.factors()[(i, j)] * lambda[j]);
            lambda[i] = (balance[i] - known.sum::<f64>()) / qr.diagonal(i);
            if !lambda[i].is_finite() {
                return Err(Singular);
            }
        }
        let chosen = &qr.pivots()[..*rank];
        for (row, lambda) in chosen.iter().zip(&*lambda) {
            rows[*row].add_gradient(&s.q0, -*lambda, w);
        }
        Ok(())
    }

    /// Adds to the right-hand side `x` of the links what the rows of closure exert: the solution
    /// then meets `J m = 0`.
    ///
    /// # Errors
    /// [`Singular`].
    pub(super) fn constrain(
        &mut self,
        at: &mut Workspace,
        blocks: &[Spatial<Held>],
        x: &mut [f64],
    ) -> Result<(), Singular> {
        let Self { rank, start, end, qr, solved, free, sigma, square, lu, rest, .. } = self;
        let chosen = &qr.pivots()[..*rank];
        let mut solve = |x: &mut [f64]| at.solve(blocks, rest, x).map_err(|_| Singular);
        free.copy_from_slice(x);
        solve(free)?;
        for (row, solved) in chosen.iter().zip(&mut *solved) {
            solved.copy_from_slice(&end[*row]);
            solve(solved)?;
        }
        for (i, row) in chosen.iter().enumerate() {
            for (j, solved) in solved.iter().enumerate() {
                square[(i, j)] = dot(&start[*row], solved);
            }
            sigma[i] = -dot(&start[*row], free);
        }
        lu.solve(square, sigma)?;
        for (row, sigma) in chosen.iter().zip(sigma) {
            x.iter_mut().zip(&end[*row]).for_each(|(x, own)| *x += *sigma * own);
        }
        Ok(())
    }

    /// Takes `G_c(q_{n+1})ᵀ σ` off `r`; writes `h λ_c` and `σ` of all rows, numbered as they are in
    /// `places`.
    pub(super) fn give(
        &self,
        s: &Interval,
        places: &[usize],
        r: &mut [f64],
        [impulse, rows]: [&mut [f64]; 2],
    ) {
        places.iter().for_each(|&place| (impulse[place], rows[place]) = (0.0, 0.0));
        let chosen = &self.qr.pivots()[..self.rank];
        for ((row, lambda), sigma) in chosen.iter().zip(&self.lambda).zip(&self.sigma) {
            let sigma = sigma / s.h; // the links are solved with −h K
            self.rows[*row].add_gradient(&s.q1, -sigma, r);
            (impulse[places[*row]], rows[places[*row]]) = (*lambda, sigma);
        }
    }

    /// `a ← a + Σ h λ_i D²g_i(q_n) μ` of the rows of closure; `b = −μ`.
    pub(super) fn bend(&self, q: &[f64], b: &[f64], a: &mut [f64]) {
        for (row, lambda) in self.qr.pivots()[..self.rank].iter().zip(&self.lambda) {
            self.rows[*row].add_bend(q, b, -lambda, a);
        }
    }
}

/// `P(q)ᵀ ∇g` of all rows, by links that are open at `q`.
fn project(
    at: &mut Workspace,
    rows: &[ScalarRow],
    q: &[f64],
    gradient: &mut [f64],
    out: &mut [Vec<f64>],
) {
    for (row, out) in rows.iter().zip(out) {
        gradient.fill(0.0);
        row.add_gradient(q, 1.0, gradient);
        at.pull_back_of(q, gradient, out);
    }
}
