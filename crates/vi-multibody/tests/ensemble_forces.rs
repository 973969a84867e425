//! Members with springs, dampers and loads on their bodies against their own integrators.

use crate::loaded_trees::{Part, tree_with};
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_core::Composition;
use vi_core::linear::norm_inf;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::ensemble::Ensemble;
use vi_multibody::run::MechanismIntegrator;
use vi_multibody::{BuiltMechanism, PairKind};
use vi_rigid::TimeHistory;

/// The bits of a state.
fn bits(run: &MechanismIntegrator) -> (u64, Vec<u64>) {
    let state = run.state();
    let (rounding, balance) = (&state.compensation.q, &state.compensation.balance);
    let all = [&state.q, &state.p, rounding, balance, &state.angles];
    let bits = all.into_iter().flatten().chain([&state.t]).map(|x| x.to_bits());
    (state.step, bits.collect())
}

/// What acts on the bodies of a member: springs to the ground, loads that vary in time, dampers
/// where there `damped`; `by`: how much stronger than on the first one, none where it is negative.
fn act(builder: &mut MechanismBuilder, (k, part): (usize, Part), by: f64, damped: bool) {
    if by < 0.0 {
        return;
    }
    let (body, x) = (part.body, 0.1 * k as f64);
    let spring = builder.spring([1.0, 0.5 + x, -0.2], body.point([0.1, 0.2, 0.3]), 20.0 + by);
    spring.natural_length(0.4);
    let harmonic =
        TimeHistory::Harmonic { frequency: 2.0, phase: x, amplitude: 1.0 + by, offset: 0.3 };
    let load = builder.load(body).force([3.0, -2.0, 0.5]).torque([0.2, 0.1, -0.3]);
    load.follower().history(harmonic);
    let ramp = TimeHistory::Ramp { start: 0.02, end: 0.1, amplitude: 1.0 + by };
    builder.load(body).force([0.0, 4.0, 1.0]).point([0.3, 0.0, 0.1]).history(ramp);
    if part.kind == PairKind::Revolute {
        builder.motor(part.joint.coordinate(0), move |t| (2.0 + by) * t);
        builder.joint_spring(part.joint.coordinate(0), 3.0 + by, 0.1);
    }
    if damped {
        builder.damper([0.0, 1.0, 0.0], body.point([0.1, 0.0, 0.0]), 0.5 + by);
    }
}

fn model(seed: u64, by: f64, damped: bool) -> BuiltMechanism {
    let other = 0.05 * by.abs();
    tree_with(1 + seed as usize % 7, seed, other, |builder, k, part| {
        act(builder, (k, part), by, damped);
    })
}

/// Compositions of all orders and backward steps; in some trees nothing acts on every third member.
#[test]
fn members_with_forces_on_bodies_move_as_their_own_integrators_do() {
    let cases = [
        (Composition::Identity, 0.004),
        (Composition::Suzuki5, 0.01),
        (Composition::Identity, -0.004),
        (Composition::KahanLi9, 0.02),
        (Composition::SofroniouSpaletta21, 0.03),
    ];
    let (mut alone, mut taken, mut moved) = (0, 0, 0.0_f64);
    for seed in 0..25 {
        let (composition, step) = cases[seed as usize % cases.len()];
        let options = Options::new(SchemeKind::Nodal, step).composition(composition);
        let damped = composition == Composition::Identity && step > 0.0;
        let by = |k: usize| if seed % 2 == 1 && k % 3 == 2 { -1.0 } else { 0.2 * k as f64 };
        let models: Vec<BuiltMechanism> = (0..11).map(|k| model(seed, by(k), damped)).collect();
        let mut ensemble = Ensemble::new(models.clone(), options).unwrap();
        assert_eq!(ensemble.in_lanes(), 11, "seed {seed}");
        ensemble.advance(17);
        ensemble.advance_on(3.try_into().unwrap(), 23);
        (alone, taken) = (alone + ensemble.steps_alone(), taken + 11 * 40);
        let mut ends = Vec::new();
        for (k, model) in models.into_iter().enumerate() {
            let mut run = model.integrator(options).unwrap();
            let failed = (0..40).find_map(|_| run.step().err());
            let failure = ensemble.failures().nth(k).unwrap();
            assert_eq!(failure, failed.as_ref(), "seed {seed}, member {k}");
            assert_eq!(bits(ensemble.member(k)), bits(&run), "seed {seed}, member {k}");
            ends.push(run.state().q.clone());
        }
        let off: Vec<f64> = ends[0].iter().zip(&ends[10]).map(|(a, b)| a - b).collect();
        moved = moved.max(norm_inf(&off));
    }
    println!("{alone} of {taken} steps alone, members {moved:.1e} apart");
    assert!(10 * alone < taken && moved > 1e-2, "{alone} of {taken}, {moved:e}");
}

/// Far from the origin positions are rounded more, and increments are not resolved any further: the
/// floors of each member are its own.
#[test]
fn members_with_forces_far_away_have_floors_of_their_own() {
    let at = |distance: f64, stiffness: f64| {
        let mut builder = MechanismBuilder::new();
        let inertia = Inertia::principal(1.0, [0.1, 0.2, 0.3]);
        let body = builder.body("body", inertia).at([distance, 0.0, 0.0]);
        let body = body.velocity([1.0, 0.2, 0.0]).angular_velocity([0.3, 2.0, 0.1]).id();
        let spring = builder.spring([distance, 1.0, 0.0], body.point([0.1, 0.2, 0.3]), stiffness);
        spring.natural_length(0.5);
        builder.build().unwrap()
    };
    let distances = [1e6, 0.0, 1e3, 1e8, 1e5, 1e4, 1e7, 10.0];
    let mut alone = 0;
    for (step, stiffness) in [(0.01, 50.0), (0.05, 50.0), (0.01, 2000.0), (0.05, 500.0)] {
        let options = Options::new(SchemeKind::Nodal, step);
        let members = distances.map(|distance| at(distance, stiffness));
        let mut ensemble = Ensemble::new(members, options).unwrap();
        assert_eq!(ensemble.in_lanes(), 8);
        ensemble.advance(200);
        alone += ensemble.steps_alone();
        for (k, distance) in distances.into_iter().enumerate() {
            let mut run = at(distance, stiffness).integrator(options).unwrap();
            let failed = (0..200).find_map(|_| run.step().err());
            assert_eq!(ensemble.failures().nth(k).unwrap(), failed.as_ref(), "at {distance} m");
            assert_eq!(bits(ensemble.member(k)), bits(&run), "at {distance} m, step {step} s");
        }
    }
    println!("{alone} of 6400 steps alone");
}

/// A blow of some members turns a body too far in a step: it is refused where their own integrators
/// refuse it, with the same words, and the others go on.
#[test]
fn a_member_that_fails_under_a_load_stays_and_is_named() {
    let blow = |strength: f64| {
        tree_with(3, 3, 0.0, |builder, k, part| {
            act(builder, (k, part), 0.1 * strength, false);
            let pulse = TimeHistory::Pulse { start: 0.1, end: 0.2, amplitude: strength };
            builder.load(part.body).torque([1e7, 3e7, -1e7]).history(pulse);
        })
    };
    for composition in [Composition::Identity, Composition::Suzuki5] {
        let options = Options::new(SchemeKind::Nodal, 0.004).composition(composition);
        let strengths = [0.0, 1.0, 0.0, 0.0, 2.0, 0.0];
        let mut ensemble = Ensemble::new(strengths.map(blow), options).unwrap();
        assert_eq!(ensemble.in_lanes(), 6);
        ensemble.advance(60);
        let named: Vec<String> = ensemble.failed().map(|failure| failure.to_string()).collect();
        println!("{named:#?}");
        let failed: Vec<usize> = ensemble.failed().map(|failure| failure.member).collect();
        assert_eq!(failed, [1, 4]);
        for (k, strength) in strengths.into_iter().enumerate() {
            let mut run = blow(strength).integrator(options).unwrap();
            let failure = (0..60).find_map(|_| run.step().err());
            assert_eq!(ensemble.failures().nth(k).unwrap(), failure.as_ref(), "member {k}");
            assert_eq!(bits(ensemble.member(k)), bits(&run), "member {k}");
            if let Some(error) = failure {
                let (step, t) = (run.state().step, run.state().t);
                let start = format!("member {k}, step {step}, t = {t} s: {error}");
                let named = named.iter().find(|named| named.starts_with(&start));
                let named = named.unwrap_or_else(|| panic!("{start}"));
                assert!(step > 20 && named.contains("(body `body "), "{named}");
            }
        }
        let stands = bits(ensemble.member(1));
        ensemble.advance(1);
        assert_eq!(bits(ensemble.member(1)), stands);
        assert_eq!(ensemble.member(0).state().step, 61);
    }
}

/// In the middle of a composition a load sets in that some lanes do not follow from extrapolated
/// increments: the macro step starts again with what was known, and has the bits of their own
/// integrators.
#[test]
fn an_event_within_a_composition_is_taken_with_what_was_known() {
    let struck = |strength: f64| {
        tree_with(3, 3, 0.0, |builder, k, part| {
            act(builder, (k, part), 0.1 * strength, false);
            let pulse = TimeHistory::Pulse { start: 0.307, end: 0.311, amplitude: strength };
            builder.load(part.body).torque([5e3, 7e3, -6e3]).history(pulse);
        })
    };
    let options = Options::new(SchemeKind::Nodal, 0.02).composition(Composition::KahanLi9);
    let strengths = [0.0, 1.0, 1.5, 0.0, 2.0, 0.5, 3.0];
    let mut ensemble = Ensemble::new(strengths.map(struck), options).unwrap();
    ensemble.advance(40);
    let alone = ensemble.steps_alone();
    let mut restarts = 0;
    for (k, strength) in strengths.into_iter().enumerate() {
        let mut run = struck(strength).integrator(options).unwrap();
        let failure = (0..40).find_map(|_| match run.step() {
            Ok(report) => {
                restarts += usize::from(report.restarts > 0);
                None
            }
            Err(error) => Some(error),
        });
        assert_eq!(ensemble.failures().nth(k).unwrap(), failure.as_ref(), "member {k}");
        assert_eq!(bits(ensemble.member(k)), bits(&run), "member {k}");
    }
    println!("{alone} steps alone, {restarts} with another initial guess");
    assert!(alone > 7 && restarts > 0, "{alone}, {restarts}");
}

/// Each member feels its own forces, at its own time.
#[test]
fn forces_of_another_member_or_of_another_time_are_seen() {
    let options = Options::new(SchemeKind::Nodal, 0.004);
    let model = |k: usize| model(5, 0.2 * k as f64, true);
    let start = (model(0).mechanism.initial_configuration(), model(0).mechanism.initial_velocity());
    let run = |models: &[BuiltMechanism], times: &[f64]| {
        let starts = times.iter().map(|&t| InitialValues::new(t, &start.0, &start.1));
        // one model, many times: or many models from zero
        let mut ensemble = match models {
            [one] => Ensemble::starting_at(one, &starts.collect::<Vec<_>>(), options).unwrap(),
            all => Ensemble::new(all.to_vec(), options).unwrap(),
        };
        assert_eq!(ensemble.in_lanes(), 7);
        ensemble.advance(50);
        (0..7).map(|k| ensemble.member(k).state().q.clone()).collect::<Vec<_>>()
    };
    let off = |a: &[Vec<f64>], b: &[Vec<f64>]| {
        let off = |(a, b): (&Vec<f64>, &Vec<f64>)| {
            norm_inf(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())
        };
        a.iter().zip(b).map(off).fold(f64::INFINITY, f64::min)
    };
    let own = run(&(0..7).map(model).collect::<Vec<_>>(), &[]);
    let next = run(&(0..7).map(|k| model((k + 1) % 7)).collect::<Vec<_>>(), &[]);
    let times: Vec<f64> = (0..7).map(|k| 0.07 * f64::from(k)).collect();
    let later: Vec<f64> = times.iter().map(|t| t + 0.002).collect(); // half a step
    let (at, after) = (run(&[model(1)], &times), run(&[model(1)], &later));
    for (k, t) in times.iter().enumerate() {
        let (q, v) = (&start.0, &start.1);
        let at_time = InitialValues::new(*t, q, v);
        let built = model(1);
        let system = built.system(vi_core::Quadrature::Midpoint);
        let solver = vi_multibody::run::Solver::Auto;
        let mut run =
            vi_multibody::run::integrator(built.mechanism, system, options, solver, at_time)
                .unwrap();
        (0..50).for_each(|_| _ = run.step().unwrap());
        assert_eq!(run.state().q, at[k], "from t = {t} s");
    }
    let [wired, shifted] = [off(&own, &next), off(&at, &after)];
    println!("forces of the next member: off by {wired:.1e}; half a step later: {shifted:.1e}");
    assert!(wired > 1e-4 && shifted > 1e-7, "{wired:e}, {shifted:e}");
}
