//! A double pendulum described by the `MechanismBuilder`: two bars, two hinges, given rates.
//!
//! Shows: bodies from shapes, joints by position and axis, initial velocities from the rates of
//! joints. Holds: the constraints to round-off, a bounded energy error over 20,000 steps of a
//! chaotic motion.

use std::error::Error;
use vi_constraints::{Constraints, Options, SchemeKind};
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::{FrameId::Ground, PairKind};
use vi_rigid::Shape;

fn main() -> Result<(), Box<dyn Error>> {
    let bar = Inertia::shape(Shape::Box { lengths: [1.0, 0.05, 0.05] }, 7800.0); // m, kg/m³
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let upper = builder.body("upper", bar).at([0.5, 0.0, 0.0]).id();
    let lower = builder.body("lower", bar).at([1.5, 0.0, 0.0]).id();
    let y = [0.0, 1.0, 0.0];
    builder.joint("shoulder", PairKind::Revolute, Ground, upper).at([0.0; 3]).axis(y);
    let elbow = builder.joint("elbow", PairKind::Revolute, upper, lower);
    let elbow = elbow.at([1.0, 0.0, 0.0]).axis(y).rate(2.0).id();

    let mut built = builder.build()?;
    let angle = built.coordinate(elbow.coordinate(0)).ok_or("a hinge has an angle")?;
    let mut run = built.integrator(Options::new(SchemeKind::Nodal, 1e-3))?;
    let first = run.observe()?.hamiltonian_projected;
    let (mut error, mut residual) = (0.0_f64, 0.0_f64);
    for n in 0..20_000 {
        run.step()?;
        if n % 4000 == 0 {
            let turns = angle.at(run.state().configuration()) / std::f64::consts::TAU;
            println!("t = {:6.3} s: elbow at {turns:+.3} revolutions", run.state().t);
        }
        let node = run.node_before()?;
        error = error.max((node.hamiltonian_projected.total() - first.total()).abs());
        residual = residual.max(node.position_residual);
    }
    let dof = run.constraints().dim() - run.rows().len();
    println!("{dof} degrees of freedom in {} coordinates", run.constraints().dim());
    println!("energy off by at most {error:.1e} J, constraints by {residual:.1e}");
    assert_eq!(dof, 2);
    assert!(residual < 1e-13, "the constraints hold");
    assert!(error < 0.1, "the energy error is bounded: {error} J");
    Ok(())
}
