//! Sixty-four double pendulums that begin a nanoradian per second apart, moved together.
//!
//! Shows: an ensemble, members side by side in wide registers; how their distance grows.
//! Holds: the energy of every member. Distances grow exponentially: the motion is chaotic.

use std::error::Error;
use vi_constraints::{Options, SchemeKind};
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::ensemble::Ensemble;
use vi_multibody::{BuildError, BuiltMechanism, FrameId::Ground, PairKind};

const MEMBERS: u32 = 64;

fn double_pendulum(rate: f64) -> Result<BuiltMechanism, BuildError> {
    let bar = Inertia::principal(1.0, [0.01, 0.1, 0.1]); // kg, kg·m²
    let (mut builder, y) = (MechanismBuilder::new().gravity([0.0, 0.0, -9.81]), [0.0, 1.0, 0.0]);
    let upper = builder.body("upper", bar).at([0.5, 0.0, 0.0]).id();
    let lower = builder.body("lower", bar).at([1.5, 0.0, 0.0]).id();
    builder.joint("shoulder", PairKind::Revolute, Ground, upper).at([0.0; 3]).axis(y);
    builder.joint("elbow", PairKind::Revolute, upper, lower).at([1.0, 0.0, 0.0]).axis(y).rate(rate);
    builder.build()
}

fn main() -> Result<(), Box<dyn Error>> {
    let models: Result<Vec<_>, _> =
        (0..MEMBERS).map(|k| double_pendulum(2.0 + 1e-9 * f64::from(k))).collect();
    let mut ensemble = Ensemble::new(models?, Options::new(SchemeKind::Nodal, 1e-3))?;
    println!("{} members, {} of them in lanes", ensemble.len(), ensemble.in_lanes());
    let energy = |ensemble: &mut Ensemble, k: usize| -> Result<f64, Box<dyn Error>> {
        Ok(ensemble.observe_state(k)?.hamiltonian_projected.total())
    };
    let start = energy(&mut ensemble, 0)?;
    let (mut apart, mut error) = (Vec::new(), 0.0_f64);
    for second in 1..=8 {
        ensemble.advance(1000);
        let end = |k: usize| &ensemble.member(k).state().q[12..15]; // centre of the lower bar
        let off = |k| end(k).iter().zip(end(0)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        apart.push((1..ensemble.len()).map(off).fold(0.0, f64::max));
        println!("t = {second} s: {:.1e} m apart", apart[apart.len() - 1]);
        for k in 0..ensemble.len() {
            error = error.max((energy(&mut ensemble, k)? - start).abs());
        }
    }
    println!("energies off by at most {error:.1e} J");
    assert!(ensemble.failures().all(|failure| failure.is_none()));
    assert!(error < 0.01 && apart[7] > 100.0 * apart[0], "{error}, {apart:?}");
    Ok(())
}
