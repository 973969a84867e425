//! Steady precession of a heavy top: a cone on its tip, tilted by 60°, precessing with 10 rad/s.
//!
//! ```text
//! spin = M g l/(J_3 Ω) + (J_1 + M l² − J_3)/J_3 · Ω cos 60° = 135.6 rad/s
//! φ(t) = Rot_z(Ω t) φ(0)
//! ```
//! The only known closed motion of the top; the method follows it with order 2 and keeps the tip in
//! its place.
#![allow(clippy::unwrap_used)] // helpers of tests

use crate::common;

use common::Stepper;
use nalgebra::{Matrix3, Vector3};
use vi_constraints::Constraints;
use vi_core::linear::norm_inf;
use vi_rigid::{RigidBody, Shape, SingleBody, Support, directors, rotation};

const GRAVITY: f64 = 9.81;
const PRECESSION: f64 = 10.0;

/// Error of the centre at `t = 0.5 s`, and the largest constraint residual on the way.
fn run(steps: u32) -> (f64, f64) {
    let cone = Shape::Cone { radius: 0.05, length: 0.1 };
    let properties = cone.mass_properties(2700.0).unwrap();
    let (arm, tilt) = (0.075, std::f64::consts::FRAC_PI_3);
    let [j1, _, j3] = properties.inertia.moments();
    let spin = properties.mass * GRAVITY * arm / (j3 * PRECESSION)
        + (j1 + properties.mass * arm * arm - j3) / j3 * PRECESSION * tilt.cos();
    assert!((spin - 135.6).abs() < 0.05, "spin {spin}");

    let support =
        Support::FixedPoint { anchor: Vector3::new(0.0, 0.0, -arm), point: Vector3::zeros() };
    let body = SingleBody::new(RigidBody::try_from(properties).unwrap(), support);
    let triad: Matrix3<f64> = rotation::exp(&Vector3::new(tilt, 0.0, 0.0));
    let q = body.configuration(&Vector3::zeros(), &triad);
    let axis = directors::director(&q, 2);
    let omega = PRECESSION * Vector3::z() + spin * axis;
    let mut state = body.start(0.0, &q, omega.as_slice());
    let start = directors::center(&q);
    assert!((start - arm * axis).norm() < 1e-16);

    let mut stepper = Stepper::new(body, body.system(&Vector3::new(0.0, 0.0, -GRAVITY)));
    let (mut residual, mut g) = (0.0_f64, [0.0; 9]);
    for _ in 0..steps {
        stepper.step(0.5 / f64::from(steps), &mut state);
        body.value(state.configuration(), &mut g);
        residual = residual.max(norm_inf(&g));
    }
    let exact = rotation::exp(&Vector3::new(0.0, 0.0, PRECESSION * 0.5)) * start;
    ((directors::center(&state.q) - exact).norm(), residual)
}

#[test]
fn steady_precession_is_followed_with_order_two() {
    let runs = [500, 1000, 2000, 4000].map(run);
    for pair in runs.windows(2) {
        let order = (pair[0].0 / pair[1].0).log2();
        println!("error {:.2e} → {:.2e}: order {order:.3}", pair[0].0, pair[1].0);
        assert!((order - 2.0).abs() < 0.1, "order {order}");
    }
    for (error, residual) in runs {
        assert!(residual < 2e-15, "constraints off by {residual:e} (error {error:e})");
    }
}
