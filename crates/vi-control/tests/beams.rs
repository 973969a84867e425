//! Gradients of beams: material damping, and dissipative strains that remember.

use nalgebra::Vector3;
use vi_beam::mesh::{BeamMesh, FrameRule};
use vi_beam::model::{BeamModel, StrainRule};
use vi_beam::section::Section;
use vi_constraints::linearization::Tangent;
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_control::objective::{NumberCost, PointComponent, Running, Terminal};
use vi_control::sensitivities::Beside;
use vi_control::{Checkpoints, Controls, Direction, Gradient, Objective, Sensitivities, Task};
use vi_core::MechanicalSystem;
use vi_core::galerkin::Stages;
use vi_core::linear::dot;
use vi_multibody::form::Form;
use vi_multibody::run::{MechanismIntegrator, Solver, integrator};
use vi_testkit::Sample;

const STEPS: usize = 20;

/// A soft beam that falls about its clamped end.
fn beam(
    rule: StrainRule,
    scheme: SchemeKind,
    stages: Option<usize>,
) -> (MechanismIntegrator, Objective) {
    let section = Section::new([500.0, 500.0, 2e3, 0.5, 0.7, 0.4], [1.0, 1.5e-3, 1e-3, 0.0]);
    let section = section.unwrap().with_damping([0.002; 6]).unwrap();
    let across = FrameRule::Normal(Vector3::z());
    let mesh = BeamMesh::straight(Vector3::zeros(), Vector3::x(), 4, across).unwrap();
    let mut model = BeamModel::new(Vector3::new(0.0, 0.0, -9.81));
    model.add_beam("beam", &mesh, section).unwrap();
    model.clamp(0);
    let mechanism = model.mechanism();
    let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
    let system = model.system(&mechanism, rule);
    let options = Options::new(scheme, 0.005);
    let options = match stages.and_then(Stages::new) {
        Some(stages) => options.galerkin(stages),
        None => options,
    };
    let at = InitialValues::new(0.0, &q, &v);
    let tip = q.len() - 12;
    let height = || PointComponent { point: Form::particle(tip, 3), axis: 2 };
    let objective = Objective::new()
        .with(10.0, Terminal { quantity: height(), judged: NumberCost::Deviation(-0.2) })
        .with(5.0, Running { quantity: height(), judged: NumberCost::Deviation(0.1) });
    (integrator(mechanism, system, options, Solver::Auto, at).unwrap(), objective)
}

#[test]
fn beams_agree_with_sensitivities_and_differences() {
    let mut sample = Sample::new(94);
    let controls = Controls::default();
    let rules = [
        (StrainRule::Averaged, None),
        (StrainRule::MassScaled, None),
        (StrainRule::Dissipative, None),
        (StrainRule::Averaged, Some(1)),
        (StrainRule::Averaged, Some(2)),
        (StrainRule::Averaged, Some(3)),
    ];
    for (rule, stages) in rules {
        for scheme in [SchemeKind::Constrained, SchemeKind::Nodal] {
            let (mut run, objective) = beam(rule, scheme, stages);
            let first = run.state().clone();
            let mut start = Tangent::zero(first.q.len(), first.internal.len());
            let v: Vec<f64> = first.q.iter().map(|_| sample.number()).collect();
            run.system().mass().mul_add(1.0, &v, &mut start.p);
            start.z.iter_mut().for_each(|z| *z = 0.01 * sample.number());
            let task = Task {
                steps: STEPS,
                objective: &objective,
                controls: &controls,
                design: None,
                by_step: false,
                checkpoints: Checkpoints::Every(6),
            };
            let found = Gradient::of(&mut run, &task).unwrap();
            let terms = [
                dot(&found.initial.q, &start.q),
                dot(&found.initial.p, &start.p),
                dot(&found.initial.z, &start.z),
            ];
            let (exact, size) =
                (terms.iter().sum::<f64>(), terms.iter().map(|x| x.abs()).sum::<f64>());
            run.place_at(&first);
            let direction = Direction::from(start.clone());
            let mut forward = Sensitivities::new(&run, 0.005, vec![direction]).unwrap();
            let beside = Beside { controls: &controls, design: None, objective: &objective };
            for _ in 0..STEPS {
                forward.advance(&mut run, beside).unwrap();
            }
            let rate = forward.rates(beside, run.state())[0];
            let mut at = |e: f64| {
                let mut moved = first.clone();
                moved.p.iter_mut().zip(&start.p).for_each(|(p, dp)| *p += e * dp);
                moved.internal.iter_mut().zip(&start.z).for_each(|(z, dz)| *z += e * dz);
                run.place_at(&moved);
                let mut value = 0.0;
                for _ in 0..STEPS {
                    let each = &mut |_: &_, _: &_, taken: vi_constraints::discretization::Step| {
                        value += objective.of_step(taken.s, &[]);
                    };
                    run.step_with(each).unwrap();
                }
                value + objective.of_end(run.state())
            };
            let e = 1e-4;
            let difference = (8.0 * (at(e) - at(-e)) - (at(2.0 * e) - at(-2.0 * e))) / (12.0 * e);
            let errors = [(rate - exact).abs() / size, (difference - exact).abs() / size];
            let memory = first.internal.len();
            let [a, b] = errors;
            println!(
                "{rule:?}, {scheme:?}, {stages:?}, {memory} internal variables: {a:.1e}, {b:.1e}"
            );
            assert!(
                errors[0] < 1e-11 && errors[1] < 1e-8,
                "{rule:?} {scheme:?} {stages:?}: {errors:?}"
            );
        }
    }
}
