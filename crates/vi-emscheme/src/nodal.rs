//! The form with discrete null space and nodal reparametrization, `em-nodal`.
//!
//! ```text
//! r(u) = P̄(q_n, q_{n+1})ᵀ h B = 0,    q_{n+1} = F_d(u, q_n)
//! Dr   = P̄ᵀ (h K + Σ_i μ_i ∂Ḡ_iᵀ/∂q_{n+1}) ∂F_d/∂u
//! ```
//! The constraints hold by construction, whatever Newton's method leaves over. The condition number
//! does not depend on `h`. Dense in `n × d`.
//!
//! Letters and the derivative of `P̄`: [`crate::null_space`]. Source: Betsch & Leyendecker 2006.

use crate::balance::Balance;
use crate::constraint::DiscreteConstraints;
use crate::em_system::EmSystem;
use crate::null_space::DiscreteNullSpace;
use crate::scheme::{EmForm, EmScheme, EmState};
use nalgebra::DMatrix;
use vi_constraints::Reparametrization;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::{Condition, StepError, SubStep, solve_step};
use vi_core::interval::Interval;
use vi_core::linear::{DenseLu, condition_number};
use vi_core::newton::{Block, Fault, Newton, NewtonProblem, NewtonReport, NewtonSettings};
use vi_core::predictor::Predictor;

/// The nodal form.
pub struct EmNodal<N, R> {
    newton: Newton,
    predictor: Predictor,
    u: Vec<f64>, // d
    source: N,
    map: R,
    work: Work,
}

struct Work {
    balance: Balance,
    push: DMatrix<f64>,     // n × d  ∂F_d/∂u
    weighted: DMatrix<f64>, // n × d  K̃ ∂F_d/∂u
    matrix: DMatrix<f64>,   // d × d
    lu: DenseLu,
    blocks: Vec<Block>,
}

struct Problem<'a, C, N, R> {
    system: &'a EmSystem,
    constraints: &'a C,
    source: &'a mut N,
    map: &'a R,
    work: &'a mut Work,
}

impl<N, R: Reparametrization> EmNodal<N, R> {
    /// For `n` coordinates, an independent set of `m` constraints, a source of `P̄` and a map `F_d`.
    #[must_use]
    pub fn new(
        n: usize,
        (rows, m): (IndependentRows, usize),
        (source, map): (N, R),
        settings: NewtonSettings,
    ) -> Self {
        let d = map.dof();
        let work = Work {
            balance: Balance::new(n, (rows, m)),
            push: DMatrix::zeros(n, d),
            weighted: DMatrix::zeros(n, d),
            matrix: DMatrix::zeros(d, d),
            lu: DenseLu::new(d),
            blocks: map.blocks(),
        };
        let (newton, predictor) = (Newton::new(d, settings), Predictor::new(d, 1));
        Self { newton, predictor, u: vec![0.0; d], source, map, work }
    }
}

impl<C, N, R> NewtonProblem for Problem<'_, C, N, R>
where
    C: DiscreteConstraints,
    N: DiscreteNullSpace<C>,
    R: Reparametrization,
{
    fn blocks(&self) -> &[Block] {
        &self.work.blocks
    }

    fn residual(&mut self, u: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        let balance = &mut self.work.balance;
        self.map.reparametrize(u, &mut balance.s)?;
        balance.s.close();
        self.source.null_space(self.constraints, &balance.s, &mut balance.null_space);
        balance.residual(self.system, r);
        Ok(())
    }

    fn correction(&mut self, u: &[f64], du: &mut [f64]) -> Result<(), Fault> {
        let Work { balance, push, weighted, matrix, lu, .. } = &mut *self.work;
        self.map.tangent(u, &balance.s, push);
        balance.pushed_tangent((self.system, self.constraints), push, weighted)?;
        matrix.gemm_tr(1.0, &balance.null_space, weighted, 0.0);
        Ok(lu.solve(matrix, du)?)
    }
}

impl<C, N, R> EmScheme<C> for EmNodal<N, R>
where
    C: DiscreteConstraints,
    N: DiscreteNullSpace<C>,
    R: Reparametrization,
{
    fn form(&self) -> EmForm {
        EmForm::Nodal
    }

    fn advance(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        step: SubStep,
        state: &mut EmState,
    ) -> Result<NewtonReport, StepError> {
        let Self { newton, predictor, u, source, map, work } = self;
        work.balance.open(state, step);
        let mut problem = Problem { system, constraints, source, map, work };
        let report = solve_step(newton, predictor, step, &mut problem, u)?;
        work.balance.multipliers(constraints).map_err(|_| StepError::RankLost)?;
        state.advance(&work.balance.s, None);
        map.clean(state.t, &mut state.q);
        Ok(report)
    }

    fn interval(&self) -> &Interval {
        &self.work.balance.s
    }

    fn scaled_multiplier(&self) -> &[f64] {
        &self.work.balance.mu
    }

    fn condition(&self) -> Option<Condition> {
        Some(Condition::unscaled(condition_number(&self.work.matrix)))
    }

    fn reset(&mut self) {
        self.predictor.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{PAIRS, four_particles, loaded, pair};
    use crate::null_space::AveragedTree;
    use vi_constraints::Constraints;
    use vi_multibody::map::TreeMap;
    use vi_multibody::spring::SpringLaw;

    #[test]
    fn the_newton_matrix_at_the_root_against_central_differences() {
        let pairs = PAIRS.iter().flat_map(|kind| [pair(*kind, false), pair(*kind, true)]);
        for model in pairs.chain([four_particles(SpringLaw::QuadraticStretch)]) {
            let mechanism = &model.mechanism;
            let bodies = !mechanism.description().bodies.is_empty();
            let system = if bodies { loaded(&model) } else { model.system() };
            let (n, m) = (mechanism.dim(), mechanism.len());
            let parts = (AveragedTree::new(mechanism).unwrap(), TreeMap::new(mechanism));
            let rows = IndependentRows::all(m);
            let mut scheme = EmNodal::new(n, (rows, m), parts, NewtonSettings::default());
            let (q, v) = mechanism.start();
            let mut state = EmState::new(0.0, q, v);
            let start = state.clone();
            let step = SubStep::single(0.0, 0.05);
            scheme.advance(&system, mechanism, step, &mut state).unwrap();
            let EmNodal { source, map, work, u, .. } = &mut scheme;
            work.balance.open(&start, step);
            let (constraints, map) = (mechanism, &*map);
            let mut problem = Problem { system: &system, constraints, source, map, work };
            let mut at = |j: usize, by: f64| {
                let mut u = u.clone();
                u[j] += by;
                let mut r = vec![0.0; u.len()];
                problem.residual(&u, &mut r).unwrap();
                r
            };
            let (d, e) = (u.len(), 1e-5);
            let slopes: Vec<_> = (0..d).map(|j| (at(j, e), at(j, -e))).collect();
            let mut r = at(0, 0.0);
            problem.correction(u, &mut r).unwrap();
            let mut worst = 0.0_f64;
            for (j, (plus, minus)) in slopes.iter().enumerate() {
                for i in 0..d {
                    let slope = (plus[i] - minus[i]) / (2.0 * e);
                    worst = worst.max((slope - scheme.work.matrix[(i, j)]).abs());
                }
            }
            let name = mechanism.description().joints.first().map_or("particles", |j| &j.name);
            println!("{name:<12} Newton matrix off by {worst:.1e}");
            assert!(worst < 1e-9, "{name}: {worst:e}");
        }
    }
}
