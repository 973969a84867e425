//! Members as they are read after each step, against integrators of their own.

use crate::loaded_trees::{tree, varied_tree};
use std::num::NonZeroUsize;
use vi_constraints::discretization::Transition;
use vi_constraints::node::Node;
use vi_constraints::{Options, SchemeKind};
use vi_core::Composition;
use vi_core::interval::Interval;
use vi_core::state::State;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::ensemble::Ensemble;
use vi_multibody::{BuiltMechanism, FrameId, PairKind};

/// What is recorded of a step; numbers are compared by their bits.
#[derive(Clone, Debug, Default)]
struct Row {
    before: State,
    s: Interval,
    multipliers: Vec<f64>,
    after: State,
    at_start: Node,
    at_end: Node,
}

fn state_bits(state: &State) -> Vec<u64> {
    let balance = &state.compensation.balance;
    let parts =
        [&state.q, &state.p, &state.compensation.q, balance, &state.angles, &state.internal];
    let numbers = parts.into_iter().flatten().copied().chain([state.t]);
    numbers.map(f64::to_bits).chain([state.step]).collect()
}

impl Row {
    fn new(taken: Transition<'_>) -> Self {
        Self {
            before: taken.before.clone(),
            s: taken.step.s.clone(),
            multipliers: taken.step.multipliers.to_vec(),
            after: taken.after.clone(),
            ..Self::default()
        }
    }

    fn bits(&self) -> Vec<u64> {
        let Self { s, at_start, at_end, .. } = self;
        let interval = [&s.q0, &s.q1, &s.dq, &s.q_mid, &s.v_mid, &s.angles, &s.internal];
        let node = |of: &Node| {
            let energies = [of.discrete_energy, of.hamiltonian_projected];
            let energies = energies.map(|of| of.total());
            let residuals = [of.position_residual, of.velocity_residual, of.momentum_residual];
            let vectors = [&of.lambda, &of.constraint_force, &of.p, &of.v, &of.p_projected];
            let vectors = vectors.into_iter().flatten().copied();
            vectors.chain(energies).chain(residuals).collect::<Vec<f64>>()
        };
        let numbers = interval.into_iter().flatten().copied().chain([s.t, s.h, s.t_end()]);
        let numbers = numbers.chain(self.multipliers.iter().copied());
        let numbers = numbers.chain(node(at_start)).chain(node(at_end)).map(f64::to_bits);
        let states = [state_bits(&self.before), state_bits(&self.after)].concat();
        numbers.chain(states).collect()
    }
}

/// The rows of `steps` steps of a model alone.
fn alone(model: BuiltMechanism, options: Options, steps: u64) -> Vec<Row> {
    let mut run = model.integrator(options).unwrap();
    let row = |_| {
        let mut row = Row::new(run.advance().ok()?);
        row.at_start = run.node_before().unwrap().clone();
        row.at_end = run.observe_state().unwrap().clone();
        Some(row)
    };
    (0..steps).map_while(row).collect()
}

/// Some members of an ensemble, recorded on some threads, in calls of some steps.
fn together(
    models: &[BuiltMechanism],
    options: Options,
    (threads, calls): (usize, &[u64]),
    recorded: impl Fn(usize) -> bool,
) -> (Ensemble, Vec<Option<Vec<Row>>>) {
    let mut ensemble = Ensemble::new(models.to_vec(), options).unwrap();
    let mut rows: Vec<Option<Vec<Row>>> =
        (0..models.len()).map(|k| recorded(k).then(Vec::new)).collect();
    for &steps in calls {
        ensemble.record_on(
            NonZeroUsize::new(threads).unwrap(),
            steps,
            &mut rows,
            |rows, mut of| {
                let mut row = Row::new(of.transition());
                assert_eq!(of.state(), &row.after);
                row.at_start = of.node_before().unwrap().clone();
                row.at_end = of.observe_state().unwrap().clone();
                rows.push(row);
            },
        );
    }
    (ensemble, rows)
}

/// States, intervals, multipliers, momenta and energies of every step; with and without forces, by
/// compositions, backward, on threads, in several calls.
#[test]
fn recorded_members_have_the_nodes_of_their_own_integrators() {
    let cases = [
        (Composition::Identity, 0.004),
        (Composition::Suzuki5, 0.01),
        (Composition::Identity, -0.004),
        (Composition::SofroniouSpaletta13, 0.03),
    ];
    let mut compared = 0;
    for seed in 0..12 {
        let (composition, step) = cases[seed as usize % cases.len()];
        let options = Options::new(SchemeKind::Nodal, step).composition(composition);
        let loaded = seed % 3 > 0;
        let other = |k: u32| 0.03 * f64::from(k);
        let models: Vec<BuiltMechanism> =
            (0..11).map(|k| varied_tree(1 + seed as usize % 6, loaded, seed, other(k))).collect();
        let calls = [&[24][..], &[1, 7, 1, 15]][seed as usize % 2];
        let wanted = |k: usize| seed % 4 < 2 || k % 3 == 1;
        let threads = 1 + seed as usize % 3;
        let (ensemble, rows) = together(&models, options, (threads, calls), wanted);
        assert_eq!(ensemble.in_lanes(), 11);
        for (k, (model, rows)) in models.into_iter().zip(rows).enumerate() {
            let own = alone(model, options, 24);
            assert_eq!(rows.is_some(), wanted(k));
            if own.len() == 24 {
                let (end, last) = (ensemble.member(k), &own[23]);
                assert_eq!(state_bits(end.state()), state_bits(&last.after), "seed {seed}, {k}");
                // the last step can be read in any case
                let taken = end.transition();
                assert_eq!(state_bits(taken.before), state_bits(&last.before), "{seed}, {k}");
                assert_eq!(taken.step.s, &last.s, "seed {seed}, member {k}");
            }
            let Some(rows) = rows else { continue };
            assert_eq!(rows.len(), own.len(), "seed {seed}, member {k}");
            for (row, own) in rows.iter().zip(&own) {
                let step = own.after.step;
                assert_eq!(row.bits(), own.bits(), "seed {seed}, member {k}, step {step}");
                compared += 1;
            }
        }
    }
    println!("{compared} steps compared");
    assert!(compared > 1500, "{compared}");
}

/// A state that was recorded continues the motion.
#[test]
fn a_recorded_state_continues_the_motion() {
    let options = Options::new(SchemeKind::Nodal, 0.02).composition(Composition::Suzuki5);
    let models: Vec<BuiltMechanism> = (0..5).map(|k| tree(4, k > 2, 7)).collect();
    let (_, rows) = together(&models, options, (1, &[30]), |_| true);
    for (k, (model, rows)) in models.into_iter().zip(rows).enumerate() {
        let rows = rows.unwrap();
        let mut run = model.integrator(options).unwrap();
        run.resume(rows[11].after.clone()).unwrap();
        (12..30).for_each(|_| _ = run.step().unwrap());
        assert_eq!(state_bits(run.state()), state_bits(&rows[29].after), "member {k}");
    }
}

/// A four-bar linkage of boxes with a spring between two of its bars; `k`: its member, `fast`: how
/// many times faster it starts.
fn linkage(k: u32, fast: f64) -> BuiltMechanism {
    let mut builder = MechanismBuilder::new().gravity([0.0, -9.81, 0.0]);
    let mass = 1.0 + 0.1 * f64::from(k);
    let mut bar = |name: &str, at: [f64; 3], v: [f64; 3], spin: f64| {
        let inertia = Inertia::principal(mass, [0.1, 0.05, 0.1]);
        let body = builder.body(name, inertia).at(at).velocity(v.map(|v| fast * v));
        body.angular_velocity([0.0, 0.0, fast * spin]).id()
    };
    // a parallelogram: cranks turn, the coupler moves without rotation
    let crank = bar("crank", [0.0, 0.5, 0.0], [-0.5, 0.0, 0.0], 1.0);
    let coupler = bar("coupler", [1.0, 1.0, 0.0], [-1.0, 0.0, 0.0], 0.0);
    let rocker = bar("rocker", [2.0, 0.5, 0.0], [-0.5, 0.0, 0.0], 1.0);
    builder.spring(crank.point([0.1, 0.0, 0.0]), rocker.point([0.0; 3]), 3.0);
    let mut hinge = |name: &str, parent: FrameId, child: FrameId, at: [f64; 3]| {
        builder.joint(name, PairKind::Revolute, parent, child).at(at).axis([0.0, 0.0, 1.0]);
    };
    hinge("base", FrameId::Ground, crank.into(), [0.0; 3]);
    hinge("knee", crank.into(), coupler.into(), [0.0, 1.0, 0.0]);
    hinge("elbow", coupler.into(), rocker.into(), [2.0, 1.0, 0.0]);
    hinge("foot", rocker.into(), FrameId::Ground, [2.0, 0.0, 0.0]);
    builder.build().unwrap()
}

/// Members with closed loops and springs between bodies move by integrators of their own, shared
/// among threads: with their bits, recorded as they are, one that fails is named.
#[test]
fn members_with_closed_loops_move_on_threads_of_their_own() {
    for threads in 1..=3 {
        let options = Options::new(SchemeKind::Nodal, 0.01);
        let fast = |k: u32| if k == 4 { 2000.0 } else { 1.0 };
        let models: Vec<BuiltMechanism> = (0..7).map(|k| linkage(k, fast(k))).collect();
        let (ensemble, rows) = together(&models, options, (threads, &[10, 15]), |_| true);
        assert_eq!(ensemble.in_lanes(), 0);
        for (k, (model, rows)) in models.into_iter().zip(rows).enumerate() {
            let (rows, own) = (rows.unwrap(), alone(model, options, 25));
            assert_eq!((rows.len(), own.len() == 25), (own.len(), k != 4), "member {k}");
            for (row, own) in rows.iter().zip(&own) {
                assert_eq!(row.bits(), own.bits(), "member {k}, step {}", own.after.step);
            }
        }
        let named: Vec<String> = ensemble.failed().map(|failure| failure.to_string()).collect();
        println!("{threads} threads: {named:?}");
        assert!(
            named.len() == 1 && named[0].starts_with("member 4, step 0, t = 0 s: "),
            "{named:?}"
        );
        assert!(named[0].contains("(body `"), "{named:?}");
        assert_eq!(ensemble.member(4).state().step, 0);
    }
}

/// Numbers of outputs.
#[test]
#[should_panic(expected = "3 outputs for 2 members")]
fn more_outputs_than_members_are_refused() {
    let models = vec![tree(2, false, 0); 2];
    let mut ensemble = Ensemble::new(models, Options::new(SchemeKind::Nodal, 0.01)).unwrap();
    ensemble.record(1, &mut [const { None::<()> }; 3], |(), _| {});
}
