//! What holds of a mechanism with contacts, rigid stops or dry friction: the order of `q`,
//! constraints, gaps, limits, momentum where nothing acts from outside, what impacts and friction
//! take out, the balance. Impulses act at nodes, so what speaks of smooth motions does not apply.

use super::halved::{self, RESIDUAL, ROUND_OFF, bounded, halved, judged_balance, judged_order};
use holonom_model::{Contact, GROUND, Model, Sensor, SensorKind};
use holonom_sim::simulation::Simulation;
use vi_core::linear::norm_inf;
use vi_verify::certificate::{Criterion, Finding, Verdict};
use vi_verify::subject::SteppingMethod;

/// A run with one step.
struct ContactRun {
    q: Vec<f64>,
    residual: f64,
    beyond: f64,    // m or rad  the largest excess over a limit
    overlap: f64,   // m  the largest of a contact
    drift: f64,     // largest change of a momentum, relative to what moves
    works: f64,     // J  of stops and friction, at the end
    gained: f64,    // J  the largest rise of these works between two nodes
    balance: f64,   // J  at the end
    exchanged: f64, // J  largest energy
}

/// What the sensors of limited joints are called.
const OF_LIMITS: &str = "limits of ";
/// What the sensors of gaps are called.
const OF_GAPS: &str = "gaps of ";

/// Why momentum is not conserved; `None` where nothing acts from outside.
fn held(model: &Model) -> Option<&'static str> {
    let outside = |name: &str| name == GROUND || model.body(name).is_some_and(|body| body.fixed);
    let mut joints = model.joints.iter().flat_map(|joint| [&joint.parent, &joint.child]);
    let mut springs = model.springs.iter().flat_map(|spring| [&spring.from, &spring.to]);
    let pairs = model.contact_pairs();
    let touched = pairs.iter().any(|pair| outside(pair.a.name()) || pair.b.fixed);
    match () {
        () if touched || joints.any(|name| outside(name)) || springs.any(|name| outside(name)) => {
            Some("the ground takes part")
        }
        () if model.gravity().iter().any(|g| *g != 0.0) => Some("the bodies have weight"),
        () if !(model.loads.is_empty() && model.laws.is_empty()) => Some("loads act from outside"),
        () if !(model.beams.is_empty()
            && model.bars.is_empty()
            && model.bushings.is_empty()
            && model.constraints.is_empty()
            && model.events.is_empty()) =>
        {
            Some("parts may be held by the ground")
        }
        () => None,
    }
}

/// The sizes of linear and angular momentum: sums over all bodies of `m|v|` and of
/// `m|x||v| + |Jω|`.
fn sizes(model: &Model) -> [f64; 2] {
    let [mut linear, mut angular] = [0.0; 2];
    for body in &model.bodies {
        let [x, v] = [body.position, body.velocity].map(|own| norm(&own));
        let spin = body.inertia_tensor().amax() * norm(body.spatial_angular_velocity().as_slice());
        linear += body.mass() * v;
        angular += body.mass() * x * v + spin;
    }
    [linear, angular]
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn run(mut model: Model) -> Result<ContactRun, String> {
    let bounds: Vec<_> = (model.joints.iter())
        .filter_map(|joint| Some((joint.name.clone(), joint.stops()?)))
        .collect();
    for (joint, _) in &bounds {
        let name = format!("{OF_LIMITS}{joint}");
        model.sensors.push(Sensor::new(name, SensorKind::JointCoordinate, joint.clone()));
    }
    let rigid: Vec<String> = model.rigid_contacts().map(|own| own.name.clone()).collect();
    for contact in rigid {
        let name = format!("{OF_GAPS}{contact}");
        model.sensors.push(Sensor::new(name, SensorKind::Gap, contact));
    }
    let sizes = sizes(&model);
    let mut simulation = Simulation::new(&model).map_err(|error| error.to_string())?;
    let columns = simulation.sensors().columns();
    let first = |joint: &str| {
        columns.iter().position(|column| column.sensor.strip_prefix(OF_LIMITS) == Some(joint))
    };
    let bounds: Vec<_> = bounds
        .iter()
        .filter_map(|(joint, limits)| Some((first(joint)? + limits.freedom, *limits)))
        .collect();
    let gaps: Vec<usize> = (columns.iter().enumerate())
        .filter(|(_, column)| column.sensor.starts_with(OF_GAPS))
        .map(|(k, _)| k)
        .collect();
    let works = simulation.energy_columns().iter().enumerate();
    let ends = [".stop", ".friction"];
    let of_impulses = |name: &str| {
        let Some(source) = name.strip_prefix("work.") else { return false };
        ends.iter().any(|end| source.ends_with(end))
            || model.contact(source).is_some_and(Contact::is_rigid)
    };
    let works: Vec<usize> = works.filter(|(_, name)| of_impulses(name)).map(|(k, _)| k).collect();
    let mut found = ContactRun {
        q: Vec::new(),
        residual: 0.0,
        beyond: 0.0,
        overlap: 0.0,
        drift: 0.0,
        works: 0.0,
        gained: 0.0,
        balance: 0.0,
        exchanged: 0.0,
    };
    let (mut first, mut least) = (None, f64::INFINITY);
    for sample in simulation.samples() {
        let sample = sample.map_err(|failure| failure.message)?;
        for (k, limits) in &bounds {
            let at = sample.sensors[*k];
            let over = [limits.lower.map(|own| own - at), limits.upper.map(|own| at - own)];
            found.beyond = over.into_iter().flatten().fold(found.beyond, f64::max);
        }
        found.overlap = gaps.iter().fold(found.overlap, |most, k| most.max(-sample.sensors[*k]));
        let momentum = *first.get_or_insert(sample.momentum);
        let parts = [
            (sample.momentum.linear, momentum.linear, sizes[0]),
            (sample.momentum.angular, momentum.angular, sizes[1]),
        ];
        for (now, start, size) in parts.into_iter().filter(|(.., size)| *size > 0.0) {
            let change: Vec<f64> = now.iter().zip(&start).map(|(a, b)| a - b).collect();
            found.drift = found.drift.max(norm_inf(&change) / size);
        }
        found.residual = found.residual.max(sample.residuals.position);
        found.works = works.iter().map(|k| sample.energies[*k]).sum();
        least = least.min(found.works);
        found.gained = found.gained.max(found.works - least);
        found.balance = sample.energies.last().copied().unwrap_or_default();
        found.exchanged = found.exchanged.max(sample.hamiltonian.abs());
        found.q = sample.q;
    }
    Ok(found)
}

/// The findings of a model with contacts, rigid stops or dry friction.
pub(super) fn findings(model: &Model, method: SteppingMethod) -> Vec<Finding> {
    let finding = |criterion, quantity: &str, expected| {
        let quantity = match model.rigid_contacts().next().is_none() {
            true => format!("{quantity}, with stops and friction"),
            false => format!("{quantity}, with contact"),
        };
        halved::finding(model, method, criterion, [&quantity, expected])
    };
    let joints = model.joints.iter().filter(|joint| joint.is_nonsmooth());
    let names = joints.map(|joint| &joint.name).chain(model.rigid_contacts().map(|own| &own.name));
    let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
    let reason = format!("impulses of {} act at nodes", names.join(", "));
    let smooth = |criterion, quantity| Finding {
        reason: reason.clone(),
        ..finding(criterion, quantity, "of smooth motions alone")
    };
    let mut all = vec![
        smooth(Criterion::Output, "residual of the equations of motion"),
        smooth(Criterion::Reversal, "reversal"),
        smooth(Criterion::Symplecticity, "symplectic form"),
    ];
    let of_order = finding(Criterion::Order, "q", "order 2");
    let runs = match halved(model, 3, |model, _| run(model)) {
        Ok(runs) => runs,
        Err(reason) => {
            all.push(Finding { verdict: Verdict::Inconclusive, reason, ..of_order });
            return all;
        }
    };
    let of_momentum = finding(Criterion::Momentum, "linear and angular momentum", "round-off");
    all.push(match held(model) {
        Some(reason) => Finding { reason: reason.to_owned(), ..of_momentum },
        None => {
            let drift = runs[0].drift;
            bounded(of_momentum, drift, ROUND_OFF, format!("{drift:.1e}"))
        }
    });
    let unclear =
        "impacts at nodes (`stepping`), a stop that is grazed, or a step that is too long";
    let q = [0, 1, 2].map(|k: usize| &runs[k].q[..]);
    all.push(judged_order(of_order, 2, q, unclear));
    let (coarse, fine) = (&runs[0], &runs[1]);
    let small = |criterion, quantity, expected, value: f64, bound| {
        bounded(finding(criterion, quantity, expected), value, bound, format!("{value:.1e}"))
    };
    let size = RESIDUAL * norm_inf(&coarse.q).max(1.0);
    let residual = |quantity, value| small(Criterion::Residual, quantity, "round-off", value, size);
    all.push(residual("constraints", coarse.residual));
    if model.joints.iter().any(|joint| joint.stops().is_some()) {
        all.push(residual("excess over limits", coarse.beyond));
    }
    if model.rigid_contacts().next().is_some() {
        all.push(residual("overlap of shapes", coarse.overlap));
    }
    let rounding = ROUND_OFF * coarse.exchanged;
    let words = "never rises, or falls with the step";
    let works = match model.rigid_contacts().next().is_none() {
        true => "work of stops and friction",
        false => "work of contacts, stops and friction",
    };
    let works = finding(Criterion::Energy, works, words);
    all.push(match coarse.works > rounding {
        true => bounded(works, coarse.works, rounding, format!("{:.1e}", coarse.works)),
        false => judged_balance(works, [coarse.gained, fine.gained], coarse.exchanged),
    });
    let balance = finding(Criterion::Energy, "balance with all works", "falls with the step");
    all.push(judged_balance(balance, [coarse.balance, fine.balance], coarse.exchanged));
    all
}
