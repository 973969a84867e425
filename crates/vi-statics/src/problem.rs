//! Static equilibrium by load stepping.
//!
//! ```text
//! ∇V(q) − f(t, q) + G(t, q)ᵀ μ = 0,    g(t, q) = 0                           t load parameter
//! ```
//! Loads and prescribed motions are taken at the time `t`: the path is the quasi-static motion of
//! the system. A prescribed motion makes it a path of given displacements. A step that fails, that
//! changes the configuration too much at once ([`StepBounds`]), or that bends an element beyond
//! 90°, is halved; the last equilibrium is never lost. A step at whose end more directions are
//! unstable than before ([`crate::stability`]) is halved as well, down to
//! [`StaticSettings::located`]: it may have jumped to another branch; what remains is a place where
//! the path itself turns unstable. Closed loops, redundant constraints, point masses, springs and
//! gear constraints are allowed; the tangent is exact and sparse. See [`crate::relaxation`] for an
//! initial configuration that is no equilibrium.
//!
//! Source: theory §6.9.

use crate::equations::{EquilibriumEquations, EquilibriumProblem};
use crate::limit::{BendingBounds, LimitReport};
use crate::path::{Equilibrium, StaticError, StaticPath, StaticSettings};
use crate::rotation::{RotationError, SteadyRotation};
use crate::steady_motion::{SteadyMotion, SteadyMotionError};
use crate::step_bounds::{StepBounds, StepFailure};
use nalgebra::DVector;
use vi_constraints::Constraints;
use vi_constraints::closure::ClosureWatch;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::Configuration;
use vi_core::linear::norm_inf;
use vi_core::newton::{Fault, Newton, NewtonError, NewtonReport, NewtonSettings, UnknownBlock};
use vi_core::{DiscreteLagrangian, MechanicalSystem, SeparableSystem};
use vi_multibody::mechanism::Mechanism;

/// Bodies, beams, point masses and what acts on them, in search of equilibrium.
///
/// ```
/// use vi_core::Quadrature;
/// use vi_multibody::builder::{Inertia, MechanismBuilder};
/// use vi_multibody::{FrameId::Ground, PairKind};
/// use vi_statics::StaticProblem;
///
/// // an arm on a hinge, released from the horizontal
/// let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
/// let arm = Inertia::principal(2.0, [0.1; 3]);
/// let arm = builder.body("arm", arm).at([0.5, 0.0, 0.0]).id();
/// builder.joint("hinge", PairKind::Revolute, Ground, arm).at([0.0; 3]).axis([0.0, 1.0, 0.0]);
/// let built = builder.build()?;
///
/// let mut problem = StaticProblem::new(built.system(Quadrature::Midpoint), built.mechanism);
/// let hanging = problem.equilibrate()?;
/// assert!((hanging.q[2] + 0.5).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct StaticProblem {
    pub(crate) newton: Newton,
    pub(crate) blocks: Vec<UnknownBlock>,
    pub(crate) bounds: StepBounds,
    pub(crate) x: Vec<f64>,  // (u, μ)
    pub(crate) mu: Vec<f64>, // μ of the last equilibrium, chosen rows
    pub(crate) work: EquilibriumEquations,
    pub(crate) neutral: bool, // some direction has no stiffness: steps are relaxed
    pub(crate) unstable: Option<usize>, // directions at the last equilibrium of a path
    pub(crate) neighbours: Vec<([usize; 2], BendingBounds)>, // nodes of elements
    pub(crate) elastic: Vec<bool>, // frames that are nodes of elements
}

/// A place to return to.
pub(crate) struct ReturnPoint {
    t: f64,
    q: Vec<f64>,
    angles: Vec<f64>,
    mu: Vec<f64>,
    rows: IndependentRows,
}

impl std::fmt::Debug for StaticProblem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("StaticProblem").field("factor", &self.factor()).finish_non_exhaustive()
    }
}

impl StaticProblem {
    /// A system with its constraints, at `t = 0` and in the initial configuration of the mechanism.
    #[must_use]
    pub fn new(system: SeparableSystem, mechanism: Mechanism) -> Self {
        let elastic = vec![false; mechanism.description().bodies.len()];
        let q = mechanism.initial_configuration();
        let work = EquilibriumEquations::new(system, mechanism, 0.0, &q);
        let (d, rows) = (work.unknowns(), work.rows.len());
        Self {
            newton: Newton::new(d + rows, NewtonSettings::default()),
            blocks: work.blocks(),
            bounds: StepBounds::default(),
            x: vec![0.0; d + rows],
            mu: vec![0.0; rows],
            work,
            neutral: false,
            unstable: None,
            neighbours: vec![],
            elastic,
        }
    }

    /// With elements between these pairs of frames, the nodes of beams: a step that bends an
    /// element too far is refused.
    #[must_use]
    pub fn with_elements(mut self, neighbours: Vec<[usize; 2]>) -> Self {
        neighbours.iter().flatten().for_each(|&node| self.elastic[node] = true);
        let bounded = neighbours.into_iter().map(|nodes| (nodes, BendingBounds::default()));
        self.neighbours = bounded.collect();
        self
    }

    /// With bounds for the bending of each element, in the order of
    /// [`StaticProblem::with_elements`]; those of mean directors otherwise.
    #[must_use]
    pub fn with_bounds(mut self, bounds: impl IntoIterator<Item = BendingBounds>) -> Self {
        let own = self.neighbours.iter_mut().zip(bounds);
        own.for_each(|((_, own), bounds)| *own = bounds);
        self
    }

    /// Whether constraints and forces turn with a rotation of the whole system.
    ///
    /// # Errors
    /// [`RotationError`].
    pub fn admits(&self, rotation: &SteadyRotation) -> Result<(), RotationError> {
        rotation.check(&self.work.system, &self.work.mechanism, &self.work.s.q0)
    }

    /// In a steady rotation: equilibria are then those of the frame that rotates. Premise:
    /// [`StaticProblem::admits`].
    #[must_use]
    pub fn in_rotation(mut self, rotation: &SteadyRotation) -> Self {
        self.work.rotate(rotation);
        self
    }

    /// The steady motion that the velocities `v` at the configuration `q` are: masses, constraints
    /// and forces are the same in the frame that moves.
    ///
    /// # Errors
    /// [`SteadyMotionError`].
    pub fn steady_motion(&self, q: &[f64], v: &[f64]) -> Result<SteadyMotion, SteadyMotionError> {
        SteadyMotion::of_velocities(&self.work.system, &self.work.mechanism, q, v)
    }

    /// In a steady motion: small motions are then those of the frame that moves. Premise:
    /// [`StaticProblem::steady_motion`].
    #[must_use]
    pub fn in_motion(mut self, motion: &SteadyMotion) -> Self {
        self.work.move_steadily(motion);
        self
    }

    /// Whether continuous states of signals are listed.
    #[must_use]
    pub fn has_states(&self) -> bool {
        let at = Configuration { t: self.work.t, ..self.work.s.start() };
        self.work.system.state_rates(at.moving(self.work.velocity())).is_some()
    }

    /// Lists the internal variables at the configuration, continuous states of signals where they
    /// rest as far as they can: small motions then have these states. Returns the largest rate that
    /// is left, in the unit of the state per second, such as that of an integral of what is not
    /// zero.
    pub fn list_states(&mut self) -> f64 {
        const ITERATIONS: usize = 30;
        let work = &mut self.work;
        let q = work.s.q0.clone();
        let mut v = vec![0.0; q.len()];
        work.velocity_at(&q, &mut v);
        let mut internal = vec![0.0; work.system.internal_variables()];
        let at = Configuration { t: work.t, ..work.s.start() };
        work.system.begin_internal(at.moving(&v), &mut internal);
        let mut left = 0.0;
        for _ in 0..ITERATIONS {
            let at = Configuration { internal: &internal, ..at };
            let Some(found) = work.system.state_rates(at.moving(&v)) else { break };
            left = norm_inf(&found.rates);
            let rates = DVector::from_vec(found.rates);
            let slopes = found.by_state.svd(true, true);
            let floor = 1e-12 * slopes.singular_values.amax();
            let Ok(change) = slopes.solve(&rates, floor) else { break };
            let small = change.iter().zip(&found.places).all(|(change, place)| {
                change.abs() <= 4.0 * f64::EPSILON * internal[*place].abs().max(f64::MIN_POSITIVE)
            });
            if small {
                break;
            }
            for (change, place) in change.iter().zip(&found.places) {
                internal[*place] -= change;
            }
        }
        work.s.internal = internal;
        left
    }

    /// From the configuration `q` instead of the initial one.
    #[must_use]
    pub fn starting_at(mut self, q: &[f64]) -> Self {
        let angles = self.work.mechanism.principal_angles(q);
        self.work.stand_at(q, angles);
        self
    }

    /// Coordinates of the last equilibrium.
    #[must_use]
    pub fn configuration(&self) -> &[f64] {
        &self.work.s.q0
    }

    /// Its angles with their revolutions, rad.
    #[must_use]
    pub fn angles(&self) -> &[f64] {
        &self.work.s.angles
    }

    /// Load parameter of the last equilibrium.
    #[must_use]
    pub fn factor(&self) -> f64 {
        self.work.t
    }

    /// The constraints.
    #[must_use]
    pub fn mechanism(&self) -> &Mechanism {
        &self.work.mechanism
    }

    /// The constraints that are enforced, without those inside the frames.
    #[must_use]
    pub fn rows(&self) -> &IndependentRows {
        &self.work.rows
    }

    /// Whether some direction has no stiffness; steps are then relaxed.
    #[must_use]
    pub fn is_neutral(&self) -> bool {
        self.neutral
    }

    /// Load stepping from the last equilibrium through the given load parameters.
    ///
    /// # Errors
    /// [`StaticError`]; the problem then stands at the last equilibrium of the path it holds.
    pub fn solve(
        &mut self,
        factors: &[f64],
        settings: &StaticSettings,
    ) -> Result<StaticPath, StaticError> {
        self.newton.settings = settings.newton;
        self.bounds = settings.bounds;
        self.unstable = self.unstable.or_else(|| self.unstable_directions());
        let mut path = StaticPath::default();
        for &target in factors {
            let start = self.work.t;
            let change = target - start;
            let (mut done, mut step) = (0.0, settings.first_step.clamp(0.0, 1.0));
            while done < 1.0 {
                let next = if done + 1.001 * step >= 1.0 { 1.0 } else { done + step };
                let factor = if next < 1.0 { start + next * change } else { target };
                let before = self.mark();
                match self.step_to(factor) {
                    // perhaps on another branch: a shorter step stays on the path, or locates where
                    // it turns unstable
                    Ok(point) if self.loses_stability(&point) && 0.5 * step >= settings.located => {
                        self.return_to(before);
                        step *= 0.5;
                        path.halvings += 1;
                    }
                    Ok(point) if self.loses_stability(&point) && settings.switches_branch => {
                        // the path itself turns unstable between `before` and here
                        self.return_to(before);
                        let (point, _) =
                            match self.switch_branch(change.abs().max(f64::MIN_POSITIVE)) {
                                Ok(found) => found,
                                Err(refused) => return Err(self.failure(refused, path)),
                            };
                        self.unstable = point.unstable;
                        path.switched = Some(point.factor);
                        done = ((point.factor - start) / change).min(1.0 - settings.smallest_step);
                        step = settings.located;
                        path.points.push(point);
                    }
                    Ok(point) => {
                        self.unstable = point.unstable;
                        let easy = point.iterations <= 8;
                        path.points.push(point);
                        done = next;
                        step *= if easy { 2.0 } else { 1.0 };
                    }
                    Err(_) if 0.5 * step >= settings.smallest_step => {
                        step *= 0.5;
                        path.halvings += 1;
                    }
                    Err(refused) => return Err(self.failure(refused, path)),
                }
            }
        }
        Ok(path)
    }

    /// Where the problem stands.
    pub(crate) fn mark(&self) -> ReturnPoint {
        let work = &self.work;
        let (q, angles) = (work.s.q0.clone(), work.s.angles.clone());
        ReturnPoint { t: work.t, q, angles, mu: self.mu.clone(), rows: work.rows.clone() }
    }

    pub(crate) fn return_to(&mut self, mark: ReturnPoint) {
        self.work.t = mark.t;
        self.work.stand_at(&mark.q, mark.angles);
        self.mu = mark.mu;
        if self.work.rows != mark.rows && self.work.balance(&mut self.x).is_ok() {
            self.mu.copy_from_slice(&self.x[self.work.unknowns()..]);
        }
    }

    pub(crate) fn loses_stability(&self, point: &Equilibrium) -> bool {
        let pair = self.unstable.zip(point.unstable);
        pair.is_some_and(|(before, after)| after > before)
    }

    pub(crate) fn failure(&self, refused: StepFailure, path: StaticPath) -> StaticError {
        let (factor, path) = (self.work.t, Box::new(path));
        match refused {
            StepFailure::Newton(cause) => StaticError::NotConverged { factor, cause, path },
            StepFailure::Jump(what) => StaticError::Jump { factor, what, path },
            StepFailure::Violated(what) => StaticError::Violated { factor, what, path },
            StepFailure::Limit(message) => StaticError::ElementLimit { factor, message, path },
        }
    }

    /// One step of the load; on failure everything is as before.
    fn step_to(&mut self, factor: f64) -> Result<Equilibrium, StepFailure> {
        let before = std::mem::replace(&mut self.work.t, factor);
        let outcome = if self.neutral {
            let bounds = self.bounds;
            self.relax(&bounds)
        } else {
            let solved = self.correct().and_then(|report| self.accept(&report));
            match solved {
                // the step begins at a bifurcation, to the last bit
                Err(StepFailure::Newton(NewtonError::Refused {
                    fault: Fault::SingularTangent,
                    ..
                })) => {
                    let bounds = self.bounds;
                    self.relax(&bounds)
                }
                other => other,
            }
        };
        if outcome.is_err() {
            self.work.t = before;
        }
        outcome
    }

    /// Newton's method from the last equilibrium; refuses jumps.
    pub(crate) fn correct(&mut self) -> Result<NewtonReport, StepFailure> {
        let d = self.work.unknowns();
        self.x[..d].fill(0.0);
        self.x[d..].copy_from_slice(&self.mu);
        let mut problem = EquilibriumProblem::of(&self.blocks, &mut self.work);
        let solved = self.newton.solve(&mut problem, &mut self.x);
        let prediction = problem.into_prediction();
        let report = solved.map_err(StepFailure::Newton)?;
        self.refuse_jump(&self.bounds)?;
        self.compare(&prediction)?;
        Ok(report)
    }

    /// Takes the configuration last evaluated as the new equilibrium, unless an element has folded.
    pub(crate) fn accept(&mut self, report: &NewtonReport) -> Result<Equilibrium, StepFailure> {
        self.check_limit()?;
        let d = self.work.unknowns();
        self.mu.copy_from_slice(&self.x[d..]);
        self.advance();
        Ok(self.here(report.iterations, report.residual))
    }

    /// Moves to the configuration last evaluated.
    pub(crate) fn advance(&mut self) {
        self.work.advance();
        if self.work.renew_rows() && self.work.balance(&mut self.x).is_ok() {
            self.mu.copy_from_slice(&self.x[self.work.unknowns()..]);
        }
    }

    /// Refuses folded elements and violated constraints in the configuration last evaluated.
    pub(crate) fn check_limit(&mut self) -> Result<(), StepFailure> {
        let at = Configuration { t: self.work.t, ..self.work.s.end() };
        let mechanism = &self.work.mechanism;
        let mut watch = ClosureWatch::of_solved(mechanism.len(), self.newton.settings.tolerance);
        if let Err(error) = watch.check(mechanism, at) {
            let name = error.constraint().map_or("", |row| mechanism.constraint_name(row));
            return Err(StepFailure::Violated(format!("{error} (`{name}`)")));
        }
        let limit = LimitReport::new(&self.neighbours, &self.work.s.q1);
        if limit.is_exceeded() {
            return Err(StepFailure::Limit(limit.message().unwrap_or_default()));
        }
        Ok(())
    }

    /// The last equilibrium.
    pub(crate) fn here(&mut self, iterations: usize, residual: f64) -> Equilibrium {
        let unstable = self.unstable_directions();
        let work = &self.work;
        let q = work.s.q0.clone();
        let mut multipliers = vec![0.0; work.mechanism.len()];
        work.rows.scatter(&self.mu, &mut multipliers);
        let mut g = vec![0.0; multipliers.len()];
        let at = Configuration { t: work.t, ..work.s.start() };
        work.mechanism.value(at, &mut g);
        Equilibrium {
            factor: work.t,
            multipliers,
            potential_energy: work.system.potential_energy(at),
            iterations,
            residual,
            position_residual: norm_inf(&g),
            angles: work.s.angles.clone(),
            limit: LimitReport::new(&self.neighbours, &q),
            unstable,
            q,
        }
    }
}
