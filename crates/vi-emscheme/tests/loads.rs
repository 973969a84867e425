//! Momentum and energy balances under loads and dampers.
#![allow(clippy::unwrap_used)] // helpers of tests

use crate::common;

use common::distance;
use nalgebra::{DMatrix, Vector3};
use std::sync::Arc;
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_core::force::{LinearDamping, Source};
use vi_core::{MechanicalSystem, Quadrature};
use vi_emscheme::load::AtMidpoint;
use vi_emscheme::{EmForm, EmIntegrator, EmOptions, EmSystem};
use vi_multibody::PairKind;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::law::{ByParameters, Change, Law, Sampler, Seed};
use vi_multibody::run::Solver;
use vi_multibody::spring::Damper;
use vi_rigid::TimeHistory;
use vi_rigid::load::{Load, LoadKind};

#[test]
fn a_wrench_changes_the_momenta_by_exactly_its_impulse() {
    let point = Vector3::new(0.2, -0.1, 0.3);
    for (kind, point) in [
        (LoadKind::Dead, Vector3::zeros()),
        (LoadKind::Follower, Vector3::zeros()),
        (LoadKind::Dead, point),
        (LoadKind::Follower, point),
    ] {
        for form in EmForm::ALL {
            let model = common::pair(PairKind::Cylindrical, false);
            let history =
                TimeHistory::Harmonic { frequency: 3.0, phase: 0.4, amplitude: 2.0, offset: 0.5 };
            let (force, torque) = (Vector3::new(3.0, -1.0, 2.0), Vector3::new(-0.5, 1.5, 0.7));
            let load = Load::new(12, kind, force, torque, history).unwrap().at(point).unwrap();
            let system = model.system().load(load.clone());
            let options = EmOptions::new(form, model.h);
            let mut run =
                vi_emscheme::run::integrator(system, model.mechanism.clone(), options).unwrap();
            let mass = run.system().mass().clone();
            let momentum = |run: &EmIntegrator<_>| {
                let mut p = vec![0.0; 24];
                mass.mul_add(1.0, &run.state().v, &mut p);
                model.mechanism.momentum(&run.state().q, &p)
            };
            let mut before = momentum(&run);
            let mut worst = [0.0_f64; 3];
            for _ in 0..200 {
                let energy = run.system().energy(run.state());
                run.step().unwrap();
                let after = momentum(&run);
                let s = run.interval();
                let vi_rigid::load::Wrench { force: f, torque: tau } =
                    load.wrench(s.t_mid(), &s.q_mid[12..]);
                let at = vi_rigid::directors::triad(&s.q_mid[12..]) * point;
                let arm = Vector3::new(s.q_mid[12], s.q_mid[13], s.q_mid[14]) + at;
                let moment = arm.cross(&f) + tau;
                for i in 0..3 {
                    let gain = after.linear[i] - before.linear[i];
                    worst[0] = worst[0].max((gain - s.h * f[i]).abs());
                    let gain = after.angular[i] - before.angular[i];
                    worst[1] = worst[1].max((gain - s.h * moment[i]).abs());
                }
                // work: force times displacement; the torque's through w×d̄_I
                let mut f_bar = vec![0.0; 24];
                vi_emscheme::load::MidpointLoad::add(&load, s, 1.0, &mut f_bar);
                let work: f64 = f_bar.iter().zip(&s.dq).map(|(f, dq)| f * dq).sum();
                worst[2] = worst[2].max((run.system().energy(run.state()) - energy - work).abs());
                before = after;
            }
            let [linear, angular, energy] = worst;
            let name = form.name();
            println!("{kind:?} {name}: impulse {linear:.1e} {angular:.1e}, work {energy:.1e}");
            assert!(linear < 2e-14 && angular < 5e-14 && energy < 2e-12, "{kind:?} {worst:?}");
        }
    }
}

#[test]
fn a_damper_takes_out_the_work_it_does_and_no_momentum() {
    let model = common::pair(PairKind::Planar, false);
    let damper = Damper { between: model.springs[0].between.clone(), damping: 3.0 };
    let options = EmOptions::new(EmForm::Nodal, model.h);
    let system = model.system().load(AtMidpoint(damper));
    let mut run = vi_emscheme::run::integrator(system, model.mechanism.clone(), options).unwrap();
    let mass = run.system().mass().clone();
    let momentum = |run: &EmIntegrator<_>| {
        let mut p = vec![0.0; 24];
        mass.mul_add(1.0, &run.state().v, &mut p);
        let momentum = model.mechanism.momentum(&run.state().q, &p);
        [momentum.linear, momentum.angular].concat()
    };
    let (start, first) = (momentum(&run), run.system().energy(run.state()));
    let mut last = first;
    for _ in 0..400 {
        run.step().unwrap();
        assert!(run.system().energy(run.state()) <= last + 1e-13, "a damper fed energy in");
        last = run.system().energy(run.state());
    }
    let off = distance(&start, &momentum(&run));
    println!("energy {first:.4} → {last:.4}, momenta off by {off:.1e}");
    assert!(last < 0.9 * first && off < 3e-13, "{first} {last} {off:e}");
}

#[test]
fn a_force_of_ones_own_does_the_same_work_in_both_families() {
    const DRAG: f64 = 0.4; // N·s/m
    let mut builder = MechanismBuilder::new();
    let body = builder.body("body", Inertia::principal(2.0, [0.3, 0.2, 0.1]));
    body.velocity([1.0, 2.0, -0.5]);
    let entries = (0..3).map(|i| (i, i, DRAG)).collect();
    builder.force(LinearDamping { entries }).named("drag");
    let built = builder.build().unwrap();
    let variational = built.system(Quadrature::Midpoint);
    let system = EmSystem::of_mechanism(&built.mechanism).force_elements(&built.forces);
    let drag = [Source::Element("drag".to_owned())];
    assert_eq!((variational.sources(), system.sources()), (&drag[..], &drag[..]));
    let (h, steps) = (0.01, 100);
    let at = (built.mechanism.initial_configuration(), built.mechanism.initial_velocity());
    let at = InitialValues::new(0.0, &at.0, &at.1);
    let (mut scratch, mut work) = ([0.0; 12], [[0.0; 1]; 2]);
    let mechanism = built.mechanism.clone();
    let options = Options::new(SchemeKind::Nodal, h);
    let mut run =
        vi_multibody::run::integrator(mechanism, variational, options, Solver::Auto, at).unwrap();
    for _ in 0..steps {
        run.step_with(&mut |of, _, step| of.add_work(step.s, &mut scratch, &mut work[0])).unwrap();
    }
    let options = EmOptions::new(EmForm::Nodal, h);
    let mut run = vi_emscheme::run::integrator(system, built.mechanism, options).unwrap();
    for _ in 0..steps {
        run.step_with(&mut |of, _, step| of.add_work(step.s, &mut scratch, &mut work[1])).unwrap();
    }
    // m v̇ = −c v:  ½ m v² (e^{−2ct/m} − 1)
    let exact = 0.5 * 2.0 * 5.25 * ((-2.0 * DRAG / 2.0 * h * f64::from(steps)).exp() - 1.0);
    let off = work.map(|work| work[0] - exact);
    println!("work {work:?} J, exactly {exact} J: off by {off:?}");
    assert!(off.iter().all(|off| off.abs() < 1e-5), "{off:?}");
}

#[test]
fn any_potential_keeps_the_energy_by_the_formula_of_gonzalez() {
    let model = common::pair(PairKind::Revolute, false);
    for form in EmForm::ALL {
        let system = EmSystem::of_mechanism(&model.mechanism);
        let system = model.springs.iter().cloned().fold(system, EmSystem::potential);
        let options = EmOptions::new(form, model.h);
        let mut run =
            vi_emscheme::run::integrator(system, model.mechanism.clone(), options).unwrap();
        let (energy, mut worst) = (run.system().energy(run.state()), 0.0_f64);
        for _ in 0..300 {
            run.step().unwrap();
            worst = worst.max((run.system().energy(run.state()) - energy).abs());
        }
        println!("{}: energy off by {worst:.1e}", form.name());
        assert!(worst < 1e-12, "{worst:e}");
    }
}

/// One held value that nothing changes.
struct Held;

impl Law for Held {
    fn efforts(&self) -> usize {
        0
    }
    fn evaluate(&self, _y: &[f64], _z: &[f64], _values: &mut [f64]) {}
    fn gradient(&self, _y: &[f64], _z: &[f64], _values: &mut [f64], _slopes: &mut DMatrix<f64>) {}
    fn is_dissipative(&self) -> bool {
        false
    }
}

impl Sampler for Held {
    fn count(&self) -> usize {
        1
    }
    fn start(&self) -> Arc<[f64]> {
        [1.0].into()
    }
    fn is_due(&self, _step: u64) -> bool {
        false
    }
    fn sample(&self, _step: u64, _y: &[f64], _internal: &mut [f64]) {}
    fn begin(&self, _y: &[f64], internal: &mut [f64]) {
        internal[0] = 1.0;
    }
    fn sample_changes(
        &self,
        _step: u64,
        _y: &[f64],
        _internal: &mut [f64],
        _by: &ByParameters<'_>,
    ) -> Vec<Change> {
        vec![Change::of(Seed::Internal(0))]
    }
    fn begin_changes(&self, _: &[f64], _: &mut [f64], _: &ByParameters<'_>) -> Vec<Change> {
        vec![Change::default()]
    }
}

/// No scheme of this family advances the states and held values of signals.
#[test]
fn signals_are_refused_by_their_name() {
    for form in EmForm::ALL {
        let mut builder = MechanismBuilder::new();
        let _ = builder.body("body", Inertia::principal(2.0, [0.3, 0.2, 0.1]));
        builder.signals(Vec::new(), Vec::new(), Arc::new(Held), Arc::new(Held));
        let built = builder.build().unwrap();
        let system = EmSystem::of_mechanism(&built.mechanism).force_elements(&built.forces);
        let options = EmOptions::new(form, 0.01);
        let refused = vi_emscheme::run::integrator(system, built.mechanism, options).unwrap_err();
        assert!(refused.to_string().contains("held values of signals"), "{refused}");
    }
}
