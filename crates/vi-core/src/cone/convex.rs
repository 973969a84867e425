//! Laws with a compliance about the impulses that are given: proximal steps.
//!
//! ```text
//! Λ = Π(x),   x = Λ_0 − ρ (y + s e_N),   y = WΛ + w,   W = L Lᵀ       Π: onto the sets of the laws
//! φ(Λ) = ½ ΛᵀWΛ + ψ(x)/ρ,   ψ = ½|x|² − ½|x − Π(x)|²,   ∇φ = W (Λ − Π(x))
//! (I + B W) δΛ = F,   F = Π(x) − Λ,   B = ρ DΠ                        Newton's step of φ
//! δΛ = F − B L u,     (I + Lᵀ B L) u = Lᵀ F
//! B = ρ DΠ (I + e_N ∂s/∂y)                                            of Coulomb's law, s = μ|y_T|
//! ```
//! The laws hold for `y + (Λ − Λ_0)/ρ`, in units in which the largest diagonal of a contact is one.
//! With `s` given, `φ` is convex and has a derivative: steps to its least value along `δΛ` lead to
//! the solution from everywhere. That always exists, and is unique. From there Newton's method with
//! `s` among the unknowns leads to Coulomb's law, or does not; then repeated steps follow `s`.
//! Where the impulses that are given do not lead on, the interior point method for Coulomb's law
//! finds ones near it from nowhere, and proximal steps go on from there. Of many contacts, whose
//! states Newton's method changes few at a time, it begins next to the impulses that are given,
//! where these are not yet near the laws. The matrix of a step is as sparse as the contacts between
//! bodies. Sources: R. T. Rockafellar, SIAM J. Control Optim. 14
//! (1976) 877–898; A. M. Castro, F. N. Permenter, X. Han, IEEE Trans. Robot. 39 (2023) 1301–1320;
//! V. Acary, F. Cadoux, C. Lemaréchal, J. Malick, ZAMM 91 (2011) 155–175.
#![allow(non_snake_case)] // W, L, F, B

use super::factored::{Factored, ScaledDelassus};
use super::primal_dual::PrimalDual;
use super::problem::Cone;
use super::{ConeFault, SparseRows};
use crate::bracket::Bracket;
use crate::linear::{dot, norm_inf};
use nalgebra::Matrix3;

/// `F` relative to the largest impulse to end with, and what is accepted.
const TARGET: f64 = 1e-13;
const ACCEPTED: f64 = 1e-9;
/// Steps of Newton's method, with the speeds of slip among the unknowns, and how often one of those
/// is halved.
const STEPS: usize = 60;
const COUPLED_STEPS: usize = 25;
const HALVINGS: usize = 6;
/// Steps in a row that do not halve the residual, of Newton's method with the speeds of slip given
/// and among the unknowns.
const STALLED: usize = 3;
const COUPLED_STALLED: usize = 4;
const FIRST_STALLED: usize = 2; // where repeated steps begin
/// Complementarity and residual to which the interior point method goes on, and what is accepted:
/// laws that contradict one another leave more. `ρ` from there.
const NEARLY: f64 = 1e-7;
const NEAR: f64 = 1e-5;
const PATIENCE: usize = 16; // steps in a row that lead no nearer
const CENTRED: f64 = 1e4;
/// What impulses violate the laws by, in parts of the largest velocity, with which Newton's method
/// leads on at once.
const CLOSE: f64 = 1e-6;
/// Complementarity in parts of what velocities may violate the laws by, and its bounds; steps in a
/// row that lead no nearer. Below the lower one rounding is left of the scalings. `ρ` from there.
const INSIDE: f64 = 0.1;
const INTERIOR: [f64; 2] = [1e-8, 1e-3];
const PATIENCE_NEAR: usize = 8;
const CENTRAL: f64 = 1e3;
/// `ρ` from the impulses that are given where neither Newton's method nor the interior point
/// method leads on.
const CAREFUL: f64 = 10.0;
/// To which the least value along a step is known.
const ALONG: f64 = 1e-3;
/// Bounds of `ρ` of repeated steps. It grows by `FAST` after a step of Coulomb's law that leads on
/// and is found in `FEW_STEPS`, by `STEADY` after another one that leads on, by `IDLY` after one
/// that does not; where that law is not found it shrinks by `BACK`.
const LAST: f64 = 1e5;
const LEAST: f64 = 1.0;
const FAST: f64 = 30.0;
const STEADY: f64 = 3.0;
const IDLY: f64 = 2.0;
const BACK: f64 = 0.3;
const FEW_STEPS: usize = 3;
/// Most repeated steps; those in a row that leave more than `BARELY` of the last violation.
const ROUNDS: usize = 20;
const BARELY: f64 = 0.7;
const IDLE: usize = 4;

/// How proximal steps are repeated.
#[derive(Clone, Copy, Debug)]
pub struct Repeated {
    /// `ρ` of the first one.
    pub first: f64,
    /// What velocities may violate the laws by.
    pub within: f64,
    /// The same where the steps lead no further.
    pub enough: f64,
    /// Whether they begin from nowhere where the impulses that are given do not lead on.
    pub afresh: bool,
    /// Whether the interior point method leads from the impulses that are given to the laws, where
    /// they are not near those: of many contacts.
    pub central: bool,
}

/// What a proximal step, or several ones, left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConvexReport {
    /// By what velocities violate the laws at most, in their units: `(Λ − Λ_0)/ρ` of the last step,
    /// and `|s − μ|y_T||` where the speed of slip was followed.
    pub left: f64,
    /// Proximal steps.
    pub rounds: usize,
    /// Steps of Newton's method.
    pub steps: usize,
    /// Whether the speeds of slip are those of the velocities, in the last proximal step.
    pub follows: bool,
}

/// The solver with its memory, which grows to the largest problem; then nothing is allocated but
/// the factors of another pattern.
#[derive(Debug, Default)]
pub struct ConvexSolver {
    laws: Factored,
    given: Vec<f64>,            // k  Λ_0
    impulse: Vec<f64>,          // k
    best: Vec<f64>,             // k
    y: Vec<f64>,                // k
    nearest: Vec<f64>,          // k  Π(x)
    F: Vec<f64>,                // k
    step: Vec<f64>,             // k  δΛ
    y_step: Vec<f64>,           // k  W δΛ
    moved: Vec<f64>,            // k  y along it
    from: Vec<f64>,             // k
    start: Vec<f64>,            // k  of a round
    kept: Vec<f64>,             // k  that violate the laws least
    u: Vec<f64>,                // r
    blocks: Vec<[[f64; 3]; 3]>, // cones  B
    method: PrimalDual,
    T: Vec<f64>,                 // k
    inverses: Vec<Matrix3<f64>>, // cones
    matrices: Vec<Matrix3<f64>>, // cones
    left: Vec<f64>,              // k
}

impl ConvexSolver {
    /// Solves the laws of `y + (Λ − Λ_0)/ρ` for `y = WΛ + w`, `W = L Lᵀ`.
    ///
    /// `cones`: without [`Cone::Sliding`]. Of [`Cone::Friction`] the law is Coulomb's where
    /// Newton's method leads to impulses that obey it, else the convex one with the speed of slip
    /// of the impulses to begin with. `L`: shape `k × r`, `r` one more than its largest column.
    /// `w`: `k`. `rho`: `ρ`, in units in which the largest diagonal of `W` of a contact is one.
    /// `given`: `k`, `Λ_0`. `lambda`: `k`, where to begin, then the solution.
    ///
    /// # Errors
    /// [`ConeFault::NotFinite`], [`ConeFault::NoConvergence`] with the nearest impulses.
    ///
    /// # Panics
    /// Where the sizes differ from the number of rows of the cones.
    pub fn step(
        &mut self,
        cones: &[Cone],
        L: SparseRows<'_>,
        w: &[f64],
        rho: f64,
        given: &[f64],
        lambda: &mut [f64],
    ) -> Result<ConvexReport, ConeFault> {
        self.load(cones, L, w, rho, given, lambda)?;
        let mut report = ConvexReport { left: 0.0, rounds: 1, steps: 0, follows: true };
        let residual = self.round(rho, &mut report);
        self.hand_over(residual, lambda, report)
    }

    /// Repeated steps about the impulses of the step before, until no velocity violates a law by
    /// more than `within`, or they lead no further; the rest as of [`ConvexSolver::step`].
    ///
    /// # Errors
    /// As [`ConvexSolver::step`].
    ///
    /// # Panics
    /// As [`ConvexSolver::step`].
    pub fn follow(
        &mut self,
        cones: &[Cone],
        L: SparseRows<'_>,
        w: &[f64],
        Repeated { first, within, enough, afresh, central }: Repeated,
        lambda: &mut [f64],
    ) -> Result<ConvexReport, ConeFault> {
        self.load(cones, L, w, first + within, lambda, lambda)?;
        let mut report = ConvexReport { left: f64::INFINITY, rounds: 0, steps: 0, follows: true };
        let (mut rho, mut idle) = (first, 0);
        let (mut begun, mut least, mut may_centre) = (0, f64::INFINITY, afresh);
        if self.holds(rho, within, &mut report) {
            return self.hand_over(0.0, lambda, report);
        }
        let violated = if central { self.violated() } else { 0.0 };
        let is_far = violated > CLOSE * norm_inf(&self.method.c);
        let is_led = is_far && self.centre_near(within, violated, &mut report) <= NEAR;
        if is_far && self.holds(rho, within, &mut report) {
            return self.hand_over(0.0, lambda, report);
        }
        if is_led {
            rho = CENTRAL;
        } else if afresh && !is_far && self.couple(rho, FIRST_STALLED, &mut report).is_some() {
            self.impulse.copy_from_slice(&self.best); // a step leads on at once
        } else if afresh {
            may_centre = false;
            let is_near = self.centre(&mut report) <= NEAR;
            if self.holds(rho, within, &mut report) {
                return self.hand_over(0.0, lambda, report);
            }
            if !is_near {
                self.give(lambda);
            }
            rho = if is_near { rho.max(CENTRED) } else { CAREFUL };
        } else if is_far {
            self.give(lambda);
        }
        loop {
            let last = report.left;
            let residual = self.round(rho, &mut report);
            report.rounds += 1;
            if report.left < least {
                least = report.left;
                self.kept.copy_from_slice(&self.best);
            }
            let leads = report.left <= BARELY * last;
            idle = if leads { 0 } else { idle + 1 };
            if residual.is_nan() || residual > ACCEPTED {
                return self.hand_over(residual, lambda, report);
            }
            let ends = report.left <= within || !leads && least <= enough;
            if ends || idle == IDLE || report.rounds == ROUNDS {
                if !ends && may_centre && self.centre(&mut report) <= NEAR {
                    (rho, idle, may_centre) = (CENTRED, 0, false);
                    (report.left, report.rounds, report.follows) = (f64::INFINITY, 0, true);
                    continue;
                }
                self.best.copy_from_slice(&self.kept);
                report.left = least;
                return self.hand_over(residual, lambda, report);
            }
            let growth = match report.follows {
                true if leads && report.steps - begun <= FEW_STEPS => FAST,
                true if leads => STEADY,
                true => IDLY,
                false => BACK,
            };
            rho = (rho * growth).clamp(LEAST, LAST);
            begun = report.steps;
            self.given.copy_from_slice(&self.best);
            self.impulse.copy_from_slice(&self.best);
        }
    }

    /// Takes the problem over.
    fn load(
        &mut self,
        cones: &[Cone],
        L: SparseRows<'_>,
        w: &[f64],
        number: f64,
        given: &[f64],
        lambda: &[f64],
    ) -> Result<(), ConeFault> {
        let k = cones.iter().map(Cone::rows).sum::<usize>();
        let sizes = [L.ends.len(), w.len(), given.len(), lambda.len()];
        assert!(sizes == [k; 4], "{k} rows");
        let mut numbers = L.values.iter().chain(w).chain(given).chain(lambda).chain([&number]);
        if !(numbers.all(|own| own.is_finite()) && cones.iter().all(Cone::is_finite)) {
            return Err(ConeFault::NotFinite);
        }
        self.laws.load(cones, L, w);
        let Self { best, y, nearest, F, step, y_step, moved, from, start, kept, left, .. } = self;
        for vector in [best, y, nearest, F, step, y_step, moved, from, start, kept, left] {
            vector.clear();
            vector.resize(k, 0.0);
        }
        self.u.clear();
        self.u.resize(self.laws.r, 0.0);
        self.laws.in_units(given, &mut self.given);
        self.laws.in_units(lambda, &mut self.impulse);
        Ok(())
    }

    /// One step; the residual. Newton's method with the speeds of slip of the solution begins at
    /// once where the last step `follows` them, else at the solution of convex laws.
    fn round(&mut self, rho: f64, report: &mut ConvexReport) -> f64 {
        self.start.copy_from_slice(&self.impulse);
        if report.follows
            && let Some(residual) = self.couple(rho, COUPLED_STALLED, report)
        {
            self.measure(rho, report);
            return residual;
        }
        self.impulse.copy_from_slice(&self.start);
        self.laws.velocity(&self.impulse, &mut self.u, &mut self.y);
        self.laws.take_speeds(&self.y);
        let (residual, steps) = self.descend(rho);
        report.steps += steps;
        self.measure(rho, report);
        self.impulse.copy_from_slice(&self.best);
        let coupled = self.couple(rho, COUPLED_STALLED, report);
        report.follows = coupled.is_some();
        if report.follows {
            self.measure(rho, report);
        }
        coupled.unwrap_or(residual)
    }

    /// `given`: impulses by the interior point method, and what that leaves.
    fn centre(&mut self, report: &mut ConvexReport) -> f64 {
        self.laws.scale(&mut self.method, &mut self.T);
        let (method, mut laws) = self.interior();
        let (steps, left) = method.solve(&mut laws, NEARLY, PATIENCE);
        report.steps += steps;
        self.take_centre();
        left
    }

    /// The same from next to `given`, until velocities violate the laws by less than `within`; not
    /// far from them the path begins at the square of what is violated: contacts as far from both
    /// of their states are in between.
    fn centre_near(&mut self, within: f64, violated: f64, report: &mut ConvexReport) -> f64 {
        let Self { laws, method, T, given, .. } = self;
        let size = norm_inf(&method.c).max(f64::MIN_POSITIVE);
        let unit = laws.units.iter().copied().fold(f64::INFINITY, f64::min);
        let target = (INSIDE * within * unit / size).clamp(INTERIOR[0], INTERIOR[1]);
        let mu = (violated / size * (violated / size)).clamp(target, 1.0);
        let of = given.iter().zip(&*T);
        let x = of.map(|(own, t)| if *t > 0.0 { own / (t * size) } else { 0.0 });
        method.x.iter_mut().zip(x).for_each(|(x, own)| *x = own);
        let (method, mut laws) = self.interior();
        let (steps, left) = method.solve_near(&mut laws, mu, target, PATIENCE_NEAR);
        report.steps += steps;
        self.take_centre();
        left
    }

    /// What the impulses that are given, with their velocities, violate the laws by:
    /// `|Λ − Π(Λ − y − s e_N)|`. These are laws of the interior point method then.
    fn violated(&mut self) -> f64 {
        let Self { laws, method, T, given, nearest, y, .. } = self;
        laws.scale(method, T);
        laws.project(given, y, 1.0, nearest);
        given.iter().zip(&*nearest).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    /// The interior point method and the laws for it.
    fn interior(&mut self) -> (&mut PrimalDual, ScaledDelassus<'_>) {
        let Self { laws, method, T, inverses, matrices, blocks, F, u, left, moved, .. } = self;
        (method, ScaledDelassus { laws, T, inverses, matrices, blocks, F, u, left, refined: moved })
    }

    /// `given`, and where to begin: the impulses of the interior point method.
    fn take_centre(&mut self) {
        let Self { method, T, given, impulse, .. } = self;
        let of = method.x.iter().zip(&*T);
        given.iter_mut().zip(of).for_each(|(own, (x, t))| *own = t * x * method.size);
        impulse.copy_from_slice(given);
    }

    /// `given`, and where to begin: these impulses.
    fn give(&mut self, lambda: &[f64]) {
        self.laws.in_units(lambda, &mut self.given);
        self.impulse.clone_from(&self.given);
    }

    /// Whether no velocity violates a law by more than `within` at the impulses that are given,
    /// which are the best ones then.
    fn holds(&mut self, rho: f64, within: f64, report: &mut ConvexReport) -> bool {
        let Self { laws, best, given, nearest, u, y, .. } = self;
        laws.velocity(given, u, y);
        laws.take_speeds(y);
        laws.project(given, y, rho, nearest);
        let left = laws.left(nearest, given, y, rho);
        let holds = left <= within;
        if holds {
            report.left = left;
            best.copy_from_slice(given);
        }
        holds
    }

    /// What the best impulses leave.
    fn measure(&mut self, rho: f64, report: &mut ConvexReport) {
        let Self { laws, best, given, u, y, .. } = self;
        laws.velocity(best, u, y);
        report.left = laws.left(best, given, y, rho);
    }

    fn hand_over(
        &self,
        residual: f64,
        lambda: &mut [f64],
        report: ConvexReport,
    ) -> Result<ConvexReport, ConeFault> {
        for ((lambda, own), unit) in lambda.iter_mut().zip(&self.best).zip(&self.laws.units) {
            *lambda = own * unit;
        }
        match residual <= ACCEPTED {
            true => Ok(report),
            false => Err(ConeFault::NoConvergence { residual, cones: self.laws.count() }),
        }
    }

    /// `y`, `Π(x)` and `F` at the present impulses, with the speeds of slip at `y` where they are
    /// `coupled`; `|F|` relative to the largest impulse.
    fn evaluate(&mut self, rho: f64, coupled: bool) -> f64 {
        let Self { laws, impulse, given, u, y, nearest, F, .. } = self;
        laws.velocity(impulse, u, y);
        if coupled {
            laws.take_speeds(y);
        }
        laws.project(given, y, rho, nearest);
        let own = F.iter_mut().zip(&*nearest).zip(&*impulse);
        own.for_each(|((out, nearest), impulse)| *out = nearest - impulse);
        let size = norm_inf(nearest).max(norm_inf(impulse)).max(rho * norm_inf(&laws.w));
        let fault = norm_inf(F);
        if fault == 0.0 { 0.0 } else { fault / size }
    }

    /// Newton's method on `φ`; the residual at the best point, and the steps.
    fn descend(&mut self, rho: f64) -> (f64, usize) {
        self.best.copy_from_slice(&self.impulse);
        let (mut least, mut stalled, mut steps) = (f64::INFINITY, 0, 0);
        loop {
            let residual = self.evaluate(rho, false);
            stalled = if residual <= 0.5 * least { 0 } else { stalled + 1 };
            if residual < least {
                least = residual;
                self.best.copy_from_slice(&self.impulse);
            }
            let is_done = least <= TARGET || least <= ACCEPTED && stalled >= STALLED;
            if is_done || steps == STEPS || residual.is_nan() || !self.find_step(rho, false) {
                return (least, steps);
            }
            steps += 1;
            let part = self.least_along(rho);
            self.impulse.iter_mut().zip(&self.step).for_each(|(own, step)| *own += part * step);
        }
    }

    /// Newton's method with the speeds of slip among the unknowns, from the present impulses:
    /// the residual where it leads to a solution, which is `best` then.
    fn couple(&mut self, rho: f64, most: usize, report: &mut ConvexReport) -> Option<f64> {
        let mut now = self.evaluate(rho, true);
        let (mut least, mut stalled, mut steps) = (f64::INFINITY, 0, 0);
        loop {
            stalled = if now <= 0.5 * least { 0 } else { stalled + 1 };
            if now < least {
                least = now;
                self.moved.copy_from_slice(&self.impulse);
            }
            let ends = least <= TARGET || stalled == most || steps == COUPLED_STEPS;
            if ends || now.is_nan() || !self.find_step(rho, true) {
                break;
            }
            steps += 1;
            self.from.copy_from_slice(&self.impulse);
            let (last, mut part) = (now, 1.0);
            for _ in 0..=HALVINGS {
                let moves = self.from.iter().zip(&self.step);
                let to = self.impulse.iter_mut().zip(moves);
                to.for_each(|(own, (from, step))| *own = from + part * step);
                now = self.evaluate(rho, true);
                if now < last {
                    break;
                }
                part *= 0.5;
            }
        }
        report.steps += steps;
        let found = least <= ACCEPTED;
        if found {
            self.best.copy_from_slice(&self.moved);
        }
        found.then_some(least)
    }

    /// `step ← δΛ` at the last evaluation, where there is one.
    fn find_step(&mut self, rho: f64, coupled: bool) -> bool {
        let Self { laws, given, y, u, F, step, blocks, .. } = self;
        laws.slopes(given, y, rho, coupled, blocks);
        laws.gather(F, u);
        laws.factorize(blocks, 0.0);
        laws.solve(u);
        laws.step(F, blocks, u, step);
        step.iter().all(|own| own.is_finite())
    }

    /// The part of a step after which `φ` is least, at most all of it.
    fn least_along(&mut self, rho: f64) -> f64 {
        let Self { laws, given, y, y_step, impulse, step, moved, nearest, F, u, .. } = self;
        let k = y.len();
        laws.apply(step, u, y_step);
        let mut slope = |part: f64| {
            (0..k).for_each(|i| moved[i] = y[i] + part * y_step[i]);
            laws.project(given, moved, rho, nearest);
            let error = |i: usize| impulse[i] + part * step[i] - nearest[i];
            (0..k).map(|i| y_step[i] * error(i)).sum::<f64>()
        };
        let at_end = slope(1.0);
        if at_end <= 0.0 {
            return 1.0;
        }
        let mut bracket = Bracket::new([0.0, -dot(y_step, F)], [1.0, at_end]);
        while let Some(part) = bracket.next(ALONG) {
            bracket.take(part, slope(part));
        }
        bracket.low().max(ALONG)
    }
}
