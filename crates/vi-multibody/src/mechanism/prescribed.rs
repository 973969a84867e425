//! Prescribed motions that cannot all be followed, along the whole of their paths.
//!
//! ```text
//! locked      ∇θ = Σ c_k G_k over constraints that do not depend on time:   θ_ref must be constant
//! dependent   Σ_r w_r ∇θ_r = 0 over joint coordinates alone:                 Σ_r w_r θ_ref,r must be constant
//! ```
//! In both cases the coefficients do not change with the configuration, so that what holds
//! initially holds along the motion; the paths are compared at many times. Motions that depend on
//! one another through the geometry of a loop are compared initially
//! ([`vi_constraints::agreement`]) and by the residual of every step ([`vi_constraints::closure`]).

use crate::constraint::scalar_constraint::ScalarRow;
use crate::mechanism::Mechanism;
use nalgebra::{DMatrix, DVector};
use vi_constraints::Constraints;
use vi_constraints::agreement::Dependence;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::Configuration;

/// Relative size below which singular values and differences of paths are round-off.
const RELATIVE: f64 = 1e-8;

/// Prescribed motions that contradict each other, or the constraints that lock a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct PathConflict {
    /// Constraint rows of the motions, by falling weight; then one of the rows that lock the joint
    /// coordinate of the only one.
    pub rows: Vec<usize>,
    /// Whether other constraints lock that joint coordinate.
    pub locked: bool,
    /// A time at which it shows, s.
    pub t: f64,
}

/// Looks for prescribed motions that cannot be followed at `times` (s). `rows` are independent at
/// `(0, q)`; where they are not (a singular configuration) locked joints are not looked for.
#[must_use]
pub fn path_conflict(
    mechanism: &Mechanism,
    rows: &IndependentRows,
    q: &[f64],
    times: &[f64],
) -> Option<PathConflict> {
    let first = mechanism.len() - mechanism.rows().len();
    let of = |kind: fn(&ScalarRow) -> bool| -> Vec<usize> {
        let all = mechanism.rows().iter().enumerate();
        all.filter(|(_, row)| kind(row)).map(|(k, _)| first + k).collect()
    };
    let motions = of(ScalarRow::is_rheonomic);
    if motions.is_empty() || rows.redundant().next().is_none() {
        return None;
    }
    let coordinates = of(|row| matches!(row, ScalarRow::Gear { .. } | ScalarRow::Motion { .. }));
    let paths = PrescribedPaths { mechanism, first, times };
    let dependent = relations(mechanism, &coordinates, q).into_iter().find_map(|weights| {
        let mut own: Vec<(usize, f64)> =
            coordinates.iter().copied().zip(weights.iter().copied()).collect();
        own.retain(|(row, weight)| motions.contains(row) && weight.abs() > RELATIVE);
        let t = paths.disagree(&own)?;
        own.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        Some(PathConflict { rows: own.iter().map(|m| m.0).collect(), locked: false, t })
    });
    dependent.or_else(|| {
        locked(mechanism, rows, q, &motions).into_iter().find_map(|(row, by)| {
            let t = paths.disagree(&[(row, 1.0)])?;
            Some(PathConflict { rows: vec![row, by], locked: true, t })
        })
    })
}

struct PrescribedPaths<'a> {
    mechanism: &'a Mechanism,
    first: usize, // row of the first constraint that is no internal one
    times: &'a [f64],
}

impl PrescribedPaths<'_> {
    /// A time at which `Σ w θ_ref` moves, judged by its rate and its acceleration.
    fn disagree(&self, motions: &[(usize, f64)]) -> Option<f64> {
        let at = |t: f64| {
            let (mut sum, mut size) = ([0.0; 2], [0.0; 2]);
            for &(row, weight) in motions {
                let derivatives = self.mechanism.rows()[row - self.first].time_derivatives(t);
                for (k, value) in derivatives.into_iter().enumerate() {
                    sum[k] += weight * value;
                    size[k] += (weight * value).abs();
                }
            }
            (sum, size)
        };
        let mut largest = [0.0_f64; 2];
        for &t in self.times {
            let (_, size) = at(t);
            (0..2).for_each(|k| largest[k] = largest[k].max(size[k]));
        }
        let moves = |t: &f64| (0..2).any(|k| at(*t).0[k].abs() > RELATIVE * largest[k]);
        self.times.iter().copied().find(moves)
    }
}

/// Weights with which gradients of joint coordinates cancel: a basis of the left null space.
fn relations(mechanism: &Mechanism, rows: &[usize], q: &[f64]) -> Vec<DVector<f64>> {
    let chosen = IndependentRows::choose(mechanism.len(), rows);
    let mut gradients = DMatrix::zeros(rows.len(), mechanism.dim());
    let place = vi_constraints::saddle_point::JacobianPlace {
        row: 0,
        column: 0,
        scale: 1.0,
        transposed: false,
    };
    chosen.emit_jacobian(mechanism, Configuration::new(0.0, q), place, &mut gradients);
    let sizes: Vec<f64> = gradients.row_iter().map(|row| row.norm().max(1e-300)).collect();
    for (mut row, size) in gradients.row_iter_mut().zip(&sizes) {
        row /= *size;
    }
    // singular values of unit rows, squared: relations are exact up to round-off
    let eigen = (&gradients * gradients.transpose()).symmetric_eigen();
    let null = (0..rows.len()).filter(|&k| eigen.eigenvalues[k] < 1e-12);
    null.map(|k| {
        let weights = eigen.eigenvectors.column(k);
        DVector::from_fn(rows.len(), |i, _| weights[i] / sizes[i]).normalize()
    })
    .collect()
}

/// The motions whose gradient depends on constraints that do not depend on time, each with one of
/// these.
fn locked(
    mechanism: &Mechanism,
    rows: &IndependentRows,
    q: &[f64],
    motions: &[usize],
) -> Vec<(usize, usize)> {
    let first = mechanism.len() - mechanism.rows().len();
    let mut dependence = Dependence::new(mechanism, rows, Configuration::new(0.0, q));
    let allowances = mechanism.allowances(); // what nearly follows from others locks nothing
    let keeps = |row: &usize| allowances.get(*row).is_some_and(|g| *g > 0.0);
    let dropped: Vec<usize> = rows.redundant().filter(|row| !keeps(row)).collect();
    if dropped.is_empty() {
        return Vec::new();
    }
    // W_R: what a unit rate of each motion leaves in the dependent rows
    let mut left = DMatrix::zeros(dropped.len(), motions.len());
    for (j, &row) in motions.iter().enumerate() {
        let mut unit = vec![0.0; mechanism.len()];
        unit[row] = dependence.sizes()[row];
        let Ok(answer) = dependence.left_over(&unit) else { return Vec::new() };
        dropped.iter().enumerate().for_each(|(i, &row)| left[(i, j)] = answer[row]);
    }
    let svd = left.clone().svd(false, true);
    let Some(v) = svd.v_t else { return Vec::new() };
    let mut share = vec![0.0; motions.len()]; // diagonal of the projector on the row space of W_R
    for (k, _) in svd.singular_values.iter().enumerate().filter(|s| *s.1 > RELATIVE) {
        share.iter_mut().enumerate().for_each(|(j, share)| *share += v[(k, j)] * v[(k, j)]);
    }
    let mut found = Vec::new();
    for (j, &row) in motions.iter().enumerate().filter(|(j, _)| share[*j] > 1.0 - 1e-6) {
        let member = |other: usize| other != row && other >= first; // no internal constraint
        let weight = |i: &usize| left[(*i, j)].abs();
        let Some(i) = (0..dropped.len()).max_by(|a, b| weight(a).total_cmp(&weight(b))) else {
            continue;
        };
        let by = Some(dropped[i]).filter(|by| member(*by));
        let by = by.or_else(|| dependence.partners(dropped[i]).into_iter().find(|by| member(*by)));
        found.push((row, by.unwrap_or(row)));
    }
    found
}
