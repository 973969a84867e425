//! When the corrections of Newton's method are small enough; the criteria are those of
//! [`crate::newton`].

use super::Precision;

/// Where the corrections of a solve are small enough.
#[derive(Clone, Copy, Debug)]
pub struct CorrectionLimits {
    /// Relative size of what may be left over.
    pub tolerance: f64,
    /// See [`crate::newton::Precision::noise`].
    pub noise: f64,
    /// See [`crate::newton::Precision::closing_size`].
    pub closing_size: f64,
    /// Contraction of the residual that the largest of its entries may hide; see
    /// [`crate::newton::NewtonProblem::rotation`].
    pub least_ratio: f64,
    /// See [`crate::newton::Precision::is_judged_by_corrections`].
    pub by_corrections: bool,
}

impl CorrectionLimits {
    /// Of a solve that stops at the `tolerance` or at rounding, where `precision` is known.
    #[must_use]
    pub fn of(tolerance: f64, precision: &Precision, least_ratio: f64) -> Self {
        let Precision { noise, closing_size, resolution, .. } = *precision;
        let tolerance = tolerance.max(resolution * f64::EPSILON);
        let by_corrections = precision.is_judged_by_corrections;
        Self { tolerance, noise, closing_size, least_ratio, by_corrections }
    }
}

/// Size of corrections that have stopped to fall above which that is no rounding, where they alone
/// are judged: slender beams leave so much.
const LEVEL: f64 = 1e-6;

/// What the corrections of a solve say of its convergence.
#[derive(Clone, Copy, Debug)]
pub struct Convergence {
    pub(crate) residual: f64, // |r|_∞ before the next correction
    stalled: usize,
    size: f64, // of the last correction; NaN before the first
}

/// What a correction says of a solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// Contraction of the residual.
    pub ratio: f64,
    /// Whether the solve is converged, closed or at the floor.
    pub is_reached: bool,
}

impl Convergence {
    /// Of a solve that begins with this `|r|_∞`.
    #[must_use]
    pub fn new(residual: f64) -> Self {
        Self { residual, stalled: 0, size: f64::NAN }
    }

    /// Takes in a correction of a relative `size` and `|r|_∞` after it.
    pub fn judge(&mut self, size: f64, next: f64, limits: CorrectionLimits) -> Judgement {
        let ratio = if next > 0.0 { next / self.residual } else { 0.0 };
        self.residual = next;
        let fall = size / std::mem::replace(&mut self.size, size);
        if limits.by_corrections {
            // corrections that fall as squares leave size · fall², and stretch what is stiff by
            // size²
            let left = size * (fall * fall).max(size);
            let converged = fall < 1.0 && left <= limits.tolerance;
            let level = fall > 0.5 && size <= LEVEL || size <= 4.0 * f64::EPSILON;
            return Judgement { ratio, is_reached: converged || level };
        }
        self.stalled = if ratio > 0.5 && size <= limits.noise { self.stalled + 1 } else { 0 };
        let converged = ratio < 1.0 && size * ratio.max(limits.least_ratio) <= limits.tolerance;
        let enough = if size <= 1e-9 { 1 } else { 3 };
        let at_floor = size <= 4.0 * f64::EPSILON || self.stalled >= enough;
        let closed = size <= limits.closing_size && ratio < 0.5;
        Judgement { ratio, is_reached: converged || at_floor || closed }
    }
}
