//! The sweeps of trees against dense matrices: chains and branched trees of all pairs, with and
//! without loads and springs, a body whose frame is not in its centre of mass; what they refuse.

use crate::dense::off_dense;
use crate::loaded_trees::tree;
use vi_constraints::nodal::Nodal;
use vi_constraints::nodal_operators::by_operators;
use vi_constraints::scheme::{Scheme, SubStep};
use vi_constraints::{DenseNodal, InitialValues, LegendreTransforms, Options, SchemeKind};
use vi_core::linear::norm_inf;
use vi_core::newton::Fault;
use vi_core::state::State;
use vi_core::{Composition, MechanicalSystem, Quadrature, SeparableSystem, SparseMatrix};
use vi_multibody::run::{Solver, integrator};
use vi_multibody::tree_map::TreeMap;
use vi_multibody::tree_step::TreeStep;
use vi_multibody::{BuiltMechanism, Mechanism};
use vi_testkit::Sample;

/// By how much the states of twenty steps differ from those by dense matrices.
fn apart(built: &BuiltMechanism, options: Options) -> f64 {
    let system = built.system(Quadrature::Midpoint);
    assert!(TreeStep::new(&built.mechanism, &system).is_some(), "the sweeps apply");
    off_dense(built, options).0
}

#[test]
fn the_sweeps_take_the_steps_of_dense_matrices() {
    let mut worst = 0.0_f64;
    for seed in 0..48 {
        for loaded in [false, true] {
            let built = tree(1 + seed as usize % 7, loaded, 7 + seed);
            let options = Options::new(SchemeKind::Nodal, 0.01);
            let off = apart(&built, options);
            assert!(off < 1e-11, "tree {seed}, loaded {loaded}: off by {off:e}");
            let composed = options.composition(Composition::Suzuki5);
            let off_composed = if loaded { 0.0 } else { apart(&built, composed) };
            assert!(off_composed < 1e-11, "tree {seed}, composed: off by {off_composed:e}");
            worst = worst.max(off).max(off_composed);
        }
    }
    println!("states off by {worst:.1e}");
}

/// Masses between the vectors of a frame that is not in the centre of mass, along axes that are not
/// principal.
#[test]
fn a_frame_may_be_anywhere_in_its_body() {
    let built = tree(4, false, 3);
    let (first, second) =
        ([0.3, -0.2, 0.5], [[0.5, 0.1, 0.05], [0.1, 0.6, -0.1], [0.05, -0.1, 0.4]]);
    let n = built.mechanism.system(Quadrature::Midpoint).dim();
    let mass = SparseMatrix::assemble(n, n, |out| {
        for frame in (0..n).step_by(12) {
            out.add_multiple(frame, frame, 2.0);
            for i in 0..3 {
                out.add_multiple(frame, frame + 3 + 3 * i, first[i]);
                out.add_multiple(frame + 3 + 3 * i, frame, first[i]);
                for j in 0..3 {
                    out.add_multiple(frame + 3 + 3 * i, frame + 3 + 3 * j, second[i][j]);
                }
            }
        }
    });
    let (q, v) = (built.mechanism.initial_configuration(), built.mechanism.initial_velocity());
    let run = |solver| {
        let system: SeparableSystem =
            built.mechanism.system_with_mass(mass.clone(), Quadrature::Midpoint);
        assert!(TreeStep::new(&built.mechanism, &system).is_some(), "the sweeps apply");
        let options = Options::new(SchemeKind::Nodal, 0.01);
        let at = InitialValues::new(0.0, &q, &v);
        let mut run = integrator(built.mechanism.clone(), system, options, solver, at).unwrap();
        (0..20).for_each(|_| {
            run.step().unwrap();
        });
        run.state().q.clone()
    };
    let (sweeps, dense) = (run(Solver::Auto), run(Solver::Dense));
    let off: Vec<f64> = sweeps.iter().zip(&dense).map(|(a, b)| a - b).collect();
    println!("off by {:.1e}", norm_inf(&off));
    assert!(norm_inf(&off) < 1e-11, "off by {:e}", norm_inf(&off));
}

/// `M v̂ + Gᵀμ = p̄`, `G v̂ = 0` by the sweeps and by a saddle-point matrix.
#[test]
fn nodes_have_the_velocity_of_the_saddle_point() {
    let mut worst = 0.0_f64;
    for seed in 0..48 {
        for loaded in [false, true] {
            let built = tree(1 + seed as usize % 9, loaded, 200 + seed);
            let mut run = built.integrator(Options::new(SchemeKind::Nodal, 0.01)).unwrap();
            (0..4).for_each(|_| {
                run.step().unwrap();
            });
            let found = run.observe_state().unwrap().v.clone();
            let (state, system) = (run.state(), run.system());
            let of = LegendreTransforms::with_rows(system, run.constraints(), run.rows());
            let v = of.unwrap().velocity(state.configuration(), &state.p).unwrap();
            let apart: Vec<f64> = found.iter().zip(&v).map(|(a, b)| a - b).collect();
            let off = norm_inf(&apart) / norm_inf(&v);
            assert!(off < 1e-12, "tree {seed}, loaded {loaded}: off by {off:e}");
            worst = worst.max(off);
        }
    }
    println!("velocities off by {worst:.1e}");
    assert!(worst > 0.0, "two ways to solve");
}

/// Residual and Newton correction of a scheme at the increments `u` of a step of 0.1 s.
fn evaluate(
    scheme: &mut dyn Scheme<SeparableSystem, Mechanism>,
    (built, system): (&BuiltMechanism, &SeparableSystem),
    (state, u): (&State, &[f64]),
) -> Result<[Vec<f64>; 2], Fault> {
    let (mechanism, mut state) = (&built.mechanism, state.clone());
    let mut r = vec![0.0; u.len()];
    state.history.fit(u.len(), 1, 0..0);
    scheme.begin(system, mechanism, SubStep::single(0.0, 0.1), &mut state);
    scheme.residual(system, mechanism, u, &mut r)?;
    let mut du = r.clone();
    scheme.correction(system, mechanism, u, &mut du)?;
    Ok([r, du])
}

/// Both schemes at the same increments.
fn both(built: &BuiltMechanism, u: &[f64]) -> [Result<[Vec<f64>; 2], Fault>; 2] {
    let system = built.system(Quadrature::Midpoint);
    let (q, v) = (built.mechanism.initial_configuration(), built.mechanism.initial_velocity());
    let at = InitialValues::new(0.0, &q, &v);
    let options = Options::new(SchemeKind::Nodal, 0.1);
    let started = built.system(Quadrature::Midpoint);
    let run = integrator(built.mechanism.clone(), started, options, Solver::Auto, at).unwrap();
    let state = run.state();
    let mut sweeps = Nodal::new(TreeStep::new(&built.mechanism, &system).unwrap());
    let dense = DenseNodal::new(state.q.len(), TreeMap::new(&built.mechanism));
    let mut general = by_operators(SchemeKind::Nodal, state.q.len(), dense, None);
    let at = ((built, &system), (state, u));
    [evaluate(&mut sweeps, at.0, at.1), evaluate(&mut *general, at.0, at.1)]
}

#[test]
fn residual_and_correction_are_those_of_dense_matrices_far_from_the_solution() {
    let mut worst = 0.0_f64;
    for seed in 0..60 {
        for loaded in [false, true] {
            let built = tree(1 + seed as usize % 9, loaded, 100 + seed);
            let mut random = Sample::new(seed);
            let u: Vec<f64> =
                (0..built.mechanism.tree().dof()).map(|_| 0.5 * random.number()).collect();
            let [sweeps, general] = both(&built, &u).map(Result::unwrap);
            for (a, b) in sweeps.iter().zip(&general) {
                let off: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
                let off = norm_inf(&off) / norm_inf(b).max(1e-300);
                assert!(u.is_empty() || off < 1e-11, "tree {seed}, loaded {loaded}: {off:e}");
                worst = if u.is_empty() { worst } else { worst.max(off) };
            }
        }
    }
    println!("residuals and corrections off by {worst:.1e}");
}

#[test]
fn the_sweeps_refuse_what_the_pair_maps_refuse() {
    let mut refused = 0;
    for seed in 0..30 {
        let built = tree(1 + seed as usize % 5, false, 300 + seed);
        let d = built.mechanism.tree().dof();
        for (k, value) in (0..d).flat_map(|k| [3.1, -3.2, f64::NAN, f64::INFINITY].map(|x| (k, x)))
        {
            let mut u = vec![0.0; d];
            u[k] = value;
            let [sweeps, general] = both(&built, &u).map(Result::err);
            let same = format!("{sweeps:?}") == format!("{general:?}"); // NaN as itself
            assert!(same, "tree {seed}, u[{k}] = {value}: {sweeps:?} and {general:?}");
            refused += usize::from(sweeps.is_some());
        }
    }
    println!("{refused} refusals");
    assert!(refused > 400, "{refused} refusals");
}
