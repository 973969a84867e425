//! Nodal reparametrization of one body.
//!
//! ```text
//! u = (u_φ, θ)
//! Δφ   = u_φ,     Δd_I = (exp θ̂ − I) d_{I,n},     q_{n+1} = q_n + Δq                  LMO08 (61)
//! ∂F_d/∂u (u, q_n) = P_in(q_{n+1}) diag(I, T(θ))
//! ```
//! Letters: `u_φ` displacement (m), `θ` rotation vector (rad), spatial. The increment is formed on
//! its own and then added, so `Δq/h` is as good as `u/h`; the directors stay orthonormal up to the
//! rounding of that sum, which grows like `ε√N` over `N` steps: [`clean_directors`] takes it out.

#![allow(non_snake_case)] // T: the tangent of the exponential map

use crate::directors::{director, set_triad, triad};
use crate::null_space;
use crate::rotation::{self, MAX_ROTATION};
use nalgebra::{SMatrix, Vector3};
use vi_core::newton::{BlockKind, Fault};

/// Defect of the directors beyond which [`clean_directors`] acts.
pub const CLEAN_THRESHOLD: f64 = 8.0 * f64::EPSILON;

/// A rotation increment beyond [`MAX_ROTATION`] in one step: reduce the time step.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("a rotation of {angle:.3} rad in one step; at most π is allowed: reduce the time step")]
pub struct RotationTooLarge {
    /// Its norm, rad; NaN if the increment is not finite.
    pub angle: f64,
}

impl RotationTooLarge {
    /// The refusal as Newton's method reports it, `unknown` being the first of the increment.
    #[must_use]
    pub fn fault(self, unknown: usize) -> Fault {
        if self.angle.is_finite() {
            Fault::OutsideChart { kind: BlockKind::Rotation, unknown, size: self.angle }
        } else {
            Fault::NotFinite
        }
    }
}

/// Refuses rotation increments beyond [`MAX_ROTATION`], and those that are not finite.
///
/// # Errors
/// [`RotationTooLarge`].
pub fn check_rotation(theta: &Vector3<f64>) -> Result<(), RotationTooLarge> {
    let angle = theta.norm();
    if angle <= MAX_ROTATION { Ok(()) } else { Err(RotationTooLarge { angle }) }
}

/// Writes `q1 = F_d(u, q0)` and `dq`, accurate relative to itself; `u`: shape 6, the rest 12.
///
/// # Errors
/// [`RotationTooLarge`] beyond half a revolution; `q1` and `dq` are then untouched.
pub fn reparametrize(
    u: &[f64],
    q0: &[f64],
    q1: &mut [f64],
    dq: &mut [f64],
) -> Result<(), RotationTooLarge> {
    let theta = Vector3::new(u[3], u[4], u[5]);
    check_rotation(&theta)?;
    dq[..3].copy_from_slice(&u[..3]);
    for k in 0..3 {
        q1[k] = q0[k] + u[k]; // (61)
    }
    turn_directors(&theta, q0, q1, dq);
    Ok(())
}

/// The director part of [`reparametrize`], for any `θ`: writes components 3 to 11 of `q1` and `dq`
/// and returns `exp θ̂ − I`.
pub fn turn_directors(
    theta: &Vector3<f64>,
    q0: &[f64],
    q1: &mut [f64],
    dq: &mut [f64],
) -> nalgebra::Matrix3<f64> {
    let turn = rotation::exp_minus_identity(theta);
    for i in 0..3 {
        let change = turn * director(q0, i);
        for k in 0..3 {
            let at = 3 + 3 * i + k;
            dq[at] = change[k];
            q1[at] = q0[at] + change[k];
        }
    }
    turn
}

/// `∂F_d/∂u (u, q_n) = P_in(q_{n+1}) diag(I, T(θ))`, from `u` and `q1 = F_d(u, q_n)`.
#[must_use]
pub fn tangent(u: &[f64], q1: &[f64]) -> SMatrix<f64, 12, 6> {
    let mut out = null_space::matrix(q1);
    let T = rotation::tangent(&Vector3::new(u[3], u[4], u[5]));
    let spin = out.fixed_view::<9, 3>(3, 3) * T;
    out.fixed_view_mut::<9, 3>(3, 3).copy_from(&spin);
    out
}

/// One polar step when the directors miss orthonormality by more than [`CLEAN_THRESHOLD`]; says
/// whether it was taken. The centre is not touched.
pub fn clean_directors(q: &mut [f64]) -> bool {
    let mut directors = triad(q);
    if rotation::orthonormality_defect(&directors) <= CLEAN_THRESHOLD {
        return false;
    }
    rotation::polar_step(&mut directors);
    set_triad(q, &directors);
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::directors::internal_value;
    use vi_core::linear::norm_inf;
    use vi_testkit::Sample;

    fn increment(sample: &mut Sample, angle: f64) -> [f64; 6] {
        let (shift, theta) = (sample.vector(), sample.of_length(angle));
        [shift.x, shift.y, shift.z, theta.x, theta.y, theta.z]
    }

    fn moved(u: &[f64; 6], q0: &[f64; 12]) -> ([f64; 12], [f64; 12]) {
        let (mut q1, mut dq) = ([f64::NAN; 12], [f64::NAN; 12]);
        reparametrize(u, q0, &mut q1, &mut dq).unwrap();
        (q1, dq)
    }

    #[test]
    fn it_stays_on_the_constraints() {
        let mut sample = Sample::new(31);
        let mut worst = 0.0_f64;
        for _ in 0..500 {
            let q0 = sample.frame();
            let angle = MAX_ROTATION * sample.number();
            let u = increment(&mut sample, angle);
            let (q1, _) = moved(&u, &q0);
            let mut g = [0.0; 6];
            internal_value(&q1, &mut g);
            worst = worst.max(norm_inf(&g));
        }
        assert!(worst < 2e-15, "g(F_d) = {worst:e}");
        let q0 = sample.frame();
        assert_eq!(moved(&[0.0; 6], &q0), (q0, [0.0; 12]), "F_d(0, q) = q");
    }

    #[test]
    fn the_increment_keeps_its_own_precision() {
        let mut sample = Sample::new(32);
        let q0 = sample.frame();
        let u = increment(&mut sample, 1e-12);
        let (_, dq) = moved(&u, &q0);
        let theta = Vector3::new(u[3], u[4], u[5]);
        for i in 0..3 {
            let error = (director(&dq, i) - theta.cross(&director(&q0, i))).norm();
            assert!(error < 1e-12 * 2e-12, "Δd_{}: off by {error:e}", i + 1);
        }
        assert_eq!(dq[..3], u[..3]);
    }

    #[test]
    fn the_tangent_matches_central_differences() {
        let mut sample = Sample::new(33);
        let mut worst = 0.0_f64;
        for k in 0..60 {
            let q0 = sample.frame();
            let u = increment(&mut sample, 3.0 * f64::from(k) / 59.0);
            let exact = tangent(&u, &moved(&u, &q0).0);
            let e = 1e-5;
            for j in 0..6 {
                let at = |by: f64| {
                    let mut u = u;
                    u[j] += by;
                    moved(&u, &q0).1
                };
                let (plus, minus) = (at(e), at(-e));
                for i in 0..12 {
                    let fd = (plus[i] - minus[i]) / (2.0 * e);
                    worst = worst.max((fd - exact[(i, j)]).abs());
                }
            }
        }
        assert!(worst < 1e-9, "{worst:e}");
    }

    #[test]
    fn more_than_half_a_turn_is_refused() {
        let q0 = Sample::new(34).frame();
        let (mut q1, mut dq) = ([7.0; 12], [8.0; 12]);
        let u = [0.0, 0.0, 0.0, 0.0, 3.2, 0.0];
        let refused = reparametrize(&u, &q0, &mut q1, &mut dq).unwrap_err();
        assert!(refused.to_string().contains("3.200 rad"), "{refused}");
        let fault = Fault::OutsideChart { kind: BlockKind::Rotation, unknown: 9, size: 3.2 };
        assert_eq!(refused.fault(9), fault);
        assert_eq!((q1, dq), ([7.0; 12], [8.0; 12]), "left as they were");
        let u = [0.0, 0.0, 0.0, f64::NAN, 0.0, 0.0];
        let refused = reparametrize(&u, &q0, &mut q1, &mut dq).unwrap_err();
        assert_eq!(refused.fault(0), Fault::NotFinite);
        check_rotation(&Vector3::new(0.0, MAX_ROTATION, 0.0)).unwrap();
    }

    #[test]
    fn a_million_steps_keep_the_directors_orthonormal() {
        let mut sample = Sample::new(35);
        let mut q = sample.frame();
        let u = increment(&mut sample, 0.037);
        let (mut q1, mut dq) = ([0.0; 12], [0.0; 12]);
        let (mut worst, mut cleaned) = (0.0_f64, 0);
        for _ in 0..1_000_000 {
            reparametrize(&u, &q, &mut q1, &mut dq).unwrap();
            cleaned += u32::from(clean_directors(&mut q1));
            q = q1;
            worst = worst.max(rotation::orthonormality_defect(&triad(&q)));
        }
        println!("defect at most {worst:.1e}, {cleaned} polar steps");
        assert!(worst <= CLEAN_THRESHOLD, "{worst:e}");
        assert!(cleaned > 0 && cleaned < 200_000, "{cleaned} polar steps in a million");
    }
}
