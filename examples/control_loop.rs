//! An inverted pendulum on a cart, held upright by a controller that is written here.
//!
//! Shows: feedback. A law of a motor is a function of time and of its own coordinate; what depends
//! on others is read at the nodes, between steps, and held over the next step in a cell that the
//! law reads, as a digital controller does. Holds: the pendulum stays upright and the cart returns.

use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use vi_constraints::{Options, SchemeKind};
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::{FrameId::Ground, PairKind};
use vi_rigid::Shape;

fn main() -> Result<(), Box<dyn Error>> {
    let h = 1e-3; // s
    let bar = |lengths| Inertia::shape_of_mass(Shape::Box { lengths }, 1.0);
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let cart = builder.body("cart", bar([0.4, 0.2, 0.1])).id();
    let lean = 0.15_f64; // rad at the start
    let pole = builder.body("pole", bar([0.02, 0.02, 1.0]));
    let pole = pole.at([0.5 * lean.sin(), 0.0, 0.5 * lean.cos()]);
    let pole = pole.rotation_vector([0.0, lean, 0.0]).id();
    let rail = builder.joint("rail", PairKind::Prismatic, Ground, cart).at([0.0; 3]);
    let place = rail.axis([1.0, 0.0, 0.0]).id().coordinate(0);
    let pivot = builder.joint("pivot", PairKind::Revolute, cart, pole).at([0.0; 3]);
    let angle = pivot.axis([0.0, 1.0, 0.0]).id().coordinate(0);
    // the force on the cart, N, as the bits of a number: laws are shared between threads
    let force = Arc::new(AtomicU64::new(0.0_f64.to_bits()));
    let read = Arc::clone(&force);
    builder.motor(place, move |_| f64::from_bits(read.load(Ordering::Relaxed)));

    let mut built = builder.build()?;
    let place = built.coordinate(place).ok_or("a slide has a length")?;
    let angle = built.coordinate(angle).ok_or("a hinge has an angle")?;
    let mut run = built.integrator(Options::new(SchemeKind::Nodal, h))?;
    let mut highest = 0.0_f64;
    for _ in 0..8000 {
        run.step()?;
        // coordinates are measured from the initial configuration; rates are those of the step
        let at = run.state().configuration();
        let (x, theta) = (place.at(at), lean + angle.at(at));
        let [v, omega] = [&place, &angle].map(|of| of.change(run.interval()).difference / h);
        let wanted = 60.0 * theta + 12.0 * omega + 4.0 * x + 6.0 * v;
        force.store(wanted.to_bits(), Ordering::Relaxed);
        highest = highest.max(theta.abs());
    }
    let at = run.state().configuration();
    let (x, theta) = (place.at(at), lean + angle.at(at));
    println!("largest lean {highest:.3} rad; after 8 s {theta:.1e} rad, cart at {x:.1e} m");
    println!("constraints hold to {:.1e}", run.observe()?.position_residual);
    assert!(highest < 0.3 && theta.abs() < 1e-2 && x.abs() < 0.1, "it stays upright");
    Ok(())
}
