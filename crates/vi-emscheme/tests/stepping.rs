//! What the integrator refuses, and what it leaves behind.
#![allow(clippy::unwrap_used)] // helpers of tests

use crate::common;
use vi_constraints::InitialValues;

use vi_emscheme::integrator::EmSetupError;
use vi_emscheme::{EmForm, EmIntegrator, EmOptions, EmSystem};
use vi_multibody::PairKind;

fn refusal<C: vi_emscheme::DiscreteConstraints>(
    found: Result<EmIntegrator<C>, EmSetupError>,
) -> String {
    found.map(|_| ()).unwrap_err().to_string()
}

#[test]
fn wrong_shapes_and_steps_are_refused() {
    let model = common::pendulum();
    let start = |q: &[f64], v: &[f64], h| {
        let options = EmOptions::new(EmForm::Constrained, h);
        vi_emscheme::integrator::new(
            model.system(),
            model.mechanism.clone(),
            options,
            InitialValues::new(0.0, q, v),
        )
    };
    let message = refusal(start(&[1.0, 0.0, 0.0], &[0.0; 2], 0.1));
    assert_eq!(message, "q(0) has 3 entries where 2 are needed");
    let message = refusal(start(&[1.0, 0.0], &[0.0; 1], 0.1));
    assert_eq!(message, "v(0) has 1 entries where 2 are needed");
    let message = refusal(start(&[1.0, 0.0], &[0.0; 2], 0.0));
    assert_eq!(message, "the time step is 0: it must be a finite number other than zero");
    assert!(refusal(start(&[f64::NAN, 0.0], &[0.0; 2], 0.1)).contains("not finite"));

    let other = common::heavy_top();
    let options = EmOptions::new(EmForm::Dalembert, 0.1);
    let at = InitialValues::new(0.0, &[1.0, 0.0], &[0.0; 2]);
    let message =
        refusal(vi_emscheme::integrator::new(model.system(), other.mechanism, options, at));
    assert_eq!(message, "the argument of the constraints has 12 entries where 2 are needed");

    let linkage = common::linkage();
    let options = EmOptions::new(EmForm::Nodal, 0.01);
    let system = EmSystem::of_mechanism(&linkage.mechanism);
    let (q, v) = (linkage.mechanism.initial_configuration(), linkage.mechanism.initial_velocity());
    let message = refusal(vi_emscheme::integrator::new(
        system,
        linkage.mechanism,
        options,
        InitialValues::new(0.0, &q, &v),
    ));
    assert!(message.starts_with("the scheme `em-nodal` needs a map"), "{message}");
}

#[test]
fn a_failed_step_leaves_the_state_alone() {
    for form in EmForm::ALL {
        let mut run = common::heavy_top().run(form, 20.0);
        let mut failed = false;
        for _ in 0..50 {
            let before = run.state().clone();
            if run.step().is_err() {
                assert_eq!(run.state(), &before);
                failed = true;
                break;
            }
        }
        assert!(failed, "{}: a step of 20 s cannot go well for ever", form.name());
    }
}

/// A composition fails in the middle of a macro step, with sub-steps behind it.
#[test]
fn a_failed_macro_step_is_taken_back_as_a_whole() {
    for form in EmForm::ALL {
        let mut run = common::heavy_top().run_by(form, 4, 0.4);
        let mut failed = false;
        for _ in 0..200 {
            let before = run.state().clone();
            if run.step().is_err() {
                assert_eq!(run.state(), &before);
                failed = true;
                break;
            }
        }
        assert!(failed, "{}: macro steps of 0.4 s at 25 rad/s", form.name());
    }
}

#[test]
fn compositions_of_damped_systems_are_refused() {
    let model = common::pair(PairKind::Cylindrical, false);
    let composition = vi_core::Composition::of_order(4).unwrap();
    let options = EmOptions::new(EmForm::Nodal, 0.01).composition(composition);
    let system = common::loaded(&model);
    let message = refusal(vi_emscheme::run::integrator(system, model.mechanism, options));
    assert!(message.starts_with("a composition has backward sub-steps"), "{message}");
}

#[test]
fn time_reverses_and_observing_changes_nothing() {
    for form in EmForm::ALL {
        let model = common::pair(PairKind::Planar, true);
        let mut run = model.run(form, model.h);
        let start = run.state().clone();
        let mut plain = model.run(form, model.h);
        for n in 0..200 {
            run.step().unwrap();
            plain.step().unwrap();
            if n % 50 == 10 {
                let force = run.observe().unwrap().constraint_force.clone();
                let at = run.state().clone();
                run.step().unwrap();
                plain.step().unwrap();
                let again = run.node_before().unwrap().constraint_force.clone();
                assert_eq!(run.before(), &at);
                let off = common::distance(&force, &again);
                assert!(off < 1e-8, "{}: {off:e}", form.name());
            }
        }
        let off = common::distance(&run.state().q, &plain.state().q);
        assert!(off < 1e-13, "{}: observing moved the motion by {off:e}", form.name());
        run.reverse();
        for _ in 0..204 {
            run.step().unwrap();
        }
        let off = common::distance(&run.state().q, &start.q);
        println!("{}: 204 steps and back, off by {off:.1e}", form.name());
        assert!(off < 1e-11, "{off:e}");
    }
}

#[test]
fn condition_numbers_against_the_step() {
    let model = common::pair(PairKind::Cylindrical, false);
    for form in EmForm::ALL {
        let at = |h| {
            let mut run = model.run(form, h);
            (0..3).for_each(|_| assert!(run.step().is_ok()));
            run.condition().unwrap()
        };
        let (coarse, fine) = (at(1e-3), at(1e-4));
        let written = (fine.as_written / coarse.as_written).log10();
        let scaled = (fine.scaled / coarse.scaled).log10();
        println!("{}: κ ~ h^{:.2} as written, h^{:.2} scaled", form.name(), -written, -scaled);
        let expected = match form {
            EmForm::Constrained => 3.0,
            EmForm::Dalembert => 1.0,
            EmForm::Nodal => 0.0,
        };
        assert!((written - expected).abs() < 0.1, "{form:?}: κ ~ h^{:.2}", -written);
        assert!(scaled.abs() < 0.1, "{form:?}: scaled κ ~ h^{:.2}", -scaled);
    }
}
