//! The form with discrete null space and nodal reparametrization, `em-nodal`.
//!
//! ```text
//! r(u) = P̄(q_n, q_{n+1})ᵀ h B = 0,    q_{n+1} = F_d(u, q_n)
//! Dr   = P̄ᵀ (h K + Σ_i μ_i ∂Ḡ_iᵀ/∂q_{n+1}) ∂F_d/∂u
//! ```
//! What rounding leaves of `B` in a step is added to the next one ([`vi_core::compensation`]):
//! increments in their format balance no momentum exactly, and on a closed loop in steady motion
//! the remainders do not average out.
//!
//! The constraints hold by construction, whatever Newton's method leaves over. The condition number
//! does not depend on `h`. Written against [`EmOperators`]: dense matrices for any system
//! ([`crate::dense_operators`], on closed loops with [`crate::loop_nodal`]), sparse ones for trees
//! ([`crate::sparse_operators`]).
//!
//! Letters and the derivative of `P̄`: [`crate::null_space`]. Source: Betsch & Leyendecker 2006.

use crate::balance::Balance;
use crate::constraint::DiscreteConstraints;
use crate::em_system::EmSystem;
use crate::null_space::EmLinearization;
use crate::scheme::advance_state;
use nalgebra::DMatrix;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::{ConditionNumbers, Scheme, StepError, SubStep};
use vi_constraints::unknowns::Increments;
use vi_core::interval::Interval;
use vi_core::linear::{condition_number, norm_inf};
use vi_core::newton::{BlockKind, Fault, Newton, Precision, UnknownBlock, largest_rotation};
use vi_core::sparse::Entries;
use vi_core::state::State;
use vi_multibody::tree_multipliers::TreeMultipliers;

/// An iterate of Newton's method.
#[derive(Clone, Copy, Debug)]
pub struct EmIterate<'a> {
    /// `u`, shape `d`.
    pub u: &'a [f64],
    /// The interval to `q_{n+1} = F_d(u, q_n)`.
    pub s: &'a Interval,
    /// `w = h B`, shape `n`.
    pub bracket: &'a [f64],
}

/// What the nodal form asks of `P̄` and `F_d`.
///
/// Call order in an iteration: `reparametrize`, `pull_back`, `solve`.
pub trait EmOperators<C>: Send {
    /// Units and scales of the increments `u`.
    fn blocks(&self) -> &[UnknownBlock];
    /// Opens a step at a state.
    fn begin(&mut self, _step: SubStep, _state: &mut State) {}
    /// Writes `s.q1 = F_d(u, s.q0)` and `s.dq`, closes the interval and takes its `P̄`.
    ///
    /// # Errors
    /// [`Fault`] when `u` is outside the domain of the map.
    fn reparametrize(&mut self, constraints: &C, u: &[f64], s: &mut Interval) -> Result<(), Fault>;
    /// The independent constraints of this step, where they are chosen in it. Then `P̄` comes from
    /// a factorization, and what is pulled back is `h B + Ḡᵀμ`: of `h B` alone its rounding would
    /// leave a drift of the energy.
    fn rows(&self) -> Option<&IndependentRows> {
        None
    }
    /// `out ← P̄ᵀ w`, the first rows of the residual; all of them without closed loops.
    fn pull_back(&mut self, w: &[f64], out: &mut [f64]);
    /// Writes the covector that rounding has left of a step, shape `n` or `d`, from the residual
    /// `r` and the last `P̄`: the next step adds it. By default the residual, for a `P̄` whose
    /// columns mean the same in each step.
    fn carry_balance(&mut self, r: &[f64], carried: &mut Vec<f64>) {
        carried.clear();
        carried.extend_from_slice(r);
    }
    /// `r ← r + scale P̄ᵀ carried`.
    fn add_carried(&self, scale: f64, carried: &[f64], r: &mut [f64]) {
        r.iter_mut().zip(carried).for_each(|(r, carried)| *r += scale * carried);
    }
    /// Writes the equations of closed loops into the last rows of the residual.
    fn close(&mut self, _constraints: &C, _s: &Interval, _r: &mut [f64]) {}
    /// Which terms the Newton matrix takes for the derivative of `P̄`.
    fn linearization(&self) -> EmLinearization;
    /// `x ← (P̄ᵀ K̃ ∂F_d/∂u)⁻¹ x` at the iterate `at`, with `K̃` as emitted:
    /// always the same places in the same order. With [`EmLinearization::NullSpaceDerivative`] what
    /// is emitted is `h K`, and `∂(P̄ᵀ w)/∂u` is added.
    ///
    /// # Errors
    /// [`Fault::SingularTangent`].
    fn solve(
        &mut self,
        constraints: &C,
        emit: &dyn Fn(&mut dyn Entries),
        at: EmIterate<'_>,
        x: &mut [f64],
    ) -> Result<(), Fault>;
    /// See [`Precision::noise`].
    fn noise(&self) -> f64 {
        1e-9
    }
    /// See [`vi_constraints::Reparametrization::clean`].
    fn clean(&mut self, t: f64, q: &mut [f64]);
    /// The Newton matrix of the last `solve`, dense.
    fn matrix(&self) -> DMatrix<f64>;
}

/// Relative size of corrections that the rounding of stiff elements leaves of soft ones.
const FLOOR: f64 = 1e-5;
/// Terms of a stress beside one entry of the matrix: the forms of both ends, their difference and
/// the quotient of the discrete gradient.
const TERMS: f64 = 4.0;

/// The nodal form.
#[derive(Debug)]
pub struct EmNodal<O> {
    operators: O,
    increments: Increments,
    balance: Balance,
    carried: Vec<f64>, // n or d  rounding error of the last momentum balance
}

impl<O> EmNodal<O> {
    /// For `n` coordinates, an independent set of `m` constraints and operators.
    #[must_use]
    pub fn new<C>(n: usize, m: usize, rows: IndependentRows, operators: O) -> Self
    where
        O: EmOperators<C>,
    {
        let balance = Balance::new(n, rows, m).without_matrix();
        let increments = Increments::new(operators.blocks().to_vec());
        Self { operators, increments, balance, carried: Vec::new() }
    }

    /// With the multipliers of a tree found frame by frame, where there is one.
    #[must_use]
    pub fn on_tree(mut self, tree: Option<TreeMultipliers>) -> Self {
        self.balance = self.balance.on_tree(tree);
        self
    }
}

impl<C: DiscreteConstraints, O: EmOperators<C>> Scheme<EmSystem, C> for EmNodal<O> {
    fn blocks(&self) -> &[UnknownBlock] {
        self.increments.blocks()
    }

    fn begin(&mut self, _system: &EmSystem, constraints: &C, step: SubStep, state: &mut State) {
        self.balance.open(state, step);
        self.carried.clone_from(&state.compensation.balance);
        self.increments.open(constraints, &state.q);
        self.operators.begin(step, state);
    }

    fn residual(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        u: &[f64],
        r: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { operators, increments, balance, carried } = self;
        operators.reparametrize(constraints, u, &mut balance.s)?;
        increments.reach(constraints, &balance.s.q1);
        if let Some(rows) = operators.rows() {
            balance.take_rows(rows);
            operators.pull_back(balance.remainder(system, constraints)?, r);
        } else {
            operators.pull_back(balance.bracket(system), r);
        }
        operators.add_carried(balance.s.h, carried, r);
        operators.close(constraints, &balance.s, r);
        Ok(())
    }

    fn correction(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        u: &[f64],
        du: &mut [f64],
    ) -> Result<(), Fault> {
        let explicit = self.operators.linearization() == EmLinearization::NullSpaceDerivative;
        if !explicit && self.operators.rows().is_none() {
            self.balance.multipliers(constraints)?;
        }
        let (bracket, s) = self.balance.evaluated();
        let emit = |out: &mut dyn Entries| {
            system.scaled_bracket_derivative(s, out);
            if !explicit {
                constraints.discrete_hessian(s, &self.balance.mu, out);
            }
        };
        self.operators.solve(constraints, &emit, EmIterate { u, s, bracket }, du)
    }

    fn precision(&self) -> Precision {
        Precision { noise: self.operators.noise(), floor: FLOOR, ..Precision::default() }
    }

    /// A strain has the rounding `ε` however small it is: a stress that of its stiffness, and where
    /// large ones cancel, as in a rope that snaps, no residual falls below.
    fn equation_sizes(&mut self, _constraints: &C, _x: &[f64]) -> Option<Vec<f64>> {
        let place = norm_inf(&self.balance.s.q1);
        let mut sizes = vec![0.0; self.blocks().iter().map(|own| own.range.end).max()?];
        for UnknownBlock { kind, range, .. } in self.increments.blocks() {
            let size = match kind {
                BlockKind::Position => place,
                BlockKind::Rotation => 1.0,
                _ => 0.0,
            };
            sizes[range.clone()].fill(size);
        }
        let matrix = self.operators.matrix();
        let row = |i| sizes.iter().enumerate().map(|(j, size)| matrix[(i, j)].abs() * size).sum();
        let mut rows: Vec<f64> = (0..sizes.len()).map(row).collect();
        // of a force or a moment all components: what cancels in one is not in its row
        for block in self.increments.blocks() {
            for own in rows[block.range.clone()].chunks_mut(3) {
                let largest = TERMS * norm_inf(own);
                own.fill(largest);
            }
        }
        Some(rows)
    }

    /// Gaps of loops, and prescribed motions, beside momenta.
    fn rotation(&self, u: &[f64]) -> f64 {
        match self.operators.rows() {
            Some(_) => largest_rotation(self.increments.blocks(), u),
            None => 0.0,
        }
    }

    fn end(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        newton: &Newton,
        state: &mut State,
    ) -> Result<(), StepError> {
        let Self { operators, balance, .. } = self;
        operators.carry_balance(newton.residual(), &mut state.compensation.balance);
        state.compensation.balance.iter_mut().for_each(|r| *r /= balance.s.h);
        if operators.rows().is_none() {
            balance.multipliers(constraints).map_err(|_| StepError::RankLost)?;
        }
        balance.remember(&mut state.memory);
        let clean = |t: f64, q: &mut [f64]| operators.clean(t, q);
        advance_state(state, system, &balance.s, &balance.mu, None, clean);
        Ok(())
    }

    fn interval(&self) -> &Interval {
        &self.balance.s
    }

    fn interval_mut(&mut self) -> &mut Interval {
        &mut self.balance.s
    }

    fn condition(&mut self, _system: &EmSystem, _: &C, _u: &[f64]) -> Option<ConditionNumbers> {
        Some(ConditionNumbers::unscaled(condition_number(&self.operators.matrix())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{PAIRS, four_particles, loaded, pair};
    use crate::dense_operators::DenseOperators;
    use crate::null_space::AveragedTree;
    use crate::sparse_operators::SparseOperators;
    use vi_constraints::Constraints;
    use vi_constraints::discretization::Discretization;
    use vi_constraints::scheme::StepSolver;
    use vi_core::newton::NewtonSettings;
    use vi_multibody::mechanism::Mechanism;
    use vi_multibody::spring::SpringLaw;
    use vi_multibody::tree_map::TreeMap;

    /// The largest difference of the Newton matrix at the root of a step from central differences.
    fn mismatch<O: EmOperators<Mechanism>>(
        (system, mechanism): (&EmSystem, &Mechanism),
        mut scheme: EmNodal<O>,
    ) -> f64 {
        let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
        let mut state = State::new(0.0, q, vec![0.0; v.len()]);
        Discretization::<Mechanism>::begin(system, &mut state, &v);
        let start = state.clone();
        let step = SubStep::single(0.0, 0.05);
        let mut solver = StepSolver::new(&scheme, NewtonSettings::default());
        solver.advance(&mut scheme, system, mechanism, step, &mut state).unwrap();
        let u = solver.solution();
        scheme.balance.open(&start, step);
        let mut at = |j: usize, by: f64| {
            let mut u = u.to_vec();
            u[j] += by;
            let mut r = vec![0.0; u.len()];
            scheme.residual(system, mechanism, &u, &mut r).unwrap();
            r
        };
        let (d, e) = (u.len(), 1e-5);
        let slopes: Vec<_> = (0..d).map(|j| (at(j, e), at(j, -e))).collect();
        let mut r = at(0, 0.0);
        scheme.correction(system, mechanism, u, &mut r).unwrap();
        let (matrix, mut worst) = (scheme.operators.matrix(), 0.0_f64);
        for (j, (plus, minus)) in slopes.iter().enumerate() {
            for i in 0..d {
                let slope = (plus[i] - minus[i]) / (2.0 * e);
                worst = worst.max((slope - matrix[(i, j)]).abs());
            }
        }
        worst
    }

    #[test]
    fn the_newton_matrix_at_the_root_against_central_differences() {
        let pairs = PAIRS.iter().flat_map(|kind| [pair(*kind, false), pair(*kind, true)]);
        for model in pairs.chain([four_particles(SpringLaw::QuadraticStretch)]) {
            let mechanism = &model.mechanism;
            let bodies = !mechanism.description().bodies.is_empty();
            let system = if bodies { loaded(&model) } else { model.system() };
            let (n, m) = (mechanism.dim(), mechanism.len());
            let averaged = || AveragedTree::new(mechanism).unwrap();
            let dense = |linearization| {
                let operators = DenseOperators::new(n, averaged(), TreeMap::new(mechanism));
                operators.linearized::<Mechanism>(linearization)
            };
            let at = (&system, mechanism);
            let of =
                |operators| EmNodal::new::<Mechanism>(n, m, IndependentRows::all(m), operators);
            let tree = TreeMultipliers::new(mechanism);
            let multipliers = dense(EmLinearization::Multipliers).unwrap();
            let mut found = vec![mismatch(at, of(multipliers).on_tree(tree))];
            match dense(EmLinearization::NullSpaceDerivative) {
                Some(explicit) => found.push(mismatch(at, of(explicit))),
                None => assert!(!bodies, "only bars have no such derivative"),
            }
            let sparse = SparseOperators::new(mechanism, averaged());
            let sparse = EmNodal::new::<Mechanism>(n, m, IndependentRows::all(m), sparse);
            found.push(mismatch(at, sparse));
            let name = mechanism.description().joints.first().map_or("particles", |j| &j.name);
            println!("{name:<12} Newton matrices off by {found:?}");
            assert!(found.iter().all(|off| *off < 1e-9), "{name}: {found:?}");
        }
    }
}
