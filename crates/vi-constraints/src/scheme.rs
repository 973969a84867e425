//! The four equivalent schemes behind one interface.
//!
//! All of them advance the same state: `(q_n, p̄_n) → (q_{n+1}, p̄_{n+1})` with
//! `p̄_{n+1} = D_2 L_d(q_n, q_{n+1}) + f_d^+`, and differ only in how `q_{n+1}` is found. Their
//! trajectories agree to solver tolerance (LMO08 Cor. 3.5).

use crate::galerkin::GaussPoint;
use crate::saddle_point::SaddlePoint;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use vi_core::interpolation::StepPolynomial;
use vi_core::interval::Interval;
use vi_core::linear::condition_number;
use vi_core::newton::{
    Block, BlockKind, Fault, Newton, NewtonError, NewtonProblem, NewtonReport, NewtonSettings,
};
use vi_core::predictor::Degree;
use vi_core::state::State;

/// Which scheme.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SchemeKind {
    /// Constrained: unknowns `(q_{n+1}, λ_n) ∈ R^{n+m}`, LMO08 (22).
    Constrained,
    /// d'Alembert: unknown `q_{n+1} ∈ R^n`, LMO08 (25).
    Dalembert,
    /// d'Alembert with nodal reparametrization: unknown `u ∈ R^d`, LMO08 (28). The production scheme.
    #[default]
    Nodal,
    /// Reduced variational: as nodal, with `P = ∂F_d/∂u` of the last step, LMO08 (30).
    Reduced,
}

impl SchemeKind {
    /// All four.
    pub const ALL: [Self; 4] = [Self::Constrained, Self::Dalembert, Self::Nodal, Self::Reduced];

    /// The name in model files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Constrained => "constrained",
            Self::Dalembert => "dalembert",
            Self::Nodal => "nodal",
            Self::Reduced => "reduced",
        }
    }
}

/// A sub-step of a composition: its place in it, its length and its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubStep {
    /// Index `k` among the sub-steps of a macro step; 0 without composition.
    pub index: usize,
    /// Number of sub-steps of a macro step; 1 without composition.
    pub count: usize,
    /// `γ_k h`, s; negative for backward sub-steps.
    pub h: f64,
    /// `t_{n+1}`, s: `t_n + h` up to rounding; at the end of a macro step that of the node.
    pub t_end: f64,
}

impl SubStep {
    /// A step from `t` (s) of length `h` (s) without composition.
    #[must_use]
    pub fn single(t: f64, h: f64) -> Self {
        Self { index: 0, count: 1, h, t_end: t + h }
    }

    /// Newton's method of the very first step starts from `h ν` where rates `ν` of the unknowns are given.
    pub fn depart(self, rates: Option<&[f64]>, state: &mut State) {
        if let Some(rates) = rates.filter(|_| state.step == 0 && self.index == 0) {
            let increment: Vec<f64> = rates.iter().map(|rate| self.h * rate).collect();
            state.history.remember(self.index, self.h, false, &increment);
        }
    }

    /// Opens the interval of this step at a state.
    pub fn open(self, s: &mut Interval, state: &State) {
        state.open(s, self.h);
        s.end_at(self.t_end);
    }
}

/// Why a step was refused. The state is then what it was before the call.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// Newton's method failed from every initial guess that was tried.
    #[error("{0}")]
    Newton(#[from] NewtonError),
    /// The constraints lost the rank that the scheme relies on.
    #[error("the step matrix is singular: the constraints have lost rank")]
    RankLost,
    /// The configuration reached does not satisfy all constraints ([`crate::closure`]).
    #[error(
        "the constraints cannot all be satisfied: residual {residual:.1e}, where rounding leaves \
         less than {bound:.1e}"
    )]
    ConstraintViolated {
        /// The constraint that is violated most, relative to its bound.
        row: usize,
        /// `|g_i|`, in the unit of the constraint.
        residual: f64,
        /// The largest residual of round-off.
        bound: f64,
    },
    /// The step found the mirror image of a body ([`crate::closure`]).
    #[error("the step ends at the mirror image of a body: its directors are left-handed")]
    Reflected {
        /// Its first coordinate.
        coordinate: usize,
    },
}

impl StepError {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Newton(NewtonError::Refused {
                fault: Fault::OutsideChart { kind: BlockKind::Rotation, .. },
                ..
            }) => "a step must turn no body by more than half a turn: reduce the time step",
            Self::Newton(NewtonError::Refused { fault: Fault::FarFromGuess { .. }, .. }) => {
                "the step has more than one solution: reduce the time step"
            }
            Self::Newton(NewtonError::Refused { fault: Fault::SingularTangent, .. })
            | Self::Newton(NewtonError::Refused { fault: Fault::RankChanged { .. }, .. })
            | Self::RankLost => {
                "check for a singular configuration, for masses or inertias that are zero in a free \
                 direction, and for redundant constraints; or use another scheme"
            }
            Self::Newton(NewtonError::NotConverged { kind: BlockKind::Multiplier, .. }) => {
                "constraints are all but dependent here (a singular configuration): use the scheme \
                 `nodal`, or reduce the time step"
            }
            Self::ConstraintViolated { .. } => {
                "constraints that depend on one another disagree along this motion: remove one of \
                 them, or correct lengths, axes and prescribed motions so that they agree"
            }
            Self::Reflected { .. } => {
                "the step has more than one solution: reduce the time step, or use the scheme `nodal`"
            }
            _ => "reduce the time step",
        }
    }

    /// The constraint the failure is about, if one is.
    #[must_use]
    pub fn constraint(&self) -> Option<usize> {
        match self {
            Self::ConstraintViolated { row, .. } => Some(*row),
            _ => None,
        }
    }

    /// The coordinate the failure is about, if one is.
    #[must_use]
    pub fn coordinate(&self) -> Option<usize> {
        match self {
            Self::Reflected { coordinate } => Some(*coordinate),
            _ => None,
        }
    }

    /// The unknown the failure is about, if one is.
    #[must_use]
    pub fn unknown(&self) -> Option<usize> {
        match self {
            Self::Newton(
                NewtonError::NotConverged { unknown, .. }
                | NewtonError::Refused { fault: Fault::OutsideChart { unknown, .. }, .. },
            ) => Some(*unknown),
            _ => None,
        }
    }
}

/// Condition numbers of a Newton matrix.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Condition {
    /// Of the matrix as the equations are written.
    pub as_written: f64,
    /// Of the matrix that is factorized (scaled by powers of `h` where that differs).
    pub scaled: f64,
}

impl Condition {
    /// Of the saddle-point matrix of a step: multiplier columns carry `h²`, momentum rows `1/h` as written.
    #[must_use]
    pub fn of_saddle_point(saddle: &SaddlePoint, s: &Interval) -> Option<Self> {
        let scaled = saddle.matrix()?.to_dense();
        let (n, size, h) = (s.dim(), scaled.ncols(), s.h);
        let mut written = scaled.clone();
        written.view_mut((0, n), (n, size - n)).scale_mut(h * h);
        written.view_mut((0, 0), (n, size)).scale_mut(1.0 / h);
        Some(Self { as_written: condition_number(&written), scaled: condition_number(&scaled) })
    }

    /// Of a matrix whose first `d` rows were multiplied by `h`.
    #[must_use]
    pub fn of_scaled_rows(scaled: &DMatrix<f64>, d: usize, h: f64) -> Self {
        let mut written = scaled.clone();
        written.rows_mut(0, d).scale_mut(1.0 / h);
        Self { as_written: condition_number(&written), scaled: condition_number(scaled) }
    }

    /// Of the inverse of a `d × d` matrix that is known by its solutions alone: `solve` turns a right-hand side into one. `None`
    /// where it cannot.
    pub fn of_inverse(
        d: usize,
        mut solve: impl FnMut(&mut [f64]) -> Result<(), Fault>,
    ) -> Option<Self> {
        let mut inverse = DMatrix::identity(d, d);
        for column in inverse.as_mut_slice().chunks_exact_mut(d.max(1)) {
            solve(column).ok()?;
        }
        Some(Self::unscaled(condition_number(&inverse)))
    }

    /// Of a matrix that is factorized as it is written.
    #[must_use]
    pub fn unscaled(number: f64) -> Self {
        Self { as_written: number, scaled: number }
    }
}

/// How Newton's method starts from an initial guess.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guess {
    /// With full corrections.
    Plain,
    /// With a line search.
    Damped,
}

/// One of the schemes: the equations of a step `r(x) = 0`, with their workspace.
///
/// Nothing in it influences a later step but through the [`State`]. Call order within a step: `begin`, then
/// for each iteration `residual`, `correction`; `end` when the step is taken. [`StepSolver`] does so.
pub trait Scheme<S, C>: Send {
    /// Units and scales of the unknowns; together the blocks cover all of them.
    fn blocks(&self) -> &[Block];
    /// Opens a step at a state.
    fn begin(&mut self, system: &S, constraints: &C, step: SubStep, state: &mut State);
    /// `r ← r(x)`, shape of `x`.
    ///
    /// # Errors
    /// [`Fault`] when `x` is outside the domain of the equations.
    fn residual(
        &mut self,
        system: &S,
        constraints: &C,
        x: &[f64],
        r: &mut [f64],
    ) -> Result<(), Fault>;
    /// `dx ← (∂r/∂x)⁻¹ dx` at the point of the last residual.
    ///
    /// # Errors
    /// [`Fault::SingularTangent`].
    fn correction(
        &mut self,
        system: &S,
        constraints: &C,
        x: &[f64],
        dx: &mut [f64],
    ) -> Result<(), Fault>;
    /// See [`NewtonProblem::settle`].
    ///
    /// # Errors
    /// [`Fault`] when `x` is outside the domain of the equations.
    fn settle(
        &mut self,
        system: &S,
        constraints: &C,
        x: &[f64],
        r: &mut [f64],
    ) -> Result<(), Fault> {
        self.residual(system, constraints, x, r)
    }
    /// See [`NewtonProblem::noise`].
    fn noise(&self) -> f64 {
        1e-9
    }
    /// `Σ_j |K_ij| size_j` of each equation at `x`, with the matrix of the last correction: rounding changes the
    /// residual by a few `ε` of that. `None`: not known. Allocates; asked only where the residual has stopped to
    /// fall.
    fn equation_sizes(&mut self, _constraints: &C, _x: &[f64]) -> Option<Vec<f64>> {
        None
    }
    /// See [`NewtonProblem::resolution`].
    fn resolution(&self) -> f64 {
        0.25
    }
    /// See [`NewtonProblem::closing_size`].
    fn closing_size(&self) -> f64 {
        0.0
    }
    /// See [`NewtonProblem::turn`].
    fn turn(&self) -> f64 {
        f64::INFINITY
    }
    /// Whether a step never finds the mirror image of a body ([`crate::closure`]).
    fn keeps_orientation(&self) -> bool {
        false
    }
    /// Whether the last step has itself found all constraints met to round-off and all coordinates finite; where it has
    /// not, [`crate::closure`] does.
    fn meets_constraints(&self) -> bool {
        false
    }
    /// Of which degree initial guesses are extrapolated.
    fn degree(&self) -> Degree {
        Degree::Cubic
    }
    /// See [`NewtonProblem::is_simplified`].
    fn is_simplified(&self) -> bool {
        false
    }
    /// Writes an initial guess of the unknowns of the step that was begun, each `attempt` a more robust one; `None`:
    /// no more. By default the extrapolated increment, the last one, and zero with a line search.
    fn guess(
        &mut self,
        _system: &S,
        attempt: usize,
        (step, state): (SubStep, &State),
        x: &mut [f64],
    ) -> Option<Guess> {
        let degree = if attempt == 0 { self.degree() } else { Degree::Zero };
        let known = state.history.predict(step.index, step.h, degree, x);
        match attempt + usize::from(attempt > 0 && !known) {
            0 if known => Some(Guess::Plain),
            0 => {
                x.fill(0.0);
                Some(Guess::Plain)
            }
            1 => Some(Guess::Plain),
            2 => {
                x.fill(0.0);
                Some(Guess::Damped)
            }
            _ => None,
        }
    }
    /// Whether a solution is that of the step.
    ///
    /// # Errors
    /// [`Fault`] when it is not.
    fn accept(&self, _x: &[f64]) -> Result<(), Fault> {
        Ok(())
    }
    /// The unknowns that alternate from step to step around a smooth course.
    fn alternating(&self, _sub_steps: usize) -> Range<usize> {
        0..0
    }
    /// After a step that was `solved` or not: whether other constraints are used from now on. The history is then
    /// void, and the step is to be solved again.
    fn renew(&mut self, _constraints: &C, _solved: bool) -> bool {
        false
    }
    /// Moves the state to the end of the step that `newton` has solved.
    ///
    /// # Errors
    /// [`StepError`]; of the state only history and memory may then have changed.
    fn end(
        &mut self,
        system: &S,
        constraints: &C,
        newton: &Newton,
        state: &mut State,
    ) -> Result<(), StepError>;
    /// Computes the Gauss nodes of the step that was taken, where the scheme has them.
    fn interpolate(&mut self) {}
    /// The Gauss nodes of the last [`Scheme::interpolate`], of Galerkin schemes; the others have none.
    fn gauss(&self) -> &[GaussPoint] {
        &[]
    }
    /// The polynomial of the last [`Scheme::interpolate`], of Galerkin schemes.
    fn polynomial(&self) -> Option<StepPolynomial<'_>> {
        None
    }
    /// The interval of the last step.
    fn interval(&self) -> &Interval;
    /// The same, to put back the one before a trial step.
    fn interval_mut(&mut self) -> &mut Interval;
    /// Condition numbers of the Newton matrix of the last step, which had the solution `x` (dense: for studies,
    /// not for runs).
    fn condition(&mut self, _system: &S, _constraints: &C, _x: &[f64]) -> Option<Condition> {
        None
    }
}

/// Newton's method for the steps of a scheme, with the unknowns.
#[derive(Clone, Debug)]
pub struct StepSolver {
    newton: Newton,
    x: Vec<f64>,
}

impl StepSolver {
    /// For the unknowns of a scheme.
    #[must_use]
    pub fn new<S, C>(scheme: &dyn Scheme<S, C>, settings: NewtonSettings) -> Self {
        let unknowns = scheme.blocks().iter().map(|block| block.range.end).max().unwrap_or(0);
        Self { newton: Newton::new(unknowns, settings), x: vec![0.0; unknowns] }
    }

    /// The solution of the last step.
    #[must_use]
    pub fn solution(&self) -> &[f64] {
        &self.x
    }

    /// Takes a sub-step: replaces `(t, q_n, p̄_n)` by the next node.
    ///
    /// # Errors
    /// [`StepError`]; of the state only history and memory may then have changed, which the caller restores.
    pub fn advance<S, C>(
        &mut self,
        scheme: &mut dyn Scheme<S, C>,
        system: &S,
        constraints: &C,
        step: SubStep,
        state: &mut State,
    ) -> Result<NewtonReport, StepError> {
        let Self { newton, x } = self;
        state.history.fit(x.len(), step.count, scheme.alternating(step.count));
        scheme.begin(system, constraints, step, state);
        let mut problem = Equations { scheme, system, constraints };
        let mut outcome = solve_step(newton, state, step, &mut problem, x);
        if problem.scheme.renew(constraints, outcome.is_ok()) {
            state.history.clear();
            outcome = solve_step(newton, state, step, &mut problem, x);
        }
        let report = outcome?;
        problem.scheme.end(system, constraints, newton, state)?;
        Ok(report)
    }
}

/// The equations of a step as Newton's method sees them.
struct Equations<'a, 'b, S, C> {
    scheme: &'a mut (dyn Scheme<S, C> + 'b),
    system: &'a S,
    constraints: &'a C,
}

impl<S, C> NewtonProblem for Equations<'_, '_, S, C> {
    fn blocks(&self) -> &[Block] {
        self.scheme.blocks()
    }

    fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        self.scheme.residual(self.system, self.constraints, x, r)
    }

    fn correction(&mut self, x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
        self.scheme.correction(self.system, self.constraints, x, dx)
    }

    fn settle(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        self.scheme.settle(self.system, self.constraints, x, r)
    }

    fn noise(&self) -> f64 {
        self.scheme.noise()
    }

    fn is_simplified(&self) -> bool {
        self.scheme.is_simplified()
    }

    fn is_round_off(&mut self, x: &[f64], r: &[f64]) -> bool {
        const PARTS: f64 = 8.0 * f64::EPSILON;
        let sizes = self.scheme.equation_sizes(self.constraints, x);
        sizes.is_some_and(|sizes| r.iter().zip(&sizes).all(|(r, size)| r.abs() <= PARTS * size))
    }

    fn resolution(&self) -> f64 {
        self.scheme.resolution()
    }

    fn closing_size(&self) -> f64 {
        self.scheme.closing_size()
    }

    fn turn(&self) -> f64 {
        self.scheme.turn()
    }
}

/// Solves one step with increasingly robust initial guesses.
fn solve_step<S, C>(
    newton: &mut Newton,
    state: &mut State,
    step: SubStep,
    problem: &mut Equations<'_, '_, S, C>,
    x: &mut [f64],
) -> Result<NewtonReport, StepError> {
    let searching = newton.settings.line_search;
    let mut failure = None;
    for attempt in 0.. {
        let guess = problem.scheme.guess(problem.system, attempt, (step, state), x);
        let Some(guess) = guess.filter(|guess| *guess == Guess::Plain || !searching) else { break };
        newton.settings.line_search = searching || guess == Guess::Damped;
        let outcome = newton.solve(problem, x);
        newton.settings.line_search = searching;
        let accepted = outcome.and_then(|report| match problem.scheme.accept(x) {
            Ok(()) => Ok(report),
            Err(fault) => Err(NewtonError::Refused { fault, iteration: report.iterations }),
        });
        match accepted {
            Ok(mut report) => {
                report.iterations += attempt * newton.settings.max_iterations;
                report.restarts = attempt;
                state.history.remember(step.index, step.h, attempt > 0, x);
                return Ok(report);
            }
            Err(error) => failure = Some(error),
        }
    }
    Err(failure.unwrap_or(NewtonError::Refused { fault: Fault::NotFinite, iteration: 0 }).into())
}
