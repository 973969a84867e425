//! Springs, dampers, motors and controls on joint coordinates: each acts on one unknown of a step,
//! on random trees of all pairs whose joints are described from either side.

#![allow(non_snake_case)] // P

use nalgebra::DMatrix;
use std::num::NonZeroUsize;
use std::sync::Arc;
use vi_constraints::{InitialValues, Options, Reparametrization, SchemeKind};
use vi_core::Quadrature;
use vi_core::composition::Composition;
use vi_core::linear::norm_inf;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::ensemble::Ensemble;
use vi_multibody::held_effort::HeldEffort;
use vi_multibody::joint_force::{EffortSlopes, JointLaw, PdControl, Setpoint, Viscous};
use vi_multibody::run::{MechanismIntegrator, Solver, integrator};
use vi_multibody::tree_map::TreeMap;
use vi_multibody::tree_step::TreeStep;
use vi_multibody::{BuiltMechanism, FrameId, PairKind};
use vi_testkit::Sample;

/// `τ = −4 sin θ − 0.3 θ̇³`.
struct Nonlinear;

impl JointLaw for Nonlinear {
    fn effort(&self, _t: f64, coordinate: f64, rate: f64) -> f64 {
        -4.0 * coordinate.sin() - 0.3 * rate.powi(3)
    }
    fn slopes(&self, _t: f64, coordinate: f64, rate: f64) -> EffortSlopes {
        EffortSlopes { by_coordinate: -4.0 * coordinate.cos(), by_rate: -0.9 * rate * rate }
    }
    fn is_dissipative(&self) -> bool {
        true
    }
}

/// Bodies on joints that may name the outer body first; on each coordinate some of all force
/// elements.
fn tree(bodies: usize, seed: u64) -> MechanismBuilder {
    tree_with(bodies, seed, (0b1111, 0.0))
}

/// The same with some of the `kinds` of elements, a bit each, stronger `by` some parts.
fn tree_with(bodies: usize, seed: u64, (kinds, by): (usize, f64)) -> MechanismBuilder {
    let mut random = Sample::new(seed);
    let mut builder = MechanismBuilder::new().gravity([0.3, -1.0, -9.0]);
    let mut frames = vec![FrameId::Ground];
    for k in 0..bodies {
        let inertia = Inertia::principal(2.0 + random.number(), [1.0, 1.2, 1.5]);
        let body = builder.body(&format!("body {k}"), inertia).at(2.0 * random.vector());
        let body = body.rotation_vector(random.vector()).id();
        let kind = PairKind::ALL[random.index(PairKind::ALL.len() - 1)];
        let parent = frames[random.index(k + 1).max(random.index(k + 1))];
        let mut sides = [parent, body.into()];
        if kind != PairKind::Free && random.index(2) == 0 {
            sides.reverse();
        }
        let joint = builder.joint(&format!("joint {k}"), kind, sides[0], sides[1]);
        let joint = joint.at(random.vector());
        let joint = if kind.has_axis() { joint.axis(random.vector()) } else { joint };
        let joint = joint.id();
        for freedom in 0..kind.coordinate_count() {
            let at = joint.coordinate(freedom);
            let chosen = kinds & (random.index(15) + 1);
            if chosen & 1 > 0 {
                builder.joint_spring(at, 5.0 + by, 0.2);
            }
            if chosen & 2 > 0 {
                builder.joint_force(at, Viscous(0.7 + by));
            }
            if chosen & 4 > 0 {
                let reference =
                    Arc::new(move |t: f64| Setpoint { value: (0.5 + by) * t, rate: 0.5 + by });
                let law = PdControl { proportional: 30.0, derivative: 2.0, reference };
                builder.joint_force(at, law);
            }
            if chosen & 8 > 0 {
                builder.joint_force(at, Nonlinear);
            }
        }
        frames.push(body.into());
    }
    builder
}

/// Positions and momenta after twenty steps.
fn end(built: &BuiltMechanism, kind: SchemeKind, solver: Solver) -> Vec<f64> {
    let (q, v) = (built.mechanism.initial_configuration(), built.mechanism.initial_velocity());
    let system = built.system(Quadrature::Midpoint);
    let (options, at) = (Options::new(kind, 0.01), InitialValues::new(0.0, &q, &v));
    let mut run = integrator(built.mechanism.clone(), system, options, solver, at).unwrap();
    (0..20).for_each(|_| _ = run.step().unwrap());
    [&run.state().q[..], &run.state().p].concat()
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    let off: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    norm_inf(&off) / norm_inf(b)
}

#[test]
fn a_coordinate_of_the_tree_is_an_unknown_up_to_its_sign() {
    let (mut found, mut worst, mut of_child) = ([0, 0], 0.0_f64, 0);
    for seed in 0..60 {
        let builder = tree(1 + seed as usize % 7, 500 + seed);
        let joints = builder.description().unwrap().joints;
        let mut mechanism = builder.build().unwrap().mechanism;
        let (q, map) = (mechanism.initial_configuration(), TreeMap::new(&mechanism));
        let mut P = DMatrix::zeros(mechanism.description().bodies.len() * 12, map.dof());
        map.null_space(&q, &mut P);
        for (k, joint) in joints.iter().enumerate() {
            for freedom in 0..joint.kind.coordinate_count() {
                let coordinate = mechanism.coordinate(k, freedom).unwrap();
                let mut gradient = vec![0.0; q.len()];
                coordinate.add_gradient(&q, 1.0, &mut gradient);
                let mut pulled = vec![0.0; map.dof()];
                map.pull_back(&q, &gradient, &mut pulled);
                let Some(unknown) = coordinate.unknown() else {
                    assert!(joint.kind == PairKind::Planar && freedom < 2, "{joint:?} {freedom}");
                    of_child += 1;
                    continue;
                };
                pulled[unknown.index] -= unknown.sign;
                worst = worst.max(norm_inf(&pulled));
                found[usize::from(unknown.sign < 0.0)] += 1;
            }
        }
    }
    println!("{found:?} coordinates with both signs, {of_child} without, Pᵀ∇θ − σ e_j {worst:.1e}");
    assert!(found[0] > 50 && found[1] > 50 && of_child > 0);
    assert!(worst < 1e-13, "{worst:e}");
}

#[test]
fn steps_with_joint_efforts_are_those_of_dense_matrices() {
    let (mut worst, mut swept) = (0.0_f64, 0);
    for seed in 0..60 {
        let built = tree(1 + seed as usize % 7, 500 + seed).build().unwrap();
        let system = built.system(Quadrature::Midpoint);
        swept += usize::from(TreeStep::new(&built.mechanism, &system).is_some());
        for kind in [SchemeKind::Nodal, SchemeKind::Reduced] {
            let dense = end(&built, kind, Solver::Dense);
            let off = apart(&end(&built, kind, Solver::Auto), &dense);
            assert!(off < 1e-10, "tree {seed}, {kind:?}: off by {off:e}");
            worst = worst.max(off);
        }
    }
    println!("{swept} of 60 by sweeps, states off by {worst:.1e}");
    assert!(swept > 40, "{swept}");
}

/// A four-bar linkage, hinges or universal joints in the tree, with a motor, a spring and a damper
/// on joints of the tree.
fn linkage(kind: PairKind) -> BuiltMechanism {
    let mut builder = MechanismBuilder::new().gravity([0.0, -9.81, 0.0]);
    let mut bar = |name: &str, at: [f64; 3]| {
        builder.body(name, Inertia::principal(1.0, [0.1, 0.05, 0.1])).at(at).id()
    };
    let [crank, rod, rocker] = [
        bar("crank", [0.0, 0.5, 0.0]),
        bar("rod", [1.0, 1.0, 0.0]),
        bar("rocker", [2.0, 0.5, 0.0]),
    ];
    let mut joint = |name: &str, kind: PairKind, parent: FrameId, child: FrameId, at: [f64; 3]| {
        builder.joint(name, kind, parent, child).at(at).axis([0.0, 0.0, 1.0]).id()
    };
    let base = joint("base", PairKind::Revolute, FrameId::Ground, crank.into(), [0.0; 3]);
    let knee = joint("knee", kind, rod.into(), crank.into(), [0.0, 1.0, 0.0]);
    let foot = joint("foot", PairKind::Revolute, rocker.into(), FrameId::Ground, [2.0, 0.0, 0.0]);
    joint("end", PairKind::Spherical, rod.into(), rocker.into(), [2.0, 1.0, 0.0]);
    builder.motor(base.coordinate(0), |t| 3.0 * (5.0 * t).cos());
    builder.joint_spring(knee.coordinate(0), 8.0, 0.1);
    builder.joint_force(foot.coordinate(0), Viscous(0.4));
    builder.build().unwrap()
}

#[test]
fn closed_loops_with_joint_efforts_move_as_in_the_constrained_scheme() {
    for kind in [PairKind::Revolute, PairKind::Universal] {
        let built = linkage(kind);
        let of = |scheme| end(&built, scheme, Solver::Auto)[..36].to_vec(); // positions
        let constrained = of(SchemeKind::Constrained);
        for scheme in [SchemeKind::Nodal, SchemeKind::Reduced] {
            let off = apart(&of(scheme), &constrained);
            println!("{kind:?}, {scheme:?}: off by {off:.1e}");
            assert!(off < 1e-11, "{kind:?}, {scheme:?}: off by {off:e}");
        }
    }
}

/// Springs, dampers and motors of members in lanes, linear or not, have the bits of their own
/// integrators; so has every composition, and any number of threads.
#[test]
fn members_with_joint_efforts_move_as_their_own_integrators_do() {
    let bits = |run: &MechanismIntegrator| -> Vec<u64> {
        let state = run.state();
        let balance = &state.compensation.balance[..];
        let all = [&state.q[..], &state.p, &state.compensation.q, balance, &state.angles];
        all.concat().into_iter().map(f64::to_bits).collect()
    };
    let (mut lanes, mut alone, mut moved) = (0, 0, 0.0_f64);
    for seed in 0..24 {
        let (composition, kinds) =
            [(Composition::Identity, 0b1111), (Composition::Suzuki5, 0b0001)][seed as usize % 2];
        let options = Options::new(SchemeKind::Nodal, 0.01).composition(composition);
        let acting = |k: u32| (kinds, 0.1 * f64::from(k));
        let model = |k: u32| tree_with(1 + seed as usize % 6, 900 + seed, acting(k));
        let models: Vec<BuiltMechanism> = (0..9).map(|k| model(k).build().unwrap()).collect();
        let mut ensemble = Ensemble::new(models.clone(), options).unwrap();
        lanes += ensemble.in_lanes();
        ensemble.advance(20);
        ensemble.advance_on(NonZeroUsize::new(3).unwrap(), 20);
        alone += ensemble.steps_alone();
        let mut ends = Vec::new();
        for (k, model) in models.into_iter().enumerate() {
            let mut run = model.integrator(options).unwrap();
            (0..40).for_each(|_| _ = run.step().unwrap());
            assert_eq!(bits(ensemble.member(k)), bits(&run), "seed {seed}, member {k}");
            ends.push(run.state().q.clone());
        }
        moved = moved.max(apart(&ends[0], &ends[8]));
    }
    println!("{lanes} of 216 members in lanes, {alone} steps alone, members {moved:.1e} apart");
    assert!(lanes > 150 && alone < 600 && moved > 1e-3, "{lanes}, {alone}, {moved:e}");
}

/// Efforts that are set before each step, other ones for each member: a wheel turns as
/// `I ω̇ = τ_n` demands, exactly, and members have the bits of their own integrators.
#[test]
fn efforts_from_outside_are_held_during_a_step() {
    let wheel = |motor: &HeldEffort| {
        let mut builder = MechanismBuilder::new();
        let wheel = builder.body("wheel", Inertia::principal(1.0, [0.1, 0.1, 0.2])).id();
        let axle = builder.joint("axle", PairKind::Revolute, FrameId::Ground, wheel);
        let angle = axle.at([0.0; 3]).axis([0.0, 0.0, 1.0]).id().coordinate(0);
        builder.joint_force(angle, motor.clone());
        builder.build().unwrap()
    };
    let options = Options::new(SchemeKind::Nodal, 0.01);
    let motors: [HeldEffort; 5] = std::array::from_fn(|_| HeldEffort::default());
    let own: [HeldEffort; 5] = std::array::from_fn(|_| HeldEffort::default());
    let mut ensemble = Ensemble::new(motors.iter().map(wheel), options).unwrap();
    let mut alone: Vec<MechanismIntegrator> =
        own.iter().map(|motor| wheel(motor).integrator(options).unwrap()).collect();
    assert_eq!(ensemble.in_lanes(), 5);
    let (mut impulse, mut random) = ([0.0; 5], Sample::new(3));
    for _ in 0..200 {
        for k in 0..5 {
            let effort = 0.5 * random.number();
            impulse[k] += 0.01 * effort;
            motors[k].set(effort);
            own[k].set(effort);
        }
        ensemble.advance(1);
        alone.iter_mut().for_each(|run| _ = run.step().unwrap());
    }
    let mut worst = 0.0_f64;
    for (k, run) in alone.iter_mut().enumerate() {
        let (member, state) = (ensemble.member(k).state(), run.state());
        assert_eq!(member.q, state.q, "member {k}");
        assert_eq!(member.p, state.p, "member {k}");
        let momentum = run.constraints().momentum(&state.q, &state.p).angular[2];
        worst = worst.max((momentum - impulse[k]).abs());
    }
    let off = (impulse[0] - impulse[1]).abs();
    println!("angular momentum and impulse of the motor {worst:.1e} apart, members {off:.1e}");
    assert!(worst < 1e-14 && off > 1e-3, "{worst:e}, {off:e}");
}
