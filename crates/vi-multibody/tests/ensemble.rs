//! Members of an ensemble against their own integrators: trees of all pairs, other initial values,
//! other parameters.

use crate::loaded_trees::{tree, varied_tree};
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_core::Composition;
use vi_core::linear::norm_inf;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::ensemble::Ensemble;
use vi_multibody::pair::screw::Pitch;
use vi_multibody::run::MechanismIntegrator;
use vi_multibody::{BuiltMechanism, FrameId, PairKind};

fn options() -> Options {
    Options::new(SchemeKind::Nodal, 0.004)
}

/// The state of a member, one number after the other.
fn numbers(run: &MechanismIntegrator) -> Vec<f64> {
    let state = run.state();
    [&state.q[..], &state.p, &state.compensation.balance, &[state.t]].concat()
}

/// By how much `q` and `p` of two motions differ, relative to their size.
fn apart(a: &MechanismIntegrator, b: &MechanismIntegrator) -> f64 {
    let (a, b) = (a.state(), b.state());
    assert_eq!((a.step, a.t.to_bits()), (b.step, b.t.to_bits()));
    let off = |a: &[f64], b: &[f64]| {
        let off: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
        norm_inf(&off) / norm_inf(b)
    };
    let worst = [off(&a.q, &b.q), off(&a.p, &b.p)];
    if worst[0] > worst[1] { worst[0] } else { worst[1] }
}

/// The bits of a state.
fn bits(run: &MechanismIntegrator) -> (u64, Vec<u64>) {
    let state = run.state();
    let all = [&numbers(run)[..], &state.compensation.q, &state.angles].concat();
    (state.step, all.into_iter().map(f64::to_bits).collect())
}

/// Members of one topology with other masses, distances and rates.
fn members(seed: u64, count: u32) -> Vec<BuiltMechanism> {
    (0..count).map(|k| varied_tree(9, false, seed, 0.03 * f64::from(k))).collect()
}

#[test]
fn members_move_as_their_own_integrators_do() {
    let mut alone_steps = 0;
    for seed in 0..24 {
        let models = members(seed, 11);
        let mut alone: Vec<MechanismIntegrator> =
            models.iter().map(|model| model.clone().integrator(options()).unwrap()).collect();
        let mut ensemble = Ensemble::new(models, options()).unwrap();
        assert_eq!(ensemble.in_lanes(), 11);
        ensemble.advance(50);
        alone_steps += ensemble.steps_alone();
        for (k, run) in alone.iter_mut().enumerate() {
            let failed = (0..50).find_map(|_| run.step().err());
            let failure = ensemble.failures().nth(k).unwrap();
            assert_eq!(failure.is_some(), failed.is_some(), "seed {seed}, member {k}: {failure:?}");
            if failed.is_none() {
                assert_eq!(bits(ensemble.member(k)), bits(run), "seed {seed}, member {k}");
            }
        }
    }
    println!("{alone_steps} of 13200 steps alone");
    assert!(alone_steps < 800, "{alone_steps}");
}

#[test]
fn one_model_starts_from_many_initial_values() {
    let model = tree(6, false, 4);
    let q = model.mechanism.initial_configuration();
    let v = model.mechanism.initial_velocity();
    let velocities: Vec<Vec<f64>> =
        (0..5).map(|k| v.iter().map(|v| v * (1.0 + 0.1 * f64::from(k))).collect()).collect();
    let starts: Vec<InitialValues<'_>> =
        velocities.iter().map(|v| InitialValues::new(0.5, &q, v)).collect();
    let mut ensemble = Ensemble::starting_at(&model, &starts, options()).unwrap();
    assert_eq!((ensemble.len(), ensemble.in_lanes(), ensemble.is_empty()), (5, 5, false));
    ensemble.advance(100);
    assert_eq!(ensemble.member(0).state().t.to_bits(), (0.5 + 100.0 * 0.004_f64).to_bits());
    let mut run = model.clone().integrator(options()).unwrap();
    (0..100).for_each(|_| {
        run.step().unwrap();
    });
    let (a, b) = (&ensemble.member(0).state().q, &run.state().q);
    assert_eq!(a, b);
}

#[test]
fn a_member_does_not_depend_on_those_beside_it() {
    for seed in [1, 2, 5] {
        let models = members(seed, 8);
        let mut all = Ensemble::new(models.clone(), options()).unwrap();
        let mut one = Ensemble::new([models[3].clone()], options()).unwrap();
        all.advance(60);
        one.advance(60);
        assert_eq!(numbers(all.member(3)), numbers(one.member(0)), "seed {seed}");
    }
}

#[test]
fn steps_in_parts_are_the_same_steps() {
    let models = members(7, 4);
    let mut whole = Ensemble::new(models.clone(), options()).unwrap();
    let mut parts = Ensemble::new(models, options()).unwrap();
    whole.advance(40);
    [1, 12, 0, 27].into_iter().for_each(|steps| parts.advance(steps));
    for k in 0..4 {
        assert_eq!(numbers(whole.member(k)), numbers(parts.member(k)), "member {k}");
    }
}

#[test]
fn compositions_and_backward_steps() {
    let cases = [
        (Composition::Suzuki5, 0.01),
        (Composition::SofroniouSpaletta13, 0.04), // sub-steps from those before
        (Composition::Identity, -0.004),
    ];
    for (composition, step) in cases {
        let options = Options::new(SchemeKind::Nodal, step).composition(composition);
        let models = members(10, 6);
        let mut ensemble = Ensemble::new(models.clone(), options).unwrap();
        assert_eq!(ensemble.in_lanes(), 6);
        ensemble.advance(40);
        for (k, model) in models.into_iter().enumerate() {
            let mut run = model.integrator(options).unwrap();
            (0..40).for_each(|_| {
                run.step().unwrap();
            });
            assert_eq!(bits(ensemble.member(k)), bits(&run), "{composition:?}, member {k}");
        }
        let alone = ensemble.steps_alone();
        println!("{composition:?}: {alone} of 240 steps alone");
        assert!(alone < 60, "{alone}");
    }
}

/// A step that turns a body by more than half a revolution is refused; the others go on.
#[test]
fn a_member_that_fails_stays_and_the_others_go_on() {
    let model = tree(3, false, 1);
    let q = model.mechanism.initial_configuration();
    let v = model.mechanism.initial_velocity();
    let fast: Vec<f64> = v.iter().map(|v| 2000.0 * v).collect();
    let starts = [&v, &fast, &v].map(|v| InitialValues::new(0.0, &q, v));
    let mut ensemble = Ensemble::starting_at(&model, &starts, options()).unwrap();
    ensemble.advance(10);
    let failed: Vec<bool> = ensemble.failures().map(|failure| failure.is_some()).collect();
    assert_eq!(failed, [false, true, false]);
    assert!(ensemble.member(1).state().step < 10 && ensemble.member(2).state().step == 10);
    assert_eq!(numbers(ensemble.member(0)), numbers(ensemble.member(2)));
    let stands = numbers(ensemble.member(1));
    ensemble.advance(1);
    assert_eq!(numbers(ensemble.member(1)), stands);
    assert_eq!(ensemble.member(0).state().step, 11);
}

/// Two bodies with a spring between them.
fn coupled(k: u32) -> BuiltMechanism {
    let mut builder = MechanismBuilder::new();
    let mut body = |at| builder.body("body", Inertia::principal(1.0, [0.1, 0.2, 0.3])).at(at).id();
    let [a, b] = [[0.0; 3], [1.0, 0.0, 0.0]].map(&mut body);
    builder.spring(a.point([0.1, 0.0, 0.0]), b.point([0.0, 0.2, 0.0]), 5.0 + f64::from(k));
    builder.build().unwrap()
}

#[test]
fn other_systems_move_one_after_the_other() {
    let mut ensemble = Ensemble::new((0..3).map(coupled), options()).unwrap();
    assert_eq!(ensemble.in_lanes(), 0);
    ensemble.advance(5);
    for k in 0..3 {
        let mut run = coupled(k).integrator(options()).unwrap();
        (0..5).for_each(|_| {
            run.step().unwrap();
        });
        assert_eq!(numbers(ensemble.member(k as usize)), numbers(&run), "member {k}");
    }
    let different = [tree(4, false, 0), tree(5, false, 0)];
    assert_eq!(Ensemble::new(different, options()).unwrap().in_lanes(), 0);
}

/// A chain on hinges that flies: many steps keep both momenta to rounding and the energy within
/// bounds.
#[test]
fn momenta_and_energy_of_members_over_many_steps() {
    let chain = |k: u32| {
        let mut builder = MechanismBuilder::new();
        let bar = Inertia::principal(1.0, [0.02, 0.1, 0.1]);
        let mut parent = None;
        for i in 0..4 {
            let x = [f64::from(i) + 0.5, 0.0, 0.0];
            let link = builder.body(&format!("b{i}"), bar).at(x);
            let spin = [0.3, 0.1 * f64::from(k), 1.0 - 0.4 * f64::from(i)];
            let link = if parent.is_none() { link.angular_velocity(spin) } else { link }.id();
            if let Some(parent) = parent {
                let axis = if i % 2 == 0 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] };
                let joint = builder.joint("hinge", PairKind::Revolute, parent, link);
                joint.at([f64::from(i), 0.0, 0.0]).axis(axis).rate(0.5 - 0.2 * f64::from(k));
            }
            parent = Some(FrameId::from(link));
        }
        builder.build().unwrap()
    };
    let options = Options::new(SchemeKind::Nodal, 0.01);
    let mut ensemble = Ensemble::new((0..6).map(chain), options).unwrap();
    let read = |run: &MechanismIntegrator, energy: f64| {
        let state = run.state();
        let momentum = run.constraints().momentum(&state.q, &state.p);
        let (p, l) = (momentum.linear, momentum.angular);
        [p[0], p[1], p[2], l[0], l[1], l[2], energy]
    };
    let read_alone = |run: &mut MechanismIntegrator| {
        let energy = run.observe_state().unwrap().hamiltonian_projected.total();
        read(run, energy)
    };
    let mut alone: Vec<MechanismIntegrator> =
        (0..6).map(|k| chain(k).integrator(options).unwrap()).collect();
    let start: Vec<[f64; 7]> = alone.iter_mut().map(read_alone).collect();
    let changes = |now: [f64; 7], start: &[f64; 7]| {
        let off: Vec<f64> = now.iter().zip(start).map(|(a, b)| a - b).collect();
        [norm_inf(&off[..6]) / norm_inf(&start[..6]), off[6].abs() / start[6]]
    };
    let mut worst = [[0.0_f64; 2]; 2]; // momenta and energy, together and alone
    for _ in 0..40 {
        ensemble.advance(500);
        assert!(ensemble.failures().all(|failure| failure.is_none()));
        for (k, run) in alone.iter_mut().enumerate() {
            (0..500).for_each(|_| {
                run.step().unwrap();
            });
            let energy = ensemble.observe_state(k).unwrap().hamiltonian_projected.total();
            let both = [read(ensemble.member(k), energy), read_alone(run)];
            for (worst, now) in worst.iter_mut().zip(both) {
                for (worst, change) in worst.iter_mut().zip(changes(now, &start[k])) {
                    *worst = if change <= *worst { *worst } else { change };
                }
            }
        }
    }
    let [together, single] = worst;
    println!("20000 steps, changes of momenta and energy: {together:?}, alone {single:?}");
    assert!(ensemble.failures().all(|failure| failure.is_none()));
    assert!(together[0] < 1e-13 && together[0] < 4.0 * single[0], "{worst:?}");
    assert!(together[1] < 1e-5, "{worst:?}");
    let members = ensemble.into_members();
    assert!(members.len() == 6 && members.iter().all(|run| run.state().step == 20_000));
}

/// A body on a screw, which turns many times, with another on a hinge; the pitch, and what acts, of
/// members of these numbers.
fn screwed(pitch: u32, acting: u32) -> BuiltMechanism {
    let gravity = [0.3 + 0.1 * f64::from(acting), 0.2, -9.0];
    let mut builder = MechanismBuilder::new().gravity(gravity);
    let pitch_of = Pitch::new(0.02 + 0.03 * f64::from(pitch));
    let inertia = || Inertia::principal(1.0, [0.3, 0.4, 0.5]);
    let nut = builder.body("nut", inertia()).at([0.2, 0.0, 0.1]).id();
    let screw = builder.joint("screw", PairKind::Screw(pitch_of), FrameId::Ground, nut);
    screw.at([0.0; 3]).axis([0.1, 0.0, 1.0]).rates(&[9.0 + f64::from(acting)]);
    let arm = builder.body("arm", inertia()).at([0.2, 0.5, 0.1]).id();
    let hinge = builder.joint("hinge", PairKind::Revolute, FrameId::from(nut), arm);
    hinge.at([0.2, 0.2, 0.1]).axis([1.0, 0.0, 0.0]).rates(&[-12.0]);
    builder.build().unwrap()
}

/// Members that are built as `built` says after 500 steps against integrators of the seven systems
/// that are meant: the largest difference of states and angles, with revolutions that `counted`
/// changes, and the least largest angle.
fn off(built: impl Fn(u32) -> BuiltMechanism, counted: impl Fn(f64) -> f64) -> [f64; 2] {
    let models: Vec<BuiltMechanism> = (0..7).map(built).collect();
    let mut ensemble = Ensemble::new(models, options()).unwrap();
    assert_eq!(ensemble.in_lanes(), 7);
    ensemble.advance(500);
    assert!(ensemble.failures().all(|failure| failure.is_none()));
    let (mut worst, mut turned) = (0.0_f64, f64::INFINITY);
    for k in 0..7 {
        let mut run = screwed(k, k).integrator(options()).unwrap();
        (0..500).for_each(|_| {
            run.step().unwrap();
        });
        let (own, alone) = (ensemble.member(k as usize).state(), run.state());
        worst = worst.max(apart(ensemble.member(k as usize), &run));
        let off: Vec<f64> =
            own.angles.iter().zip(&alone.angles).map(|(a, b)| counted(*a) - b).collect();
        assert_eq!(own.angles.len(), alone.angles.len());
        worst = worst.max(norm_inf(&off));
        turned = turned.min(norm_inf(&alone.angles));
    }
    [worst, turned]
}

/// Lengths, revolutions and all of the state are those of an integrator of its own.
#[test]
fn members_have_the_pitch_and_the_revolutions_of_their_own() {
    let [worst, turned] = off(|k| screwed(k, k), |angle| angle);
    println!("largest difference {worst:.1e}, least largest angle {turned:.1} rad");
    assert!(worst <= 0.0 && turned > std::f64::consts::TAU, "{worst:e}, {turned}");
}

/// What acts on the next member, the pitch of the first one, revolutions that are not counted.
#[test]
fn members_that_are_wired_to_others_are_seen() {
    let tau = std::f64::consts::TAU;
    let defects = [
        ("what acts on the next member", off(|k| screwed(k, (k + 1) % 7), |angle| angle)),
        ("the pitch of the first member", off(|k| screwed(0, k), |angle| angle)),
        ("no revolutions", off(|k| screwed(k, k), |angle| angle.rem_euclid(tau))),
    ];
    for (defect, [worst, _]) in defects {
        println!("{defect}: off by {worst:.1e}");
        assert!(worst > 1e-3, "{defect}: {worst:e}");
    }
}
