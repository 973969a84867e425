//! Steps by sweeps beside steps by dense matrices.

use vi_constraints::{InitialValues, Options};
use vi_core::Quadrature;
use vi_core::linear::norm_inf;
use vi_core::state::State;
use vi_multibody::BuiltMechanism;
use vi_multibody::run::{Solver, integrator};

/// The state after some steps, and their iterations.
pub(crate) fn run(
    built: &BuiltMechanism,
    options: Options,
    solver: Solver,
    steps: usize,
) -> (State, usize) {
    let (q, v) = (built.mechanism.initial_configuration(), built.mechanism.initial_velocity());
    let (system, at) = (built.system(Quadrature::Midpoint), InitialValues::new(0.0, &q, &v));
    let mut run = integrator(built.mechanism.clone(), system, options, solver, at).unwrap();
    let count = (0..steps).map(|_| run.step().unwrap().iterations).sum();
    (run.state().clone(), count)
}

/// `|found − exact|_∞` relative to `|exact|_∞`.
pub(crate) fn relative_distance(found: &[f64], exact: &[f64]) -> f64 {
    let off: Vec<f64> = found.iter().zip(exact).map(|(a, b)| a - b).collect();
    norm_inf(&off) / norm_inf(exact)
}

/// By how much the states of twenty steps differ from those by dense matrices, relative to these;
/// and the iterations of both.
pub(crate) fn off_dense(built: &BuiltMechanism, options: Options) -> (f64, [usize; 2]) {
    let run = |solver| {
        let (state, count) = run(built, options, solver, 20);
        ([state.q, state.p].concat(), count)
    };
    let ((found, count), (dense, of_dense)) = (run(Solver::Auto), run(Solver::Dense));
    (relative_distance(&found, &dense), [count, of_dense])
}
