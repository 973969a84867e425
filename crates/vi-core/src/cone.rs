//! Impulses `Λ` of unilateral contact and dry friction: `y = WΛ + w`, each row with its law.
//!
//! | law | rows | `Λ` and `y` |
//! |---|---|---|
//! | [`Cone::Normal`] | 1 | `0 ≤ Λ ⊥ y ≥ 0` |
//! | [`Cone::Friction`] | 3 | the same of the normals; `Λ_T = −μΛ_N y_T/\|y_T\|`, `\|Λ_T\| ≤ μΛ_N` where `y_T = 0` |
//! | [`Cone::Sliding`] | 3 | the same of the normals; `Λ_T = −Λ_N (s + S (y_T − v))` |
//! | [`Cone::Bounded`] | 1 | `Λ = −b sgn y`, `\|Λ\| ≤ b` where `y = 0` |
//!
//! `W` is the Delassus matrix, symmetric and positive semidefinite, and may be singular: impulses
//! of hyperstatic contacts are not unique, the velocities are.
//!
//! Block Gauss–Seidel with the exact law of each contact finds the state (open, sticks, slips);
//! Newton's method on the laws as projections, with steps of least norm, ends at rounding errors.
//! Where both fail, as of tall stacks with masses of several ratios, convex programs in a sequence
//! lead to a solution. Nothing depends on earlier problems but `Λ` itself, the warm start: of
//! several solutions the one next to it is likely.
//!
//! Of many contacts [`ConvexSolver`] takes a factor of `W` in sparse rows and leads to the laws by
//! proximal steps; with a speed of slip that is given they are convex, and there is a solution in
//! any case.
//!
//! ```
//! use vi_core::cone::{Cone, ConeSolver};
//! // a point of mass 2 kg falls at 3 m/s and slides at 1 m/s: it sticks for μ ≥ 1/3
//! let (w_matrix, w) = ([0.5, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.5], [-3.0, 1.0, 0.0]);
//! let mut impulse = [0.0; 3];
//! let cones = [Cone::Friction { coefficient: 0.4 }];
//! ConeSolver::default().solve(&cones, &w_matrix, &w, &mut impulse).unwrap();
//! assert!((impulse[0] - 6.0).abs() < 1e-14 && (impulse[1] + 2.0).abs() < 1e-14);
//! ```
#![allow(non_snake_case)] // W, F

mod block_matrix;
mod conjugate;
mod convex;
mod disc;
mod factored;
mod factors;
mod interior;
mod least_norm;
mod local;
mod operator;
mod primal_dual;
mod problem;
mod residual;
mod sparse_rows;

pub use convex::{ConvexReport, ConvexSolver, Repeated};
pub use problem::Cone;
pub use sparse_rows::SparseRows;

use conjugate::Conjugate;
use factors::ConeFactors;
use interior::Interior;
use least_norm::ConeLeastNorm;
use nalgebra::{Matrix3, Vector3};
use problem::{ConeProblem, PlacedLaw};
use residual::Residual;

/// How well the laws hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConeReport {
    /// Largest violation of a law, relative to the sizes of the terms of its rows.
    pub residual: f64,
    /// Rounds of sweeps and Newton's method; 0 where the warm start solves the problem.
    pub rounds: usize,
}

/// No impulse obeys the laws, or none was found. Cones are numbered from 0.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConeFault {
    /// An entry of `W`, `w`, `Λ` or of a law is not a number.
    #[error("the velocities of the contacts are not finite")]
    NotFinite,
    /// No motion opens the contacts: `lambda` holds impulses (the largest one is 1) that change no
    /// velocity and oppose the approach, those of the contacts involved.
    #[error("no motion opens the contact {cone}")]
    Wedged {
        /// The contact with the largest of these impulses.
        cone: usize,
    },
    /// All methods ended above the tolerance.
    #[error("the impulses of {cones} contacts do not converge: residual {residual:e}")]
    NoConvergence {
        /// Of [`ConeReport`].
        residual: f64,
        /// How many laws there are.
        cones: usize,
    },
}

const TARGET: f64 = 1e-13;
/// Accepted where Newton's method does not lead further.
const ACCEPTED: f64 = 1e-12;
/// Newton's method that ends below this has found the state of all contacts but those on a rim.
const STALLED_AT: f64 = 1e-6;
/// Velocities that no motion of the bodies has, as of a step far from its solution, leave less
/// than this: nothing is wedged then.
const NEARLY: f64 = 1e-5;
const NEWTON_STEPS: usize = 25;
/// Steps from impulses that obey the laws already.
const LAST_STEPS: usize = 2;
/// Steps in a row that do not halve an accepted residual: rounding errors alone are left.
const STALLED: usize = 4;
/// Steps in a row that do not halve the residual: they lead nowhere, but in a few problems, whose
/// methods are tried once more with all steps.
const PATIENCE: usize = 8;
/// `ρ` of the rounds: where Newton's method fails with one, others lead elsewhere.
const PARAMETERS: [f64; 9] = [1.0, 1.0, 1e2, 1e-2, 1e4, 1e-4, 10.0, 0.1, 1e3];
/// Convex programs in a sequence.
const PROGRAMS: usize = 30;
/// Compliances of rows whose laws contradict one another; `ρ` and steps with each.
const COMPLIANCES: [f64; 6] = [1e-10, 1e-9, 1e-8, 1e-11, 1e-12, 1e-6];
const SOFT_PARAMETERS: [f64; 6] = [1.0, 1e2, 1e4, 1e6, 1e8, 1e10];
const SOFT_STEPS: usize = 3;
/// Most rows of which steps of Newton's method have the least norm, and compliances are tried.
const FEW: usize = 60;
/// Most rows that are swept over where it ends early.
const SWEPT: usize = 12;
/// Added to the diagonal of the derivative of more rows, in place of the least norm.
const SMALL: f64 = 1e-10;
/// Most sweeps forth and back of more rows, the laws to end with, sweeps between two looks at them.
const FAR_SWEEPS: usize = 64;
const FAR_TARGET: f64 = 1e-9;
const BETWEEN: usize = 8;

/// The solver with its memory, which grows to the largest problem; then nothing is allocated.
#[derive(Clone, Debug, Default)]
pub struct ConeSolver {
    problem: ConeProblem,
    residual: Residual,
    least_norm: ConeLeastNorm,
    conjugate: Conjugate,
    factors: ConeFactors,
    interior: Interior,
    impulse: Vec<f64>, // k
    trial: Vec<f64>,   // k
    best: Vec<f64>,    // k
    ends_early: bool,
    patience: usize,   // of Newton's method
    warm: Vec<f64>,    // k  where the methods begin
    nearest: Vec<f64>, // k
    least: f64,        // the excess of `nearest`
    swept: Vec<f64>,   // k
    found: Vec<f64>,   // k
    step: Vec<f64>,    // k
}

impl ConeSolver {
    /// Ends with [`ConeFault::NoConvergence`] near a solution without looking for it by convex
    /// programs: for who corrects `w` and asks again. Of more than 12 rows also where Newton's
    /// method does not lead to a solution from the warm start.
    pub fn end_early(&mut self, ends_early: bool) {
        self.ends_early = ends_early;
    }

    /// Finds the impulses of `y = WΛ + w`.
    ///
    /// `w_matrix`: `W`, shape `k × k`, row by row, symmetric, positive semidefinite. `w`: `k`.
    /// `lambda`: `k`, the warm start, then the solution; on [`ConeFault::NoConvergence`]
    /// the nearest impulses that were found.
    ///
    /// # Errors
    /// [`ConeFault`].
    ///
    /// # Panics
    /// Where the sizes differ from the number of rows of the cones.
    pub fn solve(
        &mut self,
        cones: &[Cone],
        w_matrix: &[f64],
        w: &[f64],
        lambda: &mut [f64],
    ) -> Result<ConeReport, ConeFault> {
        self.solve_within(cones, w_matrix, (w, &[]), lambda)
    }

    /// The same where `w` is known to `errors`, shape `k`, or exactly where that is empty: laws of
    /// rows that `W` does not tell apart may contradict one another by as much.
    ///
    /// # Errors
    /// [`ConeFault`].
    ///
    /// # Panics
    /// Where the sizes differ from the number of rows of the cones.
    pub fn solve_within(
        &mut self,
        cones: &[Cone],
        w_matrix: &[f64],
        (w, errors): (&[f64], &[f64]),
        lambda: &mut [f64],
    ) -> Result<ConeReport, ConeFault> {
        let k = cones.iter().map(Cone::rows).sum::<usize>();
        assert!(w_matrix.len() == k * k && w.len() == k && lambda.len() == k, "{k} rows");
        assert!(errors.is_empty() || errors.len() == k, "{k} rows");
        if k == 0 {
            return Ok(ConeReport { residual: 0.0, rounds: 0 });
        }
        let mut numbers = w_matrix.iter().chain(w).chain(errors).chain(&*lambda).copied();
        if !(numbers.all(f64::is_finite) && cones.iter().all(Cone::is_finite)) {
            return Err(ConeFault::NotFinite);
        }
        if let ([law], [a], [w]) = (cones, w_matrix, w)
            && *a > 0.0
        {
            let (block, now) =
                (Matrix3::from_diagonal_element(*a), Vector3::new(lambda[0], 0.0, 0.0));
            lambda[0] = local::law(*law, &block, &Vector3::new(*w, 0.0, 0.0), 0.0, 1.0, &now)[0];
            return Ok(ConeReport { residual: 0.0, rounds: 0 });
        }
        self.problem.load(cones, w_matrix, w, errors);
        if let Some(cone) = self.problem.unmovable_approach() {
            lambda.fill(0.0);
            lambda[self.problem.cones[cone].row] = 1.0;
            return Err(ConeFault::Wedged { cone });
        }
        self.residual.resize(&self.problem);
        let Self { impulse, trial, best, warm, nearest, swept, found, step, .. } = self;
        for vector in [impulse, trial, best, warm, nearest, swept, found, step] {
            vector.clear();
            vector.resize(k, 0.0);
        }
        for (i, unit) in self.problem.units.iter().enumerate() {
            self.impulse[i] = lambda[i] / unit;
        }
        let report = self.solve_scaled();
        for (i, unit) in self.problem.units.iter().enumerate() {
            lambda[i] = self.impulse[i] * unit;
        }
        if matches!(report, Err(ConeFault::Wedged { .. })) {
            let size = crate::linear::norm_inf(lambda);
            lambda.iter_mut().for_each(|lambda| *lambda /= size);
        }
        report
    }

    fn solve_scaled(&mut self) -> Result<ConeReport, ConeFault> {
        let rounding = self.rounding();
        let done = |residual, rounds| Ok(ConeReport { residual, rounds });
        self.patience = PATIENCE;
        self.residual.set_parameter(1.0);
        let residual = self.residual.evaluate(&self.problem, &self.impulse);
        if self.residual.excess() <= TARGET {
            return done(self.newton(rounding, LAST_STEPS), 0);
        }
        if self.residual.excess() <= ACCEPTED {
            return done(self.refine(rounding), 0);
        }
        if residual <= ACCEPTED {
            self.impulse.fill(0.0); // large ones that balance one another
        }
        self.least = self.residual.excess();
        self.nearest.copy_from_slice(&self.impulse);
        let is_small = self.problem.rows() <= FEW;
        let patiences: &[usize] =
            if is_small { &[PATIENCE, NEWTON_STEPS] } else { &[NEWTON_STEPS] };
        self.warm.copy_from_slice(&self.impulse);
        for patience in patiences {
            self.patience = *patience;
            self.impulse.copy_from_slice(&self.warm);
            if self.ends_early && self.problem.rows() > SWEPT {
                self.patience = PATIENCE;
                let residual = self.refine(rounding);
                return match self.ends() {
                    true => done(residual, 1),
                    false => self.end_nearby(),
                };
            }
            let found = if is_small { self.in_rounds(rounding) } else { self.of_many(rounding) };
            if let Some(found) = found {
                return Ok(found);
            }
            let is_near = self.least <= NEARLY; // by impulses that have not grown
            if is_near && self.ends_early {
                return self.end_nearby();
            }
            if let Some(found) = self.by_programs(rounding) {
                return Ok(found);
            }
            if !is_near && let Some((cone, direction)) = self.interior.wedged(&self.problem) {
                self.impulse.copy_from_slice(direction);
                return Err(ConeFault::Wedged { cone });
            }
            if is_small && let Some(done) = self.along_compliances(rounding) {
                return Ok(done);
            }
        }
        self.end_nearby()
    }

    /// The largest relative error of a sum of as many terms.
    fn rounding(&self) -> f64 {
        2.0 * f64::EPSILON * self.problem.rows() as f64
    }

    /// Convex programs in a sequence, each followed by Newton's method.
    fn by_programs(&mut self, rounding: f64) -> Option<ConeReport> {
        self.interior.begin(&self.problem);
        for program in 1..=PROGRAMS {
            let part = if program <= PROGRAMS / 2 { 1.0 } else { 0.5 };
            self.impulse.copy_from_slice(self.interior.advance(&self.problem, part));
            self.residual.evaluate(&self.problem, &self.impulse);
            let residual = match self.residual.excess() <= TARGET {
                true => self.newton(rounding, LAST_STEPS),
                false => self.refine(rounding),
            };
            if self.ends() {
                return Some(ConeReport { residual, rounds: PARAMETERS.len() + program });
            }
        }
        None
    }

    /// Sweeps and Newton's method with several `ρ`.
    fn in_rounds(&mut self, rounding: f64) -> Option<ConeReport> {
        for (round, rho) in (1..).zip(PARAMETERS) {
            self.sweep(if round == 1 { 10 } else { 30 }, 1.0, rounding);
            self.swept.copy_from_slice(&self.impulse);
            self.residual.set_parameter(rho);
            self.newton(rounding, NEWTON_STEPS);
            self.residual.set_parameter(1.0);
            let residual = self.refine(rounding);
            if self.ends() {
                return Some(ConeReport { residual, rounds: round });
            }
            self.impulse.copy_from_slice(&self.swept);
        }
        None
    }

    /// Newton's method from the warm start, then from where sweeps end, where that is near a
    /// solution.
    fn of_many(&mut self, rounding: f64) -> Option<ConeReport> {
        for round in 1..=2 {
            if round == 2 {
                self.sweep_far();
            }
            let residual = self.residual.evaluate(&self.problem, &self.impulse);
            if round == 1 || residual <= STALLED_AT {
                self.patience = PATIENCE;
                let residual = self.newton(rounding, NEWTON_STEPS);
                self.patience = NEWTON_STEPS;
                if self.ends() {
                    return Some(ConeReport { residual, rounds: round });
                }
            }
        }
        None
    }

    /// From the nearest impulses: rows that `W` does not tell apart, with `w` that contradict one
    /// another, are left by impulses that go far along what changes no velocity, until a contact
    /// opens or slides. Proximal steps take them there.
    fn along_compliances(&mut self, rounding: f64) -> Option<ConeReport> {
        let mut rounds = PARAMETERS.len() + PROGRAMS;
        for rho in SOFT_PARAMETERS {
            for compliance in COMPLIANCES {
                self.impulse.copy_from_slice(&self.nearest);
                for _ in 0..SOFT_STEPS {
                    rounds += 1;
                    self.problem.soften(compliance, &self.impulse);
                    self.residual.set_parameter(rho);
                    self.newton(rounding, NEWTON_STEPS);
                    self.problem.harden();
                    self.swept.copy_from_slice(&self.impulse);
                    self.newton(rounding, NEWTON_STEPS);
                    self.residual.set_parameter(1.0);
                    let residual = self.refine(rounding);
                    if self.ends() {
                        return Some(ConeReport { residual, rounds });
                    }
                    self.impulse.copy_from_slice(&self.swept);
                }
            }
        }
        None
    }

    /// Whether the impulses obey the laws, as far as `w` is known.
    fn holds(&mut self) -> bool {
        self.residual.evaluate(&self.problem, &self.impulse);
        self.residual.excess() <= ACCEPTED
    }

    /// The same; the nearest impulses are kept. Impulses that balance one another are no solution
    /// where the last sweeps end near one: laws that contradict one another by what they leave
    /// would be hidden by rounding.
    fn ends(&mut self) -> bool {
        let (holds, excess) = (self.holds(), self.residual.excess());
        if self.residual.balances() {
            self.residual.evaluate(&self.problem, &self.swept);
            let (balances, near) = (self.residual.balances(), self.residual.excess());
            if !balances && near <= NEARLY {
                if near < self.least {
                    self.least = near;
                    self.nearest.copy_from_slice(&self.swept);
                }
                return false;
            }
        }
        if excess < self.least {
            self.least = excess;
            self.nearest.copy_from_slice(&self.impulse);
        }
        holds
    }

    /// The nearest impulses that were found.
    fn end_nearby(&mut self) -> Result<ConeReport, ConeFault> {
        self.impulse.copy_from_slice(&self.nearest);
        let cones = self.problem.cones.len();
        Err(ConeFault::NoConvergence { residual: self.least, cones })
    }

    /// Newton's method. Where it stalls near a solution, contacts at rest may stand on the rim
    /// of their cones, with room inside for the same motion: it begins again from there.
    fn refine(&mut self, rounding: f64) -> f64 {
        let mut residual = self.newton(rounding, NEWTON_STEPS);
        for inside in [1e-8, 1e-6, 1e-4] {
            let is_known = !self.problem.errors.is_empty() && self.holds();
            if is_known || !(TARGET..=STALLED_AT).contains(&residual) {
                return residual;
            }
            self.found.copy_from_slice(&self.impulse);
            self.sweep(30, 1.0 - inside, rounding);
            let again = self.newton(rounding, NEWTON_STEPS);
            if again < residual {
                residual = again;
            } else {
                self.impulse.copy_from_slice(&self.found);
            }
        }
        residual
    }

    /// Sweeps over the contacts, each law solved exactly with `part` of its friction, until nothing
    /// but rounding changes.
    fn sweep(&mut self, sweeps: usize, part: f64, rounding: f64) {
        for _ in 0..sweeps {
            let mut change = 0.0_f64;
            for k in 0..self.problem.cones.len() {
                change = change.max(self.settle(k, part));
            }
            if change <= rounding {
                return;
            }
        }
    }

    /// Sweeps forth and back with conjugate directions, until the laws hold to `1e-9`: of many
    /// contacts these cost less than steps of Newton's method.
    fn sweep_far(&mut self) {
        let k = self.problem.rows();
        self.conjugate.begin(k);
        for turn in 1..=FAR_SWEEPS {
            self.conjugate.before(&self.impulse);
            (0..self.problem.cones.len()).for_each(|k| _ = self.settle(k, 1.0));
            (0..self.problem.cones.len()).rev().for_each(|k| _ = self.settle(k, 1.0));
            self.conjugate.after(&mut self.impulse);
            if turn % BETWEEN == 0
                && self.residual.evaluate(&self.problem, &self.impulse) <= FAR_TARGET
            {
                break;
            }
        }
        (0..self.problem.cones.len()).for_each(|k| _ = self.settle(k, 1.0));
    }

    /// Solves the law of a contact at the impulses of the others; the largest relative change.
    fn settle(&mut self, contact: usize, part: f64) -> f64 {
        let Self { problem, impulse, .. } = self;
        let PlacedLaw { cone, row } = problem.cones[contact];
        let rows = cone.rows();
        let A = Matrix3::from_fn(|i, j| match i.max(j) < rows {
            true => problem.row(row + i)[row + j],
            false => 0.0,
        });
        let now = Vector3::from_fn(|i, _| if i < rows { impulse[row + i] } else { 0.0 });
        let c = Vector3::from_fn(|i, _| match i < rows {
            true => {
                let block: f64 = (0..rows).map(|j| A[(i, j)] * now[j]).sum();
                problem.velocity(row + i, impulse) - block
            }
            false => 0.0,
        });
        let error = problem.largest_error(row..row + rows);
        let next = local::law(cone, &A, &c, error, part, &now);
        let mut change = 0.0_f64;
        for i in 0..rows {
            let value = next[i];
            change = change.max((value - now[i]).abs() / value.abs().max(1e-300));
            impulse[row + i] = value;
        }
        change
    }

    /// Newton's method from `impulse`, to the rounding errors; keeps the best point and returns
    /// its residual.
    fn newton(&mut self, rounding: f64, steps: usize) -> f64 {
        let k = self.problem.rows();
        let mut least = self.residual.evaluate(&self.problem, &self.impulse);
        let (mut now, mut stalled, mut slow_steps) = (least, 0, 0);
        let mut holds = self.residual.excess() <= ACCEPTED;
        self.best.copy_from_slice(&self.impulse);
        for _ in 0..steps {
            if least <= rounding {
                break;
            }
            self.step.copy_from_slice(&self.residual.F);
            if k <= FEW {
                let derivative = self.least_norm.matrix_mut(k);
                self.residual.derivative(&self.problem, &self.impulse, derivative);
                self.least_norm.solve(&mut self.step);
            } else {
                let derivative = self.factors.matrix_mut(k);
                self.residual.derivative(&self.problem, &self.impulse, derivative);
                (0..k).for_each(|i| derivative[(i, i)] += SMALL);
                self.factors.factorize();
                self.factors.solve(&mut self.step);
            }
            let mut part = 1.0;
            let mut next = f64::INFINITY;
            for _ in 0..=6 {
                for i in 0..k {
                    self.trial[i] = self.impulse[i] - part * self.step[i];
                }
                next = self.residual.evaluate(&self.problem, &self.trial);
                if next < now {
                    break;
                }
                part *= 0.5;
            }
            if !next.is_finite() {
                break;
            }
            self.impulse.copy_from_slice(&self.trial);
            now = next;
            let slow = now > 0.5 * least;
            if now < least {
                least = now;
                holds |= self.residual.excess() <= ACCEPTED;
                self.best.copy_from_slice(&self.impulse);
            }
            stalled = if slow && holds { stalled + 1 } else { 0 };
            slow_steps = if slow { slow_steps + 1 } else { 0 };
            if stalled == STALLED || slow_steps == self.patience {
                break;
            }
        }
        self.impulse.copy_from_slice(&self.best);
        least
    }
}
