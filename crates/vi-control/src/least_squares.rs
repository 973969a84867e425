//! Least squares within bounds by the method of Levenberg and Marquardt, and what is known then.
//!
//! ```text
//! minimise ½ ρ(θ)ᵀρ(θ)      z_j = θ_j/s_j,   R = ∂ρ/∂z = U Σ Vᵀ over the z_j that are free
//! δz = −V diag(σ/(σ² + μ)) Uᵀ ρ          μ falls where the decrease is the one predicted, grows where not
//! cov θ = S (RᵀR)⁻¹ S,   S = diag s       residuals divided by their standard deviations
//! ```
//! A parameter at a bound that the gradient pushes outward is held there. Singular values below
//! [`UNSEEN`] of the largest belong to combinations of parameters that the data do not see; no
//! step goes along them, they are named, and no covariance is given without a prior.
//!
//! Source: J. J. Moré, in: Numerical Analysis, Lecture Notes in Mathematics 630 (1978) 105–116; A.
//! Wald, J. Wolfowitz, Ann. Math. Statist. 11 (1940) 147–162 for the runs of signs.
#![allow(non_snake_case)] // R, U, V, S

use crate::singular_values::SingularValues;
use nalgebra::DMatrix;
use vi_core::linear::{dot, norm_inf};

/// Relative size of singular values below which a combination of parameters is not seen.
pub const UNSEEN: f64 = 1e-8;

/// The same below which a combination is hardly seen.
pub const HARDLY_SEEN: f64 = 1e-3;

/// Residuals with their derivatives.
pub trait Residuals {
    /// Number of residuals.
    fn len(&self) -> usize;
    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// `out ← ρ(θ)`, shape [`Residuals::len`], and `jacobian ← ∂ρ/∂θ`, shape that times the number
    /// of parameters, where it is asked for.
    ///
    /// # Errors
    /// [`Refused`] where there are none: a motion that does not exist.
    fn evaluate(
        &mut self,
        theta: &[f64],
        out: &mut [f64],
        jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), Refused>;
}

/// Residuals do not exist for parameters.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Refused(
    /// Why.
    pub String,
);

/// An unknown.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Where the method starts, within the bounds.
    pub start: f64,
    /// `[min, max]`, infinite where there is none.
    pub bounds: [f64; 2],
    /// What is known beforehand: a value and its standard deviation.
    pub prior: Option<[f64; 2]>,
    /// Its size, positive: a relative change is one of it. The start where that is not zero.
    pub scale: f64,
}

impl Parameter {
    /// Without bounds and prior; its size is that of its start, 1 at zero.
    #[must_use]
    pub fn new(name: &str, start: f64) -> Self {
        let scale = if start == 0.0 { 1.0 } else { start.abs() };
        let bounds = [f64::NEG_INFINITY, f64::INFINITY];
        Self { name: name.to_owned(), start, bounds, prior: None, scale }
    }

    pub(crate) fn is_sound(&self) -> bool {
        let [min, max] = self.bounds;
        let prior = self.prior.is_none_or(|[at, s]| at.is_finite() && s > 0.0 && s.is_finite());
        let within = min <= self.start && self.start <= max && self.start.is_finite();
        within && prior && self.scale > 0.0 && self.scale.is_finite()
    }

    /// The bounds of `z = θ/scale`.
    fn relative(&self) -> [f64; 2] {
        self.bounds.map(|bound| bound / self.scale)
    }

    /// `θ`; a bound is met exactly.
    fn value(&self, z: f64) -> f64 {
        let ([lower, upper], [min, max]) = (self.relative(), self.bounds);
        match z {
            z if z <= lower => min,
            z if z >= upper => max,
            z => (self.scale * z).clamp(min, max),
        }
    }

    /// Whether it is held at a bound, where the sum has this slope along it.
    pub(crate) fn is_held(&self, z: f64, slope: f64) -> bool {
        let [lower, upper] = self.relative();
        lower >= upper || z <= lower && slope > 0.0 || z >= upper && slope < 0.0
    }
}

/// `θ` of relative parameters.
pub(crate) fn theta(parameters: &[Parameter], z: &[f64]) -> Vec<f64> {
    parameters.iter().zip(z).map(|(own, z)| own.value(*z)).collect()
}

/// A step of the free parameters, cut at their bounds.
pub(crate) struct BoundedStep {
    /// Where it ends.
    pub(crate) z: Vec<f64>,
    /// The change of each.
    pub(crate) by: Vec<f64>,
    /// The largest, relative.
    pub(crate) size: f64,
}

impl BoundedStep {
    pub(crate) fn new(parameters: &[Parameter], from: &[f64], free: &[usize], by: &[f64]) -> Self {
        let mut z = from.to_vec();
        for (&j, change) in free.iter().zip(by) {
            let [lower, upper] = parameters[j].relative();
            z[j] = (z[j] + change).clamp(lower, upper);
        }
        let by: Vec<f64> = z.iter().zip(from).map(|(a, b)| a - b).collect();
        let size = norm_inf(&by) / f64::max(1.0, norm_inf(&z));
        Self { z, by, size }
    }
}

/// Column `j` of a matrix.
pub(crate) fn column(matrix: &DMatrix<f64>, j: usize) -> &[f64] {
    let rows = matrix.nrows();
    &matrix.as_slice()[j * rows..(j + 1) * rows]
}

pub(crate) fn half_square(r: &[f64]) -> f64 {
    0.5 * dot(r, r)
}

/// Largest cosine between the residual and a free column of its derivatives.
pub(crate) fn slope(derivatives: &DMatrix<f64>, r: &[f64], free: &[usize]) -> f64 {
    let size = dot(r, r).sqrt();
    let cosine = |&j: &usize| {
        let own = column(derivatives, j);
        let both = dot(own, own).sqrt() * size;
        if both > 0.0 { dot(own, r).abs() / both } else { 0.0 }
    };
    norm_inf(&free.iter().map(cosine).collect::<Vec<f64>>())
}

/// Wrong inputs, and residuals that do not exist at the start.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// Bounds without its start, a prior or a size that is not positive.
    #[error("`{0}` needs a start between its bounds, and positive sizes")]
    Parameter(String),
    /// Nothing to fit.
    #[error("there are {residuals} residuals for {parameters} parameters")]
    TooFew {
        /// With those of priors.
        residuals: usize,
        /// Unknowns.
        parameters: usize,
    },
    /// No residual depends on it.
    #[error("nothing that is measured depends on `{0}`")]
    Idle(String),
    /// None at the start.
    #[error("at the start: {0}")]
    Start(Refused),
    /// A residual or a derivative is not finite at the start.
    #[error("a residual or its derivative is not finite at the start")]
    NotFinite,
}

/// How the method ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitOutcome {
    /// No direction within the bounds decreases the sum.
    Converged,
    /// It made as many iterations as it may.
    Exhausted,
    /// No step decreases the sum, though the gradient is not zero: residuals do not exist beyond,
    /// or derivatives are not theirs.
    Stuck,
}

/// A combination of parameters that the data do not see, or hardly.
#[derive(Clone, Debug, PartialEq)]
pub struct Unseen {
    /// Relative to the largest singular value.
    pub singular_value: f64,
    /// `δθ_j/s_j`, of length 1, with the largest entry positive.
    pub direction: Vec<f64>,
}

/// What the data say.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// How it ended.
    pub outcome: FitOutcome,
    /// Iterations made.
    pub iterations: usize,
    /// `θ`.
    pub parameters: Vec<f64>,
    /// Those at a bound.
    pub at_bounds: Vec<usize>,
    /// `ρ` of the measurements at `θ`, without those of priors.
    pub residuals: Vec<f64>,
    /// `½ ρᵀρ` with priors.
    pub half_sum_of_squares: f64,
    /// `ρᵀρ` over the number of residuals less that of free parameters; NaN where these are equal.
    pub chi_square_per_freedom: f64,
    /// `cov θ` of the free parameters, zero for those at bounds; `None` where a combination is not
    /// seen.
    pub covariance: Option<DMatrix<f64>>,
    /// Singular values of `R`, largest first.
    pub singular_values: Vec<f64>,
    /// Combinations that are not seen.
    pub unseen: Vec<Unseen>,
    /// Combinations that are hardly seen.
    pub hardly_seen: Vec<Unseen>,
    /// Largest `|∂(½ρᵀρ)/∂z|` of free parameters, relative to the sizes of its terms.
    pub gradient: f64,
}

impl Estimate {
    /// `√ (cov θ)_jj`; `None` where a combination is not seen.
    #[must_use]
    pub fn standard_errors(&self) -> Option<Vec<f64>> {
        let covariance = self.covariance.as_ref()?;
        Some((0..covariance.nrows()).map(|j| covariance[(j, j)].sqrt()).collect())
    }

    /// Correlations; `None` where a combination is not seen. NaN beside parameters at bounds.
    #[must_use]
    pub fn correlation(&self) -> Option<DMatrix<f64>> {
        let (covariance, s) = (self.covariance.as_ref()?, self.standard_errors()?);
        Some(DMatrix::from_fn(s.len(), s.len(), |i, j| covariance[(i, j)] / (s[i] * s[j])))
    }
}

/// The method with its limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastSquares {
    /// Iterations at most.
    pub max_iterations: usize,
}

impl Default for LeastSquares {
    fn default() -> Self {
        Self { max_iterations: 100 }
    }
}

/// Residuals with those of priors, by relative parameters.
struct RelativeProblem<'a> {
    residuals: &'a mut dyn Residuals,
    parameters: &'a [Parameter],
}

/// A point with its derivatives.
struct Fit {
    z: Vec<f64>,
    r: Vec<f64>,
    R: DMatrix<f64>,
}

impl RelativeProblem<'_> {
    fn measured(&self) -> usize {
        self.residuals.len()
    }

    fn len(&self) -> usize {
        self.measured() + self.parameters.iter().filter(|own| own.prior.is_some()).count()
    }

    /// `None`: the point is refused, or not finite.
    fn at(&mut self, z: Vec<f64>) -> Result<Option<Fit>, Refused> {
        let (m, p) = (self.measured(), self.parameters.len());
        let theta = theta(self.parameters, &z);
        let (mut r, mut jacobian) = (vec![0.0; self.len()], DMatrix::zeros(m, p));
        self.residuals.evaluate(&theta, &mut r[..m], Some(&mut jacobian))?;
        let mut R = DMatrix::zeros(self.len(), p);
        for (j, own) in self.parameters.iter().enumerate() {
            (0..m).for_each(|i| R[(i, j)] = own.scale * jacobian[(i, j)]);
        }
        let with_prior = self.parameters.iter().enumerate();
        let mut row = m;
        for (j, own) in with_prior {
            if let Some([value, deviation]) = own.prior {
                r[row] = (theta[j] - value) / deviation;
                R[(row, j)] = own.scale / deviation;
                row += 1;
            }
        }
        let finite = r.iter().chain(R.iter()).all(|x| x.is_finite());
        Ok(finite.then_some(Fit { z, r, R }))
    }
}

impl Fit {
    /// `∂(½ρᵀρ)/∂z_j`.
    fn gradient(&self, j: usize) -> f64 {
        dot(column(&self.R, j), &self.r)
    }

    /// Parameters that are not held at a bound.
    fn free(&self, parameters: &[Parameter]) -> Vec<usize> {
        let held = |j: &usize| parameters[*j].is_held(self.z[*j], self.gradient(*j));
        (0..parameters.len()).filter(|j| !held(j)).collect()
    }

    fn columns(&self, free: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(self.R.nrows(), free.len(), |i, k| self.R[(i, free[k])])
    }

    /// Whether nothing is left to do: no free column is along the residual, or the step without
    /// damping is one of rounding. A step that damping makes short says nothing.
    fn is_flat(&self, free: &[usize]) -> bool {
        let svd = SingularValues::of(&self.columns(free));
        let least = UNSEEN * svd.values.first().copied().unwrap_or(0.0);
        let products = svd.left_products(&self.r);
        let whole = |(sigma, c): (&f64, &f64)| if *sigma > least { c / sigma } else { 0.0 };
        let step: Vec<f64> = svd.values.iter().zip(&products).map(whole).collect();
        let size = norm_inf(&svd.combine(&step)) / f64::max(1.0, norm_inf(&self.z));
        slope(&self.R, &self.r, free) <= FLAT || size <= FLAT
    }
}

/// `½ρᵀρ` may rise by rounding.
const ROUNDING: f64 = 1e-13;

/// Relative steps below this end the method.
const STEP: f64 = 1e-12;

/// What is left of slopes and of steps without damping at a minimum.
const FLAT: f64 = 1e-9;

impl LeastSquares {
    /// Fits parameters.
    ///
    /// # Errors
    /// [`FitError`].
    pub fn fit(
        &self,
        residuals: &mut dyn Residuals,
        parameters: &[Parameter],
    ) -> Result<Estimate, FitError> {
        if let Some(odd) = parameters.iter().find(|own| !own.is_sound()) {
            return Err(FitError::Parameter(odd.name.clone()));
        }
        let mut problem = RelativeProblem { residuals, parameters };
        if problem.len() < parameters.len() || parameters.is_empty() {
            let residuals = problem.len();
            return Err(FitError::TooFew { residuals, parameters: parameters.len() });
        }
        let z = parameters.iter().map(|own| own.start / own.scale).collect();
        let first = problem.at(z).map_err(FitError::Start)?;
        let mut fit = first.ok_or(FitError::NotFinite)?;
        if let Some(idle) = (0..parameters.len()).find(|&j| fit.R.column(j).amax() == 0.0) {
            return Err(FitError::Idle(parameters[idle].name.clone()));
        }
        let (mut outcome, mut iterations) = (FitOutcome::Exhausted, 0);
        let mut damping = 1e-3; // μ over the largest σ²
        while iterations < self.max_iterations {
            let free = fit.free(parameters);
            if free.is_empty() || half_square(&fit.r) == 0.0 {
                outcome = FitOutcome::Converged;
                break;
            }
            iterations += 1;
            match step(&mut problem, &fit, &free, &mut damping) {
                Some((next, size)) if size > STEP => fit = next,
                last => {
                    if let Some((next, _)) = last {
                        fit = next;
                    }
                    let flat = fit.is_flat(&fit.free(parameters));
                    outcome = if flat { FitOutcome::Converged } else { FitOutcome::Stuck };
                    break;
                }
            }
        }
        Ok(estimate(&problem, &fit, outcome, iterations))
    }
}

/// The next point and the size of its step; `None` where no step decreases the sum.
fn step(
    problem: &mut RelativeProblem<'_>,
    fit: &Fit,
    free: &[usize],
    damping: &mut f64,
) -> Option<(Fit, f64)> {
    const TRIALS: usize = 40;
    let svd = SingularValues::of(&fit.columns(free));
    let products = svd.left_products(&fit.r);
    let (largest, before) = (svd.values.first().copied()?, half_square(&fit.r));
    for _ in 0..TRIALS {
        let mu = *damping * largest * largest;
        let filtered = |(sigma, c): (&f64, &f64)| {
            let seen = *sigma > UNSEEN * largest;
            if seen { -sigma / (sigma * sigma + mu) * c } else { 0.0 }
        };
        let coefficients: Vec<f64> = svd.values.iter().zip(&products).map(filtered).collect();
        let change = svd.combine(&coefficients); // [2.44]
        let BoundedStep { z, by, size } =
            BoundedStep::new(problem.parameters, &fit.z, free, &change);
        // of the linear model, with the change as it was cut
        let predicted = {
            let mut r = fit.r.clone();
            for (j, change) in by.iter().enumerate() {
                let own = column(&fit.R, j);
                r.iter_mut().zip(own).for_each(|(r, own)| *r += change * own);
            }
            before - half_square(&r)
        };
        if let Ok(Some(next)) = problem.at(z) {
            let decrease = before - half_square(&next.r);
            let gain = decrease / predicted;
            if decrease > 0.0 || decrease >= -ROUNDING * before && size <= 1e-6 {
                *damping = if gain > 0.75 { *damping * 0.1 } else { *damping };
                *damping = if gain < 0.25 && size > 1e-6 { *damping * 4.0 } else { *damping };
                *damping = damping.max(1e-16);
                return Some((next, size));
            }
        }
        if size <= STEP {
            return None;
        }
        *damping *= 10.0;
    }
    None
}

fn estimate(
    problem: &RelativeProblem<'_>,
    fit: &Fit,
    outcome: FitOutcome,
    iterations: usize,
) -> Estimate {
    let parameters = problem.parameters;
    let (p, free) = (parameters.len(), fit.free(parameters));
    let svd = SingularValues::of(&fit.columns(&free));
    let largest = svd.values.first().copied().unwrap_or(0.0);
    let combination = |k: usize| {
        let mut direction = vec![0.0; p];
        free.iter().enumerate().for_each(|(i, &j)| direction[j] = svd.right[(i, k)]);
        let top =
            direction.iter().copied().fold(0.0_f64, |a, b| if b.abs() > a.abs() { b } else { a });
        direction.iter_mut().for_each(|d| *d *= f64::copysign(1.0, top));
        Unseen { singular_value: svd.values[k] / largest, direction }
    };
    let below = |least: f64, most: f64| -> Vec<Unseen> {
        let all = (0..svd.values.len()).map(combination);
        all.filter(|own| own.singular_value >= least && own.singular_value < most).collect()
    };
    let unseen = below(0.0, UNSEEN);
    let covariance = unseen.is_empty().then(|| {
        let mut covariance = DMatrix::zeros(p, p);
        for (a, &i) in free.iter().enumerate() {
            for (b, &j) in free.iter().enumerate() {
                let term = |k: usize| {
                    svd.right[(a, k)] * svd.right[(b, k)] / (svd.values[k] * svd.values[k])
                };
                let sum: f64 = (0..free.len()).map(term).sum();
                covariance[(i, j)] = parameters[i].scale * parameters[j].scale * sum;
            }
        }
        covariance
    });
    let sum = half_square(&fit.r);
    let freedoms = fit.r.len() as f64 - free.len() as f64;
    Estimate {
        outcome,
        iterations,
        parameters: theta(problem.parameters, &fit.z),
        at_bounds: (0..p).filter(|j| !free.contains(j)).collect(),
        residuals: fit.r[..problem.measured()].to_vec(),
        half_sum_of_squares: sum,
        chi_square_per_freedom: if freedoms > 0.0 { 2.0 * sum / freedoms } else { f64::NAN },
        covariance,
        singular_values: svd.values.clone(),
        hardly_seen: below(UNSEEN, HARDLY_SEEN),
        unseen,
        gradient: slope(&fit.R, &fit.r, &free),
    }
}

/// The test of Wald and Wolfowitz: how likely at least so unusual a number of runs of equal signs
/// is where residuals are independent; `None` with fewer than ten of either sign.
///
/// Few runs tell of a model that misses something.
#[must_use]
pub fn probability_of_runs(residuals: &[f64]) -> Option<f64> {
    let signs: Vec<bool> =
        residuals.iter().filter(|r| **r != 0.0).map(|r| r.is_sign_positive()).collect();
    let positive = signs.iter().filter(|sign| **sign).count() as f64;
    let negative = signs.len() as f64 - positive;
    if positive < 10.0 || negative < 10.0 {
        return None;
    }
    let runs = 1.0 + signs.windows(2).filter(|pair| pair[0] != pair[1]).count() as f64;
    let (n, product) = (positive + negative, 2.0 * positive * negative);
    let mean = product / n + 1.0;
    let variance = product * (product - n) / (n * n * (n - 1.0));
    Some(libm::erfc((runs - mean).abs() / (2.0 * variance).sqrt()))
}
