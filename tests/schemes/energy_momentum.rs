//! The energy–momentum schemes on every shipped model: energy, momentum maps and constraints are
//! conserved to the tolerance of the solver, the three forms move alike, and where something drives
//! or dissipates the motion is that of the variational schemes to second order.
#![allow(clippy::unwrap_used)] // helpers of tests

use crate::harness::models::{all_shipped, read};
use holonom::model::Scheme;
use holonom::{Model, Sample, Simulation};

const FORMS: [Scheme; 3] = [Scheme::EmConstrained, Scheme::EmDalembert, Scheme::EmNodal];

fn shipped() -> Vec<(String, Model)> {
    let read = |(name, path): (String, std::path::PathBuf)| (name, read(&path, &[]));
    let moves = |(_, model): &(String, Model)| model.settings.scheme != Scheme::Static;
    // rolling is refused by name; laws and events have tests of their own
    let taken = |(_, model): &(String, Model)| {
        !model.has_velocity_constraints() && model.laws.is_empty() && model.events.is_empty()
    };
    // the tension of wires hands on impulses whose rounding is not of the size of momenta
    const WIRES: [&str; 4] = ["contact_wire", "crane_rope", "guitar_string", "mooring_line"];
    // dense forms of the long window take minutes
    let short = |(name, _): &(String, std::path::PathBuf)| {
        name != "four_bar_windows_40" && !WIRES.contains(&&**name)
    };
    all_shipped().into_iter().filter(short).map(read).filter(moves).filter(taken).collect()
}

fn run(model: &Model, scheme: Scheme, steps: u64) -> Result<Vec<Sample>, String> {
    run_by(model, (scheme, 2), steps)
}

fn run_by(
    model: &Model,
    (scheme, order): (Scheme, u32),
    steps: u64,
) -> Result<Vec<Sample>, String> {
    let mut model = model.clone();
    (model.settings.scheme, model.settings.order) = (scheme, order);
    model.settings.every = 1;
    model.settings.end = model.settings.step * steps.min(model.settings.steps()) as f64;
    let mut simulation = Simulation::new(&model).map_err(|e| format!("{e:?}"))?;
    let mut samples = Vec::new();
    let mut observe = |sample: &Sample| -> Result<(), String> {
        samples.push(sample.clone());
        Ok(())
    };
    match simulation.run(&mut observe, &mut |_, _| {})? {
        holonom::RunOutcome::Done => Ok(samples),
        holonom::RunOutcome::Failed(failure) => Err(failure.message),
    }
}

/// Largest deviation of a quantity from its start.
fn drift(samples: &[Sample], of: impl Fn(&Sample) -> f64) -> f64 {
    largest(samples.iter().map(|s| of(s) - of(&samples[0])))
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    let worst =
        |worst: f64, x: f64| if worst.is_nan() || x.abs() <= worst { worst } else { x.abs() };
    values.fold(0.0, worst)
}

fn distance(a: &[Sample], b: &[Sample]) -> f64 {
    let off = |(a, b): (&Sample, &Sample)| largest(a.q.iter().zip(&b.q).map(|(a, b)| a - b));
    largest(a.iter().zip(b).map(off))
}

/// Whether anything drives or dissipates.
fn is_conservative(model: &Model) -> bool {
    let joint = |j: &holonom::model::Joint| j.damper.is_none() && j.motor.is_none();
    model.joints.iter().all(joint)
        && model.springs.iter().all(|s| s.damping == 0.0)
        && model.loads.is_empty()
        && !model.constraints.iter().any(|c| matches!(c, holonom::model::Constraint::Motion { .. }))
}

fn reference(model: &Model, steps: u64) -> Vec<Sample> {
    run(model, Scheme::Nodal, steps).or_else(|_| run(model, Scheme::Constrained, steps)).unwrap()
}

/// Whether the step resolves the vibrations of all beams.
fn is_resolved(model: &Model) -> bool {
    let simulation = Simulation::new(model).unwrap();
    simulation.assembly().stiffness.as_ref().is_none_or(|stiffness| stiffness.h_omega_max < 1.0)
}

#[test]
fn every_shipped_model_runs_by_every_form() {
    for (name, model) in shipped() {
        let steps = if model.beams.is_empty() { 80 } else { 12 };
        let variational = reference(&model, steps);
        let runs = FORMS.map(|form| run(&model, form, steps).unwrap());
        for (form, samples) in FORMS.iter().zip(&runs) {
            let energy = drift(samples, |s| s.hamiltonian);
            let residual = |of: fn(&Sample) -> f64| largest(samples.iter().map(of));
            let position = residual(|s| s.residuals.position);
            let velocity = residual(|s| s.residuals.velocity);
            let (mut momentum, mut size) = (0.0_f64, 1.0_f64);
            for k in 0..3 {
                for map in [|s: &Sample| s.momentum.linear, |s: &Sample| s.momentum.angular] {
                    size = size.max(largest(samples.iter().map(|s| map(s)[k])));
                    if drift(&variational, |s| map(s)[k]) < 1e-10 {
                        momentum = momentum.max(drift(samples, |s| map(s)[k]));
                    }
                }
            }
            let apart = distance(samples, &runs[0]);
            println!(
                "{name:<18} {:<14} energy {energy:.1e}, momenta {momentum:.1e}, g {position:.1e} \
                 {velocity:.1e}, forms {apart:.1e}",
                form.name()
            );
            // `H` may be a small difference of large terms: `p·v` is as large as they are
            let rate = |[a, b]: [&Sample; 2]| {
                largest(a.q.iter().zip(&b.q).map(|(a, b)| b - a)) / (b.t - a.t)
            };
            let speed = largest(samples.windows(2).map(|s| rate([&s[0], &s[1]])));
            let scale = 1.0 + largest(samples.iter().map(|s| s.hamiltonian)) + size * speed;
            assert!(
                !is_conservative(&model) || energy < 1e-13 * scale,
                "{name}: energy {energy:e}"
            );
            let extent = 1.0 + largest(samples.iter().flat_map(|s| s.q.iter().copied()));
            assert!(momentum < 1e-12 * size, "{name}: momentum {momentum:e} of {size:.1e}");
            assert!(position < 1e-14 * extent * extent, "{name}: g {position:e}");
            assert!(velocity < 1e-10 * extent, "{name}: G v {velocity:e}");
            assert!(apart < 1e-9 * extent, "{name}: forms differ by {apart:e}");
        }
    }
}

/// Where something drives or dissipates, both families have the same limit: their distance falls by
/// four when the step is halved.
#[test]
fn driven_and_damped_motions_are_those_of_the_variational_schemes() {
    let driven = |(_, model): &(String, Model)| !is_conservative(model) && is_resolved(model);
    for (name, model) in shipped().into_iter().filter(driven) {
        let apart = |parts: u64| {
            let mut model = model.clone();
            model.settings.step /= parts as f64;
            let steps = 100 * parts;
            let ends = [run(&model, Scheme::EmNodal, steps).unwrap(), reference(&model, steps)];
            let [a, b] = ends.map(|samples| samples.into_iter().next_back().unwrap());
            distance(&[a], &[b])
        };
        let (coarse, fine) = (apart(1), apart(2));
        let order = (coarse / fine).log2();
        println!("{name:<18} apart by {coarse:.1e}, {fine:.1e}: order {order:.2}");
        let stands = coarse.max(fine) < 1e-14; // both to rounding errors: there is no order
        assert!(stands || (order - 2.0).abs() < 0.2, "{name}: {coarse:e}, {fine:e}");
    }
}

/// Sensors read the same motion: reactions, rates and coordinates of both families differ by the
/// order of the step, not by sign or scale.
#[test]
fn sensors_of_both_families_agree_to_the_order_of_the_step() {
    let (_, mut model) = shipped().into_iter().find(|(name, _)| name == "four_bar_loop").unwrap();
    let sensors = ["joint_coordinate", "joint_rate", "reaction"].map(|kind| {
        let name = &model.joints[1].name;
        format!("[[sensor]]\nname = \"{kind}\"\ntype = \"{kind}\"\nof = \"{name}\"\n")
    });
    model = Model::from_toml(&(model.to_toml() + &sensors.concat())).unwrap();
    let apart = |parts: u64| {
        let mut model = model.clone();
        model.settings.step /= parts as f64;
        let [em, vi] =
            [Scheme::EmNodal, Scheme::Nodal].map(|s| run(&model, s, 50 * parts).unwrap());
        let middle = (25 * parts) as usize;
        let values = em[middle].sensors.iter().zip(&vi[middle].sensors);
        let scale = largest(vi[middle].sensors.iter().copied().filter(|x| x.is_finite()));
        (largest(values.filter(|(a, _)| a.is_finite()).map(|(a, b)| a - b)), scale)
    };
    let ((coarse, scale), (fine, _)) = (apart(1), apart(2));
    println!("sensors up to {scale:.1e} apart by {coarse:.1e}, {fine:.1e}");
    assert!(coarse < 1e-2 * scale && fine < coarse / 2.5, "{coarse:e}, {fine:e}");
}

/// Compositions have backward sub-steps. They conserve what a single step does: on a linkage with
/// redundant joints, on point masses, on bodies and on a beam.
#[test]
fn compositions_conserve_energy_momenta_and_constraints() {
    for name in ["pendulum", "heavy_top", "six_hinge_cube", "flying_beam"] {
        let Some((_, mut model)) = shipped().into_iter().find(|m| m.0 == name) else {
            panic!("{name} is not shipped")
        };
        model.loads.clear(); // the beam rotates without a push
        model.beams.iter_mut().for_each(|beam| beam.angular_velocity = [0.2, -0.1, 0.5]);
        for (form, order) in FORMS.into_iter().zip([4, 6, 8]) {
            let steps = if model.beams.is_empty() { 20 } else { 3 };
            let samples = run_by(&model, (form, order), steps).unwrap();
            let energy = drift(&samples, |s| s.hamiltonian);
            let scale = 1.0 + largest(samples.iter().map(|s| s.hamiltonian));
            let angular = drift(&samples, |s| s.momentum.angular[2]);
            let position = largest(samples.iter().map(|s| s.residuals.position));
            println!(
                "{name:<16} {} of order {order}: energy {energy:.1e} of {scale:.1}, Lz {angular:.1e}, \
                 g {position:.1e}",
                form.name()
            );
            assert!(samples.len() as u64 == steps + 1, "{name}: {} nodes", samples.len());
            assert!(energy < 1e-12 * scale, "{name}: energy {energy:e}");
            assert!(name == "pendulum" || angular < 1e-11, "{name}: Lz {angular:e}");
            assert!(position < 1e-13, "{name}: g {position:e}");
        }
    }
}

/// The orders of a whole run by model file, in the positions of its bodies, against the variational
/// scheme of order 8; the multipliers at nodes are those of the acceleration level.
#[test]
fn compositions_have_their_order_in_model_files() {
    let (_, model) = shipped().into_iter().find(|m| m.0 == "heavy_top").unwrap();
    let at = |scheme: Scheme, order: u32, parts: u64| {
        let mut model = model.clone();
        model.settings.step = 0.01 / parts as f64;
        let samples = run_by(&model, (scheme, order), 10 * parts).unwrap();
        samples.into_iter().next_back().unwrap()
    };
    let exact = at(Scheme::Nodal, 8, 4);
    for order in [4, 6] {
        let [coarse, fine] = [1, 2].map(|parts| {
            distance(&[at(Scheme::EmNodal, order, parts)], std::slice::from_ref(&exact))
        });
        let found = (coarse / fine).log2();
        println!("em-nodal of order {order}: off by {coarse:.1e}, {fine:.1e}: order {found:.2}");
        assert!((found - f64::from(order)).abs() < 0.3, "{coarse:e}, {fine:e}");
    }
}

#[test]
fn compositions_of_damped_models_are_refused() {
    let damped = |(_, model): &(String, Model)| {
        model.joints.iter().any(|j| j.damper.is_some())
            || model.springs.iter().any(|s| s.damping > 0.0)
    };
    let (_, mut model) = shipped().into_iter().find(damped).unwrap();
    let refusal = |scheme: Scheme, model: &mut Model| {
        (model.settings.scheme, model.settings.order) = (scheme, 4);
        Simulation::new(model).map(|_| ()).unwrap_err().to_string()
    };
    let variational = refusal(Scheme::Nodal, &mut model);
    assert!(variational.contains("backward sub-steps"), "{variational}");
    assert_eq!(refusal(Scheme::EmNodal, &mut model), variational);
}

/// The sparse and the dense algebra of `em-nodal` are one scheme.
#[test]
fn sparse_and_dense_matrices_give_the_same_motion() {
    use holonom::vi_multibody::run::Solver;
    let tree = |(_, model): &(String, Model)| {
        Simulation::new(model).is_ok_and(|s| {
            !s.mechanism().has_loops() && s.mechanism().description().particles.is_empty()
        })
    };
    let mut count = 0;
    for (name, mut model) in shipped().into_iter().filter(tree) {
        (model.settings.scheme, model.settings.order) = (Scheme::EmNodal, 2);
        let steps = if model.beams.is_empty() { 50 } else { 5 };
        let end = |solver| {
            let mut run = Simulation::with_solver(&model, solver).unwrap();
            (0..steps).for_each(|_| assert!(run.step().is_ok()));
            run.configuration().to_vec()
        };
        let (sparse, dense) = (end(Solver::Sparse), end(Solver::Dense));
        let size = 1.0 + largest(dense.iter().copied());
        let apart = largest(sparse.iter().zip(&dense).map(|(a, b)| a - b));
        println!("{name:<22} apart by {apart:.1e}");
        assert!(apart < 1e-11 * size, "{name}: {apart:e}");
        count += 1;
    }
    assert!(count > 10, "{count} models");
}

/// Beams alone and between bodies: when the push is over, energy and both momenta are those of a
/// free system.
#[test]
fn flying_beams_keep_energy_and_momenta_after_the_push() {
    flying_beams(5.0);
}

#[test]
#[ignore = "long: cargo test --release -- --ignored"]
fn flying_beams_keep_energy_and_momenta_after_the_push_in_small_steps() {
    flying_beams(1.0);
}

/// With the step of the shipped models times `longer`.
fn flying_beams(longer: f64) {
    for (name, push, end) in [("flying_beam", 2.5, 3.5), ("flexible_multibody", 0.5, 1.0)] {
        let (_, mut model) = shipped().into_iter().find(|m| m.0 == name).unwrap();
        model.settings.end = end;
        model.settings.step *= longer;
        for form in [Scheme::EmConstrained, Scheme::EmNodal] {
            let samples = run(&model, form, u64::MAX).unwrap();
            let free: Vec<Sample> =
                samples.into_iter().filter(|s| s.t > push + 0.5 * model.settings.step).collect();
            let energy = drift(&free, |s| s.hamiltonian);
            let mut momentum = 0.0_f64;
            for k in 0..3 {
                momentum = momentum.max(drift(&free, |s| s.momentum.linear[k]));
                momentum = momentum.max(drift(&free, |s| s.momentum.angular[k]));
            }
            let size = free[0].hamiltonian;
            let position = largest(free.iter().map(|s| s.residuals.position));
            println!(
                "{name:<18} {:<14} {} steps: energy {size:.1} off by {energy:.1e}, momenta by {momentum:.1e}, g \
                 {position:.1e}",
                form.name(),
                free.len()
            );
            assert!(free.len() > 40 && size > 0.1, "{name}: nothing to see");
            assert!(energy < 1e-12 * (1.0 + size), "{name}: energy {energy:e}");
            assert!(momentum < 1e-11, "{name}: momenta {momentum:e}");
            assert!(position < 1e-14, "{name}: g {position:e}");
        }
    }
}

/// A steady rotation about the origin, where the rounding errors of `Δq` are biased at this step.
#[test]
fn a_steady_rotation_keeps_its_momentum_within_a_few_last_bits() {
    use holonom::certificate::subject::ModelSubject;
    use holonom::verification::measure::long_run;
    use holonom::verification::subject::{SchemeSetting, SteppingMethod};
    use holonom::vi_emscheme::EmForm;
    let text = include_str!("../../examples/models/pendulum_free.toml");
    let subject = ModelSubject::new(Model::from_toml(text).unwrap());
    for form in [EmForm::Constrained, EmForm::Dalembert] {
        let setting = SchemeSetting::new(SteppingMethod::EnergyMomentum(form), 2, 0.02);
        let angular = long_run(&subject, setting, 20_000).unwrap().momentum(5);
        let drift = largest(angular.iter().map(|l| l - angular[0]));
        println!("{}: |L − L_0| ≤ {drift:.1e} in 20000 steps", form.name());
        assert!(drift < 4e-15, "{}: {drift:e}", form.name());
    }
}

/// A slack rope that snaps taut, `EA = 10¹⁰ N` and `10⁹ N`: what is soft moves far for the rounding
/// of what is stiff, by `10⁻⁹` to `5·10⁻⁷` here, and no step is refused for it. The energy is that
/// of the start.
#[test]
fn a_rope_that_snaps_taut_keeps_its_energy() {
    let rope = |end: [f64; 3], length: f64, own: [f64; 2], elements: usize| {
        format!(
            "[[beam]]\nname = \"rope\"\npoints = [[0, 0, 0], {end:?}]\nlength = {length:?}\nelements = {elements}\n\
             element = \"rope\"\nstart = \"pinned\"\nsection = {{ EA = {0:e}, GA1 = 1e8, GA2 = 1e8, EI1 = {1:e}, \
             EI2 = {1:e}, GJ = {1:e}, rhoA = 0.1, rhoI1 = 1e-6, rhoI2 = 1e-6 }}\n",
            own[0], own[1]
        )
    };
    let head = |step: f64, end: f64| {
        format!(
            "[model]\nname = \"rope\"\ngravity = [0, 0, -9.81]\n[simulation]\nscheme = \"em-nodal\"\n\
             step = {step:e}\nend = {end:?}\n"
        )
    };
    let ball = "[[body]]\nname = \"ball\"\nmass = 50.0\ninertia = [0.1, 0.1, 0.1]\nposition = [0, 0, -2]\n[[joint]]\n\
                name = \"at\"\ntype = \"spherical\"\nparent = \"rope.end\"\nchild = \"ball\"\nposition = [0, 0, -2]\n";
    let aside = [1.5, 0.0, 0.0];
    let cases = [
        ("falls", head(1e-2, 0.5) + &rope([0.0, 0.0, -2.0], 2.05, [1e10, 1e-2], 10) + ball),
        ("swings", head(3e-3, 0.456) + &rope(aside, 2.0, [1e9, 1e-2], 4)),
        ("long", head(3e-3, 0.864) + &rope(aside, 2.0, [1e10, 1.0], 10)),
    ];
    for (name, text) in cases {
        let model = Model::from_toml(&text).unwrap();
        let rows = Simulation::new(&model).unwrap().samples().collect::<Result<Vec<_>, _>>();
        let rows = rows.unwrap_or_else(|failure| panic!("{name}: {failure:?}"));
        let size = rows.iter().map(|row| row.energy.abs()).fold(1.0, f64::max);
        let off = rows.iter().map(|row| (row.energy - rows[0].energy).abs()).fold(0.0, f64::max);
        println!("{name}: {} rows, energy {:.3} J to {off:.1e}", rows.len(), rows[0].energy);
        assert!(off < 1e-9 * size, "{name}: {off:e} J");
    }
}
