//! A flexible beam that flies freely, spinning and bending.
//!
//! Shows: nodes and elements as a mechanism, the dynamics of a beam by the same integrator as
//! bodies. Holds: linear and angular momentum to round-off, a bounded energy error.

use nalgebra::Vector3;
use std::error::Error;
use vi_beam::model::{BeamModel, StrainRule};
use vi_beam::{BeamMesh, FrameRule, Section};
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_multibody::run::{Solver, integrator};

fn main() -> Result<(), Box<dyn Error>> {
    let section = Section::new([1e4, 1e4, 1e4, 500.0, 500.0, 500.0], [1.0, 10.0, 10.0, 0.0])?;
    let rule = FrameRule::Normal(Vector3::z());
    let mesh = BeamMesh::straight(Vector3::zeros(), 10.0 * Vector3::x(), 8, rule)?;
    let mut model = BeamModel::new(Vector3::zeros());
    model.add_beam("beam", &mesh, section)?;
    let omega = Vector3::new(0.7, 0.4, -0.9); // rad/s
    for node in &mut model.description.bodies {
        let wave = 0.2 * (3.0 * node.center.norm()).sin() * Vector3::z();
        node.omega = omega;
        node.velocity = Vector3::new(0.5, -0.2, 0.3) + omega.cross(&node.center) + wave;
    }
    let mechanism = model.mechanism();
    let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
    let system = model.system(&mechanism, StrainRule::Averaged);
    let options = Options::new(SchemeKind::Nodal, 0.01);
    let at = InitialValues::new(0.0, &q, &v);
    let mut run = integrator(mechanism.clone(), system, options, Solver::Auto, at)?;

    let start = mechanism.momentum(&run.state().q, &run.state().p);
    let energy = run.observe()?.hamiltonian_projected.total();
    let (mut momentum, mut error) = ([0.0_f64; 2], 0.0_f64);
    for _ in 0..1000 {
        run.step()?;
        let now = mechanism.momentum(&run.state().q, &run.state().p);
        for i in 0..3 {
            momentum[0] = momentum[0].max((now.linear[i] - start.linear[i]).abs());
            momentum[1] = momentum[1].max((now.angular[i] - start.angular[i]).abs());
        }
        error = error.max((run.node_before()?.hamiltonian_projected.total() / energy - 1.0).abs());
    }
    println!("linear momentum  {:?} kg·m/s, off by {:.1e}", start.linear, momentum[0]);
    println!("angular momentum {:?} kg·m²/s, off by {:.1e}", start.angular, momentum[1]);
    println!("energy {energy:.3} J, relative error at most {error:.1e}");
    assert!(momentum[0] < 1e-12 && momentum[1] < 1e-10, "momenta are conserved: {momentum:?}");
    assert!(error < 1e-5, "the energy error is bounded: {error}");
    Ok(())
}
