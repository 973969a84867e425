//! Whether constraints that depend on one another at a configuration do so next to it, too.
//!
//! Rank at one configuration does not tell permanent redundancy from a singular configuration.
//! Scattered points are drawn to closed configurations by least-norm Newton corrections, and are
//! compared in one of two ways:
//! ```text
//! rank       all constraints closed:              rank G(q*) > rank G(q)             dense, up to 150 coordinates
//! followers  the independent constraints closed:  |g_d(q*)| ≤ bound Σ_j |G_dj| size_j    sparse
//! ```
//! A dependent constraint `g_d` that follows from the others vanishes with them at `q*`, but for
//! rounding. In a singular configuration it is left with the square of the distance, `~ 1e-6`.
//!
//! Every point is scattered by a part of the size of its coordinates
//! ([`Constraints::coordinate_sizes`]), lengths by that of what they are connected to: what is far
//! away has no part in it.

use super::agreement::Dependence;
use crate::closure::ClosureWatch;
use crate::connected::connected;
use crate::constraints::Constraints;
use crate::rows::choice::jacobian;
use crate::saddle_point::IndependentRows;
use crate::scheme::StepError;
use nalgebra::{DMatrix, DVector};
use vi_core::Configuration;

/// Size of the random displacement, relative to the size of the coordinates.
const MOTION: f64 = 1e-3;

/// What a comparison with configurations nearby says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nearby {
    /// The dependent constraints follow from the independent ones.
    Follow,
    /// They do not: more constraints are independent there, this one among them where it is known.
    Singular {
        /// The constraint that is left with the largest residual.
        row: usize,
    },
    /// No closed configuration was found nearby.
    Unknown,
}

/// `q` displaced at random by `MOTION` of the size of each coordinate; another one for each trial.
fn scattered(q: &[f64], sizes: &[f64], trial: usize) -> Vec<f64> {
    let fraction = |i: usize| 2.0 * libm::sin(13.7 * (i + 1 + 31 * trial) as f64).fract();
    let moved = |(i, (q, size)): (usize, (&f64, &f64))| q + MOTION * size * fraction(i);
    q.iter().zip(sizes).enumerate().map(moved).collect()
}

/// How far the constraints in `rows`, independent at `at`, take the others with them; `O(n)` where
/// few constraints meet.
#[must_use]
pub fn followers<C: Constraints>(
    constraints: &C,
    rows: &IndependentRows,
    at: Configuration<'_>,
) -> Nearby {
    const MAX_ITERATIONS: usize = 12;
    const ROUNDING: f64 = 64.0 * f64::EPSILON;
    let (t, q, m) = (at.t, at.q, constraints.len());
    let mut sizes = vec![0.0; q.len()];
    constraints.coordinate_sizes(q, &mut sizes);
    let start = constraints.principal_angles(q);
    let mut watch =
        ClosureWatch::new(constraints, Configuration { t, q, angles: &start, internal: &[] }, 0.0);
    let (mut answer, mut g) = (Nearby::Unknown, vec![0.0; m]);
    for trial in 0..2 {
        let mut near = scattered(q, &sizes, trial);
        for _ in 0..MAX_ITERATIONS {
            let mut angles = start.clone();
            constraints.unwrap_angles(&near, &mut angles);
            let at = Configuration { t, q: &near, angles: &angles, internal: &[] };
            constraints.value(at, &mut g);
            let mut dependence = Dependence::new(constraints, rows, at);
            let own = rows.rows().iter();
            let closed = own.map(|&row| (g[row].abs(), dependence.sizes()[row]));
            if closed.into_iter().all(|(g, size)| g <= ROUNDING * size) {
                match watch.check(constraints, at) {
                    Ok(()) => answer = Nearby::Follow,
                    Err(StepError::ConstraintViolated { row, .. }) => {
                        return Nearby::Singular { row };
                    }
                    Err(_) => {}
                }
                break;
            }
            let Ok(step) = dependence.correction(&g) else { break };
            near.iter_mut().zip(&step).for_each(|(q, step)| *q += step);
        }
    }
    answer
}

/// The largest rank of `G` in two closed configurations next to `q`; `None` when none was found.
pub(crate) fn rank(constraints: &impl Constraints, t: f64, q: &[f64]) -> Option<usize> {
    const CLEAR: f64 = 1e-7; // relative size of a singular value that counts there
    const CLOSED: f64 = 1e-12; // residual relative to the size of its row
    let (n, m) = (constraints.dim(), constraints.len());
    let (mut sizes, mut row_sizes) = (vec![0.0; n], vec![0.0; m]);
    constraints.coordinate_sizes(q, &mut sizes);
    let mut jacobian = DMatrix::zeros(m, n);
    let mut g = DVector::zeros(m);
    let mut largest = None;
    for trial in 0..2 {
        let mut near = DVector::from_vec(scattered(q, &sizes, trial));
        // rows and coordinates in units of their sizes
        let mut scaled = |near: &DVector<f64>, jacobian: &mut DMatrix<f64>| {
            let at = Configuration::new(t, near.as_slice());
            constraints.value(at, g.as_mut_slice());
            constraints.row_sizes(at, &mut row_sizes);
            jacobian.fill(0.0);
            constraints.jacobian(t, near.as_slice(), jacobian);
            for i in 0..m {
                let unit = if row_sizes[i] > 0.0 { 1.0 / row_sizes[i] } else { 1.0 };
                g[i] *= unit;
                (0..n).for_each(|j| jacobian[(i, j)] *= unit * sizes[j]);
            }
            g.clone()
        };
        for _ in 0..8 {
            let g = scaled(&near, &mut jacobian);
            let step = jacobian.clone().svd(true, true).solve(&g, 1e-12 * jacobian.amax());
            let Ok(step) = step else { continue };
            (0..n).for_each(|j| near[j] -= sizes[j] * step[j]);
        }
        let g = scaled(&near, &mut jacobian);
        let moved = near.iter().zip(q).zip(&sizes).map(|((a, b), size)| (a - b).abs() / size);
        if g.amax() > CLOSED || moved.fold(0.0, f64::max) > 30.0 * MOTION {
            continue;
        }
        for mut row in jacobian.row_iter_mut() {
            let size = row.norm();
            row.scale_mut(if size > 0.0 { 1.0 / size } else { 1.0 });
        }
        let values = jacobian.singular_values();
        let found = values.iter().filter(|v| **v > CLEAR * values.max()).count();
        largest = largest.max(Some(found));
    }
    largest
}

/// Why the independent constraints of the motion are not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RankNearby {
    /// More are independent in configurations nearby.
    Larger {
        /// Rank in the configuration.
        at_start: usize,
        /// Rank in configurations nearby, or a lower bound of it.
        nearby: usize,
    },
    /// No closed configuration was found nearby.
    Unknown,
    /// Some of the constraints may depend on others, and their rank needs too large a dense matrix.
    TooLarge {
        /// Coordinates that these constraints connect.
        coordinates: usize,
    },
}

impl IndependentRows {
    /// [`IndependentRows::find`], unless more are independent in configurations nearby
    /// ([`crate::nearby`]): then `(t, q)` is singular, and the rank nearby is the error. Rows that
    /// many coordinates connect must all be independent.
    ///
    /// # Errors
    /// The rank nearby; no rank when no closed configuration was found there, or the dense matrices
    /// are too large.
    pub fn find_generic(
        constraints: &impl Constraints,
        t: f64,
        q: &[f64],
    ) -> Result<Self, RankNearby> {
        const MOST: usize = 150;
        let jacobian = jacobian(constraints, t, q);
        let mut chosen = Vec::new();
        for part in connected(&jacobian) {
            match part.is_large() {
                false => chosen.extend(part.pivots(&jacobian, constraints.rank_tolerance())),
                true if part.is_independent(&jacobian) => chosen.extend(part.rows),
                true => return Err(RankNearby::TooLarge { coordinates: part.columns.len() }),
            }
        }
        let rows = Self::choose(constraints.len(), &chosen);
        let at_start = rows.len();
        if at_start == constraints.len().min(q.len()) {
            return Ok(rows);
        }
        let nearby = if q.len() > MOST { None } else { rank(constraints, t, q) };
        let followers = || match followers(constraints, &rows, Configuration::new(t, q)) {
            Nearby::Follow => Some(at_start),
            Nearby::Singular { .. } => Some(at_start + 1),
            Nearby::Unknown => None,
        };
        match nearby.or_else(followers) {
            Some(rank) if rank <= at_start => Ok(rows),
            Some(nearby) => Err(RankNearby::Larger { at_start, nearby }),
            None => Err(RankNearby::Unknown),
        }
    }
}

#[cfg(test)]
#[allow(non_snake_case)] // G
mod tests {
    use super::*;
    use crate::constraints::ConstraintFn;

    /// Two circles of the plane about the origin and `(a, 0)` through `(1, 0)`.
    fn circles(a: f64) -> impl Constraints {
        ConstraintFn::new(
            2,
            2,
            move |q, g| {
                g[0] = 0.5 * (q[0] * q[0] + q[1] * q[1] - 1.0);
                g[1] = 0.5 * ((q[0] - a).powi(2) + q[1] * q[1] - (1.0 - a).powi(2));
            },
            move |q, G| {
                (0..2).for_each(|j| G[(0, j)] = q[j]);
                (G[(1, 0)], G[(1, 1)]) = (q[0] - a, q[1]);
            },
        )
    }

    #[test]
    fn one_circle_twice_follows_and_two_that_touch_do_not() {
        let q = [1.0, 0.0];
        for (a, expected) in [(0.0, true), (3.0, false), (-1.0, false), (1e-3, false)] {
            let circles = circles(a);
            let rows = IndependentRows::find(&circles, 0.0, &q);
            assert_eq!(rows.len(), 1);
            let found = followers(&circles, &rows, Configuration::new(0.0, &q));
            assert_eq!(found == Nearby::Follow, expected, "{a}: {found:?}");
            assert_eq!(IndependentRows::find_generic(&circles, 0.0, &q).is_ok(), expected, "{a}");
        }
    }
}
