//! The symplectic form along real steps.
//!
//! ```text
//! curves   (q(s), p(s)) on T*C:   q(s) = the closest to q_0 + s a,   v(s) = the closest to v_0 + s b,   p = M v
//! δ        d/ds at 0 by differences of the motions that start on the curve, of sixth order in s
//! Ω(i, j)  = δq_iᵀ δp_j − δp_iᵀ δq_j          at the start, and after some steps
//! ```
//! Every motion is taken by the integrator itself, so an integrator that does not solve its
//! equations, or solves others, changes `Ω`. (The tangent of the discrete Euler–Lagrange equations
//! does not detect it: its form is an identity of `L_d` for any pair of configurations.) `p̄`
//! counts modulo `range Gᵀ` only, see [`vi_constraints::tangent_map`]. With dampers no form is
//! conserved; a prescribed motion or a load that depends on time alone does conserve it.

use super::subject::{SchemeSetting, Subject};
use nalgebra::DMatrix;
use vi_core::linear::norm_inf;

/// Curves, at most: a change of the form shows in directions without a pattern.
const CURVES: usize = 6;
/// Parameters of the motions on each side, and their weights in the difference.
const WEIGHTS: [(f64, f64); 3] = [(1.0, 0.75), (2.0, -0.15), (3.0, 1.0 / 60.0)];
/// Steps in `s`, relative to the sizes of `q` and `v`: the second where the first leaves a
/// difference, which on rough motions is the error of the differences and falls with its sixth
/// power. A form that changes does so for both.
const PARAMETERS: [f64; 2] = [1e-3, 1e-4];
/// Changes below this need no second look.
const SMALL: f64 = 1e-10;

/// Derivatives along the curves, one in each column.
struct Derivatives {
    dq: DMatrix<f64>,
    dp: DMatrix<f64>,
}

impl Derivatives {
    fn new(n: usize, count: usize) -> Self {
        Self { dq: DMatrix::zeros(n, count), dp: DMatrix::zeros(n, count) }
    }

    fn add(&mut self, curve: usize, weight: f64, q: &[f64], p: &[f64]) {
        for (i, (q, p)) in q.iter().zip(p).enumerate() {
            self.dq[(i, curve)] += weight * q;
            self.dp[(i, curve)] += weight * p;
        }
    }

    fn form(&self) -> DMatrix<f64> {
        self.dq.tr_mul(&self.dp) - self.dp.tr_mul(&self.dq)
    }

    /// `Σ |δq_i| |δp_j| + …` of all pairs: what round-off is measured by.
    fn size(&self) -> DMatrix<f64> {
        let (q, p) = (self.dq.abs(), self.dp.abs());
        q.tr_mul(&p) + p.tr_mul(&q)
    }
}

/// Largest change of `Ω` over `steps` steps, relative to the largest term that it is made of;
/// `None` without a degree of freedom.
///
/// # Errors
/// Why the method does not apply or a step failed, in words.
pub fn symplectic_defect(
    subject: &dyn Subject,
    setting: SchemeSetting,
    steps: u64,
) -> Result<Option<f64>, String> {
    let mut least = f64::INFINITY;
    for parameter in PARAMETERS {
        let Some(defect) = defect(subject, setting, steps, parameter)? else { return Ok(None) };
        least = if defect.is_nan() { defect } else { least.min(defect) };
        if least <= SMALL || least.is_nan() {
            break;
        }
    }
    Ok(Some(least))
}

fn defect(
    subject: &dyn Subject,
    setting: SchemeSetting,
    steps: u64,
    unit: f64,
) -> Result<Option<f64>, String> {
    let mut base = subject.start(setting)?;
    let (q0, v0) = (base.q().to_vec(), base.velocity()?);
    let n = q0.len();
    let tangents = base.tangents();
    let dof = tangents.dq.ncols() / 2;
    if dof == 0 {
        return Ok(None);
    }
    let count = (2 * dof).min(CURVES);
    let directions = tangents.dq.columns(0, dof);
    let (mut before, mut after) = (Derivatives::new(n, count), Derivatives::new(n, count));
    for curve in 0..count {
        let combination = |phase: f64| {
            let weight = |k: usize| (phase + 2.3 * curve as f64 + 1.7 * k as f64).sin();
            let x: Vec<f64> =
                (0..n).map(|i| (0..dof).map(|k| weight(k) * directions[(i, k)]).sum()).collect();
            let size = norm_inf(&x);
            x.into_iter().map(|x| x / size).collect::<Vec<f64>>()
        };
        let (a, b) = (combination(0.3), combination(1.1));
        let rate = norm_inf(&v0).max(1.0);
        for (parameter, weight) in WEIGHTS {
            for side in [-1.0, 1.0] {
                let s = side * unit * parameter;
                let moved = |x: &[f64], by: &[f64], scale: f64| -> Vec<f64> {
                    x.iter().zip(by).map(|(x, by)| x + s * scale * by).collect()
                };
                let (q, v) = base.consistent(&moved(&q0, &a, 1.0), &moved(&v0, &b, rate))?;
                let mut motion = subject.start_from(setting, Some((&q, &v)))?;
                let weight = side * weight / unit;
                before.add(curve, weight, motion.q(), &motion.p());
                (0..steps).try_for_each(|_| motion.step())?;
                after.add(curve, weight, motion.q(), &motion.p());
            }
        }
    }
    let change = after.form() - before.form();
    let size = norm_inf(before.size().as_slice()).max(norm_inf(after.size().as_slice()));
    Ok(Some(if size > 0.0 { norm_inf(change.as_slice()) / size } else { 0.0 }))
}
