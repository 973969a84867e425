//! Point masses that bars lock by the digits of a file alone.
//!
//! Bars keep their lengths to the last digit: `simulation.loop_tolerance` is of loops of bodies.
//! Bars that are parallel but for some digits hold what they were meant to let move, which their
//! singular values say.
#![allow(non_snake_case)] // G

use crate::digits::rounded;
use nalgebra::{DMatrix, DVector};
use vi_constraints::null_space::RANK_TOLERANCE;
use vi_multibody::mechanism::{Bar, BarEnd, Description, Mechanism};

/// Bars beyond which their matrix is not looked at.
const MOST: usize = 150;

/// Point masses that bars connect with each other, as numbered in the description, and these bars.
struct BarNetwork {
    points: Vec<usize>,
    bars: Vec<usize>,
}

/// What is said of parts that are locked with a singular value below the tolerance of loops.
pub(crate) fn remarks(mechanism: &Mechanism, q: &[f64], tolerance: f64) -> Vec<String> {
    let count = mechanism.description().bars.len();
    if count == 0 || count > MOST {
        return Vec::new();
    }
    let locked = |part: BarNetwork| {
        let value = smallest(mechanism, q, &part).filter(|value| *value < tolerance)?;
        let bar = &mechanism.description().bars[*part.bars.last()?].name;
        Some(format!(
            "the bars about `{bar}` hold their point masses by {} alone (smallest singular value of their constraints): \
             bars keep their lengths to the last digit, and `simulation.loop_tolerance` is of bodies; state all digits, or \
             leave out a bar that the others make redundant",
            rounded(value, 2)
        ))
    };
    parts(mechanism).into_iter().filter_map(locked).collect()
}

/// The point masses at the ends of a bar.
fn ends(bar: &Bar) -> impl Iterator<Item = usize> + '_ {
    let other = match bar.from {
        BarEnd::Particle(k) => Some(k),
        BarEnd::Ground(_) => None,
    };
    other.into_iter().chain([bar.to])
}

/// The parts that have bars.
fn parts(mechanism: &Mechanism) -> Vec<BarNetwork> {
    let Description { particles, bars, .. } = mechanism.description();
    let mut of: Vec<usize> = (0..particles.len()).collect();
    for bar in bars {
        let own: Vec<usize> = ends(bar).map(|k| of[k]).collect();
        of.iter_mut().filter(|part| own.contains(part)).for_each(|part| *part = own[0]);
    }
    let first = |k: &usize| of[*k] == *k || !of[..*k].contains(&of[*k]);
    let parts = (0..of.len()).filter(first).map(|k| {
        let points = (0..of.len()).filter(|&other| of[other] == of[k]).collect();
        let bars = (0..bars.len()).filter(|&bar| of[bars[bar].to] == of[k]).collect();
        BarNetwork { points, bars }
    });
    parts.filter(|part| !part.bars.is_empty()).collect()
}

/// The smallest singular value of the bars of a part that cannot move within itself, rows of length
/// 1; what is rounding is left out.
fn smallest(mechanism: &Mechanism, q: &[f64], part: &BarNetwork) -> Option<f64> {
    let Description { dimension, particles, bars, .. } = mechanism.description();
    let d = (*dimension).max(2);
    let first = q.len() - d * particles.len();
    let point = |k: usize| DVector::from_column_slice(&q[first + d * k..first + d * (k + 1)]);
    let n = d * part.points.len();
    let mut G = DMatrix::zeros(part.bars.len(), n);
    let mut held = false;
    for (i, bar) in part.bars.iter().map(|&k| &bars[k]).enumerate() {
        let to = point(bar.to);
        let from = match &bar.from {
            BarEnd::Particle(k) => point(*k),
            BarEnd::Ground(at) => DVector::from_column_slice(&at.as_slice()[..d]),
        };
        let along = (to - from).normalize();
        held |= matches!(bar.from, BarEnd::Ground(_));
        for (sign, k) in
            [1.0, -1.0].into_iter().zip(ends(bar).collect::<Vec<_>>().into_iter().rev())
        {
            let place = d * part.points.binary_search(&k).ok()?;
            (0..d).for_each(|j| G[(i, place + j)] = sign * along[j]);
        }
    }
    let rigid = if held { 0 } else { (d * (d + 1) / 2).min(n) }; // motions of the whole
    let values = G.singular_values();
    let clear = values.iter().copied().filter(|value| *value > RANK_TOLERANCE * values.max());
    let clear: Vec<f64> = clear.collect();
    if clear.len() + rigid < n {
        return None; // it moves
    }
    clear.into_iter().min_by(f64::total_cmp)
}
