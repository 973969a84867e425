//! Motions that are known in closed form.

use holonom::certificate::subject::ModelSubject;
use holonom::nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use holonom::verification::subject::{
    Initial, NodeValues, RunningMotion, SchemeSetting, SteppingMethod, Subject,
};
use holonom::vi_constraints::projection::Projections;
use holonom::vi_constraints::{Constraints, SchemeKind};
use holonom::vi_core::{Configuration, MechanicalSystem};

/// `(q, v)` at time `t`, from the start `q(0)`.
pub(crate) type ExactMotion = fn(f64, &[f64]) -> (Vec<f64>, Vec<f64>);

/// A model whose motion is known; momenta and multipliers follow from its own numbers.
pub(crate) struct Exact {
    subject: ModelSubject,
    motion: ExactMotion,
}

impl Exact {
    pub(crate) fn new(subject: ModelSubject, motion: ExactMotion) -> Result<Self, String> {
        subject.integrator(
            SchemeKind::Nodal,
            SchemeSetting::new(SteppingMethod::NODAL, 2, 1.0),
            None,
        )?;
        Ok(Self { subject, motion })
    }
}

impl Subject for Exact {
    fn start_from(
        &self,
        setting: SchemeSetting,
        at: Option<Initial<'_>>,
    ) -> Result<Box<dyn RunningMotion>, String> {
        self.subject.start_from(setting, at)
    }

    fn exact(&self, t: f64) -> Option<NodeValues> {
        let setting = SchemeSetting::new(SteppingMethod::NODAL, 2, 1.0);
        let run = self.subject.integrator(SchemeKind::Nodal, setting, None).ok()?;
        let (q, v) = (self.motion)(t, &run.state().q);
        let (system, constraints) = (run.system(), run.constraints());
        let (mut p, mut lambda) = (vec![0.0; q.len()], vec![0.0; constraints.len()]);
        system.mass().mul_add(1.0, &v, &mut p);
        let at = Configuration::new(t, &q);
        Projections::new(system, constraints.len(), run.rows())
            .acceleration_multiplier(system, constraints, at.moving(&v), &mut lambda)
            .ok()?;
        Some(NodeValues { q, p, lambda_other: Some(lambda), ..NodeValues::default() })
    }
}

/// `sn(u), cn(u)` of modulus `k` and the quarter period `K`, by the arithmetic–geometric mean
/// (Abramowitz & Stegun 16.4, 17.6).
fn jacobi(u_of: impl Fn(f64) -> f64, k: f64) -> (f64, f64) {
    let (mut a, mut b, mut c) = (vec![1.0_f64], (1.0 - k * k).sqrt(), vec![k]);
    for n in 0..12 {
        a.push(0.5 * (a[n] + b));
        c.push(0.5 * (a[n] - b));
        b = (a[n] * b).sqrt();
        if c[n + 1].abs() < 1e-17 {
            break;
        }
    }
    let last = a.len() - 1;
    let quarter = std::f64::consts::FRAC_PI_2 / a[last];
    let mut phi = 2_f64.powi(i32::try_from(last).unwrap_or(0)) * a[last] * u_of(quarter);
    for n in (1..=last).rev() {
        phi = 0.5 * (phi + (c[n] / a[n] * phi.sin()).asin());
    }
    phi.sin_cos()
}

/// Released at rest from `(1, 0)`: `sin(θ/2) = k sn(K − ω t)`, `θ̇ = −2 k ω cn(K − ω t)`,
/// `k² = 1/2`, `ω² = 9.81`, `θ` from the lowest point.
pub(crate) fn pendulum(t: f64, _: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (k, omega) = (0.5_f64.sqrt(), 9.81_f64.sqrt());
    let (sn, cn) = jacobi(|quarter| quarter - omega * t, k);
    let half = (k * sn).asin();
    let (sin, cos) = (2.0 * half).sin_cos();
    let rate = -2.0 * k * omega * cn;
    (vec![sin, -cos], vec![rate * cos, rate * sin])
}

/// Uniform rotation at 1 rad/s from `(1, 0)`.
pub(crate) fn uniform_rotation(t: f64, _: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (sin, cos) = t.sin_cos();
    (vec![cos, sin], vec![-sin, cos])
}

/// Steady precession at 10 rad/s with 135.6 rad/s about the axis of the cone, tilted by `π/3`.
pub(crate) fn steady_top(t: f64, start: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (precession, spin) = (10.0, 135.6);
    let tilt = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_3);
    let axis = Unit::new_normalize(tilt * Vector3::z());
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), precession * t);
    let center = turn * Vector3::from_column_slice(&start[..3]);
    let triad = Matrix3::from_column_slice(&start[3..]);
    let triad = turn * Rotation3::from_axis_angle(&axis, spin * t) * triad;
    let omega = precession * Vector3::z() + spin * (turn * axis.into_inner());
    let (mut q, mut v) = (Vec::new(), Vec::new());
    q.extend(center.iter());
    v.extend(omega.cross(&center).iter());
    for director in triad.column_iter() {
        q.extend(director.iter());
        v.extend(omega.cross(&director).iter());
    }
    (q, v)
}
