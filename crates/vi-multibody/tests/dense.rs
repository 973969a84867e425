//! Steps by sweeps beside steps by dense matrices.

use vi_constraints::{InitialValues, Options};
use vi_core::Quadrature;
use vi_core::linear::norm_inf;
use vi_multibody::BuiltMechanism;
use vi_multibody::run::{Solver, integrator};

/// By how much the states of twenty steps differ from those by dense matrices, relative to these; and the iterations of both.
pub(crate) fn off_dense(built: &BuiltMechanism, options: Options) -> (f64, [usize; 2]) {
    let (q, v) = (built.mechanism.initial_configuration(), built.mechanism.initial_velocity());
    let run = |solver| {
        let system = built.system(Quadrature::Midpoint);
        let at = InitialValues::new(0.0, &q, &v);
        let mut run = integrator(built.mechanism.clone(), system, options, solver, at).unwrap();
        let count: usize = (0..20).map(|_| run.step().unwrap().iterations).sum();
        ([&run.state().q[..], &run.state().p].concat(), count)
    };
    let ((found, count), (dense, of_dense)) = (run(Solver::Auto), run(Solver::Dense));
    let off: Vec<f64> = found.iter().zip(&dense).map(|(a, b)| a - b).collect();
    (norm_inf(&off) / norm_inf(&dense), [count, of_dense])
}
