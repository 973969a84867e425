//! Convergence studies: errors of `q`, `p` and `λ` at shrinking steps against a reference.
//!
//! Errors are largest deviations over four nodes of the run, relative to the largest entry of the
//! quantity there. The reference is the exact motion where the subject knows it, else a fine run of
//! order 8, else (with dampers, which do not compose) an extrapolation of runs of order 2 in even
//! powers of `h`. Its uncertainty is what the last refinement changed, and at the size of rounding
//! what Galerkin steps of order 12 differ by.

use super::order::{CLEAR, ErrorAt, NoOrder, ObservedOrder, QuantityScale, observed_order};
use super::round_off::round_off;
use super::subject::{GalerkinForm, NodeValues, SchemeSetting, SteppingMethod, Subject};
use serde::{Deserialize, Serialize};
use vi_constraints::SchemeKind;
use vi_core::linear::norm_inf;

/// Nodes of a run at which errors are taken.
const SAMPLES: u32 = 4;
/// The same of orders from [`HIGH`] on: their runs have few steps.
const SAMPLES_OF_HIGH: u32 = 2;
/// Orders whose errors fall from the coarse end to round-off within few halvings.
pub(super) const HIGH: u32 = 8;

/// How far, and from how coarse a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Horizon {
    /// End of the runs, s.
    pub end: f64,
    /// Steps of the coarsest run, a multiple of 8.
    pub coarsest: u32,
    /// Steps of the finest run at most.
    pub finest: u32,
}

/// What converges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum StudiedQuantity {
    /// `q_n`.
    #[serde(rename = "q")]
    Position,
    /// `ᵠp_n`.
    #[serde(rename = "p_projected")]
    Momentum,
    /// `p_n` of (34).
    #[serde(rename = "p_constrained")]
    ConstrainedMomentum,
    /// `λ_n` of (36).
    #[serde(rename = "lambda")]
    Multiplier,
    /// `λ` of the acceleration level, or of a single energy–momentum step.
    #[serde(rename = "lambda_other")]
    OtherMultiplier,
    /// `λ_0` of (47).
    #[serde(rename = "lambda_0")]
    StartMultiplier,
}

impl StudiedQuantity {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Position,
        Self::Momentum,
        Self::ConstrainedMomentum,
        Self::Multiplier,
        Self::OtherMultiplier,
        Self::StartMultiplier,
    ];

    /// As it is written for a method.
    #[must_use]
    pub fn name(self, method: SteppingMethod) -> &'static str {
        let variational = method.is_variational();
        match self {
            Self::Position => "q",
            Self::Momentum if variational => "p (projected, 40)",
            Self::Momentum => "p = M v",
            Self::ConstrainedMomentum => "p (constrained, 34)",
            Self::Multiplier if variational => "λ (36)",
            Self::Multiplier => "λ, mean of two steps",
            Self::OtherMultiplier if variational => "λ (acceleration level)",
            Self::OtherMultiplier => "λ of a single step",
            Self::StartMultiplier if variational => "λ_0 (47)",
            Self::StartMultiplier => "initial λ",
        }
    }

    /// Its value in a run, of which `start` is the first node.
    fn of<'a>(self, start: &'a NodeValues, at: &'a NodeValues) -> Option<&'a [f64]> {
        match self {
            Self::Position => Some(&at.q),
            Self::Momentum => Some(&at.p),
            Self::ConstrainedMomentum => at.p_constrained.as_deref(),
            Self::Multiplier => at.lambda.as_deref(),
            Self::OtherMultiplier => at.lambda_other.as_deref(),
            Self::StartMultiplier => start.lambda.as_deref(),
        }
    }

    /// Its value in the reference: there is one momentum and one multiplier in the exact motion.
    fn exact<'a>(self, start: &'a NodeValues, at: &'a NodeValues) -> Option<&'a [f64]> {
        match self {
            Self::Position => Some(&at.q),
            Self::Momentum | Self::ConstrainedMomentum => Some(&at.p),
            Self::Multiplier | Self::OtherMultiplier => at.lambda_other.as_deref(),
            Self::StartMultiplier => start.lambda_other.as_deref(),
        }
    }
}

/// The motion that errors are measured against.
#[derive(Clone, Debug)]
pub struct ReferenceMotion {
    /// The initial node and the nodes at quarters of the run.
    nodes: Vec<NodeValues>,
    /// Uncertainty of `q`, `p`, `λ`, relative.
    uncertainty: [f64; 3],
    /// What it is, in words.
    pub origin: String,
}

/// Errors of one quantity at shrinking steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorSequence {
    /// The quantity.
    pub quantity: StudiedQuantity,
    /// Relative errors, the coarsest step first.
    pub errors: Vec<ErrorAt>,
    /// The order over four halvings, or why none can be read.
    pub observed: Result<ObservedOrder, NoOrder>,
    /// The floor that errors were read above.
    pub floor: f64,
}

/// The initial node and the nodes at quarters of a run of `steps` steps.
///
/// # Errors
/// Why the method does not apply or fails, in words.
pub fn nodes(
    subject: &dyn Subject,
    method: SteppingMethod,
    order: u32,
    end: f64,
    steps: u32,
) -> Result<Vec<NodeValues>, String> {
    equal_parts(subject, method, order, end, steps, SAMPLES)
}

/// The initial node and those at the ends of `parts` equal parts of a run of `steps` steps.
fn equal_parts(
    subject: &dyn Subject,
    method: SteppingMethod,
    order: u32,
    end: f64,
    steps: u32,
    parts: u32,
) -> Result<Vec<NodeValues>, String> {
    let mut motion = subject.start(SchemeSetting::new(method, order, end / f64::from(steps)))?;
    let mut nodes = vec![motion.values()?];
    for k in 1..=steps {
        motion.step()?;
        if k.is_multiple_of(steps / parts) {
            nodes.push(motion.values()?);
        }
    }
    Ok(nodes)
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    norm_inf(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>())
}

/// Largest of `values`; NaN stays.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    norm_inf(&values.collect::<Vec<f64>>())
}

/// Largest relative error of a quantity; `None` where the run or the reference does not have it, or
/// where it is zero throughout.
fn relative_error(
    quantity: StudiedQuantity,
    run: &[NodeValues],
    reference: &[NodeValues],
) -> Option<f64> {
    let (start, exact_start) = (&run[0], &reference[0]);
    let (mut errors, mut sizes) = (Vec::new(), Vec::new());
    for (at, exact) in run.iter().zip(reference).skip(1) {
        let (found, exact) = (quantity.of(start, at)?, quantity.exact(exact_start, exact)?);
        errors.push(largest_difference(found, exact));
        sizes.push(norm_inf(exact));
    }
    let size = largest(sizes.into_iter());
    (size > 1e-12).then(|| largest(errors.into_iter()) / size)
}

/// Largest difference of `q` between two runs, relative to the largest coordinate.
pub fn relative_difference(run: &[NodeValues], other: &[NodeValues]) -> f64 {
    relative_error(StudiedQuantity::Position, run, other).unwrap_or(0.0)
}

/// No change of a reference below this is told from rounding.
const ROUND_OFF: f64 = 1e-14;

/// The schemes that a reference may be computed by, the best first.
const BY: [SteppingMethod; 2] =
    [SteppingMethod::NODAL, SteppingMethod::Variational(SchemeKind::Constrained)];
/// A reference less certain than that may be replaced by one of Galerkin steps, which are larger.
const WELL_KNOWN: f64 = 1e-13;
/// References of two schemes that differ by less are the same motion, apart from rounding.
const SAME_MOTION: f64 = 100.0 * ROUND_OFF;

impl ReferenceMotion {
    /// The exact motion, or a fine one.
    ///
    /// # Errors
    /// Why no method reaches the end, in words.
    pub fn find(subject: &dyn Subject, horizon: Horizon) -> Result<Self, String> {
        let t = |k: u32| horizon.end * f64::from(k) / f64::from(SAMPLES);
        if let Some(nodes) = (0..=SAMPLES).map(|k| subject.exact(t(k))).collect() {
            let origin = "exact motion".into();
            return Ok(Self { nodes, uncertainty: [1e-15; 3], origin });
        }
        let mut refused = String::new();
        for method in BY {
            match Self::composed(subject, method, 8, horizon) {
                Ok(reference) => return Ok(reference.held_against_galerkin(subject, horizon)),
                Err(error) => refused = error,
            }
        }
        for method in BY {
            match Self::extrapolated(subject, method, horizon) {
                Ok(reference) => return Ok(reference),
                Err(error) => refused = error,
            }
        }
        Err(refused)
    }

    /// This one, held against that by Galerkin steps of order 12.
    ///
    /// Rounding that all refinements of a scheme have in common does not show in their change. Two
    /// well-known references of different schemes are known as well as they agree, no better; where
    /// they are further apart than rounding explains, one is wrong, and no uncertainty may hide it.
    /// Of two less certain ones that agree to the uncertainty of this one, the better is taken.
    fn held_against_galerkin(mut self, subject: &dyn Subject, horizon: Horizon) -> Self {
        let by = SteppingMethod::Galerkin(GalerkinForm::Nodal);
        let Ok(other) = Self::composed(subject, by, 12, horizon) else { return self };
        let apart = uncertainty(&self.nodes, &other.nodes);
        let agrees = apart.iter().zip(self.uncertainty).all(|(apart, own)| *apart <= 2.0 * own);
        let better = norm_inf(&other.uncertainty) < norm_inf(&self.uncertainty);
        if norm_inf(&self.uncertainty) > WELL_KNOWN && agrees && better {
            return other;
        }
        self.uncertainty = with_rounding(self.uncertainty, apart);
        self
    }

    /// By a high order, refined until round-off stops it.
    fn composed(
        subject: &dyn Subject,
        method: SteppingMethod,
        order: u32,
        horizon: Horizon,
    ) -> Result<Self, String> {
        let run = |steps| nodes(subject, method, order, horizon.end, steps);
        let mut steps = 2 * horizon.coarsest;
        let mut coarse = run(steps);
        while coarse.is_err() && 4 * steps <= horizon.finest {
            steps *= 2; // too coarse a step may fail
            coarse = run(steps);
        }
        let (mut coarse, mut last) = (coarse?, f64::INFINITY);
        loop {
            steps *= 2;
            let fine = run(steps)?;
            let change = uncertainty(&coarse, &fine);
            let worst = norm_inf(&change);
            if worst < ROUND_OFF || worst > 0.25 * last || 2 * steps > horizon.finest {
                let origin = format!("{}, order {order}, {steps} steps", method.name());
                return Ok(Self { nodes: fine, uncertainty: change, origin });
            }
            (coarse, last) = (fine, worst);
        }
    }

    /// By order 2, extrapolated to `h = 0` in powers of `h²`.
    fn extrapolated(
        subject: &dyn Subject,
        method: SteppingMethod,
        horizon: Horizon,
    ) -> Result<Self, String> {
        const LEVELS: i32 = 5;
        let coarsest = (horizon.finest >> (LEVELS - 1)).max(horizon.coarsest) / 8 * 8;
        let mut rows: Vec<Vec<NodeValues>> = Vec::new(); // of the last refinement, by power
        let mut change = [f64::INFINITY; 3];
        for level in 0..LEVELS {
            let steps = coarsest << level;
            let mut row = vec![nodes(subject, method, 2, horizon.end, steps)?];
            for (power, coarse) in (1..).zip(&rows) {
                let factor = 1.0 / (4_f64.powi(power) - 1.0);
                let fine = row.last().expect("begun with the run itself");
                let next: Vec<NodeValues> =
                    fine.iter().zip(coarse).map(|(f, c)| extrapolate(f, c, factor)).collect();
                row.push(next);
            }
            if let [.., a, b] = &row[..] {
                change = uncertainty(a, b);
            }
            rows = row;
        }
        let nodes = rows.pop().ok_or("no run")?;
        let steps = coarsest << (LEVELS - 1);
        let origin = format!("{}, order 2 extrapolated, to {steps} steps", method.name());
        // both columns have the rounding of the finest run
        let rounding = round_off(u64::from(steps), 1.0);
        Ok(Self { nodes, uncertainty: change.map(|change| change.max(rounding)), origin })
    }

    /// Its nodes at the ends of 1, 2 or 4 equal parts.
    fn at(&self, parts: u32) -> Vec<NodeValues> {
        self.nodes.iter().step_by((SAMPLES / parts) as usize).cloned().collect()
    }

    fn floor(&self, quantity: StudiedQuantity) -> f64 {
        let [q, p, lambda] = self.uncertainty;
        let uncertainty = match quantity {
            StudiedQuantity::Position => q,
            StudiedQuantity::Momentum | StudiedQuantity::ConstrainedMomentum => p,
            _ => lambda,
        };
        uncertainty.max(ROUND_OFF)
    }
}

/// `f + factor (f − c)`, for every quantity.
fn extrapolate(fine: &NodeValues, coarse: &NodeValues, factor: f64) -> NodeValues {
    let mix = |f: &[f64], c: &[f64]| -> Vec<f64> {
        f.iter().zip(c).map(|(f, c)| f + factor * (f - c)).collect()
    };
    let both = |f: &Option<Vec<f64>>, c: &Option<Vec<f64>>| Some(mix(f.as_ref()?, c.as_ref()?));
    NodeValues {
        q: mix(&fine.q, &coarse.q),
        p: mix(&fine.p, &coarse.p),
        lambda_other: both(&fine.lambda_other, &coarse.lambda_other),
        ..NodeValues::default()
    }
}

/// Relative changes of `q`, `p`, `λ` from one run to the next.
fn uncertainty(coarse: &[NodeValues], fine: &[NodeValues]) -> [f64; 3] {
    [StudiedQuantity::Position, StudiedQuantity::Momentum, StudiedQuantity::OtherMultiplier]
        .map(|quantity| relative_error(quantity, coarse, fine).unwrap_or(0.0))
}

/// Uncertainties of a reference that another one is `apart` from.
fn with_rounding(own: [f64; 3], apart: [f64; 3]) -> [f64; 3] {
    let both = |k: usize| if apart[k] <= SAME_MOTION { own[k].max(apart[k]) } else { own[k] };
    std::array::from_fn(both)
}

/// Errors of a method at shrinking steps, for every quantity that it has.
///
/// Runs that fail (steps too coarse) are left out. Orders above 2 are refined by a factor of `√2`
/// on average, those from 8 on by 5/4 or less from two steps on: little lies between their coarse
/// end and round-off.
///
/// # Errors
/// Why the method does not apply, or why no run reached the end, in words.
pub fn study(
    subject: &dyn Subject,
    method: SteppingMethod,
    order: u32,
    horizon: Horizon,
    reference: &ReferenceMotion,
) -> Result<Vec<ErrorSequence>, String> {
    let mut errors = vec![Vec::new(); StudiedQuantity::ALL.len()];
    let mut refused = "no run was made".to_owned();
    let parts = if order >= HIGH { SAMPLES_OF_HIGH } else { SAMPLES };
    let exact = reference.at(parts);
    let (mut steps, mut halves) = (if order >= HIGH { 2 } else { horizon.coarsest }, 0);
    while steps <= horizon.finest {
        match equal_parts(subject, method, order, horizon.end, steps, parts) {
            Err(error) => refused = error,
            Ok(run) => {
                let step = horizon.end / f64::from(steps);
                for (quantity, errors) in StudiedQuantity::ALL.into_iter().zip(&mut errors) {
                    let error = relative_error(quantity, &run, &exact);
                    errors.extend(error.map(|error| ErrorAt { step, error }));
                }
            }
        }
        if is_settled(&errors, reference) {
            break;
        }
        halves += 1;
        steps = match (order, halves % 2) {
            (2, _) => 2 * steps,
            (HIGH.., _) => steps + 2 * (steps / 8).max(1),
            (_, 1) => steps / 2 * 3,
            _ => steps / 3 * 4,
        };
    }
    if errors[0].is_empty() {
        return Err(refused);
    }
    let judged = |(quantity, errors): (StudiedQuantity, Vec<ErrorAt>)| {
        let floor = reference.floor(quantity);
        let observed = observed_order(&errors, QuantityScale { size: 1.0, floor });
        (!errors.is_empty()).then_some(ErrorSequence { quantity, errors, observed, floor })
    };
    Ok(StudiedQuantity::ALL.into_iter().zip(errors).filter_map(judged).collect())
}

/// Whether refining further shows nothing more: the configuration is at round-off, and where it is
/// so at any step everything else, too.
fn is_settled(errors: &[Vec<ErrorAt>], reference: &ReferenceMotion) -> bool {
    let floor = |k: usize| reference.floor(StudiedQuantity::ALL[k]);
    let settled = |k: usize| errors[k].is_empty() || at_round_off(&errors[k], floor(k));
    let is_exact = errors[0].iter().all(|e| e.error <= CLEAR * floor(0));
    let watched = if is_exact { errors.len() } else { 1 };
    !errors[0].is_empty() && (0..watched).all(settled)
}

/// Whether refining further shows nothing more: two errors in a row are not clearly above the
/// floor.
fn at_round_off(errors: &[ErrorAt], floor: f64) -> bool {
    matches!(errors, [.., a, b] if a.error <= CLEAR * floor && b.error <= CLEAR * floor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_that_refinements_share_is_uncertain_and_a_wrong_motion_is_not() {
        let own = [1e-15, 2e-15, 6e-14];
        let bits = |numbers: [f64; 3]| numbers.map(f64::to_bits);
        let known = with_rounding(own, [1.4e-13, 1e-16, 5e-14]);
        assert_eq!(bits(known), bits([1.4e-13, 2e-15, 6e-14]));
        assert_eq!(bits(with_rounding(own, [1e-9, f64::NAN, f64::INFINITY])), bits(own));
    }
}
