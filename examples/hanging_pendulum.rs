//! Statics of a pendulum: relaxation from the horizontal, then the frequency of its small
//! vibrations.
//!
//! Shows: a mechanism described in Rust, an equilibrium, modes about it.
//! Holds: `ω² = m γ l/(J + m l²)` about the hanging equilibrium.

use std::error::Error;
use vi_core::Quadrature;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::{FrameId::Ground, PairKind};
use vi_statics::{StaticProblem, modes};

fn main() -> Result<(), Box<dyn Error>> {
    let (mass, length, inertia, gravity) = (2.0, 0.5, 0.1, 9.81); // kg, m, kg·m², m/s²
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -gravity]);
    let arm = Inertia::principal(mass, [inertia; 3]);
    let arm = builder.body("arm", arm).at([length, 0.0, 0.0]).id();
    builder.joint("hinge", PairKind::Revolute, Ground, arm).at([0.0; 3]).axis([0.0, 1.0, 0.0]);
    let built = builder.build()?;

    let mut problem = StaticProblem::new(built.system(Quadrature::Midpoint), built.mechanism);
    let equilibrium = problem.equilibrate()?;
    let omega = modes(&mut problem)?.omega[0];
    let expected = (mass * gravity * length / (inertia + mass * length * length)).sqrt();
    println!(
        "centre at z = {:+.6} m, residual {:.1e} N·m, ω = {omega:.6} rad/s",
        equilibrium.q[2], equilibrium.residual
    );
    assert!((equilibrium.q[2] + length).abs() < 1e-12, "the pendulum hangs");
    assert!((omega / expected - 1.0).abs() < 1e-12, "{omega} and {expected} rad/s");
    Ok(())
}
