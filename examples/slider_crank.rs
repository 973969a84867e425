//! A slider-crank driven by a motor of constant torque, with friction in the slide.
//!
//! Shows: a closed loop, a motor and a damper on joint coordinates, work and energy.
//! Holds: the energy changes by the work of motor and friction.

use std::error::Error;
use vi_constraints::{Options, SchemeKind};
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::joint_force::Viscous;
use vi_multibody::{FrameId::Ground, PairKind};
use vi_rigid::Shape;

fn main() -> Result<(), Box<dyn Error>> {
    let (torque, friction, h) = (0.5, 2.0, 1e-3); // N·m, N·s/m, s
    let bar = |length| Inertia::shape_of_mass(Shape::Box { lengths: [length, 0.02, 0.02] }, 0.5);
    let mut builder = MechanismBuilder::new().gravity([0.0, -9.81, 0.0]);
    // crank of 0.2 m upwards, rod of 0.5 m down to the slide on x; all at rest
    let (cos, sin) = ((0.25_f64 - 0.04).sqrt() / 0.5, -0.2 / 0.5);
    let reach = 0.5 * cos;
    let quarter = [0.0, 0.0, std::f64::consts::FRAC_PI_2];
    let crank = builder.body("crank", bar(0.2)).at([0.0, 0.1, 0.0]).rotation_vector(quarter).id();
    let rod = builder.body("rod", bar(0.5)).at([0.5 * reach, 0.1, 0.0]);
    let rod = rod.rotation_vector([0.0, 0.0, f64::atan2(sin, cos)]).id();
    let slider = builder.body("slider", bar(0.1)).at([reach, 0.0, 0.0]).id();
    let z = [0.0, 0.0, 1.0];
    let bearing = builder.joint("bearing", PairKind::Revolute, Ground, crank).at([0.0; 3]).axis(z);
    let angle = bearing.id().coordinate(0);
    builder.joint("pin", PairKind::Revolute, crank, rod).at([0.0, 0.2, 0.0]).axis(z);
    builder.joint("wrist", PairKind::Revolute, rod, slider).at([reach, 0.0, 0.0]).axis(z);
    let slide = builder.joint("slide", PairKind::Prismatic, Ground, slider);
    let slide = slide.at([reach, 0.0, 0.0]).axis([1.0, 0.0, 0.0]).id().coordinate(0);
    builder.motor(angle, move |_| torque);
    builder.joint_force(slide, Viscous(friction));

    let mut built = builder.build()?;
    let angle = built.coordinate(angle).ok_or("a hinge has an angle")?;
    let slide = built.coordinate(slide).ok_or("a slide has a length")?;
    let mut run = built.integrator(Options::new(SchemeKind::Nodal, h))?;
    let energy = run.observe()?.hamiltonian_projected.total();
    let mut lost = 0.0; // ∫ c ṡ² dt
    for _ in 0..4000 {
        run.step()?;
        let moved = slide.change(run.interval()).difference;
        lost += friction * moved * moved / h;
    }
    let turned = angle.at(run.state().configuration());
    let node = run.observe()?;
    let gained = node.hamiltonian_projected.total() - energy;
    let balance = gained - (torque * turned - lost);
    println!("crank at {turned:.4} rad after {:.1} s", 4000.0 * h);
    println!("work of the motor {:.4} J, friction {lost:.4} J", torque * turned);
    println!("energy gained {gained:.4} J, off by {balance:.1e} J");
    println!("constraints hold to {:.1e}", node.position_residual);
    assert!(balance.abs() < 1e-3 * lost.max(1.0), "work and energy balance");
    assert!(node.position_residual < 1e-12, "the loop stays closed");
    Ok(())
}
