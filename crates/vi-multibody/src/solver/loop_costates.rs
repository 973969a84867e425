//! Closed loops on the costates of their spanning tree.
//!
//! ```text
//! Kᵀ m + J'ᵀ σ = P(q_{n+1})ᵀ c,   J m = 0      K = P(q_n)ᵀ A P(q_{n+1}),  J = G_c(q_n) P(q_n),  J' at q_{n+1}
//! (J K⁻ᵀ J'ᵀ) σ = J K⁻ᵀ P(q_{n+1})ᵀ c          complement of the rows of closure
//! Jᵀ h λ_c = P(q_n)ᵀ w                          their multipliers: w − G_cᵀ h λ_c balances along the tree
//! ```
//! `K⁻ᵀ` by the sweeps over the links, once for each independent row. Where impulses cost, `μ` is
//! `P m` beside a motion `μ_J` that the costs of joints ask for, and `J m = r − G_c μ_J`.
#![allow(non_snake_case)] // J

use super::tree_step::workspace::Workspace;
use crate::constraint::scalar_constraint::ScalarRow;
use crate::geometry::matrix::Spatial;
use crate::geometry::one_tree::HeldVector;
use nalgebra::DMatrix;
use vi_constraints::linearization::LinearizationError;
use vi_core::dense::PivotedQr;
use vi_core::interval::Interval;
use vi_core::linear::{DenseLu, Singular, dot};

/// Independent rows up to which each is eliminated on its own.
pub(super) const MOST_ROWS: usize = 24;

/// How far a row that depends on the others may be from holding, relative to its terms.
const DEPENDENT: f64 = 1e-6;

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
    wanted: Vec<f64>,      // of all rows  J m
    sizes: Vec<f64>,       // of all rows, of the terms of J m
    sigma: Vec<f64>,       // of the chosen ones
    square: DMatrix<f64>,
    lu: DenseLu,
    gradient: Vec<f64>, // n
    none: Vec<f64>,     // n
    rest: Vec<f64>,     // d
}

impl LoopCostates {
    /// For rows of closure of this rank on `n` coordinates and `d` unknowns of the tree.
    pub(super) fn new(rows: Vec<ScalarRow>, rank: usize, n: usize, d: usize) -> Self {
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
            wanted: vec![0.0; count],
            sizes: vec![0.0; count],
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
        multipliers(qr, balance, lambda)?;
        let chosen = &qr.pivots()[..*rank];
        for (row, lambda) in chosen.iter().zip(&*lambda) {
            rows[*row].add_gradient(&s.q0, -*lambda, w);
        }
        Ok(())
    }

    /// Nothing costs.
    pub(super) fn want_nothing(&mut self) {
        self.wanted.fill(0.0);
        self.sizes.fill(0.0);
    }

    /// `J m = r − G_c(q_n) μ_J` from now on; `r` over all constraints, of which these are `places`.
    pub(super) fn want(&mut self, q: &[f64], places: &[usize], r: &[f64], mu: &[f64]) {
        let Self { rows, wanted, sizes, gradient, .. } = self;
        for (((row, place), wanted), size) in rows.iter().zip(places).zip(wanted).zip(sizes) {
            gradient.fill(0.0);
            row.add_gradient(q, 1.0, gradient);
            let terms = || gradient.iter().zip(mu).map(|(slope, mu)| slope * mu);
            *wanted = r[*place] - terms().sum::<f64>();
            *size = r[*place].abs() + terms().map(f64::abs).sum::<f64>();
        }
    }

    /// Refuses costs of multipliers that are not determined: rows that depend on the others have to
    /// hold as well for the solution `m`.
    ///
    /// # Errors
    /// [`LinearizationError::Undetermined`].
    pub(super) fn check(&self, places: &[usize], m: &[f64]) -> Result<(), LinearizationError> {
        for &k in &self.qr.pivots()[self.rank..] {
            let terms = || self.start[k].iter().zip(m).map(|(slope, m)| slope * m);
            let size = self.sizes[k] + terms().map(f64::abs).sum::<f64>();
            if (terms().sum::<f64>() - self.wanted[k]).abs() > DEPENDENT * size {
                return Err(LinearizationError::Undetermined { row: places[k] });
            }
        }
        Ok(())
    }

    /// `h λ_c` of all rows, numbered as they are in `places`.
    pub(super) fn give_impulses(&self, places: &[usize], impulse: &mut [f64]) {
        places.iter().for_each(|&place| impulse[place] = 0.0);
        for (row, lambda) in self.qr.pivots().iter().zip(&self.lambda) {
            impulse[places[*row]] = *lambda;
        }
    }

    /// Adds to the right-hand side `x` of the links what the rows of closure exert: the solution
    /// then meets `J m = 0`, or what is wanted of it.
    ///
    /// # Errors
    /// [`Singular`].
    pub(super) fn constrain(
        &mut self,
        at: &mut Workspace,
        blocks: &[Spatial<HeldVector>],
        x: &mut [f64],
    ) -> Result<(), Singular> {
        let Self { rank, start, end, qr, solved, free, sigma, square, lu, rest, wanted, .. } = self;
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
            sigma[i] = wanted[*row] - dot(&start[*row], free);
        }
        lu.solve(square, sigma)?;
        for (row, sigma) in chosen.iter().zip(sigma) {
            x.iter_mut().zip(&end[*row]).for_each(|(x, own)| *x += *sigma * own);
        }
        Ok(())
    }

    /// Takes `G_c(q_{n+1})ᵀ σ` off `r`; writes `σ` of all rows, numbered as they are in `places`.
    pub(super) fn give(&self, s: &Interval, places: &[usize], r: &mut [f64], rows: &mut [f64]) {
        places.iter().for_each(|&place| rows[place] = 0.0);
        for (row, sigma) in self.qr.pivots().iter().zip(&self.sigma) {
            let sigma = sigma / s.h; // the links are solved with −h K
            self.rows[*row].add_gradient(&s.q1, -sigma, r);
            rows[places[*row]] = sigma;
        }
    }

    /// `a ← a + Σ h λ_i D²g_i(q_n) μ` of the rows of closure; `b = −μ`.
    pub(super) fn bend(&self, q: &[f64], b: &[f64], a: &mut [f64]) {
        for (row, lambda) in self.qr.pivots()[..self.rank].iter().zip(&self.lambda) {
            self.rows[*row].add_bend(q, b, -lambda, a);
        }
    }
}

/// `λ` of the first pivots with `Jᵀ λ = balance`, in least squares; `balance` becomes `Qᵀ` of it.
///
/// # Errors
/// [`Singular`] where rows that were independent are no longer.
pub(super) fn multipliers(
    qr: &PivotedQr,
    balance: &mut [f64],
    lambda: &mut [f64],
) -> Result<(), Singular> {
    qr.apply_q_transposed(balance);
    for i in (0..lambda.len()).rev() {
        let known = (i + 1..lambda.len()).map(|j| qr.factors()[(i, j)] * lambda[j]);
        lambda[i] = (balance[i] - known.sum::<f64>()) / qr.diagonal(i);
        if !lambda[i].is_finite() {
            return Err(Singular);
        }
    }
    Ok(())
}

/// `P(q)ᵀ ∇g` of all rows, by links that are open at `q`.
pub(super) fn project(
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
