//! The configuration of the constraints that is next to a given one.
//!
//! ```text
//! q = argmin ½ (q − q*)ᵀ M (q − q*)   over   g(q) = 0,  γ(q) ≥ 0
//!
//! [M Gᵀ; G 0](q_{k+1} − q*, μ) = (BᵀΛ, −g_k + G (q_k − q*))
//! 0 ≤ Λ ⊥ γ_k + B (q_{k+1} − q_k) ≥ 0
//! ```
//! `γ`, `B`: gaps of unilateral constraints with their gradients. The equations are solved for
//! `x_j/s_j`, with `M_ij s_i s_j` and the rows divided by their sizes.

use super::start_error::StartError;
use crate::constraints::Constraints;
use crate::nonsmooth::{ContactLaw, ContactRows, Unilateral};
use crate::saddle_point::{IndependentRows, SaddlePoint};
use std::sync::Arc;
use vi_core::Configuration;
use vi_core::SparseMatrix;
use vi_core::cone::{Cone, ConeFault, ConeSolver};
use vi_core::interval::Interval;
use vi_core::linear::norm_inf;
use vi_core::sparse::Entries;

/// What counts as rounding, in parts of a size.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// The sizes of coordinates and rows: nothing is measured in metres.
pub(super) struct Sizes {
    pub(super) of_q: Vec<f64>, // n  s_j
    of_rows: Vec<f64>,         // m  Σ_j |G_ij| s_j
}

impl Sizes {
    pub(super) fn new(n: usize, m: usize) -> Self {
        Self { of_q: vec![1.0; n], of_rows: vec![1.0; m] }
    }

    pub(super) fn measure(&mut self, constraints: &impl Constraints, at: Configuration<'_>) {
        constraints.coordinate_sizes(at.q, &mut self.of_q);
        constraints.row_sizes(at, &mut self.of_rows);
        self.of_rows.iter_mut().filter(|size| **size <= 0.0).for_each(|size| *size = 1.0);
    }

    /// The residual of row `i` in units of rounding.
    fn excess(&self, i: usize, g: f64) -> f64 {
        g.abs() / (ROUNDING * self.of_rows[i])
    }

    /// Whether the residuals of all rows are those of rounding, or allowed where a row was
    /// `dropped`.
    pub(super) fn are_closed(
        &self,
        g: &[f64],
        allowed: &[f64],
        dropped: impl Fn(usize) -> bool,
    ) -> bool {
        (0..g.len()).all(|i| self.excess(i, g[i]) <= 1.0 || dropped(i) && is_allowed(g, allowed, i))
    }

    /// How far two configurations are apart, in units of their sizes.
    fn apart(&self, a: &[f64], b: &[f64]) -> f64 {
        let apart = a.iter().zip(b).zip(&self.of_q).map(|((a, b), size)| (a - b).abs() / size);
        apart.fold(0.0, f64::max)
    }
}

fn is_allowed(g: &[f64], allowed: &[f64], i: usize) -> bool {
    allowed.get(i).is_some_and(|allowed| g[i].abs() <= *allowed)
}

/// Entries with rows and columns in units of their own.
struct Scaled<'a> {
    rows: &'a dyn Fn(usize) -> f64,
    columns: &'a dyn Fn(usize) -> f64,
    out: &'a mut dyn Entries,
}

impl Entries for Scaled<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        self.out.add(row, column, (self.rows)(row) * value * (self.columns)(column));
    }
}

/// The largest entry of the diagonal of a matrix.
struct LargestDiagonal<'a>(&'a [f64], f64);

impl Entries for LargestDiagonal<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        if row == column {
            self.1 = self.1.max(value.abs() * self.0[row] * self.0[row]);
        }
    }
}

/// The configuration next to `target` in the norm of `mass` that satisfies the constraints, and in
/// which nothing but dry friction of the elements is passed; they may be none.
///
/// # Errors
/// [`StartError`].
pub fn closest(
    mass: &SparseMatrix,
    constraints: &impl Constraints,
    rows: &IndependentRows,
    t: f64,
    target: &[f64],
    elements: &[Arc<dyn Unilateral>],
) -> Result<Vec<f64>, StartError> {
    const MAX_ITERATIONS: usize = 200;
    const SETTLED: f64 = 1e-12;
    const ENOUGH: f64 = 10.0; // rounding in a configuration that settles no further
    let (n, m, r) = (constraints.dim(), constraints.len(), rows.len());
    let mut in_mass_norm = SaddlePoint::new(n, rows.clone());
    let mut in_plain_norm = SaddlePoint::new(n, rows.clone());
    let (mut g, mut chosen) = (vec![0.0; m], vec![0.0; r]);
    let mut gaps = Gaps::new(n, elements);
    let mut q = target.to_vec();
    let mut sizes = Sizes::new(n, m);
    let (mut residual, mut last) = (f64::INFINITY, f64::INFINITY);
    for iteration in 0..MAX_ITERATIONS {
        let at = Configuration::new(t, &q);
        constraints.value(at, &mut g);
        sizes.measure(constraints, at);
        gaps.measure(at);
        residual = norm_inf(&g);
        if !residual.is_finite() {
            break;
        }
        let enforced = rows.rows().iter().map(|&i| sizes.excess(i, g[i])).fold(0.0, f64::max);
        let enforced = enforced.max(gaps.excess);
        let mut largest = LargestDiagonal(&sizes.of_q, 0.0);
        mass.emit(&mut largest);
        let unit = if largest.1 > 0.0 { 1.0 / largest.1 } else { 1.0 };
        let of_q = |j: usize| sizes.of_q[j];
        let of_rows = |i: usize| 1.0 / sizes.of_rows[i];
        let weight = |j: usize| unit * sizes.of_q[j];
        let weighted = |out: &mut dyn Entries| {
            mass.emit(&mut Scaled { rows: &weight, columns: &of_q, out });
        };
        let plain = |out: &mut dyn Entries| (0..n).for_each(|i| out.add(i, i, 1.0));
        let above = |out: &mut dyn Entries| {
            constraints.jacobian(t, &q, &mut Scaled { rows: &of_rows, columns: &of_q, out });
        };
        let jacobian = SparseMatrix::assemble(m, n, |out| constraints.jacobian(t, &q, out));
        let step: Vec<f64> = q.iter().zip(target).map(|(a, b)| a - b).collect();
        let mut b = g.iter().map(|g| -g).collect::<Vec<_>>();
        jacobian.mul_add(1.0, &step, &mut b);
        b.iter_mut().zip(&sizes.of_rows).for_each(|(b, size)| *b /= size);
        rows.gather(&b, &mut chosen);
        let mut x = vec![0.0; n + r];
        x[n..].copy_from_slice(&chosen);
        let backup = x.clone();
        let mut used = &mut in_mass_norm;
        if used.solve_with(&weighted, &above, 1.0, &above, &mut x).is_err() {
            x = backup;
            used = &mut in_plain_norm;
            used.solve_with(&plain, &above, 1.0, &above, &mut x)
                .map_err(|_| StartError::Singular)?;
        }
        gaps.open(used, &sizes, &step, &mut x)?;
        let moved = target.iter().zip(&x).zip(&sizes.of_q);
        let next: Vec<f64> = moved.map(|((q, dx), size)| q + size * dx).collect();
        let moved = sizes.apart(&next, &q);
        let settled = moved <= SETTLED || enforced >= 0.5 * last && iteration > 5;
        last = enforced;
        if enforced <= ENOUGH && settled {
            let at = Configuration::new(t, &next);
            constraints.value(at, &mut g);
            gaps.measure(at);
            let after = rows.rows().iter().map(|&i| sizes.excess(i, g[i])).fold(0.0, f64::max);
            let after = after.max(gaps.excess);
            let q = if after <= enforced.max(1.0) { next } else { q };
            return taken_up(constraints, rows, t, q, &sizes);
        }
        q = next;
    }
    match gaps.worst() {
        Some(element) if gaps.excess > ENOUGH => Err(StartError::Closed { element }),
        _ => Err(StartError::NoConfiguration { residual, iterations: MAX_ITERATIONS }),
    }
}

/// Unilateral constraints that may be passed, at a configuration.
struct Gaps<'a> {
    elements: &'a [Arc<dyn Unilateral>],
    place: Interval,
    near: Vec<(usize, f64)>,   // k  the element and γ_i
    features: Vec<(u32, f64)>, // of one element
    rows: ContactRows,         // k  B
    tangents: ContactRows,
    reach: f64,  // m or rad  gaps above this do not count
    excess: f64, // the deepest overlap in units of rounding
    cones: ConeSolver,
}

/// Gaps count up to so many times the deepest overlap.
const REACH: f64 = 100.0;

impl<'a> Gaps<'a> {
    fn new(n: usize, elements: &'a [Arc<dyn Unilateral>]) -> Self {
        let (rows, tangents) = (ContactRows::default(), ContactRows::default());
        let place = Interval::new(if elements.is_empty() { 0 } else { n });
        let (near, features, cones) = (Vec::new(), Vec::new(), ConeSolver::default());
        Self { elements, place, near, features, rows, tangents, reach: 0.0, excess: 0.0, cones }
    }

    /// Finds those that are near, with gaps and rows.
    fn measure(&mut self, at: Configuration<'_>) {
        self.near.clear();
        self.rows.clear();
        self.excess = 0.0;
        if self.elements.is_empty() {
            return;
        }
        self.place.open(at.t, 1.0, at.q);
        let mut found: Vec<(usize, u32, f64)> = Vec::new();
        for (k, element) in self.elements.iter().enumerate() {
            if matches!(element.law(), ContactLaw::Dry { .. }) {
                continue;
            }
            self.features.clear();
            element.near(&self.place, at, &mut self.features);
            for &(feature, gap) in &self.features {
                self.reach = self.reach.max(-REACH * gap);
                self.excess = self.excess.max(-gap / (ROUNDING * element.size()));
                found.push((k, feature, gap));
            }
        }
        for (k, feature, gap) in found.into_iter().filter(|(_, _, gap)| *gap <= self.reach) {
            self.tangents.clear();
            self.elements[k].rows(feature, at, &mut self.tangents);
            self.tangents.row(0).iter().for_each(|&(i, value)| self.rows.add(i, value));
            self.rows.end_row();
            self.near.push((k, gap));
        }
    }

    /// Adds to the solution `x` of the constraints alone what the impulses `Λ` change, from `q_k`
    /// with `step = q_k − q*`; `used`: factorized.
    fn open(
        &mut self,
        used: &mut SaddlePoint,
        sizes: &Sizes,
        step: &[f64],
        x: &mut [f64],
    ) -> Result<(), StartError> {
        let (k, n) = (self.near.len(), step.len());
        if k == 0 {
            return Ok(());
        }
        let of_q = |row: usize, x: &[f64]| -> f64 {
            self.rows.row(row).iter().map(|&(j, b)| b * sizes.of_q[j] * x[j]).sum()
        };
        let mut w: Vec<f64> = Vec::with_capacity(k);
        let mut columns = Vec::with_capacity(k); // [M Gᵀ; G 0]⁻¹ (Bᵀ, 0)
        for (row, (_, gap)) in self.near.iter().enumerate() {
            w.push(gap + of_q(row, x) - self.rows.dot(row, step));
            let mut column = vec![0.0; x.len()];
            self.rows.row(row).iter().for_each(|&(j, b)| column[j] += b * sizes.of_q[j]);
            used.solve_factorized(&mut column).map_err(|_| StartError::Singular)?;
            columns.push(column);
        }
        let pairs = (0..k).flat_map(|i| (0..k).map(move |j| (i, j)));
        let delassus: Vec<f64> =
            pairs.map(|(i, j)| 0.5 * (of_q(i, &columns[j]) + of_q(j, &columns[i]))).collect();
        let mut impulse = vec![0.0; k];
        let closed = |cone: usize| StartError::Closed {
            element: self.elements[self.near[cone].0].name().to_owned(),
        };
        match self.cones.solve(&vec![Cone::Normal; k], &delassus, &w, &mut impulse) {
            Ok(_) => {}
            Err(ConeFault::Wedged { cone }) => return Err(closed(cone)),
            Err(_) => {
                let deepest = (0..k).min_by(|&a, &b| w[a].total_cmp(&w[b]));
                return Err(closed(deepest.unwrap_or(0)));
            }
        }
        for (column, impulse) in columns.iter().zip(&impulse) {
            x[..n].iter_mut().zip(column).for_each(|(x, change)| *x += impulse * change);
        }
        Ok(())
    }

    /// The element with the deepest overlap.
    fn worst(&self) -> Option<String> {
        let deepest = self.near.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(self.elements[deepest.0].name().to_owned())
    }
}

/// The configuration `q` on the independent rows, unless one of the others is left with more than
/// it may be.
fn taken_up(
    constraints: &impl Constraints,
    rows: &IndependentRows,
    t: f64,
    q: Vec<f64>,
    sizes: &Sizes,
) -> Result<Vec<f64>, StartError> {
    const FOLLOWS: f64 = 30.0; // rounding in a row that follows from others, at most
    let mut g = vec![0.0; constraints.len()];
    constraints.value(Configuration::new(t, &q), &mut g);
    let excess = |&row: &usize| match is_allowed(&g, constraints.allowances(), row) {
        true => 0.0,
        false => sizes.excess(row, g[row]),
    };
    let worst = rows.redundant().max_by(|a, b| excess(a).total_cmp(&excess(b)));
    match worst.filter(|row| excess(row) > FOLLOWS) {
        Some(row) => Err(StartError::Misfit { row, residual: g[row].abs() }),
        None => Ok(q),
    }
}
