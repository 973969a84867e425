//! A pendulum from its constraint alone: `M`, `V(q)` and `g(q)`, by all four schemes.
//!
//! Shows: `SeparableSystem`, `ConstraintFn`, `Integrator`, the quantities of a node.
//! Holds: `g(q_n) = 0` to round-off, and the four schemes give one motion.

use std::error::Error;
use vi_constraints::{ConstraintFn, InitialValues, Integrator, Options, SchemeKind};
use vi_core::SeparableSystem;
use vi_core::potential::LinearPotential;

fn main() -> Result<(), Box<dyn Error>> {
    let (length, gravity, h) = (1.0, 9.81, 0.01); // m, m/s², s
    let mut ends = Vec::new();
    for scheme in SchemeKind::ALL {
        // a mass of 1 kg in the plane: V = −(0, −m γ)·q,  g = ½(|q|² − l²),  G = qᵀ
        let system = SeparableSystem::with_diagonal_mass(&[1.0, 1.0])
            .potential(LinearPotential { force: vec![0.0, -gravity] });
        let rod = ConstraintFn::new(
            2,
            1,
            move |q, g| g[0] = 0.5 * (q[0] * q[0] + q[1] * q[1] - length * length),
            |q, jacobian| (jacobian[(0, 0)], jacobian[(0, 1)]) = (q[0], q[1]),
        );
        let horizontal = [length, 0.0];
        let start = InitialValues::new(0.0, &horizontal, &[0.0, 0.0]); // at rest
        let mut run = Integrator::new(system, rod, Options::new(scheme, h), start)?;
        for _ in 0..1000 {
            run.step()?;
        }
        let node = run.observe()?.clone();
        let (q, energy) = (&run.state().q, node.hamiltonian_projected.total());
        println!(
            "{:<12} q = ({:.6}, {:.6}) m, tension {:.4} N, energy {energy:+.1e} J, |g| = {:.1e} m²",
            scheme.name(),
            q[0],
            q[1],
            node.lambda[0] * length,
            node.position_residual
        );
        assert!(node.position_residual < 1e-14, "the constraint holds");
        assert!(energy.abs() < 1e-2, "the energy error is bounded");
        ends.push(q.clone());
    }
    for end in &ends {
        let off = (end[0] - ends[0][0]).hypot(end[1] - ends[0][1]);
        assert!(off < 1e-10, "the schemes differ by {off:e} m");
    }
    Ok(())
}
