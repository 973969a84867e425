//! What the forms with a discrete null space share: bracket, multipliers, tangent of one step.
//!
//! ```text
//! [ I  Ḡᵀ ] [c]   [ −h B ]
//! [ Ḡ  0  ] [μ] = [  0   ]                 μ = h²λ in least squares; −c = h B + Ḡᵀμ, zero at the root
//! r  = P̄ᵀ h B                              on the constraint manifold,   −P̄ᵀ c  anywhere
//! K̃  = h K + Σ_i μ_i ∂Ḡ_iᵀ/∂q_{n+1}        ∂r/∂q_{n+1} = P̄ᵀ K̃
//! ```
//! Letters and derivation: [`crate::null_space`].

use crate::constraint::DiscreteConstraints;
use crate::em_system::{EmSystem, Velocity};
use nalgebra::DMatrix;
use vi_constraints::reparametrization::pull_back;
use vi_constraints::saddle_point::{IndependentRows, SaddlePoint};
use vi_constraints::scheme::SubStep;
use vi_core::interval::Interval;
use vi_core::linear::Singular;
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::state::{Memory, State};
use vi_multibody::tree_multipliers::TreeMultipliers;

/// How the multipliers of an iterate are found; any `μ_k` that tends to `μ*` serves.
#[derive(Debug)]
pub(crate) enum MultiplierRule {
    /// In least squares over the system, for an independent set of constraints.
    LeastSquares(Box<SaddlePoint>),
    /// Frame by frame, on a tree of bodies, where all constraints are independent.
    Tree(TreeMultipliers),
}

/// One step's balance in the null space.
#[derive(Debug)]
pub(crate) struct Balance {
    pub(crate) s: Interval,
    /// `P̄`, shape `n × d`, of the forms that keep it as a matrix.
    pub(crate) null_space: DMatrix<f64>,
    /// `h²λ` over all constraints, shape `m`.
    pub(crate) mu: Vec<f64>,
    /// `K̃`, shape `n × n`.
    tangent: Option<SparseMatrix>,
    v: Velocity,
    bracket: Vec<f64>,              // n  h B
    work: Vec<f64>,                 // n
    x: Vec<f64>,                    // n + r
    jacobian: Option<SparseMatrix>, // m × n  Ḡ
    rows: IndependentRows,
    solver: MultiplierRule,
}

impl Balance {
    /// For `n` coordinates, an independent set of `m` constraints.
    pub(crate) fn new(n: usize, rows: IndependentRows, m: usize) -> Self {
        let r = rows.len();
        let zeros = |k: usize| vec![0.0; k];
        Self {
            s: Interval::new(n),
            null_space: DMatrix::zeros(n, n - r),
            mu: zeros(m),
            tangent: None,
            v: Velocity::new(n),
            bracket: zeros(n),
            work: zeros(n),
            x: zeros(n + r),
            jacobian: None,
            solver: MultiplierRule::LeastSquares(Box::new(SaddlePoint::new(n, rows.clone()))),
            rows,
        }
    }

    /// With the multipliers of a tree, where there is one.
    pub(crate) fn on_tree(mut self, tree: Option<TreeMultipliers>) -> Self {
        if let Some(tree) = tree {
            self.solver = MultiplierRule::Tree(tree);
        }
        self
    }

    /// Without a matrix for `P̄`.
    pub(crate) fn without_matrix(mut self) -> Self {
        self.null_space = DMatrix::zeros(0, 0);
        self
    }

    /// The constraints in use.
    pub(crate) fn rows(&self) -> &IndependentRows {
        match &self.solver {
            MultiplierRule::LeastSquares(saddle) => saddle.rows(),
            MultiplierRule::Tree(_) => &self.rows,
        }
    }

    /// Another independent set of the same size, where it differs.
    pub(crate) fn take_rows(&mut self, rows: &IndependentRows) {
        debug_assert_eq!(rows.len(), self.rows().len());
        if rows != self.rows() {
            let saddle = SaddlePoint::new(self.s.dim(), rows.clone());
            self.solver = MultiplierRule::LeastSquares(Box::new(saddle));
        }
    }

    /// After a step that was `solved` or not: other rows where these are no longer clearly
    /// independent; returns whether they changed and the step is to be solved again.
    pub(crate) fn renew_rows(
        &mut self,
        constraints: &impl DiscreteConstraints,
        solved: bool,
    ) -> bool {
        match &mut self.solver {
            MultiplierRule::LeastSquares(saddle) => saddle.renew(constraints, &self.s, solved),
            MultiplierRule::Tree(_) => false,
        }
    }

    /// Opens a step at the state.
    pub(crate) fn open(&mut self, state: &State, step: SubStep) {
        if let MultiplierRule::LeastSquares(saddle) = &mut self.solver {
            saddle.recall(&state.memory);
        }
        step.open(&mut self.s, state);
        self.v.take(state);
    }

    /// Writes the constraints in use into the memory of a state.
    pub(crate) fn remember(&self, memory: &mut Memory) {
        if let MultiplierRule::LeastSquares(saddle) = &self.solver {
            saddle.remember(memory);
        }
    }

    /// `h B` of the interval, shape `n`.
    pub(crate) fn bracket(&mut self, system: &EmSystem) -> &[f64] {
        system.scaled_bracket(&self.s, &self.v, &mut self.work, &mut self.bracket);
        &self.bracket
    }

    /// `h B` last computed, with the interval.
    pub(crate) fn evaluated(&self) -> (&[f64], &Interval) {
        (&self.bracket, &self.s)
    }

    /// `h B + Ḡᵀμ` and `μ`, shape `n`: as `h B` in the null space, where rounding of `P̄` counts by
    /// the size of this.
    pub(crate) fn remainder(
        &mut self,
        system: &EmSystem,
        constraints: &impl DiscreteConstraints,
    ) -> Result<&[f64], Singular> {
        self.bracket(system);
        self.multipliers(constraints)?;
        self.work.copy_from_slice(&self.bracket);
        let jacobian = self.jacobian.as_ref().expect("written by `multipliers`");
        jacobian.tr_mul_add(1.0, &self.mu, &mut self.work);
        Ok(&self.work)
    }

    /// `out ← P̄ᵀ (h B + Ḡᵀμ)` and `μ`, for the interval and the `P̄` written before.
    pub(crate) fn projected_residual(
        &mut self,
        system: &EmSystem,
        constraints: &impl DiscreteConstraints,
        out: &mut [f64],
    ) -> Result<(), Singular> {
        self.remainder(system, constraints)?;
        pull_back(&self.null_space, &self.work, out);
        Ok(())
    }

    /// `μ` from the bracket of the last residual.
    pub(crate) fn multipliers(
        &mut self,
        constraints: &impl DiscreteConstraints,
    ) -> Result<(), Singular> {
        let (n, s) = (self.s.dim(), &self.s);
        let emit = |out: &mut dyn Entries| constraints.discrete_jacobian(s, out);
        let shape = (constraints.len(), n);
        let jacobian = SparseMatrix::update(&mut self.jacobian, shape, emit);
        let saddle = match &mut self.solver {
            MultiplierRule::Tree(tree) => {
                self.mu.copy_from_slice(tree.solve(jacobian, &self.bracket)?);
                return Ok(());
            }
            MultiplierRule::LeastSquares(saddle) => saddle,
        };
        for (x, b) in self.x.iter_mut().zip(&self.bracket) {
            *x = -b;
        }
        self.x[n..].fill(0.0);
        let identity = |out: &mut dyn Entries| (0..n).for_each(|i| out.add(i, i, 1.0));
        let emit = |out: &mut dyn Entries| jacobian.emit(out);
        saddle.solve_with(&identity, &emit, 1.0, &emit, &mut self.x)?;
        saddle.rows().scatter(&self.x[n..], &mut self.mu);
        Ok(())
    }

    /// Writes `K̃` at the point of the last residual, with the `μ` computed there.
    pub(crate) fn tangent(&mut self, system: &EmSystem, constraints: &impl DiscreteConstraints) {
        let (n, s, mu) = (self.s.dim(), &self.s, &self.mu);
        let emit = |out: &mut dyn Entries| {
            system.scaled_bracket_derivative(s, out);
            constraints.discrete_hessian(s, mu, out);
        };
        SparseMatrix::update(&mut self.tangent, (n, n), emit);
    }

    /// The tangent last written, the null space matrix, and a scratch vector of shape `n`.
    pub(crate) fn parts(&mut self) -> (&SparseMatrix, &DMatrix<f64>, &mut [f64]) {
        let tangent = self.tangent.as_ref().expect("written by `tangent`");
        (tangent, &self.null_space, &mut self.work)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{Model, PAIRS, four_particles, geared, linkage, loaded, pair, screw};
    use crate::form::EmForm;
    use crate::null_space::{AveragedTree, DiscreteNullSpace, DiscreteQr};
    use vi_constraints::Constraints;
    use vi_multibody::mechanism::Mechanism;
    use vi_multibody::spring::SpringLaw;

    /// The balance at the end of a step of the model, moved off by `by`, with its `P̄`.
    fn balance(model: &Model, by: f64) -> Balance {
        let mechanism = &model.mechanism;
        let mut run = model.run(EmForm::Dalembert, 0.05);
        (0..3).for_each(|_| assert!(run.step().is_ok()));
        let (n, m) = (mechanism.dim(), mechanism.len());
        let mut balance = Balance::new(n, run.rows().clone(), m);
        balance.open(run.state(), SubStep::single(0.0, 0.05));
        assert!(run.step().is_ok());
        for i in 0..n {
            balance.s.dq[i] = run.interval().dq[i] + by * (1.7 * i as f64).sin();
        }
        balance.s.close_from_increment();
        source(model, run.rows().len()).null_space(mechanism, &balance.s, &mut balance.null_space);
        balance
    }

    fn source(model: &Model, rank: usize) -> Box<dyn DiscreteNullSpace<Mechanism>> {
        let (n, m) = (model.mechanism.dim(), model.mechanism.len());
        let averaged = AveragedTree::new(&model.mechanism);
        match averaged.filter(|_| !model.mechanism.has_loops()) {
            Some(averaged) => Box::new(averaged),
            None => Box::new(DiscreteQr::new(n, m, rank)),
        }
    }

    fn models() -> Vec<(String, Model)> {
        let mut models = vec![
            ("4 particles".to_owned(), four_particles(SpringLaw::Linear)),
            ("linkage 6R".to_owned(), linkage()),
            ("screw".to_owned(), screw()),
            ("gear".to_owned(), geared()),
        ];
        for kind in PAIRS {
            for reversed in [false, true] {
                models.push((format!("{} {reversed}", kind.name()), pair(kind, reversed)));
            }
        }
        models
    }

    #[test]
    fn the_discrete_null_space_is_annihilated_and_of_full_rank() {
        for (name, model) in models() {
            let balance = balance(&model, 0.0);
            let mechanism = &model.mechanism;
            let mut g = DMatrix::zeros(mechanism.len(), mechanism.dim());
            mechanism.discrete_jacobian(&balance.s, &mut g);
            let product = (&g * &balance.null_space).amax();
            let smallest = balance.null_space.singular_values().min();
            println!("{name:<20} |ḠP̄| = {product:.1e}, σ_min = {smallest:.2}");
            assert!(product < 5e-15 && smallest > 0.1, "{name}: {product:e}, {smallest}");
        }
    }

    /// `r_k = P̄_kᵀ (h B + Ḡᵀ μ_k)` at the increment `dq`, with `P̄_k` and `μ_k` kept.
    fn kept(balance: &mut Balance, at: (&EmSystem, &Mechanism), dq: &[f64]) -> Vec<f64> {
        let n = balance.s.dim();
        balance.s.dq.copy_from_slice(dq);
        balance.s.close_from_increment();
        balance.bracket(at.0);
        let s = &balance.s;
        let jacobian = SparseMatrix::assemble(at.1.len(), n, |out| at.1.discrete_jacobian(s, out));
        let mut bracket = balance.bracket.clone();
        jacobian.tr_mul_add(1.0, &balance.mu, &mut bracket);
        (balance.null_space.transpose() * nalgebra::DVector::from_vec(bracket)).as_slice().to_vec()
    }

    /// At the root the equations of a tree have one solution, which the sweep finds too.
    #[test]
    fn the_multipliers_of_a_tree_are_those_of_least_squares_at_the_root() {
        let mut trees = 0;
        for (name, model) in models() {
            let mechanism = &model.mechanism;
            let Some(tree) = TreeMultipliers::new(mechanism) else { continue };
            let mut balance = balance(&model, 0.0);
            let system = model.system();
            balance.bracket(&system);
            balance.multipliers(mechanism).unwrap();
            let expected = balance.mu.clone();
            let mut balance = balance.on_tree(Some(tree));
            balance.multipliers(mechanism).unwrap();
            let off = crate::common::distance(&balance.mu, &expected);
            let size = vi_core::linear::norm_inf(&expected);
            println!("{name:<20} off by {off:.1e} of {size:.1e}");
            assert!(size > 1e-4 && off < 1e-12 * (1.0 + size), "{name}: {off:e}");
            trees += 1;
        }
        assert!(trees >= 13, "{trees}");
    }

    #[test]
    fn the_newton_matrix_is_exact_off_the_root() {
        for (name, model) in models() {
            let loads = !model.springs.is_empty() && name != "4 particles";
            let system = if loads { loaded(&model) } else { model.system() };
            let mut balance = balance(&model, 0.02);
            let at = (&system, &model.mechanism);
            let dq = balance.s.dq.clone();
            let mut r = vec![0.0; balance.null_space.ncols()];
            balance.projected_residual(&system, at.1, &mut r).unwrap();
            balance.tangent(&system, at.1);
            let exact = balance.null_space.transpose() * balance.parts().0.to_dense();
            let off = crate::common::distance(&kept(&mut balance, at, &dq), &r);
            assert!(off < 1e-14, "{name}: the value is that of the residual, off by {off:e}");
            let (mut worst, e) = (0.0_f64, 1e-5);
            for j in 0..dq.len() {
                let mut shifted = |by: f64| {
                    let mut dq = dq.clone();
                    dq[j] += by;
                    kept(&mut balance, at, &dq)
                };
                let (plus, minus) = (shifted(e), shifted(-e));
                for i in 0..plus.len() {
                    let slope = (plus[i] - minus[i]) / (2.0 * e);
                    worst = worst.max((slope - exact[(i, j)]).abs());
                }
            }
            let relative = worst / exact.amax();
            println!("{name:<20} Newton matrix off by {relative:.1e} (relative)");
            assert!(relative < 1e-9, "{name}: {relative:e}");
        }
    }
}
