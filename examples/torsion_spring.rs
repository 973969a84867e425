//! A rotor on a torsion spring that winds over several revolutions.
//!
//! Shows: a spring on a joint coordinate, angles with their revolutions.
//! Holds: `J θ̈ = −k θ`, so `θ(t) = (θ̇_0/w) sin wt` with `w = √(k/J)`, up to an error of order 2.

use std::error::Error;
use vi_constraints::{Options, SchemeKind};
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::{FrameId::Ground, PairKind};

fn main() -> Result<(), Box<dyn Error>> {
    let (stiffness, inertia, rate) = (0.02_f64, 0.5, 8.0); // N·m/rad, kg·m², rad/s
    let w = (stiffness / inertia).sqrt();
    let mut errors = Vec::new();
    for steps in [2000_u32, 4000] {
        let mut builder = MechanismBuilder::new();
        let rotor = builder.body("rotor", Inertia::principal(2.0, [0.3, 0.4, inertia])).id();
        let hinge = builder.joint("hinge", PairKind::Revolute, Ground, rotor);
        let hinge = hinge.at([0.0; 3]).axis([0.0, 0.0, 1.0]).rate(rate).id().coordinate(0);
        builder.joint_spring(hinge, stiffness, 0.0);
        let mut built = builder.build()?;
        let angle = built.coordinate(hinge).ok_or("a hinge has an angle")?;

        let h = 24.0 / f64::from(steps);
        let mut run = built.integrator(Options::new(SchemeKind::Nodal, h))?;
        let (mut most, mut error) = (0.0_f64, 0.0_f64);
        for _ in 0..steps {
            run.step()?;
            let theta = angle.at(run.state().configuration());
            most = most.max(theta.abs() / std::f64::consts::TAU);
            error = error.max((theta - rate / w * (w * run.state().t).sin()).abs());
        }
        println!("h = {h:.3} s: up to {most:.3} revolutions, angle off by {error:.2e} rad");
        assert!(most > 6.0, "the spring is wound over six revolutions");
        errors.push(error);
    }
    let order = (errors[0] / errors[1]).log2();
    println!("order {order:.3}");
    assert!((order - 2.0).abs() < 0.05, "second order: {order}");
    Ok(())
}
