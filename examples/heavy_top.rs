//! A heavy top in steady precession: a cone on its tip, tilted by 60°.
//!
//! Shows: one rigid body with a fixed point (`vi-rigid`), in director coordinates.
//! Holds: the vertical angular momentum is constant to round-off, the precession follows the closed
//! solution `φ(t) = Rot_z(Ω t) φ(0)` with `Ω` = 10 rad/s, of which
//! `spin = M γ l/(J_3 Ω) + (J_1 + M l² − J_3)/J_3 Ω cos 60°`.

use nalgebra::Vector3;
use std::error::Error;
use vi_constraints::{InitialValues, Integrator, Options, SchemeKind};
use vi_core::momentum_map::Momentum;
use vi_rigid::{RigidBody, Shape, SingleBody, Support, directors, rotation};

fn main() -> Result<(), Box<dyn Error>> {
    let (gravity, precession, tilt) = (9.81, 10.0, std::f64::consts::FRAC_PI_3);
    let arm = 0.075; // from the tip to the centre of mass, m
    let cone = Shape::Cone { radius: 0.05, length: 0.1 }.mass_properties(2700.0)?;
    let ([j1, _, j3], mass) = (cone.inertia.moments(), cone.mass);
    let spin = mass * gravity * arm / (j3 * precession)
        + (j1 + mass * arm * arm - j3) / j3 * precession * tilt.cos();

    let tip = Vector3::new(0.0, 0.0, -arm); // body components
    let support = Support::FixedPoint { anchor: tip, point: Vector3::zeros() };
    let top = SingleBody::new(RigidBody::try_from(cone)?, support);
    let system = top.system(&Vector3::new(0.0, 0.0, -gravity));
    let q = top.configuration(&Vector3::zeros(), &rotation::exp(&Vector3::new(tilt, 0.0, 0.0)));
    let omega = precession * Vector3::z() + spin * directors::director(&q, 2);
    let v = top.velocity(&q, omega.as_slice());

    let (h, steps) = (1e-4, 5000_u32);
    let options = Options::new(SchemeKind::Nodal, h);
    let at = InitialValues::new(0.0, &q, &v);
    let mut run = Integrator::with_reparametrization(system, top, top, options, at)?;
    let vertical = |q: &[f64], p: &[f64]| {
        let mut momentum = Momentum::default();
        directors::add_momentum(q, p, &mut momentum);
        momentum.angular[2]
    };
    let (start, before) = (directors::center(&q), vertical(&run.state().q, &run.state().p));
    for _ in 0..steps {
        run.step()?;
    }
    let end = directors::center(&run.state().q);
    let turned = rotation::exp(&(precession * h * f64::from(steps) * Vector3::z()));
    let error = (end - turned * start).norm();
    let change = vertical(&run.state().q, &run.state().p) - before;
    println!("spin {spin:.3} rad/s, vertical angular momentum {before:.6} kg·m²/s");
    println!("after {:.1} s: height {:.6} m", run.state().t, end.z);
    println!("centre off the closed solution by {error:.1e} m, momentum by {change:.1e} kg·m²/s");
    assert!(change.abs() < 1e-12, "the vertical angular momentum is conserved");
    assert!(error < 1e-5, "the precession is steady");
    Ok(())
}
