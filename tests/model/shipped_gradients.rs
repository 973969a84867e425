//! Every shipped model: a sweep backward over some steps is the transposed of the tangents beside
//! them, step by step and as a whole, in random directions.
#![allow(clippy::unwrap_used)] // a test

use crate::harness;
use harness::models::{all_shipped, overrides, read, shipped};
use holonom::gradient::{Wanted, gradient};
use holonom::model::{ModelText, Scheme};
use holonom::vi_constraints::Constraints;
use holonom::vi_constraints::costate_sweep::{CostateSweep, Linearization};
use holonom::vi_constraints::linearization::{Costate, Sources, Tangent};
use holonom::vi_control::Controls;
use holonom::vi_control::checkpoints::Checkpoints;
use holonom::vi_control::gradient::{Gradient, GradientError, Task};
use holonom::vi_control::objective::{CostTerm, Objective};
use holonom::vi_control::sensitivities::{Beside, Direction, Sensitivities};
use holonom::vi_core::linear::dot;
use holonom::vi_core::{Interval, MechanicalSystem, State};
use holonom::vi_multibody::run::MechanismIntegrator;
use holonom::{Model, Simulation};
use std::path::Path;
use vi_testkit::Sample;

const STEPS: usize = 4;

/// `x·q_N + y·p̄_N`.
struct Linear(Vec<f64>, Vec<f64>);

impl CostTerm for Linear {
    fn of_end(&self, end: &State) -> f64 {
        dot(&self.0, &end.q) + dot(&self.1, &end.p)
    }
    fn add_of_end(&self, _: &State, scale: f64, Costate { q, p, .. }: &mut Costate) {
        for (own, out) in [(&self.0, q), (&self.1, p)] {
            out.iter_mut().zip(own).for_each(|(out, own)| *out += scale * own);
        }
    }
}

fn random(sample: &mut Sample, n: usize) -> Vec<f64> {
    (0..n).map(|_| sample.number()).collect()
}

/// A momentum that varies by a motion of the mechanism, `M v`, of random `v`.
fn momentum(run: &MechanismIntegrator, sample: &mut Sample) -> Vec<f64> {
    let v = random(sample, run.state().q.len());
    let mut p = vec![0.0; v.len()];
    run.system().mass().mul_add(1.0, &v, &mut p);
    p
}

/// What the equations of the parts of a step may change by.
fn random_sources(
    run: &MechanismIntegrator,
    step: &Linearization,
    points: &[Interval],
    sample: &mut Sample,
) -> Vec<Sources> {
    let (n, m) = (run.state().q.len(), run.constraints().len());
    let own = |part: usize| {
        let (place, _) = step.part(points, part);
        let mut own = Sources::zero(n, m);
        own.minus = random(sample, n);
        if place.has_forces() {
            own.plus = random(sample, n);
        }
        if place.has_rows() && run.rows().len() == m {
            own.rows = random(sample, m); // else they contradict each other
        }
        own
    };
    (0..step.parts()).map(own).collect()
}

/// By how much forward and backward differ over a step with sources, of all terms.
fn of_step(run: &mut MechanismIntegrator, sample: &mut Sample) -> f64 {
    let (n, m) = (run.state().q.len(), run.constraints().len());
    let mut step = Linearization::new(run.method(), n, m, run.rows());
    let mut p = run.state().p.clone();
    let mut worst = 0.0_f64;
    let mut taken = Vec::new();
    run.step_with(&mut |_, _, own| taken.push(own.points().to_vec())).unwrap();
    let (system, constraints) = (run.system(), run.constraints());
    for points in &taken {
        step.linearize(system, constraints, points, &p).unwrap();
        let internal = run.state().internal.len();
        let (q, dp, z) = (random(sample, n), random(sample, n), random(sample, internal));
        let start = Tangent { q, p: dp, z };
        let mut end = start.clone();
        step.clear_sources();
        let sources = random_sources(run, &step, points, sample);
        sources.iter().enumerate().for_each(|(part, own)| step.add_sources(part, own));
        step.push(system, constraints, points, &mut end).unwrap();
        let after =
            Costate { q: random(sample, n), p: random(sample, n), z: random(sample, internal) };
        let mut before = after.clone();
        step.pull(system, constraints, points, &p, &mut before).unwrap();
        let terms = |c: &Costate, t: &Tangent| {
            let all = [(&c.q, &t.q), (&c.p, &t.p), (&c.z, &t.z)];
            let products = all.into_iter().flat_map(|(a, b)| a.iter().zip(b));
            products.fold([0.0; 2], |[sum, size], (a, b)| [sum + a * b, size + (a * b).abs()])
        };
        let ([left, of_left], [right, of_right]) = (terms(&after, &end), terms(&before, &start));
        let (mut along, mut part) = ([0.0; 2], 0);
        step.for_each_part(points, &mut |_, _, costates| {
            let Sources { minus, plus, rows } = &sources[part];
            let negative = [(minus, costates.step), (rows, costates.rows)];
            let products = plus.iter().zip(costates.momentum).map(|(a, b)| a * b);
            let others = negative.into_iter().flat_map(|(a, b)| a.iter().zip(b));
            for product in products.chain(others.map(|(a, b)| -a * b)) {
                along = [along[0] + product, along[1] + product.abs()];
            }
            part += 1;
        });
        let size = of_left + of_right + along[1];
        worst = worst.max((left - right - along[0]).abs() / size);
        step.momentum_at_end(system, points, &mut p);
    }
    worst
}

/// By how much the sweep of the mechanism over some steps differs from tangents beside them, of all
/// terms.
fn of_run(
    run: &mut MechanismIntegrator,
    h: f64,
    sample: &mut Sample,
) -> Result<f64, GradientError> {
    let (n, internal) = (run.state().q.len(), run.state().internal.len());
    let (controls, mut objective) = (Controls::default(), Objective::new());
    objective = objective.with(1.0, Linear(random(sample, n), random(sample, n)));
    let still = Tangent { q: vec![0.0; n], p: momentum(run, sample), z: vec![0.0; internal] };
    let mut tangents = Sensitivities::new(run, h, vec![Direction::from(still)])?;
    let beside = Beside { controls: &controls, design: None, objective: &objective };
    tangents.advance(run, beside)?;
    let (start, along) = (run.state().clone(), tangents.tangents()[0].clone());
    for _ in 1..STEPS {
        tangents.advance(run, beside)?;
    }
    let forward = tangents.rates(beside, run.state())[0];
    run.place_at(&start);
    let checkpoints = Checkpoints::All;
    let (steps, by_step) = (STEPS - 1, false);
    let task = Task {
        steps,
        objective: &objective,
        controls: &controls,
        design: None,
        by_step,
        checkpoints,
    };
    let Costate { q: a, p: b, z: y } = Gradient::of(run, &task)?.initial;
    let parts = [(&a, &along.q), (&b, &along.p), (&y, &along.z)];
    let products = || parts.iter().flat_map(|(a, b)| a.iter().zip(*b)).map(|(a, b)| a * b);
    let size: f64 = products().map(f64::abs).sum();
    Ok((products().sum::<f64>() - forward).abs() / size)
}

/// What is wrong in a model, by step and by run; `None` where nothing of it has a derivative.
fn of_model(model: &Model) -> Result<[f64; 2], String> {
    if matches!(
        model.settings.scheme,
        Scheme::Static | Scheme::EmConstrained | Scheme::EmDalembert | Scheme::EmNodal
    ) {
        return Err("no variational scheme".to_owned());
    }
    let mut simulation = Simulation::new(model).map_err(|error| error.to_string())?;
    let (run, mut sample) = (simulation.integrator(), Sample::new(7));
    let start = run.state().clone();
    let whole = of_run(run, model.settings.step, &mut sample).map_err(|error| error.to_string())?;
    run.place_at(&start);
    Ok([of_step(run, &mut sample), whole])
}

#[test]
fn backward_is_the_transposed_of_forward_in_every_shipped_model() {
    let (mut worst, mut found, mut refused) = ([0.0_f64; 2], 0, Vec::new());
    for (name, path) in all_shipped() {
        match of_model(&read(&path, &[])) {
            Ok(apart) => {
                println!("{name}: a step {:.1e}, {STEPS} steps {:.1e}", apart[0], apart[1]);
                worst = [worst[0].max(apart[0]), worst[1].max(apart[1])];
                found += 1;
            }
            Err(what) => refused.push(format!("{name}: {what}")),
        }
    }
    println!(
        "{found} models, worst {:.1e} and {:.1e}; {} without:\n{}",
        worst[0],
        worst[1],
        refused.len(),
        refused.join("\n")
    );
    let is_known = |what: &String| {
        what.ends_with("has no derivatives") || what.ends_with("no variational scheme")
    };
    assert!(found > 50 && refused.iter().all(is_known));
    assert!(worst[0] < 1e-14, "a step: {:e}", worst[0]);
    assert!(worst[1] < 1e-12, "{STEPS} steps: {:e}", worst[1]);
}

/// Strips of steel are thousands of times stiffer along themselves than across: what rounding of
/// those forces hides may not be left in a start, since its derivative is that of the equilibrium.
#[test]
fn relaxed_starts_of_stiff_strips_are_their_equilibria() {
    let strips: [(&str, &[&str]); 2] = [
        ("four_bar_steel", &["beam.coupler.section.material.E", "beam.rocker.section.material.E"]),
        ("flexible_slider_crank", &["beam.rod.section.material.E"]),
    ];
    for (name, keys) in strips {
        let text = ModelText::from_text(Path::new("model.toml"), shipped(name));
        let shorter = overrides(&[("simulation.end", "0.01")]);
        let model = text.model(&shorter).unwrap();
        let wanted = Wanted {
            of: vec!["middle.y".into()],
            only: keys.iter().map(ToString::to_string).collect(),
            controls: false,
            initial: false,
            ..Wanted::everything()
        };
        let mut found = gradient(&text, &shorter, &model, &wanted).unwrap();
        found.check(&text, &shorter, &model, &wanted).unwrap();
        let worst = found.worst();
        println!("{name}: derivatives by moduli are {worst:.1e} apart from differences");
        assert!(worst < 1e-9 && found.checks.len() >= 3, "{name}: {worst:e}");
    }
}
