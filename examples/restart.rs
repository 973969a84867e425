//! A motion that is stored, and goes on in a new integrator as if nothing had happened.
//!
//! Shows: `State` as JSON, `Integrator::resume`.
//! Holds: bit for bit the same state, with an angle of many revolutions that a spring feels.

use std::error::Error;
use vi_constraints::{Options, SchemeKind};
use vi_core::{Composition, State};
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::run::MechanismIntegrator;
use vi_multibody::{FrameId::Ground, PairKind};

/// A rotor on a torsion spring that carries a pendulum.
fn start() -> Result<MechanismIntegrator, Box<dyn Error>> {
    let inertia = Inertia::principal(2.0, [0.3, 0.4, 0.5]); // kg, kg·m²
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let rotor = builder.body("rotor", inertia).id();
    let pendulum = builder.body("pendulum", inertia).at([0.4, 0.0, -0.3]).id();
    let shaft = builder.joint("shaft", PairKind::Revolute, Ground, rotor).at([0.0; 3]);
    let shaft = shaft.axis([0.0, 0.0, 1.0]).rate(30.0).id();
    let hinge = builder.joint("hinge", PairKind::Revolute, rotor, pendulum);
    hinge.at([0.4, 0.0, 0.0]).axis([0.0, 1.0, 0.0]);
    builder.joint_spring(shaft.coordinate(0), 0.1, 0.0);
    let options = Options::new(SchemeKind::Nodal, 0.002).composition(Composition::Suzuki5);
    Ok(builder.build()?.integrator(options)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut run = start()?;
    for _ in 0..1000 {
        run.step()?;
    }
    let stored = serde_json::to_string(run.state())?;
    let turns = run.state().angles[0] / std::f64::consts::TAU;
    println!("at {:.1} s the shaft has turned {turns:.2} times", run.state().t);
    println!("stored as {} bytes of JSON", stored.len());

    let mut again = start()?;
    again.resume(serde_json::from_str::<State>(&stored)?)?;
    for _ in 0..500 {
        run.step()?;
        again.step()?;
    }
    let bits = |x: &[f64]| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    println!("at {:.1} s the pendulum is at {:.6?} m", again.state().t, &again.state().q[12..15]);
    assert!(turns > 5.0, "many revolutions");
    assert_eq!(bits(&run.state().q), bits(&again.state().q), "q, bit for bit");
    assert_eq!(bits(&run.state().p), bits(&again.state().p), "p, bit for bit");
    assert_eq!(run.state(), again.state());
    Ok(())
}
