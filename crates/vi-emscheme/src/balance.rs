//! What the forms with a discrete null space share: bracket, multipliers, tangent of one step.
//!
//! ```text
//! r  = P̄ᵀ h B                                           balance without multipliers
//! [ I  Ḡᵀ ] [c]   [ −h B ]
//! [ Ḡ  0  ] [μ] = [  0   ]                              μ = h²λ; c = 0 at the root
//! K̃  = h K + ½ Σ_i μ_i D²g_i                             ∂r/∂q_{n+1} = P̄ᵀ K̃
//! ```
//! Letters and derivation: [`crate::null_space`].

use crate::em_system::EmSystem;
use crate::scheme::EmState;
use nalgebra::DMatrix;
use vi_constraints::Constraints;
use vi_constraints::saddle_point::{IndependentRows, SaddlePoint};
use vi_core::interval::Interval;
use vi_core::linear::Singular;
use vi_core::sparse::{Entries, SparseMatrix};

/// One step's balance in the null space.
pub(crate) struct Balance {
    pub(crate) s: Interval,
    /// `P̄`, shape `n × d`.
    pub(crate) null_space: DMatrix<f64>,
    /// `h²λ` over all constraints, shape `m`.
    pub(crate) mu: Vec<f64>,
    /// `K̃`, shape `n × n`.
    tangent: Option<SparseMatrix>,
    v: Vec<f64>,       // n  v_n
    bracket: Vec<f64>, // n  h B
    work: Vec<f64>,    // n
    x: Vec<f64>,       // n + r
    least_squares: SaddlePoint,
}

impl Balance {
    /// For `n` coordinates, an independent set of `m` constraints.
    pub(crate) fn new(n: usize, (rows, m): (IndependentRows, usize)) -> Self {
        let r = rows.len();
        let zeros = |k: usize| vec![0.0; k];
        Self {
            s: Interval::new(n),
            null_space: DMatrix::zeros(n, n - r),
            mu: zeros(m),
            tangent: None,
            v: zeros(n),
            bracket: zeros(n),
            work: zeros(n),
            x: zeros(n + r),
            least_squares: SaddlePoint::new(n, rows),
        }
    }

    /// The constraints in use.
    pub(crate) fn rows(&self) -> &IndependentRows {
        self.least_squares.rows()
    }

    /// Opens a step of length `h` at the state.
    pub(crate) fn open(&mut self, state: &EmState, h: f64) {
        self.s.open(state.t, h, &state.q);
        self.v.copy_from_slice(&state.v);
    }

    /// `out ← P̄ᵀ h B` for the interval and the `P̄` written before.
    pub(crate) fn residual(&mut self, system: &EmSystem, out: &mut [f64]) {
        system.scaled_bracket(&self.s, &self.v, &mut self.work, &mut self.bracket);
        for (r, column) in out.iter_mut().zip(self.null_space.column_iter()) {
            *r = column.iter().zip(&self.bracket).map(|(p, b)| p * b).sum();
        }
    }

    /// `μ` from the bracket of the last residual, in least squares.
    pub(crate) fn multipliers(&mut self, constraints: &impl Constraints) -> Result<(), Singular> {
        let n = self.s.dim();
        for (x, b) in self.x.iter_mut().zip(&self.bracket) {
            *x = -b;
        }
        self.x[n..].fill(0.0);
        let identity = |out: &mut dyn Entries| (0..n).for_each(|i| out.add(i, i, 1.0));
        let at = (self.s.t_mid(), &self.s.q_mid[..]);
        self.least_squares.solve(constraints, &identity, (at, 1.0, at), &mut self.x)?;
        self.least_squares.rows().scatter(&self.x[n..], &mut self.mu);
        Ok(())
    }

    /// `K̃` at the point of the last residual.
    pub(crate) fn tangent(
        &mut self,
        system: &EmSystem,
        constraints: &impl Constraints,
    ) -> Result<&SparseMatrix, Singular> {
        self.multipliers(constraints)?;
        let (n, s, mu) = (self.s.dim(), &self.s, &self.mu);
        let emit = |out: &mut dyn Entries| {
            system.scaled_bracket_derivative(s, out);
            constraints.weighted_hessian(s.t_mid(), &s.q_mid, mu, 0.5, out);
        };
        match &mut self.tangent {
            Some(tangent) => tangent.refill(emit),
            None => self.tangent = Some(SparseMatrix::assemble(n, n, emit)),
        }
        Ok(self.tangent.as_ref().expect("just written"))
    }

    /// The tangent last written, the null space matrix, and a scratch vector of shape `n`.
    pub(crate) fn parts(&mut self) -> (&SparseMatrix, &DMatrix<f64>, &mut [f64]) {
        let tangent = self.tangent.as_ref().expect("written by `tangent`");
        (tangent, &self.null_space, &mut self.work)
    }
}
