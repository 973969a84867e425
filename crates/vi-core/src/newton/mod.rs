//! Newton's method to the round-off floor.
//!
//! It serves every implicit equation of the project. The tangent is exact, so the loop expects
//! quadratic convergence and judges it by what it sees:
//! ```text
//! size_k   = max over blocks of |δx|_∞ / scale_block            relative size of the k-th correction
//! ratio_k  = |r(x_k)| / |r(x_{k-1})|                            contraction of the residual
//! converged  when size_k · ratio_k ≤ ε/4, ratio_k < 1           what is left is below round-off
//!            ratio_k no less than |δx| |x|/100 of rotations where residuals of unlike kinds stand side by side
//! closed     when size_k ≤ √ε/2, ratio_k < 1/2              the residual is handed on: κ size_k² is left, κ < 1
//!            or turn_k |δx|_∞ ≤ ε/4 |x|_∞ of each kind      no body turns by more than turn_k: turn_k δx is left
//! at floor   when the correction is round-off: size_k ≤ 4ε, or the residual no longer contracts and
//!            size_k ≤ 1e-9 (three times in a row with size_k ≤ noise where the problem is ill-conditioned)
//! by corrections alone    size_k³/size_{k-1}², size_k² ≤ ε/4, or size_k > size_{k-1}/2 and size_k ≤ 1e-6
//! ```
//! The last line is for equations whose residual is ruled by stiff unknowns
//! ([`Precision::is_judged_by_corrections`]).
//! `scale_block` is the largest entry of the unknowns of that block, at least its floor: increments
//! are resolved to `ε` of themselves, which is what exact momentum balances need. The residual
//! after the last correction is evaluated anyway (it closes the interval), so the test costs no
//! extra factorization; where no body turns too much, it is not needed ([`NewtonProblem::settle`]).
//! The rounding error of the last correction is at hand for compensated stepping
//! ([`Newton::rounding_error`]). An optional line search halves steps that increase the residual.
//!
//! Problems with an approximate tangent are solved by simplified iterations
//! ([`Precision::is_simplified`]).

mod convergence;
mod precision;
mod report;
mod simplified;

pub use convergence::{Convergence, CorrectionLimits, Judgement};
pub use precision::{CLOSING_SIZE, Precision};
pub use report::{Fault, NewtonError, NewtonReport};

use crate::interruption;
use crate::linear::norm_inf;
use std::ops::Range;

/// What a part of the unknowns measures; errors name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BlockKind {
    /// Coordinates or translational increments, m.
    Position,
    /// Rotation increments, rad.
    Rotation,
    /// Momenta.
    Momentum,
    /// Lagrange multipliers.
    Multiplier,
}

impl BlockKind {
    /// Its unit after a space; empty where it depends on the coordinates.
    fn unit(self) -> &'static str {
        match self {
            Self::Position => " m",
            Self::Rotation => " rad",
            Self::Momentum | Self::Multiplier => "",
        }
    }
}

impl std::fmt::Display for BlockKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Position => "position",
            Self::Rotation => "rotation",
            Self::Momentum => "momentum",
            Self::Multiplier => "multiplier",
        })
    }
}

/// A block of unknowns that share a unit and a scale.
#[derive(Clone, Debug, PartialEq)]
pub struct UnknownBlock {
    /// What it measures.
    pub kind: BlockKind,
    /// Which unknowns.
    pub range: Range<usize>,
    /// Magnitude below which the unknowns of this block do not matter.
    pub floor: f64,
}

/// A square system of equations `r(x) = 0`.
pub trait NewtonProblem {
    /// The blocks of the unknowns; together they cover all of them.
    fn blocks(&self) -> &[UnknownBlock];
    /// Evaluates the residual at `x` and keeps what [`NewtonProblem::correction`] needs; `r`: shape
    /// of `x`.
    ///
    /// # Errors
    /// [`Fault`] when `x` is outside the domain of the equations.
    fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault>;
    /// `dx ← K⁻¹ dx` with `K = ∂r/∂x` at the point of the last residual; `dx` holds `r` on entry.
    ///
    /// # Errors
    /// [`Fault::SingularTangent`].
    fn correction(&mut self, x: &[f64], dx: &mut [f64]) -> Result<(), Fault>;
    /// Takes `x` as the solution: evaluates there what later calls need. By default the residual;
    /// `r` may be left as it was before the last correction. Only for approximate tangents, and
    /// where [`Precision::turn`] shows that the last correction leaves less than rounding.
    ///
    /// # Errors
    /// [`Fault`] when `x` is outside the domain of the equations.
    fn settle(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        self.residual(x, r)
    }
    /// How exactly the equations can be solved.
    fn precision(&self) -> Precision {
        Precision::default()
    }
    /// Whether the residual `r` at `x` is no larger than rounding makes it:
    /// `|r_i| ≤ c ε Σ_j |K_ij| size_j` with a small `c`. Then `x` solves equations whose
    /// coefficients differ from these by their rounding, whatever the correction of multipliers.
    /// Asked only where residual or corrections have stopped to fall and no other unknown is
    /// corrected by more than [`Precision::noise`] or [`Precision::floor`], and after the last
    /// iteration; may allocate.
    fn is_round_off(&mut self, _x: &[f64], _r: &[f64]) -> bool {
        false
    }
    /// The largest rotation in increments `x`, rad, where residuals of unlike kinds stand side by
    /// side, as gaps and momenta: the largest are then those of one kind, which one depends on the
    /// units, and if they are linear their contraction says nothing of the others. Elsewhere zero.
    fn rotation(&self, _x: &[f64]) -> f64 {
        0.0
    }
}

/// Settings of the loop.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct NewtonSettings {
    /// Corrections before the loop gives up.
    pub max_iterations: usize,
    /// Halve corrections that increase the residual; has no effect on simplified iterations.
    pub line_search: bool,
    /// Relative size of what may be left over; `0` asks for the round-off floor.
    pub tolerance: f64,
}

impl Default for NewtonSettings {
    fn default() -> Self {
        Self { max_iterations: 30, line_search: false, tolerance: 0.0 }
    }
}

/// The loop with its work vectors.
///
/// ```
/// use vi_core::newton::{UnknownBlock, BlockKind, Fault, Newton, NewtonProblem, NewtonSettings};
///
/// struct SquareRoot([UnknownBlock; 1]); // x² = 2
/// impl NewtonProblem for SquareRoot {
///     fn blocks(&self) -> &[UnknownBlock] { &self.0 }
///     fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
///         r[0] = x[0] * x[0] - 2.0;
///         Ok(())
///     }
///     fn correction(&mut self, x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
///         dx[0] /= 2.0 * x[0];
///         Ok(())
///     }
/// }
/// let block = UnknownBlock { kind: BlockKind::Position, range: 0..1, floor: 1e-8 };
/// let mut x = [1.0];
/// Newton::new(1, NewtonSettings::default()).solve(&mut SquareRoot([block]), &mut x)?;
/// assert!((x[0] - 2.0_f64.sqrt()).abs() < 1e-15);
/// # Ok::<(), vi_core::NewtonError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Newton {
    /// Settings, changeable between solves.
    pub settings: NewtonSettings,
    r: Vec<f64>,        // residual, shape of x
    dx: Vec<f64>,       // correction, shape of x
    rounding: Vec<f64>, // error of the last correction, shape of x
}

/// Iterations without a smaller residual after which it is compared with rounding.
const LEVEL: usize = 3;

/// The largest correction of a block, relative to its unknowns.
#[derive(Clone, Copy)]
struct Size {
    relative: f64,
    block: usize,
}

/// Size of the largest correction `dx` of a block of unknowns `x`, relative to them; NaN where one
/// is.
#[must_use]
pub fn relative_size(blocks: &[UnknownBlock], x: &[f64], dx: &[f64]) -> f64 {
    size(blocks, x, dx).relative
}

fn size(blocks: &[UnknownBlock], x: &[f64], dx: &[f64]) -> Size {
    largest(blocks.iter().enumerate(), x, dx)
}

fn largest<'a>(
    blocks: impl Iterator<Item = (usize, &'a UnknownBlock)>,
    x: &[f64],
    dx: &[f64],
) -> Size {
    let mut worst = Size { relative: 0.0, block: 0 };
    for (k, block) in blocks.filter(|(_, block)| !block.range.is_empty()) {
        let (mut scale, mut correction) = (block.floor, 0.0);
        for (x, dx) in x[block.range.clone()].iter().zip(&dx[block.range.clone()]) {
            scale = larger(scale, x.abs());
            correction = larger(correction, dx.abs());
        }
        let is_smaller = correction <= worst.relative * scale;
        if !is_smaller {
            worst = Size { relative: correction / scale, block: k }; // NaN, too
        }
    }
    worst
}

/// The largest of the unknowns `x` that are rotations, rad: a [`NewtonProblem::rotation`].
#[must_use]
pub fn largest_rotation(blocks: &[UnknownBlock], x: &[f64]) -> f64 {
    let rotations = blocks.iter().filter(|block| block.kind == BlockKind::Rotation);
    rotations.map(|block| norm_inf(&x[block.range.clone()])).fold(0.0, f64::max)
}

/// The larger of two numbers; NaN where one of them is.
fn larger(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}

/// What the largest correction of a block corrects: its kind and the unknown.
fn most_corrected(blocks: &[UnknownBlock], block: usize, dx: &[f64]) -> (BlockKind, usize) {
    let Some(UnknownBlock { kind, range, .. }) = blocks.get(block) else {
        return (BlockKind::Position, 0);
    };
    let size = norm_inf(&dx[range.clone()]);
    let largest = range.clone().find(|&i| dx[i].is_nan() || dx[i].abs() >= size);
    (*kind, largest.unwrap_or(range.start))
}

impl Newton {
    /// A loop for `n` unknowns.
    #[must_use]
    pub fn new(n: usize, settings: NewtonSettings) -> Self {
        Self { settings, r: vec![0.0; n], dx: vec![0.0; n], rounding: vec![0.0; n] }
    }

    /// Solves `r(x) = 0` from the initial guess in `x`.
    ///
    /// On success the problem was last evaluated at the solution.
    ///
    /// # Errors
    /// [`NewtonError`]; nothing but `x` and the problem's own scratch has changed then.
    pub fn solve(
        &mut self,
        problem: &mut impl NewtonProblem,
        x: &mut [f64],
    ) -> Result<NewtonReport, NewtonError> {
        if interruption::is_raised() {
            return Err(NewtonError::Refused { fault: Fault::Interrupted, iteration: 0 });
        }
        if problem.precision().is_simplified {
            return self.solve_simplified(problem, x);
        }
        let refused = |iteration| move |fault| NewtonError::Refused { fault, iteration };
        let mut report = NewtonReport::default();
        let mut seen = Convergence::new(self.evaluate(problem, x).map_err(refused(0))?);
        report.evaluations = 1;
        let mut level = 0;
        for iteration in 1.. {
            let size = self.correct(problem, x).map_err(refused(iteration))?;
            (report.iterations, report.last_correction) = (iteration, size.relative);
            if self.is_resolved(problem, x) {
                problem.settle(x, &mut self.r).map_err(refused(iteration))?;
                report.residual = norm_inf(&self.r);
                break;
            }
            let next = self.evaluate_with_search(problem, x, seen.residual, &mut report);
            let next = next.map_err(refused(iteration))?;
            report.residual = next;
            let least_ratio = self.least_ratio(problem, x);
            let limits =
                CorrectionLimits::of(self.settings.tolerance, &problem.precision(), least_ratio);
            let Judgement { ratio, is_reached } = seen.judge(size.relative, next, limits);
            level = if ratio > 0.5 { level + 1 } else { 0 };
            let last = iteration >= self.settings.max_iterations;
            let stopped = (level >= LEVEL || last) && self.is_round_off(problem, x);
            if is_reached || stopped {
                break;
            }
            if last {
                return Err(self.not_converged(problem, iteration, size));
            }
        }
        Ok(report)
    }

    /// Whether the residual at `x` is round-off, where no other unknowns than multipliers are still
    /// corrected.
    fn is_round_off(&self, problem: &mut impl NewtonProblem, x: &[f64]) -> bool {
        let blocks = problem.blocks().iter().enumerate();
        let blocks = blocks.filter(|(_, block)| block.kind != BlockKind::Multiplier);
        let Precision { noise, floor, .. } = problem.precision();
        let small = largest(blocks, x, &self.dx).relative <= noise.max(floor);
        small && problem.is_round_off(x, &self.r)
    }

    /// `dx ← K⁻¹ r`, `x ← x − dx`.
    fn correct(&mut self, problem: &mut impl NewtonProblem, x: &mut [f64]) -> Result<Size, Fault> {
        self.dx.copy_from_slice(&self.r);
        problem.correction(x, &mut self.dx)?;
        let size = size(problem.blocks(), x, &self.dx);
        if !size.relative.is_finite() {
            return Err(Fault::NotFinite);
        }
        for ((x, dx), rounding) in x.iter_mut().zip(&self.dx).zip(&mut self.rounding) {
            let before = *x;
            *x -= dx;
            *rounding = (before - *x) - dx; // exact where |dx| ≤ |x|
        }
        Ok(size)
    }

    /// The failure of a solve whose last correction had this `size`.
    fn not_converged(
        &self,
        problem: &impl NewtonProblem,
        iterations: usize,
        size: Size,
    ) -> NewtonError {
        let (kind, unknown) = most_corrected(problem.blocks(), size.block, &self.dx);
        let (correction, residual) = (size.relative, norm_inf(&self.r));
        NewtonError::NotConverged { iterations, kind, unknown, correction, residual }
    }

    /// Whether rotation by the last correction leaves less than rounding of the largest unknowns.
    fn is_resolved(&self, problem: &impl NewtonProblem, x: &[f64]) -> bool {
        let Precision { turn, resolution, .. } = problem.precision();
        let rounding = resolution * f64::EPSILON;
        let of_kind = |kind: BlockKind| {
            let (mut scale, mut correction) = (0.0_f64, 0.0_f64);
            for block in problem.blocks().iter().filter(|block| block.kind == kind) {
                scale = scale.max(norm_inf(&x[block.range.clone()])).max(block.floor);
                let own = norm_inf(&self.dx[block.range.clone()]);
                correction = if own <= correction { correction } else { own }; // NaN stays
            }
            turn * correction <= rounding * scale
        };
        turn.is_finite() && of_kind(BlockKind::Rotation) && of_kind(BlockKind::Position)
    }

    /// The least contraction of what rotates: momenta bend by `x δx/8` and more of a correction
    /// `δx` of a rotation by `x` in a step.
    fn least_ratio(&self, problem: &impl NewtonProblem, x: &[f64]) -> f64 {
        const PART: f64 = 0.01;
        PART * problem.rotation(x) * problem.rotation(&self.dx)
    }

    /// Rounding error of the last correction, shape of `x`: the root is closer to `x` plus this
    /// than to `x`.
    #[must_use]
    pub fn rounding_error(&self) -> &[f64] {
        &self.rounding
    }

    /// What is left of the equations at the solution, shape of `x`.
    #[must_use]
    pub fn residual(&self) -> &[f64] {
        &self.r
    }

    fn evaluate(&mut self, problem: &mut impl NewtonProblem, x: &[f64]) -> Result<f64, Fault> {
        problem.residual(x, &mut self.r)?;
        let norm = norm_inf(&self.r);
        if norm.is_finite() { Ok(norm) } else { Err(Fault::NotFinite) }
    }

    /// Evaluates at the corrected `x`; with line search on, takes back half of the correction until
    /// the residual falls (at most ten times).
    fn evaluate_with_search(
        &mut self,
        problem: &mut impl NewtonProblem,
        x: &mut [f64],
        before: f64,
        report: &mut NewtonReport,
    ) -> Result<f64, Fault> {
        let halvings = if self.settings.line_search { 10 } else { 0 };
        for _ in 0..halvings {
            report.evaluations += 1;
            match self.evaluate(problem, x) {
                Ok(after) if after <= before || norm_inf(&self.dx) <= 1e-9 * norm_inf(x) => {
                    return Ok(after);
                }
                _ => {
                    for (x, dx) in x.iter_mut().zip(&mut self.dx) {
                        *dx *= 0.5;
                        *x += *dx;
                    }
                    self.rounding.fill(0.0);
                }
            }
        }
        report.evaluations += 1;
        self.evaluate(problem, x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `x³ = a`, and `arctan x = 0`, for which full steps diverge from `|x| > 1.39`.
    enum Scalar {
        CubeRoot(f64),
        Arctan,
    }
    struct Problem(Scalar, [UnknownBlock; 1]);
    impl Problem {
        fn new(f: Scalar) -> Self {
            Self(f, [UnknownBlock { kind: BlockKind::Position, range: 0..1, floor: 1e-8 }])
        }
    }
    impl NewtonProblem for Problem {
        fn blocks(&self) -> &[UnknownBlock] {
            &self.1
        }
        fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
            r[0] = match self.0 {
                Scalar::CubeRoot(a) => x[0].powi(3) - a,
                Scalar::Arctan => x[0].atan(),
            };
            Ok(())
        }
        fn correction(&mut self, x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
            let slope = match self.0 {
                Scalar::CubeRoot(_) => 3.0 * x[0] * x[0],
                Scalar::Arctan => 1.0 / (1.0 + x[0] * x[0]),
            };
            if slope == 0.0 {
                return Err(Fault::SingularTangent);
            }
            dx[0] /= slope;
            Ok(())
        }
    }

    #[test]
    fn work_that_is_not_wanted_is_refused() {
        let flag = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(false));
        let solve = || {
            let problem = &mut Problem::new(Scalar::CubeRoot(7.0));
            Newton::new(1, NewtonSettings::default()).solve(problem, &mut [2.0])
        };
        assert!(interruption::during(&flag, solve).is_ok());
        flag.store(true, std::sync::atomic::Ordering::Relaxed);
        let fault = Fault::Interrupted;
        let refused = interruption::during(&flag, solve);
        assert_eq!(refused, Err(NewtonError::Refused { fault, iteration: 0 }));
        assert!(solve().is_ok());
    }

    #[test]
    fn converges_to_the_last_bit() {
        for a in [1e-12_f64, 0.3, 7.0, 1e9] {
            let mut x = [2.0 * a.cbrt()];
            let report = Newton::new(1, NewtonSettings::default())
                .solve(&mut Problem::new(Scalar::CubeRoot(a)), &mut x)
                .unwrap();
            let error = (x[0] / a.cbrt() - 1.0).abs();
            assert!(error <= 4.0 * f64::EPSILON, "a = {a}: relative error {error:e}");
            assert!(report.iterations <= 8, "{report:?}");
        }
    }

    #[test]
    fn the_line_search_rescues_a_divergent_start() {
        let mut newton = Newton::new(1, NewtonSettings::default());
        let failed = newton.solve(&mut Problem::new(Scalar::Arctan), &mut [3.0]);
        assert!(failed.is_err(), "{failed:?}");
        newton.settings.line_search = true;
        let mut x = [3.0];
        newton.solve(&mut Problem::new(Scalar::Arctan), &mut x).unwrap();
        assert!(x[0].abs() < 1e-15);
    }

    #[test]
    fn a_failure_says_which_block() {
        let mut newton =
            Newton::new(1, NewtonSettings { max_iterations: 2, ..NewtonSettings::default() });
        let error = newton.solve(&mut Problem::new(Scalar::CubeRoot(5.0)), &mut [100.0]);
        let message = error.unwrap_err().to_string();
        assert!(message.contains("position block"), "{message}");
        let singular = newton.solve(&mut Problem::new(Scalar::CubeRoot(5.0)), &mut [0.0]);
        assert!(singular.unwrap_err().to_string().contains("singular"));
    }
}
