//! What rounding hides of modes.
//!
//! The entries of a stiffness are sums whose largest terms are those of extension: of a beam as
//! slender as `L/h = 10⁶` bending is `10⁻¹²` of them, and its slowest modes are near their last
//! bits. A mode below them is not one without stiffness.

use crate::digits::rounded;
use std::f64::consts::TAU;
use vi_statics::modes::Modes;

/// Part of `ω²` beyond which what rounding may change of it is told, and the same of a residual.
const TOLD: f64 = 1e-3;

/// Of the modes that were found.
pub(super) struct ModeRounding {
    /// Hz below which a mode is not told from one without stiffness, where that matters.
    pub(super) below: f64,
    uncertain: Option<(f64, f64)>, // rad/s, and the part of it that may be wrong
}

impl ModeRounding {
    pub(super) fn of(found: &Modes) -> Self {
        let all = || 0..found.squared.len();
        let mut moving = all().filter(|&k| !found.is_zero(k) && !found.is_unstable(k));
        let Some(slowest) = moving.next() else { return Self { below: 0.0, uncertain: None } };
        let hidden = all().filter(|&k| found.is_zero(k)).map(|k| found.noise[k]);
        let hidden = hidden.fold(0.0, f64::max);
        let below = match hidden > TOLD * found.squared[slowest] {
            true => hidden.sqrt() / TAU,
            false => 0.0,
        };
        let square = found.squared[slowest];
        let part = 0.5 * found.noise[slowest] / square;
        Self { below, uncertain: (part > TOLD).then(|| (square.sqrt(), part)) }
    }

    /// What is worth saying; `residual`: the largest, relative to the size of its terms.
    pub(super) fn warning(&self, residual: f64) -> Option<String> {
        let lost = "rounding hides what is slow beside what is stiff: state stiffnesses of more alike sizes (a \
                    section without extension that matters may have a smaller EA), or use more elements";
        let below = (self.below > 0.0).then(|| {
            format!(
                "modes below {} Hz are not told from those without stiffness",
                rounded(self.below, 3)
            )
        });
        let uncertain = self.uncertain.map(|(omega, part)| {
            format!(
                "the frequency of the slowest vibration, {} Hz, may be wrong by {} of it",
                rounded(omega / TAU, 3),
                rounded(part, 2)
            )
        });
        let residual = (residual > TOLD).then(|| {
            format!(
                "the equations of the modes hold to {} of their terms alone",
                rounded(residual, 2)
            )
        });
        let all = [below, uncertain, residual].into_iter().flatten();
        let all = all.reduce(|all, more| format!("{all}; {more}"))?;
        Some(format!("{all}: {lost}"))
    }
}
