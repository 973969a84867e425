//! A planar four-bar linkage of spatial hinges: a closed loop with redundant joints.
//!
//! Shows: a loop that the builder closes, which of its constraints are redundant, the reaction of a
//! joint. Holds: one degree of freedom, three redundant constraints, all 38 of them to round-off.

use std::error::Error;
use vi_constraints::{Constraints, Options, SchemeKind};
use vi_multibody::builder::{BodyId, Inertia, MechanismBuilder};
use vi_multibody::{FrameId, PairKind, Reactions};

fn main() -> Result<(), Box<dyn Error>> {
    let mut builder = MechanismBuilder::new().gravity([0.0, -9.81, 0.0]);
    // three bars of 1 kg and 1 m; the crank turns by −1 rad/s, so the coupler is in translation
    let upright = Inertia::principal(1.0, [0.1, 0.01, 0.1]);
    let lying = Inertia::principal(1.0, [0.01, 0.1, 0.1]);
    let turning = [0.0, 0.0, -1.0];
    let mut crank = |name: &str, x: f64| -> BodyId {
        let bar = builder.body(name, upright).at([x, 0.5, 0.0]).velocity([0.5, 0.0, 0.0]);
        bar.angular_velocity(turning).id()
    };
    let (left, right) = (crank("left", 0.0), crank("right", 1.0));
    let top = builder.body("top", lying).at([0.5, 1.0, 0.0]).velocity([1.0, 0.0, 0.0]).id();
    let mut hinge = |name: &str, parent: FrameId, child: BodyId, x: f64, y: f64| {
        builder
            .joint(name, PairKind::Revolute, parent, child)
            .at([x, y, 0.0])
            .axis([0.0, 0.0, 1.0]);
    };
    hinge("left foot", FrameId::Ground, left, 0.0, 0.0);
    hinge("right foot", FrameId::Ground, right, 1.0, 0.0);
    hinge("left top", left.into(), top, 0.0, 1.0);
    hinge("right top", right.into(), top, 1.0, 1.0);

    let mut run = builder.build()?.integrator(Options::new(SchemeKind::Nodal, 1e-3))?;
    let (n, m, rank) = (run.constraints().dim(), run.constraints().len(), run.rows().len());
    let closed = run.constraints().cut_joints().to_vec();
    let name = &run.constraints().description().joints[closed[0]].name;
    println!("{} degree of freedom, {m} constraints, {} redundant", n - rank, m - rank);
    println!("the loop is closed by the joint `{name}`");
    let energy = run.observe()?.hamiltonian_projected.total();
    let (mut error, mut residual) = (0.0_f64, 0.0_f64);
    for _ in 0..5000 {
        run.step()?;
        let node = run.node_before()?;
        error = error.max((node.hamiltonian_projected.total() - energy).abs());
        residual = residual.max(node.position_residual.max(node.velocity_residual));
    }
    let lambda = run.observe()?.lambda.clone();
    let at = run.state().configuration();
    let reactions = Reactions::at(run.constraints(), at, &lambda, run.rows());
    let foot = &reactions.joints[0];
    println!(
        "at {:.1} s: left foot {:.3} N, components unique: {:?}",
        at.t,
        foot.force.norm(),
        foot.unique
    );
    println!("energy off by at most {error:.1e} J, constraints by {residual:.1e}");
    assert_eq!((n - rank, m, m - rank), (1, 38, 3));
    assert!(residual < 1e-12, "all constraints hold, redundant ones too");
    assert!(error < 1e-3, "the energy error is bounded");
    Ok(())
}
