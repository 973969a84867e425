//! Orders of convergence: a double pendulum in space by compositions of order 2, 4 and 6.
//!
//! Shows: `Composition`, errors against a run of order 8 with a fine step.
//! Holds: the error of `q` shrinks with `h^p`.

use std::error::Error;
use vi_constraints::{Options, SchemeKind};
use vi_core::Composition;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::{FrameId::Ground, PairKind};
use vi_rigid::Shape;

/// `q(t = 1 s)` with `steps` steps of a composition.
fn end(composition: Composition, steps: u32) -> Result<Vec<f64>, Box<dyn Error>> {
    let bar = Inertia::shape_of_mass(Shape::Box { lengths: [0.6, 0.2, 0.1] }, 1.0);
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let upper =
        builder.body("upper", bar).at([0.5, 0.0, 0.0]).angular_velocity([1.0, 0.0, 0.0]).id();
    let lower = builder.body("lower", bar).at([1.5, 0.0, 0.0]).id();
    builder.joint("ball", PairKind::Spherical, Ground, upper).at([0.0; 3]);
    let hinge = builder.joint("hinge", PairKind::Revolute, upper, lower).at([1.0, 0.0, 0.0]);
    hinge.axis([0.0, 1.0, 0.0]).rate(1.0);
    let h = 1.0 / f64::from(steps);
    let options = Options::new(SchemeKind::Nodal, h).composition(composition);
    let mut run = builder.build()?.integrator(options)?;
    for _ in 0..steps {
        run.step()?;
    }
    Ok(run.state().q.clone())
}

fn main() -> Result<(), Box<dyn Error>> {
    let of_order = |order| Composition::of_order(order).ok_or("orders are 2, 4, 6 and 8");
    let reference = end(of_order(8)?, 800)?;
    for order in [2, 4, 6] {
        let mut errors = Vec::new();
        for steps in [40, 80, 160] {
            let q = end(of_order(order)?, steps)?;
            let off = q.iter().zip(&reference).map(|(a, b)| (a - b).abs());
            errors.push(off.fold(0.0, f64::max));
        }
        let observed = (errors[1] / errors[2]).log2();
        let [coarse, middle, fine] = errors[..] else { unreachable!("three runs") };
        println!("order {order}: {coarse:.2e}, {middle:.2e}, {fine:.2e} m; observed {observed:.2}");
        assert!((observed - f64::from(order)).abs() < 0.4, "order {order}: {observed}");
    }
    Ok(())
}
