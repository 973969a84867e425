//! Discrete derivatives of helicoidal strains.
#![allow(non_snake_case)] // G, K, C, S, R

use super::forms::{Bends, Forms, StrainSlopes};
use super::law::Helicoidal;
use crate::strain::Strain;

/// `|Δy|²` below which the change of the strains is their slope at the middle but for rounding.
const SMALL_CHANGE: f64 = 1e-16;

impl Helicoidal {
    /// `∂̄η`: the derivative between `y_0` and `y_1` whose product with their difference is that of
    /// the strains, `∂̄η (y_1 − y_0) = η(y_1) − η(y_0)`.
    ///
    /// Source: O. Gonzalez, J. Nonlinear Sci. 6 (1996) 449–467.
    #[must_use]
    pub fn discrete_slopes(&self, [y_0, y_1]: [&Forms; 2], reference: &Strain) -> StrainSlopes {
        let middle = self.at(&(0.5 * (y_0 + y_1)), reference).slopes();
        self.away_from([y_0, y_1], &middle, reference).map_or(middle, |(slopes, _)| slopes)
    }

    /// `∂̄η` from `∂η/∂y(ȳ)`, with what the latter misses; `None` where they are the same.
    fn away_from(
        &self,
        [y_0, y_1]: [&Forms; 2],
        middle: &StrainSlopes,
        reference: &Strain,
    ) -> Option<(StrainSlopes, Strain)> {
        let change = y_1 - y_0;
        let size = change.norm_squared();
        if size < SMALL_CHANGE {
            return None;
        }
        let rest = self.rest([y_0, y_1], middle, reference);
        Some((middle + rest * change.transpose() / size, rest))
    }

    /// `η(y_1) − η(y_0) − ∂η/∂y(ȳ) Δy`, accurate relative to itself where `Δy` is small: by Gauss's
    /// rule with two points, whose error `|Δy|⁵/4320` is then below the rounding error of the
    /// difference.
    fn rest(&self, [y_0, y_1]: [&Forms; 2], middle: &StrainSlopes, reference: &Strain) -> Strain {
        const CLOSE: f64 = 1e-6;
        let (mean, change) = (0.5 * (y_0 + y_1), y_1 - y_0);
        if change.norm_squared() > CLOSE {
            return self.strain(y_1, reference) - self.strain(y_0, reference) - middle * change;
        }
        let step = change * (0.5 / 3.0_f64.sqrt());
        let slopes = |y: &Forms| self.at(y, reference).slopes();
        let away = 0.5 * (slopes(&(mean + step)) + slopes(&(mean - step))) - middle;
        away * change
    }

    /// `∂̄η` and `∂(∂̄ηᵀn)/∂y_1`.
    #[must_use]
    pub fn discrete_derivatives(
        &self,
        [y_0, y_1]: [&Forms; 2],
        reference: &Strain,
        n: &Strain,
    ) -> (StrainSlopes, Bends) {
        let (mean, change) = (0.5 * (y_0 + y_1), y_1 - y_0);
        let middle = self.at(&mean, reference);
        let (slopes, bends) = (middle.slopes(), 0.5 * middle.bends(n));
        let Some((discrete, rest)) = self.away_from([y_0, y_1], &slopes, reference) else {
            return (slopes, bends);
        };
        let size = change.norm_squared();
        let (rest, end) = (n.dot(&rest), self.at(y_1, reference));
        let of_rest = (end.slopes() - slopes).tr_mul(n) - bends * change;
        let across = of_rest - (2.0 * rest / size) * change;
        let by_end = Bends::identity() * (rest / size) + change * across.transpose() / size;
        (discrete, bends + by_end)
    }
}
